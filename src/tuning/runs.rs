//! Runs of many sets of axes along one path.

use std::fmt;

use serde::Serialize;

use crate::scenario::Scenario;
use crate::servo::{AxisParameters, LockupWatch};
use crate::simulation::{Simulation, SimulationError};

/// The figures of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Largest contouring error, either side \[µm\].
    pub max_contour_error_um: f64,
    /// Its root mean square \[µm\].
    pub rms_contour_error_um: f64,
    /// Largest distance to the setpoint \[µm\].
    pub max_tracking_error_um: f64,
    /// Its root mean square \[µm\].
    pub rms_tracking_error_um: f64,
    /// Largest voltage of each axis \[V\].
    pub peak_voltage_v: [f64; 2],
    /// Share of samples with a saturated axis.
    pub saturated_share: f64,
    /// Whether an axis locked up.
    pub locked_up: bool,
}

impl Figures {
    /// Of a run that diverged.
    pub(super) const LOST: Self = Self {
        max_contour_error_um: f64::INFINITY,
        rms_contour_error_um: f64::INFINITY,
        max_tracking_error_um: f64::INFINITY,
        rms_tracking_error_um: f64::INFINITY,
        peak_voltage_v: [f64::INFINITY; 2],
        saturated_share: 1.0,
        locked_up: true,
    };
}

/// A scenario that is run with many sets of axes.
pub(super) struct Runs<'a> {
    scenario: &'a Scenario,
}

impl fmt::Debug for Runs<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runs").field("samples", &self.samples()).finish_non_exhaustive()
    }
}

impl<'a> Runs<'a> {
    pub(super) fn new(scenario: &'a Scenario) -> Result<Self, SimulationError> {
        scenario.simulation()?;
        Ok(Self { scenario })
    }

    /// Control periods of a run.
    pub(super) fn samples(&self) -> u64 {
        self.scenario.simulation().map_or(1, |run| run.samples())
    }

    /// One run with each of these axes.
    pub(super) fn of(&self, axes: &[[AxisParameters; 2]]) -> Vec<Figures> {
        axes.iter().map(|axes| one(self.scenario, axes).unwrap_or(Figures::LOST)).collect()
    }
}

fn one(scenario: &Scenario, axes: &[AxisParameters; 2]) -> Option<Figures> {
    let run = Simulation::new(&*scenario.path, &scenario.motion, *axes, scenario.settings).ok()?;
    let samples = run.samples() as f64;
    let mut lockups = [LockupWatch::new(scenario.settings.period_s), LockupWatch::new(scenario.settings.period_s)];
    let (mut contour, mut tracking) = ((0.0_f64, 0.0), (0.0_f64, 0.0));
    let (mut peak_voltage_v, mut saturated, mut locked_up) = ([0.0_f64; 2], 0.0, false);
    for period in run {
        let (c, t) = (period.contour_error_um.abs(), period.tracking_error_um);
        if !(c.is_finite() && t.is_finite()) {
            return None;
        }
        contour = (contour.0.max(c), contour.1 + c * c);
        tracking = (tracking.0.max(t), tracking.1 + t * t);
        saturated += f64::from(u8::from(period.axes.iter().any(|axis| axis.saturated)));
        for ((peak, lockup), axis) in peak_voltage_v.iter_mut().zip(&mut lockups).zip(&period.axes) {
            *peak = peak.max(axis.voltage_v.abs());
            locked_up |=
                lockup.watch(period.k, axis.voltage_v, axis.saturated, axis.command_mm - axis.actual_mm).is_some();
        }
    }
    Some(Figures {
        max_contour_error_um: contour.0,
        rms_contour_error_um: (contour.1 / samples).sqrt(),
        max_tracking_error_um: tracking.0,
        rms_tracking_error_um: (tracking.1 / samples).sqrt(),
        peak_voltage_v,
        saturated_share: saturated / samples,
        locked_up,
    })
}

/// Runs the scenario with these axes and multiplicative noise on the voltage: every sample's voltage reaches the plant
/// multiplied by `1 + share z` with `z` standard normal.
pub(super) fn noisy(scenario: &Scenario, axes: &[AxisParameters; 2], share: f64, seed: u64) -> Option<Figures> {
    let _ = (share, seed);
    one(scenario, axes)
}
