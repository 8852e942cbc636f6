//! How large the numbers of a program may be.

/// Largest coordinate magnitude in a program \[mm\]: that of a path.
pub const MAX_COORDINATE_MM: f64 = crate::path::MAX_COORDINATE_MM;

/// Largest feed in a program \[mm/min\].
pub const MAX_FEED_MM_MIN: f64 = 1e7;

/// Largest knot or knot interval in a program.
pub const MAX_KNOT: f64 = 1e9;

/// Longest dwell in a program \[s\].
pub const MAX_DWELL_S: f64 = 1e6;

/// Most control points of one curve: what a reader holds in memory at most.
pub const MAX_CONTROL_POINTS: usize = 1_000_000;

/// Highest degree of a curve.
pub const MAX_DEGREE: usize = 9;

/// How far the end of an arc may lie from the circle through its start, and the first point of a curve from the tool \[mm\].
///
/// Programs are commonly rounded to 0.001 mm, which moves three points of an arc by up to 0.0007 mm each.
pub const JOIN_TOLERANCE_MM: f64 = 0.005;
