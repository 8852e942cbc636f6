//! Optimisation: a function in, the best point and the history of the search out.
//!
//! Three direct searches, none of which needs a derivative:
//!
//! | search | good for |
//! |---|---|
//! | [`PatternSearch`] | one variable, or several that act independently; never fails, slow in curved valleys |
//! | [`NelderMead`] | up to about ten variables, smooth or not |
//! | [`CmaEs`] | rough or badly scaled functions; learns the valley's shape, robust against noise |
//!
//! Each has `minimize` and `minimize_until`, which passes every iteration to a callback and ends when it says so. What is minimised is a number
//! or a [`Value`], which also says by how much a point breaks its constraints. All of them are
//! deterministic: basic arithmetic and `libm` only, random numbers from a seed.
//!
//! ```
//! use servosim::optimize::{NelderMead, Value};
//!
//! // The point of the half plane x + y ≥ 1 that is nearest to the origin, from outside of it.
//! let outcome = NelderMead::default().minimize(&[-3.0, -1.0], |p: &[f64]| Value {
//!     violation: (1.0 - p[0] - p[1]).max(0.0),
//!     objective: p[0] * p[0] + p[1] * p[1],
//! });
//! assert!((outcome.point[0] - 0.5).abs() < 1e-3 && (outcome.objective - 0.5).abs() < 1e-6);
//! ```

mod bounds;
mod cma_es;
mod eigen;
mod golden_section;
mod nelder_mead;
mod outcome;
mod pattern_search;
mod random;
mod value;

pub use cma_es::CmaEs;
pub(crate) use golden_section::golden_section;
pub use nelder_mead::NelderMead;
pub use outcome::{Outcome, Step};
pub use pattern_search::PatternSearch;
pub use random::Random;
pub use value::Value;
