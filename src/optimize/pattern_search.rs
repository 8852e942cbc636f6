//! Pattern search along the coordinate directions (Hooke and Jeeves 1961, Torczon 1997).

use std::ops::ControlFlow;

use super::bounds::Bounds;
use super::outcome::Log;
use super::{Outcome, Step, Value};

/// Pattern search: polls the 2n coordinate directions, moves to the first better point and doubles the mesh, or halves it
/// when none is better.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternSearch {
    /// Lower bounds; empty for none. A polled point is clipped to the bounds.
    pub lower: Vec<f64>,
    /// Upper bounds; empty for none.
    pub upper: Vec<f64>,
    /// Mesh size at the start.
    pub initial_mesh: f64,
    /// The search has converged when the mesh is below this.
    pub mesh_tolerance: f64,
    /// It gives up after this many iterations.
    pub max_iterations: usize,
}

impl Default for PatternSearch {
    /// No bounds, mesh 1 → 1e-6, 1000 iterations.
    fn default() -> Self {
        Self { lower: Vec::new(), upper: Vec::new(), initial_mesh: 1.0, mesh_tolerance: 1e-6, max_iterations: 1000 }
    }
}

impl PatternSearch {
    /// Minimises `objective` from `start`. A NaN counts as worse than any number.
    pub fn minimize<V: Into<Value>>(&self, start: &[f64], objective: impl FnMut(&[f64]) -> V) -> Outcome {
        self.minimize_until(start, objective, |_| ControlFlow::Continue(()))
    }

    /// As [`PatternSearch::minimize`]; `watch` sees every iteration and may end the search.
    pub fn minimize_until<V: Into<Value>>(
        &self,
        start: &[f64],
        mut objective: impl FnMut(&[f64]) -> V,
        mut watch: impl FnMut(&Step) -> ControlFlow<()>,
    ) -> Outcome {
        let bounds = Bounds { lower: &self.lower, upper: &self.upper };
        let mut point = bounds.clipped(start);
        let mut best: Value = objective(&point).into();
        let mut evaluations = 1;
        let mut mesh = self.initial_mesh;
        let mut log = Log::new(&mut watch);
        log.push(&point, best, mesh, evaluations);
        while mesh >= self.mesh_tolerance && log.len() <= self.max_iterations && !log.is_stopped() {
            let mut moved = false;
            'poll: for i in 0..point.len() {
                for direction in [1.0, -1.0] {
                    let (old, new) = (point[i], bounds.clip(point[i] + direction * mesh, i));
                    if new == old {
                        continue;
                    }
                    point[i] = new;
                    let value: Value = objective(&point).into();
                    evaluations += 1;
                    if value.is_better_than(&best) {
                        best = value;
                        moved = true;
                        break 'poll;
                    }
                    point[i] = old;
                }
            }
            mesh *= if moved { 2.0 } else { 0.5 };
            log.push(&point, best, mesh, evaluations);
        }
        log.finish(mesh < self.mesh_tolerance)
    }
}
