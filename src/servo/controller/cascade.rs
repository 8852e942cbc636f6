//! The cascade with feedforward.

use super::p_pi::{INTEGRAL, POSITION, VELOCITY};
use super::{ControlOutput, Controller, Feedback, PPi, PPiGains};
use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::{AxisParameters, AxisReference};

/// Gains of [`Cascade`], none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CascadeGains {
    /// The cascade without feedforward.
    pub loops: PPiGains,
    /// Velocity feedforward `kf` \[rad/mm\]; `1/r_g` is all of it.
    pub velocity_rad_mm: f64,
    /// Torque per commanded velocity \[N m s/mm\]; `B/r_g` compensates the plant's viscous friction.
    pub viscous_nm_s_mm: f64,
    /// Torque per commanded acceleration `ka` \[N m s²/mm\]; `J/r_g` is all of it.
    pub acceleration_nm_s2_mm: f64,
}

parameters!("Position P, velocity PI, feedforward of velocity, viscous friction and acceleration", CascadeGains {
    loops.position_rad_s_mm: POSITION.at("controller.cascade.position_rad_s_mm"),
    loops.velocity_nm_s_rad: VELOCITY.at("controller.cascade.velocity_nm_s_rad"),
    loops.integral_1_s: INTEGRAL.at("controller.cascade.integral_1_s"),
    velocity_rad_mm: Parameter::new(
        "controller.cascade.velocity_rad_mm",
        "rad/mm",
        Range::NOT_NEGATIVE,
        "Velocity feedforward",
    )
    .otherwise("1/transmission_mm_rad, all of it")
    .linear(0.0, 2.0),
    viscous_nm_s_mm: Parameter::new(
        "controller.cascade.viscous_nm_s_mm",
        "N m s/mm",
        Range::NOT_NEGATIVE,
        "Torque per commanded velocity",
    )
    .otherwise("that of the plant's viscous friction")
    .logarithmic(1e-5, 0.1),
    acceleration_nm_s2_mm: Parameter::new(
        "controller.cascade.acceleration_nm_s2_mm",
        "N m s²/mm",
        Range::NOT_NEGATIVE,
        "Torque per commanded acceleration",
    )
    .otherwise("that of the plant's inertia")
    .logarithmic(1e-6, 0.01),
});

impl CascadeGains {
    /// All of the feedforward that the model of the axis asks for.
    pub fn with_feedforward(loops: PPiGains, axis: &AxisParameters) -> Self {
        let (plant, drive) = (&axis.plant, &axis.drive);
        Self {
            loops,
            velocity_rad_mm: 1.0 / drive.transmission_mm_rad,
            viscous_nm_s_mm: plant.viscous_nm_s_rad(drive) / drive.transmission_mm_rad,
            acceleration_nm_s2_mm: plant.inertia_kg_m2(drive) / drive.transmission_mm_rad,
        }
    }

    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// P-PI with feedforward: `ω_com = kp (x_com - x) + kf ẋ_com`, `T = kv (ω_com - ω + ki ∫(ω_com - ω)) + b ẋ_com + ka ẍ_com`.
///
/// Source: G. Ellis, "Control System Design Guide", 4th edition, sections 17.3 and 8.2.
#[derive(Debug, Clone, Copy)]
pub struct Cascade {
    gains: CascadeGains,
    loops: PPi,
}

impl Cascade {
    /// The controller at rest.
    ///
    /// # Errors
    /// A gain out of its range.
    pub fn new(gains: &CascadeGains, period_s: f64) -> Result<Self, OutOfRange> {
        gains.check()?;
        Ok(Self { gains: *gains, loops: PPi::new(&gains.loops, period_s)? })
    }
}

impl Controller for Cascade {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        let mut output = self.loops.follow(reference, feedback, self.gains.velocity_rad_mm * reference.velocity_mm_s);
        output.torque_nm += self.gains.viscous_nm_s_mm * reference.velocity_mm_s
            + self.gains.acceleration_nm_s2_mm * reference.acceleration_mm_s2;
        output
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        self.loops.anti_windup(clipped_nm);
    }
}
