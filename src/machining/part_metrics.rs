//! The metrics of a machined part.

use serde::Serialize;

use super::DeviationMap;
use crate::limits::{LimitCheck, is_kept};

/// Deviation of a machined part from its surface, along the normal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartMetrics {
    /// Largest excess.
    pub largest_scallop_um: f64,
    /// Where.
    pub largest_scallop_at_mm: Option<[f64; 2]>,
    /// Deepest gouge.
    pub deepest_gouge_um: f64,
    /// Where.
    pub deepest_gouge_at_mm: Option<[f64; 2]>,
    /// Mean deviation.
    pub mean_um: f64,
    /// Its root mean square.
    pub rms_um: f64,
    /// Share of the cells that are within scallop height and tolerance.
    pub within_share: f64,
    /// Cells that were looked at.
    pub cells: usize,
    /// Cells of the surface that the cutter did not come to.
    pub uncut_cells: usize,
    /// Side of a cell.
    pub cell_mm: f64,
}

impl PartMetrics {
    /// The metrics of a map; scallop height and tolerance are what counts as within.
    pub fn of(map: &DeviationMap, scallop_mm: f64, tolerance_mm: f64) -> Self {
        let metrics = map.metrics(-1e3 * tolerance_mm..=1e3 * scallop_mm);
        let (excess, gouge) = (metrics.largest_excess_um(), metrics.deepest_gouge_um());
        Self {
            largest_scallop_um: excess,
            largest_scallop_at_mm: metrics.largest.filter(|_| excess > 0.0).map(|place| place.at_mm),
            deepest_gouge_um: gouge,
            deepest_gouge_at_mm: metrics.least.filter(|_| gouge > 0.0).map(|place| place.at_mm),
            mean_um: metrics.mean_um,
            rms_um: metrics.rms_um,
            within_share: metrics.within_share,
            cells: metrics.cells,
            uncut_cells: metrics.uncut,
            cell_mm: map.cell_mm(),
        }
    }

    /// Holds it to two limits, if they are there; `names` are theirs.
    pub fn check(&self, names: [&str; 2], scallop_um: Option<f64>, gouge_um: Option<f64>) -> Vec<LimitCheck> {
        let values = [(scallop_um, self.largest_scallop_um), (gouge_um, self.deepest_gouge_um)];
        let checks = names.into_iter().zip(values).filter_map(|(name, (limit, value))| {
            let limit = limit?;
            Some(LimitCheck { name: name.to_owned(), value, limit, kept: is_kept(value, limit) })
        });
        checks.collect()
    }
}
