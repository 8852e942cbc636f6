//! Control points, knots and parameters of a spline improved together.
//!
//! Gauss-Newton on `Σ w_k |r_k|²` with `r_k` the part of `Q_k - C(t_k)` across the curve: what moves a point along the curve is
//! absorbed by its parameter, which is projected anew after every step. Weights `w = d^(q-2)` with rising `q` lead from least
//! squares towards the smallest largest distance. Unknowns are ordered along the curve, so that the normal equations are a band.

use nalgebra::SVector;

use super::spline::{Spline, cholesky};
use crate::path::nurbs::basis;

/// The powers `q` of the distances that are minimised one after the other.
const POWERS: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];

/// Weights below this share of the largest one are taken for it: every control point keeps an equation.
const LEAST_WEIGHT: f64 = 1e-7;

/// Two knots stay this far apart, in the parameter `0 … 1`.
const LEAST_GAP: f64 = 1e-6;

/// A spline with the parameters of its points and their distances.
#[derive(Debug, Clone)]
pub(super) struct State<const D: usize> {
    pub(super) spline: Spline<D>,
    pub(super) parameters: Vec<f64>,
    distances: Vec<f64>,
    /// The largest distance.
    pub(super) worst: f64,
}

impl<const D: usize> State<D> {
    /// Projects the points, each downhill from its parameter.
    pub(super) fn new(spline: Spline<D>, data: &[SVector<f64, D>], parameters: &[f64], steps: usize) -> Self {
        let size = data.len();
        let mut state =
            Self { spline, parameters: Vec::with_capacity(size), distances: Vec::with_capacity(size), worst: 0.0 };
        for (q, &t) in data.iter().zip(parameters) {
            let (t, distance) = state.spline.project(q, t, steps);
            state.parameters.push(t);
            state.distances.push(distance);
            state.worst = state.worst.max(distance);
        }
        state
    }

    fn objective(&self, power: f64, scale: f64) -> f64 {
        self.distances.iter().map(|d| libm::pow(d / scale, power)).sum()
    }

    fn weights(&self, power: f64) -> Vec<f64> {
        let weight = |d: &f64| libm::pow(d / self.worst, power - 2.0).max(LEAST_WEIGHT);
        self.distances.iter().map(weight).collect()
    }

    /// The spline moved by a solution of the normal equations. Knots do not pass each other: each moves by at most 0.4 of the gap
    /// on that side.
    fn moved(&self, right: &[f64]) -> Option<Spline<D>> {
        let mut next = self.spline.clone();
        let (p, n, group) = (next.degree, next.points.len(), D + 1);
        for (i, point) in next.points.iter_mut().enumerate().take(n - 1).skip(1) {
            for (x, step) in point.iter_mut().zip(&right[i * group..]) {
                *x += step;
            }
        }
        let u = &self.spline.knots;
        for j in p + 1..n {
            let step = right[(j - offset(p)) * group + D];
            next.knots[j] = u[j] + step.max(-0.4 * (u[j] - u[j - 1])).min(0.4 * (u[j + 1] - u[j]));
        }
        next.knots[p..=n].windows(2).all(|pair| pair[1] - pair[0] >= LEAST_GAP).then_some(next)
    }
}

/// The normal equations of one step. Unknowns stand in groups: control point `i`, then knot `i + offset`, which lies at its middle;
/// what is not free there has an empty row.
struct Equations {
    band: Vec<f64>,
    right: Vec<f64>,
    width: usize,
}

/// From the index of a control point to that of the knot in its group.
fn offset(degree: usize) -> usize {
    degree.div_ceil(2)
}

impl Equations {
    fn new<const D: usize>(state: &State<D>, data: &[SVector<f64, D>], weights: &[f64]) -> Self {
        let spline = &state.spline;
        let (p, n, group) = (spline.degree, spline.points.len(), D + 1);
        let off = offset(p);
        // A point on span s knows control points s-p … s and knots s-p+1 … s+p.
        let width = (2 * p + 1) * group + D;
        let stride = width + 1;
        let mut equations = Self { band: vec![0.0; n * group * stride], right: vec![0.0; n * group], width };
        let mut doubled = Vec::with_capacity(2 * p + 2);
        let mut columns: Vec<(usize, SVector<f64, D>)> = Vec::with_capacity((D + 2) * (p + 1));
        for ((q, &t), &weight) in data.iter().zip(&state.parameters).zip(weights) {
            let span = basis::span(p, &spline.knots, t);
            let [row, slope] = basis::derivatives::<2>(p, &spline.knots, span, t);
            let base = span - p;
            let (mut point, mut tangent) = (SVector::<f64, D>::zeros(), SVector::<f64, D>::zeros());
            for (control, (n, n1)) in spline.points[base..=span].iter().zip(row.iter().zip(&slope)) {
                point += control * *n;
                tangent += control * *n1;
            }
            let tangent = tangent / tangent.norm().max(f64::MIN_POSITIVE);
            // At the ends the parameter is not free.
            let inside = t > 0.0 && t < 1.0;
            let across = |v: SVector<f64, D>| if inside { v - tangent * tangent.dot(&v) } else { v };
            let residual = across(q - point);
            columns.clear();
            for (i, value) in (base..=span).zip(&row) {
                if i > 0 && i < n - 1 {
                    columns.extend((0..D).map(|c| {
                        let mut unit = SVector::zeros();
                        unit[c] = *value;
                        (i * group + c, across(unit))
                    }));
                }
            }
            for j in (span + 1).saturating_sub(p).max(p + 1)..(span + p + 1).min(n) {
                columns.push(((j - off) * group + D, across(knot_derivative(spline, j, t, &mut doubled))));
            }
            columns.sort_unstable_by_key(|column| column.0);
            for (a, (ia, va)) in columns.iter().enumerate() {
                let va = va * weight;
                equations.right[*ia] += va.dot(&residual);
                let row = &mut equations.band[ia * stride..(ia + 1) * stride];
                for (ib, vb) in &columns[a..] {
                    row[ib - ia] += va.dot(vb);
                }
            }
        }
        equations
    }

    /// The step with the diagonal raised by the share `damping` (Levenberg-Marquardt).
    fn solve(&self, damping: f64) -> Option<Vec<f64>> {
        let (mut band, mut right) = (self.band.clone(), self.right.clone());
        for row in band.chunks_exact_mut(self.width + 1) {
            row[0] = if row[0] > 0.0 { row[0] * (1.0 + damping) + 1e-14 } else { 1.0 };
        }
        cholesky(&mut band, self.width, &mut right)?;
        Some(right)
    }
}

/// `∂C/∂u_j (t) = -Σ_{i=j-p}^{j} (P_i - P_{i-1})/(u_{i+p} - u_i) N'_{i,p}(t)` with `N'` on the knots with `u_j` doubled.
fn knot_derivative<const D: usize>(spline: &Spline<D>, j: usize, t: f64, doubled: &mut Vec<f64>) -> SVector<f64, D> {
    let p = spline.degree;
    let u = &spline.knots;
    // Knots j-p … j, j, j+1 … j+p: a local vector whose functions 0 … p are N'_{j-p} … N'_j.
    doubled.clear();
    doubled.extend_from_slice(&u[j - p..=j]);
    doubled.extend_from_slice(&u[j..=j + p]);
    let mut out = SVector::zeros();
    // The span of t in it; values of functions beyond 0 … p are dropped.
    let Some(span) = (0..=2 * p).find(|&k| doubled[k] <= t && t < doubled[k + 1]) else { return out };
    let values = local_values(p, doubled, span, t);
    for (a, value) in values[..=p].iter().enumerate() {
        let Some(k) = (span + a).checked_sub(p) else { continue };
        if k > p {
            continue;
        }
        let i = j - p + k;
        let gap = u[i + p] - u[i];
        out -= (spline.points[i] - spline.points[i - 1]) * (value / gap);
    }
    out
}

/// Basis functions on a knot list that may be too short at its ends: missing knots are repeated.
fn local_values(p: usize, knots: &[f64], span: usize, t: f64) -> basis::Row {
    let last = knots.len() - 1;
    let mut n: basis::Row = [0.0; _];
    n[0] = 1.0;
    for j in 1..=p {
        let mut saved = 0.0;
        for r in 0..j {
            let right = knots[(span + r + 1).min(last)] - t;
            let left = t - knots[(span + 1 + r).saturating_sub(j)];
            let sum = right + left;
            let share = if sum > 0.0 { n[r] / sum } else { 0.0 };
            n[r] = saved + right * share;
            saved = left * share;
        }
        n[j] = saved;
    }
    n
}

/// Improves a state until its largest distance is below `tolerance`, nothing helps any more, or `budget` steps are used up.
pub(super) fn refine<const D: usize>(
    data: &[SVector<f64, D>],
    start: State<D>,
    tolerance: f64,
    most: usize,
    budget: &mut usize,
) -> State<D> {
    let mut best = start.clone();
    let mut state = start;
    let end = budget.saturating_sub(most);
    for power in POWERS {
        let mut damping = 1e-3;
        // Steps in a row that hardly helped.
        let mut idle = 0;
        while *budget > end && idle < 3 && best.worst > tolerance {
            *budget -= 1;
            let Some((next, gain)) = step(&state, data, power, &mut damping) else { break };
            idle = if gain > 1e-3 { 0 } else { idle + 1 };
            state = next;
            if state.worst < best.worst {
                best = state.clone();
            }
        }
    }
    best
}

/// One step that lowers the sum of the distances' powers, and the share that it lowers it by.
fn step<const D: usize>(
    state: &State<D>,
    data: &[SVector<f64, D>],
    power: f64,
    damping: &mut f64,
) -> Option<(State<D>, f64)> {
    let before = state.objective(power, state.worst);
    let equations = Equations::new(state, data, &state.weights(power));
    for _ in 0..6 {
        if let Some(spline) = equations.solve(*damping).and_then(|right| state.moved(&right)) {
            let there = State::new(spline, data, &state.parameters, 3);
            let after = there.objective(power, state.worst);
            if after < before {
                *damping = (*damping * 0.2).max(1e-9);
                return Some((there, 1.0 - after / before));
            }
        }
        *damping *= 5.0;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toolpath::fit::spline::clamped;
    use nalgebra::Vector2;

    #[test]
    fn validates_knot_derivatives_against_differences() {
        for p in 1..=5 {
            let interior = [0.1, 0.25, 0.3, 0.55, 0.7, 0.9];
            let knots = clamped(p, &interior);
            let n = knots.len() - p - 1;
            let points: Vec<_> = (0..n).map(|i| Vector2::new(i as f64, (2.0 * i as f64).sin())).collect();
            let spline = Spline { degree: p, knots, points };
            for j in p + 1..n {
                for k in 1..40 {
                    let t = f64::from(k) / 40.0 + 0.003;
                    let h = 1e-6;
                    let [ahead, behind] = [h, -h].map(|h| {
                        let mut other = spline.clone();
                        other.knots[j] += h;
                        other.point(t)
                    });
                    let exact = knot_derivative(&spline, j, t, &mut Vec::new());
                    let difference = (ahead - behind) / (2.0 * h);
                    assert!(
                        (exact - difference).norm() < 1e-6 * (1.0 + exact.norm()),
                        "{p} {j} {t}: {exact} {difference}"
                    );
                }
            }
        }
    }
}
