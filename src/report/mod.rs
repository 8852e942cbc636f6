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
mod convergence;
mod curve;
mod data;
mod envelope;
mod error;
mod figure;
mod files;
mod font;
mod format;
#[cfg(test)]
mod layout_tests;
mod loops;
mod machining;
#[cfg(test)]
mod machining_layout_tests;
mod marks;
mod measurements;
#[cfg(test)]
mod measurements_layout_tests;
mod part_data;
mod pixels;
mod plot_kind;
#[cfg(test)]
mod plot_tests;
mod plots;
mod runs;
mod style;
mod subplot;
mod sweep;

pub use crate::sweep::{SweepAxis, SweepCell, SweepPicture, SweepPlot};
pub use convergence::Convergence;
pub use data::{AxisLoad, AxisLoads, MAX_BUCKETS, PlotSample, RunData, RunMetadata};
pub use error::ReportError;
pub use files::write_file;
pub use format::Format;
pub use loops::write_loops;
pub use measurements::{
    draw_convergence, write_circle, write_convergence, write_learning, write_response, write_steps,
};
pub use part_data::{DeviationPicture, DeviationSubplot, MoveKind, PathMove, PathPicture, StepoverPicture};
pub use plot_kind::PlotKind;
pub use runs::{draw, write_all};
