//! A motion as an override sees it.

use super::{MotionPeaks, MotionSample};

/// A motion `s(t)` from rest to rest (a time law).
pub(super) trait TimeLaw {
    /// Whole time \[s\].
    fn total_s(&self) -> f64;

    /// Length of the path \[mm\].
    fn length_mm(&self) -> f64;

    /// The motion at a time \[s\]; at rest before 0 and after the end.
    fn at(&self, t_s: f64) -> MotionSample;

    /// Largest feed, acceleration and jerk.
    fn peaks(&self) -> MotionPeaks;

    /// From when to when the feed is steady; none where the motion has no cruise.
    fn steady_s(&self) -> Option<(f64, f64)>;

    /// The first time after this one at which the jerk may jump.
    fn next_knot(&self, t_s: f64) -> f64;
}
