//! The exponential modification of the quintic: lower peak jerk in the same time and distance.

use super::parameters::{FEED, N_C, PHASE, within};
use std::ops::RangeInclusive;

use super::FeedrateError;
use super::motion_sample::MotionSample;

/// Exponents that [`ExponentialPhase`] takes.
///
/// Below 1 the closed form of `s(t)` loses digits (and the modification vanishes: use the quintic); above 20 the
/// end accelerations exceed 4.8e8 mm/s².
pub const N_C_RANGE: RangeInclusive<f64> = 1.0..=20.0;

/// From rest to a feed: the quintic whose end accelerations depend on `τ`,
///
/// ```text
/// a_i(τ) = A (1 - exp(n_c τ))      a_f(τ) = A (1 - exp(n_c (1-τ)))      A = 1 mm/s²
/// ```
///
/// which vanish at their own ends, steepen the ends of the phase and flatten its middle. Written out, with
/// `h(τ) = τ (1-τ)³ (1 + 3τ)` and `E(τ) = (exp(n_c τ) - 1) h(τ)`,
///
/// ```text
/// V(τ) = V_f (10τ³ - 15τ⁴ + 6τ⁵) + A T (E(1-τ) - E(τ))
/// ```
///
/// Distance, acceleration and jerk are its integral and derivatives in closed form. `V` is antisymmetric about `τ = ½`,
/// so that the phase covers `V_f T/2`. Source: Jahanpour et al., section 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExponentialPhase {
    duration_s: f64,
    feed_mm_s: f64,
    n_c: f64,
    /// `A`: 1 mm/s² at the commanded feed, less where a short path lowers the feed.
    amplitude_mm_s2: f64,
    /// `∫ exp(n τ) h dτ = exp(n τ) Σ antiderivative[k] τ^k`.
    antiderivative: [f64; 6],
    /// `∫₀¹ E dτ`.
    whole: f64,
    /// `exp(n_c)`.
    exp_n_c: f64,
}

/// `h(τ) = τ - 6τ³ + 8τ⁴ - 3τ⁵` in powers of τ.
const H: [f64; 6] = [0.0, 1.0, 0.0, -6.0, 8.0, -3.0];

impl ExponentialPhase {
    /// From rest to `feed_mm_s` in `duration_s` with exponent `n_c`.
    ///
    /// # Errors
    /// Feed or duration not between 1e-9 and 1e9, `n_c` outside [`N_C_RANGE`].
    pub fn new(feed_mm_s: f64, duration_s: f64, n_c: f64) -> Result<Self, FeedrateError> {
        Self::scaled(feed_mm_s, duration_s, n_c, 1.0)
    }

    /// The same shape at `share` of the commanded feed: feed, acceleration and jerk all fall by that factor.
    pub(super) fn scaled(feed_mm_s: f64, duration_s: f64, n_c: f64, share: f64) -> Result<Self, FeedrateError> {
        within(&FEED, feed_mm_s)?;
        within(&PHASE, duration_s)?;
        within(&N_C, n_c)?;
        // Integration by parts, from the highest power down: q_k = (h_k - (k+1) q_{k+1}) / n.
        let mut antiderivative = [0.0; 6];
        let mut above = 0.0;
        for k in (0..6).rev() {
            antiderivative[k] = (H[k] - (k as f64 + 1.0) * above) / n_c;
            above = antiderivative[k];
        }
        let mut phase = Self {
            duration_s,
            feed_mm_s: feed_mm_s * share,
            n_c,
            amplitude_mm_s2: share,
            antiderivative,
            whole: 0.0,
            exp_n_c: libm::exp(n_c),
        };
        phase.whole = phase.integral(1.0, phase.exp_n_c);
        Ok(phase)
    }

    /// Length of the phase \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Distance covered in the whole phase: `V_f T/2` \[mm\].
    pub fn distance_mm(&self) -> f64 {
        0.5 * self.feed_mm_s * self.duration_s
    }

    /// `∫₀^τ E`, given `exp = exp(n_c τ)`.
    fn integral(&self, tau: f64, exp: f64) -> f64 {
        let q = self.antiderivative.iter().rev().fold(0.0, |sum, &c| sum * tau + c);
        let h = tau * tau * (0.5 + tau * tau * (-1.5 + tau * (1.6 - 0.5 * tau)));
        exp * q - self.antiderivative[0] - h
    }

    /// `E` and its first two derivatives, given `exp = exp(n_c τ)`.
    fn bump(&self, tau: f64, exp: f64) -> [f64; 3] {
        let n = self.n_c;
        let rest = 1.0 - tau;
        let h = tau * rest * rest * rest * (1.0 + 3.0 * tau);
        let h1 = 1.0 + tau * tau * (-18.0 + tau * (32.0 - 15.0 * tau));
        let h2 = tau * (-36.0 + tau * (96.0 - 60.0 * tau));
        [(exp - 1.0) * h, n * exp * h + (exp - 1.0) * h1, n * exp * (n * h + 2.0 * h1) + (exp - 1.0) * h2]
    }

    /// Motion `t_s` after the phase began (clamped to the phase).
    pub fn at(&self, t_s: f64) -> MotionSample {
        let duration = self.duration_s;
        let tau = (t_s / duration).clamp(0.0, 1.0);
        let rest = 1.0 - tau;
        let exp = libm::exp(self.n_c * tau);
        let exp_rest = self.exp_n_c / exp;
        let [e, e1, e2] = self.bump(tau, exp);
        let [f, f1, f2] = self.bump(rest, exp_rest);
        let lift = self.amplitude_mm_s2 * duration;
        let feed = self.feed_mm_s;

        let t2 = tau * tau;
        let s_area = t2 * t2 * (2.5 + tau * (-3.0 + tau));
        let s = tau * t2 * (10.0 + tau * (-15.0 + 6.0 * tau));
        let s1 = 30.0 * t2 * rest * rest;
        let s2 = 60.0 * tau * rest * (rest - tau);
        let area = self.whole - self.integral(rest, exp_rest) - self.integral(tau, exp);
        MotionSample {
            s_mm: duration * (feed * s_area + lift * area),
            feed_mm_s: feed * s + lift * (f - e),
            accel_mm_s2: (feed * s1 - lift * (f1 + e1)) / duration,
            jerk_mm_s3: (feed * s2 + lift * (f2 - e2)) / (duration * duration),
        }
    }
}
