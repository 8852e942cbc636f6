//! What a block of a program does.

use super::{Arc, MAX_CONTROL_POINTS, MAX_COORDINATE_MM, MAX_DEGREE, MAX_KNOT};

/// One block of a program: one motion, or something that happens between motions.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Line of the program that it begins on, from 1. Zero where it comes from no text.
    pub line: usize,
    /// Where the tool is before \[mm\].
    pub start_mm: [f64; 3],
    /// Where it is after \[mm\]; the start where nothing moves.
    pub end_mm: [f64; 3],
    /// The feed that is in force \[mm/min\]. Every motion but a rapid one has it.
    pub feed_mm_min: Option<f64>,
    /// What happens.
    pub action: Action,
}

/// What happens in a block.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Rapid motion (`G00`). A control may move each axis at its own pace: the path between start and end is not given.
    Rapid,
    /// Straight motion at the feed (`G01`).
    Linear,
    /// Motion on an arc or a helix (`G02`, `G03`).
    Arc(Arc),
    /// Motion along a NURBS curve.
    Nurbs(Nurbs),
    /// Standing still (`G04`).
    Dwell {
        /// For how long \[s\].
        time_s: f64,
    },
    /// Words that move nothing, such as `S12000 M3`, in capital letters and with one space between them.
    Auxiliary(String),
    /// A comment, without its marks. A comment inside a curve comes before the curve.
    Comment(String),
}

impl Block {
    /// Whether the tool moves at the feed.
    pub fn is_feed_motion(&self) -> bool {
        matches!(self.action, Action::Linear | Action::Arc(_) | Action::Nurbs(_))
    }
}

/// A clamped NURBS curve: `C(u) = Σ N_i(u) w_i P_i / Σ N_i(u) w_i` with the B-spline basis `N_i` of the degree on the knots.
#[derive(Debug, Clone, PartialEq)]
pub struct Nurbs {
    /// Degree `p`, 1 to [`MAX_DEGREE`].
    pub degree: usize,
    /// Knots `u_0 … u_{n+p+1}`, in millimetres of chord where the program was written here.
    pub knots: Vec<f64>,
    /// Weights `w_0 … w_n`, above 0.
    pub weights: Vec<f64>,
    /// Control points `P_0 … P_n` \[mm\].
    pub control_points_mm: Vec<[f64; 3]>,
}

/// Why a curve is none. Points and knots are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsFault {
    /// The degree is out of range.
    #[error("degree {degree} is not within 1 to {MAX_DEGREE}")]
    Degree {
        /// The degree.
        degree: usize,
    },
    /// Fewer control points than the degree needs.
    #[error("{given} control points are too few: degree {degree} needs at least {needed}", needed = degree + 1)]
    TooFewPoints {
        /// How many there are.
        given: usize,
        /// The degree.
        degree: usize,
    },
    /// More control points than [`MAX_CONTROL_POINTS`].
    #[error("{given} control points are too many: a curve has at most {MAX_CONTROL_POINTS}")]
    TooManyPoints {
        /// How many there are.
        given: usize,
    },
    /// The number of weights is not that of the control points.
    #[error("{weights} weights for {points} control points")]
    Weights {
        /// How many weights.
        weights: usize,
        /// How many control points.
        points: usize,
    },
    /// The number of knots is not that of the control points plus degree plus one.
    #[error("{given} knots where {needed} are needed")]
    Knots {
        /// How many there are.
        given: usize,
        /// How many there should be.
        needed: usize,
    },
    /// A coordinate is not a number or too large.
    #[error("coordinate {value} mm of control point {index} is not within ±{MAX_COORDINATE_MM} mm")]
    Coordinate {
        /// Which control point.
        index: usize,
        /// The coordinate.
        value: f64,
    },
    /// A weight is not a positive number.
    #[error("weight {value} of control point {index} is not above 0")]
    Weight {
        /// Which control point.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// A knot is not a number or too large.
    #[error("knot {index} is {value}, not within ±{MAX_KNOT}")]
    Knot {
        /// Which knot.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A knot is less than the one before.
    #[error("knot {index} is {value}, less than the {before} before it: knots must not decrease")]
    Decreasing {
        /// Which knot.
        index: usize,
        /// Its value.
        value: f64,
        /// The value before.
        before: f64,
    },
    /// The first or last `degree + 1` knots are not all the same.
    #[error("the {end} {count} knots are not all the same: the curve would not reach its {end} control point")]
    NotClamped {
        /// "first" or "last".
        end: &'static str,
        /// How many must be the same.
        count: usize,
    },
    /// An inner knot stands more than `degree` times, or one of the ends more than `degree + 1` times.
    #[error("knot {index} ({value}) is repeated too often: the curve would have a gap")]
    Gap {
        /// The last of the same knots.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// All knots are the same.
    #[error("all knots are the same: the curve has no extent")]
    NoExtent,
}

impl Nurbs {
    /// Whether this is a curve.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn check(&self) -> Result<(), NurbsFault> {
        let (degree, points) = (self.degree, self.control_points_mm.len());
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(NurbsFault::Degree { degree });
        }
        if points <= degree {
            return Err(NurbsFault::TooFewPoints { given: points, degree });
        }
        if points > MAX_CONTROL_POINTS {
            return Err(NurbsFault::TooManyPoints { given: points });
        }
        if self.weights.len() != points {
            return Err(NurbsFault::Weights { weights: self.weights.len(), points });
        }
        for (index, point) in self.control_points_mm.iter().enumerate() {
            if let Some(&value) = point.iter().find(|c| !(c.abs() <= MAX_COORDINATE_MM)) {
                return Err(NurbsFault::Coordinate { index, value });
            }
        }
        if let Some(index) = self.weights.iter().position(|w| !(*w > 0.0 && w.is_finite())) {
            return Err(NurbsFault::Weight { index, value: self.weights[index] });
        }
        self.check_knots()
    }

    fn check_knots(&self) -> Result<(), NurbsFault> {
        let (order, knots) = (self.degree + 1, &self.knots);
        let needed = self.control_points_mm.len() + order;
        if knots.len() != needed {
            return Err(NurbsFault::Knots { given: knots.len(), needed });
        }
        if let Some(index) = knots.iter().position(|u| !(u.abs() <= MAX_KNOT)) {
            return Err(NurbsFault::Knot { index, value: knots[index] });
        }
        if let Some(index) = (1..needed).find(|&i| knots[i] < knots[i - 1]) {
            return Err(NurbsFault::Decreasing { index, value: knots[index], before: knots[index - 1] });
        }
        let (first, last) = (knots[0], knots[needed - 1]);
        if first == last {
            return Err(NurbsFault::NoExtent);
        }
        if knots[order - 1] != first {
            return Err(NurbsFault::NotClamped { end: "first", count: order });
        }
        if knots[needed - order] != last {
            return Err(NurbsFault::NotClamped { end: "last", count: order });
        }
        // Inside, and at the ends beyond the clamp: never `order` in a row that include an inner knot.
        let gap = |i: &usize| knots[*i] == knots[*i + order - 1];
        if let Some(i) = (1..needed - order).find(gap) {
            return Err(NurbsFault::Gap { index: i + order - 1, value: knots[i + order - 1] });
        }
        Ok(())
    }

    /// Sum of the legs of the control polygon \[mm\]: the chord length that knots are measured against.
    pub fn polygon_length_mm(&self) -> f64 {
        self.control_points_mm.windows(2).map(|leg| super::arc::distance(leg[0], leg[1])).sum()
    }

    /// The knots from 0, in millimetres of chord: `(u - u_0) L/(u_last - u_0)` with the length `L` of the control polygon.
    ///
    /// Knots whose range is between half and twice `L` are in millimetres already and only moved to 0, so that a curve read
    /// back is not stretched again. So are those of a curve without length.
    pub fn rescaled(&self) -> Vec<f64> {
        let (Some(&first), Some(&last)) = (self.knots.first(), self.knots.last()) else { return Vec::new() };
        let length = self.polygon_length_mm();
        let range = last - first;
        let kept = !(length > 0.0) || (0.5..=2.0).contains(&(range / length));
        let factor = if kept { 1.0 } else { length / range };
        self.knots.iter().map(|u| (u - first) * factor).collect()
    }
}
