//! Where a line or an arc meets an infinite line or a circle.

use super::element::{Element, Point, Shape, cross, left};

/// Parameters at which a curve meets an infinite line.
pub(super) fn meet_line(curve: &Element, point: Point, direction: Point, out: &mut Vec<f64>) {
    match curve.shape {
        Shape::Line { direction: own } => {
            let slope = cross(direction, own);
            out.push(-cross(direction, curve.start - point) / slope);
        }
        Shape::Arc { centre, radius, .. } => {
            let height = cross(direction, centre - point);
            let square = (radius - height) * (radius + height);
            if square >= 0.0 {
                let foot = centre - left(direction) * height;
                let half = direction * square.sqrt();
                let line = |q: Point| (cross(direction, q - point), left(direction));
                out.extend([half, -half].map(|side| curve.parameter(polished(foot + side, centre, radius, line))));
            }
        }
    }
}

/// Parameters at which a curve meets a circle.
pub(super) fn meet_circle(curve: &Element, middle: Point, size: f64, out: &mut Vec<f64>) {
    match curve.shape {
        Shape::Line { direction } => {
            let w = middle - curve.start;
            let height = cross(direction, w);
            let square = (size - height) * (size + height);
            if square >= 0.0 {
                let (b, half) = (w.dot(&direction), square.sqrt());
                let line = |q: Point| (cross(direction, q - curve.start), left(direction));
                out.extend([b - half, b + half].map(|t| curve.parameter(polished(curve.at(t), middle, size, line))));
            }
        }
        Shape::Arc { centre, radius, .. } => {
            let w = middle - centre;
            let apart = w.norm();
            if !(apart > 0.0) {
                return;
            }
            let axis = w / apart;
            let a = 0.5 * (apart + (radius - size) * (radius + size) / apart);
            let square = (radius - a) * (radius + a);
            if square >= 0.0 {
                let half = left(axis) * square.sqrt();
                let own = |q: Point| from_circle(q, centre, radius);
                let foot = centre + axis * a;
                out.extend([half, -half].map(|side| curve.parameter(polished(foot + side, middle, size, own))));
            }
        }
    }
}

/// How far a point is outside of a circle, and the direction in which that grows.
fn from_circle(point: Point, centre: Point, radius: f64) -> (f64, Point) {
    let w = point - centre;
    let distance = w.norm();
    (distance - radius, w / distance)
}

/// The point near `point` at which a circle meets another curve, by Newton's method: the closed forms lose the digits by which a
/// radius is larger than the figure.
fn polished(mut point: Point, centre: Point, radius: f64, other: impl Fn(Point) -> (f64, Point)) -> Point {
    for _ in 0..2 {
        let ((f, a), (g, b)) = (from_circle(point, centre, radius), other(point));
        let slope = cross(a, b);
        // Where they only touch there is nothing to be gained.
        if !(slope.abs() > 1e-5) {
            break;
        }
        point += Point::new(g * a.y - f * b.y, f * b.x - g * a.x) / slope;
    }
    point
}
