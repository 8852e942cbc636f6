//! The motions around the setpoint: what it runs along, and what the contouring error is measured against.

use std::collections::VecDeque;
use std::f64::consts::PI;

use nalgebra::SVector;

use super::shape::Motion;
use super::stream::Sum;
use crate::contour::ContourError;
use crate::path::{Cursor, Foot, Frame, Nearest, Path, nearest_in_window};
use crate::simulation::Place;

/// Most motions that are kept behind the setpoint.
const MOST_BEHIND: usize = 1000;

/// Path that is kept behind the setpoint at least \[mm\].
const LEAST_BEHIND_MM: f64 = 0.1;

#[derive(Debug, Clone)]
struct Held {
    motion: Motion,
    length: f64,
    /// Arc length of the program at its start.
    start: Sum,
    setpoint: Cursor,
    foot: Cursor,
}

/// Motions in a row, some of them behind the setpoint.
#[derive(Debug, Clone, Default)]
pub(super) struct MotionBuffer {
    held: VecDeque<Held>,
    /// The one that the setpoint is on.
    current: usize,
    /// The one that the last foot was on.
    nearest: usize,
    end: Sum,
    /// Largest tracking error so far \[mm\].
    largest: f64,
    /// Where the setpoint last stood still: at `s` behind which base, and what the path is there.
    rest: Option<(Sum, f64, Frame<3>, Place)>,
}

impl MotionBuffer {
    pub(super) fn push(&mut self, motion: Motion) {
        let length = motion.shape.length_mm();
        let start = self.end;
        self.end.add(length);
        self.held.push_back(Held { motion, length, start, setpoint: Cursor::default(), foot: Cursor::default() });
    }

    pub(super) fn len(&self) -> usize {
        self.held.len()
    }

    /// How far the motions go beyond a place \[mm\].
    pub(super) fn ahead_mm(&self, base: &Sum, s: f64) -> f64 {
        self.end.since(base) - s
    }

    /// [`frame`](Self::frame) at a speed of the setpoint: at rest, in a dwell or after the end, the point is constant to the bit.
    pub(super) fn frame_at(&mut self, base: &Sum, s: f64, feed_mm_s: f64) -> Option<(Frame<3>, Place)> {
        if let Some((resting_base, resting_s, frame, place)) = &self.rest
            && resting_base == base
            && *resting_s == s
        {
            return Some((*frame, *place));
        }
        let (frame, place) = self.frame(base, s)?;
        self.rest = (feed_mm_s == 0.0).then_some((*base, s, frame, place));
        Some((frame, place))
    }

    /// The path at `s` behind `base` (clamped), and where that is in the program. The setpoint moves there; it never goes back.
    pub(super) fn frame(&mut self, base: &Sum, s: f64) -> Option<(Frame<3>, Place)> {
        while self.current + 1 < self.held.len() {
            let Some(next) = self.held.get(self.current + 1) else { break };
            if next.start.since(base) > s {
                break;
            }
            self.current += 1;
        }
        let held = self.held.get_mut(self.current)?;
        let local = s - held.start.since(base);
        Some((held.motion.shape.frame(local, &mut held.setpoint), held.motion.place))
    }

    /// Lets go of what is far behind the setpoint.
    pub(super) fn forget(&mut self, base: &Sum, s: f64) {
        // Twice the reach of the largest tracking error.
        let reach = LEAST_BEHIND_MM.max(2.0 * PI * self.largest);
        while self.current > 0 {
            let Some(second) = self.held.get(1) else { break };
            if self.current <= MOST_BEHIND && s - second.start.since(base) <= reach {
                break;
            }
            self.held.pop_front();
            self.current -= 1;
            self.nearest = self.nearest.saturating_sub(1);
        }
    }

    /// The contouring error, as [`ContourMeter`](crate::contour::ContourMeter) defines it: the nearest point within `π d` of arc length
    /// around the setpoint, `d` the tracking error. Arc lengths count from `base`.
    pub(super) fn measure(
        &mut self,
        actual_mm: &SVector<f64, 3>,
        setpoint_mm: &SVector<f64, 3>,
        base: &Sum,
        s: f64,
    ) -> Option<ContourError<3>> {
        let tracking = (actual_mm - setpoint_mm).norm();
        self.largest = self.largest.max(if tracking.is_finite() { tracking } else { 0.0 });
        let reach = PI * tracking + 1e-6;
        let mut best: Option<(usize, f64, Nearest<3>)> = None;
        // From the last foot's motion on: what follows is mostly settled by a bound.
        let first = self.nearest.min(self.held.len().saturating_sub(1));
        let back = (0..first).rev();
        let mut forward_over = false;
        for i in (first..self.held.len()).chain(back) {
            if forward_over && i >= first {
                continue;
            }
            let Some(held) = self.held.get_mut(i) else { break };
            let start = held.start.since(base);
            // NaN reaches nothing; the current motion is always measured.
            let (low, high) = (s - reach - start, s + reach - start);
            let within = low <= held.length && high >= 0.0;
            if !within && i != self.current {
                if i > self.current {
                    forward_over = true;
                    continue;
                }
                if i < first {
                    break;
                }
                continue;
            }
            let around = (s - start).max(0.0).min(held.length);
            let left = reach - (s - start - around).abs();
            if let Some((_, _, found)) = &best {
                // No point of it is nearer than its middle less half its length.
                let (from, to) = (low.max(0.0), high.min(held.length));
                let middle = held.motion.shape.point_mm(0.5 * (from + to), &mut held.foot.clone());
                if (middle - actual_mm).norm() - 0.5 * (to - from) >= found.distance_mm {
                    continue;
                }
            }
            let nearest = nearest_in_window(&held.motion.shape, actual_mm, around, left.max(0.0), &mut held.foot);
            if best.as_ref().is_none_or(|(_, _, found)| nearest.distance_mm < found.distance_mm) {
                best = Some((i, start, nearest));
            }
        }
        let (i, start, nearest) = best?;
        self.nearest = i;
        let Foot { s_mm, point_mm, tangent } = nearest.foot;
        let foot = Foot { s_mm: base.value() + (start + s_mm), point_mm, tangent };
        Some(ContourError::of(actual_mm, &foot, nearest.distance_mm))
    }
}
