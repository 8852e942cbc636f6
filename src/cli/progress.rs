//! A progress bar for runs that take a while.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::optimize::Value;
use crate::simulation::{Observer, ObserverError, Period, RunPlan};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::significant;

/// A run shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_millis(500);

/// The clock is looked at every so many periods.
const EVERY: u64 = 1 << 14;

/// Shows how far a run is, on standard error, once it has taken a while.
pub(crate) struct Progress {
    started: Option<Instant>,
    samples: u64,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// A bar that is shown only if `enabled`.
    pub(crate) fn new(enabled: bool) -> Self {
        Self { started: enabled.then(Instant::now), samples: 0, bar: None }
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl<const A: usize> Observer<A> for Progress {
    fn begin(&mut self, plan: &RunPlan<'_, A>) -> Result<(), ObserverError> {
        self.samples = plan.samples;
        Ok(())
    }

    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError> {
        if !period.k.is_multiple_of(EVERY) {
            return Ok(());
        }
        if self.bar.is_none() && self.started.is_some_and(|started| started.elapsed() > PATIENCE) {
            let bar = ProgressBar::with_draw_target(Some(self.samples), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left") {
                bar.set_style(style);
            }
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(period.k);
        }
        Ok(())
    }
}

/// Tells which stage of a longer work is going on, on standard error; it clears the line when it goes.
pub(crate) struct Stages(Option<ProgressBar>);

impl Stages {
    /// A line that is shown only if `enabled`.
    pub(crate) fn new(enabled: bool) -> Self {
        // What turns the spinner is a thread.
        Self((enabled && crate::run::has_threads()).then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            bar.enable_steady_tick(Duration::from_millis(200));
            match ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        }))
    }

    /// The next stage.
    pub(crate) fn begin(&self, what: &'static str) {
        if let Some(bar) = &self.0 {
            bar.set_message(what);
        }
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

/// Shows how far a search is and what it has found, on standard error, once it has taken a while. May be told from any
/// thread.
pub(crate) struct SearchProgress {
    started: Option<Instant>,
    bar: OnceLock<ProgressBar>,
    unit: &'static str,
}

impl SearchProgress {
    /// A bar that is shown only if `enabled`; `unit` is that of the objective.
    pub(crate) fn new(enabled: bool, unit: &'static str) -> Self {
        Self { started: enabled.then(Instant::now), bar: OnceLock::new(), unit }
    }

    /// So many evaluations of so many, and the best value so far.
    pub(crate) fn show(&self, evaluations: usize, budget: usize, best: Value) {
        if self.started.is_none_or(|started| started.elapsed() <= PATIENCE) {
            return;
        }
        let bar = self.bar.get_or_init(|| {
            let bar = ProgressBar::with_draw_target(Some(budget as u64), ProgressDrawTarget::stderr());
            match ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left, {msg}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_length(budget as u64);
        bar.set_position(evaluations as u64);
        bar.set_message(if best.is_feasible() {
            format!("best {} {}", significant(best.objective, 4), self.unit)
        } else {
            "no allowed gains yet".to_owned()
        });
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}
