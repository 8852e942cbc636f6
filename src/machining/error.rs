//! Why a program cannot be run.

use crate::feedrate::FeedrateError;
use crate::nc::{JOIN_TOLERANCE_MM, MAX_COORDINATE_MM, MAX_DWELL_S, MAX_FEED_MM_MIN, NcError, NurbsFault};
use crate::parameters::OutOfRange;
use crate::path::{NurbsError, PathError};
use crate::simulation::SimulationError;

/// Why a program could not be run to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] NcError),
    /// A block is no motion that a machine can make.
    #[error("line {line}: {fault}")]
    Motion {
        /// The block's line, from 1; 0 where it comes from no text.
        line: usize,
        /// What is wrong with it.
        fault: MotionFault,
    },
    /// A limit of the machine is out of range.
    #[error(transparent)]
    Machine(OutOfRange),
    /// The simulation failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// What is wrong with a block.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionFault {
    /// No feed is in force, or none that is a feed.
    #[error(
        "it moves at the feed, but its feed is {}: give one above 0, at most {MAX_FEED_MM_MIN} mm/min (F)",
        feed_mm_min.map_or_else(|| "not given".to_owned(), |feed| format!("{feed} mm/min"))
    )]
    Feed {
        /// The feed \[mm/min\].
        feed_mm_min: Option<f64>,
    },
    /// A coordinate is not a number or too large.
    #[error("coordinate {value} mm is not within ±{MAX_COORDINATE_MM} mm")]
    Coordinate {
        /// The coordinate.
        value: f64,
    },
    /// It does not begin where the tool is.
    #[error("it begins {gap_mm:.4} mm from where the tool is: blocks must join within {JOIN_TOLERANCE_MM} mm")]
    NotConnected {
        /// The gap \[mm\].
        gap_mm: f64,
    },
    /// A dwell is not a time.
    #[error("a dwell of {time_s} s is not between 0 and {MAX_DWELL_S} s")]
    Dwell {
        /// The time \[s\].
        time_s: f64,
    },
    /// Its curve is none.
    #[error("its curve cannot be run: {0}")]
    Nurbs(#[from] NurbsFault),
    /// Its curve cannot be evaluated.
    #[error("its curve cannot be run: {0}")]
    Curve(#[from] NurbsError),
    /// Its path cannot be run by arc length.
    #[error("its path cannot be run: {0}")]
    Path(#[from] PathError),
    /// Its motion cannot be planned.
    #[error("its motion cannot be planned: {0}")]
    Feedrate(#[from] FeedrateError),
}
