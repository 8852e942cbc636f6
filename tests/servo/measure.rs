//! Measurements against closed forms, and learning.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector2;
use servosim::analysis::{Feedforward, SampledLoop, error_constants, step_response};
use servosim::learning::{LearnError, LearnRequest, learn, learn_until};
use servosim::measure::{
    CircleRequest, CircleTest, MeasureError, ResponseRequest, StepRequest, circle, response, step,
};
use servosim::parameters::OutOfRange;
use servosim::scenario::Scenario;
use servosim::servo::compensation::{Compensation, Filter, LowPass, Notch};
use servosim::servo::effects::{
    Backlash, Coulomb, CurrentLoop, Delay, Encoder, EncoderPlace, Friction, Harmonic, Mismatch, TorqueRipple, TwoMass,
    VelocityEstimate,
};
use servosim::servo::{Axis, AxisReference, ControllerGains, ControllerKind, Derivative, DetailedAxis};
use servosim::simulation::Period;

fn alpha() -> Scenario {
    Scenario::builtin("alpha").unwrap()
}

fn alpha_real() -> Scenario {
    Scenario::load(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/alpha-real.toml")).unwrap()
}

/// Gain and phase of both axes on a circle.
fn gains(scenario: &Scenario, omega: f64) -> [(f64, f64); 2] {
    scenario.axes.map(|axis| {
        let h = SampledLoop::new(&axis, &scenario.settings).command_response(omega, Feedforward::With);
        (h.norm(), h.arg())
    })
}

#[track_caller]
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} within {tolerance}");
}

#[test]
fn validates_the_circle_of_a_linear_loop() {
    let scenario = alpha();
    for (radius_mm, feed_mm_s) in [(20.0, 100.0), (5.0, 50.0), (2.0, 60.0)] {
        let test = circle(&scenario, &CircleRequest { radius_mm, feed_mm_s, ..CircleRequest::of(&scenario) }).unwrap();
        assert!(test.warnings.is_empty(), "{:?}", test.warnings);
        let [(gx, px), (gy, py)] = gains(&scenario, feed_mm_s / radius_mm);
        // Every place of the table is known: x = R gx cos(φ + px), y = R gy sin(φ + py), either way around.
        let radial = |k: u32| {
            let phi = TAU * f64::from(k) / 100_000.0;
            1e3 * ((radius_mm * gx * (phi + px).cos()).hypot(radius_mm * gy * (phi + py).sin()) - radius_mm)
        };
        let high = (0..100_000).map(radial).fold(f64::NEG_INFINITY, f64::max);
        let low = (0..100_000).map(radial).fold(f64::INFINITY, f64::min);
        let mean = (0..100_000).map(radial).sum::<f64>() / 1e5;
        // Samples miss the extremes by at most ω²Δt²/2 of their height; transients are gone.
        let slack = 1e-4 * high.abs() + 1e-6;
        for direction in &test.directions {
            near(direction.radial_max_um, high, slack);
            near(direction.radial_min_um, low, slack);
            near(direction.radius_um, mean, slack);
            near(direction.circular_deviation_um, high - low, 2.0 * slack);
            near(direction.circular_deviation_least_squares_um, high - low, 2.0 * slack);
            assert!(direction.spikes.iter().all(|spike| spike.height_um.abs() < slack + 1e-3 * (high - low)));
            assert!(direction.lost_motion_um.iter().all(|lost| lost.abs() < slack + 1e-3 * (high - low)));
        }
        // To first order d = … ∓ R ḡ δ sin 2θ with the half difference of the phases δ: the ellipses lean to opposite sides.
        let hysteresis = 1e3 * radius_mm * 0.5 * (gx + gy) * (px - py).abs();
        near(test.hysteresis_um, hysteresis, 0.02 * hysteresis + slack);
        near(test.mean_radial_deviation_um, mean, slack);
        assert!(test.bidirectional_deviation_um >= high - low - slack);
    }
}

#[test]
fn validates_that_place_start_and_turns_do_not_matter_to_a_linear_loop() {
    let scenario = alpha();
    let plain = CircleRequest { radius_mm: 5.0, feed_mm_s: 50.0, ..CircleRequest::of(&scenario) };
    let of = |request: &CircleRequest| circle(&scenario, request).unwrap();
    let expected = of(&plain);
    for request in [
        CircleRequest { centre_mm: [300.0, -20.0], ..plain },
        CircleRequest { start_deg: 123.0, ..plain },
        CircleRequest { turns: 3, ..plain },
    ] {
        let test = of(&request);
        for (a, b) in test.directions.iter().zip(&expected.directions) {
            near(a.circular_deviation_um, b.circular_deviation_um, 2e-3);
            near(a.radius_um, b.radius_um, 2e-3);
        }
        near(test.hysteresis_um, expected.hysteresis_um, 4e-3);
    }
}

#[test]
fn validates_backlash_as_lost_motion() {
    for (axis, gap_um) in [(0, 8.0), (1, 3.0)] {
        let mut scenario = alpha();
        scenario.drives[axis].effects.backlash = Some(Backlash { gap_um });
        let request = CircleRequest { radius_mm: 30.0, feed_mm_s: 30.0, ..CircleRequest::of(&scenario) };
        let test = circle(&scenario, &request).unwrap();
        let plain = circle(&alpha(), &request).unwrap();
        for direction in &test.directions {
            near(direction.lost_motion_um[axis], gap_um, 0.01 * gap_um);
            near(direction.lost_motion_um[1 - axis], 0.0, 0.01 * gap_um);
            assert!(direction.circular_deviation_um > 0.5 * gap_um);
            // The table is put down on the other side without going beyond it.
            assert!(direction.spikes.iter().all(|s| s.height_um.abs() < 0.02 * gap_um), "{:?}", direction.spikes);
        }
        // The steps are at the same places either way around, outwards both times: the two paths stay together.
        assert!(test.hysteresis_um > plain.hysteresis_um);
        assert!(test.bidirectional_deviation_um >= test.directions[0].circular_deviation_um - 1e-6);
    }
}

#[test]
fn validates_friction_spikes_by_another_way() {
    let friction = Coulomb { coulomb_nm: 0.15, static_nm: 0.2, stribeck_mm_s: 2.0, viscous_nm_s_rad: 0.0 };
    let mut scenario = alpha();
    for drive in &mut scenario.drives {
        drive.effects.friction = Some(Friction::Coulomb(friction));
    }
    let (radius_mm, feed_mm_s) = (30.0, 30.0);
    let request = CircleRequest { radius_mm, feed_mm_s, ..CircleRequest::of(&scenario) };
    let test = circle(&scenario, &request).unwrap();
    // X alone on a cosine of the same speed: how much further out it is, where it turns back, than without friction.
    let run = |friction: bool| -> Vec<f64> {
        let mut effects = scenario.drives[0].effects.clone();
        if !friction {
            effects.friction = None;
        }
        let mut axis =
            DetailedAxis::pdff(&scenario.axes[0], &effects, &Compensation::default(), &scenario.settings, radius_mm)
                .unwrap();
        let at = |k: u32| radius_mm * (f64::from(k) * 1e-3 * feed_mm_s / radius_mm).cos();
        (0..16_000)
            .map(|k| axis.step(&AxisReference { position_mm: at(k), ..AxisReference::default() }).actual_mm)
            .collect()
    };
    let (with, without) = (run(true), run(false));
    // Behind the reversals of the second turn, at 2π s (outwards at +X), in a thirtieth of a turn.
    let window = 6283..6283 + 200;
    let spike = 1e3 * window.map(|k| with[k] - without[k]).fold(0.0, f64::max);
    assert!(spike > 1.0, "{spike}");
    println!("friction spike of X: {spike:.3} µm; measured {:?}", test.directions[0].spikes);
    for direction in &test.directions {
        for measured in &direction.spikes {
            assert!(measured.height_um > 0.5 && measured.after_deg < 10.0 && measured.clear, "{measured:?}");
            assert_eq!(measured.axis, if measured.at_deg % 180.0 == 0.0 { "x" } else { "y" });
        }
        near(direction.spikes[0].height_um, spike, 0.02 * spike);
        near(direction.spikes[2].height_um, spike, 0.02 * spike);
        near(direction.lost_motion_um[0], 0.0, 0.1 * spike);
    }
    // Twice the friction, a higher spike.
    for drive in &mut scenario.drives {
        drive.effects.friction = Some(Friction::Coulomb(Coulomb { coulomb_nm: 0.3, static_nm: 0.4, ..friction }));
    }
    let more = circle(&scenario, &request).unwrap();
    assert!(more.directions[0].spikes[0].height_um > 1.5 * spike);
}

/// A ripple of the motor is no work of the reversals, and neither is a loop that has lost its track.
#[test]
fn only_what_stands_out_of_the_ripple_is_a_spike() {
    let mut scenario = alpha();
    for drive in &mut scenario.drives {
        drive.effects.backlash = Some(Backlash { gap_um: 5.0 });
        let harmonic = Harmonic { per_revolution: 6, amplitude_nm: 0.5, phase_rad: 0.0 };
        drive.effects.ripple = Some(TorqueRipple { harmonics: vec![harmonic] });
    }
    let request = CircleRequest { radius_mm: 30.0, feed_mm_s: 30.0, ..CircleRequest::of(&scenario) };
    let test = circle(&scenario, &request).unwrap();
    for direction in &test.directions {
        println!("ripple {} µm, {:?}", direction.ripple_um, direction.spikes.map(|spike| spike.height_um));
        assert!(direction.ripple_um > 0.1 && direction.spikes.iter().all(|spike| !spike.clear), "{direction:?}");
    }
    let lost = circle(&alpha(), &CircleRequest { feed_mm_s: 400.0, ..CircleRequest::of(&scenario) }).unwrap();
    assert!(lost.locked_up);
    assert!(lost.directions.iter().flat_map(|direction| &direction.spikes).all(|spike| !spike.clear));
}

#[test]
fn validates_swept_sine_against_the_analytic_response() {
    let mut exact = alpha();
    exact.settings.derivative = Derivative::Exact;
    let mut delayed = alpha();
    delayed.settings.one_sample_delay = true;
    delayed.axes.iter_mut().for_each(|axis| axis.pdff.kpv_nm_s_rad *= 0.6);
    for scenario in [alpha(), exact, delayed, Scenario::builtin("heart").unwrap()] {
        let measured = response(&scenario, &ResponseRequest::default()).unwrap();
        for axis in &measured.axes {
            let (db, deg) = (axis.model_deviation_db.unwrap(), axis.model_deviation_deg.unwrap());
            println!("{} {}: {db:.2e} dB, {deg:.2e}°, {:?} Hz", scenario.name, axis.axis, axis.bandwidth_hz);
            // Asked for: 0.1 dB, 0.5°.
            assert!(db < 1e-3 && deg < 1e-2, "{db} dB, {deg}°");
            assert!(axis.points.iter().all(|point| !point.saturated) && axis.warnings.is_empty());
            near(axis.points[59].frequency_hz, 250.0, 1.0);
            near(axis.points[0].frequency_hz, 1.0, 0.05);
            assert_eq!(axis.points.len(), 60);
            // The bandwidth is that of the analysis, where it is among the frequencies measured.
            let known = axis.model_bandwidth_hz.filter(|hz| *hz < 250.0);
            assert_eq!(axis.bandwidth_hz.is_some(), known.is_some());
            if let (Some(found), Some(known)) = (axis.bandwidth_hz, known) {
                near(found, known, 1e-4 * known);
            }
        }
    }
    // However coarse the points are.
    let mut scenario = alpha();
    scenario.axes.iter_mut().for_each(|axis| axis.pdff.kpf_rad_mm = 0.0);
    for request in [
        ResponseRequest { points: Some(30), ..Default::default() },
        ResponseRequest { points: Some(2), low_hz: Some(2.0), ..Default::default() },
    ] {
        let measured = response(&scenario, &request).unwrap();
        for (axis, found) in scenario.axes.iter().zip(&measured.axes) {
            let known =
                servosim::analysis::bandwidth(axis, &scenario.settings, Feedforward::With).unwrap().first_rad_s / TAU;
            near(found.bandwidth_hz.unwrap(), known, 1e-4 * known);
            near(found.model_bandwidth_hz.unwrap(), known, 1e-9 * known);
        }
    }
}

#[test]
fn validates_the_response_of_a_drive_beyond_its_model() {
    let mut scenario = alpha();
    let mismatch = Mismatch { gain_factor: 0.9, time_constant_factor: 1.1 };
    scenario.drives[0].effects.mismatch = Some(mismatch);
    scenario.drives[1].effects.delay = Some(Delay { samples: 1.0 });
    scenario.axes[1].pdff.kpv_nm_s_rad *= 0.6;
    let measured = response(&scenario, &ResponseRequest { points: Some(20), ..Default::default() }).unwrap();
    let mut plant = scenario.axes[0];
    plant.plant = mismatch.plant(&plant.plant);
    let mut settings = scenario.settings;
    let known = [SampledLoop::new(&plant, &settings), {
        settings.one_sample_delay = true;
        SampledLoop::new(&scenario.axes[1], &settings)
    }];
    for (axis, known) in measured.axes.iter().zip(&known) {
        for point in &axis.points {
            let h = known.command_response(TAU * point.frequency_hz, Feedforward::With);
            near(point.magnitude_db, 20.0 * h.norm().log10(), 1e-3);
            let apart = point.phase_deg - h.arg().to_degrees();
            near(apart - 360.0 * (apart / 360.0).round(), 0.0, 1e-2);
        }
        assert!(axis.model_deviation_db.unwrap() < 1e-3 && axis.model_deviation_deg.unwrap() < 1e-2);
    }
}

#[test]
fn validates_every_linear_effect_against_the_analysis() {
    // Asked for: 0.1 dB, 0.5°. Softer gains, so that there is room for what each effect takes.
    let soft = || {
        let mut scenario = alpha();
        for axis in &mut scenario.axes {
            axis.pdff.kpv_nm_s_rad *= 0.5;
            axis.pdff.kpp_rad_s_mm *= 0.3;
            axis.pdff.kiv_1_s *= 0.3;
        }
        scenario
    };
    let two_mass = TwoMass { table_mass_kg: 100.0, stiffness_n_um: 30.0, damping_n_s_mm: 10.0 };
    let encoder = |place, velocity| Some(Encoder { place, resolution_um: 0.0, velocity });
    let mut cases = vec![soft(); 6];
    for (kind, case) in [ControllerKind::PPi, ControllerKind::Pid, ControllerKind::Cascade].into_iter().zip(&mut cases)
    {
        for (drive, axis) in case.drives.iter_mut().zip(&case.axes) {
            drive.controller = ControllerGains::like(kind, axis, &case.settings);
            drive.effects.delay = Some(Delay { samples: 0.3 });
        }
    }
    cases[3].drives[0].effects.two_mass = Some(two_mass);
    cases[3].drives[0].compensation.filters.push(Filter::Notch(Notch {
        frequency_hz: 150.0,
        depth: 0.2,
        damping: 0.5,
    }));
    cases[3].drives[1].effects.current_loop = Some(CurrentLoop { bandwidth_hz: 300.0 });
    cases[3].drives[1].compensation.filters.push(Filter::LowPass(LowPass { frequency_hz: 300.0, damping: 0.7 }));
    cases[4].drives[0].effects.two_mass = Some(two_mass);
    cases[4].drives[0].effects.delay = Some(Delay { samples: 1.4 });
    cases[4].drives[1].effects.encoder = encoder(EncoderPlace::Motor, VelocityEstimate::LowPass { corner_hz: 200.0 });
    let observer = VelocityEstimate::Observer { bandwidth_hz: 90.0, damping: 0.7 };
    cases[5].drives[0].effects.encoder = encoder(EncoderPlace::Motor, observer);
    cases[5].drives[1].effects.encoder = encoder(EncoderPlace::Motor, VelocityEstimate::Difference);
    cases[5].drives[1].zero_phase = true;
    for (number, case) in cases.iter().enumerate() {
        let measured = response(case, &ResponseRequest { points: Some(12), ..Default::default() }).unwrap();
        for axis in &measured.axes {
            let (db, deg) = (axis.model_deviation_db.unwrap(), axis.model_deviation_deg.unwrap());
            println!("case {number} {}: {db:.2e} dB, {deg:.2e}°, {:?}", axis.axis, axis.linearized.modelled);
            assert!(db < 1e-2 && deg < 5e-2, "case {number} {}: {db} dB, {deg}°", axis.axis);
        }
    }
}

#[test]
fn an_unstable_loop_has_no_response() {
    let mut own = alpha();
    own.settings.one_sample_delay = true;
    let mut drive = alpha();
    drive.drives[0].effects.delay = Some(Delay { samples: 1.0 });
    for unstable in [own, drive] {
        let found = response(&unstable, &ResponseRequest { points: Some(3), ..Default::default() });
        assert!(matches!(found, Err(MeasureError::Unstable { axis }) if axis == "X"));
        let found =
            step(&unstable, &StepRequest { step_um: 1.0, window_um: 0.1, ..StepRequest::of(&alpha()) }).unwrap();
        assert!(!found.passed() && !found.axes[0].stable);
        assert!(found.warnings.iter().any(|w| w.starts_with("X: the loop is unstable")), "{:?}", found.warnings);
    }
}

#[test]
fn a_table_that_stops_moving_has_no_bandwidth_and_counts_are_told() {
    let mut loose = alpha();
    loose.drives.iter_mut().for_each(|drive| drive.effects.backlash = Some(Backlash { gap_um: 5.0 }));
    let request = ResponseRequest { points: Some(10), ..Default::default() };
    let measured = response(&loose, &request).unwrap();
    for axis in &measured.axes {
        assert!(axis.points.iter().any(|point| !point.moves()) && axis.points[0].moves());
        assert_eq!(axis.bandwidth_hz, None);
        assert!(axis.model_bandwidth_hz.is_some());
        assert!(axis.warnings.iter().any(|w| w.starts_with("no bandwidth")), "{:?}", axis.warnings);
    }
    let mut coarse = alpha();
    coarse.drives[0].effects.encoder = Some(Encoder { resolution_um: 10.0, ..Default::default() });
    let measured = response(&coarse, &ResponseRequest { amplitude_um: Some(1.0), points: Some(3), ..request }).unwrap();
    assert!(measured.axes[0].warnings.iter().any(|w| w.contains("below one count of the encoder (10 µm)")));
    assert!(measured.axes[1].warnings.is_empty());
}

#[test]
fn a_sine_that_saturates_is_told() {
    let request = ResponseRequest { amplitude_um: Some(500.0), points: Some(5), ..Default::default() };
    let measured = response(&alpha(), &request).unwrap();
    assert!(measured.axes[0].points[4].saturated && !measured.axes[0].points[0].saturated);
    assert!(measured.axes[0].warnings[0].starts_with("saturated at"), "{:?}", measured.axes[0].warnings);
    // A motion that backlash swallows has a finite magnitude, no phase, and a warning.
    let mut loose = alpha();
    loose.drives[1].effects.backlash = Some(Backlash { gap_um: 50.0 });
    let measured = response(&loose, &ResponseRequest { amplitude_um: Some(1.0), ..request }).unwrap();
    let y = &measured.axes[1];
    assert!(y.warnings[0].starts_with("the table does not move at"), "{:?}", y.warnings);
    assert!(y.points.iter().any(|point| !point.moves() && point.magnitude_db.is_finite()));
}

#[test]
fn validates_step_and_ramp_against_the_analysis() {
    let scenario = alpha();
    let request = StepRequest { step_um: 1.0, window_um: 0.02, ..StepRequest::of(&scenario) };
    let measured = step(&scenario, &request).unwrap();
    assert!(measured.warnings.is_empty());
    for (axis, found) in scenario.axes.iter().zip(&measured.axes) {
        let known = step_response(axis, &scenario.settings, Feedforward::With).metrics.unwrap();
        near(found.step.rise_s.unwrap(), known.rise_s, 1e-9);
        near(found.step.overshoot_percent, known.overshoot_percent, 1e-6);
        near(found.step.settling_s.unwrap(), known.settling_s, 1e-9);
        near(found.step.rest_um, 0.0, 1e-6);
        let slope = error_constants(axis, &scenario.settings).unwrap().velocity_s;
        near(found.ramp.following_error_um, 1e3 * slope * scenario.feed_mm_s, 1e-4);
        near(found.ramp.model_following_error_um.unwrap(), found.ramp.following_error_um, 1e-4);
        assert!(found.ramp.ripple_um < 1e-3 && found.ramp.settling_s.unwrap() < 0.1);
    }
    // The default saturates nothing. A window as wide as the step says nothing; one may never be reached.
    let default = StepRequest::of(&scenario);
    assert_eq!((default.step_um, default.window_um), (2.0, 0.2));
    assert!(step(&scenario, &default).unwrap().warnings.is_empty());
    for window_um in [1.0, 100.0] {
        let wide = step(&scenario, &StepRequest { window_um, ..request }).unwrap_err().to_string();
        assert!(wide.contains("smaller than the step of 1 µm"), "{wide}");
    }
    let mut stuck = alpha();
    stuck.drives[0].effects.backlash = Some(Backlash { gap_um: 5.0 });
    let stuck = step(&stuck, &request).unwrap();
    assert_eq!(stuck.axes[0].step.settling_s, None);
    near(stuck.axes[0].step.rest_um, 1.0, 1e-3);
    let large = step(&scenario, &StepRequest { step_um: 20.0, ..request }).unwrap();
    let told = &large.warnings[0];
    assert!(told.contains("saturates the drive (±5 V)") && told.ends_with("a step of 2 µm would not"), "{told}");
    near(large.axes[0].ramp.rest_um, 0.0, 1e-6);
    assert!(large.passed());
}

fn is_monotone(runs: &[f64], noise: f64) -> bool {
    runs.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9) + noise)
}

#[test]
fn validates_that_learning_converges_as_its_law_says() {
    let learned = learn(&alpha(), &LearnRequest { runs: 8, ..LearnRequest::default() }).unwrap();
    let rms: Vec<f64> = learned.runs.iter().map(|run| run.rms_tracking_error_um).collect();
    println!("alpha: {rms:?}");
    assert!(learned.diverged.is_none() && is_monotone(&rms, 0.0), "{rms:?}");
    assert!(rms[7] < 1e-2 * rms[0], "{rms:?}");
    // Each run leaves |1 - γ| of the error, while what the low pass keeps back is small beside it.
    near(rms[1] / rms[0], 0.2, 0.02);
    assert!(learned.runs[7].max_contour_error_um < 1.0);
    // The correction gives the same run to whoever takes it.
    let scenario = alpha();
    let again = scenario.simulation().unwrap().with_corrections(learned.corrections_mm.clone()).unwrap();
    let largest = again.map(|period| period.contour_error_um.abs()).fold(0.0, f64::max);
    assert_eq!(largest, learned.runs[learned.best_run as usize - 1].max_contour_error_um);
}

#[test]
fn learning_converges_on_the_drive_as_it_is() {
    let learned = learn(&alpha_real(), &LearnRequest { runs: 8, ..LearnRequest::default() }).unwrap();
    let rms: Vec<f64> = learned.runs.iter().map(|run| run.rms_tracking_error_um).collect();
    println!("alpha-real: {rms:?}");
    assert!(learned.diverged.is_none() && is_monotone(&rms, 0.08), "{rms:?}");
    assert!(rms[7] < 0.01 * rms[0], "{rms:?}");
}

#[test]
fn regression_what_learning_makes_worse_is_not_kept() {
    // Without feedforward the corrections saturate the drives: the tracking error falls, the contouring error grows.
    let mut scenario = alpha();
    for axis in &mut scenario.axes {
        (axis.pdff.kpf_rad_mm, axis.pdff.kpp_rad_s_mm) = (0.0, 40.0);
    }
    let learned = learn(&scenario, &LearnRequest { runs: 4, ..LearnRequest::default() }).unwrap();
    let contour: Vec<f64> = learned.runs.iter().map(|run| run.max_contour_error_um).collect();
    println!("without feedforward: {contour:?}");
    assert!(contour[1..].iter().all(|um| *um > contour[0]), "{contour:?}");
    assert!(!learned.improved() && learned.best_run == 1);
    assert!(learned.corrections_mm.iter().all(|c| *c == Vector2::zeros()));
    assert!(learned.warnings.iter().any(|text| text.starts_with("nothing is gained")), "{:?}", learned.warnings);
}

#[test]
fn learning_knows_axes_that_look_ahead() {
    let mut scenario = alpha();
    scenario.drives.iter_mut().for_each(|drive| drive.zero_phase = true);
    scenario.drives[0].effects.mismatch = Some(Mismatch { gain_factor: 0.9, time_constant_factor: 1.1 });
    let learned = learn(&scenario, &LearnRequest { runs: 6, ..LearnRequest::default() }).unwrap();
    let rms: Vec<f64> = learned.runs.iter().map(|run| run.rms_tracking_error_um).collect();
    assert!(is_monotone(&rms, 0.0) && rms[5] < 0.2 * rms[0], "{rms:?}");
}

#[test]
fn learning_that_diverges_says_why() {
    // A delay that the model does not know, and a high gain up to a high cutoff.
    let mut scenario = alpha();
    scenario.drives[0].effects.delay = Some(Delay { samples: 0.5 });
    let request = LearnRequest { runs: 40, gain: 1.5, cutoff_hz: Some(150.0) };
    let learned = learn(&scenario, &request).unwrap();
    let why = learned.diverged.expect("it diverges");
    assert!(why.contains("the learning gain of 1.5 is too high"), "{why}");
    assert!(learned.runs.len() < 40);
    // A lower gain with the cutoff that comes by itself does not.
    assert!(learn(&scenario, &LearnRequest { runs: 15, ..LearnRequest::default() }).unwrap().diverged.is_none());
    let best = learned.runs.iter().map(|run| run.max_contour_error_um).fold(f64::INFINITY, f64::min);
    assert_eq!(learned.runs[learned.best_run as usize - 1].max_contour_error_um, best);
    for gain in [0.0, -1.0, 2.0, f64::NAN] {
        assert!(matches!(
            learn(&scenario, &LearnRequest { gain, ..LearnRequest::default() }),
            Err(LearnError::Request(OutOfRange { key: "gain", .. }))
        ));
    }
    for cutoff in [0.0, 1e-9, 0.5, 501.0, f64::NAN] {
        let request = LearnRequest { cutoff_hz: Some(cutoff), ..LearnRequest::default() };
        assert!(matches!(learn(&scenario, &request), Err(LearnError::Request(OutOfRange { key: "cutoff_hz", .. }))));
    }
    let mut unstable = alpha();
    unstable.settings.one_sample_delay = true;
    assert!(matches!(learn(&unstable, &LearnRequest::default()), Err(LearnError::Unstable { axis }) if axis == "X"));
}

/// What is stopped keeps its whole runs.
#[test]
fn learning_may_be_stopped() {
    let learned = learn_until(&AtomicBool::new(true), &alpha(), &LearnRequest::default()).unwrap();
    assert!(learned.interrupted && learned.runs.is_empty() && learned.diverged.is_none());
    let stop = AtomicBool::new(false);
    let request = LearnRequest { runs: 1000, ..LearnRequest::default() };
    let learned = std::thread::scope(|scope| {
        let learning = scope.spawn(|| learn_until(&stop, &alpha(), &request).unwrap());
        std::thread::sleep(std::time::Duration::from_millis(300));
        stop.store(true, Ordering::Relaxed);
        learning.join().unwrap()
    });
    assert!(learned.interrupted && learned.runs.len() < 1000);
    let whole =
        learn(&alpha(), &LearnRequest { runs: learned.runs.len().max(2).try_into().unwrap(), ..request }).unwrap();
    assert!(learned.runs.iter().zip(&whole.runs).all(|(a, b)| a == b));
}

#[test]
fn corrections_of_zero_change_no_bit_and_others_shift_the_command() {
    for scenario in [alpha(), alpha_real()] {
        let plain: Vec<Period<2>> = scenario.simulation().unwrap().collect();
        let zero: Arc<[Vector2<f64>]> = vec![Vector2::zeros(); 3].into();
        let zeroed = scenario.simulation().unwrap().with_corrections(zero).unwrap();
        assert!(zeroed.zip(&plain).all(|(a, b)| a == *b));
    }
    // A slow shift of a whole run is followed as it is; setpoints are told without it.
    let scenario = alpha();
    let plain: Vec<Period<2>> = scenario.simulation().unwrap().collect();
    let shift = |k: usize| 0.01 * (1.0 - (0.002 * k as f64).cos());
    let shifts: Arc<[Vector2<f64>]> = (0..plain.len()).map(|k| Vector2::new(shift(k), 0.0)).collect();
    let shifted: Vec<Period<2>> = scenario.simulation().unwrap().with_corrections(shifts).unwrap().collect();
    for (k, (a, b)) in shifted.iter().zip(&plain).enumerate() {
        assert_eq!((a.setpoint, a.axes[0].command_mm), (b.setpoint, b.axes[0].command_mm));
        assert_eq!(a.actual_mm.y, b.actual_mm.y);
        near(a.actual_mm.x - b.actual_mm.x, shift(k), 1e-4);
    }
    for wrong in [f64::NAN, f64::INFINITY, 1e9] {
        let shifts: Arc<[Vector2<f64>]> = vec![Vector2::new(0.0, wrong)].into();
        assert!(scenario.simulation().unwrap().with_corrections(shifts).is_err());
    }
}

#[test]
fn validates_that_corrections_come_at_their_sample() {
    // Axis by axis, one loop at a time, given what the run says it gives: at its own sample, or as far ahead as it looks.
    for zero_phase in [false, true] {
        let mut scenario = alpha();
        scenario.drives.iter_mut().for_each(|drive| drive.zero_phase = zero_phase);
        let plain: Vec<Period<2>> = scenario.simulation().unwrap().collect();
        let shift = |k: usize| if k < 20 { 0.0 } else { 0.001 * (0.05 * k as f64).sin() };
        let shifts: Arc<[Vector2<f64>]> = (0..plain.len()).map(|k| Vector2::new(shift(k), -2.0 * shift(k))).collect();
        let corrected: Vec<Period<2>> = scenario.simulation().unwrap().with_corrections(shifts).unwrap().collect();
        for axis in 0..2 {
            let start_mm = plain[0].setpoint.position_mm[axis];
            let (mut real, ahead) =
                scenario.drives[axis].axis(&scenario.axes[axis], &scenario.settings, start_mm).unwrap();
            assert_eq!(ahead > 0, zero_phase);
            for k in 0..plain.len() - ahead {
                let seen = plain[k + ahead].setpoint.position_mm[axis];
                let position_mm = seen + shift(k + ahead) * [1.0, -2.0][axis];
                let actual_mm = real.step(&AxisReference { position_mm, ..AxisReference::default() }).actual_mm;
                near(corrected[k].actual_mm[axis], actual_mm, 1e-11);
            }
        }
    }
}

#[test]
fn requests_out_of_range_are_refused_and_no_number_panics() {
    let scenario = alpha();
    let wrong = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300, 1e-300];
    for value in wrong {
        let plain = CircleRequest::of(&scenario);
        for request in [
            CircleRequest { radius_mm: value, ..plain },
            CircleRequest { feed_mm_s: value, ..plain },
            CircleRequest { centre_mm: [value * 1e9, 0.0], ..plain },
        ] {
            let refused = circle(&scenario, &request);
            assert!(refused.is_err() || request.centre_mm == [0.0, 0.0] || value == 1e-300, "{request:?}");
        }
        for request in [
            StepRequest { step_um: value, ..StepRequest::of(&scenario) },
            StepRequest { window_um: value, ..StepRequest::of(&scenario) },
            StepRequest { feed_mm_s: value, ..StepRequest::of(&scenario) },
            StepRequest { watch_s: value, ..StepRequest::of(&scenario) },
        ] {
            assert!(matches!(step(&scenario, &request), Err(MeasureError::Request(_))), "{request:?}");
        }
        for request in [
            ResponseRequest { low_hz: Some(value), ..Default::default() },
            ResponseRequest { high_hz: Some(value), ..Default::default() },
            ResponseRequest { amplitude_um: Some(value), ..Default::default() },
        ] {
            assert!(matches!(response(&scenario, &request), Err(MeasureError::Request(_))), "{request:?}");
        }
    }
    for turns in [0, 101] {
        assert!(circle(&scenario, &CircleRequest { turns, ..CircleRequest::of(&scenario) }).is_err());
    }
    let fast = CircleRequest { radius_mm: 0.5, feed_mm_s: 1000.0, ..CircleRequest::of(&scenario) };
    let told = circle(&scenario, &fast).unwrap_err().to_string();
    assert!(told.contains("would have only 3.1 control periods"), "{told}");
    let slow = CircleRequest { radius_mm: 1e5, feed_mm_s: 1.0, ..CircleRequest::of(&scenario) };
    assert!(matches!(circle(&scenario, &slow), Err(MeasureError::TooLong { .. })));
    // An unstable loop says so.
    let mut unstable = alpha();
    unstable.axes[0].pdff.kpv_nm_s_rad = 12.0;
    let found: Result<CircleTest, _> = circle(&unstable, &CircleRequest::of(&unstable));
    assert!(found.is_err() || !found.unwrap().warnings.is_empty());
    let found = response(&unstable, &ResponseRequest { points: Some(3), ..Default::default() });
    assert!(found.is_err() || !found.unwrap().axes[0].warnings.is_empty());
}
