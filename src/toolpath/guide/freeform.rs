//! Chords of a free-form curve by the Piegl-Tiller scheme.

use nalgebra::Vector2;

use super::element::MAX_ELEMENTS;
use super::error::GuideError;
use crate::path::NurbsCurve;

/// Points on the curve, both ends included, whose chords are within `tolerance` of it.
///
/// Each Bezier piece is cut into `n = √(M / 8ε)` equal parts of its parameter, where `M` is the largest `|C''|` at `2(p+1)` samples.
/// The samples do not prove the bound, so every chord is measured afterwards, and the piece cut finer where one is too far off.
pub(super) fn chords(curve: &NurbsCurve<2>, tolerance: f64) -> Result<Vec<Vector2<f64>>, GuideError> {
    let mut points = vec![curve.point_mm(curve.domain().0)];
    for piece in curve.bezier_pieces() {
        let width = piece.to - piece.from;
        let samples = 2 * (curve.degree() + 1);
        let mut most = 0.0_f64;
        for k in 0..samples {
            // At the middle of each part: at the piece's end the derivative would be the next one's.
            let u = piece.from + width * (k as f64 + 0.5) / samples as f64;
            let [_, _, second] = curve.derivatives::<3>(u);
            most = most.max(second.norm() * width * width);
        }
        let mut parts = (most / (8.0 * tolerance)).sqrt().ceil().max(1.0);
        loop {
            if !(points.len() as f64 + parts <= MAX_ELEMENTS as f64) {
                return Err(GuideError::TooManyElements { elements: MAX_ELEMENTS + 1 });
            }
            let count = super::element::parts(parts);
            let at = |k: usize, share: f64| curve.point_mm(piece.from + width * ((k as f64 + share) / parts));
            let worst = (0..count)
                .map(|k| {
                    let (a, b) = (at(k, 0.0), if k + 1 == count { end(&piece) } else { at(k + 1, 0.0) });
                    (1..8).map(|i| distance(at(k, f64::from(i) / 8.0), a, b)).fold(0.0, f64::max)
                })
                .fold(0.0, f64::max);
            if worst <= 0.98 * tolerance {
                break;
            }
            parts = (parts * (worst / tolerance).sqrt().clamp(1.05, 2.0)).ceil();
        }
        let count = super::element::parts(parts);
        points.extend((1..count).map(|k| curve.point_mm(piece.from + width * (k as f64 / parts))));
        points.push(end(&piece));
    }
    let last = points[points.len() - 1];
    points.dedup_by(|b, a| (*b - *a).norm() <= 1e-9);
    if let Some(end) = points.last_mut() {
        *end = last;
    }
    if points.len() < 2 {
        return Err(GuideError::TooFewPoints { points: 1 });
    }
    Ok(points)
}

fn end(piece: &crate::path::nurbs::BezierPiece<2>) -> Vector2<f64> {
    piece.control_points_mm.last().copied().unwrap_or_default()
}

/// Distance of a point from a line segment.
fn distance(point: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    let chord = b - a;
    let square = chord.norm_squared();
    let share = if square > 0.0 { ((point - a).dot(&chord) / square).clamp(0.0, 1.0) } else { 0.0 };
    (point - a - chord * share).norm()
}
