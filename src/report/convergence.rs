//! How a tuning converged.

use crate::optimize::Step;

/// How a tuning converged, for [`write_convergence`](super::write_convergence).
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
