//! Why a program could not be written.

use std::io;

use super::fixed::MAX_DECIMALS;
use super::writing::Decimals;
use crate::nc::{Dialect, JOIN_TOLERANCE_MM, MAX_COORDINATE_MM, MAX_DWELL_S, MAX_FEED_MM_MIN, NurbsFault};

/// Why a program could not be written. Blocks are counted from 0; nothing of the block that is named has been written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// Writing failed.
    #[error("cannot write the program: {0}")]
    Write(#[from] io::Error),
    /// A block does not begin where the one before ends.
    #[error(
        "block {index} begins {gap_mm:.4} mm from where the tool is: blocks must join within {JOIN_TOLERANCE_MM} mm; put a rapid motion between"
    )]
    NotConnected {
        /// Which block.
        index: usize,
        /// The gap \[mm\].
        gap_mm: f64,
    },
    /// A motion at the feed has none, or one that is out of range.
    #[error("block {index} moves at the feed, but its feed is {}: give one of 0.001 to {MAX_FEED_MM_MIN} mm/min", shown(*feed_mm_min))]
    Feed {
        /// Which block.
        index: usize,
        /// The feed \[mm/min\].
        feed_mm_min: Option<f64>,
    },
    /// A coordinate is not a number or too large.
    #[error("coordinate {value} mm of block {index} is not within ±{MAX_COORDINATE_MM} mm")]
    Coordinate {
        /// Which block.
        index: usize,
        /// The coordinate.
        value: f64,
    },
    /// The ends of an arc do not lie on its circle.
    #[error(
        "the arc of block {index} does not go through both its ends (within {JOIN_TOLERANCE_MM} mm): check its centre"
    )]
    Arc {
        /// Which block.
        index: usize,
    },
    /// A curve is none.
    #[error("the curve of block {index} cannot be written: {fault}")]
    Curve {
        /// Which block.
        index: usize,
        /// What is wrong with it.
        fault: NurbsFault,
    },
    /// The dialect has no curves of that degree.
    #[error(
        "the curve of block {index} has degree {degree}: {} takes {} to {}; raise or lower its degree, or write another dialect",
        dialect.name(), dialect.degrees().start(), dialect.degrees().end()
    )]
    Degree {
        /// Which block.
        index: usize,
        /// Its degree.
        degree: usize,
        /// The dialect.
        dialect: Dialect,
    },
    /// A weight is larger than the dialect takes.
    #[error(
        "the curve of block {index} has a weight of {weight}: {} takes at most {}; divide all weights of the curve by the same number",
        dialect.name(), dialect.max_weight()
    )]
    Weight {
        /// Which block.
        index: usize,
        /// The weight.
        weight: f64,
        /// The dialect.
        dialect: Dialect,
    },
    /// LinuxCNC spaces knots evenly.
    #[error(
        "the knots of the curve of block {index} are not uniform: LinuxCNC (G5.2) spaces them evenly; fit with uniform knots, write straight blocks, or another dialect"
    )]
    NotUniform {
        /// Which block.
        index: usize,
    },
    /// LinuxCNC's curves lie in the plane.
    #[error(
        "the curve of block {index} leaves the plane XY at control point {point} (counted from 0): LinuxCNC (G5.2) has planar curves only; write straight blocks or another dialect"
    )]
    NotPlanar {
        /// Which block.
        index: usize,
        /// The first control point with another Z.
        point: usize,
    },
    /// Rounding moves the tool by more than the tolerance.
    #[error(
        "rounding may move the tool by {error_mm:.3e} mm in block {index}, more than the tolerance of {tolerance_mm} mm: write more decimals than {} (coordinates), {} (weights), {} (knots), at most {MAX_DECIMALS}",
        decimals.coordinate, decimals.weight, decimals.knot
    )]
    Rounding {
        /// Which block.
        index: usize,
        /// The bound of the error \[mm\]; infinite where rounding makes another motion of it.
        error_mm: f64,
        /// The tolerance \[mm\].
        tolerance_mm: f64,
        /// The decimals.
        decimals: Decimals,
    },
    /// Words that are not what they claim to be.
    #[error("block {index} cannot be written: `{text}` {why}")]
    Words {
        /// Which block.
        index: usize,
        /// The words.
        text: String,
        /// What is wrong with them.
        why: &'static str,
    },
    /// A dwell is not a time.
    #[error("the dwell of block {index} is {time_s} s: give 0 to {} s", MAX_DWELL_S)]
    Dwell {
        /// Which block.
        index: usize,
        /// The time \[s\].
        time_s: f64,
    },
    /// Something follows the program's end.
    #[error("block {index} follows the end of the program (M30, M2 or M17): remove one of them")]
    Ended {
        /// Which block.
        index: usize,
    },
}

fn shown(feed_mm_min: Option<f64>) -> String {
    feed_mm_min.map_or_else(|| "not given".to_owned(), |feed| format!("{feed} mm/min"))
}
