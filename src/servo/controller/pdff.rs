//! The PDFF controller of [`AxisLoop`](crate::servo::AxisLoop), as a controller among others.

use super::{ControlOutput, Controller, Feedback, Integral};
use crate::servo::{AxisReference, Pdff};

/// Pseudo-derivative feedback with feedforward: `ω_com = kpp (x_com - x) + kpf ẋ_com`, `T = kpv (kvf ω_com - ω + kiv ∫(ω_com - ω))`.
#[derive(Debug, Clone, Copy)]
pub struct PdffController {
    gains: Pdff,
    integral: Integral,
}

impl PdffController {
    /// The controller at rest. Gains are taken as they are; [`AxisParameters::check`](crate::servo::AxisParameters::check) tells what
    /// is sensible.
    pub fn new(gains: &Pdff, period_s: f64) -> Self {
        Self { gains: *gains, integral: Integral::new(gains.kpv_nm_s_rad * gains.kiv_1_s * period_s) }
    }
}

impl Controller for PdffController {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        let Pdff { kpp_rad_s_mm, kpv_nm_s_rad, kpf_rad_mm, kvf, .. } = self.gains;
        let following_error = reference.position_mm - feedback.position_mm;
        let command = kpp_rad_s_mm.mul_add(following_error, kpf_rad_mm * reference.velocity_mm_s);
        self.integral.error = command - feedback.velocity_rad_s;
        let torque_nm = kpv_nm_s_rad.mul_add(kvf.mul_add(command, -feedback.velocity_rad_s), self.integral.sum);
        ControlOutput { velocity_command_rad_s: command, torque_nm }
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        self.integral.anti_windup(clipped_nm);
    }
}
