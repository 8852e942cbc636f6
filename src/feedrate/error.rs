//! Why a motion could not be planned.

use crate::parameters::{OutOfRange, Range};

/// Why a motion could not be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FeedrateError {
    /// A value is out of its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The exponential modification is too strong for the feed: the tool would swing past the feed or move back.
    #[error(
        "n_c = {n_c} is too strong for a feed of {feed_mm_s} mm/s reached in {phase_s} s: the acceleration changes sign (it reaches {accel_mm_s2:.1} mm/s² while speeding up)"
    )]
    NotMonotone {
        /// Exponent.
        n_c: f64,
        /// Commanded feed \[mm/s\].
        feed_mm_s: f64,
        /// Phase length \[s\].
        phase_s: f64,
        /// The most negative acceleration of the acceleration phase \[mm/s²\].
        accel_mm_s2: f64,
    },
    /// A path's derivatives are not finite, or its tangent vanishes.
    #[error("the path has no finite derivatives, or no direction, at {s_mm} mm")]
    BadShape {
        /// Arc length \[mm\].
        s_mm: f64,
    },
    /// No speed keeps acceleration and jerk finite at a corner of the path, or where its curvature jumps.
    #[error(
        "the path turns by {turn_rad:.3e} rad and its curvature jumps by {curvature_1_mm:.3e} 1/mm at {s_mm} mm: no speed keeps the axes' acceleration and jerk limits there (smooth the path, or plan its parts one by one)"
    )]
    Corner {
        /// Arc length \[mm\].
        s_mm: f64,
        /// Turn within the shortest interval of the grid \[rad\].
        turn_rad: f64,
        /// Jump of the curvature \[1/mm\].
        curvature_1_mm: f64,
    },
    /// The steps of a feed override are not in the order of time.
    #[error(
        "the feed override changes at {at_s} s after a change at {before_s} s: its changes must be in the order of time"
    )]
    OverrideOrder {
        /// Which step, from 0.
        step: usize,
        /// When it begins \[s\].
        at_s: f64,
        /// When the one before begins \[s\].
        before_s: f64,
    },
    /// A feed hold that nothing ends.
    #[error("the feed hold at {at_s} s is never ended: the motion would not reach the end of its path")]
    HeldForEver {
        /// Which step, from 0.
        step: usize,
        /// When it begins \[s\].
        at_s: f64,
    },
}

/// `value` if it lies between 1e-9 and 1e9: quotients and powers of such values neither overflow nor vanish.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64, FeedrateError> {
    let range = Range::POSITIVE;
    if range.contains(value) { Ok(value) } else { Err(OutOfRange::new(name, value, range.to_string()).into()) }
}

/// `value` if it is finite and of a size that a motion can have.
pub(super) fn bounded(name: &'static str, value: f64) -> Result<f64, FeedrateError> {
    if value.abs() <= 1e18 {
        Ok(value)
    } else {
        Err(FeedrateError::OutOfRange(OutOfRange::new(name, value, "a finite number, at most 1e18 either side")))
    }
}
