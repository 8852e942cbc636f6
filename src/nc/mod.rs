//! NC programs: written, and read back.
//!
//! A program is a stream of [`Block`]s. [`Reader`] makes them from text line by line, so that memory does not grow with the
//! program; [`Writer`] makes text from them in one of the [`Dialect`]s. What is written is read back to the same blocks, and
//! written again it is the same bytes.
//!
//! | dialect | NURBS curve | limits |
//! |---|---|---|
//! | [`Dialect::Siemens`] | `BSPLINE SD=3`, then `X Y Z PW= PL=` a control point | degree 2 or 3, weights above 0 to 3 |
//! | [`Dialect::Fanuc`] (and Mitsubishi) | `G06.2 P4 K X Y Z R`, then `P` blocks with `K` only | degree 1 to 3, weights above 0 to 99.9999 |
//! | [`Dialect::LinuxCnc`] | `G5.2 P L4`, `X Y P` …, `G5.3` | plane XY, uniform knots, degree 2 to 9 |
//!
//! # Conventions
//! - Positions are those of the tool tip in the part's coordinates \[mm\]; inches are converted. Feeds are mm/min, as `F` says them.
//! - Knots are in millimetres of chord, from 0 ([`Nurbs::rescaled`]). A curve does not change under `u → a u + b`, so a
//!   curve read back has its knots up to such a map.
//! - Which knot a block's `PL` sets no manual in reach tells. Taken is the reading of the one open writer: the knot interval
//!   that ends at the block's point; first block 0, the last `degree - 1` blocks 0. It stands in one place
//!   (`nc/intervals.rs`), for reader and writer.
//!
//! # What is written
//! Coordinates in millimetres (`G90`, `G21` or `G71`, `G17`), with stated [`Decimals`]. What rounding them moves is bounded over
//! the whole of each motion, returned, and kept within a tolerance ([`Writing::tolerance_mm`]); [`Decimals::choose`] takes
//! the fewest decimals that keep it. A first motion that is not a rapid one gets a rapid one to its start.
//!
//! # What is read
//! Besides the curves above: `G00 G01 G02 G03` (`I J K` from the start point, or `R`, or `CR=`; full circles, helices, in
//! the planes `G17 G18 G19`), `G04`, `G20 G21 G70 G71 G700 G710`, `G90 G91`, `G94`, `F`, comments `( )` and `;`, block
//! numbers, `%`, `/`, and the words that move nothing (`M S T H D` and codes such as `G40 G54 G64 G642`), which are kept.
//! Small and capital letters, spaces between a letter and its number, and every form of a decimal number are accepted.
//!
//! Not read, and named with their place: variables and expressions, subprograms, canned cycles, cutter compensation,
//! changes of the coordinate system, machine coordinates, rotary axes, several turns in one arc, arc centres in absolute
//! coordinates, feed per revolution and inverse-time feed, splines through points (`ASPLINE`, `CSPLINE`, `G5`). A motion is never guessed.

mod arc;
mod block;
mod block_words;
mod curve;
mod curve_blocks;
mod error;
mod fixed;
mod g_codes;
mod initial_position;
mod intervals;
mod lines;
mod modal_state;
mod plan;
mod reader;
mod rounding;
mod words;
mod writer;

pub use arc::{Arc, Plane};
pub use block::{Action, Block, Nurbs, NurbsFault};
pub use error::{NcError, SyntaxError, WriteError};
pub use fixed::MAX_DECIMALS;
pub use lines::MAX_LINE_BYTES;
pub use plan::Decimals;
pub use reader::{Reader, Reading};
pub use writer::{Writer, Writing, Written};

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

/// Whose language a program is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// Siemens 840D.
    Siemens,
    /// Fanuc 15i/30i and Mitsubishi.
    Fanuc,
    /// LinuxCNC.
    LinuxCnc,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Siemens, Self::Fanuc, Self::LinuxCnc];

    /// Its name as a person knows it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Siemens => "Siemens 840D",
            Self::Fanuc => "Fanuc",
            Self::LinuxCnc => "LinuxCNC",
        }
    }

    /// Largest weight of a control point; all are above 0.
    pub fn max_weight(self) -> f64 {
        match self {
            Self::Siemens => 3.0,
            Self::Fanuc => 99.9999,
            Self::LinuxCnc => 1e6,
        }
    }

    /// Degrees that its curves can have.
    pub fn degrees(self) -> std::ops::RangeInclusive<usize> {
        match self {
            Self::Siemens => 2..=3,
            Self::Fanuc => 1..=3,
            Self::LinuxCnc => 2..=MAX_DEGREE,
        }
    }
}

/// A whole program in memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Program {
    /// Its blocks, in order.
    pub blocks: Vec<Block>,
}

impl Program {
    /// Reads a program from text; `origin` is what messages call it.
    ///
    /// # Errors
    /// See [`Reader`].
    pub fn read(text: &str, origin: &str) -> Result<Self, NcError> {
        let blocks = Reader::new(text.as_bytes(), origin, Reading::default()).collect::<Result<_, _>>()?;
        Ok(Self { blocks })
    }

    /// Writes the program; see [`Writer`].
    ///
    /// # Errors
    /// See [`Writer::write`].
    pub fn write(&self, out: impl std::io::Write, writing: Writing) -> Result<Written, WriteError> {
        let mut writer = Writer::new(out, writing)?;
        for block in &self.blocks {
            writer.write(block)?;
        }
        writer.finish()
    }
}
