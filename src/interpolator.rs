//! Interpolator: one setpoint a control period, exact to rounding.
//!
//! At `t_k = k Δt` the motion gives the arc length `s(t_k)`, the path gives the point there by Newton's iteration from the
//! previous parameter, `ξ ← ξ - (s(ξ) - s(t_k)) / σ(ξ)`. No table and no drift: the feedrate error is rounding only.
//! Source: Jahanpour, Dolatabadi, Vahedian Azimi, equation 16.

use nalgebra::SVector;

use crate::feedrate::{AxisLimited, AxisLimitedPlan, FeedrateError, Motion, MotionSample, PathShape};
use crate::path::{Cursor, Frame, Path};

/// The commanded state of the tool at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint<const D: usize> {
    /// Time `t_k = k Δt` \[s\].
    pub time_s: f64,
    /// Arc length along the path \[mm\].
    pub s_mm: f64,
    /// Feedrate `v` along the path \[mm/s\].
    pub feed_mm_s: f64,
    /// Acceleration `a = dv/dt` along the path \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Jerk `j = da/dt` along the path \[mm/s³\].
    pub jerk_mm_s3: f64,
    /// Position \[mm\].
    pub position_mm: SVector<f64, D>,
    /// Velocity `v t` \[mm/s\].
    pub velocity_mm_s: SVector<f64, D>,
    /// Acceleration `a t + v² k` \[mm/s²\].
    pub acceleration_mm_s2: SVector<f64, D>,
    /// Jerk `j t + 3 v a k + v³ k'` \[mm/s³\].
    pub jerk_vector_mm_s3: SVector<f64, D>,
}

impl<const D: usize> Setpoint<D> {
    /// The setpoint of a motion on a point of its path.
    #[inline]
    pub(crate) fn of(time_s: f64, motion: &MotionSample, frame: &Frame<D>) -> Self {
        let (v, a) = (motion.feed_mm_s, motion.accel_mm_s2);
        Self {
            time_s,
            s_mm: motion.s_mm,
            feed_mm_s: v,
            accel_mm_s2: a,
            jerk_mm_s3: motion.jerk_mm_s3,
            position_mm: frame.point_mm,
            velocity_mm_s: frame.tangent * v,
            acceleration_mm_s2: frame.tangent * a + frame.curvature_1_mm * (v * v),
            jerk_vector_mm_s3: frame.tangent * motion.jerk_mm_s3
                + frame.curvature_1_mm * (3.0 * v * a)
                + frame.curvature_rate_1_mm2 * (v * v * v),
        }
    }
}

impl<const D: usize> From<&Frame<D>> for PathShape<D> {
    fn from(frame: &Frame<D>) -> Self {
        Self {
            tangent: frame.tangent.into(),
            curvature_1_mm: frame.curvature_1_mm.into(),
            curvature_rate_1_mm2: frame.curvature_rate_1_mm2.into(),
        }
    }
}

/// The fastest motion along `path` that keeps the limits of every axis.
///
/// # Errors
/// Those of [`AxisLimited::plan`]: the path must be smooth up to its curvature.
pub fn plan_under_axis_limits<const D: usize>(
    planner: &AxisLimited<D>,
    path: &dyn Path<D>,
) -> Result<AxisLimitedPlan, FeedrateError> {
    let mut cursor = Cursor::default();
    planner.plan(path.length_mm(), |s_mm| PathShape::from(&path.frame(s_mm, &mut cursor)))
}

/// A stream of setpoints along a path. Memory does not grow with the path.
///
/// The stream ends with the first setpoint at or after the end of the motion: at rest on the end of the path. At rest (before the start,
/// in a feed hold, after the end) the position is constant to the bit: Newton's iteration is not repeated where the arc length stays.
#[derive(Clone)]
pub struct Interpolator<'a, const D: usize> {
    path: &'a dyn Path<D>,
    motion: Motion,
    period_s: f64,
    next: u64,
    end: u64,
    cursor: Cursor,
    /// The last arc length at rest \[mm\], and the path there.
    rest: Option<(f64, Frame<D>)>,
    holds_end: bool,
}

impl<'a, const D: usize> Interpolator<'a, D> {
    /// Setpoints every `period_s` \[s\] along `path` with `motion`. Where the period is not a positive finite number the stream
    /// is the first setpoint alone ([`Simulation::new`](crate::simulation::Simulation::new) refuses such a period).
    pub fn new(path: &'a dyn Path<D>, motion: &Motion, period_s: f64) -> Self {
        let period_s = if period_s > 0.0 && period_s.is_finite() { period_s } else { 0.0 };
        let end = periods(motion.total_s(), period_s);
        let (motion, cursor) = (motion.clone(), Cursor::default());
        Self { path, motion, period_s, next: 0, end, cursor, rest: None, holds_end: true }
    }

    /// Solves for the end of the path again at every sample past it, where its last digit may then alternate. Recordings of the ideal
    /// drive model, a reference to the bit, have it so; nothing in that model takes the sign of a velocity.
    #[must_use]
    pub(crate) fn solving_the_end_again(mut self) -> Self {
        self.holds_end = false;
        self
    }

    /// Number of the last setpoint: the stream holds one more than this.
    pub fn last_sample(&self) -> u64 {
        self.end
    }

    /// Where on the path the last setpoint was found.
    pub(crate) fn cursor(&self) -> Cursor {
        self.cursor
    }

    /// The setpoint at sample `k`; the motion rests on the path's end after its last one. Cheap when `k` follows on the
    /// sample asked for before.
    #[inline]
    pub fn setpoint(&mut self, k: u64) -> Setpoint<D> {
        let time_s = k as f64 * self.period_s;
        // A remainder of rounding size is no further period: the last setpoint stands on the end all the same.
        let m = self.motion.at(if k >= self.end && self.end > 0 { f64::INFINITY } else { time_s });
        let frame = match self.rest {
            Some((s_mm, frame)) if s_mm == m.s_mm && (self.holds_end || k <= self.end) => frame,
            _ => {
                let frame = self.path.frame(m.s_mm, &mut self.cursor);
                self.rest = (m.feed_mm_s == 0.0).then_some((m.s_mm, frame));
                frame
            }
        };
        Setpoint::of(time_s, &m, &frame)
    }
}

impl<const D: usize> Iterator for Interpolator<'_, D> {
    type Item = Setpoint<D>;

    fn next(&mut self) -> Option<Setpoint<D>> {
        if self.next > self.end {
            return None;
        }
        let setpoint = self.setpoint(self.next);
        self.next += 1;
        Some(setpoint)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = usize::try_from(self.end.saturating_add(1).saturating_sub(self.next)).ok();
        (left.unwrap_or(usize::MAX), left)
    }
}

/// The fewest periods that cover `time_s`; a remainder of rounding size is none. Of a period of 0 (no period) none.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a float cast saturates
pub(crate) fn periods(time_s: f64, period_s: f64) -> u64 {
    if period_s > 0.0 { (time_s / period_s * (1.0 - 1e-12)).ceil() as u64 } else { 0 }
}
