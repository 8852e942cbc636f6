//! Result of a tuning, and whether it can be trusted.

use crate::parameters::AXIS_NAMES;
use rayon::prelude::*;
use serde::Serialize;

use super::problem::{Assessment, Objective, Problem};
use super::runs::{Metrics, Runs, noisy};
use super::search::{Tuned, Tuning};
use super::variable::Gain;
use crate::analysis::{DriveLoop, Linearized};
use crate::scenario::Scenario;
use crate::servo::AxisParameters;

/// How many plants are sampled from the uncertainty box.
pub const DRAWN_PLANTS: usize = 1000;

/// Control periods that the runs of sampled plants may take, about; the second where the user has asked to stop.
const DRAWN_PERIODS: [u64; 2] = [1 << 27, 1 << 22];

/// Fewest plants that are sampled.
const LEAST_PLANTS: u64 = 10;

/// Feed of the check at a higher feed, as a multiple of the scenario's.
const HIGHER_FEED: f64 = 1.5;

/// Standard deviation of the noise on the voltage of the check with noise, as a share of the voltage.
const NOISE: f64 = 0.01;

/// A constraint within this share of its limit is active.
const ACTIVE: f64 = 2e-3;

/// Everything that is told of a tuning, before beside after.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TuningReport {
    /// Name of the scenario.
    pub scenario: String,
    /// How it was searched.
    pub search: SearchMetadata,
    /// Whether the gains after keep every constraint.
    pub feasible: bool,
    /// The constraints that the gains after break, in words.
    pub broken: Vec<String>,
    /// The scenario's own gains.
    pub before: GainSet,
    /// The tuned ones.
    pub after: GainSet,
    /// What was varied, and how sensitive the result is to it.
    pub gains: Vec<GainSensitivity>,
    /// What keeps the result from being better, in words.
    pub active: Vec<String>,
    /// Checks that were not part of the objective.
    pub checks: Vec<Check>,
    /// What the search did not see of the drives, in words; empty where they are what their models say.
    pub notes: Vec<String>,
}

/// How it was searched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SearchMetadata {
    /// Method: `nelder-mead`, `cma-es` or `pattern-search`.
    pub method: &'static str,
    /// What was to be small: `max`, `rms` or `weighted`.
    pub objective: &'static str,
    /// How much the worst corner of the uncertainty box counted.
    pub worst_weight: f64,
    /// Runs of one evaluation.
    pub plants: usize,
    /// Starts.
    pub starts: usize,
    /// Seed.
    pub seed: u64,
    /// Evaluations that were made.
    pub evaluations: usize,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
    /// Limit of `Ms`.
    pub max_ms: f64,
    /// Least delay margin \[s\].
    pub min_delay_margin_s: Option<f64>,
    /// Uncertainty of the plants' gain, as a share.
    pub gain_uncertainty: f64,
    /// The same of their time constant.
    pub time_constant_uncertainty: f64,
}

/// One set of gains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GainSet {
    /// Objective; null where it was not simulated.
    pub objective: f64,
    /// Metrics of the nominal run; none where a loop is unstable.
    pub metrics: Option<Metrics>,
    /// Runs of [`DRAWN_PLANTS`] plants of the uncertainty box; of fewer where a run is very long.
    pub sampled: Statistics,
    /// Margins of each axis.
    pub axes: Vec<AxisMargins>,
}

/// Margins of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisMargins {
    /// Name of the axis.
    pub axis: &'static str,
    /// Peak sensitivity; null where the loop is unstable.
    pub peak_sensitivity: f64,
    /// Delay margin \[s\].
    pub delay_margin_s: f64,
    /// Phase margin \[deg\].
    pub phase_margin_deg: f64,
    /// Lowest factor on the loop gain that is stable.
    pub gain_down: f64,
    /// Highest one.
    pub gain_up: f64,
}

/// Contouring errors of many plants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// How many plants.
    pub plants: usize,
    /// Largest contouring error of any \[µm\].
    pub worst_um: f64,
    /// Of all but 5 % \[µm\].
    pub percentile_95_um: f64,
    /// Of half of them \[µm\].
    pub median_um: f64,
    /// How many of them saturate.
    pub saturated: usize,
    /// How many of them lock up.
    pub locked_up: usize,
}

/// A gain that was varied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GainSensitivity {
    /// Its key.
    pub key: String,
    /// `x.kpp`.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Value of the scenario.
    pub before: f64,
    /// Tuned value.
    pub after: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// What is minimised (without the worst plants) with one percent less.
    pub objective_less: f64,
    /// With one percent more.
    pub objective_more: f64,
    /// `Ms` of the axis with one percent less.
    pub ms_less: f64,
    /// With one percent more.
    pub ms_more: f64,
}

/// A check that was not part of the objective.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What was changed.
    pub name: String,
    /// Whether the tuned gains survive it: no lock-up, and a contouring error that is no larger than before (or within the
    /// scenario's own limit).
    pub survives: bool,
    /// With the scenario's own gains; none where it could not be run.
    pub before: Option<Metrics>,
    /// With the tuned ones.
    pub after: Option<Metrics>,
}

/// Everything about a tuning that is worth telling.
pub fn report(problem: &Problem<'_>, tuning: &Tuning, tuned: &Tuned) -> TuningReport {
    let constraints = &problem.constraints;
    let search = SearchMetadata {
        method: tuning.method.name(),
        objective: match problem.objective {
            Objective::MaxContourError => "max",
            Objective::RmsContourError => "rms",
            Objective::Weighted { .. } => "weighted",
        },
        worst_weight: problem.worst_weight,
        plants: problem.plants(),
        starts: tuning.starts,
        seed: tuning.seed,
        evaluations: tuned.evaluations,
        interrupted: tuned.interrupted,
        max_ms: constraints.max_ms,
        min_delay_margin_s: constraints.min_delay_margin_s,
        gain_uncertainty: constraints.uncertainty.gain,
        time_constant_uncertainty: constraints.uncertainty.time_constant,
    };
    let (before, after) = (&tuned.before, &tuned.after);
    let plants = drawn_plants(problem.runs().samples(), tuned.interrupted);
    TuningReport {
        scenario: problem.scenario.name.clone(),
        search,
        feasible: after.value.is_feasible(),
        broken: after.violations.iter().map(ToString::to_string).collect(),
        before: side(problem, before, tuning.seed, plants),
        after: side(problem, after, tuning.seed, plants),
        gains: gains(problem, after),
        active: active(problem, tuned),
        checks: checks(problem.scenario, &before.axes, &after.axes, tuning.seed),
        notes: notes(problem.scenario, &after.axes),
    }
}

/// Drives that are more than the models that were searched on.
fn notes(scenario: &Scenario, after: &[AxisParameters; 2]) -> Vec<String> {
    let mut notes = Vec::new();
    for ((axis, drive), name) in after.iter().zip(&scenario.drives).zip(AXIS_NAMES) {
        if drive.is_model() {
            continue;
        }
        let linear = Linearized::of(drive);
        let beside = linear.modelled.iter().chain(&linear.neglected).map(String::as_str).collect::<Vec<_>>().join(", ");
        let margins = DriveLoop::new(axis, drive, &scenario.settings).map(|of| of.margins());
        let as_it_is = match margins {
            Ok(margins) if margins.stable => {
                format!("; with the tuned gains the detailed drive model has Ms {:.3}", margins.peak_sensitivity)
            }
            Ok(_) => "; with the tuned gains the detailed drive model is UNSTABLE".to_owned(),
            Err(_) => String::new(),
        };
        notes.push(format!("axis {name} was tuned on its ideal model, without its {beside}{as_it_is}"));
    }
    if scenario.cross_coupling.is_some() {
        notes.push("the axes were tuned without their cross-coupled control".to_owned());
    }
    if scenario.corrections_mm.is_some() {
        let text = "the axes were tuned without the learned corrections, which belong to the gains that they were learned with: \
                    the tuned scenario has none";
        notes.push(text.to_owned());
    }
    notes
}

fn side(problem: &Problem<'_>, assessment: &Assessment, seed: u64, plants: usize) -> GainSet {
    let axes = assessment.margins.iter().zip(AXIS_NAMES).map(|(margins, axis)| AxisMargins {
        axis,
        peak_sensitivity: margins.peak_sensitivity,
        delay_margin_s: margins.delay_margin_s,
        phase_margin_deg: margins.phase_margin_deg,
        gain_down: margins.gain_down,
        gain_up: margins.gain_up,
    });
    GainSet {
        objective: assessment.metrics.map_or(f64::INFINITY, |metrics| problem.objective.of(&metrics)),
        metrics: assessment.metrics,
        sampled: spread(problem, &assessment.axes, seed, plants),
        axes: axes.collect(),
    }
}

/// How many plants are sampled: fewer of a long run, so that a search that was stopped ends soon.
fn drawn_plants(samples: u64, interrupted: bool) -> usize {
    let plants = DRAWN_PERIODS[usize::from(interrupted)] / samples.max(1);
    usize::try_from(plants.max(LEAST_PLANTS)).unwrap_or(DRAWN_PLANTS).min(DRAWN_PLANTS)
}

/// Runs plants sampled from the uncertainty box, the same ones for every set of gains.
fn spread(problem: &Problem<'_>, axes: &[AxisParameters; 2], seed: u64, plants: usize) -> Statistics {
    let plants = problem.constraints.uncertainty.sampled(axes, plants, seed);
    let runs: Vec<Metrics> = plants.par_chunks(48).flat_map_iter(|chunk| problem.runs().of(chunk)).collect();
    let mut errors: Vec<f64> = runs.iter().map(|run| run.max_contour_error_um).collect();
    errors.sort_by(f64::total_cmp);
    let share = |percent: usize| errors.get((errors.len() * percent / 100).min(errors.len().saturating_sub(1)));
    let share = |percent| share(percent).copied().unwrap_or(f64::NAN);
    Statistics {
        plants: runs.len(),
        worst_um: share(100),
        percentile_95_um: share(95),
        median_um: share(50),
        saturated: runs.iter().filter(|run| run.saturated_share > 0.0).count(),
        locked_up: runs.iter().filter(|run| run.locked_up).count(),
    }
}

fn gains(problem: &Problem<'_>, after: &Assessment) -> Vec<GainSensitivity> {
    let variables = problem.variables.par_iter();
    variables
        .map(|variable| {
            let own = &problem.scenario.axes[variable.axis].pdff;
            let value = variable.gain.of(&after.axes[variable.axis].pdff);
            let moved = |factor: f64| {
                let mut axes = after.axes;
                variable.gain.set(&mut axes[variable.axis].pdff, factor * value);
                let metrics = problem.runs().of(&[axes]);
                let margins = crate::analysis::margins(&axes[variable.axis], &problem.scenario.settings);
                (metrics.first().map_or(f64::NAN, |run| problem.objective.of(run)), margins.peak_sensitivity)
            };
            let ((objective_less, ms_less), (objective_more, ms_more)) = (moved(0.99), moved(1.01));
            GainSensitivity {
                key: variable.key(),
                name: variable.short(),
                unit: variable.gain.unit(),
                before: variable.gain.of(own),
                after: value,
                lower: variable.lower,
                upper: variable.upper,
                objective_less,
                objective_more,
                ms_less,
                ms_more,
            }
        })
        .collect()
}

/// Limits that are reached and bounds that are in the way.
fn active(problem: &Problem<'_>, tuned: &Tuned) -> Vec<String> {
    let mut active = Vec::new();
    let constraints = &problem.constraints;
    for (margins, axis) in tuned.after.margins.iter().zip(AXIS_NAMES) {
        let ms = margins.peak_sensitivity;
        if ms >= constraints.max_ms * (1.0 - ACTIVE) {
            active.push(format!("axis {axis}: Ms = {ms:.4} of at most {}", constraints.max_ms));
        }
        if let Some(limit) = constraints.min_delay_margin_s
            && margins.delay_margin_s <= limit * (1.0 + ACTIVE)
        {
            active.push(format!(
                "axis {axis}: delay margin {:.4} ms of at least {} ms",
                1e3 * margins.delay_margin_s,
                1e3 * limit
            ));
        }
    }
    for (variable, position) in problem.variables.iter().zip(&tuned.point) {
        let bound = match *position {
            p if p <= ACTIVE => ("lower", variable.lower),
            p if p >= 1.0 - ACTIVE => ("upper", variable.upper),
            _ => continue,
        };
        active.push(format!("{} is at its {} bound {}", variable.short(), bound.0, bound.1));
    }
    active
}

/// Another path, a higher feed, and noise.
fn checks(scenario: &Scenario, before: &[AxisParameters; 2], after: &[AxisParameters; 2], seed: u64) -> Vec<Check> {
    let limit = scenario.limits.contour_error_um;
    let check = |name: String, run: &dyn Fn(&[AxisParameters; 2]) -> Option<Metrics>| {
        let (before, after) = (run(before), run(after));
        let survives = after.is_some_and(|after| {
            let allowed = before.map_or(0.0, |before| before.max_contour_error_um).max(limit.unwrap_or(0.0));
            !after.locked_up && after.max_contour_error_um.is_finite() && after.max_contour_error_um <= allowed
        });
        Check { name, survives, before, after }
    };
    let plain =
        |scenario: &Scenario, axes: &[AxisParameters; 2]| Runs::new(scenario).ok()?.of(&[*axes]).first().copied();
    let star = Scenario::builtin("star").ok().map(|star| Scenario { settings: scenario.settings, ..star });
    let feed_mm_s = HIGHER_FEED * scenario.feed_mm_s;
    let faster = scenario.profile.motion(&*scenario.path, feed_mm_s).ok().map(|motion| Scenario {
        feed_mm_s,
        motion,
        ..scenario.clone()
    });
    vec![
        check("another path: star".to_owned(), &|axes| plain(star.as_ref()?, axes)),
        check(format!("{HIGHER_FEED} times the feed"), &|axes| plain(faster.as_ref()?, axes)),
        check(format!("{} % noise on the voltage", 100.0 * NOISE), &|axes| noisy(scenario, axes, NOISE, seed)),
    ]
}

/// Every gain that differs from the scenario's own: key and value.
pub fn changes(tuned: &Tuned) -> Vec<(String, f64)> {
    let axes = tuned.before.axes.iter().zip(&tuned.after.axes).zip(AXIS_NAMES);
    axes.flat_map(|((before, after), axis)| {
        Gain::ALL
            .into_iter()
            .filter(|gain| gain.of(&before.pdff) != gain.of(&after.pdff))
            .map(move |gain| (format!("axes.{axis}.pdff.{}", gain.name()), gain.of(&after.pdff)))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regression_a_long_run_does_not_keep_a_stopped_search_from_ending() {
        // Alpha; alpha with a control period of a microsecond.
        assert_eq!((drawn_plants(1201, false), drawn_plants(1201, true)), (DRAWN_PLANTS, DRAWN_PLANTS));
        assert_eq!((drawn_plants(1_200_000, false), drawn_plants(1_200_000, true)), (111, 10));
        assert_eq!((drawn_plants(0, false), drawn_plants(u64::MAX, false)), (DRAWN_PLANTS, 10));
    }
}
