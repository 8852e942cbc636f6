//! How a program is written.

use crate::nc::Dialect;

/// How many decimals the numbers of a program have, each 0 to [`MAX_DECIMALS`](crate::nc::MAX_DECIMALS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimals {
    /// Of `X Y Z I J K`.
    pub coordinate: u8,
    /// Of weights. A Siemens control takes 4, Mitsubishi too.
    pub weight: u8,
    /// Of knots and intervals. Mitsubishi takes 4.
    pub knot: u8,
}

impl Default for Decimals {
    /// Micrometres; weights to 0.0001, as controls state them.
    fn default() -> Self {
        Self { coordinate: 3, weight: 4, knot: 3 }
    }
}

impl From<u8> for Decimals {
    /// The same for all.
    fn from(decimals: u8) -> Self {
        Self { coordinate: decimals, weight: decimals, knot: decimals }
    }
}

/// How a program is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Writing {
    /// In whose language.
    pub dialect: Dialect,
    /// With how many decimals.
    pub decimals: Decimals,
    /// By how much rounding may move the tool \[mm\], above 0.
    pub tolerance_mm: f64,
    /// By how much block numbers (`N`) grow from line to line; none without block numbers.
    pub number_step: Option<u32>,
}

impl Writing {
    /// The default decimals, a tolerance of 0.001 mm, no block numbers.
    pub fn new(dialect: Dialect) -> Self {
        Self { dialect, decimals: Decimals::default(), tolerance_mm: 1e-3, number_step: None }
    }
}
