//! The simulation: setpoints through the axes, one control period after another, handed to observers.
//!
//! [`Simulation`] is a stream: an iterator of [`Period`]s that keeps nothing and, once it runs, allocates nothing; but detailed drives
//! go a block of 2048 periods ahead of it, each axis on a core of its own. [`Simulation::run`] pulls it to its end, watches it
//! ([`Event`]s) and hands every period to the [`Observer`]s: the recording, the summary, or one of your own.

mod axes;
mod batch;
mod block_buffer;
mod corrections;
mod corrections_file;
mod drive;
mod event;
mod monitor;
mod plan;
mod reference_trajectory;

use crate::parameters::OutOfRange;
use std::convert::Infallible;
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::SVector;

use crate::contour::{ContourError, ContourMeter};
use crate::feedrate::Motion;
use crate::interpolator::{Interpolator, Setpoint, periods};
use crate::limits::Limits;
use crate::path::Path;
use crate::servo::compensation::CrossCouplingGains;
use crate::servo::{AxisParameters, AxisSignals, DriveModel, DriveSignals, LoopSettings};
pub(crate) use axes::Axes;
use block_buffer::{BlockBuffer, BlockSample};
use corrections::Corrections;
pub(crate) use corrections::shift;
pub use corrections_file::{CorrectionsError, MAX_CORRECTED_PERIODS, read_corrections, write_corrections};
pub(crate) use drive::{Periods, drive};
pub use event::{Event, Severity};
pub use plan::{Desired, RunPlan, RunTotals};
pub use reference_trajectory::{MAX_TRAJECTORY_PERIODS, ReferenceTrajectory, RunMetrics};

/// Most control periods that a run may have (28 hours at 1 ms).
pub const MAX_PERIODS: u64 = 100_000_000;

/// All signals of one control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period<const A: usize> {
    /// Number of the sample, from 0.
    pub k: u64,
    /// Time `k Δt` \[s\].
    pub time_s: f64,
    /// What was commanded.
    pub setpoint: Setpoint<A>,
    /// What each axis did.
    pub axes: [AxisSignals; A],
    /// Where the tool is \[mm\].
    pub actual_mm: SVector<f64, A>,
    /// The nearest point of the desired path \[mm\].
    pub nearest_mm: SVector<f64, A>,
    /// Its arc length \[mm\].
    pub nearest_s_mm: f64,
    /// Signed distance to it, positive to the left of the direction of travel \[µm\].
    pub contour_error_um: f64,
    /// Distance to the setpoint \[µm\].
    pub tracking_error_um: f64,
    /// The drive signals; none with the ideal drive model.
    pub drives: Option<[DriveSignals; A]>,
}

impl<const A: usize> Period<A> {
    /// The period in which the axes answered to a setpoint.
    #[inline]
    pub(crate) fn of(
        k: u64,
        setpoint: Setpoint<A>,
        axes: [AxisSignals; A],
        error: &ContourError<A>,
        drives: Option<[DriveSignals; A]>,
    ) -> Self {
        let actual_mm = SVector::from_fn(|axis, _| axes[axis].actual_mm);
        Self {
            k,
            time_s: setpoint.time_s,
            setpoint,
            axes,
            actual_mm,
            nearest_mm: error.nearest_mm,
            nearest_s_mm: error.s_mm,
            contour_error_um: 1e3 * error.signed_mm,
            tracking_error_um: 1e3 * (setpoint.position_mm - actual_mm).norm(),
            drives,
        }
    }
}

/// Where in a program a period belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    /// Line of the program, from 1; 0 where its blocks come from no text.
    pub line: usize,
    /// Number of the block, from 0.
    pub block: u64,
    /// Whether it is rapid motion.
    pub rapid: bool,
}

/// An observer's failure: any error.
pub type ObserverError = Box<dyn Error + Send + Sync>;

/// Sees a run as it happens.
pub trait Observer<const A: usize> {
    /// Once, before the first period.
    ///
    /// # Errors
    /// Ends the run.
    fn begin(&mut self, plan: &RunPlan<'_, A>) -> Result<(), ObserverError> {
        let _ = plan;
        Ok(())
    }

    /// In the run of a program: before the first period of each of its motions that is run through (those that no sample falls on
    /// are left out).
    ///
    /// # Errors
    /// Ends the run.
    fn place(&mut self, place: &Place) -> Result<(), ObserverError> {
        let _ = place;
        Ok(())
    }

    /// Once a control period.
    ///
    /// # Errors
    /// Ends the run.
    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError>;

    /// Whenever something worth a line in the log happens; after the period that shows it.
    ///
    /// # Errors
    /// Ends the run.
    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        let _ = event;
        Ok(())
    }
}

/// Every closure over periods is an observer.
impl<const A: usize, F: FnMut(&Period<A>)> Observer<A> for F {
    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError> {
        self(period);
        Ok(())
    }
}

/// Why a simulation could not be set up or did not reach its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// A parameter of an axis or of the loop is out of range.
    #[error(transparent)]
    Parameter(#[from] OutOfRange),
    /// The run would be too long.
    #[error("the run would take {periods} control periods of {period_s} s; at most {MAX_PERIODS} are simulated")]
    TooLong {
        /// How many it would take.
        periods: u64,
        /// The control period.
        period_s: f64,
    },
    /// The trajectory of a batch would be too long.
    #[error("a run takes {periods} control periods; batches keep them all and take at most {MAX_TRAJECTORY_PERIODS}")]
    TooLongForBatch {
        /// How many it would take.
        periods: u64,
    },
    /// A signal is no longer a number.
    #[error("the loop diverged: a signal is no longer a finite number at t = {time_s} s")]
    Diverged {
        /// When.
        time_s: f64,
    },
    /// An observer failed.
    #[error("{0}")]
    Observer(ObserverError),
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// After the last period.
    Complete,
    /// The stop flag was raised.
    Interrupted,
}

/// A run as a stream of control periods.
#[derive(Clone)]
pub struct Simulation<'a, const A: usize> {
    path: &'a dyn Path<A>,
    motion: Motion,
    parameters: [AxisParameters; A],
    settings: LoopSettings,
    interpolator: Interpolator<'a, A>,
    axes: Axes<A>,
    /// Where the axes are more than their model: what they have done already.
    ahead: BlockBuffer<A>,
    corrections: Option<Corrections<A>>,
    contour: ContourMeter<'a, A>,
    next: u64,
    last: u64,
}

impl<'a, const A: usize> Simulation<'a, A> {
    /// A run along `path` with `motion`, every axis at rest on the path's first point.
    ///
    /// # Errors
    /// A parameter out of range, or more than [`MAX_PERIODS`] periods.
    pub fn new(
        path: &'a dyn Path<A>,
        motion: &Motion,
        parameters: [AxisParameters; A],
        settings: LoopSettings,
    ) -> Result<Self, SimulationError> {
        Self::build(path, motion, parameters, None, None, settings)
    }

    /// The same with detailed drives, and a cross-coupled controller where there is one.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_drives(
        path: &'a dyn Path<A>,
        motion: &Motion,
        parameters: [AxisParameters; A],
        drives: &[DriveModel; A],
        cross_coupling: Option<&CrossCouplingGains>,
        settings: LoopSettings,
    ) -> Result<Self, SimulationError> {
        Self::build(path, motion, parameters, Some(drives), cross_coupling, settings)
    }

    fn build(
        path: &'a dyn Path<A>,
        motion: &Motion,
        parameters: [AxisParameters; A],
        drives: Option<&[DriveModel; A]>,
        cross_coupling: Option<&CrossCouplingGains>,
        settings: LoopSettings,
    ) -> Result<Self, SimulationError> {
        settings.check()?;
        let mut interpolator = Interpolator::new(path, motion, settings.period_s);
        let last = interpolator.last_sample().saturating_add(periods(settings.settling_s, settings.period_s));
        if last >= MAX_PERIODS {
            return Err(SimulationError::TooLong { periods: last.saturating_add(1), period_s: settings.period_s });
        }
        let start = interpolator.setpoint(0).position_mm;
        let axes = Axes::new(&parameters, drives, cross_coupling, &settings, &start)?;
        if matches!(axes, Axes::Model(_)) {
            interpolator = interpolator.solving_the_end_again();
        }
        let contour = ContourMeter::new(path);
        let motion = motion.clone();
        Ok(Self {
            path,
            motion,
            parameters,
            settings,
            interpolator,
            axes,
            ahead: BlockBuffer::new(),
            corrections: None,
            contour,
            next: 0,
            last,
        })
    }

    /// The run with `shifts_mm` added to the position commands, one a sample \[mm\]; the last one stays. The derivatives of the
    /// commands are shifted alike. Setpoints, tracking and contouring errors stay those of the path. A run without corrections is the
    /// same to the bit.
    ///
    /// For what [`learning`](crate::learning) has learned; before the run's first sample.
    ///
    /// # Errors
    /// A shift that is not a finite number.
    pub fn with_corrections(mut self, shifts_mm: Arc<[SVector<f64, A>]>) -> Result<Self, SimulationError> {
        if let Some(wrong) = shifts_mm.iter().flat_map(|shift| shift.iter()).find(|mm| !(mm.abs() <= 1e6)) {
            let needed = "a finite number of millimetres, at most 1e6";
            return Err(OutOfRange::new("correction of a command", *wrong, needed).into());
        }
        self.corrections = Some(Corrections::new(shifts_mm, self.settings.period_s));
        Ok(self)
    }

    /// Setpoint of sample `k`, the next one, what the axes do at it and what they tell beside.
    #[inline]
    fn step(&mut self, k: u64) -> (Setpoint<A>, [AxisSignals; A], Option<[DriveSignals; A]>) {
        let corrections = self.corrections.as_ref();
        if let Axes::Real(real) = &mut self.axes {
            let left = self.last + 1 - k;
            let BlockSample { setpoint, axes, drives } =
                self.ahead.take(real, &mut self.interpolator, corrections, k, left);
            return (setpoint, axes, Some(drives));
        }
        let setpoint = self.interpolator.setpoint(k);
        let Some(corrections) = corrections else { return (setpoint, self.axes.step(&setpoint), None) };
        let mut axes = self.axes.step(&corrections.of(&setpoint, k));
        for (signals, command_mm) in axes.iter_mut().zip(setpoint.position_mm.iter()) {
            signals.command_mm = *command_mm;
        }
        (setpoint, axes, None)
    }

    /// How many periods the whole run has.
    pub fn samples(&self) -> u64 {
        self.last + 1
    }

    /// Pulls the run to its end through the observers.
    ///
    /// Events (saturation, limits passed, lock-up) are found on the way and told to the observers; they end nothing. When
    /// `stop` is raised the run ends early, after a whole period (after the last one it is complete all the same).
    ///
    /// # Errors
    /// An observer's error, or a loop that diverged; both end the run.
    pub fn run(
        self,
        limits: &Limits,
        stop: Option<&AtomicBool>,
        observers: &mut [&mut dyn Observer<A>],
    ) -> Result<Ending, SimulationError> {
        let (motion, settings, axes) = (self.motion.clone(), self.settings, self.parameters);
        let plan = RunPlan::new(self.path, &motion, &settings, &axes, limits, self.samples());
        drive(self, &plan, stop, observers)
    }
}

impl<const A: usize> Periods<A> for Simulation<'_, A> {
    type Error = SimulationError;

    #[inline]
    fn next_period(&mut self) -> Result<Option<(Period<A>, Option<Place>)>, SimulationError> {
        Ok(self.next().map(|period| (period, None)))
    }
}

impl<const A: usize> Iterator for Simulation<'_, A> {
    type Item = Period<A>;

    fn next(&mut self) -> Option<Period<A>> {
        if self.next > self.last {
            return None;
        }
        let k = self.next;
        self.next += 1;
        let (setpoint, axes, drives) = self.step(k);
        let contour = &mut self.contour;
        let measure = |actual_mm: &SVector<f64, A>| {
            Ok::<_, Infallible>(contour.measure(actual_mm, &setpoint.position_mm, setpoint.s_mm))
        };
        self.axes.finish_period(k, setpoint, (axes, drives), measure).ok()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = usize::try_from((self.last + 1).saturating_sub(self.next)).ok();
        (left.unwrap_or(usize::MAX), left)
    }
}
