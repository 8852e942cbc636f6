//! The limits of a run, and how a run is checked against them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::feedrate::AxisLimits;
use crate::parameters::{Entry, Parameter, Parameters, Range};

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
    /// Largest magnitude of the acceleration vector of the setpoints `a t + v² k` \[mm/s²\].
    pub vector_accel_mm_s2: Option<f64>,
    /// Largest magnitude of the jerk vector of the setpoints `j t + 3 v a k + v³ k'` \[mm/s³\].
    pub vector_jerk_mm_s3: Option<f64>,
    /// Largest acceleration of the setpoints of any axis, either sign \[mm/s²\].
    pub axis_accel_mm_s2: Option<f64>,
    /// Largest jerk of the setpoints of any axis, either sign \[mm/s³\].
    pub axis_jerk_mm_s3: Option<f64>,
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
        Entry {
            parameter: Parameter::new(
                "limits.vector_accel_mm_s2",
                "mm/s²",
                Range::ABOVE_ZERO,
                "Largest acceleration vector of the setpoints, curvature included",
            )
            .otherwise("not checked")
            .logarithmic(100.0, 1e5)
            .hint(UNCHECKED),
            get: |limits| limits.vector_accel_mm_s2,
            set: |limits, value| {
                limits.vector_accel_mm_s2 = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.vector_jerk_mm_s3",
                "mm/s³",
                Range::ABOVE_ZERO,
                "Largest jerk vector of the setpoints, curvature included",
            )
            .otherwise("not checked")
            .logarithmic(1e3, 1e7)
            .hint(UNCHECKED),
            get: |limits| limits.vector_jerk_mm_s3,
            set: |limits, value| {
                limits.vector_jerk_mm_s3 = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.axis_accel_mm_s2",
                "mm/s²",
                Range::ABOVE_ZERO,
                "Largest acceleration of any axis, of the setpoints",
            )
            .otherwise("not checked")
            .logarithmic(100.0, 1e5)
            .hint(UNCHECKED),
            get: |limits| limits.axis_accel_mm_s2,
            set: |limits, value| {
                limits.axis_accel_mm_s2 = Some(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "limits.axis_jerk_mm_s3",
                "mm/s³",
                Range::ABOVE_ZERO,
                "Largest jerk of any axis, of the setpoints",
            )
            .otherwise("not checked")
            .logarithmic(1e3, 1e7)
            .hint(UNCHECKED),
            get: |limits| limits.axis_jerk_mm_s3,
            set: |limits, value| {
                limits.axis_jerk_mm_s3 = Some(value);
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

/// Share of a limit that a motion planned under it (axis by axis, or a change of the feed override under the peaks of the plan) may be
/// above it between the places where it was looked at.
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
    /// See [`Limits::vector_accel_mm_s2`].
    pub vector_accel_mm_s2: f64,
    /// See [`Limits::vector_jerk_mm_s3`].
    pub vector_jerk_mm_s3: f64,
    /// Commanded velocity \[mm/s\], acceleration \[mm/s²\] and jerk \[mm/s³\] of X, of Y and, where there is one, of Z.
    pub axes: [[f64; 3]; 3],
    /// Whether the feed override changes on the way: its changes keep the peaks of the plan to 0.1 %, and so do the checks.
    pub overridden: bool,
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
    pub(crate) const COUNT: usize = 15;

    /// Holds every limit against `peaks`; none for those that are not set.
    pub(crate) fn held(&self, peaks: &Peaks) -> [Option<Held>; Self::COUNT] {
        let most = |k: usize| peaks.axes.iter().map(|axis| axis[k]).fold(0.0, f64::max);
        let planned = self.axes.is_some() || peaks.overridden;
        let along = [
            ("contour_error_um", peaks.contour_error_um, self.contour_error_um),
            ("tracking_error_um", peaks.tracking_error_um, self.tracking_error_um),
            ("voltage_v", peaks.voltage_v, self.voltage_v),
            // A feed that is planned axis by axis knows no limits along the path: two axes together are faster than one.
            ("accel_mm_s2", if self.axes.is_some() { most(1) } else { peaks.accel_mm_s2 }, self.accel_mm_s2),
            ("jerk_mm_s3", if self.axes.is_some() { most(2) } else { peaks.jerk_mm_s3 }, self.jerk_mm_s3),
            ("vector_accel_mm_s2", peaks.vector_accel_mm_s2, self.vector_accel_mm_s2),
            ("vector_jerk_mm_s3", peaks.vector_jerk_mm_s3, self.vector_jerk_mm_s3),
            ("axis_accel_mm_s2", most(1), self.axis_accel_mm_s2),
            ("axis_jerk_mm_s3", most(2), self.axis_jerk_mm_s3),
        ];
        let scalars = along.len();
        let mut all = [None; Self::COUNT];
        for (i, (held, (name, value, limit))) in all.iter_mut().zip(along).enumerate() {
            let slack = if i >= 3 && planned { 1.0 + PLANNED } else { 1.0 };
            *held = limit.map(|limit| Held { name, value, limit, kept: is_kept(value, limit * slack) });
        }
        if let Some(axes) = &self.axes {
            for axis in 0..2 {
                let limits = [axes.velocity_mm_s[axis], axes.acceleration_mm_s2[axis], axes.jerk_mm_s3[axis]];
                for (k, limit) in limits.into_iter().enumerate() {
                    let value = peaks.axes[axis][k];
                    let kept = is_kept(value, limit * (1.0 + PLANNED));
                    all[scalars + 3 * axis + k] = Some(Held { name: AXIS_LIMITS[axis][k], value, limit, kept });
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
