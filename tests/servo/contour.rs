//! The contouring error and the interpolator: exactness against brute force, and what a path that crosses itself needs.

use std::f64::consts::PI;

use crate::common::{ALPHA, Case, PROFILE, random_ring, random_walk};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::contour::ContourMeter;
use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::path::{Circle, Cursor, Line, Path, PhSpline, nearest_in_window};
use servosim::servo::LoopSettings;
use servosim::simulation::Simulation;

/// Distance from `p` to the part of `path` between two arc lengths, by a fine polyline: wrong by at most κ h²/8.
fn polyline_distance(path: &dyn Path<2>, p: &Vector2<f64>, from: f64, to: f64, pieces: usize) -> f64 {
    let mut cursor = Cursor::default();
    let mut at = |i: usize| path.point_mm(from + (to - from) * i as f64 / pieces as f64, &mut cursor);
    let mut a = at(0);
    let mut nearest = f64::INFINITY;
    for i in 1..=pieces {
        let b = at(i);
        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        nearest = nearest.min((a + (b - a) * t - p).norm());
        a = b;
    }
    nearest
}

#[test]
fn validates_the_contouring_error_of_whole_runs_against_a_fine_polyline() {
    for case in Case::both() {
        let length = case.path.length_mm();
        for period in case.simulation(PROFILE) {
            let s = period.setpoint.s_mm;
            // The part of the path within 1 mm of the setpoint: tracking errors stay below 0.2 mm.
            let (low, high) = ((s - 1.0).max(0.0), (s + 1.0).min(length));
            let mut brute = polyline_distance(&case.path, &period.actual_mm, low, high, 1000);
            if case.path.is_closed() && (s < 1.0 || s > length - 1.0) {
                brute = brute.min(polyline_distance(&case.path, &period.actual_mm, 0.0, 1.0, 1000));
                brute = brute.min(polyline_distance(&case.path, &period.actual_mm, length - 1.0, length, 1000));
            }
            // κ h²/8 = 0.13 · (2e-3)²/8 mm = 6.5e-5 µm.
            let error = 1e3 * brute - period.contour_error_um.abs();
            assert!(error.abs() < 7e-5, "{} at {}: {error}", case.name, period.k);
        }
    }
}

#[test]
fn validates_the_global_nearest_point_on_random_splines_near_and_far() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(40);
    for case in 0..200 {
        let count = rng.random_range(3..12);
        let closed = case % 2 == 0;
        let points = if closed { random_ring(&mut rng, count) } else { random_walk(&mut rng, count, 1.5) };
        let Ok(path) = PhSpline::from_nodal_points(&points, closed, None) else { continue };
        let length = path.length_mm();
        for _ in 0..5 {
            let far: f64 = 10.0_f64.powf(rng.random_range(-4.0..0.3)) * length;
            let s = rng.random_range(0.0..length);
            let angle: f64 = rng.random_range(-3.2..3.2);
            let p = path.point_mm(s, &mut Cursor::default()) + Vector2::new(angle.cos(), angle.sin()) * far;
            // A cursor that knows nothing, and the whole path in reach.
            let found = nearest_in_window(&path, &p, s, length, &mut Cursor::at(0, 0.3));
            let pieces = 5_000;
            let brute = polyline_distance(&path, &p, 0.0, length, pieces);
            let sag = path.max_curvature_1_mm() * (length / pieces as f64).powi(2) / 8.0;
            let miss = (found.distance_mm - brute).abs();
            assert!(miss < sag + 1e-9 + 1e-12 * far, "case {case}: {} {brute}: {points:?} {p}", found.distance_mm);
        }
    }
}

#[test]
fn validates_the_nearest_point_where_all_or_many_are_equally_near() {
    // The centre of a circle, and of splines that are nearly circles: the hardest case for branch and bound.
    let circle = Circle::new(Vector2::new(3.0, -2.0), 10.0, 0.5, false).unwrap();
    let found = nearest_in_window(&circle, &Vector2::new(3.0, -2.0), 1.0, 1e3, &mut Cursor::default());
    assert!((found.distance_mm - 10.0).abs() < 1e-9);
    let points: Vec<_> = (0..8)
        .map(|i| std::f64::consts::TAU * f64::from(i) / 8.0)
        .map(|t| Vector2::new(10.0 * t.cos(), 10.0 * t.sin()))
        .collect();
    let ring = PhSpline::from_nodal_points(&points, true, None).unwrap();
    let found = nearest_in_window(&ring, &Vector2::zeros(), 1.0, 1e3, &mut Cursor::default());
    let brute = polyline_distance(&ring, &Vector2::zeros(), 0.0, ring.length_mm(), 200_000);
    assert!((found.distance_mm - brute).abs() < 2e-9, "{} {brute}", found.distance_mm);
}

#[test]
fn validates_that_a_crossing_is_measured_on_its_own_branch() {
    // Alpha crosses itself. At the crossing the tool is put 50 µm to the left of either branch: nearer to the other one.
    let case = Case::alpha();
    let length = case.path.length_mm();
    let at = |s: f64| case.path.frame(s, &mut Cursor::default());
    // By symmetry about y = 9 the branches meet where y = 9 on the recovery ramp.
    let (mut low, mut high) = (1.0, 30.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if at(middle).point_mm.y < 9.0 { low = middle } else { high = middle }
    }
    let crossing = low;
    assert!((at(crossing).point_mm - at(length - crossing).point_mm).norm() < 1e-9, "the branches cross");
    for s in [crossing, length - crossing] {
        for side in [-0.05, 0.05] {
            let frame = at(s);
            let left = Vector2::new(-frame.tangent.y, frame.tangent.x);
            let actual = frame.point_mm + left * side;
            let other = if s == crossing { length - crossing } else { crossing };
            let across = polyline_distance(&case.path, &actual, other - 1.0, other + 1.0, 20_000);
            assert!(across < 0.0499, "the other branch is nearer: {across}");
            let mut meter = ContourMeter::new(&case.path);
            let error = meter.measure(&actual, &frame.point_mm, s);
            assert!((error.signed_mm - side).abs() < 1e-9, "{error:?} {side}");
            assert!((error.s_mm - s).abs() < 1e-6);
        }
    }
}

#[test]
fn validates_that_a_hairpin_is_measured_on_its_own_leg() {
    // Two legs 1 mm apart. The setpoint stands 0.5 mm before the turn, the tool 0.6 mm aside, towards the other leg: 0.4 mm from
    // it, whose foot is 2.57 mm of arc length away. Within π · 0.6 mm the nearest point is the setpoint itself.
    let leg = |y: f64, i: i32| Vector2::new(0.5 * f64::from(i), y);
    let turn =
        |i: i32| Vector2::new(5.0 + 0.5 * (PI * f64::from(i) / 8.0).sin(), 0.5 - 0.5 * (PI * f64::from(i) / 8.0).cos());
    let points: Vec<_> =
        (0..10).map(|i| leg(0.0, i)).chain((0..=8).map(turn)).chain((0..10).rev().map(|i| leg(1.0, i))).collect();
    let path = PhSpline::from_nodal_points(&points, false, None).unwrap();
    let setpoint = Vector2::new(4.5, 0.0);
    let s = path.lengths_at_nodes_mm()[9];
    let error = ContourMeter::new(&path).measure(&(setpoint + Vector2::new(0.0, 0.6)), &setpoint, s);
    assert!((error.signed_mm - 0.6).abs() < 1e-3 && (error.s_mm - s).abs() < 0.05, "{error:?}");
    // A tool that has cut the corner is measured against all that it could be near to: half a circle of the tracking error.
    let before = path.lengths_at_nodes_mm()[10];
    let tool = Vector2::new(5.0, 0.9);
    let error = ContourMeter::new(&path).measure(&tool, &Vector2::new(5.0, 0.0), before);
    assert!((error.signed_mm - 0.1).abs() < 5e-3, "{error:?}");
}

#[test]
fn validates_the_sign_and_the_ends_of_an_open_path() {
    let line = Line::new(Vector2::new(0.0, 0.0), Vector2::new(10.0, 0.0)).unwrap();
    let measure = |x: f64, y: f64, s: f64| {
        let mut meter = ContourMeter::new(&line);
        meter.measure(&Vector2::new(x, y), &Vector2::new(s, 0.0), s).signed_mm
    };
    assert_eq!(measure(5.0, 0.25, 5.1), 0.25);
    assert_eq!(measure(5.0, -0.25, 5.1), -0.25);
    assert!((measure(-3.0, 4.0, 0.0) - 5.0).abs() < 1e-12, "before the start: the distance to it");
    assert!((measure(13.0, -4.0, 10.0) + 5.0).abs() < 1e-12, "past the end: the distance to it");
}

#[test]
fn validates_mirror_images_offsets_and_units() {
    let case = Case::alpha();
    let run = |points: Vec<Vector2<f64>>, axes, settings: LoopSettings| -> Vec<(f64, f64)> {
        let path = PhSpline::from_control_points(&points, false).unwrap();
        let motion = Motion::plan(path.length_mm(), 100.0, PROFILE).unwrap();
        Simulation::new(&path, &motion, axes, settings)
            .unwrap()
            .map(|p| (p.contour_error_um, p.axes[0].voltage_v))
            .collect()
    };
    let points: Vec<_> = ALPHA.iter().map(|&p| Vector2::from(p)).collect();
    let settings = LoopSettings::default();
    let plain = run(points.clone(), case.axes, settings);
    // Mirrored in X: left becomes right, the X voltage changes its sign.
    let mirrored = run(points.iter().map(|p| Vector2::new(-p.x, p.y)).collect(), case.axes, settings);
    // Moved: nothing changes.
    let moved = run(points.iter().map(|p| p + Vector2::new(250.0, -120.0)).collect(), case.axes, settings);
    // X and Y exchanged, axes too: a mirror image in the diagonal.
    let swapped = [case.axes[1], case.axes[0]];
    let exchanged = run(points.iter().map(|p| Vector2::new(p.y, p.x)).collect(), swapped, settings);
    for k in 0..plain.len() {
        assert!((plain[k].0 + mirrored[k].0).abs() < 1e-6, "k {k}");
        assert!((plain[k].1 + mirrored[k].1).abs() < 1e-9, "k {k}");
        assert!((plain[k].0 - moved[k].0).abs() < 1e-6, "k {k}: {} {}", plain[k].0, moved[k].0);
        assert!((plain[k].0 + exchanged[k].0).abs() < 1e-6, "k {k}");
    }
    // Units: a path, feed and transmission in inches with gains per inch gives the same voltages, and errors in inches.
    let inch = 25.4;
    let axes = case.axes.map(|mut axis| {
        axis.drive.transmission_mm_rad /= inch;
        axis.pdff.kpp_rad_s_mm *= inch;
        axis.pdff.kpf_rad_mm *= inch;
        axis
    });
    let path = PhSpline::from_control_points(&points.iter().map(|p| p / inch).collect::<Vec<_>>(), false).unwrap();
    // The modification of the paper is 1 mm/s² exp(n_c τ): not free of units, so the quintic stands in.
    let quintic = Profile::Quintic { phase_s: 0.1 };
    let motion = Motion::plan(path.length_mm(), 100.0 / inch, quintic).unwrap();
    let inches = Simulation::new(&path, &motion, axes, settings).unwrap();
    for (metric, imperial) in case.simulation(quintic).zip(inches) {
        assert!((metric.contour_error_um - inch * imperial.contour_error_um).abs() < 1e-6, "k {}", metric.k);
        assert!((metric.axes[1].voltage_v - imperial.axes[1].voltage_v).abs() < 1e-9, "k {}", metric.k);
    }
}

#[test]
fn validates_mirror_images_and_offsets_on_random_paths() {
    // Random paths, saturated or not: the mirror image errs to the other side, the moved path as the path itself.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(41);
    let axes = Case::alpha().axes;
    let settings = LoopSettings { settling_s: 0.02, ..LoopSettings::default() };
    for case in 0..1000 {
        let points = random_walk(&mut rng, 6, 0.8);
        let (x, y) = (rng.random_range(-300.0..300.0), rng.random_range(-300.0..300.0));
        let run = |points: Vec<Vector2<f64>>| -> Vec<(f64, f64)> {
            let path = PhSpline::from_nodal_points(&points, false, None).unwrap();
            let length = path.length_mm();
            let motion = Motion::plan(length, length / 0.06, Profile::Quintic { phase_s: 0.02 }).unwrap();
            let simulation = Simulation::new(&path, &motion, axes, settings).unwrap();
            simulation.map(|p| (p.contour_error_um, p.axes[1].voltage_v)).collect()
        };
        let plain = run(points.clone());
        let mirrored = run(points.iter().map(|p| Vector2::new(p.x, -p.y)).collect());
        let moved = run(points.iter().map(|p| p + Vector2::new(x, y)).collect());
        assert!(plain.len() > 90, "case {case}");
        // A coordinate of 1000 mm is rounded to 1e-13 mm; the contouring error of a large one to its own last digits.
        for k in 0..plain.len() {
            let slack = 1e-6 + 1e-9 * plain[k].0.abs();
            assert!((plain[k].0 + mirrored[k].0).abs() < slack, "case {case} k {k}: {:?} {:?}", plain[k], mirrored[k]);
            assert!((plain[k].1 + mirrored[k].1).abs() < 1e-9, "case {case} k {k}");
            assert!((plain[k].0 - moved[k].0).abs() < slack, "case {case} k {k}: {:?} {:?}", plain[k], moved[k]);
        }
    }
}

#[test]
fn validates_that_setpoints_lie_where_the_motion_says() {
    // s(ξ_k) = s(t_k) within 1e-12 mm, read back from the parameter that the cursor holds, and a constant feed in the cruise.
    for case in Case::both() {
        let motion = case.motion(PROFILE);
        let mut cursor = Cursor::default();
        for k in 0..=3000 {
            let s = motion.at(f64::from(k) * 1e-3).s_mm;
            let frame = case.path.frame(s, &mut cursor);
            // The arc length of the very parameter that was found.
            let back = case.path.nearest_local(&frame.point_mm, &mut Cursor::at(cursor.segment, cursor.xi));
            assert!((back.s_mm - s).abs() < 1e-12 * s.max(1.0), "{} k {k}: {} {s}", case.name, back.s_mm);
        }
        let setpoints: Vec<_> = Interpolator::new(&case.path, &motion, 1e-3).collect();
        assert_eq!(setpoints.len() as f64, (motion.total_s() * 1e3).ceil() + 1.0);
        let end = setpoints.last().unwrap();
        assert_eq!((end.s_mm, end.feed_mm_s), (case.path.length_mm(), 0.0));
        for pair in setpoints.windows(2) {
            let steady = |p: &servosim::interpolator::Setpoint<2>| p.feed_mm_s == 100.0;
            if steady(&pair[0]) && steady(&pair[1]) {
                assert!((pair[1].s_mm - pair[0].s_mm - 0.1).abs() < 1e-12 * pair[1].s_mm.max(1.0));
            }
        }
    }
}

#[test]
fn validates_the_papers_joint_check() {
    // Differentiating the sampled chord |r_k - r_{k-1}|/Δt in the constant-feed part: what is left is chord against arc,
    // v (1 - κ² Δs²/24) with κ in the middle of the chord. The specification prints 0.011 and 5.8 for alpha, 0.0020 and 1.9
    // for heart; the last is 2.1 here.
    for (case, accel, jerk) in [(Case::alpha(), "0.011", "5.8"), (Case::heart(), "0.0020", "2.1")] {
        let motion = case.motion(PROFILE);
        let steady: Vec<_> = Interpolator::new(&case.path, &motion, 1e-3)
            .filter(|p| p.time_s > motion.phase_s() && p.time_s < motion.phase_s() + motion.cruise_s())
            .collect();
        let chord: Vec<f64> = steady.windows(2).map(|p| (p[1].position_mm - p[0].position_mm).norm() / 1e-3).collect();
        let mut cursor = Cursor::default();
        let bend: Vec<f64> = steady
            .windows(2)
            .map(|p| {
                let kappa = case.path.frame(0.5 * (p[0].s_mm + p[1].s_mm), &mut cursor).curvature_1_mm.norm();
                100.0 * (1.0 - (0.1 * kappa).powi(2) / 24.0)
            })
            .collect();
        let jumps = |feed: &[f64]| {
            let rate = |v: &[f64]| v.windows(2).map(|v| (v[1] - v[0]) / 1e-3).collect::<Vec<f64>>();
            let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let a = rate(feed);
            (largest(&a), largest(&rate(&a)))
        };
        let ((a, j), (a_bend, j_bend)) = (jumps(&chord), jumps(&bend));
        let decimals = accel.len() - 2;
        assert_eq!(format!("{a:.decimals$}"), accel, "{}", case.name);
        assert_eq!(format!("{j:.1}"), jerk, "{}", case.name);
        // The largest acceleration agrees with curvature alone. The jerk peaks at joints, where κ' jumps inside a chord: its
        // middle then exaggerates.
        assert!((a - a_bend).abs() < 1e-3 * a && j < j_bend && j_bend < 1.2 * j, "{a} {a_bend} {j} {j_bend}");
    }
}

#[test]
fn validates_commanded_velocity_acceleration_and_jerk_against_differences() {
    for case in Case::both() {
        let h = 1e-5;
        let motion = case.motion(PROFILE);
        let mut fine = Interpolator::new(&case.path, &motion, h);
        let nodes = case.path.lengths_at_nodes_mm().to_vec();
        for k in (200..fine.last_sample() - 200).step_by(997) {
            let (before, here, after) = (fine.setpoint(k - 1), fine.setpoint(k), fine.setpoint(k + 1));
            // The jerk jumps at the joints of a C2 path.
            if nodes.iter().any(|node| (node - here.s_mm).abs() < 0.01) {
                continue;
            }
            let velocity = (after.position_mm - before.position_mm) / (2.0 * h);
            assert!((velocity - here.velocity_mm_s).norm() < 1e-4, "{} k {k}", case.name);
            let acceleration = (after.velocity_mm_s - before.velocity_mm_s) / (2.0 * h);
            assert!((acceleration - here.acceleration_mm_s2).norm() < 1e-2, "{} k {k}", case.name);
            let jerk = (after.acceleration_mm_s2 - before.acceleration_mm_s2) / (2.0 * h);
            assert!((jerk - here.jerk_vector_mm_s3).norm() < 1e-5 * 50_000.0 + 2.0, "{} k {k}", case.name);
        }
    }
}
