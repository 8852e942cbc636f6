//! A straight line: the path whose every answer is known.

use nalgebra::{SVector, Vector2};

use super::{Cursor, Foot, Frame, Graph, Path, PathError, check_coordinates};

/// The straight line between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line<const D: usize> {
    start: SVector<f64, D>,
    end: SVector<f64, D>,
    tangent: SVector<f64, D>,
    length: f64,
}

impl<const D: usize> Line<D> {
    /// From `start_mm` to `end_mm`.
    ///
    /// # Errors
    /// A coordinate that is not a finite number in range, or two points that coincide.
    pub fn new(start_mm: SVector<f64, D>, end_mm: SVector<f64, D>) -> Result<Self, PathError> {
        check_coordinates(&[start_mm, end_mm])?;
        let length = (end_mm - start_mm).norm();
        if length <= super::MIN_SEGMENT_MM {
            return Err(PathError::CoincidentPoints { first: 0, second: 1, distance_mm: length });
        }
        Ok(Self { start: start_mm, end: end_mm, tangent: (end_mm - start_mm) / length, length })
    }

    fn at(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D> {
        // In this order a NaN becomes 0.
        let s_mm = s_mm.max(0.0).min(self.length);
        *cursor = Cursor::at(0, s_mm / self.length);
        // Counted from the nearer end, so that the line ends exactly on its last point.
        let point_mm = if cursor.xi < 0.5 {
            self.start + self.tangent * s_mm
        } else {
            self.end - self.tangent * (self.length - s_mm)
        };
        Frame {
            s_mm,
            point_mm,
            tangent: self.tangent,
            curvature_1_mm: SVector::zeros(),
            curvature_rate_1_mm2: SVector::zeros(),
        }
    }
}

impl<const D: usize> Path<D> for Line<D> {
    fn length_mm(&self) -> f64 {
        self.length
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<D> {
        self.at(s_mm, cursor)
    }

    fn curvature_bound_1_mm(&self, _from_mm: f64, _to_mm: f64) -> f64 {
        0.0
    }

    fn graph(&self, s_mm: f64, cursor: &mut Cursor) -> Option<Graph> {
        let frame = self.at(s_mm, cursor);
        let ([x, y], [tx, ty]) = (
            <[f64; 2]>::try_from(frame.point_mm.as_slice()).ok()?,
            <[f64; 2]>::try_from(self.tangent.as_slice()).ok()?,
        );
        Some(Graph {
            point_mm: Vector2::new(x, y),
            tangent: Vector2::new(tx, ty),
            coefficients: [0.0; 4],
            from_mm: -frame.s_mm,
            to_mm: self.length - frame.s_mm,
        })
    }

    fn nearest_local(&self, point_mm: &SVector<f64, D>, cursor: &mut Cursor) -> Foot<D> {
        self.at((point_mm - self.start).dot(&self.tangent), cursor).into()
    }
}
