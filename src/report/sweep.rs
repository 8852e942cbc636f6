//! Pictures of sweeps: a map of two variables, a curve over one, a histogram.

use std::path::{Path, PathBuf};

use super::files::write_figures;
use super::plots::sweep;
use super::{Format, ReportError, drawn};
use crate::sweep::SweepPicture;

impl SweepPicture {
    /// The bytes of an SVG document (UTF-8) or of a PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&sweep::figure(self), "sweep", format)
    }

    /// Writes `NAME-sweep.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A failure of the drawing backend, or a file that cannot be written.
    pub fn write(&self, folder: &Path, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("sweep", sweep::figure(self))], folder, &self.name, format)
    }
}
