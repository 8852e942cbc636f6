//! Paths, curves and the feed along them.

#[path = "../common/mod.rs"]
mod common;

mod feed_override;
mod feedrate;
mod fit;
mod look_ahead;
mod nurbs;
mod optimal;
mod optimize;
mod path;
