//! Feedforward of torque, and shifts of the command against what the screw does.

use super::Compensation;
use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::effects::PitchError;
use crate::servo::{AxisParameters, AxisReference};

/// Commands that are slower than this are at rest \[mm/s\]: a compensation takes no sign of their velocity. The backward difference of a
/// command at rest may be off zero by its last digit over the period, 1e-7 mm/s at 1 m from the origin and 1 µs.
pub const STANDSTILL_MM_S: f64 = 1e-6;

/// Torque for the reference acceleration, beside any controller: `T = share (J ẍ_com + B ẋ_com)/r_g` with `J`, `B` of the model.
///
/// Source: G. Ellis, "Control System Design Guide", 4th edition, section 8.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelerationFeedforward {
    /// Share, from 0 to 1 as a rule.
    pub share: f64,
}

parameters!(
    "Torque for the commanded acceleration",
    AccelerationFeedforward {
        share: Parameter::new(
            "compensation.acceleration.share",
            "",
            Range::NOT_NEGATIVE,
            "Fraction of the torque that the model needs",
        )
        .or(1.0)
        .linear(0.0, 1.5),
    }
);

impl AccelerationFeedforward {
    /// The share in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// Torque against friction: `T_c sat(ẋ_com / v)`, in the direction of the reference velocity, at full size from a smoothing velocity on;
/// none while `|ẋ_com|` is below [`STANDSTILL_MM_S`].
///
/// Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994, section 5.3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionFeedforward {
    /// Coulomb friction as it is known `T_c` \[N m\], not negative.
    pub coulomb_nm: f64,
    /// Smoothing velocity `v` \[mm/s\], positive.
    pub smoothing_mm_s: f64,
}

parameters!(
    "Torque for the friction in the commanded direction",
    FrictionFeedforward {
        coulomb_nm: Parameter::new(
            "compensation.friction.coulomb_nm",
            "N m",
            Range::NOT_NEGATIVE,
            "Known Coulomb friction",
        )
        .linear(0.0, 1.0),
        smoothing_mm_s: Parameter::new(
            "compensation.friction.smoothing_mm_s",
            "mm/s",
            Range::POSITIVE,
            "Commanded speed from which the full torque is applied",
        )
        .or(1.0)
        .logarithmic(0.01, 100.0),
    }
);

impl FrictionFeedforward {
    /// Both in their range.
    ///
    /// # Errors
    /// One is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// Shift of the command by half the gap towards the reference direction, through a first-order low pass of time constant `T`: the step
/// would be a jolt. The direction is that of the last velocity of at least [`STANDSTILL_MM_S`]: a command at rest keeps its shift.
///
/// For an encoder at the motor; a scale at the table sees the gap by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BacklashCompensation {
    /// Gap as it is known \[µm\], positive.
    pub gap_um: f64,
    /// Time constant `T` \[s\], not negative; 0 for a step.
    pub time_constant_s: f64,
}

parameters!(
    "Offset of the command against backlash",
    BacklashCompensation {
        gap_um: Parameter::new("compensation.backlash.gap_um", "µm", Range::POSITIVE, "Known width of the backlash")
            .logarithmic(0.1, 100.0),
        time_constant_s: Parameter::new(
            "compensation.backlash.time_constant_s",
            "s",
            Range::NOT_NEGATIVE,
            "Time constant of the offset; 0: a step",
        )
        .or(0.0)
        .linear(0.0, 0.05),
    }
);

impl BacklashCompensation {
    /// Both in their range.
    ///
    /// # Errors
    /// One is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// The compensations at work.
#[derive(Debug, Clone)]
pub(in crate::servo) struct Compensator {
    acceleration: [f64; 2],
    coulomb: f64,
    smoothing: f64,
    half_gap_mm: f64,
    share: f64,
    towards: f64,
    shift: f64,
    pitch: Option<PitchError>,
    pitch_start_mm: f64,
    near: usize,
    pub(in crate::servo) active: bool,
}

impl Compensator {
    /// For an axis that starts on `start_mm`: there the pitch compensation is zero, as the pitch error is.
    pub(in crate::servo) fn new(
        compensation: &Compensation,
        axis: &AxisParameters,
        period_s: f64,
        start_mm: f64,
    ) -> Self {
        let share = compensation.acceleration.map_or(0.0, |a| a.share) / axis.drive.transmission_mm_rad;
        Self {
            acceleration: [
                share * axis.plant.viscous_nm_s_rad(&axis.drive),
                share * axis.plant.inertia_kg_m2(&axis.drive),
            ],
            coulomb: compensation.friction.map_or(0.0, |f| f.coulomb_nm),
            smoothing: compensation.friction.map_or(0.0, |f| 1.0 / f.smoothing_mm_s),
            half_gap_mm: compensation.backlash.map_or(0.0, |b| 0.5e-3 * b.gap_um),
            share: compensation.backlash.map_or(0.0, |b| {
                if b.time_constant_s > 0.0 { -libm::expm1(-period_s / b.time_constant_s) } else { 1.0 }
            }),
            towards: 0.0,
            shift: 0.0,
            pitch: compensation.pitch.clone(),
            pitch_start_mm: compensation.pitch.as_ref().map_or(0.0, |pitch| pitch.at_start_mm(start_mm)),
            near: 0,
            active: compensation.acceleration.is_some()
                || compensation.friction.is_some()
                || compensation.backlash.is_some()
                || compensation.pitch.is_some(),
        }
    }

    /// The reference with compensations: `position_mm` counted from `start_mm`.
    #[inline(always)]
    pub(in crate::servo) fn compensate(&mut self, reference: &mut AxisReference, start_mm: f64) {
        let velocity = reference.velocity_mm_s;
        let moves = velocity.abs() >= STANDSTILL_MM_S;
        let slip = if moves { (velocity * self.smoothing).max(-1.0).min(1.0) } else { 0.0 };
        reference.torque_nm +=
            self.acceleration[0] * velocity + self.acceleration[1] * reference.acceleration_mm_s2 + self.coulomb * slip;
        if self.half_gap_mm > 0.0 {
            if moves {
                self.towards = self.half_gap_mm.copysign(velocity);
            }
            self.shift += self.share * (self.towards - self.shift);
        }
        let pitch_mm = match &self.pitch {
            Some(pitch) => {
                1e-3 * pitch.error_um.near(start_mm + reference.position_mm, &mut self.near) - self.pitch_start_mm
            }
            None => 0.0,
        };
        reference.position_mm += self.shift - pitch_mm;
    }
}
