//! What a run is held to, and what happens on the way that a person should hear of.

use crate::parameters::{Entry, Parameter, Parameters, Range, axis_name};
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::feedrate::{AxisLimits, OverrideChange};
use crate::servo::Lockup;

/// Limits that a run is held to; a missing one is not checked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Largest contouring error, either side \[µm\].
    pub contour_error_um: Option<f64>,
    /// Largest tracking error \[µm\].
    pub tracking_error_um: Option<f64>,
    /// Largest voltage of any axis, either sign \[V\].
    pub voltage_v: Option<f64>,
    /// Largest acceleration along the path \[mm/s²\]; of any axis where [`Limits::axes`] are set.
    pub accel_mm_s2: Option<f64>,
    /// Largest jerk along the path \[mm/s³\]; of any axis where [`Limits::axes`] are set.
    pub jerk_mm_s3: Option<f64>,
    /// The limits of X and Y that the feed is planned under: the commands are held to them to 0.1 %.
    pub axes: Option<AxisLimits<2>>,
}

/// What to do about a limit out of its range.
const UNCHECKED: &str = "remove the line if this is not to be checked";

impl Parameters for Limits {
    const ABOUT: &'static str = "Limits of the run; a missing one is not checked";
    const ENTRIES: &'static [Entry<Self>] = &[
        Entry {
            parameter: Parameter::new(
                "limits.contour_error_um",
                "µm",
                Range::ABOVE_ZERO,
                "Largest contouring error, either side of the path",
            )
            .otherwise("not checked")
            .logarithmic(1.0, 1000.0)
            .hint(UNCHECKED),
            get: |limits| limits.contour_error_um,
            set: |limits, value| {
                limits.contour_error_um = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.tracking_error_um",
                "µm",
                Range::ABOVE_ZERO,
                "Largest distance to the setpoint",
            )
            .otherwise("not checked")
            .logarithmic(1.0, 10000.0)
            .hint(UNCHECKED),
            get: |limits| limits.tracking_error_um,
            set: |limits, value| {
                limits.tracking_error_um = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.voltage_v",
                "V",
                Range::ABOVE_ZERO,
                "Largest voltage of any axis, either sign",
            )
            .otherwise("not checked")
            .logarithmic(0.5, 50.0)
            .hint(UNCHECKED),
            get: |limits| limits.voltage_v,
            set: |limits, value| {
                limits.voltage_v = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.accel_mm_s2",
                "mm/s²",
                Range::ABOVE_ZERO,
                "Largest acceleration along the path; of each axis if the feed is axis-limited",
            )
            .otherwise("not checked")
            .logarithmic(100.0, 1e5)
            .hint(UNCHECKED),
            get: |limits| limits.accel_mm_s2,
            set: |limits, value| {
                limits.accel_mm_s2 = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.jerk_mm_s3",
                "mm/s³",
                Range::ABOVE_ZERO,
                "Largest jerk along the path; of each axis if the feed is axis-limited",
            )
            .otherwise("not checked")
            .logarithmic(1e3, 1e7)
            .hint(UNCHECKED),
            get: |limits| limits.jerk_mm_s3,
            set: |limits, value| {
                limits.jerk_mm_s3 = Some(value);
                true
            },
        },
    ];
}

/// Share of a limit that a value may be above it: rounding breaks no limit. A feed of 100 mm/s reached in 0.05 s is an
/// acceleration of 2000.0000000000005 mm/s².
const ROUNDING: f64 = 1e-9;

/// Whether `value ≤ limit` (positive) but for rounding; not a number is not kept.
pub fn is_kept(value: f64, limit: f64) -> bool {
    value <= limit * (1.0 + ROUNDING)
}

/// Share of an axis' limit that a feed planned under it may be above it between the places where it was looked at.
const PLANNED: f64 = 1e-3;

/// What the limits of the axes are called.
const AXIS_LIMITS: [[&str; 3]; 2] =
    [["x.velocity_mm_s", "x.accel_mm_s2", "x.jerk_mm_s3"], ["y.velocity_mm_s", "y.accel_mm_s2", "y.jerk_mm_s3"]];

/// One limit held against what a run reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitCheck {
    /// Key of the limit, with its unit.
    pub name: String,
    /// The largest value that the run reached; null in JSON where it is infinite.
    #[serde(serialize_with = "finite_or_null", deserialize_with = "null_is_infinite")]
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// Whether `value ≤ limit`, see [`is_kept`].
    pub kept: bool,
}

/// JSON knows no infinity: it is written as null.
///
/// # Errors
/// Those of the serializer.
#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature
pub(crate) fn finite_or_null<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_f64(*value) } else { serializer.serialize_none() }
}

/// The way back from [`finite_or_null`].
pub(crate) fn null_is_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// Peaks that limits are held against.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peaks {
    /// See [`Limits::contour_error_um`].
    pub contour_error_um: f64,
    /// See [`Limits::tracking_error_um`].
    pub tracking_error_um: f64,
    /// See [`Limits::voltage_v`].
    pub voltage_v: f64,
    /// See [`Limits::accel_mm_s2`].
    pub accel_mm_s2: f64,
    /// See [`Limits::jerk_mm_s3`].
    pub jerk_mm_s3: f64,
    /// Commanded velocity \[mm/s\], acceleration \[mm/s²\] and jerk \[mm/s³\] of X and of Y.
    pub axes: [[f64; 3]; 2],
}

/// A limit that is set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    pub(crate) name: &'static str,
    pub(crate) value: f64,
    pub(crate) limit: f64,
    pub(crate) kept: bool,
}

impl Limits {
    /// How many limits there are.
    pub(crate) const COUNT: usize = 11;

    /// Holds every limit against `peaks`; none for those that are not set.
    pub(crate) fn held(&self, peaks: &Peaks) -> [Option<Held>; Self::COUNT] {
        let most = |k: usize| peaks.axes[0][k].max(peaks.axes[1][k]);
        let along = [
            ("contour_error_um", peaks.contour_error_um, self.contour_error_um),
            ("tracking_error_um", peaks.tracking_error_um, self.tracking_error_um),
            ("voltage_v", peaks.voltage_v, self.voltage_v),
            // A feed that is planned axis by axis knows no limits along the path: two axes together are faster than one.
            ("accel_mm_s2", if self.axes.is_some() { most(1) } else { peaks.accel_mm_s2 }, self.accel_mm_s2),
            ("jerk_mm_s3", if self.axes.is_some() { most(2) } else { peaks.jerk_mm_s3 }, self.jerk_mm_s3),
        ];
        let mut all = [None; Self::COUNT];
        for (i, (held, (name, value, limit))) in all.iter_mut().zip(along).enumerate() {
            let slack = if i >= 3 && self.axes.is_some() { 1.0 + PLANNED } else { 1.0 };
            *held = limit.map(|limit| Held { name, value, limit, kept: is_kept(value, limit * slack) });
        }
        if let Some(axes) = &self.axes {
            for axis in 0..2 {
                let limits = [axes.velocity_mm_s[axis], axes.acceleration_mm_s2[axis], axes.jerk_mm_s3[axis]];
                for (k, limit) in limits.into_iter().enumerate() {
                    let value = peaks.axes[axis][k];
                    let kept = is_kept(value, limit * (1.0 + PLANNED));
                    all[5 + 3 * axis + k] = Some(Held { name: AXIS_LIMITS[axis][k], value, limit, kept });
                }
            }
        }
        all
    }
    /// Holds every limit that is set against `peaks`.
    pub fn check(&self, peaks: &Peaks) -> Vec<LimitCheck> {
        let check = |Held { name, value, limit, kept }| LimitCheck { name: name.to_owned(), value, limit, kept };
        self.held(peaks).into_iter().flatten().map(check).collect()
    }
}

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
