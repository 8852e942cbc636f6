//! A full circle: the closed path whose every answer is known.

use std::f64::consts::{PI, TAU};

use nalgebra::{SVector, Vector2};

use super::{Cursor, Foot, Frame, GRAPH_ERROR_MM, Graph, MAX_COORDINATE_MM, Path, PathError, check_coordinates};

/// A full turn around a centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    centre: Vector2<f64>,
    radius: f64,
    start_rad: f64,
    /// +1 counterclockwise, -1 clockwise.
    turn: f64,
}

impl Circle {
    /// A turn around `centre_mm` that starts at angle `start_rad` (from the X axis, counterclockwise).
    ///
    /// # Errors
    /// A coordinate or angle that is not a finite number in range, or a radius that is not positive.
    pub fn new(centre_mm: Vector2<f64>, radius_mm: f64, start_rad: f64, clockwise: bool) -> Result<Self, PathError> {
        check_coordinates(&[centre_mm])?;
        if !(radius_mm > super::MIN_SEGMENT_MM && radius_mm <= MAX_COORDINATE_MM) {
            return Err(PathError::NotPositive { what: "radius", value: radius_mm });
        }
        if !(start_rad.abs() <= 1e6) {
            return Err(PathError::BadAngle { value: start_rad });
        }
        Ok(Self { centre: centre_mm, radius: radius_mm, start_rad, turn: if clockwise { -1.0 } else { 1.0 } })
    }

    fn at(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<2> {
        // In this order a NaN becomes 0.
        let s_mm = s_mm.max(0.0).min(self.length_mm());
        *cursor = Cursor::at(0, s_mm / self.length_mm());
        let (sin, cos) = libm::sincos(self.start_rad + self.turn * s_mm / self.radius);
        let out = Vector2::new(cos, sin);
        let tangent = Vector2::new(-sin, cos) * self.turn;
        Frame {
            s_mm,
            point_mm: self.centre + out * self.radius,
            tangent,
            curvature_1_mm: -out / self.radius,
            curvature_rate_1_mm2: -tangent / (self.radius * self.radius),
        }
    }
}

impl Path<2> for Circle {
    fn length_mm(&self) -> f64 {
        TAU * self.radius
    }

    fn is_closed(&self) -> bool {
        true
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<2> {
        self.at(s_mm, cursor)
    }

    fn curvature_bound_1_mm(&self, _from_mm: f64, _to_mm: f64) -> f64 {
        1.0 / self.radius
    }

    fn graph(&self, s_mm: f64, cursor: &mut Cursor) -> Option<Graph> {
        let frame = self.at(s_mm, cursor);
        // y = (1 - √(1 - (κx)²))/κ = κx²/2 + κ³x⁴/8 + κ⁵x⁶/16 + …, with less than the double of the last term behind it while
        // |κx| ≤ 1/2.
        let kappa = self.turn / self.radius;
        let reach = (0.5 * self.radius).min(self.radius * libm::pow(8.0 * GRAPH_ERROR_MM / self.radius, 1.0 / 6.0));
        Some(Graph {
            point_mm: frame.point_mm,
            tangent: frame.tangent,
            coefficients: [0.5 * kappa, 0.0, 0.125 * kappa * kappa * kappa, 0.0],
            from_mm: -reach,
            to_mm: reach,
        })
    }

    fn nearest_local(&self, point_mm: &SVector<f64, 2>, cursor: &mut Cursor) -> Foot<2> {
        let out = point_mm - self.centre;
        if out.x == 0.0 && out.y == 0.0 {
            // Every point is as near as every other: stay.
            return self.at(cursor.xi * self.length_mm(), cursor).into();
        }
        // The angle from the start of the turn, in [0, 2π).
        let (sin, cos) = libm::sincos(self.start_rad);
        let along = libm::atan2(self.turn * (cos * out.y - sin * out.x), cos * out.x + sin * out.y);
        let angle = if along < 0.0 { along + 2.0 * PI } else { along };
        self.at(self.radius * angle, cursor).into()
    }
}
