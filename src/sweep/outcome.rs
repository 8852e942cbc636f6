//! A whole sweep in a few numbers.

use serde::Serialize;

use super::definition::{Method, Sweep};
use super::metric::{Metric, Status};
use super::variable::Value;

/// The percentiles of [`Outcome::percentiles`].
pub const PERCENTILES: [u32; 5] = [5, 50, 95, 99, 100];

/// The point with the best metric: the smallest error, the largest margin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Best {
    /// Its number.
    pub index: u64,
    /// Values of the variables, in their order.
    pub values: Vec<Value>,
    /// Its metrics, in the order of [`Outcome::metrics`].
    pub metrics: Vec<f64>,
}

/// A whole sweep in a few numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the scenario.
    pub scenario: String,
    /// How points were chosen.
    pub method: Method,
    /// How many there are.
    pub points: u64,
    /// Points that ran without saturation.
    pub ok: u64,
    /// Points where an axis saturated and recovered.
    pub saturated: u64,
    /// Points where an axis locked up.
    pub locked_up: u64,
    /// Points whose signals grew beyond all numbers.
    pub diverged: u64,
    /// Points whose values make no valid scenario.
    pub invalid: u64,
    /// Keys of the variables.
    pub variables: Vec<String>,
    /// Names of the metrics of [`Best::metrics`].
    pub metrics: Vec<String>,
    /// The metric that `best` and `percentiles` are of.
    pub metric: String,
    /// The point with the best metric, of those that are ok or saturated and whose loops are stable (a run may end before an
    /// unstable loop has grown); none where there is none.
    pub best: Option<Best>,
    /// The metric's [`PERCENTILES`] (nearest rank; the last is the largest) over all points that have metrics, those that
    /// locked up among them; none where there is none.
    pub percentiles: Option<[f64; 5]>,
}

/// Gathers an [`Outcome`] point by point.
#[derive(Debug)]
pub(super) struct Tally {
    pub(super) metric: Metric,
    counts: [u64; 5],
    best: Option<(f64, u64, Vec<f64>)>,
    /// The metric of every point that has one.
    pub(super) metrics: Vec<f64>,
}

impl Tally {
    pub(super) fn new(metric: Metric) -> Self {
        Self { metric, counts: [0; 5], best: None, metrics: Vec::new() }
    }

    /// `is_stable` is asked of points that would be the best.
    pub(super) fn push(&mut self, index: u64, status: Status, metrics: &[f64], is_stable: impl FnOnce() -> bool) {
        for (count, known) in self.counts.iter_mut().zip(Status::ALL) {
            *count += u64::from(known == status);
        }
        let Some(metric) = metrics.get(self.metric.place()).copied().filter(|metric| metric.is_finite()) else {
            return;
        };
        self.metrics.push(metric);
        let is_better = |best: f64| if self.metric.is_better_large() { metric > best } else { metric < best };
        if status.is_sound() && self.best.as_ref().is_none_or(|(best, ..)| is_better(*best)) && is_stable() {
            self.best = Some((metric, index, metrics.to_vec()));
        }
    }

    /// Where the best point is, so far.
    pub(super) fn best(&self) -> Option<u64> {
        self.best.as_ref().map(|(_, index, _)| *index)
    }

    /// Sorts the metrics; the end of gathering.
    pub(super) fn outcome(&mut self, sweep: &Sweep) -> Outcome {
        self.metrics.sort_unstable_by(f64::total_cmp);
        let definition = sweep.definition();
        let [ok, saturated, locked_up, diverged, invalid] = self.counts;
        let best = self.best.take().map(|(_, index, metrics)| Best { index, values: sweep.values(index), metrics });
        Outcome {
            scenario: definition.scenario.clone(),
            method: definition.method,
            points: definition.count,
            ok,
            saturated,
            locked_up,
            diverged,
            invalid,
            variables: definition.variables.iter().map(|variable| variable.key.clone()).collect(),
            metrics: definition.metrics.clone(),
            metric: self.metric.name().to_owned(),
            best,
            percentiles: percentiles(&self.metrics),
        }
    }
}

/// The nearest-rank percentiles of sorted values: the smallest value that at least so many percent are not above.
fn percentiles(sorted: &[f64]) -> Option<[f64; 5]> {
    let last = sorted.len().checked_sub(1)?;
    let at = |percent: u32| {
        let rank = (sorted.len() as u128 * u128::from(percent)).div_ceil(100);
        usize::try_from(rank).unwrap_or(usize::MAX).saturating_sub(1).min(last)
    };
    Some(PERCENTILES.map(|percent| sorted.get(at(percent)).copied().unwrap_or(f64::NAN)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let values: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(percentiles(&values), Some([10.0, 100.0, 190.0, 198.0, 200.0]));
        assert_eq!(percentiles(&[7.0]), Some([7.0; 5]));
        assert_eq!(percentiles(&[1.0, 2.0, 3.0]), Some([1.0, 2.0, 3.0, 3.0, 3.0]));
        assert_eq!(percentiles(&[]), None);
    }
}
