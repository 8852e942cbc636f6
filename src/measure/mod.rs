//! Measurements as on a machine, through the same loop as the runs of a scenario.
//!
//! | | |
//! |---|---|
//! | [`circle`] | circular test after ISO 230-4: circular deviation, hysteresis, reversal spikes |
//! | [`response`] | frequency response from command to table, by stepped sines in the time domain |
//! | [`step`] | step of the command, and a ramp at feed: rise, overshoot, settling to a window, following error |
//!
//! The drives are those of the scenario, with effects and compensation but without cutting force. [`analysis`](crate::analysis) gives the
//! linear loop of the same drives.
//!
//! ```
//! use servosim::{measure, scenario::Scenario};
//!
//! let alpha = Scenario::builtin("alpha")?;
//! let test = measure::circle(&alpha, &measure::CircleRequest { radius_mm: 10.0, ..measure::CircleRequest::of(&alpha) })?;
//! // Both loops pull the circle out by as much as their gain at its frequency is above one.
//! assert!(test.directions[0].radius_um > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod circle;
mod circle_path;
mod response;
mod roundness;
mod single_axis;
mod step;

pub use circle::{CircleRequest, CircleTest, Direction, Radial, Spike, circle, circle_observed};
pub use response::{AxisResponse, Response, ResponsePoint, ResponseRequest, response};
pub use step::{AxisSteps, RampMetrics, Sampled, StepMetrics, StepRequest, Steps, step};

use crate::diagnostics::readable;
use crate::feedrate::FeedrateError;
use crate::parameters::OutOfRange;
use crate::path::PathError;
use crate::scenario::Scenario;
use crate::simulation::SimulationError;

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// What is asked for cannot be.
    #[error(transparent)]
    Request(OutOfRange),
    /// The measurement would take too long.
    #[error("the {what} would take {samples:.0} control periods, at most {most} are kept: {help}")]
    TooLong {
        /// Which measurement.
        what: &'static str,
        /// How many it would take.
        samples: f64,
        /// How many may be.
        most: u64,
        /// What to do.
        help: &'static str,
    },
    /// The loop is unstable: it swings by itself, and nothing answers its command.
    #[error(
        "axis {axis} has no frequency response: its loop is unstable; `servosim analyze` says what would make it stable"
    )]
    Unstable {
        /// Which axis, in capitals.
        axis: String,
    },
    /// The loop does not stay where it is put.
    #[error(
        "axis {axis} cannot be measured: its loop diverged at t = {time_s} s; `servosim analyze` says what is wrong with it"
    )]
    Diverged {
        /// Which axis, in capitals.
        axis: String,
        /// When.
        time_s: f64,
    },
    /// The circle cannot be made.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The motion cannot be planned.
    #[error(transparent)]
    Feedrate(#[from] FeedrateError),
    /// A parameter of the drives is out of its range.
    #[error(transparent)]
    Servo(#[from] OutOfRange),
    /// The run failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// `value` if it is in the range, an error otherwise.
fn within(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, MeasureError> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    let needed = format!("a number from {} to {}", readable(low), readable(high));
    Err(MeasureError::Request(OutOfRange::new(name, value, needed)))
}

/// What of a scenario a measurement leaves out, in words.
///
/// - `alone`: each axis is measured by itself
fn neglected(scenario: &Scenario, alone: bool) -> Vec<String> {
    let mut out = Vec::new();
    if alone && scenario.cross_coupling.is_some() {
        out.push(
            "without the cross-coupled control, which ties the axes together: each is measured by itself (the circular test has it)"
                .to_owned(),
        );
    }
    if scenario.corrections_mm.is_some() {
        out.push("without the learned corrections, which belong to the scenario's own motion".to_owned());
    }
    out
}

/// The scenario without what happens in a cut only.
fn idle(scenario: &Scenario) -> Scenario {
    let mut idle = scenario.clone();
    for drive in &mut idle.drives {
        drive.effects.force = None;
    }
    idle
}

/// From mm to µm.
fn um(mm: f64) -> f64 {
    1e3 * mm
}
