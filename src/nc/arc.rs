//! Arcs and helices.

use std::f64::consts::TAU;

use super::JOIN_TOLERANCE_MM;

/// In-plane distance of end and start up to which an arc given by its centre is a full circle \[mm\]: rounding noise.
const SAME_POINT_MM: f64 = 1e-6;

/// The plane that an arc lies in, seen from the positive side of the third axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Plane {
    /// X and Y (`G17`).
    #[default]
    Xy,
    /// Z and X (`G18`).
    Zx,
    /// Y and Z (`G19`).
    Yz,
}

impl Plane {
    /// First and second axis of the plane and the axis across, as indices into a point.
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// An arc from the start to the end of its block. The angle turns steadily; the axis across moves in proportion (a helix).
///
/// The end may lie up to [`JOIN_TOLERANCE_MM`] off the circle through the start (programs are rounded): the radius then
/// changes in proportion too, so that both points are met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// The plane.
    pub plane: Plane,
    /// Whether it turns clockwise (`G02`).
    pub clockwise: bool,
    /// The centre \[mm\]; its coordinate across the plane is the start's.
    pub centre_mm: [f64; 3],
}

/// Why an arc is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ArcFault {
    /// Start and centre coincide.
    NoRadius,
    /// The end is off the circle.
    OffCircle { start_radius_mm: f64, end_radius_mm: f64 },
    /// A radius and no way to go.
    SamePoint,
    /// The radius is less than half the way from start to end.
    TooSmall { radius_mm: f64, chord_mm: f64 },
}

impl Arc {
    /// Radius at the start of the arc \[mm\], given its start point.
    pub fn radius_mm(&self, start_mm: [f64; 3]) -> f64 {
        let [a, b] = self.seen_from_centre(start_mm);
        libm::hypot(a, b)
    }

    /// Angle that the arc turns through \[rad\], above 0 to one turn, given its ends. A full circle ends where it starts.
    pub fn sweep_rad(&self, start_mm: [f64; 3], end_mm: [f64; 3]) -> f64 {
        let (from, to) = (self.seen_from_centre(start_mm), self.seen_from_centre(end_mm));
        if libm::hypot(to[0] - from[0], to[1] - from[1]) <= SAME_POINT_MM {
            return TAU;
        }
        let counterclockwise = libm::atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
        let sweep = if self.clockwise { -counterclockwise } else { counterclockwise };
        if sweep > 0.0 { sweep } else { sweep + TAU }
    }

    /// In-plane components of a point as seen from the centre \[mm\].
    pub(super) fn seen_from_centre(&self, point_mm: [f64; 3]) -> [f64; 2] {
        let [a, b, _] = self.plane.axes();
        [point_mm[a] - self.centre_mm[a], point_mm[b] - self.centre_mm[b]]
    }

    /// Whether both ends lie on it.
    pub(super) fn check(&self, start_mm: [f64; 3], end_mm: [f64; 3]) -> Result<(), ArcFault> {
        let (start_radius_mm, end_radius_mm) = (self.radius_mm(start_mm), self.radius_mm(end_mm));
        if !(start_radius_mm > SAME_POINT_MM) {
            return Err(ArcFault::NoRadius);
        }
        if !((end_radius_mm - start_radius_mm).abs() <= JOIN_TOLERANCE_MM) {
            return Err(ArcFault::OffCircle { start_radius_mm, end_radius_mm });
        }
        Ok(())
    }

    /// The arc around a centre that is given from the start point.
    pub(super) fn around(
        plane: Plane,
        clockwise: bool,
        start_mm: [f64; 3],
        end_mm: [f64; 3],
        offset_mm: [f64; 3],
    ) -> Result<Self, ArcFault> {
        let mut centre_mm = start_mm;
        for &axis in &plane.axes()[..2] {
            centre_mm[axis] += offset_mm[axis];
        }
        let arc = Self { plane, clockwise, centre_mm };
        arc.check(start_mm, end_mm)?;
        Ok(arc)
    }

    /// The arc of a radius: the shorter one where it is positive, the longer one where it is negative.
    ///
    /// With the half chord `c` the centre lies `√(r² - c²)` beside the middle, on the left of the way from start to end for
    /// the shorter counterclockwise and the longer clockwise arc.
    pub(super) fn of_radius(
        plane: Plane,
        clockwise: bool,
        start_mm: [f64; 3],
        end_mm: [f64; 3],
        radius_mm: f64,
    ) -> Result<Self, ArcFault> {
        let [a, b, _] = plane.axes();
        let (da, db) = (end_mm[a] - start_mm[a], end_mm[b] - start_mm[b]);
        let chord_mm = libm::hypot(da, db);
        if !(chord_mm > SAME_POINT_MM) {
            return Err(ArcFault::SamePoint);
        }
        let (radius, half) = (radius_mm.abs(), 0.5 * chord_mm);
        if !(half <= radius + 0.5 * JOIN_TOLERANCE_MM) {
            return Err(ArcFault::TooSmall { radius_mm: radius, chord_mm });
        }
        let beside = ((radius - half) * (radius + half)).max(0.0).sqrt();
        let left = if clockwise == (radius_mm > 0.0) { -1.0 } else { 1.0 };
        let mut centre_mm = start_mm;
        centre_mm[a] += 0.5 * da - left * beside * db / chord_mm;
        centre_mm[b] += 0.5 * db + left * beside * da / chord_mm;
        let arc = Self { plane, clockwise, centre_mm };
        arc.check(start_mm, end_mm)?;
        Ok(arc)
    }
}

/// Distance of two points \[mm\].
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::hypot(libm::hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2])
}
