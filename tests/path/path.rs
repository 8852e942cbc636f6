//! Paths: identities of the PH spline on random cases, closed forms, and the errors.

use std::f64::consts::{PI, TAU};

use crate::common::{ALPHA, HEART, random_ring, random_walk};
use nalgebra::{Rotation2, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::path::{Circle, Cursor, Line, Path, PathError, PhSpline};

/// Random open and closed splines: thousands of segments.
fn random_splines(seed: u64, count: usize) -> Vec<(String, PhSpline)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut splines = Vec::new();
    for case in 0..count {
        let size = rng.random_range(3..30);
        let closed = case % 2 == 0;
        let points = if closed { random_ring(&mut rng, size) } else { random_walk(&mut rng, size, 1.0) };
        match PhSpline::from_nodal_points(&points, closed, None) {
            Ok(spline) => splines.push((format!("case {case}, closed {closed}: {points:?}"), spline)),
            Err(error) => panic!("case {case}: {error}: {points:?}"),
        }
    }
    splines
}

/// ∫₀¹ by composite Gauss with 5 points an interval: exact for the polynomials of degree 4 here on one, far below 1e-12 for
/// the rational functions on 64.
fn integral(n: u32, f: impl Fn(f64) -> f64) -> f64 {
    let nodes = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let half = 0.5 / f64::from(n);
    (0..n)
        .map(|i| {
            let middle = (2.0 * f64::from(i) + 1.0) * half;
            let pair = |(x, w): (f64, f64)| {
                let both = if x == 0.0 { f(middle) } else { f(middle - half * x) + f(middle + half * x) };
                w * both
            };
            half * nodes.iter().copied().map(pair).sum::<f64>()
        })
        .sum()
}

/// `w` of segment `i` from the solution, as the specification writes it: an evaluation of our own beside the library's.
fn w(z: &[[f64; 2]], i: usize, xi: f64) -> Vector2<f64> {
    let z = [z[i], z[i + 1], z[i + 2]].map(Vector2::from);
    let rest = 1.0 - xi;
    (z[0] + z[1]) * 0.5 * rest * rest + z[1] * 2.0 * rest * xi + (z[1] + z[2]) * 0.5 * xi * xi
}

fn square(w: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(w.x * w.x - w.y * w.y, 2.0 * w.x * w.y)
}

#[test]
fn validates_that_splines_pass_through_their_nodal_points() {
    for (case, spline) in random_splines(10, 2000) {
        let nodes = spline.nodal_points_mm();
        let scale = nodes.iter().map(Vector2::norm).fold(1.0, f64::max);
        let z: Vec<[f64; 2]> = spline.preimage().collect();
        for (i, pair) in nodes.windows(2).enumerate() {
            // The chord is the integral of w².
            let x = integral(1, |xi| square(w(&z, i, xi)).x);
            let y = integral(1, |xi| square(w(&z, i, xi)).y);
            let miss = (Vector2::new(x, y) - (pair[1] - pair[0])).norm();
            assert!(miss < 1e-12 * scale, "segment {i} misses by {miss}: {case}");
        }
    }
}

#[test]
fn validates_arc_length_against_quadrature() {
    for (case, spline) in random_splines(11, 1000) {
        let z: Vec<[f64; 2]> = spline.preimage().collect();
        let mut length = 0.0;
        for (i, node) in spline.lengths_at_nodes_mm().iter().enumerate() {
            assert!((length - node).abs() <= 1e-10 * node.abs(), "segment {i}: {length} {node}: {case}");
            if i + 2 < z.len() {
                // |r'| from the point's derivative, not from |w|².
                length += integral(1, |xi| square(w(&z, i, xi)).norm());
            }
        }
    }
}

#[test]
fn validates_the_pythagorean_identity() {
    // |r'|² = σ²: the hodograph's length is the parametric speed, here 1 per unit of arc length.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    for (case, spline) in random_splines(12, 1000) {
        let mut cursor = Cursor::default();
        let z: Vec<[f64; 2]> = spline.preimage().collect();
        for _ in 0..20 {
            let s = rng.random_range(0.0..spline.length_mm());
            let frame = spline.frame(s, &mut cursor);
            assert!((frame.tangent.norm() - 1.0).abs() < 1e-14, "at {s}: {case}");
            let w = w(&z, cursor.segment, cursor.xi);
            assert!((square(w).norm_squared() - w.norm_squared().powi(2)).abs() <= 1e-14 * w.norm_squared().powi(2));
            assert!((square(w).normalize() - frame.tangent).norm() < 1e-12, "at {s}: {case}");
        }
    }
}

#[test]
fn validates_c2_at_every_joint() {
    for (case, spline) in random_splines(13, 1500) {
        let length = spline.length_mm();
        let nodes = spline.lengths_at_nodes_mm();
        let last = nodes.len() - 1;
        for (i, &node) in nodes.iter().enumerate() {
            let (before, after) = match i {
                0 if spline.is_closed() => (length, 0.0),
                i if i == 0 || i == last => continue,
                _ => (node, node),
            };
            let left_segment = if i == 0 { last - 1 } else { i - 1 };
            let right_segment = if i == 0 { 0 } else { i };
            // Cursors force the side: the end of one segment, the start of the next.
            let h = 1e-9 * length;
            let left = spline.frame(before - h, &mut Cursor::at(left_segment, 1.0));
            let right = spline.frame(after + h, &mut Cursor::at(right_segment, 0.0));
            // Over 2h the point moves 2h, the tangent by 2hκ, the curvature by 2h dκ/ds.
            let kappa = spline.max_curvature_1_mm();
            let rate = left.curvature_rate_1_mm2.norm().max(right.curvature_rate_1_mm2.norm());
            let slack = 1e-11;
            assert!((right.point_mm - left.point_mm).norm() < 2.1 * h + slack * length, "joint {i}: {case}");
            assert!((right.tangent - left.tangent).norm() < 2.1 * h * kappa + slack, "joint {i}: {case}");
            let jump = (right.curvature_1_mm - left.curvature_1_mm).norm();
            assert!(jump < 2.1 * h * rate + 1e-10 * kappa.max(1.0 / length), "joint {i}: {jump}: {case}");
        }
    }
}

#[test]
fn validates_curvature_and_its_rate_against_differences() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(14);
    for (case, spline) in random_splines(14, 300) {
        let nodes = spline.lengths_at_nodes_mm().to_vec();
        for pair in nodes.windows(2) {
            let h = 1e-4 * (pair[1] - pair[0]);
            let s = rng.random_range(pair[0] + 2.0 * h..pair[1] - 2.0 * h);
            let at = |s| spline.frame(s, &mut Cursor::default());
            let (before, here, after) = (at(s - h), at(s), at(s + h));
            let unit = pair[1] - pair[0];
            let bend = (after.tangent - before.tangent) / (2.0 * h);
            assert!((bend - here.curvature_1_mm).norm() * unit < 1e-4 * (1.0 + bend.norm() * unit).powi(3), "{case}");
            let rate = (after.curvature_1_mm - before.curvature_1_mm) / (2.0 * h);
            let size = 1.0 + rate.norm() * unit * unit + (bend.norm() * unit).powi(4);
            assert!((rate - here.curvature_rate_1_mm2).norm() * unit * unit < 1e-3 * size, "{case}");
        }
    }
}

#[test]
fn validates_the_largest_curvature_against_a_dense_search() {
    for (case, spline) in random_splines(15, 200) {
        let (length, claimed) = (spline.length_mm(), spline.max_curvature_1_mm());
        let mut cursor = Cursor::default();
        let dense = (0..=20_000)
            .map(|i| spline.frame(length * f64::from(i) / 20_000.0, &mut cursor).curvature_1_mm.norm())
            .fold(0.0, f64::max);
        assert!(dense <= claimed * (1.0 + 1e-12), "{dense} {claimed}: {case}");
        assert!(dense >= claimed * 0.99, "{dense} {claimed}: {case}");
        // Of every stretch the bound holds, and of one segment it is that segment's own.
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(claimed.to_bits());
        for _ in 0..20 {
            let (a, b) = (rng.random_range(0.0..=length), rng.random_range(0.0..=length));
            let (from, to) = (f64::min(a, b), f64::max(a, b));
            let bound = spline.curvature_bound_1_mm(from, to);
            let at = |i: i32| (from + (to - from) * f64::from(i) / 50.0).min(to);
            let dense = (0..=50).map(|i| spline.frame(at(i), &mut cursor).curvature_1_mm.norm()).fold(0.0, f64::max);
            assert!(dense <= bound * (1.0 + 1e-12) && bound <= claimed, "{from} {to}: {dense} {bound}: {case}");
        }
        let nodes = spline.lengths_at_nodes_mm();
        let inside =
            |pair: &[f64]| spline.curvature_bound_1_mm(0.7 * pair[0] + 0.3 * pair[1], 0.3 * pair[0] + 0.7 * pair[1]);
        assert_eq!(nodes.windows(2).map(inside).fold(0.0, f64::max), claimed);
    }
}

#[test]
fn validates_bending_energy_against_a_sum_over_arc_length() {
    for points in [&ALPHA[..], &HEART[..]] {
        let closed = points.len() == 8;
        let points: Vec<_> = points.iter().map(|&p| Vector2::from(p)).collect();
        let spline = PhSpline::from_control_points(&points, closed).unwrap();
        let mut cursor = Cursor::default();
        let nodes = spline.lengths_at_nodes_mm();
        let energy: f64 = nodes
            .windows(2)
            .map(|pair| {
                let length = pair[1] - pair[0];
                let mut square = |x: f64| spline.frame(pair[0] + x * length, &mut cursor).curvature_1_mm.norm_squared();
                // Simpson on 20 000 intervals: a rule that has nothing in common with the library's.
                let n = 20_000;
                let sum: f64 = (0..=n)
                    .map(|i| {
                        let weight = if i == 0 || i == n {
                            1.0
                        } else if i % 2 == 1 {
                            4.0
                        } else {
                            2.0
                        };
                        weight * square(f64::from(i) / f64::from(n))
                    })
                    .sum();
                length * sum / (3.0 * f64::from(n))
            })
            .sum();
        let ours = spline.bending_energy_1_mm();
        assert!((ours - energy).abs() < 1e-9 * energy, "{ours} {energy}");
    }
}

#[test]
fn validates_that_the_wanted_root_turns_with_its_polygon() {
    // A closed convex ring turns once; a figure of eight not at all; alpha follows its control polygon.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(16);
    for _ in 0..500 {
        let count = rng.random_range(4..20);
        let ring = PhSpline::from_nodal_points(&random_ring(&mut rng, count), true, None).unwrap();
        assert!((total_turn(&ring) - TAU).abs() < 1e-6, "{}", total_turn(&ring));
    }
    let eight: Vec<_> = (0..12)
        .map(|i| TAU * f64::from(i) / 12.0)
        .map(|t| Vector2::new(40.0 * t.cos(), 20.0 * (2.0 * t).sin()))
        .collect();
    let eight = PhSpline::from_nodal_points(&eight, true, None).unwrap();
    assert!(total_turn(&eight).abs() < 1e-6, "{}", total_turn(&eight));
}

/// `∫ κ ds`, signed.
fn total_turn(path: &PhSpline) -> f64 {
    let length = path.length_mm();
    path.lengths_at_nodes_mm()
        .windows(2)
        .map(|pair| {
            let mut cursor = Cursor::default();
            let n = 400;
            (0..n)
                .map(|i| {
                    let at = |s: f64, c: &mut Cursor| path.frame(s.min(length), c).tangent;
                    let s = |i: i32| pair[0] + (pair[1] - pair[0]) * f64::from(i) / f64::from(n);
                    let (a, b) = (at(s(i), &mut cursor), at(s(i + 1), &mut cursor));
                    a.perp(&b).atan2(a.dot(&b))
                })
                .sum::<f64>()
        })
        .sum()
}

#[test]
fn validates_that_the_wanted_root_has_the_smallest_bending_energy_of_its_neighbours() {
    // Other solutions of the same equations are reached by flipping the sign of one start value; the library refuses them,
    // so they are found here by a plain Newton with numerical elimination on alpha's small system.
    let spline = PhSpline::from_control_points(&ALPHA.map(Vector2::from), false).unwrap();
    let wanted = energy_of(&spline.preimage().map(num).collect::<Vec<_>>());
    assert!((wanted - spline.bending_energy_1_mm()).abs() < 1e-6 * wanted);
    let nodes = spline.nodal_points_mm();
    let chords: Vec<C> = nodes.windows(2).map(|p| C::new(p[1].x - p[0].x, p[1].y - p[0].y)).collect();
    let ends = [C::new(36.0, 54.0), C::new(-36.0, 54.0)];
    let mut others = 0;
    for flips in 1..8_u32 {
        let mut z: Vec<C> = spline.preimage().map(num).collect();
        for i in 0..3 {
            if flips & (1 << i) != 0 {
                for z in &mut z[i + 2..] {
                    *z = -*z;
                }
            }
        }
        if let Some(z) = newton(z, &chords, ends) {
            let energy = energy_of(&z);
            assert!(energy >= wanted * (1.0 - 1e-9), "flips {flips:b}: {energy} < {wanted}");
            others += u32::from(energy > wanted * 1.5);
        }
    }
    assert!(others >= 2, "the test must have met other solutions: {others}");
}

type C = nalgebra::Complex<f64>;

fn num([re, im]: [f64; 2]) -> C {
    C::new(re, im)
}

fn energy_of(z: &[C]) -> f64 {
    z.windows(3)
        .map(|z| {
            let (a, b, c) = ((z[0] + z[1]) * 0.5, z[1], (z[1] + z[2]) * 0.5);
            integral(64, |xi| {
                let w = a * (1.0 - xi) * (1.0 - xi) + b * 2.0 * (1.0 - xi) * xi + c * xi * xi;
                let w1 = (b - a) * 2.0 * (1.0 - xi) + (c - b) * 2.0 * xi;
                let kappa_sigma = 2.0 * (w.conj() * w1).im / w.norm_sqr();
                kappa_sigma * kappa_sigma / w.norm_sqr()
            })
        })
        .sum()
}

/// Newton with dense elimination on the equations as the specification writes them.
fn newton(mut z: Vec<C>, chords: &[C], ends: [C; 2]) -> Option<Vec<C>> {
    let n = z.len();
    for _ in 0..100 {
        let mut f = vec![C::new(0.0, 0.0); n];
        let mut jacobian = nalgebra::DMatrix::<C>::zeros(n, n);
        let (m, one) = (n - 1, C::new(1.0, 0.0));
        f[0] = (z[0] + z[1]) * (z[0] + z[1]) - ends[0] * 4.0;
        f[m] = (z[m - 1] + z[m]) * (z[m - 1] + z[m]) - ends[1] * 4.0;
        for (row, i) in [(0, 0), (m, m - 1)] {
            jacobian[(row, i)] = (z[i] + z[i + 1]) * 2.0 * one;
            jacobian[(row, i + 1)] = (z[i] + z[i + 1]) * 2.0;
        }
        for i in 1..m {
            let (a, b, c) = (z[i - 1], z[i], z[i + 1]);
            f[i] =
                a * a * 3.0 + b * b * 27.0 + c * c * 3.0 + a * c + a * b * 13.0 + b * c * 13.0 - chords[i - 1] * 60.0;
            jacobian[(i, i - 1)] = a * 6.0 + c + b * 13.0;
            jacobian[(i, i)] = b * 54.0 + (a + c) * 13.0;
            jacobian[(i, i + 1)] = c * 6.0 + a + b * 13.0;
        }
        let step = jacobian.lu().solve(&nalgebra::DVector::from_vec(f))?;
        for (z, step) in z.iter_mut().zip(step.iter()) {
            *z -= step;
        }
        if step.iter().all(|s| s.norm() < 1e-13) {
            return Some(z);
        }
    }
    None
}

#[test]
fn validates_the_end_tangents_that_are_not_given() {
    // Those of the parabola through the three end points, parametrised by chord length: Lagrange's form, differentiated.
    let points = planar(&[[0., 0.], [10., 3.], [14., 9.], [30., 12.], [37., 8.]]);
    let path = PhSpline::from_nodal_points(&points, false, None).unwrap();
    let lagrange = |a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>| {
        let (h, k) = ((b - a).norm(), (c - b).norm());
        let t = h + k;
        -a * ((h + t) / (h * t)) + b * (t / (h * k)) - c * (h / (t * k))
    };
    let start = lagrange(points[0], points[1], points[2]).normalize();
    let end = -lagrange(points[4], points[3], points[2]).normalize();
    let tangent = |s: f64| path.frame(s, &mut Cursor::default()).tangent;
    assert!((tangent(0.0) - start).norm() < 1e-12, "{} {start}", tangent(0.0));
    assert!((tangent(path.length_mm()) - end).norm() < 1e-12, "{} {end}", tangent(path.length_mm()));
    // Scaled to one segment: given back by hand they give the same spline.
    let given = (
        lagrange(points[0], points[1], points[2]) * (points[1] - points[0]).norm(),
        -lagrange(points[4], points[3], points[2]) * (points[4] - points[3]).norm(),
    );
    let by_hand = PhSpline::from_nodal_points(&points, false, Some(given)).unwrap();
    assert!((by_hand.length_mm() - path.length_mm()).abs() < 1e-12 * path.length_mm());
}

#[test]
fn validates_invariance_under_motion_scale_and_reversal() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(17);
    for case in 0..300 {
        let count = rng.random_range(3..15);
        let points = random_walk(&mut rng, count, 1.0);
        let spline = PhSpline::from_nodal_points(&points, false, None).unwrap();
        let turn = Rotation2::new(rng.random_range(-PI..PI));
        let shift = Vector2::new(rng.random_range(-500.0..500.0), rng.random_range(-500.0..500.0));
        let scale: f64 = rng.random_range(0.1..10.0);
        let moved: Vec<_> = points.iter().map(|p| turn * p * scale + shift).collect();
        let moved = PhSpline::from_nodal_points(&moved, false, None).unwrap();
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        let reversed = PhSpline::from_nodal_points(&reversed, false, None).unwrap();
        let length = spline.length_mm();
        assert!((moved.length_mm() - scale * length).abs() < 1e-10 * scale * length, "case {case}");
        assert!((reversed.length_mm() - length).abs() < 1e-10 * length, "case {case}");
        for i in 0..=20 {
            let s = length * f64::from(i) / 20.0;
            let here = spline.frame(s, &mut Cursor::default());
            let there = moved.frame(s * scale, &mut Cursor::default());
            let size = 1e-10 * (scale * length + shift.norm());
            assert!((turn * here.point_mm * scale + shift - there.point_mm).norm() < size, "case {case}");
            let back = reversed.frame(length - s, &mut Cursor::default());
            assert!((here.point_mm - back.point_mm).norm() < 1e-10 * length, "case {case}");
        }
    }
}

#[test]
fn validates_lines_and_circles_in_closed_form() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(18);
    for _ in 0..2000 {
        let mut coordinate = || rng.random_range(-100.0..100.0);
        let (a, b) = (Vector3::new(coordinate(), coordinate(), coordinate()), Vector3::new(1.0, coordinate(), 3.0));
        let line = Line::new(a, b).unwrap();
        assert!((line.length_mm() - (b - a).norm()).abs() < 1e-12);
        assert_eq!(line.frame(line.length_mm(), &mut Cursor::default()).point_mm, b);
        let p = Vector3::new(coordinate(), coordinate(), coordinate());
        let foot = line.nearest_local(&p, &mut Cursor::default());
        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        assert!((foot.point_mm - (a + (b - a) * t)).norm() < 1e-10);

        let centre = Vector2::new(coordinate(), coordinate());
        let (radius, start) = (coordinate().abs() + 0.1, coordinate());
        let clockwise = coordinate() > 0.0;
        let circle = Circle::new(centre, radius, start, clockwise).unwrap();
        assert!((circle.length_mm() - TAU * radius).abs() < 1e-12);
        let p = Vector2::new(coordinate(), coordinate());
        let foot = circle.nearest_local(&p, &mut Cursor::default());
        assert!((foot.point_mm - (centre + (p - centre).normalize() * radius)).norm() < 1e-9);
        let side = foot.tangent.perp(&(centre - foot.point_mm));
        assert!(
            if clockwise { side < 0.0 } else { side > 0.0 },
            "the centre lies to the left of a counterclockwise turn"
        );
        let frame = circle.frame(foot.s_mm, &mut Cursor::default());
        assert!((frame.curvature_1_mm - (centre - foot.point_mm) / (radius * radius)).norm() < 1e-9 / radius);
        let rate = -foot.tangent / (radius * radius);
        assert!((frame.curvature_rate_1_mm2 - rate).norm() < 1e-9 / (radius * radius));
    }
}

#[test]
fn validates_fourth_order_convergence_to_a_circle() {
    // A C2 spline through n points of a circle approaches its circumference with the fourth power of the spacing.
    let miss = |n: u32| {
        let points: Vec<_> = (0..n)
            .map(|i| TAU * f64::from(i) / f64::from(n))
            .map(|t| Vector2::new(50.0 * t.cos(), 50.0 * t.sin()))
            .collect();
        let spline = PhSpline::from_nodal_points(&points, true, None).unwrap();
        ((spline.length_mm() - 100.0 * PI).abs(), (spline.max_curvature_1_mm() - 0.02).abs())
    };
    let (coarse, fine) = (miss(16), miss(32));
    assert!(coarse.0 < 5e-3, "{coarse:?}");
    assert!((14.0..18.0).contains(&(coarse.0 / fine.0)), "{coarse:?} {fine:?}");
    assert!(fine.1 < coarse.1 / 3.0, "{coarse:?} {fine:?}");
}

fn planar(points: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    points.iter().map(|&p| Vector2::from(p)).collect()
}

#[test]
fn bad_points_are_refused_with_the_reason() {
    let control = |points: &[[f64; 2]], closed| PhSpline::from_control_points(&planar(points), closed).unwrap_err();
    let nodal = |points: &[[f64; 2]], closed| PhSpline::from_nodal_points(&planar(points), closed, None).unwrap_err();
    assert!(matches!(
        control(&[[0., 0.], [1., 0.], [2., 0.]], false),
        PathError::TooFewPoints { given: 3, needed: 4, .. }
    ));
    assert!(matches!(control(&[[0., 0.], [1., 0.]], true), PathError::TooFewPoints { given: 2, needed: 3, .. }));
    assert!(matches!(nodal(&[[0., 0.]], false), PathError::TooFewPoints { given: 1, needed: 2, .. }));
    assert!(matches!(nodal(&[[0., 0.], [1., f64::NAN]], false), PathError::BadCoordinate { index: 1, .. }));
    assert!(matches!(nodal(&[[0., 0.], [f64::INFINITY, 0.]], false), PathError::BadCoordinate { index: 1, .. }));
    assert!(matches!(nodal(&[[1e9, 0.], [0., 0.]], false), PathError::BadCoordinate { index: 0, .. }));
    assert!(matches!(
        nodal(&[[0., 0.], [1., 0.], [1., 0.], [2., 3.]], false),
        PathError::CoincidentPoints { first: 1, second: 2, .. }
    ));
    // There and back again.
    assert!(matches!(nodal(&[[0., 0.], [10., 0.], [0., 0.]], false), PathError::Reversal { index: 1, .. }));
    // A closed path of control points on one line has to turn back at both ends.
    assert!(matches!(
        control(&[[0., 0.], [10., 0.], [20., 0.], [30., 0.]], true),
        PathError::Reversal { .. } | PathError::CoincidentPoints { .. }
    ));
    // At the seam of a closed path, and against an end tangent.
    let seam = nodal(&[[0., 0.], [10., 0.], [5., 5.], [5., 0.]], true);
    assert!(matches!(seam, PathError::Reversal { index: 0, .. }), "{seam}");
    for (ends, at) in [([-1.0, 1.0], 0), ([1.0, -1.0], 2)] {
        let [start, end] = ends.map(|x| Vector2::new(x, 0.0));
        let points = planar(&[[0., 0.], [10., 0.], [20., 0.]]);
        let error = PhSpline::from_nodal_points(&points, false, Some((start, end))).unwrap_err();
        assert!(matches!(error, PathError::Reversal { index, .. } if index == at), "{error}");
    }
    // Tangents five times as long as the chord: w = (1 - 2ξ)² solves the equations, and stands still in the middle.
    let along = Vector2::new(10.0, 0.0);
    let cusp = PhSpline::from_nodal_points(&planar(&[[0., 0.], [2., 0.]]), false, Some((along, along))).unwrap_err();
    assert!(matches!(cusp, PathError::Cusp { segment: 0, xi } if (xi - 0.5).abs() < 1e-3), "{cusp}");
    // A sharp point from which Newton reaches another root: a loop more, and one at a clamped end.
    let looped = nodal(&[[8., -3.], [9., -5.], [8., -4.], [-7., 8.]], true);
    assert!(matches!(looped, PathError::WrongRoot { segment: 0, .. }), "{looped}");
    let ends = (Vector2::new(78.5, 43.0), Vector2::new(-0.73, 0.26));
    let looped = PhSpline::from_nodal_points(&planar(&[[0., 0.], [10., 0.]]), false, Some(ends)).unwrap_err();
    assert!(matches!(looped, PathError::WrongRoot { segment: 0, .. }), "{looped}");
    // A clamped end without direction.
    assert!(matches!(
        control(&[[0., 0.], [0., 0.], [10., 5.], [20., 0.]], false),
        PathError::ZeroEndTangent { end: "start" }
    ));
    let too_many = vec![Vector2::new(0.0, 0.0); servosim::path::MAX_POINTS + 1];
    assert!(matches!(PhSpline::from_nodal_points(&too_many, true, None), Err(PathError::TooManyPoints { .. })));
}

#[test]
fn wild_points_give_a_spline_or_an_error_and_never_a_wrong_one() {
    // Points with no order at all: sharp turns, wild chord ratios. What comes back as a spline passes through its points and turns with them.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(19);
    let (mut good, mut refused) = (0, 0);
    for case in 0..20_000 {
        let count = rng.random_range(3..12);
        let points: Vec<_> =
            (0..count).map(|_| Vector2::new(rng.random_range(-50.0..50.0), rng.random_range(-50.0..50.0))).collect();
        let closed = case % 2 == 0;
        match PhSpline::from_nodal_points(&points, closed, None) {
            Ok(spline) => {
                good += 1;
                let nodes = spline.lengths_at_nodes_mm();
                for (i, pair) in spline.nodal_points_mm().windows(2).enumerate() {
                    let chord = (pair[1] - pair[0]).norm();
                    assert!(nodes[i + 1] - nodes[i] >= chord * (1.0 - 1e-12), "case {case}: {points:?}");
                    let end = spline.frame(nodes[i + 1], &mut Cursor::at(i, 1.0));
                    assert!((end.point_mm - pair[1]).norm() < 1e-9, "case {case}: {points:?}");
                }
            }
            Err(
                PathError::NoConvergence { .. }
                | PathError::WrongRoot { .. }
                | PathError::Cusp { .. }
                | PathError::Reversal { .. },
            ) => refused += 1,
            Err(other) => panic!("case {case}: {other}: {points:?}"),
        }
    }
    assert!(good > 100 * refused, "{good} splines, {refused} refused");
}
