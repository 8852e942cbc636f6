//! What happens during a run that a person should hear of.

use super::Period;
use crate::limits::{Event, Limits, is_kept};
use crate::servo::{LockupWatch, LoopSettings};

/// Turns periods into events.
#[derive(Debug)]
pub(crate) struct Monitor<const A: usize> {
    limits: Limits,
    saturated_since: [Option<f64>; A],
    lockups: [LockupWatch; A],
    passed: [bool; 5],
}

impl<const A: usize> Monitor<A> {
    pub(crate) fn new(limits: &Limits, settings: &LoopSettings) -> Self {
        Self {
            limits: *limits,
            saturated_since: [None; A],
            lockups: std::array::from_fn(|_| LockupWatch::new(settings.period_s)),
            passed: [false; 5],
        }
    }

    /// Tells `emit` every event of this period.
    pub(crate) fn watch<E>(
        &mut self,
        period: &Period<A>,
        emit: &mut dyn FnMut(&Event) -> Result<(), E>,
    ) -> Result<(), E> {
        let time_s = period.time_s;
        let mut voltage = 0.0_f64;
        for (axis, signals) in period.axes.iter().enumerate() {
            voltage = voltage.max(signals.voltage_v.abs());
            match (signals.saturated, self.saturated_since[axis]) {
                (true, None) => {
                    self.saturated_since[axis] = Some(time_s);
                    emit(&Event::SaturationBegan { axis, time_s })?;
                }
                (false, Some(since)) => {
                    self.saturated_since[axis] = None;
                    emit(&Event::SaturationEnded { axis, time_s, lasted_s: time_s - since })?;
                }
                _ => {}
            }
            let error = signals.command_mm - signals.actual_mm;
            if let Some(lockup) = self.lockups[axis].watch(period.k, signals.voltage_v, signals.saturated, error) {
                emit(&Event::LockedUp { axis, lockup })?;
            }
        }
        let values = [
            ("contour_error_um", period.contour_error_um.abs(), self.limits.contour_error_um),
            ("tracking_error_um", period.tracking_error_um, self.limits.tracking_error_um),
            ("voltage_v", voltage, self.limits.voltage_v),
            ("accel_mm_s2", period.setpoint.accel_mm_s2.abs(), self.limits.accel_mm_s2),
            ("jerk_mm_s3", period.setpoint.jerk_mm_s3.abs(), self.limits.jerk_mm_s3),
        ];
        for ((name, value, limit), passed) in values.into_iter().zip(&mut self.passed) {
            if let Some(limit) = limit
                && !is_kept(value, limit)
                && !*passed
            {
                *passed = true;
                emit(&Event::LimitPassed { name, value, limit, time_s })?;
            }
        }
        Ok(())
    }
}
