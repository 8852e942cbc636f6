//! Tool paths: curves that know their own arc length.
//!
//! Every path answers the same questions ([`Path`]): how long it is, where the point at an arc length lies, which way the
//! path runs and how it bends there, and which of its points is nearest to a given one. Lengths are millimetres, a planar
//! point of the PH spline is the complex number `x + iy`.
//!
//! | path | made from |
//! |---|---|
//! | [`PhSpline`] | B-spline control points or nodal points; C2, with exact arc length |
//! | [`Line`] | two points |
//! | [`Circle`] | centre, radius, start angle, direction |
//! | [`Helix`] | an arc in space: two ends, centre, plane, sweep |
//! | [`NurbsPath`] | a [`NurbsCurve`]: degree, knots, control points, weights; in any dimension |
//! | [`Polyline`] | points, joined by straight lines with exact corners; in any dimension |
//!
//! [`NurbsSurface`] is what tool paths are made from.

mod bernstein;
mod bspline;
mod circle;
mod descent;
mod graph;
mod helix;
mod line;
mod nearest;
pub mod nurbs;
mod ph_segment;
mod ph_solver;
mod ph_spline;
mod polyline;
mod quadrature;
mod range_maximum;

use nalgebra::SVector;

pub use circle::Circle;
pub use graph::{GRAPH_ERROR_MM, Graph};
pub use helix::Helix;
pub use line::Line;
pub use nearest::{Nearest, nearest_in_window};
pub use nurbs::{NurbsCurve, NurbsError, NurbsPath, NurbsSurface};
pub use ph_spline::PhSpline;
pub use polyline::Polyline;

/// Largest coordinate magnitude that a path accepts, in millimetres (one kilometre).
///
/// A double resolves 1.2e-10 mm there, so that the promise of 1 nm still holds after a few hundred operations.
pub const MAX_COORDINATE_MM: f64 = 1e6;

/// Most nodal or control points that a path accepts.
pub const MAX_POINTS: usize = 4_000_000;

/// Shortest segment \[mm\]: below it the direction between two points is rounding noise.
const MIN_SEGMENT_MM: f64 = 1e-6;

/// Where on a path the last question was answered: the start of the next search.
///
/// The caller keeps one cursor a stream (one for the interpolator, one for the contouring error), and the path keeps none:
/// a path can be shared between threads. Any cursor is valid on any path; a far-off one only costs a little time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cursor {
    /// Segment, counted from 0.
    pub segment: usize,
    /// Parameter on the segment, 0 to 1.
    pub xi: f64,
    /// By how much the last search moved `xi` on its segment: the next one, in a stream, moves about as far.
    pub advance: f64,
    /// By how much `advance` itself changed.
    pub change: f64,
}

impl Cursor {
    /// A cursor that knows a place and nothing of a stream.
    pub fn at(segment: usize, xi: f64) -> Self {
        Self { segment, xi, ..Self::default() }
    }

    /// Where the next answer of a stream is to be expected on the segment.
    #[inline]
    fn expected(&self) -> f64 {
        self.xi + (self.advance + self.change)
    }

    /// Notes the answer.
    #[inline]
    fn found(&mut self, segment: usize, xi: f64) {
        if segment == self.segment {
            let advance = xi - self.xi;
            *self = Self { segment, xi, advance, change: advance - self.advance };
        } else {
            *self = Self::at(segment, xi);
        }
    }
}

/// A point of a path with the first three derivatives with respect to arc length.
///
/// With feed `v`, acceleration `a` and jerk `j` along the path the point moves with
/// `v t`, `a t + v² k` and `j t + 3 v a k + v³ k'`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<const D: usize> {
    /// Arc length from the start of the path \[mm\].
    pub s_mm: f64,
    /// The point `r(s)` \[mm\].
    pub point_mm: SVector<f64, D>,
    /// Unit tangent `t = dr/ds`.
    pub tangent: SVector<f64, D>,
    /// Curvature vector `k = dt/ds` \[1/mm\].
    pub curvature_1_mm: SVector<f64, D>,
    /// Its derivative `k' = dk/ds` \[1/mm²\].
    pub curvature_rate_1_mm2: SVector<f64, D>,
}

impl<const D: usize> Frame<D> {
    /// The frame of a curve with the point `r` and three derivatives with respect to any parameter, the first of them not 0.
    ///
    /// With `σ = |r'|`: `t = r'/σ`, `k = t'/σ`, `k' = (t''/σ - t' σ'/σ²)/σ`, where the primes on `t` and `σ` are those of the parameter.
    #[inline]
    fn of_derivatives(s_mm: f64, point_mm: SVector<f64, D>, [r1, r2, r3]: [SVector<f64, D>; 3]) -> Self {
        let inverse = 1.0 / r1.norm();
        let tangent = r1 * inverse;
        let speed1 = tangent.dot(&r2);
        let t1 = (r2 - tangent * speed1) * inverse;
        let speed2 = t1.dot(&r2) + tangent.dot(&r3);
        let t2 = (r3 - t1 * (2.0 * speed1) - tangent * speed2) * inverse;
        Self {
            s_mm,
            point_mm,
            tangent,
            curvature_1_mm: t1 * inverse,
            curvature_rate_1_mm2: (t2 - t1 * (speed1 * inverse)) * (inverse * inverse),
        }
    }
}

/// A nearest point of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot<const D: usize> {
    /// Arc length from the start of the path \[mm\].
    pub s_mm: f64,
    /// The point \[mm\].
    pub point_mm: SVector<f64, D>,
    /// Unit tangent there.
    pub tangent: SVector<f64, D>,
}

impl<const D: usize> From<Frame<D>> for Foot<D> {
    fn from(frame: Frame<D>) -> Self {
        Self { s_mm: frame.s_mm, point_mm: frame.point_mm, tangent: frame.tangent }
    }
}

/// A curve parametrised by arc length.
pub trait Path<const D: usize>: Send + Sync {
    /// Total length \[mm\], positive and finite.
    fn length_mm(&self) -> f64;

    /// Whether the end is the start: arc lengths are then taken modulo the length by [`Path::nearest_local`].
    fn is_closed(&self) -> bool;

    /// Point and derivatives at arc length `s_mm`, clamped to `[0, length]` (NaN: the start). `cursor` is where the search starts and, on
    /// return, where it ended.
    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D>;

    /// The point alone; cheaper where a path can make it so.
    fn point_mm(&self, s_mm: f64, cursor: &mut Cursor) -> SVector<f64, D> {
        self.frame(s_mm, cursor).point_mm
    }

    /// Upper bound of the curvature \[1/mm\] between two arc lengths, `0 ≤ from_mm ≤ to_mm ≤ length`.
    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64;

    /// Largest curvature on the whole path \[1/mm\], exact to rounding.
    fn max_curvature_1_mm(&self) -> f64 {
        self.curvature_bound_1_mm(0.0, self.length_mm())
    }

    /// The path near arc length `s_mm` as a graph over its tangent. None where this kind of path has no such form; a path in
    /// space has none.
    fn graph(&self, s_mm: f64, cursor: &mut Cursor) -> Option<Graph> {
        let _ = (s_mm, cursor);
        None
    }

    /// Follows the distance to `point_mm` downhill from `cursor` to the nearest local minimum, where `(r - p)·r' = 0`. An
    /// open path stops at its ends, a closed one runs on through its seam. The point is that of the minimum within 1e-10 mm.
    /// A start where the distance is stationary stays there. The number of steps is bounded: very far from its foot on a very
    /// uneven path the search may end early, which `(r - p)·t ≠ 0` tells ([`nearest_in_window`] looks).
    fn nearest_local(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D>;
}

/// Why a path could not be made. Points and segments are counted from 0, as in the scenario's array.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// Fewer points than the construction needs.
    #[error("{given} {what} are too few: at least {needed} are needed")]
    TooFewPoints {
        /// "control points" or "nodal points".
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// More points than [`MAX_POINTS`].
    #[error("{given} {what} are too many: at most {} are taken", MAX_POINTS)]
    TooManyPoints {
        /// "control points" or "nodal points".
        what: &'static str,
        /// How many were given.
        given: usize,
    },
    /// A coordinate is NaN, infinite, or beyond [`MAX_COORDINATE_MM`].
    #[error("coordinate {value} mm of point {index} is not a finite number within ±{} mm", MAX_COORDINATE_MM)]
    BadCoordinate {
        /// Index of the point as given.
        index: usize,
        /// The coordinate.
        value: f64,
    },
    /// Two neighbouring nodal points coincide: the segment between them has no direction.
    #[error(
        "nodal points {first} and {second} coincide ({distance_mm:.3e} mm apart): a segment between them has no direction"
    )]
    CoincidentPoints {
        /// Index of the first nodal point.
        first: usize,
        /// Index of the second nodal point.
        second: usize,
        /// Their distance.
        distance_mm: f64,
    },
    /// The path reverses at a nodal point: left and right turn are equally good.
    #[error(
        "the path turns back on itself at nodal point {index} (by {turn_deg:.3}°): a C2 curve has no cusp, and whether to turn left or right is not given"
    )]
    Reversal {
        /// Index of the nodal point.
        index: usize,
        /// Turning angle \[deg\].
        turn_deg: f64,
    },
    /// The hodograph vanishes: the tool would have to stop and turn on the spot.
    #[error("segment {segment} has a cusp: the tangent vanishes at {xi:.4} of its parameter")]
    Cusp {
        /// Segment, between nodal points `segment` and `segment + 1`.
        segment: usize,
        /// Parameter on the segment.
        xi: f64,
    },
    /// An end tangent given by the user (or by the control polygon's end leg) is zero.
    #[error("the end tangent at the {end} of the path is zero")]
    ZeroEndTangent {
        /// "start" or "end".
        end: &'static str,
    },
    /// Newton's iteration did not converge.
    #[error(
        "no PH quintic spline found: after {iterations} Newton iterations segment {segment} still misses its nodal points by {residual_mm:.3e} mm"
    )]
    NoConvergence {
        /// Iterations done.
        iterations: usize,
        /// The segment with the largest residual.
        segment: usize,
        /// That residual as a chord error \[mm\].
        residual_mm: f64,
    },
    /// Newton converged to one of the other roots.
    #[error(
        "the spline found is not the wanted one: on segment {segment} it turns by {spline_deg:.1}° where the polygon turns by {polygon_deg:.1}°"
    )]
    WrongRoot {
        /// The segment where turning differs most.
        segment: usize,
        /// Turning of the spline \[deg\].
        spline_deg: f64,
        /// Turning of the polygon of nodal points \[deg\].
        polygon_deg: f64,
    },
    /// An angle is not a finite number of reasonable size.
    #[error("an angle of {value} rad is not a finite number within ±1e6 rad")]
    BadAngle {
        /// The angle.
        value: f64,
    },
    /// A radius or length is not a positive finite number.
    #[error("{what} of {value} mm is not a positive finite number")]
    NotPositive {
        /// What is meant, such as "radius".
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Every coordinate finite and within [`MAX_COORDINATE_MM`].
fn check_coordinates<const D: usize>(points: &[SVector<f64, D>]) -> Result<(), PathError> {
    for (index, point) in points.iter().enumerate() {
        for &value in point.iter() {
            if !(value.abs() <= MAX_COORDINATE_MM) {
                return Err(PathError::BadCoordinate { index, value });
            }
        }
    }
    Ok(())
}
