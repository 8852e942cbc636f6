//! How fast a curve may be run: pieces for the look-ahead.
//!
//! With the feed `v`, the tangent `t`, the curvature vector `k` and `k' = dk/ds` a motion at constant feed has the acceleration `v² k`
//! and the jerk `v³ k'`. Within a curve the feed is held to `v ≤ √(a/|k|)` and `v ≤ ∛(j/|k'|)`, at a joint to
//!
//! ```text
//! v ≤ Δv/|t₁ - t₀|          the velocity jumps by v |t₁ - t₀|
//! v ≤ √(Δa/|k₁ - k₀|)       the acceleration jumps by v² |k₁ - k₀|
//! ```
//!
//! with `Δv` the velocity step at corners \[mm/s\] and `Δa` the acceleration step at junctions \[mm/s²\]; `Δa = j Δt` makes of a jump between
//! two setpoints `Δt` apart no more jerk than `j`. Controls have the same two limits at a transition between blocks.

use super::shape::{Motion, Shape};
use super::{Machine, MotionFault};
use crate::feedrate::{LookAhead, PathPiece};
use crate::path::{Cursor, Frame, Path};

/// A difference of unit tangents up to which a joint is smooth: rounding of a program's curves.
const SMOOTH: f64 = 1e-6;

/// Halvings of a curve whose curvature varies.
const MOST_HALVINGS: u32 = 14;

/// Shortest part that is halved \[mm\].
const FINEST_MM: f64 = 0.02;

/// Parts whose speed limits differ by no more than this ratio stay one.
const NEARLY: f64 = 1.05;

/// Turns motions into pieces with their limits, in order.
#[derive(Debug, Clone)]
pub(super) struct FeedPlanner {
    rapid_mm_s: f64,
    lateral_accel: f64,
    jerk: f64,
    velocity_step: f64,
    accel_step: f64,
    /// The end of the last motion, and whether it was a rapid one.
    before: Option<(Frame<3>, bool)>,
    pub(super) look_ahead: LookAhead,
}

impl FeedPlanner {
    /// For a machine that has been checked.
    pub(super) fn new(machine: &Machine) -> Result<Self, MotionFault> {
        Ok(Self {
            rapid_mm_s: machine.rapid_mm_s,
            lateral_accel: machine.lateral_accel_mm_s2,
            jerk: machine.jerk_mm_s3,
            velocity_step: machine.corner_velocity_step_mm_s,
            accel_step: machine.junction_accel_step_mm_s2,
            before: None,
            look_ahead: LookAhead::new(machine.accel_mm_s2, machine.jerk_mm_s3)?,
        })
    }

    /// Plans the next motion. A dwell, and a change between rapid motion and motion at the feed, stop.
    pub(super) fn push(&mut self, motion: &Motion) -> Result<(), MotionFault> {
        let shape = &motion.shape;
        let length = shape.length_mm();
        let feed = motion.feed_mm_s.unwrap_or(self.rapid_mm_s);
        let mut cursor = Cursor::default();
        let first = shape.frame(0.0, &mut cursor);
        let mut joint = match &self.before {
            Some((last, rapid)) if *rapid == motion.place.rapid => self.junction(last, &first),
            _ => 0.0,
        };
        let mut pause_s = motion.pause_s;
        let mut from = 0.0;
        for &jump in shape.curvature_jumps_mm().iter().chain([&length]) {
            if jump > from {
                self.stretch(shape, (from, jump), feed, joint, pause_s)?;
            }
            if jump < length {
                // A jump belongs to what follows it.
                let before = shape.frame(jump.next_down(), &mut cursor);
                joint = self.junction(&before, &shape.frame(jump, &mut cursor));
            }
            (from, pause_s) = (jump, 0.0);
        }
        self.before = Some((shape.frame(length, &mut cursor), motion.place.rapid));
        Ok(())
    }

    /// The highest feed at a joint; `|t₁ - t₀| = 2 sin(θ/2)`.
    fn junction(&self, before: &Frame<3>, after: &Frame<3>) -> f64 {
        let turn = (after.tangent - before.tangent).norm();
        let corner = if turn <= SMOOTH { f64::INFINITY } else { self.velocity_step / turn };
        // Of equal curvatures the quotient is infinite.
        let curvature = (after.curvature_1_mm - before.curvature_1_mm).norm();
        corner.min((self.accel_step / curvature).sqrt())
    }

    /// A stretch without jumps inside, in parts of about the same limit.
    fn stretch(
        &mut self,
        shape: &Shape,
        (from, to): (f64, f64),
        feed_mm_s: f64,
        mut joint_mm_s: f64,
        mut pause_s: f64,
    ) -> Result<(), MotionFault> {
        let mut parts = vec![(from, to, 0)];
        while let Some((low, high, halvings)) = parts.pop() {
            let limit = |low: f64, high: f64| {
                // Without what lies before or behind a jump at its ends.
                let low = low.next_up().min(high);
                let high = high.next_down().max(low);
                let kappa = shape.curvature_bound_1_mm(low, high);
                let rate = shape.curvature_rate_bound_1_mm2(low, high);
                (self.lateral_accel / kappa).sqrt().min(libm::cbrt(self.jerk / rate)).max(1e-6)
            };
            let limit_mm_s = limit(low, high);
            let middle = 0.5 * (low + high);
            let fine = limit_mm_s >= feed_mm_s || halvings == MOST_HALVINGS || high - low <= FINEST_MM;
            if !fine {
                let halves = [limit(low, middle), limit(middle, high)].map(|half| half.min(feed_mm_s));
                if halves.iter().any(|&half| half > NEARLY * limit_mm_s) {
                    parts.push((middle, high, halvings + 1));
                    parts.push((low, middle, halvings + 1));
                    continue;
                }
            }
            self.look_ahead.push(PathPiece { length_mm: high - low, feed_mm_s, limit_mm_s, joint_mm_s, pause_s })?;
            (joint_mm_s, pause_s) = (f64::INFINITY, 0.0);
        }
        Ok(())
    }
}
