//! The plan of a run, known before its first period.

use std::fmt;

use nalgebra::SVector;

use crate::feedrate::{Motion, MotionPeaks, OverrideChange};
use crate::limits::Limits;
use crate::path::Path;
use crate::servo::{AxisParameters, LoopSettings};

/// What an observer gets before the first period.
#[derive(Clone, Copy)]
pub struct RunPlan<'a, const A: usize> {
    /// The desired path, to be drawn.
    pub desired: Desired<'a, A>,
    /// What path and motion come to.
    pub totals: RunTotals,
    /// Sampling of the loop.
    pub settings: &'a LoopSettings,
    /// The axes' parameters.
    pub axes: &'a [AxisParameters; A],
    /// The limits that the run is held to.
    pub limits: &'a Limits,
    /// The changes of the feed override.
    pub overrides: &'a [OverrideChange],
    /// How many periods the run has.
    pub samples: u64,
}

/// The desired path of a run.
#[derive(Clone, Copy)]
pub enum Desired<'a, const A: usize> {
    /// All of it.
    Path(&'a dyn Path<A>),
    /// Points along it \[mm\]: that of a program, which is never in memory as a whole.
    Points(&'a [SVector<f64, A>]),
}

impl<const A: usize> fmt::Debug for Desired<'_, A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => write!(f, "Path of {} mm", path.length_mm()),
            Self::Points(points) => write!(f, "{} Points", points.len()),
        }
    }
}

/// Metrics of path and motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunTotals {
    /// Length of the path \[mm\].
    pub length_mm: f64,
    /// Largest curvature of the path \[1/mm\].
    pub max_curvature_1_mm: f64,
    /// Time of the motion, from rest to rest \[s\].
    pub time_s: f64,
    /// Largest feed, acceleration and jerk along the path.
    pub peaks: MotionPeaks,
    /// The feed that is reached \[mm/s\].
    pub feed_mm_s: f64,
}

impl RunTotals {
    /// Those of a motion along a path.
    pub fn of<const A: usize>(path: &dyn Path<A>, motion: &Motion) -> Self {
        Self {
            length_mm: path.length_mm(),
            max_curvature_1_mm: path.max_curvature_1_mm(),
            time_s: motion.total_s(),
            peaks: motion.peaks(),
            feed_mm_s: motion.feed_mm_s(),
        }
    }
}

impl<'a, const A: usize> RunPlan<'a, A> {
    /// The plan of a motion along a path.
    pub fn new(
        path: &'a dyn Path<A>,
        motion: &'a Motion,
        settings: &'a LoopSettings,
        axes: &'a [AxisParameters; A],
        limits: &'a Limits,
        samples: u64,
    ) -> Self {
        let (desired, totals, overrides) = (Desired::Path(path), RunTotals::of(path, motion), motion.overrides());
        Self { desired, totals, settings, axes, limits, overrides, samples }
    }
}
