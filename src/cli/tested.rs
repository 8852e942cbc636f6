//! The result of one scenario of a suite.

use serde::Serialize;

use super::CliError;
use super::output::{margin, short, significant};
use crate::limits::LimitCheck;

/// What became of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    /// Every limit is kept.
    Passed,
    /// It ran, but has no limits to be held to.
    Skipped,
    /// A limit is broken.
    Broken,
    /// A loop locked up.
    LockedUp,
    /// The scenario cannot be used.
    Unusable,
    /// It failed while running.
    Failed,
    /// The user stopped before its end.
    Interrupted,
}

/// The result of one scenario.
#[derive(Debug, Serialize)]
pub(super) struct Tested {
    /// The file, or the name that was given.
    pub(super) scenario: String,
    pub(super) verdict: Verdict,
    pub(super) limits: Vec<LimitCheck>,
    /// In words: which axis, when, how.
    pub(super) lockup: Option<String>,
    /// Why it cannot be used or failed.
    pub(super) error: Option<String>,
    /// The same for standard error.
    #[serde(skip)]
    pub(super) told: Option<CliError>,
    /// How long it took \[s\]: not part of what is compared between runs.
    #[serde(skip)]
    pub(super) seconds: f64,
}

/// `27.027 of 30, 9.9 % to spare`
pub(super) fn held(check: &LimitCheck) -> String {
    let LimitCheck { value, limit, .. } = *check;
    format!("{} of {}, {}", significant(value, 5), short(limit, 5), margin(value, limit))
}
