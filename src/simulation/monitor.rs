//! Events of a run: saturation, limits passed, lock-up.

use super::Period;
use super::event::Event;
use crate::limits::{Held, Limits, Peaks};
use crate::servo::{LockupWatch, LoopSettings};

/// Turns periods into events.
#[derive(Debug)]
pub(crate) struct Monitor<const A: usize> {
    limits: Limits,
    overridden: bool,
    saturated_since: [Option<f64>; A],
    lockups: [LockupWatch; A],
    passed: [bool; Limits::COUNT],
}

impl<const A: usize> Monitor<A> {
    pub(crate) fn new(limits: &Limits, settings: &LoopSettings, overridden: bool) -> Self {
        Self {
            limits: *limits,
            overridden,
            saturated_since: [None; A],
            lockups: std::array::from_fn(|_| LockupWatch::new(settings.period_s)),
            passed: [false; Limits::COUNT],
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
        let at = &period.setpoint;
        let mut axes = [[0.0; 3]; 3];
        for (axis, values) in axes.iter_mut().enumerate().take(A) {
            *values = [at.velocity_mm_s[axis], at.acceleration_mm_s2[axis], at.jerk_vector_mm_s3[axis]].map(f64::abs);
        }
        let now = Peaks {
            contour_error_um: period.contour_error_um.abs(),
            tracking_error_um: period.tracking_error_um,
            voltage_v: voltage,
            accel_mm_s2: at.accel_mm_s2.abs(),
            jerk_mm_s3: at.jerk_mm_s3.abs(),
            vector_accel_mm_s2: at.acceleration_mm_s2.norm(),
            vector_jerk_mm_s3: at.jerk_vector_mm_s3.norm(),
            axes,
            overridden: self.overridden,
        };
        for (held, passed) in self.limits.held(&now).into_iter().zip(&mut self.passed) {
            if let Some(Held { name, value, limit, kept: false }) = held
                && !*passed
            {
                *passed = true;
                emit(&Event::LimitPassed { name, value, limit, time_s })?;
            }
        }
        Ok(())
    }
}
