//! The contouring error: distance from the actual tool point to the desired path.
//!
//! Not to the setpoint: that distance is the tracking error. It is signed, positive to the left of the direction of travel
//! (seen from +Z), and found on the exact curve.

mod local;

use std::f64::consts::PI;

use nalgebra::SVector;

use crate::path::{Cursor, Foot, Path, nearest_in_window};

pub(crate) use local::Neighbourhood;

/// The contouring error at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourError<const D: usize> {
    /// Distance, positive to the left of the direction of travel \[mm\].
    pub signed_mm: f64,
    /// The nearest point of the path \[mm\].
    pub nearest_mm: SVector<f64, D>,
    /// Its arc length \[mm\].
    pub s_mm: f64,
}

impl<const D: usize> ContourError<D> {
    /// The error of the tool at `actual_mm` whose nearest point is `foot`, so far away.
    #[inline]
    pub(crate) fn of(actual_mm: &SVector<f64, D>, foot: &Foot<D>, distance_mm: f64) -> Self {
        let away = actual_mm - foot.point_mm;
        let left = if D >= 2 { foot.tangent[0] * away[1] - foot.tangent[1] * away[0] } else { away[0] };
        Self { signed_mm: distance_mm.copysign(left), nearest_mm: foot.point_mm, s_mm: foot.s_mm }
    }
}

/// Measures the contouring error sample by sample, each search starting from the previous nearest point.
///
/// **Which branch.** With `d` the tracking error, the setpoint itself is `d` away, so that the nearest point lies within
/// `2d` of the setpoint; on a branch that turns by no more than half a circle of that diameter it is within `π d` of arc
/// length. The measurement is the global nearest point in that reach around the setpoint: a path that crosses itself
/// is measured on the branch being cut, and a tool far off the path (a locked-up loop) against all the path that it could be near to.
/// The distance is exact to 1e-9 mm (see [`nearest_in_window`]); beyond the ends of an open path it is the distance to the end point.
#[derive(Clone)]
pub struct ContourMeter<'a, const D: usize> {
    path: &'a dyn Path<D>,
    cursor: Cursor,
}

impl<'a, const D: usize> ContourMeter<'a, D> {
    /// A meter that starts at the beginning of `path`.
    pub fn new(path: &'a dyn Path<D>) -> Self {
        Self { path, cursor: Cursor::default() }
    }

    /// The contouring error of the tool at `actual_mm` while the setpoint is `setpoint_mm`, at arc length `s_mm`.
    pub fn measure(
        &mut self,
        actual_mm: &SVector<f64, D>,
        setpoint_mm: &SVector<f64, D>,
        s_mm: f64,
    ) -> ContourError<D> {
        // The floor keeps the previous foot in reach where rounding alone separates tool and setpoint.
        let reach = PI * (actual_mm - setpoint_mm).norm() + 1e-6;
        let nearest = nearest_in_window(self.path, actual_mm, s_mm, reach, &mut self.cursor);
        ContourError::of(actual_mm, &nearest.foot, nearest.distance_mm)
    }
}
