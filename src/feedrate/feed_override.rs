//! Feed override and feed hold: the same motion at another pace.

use super::motion::Motion;
use super::phase::{MotionPeaks, MotionSample};
use super::{FeedrateError, positive};

/// Most steps of an override.
pub const MAX_OVERRIDE_STEPS: usize = 1000;

/// Highest share of the planned feed.
pub const MAX_OVERRIDE: f64 = 2.0;

/// From a time on, another share of the planned feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideStep {
    /// When the pace begins to change \[s\], in the time of the run.
    pub at_s: f64,
    /// The share of the planned feed that it changes to: 1 is the plan, 0 a feed hold, at most [`MAX_OVERRIDE`].
    pub share: f64,
    /// Length `T` of the change \[s\].
    pub transition_s: f64,
}

impl OverrideStep {
    /// The shortest length \[s\] of a change of the share by `change` that itself makes at most this acceleration and jerk along the
    /// path, while the plan runs at `feed_mm_s`: `max(1.875 |c| v/a, √(5.774 |c| v/j))`. An infinite limit does not count.
    pub fn shortest_transition_s(change: f64, feed_mm_s: f64, accel_mm_s2: f64, jerk_mm_s3: f64) -> f64 {
        let speed = change.abs() * feed_mm_s;
        // The largest slope and bend of the S-curve.
        let (slope, bend) = (1.875, 10.0 / 3.0_f64.sqrt());
        (slope * speed / accel_mm_s2).max((bend * speed / jerk_mm_s3).sqrt()).clamp(1e-6, 1e9)
    }
}

/// How an operator turns the feed override during a run.
///
/// The plan `s(τ)` is run at the pace `r(t) = dτ/dt`, 1 at first. Each step takes it to the next share along the S-curve
/// `10x³ - 15x⁴ + 6x⁵`, so that along the path
///
/// ```text
/// v = r v(τ)      a = r² a(τ) + ṙ v(τ)      j = r³ j(τ) + 3 r ṙ a(τ) + r̈ v(τ)
/// ```
///
/// stay as smooth as the plan's; the path is the same, and no point of it is left out. At a steady share of at most 1 the plan's limits
/// hold; a step adds at most `1.875 v/T` to the acceleration and, while the plan cruises straight on, `5.774 v/T²` to the jerk, times the
/// change of the share ([`OverrideStep::shortest_transition_s`]). Where a step falls into the plan's own acceleration the two add up: a
/// longer `T` lessens that. (A scenario under limits of the axes lengthens it until they keep their limits, their jerks to 5 %.)
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FeedOverride {
    /// The steps, each after the change of the one before is over.
    pub steps: Vec<OverrideStep>,
}

/// From the time `t` of the run, which is the time `tau` of the plan, on: a change of the pace, then the steady pace.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    t: f64,
    tau: f64,
    from: f64,
    to: f64,
    transition: f64,
}

/// A motion at a changing pace.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Overridden {
    plan: Motion,
    pieces: Vec<Piece>,
    /// The steps that take place.
    steps: Vec<OverrideStep>,
    total_s: f64,
    peaks: MotionPeaks,
}

impl Piece {
    /// The plan as it is.
    const PLAN: Self = Self { t: 0.0, tau: 0.0, from: 1.0, to: 1.0, transition: 0.0 };

    /// The plan at this pace.
    fn at(&self, plan: &Motion, t: f64) -> MotionSample {
        let [tau, r, r1, r2] = self.pace(t);
        let m = plan.at(tau);
        MotionSample {
            s_mm: m.s_mm,
            feed_mm_s: r * m.feed_mm_s,
            accel_mm_s2: r * r * m.accel_mm_s2 + r1 * m.feed_mm_s,
            jerk_mm_s3: r * r * r * m.jerk_mm_s3 + 3.0 * r * r1 * m.accel_mm_s2 + r2 * m.feed_mm_s,
        }
    }

    /// Time of the plan, pace, and its first two derivatives.
    fn pace(&self, t: f64) -> [f64; 4] {
        let (u, transition) = (t - self.t, self.transition);
        let change = self.to - self.from;
        if u >= transition {
            return [
                self.tau + (self.from + 0.5 * change) * transition + self.to * (u - transition),
                self.to,
                0.0,
                0.0,
            ];
        }
        let x = u / transition;
        let (square, rest) = (x * x, 1.0 - x);
        [
            // Rounding must not run past where the change ends.
            (self.tau + self.from * u + change * transition * square * square * (2.5 + x * (x - 3.0)))
                .min(self.tau + (self.from + 0.5 * change) * transition),
            self.from + change * x * square * (10.0 + x * (6.0 * x - 15.0)),
            change * 30.0 * square * rest * rest / transition,
            change * 60.0 * x * rest * (rest - x) / (transition * transition),
        ]
    }
}

impl Overridden {
    /// None where no step changes anything: the plan itself.
    pub(super) fn new(plan: Motion, how: &FeedOverride) -> Result<Option<Self>, FeedrateError> {
        let out = |name, value, needed| Err(FeedrateError::OutOfRange { name, value, needed });
        if how.steps.len() > MAX_OVERRIDE_STEPS {
            return out("override steps", how.steps.len() as f64, "at most 1000");
        }
        let end = plan.total_s();
        let (mut pieces, mut steps) = (vec![Piece::PLAN], Vec::new());
        let mut last = Piece::PLAN;
        let mut last_step = 0;
        for (index, step) in how.steps.iter().enumerate() {
            let &OverrideStep { at_s, share, transition_s } = step;
            let transition = positive("transition_s", transition_s)?;
            if !(0.0..=1e9).contains(&at_s) {
                return out("at_s", at_s, "a time of the run, from 0 to 1e9 s");
            }
            if !(0.0..=MAX_OVERRIDE).contains(&share) {
                return out("override", share, "from 0 (hold) to 2 (200 %)");
            }
            let ready_s = last.t + last.transition;
            if at_s < ready_s {
                return Err(FeedrateError::OverrideTooSoon { step: index, at_s, ready_s });
            }
            let [tau, from, ..] = last.pace(at_s);
            // What comes after the end, and what changes nothing, leaves the plan as it is.
            if tau < end && share != from {
                last = Piece { t: at_s, tau, from, to: share, transition };
                last_step = index;
                pieces.push(last);
                steps.push(*step);
            }
        }
        if steps.is_empty() {
            return Ok(None);
        }
        let ramp_end = last.t + last.transition;
        let [at_ramp_end, ..] = last.pace(ramp_end);
        let total_s = if at_ramp_end < end {
            if !(last.to >= 1e-6) {
                return Err(FeedrateError::HeldForEver { step: last_step, at_s: last.t });
            }
            ramp_end + (end - at_ramp_end) / last.to
        } else {
            let (mut low, mut high) = (last.t, ramp_end);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if last.pace(middle)[0] < end { low = middle } else { high = middle }
            }
            high
        };
        let peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let mut motion = Self { plan, pieces, steps, total_s, peaks };
        motion.peaks = motion.sampled_peaks();
        Ok(Some(motion))
    }

    pub(super) fn steps(&self) -> &[OverrideStep] {
        &self.steps
    }

    /// Peaks at 500 places of every change and 2000 of every steady stretch; an acceleration that steps has an infinite jerk all the same.
    fn sampled_peaks(&self) -> MotionPeaks {
        let mut peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let ends = self.pieces.iter().skip(1).map(|piece| piece.t).chain([self.total_s]);
        for (piece, end) in self.pieces.iter().zip(ends) {
            let ramp_end = (piece.t + piece.transition).min(end);
            for (from, to, places) in [(piece.t, ramp_end, 500), (ramp_end, end, 2000)] {
                for i in 0..=places {
                    let m = self.at(from + (to - from) * f64::from(i) / f64::from(places));
                    peaks.feed_mm_s = peaks.feed_mm_s.max(m.feed_mm_s);
                    peaks.accel_mm_s2 = peaks.accel_mm_s2.max(m.accel_mm_s2.abs());
                    peaks.jerk_mm_s3 = peaks.jerk_mm_s3.max(m.jerk_mm_s3.abs());
                }
            }
        }
        if self.plan.peaks().jerk_mm_s3 == f64::INFINITY {
            peaks.jerk_mm_s3 = f64::INFINITY;
        }
        peaks
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
        let next = self.pieces.partition_point(|piece| piece.t <= t_s);
        let Some(piece) = next.checked_sub(1).and_then(|i| self.pieces.get(i)) else { return self.plan.at(t_s) };
        piece.at(&self.plan, t_s)
    }
}

/// Changes one after the other, whose lengths are to be found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turning {
    last: Piece,
}

impl Turning {
    /// Before the first.
    pub(crate) const START: Self = Self { last: Piece::PLAN };

    /// The length of the next change: the shortest one, or in steps of a fifth a longer one until the motion during the change is fine
    /// with `fits` (up to 80 times the shortest).
    pub(crate) fn fitting_s(
        &self,
        plan: &Motion,
        (at_s, share): (f64, f64),
        shortest_s: f64,
        mut fits: impl FnMut(&MotionSample) -> bool,
    ) -> f64 {
        const PLACES: u32 = 300;
        let [tau, from, ..] = self.last.pace(at_s);
        let mut transition = shortest_s;
        for _ in 0..24 {
            let piece = Piece { t: at_s, tau, from, to: share, transition };
            if (0..=PLACES)
                .all(|i| fits(&piece.at(plan, at_s + transition * (f64::from(i) / f64::from(PLACES)).next_down())))
            {
                break;
            }
            transition *= 1.2;
        }
        transition
    }

    /// Goes on behind this change.
    pub(crate) fn turn(&mut self, step: &OverrideStep) {
        let [tau, from, ..] = self.last.pace(step.at_s);
        self.last = Piece { t: step.at_s, tau, from, to: step.share, transition: step.transition_s };
    }
}
