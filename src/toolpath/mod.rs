//! Tool paths for a ball-end cutter on three axes: from a surface to few, smooth NURBS blocks.
//!
//! Source: Akbari, Rokhzadi, "NURBS-based tool path generation for high speed machining". Lengths are millimetres.

pub mod fit;
pub mod stepover;
