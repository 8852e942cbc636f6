//! How a scenario's feed is reached and left.

use crate::feedrate::{AxisLimited, AxisLimits, FeedrateError, Motion, Profile};
use crate::interpolator::plan_under_axis_limits;
use crate::path::Path;

/// How a scenario's feed is reached and left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FeedProfile {
    /// In a phase of its own, the same wherever the path bends.
    Phases(Profile),
    /// As fast as X and Y can along the path.
    AxisLimited(AxisLimits<2>),
}

impl FeedProfile {
    /// The motion along a path at a feed \[mm/s\].
    ///
    /// # Errors
    /// Those of [`Motion::plan`] and [`AxisLimited::plan`].
    pub fn motion(&self, path: &dyn Path<2>, feed_mm_s: f64) -> Result<Motion, FeedrateError> {
        match *self {
            Self::Phases(profile) => Motion::plan(path.length_mm(), feed_mm_s, profile),
            Self::AxisLimited(limits) => {
                Ok(plan_under_axis_limits(&AxisLimited::new(limits).with_feed(feed_mm_s), path)?.motion)
            }
        }
    }
}
