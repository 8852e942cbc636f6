//! One path that slides from each ring to the next.

use super::link::Turned;
use super::ridge::Point;
use super::shape::corners;

/// Steps shorter than this are left out, in pitches.
const NEAR: f64 = 0.1;

/// Places of two rings, in order along both, that are near each other: at each the next place of either ring or of both follows,
/// whichever are nearest.
fn pairs(a: &[Point], b: &[Point]) -> Vec<(usize, usize)> {
    let mut out = vec![(0, 0)];
    let (mut i, mut j) = (0, 0);
    while i + 1 < a.len() || j + 1 < b.len() {
        let far = |i: usize, j: usize| match (a.get(i), b.get(j)) {
            (Some(a), Some(b)) => (a - b).norm(),
            _ => f64::INFINITY,
        };
        let (both, first, second) = (far(i + 1, j + 1), far(i + 1, j), far(i, j + 1));
        if both <= first && both <= second {
            i += 1;
            j += 1;
        } else if first <= second {
            i += 1;
        } else {
            j += 1;
        }
        out.push((i, j));
    }
    out
}

/// A line with points at most `pitch` apart.
fn dense(line: &[Point], pitch: f64) -> Vec<Point> {
    let mut out = vec![line[0]];
    for leg in line.windows(2) {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = ((leg[1] - leg[0]).norm() / pitch).ceil().max(1.0).min(1e6) as usize;
        out.extend((1..parts).map(|k| leg[0] + (leg[1] - leg[0]) * (k as f64 / parts as f64)));
        out.push(leg[1]);
    }
    out
}

/// The turn that begins on the outer ring and ends on the inner one. None where they are further than `most` apart somewhere.
///
/// At the share `t` of the way around it stands at `(1 - t) a + t b` between places `a`, `b` of the rings. The turn before stands there
/// at the same share between the rings one further out, so that neighbouring turns are no further apart than the rings are.
pub(super) fn slide(outer: &Turned, inner: &Turned, pitch: f64, most: f64) -> Option<Vec<Point>> {
    let (a, b) = (dense(&outer.line, pitch), dense(&inner.line, pitch));
    let pairs = pairs(&a, &b);
    if pairs.iter().any(|&(i, j)| !((a[i] - b[j]).norm() <= most)) {
        return None;
    }
    let lengths = |line: &[Point]| {
        let mut sum = 0.0;
        let mut out = vec![0.0];
        for leg in line.windows(2) {
            sum += (leg[1] - leg[0]).norm();
            out.push(sum);
        }
        out
    };
    let (la, lb) = (lengths(&a), lengths(&b));
    let (whole_a, whole_b) = (la[la.len() - 1], lb[lb.len() - 1]);
    // Where one ring's places lie closer than the other's a pair can be all but the one before it: such steps are noise, and would look
    // like corners. The corners of the nearer ring stay.
    let near = NEAR * pitch;
    let (corners_a, corners_b) = (corners(&a), corners(&b));
    let mut out: Vec<Point> = Vec::with_capacity(pairs.len());
    let mut kept = 0;
    let mut before = None;
    for (i, j) in pairs {
        let t = 0.5 * (la[i] / whole_a + lb[j] / whole_b);
        let at = a[i] * (1.0 - t) + b[j] * t;
        let (on_a, place, corners) = if t < 0.5 { (true, i, &corners_a) } else { (false, j, &corners_b) };
        // A ring waits in its corner while the other goes on.
        let corner = before != Some((on_a, place)) && corners.binary_search(&place).is_ok();
        before = Some((on_a, place));
        while corner && out.len() > kept.max(1) && (at - out[out.len() - 1]).norm() < near {
            out.pop();
        }
        if corner || out.last().is_none_or(|last| (at - last).norm() >= near) {
            out.push(at);
        }
        if corner {
            kept = out.len();
        }
    }
    let end = inner.line[inner.line.len() - 1];
    while out.len() > 1 && (end - out[out.len() - 1]).norm() < near {
        out.pop();
    }
    out.push(end);
    Some(out)
}
