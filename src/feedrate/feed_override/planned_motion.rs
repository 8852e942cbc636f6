//! The planned motion: velocity, acceleration and jerk of every axis over the time of the plan.

use super::feed_scale::State;
use crate::feedrate::MotionSample;
use crate::feedrate::time_law::TimeLaw;

/// How far inside an interval its ends are looked at: the plan's jerk may jump there.
const INSET: f64 = 1e-6;

/// What the plan does to every axis at a time of its own, as a change of the feed scale sees it: at the feed scale `f` the axis makes
/// `f² a + f' v` of acceleration and `f³ j + 3 f f' a + f'' v` of jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct AxisDerivatives<const D: usize> {
    pub(in super::super) velocity: [f64; D],
    pub(in super::super) acceleration: [f64; D],
    pub(in super::super) jerk: [f64; D],
}

impl AxisDerivatives<1> {
    /// Along the path.
    pub(in super::super) fn along(m: &MotionSample) -> Self {
        Self { velocity: [m.feed_mm_s], acceleration: [m.accel_mm_s2], jerk: [m.jerk_mm_s3] }
    }
}

/// What each axis may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Bounds<const D: usize> {
    pub(in super::super) accel: [f64; D],
    pub(in super::super) jerk: [f64; D],
}

/// An interval of the plan's time without a jump of its jerk: a parabola through three places.
#[derive(Debug, Clone, Copy)]
struct Interval<const D: usize> {
    from: f64,
    to: f64,
    rows: [AxisDerivatives<D>; 3],
}

impl<const D: usize> Interval<D> {
    fn at(&self, tau: f64) -> AxisDerivatives<D> {
        let x = ((tau - self.from) / (self.to - self.from)).clamp(0.0, 1.0);
        let weights = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
        let mix = |pick: fn(&AxisDerivatives<D>) -> &[f64; D]| {
            std::array::from_fn(|i| self.rows.iter().zip(weights).map(|(row, weight)| weight * pick(row)[i]).sum())
        };
        AxisDerivatives {
            velocity: mix(|r| &r.velocity),
            acceleration: mix(|r| &r.acceleration),
            jerk: mix(|r| &r.jerk),
        }
    }
}

/// The plan ahead, laid out as far as it has been looked at.
pub(super) struct PlannedMotion<'a, const D: usize> {
    plan: &'a dyn TimeLaw,
    row: &'a mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>,
    intervals: Vec<Interval<D>>,
    end: f64,
    /// Widest interval \[s\].
    width: f64,
    /// Up to where intervals have been laid.
    laid: f64,
}

impl<'a, const D: usize> PlannedMotion<'a, D> {
    pub(super) fn new(plan: &'a dyn TimeLaw, row: &'a mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>) -> Self {
        let end = plan.total_s();
        Self { plan, row, intervals: Vec::new(), end, width: end, laid: 0.0 }
    }

    /// Forgets what lies behind, and lays intervals of this width from here on.
    pub(super) fn restart(&mut self, tau: f64, width: f64) {
        self.intervals.clear();
        self.laid = tau;
        self.width = width;
    }

    /// Panels to come have this width.
    pub(super) fn set_width(&mut self, width: f64) {
        self.width = width;
        // A long wait leaves much behind.
        if self.intervals.len() > 20_000 {
            self.intervals.drain(..10_000);
        }
    }

    fn lay(&mut self, tau: f64) {
        while self.laid <= tau && self.laid < self.end {
            let from = self.laid;
            let to = (from + self.width).min(self.plan.next_knot(from)).min(self.end);
            let to = if to > from { to } else { from.next_up() };
            let inset = INSET * (to - from);
            let rows = [from + inset, 0.5 * (from + to), to - inset].map(|tau| (self.row)(&self.plan.at(tau)));
            self.intervals.push(Interval { from, to, rows });
            self.laid = to;
        }
    }

    /// The plan at a time that may be anywhere.
    pub(super) fn fresh(&mut self, tau: f64) -> AxisDerivatives<D> {
        (self.row)(&self.plan.at(tau))
    }

    /// The plan at a time.
    pub(super) fn at(&mut self, tau: f64) -> Option<AxisDerivatives<D>> {
        self.lay(tau);
        let i = self.intervals.partition_point(|interval| interval.to <= tau);
        self.intervals.get(i).map(|interval| interval.at(tau))
    }

    /// Shows `see` the plan, the feed scale and its slope at both ends of a step and on both sides of the intervals' ends within; false as soon
    /// as it says so.
    pub(super) fn walk(
        &mut self,
        from: &State,
        (bend, length): (f64, f64),
        mut see: impl FnMut(&AxisDerivatives<D>, f64, f64) -> bool,
    ) -> bool {
        let to = from.after(bend, length);
        self.lay(to.tau);
        let mut i = self.intervals.partition_point(|interval| interval.to <= from.tau);
        let Some(mut interval) = self.intervals.get(i) else { return true };
        if !see(&interval.at(from.tau), from.ratio, from.slope) {
            return false;
        }
        while interval.to < to.tau {
            let at = from.when(interval.to, to.tau, (bend, length));
            let next = self.intervals.get(i + 1);
            if !see(&interval.rows[2], at.ratio, at.slope) || next.is_some_and(|n| !see(&n.rows[0], at.ratio, at.slope))
            {
                return false;
            }
            let Some(next) = next else { return true };
            interval = next;
            i += 1;
        }
        see(&interval.at(to.tau), to.ratio, to.slope)
    }
}
