//! Plots of servo loops: Bode, Nyquist and step response of every axis.

use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::files::write_figures;
use super::format::Format;
use super::plots::servo_loop::Drawn;
use super::plots::words::printable;
use super::plots::{bode, loop_step, nyquist};
use super::style::RUN_COLOURS;
use crate::analysis::DriveLoop;
use crate::parameters::axis_title;

/// Draws the loops of the axes and writes `STEM-bode.svg`, `STEM-nyquist.svg` and `STEM-step.svg` (or `.png`) into `folder`
/// (made if missing; existing files are replaced). Returns the files in this order.
///
/// - `title`: what the plots are headed with; `axes`: their loops, of models or of detailed drives
///
/// # Errors
/// A stem that is no plain file name, a plot that cannot be drawn, a file or folder that cannot be written.
pub fn write_loops(
    title: &str,
    axes: &[DriveLoop],
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    let drawn = drawn(axes);
    let title = printable(title);
    let figures = [
        ("bode", bode::figure(&title, &drawn)),
        ("nyquist", nyquist::figure(&title, &drawn)),
        ("step", loop_step::figure(&title, &drawn)),
    ];
    write_figures(figures, folder, stem, format)
}

pub(super) fn drawn(axes: &[DriveLoop]) -> Vec<Drawn<'_>> {
    axes.iter()
        .enumerate()
        .map(|(i, drive)| Drawn {
            name: axis_title(i),
            colour: RUN_COLOURS[i % RUN_COLOURS.len()],
            drive,
            margins: drive.margins(),
            crossovers: drive.crossovers_rad_s(),
            phase_crossovers: drive.phase_crossovers_rad_s(),
        })
        .collect()
}
