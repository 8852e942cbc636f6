//! Result and history of a search.

use super::Value;

/// State after one iteration.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Step {
    /// Number of the iteration; 0 is the start.
    pub iteration: usize,
    /// Best point so far.
    pub point: Vec<f64>,
    /// Objective there.
    pub objective: f64,
    /// By how much it breaks its constraints (see [`Value`]); left out of JSON where it breaks none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub violation: f64,
    /// How far the search looks around after the iteration: the mesh size of [`PatternSearch`](super::PatternSearch), the
    /// size of the simplex (largest distance, per coordinate, of a corner from the best one) of
    /// [`NelderMead`](super::NelderMead), the largest standard deviation of the distribution of [`CmaEs`](super::CmaEs).
    pub mesh: f64,
    /// Evaluations so far.
    pub evaluations: usize,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Step {
    /// Objective and violation.
    pub fn value(&self) -> Value {
        Value { violation: self.violation, objective: self.objective }
    }
}

/// The end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Best point.
    pub point: Vec<f64>,
    /// Objective there.
    pub objective: f64,
    /// By how much it breaks its constraints (see [`Value`]); zero where it breaks none.
    pub violation: f64,
    /// Whether the search ended because it looks no further around than its tolerance (not because it was stopped, or gave
    /// up).
    pub converged: bool,
    /// Every iteration, the start included.
    pub history: Vec<Step>,
}

impl Outcome {
    /// Objective and violation.
    pub fn value(&self) -> Value {
        Value { violation: self.violation, objective: self.objective }
    }

    /// How often the function was evaluated.
    pub fn evaluations(&self) -> usize {
        self.history.last().map_or(0, |step| step.evaluations)
    }
}

/// The history as it is written, and whoever watches it.
pub(super) struct Log<'a> {
    history: Vec<Step>,
    watch: &'a mut dyn FnMut(&Step) -> std::ops::ControlFlow<()>,
    stopped: bool,
}

impl<'a> Log<'a> {
    pub(super) fn new(watch: &'a mut dyn FnMut(&Step) -> std::ops::ControlFlow<()>) -> Self {
        Self { history: Vec::new(), watch, stopped: false }
    }

    /// Notes one iteration; the first one is the start.
    pub(super) fn push(&mut self, point: &[f64], value: Value, mesh: f64, evaluations: usize) {
        let Value { violation, objective } = value;
        let violation = if violation <= 0.0 { 0.0 } else { violation };
        let iteration = self.history.len();
        let step = Step { iteration, point: point.to_vec(), objective, violation, mesh, evaluations };
        self.stopped |= (self.watch)(&step).is_break();
        self.history.push(step);
    }

    /// Whether the search was told to end.
    pub(super) fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Iterations so far, the start included.
    pub(super) fn len(&self) -> usize {
        self.history.len()
    }

    /// The last step is the best one.
    pub(super) fn finish(self, converged: bool) -> Outcome {
        let (point, Value { violation, objective }) =
            self.history.last().map_or((Vec::new(), Value::from(f64::NAN)), |step| (step.point.clone(), step.value()));
        Outcome { point, objective, violation, converged: converged && !self.stopped, history: self.history }
    }
}
