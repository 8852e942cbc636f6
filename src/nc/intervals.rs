//! Which knot a Siemens block's `PL` sets, for reader and writer.
//!
//! No manual at hand says it; this follows the one open writer: a block's `PL` is the knot interval that ends
//! at its point. A curve of degree `p` with `n + 1` control points has `n - p + 1` intervals `u_{p+i} - u_{p+i-1}`; block `i`
//! carries interval `i`, for `i = 1 … n - p + 1`. The first block and the last `p - 1` blocks carry 0.

/// Index of the knot that ends the interval of block `block` (from 0) of a curve; none where the block carries 0.
pub(super) fn knot_of_block(degree: usize, points: usize, block: usize) -> Option<usize> {
    (1..=points.saturating_sub(degree)).contains(&block).then_some(degree + block)
}

/// The knots from 0 that the intervals of all blocks make.
pub(super) fn knots(degree: usize, intervals: &[f64]) -> Vec<f64> {
    let points = intervals.len();
    let mut knots = vec![0.0; points + degree + 1];
    let mut last = 0.0;
    for (block, interval) in intervals.iter().enumerate() {
        if let Some(knot) = knot_of_block(degree, points, block) {
            last += interval;
            knots[knot] = last;
        }
    }
    for knot in knots.iter_mut().skip(points) {
        *knot = last;
    }
    knots
}

/// Clamped uniform knots 0 … 0 1 2 3 … m … m: those that LinuxCNC makes for every curve.
pub(super) fn uniform_knots(degree: usize, points: usize) -> Vec<f64> {
    let last = points.saturating_sub(degree);
    (0..=points + degree).map(|i| i.saturating_sub(degree).min(last) as f64).collect()
}
