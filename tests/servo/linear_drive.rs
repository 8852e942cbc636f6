//! The loop of a detailed drive: against the closed form of its model, and against published forms.

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::analysis::{DriveLoop, Feedforward, Linearized, LoopMetrics};
use servosim::scenario::Scenario;
use servosim::servo::compensation::{BacklashCompensation, Filter, Notch};
use servosim::servo::effects::{Backlash, Delay, EncoderPlace, Mismatch, Noise, TwoMass};
use servosim::servo::{
    AxisParameters, ControllerGains, ControllerKind, Derivative, Drive, DriveModel, LoopSettings, Pdff, Plant,
};

#[track_caller]
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * (1.0 + b.abs()) || a == b, "{a} is not {b} within {tolerance}");
}

/// The model, as a drive that is more than one.
fn unlike_a_model() -> DriveModel {
    let mut drive = DriveModel::default();
    drive.effects.mismatch = Some(Mismatch { gain_factor: 1.0, time_constant_factor: 1.0 });
    drive
}

fn random(rng: &mut Xoshiro256PlusPlus) -> (AxisParameters, LoopSettings) {
    let plant = Plant { gain_rad_s_v: rng.random_range(20.0..150.0), time_constant_s: rng.random_range(0.02..0.5) };
    let period_s = 10f64.powf(rng.random_range(-4.0..-2.7));
    let share: f64 = rng.random_range(0.05..0.9);
    let pdff = Pdff {
        kpp_rad_s_mm: 0.1 * rng.random_range(0.05..1.5) / period_s,
        kpv_nm_s_rad: share * 0.716 * plant.time_constant_s / (plant.gain_rad_s_v * period_s),
        kiv_1_s: if rng.random_bool(0.1) { 0.0 } else { 0.25 * rng.random_range(0.05..1.5) / period_s },
        kpf_rad_mm: rng.random_range(0.0..0.8),
        kvf: rng.random_range(0.3..1.2),
    };
    let derivative = if rng.random_bool(0.5) { Derivative::Exact } else { Derivative::Backward };
    let settings = LoopSettings { period_s, settling_s: 0.1, derivative, one_sample_delay: rng.random_bool(0.4) };
    (AxisParameters { plant, drive: Drive::default(), pdff }, settings)
}

/// Everything that both tell.
#[track_caller]
fn same(a: &DriveLoop, b: &DriveLoop, rng: &mut Xoshiro256PlusPlus) {
    for _ in 0..8 {
        let omega = a.nyquist_rad_s() * 10f64.powf(rng.random_range(-5.0..0.0));
        let close = |a: Complex<f64>, b: Complex<f64>| assert!((a - b).norm() < 1e-9 * b.norm(), "{omega}: {a} {b}");
        close(a.transfer(omega), b.transfer(omega));
        for feedforward in [Feedforward::With, Feedforward::Without] {
            close(a.command_response(omega, feedforward), b.command_response(omega, feedforward));
        }
    }
    assert_eq!(a.is_stable(), b.is_stable());
    near(a.pole_radius(), b.pole_radius(), 1e-9);
    let (m, n) = (a.margins(), b.margins());
    near(m.gain_down, n.gain_down, 1e-9);
    near(m.gain_up, n.gain_up, 1e-9);
    near(m.phase_margin_deg, n.phase_margin_deg, 1e-7);
    near(m.crossover_rad_s, n.crossover_rad_s, 1e-9);
    near(m.delay_margin_s, n.delay_margin_s, 1e-9);
    near(m.peak_sensitivity, n.peak_sensitivity, 1e-9);
    let (f, g) = (a.stable_gain_factors(), b.stable_gain_factors());
    assert_eq!(f.len(), g.len(), "{f:?} {g:?}");
    for (f, g) in f.iter().zip(&g) {
        near(f.0, g.0, 1e-9);
        near(f.1, g.1, 1e-9);
    }
    for feedforward in [Feedforward::With, Feedforward::Without] {
        match (a.bandwidth(feedforward), b.bandwidth(feedforward)) {
            (Some(a), Some(b)) => {
                near(a.first_rad_s, b.first_rad_s, 1e-9);
                assert_eq!(a.last_rad_s.is_some(), b.last_rad_s.is_some());
            }
            (a, b) => assert_eq!(a, b),
        }
        // One that takes ages to anti_windup is not run.
        if (0.9995..1.0).contains(&a.pole_radius()) {
            continue;
        }
        let (a, b) = (a.step_response(feedforward), b.step_response(feedforward));
        for (a, b) in a.actual.iter().zip(&b.actual) {
            near(*a, *b, 1e-8);
        }
        assert_eq!(a.metrics.is_some(), b.metrics.is_some());
        if let (Some(a), Some(b)) = (a.metrics, b.metrics) {
            near(a.rise_s, b.rise_s, 1e-9);
            near(a.overshoot_percent, b.overshoot_percent, 1e-7);
            near(a.settling_s, b.settling_s, 1e-9);
        }
    }
    match (a.error_constants(), b.error_constants()) {
        (Some(a), Some(b)) => {
            near(a.velocity_s, b.velocity_s, 1e-9);
            near(a.acceleration_s2, b.acceleration_s2, 1e-9);
        }
        (a, b) => assert_eq!(a, b),
    }
}

#[test]
fn validates_against_the_closed_form_of_the_model() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut stable = 0;
    for _ in 0..30 {
        let (axis, settings) = random(&mut rng);
        let model = DriveLoop::model(&axis, &settings);
        stable += usize::from(model.is_stable());
        same(&DriveLoop::new(&axis, &unlike_a_model(), &settings).unwrap(), &model, &mut rng);
    }
    assert!((8..30).contains(&stable), "{stable}");
}

#[test]
fn validates_that_one_sample_of_delay_is_one_sample_of_delay() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    for _ in 0..15 {
        let (axis, mut settings) = random(&mut rng);
        settings.one_sample_delay = false;
        let mut drive = DriveModel::default();
        drive.effects.delay = Some(Delay { samples: 1.0 });
        let delayed = LoopSettings { one_sample_delay: true, ..settings };
        same(&DriveLoop::new(&axis, &drive, &settings).unwrap(), &DriveLoop::model(&axis, &delayed), &mut rng);
    }
    let alpha = Scenario::builtin("alpha").unwrap();
    let mut drive = DriveModel::default();
    drive.effects.delay = Some(Delay { samples: 1.0 });
    let told = LoopMetrics::of("x", &DriveLoop::new(&alpha.axes[0], &drive, &alpha.settings).unwrap());
    assert!(!told.stable && told.warnings[0].contains("kpv times a factor from 0.4534 to 0.9685"), "{told:?}");
}

#[test]
fn validates_mismatch_as_another_plant() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    for _ in 0..8 {
        let (axis, settings) = random(&mut rng);
        let mismatch =
            Mismatch { gain_factor: rng.random_range(0.5..2.0), time_constant_factor: rng.random_range(0.5..2.0) };
        let mut drive = DriveModel::default();
        drive.effects.mismatch = Some(mismatch);
        let other = AxisParameters { plant: mismatch.plant(&axis.plant), ..axis };
        same(&DriveLoop::new(&axis, &drive, &settings).unwrap(), &DriveLoop::model(&other, &settings), &mut rng);
    }
}

#[test]
fn validates_the_resonance_of_two_masses() {
    let alpha = Scenario::builtin("alpha").unwrap();
    let mut axis = alpha.axes[0];
    // Next to no loop: the machine is left alone.
    axis.pdff = Pdff { kpv_nm_s_rad: 1e-6, ..axis.pdff };
    let two_mass = TwoMass { table_mass_kg: 120.0, stiffness_n_um: 40.0, damping_n_s_mm: 5.0 };
    let mut drive = DriveModel::default();
    drive.effects.two_mass = Some(two_mass);
    let metrics = LoopMetrics::of("x", &DriveLoop::new(&axis, &drive, &alpha.settings).unwrap());
    let omega = two_mass.resonance_rad_s(&axis.plant, &axis.drive);
    let table = two_mass.table_inertia_kg_m2(&axis.drive);
    let motor = axis.plant.inertia_kg_m2(&axis.drive) - table;
    let damping = two_mass.damping_nm_s_rad(&axis.drive) * (1.0 / motor + 1.0 / table) / (2.0 * omega);
    let pole = metrics.poles.iter().find(|pole| pole.im > 0.1 && pole.damping < 0.5).expect("it swings");
    // The motor's viscous friction, 1 part in 10³ of the damping, is in the loop and not in the closed form.
    near(pole.natural_rad_s, omega, 1e-3);
    assert!((pole.damping - damping).abs() < 0.05 * damping, "{pole:?} {damping}");

    // Around the resonance, and at the antiresonance of the motor's side, the loop is what the continuous transfer says
    // (J_m, J_t, k, c, B; a hold of a period of 10 µs is a dead time of half of it).
    let settings = LoopSettings { period_s: 1e-5, ..alpha.settings };
    let axis =
        AxisParameters { pdff: Pdff { kpp_rad_s_mm: 1e-6, kiv_1_s: 0.0, kpv_nm_s_rad: 1.0, ..axis.pdff }, ..axis };
    let found = DriveLoop::new(&axis, &drive, &settings).unwrap();
    let (k, c) = (two_mass.stiffness_nm_rad(&axis.drive), two_mass.damping_nm_s_rad(&axis.drive));
    let viscous = axis.plant.viscous_nm_s_rad(&axis.drive);
    let anti = (k / table).sqrt();
    for omega in [0.3 * anti, 0.99 * anti, anti, 1.02 * anti, 0.99 * omega, omega, 1.1 * omega, 3.0 * omega] {
        let s = Complex::new(0.0, omega);
        let spring = s * c + k;
        // Motor speed per torque: (J_t s² + c s + k)/((J_m s + B)(J_t s² + c s + k) + J_t s (c s + k)).
        let table_side = s * s * table + spring;
        let speed = table_side / ((s * motor + viscous) * table_side + s * table * spring);
        let hold = (s * (-0.5 * settings.period_s)).exp();
        let l = found.transfer(omega);
        assert!((l - speed * hold).norm() < 2e-3 * l.norm(), "{omega}: {l} {}", speed * hold);
    }
    // A scale at the table has the antiresonance no longer.
    drive.effects.encoder =
        Some(servosim::servo::effects::Encoder { place: EncoderPlace::Table, ..Default::default() });
    assert!(DriveLoop::new(&axis, &drive, &settings).is_ok());
}

#[test]
fn validates_that_a_notch_takes_its_frequency_out_of_the_loop() {
    let alpha = Scenario::builtin("alpha").unwrap();
    let mut drive = DriveModel::default();
    drive.compensation.filters.push(Filter::Notch(Notch { frequency_hz: 200.0, depth: 0.05, damping: 0.4 }));
    let with = DriveLoop::new(&alpha.axes[0], &drive, &alpha.settings).unwrap();
    let without = DriveLoop::model(&alpha.axes[0], &alpha.settings);
    let omega = std::f64::consts::TAU * 200.0;
    near((with.transfer(omega) / without.transfer(omega)).norm(), 0.05, 1e-9);
    near((with.transfer(1.0) / without.transfer(1.0)).norm(), 1.0, 1e-3);
}

#[test]
fn regression_a_pid_like_the_pdff_loops_does_what_they_do_at_low_frequencies() {
    let alpha = Scenario::builtin("alpha").unwrap();
    let axis = AxisParameters { pdff: Pdff { kvf: 1.0, ..alpha.axes[0].pdff }, ..alpha.axes[0] };
    let controller = ControllerGains::like(ControllerKind::Pid, &axis, &alpha.settings);
    let drive = DriveModel { controller, ..DriveModel::default() };
    let pid = DriveLoop::new(&axis, &drive, &alpha.settings).unwrap();
    let pdff = DriveLoop::model(&axis, &alpha.settings);
    for omega in [0.1, 1.0, 10.0] {
        let share = pid.transfer(omega) / pdff.transfer(omega);
        assert!((share - 1.0).norm() < 1e-2, "{omega} {share}");
    }
}

#[test]
fn what_is_not_linear_is_named() {
    let mut drive = DriveModel::default();
    drive.effects.delay = Some(Delay { samples: 1.0 });
    drive.effects.backlash = Some(Backlash { gap_um: 3.0 });
    drive.effects.noise = Some(Noise { rms_um: 0.1, seed: 1 });
    drive.compensation.backlash = Some(BacklashCompensation { gap_um: 3.0, time_constant_s: 0.0 });
    let told = Linearized::of(&drive);
    assert_eq!((told.controller, &told.modelled[..]), ("pdff", &["delay of 1 sample".to_owned()][..]));
    assert_eq!(told.neglected, ["noise", "backlash", "backlash compensation"]);
    let none = Linearized::of(&DriveModel::default());
    assert!(none.modelled.is_empty() && none.neglected.is_empty());
}

#[test]
fn no_number_panics_and_bad_ones_are_refused() {
    let alpha = Scenario::builtin("alpha").unwrap();
    for value in [f64::NAN, f64::INFINITY, -1.0, 1e300] {
        let mut drive = DriveModel::default();
        drive.effects.delay = Some(Delay { samples: value });
        assert!(DriveLoop::new(&alpha.axes[0], &drive, &alpha.settings).is_err());
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    for _ in 0..60 {
        // Anything that the checks let through.
        let mut any = || 10f64.powf(rng.random_range(-9.0..9.0));
        let mut axis = alpha.axes[0];
        axis.plant = Plant { gain_rad_s_v: any(), time_constant_s: any() };
        axis.pdff = Pdff { kpp_rad_s_mm: any(), kpv_nm_s_rad: any(), kiv_1_s: any(), kpf_rad_mm: any(), kvf: any() };
        axis.drive.transmission_mm_rad = any();
        axis.drive.torque_to_voltage_v_nm = any();
        let settings = LoopSettings { period_s: any().min(1.0), ..alpha.settings };
        let mut drive = unlike_a_model();
        drive.effects.delay = Some(Delay { samples: 2.5 });
        drive.compensation.filters.push(Filter::Notch(Notch {
            frequency_hz: 0.1 / settings.period_s,
            depth: 0.0,
            damping: 0.5,
        }));
        let Ok(found) = DriveLoop::new(&axis, &drive, &settings) else { continue };
        // A loop that takes ages to anti_windup is not run.
        if found.is_stable() && found.pole_radius() > 1.0 - 1e-4 {
            continue;
        }
        let metrics = LoopMetrics::of("x", &found);
        assert!(
            !metrics.pole_radius.is_nan() && !metrics.gain_factor_down.is_nan() && !metrics.phase_margin_deg.is_nan()
        );
    }
}
