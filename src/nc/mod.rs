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
//! - No manual at hand says which knot a block's `PL` sets. Reader and writer follow the one open writer: the knot interval
//!   that ends at the block's point; first block 0, the last `degree - 1` blocks 0. The rule is in one place
//!   (`nc/intervals.rs`).
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
mod dialect;
mod intervals;
mod limits;
mod program;
mod read;
mod write;

pub use arc::{Arc, Plane};
pub use block::{Action, Block, Nurbs, NurbsFault};
pub use dialect::Dialect;
pub use limits::{
    JOIN_TOLERANCE_MM, MAX_CONTROL_POINTS, MAX_COORDINATE_MM, MAX_DEGREE, MAX_DWELL_S, MAX_FEED_MM_MIN, MAX_KNOT,
};
pub use program::Program;
pub use read::{MAX_LINE_BYTES, NcError, Reader, Reading, SyntaxError};
pub use write::{Decimals, MAX_DECIMALS, WriteError, Writer, Writing, Written};
