//! Position P around velocity PI: what most drives do.

use super::{ControlOutput, Controller, Feedback, Integral};
use crate::parameters::OutOfRange;
use crate::servo::AxisReference;
use crate::servo::parameters::not_negative;

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

impl PPiGains {
    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        not_negative("position_rad_s_mm", self.position_rad_s_mm)?;
        not_negative("velocity_nm_s_rad", self.velocity_nm_s_rad)?;
        not_negative("integral_1_s", self.integral_1_s)
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
