//! The scenario file as written: one type a table, a span on every value that is checked later.
//!
//! The doc comments here are the descriptions in the JSON schema (`servosim schema`), which editors show; numbers without one are
//! described by their [`Parameter`](crate::parameters::Parameter).

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};
use serde_json::Value;
use toml::Spanned;

use super::drive_file::{RawCompensation, RawController, RawEffects};
use super::number_table::NumberTable;
use super::numbers::RawPoint;
use super::schema::describe_all;
use crate::limits::Limits;
use crate::servo::compensation::CrossCouplingGains;
use crate::servo::{Drive, Mechanics, Pdff, Plant};

/// A closed-loop servo simulation: a tool path, how the feed is reached, two axes, and limits to hold the run to.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "servosim scenario")]
pub(super) struct RawScenario {
    /// Name of the scenario in summaries and file names. Default: the file's name without its extension.
    #[schemars(with = "Option<String>", length(min = 1, max = 100))]
    pub(super) name: Option<Spanned<String>>,
    /// The desired path: exactly one of `ph_spline`, `line` and `circle`.
    #[schemars(with = "RawPath")]
    pub(super) path: Spanned<RawPath>,
    /// Feed, and how it is reached and left.
    pub(super) feedrate: RawFeedrate,
    /// How the servo loop is sampled.
    #[serde(default)]
    pub(super) control: RawControl,
    /// The two axes.
    pub(super) axes: RawAxes,
    /// Correction of the commands that `servosim learn` has written.
    pub(super) learned: Option<RawLearned>,
    /// Limits of the run; a run that breaks one exits with 3.
    #[serde(default)]
    pub(super) limits: NumberTable<Limits>,
}

/// Correction of the commands that `servosim learn` has written, for this scenario and no other.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLearned {
    /// The CSV file, relative to the folder of this file, such as "alpha-learned.csv": sample, time in s, and offset of the position
    /// commands of X and Y, in µm. As many samples as the run has, at its control period.
    #[schemars(with = "String")]
    pub(super) file: Spanned<String>,
}

/// The desired path.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawPath {
    /// A smooth curve (C2 Pythagorean-hodograph quintic spline) through or near given points.
    PhSpline(RawPhSpline),
    /// A straight line.
    Line(RawLine),
    /// A full turn around a centre.
    Circle(RawCircle),
}

/// A C2 Pythagorean-hodograph quintic spline. Give exactly one of `control_points_mm` and `nodal_points_mm`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPhSpline {
    /// Control points of a cubic B-spline: the curve is attracted by them. A closed one gives each point once.
    #[schemars(with = "Option<Vec<[f64; 2]>>")]
    pub(super) control_points_mm: Option<Spanned<Vec<RawPoint>>>,
    /// Points that the curve passes through. A closed one gives the first point once.
    #[schemars(with = "Option<Vec<[f64; 2]>>")]
    pub(super) nodal_points_mm: Option<Spanned<Vec<RawPoint>>>,
    /// Whether the curve returns to its start.
    #[serde(default)]
    pub(super) closed: bool,
    /// Start and end tangent [[x, y], [x, y]] of an open curve through nodal points: the derivative with respect to the
    /// segment's parameter, in mm (the length of the neighbouring segment is a good choice). Default: chosen automatically.
    #[schemars(with = "Option<[[f64; 2]; 2]>")]
    pub(super) end_tangents: Option<Spanned<Vec<RawPoint>>>,
}

/// A straight line.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLine {
    /// First point.
    #[schemars(with = "[f64; 2]")]
    pub(super) start_mm: RawPoint,
    /// Last point.
    #[schemars(with = "[f64; 2]")]
    pub(super) end_mm: RawPoint,
}

/// A full turn around a centre.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCircle {
    /// Centre.
    #[schemars(with = "[f64; 2]")]
    pub(super) centre_mm: RawPoint,
    /// Radius.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) radius_mm: Spanned<f64>,
    /// Angle of the first point, from the X axis, counterclockwise. Default: 0.
    #[schemars(with = "Option<f64>")]
    pub(super) start_deg: Option<Spanned<f64>>,
    /// Direction of travel. Default: counterclockwise.
    #[serde(default)]
    pub(super) clockwise: bool,
}

/// Feed, and how it is reached and left.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFeedrate {
    #[schemars(with = "f64")]
    pub(super) feed_mm_s: Spanned<f64>,
    /// How the feed is reached: exactly one of `linear`, `cubic`, `quintic`, `exponential`, `jerk_limited` and
    /// `axis_limited`.
    pub(super) profile: RawProfile,
    /// Changes of the feed override during the run, in the order of time; 100 % before the first.
    #[serde(default, rename = "override")]
    #[schemars(with = "Vec<RawOverride>", rename = "override")]
    pub(super) feed_override: Vec<RawOverride>,
}

/// A change of the feed override; 0 % is a feed hold, which a later change must end.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawOverride {
    /// When the feed begins to change, in s from the start of the run.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) at_s: Spanned<f64>,
    /// Override ratio in percent of the planned feed: 0 (feed hold) to 200; to 100 for an axis-limited feed. More than 100 is used only while
    /// the plan cruises: its ramps, which run at its limits, do not change.
    #[schemars(with = "f64", range(min = 0, max = 200))]
    pub(super) percent: Spanned<f64>,
    /// Shortest time of the change, in s. Default: as short as possible. It takes longer where the largest acceleration and jerk of the
    /// planned motion (for an axis-limited feed: the limits of the axes) require that, and the summary says so.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) transition_s: Option<Spanned<f64>>,
}

/// How the feed is reached and left.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawProfile {
    /// Constant acceleration (a trapezoidal feed); the jerk is infinite at the ends of the phase.
    Linear(RawPhase),
    /// Cubic feed: acceleration continuous, jerk not.
    Cubic(RawPhase),
    /// Quintic feed, the S-curve with continuous jerk.
    Quintic(RawPhase),
    /// The quintic with the exponential modification: a lower peak jerk in the same time.
    Exponential(RawExponential),
    /// Seven phases with bounded acceleration and jerk.
    JerkLimited(RawJerkLimited),
    /// Axis-limited: as fast as the axes allow, at most `feed_mm_s`.
    AxisLimited(RawAxisLimited),
}

/// A phase of given length.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPhase {
    #[schemars(with = "f64")]
    pub(super) phase_s: Spanned<f64>,
}

/// The quintic with the exponential modification.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawExponential {
    #[schemars(with = "f64")]
    pub(super) phase_s: Spanned<f64>,
    #[schemars(with = "RawExponentSchema")]
    pub(super) n_c: Spanned<RawExponent>,
}

/// An exponent, or the wish to have it chosen.
#[derive(Debug, Clone, Copy)]
pub(super) enum RawExponent {
    Given(f64),
    Optimize,
}

/// What [`RawExponent`] looks like in the file.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum RawExponentSchema {
    Given(#[schemars(range(min = 1, max = 20))] f64),
    Optimize(RawOptimize),
}

#[derive(JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[expect(dead_code, reason = "only its schema is used")]
enum RawOptimize {
    Optimize,
}

impl<'de> Deserialize<'de> for RawExponent {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ExponentVisitor;

        impl Visitor<'_> for ExponentVisitor {
            type Value = RawExponent;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or \"optimize\"")
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<RawExponent, E> {
                Ok(RawExponent::Given(value))
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<RawExponent, E> {
                Ok(RawExponent::Given(value as f64))
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<RawExponent, E> {
                Ok(RawExponent::Given(value as f64))
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<RawExponent, E> {
                match value {
                    "optimize" => Ok(RawExponent::Optimize),
                    other => Err(E::invalid_value(de::Unexpected::Str(other), &self)),
                }
            }
        }

        deserializer.deserialize_any(ExponentVisitor)
    }
}

/// Seven phases with bounded acceleration and jerk.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawJerkLimited {
    #[schemars(with = "f64")]
    pub(super) accel_mm_s2: Spanned<f64>,
    #[schemars(with = "f64")]
    pub(super) jerk_mm_s3: Spanned<f64>,
}

/// As fast as the axes allow, from rest to rest. The path must be smooth up to its curvature.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAxisLimited {
    /// Largest speed of X and Y, in mm/s.
    #[schemars(with = "[f64; 2]")]
    pub(super) velocity_mm_s: RawPoint,
    /// Largest acceleration of X and Y, in mm/s².
    #[schemars(with = "[f64; 2]")]
    pub(super) acceleration_mm_s2: RawPoint,
    /// Largest jerk of X and Y, in mm/s³.
    #[schemars(with = "[f64; 2]")]
    pub(super) jerk_mm_s3: RawPoint,
}

/// How the servo loop is sampled.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawControl {
    #[schemars(with = "Option<f64>")]
    pub(super) period_s: Option<Spanned<f64>>,
    #[schemars(with = "Option<f64>")]
    pub(super) settling_s: Option<Spanned<f64>>,
    /// Source of the commanded velocity for the feedforward. Default: "backward".
    pub(super) derivative: Option<RawDerivative>,
    #[schemars(with = "Option<u8>")]
    pub(super) delay_samples: Option<Spanned<i64>>,
    /// Cross-coupled contour control beside the controllers of the axes.
    #[schemars(with = "Option<NumberTable<CrossCouplingGains>>")]
    pub(super) cross_coupling: Option<Spanned<NumberTable<CrossCouplingGains>>>,
}

/// Source of the velocity command.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawDerivative {
    /// Backward difference of the position command: all that a drive can do that receives positions only.
    Backward,
    /// The interpolator's own velocity at the sample.
    Exact,
}

/// The two axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAxes {
    /// The X axis.
    #[schemars(with = "RawAxis")]
    pub(super) x: Spanned<RawAxis>,
    /// The Y axis.
    #[schemars(with = "RawAxis")]
    pub(super) y: Spanned<RawAxis>,
}

/// One axis: plant, drive, controller.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAxis {
    /// Motor and mechanics: exactly one of `first_order` and `mechanics`.
    pub(super) plant: RawPlant,
    /// Amplifier and ballscrew.
    #[serde(default)]
    pub(super) drive: NumberTable<Drive>,
    /// Gains of the PDFF controller, none negative. May be left out where another controller is complete.
    pub(super) pdff: Option<NumberTable<Pdff>>,
    /// Another controller instead: exactly one of `p_pi`, `pid` and `cascade`. Default: the PDFF controller.
    #[schemars(with = "Option<RawController>")]
    pub(super) controller: Option<Spanned<RawController>>,
    /// Effects beyond the ideal drive model.
    #[serde(default)]
    pub(super) effects: RawEffects,
    /// What the controller does about it: filters, feedforwards, compensation.
    #[serde(default, alias = "remedies")]
    pub(super) compensation: RawCompensation,
}

/// Motor and mechanics.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawPlant {
    /// The identified velocity plant K/(1 + τ s).
    FirstOrder(NumberTable<Plant>),
    /// The same plant from moved mass, rotating inertia and friction.
    Mechanics(#[schemars(with = "NumberTable<Mechanics>")] Spanned<NumberTable<Mechanics>>),
}

/// The JSON schema of the file.
pub(super) fn make_schema() -> Value {
    let mut schema = schema_of::<RawScenario>();
    describe_all(&mut schema, &["x", "y"]);
    schema
}

/// The JSON schema of a type, with nothing to look up elsewhere.
pub(super) fn schema_of<T: JsonSchema>() -> Value {
    schemars::generate::SchemaSettings::draft2020_12()
        .with(|settings| settings.inline_subschemas = true)
        .into_generator()
        .into_root_schema_for::<T>()
        .to_value()
}
