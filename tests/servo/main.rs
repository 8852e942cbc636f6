//! The closed loop: the ideal one, the detailed drive model, their analysis, measurement and contouring error.

#[path = "../common/mod.rs"]
mod common;

mod analysis;
mod batch;
mod contour;
mod contour_limit;
mod drive;
mod drive_blocks;
mod drive_compensation;
mod drive_metrics;
mod drive_slides;
mod hostile;
mod linear_drive;
mod measure;
mod peaks;
mod reference;
mod servo;
mod standstill;
