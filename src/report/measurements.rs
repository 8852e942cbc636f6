//! Plots of measurements, of learning and of tuning.

use std::path::{Path, PathBuf};

use super::convergence::Convergence;
use super::error::ReportError;
use super::files::{drawn, write_figures};
use super::format::Format;
use super::plots::{circle, learning, response, steps, tune};
use crate::learning::Learned;
use crate::measure::{CircleTest, Response, Steps};

/// Writes the circular test as `STEM-circle.svg` (or `.png`) into `folder`: a polar plot of the radial deviation, much magnified, in both
/// directions, and the same over the angle.
///
/// # Errors
/// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
pub fn write_circle(test: &CircleTest, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
    write_figures([("circle", circle::figure(test))], folder, stem, format)
}

/// Writes the frequency response as `STEM-response.svg` (or `.png`) into `folder`: magnitude and phase, measured and of the model.
///
/// # Errors
/// As those of [`write_circle`].
pub fn write_response(
    measured: &Response,
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    write_figures([("response", response::figure(measured))], folder, stem, format)
}

/// Writes step and following error as `STEM-steps.svg` (or `.png`) into `folder`.
///
/// # Errors
/// As those of [`write_circle`].
pub fn write_steps(measured: &Steps, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
    write_figures([("steps", steps::figure(measured))], folder, stem, format)
}

/// Writes how learning went as `STEM-learning.svg` (or `.png`) into `folder`: errors over runs, and the correction that was learned.
///
/// # Errors
/// As those of [`write_circle`].
pub fn write_learning(
    learned: &Learned,
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    write_figures([("learning", learning::figure(learned))], folder, stem, format)
}

/// Draws how a tuning converged: the best objective of every start over evaluations, on a log scale, and by how much the
/// starts that begin outside of the constraints violate them. The bytes of an SVG document (UTF-8) or of a PNG file.
///
/// # Errors
/// A failure of the drawing backend.
pub fn draw_convergence(convergence: &Convergence<'_>, format: Format) -> Result<Vec<u8>, ReportError> {
    drawn(&tune::figure(convergence), "tune", format)
}

/// Writes the plot of [`draw_convergence`] as `STEM-tune.svg` (or `.png`) into `folder`, as [`write_all`](super::write_all) does.
///
/// # Errors
/// As those of [`write_all`](super::write_all).
pub fn write_convergence(
    convergence: &Convergence<'_>,
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    write_figures([("tune", tune::figure(convergence))], folder, stem, format)
}
