//! Why a NURBS curve or surface could not be made.

use crate::parameters::OutOfRange;
use crate::path::MAX_COORDINATE_MM;

/// Highest degree that a curve or a surface takes.
pub const MAX_DEGREE: usize = 9;

/// Why a NURBS curve or surface could not be made. Knots, weights and control points are counted from 0, as given; of a surface
/// control points and weights are counted row by row, and knots along the direction that was looked at last.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsError {
    /// Degree 0, or above [`MAX_DEGREE`].
    #[error(
        "degree {degree} is out of range: 1 to {} are taken (an NC word often gives the order, one more than the degree)",
        MAX_DEGREE
    )]
    BadDegree {
        /// The degree.
        degree: usize,
    },
    /// Fewer than `degree + 1` control points.
    #[error("{given} control points are too few for degree {degree}: at least {} are needed", degree + 1)]
    TooFewControlPoints {
        /// How many were given.
        given: usize,
        /// The degree.
        degree: usize,
    },
    /// The number of knots is not that of control points + degree + 1.
    #[error("{given} knots are given, but {points} control points of degree {degree} need {needed}")]
    WrongKnotCount {
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
        /// The degree.
        degree: usize,
        /// Number of control points.
        points: usize,
    },
    /// The number of weights is not that of control points.
    #[error("{given} weights are given for {points} control points: each needs one")]
    WrongWeightCount {
        /// How many were given.
        given: usize,
        /// Number of control points.
        points: usize,
    },
    /// A row of a surface's control points has another length than the first one.
    #[error("row {row} has {given} control points, the first one has {needed}")]
    RaggedRows {
        /// The row.
        row: usize,
        /// Its control points.
        given: usize,
        /// Control points of row 0.
        needed: usize,
    },
    /// A knot is NaN or infinite.
    #[error("knot {index} is {value}, not a finite number")]
    BadKnot {
        /// Index of the knot.
        index: usize,
        /// The knot.
        value: f64,
    },
    /// A knot is smaller than the one before it.
    #[error("knot {index} ({value}) is smaller than the one before it ({before}): knots must not decrease")]
    DecreasingKnots {
        /// Index of the smaller knot.
        index: usize,
        /// The knot before it.
        before: f64,
        /// The knot.
        value: f64,
    },
    /// A knot is repeated too often.
    #[error("knot {index} ({value}) is repeated more than {most} times: the curve would fall apart there")]
    TooManyEqualKnots {
        /// Index of the first repetition too many.
        index: usize,
        /// The knot.
        value: f64,
        /// How many are taken there.
        most: usize,
    },
    /// The parameter has no room: the knots of the domain coincide.
    #[error("the curve has no parameter to run over: its knots begin at {low} and end at {high}")]
    EmptyDomain {
        /// First parameter.
        low: f64,
        /// Last parameter.
        high: f64,
    },
    /// A weight that is not a positive number, or weights too far apart.
    #[error("weight {index} is {value}: weights must be positive, and none below a billionth of the largest")]
    BadWeight {
        /// Index of the weight.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// A coordinate is NaN, infinite, or too large.
    #[error("coordinate {value} mm of control point {index} is not a finite number within ±{} mm", MAX_COORDINATE_MM)]
    BadCoordinate {
        /// Index of the control point.
        index: usize,
        /// The coordinate.
        value: f64,
    },
    /// A knot to be inserted lies outside the curve, or is there as often as it can be.
    #[error(
        "a knot at {u} cannot be inserted {times} times: it must lie inside {low} … {high} and be there at most {most} times in all"
    )]
    BadInsertion {
        /// The knot.
        u: f64,
        /// How often.
        times: usize,
        /// First parameter.
        low: f64,
        /// Last parameter.
        high: f64,
        /// The degree.
        most: usize,
    },
    /// A radius that is not positive, an angle that is not in range, or axes that are not perpendicular unit vectors.
    #[error("this makes no arc: {0}")]
    BadArc(OutOfRange),
}
