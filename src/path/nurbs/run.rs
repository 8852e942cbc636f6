//! A NURBS curve as a path: arc length, curvature bounds, nearest points.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::SVector;

use super::NurbsCurve;
use super::bezier::{Bezier, OwnBezier, Shape};
use super::length::Speed;
use crate::path::descent::descend;
use crate::path::range_maximum::RangeMaximum;
use crate::path::{Cursor, Foot, Frame, MIN_SEGMENT_MM, Path, PathError};

/// What the arc length is exact to, relative to the piece that it is measured on.
pub const LENGTH_TOLERANCE: f64 = 1e-12;

/// Halvings of a Bezier piece before it is taken as it is.
const MOST_HALVINGS: u32 = 26;

/// The largest curvature is exact to this, relative.
const CURVATURE_TOLERANCE: f64 = 1e-10;

/// Halvings spent on it over the whole path; after them it is an upper bound that is a little less sharp.
const MOST_REFINEMENTS: usize = 20_000;

/// A turn of the tangent at a joint from which on it is a corner \[rad\].
const CORNER_RAD: f64 = 1e-8;

/// A difference of curvatures at a joint that is none: this share of the larger one and this much beside it \[1/mm\].
const SAME_CURVATURE: (f64, f64) = (1e-6, 1e-7);

/// By how much the third derivative of a part may pass its largest value at the places looked at.
const RATE_MARGIN: f64 = 0.02;

/// Ends as near as this close a path \[mm\].
const CLOSED_MM: f64 = 1e-9;

/// A NURBS curve that knows its arc length: a path like any other.
///
/// The curve's Bezier pieces are halved until the speed `|r'|` on each part is a series of ten Legendre polynomials to within
/// [`LENGTH_TOLERANCE`] (the Gauss nodes of the part are what it is interpolated at, so that its length is that of 10-point Gauss
/// quadrature), and until its proven bound of curvature is near its curvature. `s → u` is then a search in the table of parts and
/// Newton's iteration on one of them. A knot as often repeated as the degree may hold a corner: the curvature bound
/// of a stretch with a corner inside is infinite.
///
/// The time to make one grows linearly with the number of control points.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsPath<const D: usize> {
    curve: NurbsCurve<D>,
    /// Control points of the parts, `degree + 1` each, and their weights.
    points: Vec<SVector<f64, D>>,
    weights: Option<Vec<f64>>,
    speeds: Vec<Speed>,
    /// Arc length \[mm\] and the curve's parameter at the ends of the parts, from the start on.
    nodes_mm: Vec<f64>,
    nodes_u: Vec<f64>,
    curvature: RangeMaximum,
    curvature_rate: RangeMaximum,
    max_curvature: f64,
    /// Arc lengths of the corners \[mm\].
    corners_mm: Vec<f64>,
    /// Arc lengths inside where the curvature jumps, those of corners among them \[mm\].
    curvature_jumps_mm: Vec<f64>,
    closed: bool,
}

/// The path with its seam left open.
struct Open<'a, const D: usize>(&'a NurbsPath<D>);

impl<const D: usize> Path<D> for Open<'_, D> {
    fn length_mm(&self) -> f64 {
        self.0.length_mm()
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D> {
        self.0.frame(s_mm, cursor)
    }

    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        self.0.curvature_bound_1_mm(from_mm, to_mm)
    }

    fn nearest_local(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D> {
        let part = cursor.segment.min(self.0.speeds.len() - 1);
        // In this order a NaN becomes 0.
        let xi = cursor.expected().max(0.0).min(1.0);
        descend(self, point_mm, self.0.nodes_mm[part] + self.0.speeds[part].at(xi).0, cursor)
    }
}

/// A part of the curve while the table is made.
struct Part<const D: usize> {
    bezier: OwnBezier<D>,
    shape: Shape<D>,
    from: f64,
    to: f64,
    halvings: u32,
}

impl<const D: usize> NurbsPath<D> {
    /// The path along `curve`. It is closed where its ends coincide.
    ///
    /// # Errors
    /// A curve without length, or one that stands still ([`PathError::Cusp`], the segment counted in Bezier pieces): control
    /// points that coincide at an end make such a curve.
    pub fn new(curve: NurbsCurve<D>) -> Result<Self, PathError> {
        let (low, high) = curve.domain();
        let closed = (curve.point_mm(low) - curve.point_mm(high)).norm() <= CLOSED_MM;
        let mut path = Self {
            points: Vec::new(),
            weights: curve.weights().map(|_| Vec::new()),
            speeds: Vec::new(),
            nodes_mm: vec![0.0],
            nodes_u: vec![low],
            curvature: RangeMaximum::new([0.0].into_iter()),
            curvature_rate: RangeMaximum::new([0.0].into_iter()),
            max_curvature: 0.0,
            corners_mm: Vec::new(),
            curvature_jumps_mm: Vec::new(),
            closed,
            curve,
        };
        let mut bounds = Vec::new();
        let mut end: Option<Frame<D>> = None;
        for (segment, piece) in path.curve.clone().bezier_pieces().enumerate() {
            let bezier = OwnBezier { points: piece.control_points_mm, weights: piece.weights };
            let first = path.speeds.len();
            let shape = Shape::new(&bezier.view());
            path.divide(Part { bezier, shape, from: piece.from, to: piece.to, halvings: 0 }, segment, &mut bounds)?;
            if let Some(before) = end {
                let (after, s_mm) = (path.frame_of(first, 0.0), path.nodes_mm[first]);
                let corner = turn(&before.tangent, &after.tangent) > CORNER_RAD;
                if corner {
                    path.corners_mm.push(s_mm);
                }
                if corner || curvature_jumps(&before.curvature_1_mm, &after.curvature_1_mm) {
                    path.curvature_jumps_mm.push(s_mm);
                }
            }
            end = Some(path.frame_of(path.speeds.len() - 1, 1.0));
        }
        let length = path.length_mm();
        if !(length > MIN_SEGMENT_MM && length.is_finite()) {
            return Err(PathError::NotPositive { what: "length", value: length });
        }
        if let Some(before) = end
            && closed
            && turn(&before.tangent, &path.frame_of(0, 0.0).tangent) > CORNER_RAD
        {
            path.corners_mm.push(length);
        }
        path.curvature = RangeMaximum::new(bounds.into_iter());
        path.curvature_rate = RangeMaximum::new((0..path.speeds.len()).map(|part| path.curvature_rate_of(part)));
        path.max_curvature = path.find_max_curvature();
        Ok(path)
    }

    /// Puts a Bezier piece into the table, in as many parts as it needs.
    fn divide(&mut self, whole: Part<D>, segment: usize, bounds: &mut Vec<f64>) -> Result<(), PathError> {
        let span = (whole.from, whole.to);
        let mut stack = vec![whole];
        while let Some(part) = stack.pop() {
            let view = part.bezier.view();
            let bound = part.shape.curvature_bound();
            let speed = Speed::new(|xi| view.derivatives::<2>(xi)[1].norm());
            let here = [0.0, 0.5, 1.0].map(|xi| view.curvature(xi)).into_iter().fold(0.0, f64::max);
            // A bound well above the curvature does no harm where the part hardly turns.
            let sharp = bound <= 1.2 * here || bound * speed.length() <= 0.02;
            let last = part.halvings == MOST_HALVINGS;
            if last && !bound.is_finite() {
                let xi = (0.5 * (part.from + part.to) - span.0) / (span.1 - span.0);
                return Err(PathError::Cusp { segment, xi });
            }
            if last || sharp && speed.rest() <= LENGTH_TOLERANCE {
                self.nodes_mm.push(self.length_mm() + speed.length());
                self.nodes_u.push(part.to);
                self.speeds.push(speed);
                bounds.push(bound);
                self.points.extend(part.bezier.points);
                if let (Some(all), Some(own)) = (&mut self.weights, part.bezier.weights) {
                    all.extend(own);
                }
                continue;
            }
            let middle = 0.5 * (part.from + part.to);
            let halvings = part.halvings + 1;
            let (left, right) = part.bezier.halves();
            let shapes = part.shape.halves();
            stack.push(Part { bezier: right, shape: shapes.1, from: middle, to: part.to, halvings });
            stack.push(Part { bezier: left, shape: shapes.0, from: part.from, to: middle, halvings });
        }
        Ok(())
    }

    /// The curve that the path runs along.
    pub fn curve(&self) -> &NurbsCurve<D> {
        &self.curve
    }

    /// Arc lengths of the path's corners \[mm\]; a corner at the seam of a closed path stands at its length.
    pub fn corners_mm(&self) -> &[f64] {
        &self.corners_mm
    }

    /// Arc lengths inside the path where its curvature jumps \[mm\]: corners, and knots repeated so often that the curve is only C1
    /// there.
    pub fn curvature_jumps_mm(&self) -> &[f64] {
        &self.curvature_jumps_mm
    }

    /// Upper bound of `|k'|`, the third derivative with respect to arc length, between two arc lengths \[1/mm²\]: the jerk at a
    /// constant feed `v` is `v³ |k'|`. It is taken at five places of every part of the table, with a margin for what lies between
    /// them.
    pub fn curvature_rate_bound_1_mm2(&self, from_mm: f64, to_mm: f64) -> f64 {
        let (first, end) = self.parts_between(from_mm, to_mm);
        self.curvature_rate.of(first, end)
    }

    /// The first and the last part that an arc length of a range lies on.
    fn parts_between(&self, from_mm: f64, to_mm: f64) -> (usize, usize) {
        let last = self.speeds.len() - 1;
        let inner = &self.nodes_mm[1..=last];
        let first = inner.partition_point(|&node| node < from_mm);
        let end = inner.partition_point(|&node| node <= to_mm);
        (first, end.max(first))
    }

    /// As [`Path::nearest_local`], but a closed path too stops at its ends: where it is one block of a program that goes on.
    pub fn nearest_local_open(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D> {
        Open(self).nearest_local(point_mm, cursor)
    }

    /// The curve's parameter at arc length `s_mm`, clamped to the path.
    pub fn parameter(&self, s_mm: f64, cursor: &mut Cursor) -> f64 {
        self.seek(s_mm, cursor);
        let i = cursor.segment;
        self.nodes_u[i] + cursor.xi * (self.nodes_u[i + 1] - self.nodes_u[i])
    }

    /// Arc length at the curve's parameter `u` \[mm\], clamped to the domain.
    pub fn length_at_mm(&self, u: f64) -> f64 {
        let last = self.speeds.len() - 1;
        let i = self.nodes_u[1..=last].partition_point(|&node| node <= u);
        let xi = (u - self.nodes_u[i]) / (self.nodes_u[i + 1] - self.nodes_u[i]);
        self.nodes_mm[i] + self.speeds[i].at(xi.max(0.0).min(1.0)).0
    }

    #[inline]
    fn part(&self, i: usize) -> Bezier<'_, D> {
        let size = self.curve.degree() + 1;
        let range = i * size..(i + 1) * size;
        Bezier { points: &self.points[range.clone()], weights: self.weights.as_ref().map(|w| &w[range]) }
    }

    /// Without the arc length.
    fn frame_of(&self, part: usize, xi: f64) -> Frame<D> {
        let [point_mm, r1, r2, r3] = self.part(part).derivatives::<4>(xi);
        Frame::of_derivatives(0.0, point_mm, [r1, r2, r3])
    }

    /// The largest `|k'|` of a part: it is short, so that a few places tell.
    fn curvature_rate_of(&self, part: usize) -> f64 {
        let places = [0.0, 0.25, 0.5, 0.75, 1.0].map(|xi| self.frame_of(part, xi).curvature_rate_1_mm2.norm());
        (1.0 + RATE_MARGIN) * places.into_iter().fold(0.0, f64::max)
    }

    /// Moves the cursor to arc length `s_mm` (clamped to the path); returns it clamped.
    #[inline]
    fn seek(&self, s_mm: f64, cursor: &mut Cursor) -> f64 {
        let last = self.speeds.len() - 1;
        // NaN goes to the start.
        let s = if s_mm > 0.0 { s_mm.min(self.nodes_mm[last + 1]) } else { 0.0 };
        let mut part = cursor.segment.min(last);
        let holds = |i: usize| s >= self.nodes_mm[i] && (s < self.nodes_mm[i + 1] || i == last);
        let mut guess = cursor.expected();
        if !holds(part) {
            part = if part < last && holds(part + 1) {
                part + 1
            } else {
                self.nodes_mm[1..=last].partition_point(|&node| node <= s)
            };
            guess = (s - self.nodes_mm[part]) / (self.nodes_mm[part + 1] - self.nodes_mm[part]);
        }
        let xi = self.speeds[part].solve(s - self.nodes_mm[part], guess);
        cursor.found(part, xi);
        s
    }

    /// Branch and bound, the part with the highest bound first.
    fn find_max_curvature(&self) -> f64 {
        if !self.corners_mm.is_empty() {
            return f64::INFINITY;
        }
        let mut best = 0.0_f64;
        let mut heap = BinaryHeap::new();
        for piece in self.curve.bezier_pieces() {
            let own = Bezier { points: &piece.control_points_mm, weights: piece.weights.as_deref() };
            let shape = Shape::new(&own);
            best = best.max(shape.curvature()).max(own.curvature(1.0));
            heap.push(Bounded { bound: shape.curvature_bound(), shape });
        }
        for _ in 0..MOST_REFINEMENTS {
            let Some(top) = heap.pop() else { break };
            // What is left of a straight path is rounding.
            if top.bound <= best * (1.0 + CURVATURE_TOLERANCE) || top.bound * self.length_mm() <= 1e-12 {
                return top.bound.max(best);
            }
            let (left, right) = top.shape.halves();
            best = best.max(right.curvature());
            for shape in [left, right] {
                heap.push(Bounded { bound: shape.curvature_bound(), shape });
            }
        }
        heap.peek().map_or(best, |top| top.bound.max(best))
    }
}

struct Bounded<const D: usize> {
    bound: f64,
    shape: Shape<D>,
}

impl<const D: usize> PartialEq for Bounded<D> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const D: usize> Eq for Bounded<D> {}

impl<const D: usize> PartialOrd for Bounded<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const D: usize> Ord for Bounded<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// The angle between two unit vectors, exact for small ones.
fn turn<const D: usize>(before: &SVector<f64, D>, after: &SVector<f64, D>) -> f64 {
    2.0 * libm::asin((0.5 * (after - before).norm()).min(1.0))
}

fn curvature_jumps<const D: usize>(before: &SVector<f64, D>, after: &SVector<f64, D>) -> bool {
    let (share, least) = SAME_CURVATURE;
    (after - before).norm() > share * before.norm().max(after.norm()) + least
}

impl<const D: usize> Path<D> for NurbsPath<D> {
    fn length_mm(&self) -> f64 {
        self.nodes_mm[self.speeds.len()]
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D> {
        let s_mm = self.seek(s_mm, cursor);
        let [point_mm, r1, r2, r3] = self.part(cursor.segment).derivatives::<4>(cursor.xi);
        Frame::of_derivatives(s_mm, point_mm, [r1, r2, r3])
    }

    fn point_mm(&self, s_mm: f64, cursor: &mut Cursor) -> SVector<f64, D> {
        self.seek(s_mm, cursor);
        self.part(cursor.segment).derivatives::<1>(cursor.xi)[0]
    }

    /// A corner is counted with the stretch that ends on it.
    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        let next = self.corners_mm.partition_point(|&corner| corner <= from_mm);
        if self.corners_mm.get(next).is_some_and(|&corner| corner <= to_mm) {
            return f64::INFINITY;
        }
        let (first, end) = self.parts_between(from_mm, to_mm);
        self.curvature.of(first, end).min(self.max_curvature)
    }

    fn max_curvature_1_mm(&self) -> f64 {
        self.max_curvature
    }

    fn nearest_local(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D> {
        let part = cursor.segment.min(self.speeds.len() - 1);
        // In this order a NaN becomes 0.
        let xi = cursor.expected().max(0.0).min(1.0);
        descend(self, point_mm, self.nodes_mm[part] + self.speeds[part].at(xi).0, cursor)
    }
}
