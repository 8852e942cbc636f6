//! The languages that programs are in.

use super::limits::MAX_DEGREE;

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
