//! The nearest point of a path within a window of arc length, proven to be the nearest one.
//!
//! Distance is 1-Lipschitz in arc length, and half its square, `f(s) = |r(s) - p|²/2`, has `f'' = 1 + (r - p)·k`. Two facts
//! follow, with `κ` a bound of the curvature on an interval:
//!
//! - where `|r - p| κ < 1` on the whole interval, `f` is convex: a local minimum is the only one;
//! - with `m` the middle of an interval of half-length `h`, `f(s) ≥ f(m) - |f'(m)| h - ½ max(0, κ(|r(m) - p| + h) - 1) h²`:
//!   an interval whose bound is above the best distance found holds no nearer point.
//!
//! The common case (a servo error far below the radius of curvature) is settled by the first fact after a few Newton steps.
//! Else the window is halved by branch and bound until every piece is settled by one of them.

use nalgebra::SVector;

use super::{Cursor, Foot, Path};

/// The nearest point found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest<const D: usize> {
    /// The path there.
    pub foot: Foot<D>,
    /// Distance to it \[mm\], not negative.
    pub distance_mm: f64,
}

/// Pieces shorter than this are not divided any more \[mm\]: the distance cannot change by more on half of one.
const SMALLEST_MM: f64 = 1e-9;

/// The nearest point of `path` to `point_mm` among those within `reach_mm` of arc length `around_mm`.
///
/// `cursor` starts the local search; a cursor at the previous nearest point makes it a matter of two or three Newton steps.
/// On a closed path the window goes through the seam. The distance is that of the true nearest point within 1e-9 mm.
pub fn nearest_in_window<const D: usize>(
    path: &dyn Path<D>,
    point_mm: &SVector<f64, D>,
    around_mm: f64,
    reach_mm: f64,
    cursor: &mut Cursor,
) -> Nearest<D> {
    let window = Window::new(path, around_mm, reach_mm);
    let local = path.nearest_local(point_mm, cursor);
    let distance_mm = (local.point_mm - point_mm).norm();
    if window.contains(local.s_mm) && distance_mm.is_finite() {
        // Nothing in the window is further from the foot than the window is long.
        let furthest = distance_mm + window.span();
        if furthest * path.max_curvature_1_mm() < 1.0 || furthest * window.curvature_bound(path) < 1.0 {
            return Nearest { foot: local, distance_mm };
        }
    }
    search(path, point_mm, &window, window.contains(local.s_mm).then_some(local), cursor)
}

/// One or two stretches of arc length (two where a closed path's window goes through its seam).
struct Window {
    parts: [(f64, f64); 2],
    count: usize,
}

impl Window {
    fn new<const D: usize>(path: &dyn Path<D>, around: f64, reach: f64) -> Self {
        let length = path.length_mm();
        let (low, high) = (around - reach, around + reach);
        let one = |low: f64, high: f64| Self { parts: [(low, high), (0.0, 0.0)], count: 1 };
        if !path.is_closed() {
            one(low.clamp(0.0, length), high.clamp(0.0, length))
        } else if !(high - low < length) {
            one(0.0, length)
        } else if low < 0.0 {
            Self { parts: [(0.0, high.max(0.0)), (low + length, length)], count: 2 }
        } else if high > length {
            Self { parts: [(low.min(length), length), (0.0, high - length)], count: 2 }
        } else {
            one(low, high)
        }
    }

    fn parts(&self) -> &[(f64, f64)] {
        &self.parts[..self.count]
    }

    fn span(&self) -> f64 {
        self.parts().iter().map(|(low, high)| high - low).sum()
    }

    fn contains(&self, s: f64) -> bool {
        self.parts().iter().any(|&(low, high)| (low..=high).contains(&s))
    }

    fn curvature_bound<const D: usize>(&self, path: &dyn Path<D>) -> f64 {
        self.parts().iter().map(|&(low, high)| path.curvature_bound_1_mm(low, high)).fold(0.0, f64::max)
    }
}

/// Branch and bound over the window, best bound first by halving from a coarse division on.
fn search<const D: usize>(
    path: &dyn Path<D>,
    point: &SVector<f64, D>,
    window: &Window,
    start: Option<Foot<D>>,
    cursor: &mut Cursor,
) -> Nearest<D> {
    let mut best: Option<Nearest<D>> = None;
    let mut best_cursor = *cursor;
    let offer = |foot: Foot<D>, at: Cursor, best: &mut Option<Nearest<D>>, best_cursor: &mut Cursor| {
        let distance_mm = (foot.point_mm - point).norm();
        if best.as_ref().is_none_or(|b| distance_mm < b.distance_mm) {
            *best = Some(Nearest { foot, distance_mm });
            *best_cursor = at;
        }
    };
    if let Some(foot) = start {
        offer(foot, *cursor, &mut best, &mut best_cursor);
    }
    for &(low, high) in window.parts() {
        for s in [low, high] {
            let frame = path.frame(s, cursor);
            offer(frame.into(), *cursor, &mut best, &mut best_cursor);
        }
    }
    // A stack of pieces still to be settled. Halving keeps it as shallow as the number of halvings.
    let mut stack: Vec<(f64, f64)> = window.parts().to_vec();
    if !point.iter().all(|x| x.is_finite()) {
        stack.clear();
    }
    while let Some((low, high)) = stack.pop() {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let frame = path.frame(middle, cursor);
        offer(frame.into(), *cursor, &mut best, &mut best_cursor);
        let near = best.as_ref().map_or(f64::INFINITY, |b| b.distance_mm);
        let away = frame.point_mm - point;
        let distance = away.norm();
        if distance - half >= near - SMALLEST_MM || half < SMALLEST_MM {
            continue;
        }
        let kappa = path.curvature_bound_1_mm(low, high);
        let slope = away.dot(&frame.tangent);
        let bend = (kappa * (distance + half) - 1.0).max(0.0);
        let lowest_square = distance * distance - 2.0 * slope.abs() * half - bend * half * half;
        let target = (near - SMALLEST_MM).max(0.0);
        if lowest_square >= target * target {
            continue;
        }
        if (distance + half) * kappa < 1.0 {
            // Convex: one minimum, inside or at an end of the piece.
            let foot = path.nearest_local(point, cursor);
            if (low..=high).contains(&foot.s_mm) {
                offer(foot, *cursor, &mut best, &mut best_cursor);
                continue;
            }
            // The minimum lies outside: the nearer end is the nearest point of the piece.
            for s in [low, high] {
                let frame = path.frame(s, cursor);
                offer(frame.into(), *cursor, &mut best, &mut best_cursor);
            }
            continue;
        }
        stack.push((low, middle));
        stack.push((middle, high));
    }
    *cursor = best_cursor;
    // The window always has an end, so that something was offered; a point that is not a number has no nearest one.
    best.unwrap_or_else(|| {
        let frame = path.frame(window.parts[0].0, cursor);
        Nearest { foot: frame.into(), distance_mm: (frame.point_mm - point).norm() }
    })
}
