//! Rational Bezier curves on `[0, 1]`: derivatives, halving, and proven bounds of speed and curvature.
//!
//! With `A = w r` in homogeneous form, `N = A' w - A w'` and `M = w (A' × A'') - w' (A × A'') + w'' (A × A')`,
//!
//! ```text
//! r' = N / w²        r' × r'' = M / w³        κ² = |M|² w⁶ / |N|⁶
//! ```
//!
//! (`w = 1`: `N = r'`, `M = r' × r''`). Numerator and denominator of `κ²` are polynomials `Σ f_i B_i` and `Σ g_i B_i` of one degree;
//! where all `g_i > 0` the quotient is a mean of the `f_i / g_i` with positive weights, and `max f_i / g_i` bounds it. On a
//! circle all of them are equal. Polynomials are kept in scaled Bernstein form, coefficients times their binomials, where a
//! product is a convolution and the quotients stay the same.

use nalgebra::SVector;

use super::MAX_DEGREE;
use super::curve::quotient;

/// Control points and weights (None: all 1) of a Bezier curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bezier<'a, const D: usize> {
    pub(super) points: &'a [SVector<f64, D>],
    pub(super) weights: Option<&'a [f64]>,
}

/// A Bezier curve that owns its control points.
#[derive(Debug, Clone)]
pub(super) struct OwnBezier<const D: usize> {
    pub(super) points: Vec<SVector<f64, D>>,
    pub(super) weights: Option<Vec<f64>>,
}

impl<const D: usize> OwnBezier<D> {
    pub(super) fn view(&self) -> Bezier<'_, D> {
        Bezier { points: &self.points, weights: self.weights.as_deref() }
    }

    /// The halves on `[0, ½]` and `[½, 1]`.
    pub(super) fn halves(mut self) -> (Self, Self) {
        let p = self.points.len() - 1;
        let mut left = self.clone();
        for round in 1..=p {
            for k in 0..=p - round {
                if let Some(w) = &mut self.weights {
                    let weight = 0.5 * (w[k] + w[k + 1]);
                    let share = 0.5 * w[k + 1] / weight;
                    self.points[k] = self.points[k] * (1.0 - share) + self.points[k + 1] * share;
                    w[k] = weight;
                } else {
                    self.points[k] = (self.points[k] + self.points[k + 1]) * 0.5;
                }
            }
            left.points[round] = self.points[0];
            if let (Some(left), Some(own)) = (&mut left.weights, &self.weights) {
                left[round] = own[0];
            }
        }
        (left, self)
    }
}

impl<const D: usize> Bezier<'_, D> {
    fn degree(&self) -> usize {
        self.points.len() - 1
    }

    /// Point and derivatives with respect to the parameter, orders `0 … K-1`.
    #[inline]
    pub(super) fn derivatives<const K: usize>(&self, x: f64) -> [SVector<f64, D>; K] {
        let p = self.degree();
        // Relative to the first control point: a curve far from the origin loses no digits in products with the weights.
        let origin = self.points[0];
        let mut a = [SVector::<f64, D>::zeros(); MAX_DEGREE + 1];
        for (a, point) in a.iter_mut().zip(self.points) {
            *a = point - origin;
        }
        let Some(weights) = self.weights else {
            let mut r = casteljau(&mut a, p, x);
            r[0] += origin;
            return r;
        };
        let mut w = [SVector::<f64, 1>::zeros(); MAX_DEGREE + 1];
        for ((a, w), &weight) in a.iter_mut().zip(&mut w).zip(weights) {
            *a *= weight;
            w.x = weight;
        }
        let a = casteljau::<D, K>(&mut a, p, x);
        let w = casteljau::<1, K>(&mut w, p, x).map(|w| w.x);
        let mut r = quotient(a, &w);
        r[0] += origin;
        r
    }

    /// Curvature at `x`.
    pub(super) fn curvature(&self, x: f64) -> f64 {
        let [_, first, second] = self.derivatives::<3>(x);
        let speed = first.norm();
        let tangent = first / speed;
        (second - tangent * tangent.dot(&second)).norm() / (speed * speed)
    }
}

/// The polynomials `N`, `M` and `w` of a Bezier curve or of a part of it, by their Bernstein coefficients.
///
/// A part's are halved out of the whole curve's, which is all means and loses no digits; differences of the part's own control
/// points would lose two for each tenth of the length.
#[derive(Debug, Clone)]
pub(super) struct Shape<const D: usize> {
    n: Vec<SVector<f64, D>>,
    /// One polynomial for each plane of two axes.
    m: Vec<Vec<f64>>,
    w: Option<Vec<f64>>,
}

impl<const D: usize> Shape<D> {
    pub(super) fn new(bezier: &Bezier<'_, D>) -> Self {
        let p = bezier.degree();
        let origin = bezier.points[0];
        let (mut a, mut w) = (Vec::with_capacity(p + 1), Vec::with_capacity(p + 1));
        for (i, point) in bezier.points.iter().enumerate() {
            let weight = bezier.weights.map_or(1.0, |w| w[i]);
            w.push(weight);
            a.push((point - origin) * weight);
        }
        let (sa, sa1) = (scaled(&a), scaled(&difference(&a)));
        let sa2 = scaled(&difference(&difference(&a)));
        let (sw, sw1) = (scaled(&w), scaled(&difference(&w)));
        let sw2 = scaled(&difference(&difference(&w)));
        let rational = bezier.weights.is_some();
        let n = if rational {
            let mut n = convolution(&sa1, &sw, |a, w| a * *w);
            for (n, other) in n.iter_mut().zip(convolution(&sa, &sw1, |a, w| a * *w)) {
                *n -= other;
            }
            n
        } else {
            sa1.clone()
        };
        let mut m = Vec::new();
        for i in 0..if p > 1 { D } else { 0 } {
            for j in i + 1..D {
                let cross =
                    |x: &[SVector<f64, D>], y: &[SVector<f64, D>]| convolution(x, y, |x, y| x[i] * y[j] - x[j] * y[i]);
                let mut plane = cross(&sa1, &sa2);
                if rational {
                    plane = product(&plane, &sw);
                    let (second, third) = (product(&cross(&sa, &sa2), &sw1), product(&cross(&sa, &sa1), &sw2));
                    for (m, (second, third)) in plane.iter_mut().zip(second.iter().zip(&third)) {
                        *m += third - second;
                    }
                }
                m.push(unscaled(&plane));
            }
        }
        Self { n: unscaled(&n), m, w: rational.then_some(w) }
    }

    /// The parts on the two halves.
    pub(super) fn halves(mut self) -> (Self, Self) {
        let n = halve(&mut self.n);
        let m = self.m.iter_mut().map(|m| halve(m)).collect();
        let w = self.w.as_mut().map(|w| halve(w));
        (Self { n, m, w }, self)
    }

    /// Curvature at the start.
    pub(super) fn curvature(&self) -> f64 {
        let m = self.m.iter().map(|m| m[0] * m[0]).sum::<f64>().sqrt();
        let ratio = self.w.as_ref().map_or(1.0, |w| w[0]) / self.n[0].norm();
        m * ratio * ratio * ratio
    }

    /// Upper bound of the curvature; infinite where the speed cannot be shown to be positive.
    pub(super) fn curvature_bound(&self) -> f64 {
        let n = scaled(&self.n);
        let n_square = convolution(&n, &n, SVector::dot);
        if !n_square.iter().all(|&g| g > 0.0) {
            return f64::INFINITY;
        }
        let mut f: Vec<f64> = Vec::new();
        for m in &self.m {
            let m = scaled(m);
            let square = product(&m, &m);
            f.resize(square.len(), 0.0);
            f.iter_mut().zip(&square).for_each(|(sum, x)| *sum += x);
        }
        let g = product(&product(&n_square, &n_square), &n_square);
        if let Some(w) = &self.w {
            let w = scaled(w);
            let w3 = product(&product(&w, &w), &w);
            f = product(&f, &product(&w3, &w3));
        }
        if f.is_empty() {
            return 0.0;
        }
        // Raised to the degree of the denominator.
        let f = product(&f, &scaled(&vec![1.0; (g.len() + 1).saturating_sub(f.len()).max(1)]));
        let most = f.iter().zip(&g).map(|(f, g)| f / g).fold(0.0, f64::max);
        // For the rounding of some hundred operations.
        most.sqrt() * (1.0 + 1e-13)
    }
}

/// Leaves the Bernstein coefficients of the right half, returns those of the left one.
fn halve<T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>>(a: &mut [T]) -> Vec<T> {
    let mut left = Vec::with_capacity(a.len());
    for last in (0..a.len()).rev() {
        left.push(a[0]);
        for k in 0..last {
            a[k] = (a[k] + a[k + 1]) * 0.5;
        }
    }
    left
}

/// The derivatives of the polynomial curve with control points `b_0 … b_p`; `b` is used up.
#[inline]
fn casteljau<const D: usize, const K: usize>(
    b: &mut [SVector<f64, D>; MAX_DEGREE + 1],
    p: usize,
    x: f64,
) -> [SVector<f64, D>; K] {
    let mut out = [SVector::zeros(); K];
    for level in (0..=p).rev() {
        // b_0 … b_level are the points after p - level rounds.
        if level < K {
            let mut d = *b;
            let mut factor = 1.0;
            for order in 1..=level {
                factor *= (p + 1 - order) as f64;
                for k in 0..=level - order {
                    d[k] = d[k + 1] - d[k];
                }
            }
            out[level] = d[0] * factor;
        }
        for k in 0..level {
            b[k] = b[k] + (b[k + 1] - b[k]) * x;
        }
    }
    out
}

/// Bernstein coefficients of the derivative.
fn difference<T>(a: &[T]) -> Vec<T>
where
    for<'a> &'a T: std::ops::Sub<&'a T, Output = T>,
    T: std::ops::Mul<f64, Output = T>,
{
    let p = a.len().saturating_sub(1) as f64;
    a.windows(2).map(|pair| (&pair[1] - &pair[0]) * p).collect()
}

/// Binomial coefficients of degree `len - 1`.
fn binomials(len: usize) -> impl Iterator<Item = f64> {
    (0..len).scan(1.0, move |binomial, i| {
        let here = *binomial;
        *binomial = here * (len - 1 - i) as f64 / (i + 1) as f64;
        Some(here)
    })
}

/// Coefficients times their binomials.
fn scaled<T: Copy + std::ops::Mul<f64, Output = T>>(a: &[T]) -> Vec<T> {
    a.iter().zip(binomials(a.len())).map(|(&x, binomial)| x * binomial).collect()
}

/// And back.
fn unscaled<T: Copy + std::ops::Div<f64, Output = T>>(a: &[T]) -> Vec<T> {
    a.iter().zip(binomials(a.len())).map(|(&x, binomial)| x / binomial).collect()
}

fn product(x: &[f64], y: &[f64]) -> Vec<f64> {
    convolution(x, y, |x, y| x * y)
}

/// The product of two polynomials in scaled form.
fn convolution<X, Y, Z: std::ops::AddAssign>(x: &[X], y: &[Y], product: impl Fn(&X, &Y) -> Z) -> Vec<Z> {
    let mut out: Vec<Z> = Vec::with_capacity(x.len() + y.len());
    for (i, a) in x.iter().enumerate() {
        for (j, b) in y.iter().enumerate() {
            let term = product(a, b);
            if let Some(sum) = out.get_mut(i + j) { *sum += term } else { out.push(term) }
        }
    }
    out
}
