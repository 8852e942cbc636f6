//! Why a sweep cannot be set up, computed, written or joined.

use std::io;
use std::path::PathBuf;

use crate::scenario::ScenarioError;

use super::MAX_POINTS;

/// Why a sweep could not be set up, computed, written or joined.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// What was asked for makes no sense.
    #[error("{problem}\nhelp: {help}")]
    Request {
        /// What is wrong.
        problem: String,
        /// What to do.
        help: String,
    },
    /// The scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// More points than [`MAX_POINTS`].
    #[error(
        "the sweep has {count} points; at most {MAX_POINTS} are computed\nhelp: lower the counts, vary fewer values at a time, or sample with --method sobol --samples 100000"
    )]
    TooMany {
        /// How many, written out.
        count: String,
    },
    /// A journal or part that cannot be gone on with or joined: of another sweep, missing, given twice.
    #[error("{problem}\nhelp: {help}")]
    Unfit {
        /// What is wrong, with the file.
        problem: String,
        /// What to do.
        help: String,
    },
    /// A file that no sweep has written stands where a journal should.
    #[error(
        "{} is not a journal of a sweep\nhelp: `servosim merge` takes files called NAME-sweep.I-of-N.part; for a sweep move it away, or name another folder with --output",
        file.display()
    )]
    Foreign {
        /// The file.
        file: PathBuf,
    },
    /// A journal or part whose bytes are not those that were written.
    #[error("{} is damaged: {what}\nhelp: {help}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What does not fit, and where.
        what: String,
        /// What to do.
        help: &'static str,
    },
    /// A file could not be read.
    #[error("cannot read {}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}{}", file.display(), if kept.is_empty() { String::new() } else { format!("\nhelp: {kept}") })]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
        /// What there is of the sweep, and how to go on with it; may be empty.
        kept: String,
    },
    /// The user stopped it.
    #[error("interrupted after {done} of {count} points; {} keeps them, the same command continues from there", journal.display())]
    Interrupted {
        /// Points that are computed.
        done: u64,
        /// All of them.
        count: u64,
        /// Where they are.
        journal: PathBuf,
    },
    /// No point of the sweep makes a scenario that can be run.
    #[error("none of the {count} points can be run; the first: {}", reason.trim_start_matches("error: "))]
    NothingValid {
        /// How many points.
        count: u64,
        /// What is wrong with the first one.
        reason: String,
    },
}

impl SweepError {
    pub(super) fn request(problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Request { problem: problem.into(), help: help.into() }
    }

    pub(super) fn unfit(problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Unfit { problem: problem.into(), help: help.into() }
    }
}
