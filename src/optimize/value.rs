//! What a search compares: first how far a point is from being allowed, then how good it is.

use std::cmp::Ordering;

/// The value of a point, compared by Deb's rules: an allowed point is better than one that is not; of two allowed ones the one
/// with the lower objective; of two that are not, the one that violates its constraints less.
///
/// No penalty weight is needed, and a search that starts outside is led inside by the violation alone. Not a number counts
/// as worse than any number. Source: K. Deb, "An efficient constraint handling method for genetic algorithms", Comput.
/// Methods Appl. Mech. Eng. 186 (2000), section 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// By how much the point breaks its constraints; zero (or less) where it keeps them all.
    pub violation: f64,
    /// What is to be small.
    pub objective: f64,
}

impl Value {
    /// A point that breaks its constraints by this much, and whose objective is not known.
    pub fn infeasible(violation: f64) -> Self {
        Self { violation, objective: f64::INFINITY }
    }

    /// Whether all constraints are kept.
    pub fn is_feasible(&self) -> bool {
        self.violation <= 0.0
    }

    /// Better first; equal where neither is better.
    pub fn order(&self, other: &Self) -> Ordering {
        let violation = |value: &Self| if value.violation <= 0.0 { 0.0 } else { value.violation };
        numbers_first(violation(self), violation(other)).then(numbers_first(self.objective, other.objective))
    }

    /// Whether this one is to be preferred.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.order(other) == Ordering::Less
    }
}

impl From<f64> for Value {
    /// Without constraints.
    fn from(objective: f64) -> Self {
        Self { violation: 0.0, objective }
    }
}

/// By size, not a number last.
fn numbers_first(a: f64, b: f64) -> Ordering {
    a.partial_cmp(&b).unwrap_or_else(|| a.is_nan().cmp(&b.is_nan()))
}
