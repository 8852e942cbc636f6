//! Fits with averaged knots: the standard one and the paper's five stages.

use super::Candidate;
use super::check::Data;
use super::knots::averaged;

/// Improvements of the parameters in the paper's fourth stage, at most.
const ROUNDS: usize = 30;

/// And with many points.
const FEW_ROUNDS: usize = 5;

/// By which share the error has to fall for another one.
const LEAST_GAIN: f64 = 1e-3;

/// The next number of control points to try.
pub(super) fn next(count: usize, exhaustive: bool) -> usize {
    count + if exhaustive { 1 } else { (count / 12).max(1) }
}

/// The first number of control points that holds. With many points numbers are left out on the way up, and a few percent of them
/// tried below the one found.
pub(super) fn grow<const D: usize>(
    data: &Data<'_, D>,
    from: usize,
    attempt: impl Fn(usize) -> Option<Candidate<D>>,
) -> Option<Candidate<D>> {
    let exhaustive = data.exhaustive();
    let mut count = from;
    let mut failed = from;
    while count <= data.points.len() {
        if let Some(mut found) = attempt(count) {
            // Closer, in ever smaller steps.
            while found.count() - failed > (found.count() / 100).max(1) {
                let middle = failed.midpoint(found.count());
                match attempt(middle) {
                    Some(fewer) => found = fewer,
                    None => failed = middle,
                }
            }
            return Some(found);
        }
        failed = count;
        count = next(count, exhaustive);
    }
    None
}

pub(super) fn standard<const D: usize>(data: &Data<'_, D>) -> Option<Candidate<D>> {
    let p = data.degree;
    grow(data, p + 1, |count| data.attempt(&data.start, &averaged(p, count, &data.start), 0))
}

pub(super) fn paper<const D: usize>(data: &Data<'_, D>) -> Option<Candidate<D>> {
    let p = data.degree;
    let attempt = |parameters: &[f64], count: usize| {
        (count > p).then(|| data.attempt(parameters, &averaged(p, count, parameters), 0)).flatten()
    };
    let first = (data.points.len() / 20).max(p + 1);
    let mut parameters = data.start.clone();
    let mut best = grow(data, first, |count| attempt(&parameters, count))?;
    for _ in 0..if data.exhaustive() { ROUNDS } else { FEW_ROUNDS } {
        let step = if data.exhaustive() { 1 } else { (best.count() / 50).max(1) };
        while let Some(fewer) = attempt(&parameters, best.count() - step) {
            best = fewer;
        }
        // The knots follow from the parameters, and those from where the points are nearest.
        let (improved, error) = super::check::distances(&best.spline, &data.points, &best.parameters);
        let Some(again) = attempt(&improved, best.count()) else { return Some(best) };
        let (_, after) = super::check::distances(&again.spline, &data.points, &again.parameters);
        if !(after < error * (1.0 - LEAST_GAIN)) {
            break;
        }
        (best, parameters) = (again, improved);
    }
    Some(best)
}
