//! One scenario in many variants: its effects one by one and together, under several controllers or sets of gains.
//!
//! Rows are drives, columns are controllers or sets of gains; a cell is a whole run. Rows: the ideal model, each effect alone, all
//! effects, and all effects with compensation. A scenario without effects has one row.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector2;
use rayon::prelude::*;
use serde::Serialize;

use crate::scenario::Scenario;
use crate::servo::compensation::Compensation;
use crate::servo::effects::{EffectKind, Effects};
use crate::servo::{ControllerGains, ControllerKind, DriveModel, Pdff};
use crate::simulation::{Observer, ObserverError, Period, Simulation, SimulationError};
use crate::summary::Summary;

/// How the axes are controlled: a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// As the scenario says.
    Own,
    /// By a controller of this kind, with the scenario's own gains for it or those of the same loops
    /// ([`ControllerGains::like`]).
    Controller(ControllerKind),
    /// With the PDFF gains of another scenario, X and Y; its name.
    Gains(String, [Pdff; 2]),
}

impl Column {
    /// What stands above it.
    pub fn name(&self) -> &str {
        match self {
            Self::Own => "scenario",
            Self::Controller(kind) => kind.name(),
            Self::Gains(name, _) => name,
        }
    }

    /// The scenario controlled in this way.
    #[must_use]
    pub fn of(&self, scenario: &Scenario) -> Scenario {
        let mut out = scenario.clone();
        match self {
            Self::Own => {}
            Self::Controller(kind) => {
                for (drive, axis) in out.drives.iter_mut().zip(&scenario.axes) {
                    if drive.controller.kind() != *kind {
                        drive.controller = ControllerGains::like(*kind, axis, &scenario.settings);
                        // The prefilter undoes the PDFF loop.
                        drive.zero_phase &= *kind == ControllerKind::Pdff;
                    }
                }
            }
            Self::Gains(_, pdff) => {
                for (axis, pdff) in out.axes.iter_mut().zip(pdff) {
                    axis.pdff = *pdff;
                }
            }
        }
        out
    }
}

/// What the drives do: a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Row {
    /// Nothing that the model does not know.
    Model,
    /// One effect alone, nothing done about it.
    Effect(EffectKind),
    /// All effects, nothing done about them.
    AllEffects,
    /// The scenario as it is.
    Whole,
}

impl Row {
    /// The rows of a scenario.
    pub fn of_scenario(scenario: &Scenario) -> Vec<Self> {
        let on = |kind: &EffectKind| scenario.drives.iter().any(|drive| drive.effects.has(*kind));
        let effects: Vec<EffectKind> = EffectKind::ALL.into_iter().filter(on).collect();
        let mut rows = vec![Self::Model];
        rows.extend(effects.iter().copied().map(Self::Effect));
        if effects.len() > 1 {
            rows.push(Self::AllEffects);
        }
        if helped(scenario) {
            rows.push(Self::Whole);
        }
        rows
    }

    /// What stands beside it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Model => "ideal model",
            Self::Effect(kind) => kind.name(),
            Self::AllEffects => "all effects",
            Self::Whole => "with compensation",
        }
    }

    /// The scenario with these effects; its controllers stay.
    #[must_use]
    pub fn of(self, scenario: &Scenario) -> Scenario {
        let mut out = scenario.clone();
        if self == Self::Whole {
            return out;
        }
        out.cross_coupling = None;
        out.corrections_mm = None;
        for drive in &mut out.drives {
            let effects = match self {
                Self::Model => Effects::default(),
                Self::Effect(kind) => drive.effects.only(kind),
                Self::AllEffects | Self::Whole => drive.effects.clone(),
            };
            *drive = DriveModel { controller: drive.controller, effects, ..DriveModel::default() };
        }
        out
    }
}

/// Whether something is done about the effects.
fn helped(scenario: &Scenario) -> bool {
    let helped = |drive: &DriveModel| drive.compensation != Compensation::default() || drive.zero_phase;
    scenario.cross_coupling.is_some() || scenario.corrections_mm.is_some() || scenario.drives.iter().any(helped)
}

/// What a run came to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    /// Largest contouring error.
    pub max_contour_error_um: f64,
    /// Largest difference of the contouring error, as a vector, from that of the ideal model under the same controller, sample by sample; null
    /// where that one diverges.
    pub from_model_um: Option<f64>,
    /// Root mean square of the contouring error.
    pub rms_contour_error_um: f64,
    /// Largest tracking error.
    pub max_tracking_error_um: f64,
    /// Largest voltage of any axis.
    pub peak_voltage_v: f64,
    /// Whether an axis locked up.
    pub locked_up: bool,
    /// Whether every limit of the scenario is kept, and no axis locked up.
    pub passed: bool,
}

impl Cell {
    fn new(summary: &Summary, from_model_um: Option<f64>) -> Self {
        Self {
            max_contour_error_um: summary.max_contour_error_um,
            from_model_um,
            rms_contour_error_um: summary.rms_contour_error_um,
            max_tracking_error_um: summary.max_tracking_error_um,
            peak_voltage_v: summary.peak_voltage_v,
            locked_up: summary.locked_up,
            passed: summary.passed(),
        }
    }
}

/// From the table to the nearest point of the path.
fn error_mm(period: &Period<2>) -> Vector2<f64> {
    period.nearest_mm - period.actual_mm
}

/// Runs the model beside another run, one period for one: no run is kept.
struct Beside<'a> {
    model: Simulation<'a, 2>,
    largest_um: Option<f64>,
}

impl Observer<2> for Beside<'_> {
    fn period(&mut self, period: &Period<2>) -> Result<(), ObserverError> {
        // As vectors: beyond an end of the path the error has no side, and its sign jumps.
        let apart = self.model.next().map_or(f64::NAN, |model| 1e3 * (error_mm(period) - error_mm(&model)).norm());
        self.largest_um = self.largest_um.filter(|_| apart.is_finite()).map(|largest| largest.max(apart));
        Ok(())
    }
}

/// How a run of the table ended.
enum Ran {
    Whole(Cell),
    Diverged,
    Stopped,
}

/// One run of the table.
fn run(row: Row, column: &Column, scenario: &Scenario, stop: &AtomicBool) -> Result<Ran, SimulationError> {
    let variant = column.of(&row.of(scenario));
    let model = column.of(&Row::Model.of(scenario));
    let mut beside = Beside { model: model.simulation()?, largest_um: Some(0.0) };
    let mut observers: Vec<&mut dyn Observer<2>> = Vec::new();
    if row != Row::Model {
        observers.push(&mut beside);
    }
    match variant.run_until(Some(stop), &mut observers) {
        Ok(summary) if summary.complete => Ok(Ran::Whole(Cell::new(&summary, beside.largest_um))),
        Ok(_) => Ok(Ran::Stopped),
        Err(SimulationError::Diverged { .. }) => Ok(Ran::Diverged),
        Err(error) => Err(error),
    }
}

/// A line of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// What the drives do.
    pub drives: String,
    /// One run a column; null where the loop diverged.
    pub runs: Vec<Option<Cell>>,
}

/// A table of runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scenario.
    pub scenario: String,
    /// How the axes are controlled.
    pub columns: Vec<String>,
    /// What the drives do.
    pub lines: Vec<Line>,
}

impl Comparison {
    /// Runs every variant, on all cores; the same on any number of them.
    ///
    /// # Errors
    /// A variant that cannot be set up, a run that is too long.
    pub fn of(scenario: &Scenario, columns: &[Column]) -> Result<Self, SimulationError> {
        let complete = Self::until(&AtomicBool::new(false), scenario, columns)?;
        Ok(complete.unwrap_or_else(|| Self::with(scenario, columns, Vec::new())))
    }

    /// As [`of`](Self::of), but gives nothing where `stop` was raised before the last run was done.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn until(stop: &AtomicBool, scenario: &Scenario, columns: &[Column]) -> Result<Option<Self>, SimulationError> {
        let rows = Row::of_scenario(scenario);
        let variants: Vec<(Row, &Column)> =
            rows.iter().flat_map(|row| columns.iter().map(|column| (*row, column))).collect();
        let runs: Vec<Result<Ran, SimulationError>> = variants
            .par_iter()
            .map(
                |(row, column)| {
                    if stop.load(Ordering::Relaxed) { Ok(Ran::Stopped) } else { run(*row, column, scenario, stop) }
                },
            )
            .collect();
        let runs: Vec<Ran> = runs.into_iter().collect::<Result<_, _>>()?;
        let cells = runs.into_iter().map(|run| match run {
            Ran::Whole(cell) => Some(Some(cell)),
            Ran::Diverged => Some(None),
            Ran::Stopped => None,
        });
        let runs: Option<Vec<Option<Cell>>> = cells.collect();
        Ok(runs.map(|runs| {
            let lines = rows
                .iter()
                .zip(runs.chunks(columns.len().max(1)))
                .map(|(row, runs)| Line { drives: row.name().to_owned(), runs: runs.to_vec() });
            Self::with(scenario, columns, lines.collect())
        }))
    }

    fn with(scenario: &Scenario, columns: &[Column], lines: Vec<Line>) -> Self {
        Self {
            scenario: scenario.name.clone(),
            columns: columns.iter().map(|column| column.name().to_owned()).collect(),
            lines,
        }
    }

    /// Whether an axis locks up or a loop diverges anywhere in the table, or a limit is broken in its last line: the scenario as it is.
    pub fn is_broken(&self) -> bool {
        let lost = |run: &Option<Cell>| run.is_none_or(|cell| cell.locked_up);
        let broken = |run: &Option<Cell>| run.is_none_or(|cell| !cell.passed);
        self.lines.iter().any(|line| line.runs.iter().any(lost))
            || self.lines.last().is_some_and(|line| line.runs.iter().any(broken))
    }
}
