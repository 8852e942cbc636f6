//! How a program is read.

use crate::nc::Dialect;

/// How a program is read.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading {
    /// Whose language it is, where that is known. It only decides what differs: the unit of `G4 P` without a decimal point
    /// (LinuxCNC: s, Fanuc: ms), which is an error where it is not known.
    pub dialect: Option<Dialect>,
    /// Where the tool is before the program \[mm\]. Where it is not known, each axis is taken to be where rapid motion first puts
    /// it (0 where it does not), and to move an axis at the feed before it has been given a place is an error.
    pub start_mm: Option<[f64; 3]>,
    /// Whether blocks that begin with `/` are left out.
    pub skip_deleted: bool,
    /// Whether Siemens curves without `PL` are read with uniform knots. The control spaces them in its own way, which is not
    /// known: else they are an error.
    pub uniform_knots: bool,
}
