//! The search: several starts, the best of them polished.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::TuningError;
use super::problem::{Assessment, Problem};
use crate::optimize::{CmaEs, NelderMead, Outcome, PatternSearch, Random, Step, Value};

/// Which search every start uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// See [`NelderMead`].
    NelderMead,
    /// See [`CmaEs`].
    CmaEs,
    /// See [`PatternSearch`].
    PatternSearch,
}

impl Method {
    /// `nelder-mead`, `cma-es` or `pattern-search`.
    pub fn name(self) -> &'static str {
        match self {
            Self::NelderMead => "nelder-mead",
            Self::CmaEs => "cma-es",
            Self::PatternSearch => "pattern-search",
        }
    }
}

/// How a problem is searched.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuning {
    /// Which search.
    pub method: Method,
    /// From how many points; the first are the scenario's own gains, the others are sampled between the bounds.
    pub starts: usize,
    /// Seed of everything that is sampled.
    pub seed: u64,
    /// About how many gain sets are evaluated in all.
    pub budget: usize,
}

impl Tuning {
    /// The default, with the budget that takes a few seconds for this problem.
    pub fn default_for(problem: &Problem<'_>) -> Self {
        let steps = problem.runs().samples().saturating_mul(problem.plants() as u64).max(1);
        let budget = usize::try_from(STEPS / steps).unwrap_or(usize::MAX).clamp(2000, 12_000);
        Self { budget, ..Self::default() }
    }
}

/// Simulated control periods of a default budget.
const STEPS: u64 = 250_000_000;

impl Default for Tuning {
    /// CMA-ES from 6 points, 12 000 evaluations, seed 1.
    fn default() -> Self {
        Self { method: Method::CmaEs, starts: 6, seed: 1, budget: 12_000 }
    }
}

/// Share of the budget that goes to the polishing of the best.
const POLISH: f64 = 0.4;

/// How far a search looks around at first, as a share of the bounds.
const FIRST_SIZE: f64 = 0.12;
/// The same for the polish.
const POLISH_SIZE: f64 = 0.02;
/// A step of this share of the bounds changes nothing that matters.
const TOLERANCE: f64 = 1e-6;

/// How far a tuning is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Evaluations so far, of all starts.
    pub evaluations: usize,
    /// How many are planned.
    pub budget: usize,
    /// The best so far.
    pub best: Value,
}

/// One start, or the polish.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Number of the start; none for the polish.
    pub start: Option<usize>,
    /// Its iterations; points are in the unit cube (see [`Problem::axes`]).
    pub steps: Vec<Step>,
}

/// The end of a tuning.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuned {
    /// The best point of the unit cube.
    pub point: Vec<f64>,
    /// The scenario's own gains.
    pub before: Assessment,
    /// The best that were found.
    pub after: Assessment,
    /// Every start that was made, in order, and then the polish.
    pub traces: Vec<Trace>,
    /// Evaluations of all of them.
    pub evaluations: usize,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// What the starts share.
struct Shared<'a> {
    evaluations: AtomicUsize,
    best: Mutex<Value>,
    stop: &'a AtomicBool,
    budget: usize,
    watch: &'a (dyn Fn(Progress) + Sync),
}

impl Shared<'_> {
    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Tells whoever watches, and ends the search when it is to end.
    fn step(&self, step: &Step, before: &mut usize, budget: usize) -> ControlFlow<()> {
        let more = step.evaluations.saturating_sub(std::mem::replace(before, step.evaluations));
        let evaluations = self.evaluations.fetch_add(more, Ordering::Relaxed) + more;
        let mut best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
        if step.value().is_better_than(&best) {
            *best = step.value();
        }
        (self.watch)(Progress { evaluations, budget: self.budget.max(evaluations), best: *best });
        if self.is_stopped() || step.evaluations >= budget { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Tuning {
    /// Searches. The same problem, method and seed give the same result on any number of cores.
    ///
    /// - `stop`: once it is raised the search ends soon, with the best so far
    /// - `watch`: is told of the progress, from any thread
    ///
    /// # Errors
    /// Nothing to vary, no start, a limit that makes no sense, or axes that cannot be simulated.
    pub fn run(
        &self,
        problem: &Problem<'_>,
        stop: &AtomicBool,
        watch: &(dyn Fn(Progress) + Sync),
    ) -> Result<Tuned, TuningError> {
        self.check(problem)?;
        let before = problem.assess(problem.scenario.axes);
        let nowhere = Value { violation: f64::NAN, objective: f64::NAN };
        let shared =
            Shared { evaluations: AtomicUsize::new(0), best: Mutex::new(nowhere), stop, budget: self.budget, watch };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a share of a usize
        let polish = if self.starts > 1 { (POLISH * self.budget as f64) as usize } else { 0 };
        let each = (self.budget - polish) / self.starts;
        let outcomes: Vec<(usize, Outcome)> = (0..self.starts)
            .into_par_iter()
            .filter(|start| *start == 0 || !shared.is_stopped())
            .map(|start| (start, self.search(problem, &self.start(problem, start), start, each, FIRST_SIZE, &shared)))
            .collect();
        let mut traces: Vec<Trace> = Vec::with_capacity(outcomes.len() + 1);
        let mut best: Option<(Vec<f64>, Value)> = None;
        let better =
            |value: &Value, best: &Option<(Vec<f64>, Value)>| best.as_ref().is_none_or(|b| value.is_better_than(&b.1));
        for (start, outcome) in outcomes {
            if better(&outcome.value(), &best) {
                best = Some((outcome.point.clone(), outcome.value()));
            }
            traces.push(Trace { start: Some(start), steps: outcome.history });
        }
        if let Some((point, _)) = &best
            && !shared.is_stopped()
        {
            let spent: usize = traces.iter().filter_map(|trace| trace.steps.last()).map(|step| step.evaluations).sum();
            let left = self.budget.saturating_sub(spent).max(1);
            let outcome = self.search(problem, point, self.starts, left, POLISH_SIZE, &shared);
            if better(&outcome.value(), &best) {
                best = Some((outcome.point.clone(), outcome.value()));
            }
            traces.push(Trace { start: None, steps: outcome.history });
        }
        // The first start is always made.
        let point = best.map_or_else(|| problem.start(), |(point, _)| point);
        let after = problem.assess(problem.axes(&point));
        // The bounds may leave the scenario's own gains out, and nothing better in.
        let evaluations = shared.evaluations.into_inner();
        Ok(Tuned { point, before, after, traces, evaluations, interrupted: stop.load(Ordering::Relaxed) })
    }

    fn check(&self, problem: &Problem<'_>) -> Result<(), TuningError> {
        if self.starts == 0 {
            return Err(TuningError::NoStart);
        }
        let least = self.starts.saturating_mul(2 * problem.variables.len() + 2);
        if self.budget < least {
            return Err(TuningError::Budget { budget: self.budget, least });
        }
        Ok(())
    }

    /// Where start number `start` begins: points whose loops keep their margins are preferred.
    fn start(&self, problem: &Problem<'_>, start: usize) -> Vec<f64> {
        if start == 0 {
            return problem.start();
        }
        let mut random = Random::stream(self.seed, start as u64);
        let mut best: Option<(f64, Vec<f64>)> = None;
        for _ in 0..200 {
            let point: Vec<f64> = problem.variables.iter().map(|_| random.uniform()).collect();
            let violation = problem.loop_violation(&point);
            if best.as_ref().is_none_or(|(least, _)| violation < *least) {
                best = Some((violation, point));
            }
            if violation <= 0.0 {
                break;
            }
        }
        best.map_or_else(|| problem.start(), |(_, point)| point)
    }

    /// One search with a budget of its own.
    fn search(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
        number: usize,
        budget: usize,
        size: f64,
        shared: &Shared<'_>,
    ) -> Outcome {
        let n = start.len();
        let (lower, upper) = (vec![0.0; n], vec![1.0; n]);
        let mut before = 0;
        let watch = |step: &Step| shared.step(step, &mut before, budget);
        // A stop is heard within one evaluation, not one iteration.
        let lost = Value { violation: f64::NAN, objective: f64::NAN };
        let objective = |point: &[f64]| if shared.is_stopped() { lost } else { problem.value(point) };
        match self.method {
            Method::NelderMead => NelderMead {
                lower,
                upper,
                initial_size: size,
                size_tolerance: TOLERANCE,
                relative_tolerance: 1e-5,
                max_restarts: 100,
                max_evaluations: budget,
            }
            .minimize_until(start, objective, watch),
            Method::CmaEs => CmaEs {
                lower,
                upper,
                initial_sigma: size,
                sigma_tolerance: TOLERANCE,
                max_evaluations: budget,
                population: None,
                seed: self.seed.wrapping_add(number as u64),
            }
            .minimize_until(start, objective, watch),
            Method::PatternSearch => PatternSearch {
                lower,
                upper,
                initial_mesh: size,
                mesh_tolerance: TOLERANCE,
                max_iterations: usize::MAX,
            }
            .minimize_until(start, objective, watch),
        }
    }
}
