//! The detailed drive model of an axis, as written: controller, effects, compensation.
//!
//! The doc comments here are the descriptions in the JSON schema (`servosim schema`), which editors show; numbers without one are
//! described by their [`Parameter`](crate::parameters::Parameter).

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use super::number_table::NumberTable;
use super::numbers::RawPoint;
use crate::servo::compensation::{AccelerationFeedforward, BacklashCompensation, FrictionFeedforward, LowPass, Notch};
use crate::servo::controller::{CascadeGains, PPiGains, PidGains};
use crate::servo::effects::{Backlash, Coulomb, CurrentLoop, Dac, Delay, Integration, LuGre, Mismatch, TwoMass};

/// The controller of an axis. Gains that are not given are those of the same loops as `pdff`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawController {
    /// Position P, velocity PI.
    PPi(NumberTable<PPiGains>),
    /// Position PID with a filtered derivative.
    Pid(NumberTable<PidGains>),
    /// Position P, velocity PI, feedforward of velocity, viscous friction and acceleration.
    Cascade(NumberTable<CascadeGains>),
}

/// Effects of the drive beyond the ideal drive model. A table that is not written is off.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEffects {
    /// Mismatch: the true plant is the identified one times factors.
    #[schemars(with = "Option<NumberTable<Mismatch>>")]
    pub(super) mismatch: Option<Spanned<NumberTable<Mismatch>>>,
    /// Encoder: where it is, its resolution, how the velocity is estimated.
    #[schemars(with = "Option<RawEncoder>")]
    pub(super) encoder: Option<Spanned<RawEncoder>>,
    /// White noise on the measured position.
    #[schemars(with = "Option<RawNoise>")]
    pub(super) noise: Option<Spanned<RawNoise>>,
    /// Computation delay.
    #[schemars(with = "Option<NumberTable<Delay>>")]
    pub(super) delay: Option<Spanned<NumberTable<Delay>>>,
    /// Resolution of the digital-to-analogue DAC.
    #[schemars(with = "Option<NumberTable<Dac>>")]
    pub(super) dac: Option<Spanned<NumberTable<Dac>>>,
    /// Bandwidth of the amplifier's current loop, of first order.
    #[schemars(with = "Option<NumberTable<CurrentLoop>>")]
    pub(super) current_loop: Option<Spanned<NumberTable<CurrentLoop>>>,
    /// Compliant ballscrew: motor and table are two masses with a spring between them.
    #[schemars(with = "Option<NumberTable<TwoMass>>")]
    pub(super) two_mass: Option<Spanned<NumberTable<TwoMass>>>,
    /// Friction of the table, as a torque at the motor: exactly one of `coulomb` and `lu_gre`.
    #[schemars(with = "Option<RawFriction>")]
    pub(super) friction: Option<Spanned<RawFriction>>,
    /// Backlash between screw and table.
    #[schemars(with = "Option<NumberTable<Backlash>>")]
    pub(super) backlash: Option<Spanned<NumberTable<Backlash>>>,
    /// Pitch error of the screw, counted from where the axis starts.
    #[schemars(with = "Option<RawPitch>")]
    pub(super) pitch: Option<Spanned<RawPitch>>,
    /// Torque ripple (cogging) of the motor.
    #[schemars(with = "Option<RawRipple>")]
    pub(super) ripple: Option<Spanned<RawRipple>>,
    /// Cutting force on the table: exactly one of `over_time` and `over_position`.
    #[schemars(with = "Option<RawForce>")]
    pub(super) force: Option<Spanned<RawForce>>,
    /// Step size of the integration of nonlinear effects; not an effect itself.
    #[schemars(with = "Option<NumberTable<Integration>>")]
    pub(super) integration: Option<Spanned<NumberTable<Integration>>>,
}

/// The encoder.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEncoder {
    /// Where it is. Default: "motor".
    pub(super) place: Option<RawPlace>,
    #[schemars(with = "Option<f64>")]
    pub(super) resolution_um: Option<Spanned<f64>>,
    /// Velocity estimate. Default: "tachometer".
    pub(super) velocity: Option<RawVelocity>,
    #[schemars(with = "Option<f64>")]
    pub(super) velocity_hz: Option<Spanned<f64>>,
    #[schemars(with = "Option<f64>")]
    pub(super) velocity_damping: Option<Spanned<f64>>,
}

/// Where an encoder is.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawPlace {
    /// On the motor: it does not see the ballscrew.
    Motor,
    /// A scale along the table.
    Table,
}

/// Velocity estimate.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawVelocity {
    /// An ideal tachometer on the motor.
    Tachometer,
    /// Difference of two positions, over one period.
    Difference,
    /// The same through a low pass.
    LowPass,
    /// A tracking observer.
    Observer,
}

/// White noise.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawNoise {
    #[schemars(with = "f64")]
    pub(super) rms_um: Spanned<f64>,
    /// Seed of the random numbers; every axis has its own sequence. Default: 1.
    pub(super) seed: Option<u32>,
}

/// Friction beside the viscous friction of the plant, which stays at the motor.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawFriction {
    /// Coulomb, Stribeck and viscous, with true sticking.
    Coulomb(NumberTable<Coulomb>),
    /// Bending bristles (`LuGre`).
    LuGre(NumberTable<LuGre>),
}

/// Pitch error.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPitch {
    /// Points [position in mm, error in µm], straight lines between them, constant beyond the first and the last. The error counts relative to
    /// that at the start of the axis, where it is homed.
    #[schemars(with = "Vec<[f64; 2]>")]
    pub(super) points_mm_um: Spanned<Vec<RawPoint>>,
    /// The points repeat after this distance, in mm: the lead of the screw. Default: they do not repeat.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) period_mm: Option<Spanned<f64>>,
}

/// Torque ripple.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRipple {
    /// Harmonics.
    #[schemars(with = "Vec<RawHarmonic>")]
    pub(super) harmonics: Spanned<Vec<RawHarmonic>>,
}

/// One harmonic of the torque ripple.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawHarmonic {
    /// Times per revolution of the motor.
    #[schemars(with = "u16", range(min = 1, max = 1000))]
    pub(super) per_revolution: Spanned<i64>,
    /// Amplitude, in N m.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) amplitude_nm: Spanned<f64>,
    /// Phase, in degrees. Default: 0.
    #[schemars(with = "Option<f64>")]
    pub(super) phase_deg: Option<Spanned<f64>>,
}

/// Cutting force, in the direction of the axis.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawForce {
    /// Over time.
    OverTime(RawForceOverTime),
    /// Over the position of the table.
    OverPosition(RawForceOverPosition),
}

/// Cutting force over time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawForceOverTime {
    /// Points [time in s, force in N], straight lines between them, constant beyond the first and the last.
    #[schemars(with = "Vec<[f64; 2]>")]
    pub(super) points_s_n: Spanned<Vec<RawPoint>>,
    /// The points repeat after this time, in s. Default: they do not repeat.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) period_s: Option<Spanned<f64>>,
}

/// Cutting force over the position of the table.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawForceOverPosition {
    /// Points [position in mm, force in N], straight lines between them, constant beyond the first and the last.
    #[schemars(with = "Vec<[f64; 2]>")]
    pub(super) points_mm_n: Spanned<Vec<RawPoint>>,
    /// The points repeat after this distance, in mm. Default: they do not repeat.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) period_mm: Option<Spanned<f64>>,
}

/// Filters, feedforward and command corrections of one axis. A table that is not written is off.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCompensation {
    /// Notch filter of the torque.
    #[schemars(with = "Option<NumberTable<Notch>>")]
    pub(super) notch: Option<Spanned<NumberTable<Notch>>>,
    /// Low pass of the torque, second order.
    #[schemars(with = "Option<NumberTable<LowPass>>")]
    pub(super) low_pass: Option<Spanned<NumberTable<LowPass>>>,
    /// Torque for the commanded acceleration.
    #[schemars(with = "Option<NumberTable<AccelerationFeedforward>>")]
    pub(super) acceleration: Option<Spanned<NumberTable<AccelerationFeedforward>>>,
    /// Torque for the friction in the commanded direction.
    #[schemars(with = "Option<NumberTable<FrictionFeedforward>>")]
    pub(super) friction: Option<Spanned<NumberTable<FrictionFeedforward>>>,
    /// Offset of the command against backlash.
    #[schemars(with = "Option<NumberTable<BacklashCompensation>>")]
    pub(super) backlash: Option<Spanned<NumberTable<BacklashCompensation>>>,
    /// Offset of the command against the known pitch error, relative to the start of the axis, as the effect is.
    #[schemars(with = "Option<RawPitch>")]
    pub(super) pitch: Option<Spanned<RawPitch>>,
    /// Zero-phase-error tracking: a prefilter that inverts the PDFF loop of the ideal drive model. Default: false.
    #[schemars(with = "Option<bool>")]
    pub(super) zero_phase: Option<Spanned<bool>>,
}
