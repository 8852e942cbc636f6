//! The PDFF control law, once for the ideal loop (one axis or many, in volts) and for the detailed drive model (in newton metres).

use crate::lane::Lane;

/// Pseudo-derivative feedback with feedforward:
///
/// ```text
/// ω_com = kpp (x_com - x) + kpf ẋ_com
/// u     = u_com ω_com - u_ω ω + Σ u_i (ω_com - ω)
/// ```
///
/// with `u_com = g kpv kvf`, `u_ω = g kpv`, `u_i = g kpv kiv Δt`, `g` the factor from torque to the unit of the output `u`: 1 for N m, V/(N m)
/// for volts. Source: G. Ellis, "Control System Design Guide", 4th edition, chapter 6.
#[derive(Debug, Clone, Copy)]
pub(super) struct PdffLaw<L: Lane> {
    /// `kpp` \[rad/s/mm\].
    pub(super) kpp: L,
    /// `kpf` \[rad/mm\].
    pub(super) kpf: L,
    /// `u_com`.
    pub(super) forward: L,
    /// `u_ω`.
    pub(super) feedback: L,
    /// `u_i`.
    pub(super) rate: L,
    /// The sum, in the unit of the output.
    pub(super) integral: L,
}

impl<L: Lane> PdffLaw<L> {
    /// `ω_com` \[rad/s\] and `u` before any clamp, from the following error \[mm\], the velocity of the command \[mm/s\] and `ω` \[rad/s\].
    #[inline(always)]
    pub(super) fn output(&self, following_error: L, velocity: L, omega: L) -> (L, L) {
        let velocity_command = self.kpp.mul_add(following_error, self.kpf * velocity);
        let unclamped = self.forward.mul_add(velocity_command, (-self.feedback).mul_add(omega, self.integral));
        (velocity_command, unclamped)
    }

    /// Conditional integration of the velocity error \[rad/s\]: the integral waits while it would drive a clamped output further out. What
    /// the clamp took away, `clipped`, is zero, or has the sign of the output.
    #[inline(always)]
    pub(super) fn integrate(&mut self, error: L, clipped: L) {
        let outwards = (clipped * error).gt(error.all(0.0));
        self.integral = self.integral.or_else(outwards, self.rate.mul_add(error, self.integral));
    }
}
