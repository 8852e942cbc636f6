//! Feed override and feed hold: a planned motion at a changing feed scale.

mod planned_motion;
mod planner;

pub(super) use planned_motion::{AxisDerivatives, Bounds};

use super::motion::Motion;
use super::phase::{MotionPeaks, MotionSample};
use super::{FeedrateError, positive};
use planner::OverridePlanner;

/// Most steps of an override.
pub const MAX_OVERRIDE_STEPS: usize = 1000;

/// Highest override ratio.
pub const MAX_OVERRIDE: f64 = 2.0;

/// From a time on, another override ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideStep {
    /// When the feed scale begins to change \[s\], in the time of the run.
    pub at_s: f64,
    /// Override ratio that it changes to: 1 is the plan, 0 a feed hold, at most [`MAX_OVERRIDE`].
    pub ratio: f64,
    /// The shortest length of the change \[s\]; 0: as short as the limits allow. Where they need more it takes longer.
    pub transition_s: f64,
}

/// Changes of the feed override during a run.
///
/// The plan `s(τ)` is run at the feed scale `f(t) = dτ/dt`, 1 at first, so that along the path
///
/// ```text
/// v = f v(τ)      a = f² a(τ) + f' v(τ)      j = f³ j(τ) + 3 f f' a(τ) + f'' v(τ)
/// ```
///
/// The path is the same and no point of it is skipped. At each step the feed scale goes to the next ratio as fast as the limits allow that
/// the plan itself keeps: the acceleration and the jerk that it reaches along the path ([`Motion::with_override`]), or the limits of every axis
/// ([`AxisLimited::with_override`](super::AxisLimited::with_override)), to 0.1 %. `f''` is constant over short steps. Each step is the
/// largest that the limits allow now and from which the feed scale can still come to a steady ratio, within the limits, on the plan ahead;
/// a steady ratio of at most 1 always keeps them. Where the plan leaves nothing, in a deceleration at its limit, say, the change
/// waits: no machine could slow down faster there.
///
/// A ratio above 1 would ask for its square in acceleration and its cube in jerk. It is therefore used while the plan cruises at a steady feed: the
/// ramps of the plan run at 1, and so does a motion that has no cruise. A change may come while the one before still goes on. A step at
/// the very start, where the tool stands, acts at once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FeedOverride {
    /// The steps in the order of time.
    pub steps: Vec<OverrideStep>,
}

/// Result of a change of the override.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideChange {
    /// When it began \[s\].
    pub at_s: f64,
    /// The override ratio that was asked for.
    pub ratio: f64,
    /// The shortest length that was asked for \[s\]; 0: as short as the limits allow.
    pub asked_s: f64,
    /// How long it took \[s\], to its ratio or to where the next change or the end of the motion cut it off.
    pub transition_s: f64,
    /// The ratio that it came to: `ratio`, but where it was cut off, or where limits allow no ratio above 1.
    pub reached: f64,
    /// Whether it came after the end of the motion, so that it changed nothing.
    pub after_the_end: bool,
}

/// The feed scale at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State {
    /// Time of the run.
    t: f64,
    /// Time of the plan.
    tau: f64,
    /// `f`.
    ratio: f64,
    /// `f'`.
    slope: f64,
}

impl State {
    /// The unchanged plan.
    const PLAN: Self = Self { t: 0.0, tau: 0.0, ratio: 1.0, slope: 0.0 };

    /// With this second derivative of the feed scale for this long.
    fn after(&self, bend: f64, x: f64) -> Self {
        Self {
            t: self.t + x,
            tau: self.tau + x * (self.ratio + x * (0.5 * self.slope + x * bend / 6.0)),
            ratio: self.ratio + x * (self.slope + 0.5 * x * bend),
            slope: self.slope + x * bend,
        }
    }

    /// Where a step passes a time of the plan between its ends.
    fn when(&self, tau: f64, to_tau: f64, (bend, length): (f64, f64)) -> Self {
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
struct Piece {
    from: State,
    bend: f64,
}

/// A motion at a changing feed scale.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Overridden {
    plan: Motion,
    pieces: Vec<Piece>,
    changes: Vec<OverrideChange>,
    total_s: f64,
    peaks: MotionPeaks,
}

impl Piece {
    /// The plan at this feed scale, at most at the time `last` of it.
    fn at(&self, plan: &Motion, t: f64, last: f64) -> MotionSample {
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

impl Overridden {
    /// The plan under an override that keeps these bounds, which the plan keeps; none where no step does anything. `row` tells what the plan
    /// asks of the axes.
    pub(super) fn new<const D: usize>(
        plan: &Motion,
        how: &FeedOverride,
        bounds: Bounds<D>,
        row: &mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>,
    ) -> Result<Option<Self>, FeedrateError> {
        let out = |name, value, needed| Err(FeedrateError::OutOfRange { name, value, needed });
        if how.steps.len() > MAX_OVERRIDE_STEPS {
            return out("override steps", how.steps.len() as f64, "at most 1000");
        }
        let mut before_s = 0.0;
        for (step, &OverrideStep { at_s, ratio, transition_s }) in how.steps.iter().enumerate() {
            if !(0.0..=1e9).contains(&at_s) {
                return out("at_s", at_s, "a time of the run, from 0 to 1e9 s");
            }
            if !(0.0..=MAX_OVERRIDE).contains(&ratio) {
                return out("override", ratio, "from 0 (hold) to 2 (200 %)");
            }
            if transition_s != 0.0 {
                positive("transition_s", transition_s)?;
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
        motion.peaks = motion.sampled_peaks();
        Ok(Some(motion))
    }

    pub(super) fn changes(&self) -> &[OverrideChange] {
        &self.changes
    }

    /// Peaks at 4 places of every step of a change and 2000 of every steady stretch; an acceleration that steps has an infinite jerk all
    /// the same.
    fn sampled_peaks(&self) -> MotionPeaks {
        if self.pieces.is_empty() {
            return self.plan.peaks();
        }
        let mut peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let mut see = |piece: &Piece, to: f64| {
            let from = piece.from.t;
            let places = if piece.bend == 0.0 && piece.from.slope == 0.0 { 2000 } else { 4 };
            for i in 0..=places {
                // Just before the end: there the next piece counts.
                let x = (f64::from(i) / f64::from(places)).min(1.0 - 1e-9);
                let m = piece.at(&self.plan, from + (to - from) * x, f64::INFINITY);
                peaks.feed_mm_s = peaks.feed_mm_s.max(m.feed_mm_s);
                peaks.accel_mm_s2 = peaks.accel_mm_s2.max(m.accel_mm_s2.abs());
                peaks.jerk_mm_s3 = peaks.jerk_mm_s3.max(m.jerk_mm_s3.abs());
            }
        };
        let first = self.pieces.first().map_or(self.total_s, |piece| piece.from.t);
        if first > 0.0 {
            see(&Piece { from: State::PLAN, bend: 0.0 }, first);
        }
        let ends = self.pieces.iter().skip(1).map(|piece| piece.from.t).chain([self.total_s]);
        for (piece, end) in self.pieces.iter().zip(ends) {
            see(piece, end);
        }
        if self.plan.peaks().jerk_mm_s3 == f64::INFINITY {
            peaks.jerk_mm_s3 = f64::INFINITY;
        }
        peaks
    }

    /// Where the jerk may jump next.
    pub(super) fn next_knot(&self, t_s: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.from.t <= t_s);
        self.pieces.get(next).map_or(self.total_s, |piece| piece.from.t)
    }

    pub(super) fn total_s(&self) -> f64 {
        self.total_s
    }

    pub(super) fn length_mm(&self) -> f64 {
        self.plan.length_mm()
    }

    pub(super) fn peaks(&self) -> MotionPeaks {
        self.peaks
    }

    pub(super) fn at(&self, t_s: f64) -> MotionSample {
        let next = self.pieces.partition_point(|piece| piece.from.t <= t_s);
        let Some(piece) = next.checked_sub(1).and_then(|i| self.pieces.get(i)) else { return self.plan.at(t_s) };
        let last = self.pieces.get(next).map_or(f64::INFINITY, |piece| piece.from.tau);
        piece.at(&self.plan, t_s, last)
    }
}
