//! Step of the command, and a ramp at feed.

use crate::parameters::{AXIS_NAMES, OutOfRange};
use serde::Serialize;

use super::single_axis::{Bench, Sample};
use super::{MeasureError, idle, neglected, um, within};
use crate::analysis::DriveLoop;
use crate::feedrate::{Motion, Profile};
use crate::scenario::Scenario;
use crate::servo::{AxisReference, LockupWatch};

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRequest {
    /// Height of the step \[µm\], from 1e-3 to 1e5.
    pub step_um: f64,
    /// The table has settled when it stays this near to its command \[µm\], from 1e-6 and less than the step.
    pub window_um: f64,
    /// Feed of the ramp \[mm/s\], from 1e-3 to 1e5.
    pub feed_mm_s: f64,
    /// Time that each is watched, after the step and after the end of the ramp \[s\], from 1e-3 to 1e3.
    pub watch_s: f64,
}

impl StepRequest {
    /// The largest of 10, 5, 2, 1 … µm that saturates no axis, into a window of a tenth of it; a ramp at the scenario's feed; watched for half
    /// a second. A step of 10 µm where every one saturates.
    pub fn of(scenario: &Scenario) -> Self {
        let step_um = largest_step_um(scenario).unwrap_or(10.0);
        Self { step_um, window_um: 0.1 * step_um, feed_mm_s: scenario.feed_mm_s, watch_s: 0.5 }
    }
}

/// One sample of an axis; positions from its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Time from the beginning of the command \[s\].
    pub time_s: f64,
    /// Command \[µm\].
    pub command_um: f64,
    /// Where the table is \[µm\].
    pub actual_um: f64,
}

/// The answer to a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepMetrics {
    /// From 10 % to 90 % of the step; null where it does not get there.
    pub rise_s: Option<f64>,
    /// Beyond the step, in percent of it.
    pub overshoot_percent: f64,
    /// From then on it stays in the window; null where it does not while it is watched.
    pub settling_s: Option<f64>,
    /// Mean distance from the command over the last tenth of the time: how far off it comes to rest.
    pub rest_um: f64,
    /// Control periods in which the voltage was clamped.
    pub saturated_samples: u64,
    /// Whether it saturates and does not recover.
    pub locked_up: bool,
}

/// The answer to a ramp: from rest to the feed, half a second at it, and to rest again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RampMetrics {
    /// Feed.
    pub feed_mm_s: f64,
    /// Length.
    pub length_mm: f64,
    /// Mean of command less actual position over the last half of the cruise (negative: ahead of the command).
    pub following_error_um: f64,
    /// Velocity gain `K_v` of the loop with its feedforward \[1/s\]: feed over following error. Null where the axis does not lag behind.
    pub kv_1_s: Option<f64>,
    /// What the linear analysis says.
    pub model_following_error_um: Option<f64>,
    /// Largest distance from that mean in the same time.
    pub ripple_um: f64,
    /// Largest following error of the whole ramp, either sign.
    pub largest_error_um: f64,
    /// From the end of the ramp until it stays in the window; null where it does not while it is watched.
    pub settling_s: Option<f64>,
    /// Mean distance from the command over the last tenth of the time after its end: how far off it comes to rest.
    pub rest_um: f64,
    /// Control periods in which the voltage was clamped.
    pub saturated_samples: u64,
    /// Whether it saturates and does not recover.
    pub locked_up: bool,
}

/// Both of one axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisSteps {
    /// Name of the axis.
    pub axis: String,
    /// Whether its linear loop is stable.
    pub stable: bool,
    /// The step.
    pub step: StepMetrics,
    /// The ramp.
    pub ramp: RampMetrics,
    /// Samples of the step.
    #[serde(skip)]
    pub step_samples: Vec<Sampled>,
    /// Samples of the ramp.
    #[serde(skip)]
    pub ramp_samples: Vec<Sampled>,
}

/// Steps and ramps of all axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Steps {
    /// Name of the scenario.
    pub scenario: String,
    /// Height of the step.
    pub step_um: f64,
    /// The window.
    pub window_um: f64,
    /// One an axis.
    pub axes: Vec<AxisSteps>,
    /// In words, for a person.
    pub warnings: Vec<String>,
}

impl Steps {
    /// Whether every loop is stable, and none locked up.
    pub fn passed(&self) -> bool {
        self.axes.iter().all(|axis| axis.stable && !axis.step.locked_up && !axis.ramp.locked_up)
    }
}

/// Steps that are tried, falling \[µm\]; none below two counts of an encoder.
const STEPS_UM: [f64; 10] = [10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01];
/// How long they are \[s\], and how many samples at least and at most.
const TRIED_S: f64 = 0.1;
const TRIED: [f64; 2] = [50.0, 2000.0];

/// The largest step that saturates no axis.
fn largest_step_um(scenario: &Scenario) -> Option<f64> {
    let idle = idle(scenario);
    let counts = idle.drives.iter().map(|drive| drive.effects.encoder.map_or(0.0, |encoder| encoder.resolution_um));
    let least_um = 2.0 * counts.fold(0.0, f64::max);
    let fits = |step_um: f64| {
        (0..idle.axes.len()).all(|axis| {
            let Ok(mut bench) = Bench::new(&idle, axis) else { return false };
            let count = samples((TRIED_S / idle.settings.period_s).clamp(TRIED[0], TRIED[1]), 1.0);
            let reference = |_| AxisReference::at_rest(1e-3 * step_um);
            (0..count).all(|_| bench.step(&reference).is_ok_and(|sample| !sample.saturated))
        })
    };
    STEPS_UM.into_iter().filter(|step_um| *step_um >= least_um).find(|step_um| fits(*step_um))
}

/// How long the ramp takes to reach its feed \[s\].
const PHASE_S: f64 = 0.1;
/// How long it stays there \[s\].
const CRUISE_S: f64 = 0.5;
/// Most control periods of a step or ramp.
const MOST_PERIODS: u64 = 2_000_000;

/// Steps every axis by itself, and runs it along a ramp: rise, overshoot, settling, following error.
///
/// Rise and overshoot as in ISO 230-1 and control practice: 10 % to 90 %, times between samples interpolated linearly. The step comes with sample
/// 0, and settling is counted from it; that of the ramp from the first sample at its end. The cross-coupling and the cutting force take no part.
///
/// # Errors
/// A request out of its range, a loop that diverges.
pub fn step(scenario: &Scenario, request: &StepRequest) -> Result<Steps, MeasureError> {
    let StepRequest { step_um, window_um, feed_mm_s, watch_s } = *request;
    within("step_um", step_um, 1e-3, 1e5)?;
    within("window_um", window_um, 1e-6, 1e5)?;
    if window_um >= step_um {
        let needed =
            format!("smaller than the step of {step_um} µm: in a wider one the table has settled before it moves");
        return Err(MeasureError::Request(OutOfRange::new("window_um", window_um, needed)));
    }
    within("feed_mm_s", feed_mm_s, 1e-3, 1e5)?;
    within("watch_s", watch_s, 1e-3, 1e3)?;
    scenario.settings.check()?;
    let samples = (watch_s + CRUISE_S + 2.0 * PHASE_S) / scenario.settings.period_s;
    if !(samples <= MOST_PERIODS as f64) {
        let help = "watch it for a shorter time";
        return Err(MeasureError::TooLong { what: "step and ramp", samples, most: MOST_PERIODS, help });
    }
    let idle = idle(scenario);
    let mut warnings = Vec::new();
    let mut axes = Vec::with_capacity(idle.axes.len());
    for axis in 0..idle.axes.len() {
        let found = AxisSteps::measure(&idle, axis, request)?;
        let name = found.axis.to_uppercase();
        let (step, ramp) = (&found.step, &found.ramp);
        if !found.stable {
            warnings.push(format!(
                "{name}: the loop is unstable, whatever these figures show; `servosim analyze` says what would make it stable"
            ));
        }
        let limit = idle.axes[axis].drive.voltage_limit_v;
        for (what, count, locked_up) in
            [("step", step.saturated_samples, step.locked_up), ("ramp", ramp.saturated_samples, ramp.locked_up)]
        {
            let samples = if count == 1 { "sample" } else { "samples" };
            if locked_up {
                warnings.push(format!(
                    "{name}: the {what} locks the loop up: it saturates the drive (±{limit} V) in {count} {samples} and does not recover"
                ));
            } else if count > 0 {
                let smaller = if what == "step" && found.stable { largest_step_um(&idle) } else { None };
                let smaller = smaller.map_or(String::new(), |um| format!("; a step of {um} µm would not"));
                warnings
                    .push(format!("{name}: the {what} saturates the drive (±{limit} V) in {count} {samples}{smaller}"));
            }
        }
        axes.push(found);
    }
    warnings.extend(neglected(scenario, true));
    Ok(Steps { scenario: scenario.name.clone(), step_um, window_um, axes, warnings })
}

impl AxisSteps {
    fn measure(scenario: &Scenario, axis: usize, request: &StepRequest) -> Result<Self, MeasureError> {
        let period_s = scenario.settings.period_s;
        let step_mm = 1e-3 * request.step_um;
        let count = samples(request.watch_s, period_s);
        let (run, locked_up) = record(scenario, axis, count, &|_| AxisReference::at_rest(step_mm))?;
        let step = StepMetrics { locked_up, ..stepped(&run, request, period_s) };
        let step_samples = sampled(&run, period_s);

        let length_mm = request.feed_mm_s * (PHASE_S + CRUISE_S);
        let motion = Motion::plan(length_mm, request.feed_mm_s, Profile::Quintic { phase_s: PHASE_S })?;
        let count = samples(motion.total_s() + request.watch_s, period_s);
        let (ramp, locked_up) = record(scenario, axis, count, &|k| {
            let at = motion.at(k as f64 * period_s);
            AxisReference {
                position_mm: at.s_mm,
                velocity_mm_s: at.feed_mm_s,
                acceleration_mm_s2: at.accel_mm_s2,
                jerk_mm_s3: at.jerk_mm_s3,
                torque_nm: 0.0,
                command_offset_mm: 0.0,
            }
        })?;
        let drive = DriveLoop::new(&scenario.axes[axis], &scenario.drives[axis], &scenario.settings)?;
        let model = drive.error_constants().map(|errors| um(errors.velocity_s * request.feed_mm_s));
        Ok(Self {
            axis: AXIS_NAMES[axis].to_owned(),
            stable: drive.is_stable(),
            step,
            ramp: RampMetrics { locked_up, ..ramped(&ramp, &motion, request, period_s, model) },
            step_samples,
            ramp_samples: sampled(&ramp, period_s),
        })
    }
}

/// A following error of less is none \[µm\].
const NO_LAG_UM: f64 = 1e-3;

/// The fewest samples that cover a time, at least ten.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a float cast saturates, and the caller has bounded it
fn samples(time_s: f64, period_s: f64) -> usize {
    (time_s / period_s).ceil().clamp(10.0, MOST_PERIODS as f64) as usize
}

fn record(
    scenario: &Scenario,
    axis: usize,
    count: usize,
    reference: &impl Fn(u64) -> AxisReference,
) -> Result<(Vec<Sample>, bool), MeasureError> {
    let mut bench = Bench::new(scenario, axis)?;
    let mut watch = LockupWatch::new(scenario.settings.period_s);
    let mut run = Vec::with_capacity(count);
    let mut locked_up = false;
    for k in 0..count {
        let sample = bench.step(reference)?;
        let error_mm = sample.command_mm - sample.actual_mm;
        locked_up |= watch.watch(k as u64, sample.voltage_v, sample.saturated, error_mm).is_some();
        run.push(sample);
    }
    Ok((run, locked_up))
}

fn sampled(run: &[Sample], period_s: f64) -> Vec<Sampled> {
    let sampled = |(k, sample): (usize, &Sample)| Sampled {
        time_s: k as f64 * period_s,
        command_um: um(sample.command_mm),
        actual_um: um(sample.actual_mm),
    };
    run.iter().enumerate().map(sampled).collect()
}

fn clamped(run: &[Sample]) -> u64 {
    run.iter().filter(|sample| sample.saturated).count() as u64
}

fn error_um(sample: &Sample) -> f64 {
    um(sample.command_mm - sample.actual_mm)
}

/// From when on every sample is in the window \[samples\], interpolated over its edge; none where the last is not.
fn settled(run: &[Sample], window_um: f64) -> Option<f64> {
    let Some(outside) = run.iter().rposition(|sample| !(error_um(sample).abs() <= window_um)) else { return Some(0.0) };
    let (before, after) = (error_um(run.get(outside)?).abs(), error_um(run.get(outside + 1)?));
    // Seen from the side that it comes in from.
    let after = after * error_um(run.get(outside)?).signum();
    Some(outside as f64 + ((before - window_um) / (before - after)).clamp(0.0, 1.0))
}

/// Mean distance from the command over the last tenth.
fn rest_um(run: &[Sample]) -> f64 {
    let rest = run.get(run.len() - run.len() / 10..).unwrap_or(&[]);
    rest.iter().map(error_um).sum::<f64>() / rest.len().max(1) as f64
}

fn stepped(run: &[Sample], request: &StepRequest, period_s: f64) -> StepMetrics {
    let step_mm = 1e-3 * request.step_um;
    let share = |k: usize| run.get(k).map_or(0.0, |sample| sample.actual_mm / step_mm);
    let reach = |level: f64| {
        let k = (0..run.len()).find(|k| share(*k) >= level)?;
        let Some(before) = k.checked_sub(1) else { return Some(0.0) };
        Some(before as f64 + (level - share(before)) / (share(k) - share(before)))
    };
    let peak = (0..run.len()).map(share).fold(0.0, f64::max);
    StepMetrics {
        rise_s: reach(0.1).zip(reach(0.9)).map(|(from, to)| (to - from) * period_s),
        overshoot_percent: 100.0 * (peak - 1.0).max(0.0),
        settling_s: settled(run, request.window_um).map(|samples| samples * period_s),
        rest_um: rest_um(run),
        saturated_samples: clamped(run),
        locked_up: false,
    }
}

fn ramped(
    run: &[Sample],
    motion: &Motion,
    request: &StepRequest,
    period_s: f64,
    model_following_error_um: Option<f64>,
) -> RampMetrics {
    let at = |time_s: f64| samples(time_s, period_s).min(run.len());
    // The last half of the cruise, whole samples.
    let end_s = motion.phase_s() + motion.cruise_s();
    let (from, to) = (at(end_s - 0.5 * motion.cruise_s()), at(end_s));
    let cruise = run.get(from..to).unwrap_or(&[]);
    let mean = cruise.iter().map(error_um).sum::<f64>() / cruise.len().max(1) as f64;
    let end = at(motion.total_s());
    RampMetrics {
        feed_mm_s: request.feed_mm_s,
        length_mm: motion.length_mm(),
        following_error_um: mean,
        kv_1_s: Some(1e3 * request.feed_mm_s / mean).filter(|kv| kv.is_finite() && mean > NO_LAG_UM),
        model_following_error_um,
        ripple_um: cruise.iter().map(|sample| (error_um(sample) - mean).abs()).fold(0.0, f64::max),
        largest_error_um: run.iter().map(|sample| error_um(sample).abs()).fold(0.0, f64::max),
        settling_s: settled(run.get(end..).unwrap_or(&[]), request.window_um).map(|samples| samples * period_s),
        rest_um: rest_um(run.get(end..).unwrap_or(&[])),
        saturated_samples: clamped(run),
        locked_up: false,
    }
}
