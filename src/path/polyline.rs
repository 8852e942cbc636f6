//! Straight lines from point to point, with exact corners.

use nalgebra::SVector;

use super::descent::descend;
use super::{Cursor, Foot, Frame, MAX_POINTS, MIN_SEGMENT_MM, Path, PathError, check_coordinates};

/// A turn of the direction from which on a point is a corner \[rad\].
const CORNER_RAD: f64 = 1e-8;

/// Straight lines from point to point. The corners are exact: the curvature is 0 between them and infinite on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline<const D: usize> {
    points: Vec<SVector<f64, D>>,
    tangents: Vec<SVector<f64, D>>,
    nodes_mm: Vec<f64>,
    corners_mm: Vec<f64>,
    closed: bool,
}

impl<const D: usize> Polyline<D> {
    /// The lines between `points_mm`, at least 2. Where the last is the first the path is closed.
    ///
    /// # Errors
    /// Too few or too many points, coordinates that are not finite numbers in range, neighbours that coincide.
    pub fn new(points_mm: Vec<SVector<f64, D>>) -> Result<Self, PathError> {
        let (what, given) = ("points", points_mm.len());
        if given < 2 {
            return Err(PathError::TooFewPoints { what, given, needed: 2 });
        }
        if given > MAX_POINTS {
            return Err(PathError::TooManyPoints { what, given });
        }
        check_coordinates(&points_mm)?;
        let closed = points_mm[0] == points_mm[given - 1];
        let (mut tangents, mut nodes_mm, mut corners_mm) = (Vec::with_capacity(given - 1), vec![0.0], Vec::new());
        let mut length = 0.0;
        for (first, pair) in points_mm.windows(2).enumerate() {
            let leg = pair[1] - pair[0];
            let distance_mm = leg.norm();
            if distance_mm <= MIN_SEGMENT_MM {
                return Err(PathError::CoincidentPoints { first, second: first + 1, distance_mm });
            }
            let tangent = leg / distance_mm;
            if tangents.last().is_some_and(|before: &SVector<f64, D>| (tangent - before).norm() > CORNER_RAD) {
                corners_mm.push(length);
            }
            tangents.push(tangent);
            length += distance_mm;
            nodes_mm.push(length);
        }
        if closed && (tangents[0] - tangents[given - 2]).norm() > CORNER_RAD {
            corners_mm.push(length);
        }
        Ok(Self { points: points_mm, tangents, nodes_mm, corners_mm, closed })
    }

    /// The points \[mm\].
    pub fn points_mm(&self) -> &[SVector<f64, D>] {
        &self.points
    }

    /// Arc lengths at the points \[mm\].
    pub fn lengths_at_points_mm(&self) -> &[f64] {
        &self.nodes_mm
    }

    /// Arc lengths of the corners \[mm\]; a corner at the seam of a closed path stands at its length.
    pub fn corners_mm(&self) -> &[f64] {
        &self.corners_mm
    }
}

impl<const D: usize> Path<D> for Polyline<D> {
    fn length_mm(&self) -> f64 {
        self.nodes_mm[self.tangents.len()]
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D> {
        let last = self.tangents.len() - 1;
        // NaN goes to the start.
        let s_mm = if s_mm > 0.0 { s_mm.min(self.nodes_mm[last + 1]) } else { 0.0 };
        let holds = |i: usize| s_mm >= self.nodes_mm[i] && (s_mm < self.nodes_mm[i + 1] || i == last);
        let mut i = cursor.segment.min(last);
        if !holds(i) {
            i = if i < last && holds(i + 1) {
                i + 1
            } else {
                self.nodes_mm[1..=last].partition_point(|&node| node <= s_mm)
            };
        }
        let (from, to) = (self.nodes_mm[i], self.nodes_mm[i + 1]);
        let xi = (s_mm - from) / (to - from);
        cursor.found(i, xi);
        // From the nearer end: both are met exactly.
        let point_mm = if xi < 0.5 {
            self.points[i] + self.tangents[i] * (s_mm - from)
        } else {
            self.points[i + 1] - self.tangents[i] * (to - s_mm)
        };
        Frame {
            s_mm,
            point_mm,
            tangent: self.tangents[i],
            curvature_1_mm: SVector::zeros(),
            curvature_rate_1_mm2: SVector::zeros(),
        }
    }

    /// A corner is counted with the stretch that ends on it.
    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        let next = self.corners_mm.partition_point(|&corner| corner <= from_mm);
        if self.corners_mm.get(next).is_some_and(|&corner| corner <= to_mm) { f64::INFINITY } else { 0.0 }
    }

    fn nearest_local(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D> {
        let i = cursor.segment.min(self.tangents.len() - 1);
        // In this order a NaN becomes 0.
        let xi = cursor.expected().max(0.0).min(1.0);
        descend(self, point_mm, self.nodes_mm[i] + xi * (self.nodes_mm[i + 1] - self.nodes_mm[i]), cursor)
    }
}
