//! Tool paths for a ball-end cutter on three axes: from a surface to few, smooth NURBS blocks.
//!
//! Source: Akbari, Rokhzadi, "NURBS-based tool path generation for high speed machining". Lengths are millimetres.

mod cutter;
mod design;
pub mod drop;
pub mod fit;
pub mod guide;
pub mod mesh;
pub mod plan;
pub mod stepover;

pub use cutter::{Cutter, CutterError};
pub use design::{DesignSurface, Rest, SurfaceTop};
