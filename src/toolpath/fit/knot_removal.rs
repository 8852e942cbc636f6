//! Free knots: one is taken out, the rest are moved until the tolerance holds again.

use nalgebra::SVector;

use super::Candidate;
use super::check::Data;
use super::newton::{State, refine};
use super::spline::Spline;

/// Gauss-Newton steps in all, times points.
const BUDGET: usize = 3_000_000;

/// And at least so many.
const LEAST_BUDGET: usize = 40;

/// Steps after one knot was taken out.
const MOST_STEPS: usize = 150;

/// Knots that are tried, best first, before the rest are known to be needed.
const TRIES: usize = 6;

/// Above this many knots times points knots are ranked without fitting anew.
const RANKED_BY_FITS: usize = 150_000;

pub(super) fn free<const D: usize>(data: &Data<'_, D>, start: Candidate<D>) -> Candidate<D> {
    let mut budget = (BUDGET / data.points.len()).max(LEAST_BUDGET);
    let mut good = start;
    let mut batch = (good.count() / 16).max(1);
    while good.count() > data.degree + 1 && budget > 0 {
        let ranked = ranked(data, &good);
        let found = if batch > 1 {
            without(data, &good, &apart(&ranked, batch), &mut budget)
        } else {
            ranked.iter().take(TRIES).find_map(|&j| without(data, &good, &[j], &mut budget))
        };
        match found {
            Some(fewer) => good = fewer,
            None if batch > 1 => batch /= 2,
            None => break,
        }
    }
    good
}

/// The fit without these knots, where it can be made to hold.
fn without<const D: usize>(
    data: &Data<'_, D>,
    good: &Candidate<D>,
    out: &[usize],
    budget: &mut usize,
) -> Option<Candidate<D>> {
    let spline = fitted_without(data, good, out)?;
    let start = State::new(spline, &data.points, &good.parameters, 5);
    let state = refine(&data.points, start, data.tolerance, MOST_STEPS, budget);
    let candidate = Candidate { spline: state.spline, parameters: state.parameters };
    (state.worst <= data.tolerance && data.holds_between(&candidate)).then_some(candidate)
}

fn fitted_without<const D: usize>(data: &Data<'_, D>, good: &Candidate<D>, out: &[usize]) -> Option<Spline<D>> {
    let knots = good.spline.knots.iter().enumerate();
    let knots = knots.filter(|(j, _)| !out.contains(j)).map(|(_, &u)| u).collect();
    Spline::least_squares(data.degree, knots, &data.points, &good.parameters)
}

/// Interior knots, the one that is missed least first.
fn ranked<const D: usize>(data: &Data<'_, D>, good: &Candidate<D>) -> Vec<usize> {
    let (p, n) = (data.degree, good.count());
    let mut ranked: Vec<(f64, usize)> = if n * data.points.len() <= RANKED_BY_FITS {
        let error = |j: usize| {
            let spline = fitted_without(data, good, &[j])?;
            let off = |(q, &t): (&SVector<f64, D>, &f64)| (spline.point(t) - q).norm();
            Some(data.points.iter().zip(&good.parameters).map(off).fold(0.0, f64::max))
        };
        (p + 1..n).filter_map(|j| error(j).map(|error| (error, j))).collect()
    } else {
        (p + 1..n).map(|j| (weight(&good.spline, j), j)).collect()
    };
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, j)| j).collect()
}

/// About how far the curve moves without knot `j`: the jump of its highest derivative there over `p!`, times the distances to the
/// neighbours to the power of `p`, as between truncated powers.
fn weight<const D: usize>(spline: &Spline<D>, j: usize) -> f64 {
    let u = &spline.knots;
    let middle = |i: usize| 0.5 * (u[i] + u[i + 1]);
    let highest = |t: f64| spline.derivative_of_highest_order(t);
    let jump = (highest(middle(j)) - highest(middle(j - 1))).norm();
    let gap = (u[j + 1] - u[j]) * (u[j] - u[j - 1]) / (u[j + 1] - u[j - 1]);
    jump * libm::pow(gap, spline.degree as f64)
}

/// The first `count` of the ranked knots of which no two are neighbours.
fn apart(ranked: &[usize], count: usize) -> Vec<usize> {
    let mut out: Vec<usize> = Vec::with_capacity(count);
    let mut taken = std::collections::HashSet::new();
    for &j in ranked {
        if out.len() < count && !(taken.contains(&(j + 1)) || taken.contains(&(j - 1))) {
            taken.insert(j);
            out.push(j);
        }
    }
    out
}
