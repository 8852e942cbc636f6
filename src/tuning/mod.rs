//! Tuning: controller gains that make the contouring error small and keep stability margin.
//!
//! A [`Problem`] is a scenario, the gains that may be changed ([`Variable`]), what is to be small ([`Objective`]) and what has
//! to be kept ([`Constraints`]). [`Tuning`] searches it from several starts on all cores. The cheap constraints come first: only gains whose
//! loops keep their margins are simulated.

mod problem;
mod report;
mod runs;
mod search;
mod uncertainty;
mod variable;

use crate::parameters::OutOfRange;
pub use problem::{Assessment, Constraint, Constraints, Objective, Problem, Violation};
pub use report::{
    AxisMargins, Check, DRAWN_PLANTS, GainSensitivity, GainSet, SearchMetadata, Statistics, TuningReport, changes,
    report,
};
pub use runs::Metrics;
pub use search::{Method, Progress, Trace, Tuned, Tuning};
pub use uncertainty::Uncertainty;
pub use variable::{Gain, Variable};

use crate::simulation::SimulationError;

/// Why a tuning makes no sense.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TuningError {
    /// No gain of this name.
    #[error("there is no gain `{key}` to vary{}", suggestion.as_ref().map(|s| format!(": did you mean `{s}`?")).unwrap_or_default())]
    UnknownVariable {
        /// As it was given.
        key: String,
        /// What was probably meant.
        suggestion: Option<String>,
    },
    /// Bounds that are none.
    #[error("the bounds `{given}` of {key} cannot be used: {why}")]
    Bounds {
        /// The gain.
        key: String,
        /// As they were given.
        given: String,
        /// What is wrong with them.
        why: &'static str,
    },
    /// A gain is varied twice.
    #[error("{key} is varied twice")]
    Twice {
        /// The gain.
        key: String,
    },
    /// There is no variable.
    #[error("there is nothing to vary: name at least one gain")]
    NothingToVary,
    /// There is no start.
    #[error("a search needs at least one start")]
    NoStart,
    /// Too few evaluations to begin with.
    #[error("a budget of {budget} evaluations is too small: these starts and variables need at least {least}")]
    Budget {
        /// As given.
        budget: usize,
        /// What is needed.
        least: usize,
    },
    /// A limit that nothing can keep, or that limits nothing.
    #[error(transparent)]
    Limit(OutOfRange),
    /// An axis has another controller than the one that is tuned.
    #[error(
        "axis {axis} has a {controller} controller: tuning searches the gains of the PDFF controller, which that axis does not use"
    )]
    Controller {
        /// Name of the axis.
        axis: &'static str,
        /// Its controller.
        controller: &'static str,
    },
    /// The scenario cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}
