//! The detailed drive model: metrics of measurement, electronics, compensation and disturbances in closed form, and what is refused.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // small numbers of samples

use std::f64::consts::PI;

use crate::common::drive::{Bench, DT, axis, open, real};
use nalgebra::Complex;
use servosim::servo::compensation::{
    Biquad, ClosedLoop, Compensation, CrossCoupling, CrossCouplingGains, Filter, LowPass, Notch, ZeroPhase,
};
use servosim::servo::controller::{AnyController, Cascade, CascadeGains, PPi, PPiGains, Pid, PidGains};
use servosim::servo::effects::{
    Backlash, Coulomb, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic, LookupTable,
    LuGre, Noise, PitchError, TorqueRipple, TwoMass, VelocityEstimate,
};
use servosim::servo::{AxisLoop, AxisReference, DetailedAxis, Drive, LoopSettings, Pdff, Plant};

fn curve() -> Coulomb {
    Coulomb { coulomb_nm: 0.1, static_nm: 0.15, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.0 }
}

#[test]
fn validates_delay_in_two_parts() {
    let voltage = |k: i64| if k < 0 { 0.0 } else { 2.0 * libm::sin(0.7 * k as f64) };
    let Plant { gain_rad_s_v, time_constant_s } = axis().plant;
    for delay in [0.0, 0.3, 1.0, 2.75, 16.0] {
        let effects = Effects { delay: Some(Delay { samples: delay }), ..Effects::default() };
        let mut axis = open(&effects, |k| 0.716 * voltage(i64::from(k)));
        let (mut theta, mut omega) = (0.0, 0.0);
        let mut part = |u: f64, t: f64| {
            let gap = -libm::expm1(-t / time_constant_s);
            theta += gain_rad_s_v * u * t + (omega - gain_rad_s_v * u) * time_constant_s * gap;
            omega += (gain_rad_s_v * u - omega) * gap;
            1.59 * theta
        };
        let (whole, broken) = (delay.floor() as i64, delay.fract());
        let mut position = 0.0;
        for k in 0..200 {
            let is = axis.step(&AxisReference::default()).actual_mm;
            assert!((is - position).abs() < 1e-11, "{delay} {k}: {is} {position}");
            part(voltage(k - whole - 1), broken * DT);
            position = part(voltage(k - whole), (1.0 - broken) * DT);
        }
    }
}

#[test]
fn validates_quantisation_limit_cycle() {
    for (velocity, place) in [
        (VelocityEstimate::Tachometer, EncoderPlace::Motor),
        (VelocityEstimate::Tachometer, EncoderPlace::Table),
        (VelocityEstimate::Difference, EncoderPlace::Motor),
    ] {
        let effects = Effects { encoder: Some(Encoder { place, resolution_um: 1.0, velocity }), ..Effects::default() };
        let mut axis = real(&effects);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..4000 {
            // Between two counts.
            let ramp = f64::min(f64::from(k) * 1e-3, 1.0);
            let s = axis.step(&AxisReference::at_rest(0.0104 * ramp));
            let counts = 1e3 * axis.drive_signals().measured_mm;
            assert!((counts - counts.round()).abs() < 1e-9);
            if k > 2000 {
                (low, high) = (low.min(s.actual_mm), high.max(s.actual_mm));
            }
        }
        let counts = 0.5e3 * (high - low);
        println!("limit cycle {velocity:?}: {counts} counts on either side");
        assert!(counts <= 1.0, "{velocity:?}: {counts}");
    }
}

#[test]
fn validates_observer_and_low_pass() {
    // A ramp: the low pass and the observer tell its slope in the end, and begin as their equations say.
    for (velocity, first) in [
        (VelocityEstimate::Difference, 1.0),
        (VelocityEstimate::LowPass { corner_hz: 50.0 }, -libm::expm1(-0.1 * PI)),
        (VelocityEstimate::Observer { bandwidth_hz: 50.0, damping: 0.8 }, 0.01 * PI * PI),
    ] {
        let encoder = Encoder { velocity, ..Encoder::default() };
        let effects = Effects { encoder: Some(encoder), ..Effects::default() };
        // One long pulse; what is compared is the estimate with the positions of the run.
        let mut axis = open(&effects, |k| if k == 0 { 1.0 } else { 0.0 });
        let mut last = 0.0;
        for k in 0..400 {
            let s = axis.step(&AxisReference::default());
            let d = axis.drive_signals();
            if k == 1 {
                let raw = (s.actual_mm - last) / DT / 1.59;
                assert!((d.measured_rad_s - first * raw).abs() < 1e-9, "{velocity:?}");
            }
            if k > 300 {
                assert!((d.measured_rad_s / s.velocity_rad_s - 1.0).abs() < 0.03);
            }
            last = s.actual_mm;
        }
    }
}

#[test]
fn validates_dac_and_noise() {
    let dac = Dac { bits: 6 };
    let effects = Effects { dac: Some(dac), ..Effects::default() };
    let step = dac.step_v(5.0);
    assert!((step - 5.0 / 31.0).abs() < 1e-15);
    let mut seen = std::collections::BTreeSet::new();
    let mut axis = open(&effects, |k| 0.716 * (-6.0 + 0.01 * f64::from(k)));
    for k in 0..1200 {
        let wanted = (-6.0 + 0.01 * f64::from(k)).clamp(-5.0, 5.0);
        let u = axis.step(&AxisReference::default()).voltage_v;
        assert!((u - wanted).abs() <= 0.5 * step + 1e-12);
        assert!((u / step - (u / step).round()).abs() < 1e-12);
        seen.insert((u / step).round() as i64);
    }
    assert_eq!(seen.len(), 63);

    let effects = Effects { noise: Some(Noise { rms_um: 0.2, seed: 3 }), ..Effects::default() };
    let mut axis = open(&effects, |_| 0.0);
    let n = 20_000;
    let (mut sum, mut square, mut lagged, mut last) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..n {
        axis.step(&AxisReference::default());
        let x = 1e3 * axis.drive_signals().measured_mm;
        (sum, square, lagged, last) = (sum + x, square + x * x, lagged + x * last, x);
    }
    let n = f64::from(n);
    // Five standard deviations of each estimate.
    assert!((sum / n).abs() < 5.0 * 0.2 / n.sqrt());
    assert!((square / n / 0.04 - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
    assert!((lagged / n / 0.04).abs() < 5.0 / n.sqrt());
}

#[test]
fn validates_force_twist_and_pitch_at_rest() {
    let two_mass = TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 20.0 };
    let force = LookupTable::new([(0.0, 240.0)], None).expect("a table");
    let pitch = LookupTable::new([(-1.0, 0.0), (0.0, 0.0), (4.0, 8.0)], None).expect("a table");
    let effects = Effects {
        two_mass: Some(two_mass),
        force: Some(CuttingForce::OverTime(force)),
        pitch: Some(PitchError { error_um: pitch }),
        ..Effects::default()
    };
    let mut axis = real(&effects);
    let s = (0..3000)
        .map(|k| axis.step(&AxisReference::at_rest(f64::min(0.01 * f64::from(k), 2.0))))
        .last()
        .expect("steps");
    let d = axis.drive_signals();
    // The motor stands where it should; the table has given by F/k, and the screw is 4 µm per 2 mm too long.
    assert!((d.motor_mm - 2.0).abs() < 1e-9, "{}", d.motor_mm);
    let nominal = 2.0 + 240.0 / 120.0 * 1e-3;
    assert!((s.actual_mm - nominal - 2e-3 * nominal).abs() < 1e-9, "{}", s.actual_mm);
    assert!((d.motor_torque_nm + 240.0 * 1.59e-3).abs() < 1e-9 && (d.force_nm - 240.0 * 1.59e-3).abs() < 1e-12);

    // Ripple at rest: the motor makes up for it.
    let harmonics = vec![
        Harmonic { per_revolution: 6, amplitude_nm: 0.03, phase_rad: 0.4 },
        Harmonic { per_revolution: 24, amplitude_nm: 0.01, phase_rad: 1.1 },
    ];
    let mut axis = real(&Effects { ripple: Some(TorqueRipple { harmonics }), ..Effects::default() });
    for k in 0..3000 {
        axis.step(&AxisReference::at_rest(f64::min(0.01 * f64::from(k), 2.0)));
    }
    let angle = 2.0 / 1.59;
    let ripple = 0.03 * libm::sin(6.0 * angle + 0.4) + 0.01 * libm::sin(24.0 * angle + 1.1);
    let d = axis.drive_signals();
    assert!((d.ripple_nm - ripple).abs() < 1e-9 && (d.motor_torque_nm + ripple).abs() < 1e-9);
}

#[test]
fn validates_the_signs_of_torques_in_steady_motion() {
    // T + r_g F = B ω + T_c + B_f ω: torque, cutting force and motion in one direction, the friction against them.
    let friction = Coulomb { coulomb_nm: 0.1, static_nm: 0.1, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.002 };
    let viscous = axis().plant.viscous_nm_s_rad(&axis().drive);
    let two_mass = TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 20.0 };
    for (direction, two_mass) in [(1.0, None), (-1.0, None), (1.0, Some(two_mass)), (-1.0, Some(two_mass))] {
        let (torque, force) = (direction * 0.05, direction * 100.0);
        let effects = Effects {
            two_mass,
            friction: Some(Friction::Coulomb(friction)),
            force: Some(CuttingForce::OverTime(LookupTable::new([(0.0, force)], None).expect("a table"))),
            ..Effects::default()
        };
        let mut axis = open(&effects, |_| torque);
        let s = (0..6000).map(|_| axis.step(&AxisReference::default())).last().expect("steps");
        let speed = (torque + 1.59e-3 * force - direction * 0.1) / (viscous + 0.002);
        assert!((s.velocity_rad_s / speed - 1.0).abs() < 1e-6, "{} {speed}", s.velocity_rad_s);
        let d = axis.drive_signals();
        assert!((d.friction_nm + direction * 0.1 + 0.002 * speed).abs() < 1e-6, "{d:?}");
        if let Some(two_mass) = two_mass {
            // The screw carries what does not come from the force: J_t ω_t' = 0 = G - T_f + r_g F.
            let spring = direction * 0.1 + 0.002 * speed - 1.59e-3 * force;
            let twist_mm = 1.59 * spring / two_mass.stiffness_nm_rad(&Drive::default());
            assert!((d.motor_mm - s.actual_mm - twist_mm).abs() < 1e-6, "{d:?} {twist_mm}");
        }
    }
}

#[test]
fn validates_lugre_before_and_while_it_slides() {
    let lugre = LuGre { curve: curve(), stiffness_nm_rad: 30.0, damping_nm_s_rad: 0.3 };
    let effects = Effects { friction: Some(Friction::LuGre(lugre)), ..Effects::default() };
    // Half of what it takes to slide bends the bristles by T/σ0 and hardly more (they creep by less than 1 %).
    let mut axis = open(&effects, |k| f64::min(f64::from(k) * 1e-4, 0.02));
    let s = (0..2000).map(|_| axis.step(&AxisReference::default())).last().expect("steps");
    let bend = s.actual_mm / 1.59;
    let held = axis.drive_signals().friction_nm;
    assert!((held + 0.02).abs() < 1e-4, "{held}");
    // Bristles on a rising load: z = (g/σ0)(1 - exp(-σ0 θ/g)) at low speed.
    let foreseen = -0.15 / 30.0 * libm::log1p(-0.02 / 0.15);
    assert!((bend / foreseen - 1.0).abs() < 0.01, "{bend} {foreseen}");
    // Sliding at a steady speed: the curve.
    let mut axis = open(&effects, |_| 0.3);
    let s = (0..4000).map(|_| axis.step(&AxisReference::default())).last().expect("steps");
    let friction = axis.drive_signals().friction_nm;
    assert!((friction + lugre.curve.curve_nm(1.59 * s.velocity_rad_s)).abs() < 1e-6, "{friction}");
}

#[test]
fn validates_stuck_time_and_spike_of_a_reversal() {
    // While the table sticks at x_s, the controller's torque is T_1 + kpv (kvf (ω_c - ω_c1) + kiv ∫ω_c), ω_c = kpp (x_c - x_s) + kpf v_c:
    // it breaks away where that reaches -T_s.
    // Sampled a hundred times as fast as usual, since the closed form is continuous.
    let settings = LoopSettings { period_s: 1e-5, ..LoopSettings::default() };
    let effects = Effects { friction: Some(Friction::Coulomb(curve())), ..Effects::default() };
    let axis_real = DetailedAxis::pdff(&axis(), &effects, &Compensation::default(), &settings, 0.0);
    let mut axis_real = Bench(axis_real.expect("sound"));
    let (a, w) = (1.0, 2.0 * PI);
    let x = |t: f64| a * (1.0 - libm::cos(w * t));
    let v = |t: f64| a * w * libm::sin(w * t);
    let samples: Vec<_> = (0..60_000)
        .map(|k| {
            let t = f64::from(k) * 1e-5;
            let s =
                axis_real.step(&AxisReference { position_mm: x(t), velocity_mm_s: v(t), ..AxisReference::default() });
            (t, s, axis_real.drive_signals().stuck)
        })
        .collect();
    let first = samples.iter().position(|(t, _, stuck)| *t > 0.3 && *stuck).expect("it sticks at the reversal");
    let length = samples[first..].iter().position(|(_, _, stuck)| !stuck).expect("it breaks away");
    let (t1, s1, _) = samples[first];
    let Pdff { kpp_rad_s_mm: kpp, kpv_nm_s_rad: kpv, kiv_1_s: kiv, kpf_rad_mm: kpf, kvf } = axis().pdff;
    let command = |t: f64| kpp * (x(t) - s1.actual_mm) + kpf * v(t);
    // ∫ω_c in closed form.
    let sum = |t: f64| kpp * ((a - s1.actual_mm) * t - a / w * libm::sin(w * t)) + kpf * x(t);
    let torque = |t: f64| s1.torque_nm + kpv * (kvf * (command(t) - command(t1)) + kiv * (sum(t) - sum(t1)));
    let (mut low, mut high) = (t1, t1 + 0.1);
    assert!(torque(high) < -0.15 && torque(low) > -0.15);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if torque(middle) < -0.15 { high = middle } else { low = middle }
    }
    let stuck_s = length as f64 * 1e-5;
    println!("stuck for {stuck_s} s, closed form {}", high - t1);
    assert!((stuck_s - (high - t1)).abs() < 0.01 * (high - t1));
    let spike = (samples[first + length - 1].1.command_mm - s1.actual_mm).abs();
    let foreseen = (x(high) - s1.actual_mm).abs();
    assert!((spike - foreseen).abs() < 0.01 * foreseen, "{spike} {foreseen}");
}

#[test]
fn validates_filters_against_their_response() {
    let (f0, depth, damping) = (150.0, 0.05, 0.4);
    let w = |f: f64| libm::tan(PI * f * DT) / libm::tan(PI * f0 * DT);
    let notch = Filter::Notch(Notch { frequency_hz: f0, depth, damping });
    let low_pass = Filter::LowPass(LowPass { frequency_hz: f0, damping });
    for (filter, top) in [(notch, 2.0 * depth * damping), (low_pass, 0.0)] {
        let mut biquad = Biquad::new(&filter, DT).expect("below Nyquist");
        let impulse: Vec<f64> = (0..400).map(|k| biquad.step(if k == 0 { 1.0 } else { 0.0 })).collect();
        for f in [1.0, 50.0, 120.0, 150.0, 180.0, 300.0, 450.0] {
            let discrete: Complex<f64> =
                impulse.iter().enumerate().map(|(k, h)| Complex::from_polar(*h, -2.0 * PI * f * DT * k as f64)).sum();
            let s = Complex::new(0.0, w(f));
            let below = s * s + s * (2.0 * damping) + 1.0;
            let above = if top > 0.0 { s * s + s * top + 1.0 } else { Complex::new(1.0, 0.0) };
            assert!((discrete - above / below).norm() < 1e-12, "{f}");
            if f == f0 && top > 0.0 {
                assert!((discrete.norm() - depth).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn validates_zero_phase() {
    for one_sample_delay in [false, true] {
        let settings = LoopSettings { one_sample_delay, ..LoopSettings::default() };
        let closed = ClosedLoop::pdff(&axis(), &settings);
        let ideal = |x: f64, axis: &mut AxisLoop| axis.step(x, 0.0).actual_mm;
        // The loop's polynomials against the loop: its impulse response.
        let mut axis_loop = AxisLoop::new(&axis(), &settings, 0.0);
        let order = closed.denominator.len() - 1;
        let response: Vec<f64> =
            (0..60).map(|k| ideal(if k == 0 { 1e-3 } else { 0.0 }, &mut axis_loop) * 1e3).collect();
        let mut y = vec![0.0; 60];
        for k in 0..60 {
            let offset = order + 1 - closed.numerator.len();
            let mut sum =
                if k >= offset && k - offset < closed.numerator.len() { closed.numerator[k - offset] } else { 0.0 };
            for j in 1..=order.min(k) {
                sum -= closed.denominator[j] * y[k - j];
            }
            y[k] = sum;
            assert!((y[k] - response[k]).abs() < 1e-9, "{k} {} {}", y[k], response[k]);
        }
        // Filter and loop: nothing but their delay.
        let prefilter = ZeroPhase::new(&closed).expect("a loop");
        for f in [5.0, 40.0, 150.0, 400.0] {
            let mut filter = prefilter.clone();
            let n = 4000;
            let z = Complex::from_polar(1.0, 2.0 * PI * f * DT);
            let mut sum = Complex::new(0.0, 0.0);
            for k in 0..n {
                let out = filter.step(if k == 0 { 1.0 } else { 0.0 });
                sum += z.powi(-k) * out;
            }
            let whole = sum * closed.response(z) * z.powi(prefilter.look_ahead() as i32);
            assert!(whole.arg().abs() < 1e-9 && whole.re > 0.0, "{f}: {whole}");
        }
    }
}

#[test]
fn validates_controllers_settle_without_error() {
    let drive = Drive::default();
    let loops = PPiGains { position_rad_s_mm: 60.0, velocity_nm_s_rad: 0.8, integral_1_s: 60.0 };
    let pid = PidGains { proportional_v_mm: 40.0, integral_v_mm_s: 200.0, derivative_v_s_mm: 0.5, filter_hz: 300.0 };
    let full = CascadeGains::with_feedforward(loops, &axis());
    let controllers = [
        AnyController::PPi(PPi::new(&loops, DT).expect("gains")),
        AnyController::Pid(Pid::new(&pid, &drive, DT).expect("gains")),
        AnyController::Cascade(Cascade::new(&full, DT).expect("gains")),
    ];
    let mut worst = Vec::new();
    for controller in controllers {
        let real = DetailedAxis::new(
            &axis(),
            controller,
            &Effects::default(),
            &Compensation::default(),
            &LoopSettings::default(),
            0.0,
        );
        let mut real = Bench(real.expect("sound"));
        let mut largest = 0.0_f64;
        for k in 0..3000 {
            let t = f64::min(f64::from(k) * DT, 1.0);
            let (w, moving) = (2.0 * PI, t < 1.0);
            let reference = AxisReference {
                position_mm: 5.0 * (1.0 - libm::cos(w * t)),
                velocity_mm_s: if moving { 5.0 * w * libm::sin(w * t) } else { 0.0 },
                acceleration_mm_s2: if moving { 5.0 * w * w * libm::cos(w * t) } else { 0.0 },
                ..AxisReference::default()
            };
            let s = real.step(&reference);
            let error = (reference.position_mm - s.actual_mm).abs();
            largest = largest.max(error);
            assert!(k < 2900 || error < 1e-6, "{controller:?}: {error}");
        }
        worst.push(largest);
    }
    // Feedforward follows twenty times as closely as the cascade without it.
    assert!(worst[2] < 0.05 * worst[0], "{worst:?}");
}

#[test]
fn validates_cross_coupling() {
    let gains = CrossCouplingGains { proportional: 2.0, integral_1_s: 10.0, derivative_s: 0.01, limit_um: 500.0 };
    let mut coupling = CrossCoupling::new(&gains, DT).expect("gains");
    let [x, y] = coupling.step([0.01, -0.02]);
    assert!((x - (0.02 + 1e-4 + 0.1)).abs() < 1e-15 && (y + 0.04 + 2e-4 + 0.2).abs() < 1e-15);
    assert_eq!(coupling.step([1.0, 0.0])[0], 0.5);
}

/// A change to the effects, and what the refusal says.
type Wrong = (fn(&mut Effects), &'static str);

#[test]
fn refuses_what_no_drive_has() {
    let wrong: [Wrong; 12] = [
        (
            |e| e.two_mass = Some(TwoMass { table_mass_kg: 150.0, stiffness_n_um: -1.0, damping_n_s_mm: 1.0 }),
            "stiffness",
        ),
        (|e| e.two_mass = Some(TwoMass { table_mass_kg: 1e4, stiffness_n_um: 100.0, damping_n_s_mm: 1.0 }), "lighter"),
        (|e| e.two_mass = Some(TwoMass { table_mass_kg: 1.0, stiffness_n_um: 1e8, damping_n_s_mm: 1.0 }), "softer"),
        (|e| e.friction = Some(Friction::Coulomb(Coulomb { static_nm: 0.05, ..curve() })), "never sticks"),
        (|e| e.friction = Some(Friction::Coulomb(Coulomb { static_nm: 5.0, ..curve() })), "never slip"),
        (|e| e.friction = Some(Friction::Coulomb(Coulomb { coulomb_nm: f64::NAN, ..curve() })), "coulomb_nm"),
        (|e| e.delay = Some(Delay { samples: 17.0 }), "16 control periods"),
        (|e| e.dac = Some(Dac { bits: 1 }), "bits"),
        (|e| e.noise = Some(Noise { rms_um: -1.0, seed: 0 }), "noise"),
        (|e| e.backlash = Some(Backlash { gap_um: 0.0 }), "gap_um"),
        (
            |e| {
                let velocity = VelocityEstimate::Observer { bandwidth_hz: 300.0, damping: 1.0 };
                e.encoder = Some(Encoder { velocity, ..Encoder::default() });
            },
            "unstable",
        ),
        (|e| e.integration.substeps = 0, "substeps"),
    ];
    for (change, says) in wrong {
        let mut effects = Effects::default();
        change(&mut effects);
        let error = effects.check(&axis(), &LoopSettings::default()).expect_err(says).to_string();
        assert!(error.contains(says), "{error}");
    }
    let notch = Filter::Notch(Notch { frequency_hz: 600.0, depth: 0.1, damping: 0.5 });
    let error = Biquad::new(&notch, DT).expect_err("above Nyquist").to_string();
    assert!(error.contains("Nyquist"), "{error}");
    assert!(LookupTable::new([(1.0, 0.0), (1.0, 1.0)], None).is_err() && LookupTable::new([], None).is_err());
    assert!(
        LookupTable::new([(0.0, f64::NAN)], None).is_err()
            && LookupTable::new([(0.0, 1.0), (2.0, 1.0)], Some(1.0)).is_err()
    );
}

#[test]
fn regression_wild_parameters_and_demands_end() {
    // Whatever is allowed comes to an end, and never panics.
    let axes = axis();
    for seed in 0..300_u64 {
        let mut random = servosim::optimize::Random::new(seed);
        let mut pick = |low: f64, high: f64| libm::pow(10.0, random.between(low, high));
        let coulomb_nm = pick(-6.0, 0.3);
        let friction = Coulomb {
            coulomb_nm,
            static_nm: f64::min(coulomb_nm * (1.0 + pick(-3.0, 0.5)), 3.0),
            stribeck_mm_s: pick(-3.0, 3.0),
            viscous_nm_s_rad: pick(-6.0, 0.0),
        };
        let lugre = LuGre { curve: friction, stiffness_nm_rad: pick(-2.0, 6.0), damping_nm_s_rad: pick(-4.0, 2.0) };
        let effects = Effects {
            two_mass: (seed % 3 > 0).then(|| TwoMass {
                table_mass_kg: pick(-2.0, 2.7),
                stiffness_n_um: pick(-2.0, 2.5),
                damping_n_s_mm: pick(-3.0, 4.0),
            }),
            friction: Some(if seed % 2 == 0 { Friction::Coulomb(friction) } else { Friction::LuGre(lugre) }),
            backlash: (seed % 5 > 1).then(|| Backlash { gap_um: pick(-4.0, 4.0) }),
            delay: Some(Delay { samples: pick(-3.0, 1.0) }),
            ..Effects::default()
        };
        let Ok(real) = DetailedAxis::pdff(&axes, &effects, &Compensation::default(), &LoopSettings::default(), 0.0)
        else {
            continue;
        };
        let mut real = Bench(real);
        for k in 0..60 {
            let position_mm = if k < 30 { 0.3 * f64::from(k) } else { -1e3 };
            let s = real.step(&AxisReference { position_mm, ..AxisReference::default() });
            // Nor does any drive go faster than its voltage lets it, or further than its screw gives.
            assert!(s.actual_mm.abs() < 1e3, "seed {seed}, sample {k}: {} mm, {effects:?}", s.actual_mm);
        }
        real.step(&AxisReference::at_rest(f64::NAN));
        real.step(&AxisReference::at_rest(f64::INFINITY));
        real.step(&AxisReference::at_rest(0.0));
    }
}
