//! A run takes its drives a block of samples ahead, each on a core: that must not be seen anywhere.

use std::sync::Arc;

use nalgebra::Vector2;
use rayon::ThreadPoolBuilder;
use servosim::interpolator::Interpolator;
use servosim::scenario::{Document, Scenario};
use servosim::servo::{Axis, AxisReference, DetailedAxis, DriveSignals, step_side_by_side};
use servosim::simulation::Period;

/// Alpha with its detailed drives, Y looking ahead, so slow that the run takes several blocks.
fn scenario() -> Scenario {
    let mut document = Document::builtin("alpha-real").unwrap();
    document.set("feedrate.feed_mm_s=12").unwrap();
    document.set("axes.y.compensation.zero_phase=true").unwrap();
    document.scenario().unwrap()
}

fn axes(scenario: &Scenario) -> ([DetailedAxis; 2], [usize; 2]) {
    let start = scenario.simulation().unwrap().next().unwrap().setpoint.position_mm;
    let axis = |i: usize| scenario.drives[i].axis(&scenario.axes[i], &scenario.settings, start[i]).unwrap();
    let [(x, none), (y, ahead)] = [axis(0), axis(1)];
    assert!(none == 0 && ahead > 0, "one of them looks ahead");
    ([x, y], [none, ahead])
}

#[test]
fn validates_a_run_in_blocks_against_its_axes_sample_by_sample() {
    let scenario = scenario();
    let shift = |k: u64| Vector2::new(1e-3 * libm::sin(0.01 * k as f64), 2e-3 * libm::cos(0.02 * k as f64));
    let run = || scenario.simulation().unwrap();
    let samples = run().samples();
    assert!(samples > 3 * 2048, "{samples} samples are several blocks");
    let shifts: Arc<[_]> = (0..samples).map(shift).collect();
    let blocks: Vec<Period<2>> = run().with_corrections(shifts).unwrap().collect();
    assert_eq!(blocks.len() as u64, samples);

    let (mut axes, ahead) = axes(&scenario);
    let rate = 1.0 / scenario.settings.period_s;
    // Each axis has an interpolator of its own: they are at different samples.
    let interpolator = || Interpolator::new(&*scenario.path, &scenario.motion, scenario.settings.period_s);
    let mut interpolators = [interpolator(), interpolator()];
    for (k, period) in (0..).zip(&blocks) {
        for i in 0..2 {
            let seen = k + ahead[i] as u64;
            let setpoint = interpolators[i].setpoint(seen);
            // There is no shift before the first sample; after the last one it stays.
            let shift = |k: Option<u64>| k.map_or(0.0, |k| shift(k.min(samples - 1))[i]);
            let (before, here, after) = (shift(seen.checked_sub(1)), shift(Some(seen)), shift(Some(seen + 1)));
            let signals = axes[i].step(&AxisReference {
                position_mm: setpoint.position_mm[i] + here,
                velocity_mm_s: setpoint.velocity_mm_s[i] + (after - before) * (0.5 * rate),
                acceleration_mm_s2: setpoint.acceleration_mm_s2[i] + (after - here * 2.0 + before) * (rate * rate),
                jerk_mm_s3: setpoint.jerk_vector_mm_s3[i],
                ..AxisReference::default()
            });
            assert_eq!(signals.actual_mm.to_bits(), period.axes[i].actual_mm.to_bits(), "axis {i}, sample {k}");
            assert_eq!(signals.voltage_v.to_bits(), period.axes[i].voltage_v.to_bits(), "axis {i}, sample {k}");
            assert_eq!(axes[i].drive_signals(), period.drives.unwrap()[i], "axis {i}, sample {k}");
            assert_eq!(period.axes[i].command_mm.to_bits(), period.setpoint.position_mm[i].to_bits());
        }
    }
}

#[test]
fn a_run_is_the_same_on_one_core_and_wherever_it_is_copied() {
    // On a thread of rayon's the axes go one after another, here side by side.
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let one: Vec<Period<2>> = pool.install(|| scenario().simulation().unwrap().collect());
    assert!(scenario().simulation().unwrap().eq(one.iter().copied()));
    // A copy taken in the middle of a block goes on as the run does.
    let scenario = scenario();
    let mut run = scenario.simulation().unwrap();
    run.by_ref().take(2500).for_each(drop);
    assert!(run.clone().eq(one[2500..].iter().copied()));
    assert!(run.eq(one[2500..].iter().copied()));
}

#[test]
fn validates_blocks_against_coupled_axes_whose_gains_are_zero() {
    // Coupled axes go one sample at a time.
    let mut document = Document::builtin("alpha-real").unwrap();
    for key_value in
        ["feedrate.feed_mm_s=12", "axes.y.compensation.zero_phase=true", "control.cross_coupling.proportional=0"]
    {
        document.set(key_value).unwrap();
    }
    let coupled = document.scenario().unwrap();
    assert!(coupled.cross_coupling.is_some());
    assert!(coupled.simulation().unwrap().eq(scenario().simulation().unwrap()));
}

#[test]
fn axes_side_by_side_are_axes_one_after_another() {
    let scenario = scenario();
    for samples in [0, 1, 63, 64, 500] {
        let reference = |k: usize| AxisReference::at_rest(0.01 * k as f64);
        let references = [(); 2].map(|()| (0..samples).map(reference).collect::<Vec<_>>());
        let (mut together, _) = axes(&scenario);
        let (mut apart, _) = axes(&scenario);
        let mut told: [Vec<DriveSignals>; 2] = [Vec::new(), Vec::new()];
        step_side_by_side(&mut together, &references, &mut told, |axis, _| axis.drive_signals());
        for i in 0..2 {
            let alone: Vec<_> = references[i]
                .iter()
                .map(|reference| {
                    apart[i].step(reference);
                    apart[i].drive_signals()
                })
                .collect();
            assert_eq!(told[i], alone, "axis {i}, {samples} samples");
        }
    }
}
