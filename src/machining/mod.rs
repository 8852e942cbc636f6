//! The part as machined: what a cutter leaves, and how far that is from the design surface.

mod deviation;
mod deviation_figures;
mod height_field;
mod height_field_sweep;

pub use deviation::{DeviationMap, MapRegion};
pub use deviation_figures::{DeviationFigures, DeviationPlace};
pub use height_field::{HeightField, HeightFieldError, MAX_CELLS};
