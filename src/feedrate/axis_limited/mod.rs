//! The fastest motion along a path that keeps the limits of every axis.
//!
//! On the axis `i` of a path `x(s)` the motion `s(t)` makes
//!
//! ```text
//! velocity      x_i' ṡ                              [mm/s]
//! acceleration  x_i'' ṡ² + x_i' s̈                   [mm/s²]
//! jerk          x_i''' ṡ³ + 3 x_i'' ṡ s̈ + x_i' s⃛     [mm/s³]
//! ```
//!
//! With `q(s) = ṡ²` is `s̈ = q'/2` and `s⃛ = ṡ q''/2`: velocity and acceleration limits are linear in `q`, a jerk limit divided by the
//! speed is `|x''' q + 3 x'' q'/2 + x' q''/2| ≤ j/√q`, and the time `∫ ds/√q` is convex. `q` is a quadratic spline with continuous
//! derivative over a grid of arc length; each of its coefficients meets two neighbours in a limit, so that an interior-point method
//! (Mehrotra's predictor and corrector) needs one banded factorisation an iteration: time and memory grow linearly with the number of
//! grid points. `j/√q` is convex in `q`: its tangent lies below it, so that every iterate keeps the limits and the last one can
//! always be run. Where a speed limit is constant the coefficients themselves keep it, and of motions that are about equally fast the one with
//! the least jerk is taken: at constant feed the jerk is 0, without chatter. At the ends, where `q` grows with the power 4/3 of the distance, the first interval has constant jerk in time and the
//! grid is graded towards it.
//!
//! The motion that is run is a spline of degree 5 in time through position, speed and acceleration at the grid points
//! (continuous acceleration). It is held against the limits at ten places of every interval (46 in the end); what it passes
//! them by is taken off the limits there, and in the end off the feed scale of the whole motion. Where the path's third derivative jumps there
//! is a grid point.
//!
//! Sources: Verscheure, Demeulenaere, Swevers, De Schutter, Diehl, "Time-optimal path tracking for robots: a convex optimization
//! approach", IEEE Transactions on Automatic Control 54 (2009), sections II to IV (`q` as the variable); Nocedal, Wright,
//! "Numerical optimization", 2nd edition, sections 14.2 and 19.3 (predictor and corrector, interior points).

mod banded;
mod grid;
mod interior;
mod limits;
mod program;
mod verify;

pub use grid::MAX_GRID_POINTS;
pub use limits::{AxisLimited, AxisLimits, PathShape};

use super::feed_override::{AxisDerivatives, Bounds};
use super::planned::Planned;
use super::{FeedOverride, FeedrateError, Motion, positive};
use crate::parameters::OutOfRange;
use interior::Solution;
use program::{Program, TOLERANCE};

/// Places of every interval where the motion is held against the limits in the end.
const FINAL_PLACES: u32 = 46;

/// Rounds in which limits that are passed between the points of the grid are tightened there.
const ROUNDS: usize = 4;

/// A motion under axis limits, and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisLimitedPlan {
    /// The motion.
    pub motion: Motion,
    /// Points of the grid of arc length.
    pub grid_points: usize,
    /// Iterations of the interior-point method, over all rounds.
    pub iterations: usize,
    /// How often limits had to be tightened between grid points.
    pub rounds: usize,
    /// By how much the whole motion was slowed down in the end, where that is more than 1, to keep the limits between grid points.
    pub worst_share: f64,
    /// Bound of the share of time that is lost against the optimum of the grid's problem, near this solution.
    pub gap: f64,
}

impl<const D: usize> AxisLimited<D> {
    /// Plans the motion along a path of `length_mm`, from rest to rest. `shape` tells how the path runs at an arc length; it is
    /// asked at ten places a grid interval and round and more in the end, mostly in rising order. Where its third derivative jumps both sides count.
    ///
    /// # Errors
    /// A limit, the length, the feed or the step not between 1e-9 and 1e9; a shape that is not finite
    /// ([`FeedrateError::BadShape`]); a corner or a jump of the curvature, where no speed keeps the limits
    /// ([`FeedrateError::Corner`]); more than [`MAX_GRID_POINTS`] points.
    pub fn plan(
        &self,
        length_mm: f64,
        mut shape: impl FnMut(f64) -> PathShape<D>,
    ) -> Result<AxisLimitedPlan, FeedrateError> {
        let length = positive("length_mm", length_mm)?;
        self.check()?;
        let grid = grid::grid(self, length, &mut shape)?;
        let mut program = Program::new(self, grid, &mut shape)?;
        let mut solution = interior::solve(&program, None);
        let mut iterations = solution.iterations;
        let mut best: Option<(f64, f64, Planned, Solution)> = None;
        let mut rounds = 0;
        loop {
            let planned = program.motion(&solution.coefficients);
            let shares = verify::shares(&planned, self, 10, &mut shape);
            let worst = shares.iter().map(verify::Share::feed_scale).fold(0.0, f64::max);
            let time = planned.total_s() * worst.max(1.0);
            if best.as_ref().is_none_or(|(before, ..)| time < *before) {
                best = Some((time, worst, planned, solution.clone()));
            }
            if worst <= 1.0 + TOLERANCE || rounds == ROUNDS {
                break;
            }
            rounds += 1;
            program.tighten(&shares);
            solution = interior::solve(&program, Some(&solution));
            iterations += solution.iterations;
        }
        let Some((_, _, planned, solution)) = best else {
            return Err(FeedrateError::BadShape { s_mm: 0.0 });
        };
        let shares = verify::shares(&planned, self, FINAL_PLACES, &mut shape);
        let worst = shares.iter().map(verify::Share::feed_scale).fold(0.0, f64::max);
        let grid_points = planned.nodes();
        let planned = planned.paced(worst.max(1.0));
        let time = planned.total_s();
        if !(time > 0.0 && time.is_finite()) {
            let needed = "finite: are the limits far apart from each other, or from the path's length?";
            let help = "limits that a machine has: some 100 mm/s, some 1000 mm/s² and some 10000 mm/s³";
            return Err(OutOfRange::new("motion time", time, needed).with_help(help).into());
        }
        Ok(AxisLimitedPlan {
            motion: Motion::of_planned(planned),
            grid_points,
            iterations,
            rounds,
            worst_share: worst,
            gap: solution.gap,
        })
    }

    /// A motion that keeps the limits (as [`AxisLimited::plan`] finds it) under a feed override that keeps them too, to 0.1 %: acceleration
    /// and jerk of every axis. `shape` is that of the plan. No share is above 1: the plan has no cruise.
    ///
    /// # Errors
    /// A limit out of range, and those of [`Motion::with_override`].
    pub fn with_override(
        &self,
        plan: &Motion,
        how: &FeedOverride,
        mut shape: impl FnMut(f64) -> PathShape<D>,
    ) -> Result<Motion, FeedrateError> {
        self.check()?;
        let bounds = Bounds { accel: self.limits.acceleration_mm_s2, jerk: self.limits.jerk_mm_s3 };
        plan.overridden(how, bounds, &mut |m| {
            let (v, a, j) = (m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3);
            let PathShape { tangent: t, curvature_1_mm: k, curvature_rate_1_mm2: r } = shape(m.s_mm);
            AxisDerivatives {
                velocity: std::array::from_fn(|i| t[i] * v),
                acceleration: std::array::from_fn(|i| t[i] * a + k[i] * v * v),
                jerk: std::array::from_fn(|i| t[i] * j + 3.0 * k[i] * v * a + r[i] * v * v * v),
            }
        })
    }
}
