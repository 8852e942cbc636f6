//! Mehrotra's predictor-corrector interior-point method on the problem of the spline.

use super::banded::Banded;
use super::program::Program;

/// Most iterations; what is found by then is run.
const ITERATIONS: usize = 150;

/// The search ends when this share of the time can still be gained at most.
const GAP: f64 = 1e-6;

/// Coefficients of `q`, and the multipliers of the limits.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) coefficients: Vec<f64>,
    multipliers: Vec<f64>,
    pub(super) iterations: usize,
    pub(super) gap: f64,
}

/// A strictly feasible point: `c` made smaller until every limit is kept with room.
fn shrink<const D: usize>(program: &Program<D>, c: &mut [f64]) {
    for _ in 0..200 {
        let mut kept = true;
        program.each_limit(c, |limit| kept &= limit.value > 0.0);
        if kept {
            break;
        }
        for value in c.iter_mut() {
            *value *= 0.8;
        }
    }
}

/// Solves the problem, from another solution if there is one.
#[allow(clippy::too_many_lines)] // one iteration, step by step
pub(super) fn solve<const D: usize>(program: &Program<D>, from: Option<&Solution>) -> Solution {
    let n = program.coefficients();
    let count = program.limits();
    let mut c = match from {
        Some(from) => from.coefficients.iter().map(|value| 0.95 * value).collect(),
        None => program.start(),
    };
    shrink(program, &mut c);
    let mut values = vec![0.0; count];
    program.each_limit(&c, |limit| values[limit.index] = limit.value);
    let start = program.time(&c, |_, _, _, _| ()) / count as f64;
    let mut lambda: Vec<f64> = match from {
        // Of the old multipliers what fits the new limits.
        Some(from) => {
            let mu = 1e-2 * start;
            from.multipliers
                .iter()
                .zip(&values)
                .map(|(old, value)| old.clamp(0.1 * mu / value, 10.0 * mu / value))
                .collect()
        }
        None => values.iter().map(|value| start / value).collect(),
    };
    let mut matrix = Banded::new(n);
    let (mut gradient, mut affine, mut step) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    // By how much each limit's value changes along the predictor, then its corrector's term.
    let mut change = vec![0.0; count];
    let mut iterations = 0;
    let mut gap = f64::INFINITY;
    while iterations < ITERATIONS {
        // Hessian of the time plus Σ λ/g ∇g ∇gᵀ, gradient of the Lagrangian.
        matrix.clear();
        gradient.fill(0.0);
        let time = program.time(&c, |first, by, slope, bend| {
            matrix.add(first, by, bend);
            (0..3).for_each(|k| gradient[first + k] += slope * by[k]);
        });
        affine.iter_mut().zip(&gradient).for_each(|(a, g)| *a = -g);
        let mut total = 0.0;
        program.each_limit(&c, |limit| {
            let multiplier = lambda[limit.index];
            values[limit.index] = limit.value;
            matrix.add(limit.first, limit.by, multiplier / limit.value);
            total += multiplier * limit.value;
            (0..3).for_each(|k| gradient[limit.first + k] -= multiplier * limit.by[k]);
        });
        let dual: f64 = gradient.iter().zip(&c).map(|(g, c)| (g * c).abs()).sum();
        gap = total / time;
        if gap <= GAP && dual <= 10.0 * GAP * time {
            break;
        }
        iterations += 1;
        // The outer coefficients are no unknowns.
        matrix.add_diagonal(0, 1.0);
        matrix.add_diagonal(n - 1, 1.0);
        matrix.factor();
        matrix.solve(&mut affine);

        // Predictor: towards complementarity 0.
        let (mut primal_room, mut dual_room) = (1.0_f64, 1.0_f64);
        program.each_limit(&c, |limit| {
            let multiplier = lambda[limit.index];
            let by: f64 = (0..3).map(|k| limit.by[k] * affine[limit.first + k]).sum();
            change[limit.index] = by;
            if by < 0.0 {
                primal_room = primal_room.min(-limit.value / by);
            }
            let lift = -multiplier - multiplier / limit.value * by;
            if lift < 0.0 {
                dual_room = dual_room.min(-multiplier / lift);
            }
        });
        let mut ahead = 0.0;
        for ((value, by), multiplier) in values.iter().zip(&change).zip(&lambda) {
            let lift = -multiplier - multiplier / value * by;
            ahead += (value + primal_room * by) * (multiplier + dual_room * lift);
        }
        let mu = total / count as f64;
        // Far from the optimum complementarity waits for the gradient: limits met too early are hard to follow.
        let patience = (0.1 * dual.min(time) / total).min(1.0);
        let sigma = (ahead / total).clamp(0.0, 1.0).powi(3).max(patience).max(1e-6);

        // Corrector: towards σμ, with the product of the predictor's changes.
        step.fill(0.0);
        program.time(&c, |first, by, slope, _| (0..3).for_each(|k| step[first + k] -= slope * by[k]));
        program.each_limit(&c, |limit| {
            let (value, multiplier, by) = (limit.value, lambda[limit.index], change[limit.index]);
            let lift = -multiplier - multiplier / value * by;
            let aim = (sigma * mu - by * lift) / value;
            change[limit.index] = aim;
            (0..3).for_each(|k| step[limit.first + k] += aim * limit.by[k]);
        });
        matrix.solve(&mut step);
        program.close(&mut step);
        let (mut primal_room, mut dual_room) = (f64::INFINITY, f64::INFINITY);
        program.each_limit(&c, |limit| {
            let multiplier = lambda[limit.index];
            let by: f64 = (0..3).map(|k| limit.by[k] * step[limit.first + k]).sum();
            if by < 0.0 {
                primal_room = primal_room.min(-limit.value / by);
            }
            let lift = change[limit.index] - multiplier - multiplier / limit.value * by;
            change[limit.index] = lift;
            if lift < 0.0 {
                dual_room = dual_room.min(-multiplier / lift);
            }
        });
        let primal = (0.995 * primal_room).min(0.9 * program.room(&c, &step)).min(1.0);
        let dual_step = (0.995 * dual_room).min(1.0);
        c.iter_mut().zip(&step).for_each(|(c, step)| *c += primal * step);
        lambda.iter_mut().zip(&change).for_each(|(multiplier, lift)| *multiplier += dual_step * lift);
    }
    Solution { coefficients: c, multipliers: lambda, iterations, gap }
}
