//! NC programs: from a tool path to a program, and through the machine: from blocks to motion, and through the same closed loop
//! as any other path.
//!
//! | step | what does it |
//! |---|---|
//! | a block to a curve in space that knows its arc length | [`Shape`], [`MotionReader`] |
//! | how fast it may be run | [`Machine`]: rapid feed, acceleration, jerk, lateral acceleration, velocity step at corners |
//! | when | [`LookAhead`](crate::feedrate::LookAhead) |
//! | statistics of a program, without simulating it | [`ProgramStatistics`] |
//! | a tool path to blocks | [`program`] |
//! | one control period after another | [`ProgramRun`], a stream of [`ProgramPeriod`]s |
//! | the resulting part | [`HeightField`], [`DeviationMap`]; of a program or a run: [`Inspection`] |
//!
//! # Conventions
//! - Rapid motion (`G00`) is a straight line at the rapid feed along it, all axes together; a control may move each axis at its own speed.
//! - Between rapid motion and motion at the feed, and at a dwell, the machine stops. Spindle, coolant and other words that move
//!   nothing take no time.
//! - Blocks join exactly: each begins where the one before ends, also where a program's rounding leaves up to
//!   [`JOIN_TOLERANCE_MM`](crate::nc::JOIN_TOLERANCE_MM) between them. Motions shorter than 1e-6 mm are skipped.
//! - Memory does not grow with the program: blocks are read as they are needed.

mod deviation;
mod deviation_metrics;
mod error;
mod feed;
mod height_field;
mod height_field_sweep;
mod inspection;
mod machine;
mod motion_buffer;
mod part_metrics;
mod program_statistics;
mod program_text;
mod run;
mod shape;
mod stream;

pub use deviation::{DeviationMap, MapRegion};
pub use deviation_metrics::{DeviationMetrics, DeviationPlace};
pub use error::{MotionFault, ProgramError};
pub use height_field::{HeightField, HeightFieldError, MAX_CELLS};
pub use inspection::{CHORD_ERROR_MM, Inspection, InspectionError, MachinedPart};
pub use machine::Machine;
pub use part_metrics::PartMetrics;
pub use program_statistics::{BlockCounts, MAX_DRAWN_POINTS, ProgramStatistics};
pub use program_text::{Blocks, Feeds, program};
pub use run::{ProgramPeriod, ProgramRun};
pub use shape::{Motion, MotionReader, Shape};
