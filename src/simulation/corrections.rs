//! Corrections of the commands, sample by sample.

use std::sync::Arc;

use nalgebra::SVector;

use crate::interpolator::Setpoint;

/// What is added to the position commands of a run.
#[derive(Debug, Clone)]
pub(super) struct Corrections<const A: usize> {
    shifts_mm: Arc<[SVector<f64, A>]>,
    rate: f64,
}

/// The shift of sample `k`, and its first and second derivative by central differences; `rate` is `1/Δt` \[1/s\]. Before the
/// first sample there is none, after the last one it stays.
pub(crate) fn shift<const A: usize>(shifts_mm: &[SVector<f64, A>], k: u64, rate: f64) -> [SVector<f64, A>; 3] {
    let at = |k: Option<u64>| {
        let k = k.map(|k| usize::try_from(k).unwrap_or(usize::MAX));
        k.and_then(|k| shifts_mm.get(k).or(shifts_mm.last())).copied().unwrap_or_else(SVector::zeros)
    };
    let (before, here, after) = (at(k.checked_sub(1)), at(Some(k)), at(Some(k.saturating_add(1))));
    [here, (after - before) * (0.5 * rate), (after - here * 2.0 + before) * (rate * rate)]
}

impl<const A: usize> Corrections<A> {
    pub(super) fn new(shifts_mm: Arc<[SVector<f64, A>]>, period_s: f64) -> Self {
        Self { shifts_mm, rate: 1.0 / period_s }
    }

    /// The setpoint of sample `k` as the axes are given it.
    pub(super) fn of(&self, setpoint: &Setpoint<A>, k: u64) -> Setpoint<A> {
        let [position, velocity, acceleration] = shift(&self.shifts_mm, k, self.rate);
        Setpoint {
            position_mm: setpoint.position_mm + position,
            velocity_mm_s: setpoint.velocity_mm_s + velocity,
            acceleration_mm_s2: setpoint.acceleration_mm_s2 + acceleration,
            ..*setpoint
        }
    }
}
