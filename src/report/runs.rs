//! Plots of runs.

use std::path::{Path, PathBuf};

use super::data::RunData;
use super::error::ReportError;
use super::figure::Figure;
use super::files::{check_stem, drawn, write_figures};
use super::format::Format;
use super::plot_kind::PlotKind;
use super::plots::named_run::named;
use super::plots::{feedrate, loads, path, path_3d, search, time};

/// Draws one plot of the runs, laid over each other: the bytes of an SVG document (UTF-8) or of a PNG file.
///
/// # Errors
/// Nothing to draw ([`PlotKind::applies_to`]), or a failure of the drawing backend.
pub fn draw(runs: &[RunData], kind: PlotKind, format: Format) -> Result<Vec<u8>, ReportError> {
    if !kind.applies_to(runs) {
        return Err(ReportError::Nothing { kind });
    }
    drawn(&figure(runs, kind), kind.name(), format)
}

/// Draws every plot that applies to the runs and writes `STEM-path.svg`, `STEM-contour.svg`, `STEM-feedrate.svg`,
/// `STEM-voltage.svg`, of motions planned under limits of the axes `STEM-axes.svg`, of machines with three axes `STEM-space.svg`, and when there was a search `STEM-search.svg` into `folder`
/// (made if missing; existing files are replaced). Returns the files in this order.
///
/// All plots are drawn before the first is written, and each file appears under its name only when it is complete.
///
/// # Errors
/// No run, a stem that is no plain file name, a plot that cannot be drawn, a file or folder that cannot be written.
pub fn write_all(runs: &[RunData], folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
    check_stem(stem)?;
    if runs.is_empty() {
        return Err(ReportError::Nothing { kind: PlotKind::Path });
    }
    let kinds = PlotKind::ALL.into_iter().filter(|kind| kind.applies_to(runs));
    write_figures(kinds.map(|kind| (kind.name(), figure(runs, kind))), folder, stem, format)
}

/// The figure of one plot.
pub(super) fn figure(runs: &[RunData], kind: PlotKind) -> Figure {
    let runs = named(runs);
    match kind {
        PlotKind::Path => path::figure(&runs),
        PlotKind::Contour => time::contour(&runs),
        PlotKind::Feedrate => feedrate::figure(&runs),
        PlotKind::Axes => loads::figure(&runs),
        PlotKind::Voltage => time::voltage(&runs),
        PlotKind::Space => path_3d::of_runs(&runs),
        PlotKind::Search => search::figure(&runs),
    }
}
