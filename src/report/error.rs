//! Why a plot could not be drawn or written.

use std::io;
use std::path::PathBuf;

use super::plot_kind::PlotKind;

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
