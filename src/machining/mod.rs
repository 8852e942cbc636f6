//! From tool paths to programs, and from programs to parts.

mod program_text;

pub use program_text::{Feeds, Shape, program};
