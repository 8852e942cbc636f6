//! The plots of runs, and what each needs.

use super::data::RunData;

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
    /// Every plot, in the order in which [`write_all`](super::write_all) writes them.
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
    pub(super) fn missing(self) -> &'static str {
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
