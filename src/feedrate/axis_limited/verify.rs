//! The motion held against the limits between the points of the grid.

use super::limits::{AxisLimited, PathShape};
use crate::feedrate::planned::Planned;

/// The largest shares of the limits that are used in an interval.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Share {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

impl Share {
    /// By how much the motion would have to slow down to keep the limits: speeds fall with it, accelerations with its square,
    /// jerks with its cube.
    pub(super) fn feed_scale(&self) -> f64 {
        self.velocity.max(self.acceleration.max(0.0).sqrt()).max(libm::cbrt(self.jerk))
    }
}

/// The shares in every interval, at so many places.
pub(super) fn shares<const D: usize>(
    planned: &Planned,
    planner: &AxisLimited<D>,
    places: u32,
    shape: &mut impl FnMut(f64) -> PathShape<D>,
) -> Vec<Share> {
    let limits = &planner.limits;
    let mut shares = vec![Share::default(); planned.nodes().saturating_sub(1)];
    planned.each_sample(places, |interval, m| {
        let (v, a, j) = (m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3);
        let at = shape(m.s_mm);
        let Some(share) = shares.get_mut(interval) else { return };
        if let Some(feed) = planner.feed_mm_s {
            share.velocity = share.velocity.max(v / feed);
        }
        for i in 0..D {
            let (t, k, r) = (at.tangent[i], at.curvature_1_mm[i], at.curvature_rate_1_mm2[i]);
            share.velocity = share.velocity.max((t * v).abs() / limits.velocity_mm_s[i]);
            share.acceleration = share.acceleration.max((k * v * v + t * a).abs() / limits.acceleration_mm_s2[i]);
            share.jerk = share.jerk.max((r * v * v * v + 3.0 * k * v * a + t * j).abs() / limits.jerk_mm_s3[i]);
        }
    });
    shares
}
