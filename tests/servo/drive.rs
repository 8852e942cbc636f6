//! The detailed drive model: each effect against a closed form, an independent route, or the ideal loop.

use crate::common::drive::{self, Bench, DT, axis, real};
use servosim::servo::compensation::Compensation;
use servosim::servo::effects::{
    Backlash, Coulomb, CurrentLoop, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic,
    Integration, LookupTable, LuGre, Mismatch, Noise, PitchError, TorqueRipple, TwoMass, VelocityEstimate,
};
use servosim::servo::{
    Axis, AxisLoop, AxisReference, AxisSignals, Derivative, DetailedAxis, Drive, DriveSignals, LoopSettings,
};

fn coulomb() -> Coulomb {
    Coulomb { coulomb_nm: 0.1, static_nm: 0.15, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.001 }
}

fn two_mass() -> TwoMass {
    TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 5.0 }
}

fn ripple() -> TorqueRipple {
    let harmonic = |per_revolution, amplitude_nm, phase_rad| Harmonic { per_revolution, amplitude_nm, phase_rad };
    TorqueRipple { harmonics: vec![harmonic(6, 0.03, 0.4), harmonic(24, 0.01, 1.1)] }
}

/// Everything at once.
fn everything() -> Effects {
    let force = LookupTable::new([(0.0, 0.0), (0.1, 60.0), (0.25, -40.0), (0.4, 80.0), (0.6, 0.0)], None);
    let pitch = LookupTable::new((0..20).map(|i| (f64::from(i), 3.0 * libm::sin(f64::from(i)))), None);
    Effects {
        mismatch: Some(Mismatch { gain_factor: 1.1, time_constant_factor: 0.9 }),
        encoder: Some(Encoder {
            place: EncoderPlace::Motor,
            resolution_um: 0.1,
            velocity: VelocityEstimate::Observer { bandwidth_hz: 100.0, damping: 1.0 },
        }),
        noise: Some(Noise { rms_um: 0.05, seed: 7 }),
        delay: Some(Delay { samples: 0.3 }),
        dac: Some(Dac { bits: 14 }),
        current_loop: Some(CurrentLoop { bandwidth_hz: 1000.0 }),
        two_mass: Some(two_mass()),
        friction: Some(Friction::Coulomb(coulomb())),
        backlash: Some(Backlash { gap_um: 5.0 }),
        pitch: Some(PitchError { error_um: pitch.expect("a table") }),
        ripple: Some(ripple()),
        force: Some(CuttingForce::OverTime(force.expect("a table"))),
        integration: Integration::default(),
    }
}

/// A smooth reference with four reversals a second: 100 mm/s at most.
fn reference(k: usize) -> AxisReference {
    let (t, w, a) = (k as f64 * DT, 4.0 * std::f64::consts::PI, 8.0);
    AxisReference {
        position_mm: a * (1.0 - libm::cos(w * t)),
        velocity_mm_s: a * w * libm::sin(w * t),
        acceleration_mm_s2: a * w * w * libm::cos(w * t),
        jerk_mm_s3: -a * w * w * w * libm::sin(w * t),
        torque_nm: 0.0,
        command_offset_mm: 0.0,
    }
}

/// The motion under torques in an open loop.
fn open(effects: &Effects, samples: usize, mut torque: impl FnMut(f64) -> f64) -> Vec<(AxisSignals, DriveSignals)> {
    let mut axis = drive::open(effects, |k| torque(f64::from(k) * DT));
    (0..samples).map(|_| (axis.step(&AxisReference::default()), axis.drive_signals())).collect()
}

#[test]
fn validates_without_effects_the_ideal_loop() {
    for (one_sample_delay, derivative, size) in
        [(false, Derivative::Backward, 1.0), (true, Derivative::Exact, 0.5), (false, Derivative::Exact, 6.0)]
    {
        let settings = LoopSettings { one_sample_delay, derivative, ..LoopSettings::default() };
        let mut ideal = AxisLoop::new(&axis(), &settings, 0.0);
        let real = DetailedAxis::pdff(&axis(), &Effects::default(), &Compensation::default(), &settings, 0.0);
        let mut real = Bench(real.expect("sound"));
        let mut saturated = 0;
        for k in 0..1000 {
            let mut reference = reference(k);
            reference.position_mm *= size;
            reference.velocity_mm_s *= size;
            let (a, b) = (Axis::step(&mut ideal, &reference), real.step(&reference));
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + a.abs().max(100.0));
            assert!(near(a.actual_mm, b.actual_mm), "{k} {} {}", a.actual_mm, b.actual_mm);
            assert!((a.voltage_v - b.voltage_v).abs() < 1e-9 && near(a.velocity_rad_s, b.velocity_rad_s), "{k}");
            assert!((a.torque_nm - b.torque_nm).abs() < 1e-9 * (1.0 + a.torque_nm.abs()));
            assert_eq!(a.saturated, b.saturated);
            saturated += usize::from(a.saturated);
        }
        // With the delay this loop has next to no margin left.
        assert_eq!(saturated > 0, size > 1.0 || one_sample_delay);
    }
}

#[test]
fn validates_friction_coasting_to_rest() {
    // J ω' + (B + B_f) ω = T - T_c: after a pulse of one sample the axis stops at τ ln(1 + ω0 B/T_c), exactly, and stays.
    let curve = Coulomb { coulomb_nm: 0.1, static_nm: 0.1, stribeck_mm_s: 1.0, viscous_nm_s_rad: 0.002 };
    let effects = Effects { friction: Some(Friction::Coulomb(curve)), ..Effects::default() };
    let run = open(&effects, 100, |t| if t < 0.5 * DT { 1.7 } else { 0.0 });
    let (plant, drive) = (axis().plant, axis().drive);
    let (inertia, viscous) = (plant.inertia_kg_m2(&drive), plant.viscous_nm_s_rad(&drive) + 0.002);
    let tau = inertia / viscous;
    let end = |torque: f64, omega: f64, t: f64| {
        let rest = (torque - 0.1) / viscous;
        let gap = -libm::expm1(-t / tau);
        (rest * t + (omega - rest) * tau * gap, omega + (rest - omega) * gap)
    };
    let (pushed, omega) = end(1.7, 0.0, DT);
    let stop_s = tau * libm::log1p(omega * viscous / 0.1);
    let travel_mm = 1.59 * (pushed + end(0.0, omega, stop_s).0);
    assert!((run[1].0.velocity_rad_s - omega).abs() < 1e-12);
    let stuck = run.iter().position(|(_, s)| s.stuck && s.motor_mm > 0.0).expect("it stops");
    assert_eq!(stuck as f64, 1.0 + (stop_s / DT).ceil());
    let last = run[99].0.actual_mm;
    assert!((last - travel_mm).abs() < 1e-10, "{last} {travel_mm}");
    assert!(run[stuck..].iter().all(|(a, _)| a.actual_mm == last && a.velocity_rad_s == 0.0));
}

#[test]
fn validates_friction_breaking_away() {
    // Torque that rises by 0.1 N m/s in steps of a sample: it moves with the first that is above 0.15 N m.
    let effects = Effects { friction: Some(Friction::Coulomb(coulomb())), ..Effects::default() };
    let run = open(&effects, 1600, |t| 0.1 * t);
    let moves = run.iter().position(|(a, _)| a.actual_mm != 0.0).expect("it moves");
    assert!((1501..=1502).contains(&moves), "{moves}");
    assert!(run[1..moves - 1].iter().all(|(_, s)| s.stuck && (s.friction_nm + s.motor_torque_nm).abs() < 1e-15));
}

#[test]
fn validates_resonance_of_two_masses() {
    let effects = Effects { two_mass: Some(two_mass()), ..Effects::default() };
    let run = open(&effects, 120, |t| if t < 0.5 * DT { 2.0 } else { 0.0 });
    // Twist after the pulse; the plant's own viscous friction is a slow term besides, 2 % of the damping.
    let (plant, drive) = (axis().plant, axis().drive);
    let inertia = plant.inertia_kg_m2(&drive);
    let table = two_mass().table_inertia_kg_m2(&drive);
    let (k, c) = (two_mass().stiffness_nm_rad(&drive), two_mass().damping_nm_s_rad(&drive));
    let (motor, viscous) = (inertia - table, plant.viscous_nm_s_rad(&drive));
    // Poles of the three states by Newton on s³ + … from the undamped guess: the closed form of the same linear machine.
    let poly = |s: nalgebra::Complex<f64>| {
        // (J_m s + B + c + k/s)(J_t s + c + k/s) - (c + k/s)², times s.
        let g = s * c + k;
        ((s * s * motor + s * viscous + g) * (s * s * table + g) - g * g) / (s * s)
    };
    let omega = two_mass().resonance_rad_s(&plant, &drive);
    let mut s = nalgebra::Complex::new(-0.5 * c * (1.0 / motor + 1.0 / table), omega);
    for _ in 0..50 {
        let h = nalgebra::Complex::new(1e-3, 0.0);
        let slope = (poly(s + h) - poly(s - h)) / (h * 2.0);
        s -= poly(s) / slope;
    }
    // From the samples: twist obeys a recursion of its three poles (Prony's method).
    let twist: Vec<f64> = run[1..].iter().map(|(a, d)| d.motor_mm - a.actual_mm).collect();
    let rows = 60;
    let m = nalgebra::DMatrix::from_fn(rows, 3, |i, j| twist[i + 2 - j]);
    let b = nalgebra::DVector::from_fn(rows, |i, _| twist[i + 3]);
    let r = m.svd(true, true).solve(&b, 1e-14).expect("a recursion");
    let value = |z: nalgebra::Complex<f64>| z * z * z - z * z * r[0] - z * r[1] - r[2];
    let z = (s * DT).exp();
    // The pole of the machine is a root of the recursion, found again from nearby.
    let mut found = z * nalgebra::Complex::new(1.01, 0.01);
    for _ in 0..50 {
        let slope = found * found * 3.0 - found * r[0] * 2.0 - r[1];
        found -= value(found) / slope;
    }
    let pole = found.ln() / DT;
    assert!((pole - s).norm() < 1e-6 * omega, "{pole} {s}");
    // And within 0.1 % the textbook's metrics.
    let (frequency, damping) = (pole.norm(), -pole.re / pole.norm());
    assert!((frequency / omega - 1.0).abs() < 1e-3, "{frequency} {omega}");
    let textbook = c * (1.0 / motor + 1.0 / table) / (2.0 * omega);
    let own = viscous / motor * (table / inertia) / (2.0 * omega);
    assert!((damping / (textbook + own) - 1.0).abs() < 1e-3, "{damping} {textbook} {own}");
}

#[test]
fn validates_lost_motion() {
    let effects = Effects { backlash: Some(Backlash { gap_um: 8.0 }), ..Effects::default() };
    // Rigid: forth, and back after a stop; the table is exactly half the gap behind on each side.
    let run = open(&effects, 400, |t| if t < 0.1 { 0.2 } else { -0.3 });
    for (a, d) in &run {
        let behind_um = 1e3 * (d.motor_mm - a.actual_mm);
        assert!(behind_um.abs() < 4.0 + 1e-9);
    }
    let behind = |k: usize| 1e3 * (run[k].1.motor_mm - run[k].0.actual_mm);
    assert!((behind(90) - 4.0).abs() < 1e-9 && (behind(399) + 4.0).abs() < 1e-9);
    // It turns inside a sample, where ω(t) = 0: the table stays at that place less half the gap.
    let (plant, drive) = (axis().plant, axis().drive);
    let last = run.iter().rposition(|(a, _)| a.velocity_rad_s > 0.0).expect("it goes forth");
    let (omega, rest) = (run[last].0.velocity_rad_s, -0.3 / plant.viscous_nm_s_rad(&drive));
    let tau = plant.time_constant_s;
    let turn_s = tau * libm::log1p(-omega / rest);
    let travel = rest * turn_s + (omega - rest) * tau * -libm::expm1(-turn_s / tau);
    let table = run.iter().map(|(a, _)| a.actual_mm).fold(0.0, f64::max);
    let turned = run[last].1.motor_mm + 1.59 * travel;
    assert!((turned - table - 4e-3).abs() < 1e-9, "{}", turned - table);
}

#[test]
fn validates_gap_between_two_masses() {
    // Slow forth and back under the controller: the motor comes back by the gap and the twists before the table moves.
    let effects = Effects {
        two_mass: Some(TwoMass { damping_n_s_mm: 20.0, ..two_mass() }),
        backlash: Some(Backlash { gap_um: 8.0 }),
        friction: Some(Friction::Coulomb(Coulomb { static_nm: 0.1, ..coulomb() })),
        ..Effects::default()
    };
    let mut axis = real(&effects);
    let slow = |k: usize| {
        let t = k as f64 * DT;
        let x = if t < 0.5 { t } else { 1.0 - t };
        AxisReference { position_mm: x, velocity_mm_s: if t < 0.5 { 1.0 } else { -1.0 }, ..AxisReference::default() }
    };
    let mut behind = Vec::new();
    for k in 0..1000 {
        let a = axis.step(&slow(k));
        behind.push(1e3 * (axis.drive_signals().motor_mm - a.actual_mm));
    }
    // T_c and viscous friction twist the screw: T/k.
    let twist_um = 1.59e3 * (0.1 + 0.001 / 1.59) / two_mass().stiffness_nm_rad(&Drive::default());
    assert!((behind[480] - 4.0 - twist_um).abs() < 1e-3, "{} {twist_um}", behind[480]);
    assert!((behind[980] + 4.0 + twist_um).abs() < 1e-3, "{}", behind[980]);
}

/// Largest distance of the table between two runs \[nm\].
fn apart_nm(a: &Effects, b: &Effects, samples: usize) -> f64 {
    let (mut a, mut b) = (real(a), real(b));
    (0..samples)
        .map(|k| 1e6 * (a.step(&reference(k)).actual_mm - b.step(&reference(k)).actual_mm).abs())
        .fold(0.0, f64::max)
}

#[test]
fn validates_convergence() {
    // Half the step and a quarter of the tolerance: less than 1 nm over a run. Rounding to counts and noise would hide that, so
    // the measurement is exact.
    let lugre = Friction::LuGre(LuGre { curve: coulomb(), stiffness_nm_rad: 30.0, damping_nm_s_rad: 0.2 });
    let smooth = Effects { encoder: None, noise: None, dac: None, ..everything() };
    let rigid = Effects { two_mass: None, backlash: None, ..smooth.clone() };
    let mut worst = 0.0_f64;
    for (name, effects) in [
        ("all", smooth.clone()),
        ("all, LuGre", Effects { friction: Some(lugre), ..smooth.clone() }),
        ("no gap", Effects { backlash: None, ..smooth.clone() }),
        ("no gap, LuGre", Effects { backlash: None, friction: Some(lugre), ..smooth.clone() }),
        ("rigid", rigid.clone()),
        ("rigid, at once", Effects { delay: None, current_loop: None, ..rigid.clone() }),
        ("rigid, LuGre", Effects { friction: Some(lugre), ..rigid.clone() }),
        ("rigid, gap", Effects { backlash: Some(Backlash { gap_um: 5.0 }), ..rigid.clone() }),
        ("ripple", Effects { ripple: Some(ripple()), ..Effects::default() }),
    ] {
        let finer = |n: u32| Effects {
            integration: Integration { substeps: n, tolerance_mm_s: 1e-4 / f64::from(n * n) },
            ..effects.clone()
        };
        let (half, fine) = (apart_nm(&effects, &finer(2), 600), apart_nm(&effects, &finer(8), 600));
        println!("{name:20} {half:.4} nm, {fine:.4} nm");
        worst = worst.max(half).max(fine / 1.5);
    }
    assert!(worst < 1.0, "{worst} nm");
}
