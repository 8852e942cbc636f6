//! What rounding does to a motion: bounds that hold for the whole curve, not only at sampled points.

use crate::nc::arc::distance;
use crate::nc::{Arc, Nurbs};

/// Parts of the error that rounding adds to a curve \[mm\].
#[allow(clippy::struct_field_names)] // the unit
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Parts {
    pub(super) coordinates_mm: f64,
    pub(super) weights_mm: f64,
    pub(super) knots_mm: f64,
}

impl Parts {
    pub(super) fn total_mm(self) -> f64 {
        self.coordinates_mm + self.weights_mm + self.knots_mm
    }

    pub(super) fn max(self, other: Self) -> Self {
        Self {
            coordinates_mm: self.coordinates_mm.max(other.coordinates_mm),
            weights_mm: self.weights_mm.max(other.weights_mm),
            knots_mm: self.knots_mm.max(other.knots_mm),
        }
    }
}

/// Largest distance between points of two curves at the same fraction of the same knot span.
///
/// `from` has the knots of `to` but for rounding, and so its points and weights. Three steps, each bounded span by span over
/// the `p + 1` active control points, whose mutual distances are at most `D` and whose weights differ by at most a factor `W`:
///
/// 1. Knots. De Boor's algorithm makes `p` levels of points between neighbours, at `β = α ρ/(1 - α + α ρ)` of the way, where
///    `α = (u - a)/(b - a)` with two knots and `ρ` is a ratio of weights within `1/W … W`. `α` is linear in the fraction of
///    the span, so it changes most at one of its ends, and `|dβ/dα| ≤ W`. All points of a level lie in the hull of the
///    active ones: a level adds at most `W D max |Δα|`.
/// 2. Weights. With `w' = w (1 + e)` the point moves by `Σ N w' (e/(1 + e)) (P - C)/Σ N w'`, at most `D max |e/(1 + e)|`.
/// 3. Coordinates. The point is a mean of the control points with positive weights: at most the largest `|ΔP|`.
///
/// A span that rounding closes has no bound: infinite.
pub(super) fn curve(from: &Nurbs, to: &Nurbs) -> Parts {
    let (p, points) = (from.degree, from.control_points_mm.len());
    let mut most = Parts::default();
    for span in p..points {
        let (u, v) = (&from.knots, &to.knots);
        if u[span] == u[span + 1] && v[span] == v[span + 1] {
            continue;
        }
        let active = span - p..=span;
        let diameter_mm = diameter_mm(&from.control_points_mm[active.clone()]);
        let weights = &from.weights[active.clone()];
        let (least, largest) = weights.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &w| (a.min(w), b.max(w)));
        let mut turned = 0.0;
        if u != v {
            for level in 1..=p {
                let change = |i: usize| alpha_change(u, v, span, i, i + p + 1 - level);
                turned += (span - p + level..=span).map(change).fold(0.0, larger);
            }
        }
        let relative = |i: usize| (to.weights[i] - from.weights[i]).abs() / to.weights[i];
        let moved = |i: usize| distance(from.control_points_mm[i], to.control_points_mm[i]);
        let knots_mm = if turned > 0.0 { turned * diameter_mm * (largest / least) } else { 0.0 };
        let part = Parts {
            coordinates_mm: active.clone().map(moved).fold(0.0, larger),
            weights_mm: diameter_mm * active.clone().map(relative).fold(0.0, larger),
            // Not a number where the points coincide and the span closes: no bound either way.
            knots_mm: if knots_mm.is_nan() { f64::INFINITY } else { knots_mm },
        };
        most = most.max(part);
    }
    most
}

/// The larger number, or infinity where one is none.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

/// How much `α = (u - u_i)/(u_j - u_i)` changes at most on a span when knots `u` become `v`.
fn alpha_change(u: &[f64], v: &[f64], span: usize, i: usize, j: usize) -> f64 {
    let alpha = |knots: &[f64], at: usize| (knots[at] - knots[i]) / (knots[j] - knots[i]);
    let change = |at: usize| (alpha(v, at) - alpha(u, at)).abs();
    larger(larger(0.0, change(span)), change(span + 1))
}

fn diameter_mm(points: &[[f64; 3]]) -> f64 {
    let pairs = points.iter().enumerate().flat_map(|(i, &a)| points[i + 1..].iter().map(move |&b| distance(a, b)));
    pairs.fold(0.0, f64::max)
}

/// Largest distance between points of two arcs at the same fraction \[mm\]: radii, angles and heights run in proportion.
pub(super) fn arc(from: (&Arc, [f64; 3], [f64; 3]), to: (&Arc, [f64; 3], [f64; 3])) -> f64 {
    let ((arc, start_mm, end_mm), (arc_to, start_to_mm, end_to_mm)) = (from, to);
    let turn = |a: &Arc, p: [f64; 3], b: &Arc, q: [f64; 3]| {
        let ([x, y], [s, t]) = (a.seen_from_centre(p), b.seen_from_centre(q));
        let across = a.plane.axes()[2];
        let radius = libm::hypot(x, y);
        let angle = libm::atan2(x * t - y * s, x * s + y * t).abs();
        ((libm::hypot(s, t) - radius).abs(), radius * angle, (q[across] - p[across]).abs())
    };
    let sweeps = arc_to.sweep_rad(start_to_mm, end_to_mm) - arc.sweep_rad(start_mm, end_mm);
    // A full circle that rounding opens, or an arc that it closes, is another arc.
    if !(sweeps.abs() < 1.0) {
        return f64::INFINITY;
    }
    let (radial, along, across) = turn(arc, start_mm, arc_to, start_to_mm);
    let (radial_end, along_end, across_end) = turn(arc, end_mm, arc_to, end_to_mm);
    let [a, b, _] = arc.plane.axes();
    let (c, d) = (arc.centre_mm, arc_to.centre_mm);
    let centre = libm::hypot(d[a] - c[a], d[b] - c[b]);
    let in_plane = centre + radial.max(radial_end) + along.max(along_end);
    libm::hypot(in_plane, across.max(across_end))
}
