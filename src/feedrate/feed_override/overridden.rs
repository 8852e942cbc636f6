//! A motion under a feed override.

use super::feed_scale::{Piece, State};
use super::planned_motion::{AxisDerivatives, Bounds};
use super::planner::OverridePlanner;
use super::steps::{FeedOverride, MAX_OVERRIDE_STEPS, OverrideChange, OverrideStep};
use crate::feedrate::parameters::{AT, RATIO, TRANSITION, within};
use crate::feedrate::time_law::TimeLaw;
use crate::feedrate::{FeedrateError, MotionPeaks, MotionSample};
use crate::optimize::golden_section;
use crate::parameters::OutOfRange;

/// A motion at a changing feed scale; `M` is that of the plan.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::feedrate) struct Overridden<M> {
    plan: M,
    pieces: Vec<Piece>,
    changes: Vec<OverrideChange>,
    total_s: f64,
    peaks: MotionPeaks,
}

impl<M: TimeLaw + Clone> Overridden<M> {
    /// The plan under an override that keeps these bounds, which the plan keeps; none where no step does anything. `row` tells what the plan
    /// asks of the axes.
    pub(in crate::feedrate) fn new<const D: usize>(
        plan: &M,
        how: &FeedOverride,
        bounds: Bounds<D>,
        row: &mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>,
    ) -> Result<Option<Self>, FeedrateError> {
        if how.steps.len() > MAX_OVERRIDE_STEPS {
            let count = how.steps.len() as f64;
            return Err(OutOfRange::new("override steps", count, "at most 1000").into());
        }
        let mut before_s = 0.0;
        for (step, &OverrideStep { at_s, ratio, transition_s }) in how.steps.iter().enumerate() {
            within(&AT, at_s)?;
            within(&RATIO, ratio)?;
            if transition_s != 0.0 {
                within(&TRANSITION, transition_s)?;
            }
            if at_s < before_s {
                return Err(FeedrateError::OverrideOrder { step, at_s, before_s });
            }
            before_s = at_s;
        }
        let mut planner = OverridePlanner::new(plan, bounds, row);
        for (index, step) in how.steps.iter().enumerate() {
            planner.turn(index, step);
        }
        let (pieces, changes, total_s) = planner.finish()?;
        if changes.is_empty() {
            return Ok(None);
        }
        let peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let mut motion = Self { plan: plan.clone(), pieces, changes, total_s, peaks };
        motion.peaks = motion.refined_peaks();
        Ok(Some(motion))
    }

    pub(in crate::feedrate) fn changes(&self) -> &[OverrideChange] {
        &self.changes
    }

    /// Peaks from 4 places of every step of a change and 2000 of every steady stretch, each refined between the places beside the
    /// largest: a stretch that no change has touched has the peaks of the plan. An acceleration that steps has an infinite jerk all the same.
    fn refined_peaks(&self) -> MotionPeaks {
        if self.pieces.is_empty() {
            return self.plan.peaks();
        }
        let first = self.pieces.first().map_or(self.total_s, |piece| piece.from.t);
        let plan = Piece { from: State::PLAN, bend: 0.0 };
        let before = (first > 0.0).then_some((&plan, first));
        let ends = self.pieces.iter().skip(1).map(|piece| piece.from.t).chain([self.total_s]);
        let stretches: Vec<(&Piece, f64)> = before.into_iter().chain(self.pieces.iter().zip(ends)).collect();
        let peak = |pick: fn(&MotionSample) -> f64| {
            // The largest: its value, its piece, and the times beside it.
            let mut best = (0.0, None);
            for &(piece, to) in &stretches {
                let from = piece.from.t;
                let places = if piece.bend == 0.0 && piece.from.slope == 0.0 { 2000 } else { 4 };
                // Just before the end: there the next piece counts.
                let when = |i: f64| from + (to - from) * (i / f64::from(places)).clamp(0.0, 1.0 - 1e-9);
                for i in (0..=places).map(f64::from) {
                    let value = pick(&piece.at(&self.plan, when(i), f64::INFINITY)).abs();
                    if value > best.0 {
                        best = (value, Some((piece, when(i - 1.0), when(i + 1.0))));
                    }
                }
            }
            let (value, Some((piece, low, high))) = best else { return 0.0 };
            let at = |t: f64| pick(&piece.at(&self.plan, t, f64::INFINITY)).abs();
            value.max(-golden_section(low, high, 40, |t| -at(t)).1)
        };
        let mut peaks = MotionPeaks {
            feed_mm_s: peak(|m| m.feed_mm_s),
            accel_mm_s2: peak(|m| m.accel_mm_s2),
            jerk_mm_s3: peak(|m| m.jerk_mm_s3),
        };
        if self.plan.peaks().jerk_mm_s3 == f64::INFINITY {
            peaks.jerk_mm_s3 = f64::INFINITY;
        }
        peaks
    }

    /// Where the jerk may jump next.
    pub(in crate::feedrate) fn next_knot(&self, t_s: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.from.t <= t_s);
        self.pieces.get(next).map_or(self.total_s, |piece| piece.from.t)
    }

    pub(in crate::feedrate) fn total_s(&self) -> f64 {
        self.total_s
    }

    pub(in crate::feedrate) fn length_mm(&self) -> f64 {
        self.plan.length_mm()
    }

    pub(in crate::feedrate) fn peaks(&self) -> MotionPeaks {
        self.peaks
    }

    pub(in crate::feedrate) fn at(&self, t_s: f64) -> MotionSample {
        let next = self.pieces.partition_point(|piece| piece.from.t <= t_s);
        let Some(piece) = next.checked_sub(1).and_then(|i| self.pieces.get(i)) else { return self.plan.at(t_s) };
        let last = self.pieces.get(next).map_or(f64::INFINITY, |piece| piece.from.tau);
        piece.at(&self.plan, t_s, last)
    }
}
