//! Guide contours: properties over many random regions. Closed forms and bad input are in `guide_forms`.
//!
//! Distances and insides are measured by brute force on the pieces as given, by code of the test's own.

use std::f64::consts::TAU;

use rand::RngExt;
use servosim::path::NurbsCurve;
use servosim::toolpath::guide::{Area, Contour, GuideError, Piece, Region, Ring};

use crate::common::regions::{Point, Random, arc, between, count, line, near, p, random, total};

/// An outer contour and islands as pieces, and how near a result must be to what they say.
struct Outline {
    rings: Vec<Vec<Piece>>,
    tolerance: f64,
}

fn angle(sense: bool, from: Point, to: Point) -> f64 {
    let angle = to.y.atan2(to.x) - from.y.atan2(from.x);
    let angle = if sense { angle } else { -angle };
    if (to - from).norm() < 1e-12 { TAU } else { angle.rem_euclid(TAU) }
}

impl Outline {
    fn of_polygons(polygons: &[Vec<Point>]) -> Self {
        let pieces =
            |points: &Vec<Point>| (0..points.len()).map(|i| line(points[i], points[(i + 1) % points.len()])).collect();
        Self { rings: polygons.iter().map(pieces).collect(), tolerance: 1e-9 }
    }

    fn region(&self) -> Result<Region, GuideError> {
        let islands: Result<Vec<_>, _> = self.rings[1..].iter().map(|pieces| Contour::new(pieces)).collect();
        Region::new(Contour::new(&self.rings[0])?, islands?)
    }

    fn distance(&self, q: Point) -> f64 {
        let one = |piece: &Piece| match piece {
            Piece::Line { start_mm: a, end_mm: b } => {
                let t = ((q - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (a + (b - a) * t - q).norm()
            }
            Piece::Arc { start_mm: a, end_mm: b, centre_mm: c, counterclockwise } => {
                let on = angle(*counterclockwise, a - c, q - c) <= angle(*counterclockwise, a - c, b - c);
                let round = if on { ((q - c).norm() - (a - c).norm()).abs() } else { f64::INFINITY };
                round.min((q - a).norm()).min((q - b).norm())
            }
            Piece::Curve(curve) => curve_distance(curve, q),
        };
        self.rings.iter().flatten().map(one).fold(f64::INFINITY, f64::min)
    }

    /// By the even-odd rule on a fine polygon; to be trusted away from the boundary only.
    fn contains(&self, q: Point) -> bool {
        let mut inside = false;
        for ring in &self.rings {
            let points: Vec<Point> = ring.iter().flat_map(sampled).collect();
            for i in 0..points.len() {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                if (a.y > q.y) != (b.y > q.y) && q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y) {
                    inside = !inside;
                }
            }
        }
        inside
    }
}

/// Points of a piece, the last one left out.
fn sampled(piece: &Piece) -> Vec<Point> {
    match piece {
        Piece::Line { start_mm, .. } => vec![*start_mm],
        Piece::Arc { start_mm: a, end_mm: b, centre_mm: c, counterclockwise } => {
            let whole = angle(*counterclockwise, a - c, b - c) * if *counterclockwise { 1.0 } else { -1.0 };
            let at = |k: i32| {
                let (sine, cosine) = (whole * f64::from(k) / 400.0).sin_cos();
                let w = a - c;
                c + p(cosine * w.x - sine * w.y, sine * w.x + cosine * w.y)
            };
            (0..400).map(at).collect()
        }
        Piece::Curve(curve) => {
            let (low, high) = curve.domain();
            (0..2000).map(|k| curve.point_mm(low + (high - low) * f64::from(k) / 2000.0)).collect()
        }
    }
}

fn curve_distance(curve: &NurbsCurve<2>, q: Point) -> f64 {
    let (low, high) = curve.domain();
    let at = |u: f64| (curve.point_mm(u) - q).norm();
    let count = 300_usize;
    let step = (high - low) / count as f64;
    let coarse: Vec<f64> = (0..=count).map(|k| at(low + step * k as f64)).collect();
    let least = coarse.iter().copied().fold(f64::INFINITY, f64::min);
    let mut best = least;
    for k in 0..=count {
        let reach = if k > 0 { (coarse[k] - coarse[k - 1]).abs() } else { f64::INFINITY };
        if coarse[k] > least + reach.max(0.05) {
            continue;
        }
        // Golden section around every sample that could hide the nearest point.
        let (mut a, mut b) = ((low + step * (k as f64 - 1.0)).max(low), (low + step * (k as f64 + 1.0)).min(high));
        for _ in 0..40 {
            let (x, y) = (b - 0.618_034 * (b - a), a + 0.618_034 * (b - a));
            if at(x) < at(y) { b = y } else { a = x }
        }
        best = best.min(at(0.5 * (a + b)));
    }
    best
}

fn ends(piece: &Piece) -> (Point, Point) {
    match piece {
        Piece::Line { start_mm, end_mm } | Piece::Arc { start_mm, end_mm, .. } => (*start_mm, *end_mm),
        Piece::Curve(_) => panic!("rings have no curves"),
    }
}

/// The last piece ends where the first one starts, to the last bit.
fn check_closed(ring: &Ring, case: &str) {
    let pieces = ring.pieces();
    for (i, piece) in pieces.iter().enumerate() {
        assert_eq!(ends(piece).1, ends(&pieces[(i + 1) % pieces.len()]).0, "{case}: open");
    }
}

/// No two chords of a ring cross, by brute force.
fn check_simple(area: &Area, case: &str) {
    let mut chords = Vec::new();
    for ring in area.rings() {
        let points = ring.points_mm(1e-3);
        chords.extend((0..points.len()).map(|i| (points[i], points[(i + 1) % points.len()])));
    }
    if chords.len() > 600 {
        return;
    }
    let side = |a: Point, b: Point, c: Point| (b - a).perp(&(c - a));
    for (i, &(a, b)) in chords.iter().enumerate() {
        for &(c, d) in &chords[..i] {
            // Less than rounding is no crossing.
            let deep = |x: f64, y: f64| x * y < 0.0 && x.abs().min(y.abs()) > 1e-9;
            let crosses = deep(side(a, b, c), side(a, b, d)) && deep(side(c, d, a), side(c, d, b));
            assert!(!crosses, "{case}: crosses itself at {a} … {b}, {c} … {d}");
        }
    }
}

/// Everything that must hold of an inset by `d`.
fn check(outline: &Outline, areas: &[Area], d: f64, random: &mut Random, case: &str) {
    for area in areas {
        assert!(area.outer.signed_area_mm2() > 0.0, "{case}");
        assert!(area.islands.iter().all(|island| island.signed_area_mm2() < 0.0), "{case}");
        check_simple(area, case);
        for ring in area.rings() {
            check_closed(ring, case);
            let points = ring.points_mm(0.01);
            for &point in points.iter().step_by(points.len().div_ceil(40)) {
                let distance = outline.distance(point);
                assert!((distance - d).abs() <= outline.tolerance, "{case}: {distance} for {d} at {point}");
            }
            for k in 0..10 {
                let distance = outline.distance(ring.point_at_mm(ring.length_mm() * f64::from(k) / 10.0));
                assert!((distance - d).abs() <= outline.tolerance, "{case}: {distance} for {d} along");
            }
        }
    }
    // Nothing is left out, nothing is too much.
    for _ in 0..40 {
        let point = p(between(random, -13.0, 13.0), between(random, -13.0, 13.0));
        let distance = outline.distance(point);
        if (distance - d).abs() > 2.0 * outline.tolerance && distance > 0.01 {
            let found = areas.iter().filter(|area| area.contains(point)).count();
            let expected = usize::from(distance > d && outline.contains(point));
            assert_eq!(found, expected, "{case}: {point} is {distance} from the boundary");
        }
    }
}

/// An inset, and an inset of it, and both at once.
fn check_nested(outline: &Outline, random: &mut Random, deepest: f64, case: &str) -> usize {
    let Ok(region) = outline.region() else { return 0 };
    let (d, e) = (between(random, 0.0, deepest), between(random, 0.0, deepest));
    let case = &format!("{case}, d = {d} + {e}");
    let first = region.inset(d).unwrap_or_else(|error| panic!("{case}: {error}"));
    check(outline, &first, d, random, case);
    let both = region.inset(d + e).unwrap_or_else(|error| panic!("{case}: {error}"));
    check(outline, &both, d + e, random, case);
    let mut nested = Vec::new();
    for area in &first {
        let inner = area.inset(e).unwrap_or_else(|error| panic!("{case}: {error}"));
        for ring in inner.iter().flat_map(Area::rings) {
            for point in ring.points_mm(0.1) {
                assert!(area.contains(point), "{case}: {point} is not in the ring before");
            }
        }
        nested.extend(inner);
    }
    check(outline, &nested, d + e, random, case);
    // Each of the three insets within the tolerance.
    let tolerance =
        3.0 * outline.tolerance * (1.0 + both.iter().flat_map(Area::rings).map(Ring::length_mm).sum::<f64>());
    near(total(&both), total(&nested), tolerance);
    if outline.tolerance < 1e-8 && (total(&both) > 1e-6 || both.is_empty()) {
        assert_eq!(both.len(), nested.len(), "{case}");
    }
    let (depth, point) = region.depth_mm().unwrap_or_else(|error| panic!("{case}: {error}"));
    near(outline.distance(point), depth, 2.0 * outline.tolerance);
    assert!(region.inset(depth + 1e-8).unwrap().is_empty(), "{case}: deeper than {depth}");
    assert!(!region.inset(depth - 1e-8).unwrap().is_empty(), "{case}: not {depth} deep");
    assert_eq!(both.is_empty(), d + e >= depth, "{case}: {depth}");
    1
}

fn star(random: &mut Random, centre: Point, count: usize, radius: f64, rough: f64) -> Vec<Point> {
    (0..count)
        .map(|i| {
            let a = TAU * i as f64 / count as f64;
            let r = radius * (1.0 + rough * (random.random::<f64>() - 0.5));
            centre + p(r * a.cos(), r * a.sin())
        })
        .collect()
}

#[test]
fn validates_random_stars() {
    stars(1, 1000);
}

fn stars(seed: u64, cases: usize) {
    let mut random = random(seed);
    let mut done = 0;
    for case in 0..cases {
        let (corners, rough) = (count(&mut random, 3, 40), between(&mut random, 0.0, 1.6));
        let outline = Outline::of_polygons(&[star(&mut random, p(0., 0.), corners, 10.0, rough)]);
        done += check_nested(&outline, &mut random, 3.0, &format!("star {case}"));
    }
    assert!(done > cases * 9 / 10, "{done}");
}

#[test]
fn validates_random_combs() {
    combs(2, 400);
}

fn combs(seed: u64, cases: usize) {
    let mut random = random(seed);
    let mut done = 0;
    for case in 0..cases {
        let teeth = count(&mut random, 2, 12);
        // On a grid half of the time: parallel walls, equal widths, everything at once.
        let grid = case % 2 == 0;
        let snap = |x: f64| if grid { (x * 2.0).round() / 2.0 } else { x };
        let mut points = vec![p(-10.0, -10.0), p(10.0, -10.0)];
        let width = 20.0 / (2 * teeth - 1) as f64;
        for tooth in 0..teeth {
            let x = 10.0 - width * 2.0 * tooth as f64;
            let (top, bottom) = (snap(between(&mut random, 2.0, 10.0)), snap(between(&mut random, -6.0, 1.0)));
            points.extend([p(x, top), p(x - width, top)]);
            if tooth + 1 < teeth {
                points.extend([p(x - width, bottom), p(x - 2.0 * width, bottom)]);
            }
        }
        let outline = Outline::of_polygons(&[points]);
        done += check_nested(&outline, &mut random, 2.0, &format!("comb {case}"));
    }
    assert_eq!(done, cases);
}

#[test]
fn validates_random_islands() {
    islands(3, 250);
}

fn islands(seed: u64, cases: usize) {
    let mut random = random(seed);
    let mut done = 0;
    for case in 0..cases {
        let mut polygons = vec![star(&mut random, p(0., 0.), 24, 11.0, 0.2)];
        let mut circles = Vec::new();
        for _ in 0..count(&mut random, 1, 12) {
            let centre = p(between(&mut random, -7.0, 7.0), between(&mut random, -7.0, 7.0));
            let size = between(&mut random, 0.2, 2.5);
            if random.random::<bool>() {
                let start = centre + p(size, 0.0);
                circles.push(vec![arc(start, start, centre, true)]);
            } else {
                let corners = count(&mut random, 3, 9);
                polygons.push(star(&mut random, centre, corners, size, 0.8));
            }
        }
        let mut outline = Outline::of_polygons(&polygons);
        outline.rings.extend(circles);
        // Those that overlap are left out.
        while let Err(error) = outline.region() {
            let last = match error {
                GuideError::IslandsMeet { second, .. } => second,
                GuideError::IslandOutside { island, .. } => island,
                other => panic!("{case}: {other}"),
            };
            outline.rings.remove(last + 1);
        }
        done += check_nested(&outline, &mut random, 1.5, &format!("islands {case}"));
    }
    assert_eq!(done, cases);
}

#[test]
fn validates_random_lines_and_arcs() {
    lines_and_arcs(4, 250);
}

fn lines_and_arcs(seed: u64, cases: usize) {
    let mut random = random(seed);
    let mut done = 0;
    for case in 0..cases {
        let corners = count(&mut random, 2, 14);
        let rough = between(&mut random, 0.0, 0.8);
        let points = star(&mut random, p(0., 0.), corners, 9.0, rough);
        let mut pieces = Vec::new();
        for i in 0..corners {
            let (a, b) = (points[i], points[(i + 1) % corners]);
            // Tangent of a quarter of the arc's angle; up to three quarters of a turn.
            let bulge = if corners == 2 { between(&mut random, 0.2, 1.0) } else { between(&mut random, -0.6, 1.2) };
            // Arcs with a radius of kilometres are as exact as such a number is.
            let bulge = if bulge.abs() < 0.003 { 0.003 } else { bulge };
            if corners > 2 && random.random::<f64>() < 0.4 {
                pieces.push(line(a, b));
            } else {
                let normal = p(a.y - b.y, b.x - a.x);
                let centre = (a + b) * 0.5 + normal * ((1.0 - bulge * bulge) / (4.0 * bulge));
                pieces.push(arc(a, b, centre, bulge > 0.0));
            }
        }
        let outline = Outline { rings: vec![pieces], tolerance: 1e-9 };
        done += check_nested(&outline, &mut random, 3.0, &format!("arcs {case}"));
    }
    assert!(done > cases / 3, "{done}");
}

/// A closed cubic B-spline.
fn blob(points: &[Point]) -> NurbsCurve<2> {
    let mut control = points.to_vec();
    control.extend_from_slice(&points[..3]);
    let knots = (0..control.len() + 4).map(|k| k as f64).collect();
    NurbsCurve::new(3, knots, control, None).unwrap()
}

#[test]
fn validates_random_free_form_blobs() {
    free_form_blobs(5, 20);
}

fn free_form_blobs(seed: u64, cases: usize) {
    let mut random = random(seed);
    let mut done = 0;
    for case in 0..cases {
        let corners = count(&mut random, 5, 14);
        let curve = blob(&star(&mut random, p(0., 0.), corners, 10.0, 1.2));
        // The chords within the tolerance of 1e-4 mm.
        let outline = Outline { rings: vec![vec![Piece::Curve(curve)]], tolerance: 1.01e-4 };
        done += check_nested(&outline, &mut random, 2.5, &format!("blob {case}"));
    }
    assert!(done > cases / 2, "{done}");
}

/// A few more of each kind; `GUIDE_SEEDS=50 cargo test --release --test parts thousands` tries 50 times as many.
#[test]
fn validates_thousands_of_random_regions() {
    let seeds = std::env::var("GUIDE_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    for seed in 100..100 + seeds {
        stars(seed, 60);
        combs(seed, 20);
        islands(seed, 20);
        lines_and_arcs(seed, 20);
        free_form_blobs(seed, 1);
    }
}
