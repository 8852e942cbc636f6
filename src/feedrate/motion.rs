//! Motion along a path of a given length: accelerate, cruise, decelerate.

use super::parameters::{ACCEL, FEED, JERK, PHASE, within};
use std::sync::Arc;

use super::feed_override::{AxisDerivatives, Bounds, FeedOverride, Overridden, OverrideChange};
use super::planned::Planned;
use super::time_law::TimeLaw;
use super::{
    BernsteinPhase, ExponentialPhase, FeedState, FeedrateError, JerkLimitedPhase, MotionPeaks, MotionSample, Phase,
    positive,
};

/// How the feed is reached and left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    /// Degree 1: constant acceleration (a trapezoidal feed); the jerk is infinite at the ends of the phase.
    Linear {
        /// Phase length `T` \[s\].
        phase_s: f64,
    },
    /// Degree 3: acceleration continuous, jerk not.
    Cubic {
        /// Phase length `T` \[s\].
        phase_s: f64,
    },
    /// Degree 5: the S-curve with continuous jerk.
    Quintic {
        /// Phase length `T` \[s\].
        phase_s: f64,
    },
    /// Degree 5 with the exponential modification.
    Exponential {
        /// Phase length `T` \[s\].
        phase_s: f64,
        /// Exponent `n_c`, 1 to 20.
        n_c: f64,
    },
    /// Seven phases with bounded acceleration and jerk.
    JerkLimited {
        /// Acceleration limit \[mm/s²\].
        accel_mm_s2: f64,
        /// Jerk limit \[mm/s³\].
        jerk_mm_s3: f64,
    },
}

/// Motion `s(t)` from rest to rest along a length: acceleration, cruise at the feed, mirrored deceleration.
///
/// Where the path is too short to reach the feed the peak feed falls: the phases keep their shape (and, but for the
/// jerk-limited ones, their length), so that acceleration and jerk fall with it, and the motion still ends at rest
/// exactly at the end.
///
/// A motion under axis limits ([`AxisLimited`](super::AxisLimited)) has no such phases: it is a table, which clones share.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    law: Law,
    phase_s: f64,
    phase_mm: f64,
    cruise_s: f64,
    feed_mm_s: f64,
    length_mm: f64,
    total_s: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Law {
    /// This acceleration, cruise, and the acceleration mirrored.
    Phases(Phase),
    /// Node by node.
    Planned(Arc<Planned>),
    /// Another motion at a changing feed scale.
    Overridden(Arc<Overridden<Motion>>),
}

impl Motion {
    /// A motion from a table.
    pub(super) fn of_planned(planned: Planned) -> Self {
        let (total_s, length_mm, feed_mm_s) = (planned.total_s(), planned.length_mm(), planned.peaks().feed_mm_s);
        Self::without_phases(Law::Planned(Arc::new(planned)), total_s, length_mm, feed_mm_s)
    }

    fn without_phases(law: Law, total_s: f64, length_mm: f64, feed_mm_s: f64) -> Self {
        Self { law, phase_s: 0.5 * total_s, phase_mm: 0.5 * length_mm, cruise_s: 0.0, feed_mm_s, length_mm, total_s }
    }

    /// The same motion under a feed override; this very motion where that changes nothing. Acceleration and jerk along the path stay
    /// within the largest that this motion itself has. (The jerk of a linear profile is infinite where its acceleration jumps: there a
    /// change builds up its acceleration in a tenth of the time in which the feed is reached.) A motion under limits of the axes keeps
    /// those with [`AxisLimited::with_override`](super::AxisLimited::with_override).
    ///
    /// # Errors
    /// A time, a share or a transition out of range, steps out of order, or a hold that is never ended.
    pub fn with_override(&self, how: &FeedOverride) -> Result<Self, FeedrateError> {
        let MotionPeaks { feed_mm_s, accel_mm_s2, mut jerk_mm_s3 } = self.peaks();
        if !jerk_mm_s3.is_finite() {
            jerk_mm_s3 = 10.0 * accel_mm_s2 * accel_mm_s2 / feed_mm_s;
        }
        self.overridden(how, Bounds { accel: [accel_mm_s2], jerk: [jerk_mm_s3] }, &mut AxisDerivatives::along)
    }

    /// The same motion under a feed override that keeps these bounds.
    pub(super) fn overridden<const D: usize>(
        &self,
        how: &FeedOverride,
        bounds: Bounds<D>,
        row: &mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>,
    ) -> Result<Self, FeedrateError> {
        let Some(motion) = Overridden::new(self, how, bounds, row)? else { return Ok(self.clone()) };
        let (total_s, length_mm, feed_mm_s) = (motion.total_s(), motion.length_mm(), motion.peaks().feed_mm_s);
        Ok(Self::without_phases(Law::Overridden(Arc::new(motion)), total_s, length_mm, feed_mm_s))
    }

    /// The changes of the feed override.
    pub fn overrides(&self) -> &[OverrideChange] {
        match &self.law {
            Law::Overridden(motion) => motion.changes(),
            Law::Phases(_) | Law::Planned(_) => &[],
        }
    }

    /// Plans a motion along `length_mm` at `feed_mm_s`.
    ///
    /// # Errors
    /// A value that is not between 1e-9 and 1e9, `n_c` out of range, or a modification so strong that the acceleration
    /// changes its sign ([`FeedrateError::NotMonotone`]).
    pub fn plan(length_mm: f64, feed_mm_s: f64, profile: Profile) -> Result<Self, FeedrateError> {
        let length = positive("length_mm", length_mm)?;
        let wanted = within(&FEED, feed_mm_s)?;
        // Both phases together cover V T: the path is long enough from L = V T on.
        let reachable = |phase_s: f64| Ok::<_, FeedrateError>(wanted.min(length / within(&PHASE, phase_s)?));
        let steady = FeedState::steady;
        let accelerate = match profile {
            Profile::Linear { phase_s } => Phase::Bernstein(BernsteinPhase::linear(0.0, reachable(phase_s)?, phase_s)?),
            Profile::Cubic { phase_s } => {
                Phase::Bernstein(BernsteinPhase::cubic(steady(0.0), steady(reachable(phase_s)?), phase_s)?)
            }
            Profile::Quintic { phase_s } => {
                Phase::Bernstein(BernsteinPhase::quintic(steady(0.0), steady(reachable(phase_s)?), phase_s)?)
            }
            Profile::Exponential { phase_s, n_c } => {
                let share = reachable(phase_s)? / wanted;
                Phase::Exponential(ExponentialPhase::scaled(wanted, phase_s, n_c, share)?)
            }
            Profile::JerkLimited { accel_mm_s2, jerk_mm_s3 } => {
                let accel = within(&ACCEL, accel_mm_s2)?;
                let jerk = within(&JERK, jerk_mm_s3)?;
                let feed = JerkLimitedPhase::highest_feed_mm_s(length, wanted, accel, jerk);
                Phase::JerkLimited(JerkLimitedPhase::checked(feed, accel, jerk))
            }
        };
        if let Profile::Exponential { phase_s, n_c } = profile {
            // A short path scales the whole phase down: it is judged at its full size.
            let full = Phase::Exponential(ExponentialPhase::new(wanted, phase_s, n_c)?);
            let accel_mm_s2 = full.lowest_accel_mm_s2();
            // The modification leaves a trace of negative acceleration at the ends: jerk -2 n_c/T there, from A = 1 mm/s².
            let mean = wanted / phase_s;
            if accel_mm_s2 < -(1e-3 * mean + 2.0).min(0.05 * mean) {
                return Err(FeedrateError::NotMonotone { n_c, feed_mm_s, phase_s, accel_mm_s2 });
            }
        }
        let feed = accelerate.at(accelerate.duration_s()).feed_mm_s;
        let phase_s = accelerate.duration_s();
        let phase_mm = accelerate.distance_mm();
        let cruise_s = ((length - 2.0 * phase_mm) / feed).max(0.0);
        Ok(Self {
            law: Law::Phases(accelerate),
            phase_s,
            phase_mm,
            cruise_s,
            feed_mm_s: feed,
            length_mm: length,
            total_s: 2.0 * phase_s + cruise_s,
        })
    }

    /// Whole time from rest to rest \[s\].
    pub fn total_s(&self) -> f64 {
        self.total_s
    }

    /// Length of the path \[mm\].
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// The feed that is reached \[mm/s\]: the commanded one, or less where the path is short.
    pub fn feed_mm_s(&self) -> f64 {
        self.feed_mm_s
    }

    /// Length of the acceleration phase \[s\], the same as that of the deceleration; half of a motion that has no phases.
    pub fn phase_s(&self) -> f64 {
        self.phase_s
    }

    /// Length of the cruise \[s\].
    pub fn cruise_s(&self) -> f64 {
        self.cruise_s
    }

    /// Largest feed, acceleration and jerk of the motion.
    pub fn peaks(&self) -> MotionPeaks {
        match &self.law {
            Law::Phases(accelerate) => accelerate.peaks(),
            Law::Planned(planned) => planned.peaks(),
            Law::Overridden(motion) => motion.peaks(),
        }
    }

    /// Motion at `t_s`; at rest on the start before 0 and on the end after [`Motion::total_s`].
    #[inline]
    pub fn at(&self, t_s: f64) -> MotionSample {
        if t_s >= self.total_s {
            return MotionSample { s_mm: self.length_mm, ..MotionSample::default() };
        }
        let accelerate = match &self.law {
            Law::Phases(accelerate) => accelerate,
            Law::Planned(planned) => return if t_s > 0.0 { planned.at(t_s) } else { planned.at(0.0) },
            Law::Overridden(motion) => return motion.at(t_s),
        };
        let after = t_s - self.phase_s;
        if after < 0.0 {
            return if t_s < 0.0 { MotionSample::default() } else { accelerate.at(t_s) };
        }
        if after <= self.cruise_s {
            return MotionSample {
                s_mm: self.phase_mm + self.feed_mm_s * after,
                feed_mm_s: self.feed_mm_s,
                ..MotionSample::default()
            };
        }
        let mirrored = accelerate.at(self.total_s - t_s);
        MotionSample { s_mm: self.length_mm - mirrored.s_mm, accel_mm_s2: -mirrored.accel_mm_s2, ..mirrored }
    }
}

impl TimeLaw for Motion {
    fn total_s(&self) -> f64 {
        self.total_s
    }

    fn length_mm(&self) -> f64 {
        self.length_mm
    }

    fn at(&self, t_s: f64) -> MotionSample {
        self.at(t_s)
    }

    fn peaks(&self) -> MotionPeaks {
        self.peaks()
    }

    fn steady_s(&self) -> Option<(f64, f64)> {
        let cruises = matches!(self.law, Law::Phases(_)) && self.cruise_s > 0.0;
        cruises.then_some((self.phase_s, self.phase_s + self.cruise_s))
    }

    fn next_knot(&self, t_s: f64) -> f64 {
        let phase = match &self.law {
            Law::Planned(planned) => return planned.next_knot(t_s),
            Law::Overridden(motion) => return motion.next_knot(t_s),
            Law::Phases(phase) => phase,
        };
        let behind = self.phase_s + self.cruise_s;
        let within = match phase {
            Phase::JerkLimited(phase) => phase.knots_s(),
            Phase::Bernstein(_) | Phase::Exponential(_) => [0.0; 2],
        };
        [within[0], within[1], self.phase_s, behind, self.total_s - within[1], self.total_s - within[0], self.total_s]
            .into_iter()
            .filter(|knot| *knot > t_s)
            .fold(f64::INFINITY, f64::min)
    }
}
