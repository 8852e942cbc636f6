//! The closed loop: the ideal one, the drive as it is, their analysis, measurement and contouring error.

#[path = "../common/mod.rs"]
mod common;

mod analysis;
mod batch;
mod contour;
mod contour_limit;
mod drive;
mod drive_blocks;
mod drive_figures;
mod drive_remedies;
mod drive_slides;
mod hostile;
mod linear_drive;
mod measure;
mod reference;
mod servo;
