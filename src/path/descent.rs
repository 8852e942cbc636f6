//! From a point of a path downhill to its nearest local minimum of distance, for paths that answer by arc length.

use nalgebra::SVector;

use super::{Cursor, Foot, Path};

/// Newton's iteration on `(r - p)·t = 0` in arc length from `from_mm`, every step shortened until it leads downhill. An open path
/// ends at its ends, a closed one is gone around. `cursor` is left on the foot.
pub(super) fn descend<const D: usize>(
    path: &dyn Path<D>,
    point_mm: &SVector<f64, D>,
    from_mm: f64,
    cursor: &mut Cursor,
) -> Foot<D> {
    // Of steps as short as this rounding hides what they do to the distance; the slope tells.
    const FINE_STEP_MM: f64 = 1e-5;
    const LAST_STEP_MM: f64 = 1e-11;
    const SHORTEST_STEP_MM: f64 = 1e-13;
    let length = path.length_mm();
    let mut at = *cursor;
    let place = |s: f64| if path.is_closed() { s.rem_euclid(length) } else { s.max(0.0).min(length) };
    let mut here = path.frame(place(from_mm), &mut at);
    let mut away = here.point_mm - point_mm;
    for _ in 0..200 {
        let slope = away.dot(&here.tangent);
        let second = 1.0 + away.dot(&here.curvature_1_mm);
        // Newton where the distance is convex, else downhill by the length that a straight path would need; never around more
        // than half a radian of a bend.
        let bend = here.curvature_1_mm.norm();
        let most = if bend > 0.0 { (0.5 / bend).min(0.5 * length) } else { 0.5 * length };
        let mut step = (if second > 0.1 { -slope / second } else { -slope }).clamp(-most, most);
        let fine = second > 0.1 && step.abs() <= FINE_STEP_MM;
        let last = step.abs() <= LAST_STEP_MM;
        let moved = loop {
            let s = place(here.s_mm + step);
            if s == here.s_mm || !(step.abs() >= SHORTEST_STEP_MM) {
                break None;
            }
            let mut cursor = at;
            let there = path.frame(s, &mut cursor);
            let vector = there.point_mm - point_mm;
            let better = if fine {
                vector.dot(&there.tangent).abs() < slope.abs()
            } else {
                vector.norm_squared() < away.norm_squared()
            };
            if better {
                break Some((there, vector, cursor));
            }
            step *= 0.5;
        };
        let Some((there, vector, there_cursor)) = moved else { break };
        (here, away, at) = (there, vector, there_cursor);
        if last {
            break;
        }
    }
    cursor.found(at.segment, at.xi);
    here.into()
}
