//! The optimisation problem: `q` as a quadratic spline, its limits as functions of three neighbouring coefficients each.

use super::limits::{AxisLimited, PathShape};
use super::verify::Share;
use crate::feedrate::FeedrateError;
use crate::feedrate::planned::{INSET, Node, Planned};
use crate::parameters::OutOfRange;

/// Gauss-Legendre points and weights on `[0, 1]`, degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// What a motion that is at its jerk limit throughout costs beside its time, as a share of it.
///
/// Limits at the points leave coefficients free to alternate above and below them, and the time hardly tells: of motions that are
/// about equally fast the one with the least jerk is taken.
const ROUGHNESS: f64 = 1e-4;

/// Largest share by which the planned motion may slow down in the end instead of one more round.
pub(super) const TOLERANCE: f64 = 2e-4;

/// `q` between the second and the last but one point of the grid, and the limits that it has to keep.
#[derive(Debug, Clone)]
pub(super) struct Program<const D: usize> {
    planner: AxisLimited<D>,
    /// The whole grid; the spline's points are the inner ones.
    grid: Vec<f64>,
    points: Vec<Point<D>>,
    spans: Vec<Span<D>>,
    /// The coefficients at both ends are these shares of their neighbours: `q' = 4q/(3δ)` where the motion of constant jerk ends.
    tie: [f64; 2],
}

/// An inner point of the grid: `q = here c_k + next c_{k+1}`, `q'/2 = slope (c_{k+1} - c_k)`.
#[derive(Debug, Clone)]
struct Point<const D: usize> {
    here: f64,
    next: f64,
    slope: f64,
    /// Share of the length in the integral of `1/√q`.
    weight: f64,
    most: f64,
    tangent: [f64; D],
    curvature: [f64; D],
    acceleration: [f64; D],
}

/// An interval between inner points, and how the path runs just inside both of its ends.
#[derive(Debug, Clone)]
struct Span<const D: usize> {
    h: f64,
    /// What its jerk costs: this times `(q''/2)²`, `ε ∫ (v q''/2j)² dt`.
    roughness: f64,
    ends: [PathShape<D>; 2],
    jerk: [f64; D],
}

/// A limit `value ≥ 0` and its derivatives by the coefficients from `first` on.
pub(super) struct Limit {
    pub(super) index: usize,
    pub(super) first: usize,
    pub(super) by: [f64; 3],
    pub(super) value: f64,
}

impl<const D: usize> Program<D> {
    pub(super) fn new(
        planner: &AxisLimited<D>,
        grid: Vec<f64>,
        shape: &mut impl FnMut(f64) -> PathShape<D>,
    ) -> Result<Self, FeedrateError> {
        let few = FeedrateError::OutOfRange(OutOfRange::new("grid points", grid.len() as f64, "5 or more"));
        let inner = match grid.get(1..grid.len().saturating_sub(1)) {
            Some(inner) if inner.len() >= 3 => inner,
            _ => return Err(few),
        };
        let lengths: Vec<f64> = inner.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let first = inner[0];
        let last = grid[grid.len() - 1] - inner[inner.len() - 1];
        let limits = &planner.limits;
        let mut points = Vec::with_capacity(inner.len());
        let mut spans: Vec<Span<D>> = Vec::with_capacity(lengths.len());
        for (k, &s) in inner.iter().enumerate() {
            let before = if k == 0 { 0.0 } else { lengths[k - 1] };
            let after = lengths.get(k).copied().unwrap_or(0.0);
            let at = shape(s);
            let mut most = planner.feed_mm_s.map_or(f64::INFINITY, |feed| feed * feed);
            for i in 0..D {
                let fastest = limits.velocity_mm_s[i] / at.tangent[i].abs();
                most = most.min(fastest * fastest);
                // From rest to here, or from here to rest, with constant jerk j: q = (9 j δ²/2)^(2/3).
                for (end, delta) in [(0, first), (inner.len() - 1, last)] {
                    if k == end {
                        let q = libm::cbrt(4.5 * limits.jerk_mm_s3[i] / at.tangent[i].abs() * delta * delta);
                        most = most.min(q * q);
                    }
                }
            }
            points.push(Point {
                here: after / (before + after),
                next: before / (before + after),
                slope: 1.0 / (before + after),
                weight: 0.5 * (before + after),
                most,
                tangent: at.tangent,
                curvature: at.curvature_1_mm,
                acceleration: limits.acceleration_mm_s2,
            });
            if let Some(next) = inner.get(k + 1) {
                let inset = INSET * after;
                let ends = [shape(s + inset), shape(next - inset)];
                spans.push(Span { h: after, roughness: 0.0, ends, jerk: limits.jerk_mm_s3 });
            }
        }
        // The last point has no coefficient of its own interval: it lies on the last coefficient.
        if let Some(end) = points.last_mut() {
            (end.here, end.next) = (0.0, 1.0);
        }
        let tie = [(lengths[0], first), (lengths[lengths.len() - 1], last)]
            .map(|(h, delta)| 1.0 / (1.0 + 2.0 * h / (3.0 * delta)));
        // No faster than from rest to rest with the jerk alone.
        let length = grid[grid.len() - 1];
        for (span, ends) in spans.iter_mut().zip(points.windows(2)) {
            let along = |shape: &PathShape<D>| {
                let of = |i: usize| shape.tangent[i].abs() / limits.jerk_mm_s3[i];
                (0..D).map(of).fold(0.0, f64::max)
            };
            let jerk = along(&span.ends[0]).max(along(&span.ends[1])).recip();
            let speed = ends[0].most.min(ends[1].most).sqrt().min(2.0 * length / libm::cbrt(32.0 * length / jerk));
            span.roughness = ROUGHNESS * span.h * speed / (jerk * jerk);
        }
        let program = Self { planner: *planner, grid, points, spans, tie };
        for (end, shapes) in program.spans.iter().enumerate() {
            let finite = |p: &PathShape<D>| {
                p.tangent.iter().chain(&p.curvature_1_mm).chain(&p.curvature_rate_1_mm2).all(|v| v.abs() <= 1e30)
            };
            if !shapes.ends.iter().all(finite) {
                return Err(FeedrateError::BadShape { s_mm: program.grid[end + 1] });
            }
        }
        Ok(program)
    }

    /// How many coefficients the spline has.
    pub(super) fn coefficients(&self) -> usize {
        self.points.len() + 1
    }

    /// How many limits there are.
    pub(super) fn limits(&self) -> usize {
        self.points.len() * (1 + 2 * D) + self.spans.len() * (1 + 4 * D)
    }

    /// Sets the outer coefficients, which are no unknowns.
    pub(super) fn close(&self, c: &mut [f64]) {
        let n = c.len();
        c[0] = self.tie[0] * c[1];
        c[n - 1] = self.tie[1] * c[n - 2];
    }

    /// Derivatives by the unknowns: what an outer coefficient does is its neighbour's doing.
    #[inline]
    fn tied(&self, first: usize, mut by: [f64; 3]) -> [f64; 3] {
        if first == 0 {
            by[1] += by[0] * self.tie[0];
            by[0] = 0.0;
        }
        if first + 3 == self.points.len() + 1 {
            by[1] += by[2] * self.tie[1];
            by[2] = 0.0;
        }
        by
    }

    /// A first point, well inside the limits: constant but for its ends.
    pub(super) fn start(&self) -> Vec<f64> {
        let scale = self.planner.scale();
        let mut most = scale.speed * scale.speed;
        for point in &self.points[1..self.points.len() - 1] {
            most = most.min(point.most);
            for i in 0..D {
                most = most.min(point.acceleration[i] / point.curvature[i].abs());
            }
        }
        for span in &self.spans {
            for end in &span.ends {
                for i in 0..D {
                    let cube = libm::cbrt(span.jerk[i] / end.curvature_rate_1_mm2[i].abs());
                    most = most.min(cube * cube);
                }
            }
        }
        let length = self.grid[self.grid.len() - 1];
        let speed = most.sqrt();
        let rise = (2.0 * speed * (speed / scale.jerk).sqrt() + speed * speed / scale.accel).min(0.25 * length);
        let n = self.coefficients();
        // The coefficient k belongs to the middle between the points k-1 and k.
        let place = |k: usize| {
            let at = |i: usize| self.grid[i.clamp(1, self.grid.len() - 2)];
            0.5 * (at(k) + at(k + 1))
        };
        let mut c: Vec<f64> = (0..n)
            .map(|k| {
                let s = place(k);
                let y = s * (length - s) / (length * rise);
                let root = libm::cbrt(y / (1.0 + y));
                0.5 * most * (root * root) * (root * root)
            })
            .collect();
        self.close(&mut c);
        c
    }

    /// `q` and `q'/2` at an inner point.
    #[inline]
    fn state(&self, k: usize, c: &[f64]) -> (f64, f64) {
        let point = &self.points[k];
        (point.here * c[k] + point.next * c[k + 1], point.slope * (c[k + 1] - c[k]))
    }

    /// `q''/2` of an interval by the coefficients from its own on.
    #[inline]
    fn bend(&self, k: usize) -> [f64; 3] {
        let (p0, p1) = (&self.points[k], &self.points[k + 1]);
        let h = self.spans[k].h;
        [p0.slope / h, -(p0.slope + p1.slope) / h, p1.slope / h]
    }

    /// The time `Σ h/√q` and what the jerk costs, with first and second derivatives by the unknowns.
    pub(super) fn time(&self, c: &[f64], mut see: impl FnMut(usize, [f64; 3], f64, f64)) -> f64 {
        let mut time = 0.0;
        let last = self.points.len() - 1;
        for (k, point) in self.points.iter().enumerate() {
            let (q, _) = self.state(k, c);
            let root = 1.0 / q.sqrt();
            time += point.weight * root;
            let (first, by) =
                if k == last { (k - 1, [0.0, point.here, point.next]) } else { (k, [point.here, point.next, 0.0]) };
            let slope = -0.5 * point.weight * root / q;
            see(first, self.tied(first, by), slope, -1.5 * slope / q);
        }
        for (k, span) in self.spans.iter().enumerate() {
            let by = self.bend(k);
            let bend = by[0] * c[k] + by[1] * c[k + 1] + by[2] * c[k + 2];
            time += span.roughness * bend * bend;
            see(k, self.tied(k, by), 2.0 * span.roughness * bend, 2.0 * span.roughness);
        }
        time
    }

    /// The smallest `q` of a change: how far it can be gone until a `q` vanishes.
    pub(super) fn room(&self, c: &[f64], change: &[f64]) -> f64 {
        let mut room = f64::INFINITY;
        for k in 0..self.points.len() {
            let (q, dq) = (self.state(k, c).0, self.state(k, change).0);
            if dq < 0.0 {
                room = room.min(-q / dq);
            }
        }
        room
    }

    /// Shows every limit.
    #[inline]
    pub(super) fn each_limit(&self, c: &[f64], mut see: impl FnMut(Limit)) {
        let last = self.points.len() - 1;
        let mut index = 0;
        for (k, point) in self.points.iter().enumerate() {
            let (q, a) = self.state(k, c);
            let shift = usize::from(k == last);
            let first = k - shift;
            let row = |on_q: f64, on_a: f64| {
                let here = on_q * point.here - on_a * point.slope;
                let next = on_q * point.next + on_a * point.slope;
                self.tied(first, if shift == 1 { [0.0, here, next] } else { [here, next, 0.0] })
            };
            see(Limit { index, first, by: row(-1.0, 0.0), value: point.most - q });
            index += 1;
            for i in 0..D {
                let (t, curve, most) = (point.tangent[i], point.curvature[i], point.acceleration[i]);
                let accel = curve * q + t * a;
                let by = row(curve, t);
                see(Limit { index, first, by: by.map(|v| -v), value: most - accel });
                see(Limit { index: index + 1, first, by, value: most + accel });
                index += 2;
            }
        }
        for (k, span) in self.spans.iter().enumerate() {
            let (p0, p1) = (&self.points[k], &self.points[k + 1]);
            // `q` lies between its coefficients: where they keep a constant limit it is kept between the points too, and no
            // coefficients above and below it alternate.
            see(Limit { index, first: k, by: [0.0, -1.0, 0.0], value: p0.most.max(p1.most) - c[k + 1] });
            index += 1;
            let (q0, a0) = self.state(k, c);
            let (q1, a1) = self.state(k + 1, c);
            let b = (a1 - a0) / span.h;
            let by_b = self.bend(k);
            let by_q = [[p0.here, p0.next, 0.0], [0.0, p1.here, p1.next]];
            let by_a = [[-p0.slope, p0.slope, 0.0], [0.0, -p1.slope, p1.slope]];
            for (end, (q, a)) in [(q0, a0), (q1, a1)].into_iter().enumerate() {
                let shape = &span.ends[end];
                let root = 1.0 / q.sqrt();
                let fall = -0.5 * root / q;
                for i in 0..D {
                    let (t, curve, rate) = (shape.tangent[i], shape.curvature_1_mm[i], shape.curvature_rate_1_mm2[i]);
                    let value = rate * q + 3.0 * curve * a + t * b;
                    let most = span.jerk[i] * root;
                    let by: [f64; 3] =
                        std::array::from_fn(|n| rate * by_q[end][n] + 3.0 * curve * by_a[end][n] + t * by_b[n]);
                    let by_most: [f64; 3] = std::array::from_fn(|n| span.jerk[i] * fall * by_q[end][n]);
                    let less = self.tied(k, std::array::from_fn(|n| by_most[n] - by[n]));
                    let more = self.tied(k, std::array::from_fn(|n| by_most[n] + by[n]));
                    see(Limit { index, first: k, by: less, value: most - value });
                    see(Limit { index: index + 1, first: k, by: more, value: most + value });
                    index += 2;
                }
            }
        }
    }

    /// Takes off the limits what the motion passes them by.
    pub(super) fn tighten(&mut self, shares: &[Share]) {
        let over = |share: f64| if share > 1.0 { share * (1.0 + 0.2 * TOLERANCE) } else { 1.0 };
        let last = self.points.len() - 1;
        for (interval, share) in shares.iter().enumerate() {
            let (velocity, acceleration, jerk) = (over(share.velocity), over(share.acceleration), over(share.jerk));
            // The grid's interval lies between the inner points interval - 1 and interval.
            for k in [interval.saturating_sub(1), interval.min(last)] {
                if let Some(point) = self.points.get_mut(k) {
                    point.most /= velocity * velocity;
                    point.acceleration.iter_mut().for_each(|most| *most /= acceleration);
                }
            }
            if let Some(span) = interval.checked_sub(1).and_then(|k| self.spans.get_mut(k)) {
                span.jerk.iter_mut().for_each(|most| *most /= jerk);
            } else if let Some(point) = self.points.get_mut(if interval == 0 { 0 } else { last }) {
                point.most /= libm::cbrt(jerk * jerk);
            }
        }
    }

    /// The motion that runs through the grid as these coefficients of `q` say.
    pub(super) fn motion(&self, c: &[f64]) -> Planned {
        let n = self.grid.len();
        let mut nodes: Vec<Node> = Vec::with_capacity(n);
        let mut here = Node::default();
        for k in 0..self.points.len() {
            let (q, a) = self.state(k, c);
            let s = self.grid[k + 1];
            here.dt = if k == 0 {
                3.0 * s / q.sqrt()
            } else {
                let (q0, a0) = self.state(k - 1, c);
                let h = self.spans[k - 1].h;
                let least = 0.01 * q0.min(q);
                let slowness =
                    GAUSS.map(|(x, weight)| weight / (q0 + h * x * (2.0 * a0 + (a - a0) * x)).max(least).sqrt());
                h * slowness.iter().sum::<f64>()
            };
            nodes.push(here);
            here = Node { t: here.t + here.dt, dt: 0.0, s, v: q.sqrt(), a };
        }
        let (end, before) = (self.grid[n - 1], self.grid[n - 2]);
        here.dt = 3.0 * (end - before) / here.v;
        nodes.push(here);
        nodes.push(Node { t: here.t + here.dt, dt: 0.0, s: end, v: 0.0, a: 0.0 });
        Planned::new(nodes)
    }
}
