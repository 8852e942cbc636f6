//! Plots of runs, as SVG or PNG, with `plotters`.
//!
//! [`RunData`] gathers what is plotted while the run (or its recording) goes by; it is an
//! [`Observer`](crate::simulation::Observer) and its memory does not grow with the run. [`draw`] makes one plot in memory,
//! [`write_all`] writes the whole set into a folder. Several runs are laid over each other in the same plots.
//!
//! | plot | shows |
//! |---|---|
//! | [`PlotKind::Path`] | desired path, actual path, and the contouring error drawn large, at equal scale of both axes |
//! | [`PlotKind::Contour`] | contouring error over time, its limit, its largest value |
//! | [`PlotKind::Feedrate`] | feed, acceleration and jerk over time with their limits, beside another profile |
//! | [`PlotKind::Axes`] | velocity, acceleration and jerk of every axis beside its limits, of an axis-limited motion |
//! | [`PlotKind::Voltage`] | voltage of every axis with the saturation band |
//! | [`PlotKind::Space`] | path of a machine with three axes in three dimensions, coloured by its contouring error |
//! | [`PlotKind::Search`] | pattern search for `n_c`: objective, best point, mesh size and evaluations over iterations |
//!
//! [`write_loops`] draws the servo loops themselves: Bode, Nyquist, step response.
//! [`write_convergence`] plots how a tuning converged. [`DeviationPicture`], [`PathPicture`] and [`StepoverPicture`] show tool paths
//! and the part that they leave.
//!
//! [`write_circle`], [`write_response`], [`write_steps`] draw what was [`measure`](crate::measure)d, [`write_learning`] what was learned.
//!
//! The same runs give the same bytes. Text is laid out with the bundled font (`DejaVu` Sans); an SVG names it first and falls back
//! to what the viewer has.

mod axis;
mod curve;
mod data;
mod figure;
mod files;
mod font;
#[cfg(test)]
mod layout_tests;
mod loops;
mod machining;
#[cfg(test)]
mod machining_layout_tests;
mod measurements;
#[cfg(test)]
mod measurements_layout_tests;
mod pixels;
mod plots;
mod subplot;
mod sweep;

use std::io;
use std::path::PathBuf;

use crate::optimize::Step;

pub use crate::sweep::{SweepAxis, SweepCell, SweepPicture, SweepPlot};
pub use data::{AxisLoad, AxisLoads, MAX_BUCKETS, PlotSample, RunData, RunMetadata};
pub use files::{write_all, write_file};
pub use loops::write_loops;
pub use machining::{
    DeviationPicture, DeviationSubplot, MoveKind, PathMove, PathPicture, StepoverPicture, StepoverRow, stepover_row,
};
pub use measurements::{write_circle, write_learning, write_response, write_steps};

/// Which plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlotKind {
    /// Desired path, actual path, error drawn large.
    Path,
    /// Contouring error over time.
    Contour,
    /// Feed, acceleration and jerk over time.
    Feedrate,
    /// Velocity, acceleration and jerk of the axes over time, with their limits.
    Axes,
    /// Voltages over time.
    Voltage,
    /// Path in three dimensions.
    Space,
    /// Pattern search over iterations.
    Search,
}

impl PlotKind {
    /// Every plot, in the order in which [`write_all`] writes them.
    pub const ALL: [Self; 7] =
        [Self::Path, Self::Contour, Self::Feedrate, Self::Axes, Self::Voltage, Self::Space, Self::Search];

    /// Name in file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Contour => "contour",
            Self::Feedrate => "feedrate",
            Self::Axes => "axes",
            Self::Voltage => "voltage",
            Self::Space => "space",
            Self::Search => "search",
        }
    }

    /// Why there is nothing to draw.
    fn missing(self) -> &'static str {
        match self {
            Self::Search => "no run has a pattern search",
            Self::Space => "no run has a third axis",
            Self::Axes => "no run is planned under limits of the axes",
            _ => "no run was given",
        }
    }

    /// Whether these runs hold anything to draw: a search is there only when one of them searched, a path in space only of a
    /// machine with three axes.
    pub fn applies_to(self, runs: &[RunData]) -> bool {
        match self {
            Self::Search => runs.iter().any(|run| run.metadata().n_c_search.as_ref().is_some_and(|s| !s.is_empty())),
            Self::Axes => runs.iter().any(|run| run.metadata().axis_loads.is_some()),
            Self::Space => runs.iter().any(|run| run.metadata().three_axes),
            _ => !runs.is_empty(),
        }
    }
}

/// File format of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Format {
    /// Vector graphics, 1200 × 800.
    #[default]
    Svg,
    /// Pixels, 2400 × 1600.
    Png,
}

impl Format {
    /// Ending of file names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

/// Why a plot could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// There is no run, or none with a search.
    #[error("nothing to draw in a {} plot: {}", kind.name(), kind.missing())]
    Nothing {
        /// Which plot.
        kind: PlotKind,
    },
    /// The drawing backend failed.
    #[error("the {plot} plot could not be drawn: {reason}")]
    Draw {
        /// Which plot, as in its file's name.
        plot: &'static str,
        /// What the backend says.
        reason: String,
    },
    /// The beginning of the file names is not one.
    #[error("`{stem}` cannot begin a file name: it must be a plain name without path separators")]
    Stem {
        /// As given.
        stem: String,
    },
    /// A file or its folder could not be written.
    #[error("cannot write {}: {source}", file.display())]
    Write {
        /// Which file, or folder.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Draws one plot of the runs, laid over each other: the bytes of an SVG document (UTF-8) or of a PNG file.
///
/// # Errors
/// Nothing to draw ([`PlotKind::applies_to`]), or a failure of the drawing backend.
pub fn draw(runs: &[RunData], kind: PlotKind, format: Format) -> Result<Vec<u8>, ReportError> {
    if !kind.applies_to(runs) {
        return Err(ReportError::Nothing { kind });
    }
    drawn(&plots::figure(runs, kind), kind.name(), format)
}

/// How a tuning converged, for [`write_convergence`].
#[derive(Debug, Clone, PartialEq)]
pub struct Convergence<'a> {
    /// Name of the scenario.
    pub name: &'a str,
    /// What was searched for and found, in one line.
    pub subtitle: &'a str,
    /// Unit of the objective.
    pub unit: &'a str,
    /// Each search: the number of its start (0 for the scenario's own gains; none for the polish of the best) and its
    /// iterations.
    pub searches: Vec<(Option<usize>, &'a [Step])>,
}

/// Draws how a tuning converged: the best objective of every start over evaluations, on a log scale, and by how much the
/// starts that begin outside of the constraints violate them. The bytes of an SVG document (UTF-8) or of a PNG file.
///
/// # Errors
/// A failure of the drawing backend.
pub fn draw_convergence(convergence: &Convergence<'_>, format: Format) -> Result<Vec<u8>, ReportError> {
    drawn(&plots::convergence_figure(convergence), "tune", format)
}

/// Writes the plot of [`draw_convergence`] as `STEM-tune.svg` (or `.png`) into `folder`, as [`write_all`] does.
///
/// # Errors
/// As those of [`write_all`].
pub fn write_convergence(
    convergence: &Convergence<'_>,
    folder: &std::path::Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    files::write_figures([("tune", plots::convergence_figure(convergence))], folder, stem, format)
}

/// The bytes of a figure; `plot` is what messages and file names call it.
fn drawn(figure: &figure::Figure, plot: &'static str, format: Format) -> Result<Vec<u8>, ReportError> {
    let drawn = match format {
        Format::Svg => figure.svg(),
        Format::Png => figure.png(),
    };
    drawn.map_err(|reason| ReportError::Draw { plot, reason })
}
