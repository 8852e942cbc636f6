//! Where lines and arcs cross or touch.

use super::element::{Element, Point, Shape, cross, turn};
use super::intersection::{meet_circle, meet_line};
use super::tree::Tree;

/// How two elements stand to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Meeting {
    /// They share no end.
    Apart,
    /// The first ends where the second starts.
    Joined,
    /// So at both ends.
    JoinedTwice,
}

/// A point where a closed boundary crosses or touches itself.
pub(super) fn itself(elements: &[Element], tree: &Tree, eps: f64) -> Option<Point> {
    let count = elements.len();
    let mut found = None;
    tree.pairs(tree, 10.0 * eps, &mut |i, j| {
        if i == j {
            return true;
        }
        let (after, before) = ((i + 1) % count == j, (j + 1) % count == i);
        let (a, b, meeting_kind) = match (after, before) {
            (true, true) => (i, j, Meeting::JoinedTwice),
            (true, false) => (i, j, Meeting::Joined),
            (false, true) => (j, i, Meeting::Joined),
            (false, false) => (i, j, Meeting::Apart),
        };
        found = meeting(&elements[a], &elements[b], meeting_kind, eps);
        found.is_none()
    });
    found
}

/// A point that two elements share, besides the ends at which they are joined.
pub(super) fn meeting(a: &Element, b: &Element, kind: Meeting, eps: f64) -> Option<Point> {
    let touch = 10.0 * eps;
    if kind == Meeting::Joined {
        // Back along itself.
        let angle = turn(a.tangent_end(), b.tangent_start());
        let curved = matches!((a.shape, b.shape), (Shape::Line { .. }, Shape::Line { .. }));
        if curved && std::f64::consts::PI - angle.abs() < 1e-9 {
            return Some(b.start);
        }
    }
    if let (Shape::Line { .. }, Shape::Line { .. }) = (a.shape, b.shape) {
        if kind != Meeting::Apart {
            return None;
        }
        let side = |e: &Element, p: Point| cross(e.end - e.start, p - e.start);
        let (s0, s1) = (side(a, b.start), side(a, b.end));
        let (t0, t1) = (side(b, a.start), side(b, a.end));
        if (s0 < 0.0) != (s1 < 0.0) && (t0 < 0.0) != (t1 < 0.0) && s0 != s1 {
            return Some(b.start + (b.end - b.start) * (s0 / (s0 - s1)));
        }
        let near = |e: &Element, p: Point| (e.distance(p) <= touch).then_some(p);
        return near(a, b.start).or(near(a, b.end)).or(near(b, a.start)).or(near(b, a.end));
    }
    if kind == Meeting::Apart {
        for (e, p) in [(a, b.start), (a, b.end), (b, a.start), (b, a.end)] {
            if e.distance(p) <= touch {
                return Some(p);
            }
        }
    }
    let mut parameters = Vec::new();
    match b.shape {
        Shape::Line { direction } => meet_line(a, b.start, direction, &mut parameters),
        Shape::Arc { centre, radius, .. } => meet_circle(a, centre, radius, &mut parameters),
    }
    // Curves that touch at their common end are found a little beside it.
    let beside = 100.0 * (eps * (a.length() + b.length())).sqrt();
    for t in parameters {
        if !(t >= 0.0 && t <= a.span) {
            continue;
        }
        let point = a.at(t);
        let joint = kind != Meeting::Apart && (point - a.end).norm() <= beside
            || kind == Meeting::JoinedTwice && (point - a.start).norm() <= beside;
        if !joint && b.distance(point) <= touch {
            return Some(point);
        }
    }
    None
}
