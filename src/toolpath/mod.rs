//! Tool paths on three axes: from a surface to few, smooth NURBS blocks.
//!
//! | step | what does it |
//! |---|---|
//! | the surface, as a cutter sees it from above | [`DesignSurface`]; [`mesh`], [`mod@drop_cutter`] |
//! | the region in plan and its insets | [`guide`] |
//! | the distance from pass to pass | [`stepover`] |
//! | rings, laid on the surface, linked | [`plan`] |
//! | few control points through many points | [`fit`] |
//!
//! Source: Akbari, Rokhzadi, "NURBS-based tool path generation for high speed machining". Lengths are millimetres.

mod cutter;
mod design;
pub mod drop_cutter;
pub mod fit;
pub mod guide;
pub mod mesh;
pub mod plan;
pub mod stepover;
mod stepover_comparison;

pub use cutter::{Cutter, CutterError};
pub use design::{ContactLocation, DesignSurface, SurfaceTop};
pub use stepover_comparison::{StepoverComparison, StepoverCurve, StepoverRow, stepover_row};
