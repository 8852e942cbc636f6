//! Cross-coupled contour control.

use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};

/// Gains of [`CrossCoupling`], none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossCouplingGains {
    /// `kp`: shift of the command per contouring error.
    pub proportional: f64,
    /// `ki` \[1/s\].
    pub integral_1_s: f64,
    /// `kd` \[s\].
    pub derivative_s: f64,
    /// The command of each axis is shifted by at most this \[µm\], positive.
    pub limit_um: f64,
}

parameters!(
    "Cross-coupled contour control: an offset of the commands against the contouring error itself",
    CrossCouplingGains {
        proportional: Parameter::new(
            "control.cross_coupling.proportional",
            "",
            Range::NOT_NEGATIVE,
            "Offset of the command per contouring error",
        )
        .linear(0.0, 2.0),
        integral_1_s: Parameter::new(
            "control.cross_coupling.integral_1_s",
            "1/s",
            Range::NOT_NEGATIVE,
            "Offset per integral of the contouring error",
        )
        .or(0.0)
        .linear(0.0, 100.0),
        derivative_s: Parameter::new(
            "control.cross_coupling.derivative_s",
            "s",
            Range::NOT_NEGATIVE,
            "Offset per rate of the contouring error",
        )
        .or(0.0)
        .linear(0.0, 0.02),
        limit_um:
            Parameter::new("control.cross_coupling.limit_um", "µm", Range::POSITIVE, "Largest offset of an axis",)
                .or(100.0)
                .logarithmic(1.0, 1000.0),
    }
);

impl CrossCouplingGains {
    /// Every gain in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// A controller of the contouring error itself: from the vector `ε` (nearest point of the path less actual position) to a shift of each
/// axis' position command, `Δ = kp ε + ki ∫ε + kd ε'`, for the next sample.
///
/// Before a position controller of gain `kpp` a shift `Δ` is the velocity command `kpp Δ`: where the cross-coupling controllers of the
/// literature put theirs. The feedforward of the axes takes the command without it.
///
/// Source: Y. Koren, C.-C. Lo, "Variable-gain cross-coupling controller for contouring", CIRP Annals 40, 1991; the vector form after
/// S.-S. Yeh, P.-L. Hsu, IEEE/ASME Transactions on Mechatronics 8, 2003.
#[derive(Debug, Clone, Copy)]
pub struct CrossCoupling<const A: usize> {
    gains: CrossCouplingGains,
    limit_mm: f64,
    period_s: f64,
    last: [f64; A],
    integral: [f64; A],
}

impl<const A: usize> CrossCoupling<A> {
    /// The controller at rest.
    ///
    /// # Errors
    /// A gain out of its range.
    pub fn new(gains: &CrossCouplingGains, period_s: f64) -> Result<Self, OutOfRange> {
        gains.check()?;
        let limit_mm = 1e-3 * gains.limit_um;
        Ok(Self { gains: *gains, limit_mm, period_s, last: [0.0; A], integral: [0.0; A] })
    }

    /// The shifts \[mm\] for the components of the contouring error \[mm\] at this sample. The integral of an axis stands still while
    /// its shift is at the limit.
    #[inline]
    pub fn step(&mut self, error_mm: [f64; A]) -> [f64; A] {
        let mut shifts = [0.0; A];
        for (axis, shift) in shifts.iter_mut().enumerate() {
            let error = error_mm[axis];
            let rate = (error - self.last[axis]) / self.period_s;
            self.last[axis] = error;
            let grown = self.integral[axis] + self.gains.integral_1_s * self.period_s * error;
            let wanted = self.gains.proportional * error + self.gains.derivative_s * rate + grown;
            *shift = wanted.max(-self.limit_mm).min(self.limit_mm);
            if *shift == wanted {
                self.integral[axis] = grown;
            }
        }
        shifts
    }
}
