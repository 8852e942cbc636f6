//! Analysis of the sampled loop, against the specification's table and second routes.

use std::time::Instant;

use crate::common::Case;
use nalgebra::{Complex, DMatrix};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::analysis::{
    DriveLoop, Feedforward, Margins, SampledLoop, bandwidth, error_constants, margins, peak_sensitivity,
    stable_gain_factors, step_response,
};
use servosim::scenario::Document;
use servosim::servo::{AxisLoop, AxisParameters, Derivative, Drive, LoopSettings, Pdff, Plant};

/// Axes around the paper's, stable and unstable; now and then without one of the gains.
fn random_axis(rng: &mut Xoshiro256PlusPlus) -> (AxisParameters, LoopSettings) {
    let plant = Plant { gain_rad_s_v: rng.random_range(20.0..150.0), time_constant_s: rng.random_range(0.02..0.5) };
    let period_s = 10f64.powf(rng.random_range(-4.0..-2.7));
    let share: f64 = rng.random_range(0.05..1.2);
    let mut pdff = Pdff {
        kpp_rad_s_mm: 0.1 * rng.random_range(0.05..2.0) / period_s,
        kpv_nm_s_rad: share * 0.716 * plant.time_constant_s / (plant.gain_rad_s_v * period_s),
        kiv_1_s: 0.25 * rng.random_range(0.05..2.0) / period_s,
        kpf_rad_mm: rng.random_range(0.0..0.8),
        kvf: rng.random_range(0.3..1.2),
    };
    match rng.random_range(0..12) {
        0 => pdff.kiv_1_s = 0.0,
        1 => pdff.kvf = 0.0,
        2 => (pdff.kpf_rad_mm, pdff.kpp_rad_s_mm) = (0.0, 0.01 * pdff.kpp_rad_s_mm),
        _ => {}
    }
    let derivative = if rng.random_bool(0.5) { Derivative::Exact } else { Derivative::Backward };
    let settings = LoopSettings { period_s, settling_s: 0.1, derivative, one_sample_delay: rng.random_bool(0.5) };
    (AxisParameters { plant, drive: Drive::default(), pdff }, settings)
}

/// The axis with its loop gain multiplied: all of the loop is behind `k_T`.
fn scaled(axis: &AxisParameters, factor: f64) -> AxisParameters {
    let mut axis = *axis;
    axis.drive.torque_to_voltage_v_nm *= factor;
    axis
}

fn radius(axis: &AxisParameters, settings: &LoopSettings) -> f64 {
    SampledLoop::new(axis, settings).pole_radius()
}

/// Until a motion with this pole radius has fallen by `exp(-decay)`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a few thousand
fn samples_until(radius: f64, decay: f64) -> usize {
    (-decay / radius.ln()).ceil() as usize + 10
}

#[test]
fn validates_the_table_of_the_specification() {
    // Ms, phase margin [deg], crossover [rad/s], gain factors, delay margin [ms]: every digit shown, but for two where the
    // table was read off a grid of frequencies just below the crossover, see the next test.
    let table = [
        ["1.5635", "37.76", "670.1", "0.2114", "3.3081", "0.983"],
        ["1.5620", "37.80", "668.3", "0.2095", "3.3190", "0.987"],
        ["1.6033", "36.61", "676.9", "0.2299", "3.2790", "0.944"],
        ["1.6167", "36.19", "658.8", "0.2352", "3.3849", "0.959"],
    ];
    let axes = Case::both().into_iter().flat_map(|case| case.axes);
    for (axis, expected) in axes.zip(table) {
        let m = margins(&axis, &LoopSettings::default());
        let shown = [
            format!("{:.4}", m.peak_sensitivity),
            format!("{:.2}", m.phase_margin_deg),
            format!("{:.1}", m.crossover_rad_s),
            format!("{:.4}", m.gain_down),
            format!("{:.4}", m.gain_up),
            format!("{:.3}", 1e3 * m.delay_margin_s),
        ];
        assert_eq!(shown, expected, "{m:?}");
        assert!(m.stable && m.is_conditionally_stable() && m.pole_radius < 1.0);
    }
}

#[test]
fn two_last_digits_of_the_specification_lie_beside_the_crossover() {
    // heart Y "at 658.7": |L| falls through 1 between 658.75 and 658.80. alpha X "0.984 ms": 37.76°/670.1 is 0.98349, and with
    // the crossover 670.14 it is 0.98345. Both with nothing of the analysis but the transfer, which is held against the
    // time domain below.
    let size = |axis, omega| SampledLoop::new(axis, &LoopSettings::default()).transfer(omega).norm();
    let heart_y = Case::heart().axes[1];
    assert!(size(&heart_y, 658.75) > 1.0 && size(&heart_y, 658.80) < 1.0);
    let alpha_x = Case::alpha().axes[0];
    assert!(size(&alpha_x, 670.14) > 1.0 && size(&alpha_x, 670.15) < 1.0);
    let m = margins(&alpha_x, &LoopSettings::default());
    assert!((m.delay_margin_s - m.phase_margin_deg.to_radians() / m.crossover_rad_s).abs() < 1e-15);
}

#[test]
fn validates_the_poles_against_the_eigenvalues_of_the_loop_itself() {
    // The matrix is identified from `AxisLoop`: nothing of the analysis is in it. An impulse response of the voltage obeys the
    // characteristic polynomial; and the matrix in closed form has the same eigenvalues (nalgebra's Schur).
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    for case in 0..400 {
        let (axis, settings) = random_axis(&mut rng);
        let sampled = SampledLoop::new(&axis, &settings);
        let poles = sampled.poles();
        let eigenvalues = sampled.closed_loop_matrix().complex_eigenvalues();
        assert_eq!(poles.len(), eigenvalues.len());
        for pole in &poles {
            let nearest = eigenvalues.iter().map(|e| (e - pole).norm()).fold(f64::INFINITY, f64::min);
            // Nearly equal poles lose half of the digits.
            assert!(nearest < 1e-6, "case {case}: {poles:?} {eigenvalues}");
        }
        // Σ c_i y[k+i] = 0 for the free motion after a step that was taken back.
        let mut polynomial = vec![Complex::new(1.0, 0.0)];
        for pole in &poles {
            polynomial.push(Complex::new(0.0, 0.0));
            for i in (1..polynomial.len()).rev() {
                let before = polynomial[i - 1];
                polynomial[i] -= before * pole;
            }
        }
        let mut free = axis;
        free.drive.voltage_limit_v = f64::INFINITY;
        let mut axis_loop = AxisLoop::new(&free, &settings, 0.0);
        axis_loop.step(1.0, 0.0);
        axis_loop.step(0.0, 0.0);
        let motion: Vec<f64> = (0..12).map(|_| axis_loop.step(0.0, 0.0).actual_mm).collect();
        for window in motion.windows(polynomial.len()) {
            let (sum, size) = polynomial
                .iter()
                .zip(window.iter().rev())
                .fold((0.0, 0.0), |(sum, size), (c, y)| (sum + c.re * y, size + (c.norm() * y).abs()));
            assert!(sum.abs() <= 1e-10 * size, "case {case}: {sum} of {size}");
        }
    }
}

#[test]
fn validates_stability_and_gain_margins_against_the_poles() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(22);
    let (mut stable, mut conditional, mut bounded) = (0, 0, 0);
    for case in 0..4000 {
        let (axis, settings) = random_axis(&mut rng);
        let m = margins(&axis, &settings);
        let what = || format!("case {case}: {axis:?} {settings:?} {m:?}");
        let r = radius(&axis, &settings);
        assert_eq!(m.pole_radius, r);
        if (r - 1.0).abs() > 1e-9 {
            assert_eq!(m.stable, r < 1.0, "{}", what());
        }
        let intervals = stable_gain_factors(&SampledLoop::new(&axis, &settings));
        let own = intervals.iter().find(|(low, high)| (*low..*high).contains(&1.0));
        assert_eq!(m.stable, own.is_some(), "{} {intervals:?}", what());
        // Ends of every interval: a pole on the circle, and within it the poles are inside.
        for &(low, high) in &intervals {
            for end in [low, high].into_iter().filter(|end| *end > 0.0 && end.is_finite()) {
                // A multiple pole on the circle would lose half of the digits; none turns up.
                assert!((radius(&scaled(&axis, end), &settings) - 1.0).abs() < 1e-9, "{} {end}", what());
            }
            for share in [0.001, 0.3, 0.7, 0.999] {
                let high = if high.is_finite() { high } else { low + 1e3 };
                assert!(radius(&scaled(&axis, low + share * (high - low)), &settings) < 1.0, "{}", what());
            }
        }
        if !m.stable {
            continue;
        }
        stable += 1;
        conditional += i32::from(m.gain_down > 0.0);
        bounded += i32::from(m.gain_up.is_finite());
        assert_eq!(own, Some(&(m.gain_down, m.gain_up)));
        // The same by bisection on the pole radius, outwards from 1.
        let bisected = |mut inside: f64, mut outside: f64| {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                if radius(&scaled(&axis, middle), &settings) < 1.0 { inside = middle } else { outside = middle }
            }
            inside
        };
        if case % 8 == 0 {
            if m.gain_down > 0.0 {
                assert!((bisected(1.0, 0.999 * m.gain_down) / m.gain_down - 1.0).abs() < 1e-9, "{}", what());
            }
            if m.gain_up.is_finite() {
                assert!((bisected(1.0, 1.001 * m.gain_up) / m.gain_up - 1.0).abs() < 1e-9, "{}", what());
            }
        }
    }
    // The cases are what they are meant to be.
    assert!(stable > 1000 && stable < 3900 && conditional > 300 && bounded > 1000, "{stable} {conditional} {bounded}");
}

#[test]
fn validates_crossovers_and_sensitivity_against_a_dense_grid() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
    let mut checked = 0;
    for case in 0..600 {
        let (axis, settings) = random_axis(&mut rng);
        let m = margins(&axis, &settings);
        if !m.stable {
            assert_eq!(peak_sensitivity(&axis, &settings), None);
            continue;
        }
        checked += 1;
        let what = || format!("case {case}: {axis:?} {settings:?} {m:?}");
        let sampled = SampledLoop::new(&axis, &settings);
        let grid = |i: i32| sampled.nyquist_rad_s() * 10f64.powf(f64::from(i - 20_000) / 4000.0);
        let (mut peak, mut phase, mut delay) = (0.0_f64, f64::INFINITY, f64::INFINITY);
        let mut before: Option<(f64, Complex<f64>)> = None;
        for i in 0..=20_000 {
            let omega = grid(i);
            let l = sampled.transfer(omega);
            peak = peak.max(1.0 / (l + 1.0).norm());
            if let Some((last, at)) = before
                && (at.norm() - 1.0) * (l.norm() - 1.0) <= 0.0
            {
                // Linear between two points 0.06 % apart.
                let share = (at.norm() - 1.0) / (at.norm() - l.norm());
                let (omega, l) = (last + share * (omega - last), at + (l - at) * share);
                let lead = (-l).arg();
                phase = phase.min(lead.abs().to_degrees());
                delay = delay.min(lead.rem_euclid(std::f64::consts::TAU) / omega);
            }
            before = Some((omega, l));
        }
        // The grid is too low by the square of half a step over the width of the peak, the crossover is linear on it.
        assert!(m.peak_sensitivity >= peak * (1.0 - 1e-12), "{} {peak}", what());
        if m.peak_sensitivity < 30.0 {
            assert!(m.peak_sensitivity < peak * (1.0 + 2e-4), "{} {peak}", what());
        }
        assert!((m.phase_margin_deg - phase).abs() < 1e-3, "{} {phase}", what());
        assert!((m.delay_margin_s / delay - 1.0).abs() < 1e-3, "{} {delay}", what());
        // At the crossover |L| is 1, at the peak the sensitivity is the peak and stationary.
        assert!((sampled.transfer(m.crossover_rad_s).norm() - 1.0).abs() < 1e-9, "{}", what());
        let at = |omega: f64| 1.0 / (sampled.transfer(omega) + 1.0).norm();
        let omega = m.peak_sensitivity_at_rad_s;
        assert!((at(omega) / m.peak_sensitivity - 1.0).abs() < 1e-9, "{}", what());
        for near in [0.999, 1.001] {
            let near = (near * omega).min(sampled.nyquist_rad_s());
            assert!(at(near) <= m.peak_sensitivity * (1.0 + 1e-12), "{}", what());
        }
        assert_eq!(peak_sensitivity(&axis, &settings).map(|p| p.peak), Some(m.peak_sensitivity));
        assert!((m.modulus_margin() * m.peak_sensitivity - 1.0).abs() < 1e-15);
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn validates_the_delay_margin_against_a_loop_with_whole_samples_of_delay() {
    // Where the loop with its gain lowered by g has a delay margin of exactly one sample, the loop with one sample of delay
    // is on the verge: its gain margin is g. No formula of the delay margin is in that.
    for axis in Case::both().into_iter().flat_map(|case| case.axes) {
        for kiv_1_s in [axis.pdff.kiv_1_s, 60.0, 0.0] {
            let axis = AxisParameters { pdff: Pdff { kiv_1_s, ..axis.pdff }, ..axis };
            let settings = LoopSettings::default();
            let delayed = LoopSettings { one_sample_delay: true, ..settings };
            let verge = stable_gain_factors(&SampledLoop::new(&axis, &delayed));
            let &[(low, high)] = verge.as_slice() else { panic!("{verge:?}") };
            for end in [low, high].into_iter().filter(|end| *end > 0.0) {
                let m = margins(&scaled(&axis, end), &settings);
                assert!((m.delay_margin_s / settings.period_s - 1.0).abs() < 1e-9, "{end} {m:?}");
            }
            for (inside, stable) in [(1.001 * low.max(1e-3), true), (0.999 * high, true), (1.001 * high, false)] {
                assert_eq!(margins(&scaled(&axis, inside), &delayed).stable, stable);
            }
        }
    }
}

#[test]
fn validates_the_phase_margin_by_turning_the_loop() {
    // L turned by the phase margin passes through -1: |1 + L e^{∓jφ}| = 0 at the crossover.
    for axis in Case::both().into_iter().flat_map(|case| case.axes) {
        let m = margins(&axis, &LoopSettings::default());
        let l = SampledLoop::new(&axis, &LoopSettings::default()).transfer(m.crossover_rad_s);
        let turned = l * Complex::from_polar(1.0, -m.phase_margin_deg.to_radians());
        assert!((turned + 1.0).norm() < 1e-9, "{turned}");
    }
}

#[test]
fn validates_the_loop_transfer_against_a_sinusoid_through_the_axis_loop() {
    // A closed loop driven by exp(jωt) settles to the command response; a stable one after 60 time constants of its
    // slowest pole is settled to rounding. With kpf = 0: x/x_com = Gθ(…)/(1 + L), so L follows from the ratio.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(24);
    let mut checked = 0;
    while checked < 40 {
        let (axis, settings) = random_axis(&mut rng);
        let sampled = SampledLoop::new(&axis, &settings);
        let r = sampled.pole_radius();
        if !(r < 0.995) {
            continue;
        }
        checked += 1;
        let mut free = axis;
        free.drive.voltage_limit_v = f64::INFINITY;
        for feedforward in [Feedforward::Without, Feedforward::With] {
            if feedforward == Feedforward::Without {
                free.pdff.kpf_rad_mm = 0.0;
            } else {
                free.pdff.kpf_rad_mm = axis.pdff.kpf_rad_mm;
            }
            let omega = sampled.nyquist_rad_s() * 10f64.powf(rng.random_range(-2.0..-0.05));
            let anti_windup = samples_until(r, 30.0);
            let mut parts = [AxisLoop::new(&free, &settings, 0.0), AxisLoop::new(&free, &settings, 0.0)];
            let (mut ratio, mut voltage, mut theta) = (Complex::default(), Complex::default(), Complex::default());
            for k in 0..=anti_windup {
                let phase = Complex::from_polar(1.0, omega * settings.period_s * k as f64);
                let rate = phase * Complex::new(0.0, omega);
                let re = parts[0].step(phase.re, rate.re);
                let im = parts[1].step(phase.im, rate.im);
                ratio = Complex::new(re.actual_mm, im.actual_mm) / phase;
                voltage = Complex::new(re.voltage_v, im.voltage_v) / phase;
                theta = Complex::new(re.velocity_rad_s, im.velocity_rad_s) / phase;
            }
            let expected = sampled.command_response(omega, feedforward);
            assert!((ratio - expected).norm() < 1e-8 * expected.norm().max(1.0), "{ratio} {expected} {axis:?}");
            // u = u_d - L u at the break, u_d what the command alone asks for.
            let z = Complex::from_polar(1.0, omega * settings.period_s);
            let derivative = match settings.derivative {
                Derivative::Backward => (Complex::new(1.0, 0.0) - z.inv()) / settings.period_s,
                Derivative::Exact => Complex::new(0.0, omega),
            };
            let reference = derivative * free.pdff.kpf_rad_mm + free.pdff.kpp_rad_s_mm;
            let g = axis.drive.torque_to_voltage_v_nm * axis.pdff.kpv_nm_s_rad;
            let sum = Complex::new(settings.period_s * axis.pdff.kiv_1_s, 0.0) / (z - 1.0);
            let asked = reference * (sum + axis.pdff.kvf) * g;
            let l = asked / voltage - 1.0;
            let ours = sampled.transfer(omega);
            assert!((l - ours).norm() < 1e-7 * ours.norm().max(1.0), "{l} {ours} {theta}");
        }
    }
}

#[test]
fn margins_are_never_nan_whatever_the_parameters() {
    let extreme = [0.0, 1e-9, 1e-3, 1.0, 97.38, 1e4, 1e9];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(25);
    let mut pick = |zero: bool| extreme[rng.random_range(usize::from(!zero)..extreme.len())];
    for _ in 0..20_000 {
        let axis = AxisParameters {
            plant: Plant { gain_rad_s_v: pick(false), time_constant_s: pick(false) },
            drive: Drive {
                transmission_mm_rad: pick(false),
                torque_to_voltage_v_nm: pick(false),
                voltage_limit_v: pick(false),
            },
            pdff: Pdff {
                kpp_rad_s_mm: pick(true),
                kpv_nm_s_rad: pick(true),
                kiv_1_s: pick(true),
                kpf_rad_mm: pick(true),
                kvf: pick(true),
            },
        };
        axis.check().unwrap();
        let delay = pick(true) > 1.0;
        let settings = LoopSettings { period_s: pick(false), one_sample_delay: delay, ..LoopSettings::default() };
        let m = margins(&axis, &settings);
        let Margins { gain_down, gain_up, phase_margin_deg, crossover_rad_s, delay_margin_s, .. } = m;
        let metrics = [gain_down, gain_up, phase_margin_deg, crossover_rad_s, delay_margin_s, m.pole_radius];
        let what = || format!("{axis:?} {settings:?} {m:?}");
        assert!(metrics.iter().all(|f| *f >= 0.0), "{}", what());
        assert!(gain_down <= 1.0 && gain_up >= 1.0, "{}", what());
        assert!(m.peak_sensitivity > 0.0 && m.peak_sensitivity_at_rad_s >= 0.0, "{}", what());
        if m.stable {
            // Whatever destabilises by gain or phase is as near as the modulus margin says, and no nearer.
            let slack = 1.0 + 1e-9;
            assert!(gain_up * slack >= 1.0 + m.modulus_margin() || gain_up.is_infinite(), "{}", what());
            assert!(gain_down <= 1.0 / (1.0 + m.modulus_margin()) * slack || gain_down == 0.0, "{}", what());
        } else {
            let gone = (gain_down, gain_up, phase_margin_deg, delay_margin_s, m.modulus_margin());
            assert_eq!(gone, (1.0, 1.0, 0.0, 0.0, 0.0));
        }
    }
}

#[test]
fn an_axis_that_does_not_hold_its_position_is_not_stable() {
    let axis = Case::alpha().axes[0];
    let with = |change: fn(&mut Pdff)| {
        let mut axis = axis;
        change(&mut axis.pdff);
        margins(&axis, &LoopSettings::default())
    };
    assert!(with(|_| ()).stable && with(|g| g.kiv_1_s = 0.0).stable && with(|g| g.kpf_rad_mm = 0.0).stable);
    for open in
        [with(|g| g.kpp_rad_s_mm = 0.0), with(|g| g.kpv_nm_s_rad = 0.0), with(|g| (g.kvf, g.kiv_1_s) = (0.0, 0.0))]
    {
        assert!(!open.stable && (open.pole_radius - 1.0).abs() < 1e-12, "{open:?}");
    }
    // Without an integral less gain only makes the loop slower.
    let m = with(|g| g.kiv_1_s = 0.0);
    assert!(m.gain_down == 0.0 && !m.is_conditionally_stable());
}

#[test]
fn validates_the_error_constants_against_a_ramp_and_a_parabola_through_the_axis_loop() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(26);
    let mut checked = 0;
    while checked < 60 {
        let (axis, settings) = random_axis(&mut rng);
        let r = radius(&axis, &settings);
        let Some(constants) = error_constants(&axis, &settings).filter(|_| r < 0.995) else { continue };
        checked += 1;
        let mut free = axis;
        free.drive.voltage_limit_v = f64::INFINITY;
        let (speed, accel) = (100.0, 1000.0);
        // Long enough to anti_windup to rounding, and for the constants from two points of the parabola.
        let anti_windup = samples_until(r, 35.0);
        let error = |command: &dyn Fn(f64) -> (f64, f64), samples: usize| {
            let mut axis_loop = AxisLoop::new(&free, &settings, 0.0);
            let mut last = 0.0;
            for k in 0..=samples {
                let (x, v) = command(k as f64 * settings.period_s);
                last = x - axis_loop.step(x, v).actual_mm;
            }
            last
        };
        let ramp = error(&|t| (speed * t, speed), anti_windup);
        let expected = constants.velocity_s * speed;
        assert!((ramp - expected).abs() < 1e-9 * speed, "{ramp} {expected} {axis:?} {settings:?}");
        let closed_form = (1.0 / 1.59 - axis.pdff.kpf_rad_mm) / axis.pdff.kpp_rad_s_mm;
        if axis.pdff.kiv_1_s > 0.0 {
            assert!((constants.velocity_s - closed_form).abs() < 1e-12 * (1.0 + closed_form.abs()));
        }
        let parabola = error(&|t| (0.5 * accel * t * t, accel * t), anti_windup);
        let v = accel * anti_windup as f64 * settings.period_s;
        let expected = constants.velocity_s * v + constants.acceleration_s2 * accel;
        // The position has grown to metres: 1e-16 of it, times the loop's own amplification.
        let tolerance = 1e-6 * (constants.acceleration_s2 * accel).abs() + 1e-12 * v * v / accel;
        assert!((parabola - expected).abs() < tolerance, "{parabola} {expected} {constants:?} {axis:?} {settings:?}");
    }
}

#[test]
fn validates_the_step_response_against_powers_of_the_matrix() {
    // Without feedforward a step is the free motion from -1 mm: x(k) = 1 + C A^k x0, θ0 = -1/r_g, everything else at rest.
    for one_sample_delay in [false, true] {
        for axis in Case::both().into_iter().flat_map(|case| case.axes) {
            let mut axis = axis;
            (axis.pdff.kpp_rad_s_mm, axis.pdff.kiv_1_s) = (50.0, 80.0);
            axis.pdff.kpv_nm_s_rad *= 0.6;
            let settings = LoopSettings { one_sample_delay, ..LoopSettings::default() };
            let response = step_response(&axis, &settings, Feedforward::Without);
            let a: DMatrix<f64> = SampledLoop::new(&axis, &settings).closed_loop_matrix();
            let mut state = DMatrix::zeros(a.nrows(), 1);
            state[0] = -1.0 / 1.59;
            let mut exact = Vec::new();
            for actual in &response.actual {
                exact.push(1.0 + 1.59 * state[0]);
                assert!((actual - exact[exact.len() - 1]).abs() < 1e-11);
                state = &a * state;
            }
            // The metrics once more, from the samples alone.
            let metrics = response.metrics.unwrap();
            let peak = exact.iter().copied().fold(0.0, f64::max);
            assert!((metrics.overshoot_percent - 100.0 * (peak - 1.0).max(0.0)).abs() < 1e-8, "{peak} {metrics:?}");
            let last_outside = exact.iter().rposition(|x| (x - 1.0).abs() > 0.02).unwrap() as f64 * 1e-3;
            assert!((last_outside..=last_outside + 1e-3).contains(&metrics.settling_s), "{metrics:?}");
            let first = |level: f64| exact.iter().position(|x| *x >= level).unwrap() as f64 * 1e-3;
            assert!((metrics.rise_s - (first(0.9) - first(0.1))).abs() <= 1e-3, "{metrics:?}");
        }
    }
}

#[test]
fn validates_the_bandwidth_against_the_response() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(27);
    let (mut checked, mut again) = (0, 0);
    for _ in 0..300 {
        let (axis, settings) = random_axis(&mut rng);
        let sampled = SampledLoop::new(&axis, &settings);
        for feedforward in [Feedforward::Without, Feedforward::With] {
            let Some(found) = bandwidth(&axis, &settings, feedforward) else { continue };
            checked += 1;
            let size = |omega: f64| sampled.command_response(omega, feedforward).norm();
            let (first, half) = (found.first_rad_s, 0.5f64.sqrt());
            assert!((size(first) - half).abs() < 1e-9);
            assert!((1..1000).all(|i| size(first * f64::from(i) / 1000.0) >= half), "{axis:?}");
            // From the last crossing on it stays below, and just before it does not.
            let nyquist = sampled.nyquist_rad_s();
            assert_eq!(found.last_rad_s.is_some(), size(nyquist) < half, "{axis:?}");
            let Some(last) = found.last_rad_s else { continue };
            assert!(last >= first && size(last * (1.0 - 1e-9)) >= half - 1e-9, "{axis:?}");
            assert!((1..1000).all(|i| size(last + (nyquist - last) * f64::from(i) / 1000.0) < half), "{axis:?}");
            again += usize::from(found.rises_again());
        }
    }
    assert!(again > 0, "some rise again");
    assert!(checked > 100, "{checked}");
}

#[test]
fn validates_the_two_crossings_of_alpha_at_two_milliseconds() {
    let mut document = Document::builtin("alpha").unwrap();
    document.set("control.period_s=0.002").unwrap();
    let scenario = document.scenario().unwrap();
    let found = bandwidth(&scenario.axes[0], &scenario.settings, Feedforward::Without).unwrap();
    // Read off 10^6 frequencies of the response by an independent implementation, to its four digits.
    assert!((found.first_rad_s - 230.8).abs() < 0.05 && found.rises_again(), "{found:?}");
    assert!((found.last_rad_s.unwrap() - 535.0).abs() < 0.05, "{found:?}");
}

#[test]
fn validates_the_velocity_gain_against_its_closed_form() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(29);
    let mut checked = 0;
    for _ in 0..200 {
        let (axis, settings) = random_axis(&mut rng);
        let drive = DriveLoop::model(&axis, &settings);
        let Some(kv) = drive.velocity_gain_1_s() else { continue };
        if axis.pdff.kiv_1_s == 0.0 {
            continue;
        }
        // With an integral a ramp of feedback alone lags by v/(r_g kpp).
        let closed = axis.drive.transmission_mm_rad * axis.pdff.kpp_rad_s_mm;
        assert!((kv / closed - 1.0).abs() < 1e-6, "{axis:?}: {kv} {closed}");
        checked += 1;
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn margins_are_cheap() {
    // The tuner asks 1e5 times. In a release build this is 5 µs (13 on a busy machine); the bound is for a debug build on a busy machine.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(28);
    let cases: Vec<_> = (0..2000).map(|_| random_axis(&mut rng)).collect();
    let start = Instant::now();
    let stable = cases.iter().filter(|(axis, settings)| margins(axis, settings).stable).count();
    let each_us = 1e6 * start.elapsed().as_secs_f64() / cases.len() as f64;
    println!("margins: {each_us:.2} µs a call, {stable} of {} stable", cases.len());
    assert!(each_us < 2000.0);
}
