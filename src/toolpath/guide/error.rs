//! Why there is no guide contour.

use super::element::MAX_ELEMENTS;
use crate::path::MAX_COORDINATE_MM;

/// Why there is no guide contour. Points, pieces and islands are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GuideError {
    /// A coordinate is NaN, infinite or too large.
    #[error(
        "coordinate {value_mm} mm of point or piece {index} is not a finite number within ±{} mm",
        MAX_COORDINATE_MM
    )]
    BadCoordinate {
        /// Index of the point or piece.
        index: usize,
        /// The coordinate.
        value_mm: f64,
    },
    /// Fewer than three different points, or no pieces.
    #[error("a contour of {points} different points encloses nothing: at least three are needed")]
    TooFewPoints {
        /// How many there are.
        points: usize,
    },
    /// More lines and arcs than are taken.
    #[error(
        "a contour of {elements} lines and arcs is too large: at most {} are taken; of a free-form curve, allow a wider tolerance",
        MAX_ELEMENTS
    )]
    TooManyElements {
        /// How many there are.
        elements: usize,
    },
    /// The ends of an arc are not equally far from its centre, or too near to it.
    #[error(
        "piece {index} is no arc: it starts {start_radius_mm} mm from its centre and ends {end_radius_mm} mm from it; both must be the radius"
    )]
    BadArc {
        /// The piece.
        index: usize,
        /// Distance of its start from the centre.
        start_radius_mm: f64,
        /// Distance of its end from the centre.
        end_radius_mm: f64,
    },
    /// A gap between two pieces.
    #[error(
        "the contour is open: piece {piece} ends at ({end_x_mm}, {end_y_mm}) mm, but piece {next} starts at ({start_x_mm}, {start_y_mm}) mm, a gap of {gap_mm} mm; close it with a line"
    )]
    Open {
        /// The piece before the gap.
        piece: usize,
        /// The piece after it.
        next: usize,
        /// Its width.
        gap_mm: f64,
        /// Where the one piece ends.
        end_x_mm: f64,
        /// Where the one piece ends.
        end_y_mm: f64,
        /// Where the next one starts.
        start_x_mm: f64,
        /// Where the next one starts.
        start_y_mm: f64,
    },
    /// The contour crosses or touches itself.
    #[error("the contour crosses or touches itself at ({x_mm}, {y_mm}) mm: split it there into contours of their own")]
    SelfCrossing {
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
    },
    /// The contour encloses no area.
    #[error("the contour that starts at ({x_mm}, {y_mm}) mm encloses no area")]
    ZeroArea {
        /// Its first point.
        x_mm: f64,
        /// Its first point.
        y_mm: f64,
    },
    /// An island crosses or touches the outer contour, or lies outside of it.
    #[error(
        "island {island} is not inside the outer contour at ({x_mm}, {y_mm}) mm: leave it out or cut it from the outer contour"
    )]
    IslandOutside {
        /// The island.
        island: usize,
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
    },
    /// Two islands cross, touch or lie in each other.
    #[error("islands {first} and {second} overlap or touch at ({x_mm}, {y_mm}) mm: join them into one")]
    IslandsMeet {
        /// The one.
        first: usize,
        /// The other.
        second: usize,
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
    },
    /// A distance that is not positive and finite.
    #[error("an inset by {distance_mm} mm is not possible: the distance must be positive and finite")]
    BadDistance {
        /// The distance.
        distance_mm: f64,
    },
    /// A tolerance that is not positive and finite.
    #[error("a tolerance of {tolerance_mm} mm is not possible: it must be positive and finite")]
    BadTolerance {
        /// The tolerance.
        tolerance_mm: f64,
    },
    /// The inset could not be closed, at no distance near the one asked for.
    #[error(
        "the inset by {distance_mm} mm could not be closed near ({x_mm}, {y_mm}) mm: simplify the contour there, or take another distance"
    )]
    Lost {
        /// The distance.
        distance_mm: f64,
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
    },
}
