//! Pictures of sweeps: a map of two variables, a curve over one, a histogram.

use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::figure::Figure;
use super::files::drawn;
use super::files::write_figures;
use super::format::Format;
use super::plots::sweep::{curve, histogram, map};
use crate::sweep::{SweepPicture, SweepPlot};

impl SweepPicture {
    /// The bytes of an SVG document (UTF-8) or of a PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&figure(self), "sweep", format)
    }

    /// Writes `NAME-sweep.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A failure of the drawing backend, or a file that cannot be written.
    pub fn write(&self, folder: &Path, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("sweep", figure(self))], folder, &self.name, format)
    }
}

fn figure(picture: &SweepPicture) -> Figure {
    match &picture.plot {
        SweepPlot::Map { .. } | SweepPlot::Scatter { .. } => map::figure(picture),
        SweepPlot::Curve { .. } => curve::figure(picture),
        SweepPlot::Histogram { .. } => histogram::figure(picture),
    }
}
