//! Runs a stream of periods to its end, through monitor and observers.

use std::sync::atomic::{AtomicBool, Ordering};

use super::event::Event;
use super::monitor::Monitor;
use super::{Ending, Observer, Period, Place, RunPlan, SimulationError};

/// A run as a stream of control periods.
pub(crate) trait Periods<const A: usize> {
    /// What can go wrong in it.
    type Error: From<SimulationError>;

    /// The next period, and where in its program it belongs to.
    ///
    /// # Errors
    /// Ends the run.
    fn next_period(&mut self) -> Result<Option<(Period<A>, Option<Place>)>, Self::Error>;
}

/// Pulls the periods through the observers and watches them; see [`Simulation::run`](super::Simulation::run).
pub(crate) fn drive<const A: usize, P: Periods<A>>(
    mut periods: P,
    plan: &RunPlan<'_, A>,
    stop: Option<&AtomicBool>,
    observers: &mut [&mut dyn Observer<A>],
) -> Result<Ending, P::Error> {
    let mut monitor = Monitor::new(plan.limits, plan.settings, !plan.overrides.is_empty());
    for observer in observers.iter_mut() {
        observer.begin(plan).map_err(SimulationError::Observer)?;
    }
    let mut place = None;
    let mut overrides = plan.overrides.iter().peekable();
    while let Some((period, here)) = periods.next_period()? {
        if !(period.contour_error_um.is_finite() && period.tracking_error_um.is_finite()) {
            return Err(SimulationError::Diverged { time_s: period.time_s }.into());
        }
        if let Some(here) = here
            && place != Some(here)
        {
            place = Some(here);
            for observer in observers.iter_mut() {
                observer.place(&here).map_err(SimulationError::Observer)?;
            }
        }
        for observer in observers.iter_mut() {
            observer.period(&period).map_err(SimulationError::Observer)?;
        }
        monitor.watch(&period, &mut |event| {
            observers.iter_mut().try_for_each(|o| o.event(event).map_err(SimulationError::Observer))
        })?;
        while let Some(&change) = overrides.next_if(|change| change.at_s <= period.time_s) {
            let event = Event::OverrideChanged { change, time_s: period.time_s };
            for observer in observers.iter_mut() {
                observer.event(&event).map_err(SimulationError::Observer)?;
            }
        }
        let more = period.k + 1 < plan.samples;
        if more && stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            let event = Event::Interrupted { time_s: period.time_s };
            for observer in observers.iter_mut() {
                observer.event(&event).map_err(SimulationError::Observer)?;
            }
            return Ok(Ending::Interrupted);
        }
    }
    Ok(Ending::Complete)
}
