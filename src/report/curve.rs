//! Polylines on their way to the figure: thinned to what can be seen, clipped to their subplot, dashed.

/// A point on the figure \[px\], y downwards.
pub(super) type Px = (f64, f64);

/// Thinning never moves a line by more than this \[px\].
const TOLERANCE_PX: f64 = 0.06;
/// Or, for a tangle of more than [`MANY`] points, by more than this \[px\].
const COARSE_PX: f64 = 0.5;
const MANY: usize = 20_000;
/// Of a curve over time the first, lowest, highest and last point of every column this wide are kept \[px\].
const COLUMN_PX: f64 = 0.25;
/// Points simplified at a time; bounds the work on the worst of curves.
const CHUNK: usize = 2000;
/// A curve of more dashes than this is drawn solid.
const MOST_DASHES: usize = 4000;

/// Leaves out the points that make no visible difference.
pub(super) fn thinned(points: &[Px]) -> Vec<Px> {
    let over_time = points.is_sorted_by(|a, b| a.0 <= b.0);
    let points = if over_time { columns(points) } else { points.to_vec() };
    let kept = simplified(&points, TOLERANCE_PX);
    if kept.len() > MANY { simplified(&kept, COARSE_PX) } else { kept }
}

/// Douglas-Peucker, chunk by chunk.
fn simplified(points: &[Px], tolerance: f64) -> Vec<Px> {
    let mut kept = Vec::with_capacity(points.len().min(4096));
    let mut rest = points;
    while rest.len() > 1 {
        let (chunk, _) = rest.split_at(rest.len().min(CHUNK));
        simplify(chunk, tolerance, &mut kept);
        rest = &rest[chunk.len() - 1..];
    }
    kept.extend(rest.last());
    kept
}

/// First, lowest, highest and last point of every column, in their order.
fn columns(points: &[Px]) -> Vec<Px> {
    let mut out = Vec::new();
    for column in points.chunk_by(|a, b| (a.0 / COLUMN_PX).floor() == (b.0 / COLUMN_PX).floor()) {
        if column.len() <= 4 {
            out.extend_from_slice(column);
            continue;
        }
        let index = |better: fn(f64, f64) -> bool| {
            (0..column.len()).reduce(|best, i| if better(column[i].1, column[best].1) { i } else { best }).unwrap_or(0)
        };
        let mut picked = [0, index(|a, b| a < b), index(|a, b| a > b), column.len() - 1];
        picked.sort_unstable();
        let mut last = None;
        for i in picked {
            if last != Some(i) {
                out.push(column[i]);
            }
            last = Some(i);
        }
    }
    out
}

/// One chunk; its last point is left to the next.
fn simplify(points: &[Px], tolerance: f64, kept: &mut Vec<Px>) {
    let Some(end) = points.len().checked_sub(1) else { return };
    // A stack of open intervals, the leftmost on top.
    let mut stack = vec![(0, end)];
    while let Some((from, to)) = stack.pop() {
        let farthest = (from + 1..to)
            .map(|i| (i, distance_to_segment(points[i], points[from], points[to])))
            .fold((from, 0.0), |best, next| if next.1 > best.1 { next } else { best });
        if farthest.1 > tolerance {
            stack.push((farthest.0, to));
            stack.push((from, farthest.0));
        } else {
            kept.push(points[from]);
        }
    }
}

/// Distance of `p` to the segment from `a` to `b`.
pub(super) fn distance_to_segment(p: Px, a: Px, b: Px) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    length((p.0 - a.0 - along * dx, p.1 - a.1 - along * dy))
}

pub(super) fn length(v: Px) -> f64 {
    (v.0 * v.0 + v.1 * v.1).sqrt()
}

/// A rectangle on the figure \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    /// Whether `self` lies within `outer`.
    pub(super) fn is_within(&self, outer: &Self) -> bool {
        self.left >= outer.left && self.right <= outer.right && self.top >= outer.top && self.bottom <= outer.bottom
    }

    /// The part of the segment inside (Liang and Barsky).
    pub(super) fn clip(&self, a: Px, b: Px) -> Option<(Px, Px)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (step, room) in
            [(-dx, a.0 - self.left), (dx, self.right - a.0), (-dy, a.1 - self.top), (dy, self.bottom - a.1)]
        {
            if step == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if step < 0.0 {
                from = from.max(room / step);
            } else {
                to = to.min(room / step);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (from <= to).then(|| (if from > 0.0 { at(from) } else { a }, if to < 1.0 { at(to) } else { b }))
    }

    /// The pieces of a polyline inside.
    pub(super) fn clipped(&self, points: &[Px]) -> Vec<Vec<Px>> {
        let mut pieces: Vec<Vec<Px>> = Vec::new();
        let mut open: Option<Px> = None;
        for pair in points.windows(2) {
            let Some((a, b)) = self.clip(pair[0], pair[1]) else {
                open = None;
                continue;
            };
            match (open, pieces.last_mut()) {
                (Some(end), Some(piece)) if end == a => piece.push(b),
                _ => pieces.push(vec![a, b]),
            }
            open = Some(b);
        }
        pieces
    }
}

/// A dash pattern \[px\]: nothing for the `lead`, then `on` drawn and `off` not, again and again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dash {
    pub(super) lead: f64,
    pub(super) on: f64,
    pub(super) off: f64,
}

impl Dash {
    pub(super) const fn new(on: f64, off: f64) -> Self {
        Self { lead: 0.0, on, off }
    }
}

/// The dashes of a polyline.
pub(super) fn dashed(points: &[Px], dash: Dash) -> Vec<Vec<Px>> {
    let Dash { lead, on, off } = dash;
    let total: f64 = points.windows(2).map(|p| length((p[1].0 - p[0].0, p[1].1 - p[0].1))).sum();
    if total / (on + off) > MOST_DASHES as f64 {
        return vec![points.to_vec()];
    }
    let mut dashes = Vec::new();
    let mut dash: Vec<Px> = points.first().copied().into_iter().collect();
    let (mut drawing, mut left) = if lead > 0.0 { (false, lead) } else { (true, on) };
    for pair in points.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        let mut rest = length((b.0 - a.0, b.1 - a.1));
        while rest > left {
            let t = left / rest;
            a = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            rest -= left;
            dash.push(a);
            if drawing {
                dashes.push(std::mem::take(&mut dash));
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
            dash = vec![a];
        }
        left -= rest;
        dash.push(b);
    }
    if drawing && dash.len() > 1 {
        dashes.push(dash);
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_spike_and_both_ends() {
        let noisy: Vec<Px> = (0..50_000)
            .map(|i| (f64::from(i) * 0.02, if i % 977 == 0 { 300.0 } else { f64::from(i * 7919 % 13) }))
            .collect();
        let thin = thinned(&noisy);
        assert!(thin.len() < 17_000, "{}", thin.len());
        assert_eq!((thin.first(), thin.last()), (noisy.first(), noisy.last()));
        let spikes = |points: &[Px]| points.iter().filter(|p| p.1 == 300.0).count();
        assert_eq!(spikes(&thin), spikes(&noisy));
    }

    #[test]
    fn a_smooth_curve_needs_few_points_and_does_not_move() {
        let arc: Vec<Px> = (0..=20_000)
            .map(|i| f64::from(i) * std::f64::consts::TAU / 20_000.0)
            .map(|a| (500.0 + 300.0 * a.cos(), 400.0 + 300.0 * a.sin()))
            .collect();
        let thin = thinned(&arc);
        assert!(thin.len() < 400, "{}", thin.len());
        for p in &arc {
            let gap = thin.windows(2).map(|w| distance_to_segment(*p, w[0], w[1])).fold(f64::INFINITY, f64::min);
            assert!(gap <= 1.01 * TOLERANCE_PX, "{gap}");
        }
    }

    #[test]
    fn thinning_takes_any_number_of_points() {
        for n in [0_u32, 1, 2, 3, 5, 1999, 2000, 2001, 4000] {
            let line: Vec<Px> = (0..n).map(|i| (f64::from(i), 2.0)).collect();
            let thin = thinned(&line);
            assert_eq!((thin.first(), thin.last()), (line.first(), line.last()), "{n}");
        }
    }

    #[test]
    fn clipping_cuts_at_the_frame() {
        let frame = Frame { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };
        let pieces = frame.clipped(&[(-5.0, 5.0), (5.0, 5.0), (5.0, 50.0), (8.0, 50.0), (8.0, -1e90)]);
        assert_eq!(pieces, vec![vec![(0.0, 5.0), (5.0, 5.0), (5.0, 10.0)], vec![(8.0, 10.0), (8.0, 0.0)]]);
    }

    #[test]
    fn dashes_cover_their_share() {
        let dashes = dashed(&[(0.0, 0.0), (50.0, 0.0), (50.0, 50.0)], Dash::new(6.0, 4.0));
        let drawn: f64 =
            dashes.iter().flat_map(|d| d.windows(2).map(|p| length((p[1].0 - p[0].0, p[1].1 - p[0].1)))).sum();
        assert!((drawn - 60.0).abs() < 1e-9, "{drawn}");
        assert_eq!(dashed(&[(0.0, 0.0), (1e9, 0.0)], Dash::new(6.0, 4.0)).len(), 1);
    }
}
