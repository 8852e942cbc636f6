//! The servo loop: plant, controller, saturation, lock-up, against closed forms and second routes.

use crate::common::{ALPHA, Case, HEART, PROFILE};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{Motion, Profile};
use servosim::limits::Limits;
use servosim::path::{Cursor, Foot, Frame, Line, Path, PhSpline};
use servosim::servo::{
    AxisLoop, AxisParameters, Derivative, Drive, Lockup, LockupKind, LockupWatch, LoopSettings, Pdff, Plant,
};
use servosim::simulation::{Event, Observer, ObserverError, Period, Simulation, SimulationError};
use servosim::summary::SummaryObserver;

/// Random parameters around the paper's. The velocity gain is drawn as its share of what one sample undoes,
/// `kpv k_T K Δt/τ` (0.69 for the paper's X axis): from 2 on a sampled loop is unstable, and amplifies rounding.
fn random_axis(rng: &mut Xoshiro256PlusPlus) -> AxisParameters {
    let plant = Plant { gain_rad_s_v: rng.random_range(20.0..150.0), time_constant_s: rng.random_range(0.02..0.5) };
    let share: f64 = rng.random_range(0.4..0.9);
    AxisParameters {
        plant,
        drive: Drive::default(),
        pdff: Pdff {
            kpp_rad_s_mm: rng.random_range(20.0..100.0),
            kpv_nm_s_rad: share * 0.716 * plant.time_constant_s / (plant.gain_rad_s_v * 1e-3),
            kiv_1_s: rng.random_range(50.0..250.0),
            kpf_rad_mm: rng.random_range(0.0..0.8),
            kvf: rng.random_range(0.8..1.0),
        },
    }
}

/// A smooth random command that starts at rest on 0 mm.
fn random_command(rng: &mut Xoshiro256PlusPlus, samples: usize) -> Vec<f64> {
    let waves: [(f64, f64); 3] = std::array::from_fn(|_| (rng.random_range(-1.0..1.0), rng.random_range(1.0..20.0)));
    (0..samples)
        .map(|k| {
            let t = k as f64 * 1e-3;
            waves.iter().map(|(a, w)| a * (1.0 - (w * t).cos())).sum()
        })
        .collect()
}

#[test]
fn validates_the_exact_plant_against_a_fine_runge_kutta() {
    // Closed loop, one control period at a time: the plant is integrated with 50 classical Runge-Kutta steps a period
    // (their error is (Δt/50τ)⁴ ≈ 1e-12 relative for τ = 20 ms), the controller is written out as in the specification.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let (mut outwards, mut inwards) = (0, 0);
    for case in 0..200 {
        let axis = random_axis(&mut rng);
        let settings = LoopSettings::default();
        let (plant, g, dt) = (axis.plant, axis.pdff, settings.period_s);
        // Every fourth command is more than the drive can follow.
        let size = if case % 4 == 0 { 10.0 } else { 1.0 };
        let command: Vec<f64> = random_command(&mut rng, 400).iter().map(|x| size * x).collect();
        let mut ours = AxisLoop::new(&axis, &settings, 0.0);
        let (mut theta, mut omega, mut integral, mut last) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        for (k, &x) in command.iter().enumerate() {
            let signals = ours.step(x, 0.0);
            let velocity = if k == 0 { 0.0 } else { (x - last) / dt };
            last = x;
            let omega_com = g.kpp_rad_s_mm * (x - 1.59 * theta) + g.kpf_rad_mm * velocity;
            let torque = g.kpv_nm_s_rad * (g.kvf * omega_com - omega + g.kiv_1_s * integral);
            let wanted = torque / 0.716;
            let u = wanted.clamp(-5.0, 5.0);
            assert!((signals.actual_mm - 1.59 * theta).abs() < 1e-9, "case {case} k {k}: {axis:?}");
            assert!((signals.voltage_v - u).abs() < 1e-6, "case {case} k {k}: {} {u}", signals.voltage_v);
            let error = omega_com - omega;
            if wanted > 5.0 && error > 0.0 || wanted < -5.0 && error < 0.0 {
                outwards += 1;
            } else {
                integral += dt * error;
                inwards += i32::from(wanted.abs() > 5.0);
            }
            let h = dt / 50.0;
            let rate = |w: f64| (plant.gain_rad_s_v * u - w) / plant.time_constant_s;
            for _ in 0..50 {
                let k1 = rate(omega);
                let k2 = rate(omega + 0.5 * h * k1);
                let k3 = rate(omega + 0.5 * h * k2);
                let k4 = rate(omega + h * k3);
                theta += h * omega + h * h / 6.0 * (k1 + k2 + k3);
                omega += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            }
        }
    }
    assert!(outwards > 1000 && inwards > 10, "the test must see both: {outwards} {inwards}");
}

#[test]
fn validates_the_step_response_of_the_plant_in_closed_form() {
    // No feedback: only feedforward through kvf, one volt's worth. ω(t) = K u (1 - exp(-t/τ)), θ = K u (t - τ(1 - exp(-t/τ))).
    let axis = AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0089, time_constant_s: 0.19936 },
        drive: Drive { voltage_limit_v: 1.0, ..Drive::default() },
        // A huge gain on a far command pins the voltage at the limit of 1 V.
        pdff: Pdff { kpp_rad_s_mm: 1e6, kpv_nm_s_rad: 1.0, kiv_1_s: 0.0, kpf_rad_mm: 0.0, kvf: 1.0 },
    };
    let mut plant = AxisLoop::new(&axis, &LoopSettings::default(), 0.0);
    for k in 0..1000 {
        let signals = plant.step(1e6, 0.0);
        let t = f64::from(k) * 1e-3;
        let rise = 1.0 - (-t / 0.19936).exp();
        let (omega, theta) = (83.0089 * rise, 83.0089 * (t - 0.19936 * rise));
        assert!((signals.velocity_rad_s - omega).abs() < 1e-10, "k {k}: {} {omega}", signals.velocity_rad_s);
        assert!((signals.actual_mm - 1.59 * theta).abs() < 1e-10, "k {k}");
        assert!(signals.saturated && signals.voltage_v == 1.0);
    }
}

#[test]
fn validates_superposition_while_unsaturated() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    for case in 0..300 {
        let mut axis = random_axis(&mut rng);
        axis.drive.voltage_limit_v = 1e6;
        let settings = LoopSettings::default();
        let (a, b) = (random_command(&mut rng, 300), random_command(&mut rng, 300));
        let (p, q): (f64, f64) = (rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0));
        let run = |command: &dyn Fn(usize) -> f64| {
            let mut axis = AxisLoop::new(&axis, &settings, 0.0);
            (0..300).map(|k| axis.step(command(k), 0.0).actual_mm).collect::<Vec<f64>>()
        };
        let (of_a, of_b) = (run(&|k| a[k]), run(&|k| b[k]));
        let of_sum = run(&|k| p * a[k] + q * b[k]);
        for k in 0..300 {
            let sum = p * of_a[k] + q * of_b[k];
            assert!((of_sum[k] - sum).abs() < 1e-9, "case {case} k {k}: {} {sum} {axis:?}", of_sum[k]);
        }
    }
}

#[test]
fn validates_one_sample_of_delay_as_the_same_voltage_one_period_later() {
    // Without feedback (kpp and kiv zero, ω fed back only through kpv) the delayed plant is the plant of the delayed command
    // if the feedback is negligible: take kpv tiny so that u is feedforward to 1e-9.
    let axis = AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0, time_constant_s: 0.2 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 0.0, kpv_nm_s_rad: 1e-9, kiv_1_s: 0.0, kpf_rad_mm: 1e8, kvf: 1.0 },
    };
    let prompt_settings = LoopSettings { derivative: Derivative::Exact, ..LoopSettings::default() };
    let late_settings = LoopSettings { one_sample_delay: true, ..prompt_settings };
    let (mut prompt, mut late) =
        (AxisLoop::new(&axis, &prompt_settings, 0.0), AxisLoop::new(&axis, &late_settings, 0.0));
    let mut before = 0.0;
    for k in 0..200 {
        let v = (f64::from(k) * 0.05).sin();
        let (now, then) = (prompt.step(0.0, v), late.step(0.0, v));
        assert!((then.actual_mm - before).abs() < 1e-6, "k {k}: {} {before}", then.actual_mm);
        before = now.actual_mm;
    }
    assert!(before.abs() > 0.01, "the plant must have moved: {before}");
}

#[test]
fn validates_that_the_two_derivatives_differ_by_half_a_period() {
    // In steady motion both are the feed; while accelerating the backward difference lags by Δt/2: ẋ_exact - ẋ_back = a Δt/2.
    let line = Line::new(Vector2::new(0.0, 0.0), Vector2::new(100.0, 0.0)).unwrap();
    let motion = Motion::plan(100.0, 100.0, Profile::Linear { phase_s: 0.1 }).unwrap();
    let axes = Case::alpha().axes.map(|mut axis| {
        // kpp = 0: the velocity command is kpf ẋ alone.
        axis.pdff.kpp_rad_s_mm = 0.0;
        axis
    });
    let of = |derivative| {
        let settings = LoopSettings { derivative, ..LoopSettings::default() };
        Simulation::new(&line, &motion, axes, settings).unwrap().collect::<Vec<_>>()
    };
    let (backward, exact) = (of(Derivative::Backward), of(Derivative::Exact));
    for k in 1..100 {
        let lag = exact[k].axes[0].velocity_command_rad_s - backward[k].axes[0].velocity_command_rad_s;
        assert!((lag / 0.8 - 1000.0 * 0.5e-3).abs() < 1e-8, "k {k}: {lag}");
    }
    for k in 150..1000 {
        let lag = exact[k].axes[0].velocity_command_rad_s - backward[k].axes[0].velocity_command_rad_s;
        assert!(lag.abs() < 1e-8, "k {k}: {lag}");
    }
}

#[derive(Default)]
struct Events(Vec<Event>);

impl Observer<2> for Events {
    fn period(&mut self, _: &Period<2>) -> Result<(), ObserverError> {
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        self.0.push(event.clone());
        Ok(())
    }
}

/// The lock-ups of a run of heart with this feed, profile and factor on the loop gain, with a second of settling.
fn lockups(path: &dyn Path<2>, feed_mm_s: f64, profile: Profile, gain: f64) -> Vec<(usize, LockupKind)> {
    let axes = Case::heart().axes.map(|mut axis| {
        axis.pdff.kpv_nm_s_rad *= gain;
        axis
    });
    let motion = Motion::plan(path.length_mm(), feed_mm_s, profile).unwrap();
    let settings = LoopSettings { settling_s: 1.0, ..LoopSettings::default() };
    let mut events = Events::default();
    Simulation::new(path, &motion, axes, settings).unwrap().run(&Limits::default(), None, &mut [&mut events]).unwrap();
    events
        .0
        .iter()
        .filter_map(|event| match event {
            Event::LockedUp { axis, lockup } => Some((*axis, lockup.kind)),
            _ => None,
        })
        .collect()
}

#[test]
fn validates_lock_up_where_the_loop_is_unstable_and_none_where_it_recovers() {
    let heart = PhSpline::from_control_points(&HEART.map(Vector2::from), true).unwrap();
    let quintic = Profile::Quintic { phase_s: 0.1 };
    let step = Profile::Linear { phase_s: 0.001 };
    // The specification's margins for heart: stable while the gain is scaled by 0.2299 … 3.2790 (X), 0.2352 … 3.3849 (Y).
    for gain in [0.24, 1.0, 3.25] {
        assert_eq!(lockups(&heart, 100.0, quintic, gain), [], "gain × {gain}");
    }
    for gain in [0.15, 0.2, 3.6, 4.0] {
        let found = lockups(&heart, 100.0, quintic, gain);
        assert_eq!(found.len(), 2, "gain × {gain}: {found:?}");
        assert!(found.iter().all(|&(_, kind)| kind == LockupKind::LimitCycle), "gain × {gain}: {found:?}");
    }
    // A step of the feed to 100 mm/s saturates for 0.12 s and is recovered from; one to 300 mm/s is not.
    assert_eq!(lockups(&heart, 100.0, step, 1.0), []);
    assert!(lockups(&heart, 300.0, step, 1.0).iter().any(|&(_, kind)| kind == LockupKind::Pinned));
}

#[test]
fn regression_saturation_is_told_once_a_stretch_and_ends() {
    let case = Case::heart();
    let motion = case.motion(Profile::Linear { phase_s: 0.01 });
    let mut events = Events::default();
    let sim = Simulation::new(&case.path, &motion, case.axes, LoopSettings::default()).unwrap();
    let mut saturated = 0;
    let mut count = |p: &Period<2>| saturated += p.axes.iter().filter(|a| a.saturated).count();
    sim.run(&Limits::default(), None, &mut [&mut events, &mut count]).unwrap();
    let began = events.0.iter().filter(|e| matches!(e, Event::SaturationBegan { .. })).count();
    let lasted: f64 =
        events.0.iter().map(|e| if let Event::SaturationEnded { lasted_s, .. } = e { *lasted_s } else { 0.0 }).sum();
    let ended = events.0.iter().filter(|e| matches!(e, Event::SaturationEnded { .. })).count();
    assert!(began > 1 && began == ended, "{began} {ended}");
    assert!((lasted - saturated as f64 * 1e-3).abs() < 1e-9, "{lasted} {saturated}");
}

#[test]
fn a_limit_is_told_when_it_is_first_passed() {
    let case = Case::alpha();
    let limits = Limits { contour_error_um: Some(20.0), voltage_v: Some(3.6), ..Limits::default() };
    let mut events = Events::default();
    case.simulation(PROFILE).run(&limits, None, &mut [&mut events]).unwrap();
    let passed: Vec<_> = events.0.iter().filter(|e| matches!(e, Event::LimitPassed { .. })).collect();
    assert_eq!(passed.len(), 1, "{passed:?}");
    let Event::LimitPassed { name, value, limit, .. } = passed[0] else { unreachable!() };
    assert_eq!((*name, *limit), ("contour_error_um", 20.0));
    assert!(*value > 20.0 && *value < 21.0, "first sample beyond the limit: {value}");
}

#[test]
fn validates_each_limit_at_its_edge_and_by_magnitude() {
    // The deceleration comes last: with the limits just above the acceleration's own values nothing is passed; below, each is
    // told once. Jerk and acceleration of alpha's quintic: 57 735 mm/s³, 1875 mm/s², either sign.
    let case = Case::alpha();
    let quintic = Profile::Quintic { phase_s: 0.1 };
    let periods: Vec<_> = case.simulation(quintic).collect();
    let largest = |of: &dyn Fn(&Period<2>) -> f64| periods.iter().map(|p| of(p).abs()).fold(0.0, f64::max);
    let at = [
        largest(&|p| p.contour_error_um),
        largest(&|p| p.tracking_error_um),
        largest(&|p| p.axes[0].voltage_v.abs().max(p.axes[1].voltage_v.abs())),
        largest(&|p| p.setpoint.accel_mm_s2),
        largest(&|p| p.setpoint.jerk_mm_s3),
    ];
    let names = ["contour_error_um", "tracking_error_um", "voltage_v", "accel_mm_s2", "jerk_mm_s3"];
    for (i, name) in names.iter().enumerate() {
        for (limit, passed) in [(at[i], false), (at[i] * (1.0 - 1e-8), true)] {
            let one = |j: usize| (i == j).then_some(limit);
            let limits = Limits {
                axes: None,
                contour_error_um: one(0),
                tracking_error_um: one(1),
                voltage_v: one(2),
                accel_mm_s2: one(3),
                jerk_mm_s3: one(4),
                ..Limits::default()
            };
            let (mut events, mut summary) = (Events::default(), SummaryObserver::<2>::new("alpha"));
            case.simulation(quintic).run(&limits, None, &mut [&mut events, &mut summary]).unwrap();
            let told: Vec<_> = events.0.iter().filter(|e| matches!(e, Event::LimitPassed { .. })).collect();
            assert_eq!(told.len(), usize::from(passed), "{name}: {told:?}");
            // Acceleration and jerk of the summary are those of the motion, between the samples too.
            let check = &summary.summary().limits[0];
            assert_eq!(check.name, *name);
            if i < 3 {
                assert!(check.value == at[i] && check.kept != passed, "{check:?}");
            } else {
                assert!(check.value >= at[i], "{check:?}");
            }
        }
    }
    // A negative value passes a limit by its magnitude: here the first jerk beyond 50 000 is at the start of the deceleration.
    let mut mirrored = Events::default();
    let limits = Limits { jerk_mm_s3: Some(0.0), accel_mm_s2: Some(0.0), ..Limits::default() };
    let line = Line::new(Vector2::new(0.0, 0.0), Vector2::new(-20.0, -20.0)).unwrap();
    let motion = Motion::plan(line.length_mm(), 100.0, quintic).unwrap();
    let settings = LoopSettings::default();
    Simulation::new(&line, &motion, case.axes, settings).unwrap().run(&limits, None, &mut [&mut mirrored]).unwrap();
    assert_eq!(mirrored.0.iter().filter(|e| matches!(e, Event::LimitPassed { .. })).count(), 2);
}

#[test]
fn validates_the_summary_against_sums_over_its_periods() {
    // A hard start, so that the axes saturate at different times.
    let case = Case::heart();
    let profile = Profile::Linear { phase_s: 0.01 };
    let mut observer = SummaryObserver::<2>::new("heart");
    let motion = case.motion(profile);
    case.simulation(profile).run(&Limits::default(), None, &mut [&mut observer]).unwrap();
    let (ours, periods) = (observer.summary(), case.simulation(profile).collect::<Vec<_>>());
    let n = periods.len() as f64;
    let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} {b}");
    let largest = |of: &dyn Fn(&Period<2>) -> f64| periods.iter().map(|p| of(p).abs()).fold(0.0, f64::max);
    let rms = |of: &dyn Fn(&Period<2>) -> f64| (periods.iter().map(|p| of(p).powi(2)).sum::<f64>() / n).sqrt();
    let share = |of: &dyn Fn(&Period<2>) -> bool| periods.iter().filter(|p| of(p)).count() as f64 / n;
    assert!(ours.complete && ours.samples == periods.len() as u64 && ours.period_s == 1e-3);
    close(ours.max_contour_error_um, largest(&|p| p.contour_error_um));
    close(ours.rms_contour_error_um, rms(&|p| p.contour_error_um));
    close(ours.max_tracking_error_um, largest(&|p| p.tracking_error_um));
    close(ours.rms_tracking_error_um, rms(&|p| p.tracking_error_um));
    close(ours.peak_voltage_v, largest(&|p| p.axes[0].voltage_v.abs().max(p.axes[1].voltage_v.abs())));
    close(ours.rms_voltage_v, rms(&|p| f64::midpoint(p.axes[0].voltage_v.powi(2), p.axes[1].voltage_v.powi(2)).sqrt()));
    close(ours.saturated_share, share(&|p| p.axes[0].saturated || p.axes[1].saturated));
    assert_eq!(ours.peak_jerk_mm_s3, f64::INFINITY);
    close(ours.peak_accel_mm_s2, 1e4);
    close(ours.motion_time_s, motion.total_s());
    let worst = periods.iter().find(|p| p.contour_error_um.abs() == ours.max_contour_error_um).unwrap();
    assert_eq!((ours.max_contour_error_at_s, ours.max_contour_error_at_mm), (worst.time_s, worst.nearest_s_mm));
    for (i, axis) in ours.axes.iter().enumerate() {
        let error = |p: &Period<2>| 1e3 * (p.axes[i].command_mm - p.axes[i].actual_mm);
        close(axis.max_tracking_error_um, largest(&error));
        close(axis.rms_tracking_error_um, rms(&error));
        close(axis.peak_voltage_v, largest(&|p| p.axes[i].voltage_v));
        close(axis.rms_voltage_v, rms(&|p| p.axes[i].voltage_v));
        close(axis.saturated_share, share(&|p| p.axes[i].saturated));
    }
    assert!(ours.axes[0].saturated_share != ours.axes[1].saturated_share, "{:?}", ours.axes);
}

/// What a watch at 1 ms finds in a voltage and an error given sample by sample.
fn watched(samples: u64, of: impl Fn(u64) -> (f64, f64)) -> Vec<Lockup> {
    let mut watch = LockupWatch::new(1e-3);
    (0..samples).filter_map(|k| watch.watch(k, of(k).0, of(k).0.abs() >= 5.0, of(k).1)).collect()
}

#[test]
fn validates_when_an_axis_counts_as_locked_up() {
    // Pinned from 0.1 s on with an error that stays: certain after two stretches of 0.125 s, told once.
    let pinned = watched(2000, |k| if k < 100 { (1.0, 0.0) } else { (5.0, 2.0) });
    let expected = Lockup { kind: LockupKind::Pinned, since_s: 0.1, time_s: 349.0 * 1e-3, error_mm: 2.0 };
    assert_eq!(pinned, [expected]);
    // Swinging every 20 ms.
    let swinging = watched(2000, |k| if (k / 20) % 2 == 0 { (5.0, 1.0) } else { (-5.0, -1.0) });
    assert_eq!(swinging.iter().map(|l| l.kind).collect::<Vec<_>>(), [LockupKind::LimitCycle]);
    // Saturated for as long as the error still falls by a fifth from stretch to stretch.
    assert_eq!(watched(2000, |k| (5.0, 0.7_f64.powf(k as f64 / 125.0))), []);
    // The error stays, but the saturation fades.
    let fading = |k: u64| if k % 125 < 100 >> (k / 125).min(60) { (5.0, 1.0) } else { (4.0, 1.0) };
    assert_eq!(watched(2000, fading), []);
    // Single saturated samples 0.06 s apart: each is recovered from. 0.04 s apart: not.
    // Every sample, every second, every fourth …: less and less, though never 0.05 s without.
    let thinning = |k: u64| if k.is_multiple_of(1 << (k / 125).min(5)) { (5.0, 1.0) } else { (4.0, 1.0) };
    assert_eq!(watched(750, thinning), []);
    assert_eq!(watched(2000, |k| if k % 60 == 0 { (5.0, 1.0) } else { (1.0, 1.0) }), []);
    assert_eq!(watched(2000, |k| if k % 40 == 0 { (5.0, 1.0) } else { (1.0, 1.0) }).len(), 1);
}

#[test]
fn validates_the_plant_of_given_mechanics() {
    // J ω' + B ω = u/k_T: 20 kg on 1.59 mm/rad beside 1e-4 kg m².
    let drive = Drive::default();
    let plant = Plant::from_mechanics(20.0, 1e-4, 2e-3, &drive);
    let inertia = 1e-4 + 20.0 * 1.59e-3 * 1.59e-3;
    assert!((plant.time_constant_s - inertia / 2e-3).abs() < 1e-15);
    assert!((plant.gain_rad_s_v - 0.716 / 2e-3).abs() < 1e-10);
}

#[test]
fn the_torque_is_that_of_the_control_law_before_the_clamp() {
    // T = kpv (kvf ω_com - ω + kiv I); its voltage k_T T is clamped, the torque command is not.
    let axis = Case::alpha().axes[0];
    let mut servo = AxisLoop::new(&axis, &LoopSettings::default(), 3.0);
    let signals = servo.step(4.0, 0.0);
    let torque = 1.19 * 0.85 * (97.38 * 1.0 + 0.8 * 1000.0);
    assert!((signals.torque_nm - torque).abs() < 1e-9 * torque, "{signals:?}");
    assert!(signals.saturated && signals.voltage_v == 5.0);
    assert!((signals.velocity_command_rad_s - (97.38 + 800.0)).abs() < 1e-9);
}

#[test]
fn a_path_that_loses_its_numbers_ends_the_run() {
    struct Broken(Line<2>);
    impl Path<2> for Broken {
        fn length_mm(&self) -> f64 {
            self.0.length_mm()
        }
        fn is_closed(&self) -> bool {
            false
        }
        fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<2> {
            let frame = self.0.frame(s_mm, cursor);
            if s_mm > 5.0 { Frame { point_mm: frame.point_mm * f64::NAN, ..frame } } else { frame }
        }
        fn curvature_bound_1_mm(&self, _: f64, _: f64) -> f64 {
            0.0
        }
        fn nearest_local(&self, point_mm: &Vector2<f64>, cursor: &mut Cursor) -> Foot<2> {
            self.0.nearest_local(point_mm, cursor)
        }
    }
    let path = Broken(Line::new(Vector2::new(0.0, 0.0), Vector2::new(10.0, 0.0)).unwrap());
    let motion = Motion::plan(10.0, 50.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
    let mut seen = 0;
    let mut count = |_: &Period<2>| seen += 1;
    let run = Simulation::new(&path, &motion, Case::alpha().axes, LoopSettings::default()).unwrap();
    let error = run.run(&Limits::default(), None, &mut [&mut count]).unwrap_err();
    assert!(
        matches!(error, SimulationError::Diverged { time_s } if (time_s * 1e3).round() == f64::from(seen)),
        "{error}"
    );
}

#[test]
fn validates_that_each_axis_is_given_its_own_velocity() {
    // Along X and then, the same line turned, along Y: the axes of equal parameters change places.
    let axes = [Case::alpha().axes[0]; 2];
    let settings = LoopSettings { derivative: Derivative::Exact, ..LoopSettings::default() };
    let run = |end: Vector2<f64>| {
        let line = Line::new(Vector2::new(0.0, 0.0), end).unwrap();
        let motion = Motion::plan(50.0, 100.0, PROFILE).unwrap();
        Simulation::new(&line, &motion, axes, settings).unwrap().map(|p| p.axes).collect::<Vec<_>>()
    };
    let (along_x, along_y) = (run(Vector2::new(50.0, 0.0)), run(Vector2::new(0.0, 50.0)));
    assert!(along_x.iter().zip(&along_y).all(|(x, y)| x[0] == y[1] && x[1] == y[0]));
    assert!(along_x.iter().any(|axes| axes[0].voltage_v > 1.0));
}

#[test]
fn a_limit_is_passed_by_magnitude_at_the_first_sample_beyond_it() {
    // Either sign counts: the first sample beyond each limit is looked for in the magnitudes, on alpha and on its mirror image.
    let (case, quintic) = (Case::alpha(), Profile::Quintic { phase_s: 0.1 });
    for share in [0.1, 0.5, 0.9, 0.999] {
        let periods: Vec<_> = case.simulation(quintic).collect();
        let of = |p: &Period<2>| [p.contour_error_um, p.setpoint.accel_mm_s2, p.setpoint.jerk_mm_s3].map(f64::abs);
        let largest = periods.iter().map(of).reduce(|a, b| std::array::from_fn(|i| a[i].max(b[i]))).unwrap();
        let limits = Limits {
            contour_error_um: Some(share * largest[0]),
            accel_mm_s2: Some(share * largest[1]),
            jerk_mm_s3: Some(share * largest[2]),
            ..Limits::default()
        };
        let back = PhSpline::from_control_points(&ALPHA.map(|[x, y]| Vector2::new(-x, y)), false).unwrap();
        for path in [&case.path, &back] {
            let run = || Simulation::new(path, &case.motion(quintic), case.axes, LoopSettings::default()).unwrap();
            let mut events = Events::default();
            run().run(&limits, None, &mut [&mut events]).unwrap();
            for (i, key) in ["contour_error_um", "accel_mm_s2", "jerk_mm_s3"].iter().enumerate() {
                let first = run().find(|p| of(p)[i] > share * largest[i]).map(|p| p.time_s);
                let told = events.0.iter().find_map(|e| match e {
                    Event::LimitPassed { name, time_s, .. } if name == key => Some(*time_s),
                    _ => None,
                });
                assert_eq!(told, first, "{key} at {share} of its peak");
            }
        }
    }
}
