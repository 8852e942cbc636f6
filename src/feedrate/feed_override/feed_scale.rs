//! The feed scale over time: steps of constant second derivative.

use crate::feedrate::MotionSample;
use crate::feedrate::time_law::TimeLaw;

/// The feed scale at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// Time of the run.
    pub(super) t: f64,
    /// Time of the plan.
    pub(super) tau: f64,
    /// `f`.
    pub(super) ratio: f64,
    /// `f'`.
    pub(super) slope: f64,
}

impl State {
    /// The unchanged plan.
    pub(super) const PLAN: Self = Self { t: 0.0, tau: 0.0, ratio: 1.0, slope: 0.0 };

    /// With this second derivative of the feed scale for this long.
    pub(super) fn after(&self, bend: f64, x: f64) -> Self {
        Self {
            t: self.t + x,
            tau: self.tau + x * (self.ratio + x * (0.5 * self.slope + x * bend / 6.0)),
            ratio: self.ratio + x * (self.slope + 0.5 * x * bend),
            slope: self.slope + x * bend,
        }
    }

    /// Where a step passes a time of the plan between its ends.
    pub(super) fn when(&self, tau: f64, to_tau: f64, (bend, length): (f64, f64)) -> Self {
        let mut x = length * ((tau - self.tau) / (to_tau - self.tau)).clamp(0.0, 1.0);
        for _ in 0..4 {
            let at = self.after(bend, x);
            if !(at.ratio > 1e-9) {
                break;
            }
            x = (x - (at.tau - tau) / at.ratio).clamp(0.0, length);
        }
        self.after(bend, x)
    }
}

/// From a state on: a feed scale whose second derivative is constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub(super) from: State,
    pub(super) bend: f64,
}

impl Piece {
    /// The plan at this feed scale, at most at the time `last` of it.
    pub(super) fn at(&self, plan: &dyn TimeLaw, t: f64, last: f64) -> MotionSample {
        let State { tau, ratio, slope, .. } = self.from.after(self.bend, t - self.from.t);
        // Rounding makes no motion back, and does not run past where the next piece begins.
        let r = ratio.max(0.0);
        let m = plan.at(tau.min(last));
        MotionSample {
            s_mm: m.s_mm,
            feed_mm_s: r * m.feed_mm_s,
            accel_mm_s2: r * r * m.accel_mm_s2 + slope * m.feed_mm_s,
            jerk_mm_s3: r * r * r * m.jerk_mm_s3 + 3.0 * r * slope * m.accel_mm_s2 + self.bend * m.feed_mm_s,
        }
    }
}
