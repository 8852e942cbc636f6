//! Feed override and feed hold: a planned motion at a changing feed scale.

mod feed_scale;
mod overridden;
mod planned_motion;
mod planner;
mod steps;

pub(super) use overridden::Overridden;
pub(super) use planned_motion::{AxisDerivatives, Bounds};
pub use steps::{FeedOverride, MAX_OVERRIDE, MAX_OVERRIDE_STEPS, OverrideChange, OverrideStep};
