//! Why a run did not come to its end.

use std::io;
use std::path::PathBuf;

use crate::machining::{InspectionError, ProgramError};
use crate::nc::NcError;
use crate::recording::{ReadError, RecordingError};
#[cfg(feature = "plots")]
use crate::report::ReportError;
use crate::simulation::SimulationError;

/// Why a run did not come to its end, or what of it could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The name is no plain file name.
    #[error("`{name}` is no name for the files of a run: it must not be empty nor hold slashes or control characters")]
    Name {
        /// The name.
        name: String,
    },
    /// The folder is a file.
    #[error("cannot write to {}: it is a file, not a folder", path.display())]
    NoFolder {
        /// Which one.
        path: PathBuf,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The simulation failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The recording could not be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording could not be read back for its plots.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It was stopped while it read a recording for its plots.
    #[error("interrupted before the plots were drawn; {} is whole, `servosim plot` draws it", recording.display())]
    PlotsInterrupted {
        /// The recording.
        recording: PathBuf,
    },
    /// The plots could not be drawn or written.
    #[cfg(feature = "plots")]
    #[error(transparent)]
    Report(#[from] ReportError),
    /// There is no such program.
    #[error("the program {} cannot be read: {source}", path.display())]
    NoProgram {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The program has no motion.
    #[error("{}: the program moves nothing", path.display())]
    NoMotion {
        /// Which one.
        path: PathBuf,
    },
    /// The program could not be run.
    #[error("{}: {source}", path.display())]
    Program {
        /// Which one.
        path: PathBuf,
        /// What is wrong.
        source: ProgramError,
    },
    /// The part could not be looked at.
    #[error("no machining check: {0}")]
    Inspection(InspectionError),
}

impl RunError {
    /// Whether what was asked for cannot be: another request would do.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Name { .. }
                | Self::NoFolder { .. }
                | Self::NoProgram { .. }
                | Self::NoMotion { .. }
                | Self::Inspection(_)
                | Self::Program { source: ProgramError::Read(NcError::Syntax(_)) | ProgramError::Motion { .. }, .. }
        )
    }

    /// A program that could not be run. What is wrong with the machine or the loop is no fault of the program.
    pub(crate) fn program(path: &std::path::Path, source: ProgramError) -> Self {
        match source {
            ProgramError::Simulation(error) => Self::Simulation(error),
            source => Self::Program { path: path.to_owned(), source },
        }
    }

    /// A part that could not be looked at.
    pub(crate) fn inspection(path: &std::path::Path, error: InspectionError) -> Self {
        match error {
            InspectionError::Program(source) => Self::program(path, source),
            error => Self::Inspection(error),
        }
    }
}
