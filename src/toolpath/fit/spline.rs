//! A clamped B-spline on `[0, 1]` while it is being fitted: least squares with both ends held, projection of points.

use nalgebra::SVector;

use crate::path::nurbs::{MAX_DEGREE, basis};

/// Knots and control points.
#[derive(Debug, Clone)]
pub(super) struct Spline<const D: usize> {
    pub(super) degree: usize,
    pub(super) knots: Vec<f64>,
    pub(super) points: Vec<SVector<f64, D>>,
}

/// Clamped knots around these interior ones.
pub(super) fn clamped(degree: usize, interior: &[f64]) -> Vec<f64> {
    let mut knots = vec![0.0; degree + 1];
    knots.extend_from_slice(interior);
    knots.extend(std::iter::repeat_n(1.0, degree + 1));
    knots
}

impl<const D: usize> Spline<D> {
    /// Least squares: the control points of the curve on `knots` that begins on the first and ends on the last point and makes
    /// `Σ |C(t_k) - Q_k|²` small. The normal equations are a band of `degree` beside the diagonal:
    /// time `O(m p²)`. None where they are singular: a knot interval without points.
    pub(super) fn least_squares(
        degree: usize,
        knots: Vec<f64>,
        data: &[SVector<f64, D>],
        parameters: &[f64],
    ) -> Option<Self> {
        let n = knots.len() - degree - 1;
        let (first, last) = (data[0], data[data.len() - 1]);
        let size = n - 2;
        // Row i of the band: entries (i, i) … (i, i + degree).
        let stride = degree + 1;
        let mut band = vec![0.0; size * stride];
        let mut right = vec![SVector::<f64, D>::zeros(); size];
        let mut span = degree;
        for (&t, q) in parameters.iter().zip(data) {
            // Parameters rise: the next span is this one or near it.
            while span + 1 < n && knots[span + 1] <= t {
                span += 1;
            }
            if t < knots[span] {
                span = basis::span(degree, &knots, t);
            }
            let row = basis::values(degree, &knots, span, t);
            let base = span - degree;
            let mut target = *q;
            if base == 0 {
                target -= first * row[0];
            }
            if base + degree == n - 1 {
                target -= last * row[degree];
            }
            for a in 0..=degree {
                let i = base + a;
                if i == 0 || i == n - 1 {
                    continue;
                }
                let wa = row[a];
                right[i - 1] += target * wa;
                let end = (degree - a).min(size - i);
                for b in 0..=end {
                    band[(i - 1) * stride + b] += wa * row[a + b];
                }
            }
        }
        cholesky(&mut band, degree, &mut right)?;
        let mut points = Vec::with_capacity(n);
        points.push(first);
        points.extend(right);
        points.push(last);
        Some(Self { degree, knots, points })
    }

    pub(super) fn point(&self, t: f64) -> SVector<f64, D> {
        let span = basis::span(self.degree, &self.knots, t);
        let row = basis::values(self.degree, &self.knots, span, t);
        let local = self.points[span - self.degree..=span].iter().zip(&row);
        local.fold(SVector::zeros(), |sum, (point, n)| sum + point * *n)
    }

    /// Point and derivatives, orders `0 … K-1`.
    pub(super) fn evaluate<const K: usize>(&self, t: f64) -> [SVector<f64, D>; K] {
        let span = basis::span(self.degree, &self.knots, t);
        let rows = basis::derivatives::<K>(self.degree, &self.knots, span, t);
        let local = &self.points[span - self.degree..=span];
        let mut out = [SVector::zeros(); K];
        for (out, row) in out.iter_mut().zip(&rows) {
            for (point, n) in local.iter().zip(row) {
                *out += point * *n;
            }
        }
        out
    }

    /// The derivative of order `degree`, constant on each span, at `t`.
    pub(super) fn derivative_of_highest_order(&self, t: f64) -> SVector<f64, D> {
        let span = basis::span(self.degree, &self.knots, t);
        let rows = basis::derivatives::<{ MAX_DEGREE + 1 }>(self.degree, &self.knots, span, t);
        let local = self.points[span - self.degree..=span].iter().zip(&rows[self.degree]);
        local.fold(SVector::zeros(), |sum, (point, n)| sum + point * *n)
    }

    /// The parameter of the curve's point nearest to `q`, downhill from `t` by at most `steps` Newton steps; and the distance.
    pub(super) fn project(&self, q: &SVector<f64, D>, t: f64, steps: usize) -> (f64, f64) {
        let mut t = t;
        let [mut r, mut r1, mut r2] = self.evaluate::<3>(t);
        let mut square = (r - q).norm_squared();
        for _ in 0..steps {
            let away = r - q;
            let slope = away.dot(&r1);
            let speed = r1.norm_squared();
            let second = speed + away.dot(&r2);
            let mut step = -slope / if second > 0.1 * speed { second } else { speed };
            // 1e-9 of the curve's length and less changes no distance.
            if !(step.abs() > 1e-10) {
                break;
            }
            let mut moved = false;
            for _ in 0..12 {
                let next = (t + step).clamp(0.0, 1.0);
                let [n, n1, n2] = self.evaluate::<3>(next);
                let there = (n - q).norm_squared();
                if there < square {
                    (t, r, r1, r2, square, moved) = (next, n, n1, n2, there, true);
                    break;
                }
                step *= 0.4;
            }
            if !moved {
                break;
            }
        }
        (t, square.sqrt())
    }
}

/// Solves a symmetric positive definite band system in place: row `i` of `band` holds the entries `(i, i) … (i, i + width)`. None
/// where it is singular.
pub(super) fn cholesky<T>(band: &mut [f64], width: usize, right: &mut [T]) -> Option<()>
where
    T: Copy + std::ops::Mul<f64, Output = T> + std::ops::SubAssign + std::ops::MulAssign<f64>,
{
    let stride = width + 1;
    let size = right.len();
    for i in 0..size {
        let (head, tail) = band[i * stride..].split_at_mut(stride);
        let inverse = 1.0 / head[0].sqrt();
        if !(inverse.is_finite() && inverse > 0.0) {
            return None;
        }
        let reach = width.min(size - 1 - i);
        for x in &mut head[..=reach] {
            *x *= inverse;
        }
        right[i] *= inverse;
        let own = right[i];
        for (a, below) in (1..=reach).zip(tail.chunks_exact_mut(stride)) {
            let factor = head[a];
            if factor != 0.0 {
                for (x, y) in below.iter_mut().zip(&head[a..=reach]) {
                    *x -= factor * y;
                }
                right[i + a] -= own * factor;
            }
        }
    }
    for i in (0..size).rev() {
        let row = &band[i * stride..(i + 1) * stride];
        for a in 1..=width.min(size - 1 - i) {
            let other = right[i + a];
            right[i] -= other * row[a];
        }
        right[i] *= 1.0 / row[0];
    }
    Some(())
}
