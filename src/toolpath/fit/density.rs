//! Knots where the next derivative is large.

use super::Candidate;
use super::check::Data;
use super::knots::{Density, averaged};
use super::spline::{Spline, clamped};
use super::standard::{grow, standard};

/// Rounds of parameter correction.
const ROUNDS: usize = 5;

/// Points a knot interval of the splines that the density is taken from.
const FINENESS: [f64; 4] = [1.5, 2.0, 3.0, 6.0];

/// The density is nowhere below this share of its mean.
const FLOORS: [f64; 5] = [0.0, 0.1, 0.2, 0.3, 0.5];

/// Half-widths of the means that smooth it.
const SMOOTHING: [usize; 2] = [1, 2];

/// How many fewer control points a further estimate is asked for.
const NEAR: usize = 6;

/// The fewest control points over a few estimates of the density: which one is best depends on how rough the points are.
pub(super) fn density<const D: usize>(data: &Data<'_, D>) -> Option<Candidate<D>> {
    let p = data.degree;
    let few = data.exhaustive();
    // What there is to beat; with many points the search does without.
    let mut best = if few { standard(data) } else { None };
    let mut first = few;
    for (i, points) in FINENESS.into_iter().enumerate() {
        // With many points one estimate has to do: the finest in which rounding of the points is no rougher than the tolerance.
        let Some(spline) = estimate(data, points, few) else { continue };
        for floor in FLOORS {
            for smoothing in SMOOTHING {
                if !few && (i > 0 || smoothing == 2 || floor > 0.15) {
                    continue;
                }
                let density = Density::of(&spline, smoothing, floor);
                let attempt = |count: usize| data.attempt(&data.start, &density.knots(p, count), ROUNDS);
                let known = best.as_ref().map_or(data.points.len() + 1, Candidate::count);
                let found = if few {
                    let from = if first { p + 1 } else { known.saturating_sub(NEAR).max(p + 1) };
                    (from..known).find_map(attempt)
                } else {
                    let from = if best.is_some() { (4 * known / 5).max(p + 1) } else { p + 1 };
                    grow(data, from, attempt).filter(|found| found.count() < known)
                };
                first = false;
                best = found.or(best);
            }
        }
    }
    best.or_else(|| standard(data))
}

/// A fine spline through the points. With many points: the coarsest one with a quarter of the tolerance.
fn estimate<const D: usize>(data: &Data<'_, D>, points: f64, few: bool) -> Option<Spline<D>> {
    let p = data.degree;
    let at = |count: usize| {
        let knots = clamped(p, &averaged(p, count, &data.start));
        Spline::least_squares(p, knots, &data.points, &data.start)
    };
    let m = data.points.len();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // fewer than there are points
    let finest = ((m as f64 / points) as usize).max(p + 1);
    if few {
        return at(finest);
    }
    let mut count = 64;
    while count < finest {
        let spline = at(count)?;
        let off = |(q, &t): (&nalgebra::SVector<f64, D>, &f64)| (spline.point(t) - q).norm();
        let most = data.points.iter().zip(&data.start).map(off).fold(0.0, f64::max);
        if most <= 0.25 * data.tolerance {
            // Twice as fine: the knots' own places are no longer seen in the density.
            return at((2 * count).min(finest));
        }
        count *= 2;
    }
    at(finest)
}
