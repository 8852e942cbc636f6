//! One axis of a scenario on its own.

use super::MeasureError;
use crate::parameters::axis_title;
use crate::path::Cursor;
use crate::scenario::Scenario;
use crate::servo::{AxisLoop, AxisReference, AxisSignals, DetailedAxis, step_alone};

/// One sample; positions counted from the start \[mm\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) command_mm: f64,
    pub(super) actual_mm: f64,
    pub(super) voltage_v: f64,
    pub(super) saturated: bool,
}

/// An axis at rest where the scenario's path starts. Cross-coupling, which takes two axes, is not in it.
pub(super) struct Bench {
    axis: Kind,
    ahead: u64,
    start_mm: f64,
    period_s: f64,
    name: String,
    k: u64,
}

/// The model's own loop where that is all there is, as in a run.
enum Kind {
    Model(AxisLoop),
    Real(Box<DetailedAxis>),
}

impl Bench {
    /// - `axis`: its number
    pub(super) fn new(scenario: &Scenario, axis: usize) -> Result<Self, MeasureError> {
        let start_mm = scenario.path.point_mm(0.0, &mut Cursor::default())[axis];
        let (parameters, drive, settings) = (&scenario.axes[axis], &scenario.drives[axis], &scenario.settings);
        parameters.check()?;
        settings.check()?;
        let (kind, ahead) = if drive.is_model() {
            (Kind::Model(AxisLoop::new(parameters, settings, start_mm)), 0)
        } else {
            let (real, ahead) = drive.axis(parameters, settings, start_mm)?;
            (Kind::Real(Box::new(real)), ahead)
        };
        Ok(Self {
            axis: kind,
            ahead: ahead as u64,
            start_mm,
            period_s: settings.period_s,
            name: axis_title(axis),
            k: 0,
        })
    }

    /// The next control period under a reference that is known for every sample, counted from the start.
    pub(super) fn step(&mut self, reference: &impl Fn(u64) -> AxisReference) -> Result<Sample, MeasureError> {
        let seen = reference(self.k + self.ahead);
        let seen = AxisReference { position_mm: self.start_mm + seen.position_mm, ..seen };
        let AxisSignals { actual_mm, voltage_v, saturated, .. } = match &mut self.axis {
            Kind::Model(axis) => step_alone(axis, &seen),
            Kind::Real(axis) => step_alone(axis.as_mut(), &seen),
        };
        // A loop that has left the range of any machine will not come back.
        if !(actual_mm.abs() <= 1e12 && voltage_v.is_finite()) {
            return Err(MeasureError::Diverged { axis: self.name.clone(), time_s: self.k as f64 * self.period_s });
        }
        let command_mm = reference(self.k).position_mm;
        self.k += 1;
        Ok(Sample { command_mm, actual_mm: actual_mm - self.start_mm, voltage_v, saturated })
    }
}
