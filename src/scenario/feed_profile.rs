//! How a scenario's feed is reached and left.

use crate::feedrate::{AxisLimited, AxisLimits, FeedOverride, FeedrateError, Motion, PathShape, Profile};
use crate::interpolator::plan_under_axis_limits;
use crate::path::{Cursor, Path};

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
    /// A motion of this profile under a feed override that keeps its limits.
    ///
    /// # Errors
    /// Those of [`Motion::with_override`].
    pub fn with_override(
        &self,
        plan: &Motion,
        path: &dyn Path<2>,
        how: &FeedOverride,
    ) -> Result<Motion, FeedrateError> {
        match *self {
            Self::Phases(_) => plan.with_override(how),
            Self::AxisLimited(limits) => {
                let mut cursor = Cursor::default();
                let shape = |s_mm| PathShape::from(&path.frame(s_mm, &mut cursor));
                AxisLimited::new(limits).with_override(plan, how, shape)
            }
        }
    }
}
