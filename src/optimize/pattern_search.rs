//! Pattern search along the coordinate directions (Hooke and Jeeves 1961, Torczon 1997).

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

/// State after one iteration.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Step {
    /// Number of the iteration; 0 is the start.
    pub iteration: usize,
    /// Best point so far.
    pub point: Vec<f64>,
    /// Objective there.
    pub objective: f64,
    /// Mesh size after the iteration.
    pub mesh: f64,
    /// Evaluations so far.
    pub evaluations: usize,
}

/// The end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Best point.
    pub point: Vec<f64>,
    /// Objective there.
    pub objective: f64,
    /// Whether the mesh fell below its tolerance.
    pub converged: bool,
    /// Every iteration, the start included.
    pub history: Vec<Step>,
}

impl PatternSearch {
    /// Minimises `objective` from `start`. A NaN counts as worse than any number.
    pub fn minimize(&self, start: &[f64], mut objective: impl FnMut(&[f64]) -> f64) -> Outcome {
        let clip = |value: f64, i: usize| {
            let low = self.lower.get(i).copied().unwrap_or(f64::NEG_INFINITY);
            let high = self.upper.get(i).copied().unwrap_or(f64::INFINITY);
            value.min(high).max(low)
        };
        let mut point: Vec<f64> = start.iter().enumerate().map(|(i, &value)| clip(value, i)).collect();
        let mut best = objective(&point);
        let mut evaluations = 1;
        let mut mesh = self.initial_mesh;
        let mut history = vec![Step { iteration: 0, point: point.clone(), objective: best, mesh, evaluations }];
        while mesh >= self.mesh_tolerance && history.len() <= self.max_iterations {
            let mut moved = false;
            'poll: for i in 0..point.len() {
                for direction in [1.0, -1.0] {
                    let (old, new) = (point[i], clip(point[i] + direction * mesh, i));
                    if new == old {
                        continue;
                    }
                    point[i] = new;
                    let value = objective(&point);
                    evaluations += 1;
                    if value < best || (best.is_nan() && !value.is_nan()) {
                        best = value;
                        moved = true;
                        break 'poll;
                    }
                    point[i] = old;
                }
            }
            mesh *= if moved { 2.0 } else { 0.5 };
            let iteration = history.len();
            history.push(Step { iteration, point: point.clone(), objective: best, mesh, evaluations });
        }
        Outcome { point, objective: best, converged: mesh < self.mesh_tolerance, history }
    }
}
