//! The contouring error from tangent and curvature: quick, and proven to be within a nanometre where it is used.
//!
//! Near the setpoint the path is the graph `y = f(x)` of a polynomial over a tangent ([`Graph`], remainder `ε`). The tool at
//! `(u, w)` is `v = w - f(u)` above it. With `p = f'(u)`, `h = 1 - 1/√(1 + p²)` and the curvature `k = f''(u)/(1 + p²)^{3/2}` of the
//! graph below the tool the distance to the circle of curvature there is
//!
//! ```text
//! e = (1 - √((1 - kv)² + 2 kv h))/k = v - v h/(1 - kv) + k v² h²/(2 (1 - kv)³) - …
//! ```
//!
//! of which [`Piece::square`] takes `h` to `p⁶`, `k` to `p²`, `1/(1 - kv)` to `(kv)⁴` and the last factor to `1 + 3kv`.
//!
//! **Neglected terms.** With `d` the tracking error, `κ` the largest curvature on the piece and `J` a bound of `|κ'|` there, all with
//! their slack: `P = 1.1 κ d ≥ |p|`, `V = 1.1 d ≥ |v|`, `K = κV ≤ 0.11`. The series neglect less than
//! `V (0.3 P⁸ + 0.6 P² K⁵ + 0.9 K³ P⁴ + 1.1 K P⁶)`, and the curvature's change over the `|v| P` between the point below the tool and its
//! foot less than `J (VP)³/5`. Twice the sum, with `ε`, is kept below half a nanometre by the largest `d` that a [`Piece`] takes.
//!
//! The foot itself lies within `1.1 V P` of `u`; it is on the piece if both `u` and that stretch are. Within the reach of the
//! [`ContourMeter`](super::ContourMeter) it is the only one, because `d (1 + 2π) κ < 1`.

use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::lane::Lane;
use crate::path::{Cursor, GRAPH_ERROR_MM, Graph, Path};

/// Half of what the distance may be wrong by \[mm\].
const HALF_NM: f64 = 0.5e-6;

/// A piece of path near a setpoint, against which the distance is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// From the setpoint to the point where `x = y = 0` \[mm\].
    offset: [f64; 2],
    tangent: [f64; 2],
    coefficients: [f64; 4],
    /// Where the piece ends \[mm\].
    from: f64,
    to: f64,
    /// The largest squared tracking error that it is good for \[mm²\].
    pub(crate) most_square: f64,
    /// The open end of the path, where it starts (-1) or stops (1): beyond it the distance is that to `x = y = 0`.
    end: f64,
}

/// A squared distance with the answer whether it is the right one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Local<L: Lane> {
    pub(crate) square: L,
    pub(crate) valid: L::Mask,
}

impl Piece {
    /// Squared distance of the tool at `(dx, dy)` from the setpoint, for a tracking error and a place that the piece is good for.
    #[inline(always)]
    pub(crate) fn square<L: Lane>(&self, dx: L, dy: L) -> L {
        self.measure(dx, dy).0
    }

    /// Squared distance, `u` and how far from `u` the foot may be.
    #[inline(always)]
    fn measure<L: Lane>(&self, dx: L, dy: L) -> (L, L, L) {
        let all = |value: f64| dx.all(value);
        let [tx, ty] = self.tangent;
        let [c2, c3, c4, c5] = self.coefficients;
        let (dx, dy) = (dx - all(self.offset[0]), dy - all(self.offset[1]));
        let u = all(tx).mul_add(dx, all(ty) * dy);
        let w = all(tx).mul_add(dy, all(-ty) * dx);
        let f = u.mul_add(u.mul_add(u.mul_add(all(c5), all(c4)), all(c3)), all(c2));
        let v = (-(u * u)).mul_add(f, w);
        let p = u * u.mul_add(u.mul_add(u.mul_add(all(5.0 * c5), all(4.0 * c4)), all(3.0 * c3)), all(2.0 * c2));
        let k = u.mul_add(u.mul_add(u.mul_add(all(20.0 * c5), all(12.0 * c4)), all(6.0 * c3)), all(2.0 * c2));
        let p_square = p * p;
        let h = p_square * p_square.mul_add(p_square.mul_add(all(0.3125), all(-0.375)), all(0.5));
        let kv = k * p_square.mul_add(all(-1.5), all(1.0)) * v;
        let one = all(1.0);
        let inverse = kv.mul_add(kv.mul_add(kv.mul_add(one + kv, one), one), one);
        let second = kv * h * kv.mul_add(all(1.5), all(0.5));
        let e = (-(h * v)).mul_add(inverse - second, v);
        (e * e, u, v * p)
    }

    /// Squared distance, and where it holds. `square` is the squared tracking error.
    #[inline(always)]
    pub(crate) fn checked<L: Lane>(&self, dx: L, dy: L, square: L) -> Local<L> {
        let all = |value: f64| dx.all(value);
        let within = all(self.most_square).gt(square);
        if self.end != 0.0 {
            let (x, y) = (dx - all(self.offset[0]), dy - all(self.offset[1]));
            let beyond = all(self.end * self.tangent[0]).mul_add(x, all(self.end * self.tangent[1]) * y);
            let square = x.mul_add(x, y * y);
            return Local { square, valid: square.and(within, beyond.gt(all(-1e-300))) };
        }
        let (square, u, foot) = self.measure(dx, dy);
        // The foot is at most 1.1 · 1.1 |v p| from u.
        let room = all(1e-12).max_abs(foot * all(1.25)) + all(1e-12);
        let inside = square.and((u - all(self.from)).gt(room), (all(self.to) - u).gt(room));
        Local { square, valid: square.and(within, inside) }
    }

    /// The graph at arc length `s_mm` as seen from the setpoint, for tracking errors up to `reach_mm` at most.
    fn new<const D: usize>(
        path: &dyn Path<D>,
        graph: &Graph,
        setpoint_mm: &Vector2<f64>,
        s_mm: f64,
        reach_mm: f64,
    ) -> Self {
        let offset = graph.point_mm - setpoint_mm;
        let away = offset.norm();
        let span = graph.to_mm.max(-graph.from_mm).min(reach_mm + away);
        let kappa = curvature_bound(path, s_mm, 1.1 * span);
        let [_, c3, c4, c5] = graph.coefficients;
        let rate = 6.0 * c3.abs() + span * (24.0 * c4.abs() + span * 60.0 * c5.abs()) + 6.0 * kappa.powi(3) * span;
        let wrong = |d: f64| {
            let (p, v) = (1.1 * kappa * (d + away), 1.1 * d);
            let kv = kappa * v;
            let square = p * p;
            let series = 0.3 * square.powi(4)
                + 0.6 * square * kv.powi(5)
                + 0.9 * kv.powi(3) * square * square
                + 1.1 * kv * square.powi(3);
            2.0 * (v * series + rate * (v * p).powi(3) / 5.0) + GRAPH_ERROR_MM
        };
        let mut most = reach_mm;
        while most > 1e-6 && !(wrong(most) <= HALF_NM && kappa * (most + away) <= 0.1) {
            most *= 0.93;
        }
        Self {
            offset: offset.into(),
            tangent: graph.tangent.into(),
            coefficients: graph.coefficients,
            from: graph.from_mm,
            to: graph.to_mm,
            most_square: if most > 1e-6 { most * most } else { 0.0 },
            end: 0.0,
        }
    }

    /// What lies beyond the end of an open path, whose graph there is given.
    fn beyond(graph: &Graph, setpoint_mm: &Vector2<f64>, direction: f64, reach_mm: f64) -> Self {
        Self {
            offset: (graph.point_mm - setpoint_mm).into(),
            tangent: graph.tangent.into(),
            coefficients: [0.0; 4],
            from: 0.0,
            to: 0.0,
            most_square: reach_mm * reach_mm,
            end: direction,
        }
    }

    /// The largest squared tracking error for which [`Piece::square`] alone is right, whatever the place.
    fn anywhere_square(&self) -> f64 {
        // |u| ≤ d, the foot at most 1.25 V P ≤ 0.14 d from it.
        let room = 0.85 * self.to.min(-self.from);
        if self.end == 0.0 { self.most_square.min(room * room) } else { 0.0 }
    }
}

/// What the contouring error is measured against near one setpoint.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Neighbourhood {
    /// The setpoint's own piece; none where the path has no graphs.
    pub(crate) own: Option<Piece>,
    /// What it leaves out.
    pub(crate) others: Vec<Piece>,
    /// The largest squared tracking error for which the own piece alone is right \[mm²\].
    pub(crate) plain_square: f64,
}

/// No tracking error beyond this is looked at \[mm\].
const FURTHEST_MM: f64 = 1.0;

/// Most pieces around a setpoint beside its own.
const MOST_PIECES: usize = 3;

impl Neighbourhood {
    /// The pieces of `path` around arc length `s_mm`, whose point is `setpoint_mm`; none where the path has no graphs.
    pub(crate) fn around<const D: usize>(
        path: &dyn Path<D>,
        setpoint_mm: &Vector2<f64>,
        s_mm: f64,
        cursor: &Cursor,
    ) -> Self {
        let mut around = Self::default();
        let mut cursor = *cursor;
        let Some(own) = path.graph(s_mm, &mut cursor) else { return around };
        let mut reach = FURTHEST_MM;
        while reach > 1e-6 && reach * (1.0 + 2.0 * PI) * curvature_bound(path, s_mm, PI * reach) >= 1.0 {
            reach *= 0.8;
        }
        let length = path.length_mm();
        let first = Piece::new(path, &own, setpoint_mm, s_mm, reach);
        around.plain_square = first.anywhere_square();
        around.own = Some(first);
        for direction in [-1.0, 1.0] {
            let within = |s: f64| if path.is_closed() { s } else { s.clamp(0.0, length) };
            let towards = |s: f64, graph: &Graph| within(s + if direction < 0.0 { graph.from_mm } else { graph.to_mm });
            let mut edge = towards(s_mm, &own);
            while (edge - s_mm).abs() < reach && around.others.len() < MOST_PIECES {
                let s = within(edge + direction * (0.5 * (reach - (edge - s_mm).abs())).clamp(1e-3, 0.1));
                let Some(graph) = path.graph(if path.is_closed() { s.rem_euclid(length) } else { s }, &mut cursor)
                else {
                    break;
                };
                if s == edge {
                    around.others.push(Piece::beyond(&graph, setpoint_mm, direction, reach));
                    break;
                }
                around.others.push(Piece::new(path, &graph, setpoint_mm, s, reach));
                let next = towards(s, &graph);
                if !((next - edge) * direction > 0.0) {
                    break;
                }
                edge = next;
            }
        }
        around
    }
}

/// Upper bound of the curvature within `half_mm` of arc length `s_mm` \[1/mm\].
fn curvature_bound<const D: usize>(path: &dyn Path<D>, s_mm: f64, half_mm: f64) -> f64 {
    let (low, high, length) = (s_mm - half_mm, s_mm + half_mm, path.length_mm());
    if path.is_closed() && !(low >= 0.0 && high <= length) {
        path.max_curvature_1_mm()
    } else {
        path.curvature_bound_1_mm(low.clamp(0.0, length), high.clamp(0.0, length))
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::path::{Circle, Line, PhSpline, nearest_in_window};

    /// What a path is measured with: random tools around random setpoints, each piece that says it is right against the exact
    /// distance. Returns how many tools were measured, how many by the own piece alone, and how many by some piece.
    fn measure(rng: &mut Xoshiro256PlusPlus, path: &dyn Path<2>, what: &str) -> [u32; 3] {
        let mut counts = [0; 3];
        for i in 0..20 {
            // Now and then right at the ends.
            let s = match i {
                0 => 0.0,
                1 => path.length_mm(),
                2 => 0.01,
                _ => rng.random_range(0.0..path.length_mm()),
            };
            let mut cursor = Cursor::default();
            let setpoint = path.point_mm(s, &mut cursor);
            let around = Neighbourhood::around(path, &setpoint, s, &cursor);
            for tool in 0..20 {
                // Every other one about as far as the own piece is good for.
                let limit = around.plain_square.sqrt().max(1e-3) * rng.random_range(0.9..1.0);
                let size = if tool % 2 == 0 { limit } else { 10.0_f64.powf(rng.random_range(-5.0..0.2)) };
                let angle = rng.random_range(0.0..2.0 * PI);
                let (dx, dy) = (size * angle.cos(), size * angle.sin());
                let reach = PI * size + 1e-6;
                let exact = nearest_in_window(path, &(setpoint + Vector2::new(dx, dy)), s, reach, &mut cursor.clone())
                    .distance_mm;
                let check = |square: f64, by: &str| {
                    let error = square.sqrt() - exact;
                    // Half a nanometre, and the rounding of coordinates and squares.
                    let rounding = 1e-12 * (1.0 + path.length_mm());
                    assert!(
                        error.abs() < HALF_NM + rounding,
                        "{what} s {s}, tool at {dx} {dy}, {by}: {error} {around:?}"
                    );
                };
                counts[0] += 1;
                let square = dx * dx + dy * dy;
                let mut found = false;
                if let Some(own) = &around.own {
                    if square <= around.plain_square {
                        check(own.square(dx, dy), "own piece");
                        counts[1] += 1;
                        found = true;
                    }
                    for piece in std::iter::once(own).chain(&around.others) {
                        let local = piece.checked(dx, dy, square);
                        if local.valid {
                            check(local.square, "a piece");
                            found = true;
                        }
                    }
                }
                counts[2] += u32::from(found);
            }
        }
        counts
    }

    #[test]
    fn validates_every_piece_that_says_it_is_right_against_the_exact_distance() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(70);
        let mut sum = [0; 3];
        for case in 0..400 {
            let scale = 10.0_f64.powf(rng.random_range(-1.0..2.0));
            let path: Box<dyn Path<2>> = match case % 5 {
                0 => Box::new(Line::new(Vector2::zeros(), Vector2::new(scale, 0.3 * scale)).unwrap()),
                1 => Box::new(Circle::new(Vector2::new(1.0, 2.0), scale, 0.5, case % 2 == 0).unwrap()),
                kind => {
                    let count = rng.random_range(3..20);
                    let points: Vec<_> = (0..count)
                        .map(|i| {
                            let angle = 2.0 * PI * (f64::from(i) + rng.random_range(-0.3..0.3)) / f64::from(count);
                            Vector2::new(angle.cos(), angle.sin()) * scale * rng.random_range(0.6..1.4)
                        })
                        .collect();
                    match PhSpline::from_nodal_points(&points, kind == 2, None) {
                        Ok(path) => Box::new(path),
                        Err(_) => continue,
                    }
                }
            };
            for (sum, count) in sum.iter_mut().zip(measure(&mut rng, &*path, &format!("case {case}"))) {
                *sum += count;
            }
        }
        let [all, own, some] = sum;
        assert!(all > 100_000 && 2 * own > all && 10 * some > 7 * all, "{sum:?}");
    }
}
