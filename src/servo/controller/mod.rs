//! Controllers: from reference and feedback to the torque command.
//!
//! Positions of reference and feedback are in mm from the start of the axis. The output may be clamped;
//! [`Controller::anti_windup`] passes by how much, so that the integral does not wind up.

mod cascade;
mod p_pi;
mod pdff;
mod pid;

pub use cascade::{Cascade, CascadeGains};
pub use p_pi::{PPi, PPiGains};
pub use pdff::PdffController;
pub use pid::{Pid, PidGains};

use super::reference::AxisReference;

/// Feedback of an axis at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Feedback {
    /// Position from the start \[mm\].
    pub position_mm: f64,
    /// Velocity of the motor \[rad/s\].
    pub velocity_rad_s: f64,
}

/// Output of a controller at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ControlOutput {
    /// Velocity command; zero where the controller has none \[rad/s\].
    pub velocity_command_rad_s: f64,
    /// Torque of the motor \[N m\].
    pub torque_nm: f64,
}

/// A controller of one axis.
pub trait Controller {
    /// The control output at this sample.
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput;

    /// Once after [`control`](Self::control): by how much the voltage limit reduced the torque \[N m\], with its sign; zero where it did
    /// not act. The integral is advanced here.
    fn anti_windup(&mut self, clipped_nm: f64);
}

/// An integral that waits while it would drive a clamped torque further out.
#[derive(Debug, Clone, Copy, Default)]
struct Integral {
    sum: f64,
    rate: f64,
    error: f64,
}

impl Integral {
    fn new(rate: f64) -> Self {
        Self { rate, ..Self::default() }
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        if !(clipped_nm * self.error > 0.0) {
            self.sum = self.rate.mul_add(self.error, self.sum);
        }
    }
}

/// One of the controllers, chosen while the program runs.
#[derive(Debug, Clone, Copy)]
pub enum AnyController {
    /// Pseudo-derivative feedback with feedforward.
    Pdff(PdffController),
    /// Position P, velocity PI.
    PPi(PPi),
    /// Position PID.
    Pid(Pid),
    /// Position P, velocity PI, feedforward of velocity and acceleration.
    Cascade(Cascade),
}

impl Controller for AnyController {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        match self {
            Self::Pdff(controller) => controller.control(reference, feedback),
            Self::PPi(controller) => controller.control(reference, feedback),
            Self::Pid(controller) => controller.control(reference, feedback),
            Self::Cascade(controller) => controller.control(reference, feedback),
        }
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        match self {
            Self::Pdff(controller) => controller.anti_windup(clipped_nm),
            Self::PPi(controller) => controller.anti_windup(clipped_nm),
            Self::Pid(controller) => controller.anti_windup(clipped_nm),
            Self::Cascade(controller) => controller.anti_windup(clipped_nm),
        }
    }
}
