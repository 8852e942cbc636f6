//! Feedrate: time-dependent phases and the motion `s(t)` along a length.
//!
//! A [`Phase`] takes the feed from rest to the commanded feed; [`Motion`] strings acceleration, cruise and the mirrored
//! deceleration together along a path of a given length. [`LookAhead`] does so along a stream of pieces with
//! their own limits, and [`AxisLimited`] as fast as every axis of the machine can. [`FeedOverride`] runs any of them at another feed scale.
//! Feedrate `V` in mm/s, phase length `T` in s, `τ = t/T ∈ [0, 1]`.
//!
//! | profile | acceleration | source |
//! |---|---|---|
//! | [`Profile::Linear`], [`Profile::Cubic`], [`Profile::Quintic`] | Bernstein feed of degree 1, 3, 5 | Jahanpour et al., section 4 |
//! | [`Profile::Exponential`] | the quintic with end accelerations that depend on τ | the same, section 5 |
//! | [`Profile::JerkLimited`] | constant jerk, constant acceleration, constant jerk (seven phases in all) | textbook |
//! | [`AxisLimited`] | as fast as velocity, acceleration and jerk limits of every axis allow along the path | Verscheure et al. |

mod axis_limited;
mod bernstein;
mod error;
mod exponential;
mod feed_override;
mod jerk_limited;
mod look_ahead;
mod motion;
mod motion_sample;
mod n_c;
mod parameters;
mod phase;
mod planned;
mod span;
mod time_law;

pub use axis_limited::{AxisLimited, AxisLimitedPlan, AxisLimits, MAX_GRID_POINTS, PathShape};
pub use bernstein::{BernsteinPhase, FeedState};
pub use error::FeedrateError;
pub use exponential::{ExponentialPhase, N_C_RANGE};
pub use feed_override::{FeedOverride, MAX_OVERRIDE, MAX_OVERRIDE_STEPS, OverrideChange, OverrideStep};
pub use jerk_limited::JerkLimitedPhase;
pub use look_ahead::{LookAhead, MAX_LOOK_AHEAD, PathPiece};
pub use motion::{Motion, Profile};
pub use motion_sample::{MotionPeaks, MotionSample};
pub use n_c::{N_C_SEARCH_RANGE, optimize_n_c};
pub use phase::Phase;
pub use span::Span;

use error::bounded;
pub(crate) use error::positive;
pub(crate) use parameters::{AT, FEED, OF_EACH_AXIS, TRANSITION};
