//! Metrics of a deviation map.

use std::ops::RangeInclusive;

use super::DeviationMap;

/// A deviation and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviationPlace {
    /// The deviation \[µm\].
    pub value_um: f64,
    /// The cell's centre in plan \[mm\].
    pub at_mm: [f64; 2],
}

/// Metrics over the cells of a map that have a deviation. The sums run row by row in the order of the rows: the same bits on any
/// number of cores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviationMetrics {
    /// Cells with a deviation.
    pub cells: usize,
    /// Cells of the surface where nothing was cut.
    pub uncut: usize,
    /// The largest deviation: the highest scallop where it is positive. The first of several, in the order of the cells.
    pub largest: Option<DeviationPlace>,
    /// The least deviation: the deepest gouge where it is negative.
    pub least: Option<DeviationPlace>,
    /// Mean \[µm\]; 0 without cells.
    pub mean_um: f64,
    /// Root of the mean square \[µm\]; 0 without cells.
    pub rms_um: f64,
    /// Share of the cells (uncut ones too) whose deviation is within the tolerance, 0 to 1.
    pub within_share: f64,
}

impl DeviationMetrics {
    /// The largest excess \[µm\]: 0 where no material is left.
    pub fn largest_excess_um(&self) -> f64 {
        self.largest.map_or(0.0, |place| place.value_um.max(0.0))
    }

    /// The deepest gouge \[µm\], as a positive number: 0 where nothing is cut too deep.
    pub fn deepest_gouge_um(&self) -> f64 {
        self.least.map_or(0.0, |place| (-place.value_um).max(0.0))
    }

    /// The deviation of largest magnitude: of a difference of two maps, the largest difference.
    pub fn worst(&self) -> Option<DeviationPlace> {
        match (self.largest, self.least) {
            (Some(largest), Some(least)) if -least.value_um > largest.value_um => Some(least),
            (largest, _) => largest,
        }
    }
}

impl DeviationMap {
    /// The metrics; `tolerance_um` is what counts as within it, from the deepest gouge to the highest scallop allowed.
    pub fn metrics(&self, tolerance_um: RangeInclusive<f64>) -> DeviationMetrics {
        let (mut cells, mut uncut, mut within) = (0_usize, 0_usize, 0_usize);
        let mut largest: Option<(f32, usize)> = None;
        let mut least: Option<(f32, usize)> = None;
        let (mut sum, mut squares) = (0.0, 0.0);
        for (row, values) in self.values.chunks(self.columns.max(1)).enumerate() {
            let (mut row_sum, mut row_squares) = (0.0, 0.0);
            for (column, value) in values.iter().enumerate() {
                uncut += usize::from(*value == f32::INFINITY);
                if !value.is_finite() {
                    continue;
                }
                let at = row * self.columns + column;
                if largest.is_none_or(|(other, _)| *value > other) {
                    largest = Some((*value, at));
                }
                if least.is_none_or(|(other, _)| *value < other) {
                    least = Some((*value, at));
                }
                let value = f64::from(*value);
                cells += 1;
                within += usize::from(tolerance_um.contains(&value));
                row_sum += value;
                row_squares += value * value;
            }
            sum += row_sum;
            squares += row_squares;
        }
        let share = |part: f64, whole: usize| if whole > 0 { part / whole as f64 } else { 0.0 };
        let place = |found: Option<(f32, usize)>| {
            found.map(|(value, at)| DeviationPlace { value_um: f64::from(value), at_mm: self.centre_mm(at) })
        };
        DeviationMetrics {
            cells,
            uncut,
            largest: place(largest),
            least: place(least),
            mean_um: share(sum, cells),
            rms_um: share(squares, cells).sqrt(),
            within_share: share(within as f64, cells + uncut),
        }
    }

    /// The deviations below which these shares of the cells lie \[µm\], exact: of `n` values in order the one at
    /// `⌈share n⌉` (the first for 0). Empty where no cell has a deviation; a share that is NaN counts as 0.
    pub fn percentiles_um(&self, shares: &[f64]) -> Vec<f64> {
        let mut values: Vec<f32> = self.values.iter().copied().filter(|value| value.is_finite()).collect();
        let Some(last) = values.len().checked_sub(1) else { return Vec::new() };
        let rank = |share: f64| {
            let rank = (share.max(0.0).min(1.0) * values.len() as f64).ceil();
            super::height_field::count(rank).saturating_sub(1).min(last)
        };
        let ranks: Vec<usize> = shares.iter().copied().map(rank).collect();
        ranks.into_iter().map(|rank| f64::from(*values.select_nth_unstable_by(rank, f32::total_cmp).1)).collect()
    }
}
