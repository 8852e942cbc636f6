//! Sweeps: maps and scattered dots in colour, curves, histograms.

pub(in super::super) mod colour;
pub(in super::super) mod curve;
pub(in super::super) mod histogram;
pub(in super::super) mod map;
mod shared;
