//! Position PID.

use super::{ControlOutput, Controller, Feedback, Integral};
use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::parameters::at_most_nyquist;
use crate::servo::{AxisReference, Drive};

/// Gains of [`Pid`], none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PidGains {
    /// `kp` \[V/mm\].
    pub proportional_v_mm: f64,
    /// `ki` \[V/(mm s)\].
    pub integral_v_mm_s: f64,
    /// `kd` \[V s/mm\].
    pub derivative_v_s_mm: f64,
    /// Corner of the derivative's filter `f` \[Hz\], positive, at most the Nyquist frequency.
    pub filter_hz: f64,
}

parameters!(
    "Position PID with a filtered derivative",
    PidGains {
        proportional_v_mm: Parameter::new(
            "controller.pid.proportional_v_mm",
            "V/mm",
            Range::NOT_NEGATIVE,
            "Proportional gain",
        )
        .otherwise("that of the loops of `pdff`")
        .logarithmic(1.0, 1000.0),
        integral_v_mm_s: Parameter::new(
            "controller.pid.integral_v_mm_s",
            "V/(mm s)",
            Range::NOT_NEGATIVE,
            "Integral gain",
        )
        .otherwise("that of the loops of `pdff`")
        .logarithmic(10.0, 1e6),
        derivative_v_s_mm: Parameter::new(
            "controller.pid.derivative_v_s_mm",
            "V s/mm",
            Range::NOT_NEGATIVE,
            "Derivative gain",
        )
        .otherwise("that of the loops of `pdff`")
        .logarithmic(0.01, 10.0),
        filter_hz: Parameter::new(
            "controller.pid.filter_hz",
            "Hz",
            Range::POSITIVE,
            "Corner of the derivative's filter, at most the Nyquist frequency",
        )
        .otherwise("a quarter of the sampling rate")
        .logarithmic(10.0, 5000.0),
    }
);

impl PidGains {
    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        self.check_ranges()?;
        at_most_nyquist::<Self>("filter_hz", self.filter_hz, period_s)
    }
}

/// `u = kp e + ki ∫e + kd d`, `e = x_com - x`, `d` the backward difference of `e` through a first-order low pass:
/// `d += (1 - exp(-2π f Δt)) ((e - e_before)/Δt - d)`.
///
/// Source: K. J. Åström, T. Hägglund, "Advanced PID Control", sections 3.3 and 13.2.
#[derive(Debug, Clone, Copy)]
pub struct Pid {
    gains: PidGains,
    nm_v: f64,
    rate: f64,
    share: f64,
    last: f64,
    derivative: f64,
    integral: Integral,
}

impl Pid {
    /// The controller at rest.
    ///
    /// # Errors
    /// A gain out of its range.
    pub fn new(gains: &PidGains, drive: &Drive, period_s: f64) -> Result<Self, OutOfRange> {
        gains.check(period_s)?;
        Ok(Self {
            gains: *gains,
            nm_v: 1.0 / drive.torque_to_voltage_v_nm,
            rate: 1.0 / period_s,
            share: -libm::expm1(-2.0 * std::f64::consts::PI * gains.filter_hz * period_s),
            last: 0.0,
            derivative: 0.0,
            integral: Integral::new(gains.integral_v_mm_s * period_s),
        })
    }
}

impl Controller for Pid {
    #[inline(always)]
    fn control(&mut self, reference: &AxisReference, feedback: &Feedback) -> ControlOutput {
        let error = reference.position_mm - feedback.position_mm;
        self.derivative += self.share * ((error - self.last) * self.rate - self.derivative);
        self.last = error;
        self.integral.error = error;
        let voltage =
            self.gains.proportional_v_mm * error + self.gains.derivative_v_s_mm * self.derivative + self.integral.sum;
        ControlOutput { velocity_command_rad_s: 0.0, torque_nm: self.nm_v * voltage }
    }

    #[inline(always)]
    fn anti_windup(&mut self, clipped_nm: f64) {
        self.integral.anti_windup(clipped_nm);
    }
}
