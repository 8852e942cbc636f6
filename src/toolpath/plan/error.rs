//! Why there is no tool path.

use crate::path::NurbsError;
use crate::toolpath::CutterError;
use crate::toolpath::fit::FitError;
use crate::toolpath::guide::GuideError;
use crate::toolpath::stepover::StepoverError;

/// Why there is no tool path. Places are those of the tool axis in plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The tolerance is not a positive finite number.
    #[error("a path tolerance of {tolerance_mm} mm is not possible: it must be a positive number")]
    BadTolerance {
        /// The tolerance.
        tolerance_mm: f64,
    },
    /// Some other length is not a number, or negative.
    #[error("{what} of {value_mm} mm is not possible: it must be a finite number, 0 or more")]
    BadLength {
        /// Which one.
        what: &'static str,
        /// Its value.
        value_mm: f64,
    },
    /// The scallop height is not possible.
    #[error(transparent)]
    BadScallop(StepoverError),
    /// There is no step-over at a place.
    #[error("no step-over at x = {x_mm:.3}, y = {y_mm:.3} mm: {source}")]
    StepOver {
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
        /// Why.
        source: StepoverError,
    },
    /// The formulas are those of a ball.
    #[error("the step-over formulas hold for a ball-end cutter only: take the measured step-over for this one")]
    FormulaNeedsBall,
    /// The cutter has nothing to rest on.
    #[error(
        "the cutter has nothing to rest on at x = {x_mm:.3}, y = {y_mm:.3} mm: no part of the surface lies under it; draw the boundary nearer to the surface"
    )]
    NoRest {
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
    },
    /// No region is left.
    #[error(
        "nothing is left of the region after its first inset of {inset_mm} mm: it is nowhere deeper than {depth_mm:.4} mm"
    )]
    NothingLeft {
        /// The inset.
        inset_mm: f64,
        /// Largest distance of a point from the boundary.
        depth_mm: f64,
    },
    /// However near the passes are, something stays.
    #[error(
        "at x = {x_mm:.3}, y = {y_mm:.3} mm a ridge of {ridge_mm:.4} mm stays however near the passes are: the surface is too steep or too sharply bent for this cutter there"
    )]
    Uncovered {
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
        /// The ridge.
        ridge_mm: f64,
    },
    /// The passes would be too many.
    #[error("the region needs more than {most} rings inside each other: take a larger cutter or scallop height")]
    TooManyRings {
        /// How many are taken.
        most: usize,
    },
    /// The tolerance is as large as the cutter.
    #[error("the tolerance does not suit the cutter: {0}")]
    Cutter(#[from] CutterError),
    /// A guide contour.
    #[error(transparent)]
    Guide(#[from] GuideError),
    /// A fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A curve.
    #[error(transparent)]
    Curve(#[from] NurbsError),
}
