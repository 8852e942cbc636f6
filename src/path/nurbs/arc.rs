//! Circles and arcs as exact rational quadratics.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{SVector, Vector2};

use super::{NurbsCurve, NurbsError};
use crate::parameters::OutOfRange;
use crate::path::{MAX_COORDINATE_MM, MIN_SEGMENT_MM};

impl<const D: usize> NurbsCurve<D> {
    /// The arc `c + r (cos φ x + sin φ y)` for `φ` from `start_rad` on by `sweep_rad` (negative: from `y` towards `x`; at most a full
    /// turn), in the plane of the perpendicular unit vectors `x` and `y`.
    ///
    /// Rational quadratic pieces of at most a quarter turn, with the middle weights `cos(sweep / 2 pieces)`: exact.
    ///
    /// # Errors
    /// A radius that is not positive, angles that are not finite numbers in range, axes that are not perpendicular unit vectors.
    pub fn arc_in_plane(
        centre_mm: SVector<f64, D>,
        radius_mm: f64,
        [x, y]: [SVector<f64, D>; 2],
        start_rad: f64,
        sweep_rad: f64,
    ) -> Result<Self, NurbsError> {
        let bad = |what, value, needed| Err(NurbsError::BadArc(OutOfRange::new(what, value, needed)));
        if !(radius_mm > MIN_SEGMENT_MM && radius_mm <= MAX_COORDINATE_MM) {
            return bad("radius_mm", radius_mm, "above 1e-9, at most 1e6 mm");
        }
        if !(start_rad.abs() <= 1e6) {
            return bad("start_rad", start_rad, "within ±1e6");
        }
        // A full turn that was computed may be a rounding error more.
        let turns = sweep_rad.abs() / TAU;
        if !(turns > 1e-9 && turns <= 1.0 + 1e-12) {
            return bad("sweep_rad", sweep_rad, "not 0 and at most a full turn, 2π");
        }
        let skew = x.dot(&y).abs().max((x.norm() - 1.0).abs()).max((y.norm() - 1.0).abs());
        if !(skew <= 1e-9) {
            return bad("error of the plane's axes", skew, "at most 1e-9: they are perpendicular unit vectors");
        }
        let pieces = [1, 2, 3, 4].into_iter().find(|&n| sweep_rad.abs() <= f64::from(n) * FRAC_PI_2 * (1.0 + 1e-12));
        let pieces = pieces.unwrap_or(4);
        let half = sweep_rad / f64::from(2 * pieces);
        let middle = libm::cos(half);
        let full = turns >= 1.0 - 1e-12;
        let (mut points, mut weights, mut knots) = (Vec::new(), Vec::new(), vec![0.0; 3]);
        for i in 0..=2 * pieces {
            let (sin, cos) = libm::sincos(start_rad + half * f64::from(i));
            let even = i % 2 == 0;
            let reach = if even { radius_mm } else { radius_mm / middle };
            points.push(centre_mm + x * (reach * cos) + y * (reach * sin));
            weights.push(if even { 1.0 } else { middle });
            if even && i > 0 {
                let knot = f64::from(i) / f64::from(2 * pieces);
                knots.extend([knot, knot]);
            }
        }
        knots.push(1.0);
        // A full turn ends where it began, to the last bit.
        if let (true, [first, .., last]) = (full, points.as_mut_slice()) {
            *last = *first;
        }
        Self::new(2, knots, points, Some(weights))
    }
}

impl NurbsCurve<2> {
    /// The planar arc from angle `start_rad` (from the X axis) on by `sweep_rad`, counterclockwise where that is positive.
    ///
    /// # Errors
    /// As [`NurbsCurve::arc_in_plane`].
    pub fn arc(centre_mm: Vector2<f64>, radius_mm: f64, start_rad: f64, sweep_rad: f64) -> Result<Self, NurbsError> {
        Self::arc_in_plane(centre_mm, radius_mm, [Vector2::x(), Vector2::y()], start_rad, sweep_rad)
    }

    /// The full circle, counterclockwise from angle 0.
    ///
    /// # Errors
    /// As [`NurbsCurve::arc_in_plane`].
    pub fn circle(centre_mm: Vector2<f64>, radius_mm: f64) -> Result<Self, NurbsError> {
        Self::arc(centre_mm, radius_mm, 0.0, TAU)
    }
}
