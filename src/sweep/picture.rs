//! What is drawn of a sweep, gathered while its points go by: no more than a plot can show.

use super::chart::{SweepAxis, SweepCell, SweepPicture, SweepPlot};
use super::definition::{Method, Sweep};
use super::metric::{Metric, Status};
use super::outcome::{Outcome, PERCENTILES};
use super::variable::Value;

/// Most cells of a map, across and up; of a finer grid each cell shows the worst of its points.
const MOST_CELLS: [u64; 2] = [240, 160];
/// Most dots of a scattered sample, and most points of a curve.
const MOST_DOTS: u64 = 4000;
const MOST_ON_A_CURVE: u64 = 20_000;

/// A plot in the making.
#[derive(Debug)]
pub(super) struct Sketch {
    metric: Metric,
    plot: SweepPlot,
    /// Of so many points one is shown.
    stride: u64,
    /// Grid levels, and cells they share, of a map.
    levels: [u64; 2],
}

impl Sketch {
    pub(super) fn new(sweep: &Sweep, metric: Metric) -> Self {
        let definition = sweep.definition();
        let variables = &definition.variables;
        let own = sweep.own_values();
        let axis = |i: usize| SweepAxis {
            title: variables.get(i).map(|variable| with_unit(&variable.key)).unwrap_or_default(),
            logarithmic: variables.get(i).is_some_and(|variable| variable.values.is_logarithmic()),
        };
        let own_pair = || Some([*own.first()?.as_ref()?, *own.get(1)?.as_ref()?]);
        let numeric = variables.iter().all(|variable| variable.values.is_numeric());
        let is_drawn = numeric && definition.method != Method::MonteCarlo;
        let levels = [0, 1].map(|i| variables.get(i).and_then(|variable| variable.values.count()).unwrap_or(0));
        let mut stride = 1;
        let plot = match variables.len() {
            1 if is_drawn => {
                stride = definition.count.div_ceil(MOST_ON_A_CURVE);
                SweepPlot::Curve { axis: axis(0), points: Vec::new(), own: own.first().copied().flatten(), best: None }
            }
            2 if is_drawn && definition.method == Method::Grid && levels.iter().all(|levels| *levels > 1) => {
                let cells = [0, 1].map(|i| levels[i].min(MOST_CELLS[i]));
                let edges = [0, 1].map(|i| edges(&level_values(sweep, i, levels[i]), cells[i], axis(i).logarithmic));
                let is_ordered = edges.iter().all(|edges| edges.is_sorted_by(|a, b| a < b));
                if is_ordered {
                    SweepPlot::Map {
                        axes: [axis(0), axis(1)],
                        edges,
                        cells: vec![SweepCell::Empty; usize::try_from(cells[0] * cells[1]).unwrap_or(0)],
                        shared: levels[0].div_ceil(cells[0]) * levels[1].div_ceil(cells[1]) > 1,
                        own: own_pair(),
                        best: None,
                    }
                } else {
                    SweepPlot::Scatter { axes: [axis(0), axis(1)], points: Vec::new(), own: own_pair(), best: None }
                }
            }
            2 if is_drawn => {
                SweepPlot::Scatter { axes: [axis(0), axis(1)], points: Vec::new(), own: own_pair(), best: None }
            }
            _ => SweepPlot::Histogram { values: Vec::new(), percentiles: Vec::new() },
        };
        if matches!(plot, SweepPlot::Scatter { .. }) {
            stride = definition.count.div_ceil(MOST_DOTS);
        }
        Self { metric, plot, stride: stride.max(1), levels }
    }

    pub(super) fn push(&mut self, sweep: &Sweep, index: u64, values: &[Value], status: Status, metrics: &[f64]) {
        let cell = match status {
            Status::Ok | Status::Saturated => {
                let metric = metrics.get(self.metric.place()).filter(|metric| metric.is_finite());
                metric.map_or(SweepCell::Missing, |metric| SweepCell::Metric(*metric))
            }
            Status::LockedUp => SweepCell::LockedUp,
            Status::Diverged | Status::Invalid => SweepCell::Missing,
        };
        let number = |i: usize| values.get(i).and_then(Value::number);
        let shown = index.is_multiple_of(self.stride);
        match &mut self.plot {
            SweepPlot::Map { cells, edges, .. } => {
                let at = sweep.levels(index);
                let [across, up] = [0, 1].map(|i| {
                    let cells = edges[i].len().saturating_sub(1) as u64;
                    usize::try_from(at.get(i).copied().unwrap_or(0) * cells / self.levels[i].max(1)).unwrap_or(0)
                });
                if let Some(slot) = cells.get_mut(up * edges[0].len().saturating_sub(1) + across) {
                    *slot = slot.worse(cell);
                }
            }
            SweepPlot::Scatter { points, .. } if shown => {
                if let (Some(x), Some(y)) = (number(0), number(1)) {
                    points.push(([x, y], cell));
                }
            }
            SweepPlot::Curve { points, .. } if shown => points.extend(number(0).map(|x| (x, cell))),
            _ => {}
        }
    }

    /// The picture; `metrics` are those of all points that have one, sorted.
    pub(super) fn finish(
        mut self,
        sweep: &Sweep,
        outcome: &Outcome,
        best: Option<u64>,
        metrics: &[f64],
    ) -> SweepPicture {
        let numbers: Vec<f64> =
            best.map_or_else(Vec::new, |i| sweep.values(i).iter().filter_map(Value::number).collect());
        let best_metric = outcome.best.as_ref().and_then(|best| best.metrics.get(self.metric.place()).copied());
        match &mut self.plot {
            SweepPlot::Map { best, .. } | SweepPlot::Scatter { best, .. } => {
                *best = best_metric.and_then(|metric| Some(([*numbers.first()?, *numbers.get(1)?], metric)));
            }
            SweepPlot::Curve { best, points, .. } => {
                *best = best_metric.and_then(|metric| Some((*numbers.first()?, metric)));
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
            SweepPlot::Histogram { values, percentiles } => {
                *values = metrics.iter().copied().filter(|metric| metric.is_finite()).collect();
                if let Some(found) = outcome.percentiles {
                    *percentiles = PERCENTILES.into_iter().zip(found).filter(|(percent, _)| *percent < 100).collect();
                }
            }
        }
        let mut caption = vec![match outcome.method {
            Method::Grid => format!("{} points on a grid", outcome.points),
            Method::LatinHypercube => format!("{} points of a Latin hypercube", outcome.points),
            Method::Sobol => format!("{} points of a Sobol sequence", outcome.points),
            Method::MonteCarlo => format!("{} random points", outcome.points),
        }];
        let counts = [
            (outcome.saturated, "saturated"),
            (outcome.locked_up, "locked up"),
            (outcome.diverged, "diverged"),
            (outcome.invalid, "invalid"),
        ];
        caption.extend(counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")));
        if self.stride > 1 {
            caption.push(format!("every {}th is drawn", self.stride));
        }
        SweepPicture {
            name: sweep.scenario().name.clone(),
            caption: caption.join(", "),
            metric: self.metric.title(),
            unit: self.metric.unit(),
            over: sweep.definition().variables.iter().map(|variable| variable.key.clone()).collect(),
            plot: self.plot,
        }
    }
}

/// A key with the unit of its value, where the key does not name it.
fn with_unit(key: &str) -> String {
    let unit = match key.rsplit_once(".pdff.").map(|(_, gain)| gain) {
        Some("kpp") => "rad/s/mm",
        Some("kpv") => "N m s/rad",
        Some("kiv") => "1/s",
        Some("kpf") => "rad/mm",
        _ => return key.to_owned(),
    };
    format!("{key} [{unit}]")
}

/// The values at the levels of a grid's variable; for very many only those that bound cells matter.
fn level_values(sweep: &Sweep, variable: usize, levels: u64) -> Vec<f64> {
    let Some(variable) = sweep.definition().variables.get(variable) else { return Vec::new() };
    (0..levels.min(100_000)).filter_map(|level| variable.values.at_level(level).number()).collect()
}

/// Borders of `cells` cells that share the levels: half way between neighbouring values, and as far beyond the outer ones.
fn edges(values: &[f64], cells: u64, logarithmic: bool) -> Vec<f64> {
    let logarithmic = logarithmic && values.iter().all(|value| *value > 0.0);
    let place = |value: f64| if logarithmic { libm::log(value) } else { value };
    let value = |place: f64| if logarithmic { libm::exp(place) } else { place };
    let levels = values.len() as u64;
    let between = |a: f64, b: f64, share: f64| value(place(a) + share * (place(b) - place(a)));
    let at = |i: u64| usize::try_from(i).ok().and_then(|i| values.get(i)).copied().unwrap_or(f64::NAN);
    (0..=cells)
        .map(|edge| {
            // The first level of the cell above this edge: levels go to cell `level * cells / levels`.
            let level = (edge * levels).div_ceil(cells.max(1));
            match level {
                0 => between(at(0), at(1), -0.5),
                level if level >= levels => between(at(levels - 2), at(levels - 1), 1.5),
                level => between(at(level - 1), at(level), 0.5),
            }
        })
        .collect()
}
