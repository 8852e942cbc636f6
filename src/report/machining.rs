//! Pictures of a tool path and of the part that it leaves: deviation maps, rings in plan, the path in three dimensions, and the
//! comparison of the step-over formulas.

use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::files::{drawn, write_figures};
use super::format::Format;
use super::part_data::{DeviationPicture, PathPicture, StepoverPicture};
use super::plots::{deviation, path_3d, rings, stepover};

impl DeviationPicture<'_> {
    /// The bytes of an SVG document (UTF-8) or of a PNG file. Where a map has more cells than the figure can show, each square of
    /// the picture has the worst deviation of its cells: uncut, else the largest in magnitude.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&deviation::figure(self), "deviation", format)
    }

    /// Writes `STEM-deviation.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("deviation", deviation::figure(self))], folder, stem, format)
    }
}

impl PathPicture {
    /// The path in plan, rings coloured by their depth: the bytes of an SVG document (UTF-8) or of a PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw_rings(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&rings::figure(self), "rings", format)
    }

    /// The path in three dimensions, seen along a slanted axis, coloured by height: the bytes of an SVG document (UTF-8) or of a
    /// PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw_3d(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&path_3d::figure(self), "path3d", format)
    }

    /// Writes `STEM-rings.svg` and `STEM-path3d.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("rings", rings::figure(self)), ("path3d", path_3d::figure(self))], folder, stem, format)
    }
}

impl StepoverPicture<'_> {
    /// The plot: the bytes of an SVG document (UTF-8) or of a PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&stepover::figure(self), "stepover", format)
    }

    /// Writes `STEM-stepover.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("stepover", stepover::figure(self))], folder, stem, format)
    }
}
