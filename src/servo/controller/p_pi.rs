//! Position P around velocity PI: what most drives do.

use super::{ControlOutput, Controller, Feedback, Integral};
use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::AxisReference;

/// Gains of [`PPi`], none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PPiGains {
    /// Position gain `kp` \[rad/s/mm\].
    pub position_rad_s_mm: f64,
    /// Velocity gain `kv` \[N m s/rad\].
    pub velocity_nm_s_rad: f64,
    /// Velocity integral gain `ki` \[1/s\], the inverse of the integral time.
    pub integral_1_s: f64,
}

/// Position gain of a cascade.
pub(super) const POSITION: Parameter =
    Parameter::new("controller.p_pi.position_rad_s_mm", "rad/s/mm", Range::NOT_NEGATIVE, "Position gain")
        .otherwise("`pdff.kpp`")
        .logarithmic(1.0, 500.0);

/// Velocity gain of a cascade.
pub(super) const VELOCITY: Parameter =
    Parameter::new("controller.p_pi.velocity_nm_s_rad", "N m s/rad", Range::NOT_NEGATIVE, "Velocity gain")
        .otherwise("`pdff.kpv`")
        .logarithmic(0.01, 10.0);

/// Velocity integral gain of a cascade.
pub(super) const INTEGRAL: Parameter =
    Parameter::new("controller.p_pi.integral_1_s", "1/s", Range::NOT_NEGATIVE, "Velocity integral gain")
        .otherwise("`pdff.kiv`")
        .linear(0.0, 1000.0);

parameters!(
    "Position P, velocity PI",
    PPiGains { position_rad_s_mm: POSITION, velocity_nm_s_rad: VELOCITY, integral_1_s: INTEGRAL }
);

impl PPiGains {
    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// `ω_com = kp (x_com - x)`, `T = kv (ω_com - ω + ki ∫(ω_com - ω))`.
///
/// Source: G. Ellis, "Control System Design Guide", 4th edition, chapter 17.
#[derive(Debug, Clone, Copy)]
pub struct PPi {
    gains: PPiGains,
    integral: Integral,
}

impl PPi {
    /// The controller at rest.
    ///
    /// # Errors
    /// A gain out of its range.
    pub fn new(gains: &PPiGains, period_s: f64) -> Result<Self, OutOfRange> {
        gains.check()?;
        let integral = Integral::new(gains.velocity_nm_s_rad * gains.integral_1_s * period_s);
        Ok(Self { gains: *gains, integral })
    }

    /// The same with a velocity that is commanded beside the position error's \[rad/s\].
    #[inline(always)]
    pub(super) fn follow(
        &mut self,
        reference: &AxisReference,
        feedback: &Feedback,
        velocity_rad_s: f64,
    ) -> ControlOutput {
        let following_error = reference.position_mm - feedback.position_mm;
        let command = self.gains.position_rad_s_mm * following_error + velocity_rad_s;
        let error = command - feedback.velocity_rad_s;
        self.integral.error = error;
        let torque_nm = self.gains.velocity_nm_s_rad * error + self.integral.sum;
        ControlOutput { velocity_command_rad_s: command, torque_nm }
    }
}

impl Controller for PPi {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        self.follow(reference, feedback, 0.0)
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        self.integral.anti_windup(clipped_nm);
    }
}
