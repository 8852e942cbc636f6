//! A circle, several times around.

use std::f64::consts::TAU;

use nalgebra::{SVector, Vector2};

use crate::path::{Circle, Cursor, Foot, Frame, Path, PathError};

/// Some turns of a circle as one open path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turns {
    circle: Circle,
    once_mm: f64,
    length_mm: f64,
}

impl Turns {
    pub(super) fn new(
        centre_mm: [f64; 2],
        radius_mm: f64,
        start_rad: f64,
        clockwise: bool,
        turns: f64,
    ) -> Result<Self, PathError> {
        let circle = Circle::new(Vector2::from(centre_mm), radius_mm, start_rad, clockwise)?;
        let once_mm = TAU * radius_mm;
        Ok(Self { circle, once_mm, length_mm: turns * once_mm })
    }

    /// The frame of the circle as one of this path.
    fn on(&self, s_mm: f64, frame: Frame<2>, cursor: &mut Cursor) -> Frame<2> {
        *cursor = Cursor::at(0, s_mm / self.length_mm);
        Frame { s_mm, ..frame }
    }
}

impl Path<2> for Turns {
    fn length_mm(&self) -> f64 {
        self.length_mm
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<2> {
        // In this order a NaN becomes 0.
        let s_mm = s_mm.max(0.0).min(self.length_mm);
        let frame = self.circle.frame(s_mm % self.once_mm, &mut Cursor::default());
        self.on(s_mm, frame, cursor)
    }

    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        self.circle.curvature_bound_1_mm(from_mm, to_mm)
    }

    fn nearest_local(&self, point_mm: &SVector<f64, 2>, cursor: &mut Cursor) -> Foot<2> {
        let here_mm = cursor.xi.max(0.0).min(1.0) * self.length_mm;
        let mut once = Cursor::at(0, (here_mm / self.once_mm).fract());
        let foot = self.circle.nearest_local(point_mm, &mut once);
        // Of all turns, the nearest one.
        let turn = ((here_mm - foot.s_mm) / self.once_mm).round();
        let s_mm = foot.s_mm + turn * self.once_mm;
        self.frame(s_mm, cursor).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_turn_is_the_circle_and_feet_stay_on_their_turn() {
        for clockwise in [false, true] {
            let path = Turns::new([3.0, -2.0], 5.0, 0.7, clockwise, 3.25).unwrap();
            let mut cursor = Cursor::default();
            let mut feet = Cursor::default();
            for k in 0..=1000 {
                let s_mm = path.length_mm() * f64::from(k) / 1000.0;
                let frame = path.frame(s_mm, &mut cursor);
                let angle = 0.7 + s_mm / 5.0 * if clockwise { -1.0 } else { 1.0 };
                let point = Vector2::new(3.0 + 5.0 * angle.cos(), -2.0 + 5.0 * angle.sin());
                assert!((frame.point_mm - point).norm() < 1e-12);
                let beside = point + (point - Vector2::new(3.0, -2.0)) * 0.01;
                let foot = path.nearest_local(&beside, &mut feet);
                assert!((foot.s_mm - s_mm).abs() < 1e-9 && (foot.point_mm - point).norm() < 1e-9, "{s_mm} {foot:?}");
            }
        }
    }
}
