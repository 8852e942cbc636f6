//! Parameters of feeds: ranges, units, help.

use super::{FeedrateError, MAX_OVERRIDE, N_C_RANGE, Profile};
use crate::parameters::{Entry, Parameter, Parameters, Range};

/// Commanded feed along the path.
pub(crate) const FEED: Parameter = Parameter::new(
    "feedrate.feed_mm_s",
    "mm/s",
    Range::POSITIVE,
    "Commanded feed along the path; on a path too short for it the peak feed falls",
)
.logarithmic(1.0, 1000.0)
.hint("give the feed in mm/s, such as 100");

/// Length of the acceleration phase.
pub(super) const PHASE: Parameter =
    Parameter::new("feedrate.profile.phase_s", "s", Range::POSITIVE, "Length of the acceleration phase")
        .logarithmic(0.005, 2.0)
        .hint("give the time to reach the feed in seconds, such as 0.1");

/// Exponent of the exponential profile.
pub(super) const N_C: Parameter = Parameter::new(
    "feedrate.profile.exponential.n_c",
    "",
    Range::closed(*N_C_RANGE.start(), *N_C_RANGE.end()),
    "Strength of the modification, or \"optimize\" to search for the lowest peak jerk",
)
.linear(1.0, 20.0)
.hint("n_c is usually 5 to 10; n_c = \"optimize\" finds the one with the lowest peak jerk");

/// What to do about the limits of a jerk-limited profile.
const ALONG: &str = "give a positive number, such as accel_mm_s2 = 2000, jerk_mm_s3 = 50000";

/// Acceleration of the jerk-limited profile.
pub(super) const ACCEL: Parameter = Parameter::new(
    "feedrate.profile.jerk_limited.accel_mm_s2",
    "mm/s²",
    Range::POSITIVE,
    "Largest acceleration along the path",
)
.logarithmic(100.0, 50_000.0)
.hint(ALONG);

/// Jerk of the jerk-limited profile.
pub(super) const JERK: Parameter =
    Parameter::new("feedrate.profile.jerk_limited.jerk_mm_s3", "mm/s³", Range::POSITIVE, "Largest jerk along the path")
        .logarithmic(1000.0, 5e6)
        .hint(ALONG);

/// What to do about the limits of an axis-limited feed.
const OF_AXES: &str = "give a positive number for X and one for Y, such as acceleration_mm_s2 = [2000, 2000]";

/// Velocity, acceleration and jerk of the axes.
pub(crate) const OF_EACH_AXIS: [Parameter; 3] = [
    Parameter::new("feedrate.profile.axis_limited.velocity_mm_s", "mm/s", Range::POSITIVE, "Largest speed")
        .logarithmic(10.0, 2000.0)
        .hint(OF_AXES),
    Parameter::new(
        "feedrate.profile.axis_limited.acceleration_mm_s2",
        "mm/s²",
        Range::POSITIVE,
        "Largest acceleration",
    )
    .logarithmic(100.0, 50_000.0)
    .hint(OF_AXES),
    Parameter::new("feedrate.profile.axis_limited.jerk_mm_s3", "mm/s³", Range::POSITIVE, "Largest jerk")
        .logarithmic(1000.0, 5e6)
        .hint(OF_AXES),
];

/// When the override changes.
pub(crate) const AT: Parameter = Parameter::new(
    "feedrate.override.at_s",
    "s",
    Range::NOT_NEGATIVE,
    "When the feed begins to change, from the start of the run",
)
.linear(0.0, 10.0)
.hint("give the time in seconds from the start of the run, such as 0.4");

/// To what it changes, as a ratio.
pub(super) const RATIO: Parameter =
    Parameter::new("override", "", Range::closed(0.0, MAX_OVERRIDE), "Override ratio; 0 is a feed hold")
        .linear(0.0, MAX_OVERRIDE);

/// How long it takes.
pub(crate) const TRANSITION: Parameter =
    Parameter::new("feedrate.override.transition_s", "s", Range::POSITIVE, "Shortest time of the change")
        .otherwise("as short as possible")
        .logarithmic(0.01, 2.0)
        .hint("give the length of the change in seconds, such as 0.1, or leave the key out");

/// The value if it is in the range of its parameter.
pub(super) fn within(parameter: &Parameter, value: f64) -> Result<f64, FeedrateError> {
    Ok(parameter.check(value)?)
}

/// A value of one variant of the profile.
macro_rules! entry {
    ($variant:ident, $field:ident, $parameter:expr) => {
        Entry {
            parameter: $parameter,
            get: |profile| match profile {
                Profile::$variant { $field, .. } => Some(*$field),
                _ => None,
            },
            set: |profile, value| match profile {
                Profile::$variant { $field, .. } => {
                    *$field = value;
                    true
                }
                _ => false,
            },
        }
    };
}

impl Parameters for Profile {
    const ABOUT: &'static str = "How the feed is reached and left";
    const ENTRIES: &'static [Entry<Self>] = &[
        entry!(Linear, phase_s, PHASE.at("feedrate.profile.linear.phase_s")),
        entry!(Cubic, phase_s, PHASE.at("feedrate.profile.cubic.phase_s")),
        entry!(Quintic, phase_s, PHASE.at("feedrate.profile.quintic.phase_s")),
        entry!(Exponential, phase_s, PHASE.at("feedrate.profile.exponential.phase_s")),
        entry!(Exponential, n_c, N_C),
        entry!(JerkLimited, accel_mm_s2, ACCEL),
        entry!(JerkLimited, jerk_mm_s3, JERK),
    ];
}
