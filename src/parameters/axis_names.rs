//! Names of the axes.

/// Names of the axes, in the order of the path's coordinates.
pub const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

/// The name of an axis, counted from 0; `?` beyond the last.
pub fn axis_name(axis: usize) -> &'static str {
    AXIS_NAMES.get(axis).copied().unwrap_or("?")
}

/// The name of an axis in capitals, as titles and sentences have it: `X`; `?` beyond the last.
pub fn axis_title(axis: usize) -> String {
    axis_name(axis).to_uppercase()
}
