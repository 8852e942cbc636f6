//! One phase of a motion: from rest (or a given state) to the commanded feed.

use super::{BernsteinPhase, ExponentialPhase, JerkLimitedPhase, MotionPeaks, MotionSample};
use crate::optimize::golden_section;

/// An acceleration phase of any kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Bernstein feed of degree 1, 3 or 5.
    Bernstein(BernsteinPhase),
    /// The quintic with the exponential modification.
    Exponential(ExponentialPhase),
    /// Constant jerk, constant acceleration, constant jerk.
    JerkLimited(JerkLimitedPhase),
}

impl Phase {
    /// Length of the phase \[s\].
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Bernstein(p) => p.duration_s(),
            Self::Exponential(p) => p.duration_s(),
            Self::JerkLimited(p) => p.duration_s(),
        }
    }

    /// Distance covered in the whole phase \[mm\].
    pub fn distance_mm(&self) -> f64 {
        match self {
            Self::Bernstein(p) => p.distance_mm(),
            Self::Exponential(p) => p.distance_mm(),
            Self::JerkLimited(p) => p.distance_mm(),
        }
    }

    /// Motion `t_s` after the phase began, `0 ≤ t ≤ T` (clamped).
    #[inline]
    pub fn at(&self, t_s: f64) -> MotionSample {
        match self {
            Self::Bernstein(p) => p.at(t_s),
            Self::Exponential(p) => p.at(t_s),
            Self::JerkLimited(p) => p.at(t_s),
        }
    }

    /// Largest magnitudes, found on a fine grid and refined between its points; relative error below 1e-12.
    pub fn peaks(&self) -> MotionPeaks {
        let peak = |pick: &dyn Fn(&MotionSample) -> f64| {
            let duration = self.duration_s();
            maximum(|tau| pick(&self.at(tau * duration)).abs())
        };
        let jerk = match self {
            // The acceleration steps on at the start of the phase: an impulse of jerk.
            Self::Bernstein(p) if p.jumps() => f64::INFINITY,
            _ => peak(&|m| m.jerk_mm_s3),
        };
        MotionPeaks { feed_mm_s: peak(&|m| m.feed_mm_s), accel_mm_s2: peak(&|m| m.accel_mm_s2), jerk_mm_s3: jerk }
    }

    /// The most negative acceleration of the phase, or the smallest \[mm/s²\].
    pub(super) fn lowest_accel_mm_s2(&self) -> f64 {
        let duration = self.duration_s();
        -maximum(|tau| -self.at(tau * duration).accel_mm_s2)
    }
}

/// Largest value of a piecewise smooth function on `[0, 1]`: a grid of 512 intervals, then golden-section search on the two
/// around the best grid point.
fn maximum(f: impl Fn(f64) -> f64) -> f64 {
    const INTERVALS: u32 = 512;
    let step = 1.0 / f64::from(INTERVALS);
    let (mut best_at, mut best) = (0.0, f(0.0));
    for i in 1..=INTERVALS {
        let tau = f64::from(i) * step;
        let value = f(tau);
        if value > best {
            (best_at, best) = (tau, value);
        }
    }
    let (low, high) = ((best_at - step).max(0.0), (best_at + step).min(1.0));
    // 40 rounds shrink the interval by 4e-9; at a smooth peak the value is then exact to rounding.
    best.max(-golden_section(low, high, 40, |tau| -f(tau)).1)
}
