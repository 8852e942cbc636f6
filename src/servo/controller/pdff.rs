//! The PDFF controller of [`AxisLoop`](crate::servo::AxisLoop), as a controller among others.

use super::{ControlOutput, Controller, Feedback};
use crate::servo::pdff_law::PdffLaw;
use crate::servo::{AxisReference, Pdff};

/// Pseudo-derivative feedback with feedforward: `ω_com = kpp (x_com - x) + kpf ẋ_com`, `T = kpv (kvf ω_com - ω + kiv ∫(ω_com - ω))`.
#[derive(Debug, Clone, Copy)]
pub struct PdffController {
    /// Its output is the torque.
    law: PdffLaw<f64>,
    /// Velocity error of the last sample \[rad/s\].
    error: f64,
}

impl PdffController {
    /// The controller at rest. Gains are taken as they are; [`AxisParameters::check`](crate::servo::AxisParameters::check) tells what
    /// is sensible.
    pub fn new(gains: &Pdff, period_s: f64) -> Self {
        let &Pdff { kpp_rad_s_mm: kpp, kpv_nm_s_rad: kpv, kiv_1_s, kpf_rad_mm: kpf, kvf } = gains;
        let rate = kpv * kiv_1_s * period_s;
        Self { law: PdffLaw { kpp, kpf, forward: kpv * kvf, feedback: kpv, rate, integral: 0.0 }, error: 0.0 }
    }
}

impl Controller for PdffController {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        let following_error = reference.position_mm - feedback.position_mm;
        let velocity_rad_s = feedback.velocity_rad_s;
        let (velocity_command_rad_s, torque_nm) =
            self.law.output(following_error, reference.velocity_mm_s, velocity_rad_s);
        self.error = velocity_command_rad_s - velocity_rad_s;
        ControlOutput { velocity_command_rad_s, torque_nm }
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        self.law.integrate(self.error, clipped_nm);
    }
}
