//! The machining check: heights against brute force, scallops and gouges against closed forms.

// Small whole numbers.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::machining::{DeviationMap, HeightField, HeightFieldError, MapRegion};
use servosim::toolpath::stepover::{exact_mm, flat_mm};
use servosim::toolpath::{ContactLocation, Cutter, DesignSurface, SurfaceTop};

type Point = Vector3<f64>;

/// A surface z = f(x, y) with its gradient, over a square; cutters rest by a dense maximum.
struct Graph<F> {
    half_mm: f64,
    height: F,
}

impl<F: Fn(f64, f64) -> (f64, [f64; 2]) + Send + Sync> DesignSurface for Graph<F> {
    fn bounds_mm(&self) -> [Point; 2] {
        [Point::new(-self.half_mm, -self.half_mm, -100.0), Point::new(self.half_mm, self.half_mm, 100.0)]
    }

    fn top(&self, x: f64, y: f64) -> Option<SurfaceTop> {
        (x.abs().max(y.abs()) <= self.half_mm).then(|| {
            let (z_mm, [dx, dy]) = (self.height)(x, y);
            SurfaceTop { z_mm, normal: Point::new(-dx, -dy, 1.0).normalize() }
        })
    }

    fn rest(&self, cutter: &Cutter, x: f64, y: f64) -> Option<ContactLocation> {
        let mut best: Option<ContactLocation> = None;
        let steps = 60;
        for i in -steps..=steps {
            for j in -steps..=steps {
                let [dx, dy] = [i, j].map(|k| f64::from(k) / f64::from(steps) * cutter.radius_mm());
                let Some(rise) = cutter.profile_mm(dx.hypot(dy)) else { continue };
                let Some(top) = self.top(x + dx, y + dy) else { continue };
                if best.is_none_or(|best| top.z_mm - rise > best.tip_z_mm) {
                    let contact_mm = Point::new(x + dx, y + dy, top.z_mm);
                    best = Some(ContactLocation { tip_z_mm: top.z_mm - rise, contact_mm, normal: top.normal });
                }
            }
        }
        best
    }
}

fn plane(slope: f64) -> Graph<impl Fn(f64, f64) -> (f64, [f64; 2]) + Send + Sync> {
    Graph { half_mm: 20.0, height: move |_, y: f64| (slope * y, [0.0, slope]) }
}

/// The cap of a sphere around the origin.
fn sphere(radius: f64, half_mm: f64) -> Graph<impl Fn(f64, f64) -> (f64, [f64; 2]) + Send + Sync> {
    Graph {
        half_mm,
        height: move |x: f64, y: f64| {
            let z = (radius * radius - x * x - y * y).max(1e-3).sqrt();
            (z, [-x / z, -y / z])
        },
    }
}

/// The height that a straight piece leaves: the convex function of the way, minimised by halving thirds; no formula of ours.
fn brute(cutter: &Cutter, from: Point, to: Point, x: f64, y: f64) -> f64 {
    let height = |t: f64| {
        let tip = from + t * (to - from);
        cutter.profile_mm((tip.x - x).hypot(tip.y - y)).map_or(f64::INFINITY, |rise| tip.z + rise)
    };
    // The part of the piece within the radius, by its square equation.
    let (way, start) = (to.xy() - from.xy(), from.xy() - nalgebra::Vector2::new(x, y));
    let (a, b, c) = (way.norm_squared(), start.dot(&way), start.norm_squared() - cutter.radius_mm().powi(2));
    let (mut low, mut high) = if a > 0.0 {
        let root = b * b - a * c;
        if root < 0.0 {
            return f64::INFINITY;
        }
        (((-b - root.sqrt()) / a).max(0.0), ((-b + root.sqrt()) / a).min(1.0))
    } else {
        (0.0, 1.0)
    };
    if low > high {
        return f64::INFINITY;
    }
    // Off the very rim, where rounding decides.
    let shrink = 1e-12 * (high - low);
    (low, high) = (low + shrink, high - shrink);
    for _ in 0..90 {
        let third = (high - low) / 3.0;
        let (left, right) = (height(low + third), height(high - third));
        if left <= right {
            high -= third;
        }
        if left >= right {
            low += third;
        }
    }
    height(0.5 * (low + high)).min(height(low)).min(height(high))
}

fn cutters() -> [Cutter; 4] {
    [
        Cutter::ball(2.0).unwrap(),
        Cutter::flat(2.0).unwrap(),
        Cutter::bull_nose(2.0, 0.5).unwrap(),
        Cutter::bull_nose(2.0, 1.999).unwrap(),
    ]
}

/// A path of long, short, level, steep and upright pieces, turns of every angle, places held.
fn random_path(random: &mut Xoshiro256PlusPlus, pieces: usize) -> Vec<Point> {
    let mut at =
        Point::new(random.random_range(-4.0..4.0), random.random_range(-4.0..4.0), random.random_range(-1.0..3.0));
    let mut path = vec![at];
    let mut angle: f64 = random.random_range(0.0..TAU);
    for _ in 0..pieces {
        angle += match random.random_range(0..3) {
            0 => 0.0,
            1 => random.random_range(-0.1..0.1),
            _ => random.random_range(-3.2..3.2),
        };
        let length = [0.0, 1e-13, 1e-6, 0.05, 0.3, 4.0][random.random_range(0..6)];
        let rise = length * [0.0, 0.0, 0.01, -0.3, 1.0, -20.0, 1e5][random.random_range(0..7)];
        let lift = if random.random_range(0..8) == 0 { random.random_range(-0.5..0.5) } else { 0.0 };
        let turn = Point::new(angle.cos() * length, angle.sin() * length, rise.clamp(-1.0, 1.0) + lift);
        at = (at + turn).map(|c| c.clamp(-6.0, 6.0));
        path.push(at);
    }
    path
}

#[test]
fn validates_swept_cutters_against_brute_force_on_random_paths() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(41);
    for round in 0..32 {
        let cutter = cutters()[round % 4];
        let path = random_path(&mut random, 12);
        let mut field = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.4).unwrap();
        field.cut_along(&cutter, &path).unwrap();
        let [columns, rows] = field.size();
        let mut cut = 0;
        for row in 0..rows {
            for column in 0..columns {
                let [x, y] = field.centre_mm(column, row);
                let wanted = path.windows(2).map(|p| brute(&cutter, p[0], p[1], x, y)).fold(f64::INFINITY, f64::min);
                let height = field.height_mm(x, y).unwrap();
                cut += usize::from(height.is_finite());
                // On the rim of a cutter a cell is cut or not; elsewhere 1e-7 mm: the steepest pieces here are 1e5 : 1.
                let near = path.windows(2).any(|p| {
                    let (from, way) = (nalgebra::Vector2::new(x, y) - p[0].xy(), p[1].xy() - p[0].xy());
                    let along = if way.norm() > 0.0 { from.dot(&way) / way.norm_squared() } else { 0.0 };
                    ((from - along.clamp(0.0, 1.0) * way).norm() - 2.0).abs() < 1e-6
                });
                assert!(
                    (height - wanted).abs() < 1e-7 || height == wanted || near,
                    "round {round}, {cutter:?}, ({x}, {y}): {height} instead of {wanted}\n{path:?}"
                );
            }
        }
        assert!(cut > 50, "{cut}");
    }
}

#[test]
fn validates_a_ball_against_the_plain_envelope_of_dense_samples() {
    // Nothing but balls at many places: never below the sweep, and nearly touching it.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let ball = Cutter::ball(2.0).unwrap();
    for _ in 0..6 {
        let path: Vec<Point> = (0..8)
            .map(|_| {
                Point::new(
                    random.random_range(-4.0..4.0),
                    random.random_range(-4.0..4.0),
                    random.random_range(0.0..2.0),
                )
            })
            .collect();
        let mut field = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.5).unwrap();
        field.cut_along(&ball, &path).unwrap();
        for row in 0..20 {
            for column in 0..20 {
                let [x, y] = field.centre_mm(column, row);
                let height = field.height_mm(x, y).unwrap();
                let mut least = f64::INFINITY;
                for pair in path.windows(2) {
                    for i in 0..=1000 {
                        let tip = pair[0] + f64::from(i) / 1000.0 * (pair[1] - pair[0]);
                        if let Some(rise) = ball.profile_mm((tip.x - x).hypot(tip.y - y)) {
                            least = least.min(tip.z + rise);
                        }
                    }
                }
                assert!(height <= least + 1e-12, "{height} above {least}");
                // Samples 0.01 mm apart: on the upright rim of the ball they fall short most.
                assert!(height > least - 0.15 || least == f64::INFINITY, "{height} far below {least}");
            }
        }
    }
}

/// A path that winds over the field in many short pieces.
fn winding(pieces: usize) -> Vec<Point> {
    (0..=pieces)
        .map(|i| 40.0 * i as f64 / pieces as f64)
        .map(|t| Point::new(3.5 * (1.3 * t).sin(), 3.5 * (0.7 * t).cos(), 0.5 * (3.0 * t).sin()))
        .collect()
}

#[test]
fn neither_cores_nor_batches_change_a_bit() {
    let path = winding(40_000);
    let ball = Cutter::ball(2.0).unwrap();
    let cut = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut field = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.1).unwrap();
            field.cut_along(&ball, &path).unwrap();
            field.heights_mm().to_vec()
        })
    };
    let one = cut(1);
    assert!(one == cut(3));
    // Cells in the order of the pieces, each piece a chain of its own: the same but for rounding.
    let mut field = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.1).unwrap();
    for pair in path.windows(2).take(1000) {
        field.cut(&ball, pair[0], pair[1]).unwrap();
        field.heights_mm();
    }
    let mut other = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.1).unwrap();
    other.cut_along(&ball, &path[..=1000]).unwrap();
    for (a, b) in field.heights_mm().iter().zip(other.heights_mm()) {
        assert!(a == b || (a - b).abs() < 1e-12, "{a} {b}");
    }
}

/// Passes along x at these y, the ball resting on the plane z = slope y.
fn passes(slope: f64, ball: &Cutter, at: impl Iterator<Item = f64>) -> Vec<[Point; 2]> {
    let r = ball.radius_mm();
    let lift = r * (1.0 + slope * slope).sqrt() - r;
    at.map(|y| [-12.0, 12.0].map(|x| Point::new(x, y, slope * y + lift))).collect()
}

#[test]
fn validates_the_scallop_of_parallel_passes_on_level_and_inclined_planes() {
    let ball = Cutter::ball(5.0).unwrap();
    for slope in [0.0_f64, 0.3, 1.0] {
        for h in [0.01, 0.1] {
            // Measured along the surface the passes are w apart.
            let w = flat_mm(5.0, h).unwrap();
            let step = w / (1.0 + slope * slope).sqrt();
            let mut field = HeightField::new([-3.0, -4.0], [3.0, 4.0], 0.02).unwrap();
            for [from, to] in passes(slope, &ball, (-32..=32).map(|k| f64::from(k) * step)) {
                field.cut(&ball, from, to).unwrap();
            }
            let metrics = DeviationMap::of(&mut field, &plane(slope), None).metrics(-0.01..=1e3 * h + 0.01);
            let largest = metrics.largest_excess_um();
            // A cell's centre is at most half a cell from the ridge; there the flank of the scallop falls by w/2r a millimetre.
            let missed = 1e3 * 0.01 * (1.0 + slope * slope).sqrt() * 0.5 * w / 5.0 * 1.1;
            assert!(largest <= 1e3 * h + 1e-3 && largest > 1e3 * h - missed, "slope {slope}: {largest} of {h}");
            assert!(metrics.deepest_gouge_um() < 1e-3, "{metrics:?}");
            assert_eq!((metrics.uncut, metrics.within_share), (0, 1.0));
            // Mean of a parabola's arch: a third of its height; rms 1/√5.
            assert!((metrics.mean_um / (1e3 * h / 3.0) - 1.0).abs() < 0.1, "{metrics:?}");
            assert!((metrics.rms_um / (1e3 * h / 5.0_f64.sqrt()) - 1.0).abs() < 0.1, "{metrics:?}");
            // The ball touches beside its axis, and the ridge stands square on the plane.
            let sine = slope / (1.0 + slope * slope).sqrt();
            let place = (metrics.largest.unwrap().at_mm[1] - (5.0 - h) * sine) / step - 0.5;
            assert!((place - place.round()).abs() * step <= 0.011, "{metrics:?}");
        }
    }
}

#[test]
fn validates_the_scallop_of_rings_on_a_sphere() {
    let (radius, r, h) = (30.0, 5.0, 0.05);
    let ball = Cutter::ball(r).unwrap();
    // Contact points w apart: the rings are an even angle apart, seen from the sphere's centre.
    let w = exact_mm(r, h, radius).unwrap();
    let angle = 2.0 * (0.5 * w / radius).asin();
    let mut field = HeightField::new([-12.0, -12.0], [12.0, 12.0], 0.05).unwrap();
    for ring in 0..=20 {
        let (out, up) =
            ((radius + r) * (f64::from(ring) * angle).sin(), (radius + r) * (f64::from(ring) * angle).cos());
        // Chords 1e-7 mm off the circle cost nothing here, and cut no deeper than that.
        let corners = 1 + (60.0 * out) as usize;
        let path: Vec<Point> = (0..=corners)
            .map(|i| TAU * i as f64 / corners as f64)
            .map(|a| Point::new(out * a.cos(), out * a.sin(), up - r))
            .collect();
        field.cut(&ball, path[0], path[0]).unwrap();
        field.cut_along(&ball, &path).unwrap();
    }
    let map = DeviationMap::of(&mut field, &sphere(radius, 13.0), None);
    let metrics = map.metrics(-1.0..=51.0);
    assert!((metrics.largest_excess_um() - 1e3 * h).abs() < 0.5, "{metrics:?}");
    assert!(metrics.deepest_gouge_um() < 0.05, "{metrics:?}");
    // The exact distance to a sphere, cell by cell.
    let [columns, _] = map.size();
    let heights = field.heights_mm().to_vec();
    for (at, (value, height)) in map.values_um().iter().zip(&heights).enumerate() {
        let [x, y] = field.centre_mm(at % columns, at / columns);
        let exact = 1e3 * (Point::new(x, y, *height).norm() - radius);
        assert!((f64::from(*value) - exact).abs() < 0.01, "({x}, {y}): {value} instead of {exact}");
    }
}

#[test]
fn validates_the_distance_to_a_steep_curved_surface() {
    // A block cut level through a sphere of radius 10 and the plane above it: heights 0.25 mm off, up to 60 degrees steep.
    let radius = 10.0;
    let surface = sphere(radius, 9.0);
    for off in [0.25, -0.25, 0.01] {
        for share in [0.0, 0.3, 0.6, 0.85] {
            // A point at distance `off` over the place at this share of the radius; a flat cutter cuts the cell there to it.
            let place = Point::new(share, 0.0, (1.0_f64 - share * share).sqrt()) * (radius + off);
            let mut field = HeightField::new([place.x - 0.005, -0.005], [place.x + 0.005, 0.005], 0.01).unwrap();
            let tip = Point::new(place.x, 0.0, place.z);
            field.cut(&Cutter::flat(1.0).unwrap(), tip, tip).unwrap();
            let metrics = DeviationMap::of(&mut field, &surface, None).metrics(0.0..=1.0);
            let found = metrics.largest.unwrap().value_um;
            assert!((found - 1e3 * off).abs() < 0.02, "{off} at {share}: {found}");
        }
    }
}

#[test]
fn a_gouge_is_found_where_it_is() {
    let ball = Cutter::ball(5.0).unwrap();
    let mut field = HeightField::new([-10.0, -10.0], [10.0, 10.0], 0.1).unwrap();
    for [from, to] in passes(0.0, &ball, (-40..=40).map(|k| f64::from(k) * 0.5)) {
        field.cut(&ball, from, to).unwrap();
    }
    let nominal = DeviationMap::of(&mut field, &plane(0.0), None);
    // A dip of 37 µm in one pass.
    let dip = Point::new(3.15, -4.55, -0.037);
    let mut gouged = field.clone();
    gouged.cut_along(&ball, &[Point::new(2.0, -4.55, 0.0), dip, Point::new(4.0, -4.55, 0.0)]).unwrap();
    let map = DeviationMap::of(&mut gouged, &plane(0.0), None);
    let metrics = map.metrics(-10.0..=10.0);
    let gouge = metrics.least.unwrap();
    assert!((gouge.value_um + 37.0).abs() < 1e-4, "{gouge:?}");
    assert!((gouge.at_mm[0] - 3.15).abs() < 1e-9 && (gouge.at_mm[1] + 4.55).abs() < 1e-9, "{gouge:?}");
    assert!(metrics.within_share < 1.0 && metrics.within_share > 0.9, "{metrics:?}");
    // What the dip changed, and nothing else.
    let worst = map.minus(&nominal).unwrap().metrics(0.0..=0.0).worst().unwrap();
    // On the ridge 0.2 mm beside it: 33 µm deep where there was a scallop of 6.25 µm.
    assert!((worst.at_mm[1] + 4.75).abs() < 1e-9 && (worst.value_um + 39.25).abs() < 0.01, "{worst:?}");
    // Within a region beside it, it is not there; the margin keeps the border out.
    let square = |low: f64, high: f64| vec![[low, low], [high, low], [high, high], [low, high]];
    let beside = MapRegion { polygons_mm: vec![square(-2.0, 9.0)], margin_mm: 1.0, cutter: None };
    let region = DeviationMap::of(&mut gouged, &plane(0.0), Some(&beside));
    let metrics = region.metrics(0.0..=7.0);
    assert_eq!((metrics.cells, metrics.uncut), (90 * 90, 0), "9 mm square of 0.1 mm cells");
    assert!(metrics.deepest_gouge_um() < 1e-9);
    let island = MapRegion { polygons_mm: vec![square(-9.0, 9.0), square(-6.0, 5.0)], margin_mm: 0.0, cutter: None };
    assert_eq!(
        DeviationMap::of(&mut gouged, &plane(0.0), Some(&island)).metrics(0.0..=0.0).cells,
        180 * 180 - 110 * 110
    );
}

#[test]
fn uncut_cells_and_cells_beside_the_surface_are_told_apart() {
    let ball = Cutter::ball(2.0).unwrap();
    let small = Graph { half_mm: 4.0, height: |_, _| (0.0, [0.0, 0.0]) };
    let mut field = HeightField::new([-5.0, -5.0], [5.0, 5.0], 0.5).unwrap();
    field.cut(&ball, Point::new(-9.0, 0.0, 0.0), Point::new(9.0, 0.0, 0.0)).unwrap();
    let map = DeviationMap::of(&mut field, &small, None);
    let metrics = map.metrics(0.0..=1e9);
    // 16 × 16 cells of the surface, 8 rows of them within 2 mm of the pass.
    assert_eq!((metrics.cells, metrics.uncut), (16 * 8, 16 * 8));
    assert_eq!(metrics.within_share, 0.5);
    assert_eq!(map.values_um().iter().filter(|value| value.is_nan()).count(), 400 - 256);
    let nothing = DeviationMap::of(&mut HeightField::new([0.0; 2], [1.0; 2], 0.1).unwrap(), &small, None);
    let metrics = nothing.metrics(0.0..=1.0);
    assert_eq!((metrics.cells, metrics.uncut, metrics.largest, metrics.worst()), (0, 100, None, None));
    assert!(nothing.percentiles_um(&[0.5]).is_empty() && nothing.minus(&map).is_none());
}

#[test]
fn percentiles_are_exact() {
    // A flat cutter leaves each cell at a height of its own.
    let mut field = HeightField::new([0.0, 0.0], [10.0, 1.0], 1.0).unwrap();
    for (place, height) in [4, 9, 0, 7, 2, 5, 1, 8, 3, 6].into_iter().enumerate() {
        let tip = Point::new(place as f64 + 0.5, 0.5, 1e-3 * f64::from(height));
        field.cut(&Cutter::flat(0.4).unwrap(), tip, tip).unwrap();
    }
    let map = DeviationMap::of(&mut field, &plane(0.0), None);
    let found = map.percentiles_um(&[0.0, 0.1, 0.11, 0.5, 0.95, 1.0, f64::NAN, 9.0]);
    let rounded: Vec<f64> = found.iter().map(|value| value.round()).collect();
    assert_eq!(rounded, [0.0, 0.0, 1.0, 4.0, 9.0, 9.0, 0.0, 9.0]);
}

#[test]
fn impossible_input_is_refused() {
    let make = |low, high, cell| HeightField::new(low, high, cell).unwrap_err();
    for (low, high) in [
        ([0.0, 0.0], [0.0, 1.0]),
        ([0.0, f64::NAN], [1.0, 1.0]),
        ([0.0, 0.0], [f64::INFINITY, 1.0]),
        ([2.0; 2], [1.0; 2]),
    ] {
        assert!(matches!(make(low, high, 0.1), HeightFieldError::BadRectangle { .. }));
    }
    for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(make([0.0; 2], [1.0; 2], cell), HeightFieldError::BadCell { .. }));
    }
    for cell in [1e-4, 1e-300] {
        let error = make([0.0; 2], [80.0, 80.0], cell);
        assert!(error.to_string().contains("take cells of 0.02 mm"), "{error}");
    }
    assert!(HeightField::new([0.0; 2], [80.0, 80.0], 0.02).is_ok());
    let mut field = HeightField::new([0.0; 2], [1.0; 2], 0.1).unwrap();
    let ball = Cutter::ball(5.0).unwrap();
    for bad in [f64::NAN, f64::INFINITY, 1e7] {
        let error = field.cut(&ball, Point::zeros(), Point::new(0.0, bad, 0.0)).unwrap_err();
        assert!(error.to_string().contains("mm"), "{error}");
    }
    // Far away, and with the largest cutter: no cell, or all of them.
    field.cut(&ball, Point::new(1e6, 1e6, 0.0), Point::new(-1e6, 1e6, 0.0)).unwrap();
    assert_eq!(field.height_mm(0.5, 0.5), Some(f64::INFINITY));
    field.cut(&Cutter::ball(1e6).unwrap(), Point::new(0.0, 0.0, 1.0), Point::new(1.0, 1.0, 1.0)).unwrap();
    assert!(field.heights_mm().iter().all(|height| (1.0..1.001).contains(height)));
    assert_eq!(
        (field.height_mm(-0.1, 0.5), field.height_mm(f64::NAN, 0.5), field.height_mm(0.5, 1.05)),
        (None, None, None)
    );
}

#[test]
fn the_surfaces_of_these_tests_are_sound() {
    // The dense rest against the closed form of a ball on a plane.
    let rest = plane(0.5).rest(&Cutter::ball(2.0).unwrap(), 1.0, 1.0).unwrap();
    assert!((rest.tip_z_mm - (0.5 + 2.0 * 1.25_f64.sqrt() - 2.0)).abs() < 1e-3, "{rest:?}");
}
