//! The detailed drive model of an axis, as written: controller, effects, compensation.
//!
//! The doc comments here are the descriptions in the JSON schema (`servosim schema`), which editors show.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use super::numbers::RawPoint;

/// The controller of an axis. Gains that are not given are those of the same loops as `pdff`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawController {
    /// Position P, velocity PI.
    PPi(RawPPi),
    /// Position PID with a filtered derivative.
    Pid(RawPid),
    /// Position P, velocity PI, feedforward of velocity, viscous friction and acceleration.
    Cascade(RawCascade),
}

/// Position P, velocity PI.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPPi {
    /// Position gain, in rad/s/mm. Default: `kpp`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) position_rad_s_mm: Option<Spanned<f64>>,
    /// Velocity gain, in N m s/rad. Default: `kpv`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) velocity_nm_s_rad: Option<Spanned<f64>>,
    /// Velocity integral gain, in 1/s. Default: `kiv`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) integral_1_s: Option<Spanned<f64>>,
}

/// Position PID.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPid {
    /// Proportional gain, in V/mm.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) proportional_v_mm: Option<Spanned<f64>>,
    /// Integral gain, in V/(mm s).
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) integral_v_mm_s: Option<Spanned<f64>>,
    /// Derivative gain, in V s/mm.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) derivative_v_s_mm: Option<Spanned<f64>>,
    /// Corner of the derivative's filter, in Hz, at most the Nyquist frequency. Default: a quarter of the sampling rate.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) filter_hz: Option<Spanned<f64>>,
}

/// The cascade of P-PI with feedforward.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCascade {
    /// Position gain, in rad/s/mm. Default: `kpp`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) position_rad_s_mm: Option<Spanned<f64>>,
    /// Velocity gain, in N m s/rad. Default: `kpv`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) velocity_nm_s_rad: Option<Spanned<f64>>,
    /// Velocity integral gain, in 1/s. Default: `kiv`.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) integral_1_s: Option<Spanned<f64>>,
    /// Velocity feedforward, in rad/mm. Default: 1/transmission, all of it.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) velocity_rad_mm: Option<Spanned<f64>>,
    /// Torque per commanded velocity, in N m s/mm. Default: that of the plant's viscous friction.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) viscous_nm_s_mm: Option<Spanned<f64>>,
    /// Torque per commanded acceleration, in N m s²/mm. Default: that of the plant's inertia.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) acceleration_nm_s2_mm: Option<Spanned<f64>>,
}

/// Effects of the drive beyond the ideal drive model. A table that is not written is off.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEffects {
    /// Mismatch: the true plant is the identified one times factors.
    #[schemars(with = "Option<RawMismatch>")]
    pub(super) mismatch: Option<Spanned<RawMismatch>>,
    /// Encoder: where it is, its resolution, how the velocity is estimated.
    #[schemars(with = "Option<RawEncoder>")]
    pub(super) encoder: Option<Spanned<RawEncoder>>,
    /// White noise on the measured position.
    #[schemars(with = "Option<RawNoise>")]
    pub(super) noise: Option<Spanned<RawNoise>>,
    /// Computation delay.
    #[schemars(with = "Option<RawDelay>")]
    pub(super) delay: Option<Spanned<RawDelay>>,
    /// Resolution of the digital-to-analogue DAC.
    #[schemars(with = "Option<RawDac>")]
    pub(super) dac: Option<Spanned<RawDac>>,
    /// Bandwidth of the amplifier's current loop, of first order.
    #[schemars(with = "Option<RawCurrentLoop>")]
    pub(super) current_loop: Option<Spanned<RawCurrentLoop>>,
    /// Compliant ballscrew: motor and table are two masses with a spring between them.
    #[schemars(with = "Option<RawTwoMass>")]
    pub(super) two_mass: Option<Spanned<RawTwoMass>>,
    /// Friction of the table, as a torque at the motor: exactly one of `coulomb` and `lu_gre`.
    #[schemars(with = "Option<RawFriction>")]
    pub(super) friction: Option<Spanned<RawFriction>>,
    /// Backlash between screw and table.
    #[schemars(with = "Option<RawBacklash>")]
    pub(super) backlash: Option<Spanned<RawBacklash>>,
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
    #[schemars(with = "Option<RawIntegration>")]
    pub(super) integration: Option<Spanned<RawIntegration>>,
}

/// The true plant is the identified one times factors.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMismatch {
    /// Factor of the gain. Default: 1.
    #[schemars(with = "Option<f64>", range(min = 0.01, max = 100))]
    pub(super) gain_factor: Option<Spanned<f64>>,
    /// Factor of the time constant. Default: 1.
    #[schemars(with = "Option<f64>", range(min = 0.01, max = 100))]
    pub(super) time_constant_factor: Option<Spanned<f64>>,
}

/// The encoder.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEncoder {
    /// Where it is. Default: "motor".
    pub(super) place: Option<RawPlace>,
    /// Resolution, in µm at the table. Default: 0, no quantisation.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) resolution_um: Option<Spanned<f64>>,
    /// Velocity estimate. Default: "tachometer".
    pub(super) velocity: Option<RawVelocity>,
    /// Corner of the low pass (at most the Nyquist frequency), or bandwidth of the observer, in Hz. Default: 200, but at most a fifth of the
    /// sampling rate, and half the bandwidth below which an observer is stable.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) velocity_hz: Option<Spanned<f64>>,
    /// Damping of the observer. Default: 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
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
    /// Standard deviation, in µm.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) rms_um: Spanned<f64>,
    /// Seed of the random numbers; every axis has its own sequence. Default: 1.
    pub(super) seed: Option<u32>,
}

/// Computation delay.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawDelay {
    /// From the sample to the voltage, in control periods, fractions included. Adds to `delay_samples`.
    #[schemars(with = "f64", range(min = 0, max = 16))]
    pub(super) samples: Spanned<f64>,
}

/// Digital-to-analogue DAC.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawDac {
    /// Bits over the voltage range.
    #[schemars(with = "u8", range(min = 2, max = 32))]
    pub(super) bits: Spanned<i64>,
}

/// Current loop.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCurrentLoop {
    /// Bandwidth, in Hz.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) bandwidth_hz: Spanned<f64>,
}

/// Two masses.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTwoMass {
    /// Mass of the table, in kg: its part of the plant's inertia.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) table_mass_kg: Spanned<f64>,
    /// Stiffness along the axis, in N/µm.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) stiffness_n_um: Spanned<f64>,
    /// Damping along the axis, in N s/mm. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) damping_n_s_mm: Option<Spanned<f64>>,
}

/// Friction beside the viscous friction of the plant, which stays at the motor.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawFriction {
    /// Coulomb, Stribeck and viscous, with true sticking.
    Coulomb(RawCoulomb),
    /// Bending bristles (`LuGre`).
    LuGre(RawLuGre),
}

/// Coulomb, Stribeck and viscous friction.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCoulomb {
    /// Friction in motion, in N m at the motor.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) coulomb_nm: Spanned<f64>,
    /// Friction at rest, in N m. Default: `coulomb_nm`.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) static_nm: Option<Spanned<f64>>,
    /// Stribeck speed of the table, over which friction falls from static to Coulomb, in mm/s. Default: 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) stribeck_mm_s: Option<Spanned<f64>>,
    /// Viscous friction beside the plant's, in N m s/rad. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) viscous_nm_s_rad: Option<Spanned<f64>>,
}

/// Bristles.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLuGre {
    /// Friction in motion, in N m at the motor.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) coulomb_nm: Spanned<f64>,
    /// Friction at rest, in N m. Default: `coulomb_nm`.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) static_nm: Option<Spanned<f64>>,
    /// Stribeck speed of the table, over which friction falls from static to Coulomb, in mm/s. Default: 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) stribeck_mm_s: Option<Spanned<f64>>,
    /// Viscous friction beside the plant's, in N m s/rad. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) viscous_nm_s_rad: Option<Spanned<f64>>,
    /// Stiffness of the bristles, in N m/rad.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) stiffness_nm_rad: Spanned<f64>,
    /// Damping of the bristles, in N m s/rad. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) damping_nm_s_rad: Option<Spanned<f64>>,
}

/// Backlash.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBacklash {
    /// Width, in µm at the table.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) gap_um: Spanned<f64>,
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

/// Step size of the integration of the nonlinear parts; the linear ones are exact.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawIntegration {
    /// Least number of steps in a control period; a fast resonance, events and errors add more. Default: 1. Halving the step changes the
    /// largest contouring error by less than 1 nm, except where quantisation or noise amplify the difference.
    #[schemars(with = "Option<u32>", range(min = 1, max = 1024))]
    pub(super) substeps: Option<Spanned<i64>>,
    /// A step is halved while its error in friction, ripple and force may change the table's speed by more than this, in mm/s.
    /// Default: 1e-5.
    #[schemars(with = "Option<f64>", range(min = 1e-9, max = 1e9))]
    pub(super) tolerance_mm_s: Option<Spanned<f64>>,
}

/// Filters, feedforward and command corrections of one axis. A table that is not written is off.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCompensation {
    /// Notch filter of the torque.
    #[schemars(with = "Option<RawNotch>")]
    pub(super) notch: Option<Spanned<RawNotch>>,
    /// Low pass of the torque, second order.
    #[schemars(with = "Option<RawLowPass>")]
    pub(super) low_pass: Option<Spanned<RawLowPass>>,
    /// Torque for the commanded acceleration.
    #[schemars(with = "Option<RawAccelerationFeedforward>")]
    pub(super) acceleration: Option<Spanned<RawAccelerationFeedforward>>,
    /// Torque for the friction in the commanded direction.
    #[schemars(with = "Option<RawFrictionFeedforward>")]
    pub(super) friction: Option<Spanned<RawFrictionFeedforward>>,
    /// Offset of the command against backlash.
    #[schemars(with = "Option<RawBacklashCompensation>")]
    pub(super) backlash: Option<Spanned<RawBacklashCompensation>>,
    /// Offset of the command against the known pitch error, relative to the start of the axis, as the effect is.
    #[schemars(with = "Option<RawPitch>")]
    pub(super) pitch: Option<Spanned<RawPitch>>,
    /// Zero-phase-error tracking: a prefilter that inverts the PDFF loop of the ideal drive model. Default: false.
    #[schemars(with = "Option<bool>")]
    pub(super) zero_phase: Option<Spanned<bool>>,
}

/// Notch filter.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawNotch {
    /// Centre, in Hz, below 0.499 of the sampling rate.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) frequency_hz: Spanned<f64>,
    /// Gain at the centre, 0 to 1. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0, max = 1))]
    pub(super) depth: Option<Spanned<f64>>,
    /// Half the width over the frequency. Default: 0.5.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) damping: Option<Spanned<f64>>,
}

/// Low pass.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLowPass {
    /// Corner, in Hz, below 0.499 of the sampling rate.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) frequency_hz: Spanned<f64>,
    /// Damping. Default: 0.7071 (Butterworth).
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) damping: Option<Spanned<f64>>,
}

/// Feedforward of acceleration.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAccelerationFeedforward {
    /// Fraction of the torque that the model needs. Default: 1.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) share: Option<Spanned<f64>>,
}

/// Feedforward of friction.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFrictionFeedforward {
    /// Known Coulomb friction, in N m.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) coulomb_nm: Spanned<f64>,
    /// Commanded speed from which the full torque is applied, in mm/s. Default: 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) smoothing_mm_s: Option<Spanned<f64>>,
}

/// Compensation of backlash.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBacklashCompensation {
    /// Known width of the backlash, in µm.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) gap_um: Spanned<f64>,
    /// Time constant of the offset, in s. Default: 0, a step.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) time_constant_s: Option<Spanned<f64>>,
}

/// Cross-coupled contour control: an offset of the commands against the contouring error itself.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCrossCoupling {
    /// Offset of the command per contouring error.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) proportional: Spanned<f64>,
    /// Offset per integral of the contouring error, in 1/s. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) integral_1_s: Option<Spanned<f64>>,
    /// Offset per rate of the contouring error, in s. Default: 0.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub(super) derivative_s: Option<Spanned<f64>>,
    /// Largest offset of an axis, in µm. Default: 100.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) limit_um: Option<Spanned<f64>>,
}
