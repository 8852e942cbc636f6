//! A progress bar for runs that take a while.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use servosim::simulation::{Observer, ObserverError, Period, RunPlan};

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

impl Observer<2> for Progress {
    fn begin(&mut self, plan: &RunPlan<'_, 2>) -> Result<(), ObserverError> {
        self.samples = plan.samples;
        Ok(())
    }

    fn period(&mut self, period: &Period<2>) -> Result<(), ObserverError> {
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
