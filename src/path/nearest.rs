//! The nearest point of a path within a window of arc length, proven to be the nearest one.
//!
//! Distance is 1-Lipschitz in arc length, and half its square, `f(s) = |r(s) - p|²/2`, has `f'' = 1 + (r - p)·k`. Two metadata
//! follow, with `κ` a bound of the curvature on an interval:
//!
//! - where `|r - p| κ < 1` on the whole interval, `f` is convex: a local minimum is the only one;
//! - with `m` the middle of an interval of half-length `h` and `D` a bound of `|r - p|` on it,
//!   `f(s) ≥ f(m) - |f'(m)| h - ½ max(0, κ D - 1) h²`: an interval whose bound is above the best distance found holds no
//!   nearer point. `D` is the smaller of `d + h` and `√(d² + 2 |f'(m)| h + (1 + κ(d + h)) h²)`, `d = |r(m) - p|`.
//!
//! The common case (a servo error far below the radius of curvature) is settled by the first fact after a few Newton steps.
//! Else the window is halved by branch and bound, the piece with the lowest bound first, until every piece is settled by one
//! of them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::SVector;

use super::{Cursor, Foot, Frame, Path};

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
/// On a closed path the window goes through the seam. `around_mm` is clamped to the path (a closed one: taken modulo its length);
/// a window that is not a number is the whole path. The distance is that of the true nearest point within 1e-9 mm; of a point
/// that is not finite it is not a finite number.
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
        if (furthest * path.max_curvature_1_mm() < 1.0 || furthest * window.curvature_bound(path) < 1.0)
            && is_foot(path, &local, point_mm)
        {
            return Nearest { foot: local, distance_mm };
        }
    }
    search(path, point_mm, &window, window.contains(local.s_mm).then_some(local), cursor)
}

/// Whether the distance is stationary at `foot`, or falls towards the end of the open path that it is.
fn is_foot<const D: usize>(path: &dyn Path<D>, foot: &Foot<D>, point: &SVector<f64, D>) -> bool {
    // Half the squared distance is wrong by the square of the slope: far less than asked for.
    const FLAT_MM: f64 = 1e-9;
    let slope = (foot.point_mm - point).dot(&foot.tangent);
    let open = !path.is_closed();
    slope.abs() <= FLAT_MM
        || (open && slope > 0.0 && foot.s_mm <= 0.0)
        || (open && slope < 0.0 && foot.s_mm >= path.length_mm())
}

/// One or two stretches of arc length (two where a closed path's window goes through its seam).
struct Window {
    parts: [(f64, f64); 2],
    count: usize,
}

impl Window {
    fn new<const D: usize>(path: &dyn Path<D>, around: f64, reach: f64) -> Self {
        let length = path.length_mm();
        let one = |low: f64, high: f64| Self { parts: [(low, high), (0.0, 0.0)], count: 1 };
        if !(around.is_finite() && reach >= 0.0) {
            return one(0.0, length);
        }
        let around = if path.is_closed() && !(0.0..=length).contains(&around) {
            around.rem_euclid(length)
        } else {
            around.clamp(0.0, length)
        };
        let (low, high) = (around - reach, around + reach);
        if !path.is_closed() {
            one(low.max(0.0), high.min(length))
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

/// A piece of the window with what is known of it.
struct Piece {
    low: f64,
    high: f64,
    /// No point of the piece is nearer than this \[mm\].
    bound: f64,
    convex: bool,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    /// The greatest is the one with the lowest bound: that is what the heap gives first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then(other.low.total_cmp(&self.low))
    }
}

/// The best point so far, and what the search looks at.
struct Search<'a, const D: usize> {
    path: &'a dyn Path<D>,
    point: &'a SVector<f64, D>,
    cursor: Cursor,
    best: Nearest<D>,
    best_cursor: Cursor,
}

impl<const D: usize> Search<'_, D> {
    /// Offers a frame that the cursor stands on as the nearest one; returns its distance.
    fn offer(&mut self, frame: Frame<D>) -> f64 {
        let distance_mm = (frame.point_mm - self.point).norm();
        if distance_mm < self.best.distance_mm {
            self.best = Nearest { foot: frame.into(), distance_mm };
            self.best_cursor = self.cursor;
        }
        distance_mm
    }

    fn visit(&mut self, s: f64) -> Frame<D> {
        let frame = self.path.frame(s, &mut self.cursor);
        self.offer(frame);
        frame
    }

    /// The piece between two arc lengths, its middle offered.
    fn piece(&mut self, low: f64, high: f64) -> Piece {
        let half = 0.5 * (high - low);
        let frame = self.path.frame(0.5 * (low + high), &mut self.cursor);
        let distance = self.offer(frame);
        let kappa = self.path.curvature_bound_1_mm(low, high);
        let slope = (frame.point_mm - self.point).dot(&frame.tangent).abs();
        let square = distance * distance;
        let furthest_square = square + half * (2.0 * slope + (1.0 + kappa * (distance + half)) * half);
        let furthest = (distance + half).min(furthest_square.sqrt());
        let bend = (kappa * furthest - 1.0).max(0.0);
        let lowest_square = square - half * (2.0 * slope + bend * half);
        let bound = (distance - half).max(lowest_square.max(0.0).sqrt());
        Piece { low, high, bound, convex: kappa * furthest < 1.0 }
    }

    /// Offers the nearest point of a piece on which half the squared distance is convex: Newton on its derivative, kept inside
    /// a shrinking bracket.
    fn settle(&mut self, piece: &Piece) {
        let (mut low, mut high) = (piece.low, piece.high);
        let slope = |frame: &Frame<D>, point: &SVector<f64, D>| (frame.point_mm - point).dot(&frame.tangent);
        let first = self.visit(low);
        if slope(&first, self.point) >= 0.0 {
            return;
        }
        let last = self.visit(high);
        if slope(&last, self.point) <= 0.0 {
            return;
        }
        let mut s = 0.5 * (low + high);
        for _ in 0..60 {
            let frame = self.visit(s);
            let away = frame.point_mm - self.point;
            let rise = slope(&frame, self.point);
            if rise < 0.0 {
                low = s
            } else {
                high = s
            }
            let newton = s - rise / (1.0 + away.dot(&frame.curvature_1_mm));
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - s).abs() <= SMALLEST_MM {
                return;
            }
            s = next;
        }
    }
}

/// Branch and bound over the window, the piece with the lowest bound first.
fn search<const D: usize>(
    path: &dyn Path<D>,
    point: &SVector<f64, D>,
    window: &Window,
    start: Option<Foot<D>>,
    cursor: &mut Cursor,
) -> Nearest<D> {
    let foot = start.unwrap_or_else(|| path.frame(window.parts[0].0, cursor).into());
    let best = Nearest { foot, distance_mm: (foot.point_mm - point).norm() };
    let best_cursor = *cursor;
    let mut search = Search { path, point, cursor: *cursor, best, best_cursor };
    let mut heap = BinaryHeap::new();
    // A point that is not a number, or out of all reach, has no nearest one.
    if best.distance_mm.is_finite() {
        for &(low, high) in window.parts() {
            search.visit(low);
            search.visit(high);
            heap.push(search.piece(low, high));
        }
    }
    while let Some(piece) = heap.pop() {
        // Every other piece has a higher bound.
        if !(piece.bound < search.best.distance_mm - SMALLEST_MM) {
            break;
        }
        if piece.convex {
            search.settle(&piece);
        } else if piece.high - piece.low >= 2.0 * SMALLEST_MM {
            let middle = 0.5 * (piece.low + piece.high);
            for (low, high) in [(piece.low, middle), (middle, piece.high)] {
                let half = search.piece(low, high);
                if half.bound < search.best.distance_mm - SMALLEST_MM {
                    heap.push(half);
                }
            }
        }
    }
    *cursor = search.best_cursor;
    search.best
}
