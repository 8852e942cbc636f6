//! Blocks to text.
//!
//! | step | file |
//! |---|---|
//! | a motion in the numbers that are written | `plan`, `fixed` |
//! | what rounding them moves | `rounding` |
//! | the stream of text | `writer` |

mod error;
mod fixed;
mod plan;
mod rounding;
mod writer;
mod writing;

pub use error::WriteError;
pub use fixed::MAX_DECIMALS;
pub use writer::{Writer, Written};
pub use writing::{Decimals, Writing};
