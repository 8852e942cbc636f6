//! The C2 Pythagorean-hodograph quintic spline.

use nalgebra::{SVector, Vector2};

use super::bspline::{Ends, NodalPoints};
use super::ph_segment::{Point, Segment, complex};
use super::range_maximum::RangeMaximum;
use super::{Cursor, Foot, Frame, Graph, Path, PathError, ph_solver};

/// A planar spline with continuous position, first and second derivative, whose arc length is a polynomial.
///
/// Segment `i = 1 … M` has the hodograph `r_i'(ξ) = w_i(ξ)²`, `ξ ∈ [0, 1]`, with the quadratic
///
/// ```text
/// w_i(ξ) = ½(z_{i-1} + z_i)(1-ξ)² + 2 z_i (1-ξ)ξ + ½(z_i + z_{i+1}) ξ²
/// ```
///
/// so that the parametric speed `σ = |w|²` and the arc length `s(ξ) = ∫σ` are polynomials: no quadrature, no table.
/// The unit tangent is `w²/σ`, the curvature `2 Im(w* w')/σ²`.
///
/// Source: Jahanpour, Dolatabadi, Vahedian Azimi, "Jerk limited machining using C2 Pythagorean-hodograph quintic spline
/// curves", sections 2 and 3 (after Farouki).
///
/// ```
/// use nalgebra::Vector2;
/// use servosim::path::{Path, PhSpline};
///
/// let control = [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(Vector2::from);
/// let alpha = PhSpline::from_control_points(&control, false)?;
/// assert!((alpha.length_mm() - 99.941551).abs() < 1e-6);
/// # Ok::<(), servosim::path::PathError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PhSpline {
    nodal: Vec<Vector2<f64>>,
    preimage: Vec<Point>,
    segments: Vec<Segment>,
    /// Arc length at the nodal points, from 0 to the whole length \[mm\].
    nodes_mm: Vec<f64>,
    closed: bool,
    curvature: RangeMaximum,
}

impl PhSpline {
    /// The spline through the nodal points of a cubic B-spline with uniform knots.
    ///
    /// Open (at least 4 control points): clamped; the path starts on the first and ends on the last control point, in the
    /// direction of the first and last leg. Closed (at least 3, each given once): starts at `(P_0 + 4 P_1 + P_2)/6`.
    /// Time and memory grow linearly with the number of points.
    ///
    /// # Errors
    /// Too few or too many points, coordinates that are not finite or too large, nodal points that coincide or reverse, a
    /// cusp, and an iteration that does not converge or finds another solution. Indices in the errors are those of nodal
    /// points: `q_j` is governed by control points `j … j+2` (closed) or lies at knot `j` (open).
    pub fn from_control_points(control_mm: &[Vector2<f64>], closed: bool) -> Result<Self, PathError> {
        Self::new(NodalPoints::from_control_points(control_mm, closed)?)
    }

    /// The spline through given points. `end_tangents_mm` are derivatives with respect to the parameter of the first and
    /// the last segment, as long as that segment roughly; without them they are estimated (Bessel). A closed path has none.
    ///
    /// # Errors
    /// As [`PhSpline::from_control_points`]; at least 2 points (open) or 3 (closed) are needed.
    pub fn from_nodal_points(
        points_mm: &[Vector2<f64>],
        closed: bool,
        end_tangents_mm: Option<(Vector2<f64>, Vector2<f64>)>,
    ) -> Result<Self, PathError> {
        Self::new(NodalPoints::from_points(points_mm, closed, end_tangents_mm)?)
    }

    fn new(nodal: NodalPoints) -> Result<Self, PathError> {
        let z = ph_solver::solve(&nodal)?;
        let m = nodal.points.len() - 1;
        let mut segments = Vec::with_capacity(m);
        let mut nodes_mm = Vec::with_capacity(m + 1);
        nodes_mm.push(0.0);
        let mut length = 0.0;
        for (i, start) in nodal.points[..m].iter().enumerate() {
            let w = [(z[i] + z[i + 1]) * 0.5, z[i + 1], (z[i + 1] + z[i + 2]) * 0.5];
            let segment = Segment::new(complex(start), w).map_err(|xi| PathError::Cusp { segment: i, xi })?;
            length += segment.arc_length(1.0);
            segments.push(segment);
            nodes_mm.push(length);
        }
        let curvature = RangeMaximum::new(segments.iter().map(Segment::max_curvature));
        let closed = nodal.ends == Ends::Closed;
        let spline = Self { nodal: nodal.points, preimage: z, segments, nodes_mm, closed, curvature };
        spline.check_turning()?;
        Ok(spline)
    }

    /// The wanted solution turns with the polygon: from the middle of one segment to the middle of the next as the chords
    /// do, and around a closed path as often as the polygon.
    fn check_turning(&self) -> Result<(), PathError> {
        let m = self.segments.len();
        let chord = |i: usize| complex(&(self.nodal[i + 1] - self.nodal[i]));
        let mut total = 0.0;
        let mut worst = (0, 0.0, 0.0);
        let joints = if self.closed { m } else { m - 1 };
        for i in 0..joints {
            let next = (i + 1) % m;
            let spline = self.segments[i].turning(0.5, 1.0) + self.segments[next].turning(0.0, 0.5);
            let polygon = ph_solver::turn_rad(chord(i), chord(next));
            total += spline - polygon;
            if (spline - polygon).abs() > f64::abs(worst.1 - worst.2) {
                worst = (i, spline, polygon);
            }
        }
        if !self.closed {
            // The same from the end tangents to the middle of the end segments.
            let tangent = |z: [Point; 2]| (z[0] + z[1]) * (z[0] + z[1]);
            let z = &self.preimage;
            for (segment, spline, polygon) in [
                (0, self.segments[0].turning(0.0, 0.5), ph_solver::turn_rad(tangent([z[0], z[1]]), chord(0))),
                (
                    m - 1,
                    self.segments[m - 1].turning(0.5, 1.0),
                    ph_solver::turn_rad(chord(m - 1), tangent([z[m], z[m + 1]])),
                ),
            ] {
                if (spline - polygon).abs() > f64::abs(worst.1 - worst.2) {
                    worst = (segment, spline, polygon);
                }
            }
        }
        let (segment, spline, polygon) = worst;
        let limit = std::f64::consts::PI;
        if (spline - polygon).abs() >= limit || (self.closed && total.abs() >= limit) {
            return Err(PathError::WrongRoot {
                segment,
                spline_deg: spline.to_degrees(),
                polygon_deg: polygon.to_degrees(),
            });
        }
        Ok(())
    }

    /// The points that the spline passes through \[mm\]; of a closed path the first is repeated at the end.
    pub fn nodal_points_mm(&self) -> &[Vector2<f64>] {
        &self.nodal
    }

    /// Arc length at the nodal points \[mm\].
    pub fn lengths_at_nodes_mm(&self) -> &[f64] {
        &self.nodes_mm
    }

    /// The solution `z_0 … z_{M+1}` of the spline's equations \[√mm\], a complex number as `[re, im]`. It is determined
    /// up to one common sign.
    pub fn preimage(&self) -> impl ExactSizeIterator<Item = [f64; 2]> + '_ {
        self.preimage.iter().map(|z| [z.re, z.im])
    }

    /// Bending energy `∫ κ² ds` \[1/mm\], by quadrature of the exact rational integrand to 1e-13 relative a segment.
    pub fn bending_energy_1_mm(&self) -> f64 {
        self.segments.iter().map(Segment::bending_energy).sum()
    }

    /// Moves the cursor to arc length `s_mm` (clamped to the path); returns it clamped.
    #[inline]
    fn seek(&self, s_mm: f64, cursor: &mut Cursor) -> f64 {
        let last = self.segments.len() - 1;
        // NaN goes to the start.
        let s = if s_mm > 0.0 { s_mm.min(self.nodes_mm[last + 1]) } else { 0.0 };
        let mut segment = cursor.segment.min(last);
        let holds = |i: usize| s >= self.nodes_mm[i] && (s < self.nodes_mm[i + 1] || i == last);
        let mut guess = cursor.expected();
        if !holds(segment) {
            segment = if segment < last && holds(segment + 1) {
                segment + 1
            } else {
                self.nodes_mm[1..=last].partition_point(|&node| node <= s)
            };
            // Nothing is known of the new segment: start as if its speed were constant.
            guess = (s - self.nodes_mm[segment]) / (self.nodes_mm[segment + 1] - self.nodes_mm[segment]);
        }
        let xi = self.segments[segment].solve_length(s - self.nodes_mm[segment], guess);
        cursor.found(segment, xi);
        s
    }

    /// The neighbouring segment in direction `forward`, through the seam of a closed path.
    fn neighbour(&self, segment: usize, forward: bool) -> Option<usize> {
        let last = self.segments.len() - 1;
        match (forward, segment) {
            (true, s) if s < last => Some(s + 1),
            (true, _) => self.closed.then_some(0),
            (false, 0) => self.closed.then_some(last),
            (false, s) => Some(s - 1),
        }
    }
}

impl Path<2> for PhSpline {
    fn length_mm(&self) -> f64 {
        self.nodes_mm[self.segments.len()]
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    #[inline]
    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<2> {
        let s = self.seek(s_mm, cursor);
        self.segments[cursor.segment].frame(cursor.xi, s)
    }

    fn point_mm(&self, s_mm: f64, cursor: &mut Cursor) -> Vector2<f64> {
        self.seek(s_mm, cursor);
        let point = self.segments[cursor.segment].point(cursor.xi);
        Vector2::new(point.re, point.im)
    }

    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        let last = self.segments.len() - 1;
        let inner = &self.nodes_mm[1..=last];
        let first = inner.partition_point(|&node| node < from_mm);
        let end = inner.partition_point(|&node| node <= to_mm);
        self.curvature.of(first, end.max(first))
    }

    fn max_curvature_1_mm(&self) -> f64 {
        self.curvature.of_all()
    }

    fn graph(&self, s_mm: f64, cursor: &mut Cursor) -> Option<Graph> {
        self.seek(s_mm, cursor);
        Some(self.segments[cursor.segment].graph(cursor.xi))
    }

    fn nearest_local(&self, point_mm: &SVector<f64, 2>, cursor: &mut Cursor) -> Foot<2> {
        // Newton converges quadratically: a step of ξ by δ leaves an error of the order of σ δ² in arc length, and that
        // has to be far below a nanometre.
        const LAST_STEP_MM: f64 = 1e-11;
        let target = complex(point_mm);
        let segment = cursor.segment.min(self.segments.len() - 1);
        // In this order a NaN becomes 0.
        let mut at = Cursor::at(segment, cursor.expected().max(0.0).min(1.0));
        let mut here = self.segments[at.segment].slope(at.xi, target);
        for _ in 0..200 {
            // Newton where the distance is convex, else downhill by the length that a straight path would need.
            let speed_square = here.speed * here.speed;
            let curved = if here.second > 0.1 * speed_square { here.second } else { speed_square };
            let wanted = -here.first / curved;
            if wanted.abs() > 1.0
                && let Some(next) = self.leap(at, wanted * here.speed)
            {
                let there = self.segments[next.segment].slope(next.xi, target);
                if there.half_square < here.half_square {
                    (at, here) = (next, there);
                    continue;
                }
            }
            let mut step = wanted.clamp(-0.5, 0.5);
            if !(step * step * here.speed >= LAST_STEP_MM) {
                at = self.moved(at, step, here.speed);
                break;
            }
            let (next, there) = loop {
                let next = self.moved(at, step, here.speed);
                let there = self.segments[next.segment].slope(next.xi, target);
                if there.half_square <= here.half_square || step.abs() < 1e-12 {
                    break (next, there);
                }
                step *= 0.5;
            };
            let stayed = next == at;
            (at, here) = (next, there);
            if stayed {
                break;
            }
        }
        cursor.found(at.segment, at.xi);
        self.segments[at.segment].foot(at.xi, self.nodes_mm[at.segment])
    }
}

impl PhSpline {
    /// `at` moved by `wanted_mm` of arc length or as far as the path turns by less than half a radian, where that leads
    /// beyond the neighbouring segment: on segments that are short beside the way to go, steps in `ξ` would be many.
    fn leap(&self, at: Cursor, wanted_mm: f64) -> Option<Cursor> {
        let own = &self.nodes_mm[at.segment..at.segment + 2];
        let least = 2.0 * (own[1] - own[0]);
        if !(wanted_mm.abs() > least) {
            return None;
        }
        let s = own[0] + self.segments[at.segment].arc_length(at.xi);
        let mut end = (s + wanted_mm).clamp(0.0, self.length_mm());
        while (end - s).abs() * self.curvature_bound_1_mm(s.min(end), s.max(end)) > 0.5 {
            end = s + 0.5 * (end - s);
        }
        if (end - s).abs() <= least {
            return None;
        }
        let mut next = at;
        self.seek(end, &mut next);
        Some(Cursor::at(next.segment, next.xi))
    }

    /// `at` moved by `step` in its segment's parameter, into the neighbouring segment where it leaves its own.
    fn moved(&self, at: Cursor, step: f64, speed: f64) -> Cursor {
        let xi = at.xi + step;
        if (0.0..=1.0).contains(&xi) {
            return Cursor { xi, ..at };
        }
        let forward = xi > 1.0;
        let Some(segment) = self.neighbour(at.segment, forward) else {
            return Cursor { xi: xi.clamp(0.0, 1.0), ..at };
        };
        // The rest of the step in millimetres, in the parameter of the neighbour; at most half of that one.
        let over = if forward { xi - 1.0 } else { -xi };
        let entry = if forward { 0.0 } else { 1.0 };
        let rest = (over * speed / self.segments[segment].speed(entry)).min(0.5);
        Cursor::at(segment, if forward { rest } else { 1.0 - rest })
    }
}
