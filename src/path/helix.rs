//! Arcs and helices in space.

use nalgebra::SVector;

use super::descent::descend;
use super::{Cursor, Foot, Frame, MAX_COORDINATE_MM, MIN_SEGMENT_MM, Path, PathError, check_coordinates};

/// Share of the radius up to which the radius' change makes the arc length a quadrature; above it the closed form does not cancel.
const NEARLY_ROUND: f64 = 1e-3;

/// An arc around an axis that is parallel to a coordinate axis. The angle `θ` runs from 0 to the sweep `Θ`, and with it, in
/// proportion, the height and (where the ends are not equally far from the axis) the radius:
///
/// ```text
/// r(θ) = C + ρ(θ) e(φ_0 ± θ) + (z_0 + c θ) n      ρ(θ) = ρ_0 + m θ
/// ```
///
/// with the centre `C` \[mm\], the unit vector `e` in the plane, the plane's normal `n`, `c` and `m` in mm/rad. The arc length,
/// `∫ √(ρ² + m² + c²) dθ`, is exact to rounding. It is an open path, a full turn too: it starts and ends there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Helix {
    start: SVector<f64, 3>,
    end: SVector<f64, 3>,
    centre: SVector<f64, 3>,
    /// First and second axis of the plane and the axis across.
    axes: [usize; 3],
    start_rad: f64,
    /// +1 counterclockwise, -1 clockwise.
    turn: f64,
    sweep: f64,
    radius: f64,
    /// `m` \[mm/rad\].
    radial: f64,
    /// `c` \[mm/rad\].
    climb: f64,
    length: f64,
}

impl Helix {
    /// The arc from `start_mm` to `end_mm` around `centre_mm`, through `sweep_rad` (above 0, at most 1e6).
    ///
    /// `axes` are the first and second axis of the plane and the axis across, as indices into a point (`[0, 1, 2]` is the plane XY,
    /// seen from +Z). The angle of the end is that of `start_mm` and the sweep: the angle of `end_mm` itself is not used, its
    /// distance from the axis and its height are.
    ///
    /// # Errors
    /// Coordinates out of range, a sweep that is no angle, a radius that is not positive, an arc without length.
    pub fn new(
        start_mm: SVector<f64, 3>,
        end_mm: SVector<f64, 3>,
        centre_mm: SVector<f64, 3>,
        axes: [usize; 3],
        sweep_rad: f64,
        clockwise: bool,
    ) -> Result<Self, PathError> {
        check_coordinates(&[start_mm, end_mm])?;
        if let Some(&value) = centre_mm.iter().find(|c| !(c.abs() <= 1e3 * MAX_COORDINATE_MM)) {
            return Err(PathError::BadCoordinate { index: 2, value });
        }
        if !(sweep_rad > 0.0 && sweep_rad <= 1e6) || axes.iter().any(|&axis| axis > 2) {
            return Err(PathError::BadAngle { value: sweep_rad });
        }
        let [a, b, n] = axes;
        let from_axis = |p: &SVector<f64, 3>| (p[a] - centre_mm[a], p[b] - centre_mm[b]);
        let ((x0, y0), (x1, y1)) = (from_axis(&start_mm), from_axis(&end_mm));
        let (radius, last) = (libm::hypot(x0, y0), libm::hypot(x1, y1));
        for value in [radius, last] {
            if !(value > MIN_SEGMENT_MM) {
                return Err(PathError::NotPositive { what: "radius", value });
            }
        }
        let mut helix = Self {
            start: start_mm,
            end: end_mm,
            centre: centre_mm,
            axes,
            start_rad: libm::atan2(y0, x0),
            turn: if clockwise { -1.0 } else { 1.0 },
            sweep: sweep_rad,
            radius,
            // A difference of rounding size is none.
            radial: if (last - radius).abs() <= 1e-12 * radius { 0.0 } else { (last - radius) / sweep_rad },
            climb: (end_mm[n] - start_mm[n]) / sweep_rad,
            length: 0.0,
        };
        helix.length = helix.length_to(sweep_rad);
        if !(helix.length > MIN_SEGMENT_MM && helix.length.is_finite()) {
            return Err(PathError::NotPositive { what: "length", value: helix.length });
        }
        Ok(helix)
    }

    /// Angle turned through \[rad\].
    pub fn sweep_rad(&self) -> f64 {
        self.sweep
    }

    /// Radius at the start \[mm\].
    pub fn radius_mm(&self) -> f64 {
        self.radius
    }

    /// Upper bound of `|k'|`, the third derivative with respect to arc length, between two arc lengths \[1/mm²\]: the jerk at a
    /// constant feed `v` is `v³ |k'|`. Of a helix it is `ρ/(ρ² + c²)^(3/2)`; where the radius changes it is largest at an end.
    pub fn curvature_rate_bound_1_mm2(&self, from_mm: f64, to_mm: f64) -> f64 {
        if self.radial == 0.0 {
            let square = self.radius * self.radius + self.climb * self.climb;
            return self.radius / (square * square.sqrt());
        }
        let mut cursor = Cursor::default();
        [from_mm, 0.5 * (from_mm + to_mm), to_mm]
            .map(|s| self.at(s, &mut cursor).curvature_rate_1_mm2.norm())
            .into_iter()
            .fold(0.0, f64::max)
    }

    fn speed(&self, theta: f64) -> f64 {
        let rho = self.radius + self.radial * theta;
        (rho * rho + self.radial * self.radial + self.climb * self.climb).sqrt()
    }

    /// Arc length from the start to an angle.
    fn length_to(&self, theta: f64) -> f64 {
        if self.radial == 0.0 {
            return self.speed(0.0) * theta;
        }
        let last = self.radius + self.radial * self.sweep;
        if (last - self.radius).abs() <= NEARLY_ROUND * self.radius.min(last) {
            // Four Gauss nodes: what is left out is the change of radius to the eighth power.
            const NODES: [(f64, f64); 2] = [
                (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
                (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
            ];
            let half = 0.5 * theta;
            return half
                * NODES
                    .iter()
                    .map(|(x, w)| w * (self.speed(half * (1.0 - x)) + self.speed(half * (1.0 + x))))
                    .sum::<f64>();
        }
        // ∫ √(ρ² + c²) dρ/m with c² = m² + climb².
        let c2 = self.radial * self.radial + self.climb * self.climb;
        let c = c2.sqrt();
        let whole = |rho: f64| 0.5 * (rho * (rho * rho + c2).sqrt() + c2 * libm::asinh(rho / c));
        (whole(self.radius + self.radial * theta) - whole(self.radius)) / self.radial
    }

    /// The angle at an arc length within the path.
    fn angle_at(&self, s: f64) -> f64 {
        let mut theta = s / self.length * self.sweep;
        if self.radial == 0.0 {
            return theta;
        }
        // Arc length rises with the angle at nearly the same rate everywhere, or at least smoothly and never slower than `m`.
        for _ in 0..60 {
            let step = (s - self.length_to(theta)) / self.speed(theta);
            theta = (theta + step).clamp(0.0, self.sweep);
            if step.abs() <= 1e-15 * self.sweep {
                break;
            }
        }
        theta
    }

    fn vector(&self, along: f64, beside: f64, across: f64) -> SVector<f64, 3> {
        let [a, b, n] = self.axes;
        let mut vector = SVector::zeros();
        (vector[a], vector[b], vector[n]) = (along, beside, across);
        vector
    }

    fn at(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<3> {
        // In this order a NaN becomes 0.
        let s_mm = s_mm.max(0.0).min(self.length);
        *cursor = Cursor::at(0, s_mm / self.length);
        let theta = self.angle_at(s_mm);
        let (sin, cos) = libm::sincos(self.start_rad + self.turn * theta);
        let (rho, m) = (self.radius + self.radial * theta, self.radial);
        // Components along e and along the unit vector of growing θ.
        let plane = |e: f64, g: f64, across: f64| {
            self.vector(e * cos - g * self.turn * sin, e * sin + g * self.turn * cos, across)
        };
        let [a, b, n] = self.axes;
        let mut point_mm =
            self.vector(self.centre[a] + rho * cos, self.centre[b] + rho * sin, self.start[n] + self.climb * theta);
        // The ends are met exactly.
        if s_mm <= 0.0 {
            point_mm = self.start;
        } else if s_mm >= self.length {
            point_mm = self.end;
        }
        let first = plane(m, rho, self.climb);
        let (second, third) = (plane(-rho, 2.0 * m, 0.0), plane(-3.0 * m, -rho, 0.0));
        Frame::of_derivatives(s_mm, point_mm, [first, second, third])
    }
}

impl Path<3> for Helix {
    fn length_mm(&self) -> f64 {
        self.length
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<3> {
        self.at(s_mm, cursor)
    }

    /// `√(ρ² + 4m²)/(ρ² + m² + c²)` with the larger radius above and the smaller one below.
    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        let (m, c) = (self.radial, self.climb);
        if m == 0.0 {
            return self.radius / (self.radius * self.radius + c * c);
        }
        let radius = |s: f64| self.radius + m * self.angle_at(s.max(0.0).min(self.length));
        let (from, to) = (radius(from_mm), radius(to_mm));
        let (low, high) = (from.min(to), from.max(to));
        (high * high + 4.0 * m * m).sqrt() / (low * low + m * m + c * c)
    }

    fn nearest_local(&self, point_mm: &SVector<f64, 3>, cursor: &mut Cursor) -> Foot<3> {
        // In this order a NaN becomes 0.
        let xi = cursor.expected().max(0.0).min(1.0);
        descend(self, point_mm, xi * self.length, cursor)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::path::nearest_in_window;

    fn random(rng: &mut Xoshiro256PlusPlus) -> Helix {
        let axes = [[0, 1, 2], [2, 0, 1], [1, 2, 0]][rng.random_range(0..3)];
        let [a, b, n] = axes;
        let centre = Vector3::from_fn(|_, _| rng.random_range(-50.0..50.0));
        let radius = 10.0_f64.powf(rng.random_range(-1.0..2.0));
        let change = if rng.random_range(0..3) == 0 { rng.random_range(-0.005..0.005) } else { 0.0 };
        let sweep = rng.random_range(0.01..TAU);
        let phi = rng.random_range(-PI..PI);
        let clockwise = rng.random_range(0..2) == 0;
        let end_phi = if clockwise { phi - sweep } else { phi + sweep };
        let (mut start, mut end) = (centre, centre);
        (start[a], start[b]) = (centre[a] + radius * phi.cos(), centre[b] + radius * phi.sin());
        (end[a], end[b]) =
            (centre[a] + (radius + change) * end_phi.cos(), centre[b] + (radius + change) * end_phi.sin());
        end[n] += rng.random_range(-5.0..5.0);
        Helix::new(start, end, centre, axes, sweep, clockwise).unwrap()
    }

    #[test]
    fn validates_length_of_a_helix_in_closed_form() {
        let start = Vector3::new(10.0, 0.0, 3.0);
        let end = Vector3::new(10.0, 0.0, 8.0);
        let helix = Helix::new(start, end, Vector3::zeros(), [0, 1, 2], TAU, false).unwrap();
        assert!((helix.length_mm() - (TAU * 10.0).hypot(5.0)).abs() < 1e-12);
        // 1/ρ of a circle, flattened by the climb.
        let climb = 5.0 / TAU;
        assert!((helix.max_curvature_1_mm() - 10.0 / (100.0 + climb * climb)).abs() < 1e-15);
    }

    #[test]
    fn validates_frames_against_differences_and_the_length_against_the_polygon() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(71);
        for case in 0..300 {
            let helix = random(&mut rng);
            let length = helix.length_mm();
            let mut cursor = Cursor::default();
            assert_eq!(helix.point_mm(0.0, &mut cursor), helix.start);
            assert_eq!(helix.point_mm(length, &mut cursor), helix.end);
            assert_eq!(helix.point_mm(f64::NAN, &mut cursor), helix.start);
            // Continuous at its ends too.
            let near = helix.point_mm(length * (1.0 - 1e-12), &mut cursor);
            assert!((near - helix.end).norm() < 1e-9, "case {case}: {helix:?}");
            let h = 1e-4 * length;
            for _ in 0..5 {
                let s = rng.random_range(2.0 * h..length - 2.0 * h);
                let [before, here, after] = [s - h, s, s + h].map(|s| helix.frame(s, &mut cursor));
                let slope = (after.point_mm - before.point_mm) / (2.0 * h);
                // Each derivative along s brings in another turn rate ω; differences are good to (ωh)².
                let (kappa, omega) = (here.curvature_1_mm.norm(), helix.sweep / length);
                let fine = (omega * h).powi(2);
                assert!((slope - here.tangent).norm() < kappa / omega * fine + 1e-12 / h, "case {case} s {s}");
                let bend = (after.tangent - before.tangent) / (2.0 * h);
                assert!((bend - here.curvature_1_mm).norm() < kappa * fine + 1e-13 / h, "case {case} s {s}");
                let rate = (after.curvature_1_mm - before.curvature_1_mm) / (2.0 * h);
                let error = (rate - here.curvature_rate_1_mm2).norm();
                assert!(error < kappa * omega * fine + 1e-12 * kappa / h, "case {case} s {s}: {error}");
                assert!(kappa <= helix.curvature_bound_1_mm(s - h, s + h) * (1.0 + 1e-12), "case {case} s {s}");
                let (size, bound) = (here.curvature_rate_1_mm2.norm(), helix.curvature_rate_bound_1_mm2(s - h, s + h));
                assert!(size <= bound * (1.0 + 1e-12) && bound <= 1.01 * size, "case {case} s {s}: {size} {bound}");
            }
        }
    }

    #[test]
    fn validates_nearest_points_against_a_dense_search() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(72);
        for case in 0..100 {
            let helix = random(&mut rng);
            let length = helix.length_mm();
            let mut cursor = Cursor::default();
            let s = rng.random_range(0.0..length);
            let point =
                helix.point_mm(s, &mut cursor) + Vector3::from_fn(|_, _| rng.random_range(-0.5..0.5)) * helix.radius;
            let found = nearest_in_window(&helix, &point, s, length, &mut cursor).distance_mm;
            let dense = (0..=2000)
                .map(|i| (helix.point_mm(length * f64::from(i) / 2000.0, &mut cursor) - point).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(found <= dense + 1e-9 && found >= dense - 1e-3 * length, "case {case}: {found} {dense}");
        }
    }

    #[test]
    fn bad_arcs_are_refused() {
        let (zero, x) = (Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0));
        let arc = |start, end, centre, sweep| Helix::new(start, end, centre, [0, 1, 2], sweep, false);
        assert!(matches!(arc(zero, x, zero, 1.0), Err(PathError::NotPositive { what: "radius", .. })));
        assert!(matches!(arc(x, x, zero, 0.0), Err(PathError::BadAngle { .. })));
        assert!(matches!(arc(x, x, zero, f64::NAN), Err(PathError::BadAngle { .. })));
        assert!(matches!(arc(x * f64::NAN, x, zero, 1.0), Err(PathError::BadCoordinate { .. })));
        assert!(matches!(arc(x, x, x * f64::INFINITY, 1.0), Err(PathError::BadCoordinate { .. })));
        assert!(matches!(arc(x, x, zero, 1e-9), Err(PathError::NotPositive { what: "length", .. })));
    }
}
