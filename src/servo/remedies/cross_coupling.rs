//! Cross-coupled contour control.

use crate::servo::ServoError;
use crate::servo::parameters::not_negative;

/// Gains of [`CrossCoupling`], none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossCouplingGains {
    /// `kp` \[N m/mm\].
    pub proportional_nm_mm: f64,
    /// `ki` \[N m/(mm s)\].
    pub integral_nm_mm_s: f64,
    /// `kd` \[N m s/mm\].
    pub derivative_nm_s_mm: f64,
    /// The torque of each axis is at most this \[N m\], positive.
    pub limit_nm: f64,
}

impl CrossCouplingGains {
    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), ServoError> {
        not_negative("proportional_nm_mm", self.proportional_nm_mm)?;
        not_negative("integral_nm_mm_s", self.integral_nm_mm_s)?;
        not_negative("derivative_nm_s_mm", self.derivative_nm_s_mm)?;
        crate::servo::parameters::positive("limit_nm", self.limit_nm)
    }
}

/// A controller of the contouring error itself: from the vector `ε` (nearest point of the path less actual position) to a torque of each
/// axis, `T = kp ε + ki ∫ε + kd ε'`, for [`Demand::torque_nm`](crate::servo::Demand::torque_nm) of the next sample.
///
/// Source: Y. Koren, "Cross-coupled biaxial computer control for manufacturing systems", Journal of Dynamic Systems, Measurement,
/// and Control 102, 1980; the vector form after S.-S. Yeh, P.-L. Hsu, IEEE/ASME Transactions on Mechatronics 8, 2003.
#[derive(Debug, Clone, Copy)]
pub struct CrossCoupling<const A: usize> {
    gains: CrossCouplingGains,
    period_s: f64,
    last: [f64; A],
    integral: [f64; A],
}

impl<const A: usize> CrossCoupling<A> {
    /// The controller at rest.
    ///
    /// # Errors
    /// A gain out of its range.
    pub fn new(gains: &CrossCouplingGains, period_s: f64) -> Result<Self, ServoError> {
        gains.check()?;
        Ok(Self { gains: *gains, period_s, last: [0.0; A], integral: [0.0; A] })
    }

    /// The torques \[N m\] for the components of the contouring error \[mm\] at this sample. The integral of an axis stands still while
    /// its torque is at the limit.
    #[inline]
    pub fn step(&mut self, error_mm: [f64; A]) -> [f64; A] {
        let mut torques = [0.0; A];
        for (axis, torque) in torques.iter_mut().enumerate() {
            let error = error_mm[axis];
            let rate = (error - self.last[axis]) / self.period_s;
            self.last[axis] = error;
            let grown = self.integral[axis] + self.gains.integral_nm_mm_s * self.period_s * error;
            let wanted = self.gains.proportional_nm_mm * error + self.gains.derivative_nm_s_mm * rate + grown;
            *torque = wanted.max(-self.gains.limit_nm).min(self.gains.limit_nm);
            if *torque == wanted {
                self.integral[axis] = grown;
            }
        }
        torques
    }
}
