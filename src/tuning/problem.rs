//! The optimisation problem: objective, constraints, variables.

use crate::analysis::{Margins, margins};
use crate::optimize::Value;
use crate::parameters::{AXIS_NAMES, OutOfRange};
use crate::scenario::Scenario;
use crate::servo::{AxisParameters, ControllerKind};

use super::TuningError;
use super::runs::{Metrics, Runs};
use super::uncertainty::{Shares, Uncertainty};
use super::variable::Variable;

/// What is to be small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Objective {
    /// Largest contouring error \[µm\].
    MaxContourError,
    /// Root mean square of the contouring error \[µm\].
    RmsContourError,
    /// Largest contouring error \[µm\] and peak voltage.
    Weighted {
        /// What one volt counts for \[µm/V\].
        voltage_um_v: f64,
    },
}

impl Objective {
    /// Of one run.
    pub fn of(self, metrics: &Metrics) -> f64 {
        let voltage = metrics.peak_voltage_v.iter().copied().fold(0.0, f64::max);
        match self {
            Self::MaxContourError => metrics.max_contour_error_um,
            Self::RmsContourError => metrics.rms_contour_error_um,
            Self::Weighted { voltage_um_v } => metrics.max_contour_error_um + voltage_um_v * voltage,
        }
    }
}

/// What gains have to keep. That no axis saturates, and none locks up, is always asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constraints {
    /// Largest peak sensitivity `Ms` of any axis, above 1.
    pub max_ms: f64,
    /// Smallest delay margin of any axis \[s\]; none where that is left to `max_ms`.
    pub min_delay_margin_s: Option<f64>,
    /// Every plant of this box must be stable.
    pub uncertainty: Uncertainty,
}

impl Default for Constraints {
    /// `Ms ≤ 1.6`, stable with gain and time constant ±20 %.
    fn default() -> Self {
        Self { max_ms: 1.6, min_delay_margin_s: None, uncertainty: Uncertainty::default() }
    }
}

/// Something that gains have to keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// Peak sensitivity at most the limit.
    PeakSensitivity,
    /// Delay margin at least the limit \[s\].
    DelayMargin,
    /// Stable for every plant of the box: the smallest of the factors by which the plant's gain is from the edge of stability,
    /// at least 1.
    StableBox,
    /// Share of saturated samples: none.
    Saturation,
    /// No lock-up.
    Lockup,
}

/// A constraint that is broken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Which one.
    pub constraint: Constraint,
    /// Of which axis, from 0; none where it is the run's.
    pub axis: Option<usize>,
    /// What the gains reach.
    pub value: f64,
    /// What they had to.
    pub limit: f64,
    /// By how much it is broken, as a share of the limit.
    pub by: f64,
}

impl std::fmt::Display for Violation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axis =
            self.axis.and_then(|axis| AXIS_NAMES.get(axis)).map(|name| format!("axis {name}: ")).unwrap_or_default();
        let (value, limit) = (self.value, self.limit);
        match self.constraint {
            Constraint::PeakSensitivity if value.is_infinite() => write!(f, "{axis}the loop is unstable"),
            Constraint::PeakSensitivity => {
                write!(f, "{axis}Ms = {value:.4} is above {limit} by {:.2} %", 100.0 * self.by)
            }
            Constraint::DelayMargin => write!(
                f,
                "{axis}the delay margin {:.4} ms is below {} ms by {:.2} %",
                1e3 * value,
                1e3 * limit,
                100.0 * self.by
            ),
            Constraint::StableBox => {
                write!(
                    f,
                    "{axis}not every plant within the uncertainty is stable (gain short by a factor of {value:.4})"
                )
            }
            Constraint::Saturation => write!(f, "the voltage saturates in {:.2} % of the samples", 100.0 * value),
            Constraint::Lockup => f.write_str("an axis locks up"),
        }
    }
}

/// Everything that is known of one set of gains.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// The axes with these gains.
    pub axes: [AxisParameters; 2],
    /// Margins of each axis.
    pub margins: [Margins; 2],
    /// The run; none where the loop is not stable enough to be worth one.
    pub metrics: Option<Metrics>,
    /// Constraints that are broken.
    pub violations: Vec<Violation>,
    /// What the search compares.
    pub value: Value,
}

/// A scenario, what may be changed in it and what is asked of it.
///
/// It is the models of the axes that are run and analysed: what their drives do beside that takes no part, see
/// [`TuningReport::notes`](super::TuningReport::notes).
///
/// **Why the worst plants count.** A search that sees the nominal plants alone finds gains for which the errors of the two axes
/// cancel along this very path: 0.1 µm, and twenty times as much when one plant is a little slower than the scenario says.
/// The corners of the uncertainty box count with [`Problem::worst_weight`] for that reason. Corners whose plants would need more
/// than the drive's voltage to follow the path are left out: no gains can help there.
#[derive(Debug)]
pub struct Problem<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// What may be changed.
    pub variables: Vec<Variable>,
    /// What is to be small.
    pub objective: Objective,
    /// What has to be kept.
    pub constraints: Constraints,
    /// How much the worst corner of the uncertainty box counts beside the nominal plants; 0 for the nominal plants alone.
    pub worst_weight: f64,
    /// The corners that count.
    corners: Vec<Shares>,
    runs: Runs<'a>,
}

impl<'a> Problem<'a> {
    /// A scenario, what may be changed in it, and what is asked of it.
    ///
    /// # Errors
    /// No variable, one that is there twice, limits that make no sense, another controller than PDFF, axes that cannot be simulated.
    pub fn new(
        scenario: &'a Scenario,
        variables: Vec<Variable>,
        objective: Objective,
        constraints: Constraints,
        worst_weight: f64,
    ) -> Result<Self, TuningError> {
        for (drive, axis) in scenario.drives.iter().zip(AXIS_NAMES) {
            let kind = drive.controller.kind();
            if kind != ControllerKind::Pdff {
                return Err(TuningError::Controller { axis, controller: kind.name() });
            }
        }
        let runs = Runs::new(scenario)?;
        let mut problem = Self { scenario, variables, objective, constraints, worst_weight, corners: Vec::new(), runs };
        problem.check()?;
        if worst_weight > 0.0 && !constraints.uncertainty.is_none() {
            problem.corners = constraints.uncertainty.corners_in_reach(scenario);
        }
        Ok(problem)
    }

    /// Runs with each of these axes, whatever becomes of them.
    pub(super) fn runs(&self) -> &Runs<'a> {
        &self.runs
    }

    /// How many runs one evaluation takes.
    pub fn plants(&self) -> usize {
        1 + self.corners.len()
    }

    /// The axes at a point of the unit cube, a coordinate a variable (see [`Variable::value`]).
    pub fn axes(&self, point: &[f64]) -> [AxisParameters; 2] {
        let mut axes = self.scenario.axes;
        for (variable, &position) in self.variables.iter().zip(point) {
            variable.gain.set(&mut axes[variable.axis].pdff, variable.value(position));
        }
        axes
    }

    /// The scenario's own gains as a point of the unit cube.
    pub fn start(&self) -> Vec<f64> {
        let own = |v: &Variable| v.position(v.gain.of(&self.scenario.axes[v.axis].pdff));
        self.variables.iter().map(own).collect()
    }

    /// Limits that make sense, variables that are there once, and a run that can be made.
    ///
    /// # Errors
    /// Names the first thing that is wrong.
    fn check(&self) -> Result<(), TuningError> {
        if self.variables.is_empty() {
            return Err(TuningError::NothingToVary);
        }
        let limit = |name, value, needed, is_sound: bool| {
            if is_sound { Ok(()) } else { Err(TuningError::Limit(OutOfRange::new(name, value, needed))) }
        };
        let Constraints { max_ms, min_delay_margin_s, uncertainty } = self.constraints;
        let needed = "above 1 (no loop has a peak sensitivity of 1 or less), and finite";
        limit("the limit of Ms", max_ms, needed, max_ms > 1.0 && max_ms.is_finite())?;
        if let Some(margin) = min_delay_margin_s {
            limit("the least delay margin [s]", margin, "positive and finite", margin > 0.0 && margin.is_finite())?;
        }
        for (name, share) in [("gain", uncertainty.gain), ("time constant", uncertainty.time_constant)] {
            let name =
                if name == "gain" { "the uncertainty of the gain" } else { "the uncertainty of the time constant" };
            limit(name, share, "at least 0 and below 1 (0 % to below 100 %)", (0.0..1.0).contains(&share))?;
        }
        let sound = self.worst_weight >= 0.0 && self.worst_weight.is_finite();
        limit("the weight of the worst plants", self.worst_weight, "not negative, and finite", sound)?;
        if let Objective::Weighted { voltage_um_v } = self.objective {
            let sound = voltage_um_v >= 0.0 && voltage_um_v.is_finite();
            limit("the weight of the voltage [µm/V]", voltage_um_v, "not negative, and finite", sound)?;
        }
        for (i, variable) in self.variables.iter().enumerate() {
            if self.variables[..i].iter().any(|v| v.axis == variable.axis && v.gain == variable.gain) {
                return Err(TuningError::Twice { key: variable.key() });
            }
        }
        Ok(())
    }

    /// By how much the loops alone break what they have to keep; cheap.
    pub(super) fn loop_violation(&self, point: &[f64]) -> f64 {
        self.loops(&self.axes(point)).0.iter().map(|violation| violation.by).sum()
    }

    /// The value of a point: what a search minimises.
    pub fn value(&self, point: &[f64]) -> Value {
        let axes = self.axes(point);
        let (violations, _) = self.loops(&axes);
        if violations.is_empty() { self.run(&axes).2 } else { not_simulated(&violations) }
    }

    /// Everything about these axes.
    pub fn assess(&self, axes: [AxisParameters; 2]) -> Assessment {
        let (mut violations, margins) = self.loops(&axes);
        let (metrics, of_run, value) = self.run(&axes);
        let value = if violations.is_empty() { value } else { not_simulated(&violations) };
        violations.extend(of_run);
        let is_stable = margins.iter().all(|m| m.stable);
        Assessment { axes, margins, metrics: is_stable.then_some(metrics), violations, value }
    }

    /// What the loops break, without a run: cheap.
    fn loops(&self, axes: &[AxisParameters; 2]) -> (Vec<Violation>, [Margins; 2]) {
        let settings = &self.scenario.settings;
        let margins = axes.each_ref().map(|axis| margins(axis, settings));
        let mut violations = Vec::new();
        for (i, (axis, margins)) in axes.iter().zip(&margins).enumerate() {
            let mut broken = |constraint, value, limit, by| {
                violations.push(Violation { constraint, axis: Some(i), value, limit, by });
            };
            let Constraints { max_ms, min_delay_margin_s, uncertainty } = self.constraints;
            if !margins.stable {
                // Beyond every stable loop; the slower it diverges the better.
                broken(Constraint::PeakSensitivity, f64::INFINITY, max_ms, 1e3 * margins.pole_radius);
                continue;
            }
            if !(margins.peak_sensitivity <= max_ms) {
                let by = (margins.peak_sensitivity / max_ms - 1.0).min(1e3);
                broken(Constraint::PeakSensitivity, margins.peak_sensitivity, max_ms, by);
            }
            if let Some(limit) = min_delay_margin_s
                && !(margins.delay_margin_s >= limit)
            {
                broken(Constraint::DelayMargin, margins.delay_margin_s, limit, 1.0 - margins.delay_margin_s / limit);
            }
            let reserve = uncertainty.reserve(axis, settings);
            if !(reserve > 1.0) {
                broken(Constraint::StableBox, reserve, 1.0, (1.0 - reserve).max(1e-12));
            }
        }
        (violations, margins)
    }

    /// The nominal run, what it breaks, and its value.
    fn run(&self, axes: &[AxisParameters; 2]) -> (Metrics, Vec<Violation>, Value) {
        let uncertainty = &self.constraints.uncertainty;
        let corners = self.corners.iter().map(|shares| uncertainty.moved(axes, shares));
        let plants: Vec<[AxisParameters; 2]> = std::iter::once(*axes).chain(corners).collect();
        let runs = self.runs.of(&plants);
        let nominal = runs.first().copied().unwrap_or(Metrics::LOST);
        let mut violations = Vec::new();
        let mut broken = |constraint, value, by| {
            violations.push(Violation { constraint, axis: None, value, limit: 0.0, by });
        };
        if nominal.saturated_share > 0.0 {
            broken(Constraint::Saturation, nominal.saturated_share, 0.5 * nominal.saturated_share);
        }
        let locked = runs.iter().filter(|run| run.locked_up).count();
        if locked > 0 {
            broken(Constraint::Lockup, locked as f64, 0.5 * locked as f64 / runs.len() as f64);
        }
        // `max` would lose what is no number.
        let worse = |worst: f64, value: f64| if value > worst || value.is_nan() { value } else { worst };
        let worst = runs.iter().map(|run| self.objective.of(run)).fold(0.0, worse);
        let weight = if self.corners.is_empty() { 0.0 } else { self.worst_weight };
        let nominal_value = self.objective.of(&nominal);
        let objective = if weight > 0.0 { nominal_value + weight * worst } else { nominal_value };
        let value = Value { violation: violations.iter().map(|v| v.by).sum(), objective };
        (nominal, violations, value)
    }
}

/// Further from allowed than any point whose run saturates (those are at most 1 away).
fn not_simulated(violations: &[Violation]) -> Value {
    Value::infeasible(1.0 + violations.iter().map(|violation| violation.by).sum::<f64>())
}
