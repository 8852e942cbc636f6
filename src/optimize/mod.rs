//! Optimisation: a function in, the best point and the history of the search out.

mod pattern_search;

pub use pattern_search::{Outcome, PatternSearch, Step};
