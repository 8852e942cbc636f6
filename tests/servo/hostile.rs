//! Hostile inputs through the public interface: no panic, no hang, no wrong figure.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;

use crate::common::{Case, PROFILE};
use nalgebra::Vector2;
use servosim::contour::ContourMeter;
use servosim::feedrate::{BernsteinPhase, FeedState, FeedrateError, Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::limits::Limits;
use servosim::parameters::OutOfRange;
use servosim::path::{Circle, Cursor, Line, Path, PathError, PhSpline, nearest_in_window};
use servosim::servo::{AxisLoop, AxisParameters, Drive, LockupWatch, LoopSettings, Pdff, Plant};
use servosim::simulation::{Ending, MAX_PERIODS, Simulation, SimulationError};
use servosim::summary::SummaryObserver;

type V = Vector2<f64>;

fn alpha() -> PhSpline {
    Case::alpha().path
}

fn heart() -> PhSpline {
    Case::heart().path
}

/// A wave of many short segments: `n` points `h` mm apart in x.
fn dense_wave(n: u32, h: f64) -> PhSpline {
    let points: Vec<V> = (0..n).map(|i| f64::from(i) * h).map(|x| V::new(x, 5.0 * (0.2 * x).sin())).collect();
    PhSpline::from_nodal_points(&points, false, None).unwrap()
}

#[test]
fn any_cursor_and_any_arc_length_give_a_point_of_the_path() {
    let circle = Circle::new(V::new(1.0, 2.0), 3.0, 0.5, true).unwrap();
    let line = Line::new(V::new(1.0, 2.0), V::new(3.0, 4.0)).unwrap();
    let (alpha, heart) = (alpha(), heart());
    let paths: [&dyn Path<2>; 4] = [&alpha, &heart, &circle, &line];
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 0.5, 1.0, 1e300];
    for path in paths {
        let length = path.length_mm();
        for segment in [0, 1, 3, usize::MAX] {
            for xi in odd {
                for advance in odd {
                    let cursor = Cursor { segment, xi, advance, change: advance };
                    for s in [f64::NAN, f64::NEG_INFINITY, -1.0, 0.0, 0.3 * length, length, 2.0 * length, f64::INFINITY]
                    {
                        let clamped = if s > 0.0 { s.min(length) } else { 0.0 };
                        let frame = path.frame(s, &mut cursor.clone());
                        let plain = path.frame(clamped, &mut Cursor::default());
                        assert!((frame.point_mm - plain.point_mm).norm() < 1e-12, "{cursor:?} at {s}: {frame:?}");
                        assert!((path.point_mm(s, &mut cursor.clone()) - plain.point_mm).norm() < 1e-12);
                    }
                    // At the circle's centre every point is as near as every other.
                    for p in [V::new(1.0, 2.0), V::new(50.0, 60.0), V::new(-1e9, 1e9)] {
                        let foot = path.nearest_local(&p, &mut cursor.clone());
                        assert!(foot.point_mm.iter().all(|x| x.is_finite()), "{cursor:?} from {p}: {foot:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn any_window_has_an_answer() {
    // A window that is not a number was searched for ever.
    let line = Line::new(V::new(0.0, 0.0), V::new(10.0, 0.0)).unwrap();
    let (alpha, heart) = (alpha(), heart());
    let paths: [&dyn Path<2>; 3] = [&line, &alpha, &heart];
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e9, -1.0, 0.0, 1e-300, 1.0, 1e9, 1e300];
    for path in paths {
        for around in odd {
            for reach in odd {
                for p in [V::new(3.0, 4.0), V::new(1e9, -1e9), V::new(1e200, 0.0), V::new(f64::NAN, 0.0)] {
                    let found = nearest_in_window(path, &p, around, reach, &mut Cursor::default());
                    assert!((0.0..=path.length_mm()).contains(&found.foot.s_mm), "{around} {reach} {p}: {found:?}");
                    let distance = (found.foot.point_mm - p).norm();
                    assert!(found.distance_mm == distance || distance.is_nan(), "{around} {reach} {p}: {found:?}");
                    if !(around.is_finite() && reach >= 0.0) && p.x == 3.0 {
                        let whole = nearest_in_window(path, &p, 0.0, 1e9, &mut Cursor::default());
                        assert_eq!(found.distance_mm, whole.distance_mm, "not a window: the whole path");
                    }
                }
            }
        }
    }
    // Arc lengths of a closed path are taken modulo its length.
    let p = heart.point_mm(20.0, &mut Cursor::default());
    let found = nearest_in_window(&heart, &p, 20.0 - 3.0 * heart.length_mm(), 1.0, &mut Cursor::default());
    assert!(found.distance_mm < 1e-9 && (found.foot.s_mm - 20.0).abs() < 1e-6, "{found:?}");
}

#[test]
fn validates_the_contouring_error_on_a_dense_spline() {
    // A CAM path has segments far shorter than the tool moves in a period: 1000 of them here. The tool runs 0.15 mm behind
    // and 20 µm to the left.
    let path = dense_wave(50_000, 1e-4);
    let mut meter = ContourMeter::new(&path);
    for k in 0..45 {
        let s = 0.2 + 0.1 * f64::from(k);
        let setpoint = path.point_mm(s, &mut Cursor::default());
        let foot = path.frame(s - 0.15, &mut Cursor::default());
        let tool = foot.point_mm + V::new(-foot.tangent.y, foot.tangent.x) * 0.02;
        let error = meter.measure(&tool, &setpoint, s);
        assert!((error.signed_mm - 0.02).abs() < 1e-9, "k {k}: {error:?}");
        assert!((error.s_mm - (s - 0.15)).abs() < 1e-6, "k {k}: {error:?}");
    }
    // The local search alone crosses 49 999 segments too.
    let target = path.frame(path.length_mm() - 0.01, &mut Cursor::default());
    let foot = path.nearest_local(&target.point_mm, &mut Cursor::default());
    assert!((foot.s_mm - target.s_mm).abs() < 1e-9, "{foot:?} {target:?}");
}

#[test]
fn validates_that_far_tools_and_centres_of_curvature_cost_little() {
    // Questions answered with at most so many frames; each costs about 0.1 µs in release.
    struct Counted<'a>(&'a PhSpline, std::sync::atomic::AtomicUsize);
    impl Counted<'_> {
        fn count(&self) {
            self.1.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
    }
    impl Path<2> for Counted<'_> {
        fn length_mm(&self) -> f64 {
            self.0.length_mm()
        }
        fn is_closed(&self) -> bool {
            self.0.is_closed()
        }
        fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> servosim::path::Frame<2> {
            self.count();
            self.0.frame(s_mm, cursor)
        }
        fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
            self.0.curvature_bound_1_mm(from_mm, to_mm)
        }
        fn nearest_local(&self, point_mm: &V, cursor: &mut Cursor) -> servosim::path::Foot<2> {
            self.0.nearest_local(point_mm, cursor)
        }
    }
    let frames = |path: &PhSpline, p: V| {
        let counted = Counted(path, std::sync::atomic::AtomicUsize::new(0));
        let found = nearest_in_window(&counted, &p, 1.0, 1e9, &mut Cursor::default());
        (counted.1.into_inner(), found.distance_mm)
    };
    let ring = |n: u32, radius: f64| {
        let points: Vec<V> = (0..n)
            .map(|i| TAU * f64::from(i) / f64::from(n))
            .map(|t| V::new(radius * t.cos(), radius * t.sin()))
            .collect();
        PhSpline::from_nodal_points(&points, true, None).unwrap()
    };
    for (n, radius, most) in [(8, 10.0, 1000), (1000, 10.0, 5000), (1000, 1000.0, 12_000)] {
        let path = ring(n, radius);
        let (count, distance) = frames(&path, V::zeros());
        assert!(count < most && (distance - radius).abs() < 1e-2 * radius, "{n} {radius}: {count} {distance}");
        let (count, distance) = frames(&path, V::new(1e-3 * radius, 0.0));
        assert!(count < 1000 && (distance - 0.999 * radius).abs() < 1e-2 * radius, "{n} {radius}: {count} {distance}");
        let (count, _) = frames(&path, V::new(0.0, 1e6));
        assert!(count < 200, "{n} {radius} from far away: {count}");
    }
    let wave = dense_wave(100_000, 0.1);
    for p in [V::new(5000.0, 3000.0), V::new(-1e8, 3.0), V::new(5000.0, 40.0)] {
        let (count, _) = frames(&wave, p);
        assert!(count < 2000, "{p}: {count}");
    }
}

#[test]
fn the_nearest_point_does_not_rest_on_a_local_search_that_gives_up() {
    // A path of one's own whose local search does nothing: its cursor's point is no foot.
    struct Lazy(PhSpline);
    impl Path<2> for Lazy {
        fn length_mm(&self) -> f64 {
            self.0.length_mm()
        }
        fn is_closed(&self) -> bool {
            self.0.is_closed()
        }
        fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> servosim::path::Frame<2> {
            self.0.frame(s_mm, cursor)
        }
        fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
            self.0.curvature_bound_1_mm(from_mm, to_mm)
        }
        fn nearest_local(&self, _: &V, cursor: &mut Cursor) -> servosim::path::Foot<2> {
            self.0.frame(cursor.xi, cursor).into()
        }
    }
    let lazy = Lazy(alpha());
    for s in [0.0, 0.7, 5.0, 50.0, lazy.length_mm()] {
        let here = lazy.frame(s, &mut Cursor::default());
        let p = here.point_mm + V::new(-here.tangent.y, here.tangent.x) * 0.02;
        let found = nearest_in_window(&lazy, &p, s, 0.9, &mut Cursor::at(0, 0.3));
        assert!((found.distance_mm - 0.02).abs() < 1e-9 && (found.foot.s_mm - s).abs() < 1e-6, "{s}: {found:?}");
    }
}

#[test]
fn the_nearest_point_stays_on_a_joint_and_passes_the_seam() {
    let heart = heart();
    for (i, &node) in heart.lengths_at_nodes_mm().iter().enumerate() {
        let here = heart.frame(node, &mut Cursor::default());
        for side in [-0.5, -1e-9, 0.0, 1e-9, 0.5] {
            let p = here.point_mm + V::new(-here.tangent.y, here.tangent.x) * side;
            let mut cursor = Cursor::at(i, 0.5);
            let found = nearest_in_window(&heart, &p, node, 3.0, &mut cursor);
            assert!((found.distance_mm - f64::abs(side)).abs() < 1e-9, "joint {i}, {side}: {found:?}");
            let error = ContourMeter::new(&heart).measure(&p, &here.point_mm, node);
            assert!((error.signed_mm - side).abs() < 1e-9, "joint {i}, {side}: {error:?}");
        }
    }
    // Followed around, across the seam in both directions.
    let length = heart.length_mm();
    let mut cursor = Cursor::default();
    for i in -20..20 {
        let s = (f64::from(i) * 0.5).rem_euclid(length);
        let here = heart.frame(s, &mut Cursor::default());
        let foot =
            heart.nearest_local(&(here.point_mm + here.tangent.yx().component_mul(&V::new(-0.2, 0.2))), &mut cursor);
        assert!((foot.point_mm - here.point_mm).norm() < 1e-9, "{i}: {foot:?}");
    }
}

#[test]
fn odd_but_sound_paths_are_made() {
    let line = |n: usize| (0..n).map(|i| V::new(i as f64, 2.0 * i as f64)).collect::<Vec<_>>();
    for n in [4, 5, 6, 30] {
        let straight = PhSpline::from_control_points(&line(n), false).unwrap();
        assert!((straight.length_mm() - line(n)[n - 1].norm()).abs() < 1e-9, "{}", straight.length_mm());
        assert!(straight.max_curvature_1_mm() < 1e-12);
        // Quadrature of rounding noise took a third of a second a segment.
        let start = std::time::Instant::now();
        assert!(straight.bending_energy_1_mm() < 1e-20);
        assert!(start.elapsed().as_millis() < 20 * n as u128, "{:?}", start.elapsed());
    }
    let triangle = [V::new(0.0, 0.0), V::new(30.0, 0.0), V::new(10.0, 20.0)];
    for path in [
        PhSpline::from_nodal_points(&triangle, true, None).unwrap(),
        PhSpline::from_control_points(&triangle, true).unwrap(),
    ] {
        assert!(path.is_closed() && path.lengths_at_nodes_mm().len() == 4);
    }
    let two = PhSpline::from_nodal_points(&triangle[..2], false, None).unwrap();
    assert!((two.length_mm() - 30.0).abs() < 1e-12);
    // Control points may repeat inside as long as the nodal points differ.
    let repeated = [[0., 0.], [10., 0.], [10., 0.], [20., 5.], [30., 5.]].map(V::from);
    assert!(PhSpline::from_control_points(&repeated, false).is_ok());
    // End tangents of any direction but straight back turn with the chord or are refused.
    for i in (0..36).step_by(3) {
        for j in (1..36).step_by(5) {
            for size in [3.0, 10.0, 30.0] {
                let tangent =
                    |k: i32| V::new((PI * f64::from(k) / 18.0).cos(), (PI * f64::from(k) / 18.0).sin()) * size;
                let ends = (tangent(i), tangent(j));
                match PhSpline::from_nodal_points(&[V::zeros(), V::new(10.0, 0.0)], false, Some(ends)) {
                    Ok(path) => {
                        let mut cursor = Cursor::default();
                        let mut at = |s: f64| path.frame(s, &mut cursor).tangent;
                        let n = 600;
                        let length = path.length_mm();
                        let turn: f64 = (0..n)
                            .map(|k| {
                                let (a, b) = (
                                    at(length * f64::from(k) / f64::from(n)),
                                    at(length * f64::from(k + 1) / f64::from(n)),
                                );
                                a.perp(&b).atan2(a.dot(&b))
                            })
                            .sum();
                        let wanted = ends.1.y.atan2(ends.1.x) - ends.0.y.atan2(ends.0.x);
                        assert!((turn - wanted).abs() < 1e-6, "{i} {j} {size}: {turn} {wanted}");
                    }
                    Err(PathError::Reversal { .. } | PathError::WrongRoot { .. }) => {}
                    Err(other) => panic!("{i} {j} {size}: {other}"),
                }
            }
        }
    }
}

#[test]
fn absurd_periods_neither_panic_nor_lose_the_end() {
    let path = alpha();
    let motion = Motion::plan(path.length_mm(), 100.0, PROFILE).unwrap();
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let stream = Interpolator::new(&path, &motion, period);
        assert_eq!(stream.size_hint(), (1, Some(1)), "{period}");
        let all: Vec<_> = stream.collect();
        assert!(all.len() == 1 && all[0].time_s == 0.0 && all[0].s_mm == 0.0, "{period}: {all:?}");
    }
    // Far more setpoints than can be counted.
    let endless = Interpolator::new(&path, &motion, 1e-300);
    assert_eq!((endless.last_sample(), endless.size_hint().0), (u64::MAX, usize::MAX));
    // Periods longer than the motion, and such that a remainder of rounding size is left: the last setpoint rests on the end.
    for period in [1e300, 10.0, motion.total_s(), motion.total_s() / 7.0, motion.total_s() / 7.0 * (1.0 - 1e-15)] {
        let all: Vec<_> = Interpolator::new(&path, &motion, period).collect();
        assert_eq!(all.len(), if period < 1.0 { 8 } else { 2 }, "{period}");
        let end = all.last().unwrap();
        assert!(end.s_mm == path.length_mm() && end.feed_mm_s == 0.0 && end.jerk_mm_s3 == 0.0, "{period}: {end:?}");
    }
    // A remainder that is not of rounding size is a period, in a long run too.
    let motion = Motion::plan(1000.0, 1.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
    let period = motion.total_s() / (1e6 + 1e-4);
    assert_eq!(Interpolator::new(&path, &motion, period).last_sample(), 1_000_001);
}

#[test]
fn the_longest_run_is_accepted_and_one_period_more_refused() {
    let case = Case::alpha();
    let motion = case.motion(PROFILE);
    let moving = Interpolator::new(&case.path, &motion, 1e-3).last_sample();
    let of = |settling: u64| {
        let settings = LoopSettings { settling_s: settling as f64 * 1e-3, ..LoopSettings::default() };
        Simulation::new(&case.path, &motion, case.axes, settings).map(|s| s.samples())
    };
    assert_eq!(of(MAX_PERIODS - moving - 1).unwrap(), MAX_PERIODS);
    assert!(matches!(of(MAX_PERIODS - moving), Err(SimulationError::TooLong { .. })));
    for period_s in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        let settings = LoopSettings { period_s, ..LoopSettings::default() };
        let error = Simulation::new(&case.path, &motion, case.axes, settings).err();
        assert!(matches!(error, Some(SimulationError::Parameter(_))), "{period_s}: {error:?}");
    }
    for settling_s in [-1.0, f64::NAN, f64::INFINITY] {
        let settings = LoopSettings { settling_s, ..LoopSettings::default() };
        assert!(matches!(
            Simulation::new(&case.path, &motion, case.axes, settings),
            Err(SimulationError::Parameter(_))
        ));
    }
}

#[test]
fn tiny_and_huge_motions_are_planned_or_refused_by_name() {
    let sizes = [5e-324, 1e-320, 1e-100, 1e-9, 1e-3, 1.0, 1e3, 1e9, 1e100];
    for length in sizes {
        for feed in sizes {
            for a in sizes {
                for b in [1e-9, 1.0, 1e9, 1e-300] {
                    for profile in [
                        Profile::Linear { phase_s: a },
                        Profile::Cubic { phase_s: a },
                        Profile::Quintic { phase_s: a },
                        Profile::Exponential { phase_s: a, n_c: 8.0 },
                        Profile::JerkLimited { accel_mm_s2: a, jerk_mm_s3: b },
                    ] {
                        let what = format!("{length:e} {feed:e} {profile:?}");
                        match Motion::plan(length, feed, profile) {
                            Err(FeedrateError::OutOfRange(OutOfRange { value, .. })) => {
                                assert!(!(1e-9..=1e9).contains(&value), "{what}: the value as given is named");
                            }
                            Err(_) => {}
                            Ok(motion) => {
                                assert!(motion.total_s().is_finite() && motion.feed_mm_s() > 0.0, "{what}: {motion:?}");
                                for i in 0..=8 {
                                    let at = motion.at(motion.total_s() * f64::from(i) / 8.0);
                                    let sound = at.feed_mm_s.is_finite()
                                        && at.accel_mm_s2.is_finite()
                                        && at.jerk_mm_s3.is_finite();
                                    assert!(sound && at.s_mm.abs() <= length * (1.0 + 1e-6), "{what}: {at:?}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let (rest, state) = (FeedState::steady(0.0), FeedState { accel_mm_s2: bad, ..FeedState::steady(1.0) });
        assert!(matches!(
            BernsteinPhase::quintic(rest, state, 1.0),
            Err(FeedrateError::OutOfRange(error)) if error.name() == "accel_mm_s2"
        ));
        assert!(BernsteinPhase::cubic(state, rest, 1.0).is_err() && BernsteinPhase::linear(0.0, bad, 1.0).is_err());
    }
}

#[test]
fn a_modification_too_strong_for_the_feed_is_refused_on_short_paths_and_at_low_feeds() {
    // exp(8.12) mm/s² at 1 mm/s: the feed would swing between -69 % and +169 %, on a short path as on a long one.
    for length in [100.0, 0.05, 1e-3] {
        let error = Motion::plan(length, 1.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 }).unwrap_err();
        assert!(matches!(error, FeedrateError::NotMonotone { .. }), "{length}: {error}");
    }
    // What is accepted hardly moves back.
    for phase_s in [0.1, 1.0, 10.0] {
        for n_c in [1.0, 2.0, 3.0, 5.0, 8.12] {
            for i in -8..12 {
                let feed = 10.0_f64.powf(f64::from(i) / 4.0);
                let Ok(motion) = Motion::plan(1e3, feed, Profile::Exponential { phase_s, n_c }) else { continue };
                for k in 0..=500 {
                    let v = motion.at(motion.phase_s() * f64::from(k) / 500.0).feed_mm_s;
                    assert!(v > -3e-3 * feed && v < 1.003 * feed, "{feed} {phase_s} {n_c}: {v}");
                }
            }
        }
    }
}

#[test]
fn validates_the_plant_far_below_its_time_constant() {
    // One volt for one period: θ = K (Δt²/2τ)(1 - Δt/3τ + …), which Δt - τ(1 - exp(-Δt/τ)) would lose to cancellation.
    for (dt, tau) in [(1e-3, 0.2), (1e-4, 1.0001), (1e-4, 0.9999), (1e-6, 10.0), (1e-9, 1e9)] {
        let axis = AxisParameters {
            plant: Plant { gain_rad_s_v: 50.0, time_constant_s: tau },
            drive: Drive { transmission_mm_rad: 1.0, torque_to_voltage_v_nm: 1.0, voltage_limit_v: 1.0 },
            pdff: Pdff { kpp_rad_s_mm: 1e6, kpv_nm_s_rad: 1.0, kiv_1_s: 0.0, kpf_rad_mm: 0.0, kvf: 1.0 },
        };
        axis.check().unwrap();
        let mut plant = AxisLoop::new(&axis, &LoopSettings { period_s: dt, ..LoopSettings::default() }, 0.0);
        plant.step(1e6, 0.0);
        let theta = plant.step(1e6, 0.0).actual_mm;
        let x = dt / tau;
        let exact = 50.0 * dt * x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0))));
        assert!((theta - exact).abs() < 1e-11 * exact, "{dt} {tau}: {theta} {exact}");
    }
}

#[test]
fn values_that_would_divide_to_infinity_are_refused_by_name() {
    let good = Case::alpha().axes[0];
    for bad in [0.0, -1.0, 1e-320, 1e-10, 1e10, f64::NAN, f64::INFINITY] {
        let with = |change: &dyn Fn(&mut AxisParameters)| {
            let mut axis = good;
            change(&mut axis);
            axis.check().unwrap_err().name()
        };
        assert_eq!(with(&|a| a.plant.gain_rad_s_v = bad), "gain_rad_s_v");
        assert_eq!(with(&|a| a.plant.time_constant_s = bad), "time_constant_s");
        assert_eq!(with(&|a| a.drive.transmission_mm_rad = bad), "transmission_mm_rad");
        assert_eq!(with(&|a| a.drive.torque_to_voltage_v_nm = bad), "torque_to_voltage_v_nm");
        assert_eq!(with(&|a| a.drive.voltage_limit_v = bad), "voltage_limit_v");
    }
    for bad in [-1e-9, 1e10, f64::NAN, f64::INFINITY] {
        let with = |change: &dyn Fn(&mut Pdff)| {
            let mut axis = good;
            change(&mut axis.pdff);
            axis.check().unwrap_err().name()
        };
        assert_eq!(with(&|g| g.kpp_rad_s_mm = bad), "kpp");
        assert_eq!(with(&|g| g.kpv_nm_s_rad = bad), "kpv");
        assert_eq!(with(&|g| g.kiv_1_s = bad), "kiv");
        assert_eq!(with(&|g| g.kpf_rad_mm = bad), "kpf");
        assert_eq!(with(&|g| g.kvf = bad), "kvf");
    }
}

#[test]
fn a_watch_takes_any_sample_number() {
    for period in [0.0, f64::NAN, f64::INFINITY, 1e-300, 1e-3] {
        let mut watch = LockupWatch::new(period);
        for k in [5, 3, 0, u64::MAX, 1, u64::MAX - 1] {
            watch.watch(k, 5.0, true, 1.0);
            watch.watch(k, f64::NAN, false, f64::NAN);
        }
    }
}

#[test]
fn a_stop_after_the_last_period_changes_nothing_and_a_summary_can_be_used_again() {
    let case = Case::alpha();
    let mut summary = SummaryObserver::<2>::new("alpha").with_n_c(Some(8.12), None);
    let stop = AtomicBool::new(false);
    let last = case.simulation(PROFILE).samples() - 1;
    let mut at_the_end = |p: &servosim::simulation::Period<2>| {
        if p.k == last {
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    };
    let ending =
        case.simulation(PROFILE).run(&Limits::default(), Some(&stop), &mut [&mut summary, &mut at_the_end]).unwrap();
    assert_eq!(ending, Ending::Complete);
    let first = summary.summary();
    assert!(first.complete && first.n_c == Some(8.12));
    case.simulation(PROFILE).run(&Limits::default(), None, &mut [&mut summary]).unwrap();
    assert_eq!(summary.summary(), first);
    let ending = case.simulation(PROFILE).run(&Limits::default(), Some(&stop), &mut [&mut summary]).unwrap();
    assert_eq!((ending, summary.summary().samples, summary.summary().complete), (Ending::Interrupted, 1, false));
}
