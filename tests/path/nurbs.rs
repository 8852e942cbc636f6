//! NURBS curves and surfaces and polylines: identities on random cases, closed forms, second routes, and the errors.

use std::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, SVector, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::path::{
    Cursor, NurbsCurve, NurbsError, NurbsPath, NurbsSurface, Path, PathError, Polyline, nearest_in_window,
};

type Rng = Xoshiro256PlusPlus;

/// A knot vector for `count` control points: clamped or not, knots repeated here and there.
fn random_knots(rng: &mut Rng, degree: usize, count: usize) -> Vec<f64> {
    let clamped = rng.random_bool(0.7);
    let mut knots: Vec<f64> = Vec::new();
    let mut u = rng.random_range(-2.0..2.0);
    while knots.len() < count + degree + 1 {
        let inside = knots.len() > degree && knots.len() < count;
        let left = count + degree + 1 - knots.len();
        let times = if clamped && (knots.is_empty() || knots.len() >= count) {
            degree + 1
        } else if inside && rng.random_bool(0.2) {
            rng.random_range(1..=degree.max(2) - 1).min(count - knots.len())
        } else {
            1
        };
        knots.extend(std::iter::repeat_n(u, times.min(left)));
        u += rng.random_range(0.3..1.5);
    }
    knots
}

/// A random curve whose control points walk on, so that it has no cusp.
fn random_curve<const D: usize>(rng: &mut Rng, rational: bool) -> NurbsCurve<D> {
    let degree = rng.random_range(2..=5);
    let count = degree + 1 + rng.random_range(0..12);
    let mut point = SVector::<f64, D>::zeros();
    let points = (0..count)
        .map(|_| {
            point[0] += 3.0;
            point + SVector::from_fn(|_, _| rng.random_range(-1.0..1.0))
        })
        .collect();
    let weights = rational.then(|| (0..count).map(|_| rng.random_range(0.5..2.0)).collect());
    let knots = random_knots(rng, degree, count);
    NurbsCurve::new(degree, knots.clone(), points, weights)
        .unwrap_or_else(|e| panic!("{e}: degree {degree}: {knots:?}"))
}

fn inside(rng: &mut Rng, (low, high): (f64, f64)) -> f64 {
    rng.random_range(low..high)
}

#[test]
fn validates_partition_of_unity_and_affine_invariance() {
    let mut rng = Rng::seed_from_u64(1);
    for case in 0..2000 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        // All control points at one place: the basis functions add up to 1 there, their derivatives to 0.
        let one = curve.mapped(|_| Vector3::new(1.0, 1.0, 1.0)).unwrap();
        let map = Rotation3::from_euler_angles(0.3, 1.0, -2.0).matrix() * 1.7;
        let shift = Vector3::new(10.0, -20.0, 5.0);
        let image = curve.mapped(|p| map * p + shift).unwrap();
        for _ in 0..10 {
            let u = inside(&mut rng, curve.domain());
            let [sum, rate] = one.derivatives::<2>(u);
            assert!((sum - Vector3::repeat(1.0)).norm() < 1e-14 && rate.norm() < 1e-12, "{u}: {sum} {rate} {curve:?}");
            // Coordinates up to 60 mm, some ten operations.
            let off = (image.point_mm(u) - (map * curve.point_mm(u) + shift)).norm();
            assert!(off < 1e-12, "{u}: {off}: {curve:?}");
        }
    }
}

#[test]
fn validates_derivatives_against_differences_and_knot_inserted_copies() {
    let mut rng = Rng::seed_from_u64(2);
    for case in 0..1000 {
        let curve = random_curve::<2>(&mut rng, case % 2 == 0);
        let mut finer = curve.clone();
        for _ in 0..5 {
            let u = inside(&mut rng, curve.domain());
            finer = finer.with_knot(u, rng.random_range(1..=curve.degree())).unwrap();
        }
        assert!(finer.control_points_mm().len() > curve.control_points_mm().len());
        for _ in 0..10 {
            let u = inside(&mut rng, curve.domain());
            let [r, r1, r2, r3] = curve.derivatives::<4>(u);
            let other = finer.derivatives::<4>(u);
            // A derivative costs a division by a knot interval, 0.01 and more here, each time.
            for (k, (a, b)) in [r, r1, r2, r3].iter().zip(&other).enumerate() {
                let scale = [1.0, r1.norm(), r2.norm() + r1.norm(), r3.norm() + r2.norm() + r1.norm()][k].max(1.0);
                assert!((a - b).norm() < 1e-8 * scale, "order {k} at {u}: {a} {b}: {curve:?}");
            }
            assert!((r - other[0]).norm() < 1e-12);
            // Central differences, where no knot lies between: the error is h² r⁽ᵏ⁺²⁾/6 and rounding 1e-14/h.
            let h = 1e-5;
            if curve.knots().iter().all(|k| (k - u).abs() > h) {
                let [ahead, behind] = [u + h, u - h].map(|u| curve.derivatives::<3>(u));
                for (k, exact) in [r1, r2, r3].into_iter().enumerate() {
                    let difference = (ahead[k] - behind[k]) / (2.0 * h);
                    assert!(
                        (difference - exact).norm() < 1e-5 * (1.0 + exact.norm() + r3.norm()),
                        "order {k} at {u}: {curve:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn validates_bezier_pieces_and_reversal() {
    let mut rng = Rng::seed_from_u64(3);
    for case in 0..1000 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        let (low, high) = curve.domain();
        let mut end = low;
        for piece in curve.bezier_pieces() {
            assert_eq!(piece.from, end);
            end = piece.to;
            let p = curve.degree();
            let knots = [vec![piece.from; p + 1], vec![piece.to; p + 1]].concat();
            let alone = NurbsCurve::new(p, knots, piece.control_points_mm, piece.weights).unwrap();
            for i in 0..=8 {
                let u = piece.from + (piece.to - piece.from) * f64::from(i) / 8.0;
                assert!((alone.point_mm(u) - curve.point_mm(u)).norm() < 1e-12, "{u}: {curve:?}");
            }
        }
        assert_eq!(end, high);
        let u = inside(&mut rng, (low, high));
        let back = curve.reversed().point_mm(low + (high - u));
        assert!((back - curve.point_mm(u)).norm() < 1e-11);
    }
}

#[test]
fn validates_that_circles_and_arcs_are_exact() {
    let mut rng = Rng::seed_from_u64(4);
    let circle = NurbsCurve::circle(Vector2::zeros(), 1.0).unwrap();
    for i in 0..=1000 {
        let u = f64::from(i) / 1000.0;
        assert!((circle.point_mm(u).norm() - 1.0).abs() < 1e-14);
        assert!((circle.curvature_1_mm(u) - 1.0).abs() < 1e-13);
    }
    for _ in 0..500 {
        let radius = 10.0_f64.powf(rng.random_range(-2.0..3.0));
        let centre = Vector2::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)) * radius;
        let (start, sweep) = (rng.random_range(-7.0..7.0), rng.random_range(-TAU..TAU));
        let arc = NurbsCurve::arc(centre, radius, start, sweep).unwrap();
        let path = NurbsPath::new(arc).unwrap();
        assert!((path.length_mm() - radius * sweep.abs()).abs() < 1e-12 * radius, "{sweep}: {}", path.length_mm());
        // A rounding error of the control points beside the sagitta, about sweep²/8 of the radius.
        let rounding = 1e-11 + 1e-14 / (sweep * sweep);
        assert!(
            (path.max_curvature_1_mm() * radius - 1.0).abs() < rounding,
            "{sweep} {}",
            path.max_curvature_1_mm() * radius
        );
        let mut cursor = Cursor::default();
        for i in 0..=50 {
            let s = path.length_mm() * f64::from(i) / 50.0;
            let frame = path.frame(s, &mut cursor);
            let angle = start + sweep.signum() * s / radius;
            let out = Vector2::new(angle.cos(), angle.sin());
            // The point at an arc length is one at an angle: 1e-12 of the length, as stated.
            assert!((frame.point_mm - centre - out * radius).norm() < 1e-11 * radius, "{s} {sweep}");
            assert!((frame.curvature_1_mm + out / radius).norm() * radius < 100.0 * rounding);
            assert!(
                (frame.curvature_rate_1_mm2 + frame.tangent / (radius * radius)).norm() * radius * radius
                    < 1e4 * rounding / sweep.abs().min(1.0)
            );
        }
    }
}

#[test]
fn validates_jumps_and_rates_of_the_curvature() {
    let mut rng = Rng::seed_from_u64(41);
    for case in 0..200 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        let path = NurbsPath::new(curve.clone()).unwrap();
        // A knot r times repeated leaves p - r continuous derivatives: the curvature jumps where those are fewer than two.
        let (low, high) = curve.domain();
        let inner: Vec<f64> = curve.knots().iter().copied().filter(|&knot| knot > low && knot < high).collect();
        let mut wanted: Vec<f64> = inner.clone();
        wanted.retain(|knot| inner.iter().filter(|other| *other == knot).count() + 2 > curve.degree());
        wanted.dedup();
        let found = path.curvature_jumps_mm();
        assert_eq!(found.len(), wanted.len(), "{curve:?}");
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found - path.length_at_mm(*wanted)).abs() < 1e-9, "{found} {wanted}");
        }
        // Against dense places between two of them; not far above the largest.
        let mut cursor = Cursor::default();
        let (from, to) = (inside(&mut rng, (0.0, path.length_mm())), path.length_mm());
        let bound = path.curvature_rate_bound_1_mm2(from, to);
        let rates = (0..=4000).map(|i| {
            let s = from + (to - from) * f64::from(i) / 4000.0;
            path.frame(s, &mut cursor).curvature_rate_1_mm2.norm()
        });
        let largest = rates.fold(0.0, f64::max);
        assert!(largest <= bound * 1.001, "case {case}: {largest} {bound}");
    }
}

#[test]
fn validates_arc_length_of_a_parabola_and_of_random_curves() {
    // y = x²/2 from 0 to a: (a √(1+a²) + asinh a)/2.
    for a in [0.1, 1.0, 7.0, 100.0_f64] {
        let points = [[0.0, 0.0], [0.5 * a, 0.0], [a, 0.5 * a * a]].map(Vector2::from).to_vec();
        let path = NurbsPath::new(NurbsCurve::new(2, vec![0., 0., 0., 1., 1., 1.], points, None).unwrap()).unwrap();
        let exact = 0.5 * (a * a.hypot(1.0) + a.asinh());
        assert!((path.length_mm() - exact).abs() < 1e-12 * exact, "{a}: {} {exact}", path.length_mm());
        assert!((path.max_curvature_1_mm() - 1.0).abs() < 2e-10, "{}", path.max_curvature_1_mm());
        let s = path.length_at_mm(0.5);
        let half = 0.5 * a;
        assert!((s - 0.5 * (half * half.hypot(1.0) + half.asinh())).abs() < 1e-12 * exact);
        assert!((path.parameter(s, &mut Cursor::default()) - 0.5).abs() < 1e-11);
    }
    // A second route: Simpson's rule on the curve's own derivative, the pieces in 400 steps each.
    let mut rng = Rng::seed_from_u64(5);
    for case in 0..60 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        let path = NurbsPath::new(curve.clone()).unwrap();
        let mut length = 0.0;
        for piece in curve.bezier_pieces() {
            let h = (piece.to - piece.from) / 400.0;
            // The end of a piece belongs to the next one, whose derivative may differ: stay inside by a rounding error.
            let speed =
                |i: u32| curve.derivatives::<2>((piece.from + h * f64::from(i)).min(piece.to - 1e-14))[1].norm();
            let inner: f64 = (1..400).map(|i| if i % 2 == 0 { 2.0 } else { 4.0 } * speed(i)).sum();
            length += h / 3.0 * (speed(0) + speed(400) + inner);
        }
        assert!((path.length_mm() - length).abs() < 1e-7 * length, "{case}: {} {length}", path.length_mm());
    }
}

#[test]
fn validates_frames_and_curvature_bounds_on_random_paths() {
    let mut rng = Rng::seed_from_u64(6);
    for case in 0..80 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        let path = NurbsPath::new(curve.clone()).unwrap();
        let length = path.length_mm();
        let mut most = 0.0_f64;
        let mut cursor = Cursor::default();
        for _ in 0..60 {
            let s = rng.random_range(0.0..length);
            let frame = path.frame(s, &mut cursor);
            let u = path.parameter(s, &mut cursor);
            assert!((curve.point_mm(u) - frame.point_mm).norm() < 1e-11, "{case} {s}");
            assert!((path.length_at_mm(u) - s).abs() < 1e-10);
            let kappa = curve.curvature_1_mm(u);
            assert!((frame.curvature_1_mm.norm() - kappa).abs() < 1e-8 * (1.0 + kappa), "{case} {s} {kappa}");
            assert!(
                (frame.tangent.norm() - 1.0).abs() < 1e-14
                    && frame.tangent.dot(&frame.curvature_1_mm).abs() < 1e-9 * (1.0 + kappa)
            );
            let (from, to) = (s.max(0.5) - 0.5, (s + 0.5).min(length));
            assert!(path.curvature_bound_1_mm(from, to) >= kappa * (1.0 - 1e-12));
            most = most.max(kappa);
            // k' against a central difference of k, where no joint is between.
            let h = 1e-5;
            let [ahead, behind] = [s + h, s - h].map(|s| path.frame(s, &mut cursor));
            let joint = curve.knots().iter().any(|&k| (path.length_at_mm(k) - s).abs() < 2.0 * h);
            if !joint && s > h && s + h < length {
                let difference = (ahead.curvature_1_mm - behind.curvature_1_mm) / (2.0 * h);
                let rate = frame.curvature_rate_1_mm2;
                assert!(
                    (difference - rate).norm() < 1e-4 * (1.0 + rate.norm() * (1.0 + kappa * kappa)),
                    "{case} {s}: {difference} {rate}"
                );
            }
        }
        // Both ends of every piece included: the curvature may jump at a knot.
        for piece in curve.bezier_pieces() {
            let p = curve.degree();
            let knots = [vec![0.0; p + 1], vec![1.0; p + 1]].concat();
            let alone = NurbsCurve::new(p, knots, piece.control_points_mm, piece.weights).unwrap();
            most = (0..=400).map(|i| alone.curvature_1_mm(f64::from(i) / 400.0)).fold(most, f64::max);
        }
        let bound = path.max_curvature_1_mm();
        // Never below any sample, and near the best of 400 samples a piece.
        assert!(bound >= most * (1.0 - 1e-12) && bound <= most * 1.05 + 1e-9, "{case}: {bound} {most}");
    }
}

#[test]
fn validates_nearest_points_against_a_dense_search() {
    let mut rng = Rng::seed_from_u64(7);
    for case in 0..40 {
        let curve = random_curve::<3>(&mut rng, case % 2 == 0);
        let corners: Vec<_> = (0..8)
            .map(|i| Vector3::new(f64::from(i), rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0)))
            .collect();
        let square = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.]].map(|[x, y]| Vector3::new(x, y, 0.0)).to_vec();
        let paths: [Box<dyn Path<3>>; 3] = [
            Box::new(NurbsPath::new(curve).unwrap()),
            Box::new(Polyline::new(corners).unwrap()),
            Box::new(Polyline::new(square).unwrap()),
        ];
        for (kind, path) in paths.iter().enumerate() {
            let path = path.as_ref();
            let length = path.length_mm();
            for _ in 0..10 {
                let s = rng.random_range(0.0..length);
                let point =
                    path.point_mm(s, &mut Cursor::default()) + Vector3::from_fn(|_, _| rng.random_range(-1.5..1.5));
                let mut cursor = Cursor::default();
                let found = nearest_in_window(path, &point, 0.5 * length, length, &mut cursor);
                let mut dense = f64::INFINITY;
                let mut walk = Cursor::default();
                for i in 0..=1000 {
                    let place = path.point_mm(length * f64::from(i) / 1000.0, &mut walk);
                    dense = dense.min((place - point).norm());
                }
                // No sample is nearer; the nearest one is within half a step.
                assert!(found.distance_mm <= dense + 1e-9, "{case} {kind}: {} {dense}", found.distance_mm);
                assert!(found.distance_mm >= dense - length / 1000.0);
                let foot = path.nearest_local(&point, &mut Cursor::at(cursor.segment, cursor.xi));
                assert!(((foot.point_mm - point).norm() - found.distance_mm).abs() < 1e-9, "{case} {kind}");
            }
        }
    }
}

#[test]
fn validates_constant_feed_along_nurbs_paths() {
    let mut rng = Rng::seed_from_u64(8);
    let mut paths: Vec<NurbsPath<3>> =
        (0..20).map(|case| NurbsPath::new(random_curve(&mut rng, case % 2 == 0)).unwrap()).collect();
    let circle = NurbsCurve::circle(Vector2::new(3.0, 4.0), 20.0).unwrap();
    paths.push(NurbsPath::new(circle.mapped(|p| Vector3::new(p.x, p.y, 1.0)).unwrap()).unwrap());
    for (case, path) in paths.iter().enumerate() {
        let motion = Motion::plan(path.length_mm(), 50.0, Profile::Exponential { phase_s: 0.05, n_c: 8.12 }).unwrap();
        let period = 1e-4;
        let setpoints: Vec<_> = Interpolator::new(path, &motion, period).collect();
        let curve = path.curve();
        let mut cursor = Cursor::default();
        let mut cruising = 0;
        for pair in setpoints.windows(2) {
            if pair[0].accel_mm_s2 != 0.0 || pair[1].accel_mm_s2 != 0.0 {
                continue;
            }
            cruising += 1;
            // The arc between two setpoints by a second route: the curve's own speed, Simpson's rule over the parameter, which is
            // far better than 1e-6 on steps of 5 µm unless a knot lies between.
            let [from, to] = [0, 1].map(|i| path.parameter(pair[i].s_mm, &mut cursor));
            if curve.knots().iter().any(|k| (from..=to).contains(k)) {
                continue;
            }
            let speed = |u: f64| curve.derivatives::<2>(u)[1].norm();
            let arc = (to - from) / 6.0 * (speed(from) + 4.0 * speed(0.5 * (from + to)) + speed(to));
            assert!((arc / period / 50.0 - 1.0).abs() < 1e-6, "{case}: {}", arc / period);
            let chord = (pair[1].position_mm - pair[0].position_mm).norm();
            assert!(chord <= arc * (1.0 + 1e-9) && (chord / arc - 1.0).abs() < 1e-4, "{case}: {chord} {arc}");
        }
        assert!(cruising > 100 || path.length_mm() < 10.0, "{case}: {cruising}");
        let end = setpoints.last().unwrap().position_mm;
        assert!((end - curve.point_mm(curve.domain().1)).norm() < 1e-12);
    }
}

#[test]
fn corners_of_curves_and_polylines_are_found() {
    // Degree 2 with a double knot: a corner at (2, 2); the seam of the closed curve is one as well.
    let points = [[0., 0.], [0., 2.], [2., 2.], [4., 2.], [0., 0.]].map(Vector2::from).to_vec();
    let curve = NurbsCurve::new(2, vec![0., 0., 0., 1., 1., 2., 2., 2.], points, None).unwrap();
    let path = NurbsPath::new(curve).unwrap();
    assert!(path.is_closed());
    assert_eq!(path.corners_mm().len(), 1, "smooth at the double knot: {:?}", path.corners_mm());
    assert_eq!(path.corners_mm()[0], path.length_mm());
    assert_eq!(path.max_curvature_1_mm(), f64::INFINITY);
    assert!(path.curvature_bound_1_mm(0.0, 0.5 * path.length_mm()).is_finite());
    let square = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.]].map(Vector2::from).to_vec();
    let line = Polyline::new(square).unwrap();
    assert_eq!(line.corners_mm(), [4.0, 8.0, 12.0, 16.0]);
    assert_eq!(line.length_mm(), 16.0);
    assert_eq!(line.curvature_bound_1_mm(4.0, 7.9), 0.0);
    assert_eq!(line.curvature_bound_1_mm(3.0, 4.0), f64::INFINITY);
    let mut cursor = Cursor::default();
    for s in [0.0, 4.0, 8.0, 12.0, 16.0] {
        let at = line.point_mm(s, &mut cursor);
        assert!(line.points_mm().contains(&at), "exact at {s}: {at}");
    }
}

/// A sphere's octant as the exact rational surface of revolution.
fn sphere(radius: f64) -> NurbsSurface {
    let w = 0.5_f64.sqrt();
    let arc = [(1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)];
    let points: Vec<Vec<_>> = arc
        .iter()
        .map(|&(x, y, _)| arc.iter().map(|&(r, z, _)| Vector3::new(x * r, y * r, z) * radius).collect())
        .collect();
    let weights: Vec<Vec<_>> = arc.iter().map(|a| arc.iter().map(|b| a.2 * b.2).collect()).collect();
    let knots = vec![0., 0., 0., 1., 1., 1.];
    NurbsSurface::new([2, 2], [knots.clone(), knots], &points, Some(&weights)).unwrap()
}

#[test]
fn validates_a_sphere_and_a_saddle() {
    let radius = 7.0;
    let ball = sphere(radius);
    let mut rng = Rng::seed_from_u64(9);
    for _ in 0..500 {
        let (u, v) = (rng.random_range(0.0..1.0), rng.random_range(0.0..0.95));
        let q = ball.evaluate(u, v);
        assert!((q.point_mm.norm() - radius).abs() < 1e-13 * radius * 10.0);
        let normal = q.normal().unwrap();
        let outward = q.point_mm / radius;
        assert!((normal - outward).norm() < 1e-11);
        let k = q.principal_curvatures().unwrap();
        assert!((k.largest_1_mm * radius + 1.0).abs() < 1e-9 && (k.smallest_1_mm * radius + 1.0).abs() < 1e-9, "{k:?}");
        let direction = q.du * rng.random_range(-1.0..1.0) + q.dv;
        assert!((q.normal_curvature_1_mm(&direction).unwrap() * radius + 1.0).abs() < 1e-10);
        for (curve, at) in [(ball.curve_at_u(u).unwrap(), v), (ball.curve_at_v(v).unwrap(), u)] {
            assert!((curve.point_mm(at) - q.point_mm).norm() < 1e-13 * radius);
        }
    }
    assert!(ball.evaluate(0.5, 1.0).normal().is_none(), "the pole has no normal by its derivatives");
    // z = (x² - y²)/2 over [-1, 1]²: curvatures ±1 at the middle, along the axes. As a biquadratic Bezier patch.
    let x = [-1.0, 0.0, 1.0];
    let square = [0.5, -0.5, 0.5]; // Bernstein coefficients of x²/2 over [-1, 1]
    let points: Vec<Vec<_>> =
        (0..3).map(|i| (0..3).map(|j| Vector3::new(x[i], x[j], square[i] - square[j])).collect()).collect();
    let knots = vec![0., 0., 0., 1., 1., 1.];
    let saddle = NurbsSurface::new([2, 2], [knots.clone(), knots], &points, None).unwrap();
    let q = saddle.evaluate(0.5, 0.5);
    let k = q.principal_curvatures().unwrap();
    assert!((k.largest_1_mm - 1.0).abs() < 1e-14 && (k.smallest_1_mm + 1.0).abs() < 1e-14, "{k:?}");
    assert!((k.largest_direction.x.abs() - 1.0).abs() < 1e-14 && (k.smallest_direction.y.abs() - 1.0).abs() < 1e-14);
    for _ in 0..300 {
        let (u, v) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
        let q = saddle.evaluate(u, v);
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        assert!((q.point_mm - Vector3::new(x, y, 0.5 * (x * x - y * y))).norm() < 1e-14);
        // Gauss' curvature of a graph: (z_xx z_yy - z_xy²)/(1 + z_x² + z_y²)².
        let gauss = -1.0 / (1.0 + x * x + y * y).powi(2);
        let k = q.principal_curvatures().unwrap();
        assert!((k.largest_1_mm * k.smallest_1_mm - gauss).abs() < 1e-13);
        // Euler: κ_n = κ_1 cos² + κ_2 sin² of the angle to the first direction.
        let angle = rng.random_range(0.0..PI);
        let direction = k.largest_direction * angle.cos() + k.smallest_direction * angle.sin();
        let euler = k.largest_1_mm * angle.cos().powi(2) + k.smallest_1_mm * angle.sin().powi(2);
        assert!((q.normal_curvature_1_mm(&direction).unwrap() - euler).abs() < 1e-12);
        // Derivatives against central differences.
        let h = 1e-5;
        let ahead = saddle.evaluate(u + h, v);
        let behind = saddle.evaluate(u - h, v);
        if u > h && u < 1.0 - h {
            assert!(((ahead.dv - behind.dv) / (2.0 * h) - q.duv).norm() < 1e-8);
            assert!(((ahead.du - behind.du) / (2.0 * h) - q.duu).norm() < 1e-8);
        }
    }
}

#[test]
fn validates_rational_surface_derivatives_against_differences() {
    let ball = sphere(3.0);
    let h = 1e-5;
    for (u, v) in [(0.2, 0.3), (0.7, 0.6), (0.5, 0.1)] {
        let q = ball.evaluate(u, v);
        let [right, left, up, down] =
            [(h, 0.0), (-h, 0.0), (0.0, h), (0.0, -h)].map(|(a, b)| ball.evaluate(u + a, v + b));
        let near = |a: Vector3<f64>, b: Vector3<f64>, exact: Vector3<f64>| ((a - b) / (2.0 * h) - exact).norm() < 1e-7;
        assert!(near(right.point_mm, left.point_mm, q.du) && near(up.point_mm, down.point_mm, q.dv));
        assert!(near(right.du, left.du, q.duu) && near(up.dv, down.dv, q.dvv) && near(right.dv, left.dv, q.duv));
    }
}

#[test]
fn what_is_wrong_with_a_curve_is_said() {
    let points = || (0..4).map(|i| Vector2::new(f64::from(i), 0.5)).collect::<Vec<_>>();
    let good = vec![0., 0., 0., 0., 1., 1., 1., 1.];
    let with = |i: usize, value: f64| {
        let mut knots = good.clone();
        knots[i] = value;
        NurbsCurve::new(3, knots, points(), None).unwrap_err()
    };
    assert!(NurbsCurve::new(3, good.clone(), points(), None).is_ok());
    assert!(matches!(with(4, -1.0), NurbsError::DecreasingKnots { index: 4, .. }));
    assert!(matches!(with(2, f64::NAN), NurbsError::BadKnot { index: 2, .. }));
    assert!(matches!(with(7, f64::INFINITY), NurbsError::BadKnot { index: 7, .. }));
    assert!(matches!(NurbsCurve::new(0, good.clone(), points(), None), Err(NurbsError::BadDegree { .. })));
    assert!(matches!(NurbsCurve::new(10, good.clone(), points(), None), Err(NurbsError::BadDegree { .. })));
    assert!(matches!(NurbsCurve::new(4, good.clone(), points(), None), Err(NurbsError::TooFewControlPoints { .. })));
    assert!(matches!(
        NurbsCurve::new(2, good.clone(), points(), None),
        Err(NurbsError::WrongKnotCount { needed: 7, .. })
    ));
    assert!(matches!(NurbsCurve::new(3, vec![1.0; 8], points(), None), Err(NurbsError::EmptyDomain { .. })));
    let eight: Vec<_> = (0..8).map(|i| Vector2::new(f64::from(i), 0.0)).collect();
    let knots = vec![0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2.];
    assert!(matches!(
        NurbsCurve::new(3, knots, eight, None),
        Err(NurbsError::TooManyEqualKnots { value: 1.0, most: 3, .. })
    ));
    for (i, weight) in [0.0, -1.0, f64::NAN, f64::INFINITY].into_iter().enumerate() {
        let mut weights = vec![1.0; 4];
        weights[i] = weight;
        let error = NurbsCurve::new(3, good.clone(), points(), Some(weights)).unwrap_err();
        assert!(matches!(error, NurbsError::BadWeight { .. }), "{error}");
    }
    assert!(matches!(
        NurbsCurve::new(3, good.clone(), points(), Some(vec![1.0; 3])),
        Err(NurbsError::WrongWeightCount { .. })
    ));
    let mut bad = points();
    bad[2].y = f64::NAN;
    assert!(matches!(NurbsCurve::new(3, good.clone(), bad, None), Err(NurbsError::BadCoordinate { index: 2, .. })));
    let curve = NurbsCurve::new(3, good.clone(), points(), None).unwrap();
    for (u, times) in [(0.0, 1), (1.0, 1), (0.5, 4), (f64::NAN, 1), (0.5, usize::MAX)] {
        assert!(matches!(curve.with_knot(u, times), Err(NurbsError::BadInsertion { .. })));
    }
    for (radius, sweep) in [(0.0, 1.0), (-1.0, 1.0), (f64::NAN, 1.0), (1.0, 0.0), (1.0, 7.0), (1.0, f64::NAN)] {
        assert!(matches!(NurbsCurve::arc(Vector2::zeros(), radius, 0.0, sweep), Err(NurbsError::BadArc(_))));
    }
    // Curves that stand still.
    let still = NurbsCurve::new(3, good.clone(), vec![Vector2::new(1.0, 1.0); 4], None).unwrap();
    assert!(matches!(NurbsPath::new(still), Err(PathError::Cusp { .. })));
    let cusp = [[0., 0.], [1., 1.], [0., 1.], [1., 0.]].map(Vector2::from).to_vec();
    let error = NurbsPath::new(NurbsCurve::new(3, good, cusp, None).unwrap()).unwrap_err();
    assert!(matches!(error, PathError::Cusp { xi, .. } if (xi - 0.5).abs() < 1e-6), "{error}");
    assert!(matches!(Polyline::new(vec![Vector2::new(0.0, 0.0)]), Err(PathError::TooFewPoints { .. })));
    assert!(matches!(Polyline::new(vec![Vector2::new(0.0, 0.0); 2]), Err(PathError::CoincidentPoints { .. })));
    assert!(matches!(
        Polyline::new(vec![Vector2::new(0.0, 0.0), Vector2::new(f64::NAN, 0.0)]),
        Err(PathError::BadCoordinate { .. })
    ));
    // Wild questions have answers.
    let path = NurbsPath::new(curve).unwrap();
    for s in [f64::NAN, f64::NEG_INFINITY, f64::INFINITY, -1.0, 1e300] {
        let mut cursor = Cursor::at(usize::MAX, f64::NAN);
        assert!(path.frame(s, &mut cursor).point_mm.norm().is_finite());
        let _ = path.nearest_local(&Vector2::new(s, 0.0), &mut cursor);
        let _ = path.curvature_bound_1_mm(0.0, path.length_mm());
    }
}
