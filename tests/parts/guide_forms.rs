//! Guide contours: closed forms and bad input. Random regions are in `guide`.

use std::f64::consts::{PI, SQRT_2, TAU};

use rand::RngExt;
use servosim::path::NurbsCurve;
use servosim::toolpath::guide::{Contour, GuideError, Piece, Region};

use crate::common::regions::{Point, arc, between, count, line, near, p, polygon, random, rectangle, region, total};

#[test]
fn validates_a_square() {
    let square = region(&rectangle(0., 0., 20., 20.));
    for d in [1e-6, 0.001, 0.1, 1.0, 3.0, 9.0, 9.999, 9.9999999] {
        let areas = square.inset(d).unwrap();
        assert_eq!(areas.len(), 1, "{d}");
        near(total(&areas), (20.0 - 2.0 * d).powi(2), 1e-9);
        for point in areas[0].outer.points_mm(1.0) {
            let corner = point - p(10.0, 10.0);
            near(corner.x.abs(), 10.0 - d, 1e-12);
            near(corner.y.abs(), 10.0 - d, 1e-12);
        }
        let corners = areas[0].outer.corners(0.1);
        assert_eq!(corners.len(), 4);
        assert!(corners.iter().all(|corner| (corner.interior_angle_rad - PI / 2.0).abs() < 1e-9));
    }
    for d in [10.0, 10.0 + 1e-9, 12.0, 1e6] {
        assert!(square.inset(d).unwrap().is_empty(), "{d}");
    }
    let (depth, point) = square.depth_mm().unwrap();
    near(depth, 10.0, 1e-9);
    assert!((point - p(10.0, 10.0)).norm() < 1e-8);
    near(region(&rectangle(0., 0., 40., 20.)).depth_mm().unwrap().0, 10.0, 1e-9);
}

#[test]
fn validates_a_circle() {
    let circle = Region::new(Contour::circle(p(3.0, 4.0), 10.0).unwrap(), vec![]).unwrap();
    for d in [1e-6, 0.01, 1.0, 5.0, 9.9, 9.99999] {
        let areas = circle.inset(d).unwrap();
        near(total(&areas), PI * (10.0 - d).powi(2), 1e-10);
        let [Piece::Arc { start_mm, end_mm, centre_mm, counterclockwise: true }] = areas[0].outer.pieces()[..] else {
            panic!("{:?}", areas[0].outer.pieces())
        };
        assert_eq!((start_mm, centre_mm), (end_mm, p(3.0, 4.0)));
        near((start_mm - centre_mm).norm(), 10.0 - d, 1e-14);
        near(areas[0].outer.length_mm(), TAU * (10.0 - d), 1e-12);
    }
    assert!(circle.inset(10.0).unwrap().is_empty());
    near(circle.depth_mm().unwrap().0, 10.0, 1e-9);
}

#[test]
fn validates_a_stadium() {
    let [a, b, c, d] = [p(0., 0.), p(30., 0.), p(30., 8.), p(0., 8.)];
    let pieces = [line(a, b), arc(b, c, p(30., 4.), true), line(c, d), arc(d, a, p(0., 4.), true)];
    let stadium = Region::new(Contour::new(&pieces).unwrap(), vec![]).unwrap();
    for d in [0.1, 1.0, 3.9, 3.99999] {
        let r = 4.0 - d;
        let areas = stadium.inset(d).unwrap();
        near(total(&areas), 60.0 * r + PI * r * r, 1e-9);
        assert_eq!(areas[0].outer.pieces().len(), 4);
        assert!(areas[0].outer.corners(1e-6).is_empty());
    }
    assert!(stadium.inset(4.0).unwrap().is_empty());
    near(stadium.depth_mm().unwrap().0, 4.0, 1e-9);
}

#[test]
fn validates_a_square_with_a_round_island() {
    let island = Contour::circle(p(10., 10.), 4.0).unwrap();
    let region = Region::new(polygon(&rectangle(0., 0., 20., 20.)).unwrap(), vec![island]).unwrap();
    near(region.area_mm2(), 400.0 - 16.0 * PI, 1e-10);
    for d in [0.1, 1.0, 2.9, 2.999999] {
        let areas = region.inset(d).unwrap();
        assert_eq!((areas.len(), areas[0].islands.len()), (1, 1));
        near(total(&areas), (20.0 - 2.0 * d).powi(2) - PI * (4.0 + d).powi(2), 1e-9);
    }
    // At 3 mm the rings touch, and four corners are left.
    for d in [3.0, 3.0000001, 3.5] {
        let areas = region.inset(d).unwrap();
        assert_eq!(areas.len(), 4, "{d}");
        // A quarter of the square without the circle, by integration.
        let (half, r) = (10.0 - d, 4.0 + d);
        let rise = |x: f64| (half - (r * r - x * x).max(0.0).sqrt()).max(0.0);
        let from = (r * r - half * half).sqrt().min(half);
        let steps = 200_000;
        let sum: f64 = (0..steps).map(|k| rise(from + (half - from) * (f64::from(k) + 0.5) / f64::from(steps))).sum();
        near(areas[0].area_mm2(), sum * (half - from) / f64::from(steps), 1e-5);
    }
    // The circle that touches two sides and the island.
    near(region.depth_mm().unwrap().0, (10.0 * SQRT_2 - 4.0) / (1.0 + SQRT_2), 1e-9);
}

#[test]
fn validates_a_dumbbell_that_splits_at_its_neck() {
    let dumbbell = region(&[
        [0., 0.],
        [10., 0.],
        [10., 4.],
        [20., 4.],
        [20., 0.],
        [30., 0.],
        [30., 10.],
        [20., 10.],
        [20., 6.],
        [10., 6.],
        [10., 10.],
        [0., 10.],
    ]);
    assert_eq!(dumbbell.inset(0.999999).unwrap().len(), 1);
    for d in [1.0, 1.000001, 2.0, 4.9] {
        let areas = dumbbell.inset(d).unwrap();
        assert_eq!(areas.len(), 2, "{d}");
        let side = 10.0 - 2.0 * d;
        // The neck's corners leave a bite, two arcs wide.
        let full = areas.iter().all(|area| area.area_mm2() <= side * side + 1.0);
        assert!(full, "{d}: {areas:?}");
        near(areas[0].area_mm2(), areas[1].area_mm2(), 1e-9);
    }
    let (first, second) = (dumbbell.inset(0.5).unwrap(), dumbbell.inset(1.5).unwrap());
    near(total(&second), total(&first[0].inset(1.0).unwrap()), 1e-9);
}

#[test]
fn validates_a_reflex_corner() {
    let corner = region(&[[0., 0.], [20., 0.], [20., 10.], [10., 10.], [10., 20.], [0., 20.]]);
    for d in [0.5, 2.0, 4.0] {
        let areas = corner.inset(d).unwrap();
        let arcs: Vec<_> = areas[0].outer.pieces().into_iter().filter(|p| matches!(p, Piece::Arc { .. })).collect();
        assert_eq!(arcs.len(), 1);
        let Piece::Arc { start_mm, end_mm, centre_mm, counterclockwise: false } = arcs[0] else { panic!("{arcs:?}") };
        assert_eq!(centre_mm, p(10., 10.));
        near((start_mm - p(10., 10. - d)).norm(), 0.0, 1e-13);
        near((end_mm - p(10. - d, 10.)).norm(), 0.0, 1e-13);
        near(total(&areas), 300.0 - (80.0 * d - 4.0 * d * d - d * d) - PI * d * d / 4.0, 1e-9);
    }
}

#[test]
fn touching_at_the_exact_distance_is_no_trouble() {
    // A grid of square islands, 2 mm wide with gaps of 2 mm: at 1 mm everything touches at once.
    let mut islands = Vec::new();
    for i in 0..5 {
        for j in 0..5 {
            islands.push(polygon(&rectangle(2. + 4. * f64::from(i), 2. + 4. * f64::from(j), 2., 2.)).unwrap());
        }
    }
    let grid = Region::new(polygon(&rectangle(0., 0., 22., 22.)).unwrap(), islands).unwrap();
    let areas = grid.inset(0.5).unwrap();
    assert_eq!((areas.len(), areas[0].islands.len()), (1, 25));
    let walls = grid.inset(0.9999999).unwrap();
    assert_eq!(walls.len(), 1);
    let pockets = grid.inset(1.0).unwrap();
    assert_eq!(pockets.len(), 36, "the crossings of the gaps");
    near(grid.depth_mm().unwrap().0, SQRT_2, 1e-9);
    // Nested, in steps that meet the same distances.
    let mut inner = grid.inset(0.25).unwrap();
    for _ in 0..3 {
        inner = inner.iter().flat_map(|area| area.inset(0.25).unwrap()).collect();
    }
    near(total(&inner), total(&pockets), 1e-8);
}

#[test]
fn a_thousand_sided_circle_shrinks_to_nothing() {
    let points: Vec<Point> =
        (0..1000).map(|i| TAU * f64::from(i) / 1000.0).map(|a| p(10.0 * a.cos(), 10.0 * a.sin())).collect();
    let circle = Region::new(Contour::polygon(&points).unwrap(), vec![]).unwrap();
    let depth = 10.0 * (PI / 1000.0).cos();
    for left in [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
        let areas = circle.inset(depth - left).unwrap();
        assert_eq!(areas.len(), 1, "{left}");
        let exact = 1000.0 * left * left * (PI / 1000.0).tan();
        near(total(&areas), exact, 1e-9 * left.max(1e-3));
    }
    near(circle.depth_mm().unwrap().0, depth, 1e-9);
}

#[test]
fn a_circle_of_nurbs_is_a_circle_within_the_tolerance() {
    let curve = NurbsCurve::circle(p(1.0, 2.0), 5.0).unwrap();
    for tolerance in [1e-2, 1e-4, 1e-6] {
        let contour = Contour::with_tolerance(&[Piece::Curve(curve.clone())], tolerance).unwrap();
        let region = Region::new(contour, vec![]).unwrap();
        for d in [0.1, 2.0, 4.5] {
            let areas = region.inset(d).unwrap();
            for point in areas[0].outer.points_mm(1e-3) {
                near((point - p(1.0, 2.0)).norm(), 5.0 - d, 1.001 * tolerance);
            }
            assert!(areas[0].outer.corners(1e-3).is_empty());
        }
        near(region.depth_mm().unwrap().0, 5.0, tolerance);
    }
}

#[test]
fn rings_answer_along_their_length() {
    let square = region(&rectangle(0., 0., 10., 10.));
    let ring = &square.inset(1.0).unwrap()[0].outer;
    near(ring.length_mm(), 32.0, 1e-12);
    near((ring.point_at_mm(0.0) - ring.point_at_mm(32.0)).norm(), 0.0, 1e-12);
    near((ring.point_at_mm(-1.0) - ring.point_at_mm(31.0)).norm(), 0.0, 1e-12);
    for corner in ring.corners(0.1) {
        near((ring.point_at_mm(corner.along_mm) - corner.point_mm).norm(), 0.0, 1e-12);
    }
    assert!(ring.point_at_mm(f64::NAN).x.is_finite());
    assert!(ring.winds_around(p(5., 5.)) && !ring.winds_around(p(0.5, 5.)) && !ring.winds_around(p(f64::NAN, 0.)));
    assert_eq!(ring.points_mm(f64::NAN).len(), 4);
}

#[test]
fn bad_contours_say_where() {
    let gap = [line(p(0., 0.), p(10., 0.)), line(p(10., 0.5), p(10., 10.)), line(p(10., 10.), p(0., 0.))];
    let error = Contour::new(&gap).unwrap_err();
    let GuideError::Open { piece: 0, next: 1, gap_mm, end_x_mm, start_y_mm, .. } = error else { panic!("{error}") };
    assert_eq!((gap_mm, end_x_mm, start_y_mm), (0.5, 10.0, 0.5));
    assert!(matches!(
        Contour::new(&[line(p(0., 0.), p(10., 0.)), line(p(10., 0.), p(5., 5.))]),
        Err(GuideError::Open { piece: 1, next: 0, .. })
    ));
    let GuideError::SelfCrossing { x_mm, y_mm } = polygon(&[[0., 0.], [10., 10.], [10., 0.], [0., 10.]]).unwrap_err()
    else {
        panic!()
    };
    assert_eq!((x_mm, y_mm), (5.0, 5.0));
    // Touching itself in a corner; a spike without width; the same way there and back.
    for points in [
        &[[0., 0.], [10., 0.], [5., 5.], [10., 10.], [0., 10.], [5., 5.]][..],
        &[[0., 0.], [10., 0.], [15., 0.], [10., 0.], [10., 10.]],
        &[[0., 0.], [10., 0.], [5., 0.]],
        &[[0., 0.], [10., 0.], [10., 5.], [10., 0.], [20., 0.], [20., 20.]],
    ] {
        assert!(matches!(polygon(points), Err(GuideError::SelfCrossing { .. })), "{points:?}");
    }
    assert_eq!(polygon(&[]), Err(GuideError::TooFewPoints { points: 0 }));
    assert_eq!(
        polygon(&[[1., 1.], [1., 1.], [2., 2.], [2., 2.], [1., 1.]]),
        Err(GuideError::TooFewPoints { points: 2 })
    );
    assert!(matches!(Contour::new(&[]), Err(GuideError::TooFewPoints { .. })));
    for bad in [f64::NAN, f64::INFINITY, 1e7] {
        assert!(matches!(polygon(&[[0., 0.], [1., bad], [1., 1.]]), Err(GuideError::BadCoordinate { index: 1, .. })));
        assert!(Contour::circle(p(0., 0.), bad).is_err());
        assert!(Contour::circle(p(bad, 0.), 1.0).is_err());
    }
    for radius in [0.0, 1e-300] {
        assert!(matches!(Contour::circle(p(0., 0.), radius), Err(GuideError::BadArc { .. })), "{radius}");
    }
    assert!(matches!(
        Contour::new(&[arc(p(0., 0.), p(3., 0.), p(1., 0.), true), line(p(3., 0.), p(0., 0.))]),
        Err(GuideError::BadArc { index: 0, .. })
    ));
    assert!(matches!(Contour::with_tolerance(&gap, 0.0), Err(GuideError::BadTolerance { .. })));
    // Two arcs that cross between their ends.
    let (a, b) = (p(0., 0.), p(10., 0.));
    let lens = [arc(a, b, p(5., -3.), false), arc(b, a, p(5., -1.), true)];
    assert!(matches!(Contour::new(&lens), Ok(_) | Err(GuideError::SelfCrossing { .. })));
    let wave = NurbsCurve::new(
        3,
        vec![0., 0., 0., 0., 1., 1., 1., 1.],
        vec![p(0., 0.), p(20., 10.), p(-10., 10.), p(10., 0.)],
        None,
    );
    let loops = [Piece::Curve(wave.unwrap()), line(p(10., 0.), p(0., 0.))];
    assert!(matches!(Contour::new(&loops), Err(GuideError::SelfCrossing { .. })));
}

#[test]
fn bad_islands_say_which_and_where() {
    let square = || polygon(&rectangle(0., 0., 20., 20.)).unwrap();
    let small = |x: f64, y: f64| polygon(&rectangle(x, y, 4., 4.)).unwrap();
    let outside = Region::new(square(), vec![small(2., 2.), small(30., 2.)]).unwrap_err();
    assert!(matches!(outside, GuideError::IslandOutside { island: 1, .. }), "{outside}");
    let across = Region::new(square(), vec![small(18., 2.)]).unwrap_err();
    assert!(matches!(across, GuideError::IslandOutside { island: 0, x_mm: 20.0, .. }), "{across}");
    let touching = Region::new(square(), vec![small(16., 2.)]).unwrap_err();
    assert!(matches!(touching, GuideError::IslandOutside { island: 0, .. }), "{touching}");
    let overlapping = Region::new(square(), vec![small(2., 2.), small(10., 10.), small(12., 8.)]).unwrap_err();
    assert!(matches!(overlapping, GuideError::IslandsMeet { first: 1, second: 2, .. }), "{overlapping}");
    let inside = polygon(&rectangle(3., 3., 1., 1.)).unwrap();
    for islands in [vec![small(2., 2.), inside.clone()], vec![inside, small(2., 2.)]] {
        assert!(matches!(Region::new(square(), islands), Err(GuideError::IslandsMeet { .. })));
    }
    for distance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let region = Region::new(square(), vec![]).unwrap();
        assert!(matches!(region.inset(distance), Err(GuideError::BadDistance { .. })));
    }
}

#[test]
fn odd_but_good_regions() {
    // Repeated points, collinear runs, either direction.
    let dense =
        polygon(&[[0., 0.], [0., 0.], [5., 0.], [7., 0.], [10., 0.], [10., 10.], [0., 10.], [0., 5.], [0., 0.]])
            .unwrap();
    let areas = Region::new(dense, vec![]).unwrap().inset(2.0).unwrap();
    near(total(&areas), 36.0, 1e-10);
    let clockwise = region(&[[0., 0.], [0., 10.], [10., 10.], [10., 0.]]);
    near(total(&clockwise.inset(2.0).unwrap()), 36.0, 1e-10);
    // Needles, outwards and inwards.
    let needles = [
        [0., 0.],
        [5., 0.],
        [5.0005, -40.],
        [5.001, 0.],
        [10., 0.],
        [10., 10.],
        [5.001, 10.],
        [5.0005, 1.],
        [5., 10.],
        [0., 10.],
    ];
    let needles = region(&needles);
    assert_eq!(needles.inset(0.1).unwrap().len(), 1);
    for d in [0.00001, 0.0002, 0.001, 0.1, 0.4999, 0.5, 0.6, 1.0, 2.0] {
        for area in needles.inset(d).unwrap() {
            for point in area.outer.points_mm(0.01) {
                near(needles.distance_mm(point), d, 1e-9);
            }
        }
    }
    // Narrower than the step-over.
    assert!(region(&rectangle(0., 0., 100., 0.5)).inset(1.0).unwrap().is_empty());
    // Small, large, far away.
    for size in [1e-5, 1e-3, 1.0, 1e3, 9e5] {
        let square = region(&rectangle(0., 0., size, size));
        near(total(&square.inset(0.2 * size).unwrap()) / (size * size), 0.36, 1e-9);
        near(square.depth_mm().unwrap().0 / size, 0.5, 1e-9);
    }
    let far = region(&rectangle(9e5, -9e5, 10., 10.));
    near(total(&far.inset(2.0).unwrap()), 36.0, 1e-6);
    near(far.depth_mm().unwrap().0, 5.0, 1e-6);
}

#[test]
fn any_numbers_at_all_end_in_an_answer() {
    let mut random = random(6);
    let values = [0.0, 1.0, -1.0, 1e-9, 1e-300, 1e6, -1e6, 3.0, f64::NAN, f64::INFINITY];
    for _ in 0..3000 {
        let points: Vec<Point> = (0..count(&mut random, 0, 7))
            .map(|_| {
                let mut value = || {
                    if random.random::<f64>() < 0.9 {
                        f64::from(random.random_range(0..6))
                    } else {
                        values[random.random_range(0..10)]
                    }
                };
                p(value(), value())
            })
            .collect();
        let Ok(contour) = Contour::polygon(&points) else { continue };
        let Ok(region) = Region::new(contour, vec![]) else { continue };
        let d = 10.0_f64.powf(between(&mut random, -12.0, 3.0));
        for area in region.inset(d).unwrap_or_else(|error| panic!("{points:?}: {error}")) {
            for point in area.outer.points_mm(0.1) {
                assert!(
                    (region.distance_mm(point) - d).abs() < 1e-8 * points.iter().map(Point::amax).fold(1.0, f64::max),
                    "{points:?} {d}"
                );
            }
        }
    }
}
