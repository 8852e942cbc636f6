//! The metrics at the points: axis parameters are written straight into the loop, other values make a new scenario.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::cache::Prepared;
use super::definition::Sweep;
use super::metric::{METRICS, OF_THE_RUN, Rows, Status};
use super::variable::Value;
use crate::analysis::{DriveLoop, Margins, margins, peak_sensitivity};
use crate::scenario::Scenario;
use crate::servo::AxisParameters;
use crate::simulation::{ReferenceTrajectory, RunMetrics};
use crate::summary::SummaryObserver;

/// What one point comes to.
type Row = (Status, [f64; METRICS.len()]);

const NOTHING: [f64; METRICS.len()] = [f64::NAN; METRICS.len()];

impl Sweep {
    /// Status and metrics of the points in `range`, computed on all cores; none where `stop` was raised.
    ///
    /// What a point comes to does not depend on the range or the number of cores.
    pub fn evaluate(&self, range: Range<u64>, stop: Option<&AtomicBool>) -> Option<Rows> {
        let range = range.start..range.end.min(self.count());
        let points: Vec<Vec<Value>> = range.into_par_iter().map(|index| self.values(index)).collect();
        // Points with the same scenario are run together.
        let mut groups: Vec<(Vec<String>, Vec<usize>)> = Vec::new();
        let mut known: HashMap<Vec<String>, usize> = HashMap::new();
        for (place, values) in points.iter().enumerate() {
            let settings = self.settings(values);
            let group = *known.entry(settings).or_insert_with_key(|settings| {
                groups.push((settings.clone(), Vec::new()));
                groups.len() - 1
            });
            if let Some((_, places)) = groups.get_mut(group) {
                places.push(place);
            }
        }
        let done: Vec<Vec<Row>> = groups
            .par_iter()
            .map(|(settings, places)| {
                let values: Vec<&[Value]> = places.iter().filter_map(|&i| Some(points.get(i)?.as_slice())).collect();
                self.group(settings, &values, stop)
            })
            .collect::<Option<_>>()?;
        let width = self.definition.metrics.len();
        let mut rows =
            Rows { status: vec![Status::Invalid; points.len()], width, metrics: vec![f64::NAN; points.len() * width] };
        for ((_, places), found) in groups.iter().zip(done) {
            for (&place, (status, metrics)) in places.iter().zip(found) {
                if let Some(slot) = rows.status.get_mut(place) {
                    *slot = status;
                }
                for (slot, metric) in rows.metrics.iter_mut().skip(place * width).take(width).zip(metrics) {
                    *slot = metric;
                }
            }
        }
        Some(rows)
    }

    /// Why the values of a point cannot be run; none where they can.
    pub fn why_invalid(&self, index: u64) -> Option<String> {
        let values = self.values(index);
        match self.prepared(&self.settings(&values)) {
            Err(reason) => Some(reason),
            Ok(scenario) => self.axes(&scenario, &values).iter().find_map(|axis| Some(axis.check().err()?.to_string())),
        }
    }

    /// Whether the loops of a point are stable, both of them, without saturation ([`crate::analysis::Margins::stable`]), of the drives
    /// as they are. Not where its values make no scenario.
    pub fn is_stable(&self, index: u64) -> bool {
        let values = self.values(index);
        let settings = self.settings(&values);
        let stable = |scenario: &Scenario| {
            self.axes(scenario, &values).iter().zip(&scenario.drives).all(|(axis, drive)| {
                if drive.is_model() {
                    peak_sensitivity(axis, &scenario.settings).is_some()
                } else {
                    DriveLoop::new(axis, drive, &scenario.settings).is_ok_and(|of| of.is_stable())
                }
            })
        };
        // (Without settings the scenario is not copied: this is asked of many points.)
        if settings.is_empty() { stable(&self.scenario) } else { self.prepared(&settings).is_ok_and(|s| stable(&s)) }
    }

    /// What has to be set in the scenario's text.
    fn settings(&self, values: &[Value]) -> Vec<String> {
        let variables = self.definition.variables.iter().zip(&self.axis_values).zip(values);
        variables
            .filter(|((_, axis), _)| axis.is_none())
            .map(|((variable, _), value)| variable.setting(value))
            .collect()
    }

    fn prepared(&self, settings: &[String]) -> Prepared {
        if settings.is_empty() {
            return Ok(Arc::new(self.scenario.clone()));
        }
        self.cache.get(settings, || {
            let mut document = self.document.clone();
            for setting in settings {
                document.set(setting).map_err(|error| error.to_string())?;
            }
            document.scenario().map(Arc::new).map_err(|error| error.to_string())
        })
    }

    /// The axes at a point.
    fn axes(&self, scenario: &Scenario, values: &[Value]) -> [AxisParameters; 2] {
        let mut axes = scenario.axes;
        for (target, value) in self.axis_values.iter().zip(values) {
            if let (Some(target), Some(number)) = (target, value.number())
                && let Some(axis) = axes.get_mut(target.axis)
            {
                target.parameter.set_in_model(axis, number);
            }
        }
        axes
    }

    /// Points with the same settings; none where `stop` was raised.
    fn group(&self, settings: &[String], points: &[&[Value]], stop: Option<&AtomicBool>) -> Option<Vec<Row>> {
        let invalid = (Status::Invalid, NOTHING);
        let Ok(scenario) = self.prepared(settings) else { return Some(vec![invalid; points.len()]) };
        let engine = Engine::new(&scenario);
        let mut rows = Vec::with_capacity(points.len());
        for points in points.chunks(engine.batch()) {
            if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return None;
            }
            let axes: Vec<[AxisParameters; 2]> = points.iter().map(|values| self.axes(&scenario, values)).collect();
            let is_valid = |axes: &[AxisParameters; 2]| axes.iter().all(|axis| axis.check().is_ok());
            let valid: Vec<[AxisParameters; 2]> = axes.iter().copied().filter(is_valid).collect();
            let mut found = engine.run(&valid).into_iter();
            let of_loops: Vec<Vec<f64>> = if self.definition.metrics.len() > OF_THE_RUN {
                valid.par_iter().map(|axes| margins_of(axes, &scenario)).collect()
            } else {
                Vec::new()
            };
            let mut of_loops = of_loops.into_iter();
            rows.extend(axes.iter().map(|axes| {
                if !is_valid(axes) {
                    return invalid;
                }
                let (status, mut metrics) = found.next().flatten().map_or((Status::Diverged, NOTHING), |run| row(&run));
                let margins = of_loops.next().unwrap_or_default();
                metrics.iter_mut().skip(OF_THE_RUN).zip(margins).for_each(|(slot, margin)| *slot = margin);
                (status, metrics)
            }));
        }
        Some(rows)
    }
}

/// The margins of both loops, in the order of the metrics: of the model, or of the detailed drive model where it is more than that.
fn margins_of(axes: &[AxisParameters; 2], scenario: &Scenario) -> Vec<f64> {
    const OF_EACH: [fn(&Margins) -> f64; 5] =
        [|m| m.peak_sensitivity, |m| m.gain_down, |m| m.gain_up, |m| m.phase_margin_deg, |m| m.delay_margin_s];
    let settings = &scenario.settings;
    let loops = [0, 1].map(|axis| match &scenario.drives[axis] {
        drive if drive.is_model() => Some(margins(&axes[axis], settings)),
        drive => DriveLoop::new(&axes[axis], drive, settings).ok().map(|of| of.margins()),
    });
    OF_EACH.iter().flat_map(|pick| loops.map(|of| of.map_or(f64::NAN, |margins| pick(&margins)))).collect()
}

fn row(run: &RunMetrics<2>) -> Row {
    let of_the_run = [
        run.max_contour_error_um,
        run.rms_contour_error_um,
        run.max_tracking_error_um,
        run.rms_tracking_error_um,
        run.peak_voltage_v[0],
        run.peak_voltage_v[1],
        run.saturated_share,
    ];
    if of_the_run.iter().any(|metric| !metric.is_finite()) {
        return (Status::Diverged, NOTHING);
    }
    let mut metrics = NOTHING;
    metrics.iter_mut().zip(of_the_run).for_each(|(slot, metric)| *slot = metric);
    let status = if run.locked_up {
        Status::LockedUp
    } else if run.saturated_share > 0.0 {
        Status::Saturated
    } else {
        Status::Ok
    };
    (status, metrics)
}

/// What runs many axes along the path of one scenario.
enum Engine<'a> {
    /// Side by side.
    ReferenceTrajectory(ReferenceTrajectory<'a, 2>),
    /// One by one: a trajectory would be too long to be kept, the drives are more than their models, or the commands are corrected.
    Single(&'a Scenario),
}

impl<'a> Engine<'a> {
    fn new(scenario: &'a Scenario) -> Self {
        if !scenario.is_model() || scenario.corrections_mm.is_some() {
            return Self::Single(scenario);
        }
        scenario.reference_trajectory().map_or(Self::Single(scenario), Self::ReferenceTrajectory)
    }

    /// How many points to hand it at a time: a second of work at most, so that it can be stopped.
    fn batch(&self) -> usize {
        match self {
            Self::ReferenceTrajectory(trajectory) => {
                usize::try_from((1 << 24) / trajectory.samples().max(1)).unwrap_or(1).clamp(64, 1 << 14)
            }
            Self::Single(_) => 16,
        }
    }

    /// The metrics of each; none where a loop diverged.
    fn run(&self, axes: &[[AxisParameters; 2]]) -> Vec<Option<RunMetrics<2>>> {
        match self {
            Self::ReferenceTrajectory(trajectory) => {
                trajectory.run(axes).map_or(Vec::new(), |runs| runs.into_iter().map(Some).collect())
            }
            Self::Single(scenario) => axes.par_iter().map(|axes| single(scenario, *axes)).collect(),
        }
    }
}

fn single(scenario: &Scenario, axes: [AxisParameters; 2]) -> Option<RunMetrics<2>> {
    let mut observer = SummaryObserver::new(String::new());
    let simulation = scenario.simulation_of(axes).ok()?;
    simulation.run(&scenario.limits, None, &mut [&mut observer]).ok()?;
    let summary = observer.summary();
    let voltage = |axis: usize| summary.axes.get(axis).map_or(f64::NAN, |axis| axis.peak_voltage_v);
    Some(RunMetrics {
        max_contour_error_um: summary.max_contour_error_um,
        rms_contour_error_um: summary.rms_contour_error_um,
        max_tracking_error_um: summary.max_tracking_error_um,
        rms_tracking_error_um: summary.rms_tracking_error_um,
        peak_voltage_v: [voltage(0), voltage(1)],
        saturated_share: summary.saturated_share,
        locked_up: summary.locked_up,
    })
}
