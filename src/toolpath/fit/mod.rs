//! B-splines with few control points through many points.
//!
//! Given points `Q_0 … Q_m`, a degree `p` and a tolerance `ε`: a curve from `Q_0` to `Q_m` within `ε` of every point with as few
//! control points as the method finds. The distance of a point is the true one, to its nearest place of the curve (Newton). Between
//! the points the curve is sampled densely: nowhere may it be further from their polygon than `ε` and the bulge that the points
//! themselves show there (the sagitta `κ l²/8` of a leg `l` at the curvature `κ` of the circle through three points).
//!
//! | method | knots | what it is for |
//! |---|---|---|
//! | [`Method::Standard`] | averaged parameters | the textbook's fit, to compare with |
//! | [`Method::Paper`] | averaged, five stages | the paper's |
//! | [`Method::Density`] | dense where the `p+1`-th derivative is large | fast and good |
//! | [`Method::Free`] | free, moved together with control points and parameters | the fewest |
//!
//! Control points found on 500 points of `x = 40 cos t, y = 25 sin t, z = 3 sin 3t + 1.5 sin 24(t-4) exp(-((t-4)/0.25)²)` (after the
//! slash: without the last term), cubic:
//!
//! | ε \[mm\] | 0.5 | 0.25 | 0.05 | 0.01 | 0.005 |
//! |---|---|---|---|---|---|
//! | standard | 51/12 | 54/14 | 123/18 | 188/26 | 236/28 |
//! | paper | 51/12 | 54/14 | 114/18 | 188/24 | 236/28 |
//! | density | 18/10 | 21/12 | 30/16 | 47/22 | 54/25 |
//! | free | 12/8 | 14/8 | 19/12 | 21/15 | 29/16 |
//!
//! Of the free knots some end up close together: the curve stays C² there, but its third derivative changes quickly.
//!
//! Least squares solves a band of `p` beside the diagonal; the numbers of control points are tried one after the other up to
//! 1000 points (the error does not fall steadily with their number) and in steps of a few percent beyond, so that the time grows
//! linearly with the number of points. The free method spends a fixed number of steps times points: beyond some 10 000 points it
//! does little more than the density.
//!
//! Source: Akbari, Rokhzadi, "NURBS-based tool path generation for high speed machining"; Piegl, Tiller, "The NURBS Book", section
//! 9.4; de Boor, "A Practical Guide to Splines", chapter 12.

mod check;
mod density;
mod knot_removal;
mod knots;
mod newton;
mod parameters;
mod spline;
mod standard;

use nalgebra::SVector;

use crate::path::nurbs::MAX_DEGREE;
use crate::path::{MAX_COORDINATE_MM, MAX_POINTS, NurbsCurve, NurbsError};
use check::Data;
pub use parameters::Parametrization;
use spline::Spline;

/// How knots are placed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Averaged knots, their number raised until the tolerance is kept.
    Standard,
    /// The paper's five stages: grow, shrink, improve the parameters, shrink again, as long as the error falls.
    Paper,
    /// Knots where the `p+1`-th derivative is large, its `p+1`-th root as their density; parameters corrected.
    Density,
    /// From the density's knots on: knots taken out one by one, the rest moved by Gauss-Newton steps on control points, knots and
    /// parameters together that weigh the largest distances more and more.
    #[default]
    Free,
}

/// What a fit is to be like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Degree `p` of the curve, 1 to [`MAX_DEGREE`].
    pub degree: usize,
    /// Largest distance `ε` of a point to the curve \[mm\].
    pub tolerance_mm: f64,
    /// How parameters are first given to the points.
    pub parametrization: Parametrization,
    /// How knots are placed.
    pub method: Method,
}

impl FitOptions {
    /// A cubic by the default method and chord length.
    pub fn cubic(tolerance_mm: f64) -> Self {
        Self { degree: 3, tolerance_mm, parametrization: Parametrization::default(), method: Method::default() }
    }
}

/// A fitted curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const D: usize> {
    /// The curve, clamped, over `0 … 1`. Its first and last control points are the first and last of the
    /// points, exactly.
    pub curve: NurbsCurve<D>,
    /// Where on the curve each of the points is nearest.
    pub parameters: Vec<f64>,
    /// Largest distance of a point to the curve \[mm\], at most the tolerance.
    pub error_mm: f64,
    /// Largest distance of the curve, sampled eight times between neighbouring points, to the points' polygon \[mm\].
    pub polygon_error_mm: f64,
}

/// Why nothing was fitted. Points are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer than two points.
    #[error("{given} points are too few to fit a curve to: at least 2 are needed")]
    TooFewPoints {
        /// How many were given.
        given: usize,
    },
    /// More than [`MAX_POINTS`] points.
    #[error("{given} points are too many to fit a curve to: at most {} are taken; fit the path in parts", MAX_POINTS)]
    TooManyPoints {
        /// How many were given.
        given: usize,
    },
    /// A coordinate is NaN, infinite, or too large.
    #[error("coordinate {value} mm of point {index} is not a finite number within ±{} mm", MAX_COORDINATE_MM)]
    BadCoordinate {
        /// Index of the point.
        index: usize,
        /// The coordinate.
        value: f64,
    },
    /// Two neighbouring points coincide.
    #[error("points {first} and {second} coincide ({distance_mm:.3e} mm apart): leave one of them out", second = first + 1)]
    CoincidentPoints {
        /// Index of the first one.
        first: usize,
        /// Their distance \[mm\].
        distance_mm: f64,
    },
    /// The tolerance is not a positive finite number, or too small for a double at these coordinates.
    #[error(
        "a tolerance of {tolerance_mm} mm is not possible: it must be a finite number of at least {} mm",
        LEAST_TOLERANCE_MM
    )]
    BadTolerance {
        /// The tolerance.
        tolerance_mm: f64,
    },
    /// The degree is 0 or above [`MAX_DEGREE`].
    #[error("degree {degree} is out of range: 1 to {} are taken", MAX_DEGREE)]
    BadDegree {
        /// The degree.
        degree: usize,
    },
    /// The curve found is none.
    #[error("the fitted curve is not valid: {0}")]
    Curve(#[from] NurbsError),
}

/// Smallest tolerance that is taken \[mm\].
pub const LEAST_TOLERANCE_MM: f64 = 1e-7;

/// Points as near as this coincide \[mm\].
const COINCIDENT_MM: f64 = 1e-9;

/// A spline that keeps the tolerance, with the parameters of the points.
#[derive(Debug, Clone)]
struct Candidate<const D: usize> {
    spline: Spline<D>,
    parameters: Vec<f64>,
}

impl<const D: usize> Candidate<D> {
    fn count(&self) -> usize {
        self.spline.points.len()
    }
}

/// Fits a B-spline to `points_mm`.
///
/// Tolerance and both ends are always kept: where a method finds nothing with fewer control points than there are points, the
/// polygon itself is the curve.
///
/// ```
/// use nalgebra::Vector2;
/// use servosim::toolpath::fit::{FitOptions, fit};
///
/// let points: Vec<_> = (0..=200).map(|i| 0.02 * f64::from(i)).map(|t| Vector2::new(10.0 * t, 5.0 * t.sin())).collect();
/// let fitted = fit(&points, &FitOptions::cubic(0.01))?;
/// assert!(fitted.error_mm <= 0.01);
/// assert!(fitted.curve.control_points_mm().len() < 10);
/// assert_eq!(fitted.curve.control_points_mm().last(), points.last());
/// # Ok::<(), servosim::toolpath::fit::FitError>(())
/// ```
///
/// # Errors
/// Fewer than 2 points or too many, neighbours that coincide, coordinates that are not finite numbers in range, a tolerance that is
/// not positive, a degree out of range.
pub fn fit<const D: usize>(points_mm: &[SVector<f64, D>], options: &FitOptions) -> Result<Fit<D>, FitError> {
    validate(points_mm, options)?;
    let FitOptions { degree, tolerance_mm, parametrization, method } = *options;
    let data = Data::new(points_mm, degree, tolerance_mm, parametrization);
    let found = match method {
        Method::Standard => standard::standard(&data),
        Method::Paper => standard::paper(&data),
        Method::Density => density::density(&data),
        Method::Free => density::density(&data).map(|start| knot_removal::free(&data, start)),
    };
    let Candidate { spline, parameters } = found.unwrap_or_else(|| polygon(&data));
    let (parameters, error_mm) = check::distances(&spline, data.given(), &data.given_only(&parameters));
    let polygon_error_mm = check::polygon_error(&spline, data.given(), &parameters);
    let curve = NurbsCurve::new(degree, spline.knots, spline.points, None)?;
    Ok(Fit { curve, parameters, error_mm, polygon_error_mm })
}

fn validate<const D: usize>(points: &[SVector<f64, D>], options: &FitOptions) -> Result<(), FitError> {
    let &FitOptions { degree, tolerance_mm, .. } = options;
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(FitError::BadDegree { degree });
    }
    if !(LEAST_TOLERANCE_MM..=MAX_COORDINATE_MM).contains(&tolerance_mm) {
        return Err(FitError::BadTolerance { tolerance_mm });
    }
    let given = points.len();
    if given < 2 {
        return Err(FitError::TooFewPoints { given });
    }
    if given > MAX_POINTS {
        return Err(FitError::TooManyPoints { given });
    }
    for (index, point) in points.iter().enumerate() {
        if let Some(&value) = point.iter().find(|x| !(x.abs() <= MAX_COORDINATE_MM)) {
            return Err(FitError::BadCoordinate { index, value });
        }
    }
    for (first, pair) in points.windows(2).enumerate() {
        let distance_mm = (pair[1] - pair[0]).norm();
        if distance_mm <= COINCIDENT_MM {
            return Err(FitError::CoincidentPoints { first, distance_mm });
        }
    }
    Ok(())
}

/// The polygon as a curve: every leg a straight piece, knots as often repeated as the degree.
fn polygon<const D: usize>(data: &Data<'_, D>) -> Candidate<D> {
    let p = data.degree;
    let mut interior = Vec::new();
    for &t in &data.start[1..data.start.len() - 1] {
        interior.extend(std::iter::repeat_n(t, p));
    }
    let mut points = vec![data.points[0]];
    for pair in data.points.windows(2) {
        points.extend((1..p).map(|k| pair[0] + (pair[1] - pair[0]) * (k as f64 / p as f64)));
        points.push(pair[1]);
    }
    let knots = spline::clamped(p, &interior);
    Candidate { spline: Spline { degree: p, knots, points }, parameters: data.start.clone() }
}
