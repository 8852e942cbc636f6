//! A program through the closed loop.

use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

use super::motion_buffer::MotionBuffer;
use super::stream::{Next, Stream, Sum};
use super::{Machine, ProgramError, ProgramStatistics};
use crate::feedrate::{MotionSample, Span};
use crate::interpolator::{Setpoint, periods};
use crate::limits::Limits;
use crate::nc::{Block, NcError};
use crate::servo::DriveModel;
use crate::servo::compensation::CrossCouplingGains;
use crate::simulation::{
    Axes, Desired, Ending, MAX_PERIODS, Observer, Period, Periods, Place, RunPlan, RunTotals, SimulationError, drive,
};

/// Most motions that are read ahead of the setpoint for the sake of the contouring error alone.
const MOST_AHEAD: usize = 1000;

/// A control period of a program's run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgramPeriod {
    /// Its signals. Arc lengths are those of the whole program.
    pub period: Period<3>,
    /// The block that its setpoint is on.
    pub place: Place,
}

/// A program's run as a stream of control periods, every axis at rest on the program's first point before.
///
/// The loop is that of a [`Simulation`](crate::simulation::Simulation). Its memory does not grow with the program: blocks are read as
/// far ahead as stopping takes, and let go behind the setpoint once they are beyond twice the reach of the largest
/// tracking error so far. A tool further off than what is held (a loop that locked up) is measured against what is held.
///
/// What is wrong with a block ends the run when it is read, about a stopping distance before the tool gets there;
/// [`ProgramStatistics::of`] finds it before anything moves.
///
/// ```
/// use servosim::limits::Limits;
/// use servosim::machining::{Machine, ProgramStatistics, ProgramRun};
/// use servosim::nc::{Reader, Reading};
/// use servosim::scenario::Scenario;
/// use servosim::summary::SummaryObserver;
///
/// let text = "G0 X0 Y0 Z5\nG1 Z0 F600\nX20 F3000\nG3 X20 Y20 I0 J10\nG1 X0\nG0 Z5\nM30\n";
/// let read = || Reader::new(text.as_bytes(), "part.nc", Reading::default());
/// let alpha = Scenario::builtin("alpha")?;
/// let [x, y] = alpha.axes;
/// let machine = Machine {
///     axes: [x, y, y],
///     settings: Default::default(),
///     rapid_mm_s: 200.0,
///     accel_mm_s2: 2000.0,
///     jerk_mm_s3: 50_000.0,
///     lateral_accel_mm_s2: 1000.0,
///     corner_velocity_step_mm_s: 5.0,
///     junction_accel_step_mm_s2: 50.0,
/// };
/// let statistics = ProgramStatistics::of(read(), &machine)?;
/// assert_eq!((statistics.blocks.linear, statistics.blocks.arc, statistics.blocks.rapid), (3, 1, 2));
/// let mut summary = SummaryObserver::<3>::new("part.nc");
/// ProgramRun::new(read(), &machine)?.run(&statistics, &Limits::default(), None, &mut [&mut summary])?;
/// assert_eq!(summary.summary().samples, statistics.samples);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ProgramRun<I> {
    machine: Machine,
    stream: Stream<I>,
    window: MotionBuffer,
    axes: Axes<3>,
    /// The span being run, and whether it is the last one.
    span: Option<Span>,
    last_span: bool,
    /// Arc length and time at its start (time: after its pause).
    base: Sum,
    begun: Sum,
    /// After the end of the last span [s].
    rest_s: f64,
    /// Samples from this one on are at rest on the end; known once the last span is.
    end: Option<u64>,
    next: u64,
    over: bool,
}

impl<I: Iterator<Item = Result<Block, NcError>>> ProgramRun<I> {
    /// The run of these blocks.
    ///
    /// # Errors
    /// A machine out of range, or what is wrong with the first blocks of the program (as far as it looks ahead).
    pub fn new(blocks: I, machine: &Machine) -> Result<Self, ProgramError> {
        Self::with_drives(blocks, machine, None)
    }

    /// The same with detailed drives.
    ///
    /// # Errors
    /// As [`new`](Self::new); a drive out of range.
    pub fn with_drives(
        blocks: I,
        machine: &Machine,
        drives: Option<(&[DriveModel; 3], Option<&CrossCouplingGains>)>,
    ) -> Result<Self, ProgramError> {
        let mut stream = Stream::new(blocks, machine)?;
        let mut window = MotionBuffer::default();
        if let Some(motion) = stream.pull(&mut |_| {})? {
            window.push(motion);
        }
        let start = match window.frame(&Sum::default(), 0.0) {
            Some((frame, _)) => frame.point_mm,
            None => stream.shapes.position_mm().unwrap_or_default(),
        };
        let coupling = drives.and_then(|(_, coupling)| coupling);
        let drives = drives.map(|(drives, _)| drives);
        let axes = Axes::new(&machine.axes, drives, coupling, &machine.settings, &start);
        let axes = axes.map_err(SimulationError::from)?;
        let mut run = Self {
            machine: *machine,
            stream,
            window,
            axes,
            span: None,
            last_span: false,
            base: Sum::default(),
            begun: Sum::default(),
            rest_s: 0.0,
            end: None,
            next: 0,
            over: false,
        };
        run.advance()?;
        Ok(run)
    }

    /// How many motions are in memory: those looked ahead at, and those behind the setpoint that the tool may still be near to.
    pub fn held(&self) -> usize {
        self.window.len()
    }

    /// Takes the next span.
    fn advance(&mut self) -> Result<(), ProgramError> {
        if let Some(span) = self.span.take() {
            self.base.add(span.length_mm());
            self.begun.add(span.total_s());
        }
        loop {
            match self.stream.next(&mut |_| {})? {
                Next::Motion(motion) => self.window.push(motion),
                Next::Span(span) => {
                    self.begun.add(span.pause_s());
                    self.span = Some(span);
                    if self.stream.is_over() {
                        self.finish(self.stream.shapes.pause_s(), span.total_s());
                    }
                    return Ok(());
                }
                Next::End(pause_s) => {
                    self.finish(pause_s, 0.0);
                    return Ok(());
                }
            }
        }
    }

    /// The end is known: after the span's time and a last pause.
    fn finish(&mut self, pause_s: f64, span_s: f64) {
        if self.end.is_none() {
            let mut end = self.begun;
            end.add(span_s);
            end.add(pause_s);
            self.rest_s = pause_s;
            self.last_span = true;
            self.end = Some(periods(end.value(), self.machine.settings.period_s));
        }
    }

    /// Motion at sample `k`, its arc length counted from `base`.
    fn motion(&mut self, k: u64, time_s: f64) -> Result<MotionSample, ProgramError> {
        loop {
            let Some(span) = self.span else { return Ok(MotionSample::default()) };
            let local = self.begun.until(time_s);
            if self.end.is_some_and(|end| k >= end && end > 0) {
                return Ok(span.at(f64::INFINITY));
            }
            if self.last_span || local < span.total_s() {
                return Ok(span.at(local));
            }
            self.advance()?;
        }
    }

    fn step(&mut self) -> Result<Option<ProgramPeriod>, ProgramError> {
        let (k, settings) = (self.next, self.machine.settings);
        if let Some(end) = self.end
            && k > end.saturating_add(periods(settings.settling_s, settings.period_s))
        {
            return Ok(None);
        }
        if k >= MAX_PERIODS {
            return Err(SimulationError::TooLong { periods: k + 1, period_s: settings.period_s }.into());
        }
        self.next += 1;
        let time_s = k as f64 * settings.period_s;
        let mut motion = self.motion(k, time_s)?;
        let s = motion.s_mm;
        motion.s_mm += self.base.value();
        let Some((frame, place)) = self.window.frame_at(&self.base, s, motion.feed_mm_s) else {
            return Ok(Some(self.resting(k, time_s)));
        };
        let setpoint = Setpoint::of(time_s, &motion, &frame);
        let signals = self.axes.step_with_drives(&setpoint);
        let Self { axes, window, stream, base, .. } = self;
        let period = axes.finish_period(k, setpoint, signals, |actual_mm| {
            let reach = std::f64::consts::PI * (actual_mm - setpoint.position_mm).norm();
            while window.ahead_mm(base, s) < reach && window.len() < MOST_AHEAD {
                match stream.pull(&mut |_| {}).map_err(Some)? {
                    Some(motion) => window.push(motion),
                    None => break,
                }
            }
            window.measure(actual_mm, &setpoint.position_mm, base, s).ok_or(None)
        });
        match period {
            Ok(period) => {
                self.window.forget(&self.base, s);
                Ok(Some(ProgramPeriod { period, place }))
            }
            Err(None) => Ok(Some(self.resting(k, time_s))),
            Err(Some(error)) => Err(error),
        }
    }

    /// A period of a program without motion.
    fn resting(&mut self, k: u64, time_s: f64) -> ProgramPeriod {
        let zero = nalgebra::SVector::zeros();
        let position_mm = self.stream.shapes.position_mm().unwrap_or(zero);
        let frame = crate::path::Frame {
            s_mm: 0.0,
            point_mm: position_mm,
            tangent: zero,
            curvature_1_mm: zero,
            curvature_rate_1_mm2: zero,
        };
        let setpoint = Setpoint::of(time_s, &MotionSample::default(), &frame);
        let foot = crate::path::Foot { s_mm: 0.0, point_mm: position_mm, tangent: zero };
        let signals = self.axes.step_with_drives(&setpoint);
        let measure = |actual_mm: &nalgebra::SVector<f64, 3>| {
            let distance_mm = (actual_mm - position_mm).norm();
            Ok::<_, Infallible>(crate::contour::ContourError::of(actual_mm, &foot, distance_mm))
        };
        let Ok(period) = self.axes.finish_period(k, setpoint, signals, measure);
        ProgramPeriod { period, place: Place::default() }
    }

    /// Pulls the run to its end through the observers, as [`Simulation::run`](crate::simulation::Simulation::run) does. `statistics`
    /// are those of the same program on the same machine.
    ///
    /// # Errors
    /// An observer's error, a loop that diverged, or what is wrong with the program; all end the run.
    pub fn run(
        self,
        statistics: &ProgramStatistics,
        limits: &Limits,
        stop: Option<&AtomicBool>,
        observers: &mut [&mut dyn Observer<3>],
    ) -> Result<Ending, ProgramError> {
        let (settings, axes) = (self.machine.settings, self.machine.axes);
        let plan = RunPlan {
            desired: Desired::Points(&statistics.points_mm),
            totals: RunTotals {
                length_mm: statistics.length_mm,
                max_curvature_1_mm: statistics.max_curvature_1_mm,
                time_s: statistics.time_s,
                peaks: statistics.peaks,
                feed_mm_s: statistics.peaks.feed_mm_s,
            },
            settings: &settings,
            axes: &axes,
            limits,
            overrides: &[],
            samples: statistics.samples,
        };
        drive(self, &plan, stop, observers)
    }
}

impl<I: Iterator<Item = Result<Block, NcError>>> Periods<3> for ProgramRun<I> {
    type Error = ProgramError;

    fn next_period(&mut self) -> Result<Option<(Period<3>, Option<Place>)>, ProgramError> {
        Ok(self.next().transpose()?.map(|ProgramPeriod { period, place }| (period, Some(place))))
    }
}

impl<I: Iterator<Item = Result<Block, NcError>>> Iterator for ProgramRun<I> {
    type Item = Result<ProgramPeriod, ProgramError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let step = self.step().transpose();
        self.over = !matches!(step, Some(Ok(_)));
        step
    }
}
