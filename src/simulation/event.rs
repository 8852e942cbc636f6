//! Events of a run: what a person should hear of.

use std::fmt;

use crate::feedrate::OverrideChange;
use crate::parameters::axis_name;
use crate::servo::Lockup;

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing.
    Info,
    /// Worth a look.
    Warning,
    /// The run is not what was asked for.
    Error,
}

/// Something that happened during a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// An axis' voltage reached its limit.
    SaturationBegan {
        /// Axis, from 0.
        axis: usize,
        /// When \[s\].
        time_s: f64,
    },
    /// It came back.
    SaturationEnded {
        /// Axis, from 0.
        axis: usize,
        /// When \[s\].
        time_s: f64,
        /// For how long it had been saturated \[s\].
        lasted_s: f64,
    },
    /// A limit was passed for the first time.
    LimitPassed {
        /// Key of the limit, with its unit.
        name: &'static str,
        /// The value that passed it.
        value: f64,
        /// The limit.
        limit: f64,
        /// When \[s\].
        time_s: f64,
    },
    /// An axis saturated and does not recover.
    LockedUp {
        /// Axis, from 0.
        axis: usize,
        /// What was found.
        lockup: Lockup,
    },
    /// The feed override begins to change.
    OverrideChanged {
        /// To what, and what comes of it.
        change: OverrideChange,
        /// When \[s\].
        time_s: f64,
    },
    /// The user stopped the run.
    Interrupted {
        /// After this sample \[s\].
        time_s: f64,
    },
}

impl Event {
    /// When it happened \[s\].
    pub fn time_s(&self) -> f64 {
        match self {
            Self::SaturationBegan { time_s, .. }
            | Self::SaturationEnded { time_s, .. }
            | Self::LimitPassed { time_s, .. }
            | Self::OverrideChanged { time_s, .. }
            | Self::Interrupted { time_s } => *time_s,
            Self::LockedUp { lockup, .. } => lockup.time_s,
        }
    }

    /// How much it matters.
    pub fn severity(&self) -> Severity {
        match self {
            Self::SaturationEnded { .. } | Self::OverrideChanged { .. } => Severity::Info,
            Self::SaturationBegan { .. } | Self::LimitPassed { .. } | Self::Interrupted { .. } => Severity::Warning,
            Self::LockedUp { .. } => Severity::Error,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |axis: usize| axis_name(axis);
        match self {
            Self::SaturationBegan { axis, .. } => write!(f, "axis {}: saturation began", name(*axis)),
            Self::SaturationEnded { axis, lasted_s, .. } => {
                write!(f, "axis {}: saturation ended after {:.1} ms", name(*axis), 1e3 * lasted_s)
            }
            Self::LimitPassed { name, value, limit, .. } => write!(f, "limit {name} = {limit} passed: {value:.4}"),
            Self::LockedUp { axis, lockup } => write!(
                f,
                "axis {} locked up: saturating since {:.3} s and not recovering, {:.3} mm behind ({})",
                name(*axis),
                lockup.since_s,
                lockup.error_mm,
                lockup.kind
            ),
            Self::OverrideChanged { change, .. } => {
                let &OverrideChange { ratio, asked_s, transition_s, reached, after_the_end, .. } = change;
                let what =
                    if ratio > 0.0 { format!("feed override: {} %", 100.0 * ratio) } else { "feed hold".to_owned() };
                if after_the_end {
                    return write!(f, "{what}, after the end of the motion: no effect");
                }
                write!(f, "{what}{} within {transition_s:.4} s", if ratio > 0.0 { "" } else { ": at rest" })?;
                if reached != ratio {
                    write!(f, ", cut off at {:.1} %", 100.0 * reached)?;
                } else if asked_s > 0.0 && transition_s > 1.001 * asked_s {
                    write!(f, " ({asked_s} s was asked for: the limits need longer)")?;
                }
                Ok(())
            }
            Self::Interrupted { .. } => f.write_str("interrupted by the user"),
        }
    }
}
