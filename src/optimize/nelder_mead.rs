//! The downhill simplex of Nelder and Mead (1965) with coefficients that fit the number of variables.

use std::ops::ControlFlow;

use super::bounds::Bounds;
use super::outcome::Log;
use super::{Outcome, Step, Value};

/// Nelder-Mead: the worst corner of a simplex of n + 1 points is reflected at the others, further where that pays, less far
/// where it does not; failing all, the simplex shrinks towards its best corner.
///
/// The coefficients depend on the number of variables, for `n ≥ 2`: reflection 1, expansion `1 + 2/n`, contraction `3/4 - 1/(2n)`,
/// shrinkage `1 - 1/n`, which keep the simplex from collapsing when there are many variables. A simplex that has collapsed
/// all the same is built afresh around the best point, until that no longer pays. Corners outside of the bounds are clipped to them.
/// Source: F. Gao, L. Han, "Implementing the Nelder-Mead simplex algorithm with adaptive parameters", Comput. Optim. Appl.
/// 51 (2012), section 2.
#[derive(Debug, Clone, PartialEq)]
pub struct NelderMead {
    /// Lower bounds; empty for none.
    pub lower: Vec<f64>,
    /// Upper bounds; empty for none.
    pub upper: Vec<f64>,
    /// Edge of the first simplex along every coordinate.
    pub initial_size: f64,
    /// The simplex has collapsed when no coordinate of a corner is further than this from the best one.
    pub size_tolerance: f64,
    /// A fresh simplex that lowers the objective by no more than this share of it is the last.
    pub relative_tolerance: f64,
    /// Most fresh simplices after the first.
    pub max_restarts: usize,
    /// It gives up after about this many evaluations (an iteration that has begun is finished).
    pub max_evaluations: usize,
}

impl Default for NelderMead {
    /// No bounds, size 1 → 1e-6, fresh simplices while they gain 1e-9, at most 20 of them, 100 000 evaluations.
    fn default() -> Self {
        Self {
            lower: Vec::new(),
            upper: Vec::new(),
            initial_size: 1.0,
            size_tolerance: 1e-6,
            relative_tolerance: 1e-9,
            max_restarts: 20,
            max_evaluations: 100_000,
        }
    }
}

/// A point and its value.
#[derive(Debug, Clone)]
struct Corner {
    point: Vec<f64>,
    value: Value,
}

/// The function, counted.
struct Counted<F> {
    objective: F,
    evaluations: usize,
}

impl<V: Into<Value>, F: FnMut(&[f64]) -> V> Counted<F> {
    fn corner(&mut self, point: Vec<f64>) -> Corner {
        self.evaluations += 1;
        let value = (self.objective)(&point).into();
        Corner { point, value }
    }
}

impl NelderMead {
    /// Minimises `objective` from `start`. A NaN counts as worse than any number.
    pub fn minimize<V: Into<Value>>(&self, start: &[f64], objective: impl FnMut(&[f64]) -> V) -> Outcome {
        self.minimize_until(start, objective, |_| ControlFlow::Continue(()))
    }

    /// As [`NelderMead::minimize`]; `watch` sees every iteration and may end the search.
    pub fn minimize_until<V: Into<Value>>(
        &self,
        start: &[f64],
        objective: impl FnMut(&[f64]) -> V,
        mut watch: impl FnMut(&Step) -> ControlFlow<()>,
    ) -> Outcome {
        let bounds = Bounds { lower: &self.lower, upper: &self.upper };
        let mut counted = Counted { objective, evaluations: 0 };
        let mut log = Log::new(&mut watch);
        let mut best = counted.corner(bounds.clipped(start));
        let mut size = self.initial_size;
        log.push(&best.point, best.value, size, counted.evaluations);
        if best.point.is_empty() {
            return log.finish(true);
        }
        for restart in 0..=self.max_restarts {
            let before = best.value;
            // Every other one looks the other way.
            let edge = if restart % 2 == 0 { size } else { -size };
            let mut simplex = fresh(&bounds, &best, edge, &mut counted);
            let collapsed = self.run(&bounds, &mut simplex, &mut counted, &mut log);
            best = simplex.swap_remove(0);
            if !collapsed {
                return log.finish(false);
            }
            if !pays(&before, &best.value, self.relative_tolerance) && restart > 0 {
                break;
            }
            // Smaller from time to time: the optimum is near, but how near is not known.
            size = (0.3 * size).max(100.0 * self.size_tolerance);
        }
        log.finish(true)
    }

    /// Runs until the simplex has collapsed (true) or the search is to end (false); the best corner comes first.
    fn run<V: Into<Value>, F: FnMut(&[f64]) -> V>(
        &self,
        bounds: &Bounds<'_>,
        simplex: &mut [Corner],
        counted: &mut Counted<F>,
        log: &mut Log<'_>,
    ) -> bool {
        loop {
            simplex.sort_by(|a, b| a.value.order(&b.value));
            let extent = extent(simplex);
            log.push(&simplex[0].point, simplex[0].value, extent, counted.evaluations);
            if log.is_stopped() || counted.evaluations >= self.max_evaluations {
                return false;
            }
            if !(extent > self.size_tolerance) {
                return true;
            }
            iterate(bounds, simplex, counted);
        }
    }
}

/// One iteration on a sorted simplex.
fn iterate<V: Into<Value>, F: FnMut(&[f64]) -> V>(
    bounds: &Bounds<'_>,
    simplex: &mut [Corner],
    counted: &mut Counted<F>,
) {
    let n = simplex.len() - 1;
    // One variable takes the coefficients of two, which are those of Nelder and Mead.
    let dimension = n.max(2) as f64;
    let (expansion, contraction) = (1.0 + 2.0 / dimension, 0.75 - 0.5 / dimension);
    let shrinkage = 1.0 - 1.0 / dimension;

    let centroid: Vec<f64> =
        (0..n).map(|i| simplex[..n].iter().map(|corner| corner.point[i]).sum::<f64>() / n as f64).collect();
    let worst = simplex[n].point.clone();
    // 1 is the reflection, -1 the worst corner itself.
    let mut at = |share: f64| {
        let point: Vec<f64> = centroid.iter().zip(&worst).map(|(c, w)| c + share * (c - w)).collect();
        counted.corner(bounds.clipped(&point))
    };
    let reflected = at(1.0);
    let accepted = if reflected.value.is_better_than(&simplex[0].value) {
        let expanded = at(expansion);
        Some(if expanded.value.is_better_than(&reflected.value) { expanded } else { reflected })
    } else if reflected.value.is_better_than(&simplex[n - 1].value) {
        Some(reflected)
    } else if reflected.value.is_better_than(&simplex[n].value) {
        let outside = at(contraction);
        (!reflected.value.is_better_than(&outside.value)).then_some(outside)
    } else {
        let inside = at(-contraction);
        inside.value.is_better_than(&simplex[n].value).then_some(inside)
    };
    if let Some(corner) = accepted {
        simplex[n] = corner;
        return;
    }
    let best = simplex[0].point.clone();
    for corner in &mut simplex[1..] {
        let point = best.iter().zip(&corner.point).map(|(b, p)| b + shrinkage * (p - b)).collect();
        *corner = counted.corner(point);
    }
}

/// A simplex along the coordinates, with `best` as a corner.
fn fresh<V: Into<Value>, F: FnMut(&[f64]) -> V>(
    bounds: &Bounds<'_>,
    best: &Corner,
    edge: f64,
    counted: &mut Counted<F>,
) -> Vec<Corner> {
    let mut simplex = vec![best.clone()];
    for i in 0..best.point.len() {
        let mut point = best.point.clone();
        point[i] = bounds.moved(point[i], edge, i);
        simplex.push(counted.corner(point));
    }
    simplex
}

/// Largest distance, per coordinate, of a corner from the first.
fn extent(simplex: &[Corner]) -> f64 {
    let distances = simplex.iter().flat_map(|corner| corner.point.iter().zip(&simplex[0].point));
    distances.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Whether `after` is better by more than a share.
fn pays(before: &Value, after: &Value, share: f64) -> bool {
    if !after.is_better_than(before) {
        return false;
    }
    let lower = |from: f64, to: f64| !(from - to <= share * from.abs());
    if before.is_feasible() {
        lower(before.objective, after.objective)
    } else {
        lower(before.violation, after.violation)
    }
}
