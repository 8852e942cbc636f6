//! Iterative learning control: the same run again and again, each with a correction of its commands learned from the one before.
//!
//! Per axis, with the error `e = x_com - x_act` of run `j` and the correction `c` that was added to its position command:
//!
//! ```text
//! c ← Q (c + γ L e)        L = H*/(|H|² + ε²)      Q = 1/(1 + (f/f_c)⁸)
//! e ← Q |1 - γ L H_true| e  (per frequency, once Q = 1)
//! ```
//!
//! `H` is the axis' linear response from command to table as its controller's designer knows it (plant, gains, filters, prefilter), run
//! through the loop itself. Its inverse needs no causality: the error of the whole last run is there. `Q`, a low pass without phase, ends the
//! learning where the drive is no longer what its model says; without it what begins to converge diverges later, at high frequencies.
//! Where `|1 - γ L H_true| < 1` below the cutoff, the error falls from run to run, monotonically, down to what changes from run to run.
//!
//! Source: D. A. Bristow, M. Tharayil, A. G. Alleyne, "A survey of iterative learning control", IEEE Control Systems Magazine 26 (3), 2006.
//!
//! ```
//! use servosim::{learning, scenario::Scenario};
//!
//! let alpha = Scenario::builtin("alpha")?;
//! let learned = learning::learn(&alpha, &learning::LearnRequest { runs: 4, ..Default::default() })?;
//! assert!(learned.runs[3].rms_tracking_error_um < 0.1 * learned.runs[0].rms_tracking_error_um);
//! // The correction is good for any run of this scenario.
//! let run = alpha.simulation()?.with_corrections(learned.corrections_mm.clone())?;
//! assert!(run.map(|period| period.contour_error_um.abs()).fold(0.0, f64::max) < 5.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod spectrum;

use crate::parameters::{OutOfRange, axis_title};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::{Complex, SVector, Vector1, Vector2};
use serde::Serialize;

use crate::diagnostics::readable;
use crate::scenario::Scenario;
use crate::servo::compensation::Compensation;
use crate::servo::{AxisParameters, AxisReference, DriveModel, step_alone};
use crate::simulation::{Ending, MAX_CORRECTED_PERIODS, Period, SimulationError, shift};
use crate::summary::Summary;
use spectrum::Transform;

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnRequest {
    /// Runs in all, the first one without a correction (or with those that the scenario has); 2 to 1000.
    pub runs: u32,
    /// Learning gain `γ`, above 0 and below 2.
    pub gain: f64,
    /// Cutoff `f_c` of the low pass \[Hz\], from one period in the run to the Nyquist frequency; by default a quarter of the bandwidth of the slower axis' response, at
    /// most a tenth of the Nyquist frequency: a twentieth of the sampling rate.
    pub cutoff_hz: Option<f64>,
}

impl Default for LearnRequest {
    /// Ten runs, a gain of 0.8.
    fn default() -> Self {
        Self { runs: 10, gain: 0.8, cutoff_hz: None }
    }
}

/// Metrics of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LearnRun {
    /// Its number, from 1.
    pub run: u32,
    /// Largest contouring error: what a run is judged by.
    pub max_contour_error_um: f64,
    /// Its root mean square.
    pub rms_contour_error_um: f64,
    /// Largest tracking error.
    pub max_tracking_error_um: f64,
    /// Its root mean square: what is learned from, and what tells divergence.
    pub rms_tracking_error_um: f64,
    /// Largest voltage of any axis.
    pub peak_voltage_v: f64,
    /// Share of samples in which an axis is saturated.
    pub saturated_share: f64,
}

impl From<(u32, &Summary)> for LearnRun {
    fn from((run, summary): (u32, &Summary)) -> Self {
        Self {
            run,
            max_contour_error_um: summary.max_contour_error_um,
            rms_contour_error_um: summary.rms_contour_error_um,
            max_tracking_error_um: summary.max_tracking_error_um,
            rms_tracking_error_um: summary.rms_tracking_error_um,
            peak_voltage_v: summary.peak_voltage_v,
            saturated_share: summary.saturated_share,
        }
    }
}

/// What was learned.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Learned {
    /// Name of the scenario.
    pub scenario: String,
    /// Learning gain.
    pub gain: f64,
    /// Cutoff of the low pass.
    pub cutoff_hz: f64,
    /// Control period.
    pub period_s: f64,
    /// The runs; fewer than asked for where learning diverged.
    pub runs: Vec<LearnRun>,
    /// Number of the run with the smallest contouring error (largest of the run); the first of equals.
    pub best_run: u32,
    /// Why learning was ended early: it diverged.
    pub diverged: Option<String>,
    /// Whether an axis locks up in the first run.
    pub locked_up: bool,
    /// Whether learning was stopped: there are the runs up to then.
    pub interrupted: bool,
    /// Whether the first run had the corrections of the scenario.
    pub continued: bool,
    /// In words, for a person.
    pub warnings: Vec<String>,
    /// The corrections of the best run, sample by sample \[mm\]: for [`Simulation::with_corrections`](crate::simulation::Simulation::with_corrections).
    #[serde(skip)]
    pub corrections_mm: Arc<[Vector2<f64>]>,
}

impl Learned {
    /// Whether a run has a smaller contouring error than the first one: otherwise the corrections are those of the first run, zero or the
    /// scenario's.
    pub fn improved(&self) -> bool {
        self.best_run > 1
    }
}

/// Why nothing could be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// What is asked for cannot be.
    #[error(transparent)]
    Request(OutOfRange),
    /// The run is too long to be kept.
    #[error("the run has {samples} control periods; learning keeps them all and takes at most {MAX_LEARNED_PERIODS}")]
    TooLong {
        /// How many.
        samples: u64,
    },
    /// The linear loop does not come to rest.
    #[error(
        "nothing can be learned: the loop of axis {axis} is not stable, or takes too long to settle; `servosim analyze` says why"
    )]
    Unstable {
        /// In capitals.
        axis: String,
    },
    /// A parameter of the drives is out of its range.
    #[error(transparent)]
    Servo(#[from] OutOfRange),
    /// The first run failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Most control periods of a run that is learned.
pub const MAX_LEARNED_PERIODS: u64 = MAX_CORRECTED_PERIODS;

/// A run whose error is larger than the best one by this factor ends the learning.
const GROWTH: f64 = 1.5;
/// And by so much \[µm\]: rounding is no growth.
const GROWTH_UM: f64 = 1e-6;
/// `ε` as a share of the largest `|H|`.
const REGULARISED: f64 = 1e-3;
/// Before the impulse of the model: more than any axis looks ahead.
const BEFORE: usize = 64;
/// Longest response of the model \[samples\].
const LONGEST: usize = 1 << 18;
/// What of it is left out.
const SETTLED: f64 = 1e-9;

/// Learns a correction of the position commands of every axis over repeated runs of a scenario.
///
/// A measurement noise is another one in every run (its seed is), all else repeats itself. A scenario that has corrections already goes on
/// from them: its first run is made with them.
///
/// # Errors
/// A request out of its range, a first run that fails, a loop that is not stable. Learning that diverges is no error:
/// [`Learned::diverged`] tells why.
pub fn learn(scenario: &Scenario, request: &LearnRequest) -> Result<Learned, LearnError> {
    learn_until(&AtomicBool::new(false), scenario, request)
}

/// As [`learn`], but ends early, with the runs that it has (none, if it is the first one that is stopped), when `stop` is raised.
///
/// # Errors
/// As [`learn`].
pub fn learn_until(stop: &AtomicBool, scenario: &Scenario, request: &LearnRequest) -> Result<Learned, LearnError> {
    let settings = &scenario.settings;
    let nyquist_hz = 0.5 / settings.period_s;
    let refuse = |name, value, needed: String| Err(LearnError::Request(OutOfRange::new(name, value, needed)));
    if !(2..=1000).contains(&request.runs) {
        return refuse("runs", f64::from(request.runs), "a number from 2 to 1000".to_owned());
    }
    if !(request.gain > 0.0 && request.gain < 2.0) {
        let needed =
            "above 0 and below 2: each run multiplies the error by |1 - gain|, from 2 on it would grow".to_owned();
        return refuse("gain", request.gain, needed);
    }
    let samples = scenario.simulation()?.samples();
    if samples > MAX_LEARNED_PERIODS {
        return Err(LearnError::TooLong { samples });
    }
    let once_hz = 1.0 / (samples as f64 * settings.period_s);
    if let Some(cutoff) = request.cutoff_hz
        && !(once_hz.min(nyquist_hz)..=nyquist_hz).contains(&cutoff)
    {
        let (low, high) = (readable(once_hz), readable(nyquist_hz));
        let needed = format!("from {low} (one period in the whole run) to {high} (the Nyquist frequency)");
        return refuse("cutoff_hz", cutoff, needed);
    }
    let learner = Learner::new(scenario, request, usize::try_from(samples).unwrap_or(usize::MAX))?;
    learner.learn(stop, scenario, request)
}

/// What is the same in all runs.
struct Learner {
    transform: Transform,
    /// `γ L`, axis by axis.
    inverse: Vec<Vec<Complex<f64>>>,
    /// `Q`.
    low_pass: Vec<f64>,
    cutoff_hz: f64,
}

impl Learner {
    fn new(scenario: &Scenario, request: &LearnRequest, samples: usize) -> Result<Self, LearnError> {
        let period_s = scenario.settings.period_s;
        let impulses: Vec<Vec<f64>> =
            (0..scenario.axes.len()).map(|axis| impulse(scenario, axis)).collect::<Result<_, _>>()?;
        let longest = impulses.iter().map(Vec::len).max().unwrap_or(0);
        let transform = Transform::at_least(samples + 2 * longest.max(256));
        let n = transform.length();
        let hz = |m: usize| m.min(n - m) as f64 / (n as f64 * period_s);
        let responses: Vec<Vec<Complex<f64>>> = impulses
            .iter()
            .map(|impulse| {
                // What comes before the impulse is at the end of the circle.
                let mut around = vec![0.0; n];
                for (k, value) in impulse.iter().enumerate() {
                    around[(k + n - BEFORE) % n] = *value;
                }
                transform.forward(around)
            })
            .collect();
        let nyquist_hz = 0.5 / period_s;
        let bandwidth = |response: &Vec<Complex<f64>>| {
            let below = (0..=n / 2).find(|m| response[*m].norm_sqr() < 0.5);
            below.map_or(nyquist_hz, hz)
        };
        let cutoff_hz = request.cutoff_hz.unwrap_or_else(|| {
            let slowest = responses.iter().map(bandwidth).fold(f64::INFINITY, f64::min);
            (0.25 * slowest).min(0.1 * nyquist_hz)
        });
        let inverse = responses.into_iter().map(|response| {
            let largest = response.iter().map(Complex::norm_sqr).fold(0.0, f64::max);
            let regular = REGULARISED * REGULARISED * largest;
            response.into_iter().map(|h| h.conj() * (request.gain / (h.norm_sqr() + regular))).collect()
        });
        Ok(Self {
            inverse: inverse.collect(),
            low_pass: (0..n).map(|m| 1.0 / (1.0 + libm::pow(hz(m) / cutoff_hz, 8.0))).collect(),
            transform,
            cutoff_hz,
        })
    }

    fn learn(&self, stop: &AtomicBool, scenario: &Scenario, request: &LearnRequest) -> Result<Learned, LearnError> {
        let mut corrections = scenario.corrections_mm.clone().unwrap_or_else(|| Arc::from([]));
        let mut out = Learned {
            scenario: scenario.name.clone(),
            gain: request.gain,
            cutoff_hz: self.cutoff_hz,
            period_s: scenario.settings.period_s,
            runs: Vec::new(),
            best_run: 1,
            diverged: None,
            locked_up: false,
            interrupted: false,
            continued: scenario.corrections_mm.is_some(),
            warnings: Vec::new(),
            corrections_mm: corrections.clone(),
        };
        // Judged by the contouring error, watched by the tracking error that is learned from.
        let (mut best_um, mut least_rms_um) = (f64::INFINITY, f64::INFINITY);
        for run in 1..=request.runs {
            let (summary, errors) = match one_run(stop, scenario, run, corrections.clone()) {
                Ok(Some(done)) => done,
                Ok(None) => {
                    out.interrupted = true;
                    break;
                }
                Err(SimulationError::Diverged { time_s }) if run > 1 => {
                    out.diverged = Some(self.blame(request, run, &format!("the loop diverged at t = {time_s} s")));
                    break;
                }
                Err(error) => return Err(error.into()),
            };
            let metrics = LearnRun::from((run, &summary));
            let rms_um = metrics.rms_tracking_error_um;
            out.runs.push(metrics);
            if run == 1 {
                out.locked_up = summary.locked_up;
                if !out.continued {
                    out.corrections_mm = vec![Vector2::zeros(); errors.len()].into();
                }
            }
            if metrics.max_contour_error_um < best_um && (run == 1 || !summary.locked_up) {
                (best_um, out.best_run) = (metrics.max_contour_error_um, run);
                if run > 1 {
                    out.corrections_mm = corrections.clone();
                }
            }
            least_rms_um = least_rms_um.min(rms_um);
            if summary.locked_up && !out.locked_up {
                out.diverged = Some(self.blame(request, run, "an axis locked up"));
                break;
            }
            if rms_um > GROWTH * least_rms_um + GROWTH_UM {
                let grown = format!("the tracking error (rms) grew from {least_rms_um:.4} to {rms_um:.4} µm");
                out.diverged = Some(self.blame(request, run, &grown));
                break;
            }
            if run < request.runs {
                corrections = self.next(&corrections, &errors);
            }
        }
        let first = out.runs.first();
        if let Some(text) = first.filter(|run| run.saturated_share > 0.0).map(|_| "the first run saturates the drive") {
            out.warnings.push(format!("{text}: what the voltage limit takes away cannot be learned"));
        }
        if out.runs.first().is_some_and(|run| run.saturated_share == 0.0)
            && out.runs.iter().any(|run| run.saturated_share > 0.0)
        {
            out.warnings.push("the learned corrections saturate the drives: lower the cutoff or the gain".to_owned());
        }
        if !out.improved() && out.runs.len() > 1 {
            let kept = if out.continued { "the scenario's own correction is kept" } else { "the correction is zero" };
            out.warnings.push(format!(
                "nothing is gained: no run has a smaller contouring error than the first ({:.4} µm); {kept}",
                out.runs.first().map_or(0.0, |run| run.max_contour_error_um)
            ));
        }
        if out.locked_up {
            out.warnings.push("an axis locks up in the first run: tune the loop before it learns".to_owned());
        }
        Ok(out)
    }

    /// Why learning diverges.
    fn blame(&self, request: &LearnRequest, run: u32, what: &str) -> String {
        let cutoff = self.cutoff_hz;
        let why = if request.gain > 1.0 {
            format!("the learning gain of {} is too high for these drives: try one below 1", request.gain)
        } else {
            format!(
                "up to the cutoff of {cutoff:.4} Hz the drives differ too much from their model for a learning gain of {}: lower \
                 the cutoff or the gain",
                request.gain
            )
        };
        format!("learning diverges: in run {run} {what}; {why}")
    }

    /// The corrections of the next run.
    fn next(&self, corrections: &[Vector2<f64>], errors: &[Vector2<f64>]) -> Arc<[Vector2<f64>]> {
        let mut out = vec![Vector2::zeros(); errors.len()];
        for (axis, inverse) in self.inverse.iter().enumerate() {
            let spectrum = |values: &[Vector2<f64>]| self.transform.forward(self.closed(values, axis));
            let (before, error) = (spectrum(corrections), spectrum(errors));
            let learned = before.iter().zip(&error).zip(inverse).zip(&self.low_pass);
            let learned = learned.map(|(((before, error), inverse), q)| (before + error * inverse) * *q).collect();
            for (out, value) in out.iter_mut().zip(self.transform.back(learned)) {
                out[axis] = value;
            }
        }
        out.into()
    }

    /// A signal of one axis on the circle of the transform: from its last value it goes back to zero smoothly, as if the run ended so.
    fn closed(&self, values: &[Vector2<f64>], axis: usize) -> Vec<f64> {
        let last = values.last().map_or(0.0, |value| value[axis]);
        let room = self.transform.length().saturating_sub(values.len()).max(1) as f64;
        let back = (1..=self.transform.length().saturating_sub(values.len()))
            .map(|k| 0.5 * last * (1.0 + libm::cos(std::f64::consts::PI * k as f64 / room)));
        values.iter().map(|value| value[axis]).chain(back).collect()
    }
}

/// Summary and errors, command less actual position \[mm\].
type Run = (Summary, Vec<Vector2<f64>>);

/// One run; nothing where it was stopped.
fn one_run(
    stop: &AtomicBool,
    scenario: &Scenario,
    run: u32,
    corrections: Arc<[Vector2<f64>]>,
) -> Result<Option<Run>, SimulationError> {
    let mut repeated = scenario.clone();
    for noise in repeated.drives.iter_mut().filter_map(|drive| drive.effects.noise.as_mut()) {
        noise.seed = noise.seed.wrapping_add(u64::from(run - 1));
    }
    let mut simulation = repeated.simulation()?;
    if !corrections.is_empty() {
        simulation = simulation.with_corrections(corrections)?;
    }
    let mut errors: Vec<Vector2<f64>> = Vec::new();
    let mut summary = repeated.summary_observer();
    let mut note = |period: &Period<2>| errors.push(period.setpoint.position_mm - period.actual_mm);
    let ending = simulation.run(&repeated.limits, Some(stop), &mut [&mut summary, &mut note])?;
    Ok((ending == Ending::Complete).then(|| (summary.summary(), errors)))
}

/// What the linear axis makes of a pulse of one sample of its position command, [`BEFORE`] samples after the first: until it has come to rest.
fn impulse(scenario: &Scenario, axis: usize) -> Result<Vec<f64>, LearnError> {
    let (parameters, drive) = (&scenario.axes[axis], &scenario.drives[axis]);
    let mut linear = AxisParameters { ..*parameters };
    // Never reached.
    linear.drive.voltage_limit_v = 1e9;
    let compensation = Compensation {
        filters: drive.compensation.filters.clone(),
        acceleration: drive.compensation.acceleration,
        ..Compensation::default()
    };
    let known = DriveModel {
        controller: drive.controller,
        zero_phase: drive.zero_phase,
        compensation,
        ..DriveModel::default()
    };
    let (mut axis_loop, ahead) = known.axis(&linear, &scenario.settings, 0.0)?;
    let rate = 1.0 / scenario.settings.period_s;
    let pulse: Vec<SVector<f64, 1>> =
        (0..BEFORE + 2).map(|k| Vector1::new(if k == BEFORE { 1.0 } else { 0.0 })).collect();
    let mut out: Vec<f64> = Vec::new();
    let (mut peak, mut quiet) = (0.0_f64, 0);
    while out.len() < LONGEST {
        let [position, velocity, acceleration] = shift(&pulse, (out.len() + ahead) as u64, rate);
        let reference = AxisReference {
            position_mm: position[0],
            velocity_mm_s: velocity[0],
            acceleration_mm_s2: acceleration[0],
            ..AxisReference::default()
        };
        let actual = step_alone(&mut axis_loop, &reference).actual_mm;
        peak = peak.max(actual.abs());
        quiet = if actual.abs() <= SETTLED * peak { quiet + 1 } else { 0 };
        out.push(actual);
        if !(actual.abs() <= 1e12) {
            break;
        }
        // A pulse that has not come yet is no rest; one that swings through zero is none either.
        if out.len() > 2 * BEFORE && quiet > BEFORE && peak > 0.0 {
            return Ok(out);
        }
    }
    Err(LearnError::Unstable { axis: axis_title(axis) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::{Feedforward, SampledLoop};

    #[test]
    fn validates_the_pulse_response_against_the_closed_form() {
        let scenario = Scenario::builtin("alpha").unwrap();
        for axis in 0..2 {
            let pulse = impulse(&scenario, axis).unwrap();
            let closed = SampledLoop::new(&scenario.axes[axis], &scenario.settings);
            for omega in [0.0_f64, 10.0, 100.0, 700.0, 2000.0, 3100.0] {
                let term = |(k, x): (usize, &f64)| {
                    Complex::from_polar(*x, -omega * (k as f64 - BEFORE as f64) * scenario.settings.period_s)
                };
                let sum: Complex<f64> = pulse.iter().enumerate().map(term).sum();
                let known = closed.command_response(omega, Feedforward::With);
                let known = if omega == 0.0 { Complex::new(1.0, 0.0) } else { known };
                assert!((sum - known).norm() < 1e-6, "{omega}: {sum} {known}");
            }
        }
    }
}
