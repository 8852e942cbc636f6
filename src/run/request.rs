//! What is asked of a run, and what is left of it.

use std::path::{Path, PathBuf};

use super::error::RunError;
use crate::comparison::Comparison;
use crate::recording::RecordingOptions;
use crate::simulation::{Observer, ObserverError, Period};
use crate::summary::Summary;

/// What is asked of a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RunRequest {
    /// Folder for all files; made if it is missing.
    pub folder: PathBuf,
    /// Name of the files; by default that of the scenario or the program.
    pub name: Option<String>,
    /// How it is recorded.
    pub recording: RecordingOptions,
    /// Plots, and in which format.
    #[cfg(feature = "plots")]
    pub plots: Option<crate::report::Format>,
    /// Whether the effects of a detailed drive are run one by one too.
    pub compare_effects: bool,
}

impl RunRequest {
    /// A recording of every sample under the name of the scenario, without plots.
    pub fn new(folder: impl AsRef<Path>) -> Self {
        Self {
            folder: folder.as_ref().to_owned(),
            name: None,
            recording: RecordingOptions::default(),
            #[cfg(feature = "plots")]
            plots: None,
            compare_effects: false,
        }
    }

    /// The name of the files.
    pub(super) fn stem(&self, own: &str) -> Result<String, RunError> {
        let name = self.name.as_deref().unwrap_or(own);
        if name.is_empty() || name.chars().any(|c| matches!(c, '/' | '\\') || c.is_control()) {
            return Err(RunError::Name { name: name.to_owned() });
        }
        Ok(name.to_owned())
    }
}

/// What is left of a run.
#[derive(Debug)]
#[non_exhaustive]
pub struct RunReport {
    /// Its metrics; not complete where it was stopped.
    pub summary: Summary,
    /// Whether it was stopped: the recording is `NAME.mcap.partial`, and nothing else was written.
    pub interrupted: bool,
    /// The recording.
    pub recording: PathBuf,
    /// Whether a recording of an earlier run was replaced.
    pub replaced: bool,
    /// Every file that was written, the recording first.
    pub written: Vec<PathBuf>,
    /// Plots of an earlier run of this name that this one has not written anew: removed.
    pub removed: Vec<PathBuf>,
    /// Why plots are missing: metrics and recording are there whatever becomes of them.
    pub plots_error: Option<RunError>,
    /// What each effect of the drives costs, where it was asked for and there are any.
    pub effects: Option<Comparison>,
    /// Axes whose loops are unstable, even if the run does not show it.
    pub unstable_axes: Vec<&'static str>,
}

impl RunReport {
    /// Whether every limit is kept and no axis locked up.
    pub fn passed(&self) -> bool {
        self.summary.passed()
    }
}

/// What a run is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// The simulation, period by period.
    Simulating,
    /// The effects of the drives, one by one.
    ComparingEffects,
    /// The part as the program has it.
    CuttingNominalPart,
    /// Plots.
    Drawing,
}

/// Watches a run: sees every control period as an observer, and hears of its stages.
pub trait Watch<const A: usize>: Observer<A> {
    /// A stage begins.
    fn stage(&mut self, stage: Stage) {
        let _ = stage;
    }
}

/// Nobody watches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl<const A: usize> Observer<A> for Unwatched {
    fn period(&mut self, _: &Period<A>) -> Result<(), ObserverError> {
        Ok(())
    }
}

impl<const A: usize> Watch<A> for Unwatched {}
