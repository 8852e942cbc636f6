//! Limits of axes, how a path runs, and what a plan is asked to keep.

use crate::feedrate::parameters::{FEED, OF_EACH_AXIS, within};
use crate::feedrate::{FeedrateError, positive};
use crate::parameters::OutOfRange;

/// What every axis can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits<const D: usize> {
    /// Largest speed of each axis \[mm/s\].
    pub velocity_mm_s: [f64; D],
    /// Largest acceleration of each axis \[mm/s²\].
    pub acceleration_mm_s2: [f64; D],
    /// Largest jerk of each axis \[mm/s³\].
    pub jerk_mm_s3: [f64; D],
}

/// How a path runs at an arc length: its derivatives with respect to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathShape<const D: usize> {
    /// Unit tangent `x'`.
    pub tangent: [f64; D],
    /// Curvature vector `x''` \[1/mm\].
    pub curvature_1_mm: [f64; D],
    /// Its derivative `x'''` \[1/mm²\].
    pub curvature_rate_1_mm2: [f64; D],
}

/// The planner of motions under axis limits.
///
/// ```
/// use servosim::feedrate::{AxisLimited, AxisLimits, PathShape};
///
/// let limits = AxisLimits { velocity_mm_s: [200.0], acceleration_mm_s2: [2000.0], jerk_mm_s3: [50_000.0] };
/// let line = |_| PathShape { tangent: [1.0], curvature_1_mm: [0.0], curvature_rate_1_mm2: [0.0] };
/// let plan = AxisLimited::new(limits).plan(100.0, line)?;
/// // The seven phases: L/v + v/a + a/j = 0.64 s.
/// assert!((plan.motion.total_s() / 0.64 - 1.0).abs() < 0.005);
/// # Ok::<(), servosim::feedrate::FeedrateError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimited<const D: usize> {
    /// The limits, each between 1e-9 and 1e9.
    pub limits: AxisLimits<D>,
    /// Largest feed along the path, if there is one \[mm/s\].
    pub feed_mm_s: Option<f64>,
    /// Largest distance of the grid's points \[mm\]; none: chosen from the limits and the length. Where the path bends sharply, and
    /// at its ends, the points are closer.
    pub step_mm: Option<f64>,
}

impl<const D: usize> AxisLimited<D> {
    /// Limits without a feed limit.
    pub fn new(limits: AxisLimits<D>) -> Self {
        Self { limits, feed_mm_s: None, step_mm: None }
    }

    /// With a largest feed along the path \[mm/s\].
    #[must_use]
    pub fn with_feed(mut self, feed_mm_s: f64) -> Self {
        self.feed_mm_s = Some(feed_mm_s);
        self
    }

    pub(super) fn check(&self) -> Result<(), FeedrateError> {
        let AxisLimits { velocity_mm_s, acceleration_mm_s2, jerk_mm_s3 } = &self.limits;
        for (parameter, values) in OF_EACH_AXIS.iter().zip([velocity_mm_s, acceleration_mm_s2, jerk_mm_s3]) {
            values.iter().try_for_each(|&value| within(parameter, value).map(|_| ()))?;
        }
        if D == 0 {
            return Err(FeedrateError::OutOfRange(OutOfRange::new("axes", 0.0, "at least one")));
        }
        if let Some(feed) = self.feed_mm_s {
            within(&FEED, feed)?;
        }
        if let Some(step) = self.step_mm {
            positive("step_mm", step)?;
        }
        Ok(())
    }

    /// The smallest acceleration and jerk limit, the acceleration of all axes together, and the largest speed that a tangent along one axis may have.
    pub(super) fn scale(&self) -> Scale {
        let least = |values: &[f64; D]| values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.limits.velocity_mm_s.iter().copied().fold(0.0, f64::max);
        Scale {
            speed: self.feed_mm_s.map_or(most, |feed| feed.min(most)),
            accel: least(&self.limits.acceleration_mm_s2),
            accel_norm: self.limits.acceleration_mm_s2.iter().map(|a| a * a).sum::<f64>().sqrt(),
            jerk: least(&self.limits.jerk_mm_s3),
        }
    }
}

/// The size of things: what the grid and the start of the search are chosen by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    pub(super) speed: f64,
    pub(super) accel: f64,
    pub(super) accel_norm: f64,
    pub(super) jerk: f64,
}
