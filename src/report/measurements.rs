//! Plots of measurements and of learning.

use std::path::{Path, PathBuf};

use super::files::write_figures;
use super::plots::{circle, learning, response, steps};
use super::{Format, ReportError};
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
