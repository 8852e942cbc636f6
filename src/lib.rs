//! servosim
pub mod cli {
    //! The subcommands.
    pub mod inspect;
}
pub mod contour;
pub mod feedrate;
pub mod interpolator;
pub mod limits;
pub mod optimize;
pub mod path;
pub mod recording;
pub mod report;
pub mod scenario;
pub mod servo;
pub mod simulation;
pub mod summary;
