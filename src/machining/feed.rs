//! How fast a curve may be run: pieces for the look-ahead.

use nalgebra::SVector;

use super::shape::{Motion, Shape};
use super::{Machine, MotionFault};
use crate::feedrate::{LookAhead, PathPiece};
use crate::path::{Cursor, Path};

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
    corner_step: f64,
    /// Tangent at the end of the last motion, and whether it was a rapid one.
    before: Option<(SVector<f64, 3>, bool)>,
    pub(super) look_ahead: LookAhead,
}

impl FeedPlanner {
    /// For a machine that has been checked.
    pub(super) fn new(machine: &Machine) -> Result<Self, MotionFault> {
        Ok(Self {
            rapid_mm_s: machine.rapid_mm_s,
            lateral_accel: machine.lateral_accel_mm_s2,
            corner_step: machine.corner_velocity_step_mm_s,
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
        let first = shape.frame(0.0, &mut cursor).tangent;
        let mut joint = match self.before {
            Some((tangent, rapid)) if rapid == motion.place.rapid => self.corner(&tangent, &first),
            _ => 0.0,
        };
        let mut pause_s = motion.pause_s;
        let mut from = 0.0;
        for &corner in shape.corners_mm().iter().chain([&length]) {
            if corner > from {
                self.stretch(shape, (from, corner), feed, joint, pause_s)?;
            }
            if corner < length {
                // A corner belongs to what follows it.
                let before = shape.frame(corner.next_down(), &mut cursor).tangent;
                joint = self.corner(&before, &shape.frame(corner, &mut cursor).tangent);
            }
            (from, pause_s) = (corner, 0.0);
        }
        self.before = Some((shape.frame(length, &mut cursor).tangent, motion.place.rapid));
        Ok(())
    }

    /// The highest speed at a joint: `|t_1 - t_0| = 2 sin(θ/2)`.
    fn corner(&self, before: &SVector<f64, 3>, after: &SVector<f64, 3>) -> f64 {
        let jump = (after - before).norm();
        if jump <= SMOOTH { f64::INFINITY } else { self.corner_step / jump }
    }

    /// A stretch without corners inside, in parts of about the same limit.
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
                // What ends on a corner is bounded without it.
                let kappa = shape.curvature_bound_1_mm(low, high.next_down().max(low));
                if kappa > 0.0 { (self.lateral_accel / kappa).sqrt().max(1e-6) } else { f64::INFINITY }
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
