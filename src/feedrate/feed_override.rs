//! Feed override and feed hold: the same motion at another pace.

use super::motion::Motion;
use super::phase::{MotionPeaks, MotionSample};
use super::{FeedrateError, positive};

/// Most steps of an override.
pub const MAX_OVERRIDE_STEPS: usize = 10_000;

/// Highest share of the planned feed.
pub const MAX_OVERRIDE: f64 = 2.0;

/// From a time on, another share of the planned feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideStep {
    /// When the pace begins to change \[s\], in the time of the run.
    pub at_s: f64,
    /// The share of the planned feed that it changes to: 1 is the plan, 0 a feed hold, at most [`MAX_OVERRIDE`].
    pub share: f64,
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
/// hold; a step adds at most `1.875 v/T` and, while the plan cruises, `5.774 v/T²` times the change of the share.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedOverride {
    /// The steps, each at least `transition_s` after the one before.
    pub steps: Vec<OverrideStep>,
    /// Length `T` of each change \[s\].
    pub transition_s: f64,
}

/// From the time `t` of the run, which is the time `tau` of the plan, on: a change of the pace, then the steady pace.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    t: f64,
    tau: f64,
    from: f64,
    to: f64,
}

/// A motion at a changing pace.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Overridden {
    plan: Motion,
    pieces: Vec<Piece>,
    transition_s: f64,
    total_s: f64,
    peaks: MotionPeaks,
}

impl Piece {
    /// Time of the plan, pace, and its first two derivatives.
    fn pace(&self, t: f64, transition: f64) -> [f64; 4] {
        let u = t - self.t;
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
            self.tau + self.from * u + change * transition * square * square * (2.5 + x * (x - 3.0)),
            self.from + change * x * square * (10.0 + x * (6.0 * x - 15.0)),
            change * 30.0 * square * rest * rest / transition,
            change * 60.0 * x * rest * (rest - x) / (transition * transition),
        ]
    }
}

impl Overridden {
    pub(super) fn new(plan: Motion, how: &FeedOverride) -> Result<Self, FeedrateError> {
        let transition = positive("transition_s", how.transition_s)?;
        let out = |name, value, needed| Err(FeedrateError::OutOfRange { name, value, needed });
        if how.steps.len() > MAX_OVERRIDE_STEPS {
            return out("override steps", how.steps.len() as f64, "at most 10000");
        }
        let mut pieces = vec![Piece { t: -transition, tau: -transition, from: 1.0, to: 1.0 }];
        for step in &how.steps {
            let Some(before) = pieces.last().copied() else { break };
            if !(step.at_s >= before.t + transition && step.at_s <= 1e9) {
                return out("at_s", step.at_s, "a time from 0 on, each at least transition_s after the one before");
            }
            if !(0.0..=MAX_OVERRIDE).contains(&step.share) {
                return out("override", step.share, "from 0 (hold) to 2 (200 %)");
            }
            let [tau, from, ..] = before.pace(step.at_s, transition);
            pieces.push(Piece { t: step.at_s, tau, from, to: step.share });
        }
        let end = plan.total_s();
        // The piece in which the plan ends, and when.
        pieces.retain(|piece| piece.tau < end);
        let Some(last) = pieces.last().copied() else { return out("total_s", end, "positive") };
        let ramp_end = last.t + transition;
        let [at_ramp_end, ..] = last.pace(ramp_end, transition);
        let total_s = if at_ramp_end < end {
            if !(last.to >= 1e-6) {
                return out("override", last.to, "raised again after a hold: the motion would never end");
            }
            ramp_end + (end - at_ramp_end) / last.to
        } else {
            let (mut low, mut high) = (last.t, ramp_end);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if last.pace(middle, transition)[0] < end { low = middle } else { high = middle }
            }
            high
        };
        let peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let mut motion = Self { plan, pieces, transition_s: transition, total_s, peaks };
        motion.peaks = motion.sampled_peaks();
        Ok(motion)
    }

    /// Peaks at 2000 places of every change and of every steady stretch.
    fn sampled_peaks(&self) -> MotionPeaks {
        const PLACES: u32 = 2000;
        let mut peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let ends = self.pieces.iter().skip(1).map(|piece| piece.t).chain([self.total_s]);
        for (piece, end) in self.pieces.iter().zip(ends) {
            let ramp_end = (piece.t + self.transition_s).min(end);
            for (from, to) in [(piece.t.max(0.0), ramp_end), (ramp_end.max(0.0), end)] {
                for i in 0..=PLACES {
                    let m = self.at(from + (to - from) * f64::from(i) / f64::from(PLACES));
                    peaks.feed_mm_s = peaks.feed_mm_s.max(m.feed_mm_s);
                    peaks.accel_mm_s2 = peaks.accel_mm_s2.max(m.accel_mm_s2.abs());
                    peaks.jerk_mm_s3 = peaks.jerk_mm_s3.max(m.jerk_mm_s3.abs());
                }
            }
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
        let Some(piece) = next.checked_sub(1).and_then(|i| self.pieces.get(i)) else { return MotionSample::default() };
        let [tau, r, r1, r2] = piece.pace(t_s, self.transition_s);
        let m = self.plan.at(tau);
        MotionSample {
            s_mm: m.s_mm,
            feed_mm_s: r * m.feed_mm_s,
            accel_mm_s2: r * r * m.accel_mm_s2 + r1 * m.feed_mm_s,
            jerk_mm_s3: r * r * r * m.jerk_mm_s3 + 3.0 * r * r1 * m.accel_mm_s2 + r2 * m.feed_mm_s,
        }
    }
}
