//! Runs of many sets of axes along one path.

use std::fmt;

use serde::Serialize;

use crate::contour::ContourMeter;
use crate::interpolator::{Interpolator, periods};
use crate::optimize::Random;
use crate::scenario::Scenario;
use crate::servo::{AxisLoop, AxisParameters, LockupWatch, LoopSettings};
use crate::simulation::{ReferenceTrajectory, RunMetrics, SimulationError};

/// The metrics of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Metrics {
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

impl Metrics {
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
pub(super) struct Runs<'a>(ReferenceTrajectory<'a, 2>);

impl fmt::Debug for Runs<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runs").field("samples", &self.samples()).finish_non_exhaustive()
    }
}

impl<'a> Runs<'a> {
    pub(super) fn new(scenario: &'a Scenario) -> Result<Self, SimulationError> {
        // The trajectory knows nothing of the axes.
        scenario.simulation()?;
        scenario.reference_trajectory().map(Self)
    }

    /// Control periods of a run.
    pub(super) fn samples(&self) -> u64 {
        self.0.samples()
    }

    /// One run with each of these axes.
    pub(super) fn of(&self, axes: &[[AxisParameters; 2]]) -> Vec<Metrics> {
        match self.0.run(axes) {
            Ok(runs) => runs.iter().map(Metrics::from).collect(),
            // A gain beyond what is simulated at all: the bounds of a variable keep out of there.
            Err(_) => vec![Metrics::LOST; axes.len()],
        }
    }
}

impl From<&RunMetrics<2>> for Metrics {
    fn from(run: &RunMetrics<2>) -> Self {
        if !(run.max_contour_error_um.is_finite() && run.rms_contour_error_um.is_finite()) {
            return Self::LOST;
        }
        Self {
            max_contour_error_um: run.max_contour_error_um,
            rms_contour_error_um: run.rms_contour_error_um,
            max_tracking_error_um: run.max_tracking_error_um,
            rms_tracking_error_um: run.rms_tracking_error_um,
            peak_voltage_v: run.peak_voltage_v,
            saturated_share: run.saturated_share,
            locked_up: run.locked_up,
        }
    }
}

/// Runs the scenario with these axes and multiplicative noise on the voltage: every sample's voltage reaches the plant
/// multiplied by `1 + share z` with `z` standard normal, on every axis by itself.
pub(super) fn noisy(scenario: &Scenario, axes: &[AxisParameters; 2], share: f64, seed: u64) -> Option<Metrics> {
    let LoopSettings { period_s, settling_s, .. } = scenario.settings;
    let mut interpolator = Interpolator::new(&*scenario.path, &scenario.motion, period_s);
    let last = interpolator.last_sample().saturating_add(periods(settling_s, period_s));
    let start = interpolator.setpoint(0).position_mm;
    let mut loops = [0, 1].map(|axis| AxisLoop::new(&axes[axis], &scenario.settings, start[axis]));
    let mut lockups = [(); 2].map(|()| LockupWatch::new(period_s));
    let mut meter = ContourMeter::new(&*scenario.path);
    let mut random = Random::new(seed);
    let (mut contour, mut tracking) = ((0.0_f64, 0.0), (0.0_f64, 0.0));
    let (mut peak_voltage_v, mut saturated, mut locked_up) = ([0.0_f64; 2], 0_u64, false);
    for k in 0..=last {
        let setpoint = interpolator.setpoint(k);
        let mut actual_mm = setpoint.position_mm;
        let mut is_saturated = false;
        for (i, axis) in loops.iter_mut().enumerate() {
            let signals = axis.control(setpoint.position_mm[i], setpoint.velocity_mm_s[i]);
            axis.advance(signals.voltage_v * (1.0 + share * random.normal()));
            actual_mm[i] = signals.actual_mm;
            is_saturated |= signals.saturated;
            peak_voltage_v[i] = peak_voltage_v[i].max(signals.voltage_v.abs());
            let error_mm = signals.command_mm - signals.actual_mm;
            locked_up |= lockups[i].watch(k, signals.voltage_v, signals.saturated, error_mm).is_some();
        }
        if !actual_mm.iter().all(|x| x.is_finite()) {
            return None;
        }
        let c = 1e3 * meter.measure(&actual_mm, &setpoint.position_mm, setpoint.s_mm).signed_mm.abs();
        let t = 1e3 * (setpoint.position_mm - actual_mm).norm();
        contour = (contour.0.max(c), contour.1 + c * c);
        tracking = (tracking.0.max(t), tracking.1 + t * t);
        saturated += u64::from(is_saturated);
    }
    let samples = (last + 1) as f64;
    Some(Metrics {
        max_contour_error_um: contour.0,
        rms_contour_error_um: (contour.1 / samples).sqrt(),
        max_tracking_error_um: tracking.0,
        rms_tracking_error_um: (tracking.1 / samples).sqrt(),
        peak_voltage_v,
        saturated_share: saturated as f64 / samples,
        locked_up,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_the_noisy_run_without_noise_is_the_run() {
        let alpha = Scenario::builtin("alpha").unwrap();
        let plain = Runs::new(&alpha).unwrap().of(&[alpha.axes])[0];
        let quiet = noisy(&alpha, &alpha.axes, 0.0, 1).unwrap();
        // A batch may differ from the exact distance by 1 nm; everything else is the same.
        assert!((plain.max_contour_error_um - quiet.max_contour_error_um).abs() < 1e-3);
        assert!((plain.max_tracking_error_um - quiet.max_tracking_error_um).abs() < 1e-9);
        assert_eq!(plain.peak_voltage_v, quiet.peak_voltage_v);
        let noisy_run = noisy(&alpha, &alpha.axes, 0.01, 1).unwrap();
        assert_ne!(noisy_run, quiet);
        assert_eq!(noisy_run, noisy(&alpha, &alpha.axes, 0.01, 1).unwrap());
        assert_ne!(noisy_run, noisy(&alpha, &alpha.axes, 0.01, 2).unwrap());
        // One percent of the voltage is not much of the error.
        assert!((noisy_run.max_contour_error_um / quiet.max_contour_error_um - 1.0).abs() < 0.1);
    }
}
