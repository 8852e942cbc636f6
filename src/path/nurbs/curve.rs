//! NURBS curves: evaluation, derivatives, knot insertion, Bezier pieces.

use nalgebra::SVector;

use super::{MAX_DEGREE, NurbsError, basis, check_points, check_weights};

/// A non-uniform rational B-spline curve,
///
/// ```text
/// r(u) = Σ N_{i,p}(u) w_i P_i / Σ N_{i,p}(u) w_i          u_p ≤ u ≤ u_n
/// ```
///
/// with degree `p`, knots `u_0 … u_{n+p}`, weights `w_i > 0` and control points `P_0 … P_{n-1}` \[mm\]. The knots may be
/// clamped or not. Its own parameter is `u`; [`NurbsPath`](super::NurbsPath) runs along it by arc length.
///
/// Source: Piegl, Tiller, "The NURBS Book", chapters 2 to 5.
///
/// ```
/// use nalgebra::Vector2;
/// use servosim::path::NurbsCurve;
///
/// let circle = NurbsCurve::circle(Vector2::new(1.0, 2.0), 5.0)?;
/// let (low, high) = circle.domain();
/// for i in 0..=100 {
///     let point = circle.point_mm(low + (high - low) * f64::from(i) / 100.0);
///     assert!(((point - Vector2::new(1.0, 2.0)).norm() - 5.0).abs() < 1e-14);
/// }
/// # Ok::<(), servosim::path::NurbsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsCurve<const D: usize> {
    degree: usize,
    knots: Vec<f64>,
    points: Vec<SVector<f64, D>>,
    /// None where all are 1.
    weights: Option<Vec<f64>>,
}

/// One polynomial (rational) piece of a curve: a Bezier curve over `from ≤ u ≤ to`.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierPiece<const D: usize> {
    /// Parameter of the curve at the start.
    pub from: f64,
    /// Parameter of the curve at the end.
    pub to: f64,
    /// The `degree + 1` control points \[mm\].
    pub control_points_mm: Vec<SVector<f64, D>>,
    /// Their weights; None where all are 1.
    pub weights: Option<Vec<f64>>,
}

impl<const D: usize> NurbsCurve<D> {
    /// A curve of `degree` (1 to [`MAX_DEGREE`]) with `control + degree + 1` knots, and weights (None: all are 1).
    ///
    /// # Errors
    /// A degree out of range, counts that do not match, knots that decrease, coincide too often (more than `degree` times
    /// inside, `degree + 1` at the ends) or leave no room, weights that are not positive, and numbers that are not finite.
    pub fn new(
        degree: usize,
        knots: Vec<f64>,
        control_points_mm: Vec<SVector<f64, D>>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        basis::check(degree, &knots, control_points_mm.len())?;
        check_points(&control_points_mm)?;
        let weights = check_weights(weights, control_points_mm.len())?;
        Ok(Self { degree, knots, points: control_points_mm, weights })
    }

    /// The degree `p`.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The knots `u_0 … u_{n+p}`.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The control points `P_0 … P_{n-1}` \[mm\].
    pub fn control_points_mm(&self) -> &[SVector<f64, D>] {
        &self.points
    }

    /// The weights; None where all are 1.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// First and last parameter, `u_p` and `u_n`.
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.points.len()])
    }

    fn weight(&self, i: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |w| w[i])
    }

    /// The point at `u` \[mm\], `u` clamped to the domain (NaN: the start).
    pub fn point_mm(&self, u: f64) -> SVector<f64, D> {
        self.derivatives::<1>(u)[0]
    }

    /// The point \[mm\] and the derivatives with respect to `u` up to order `K - 1`, `u` clamped to the domain (NaN: the start). At
    /// a knot where a derivative jumps it is that of the piece that follows.
    pub fn derivatives<const K: usize>(&self, u: f64) -> [SVector<f64, D>; K] {
        let (low, high) = self.domain();
        // In this order a NaN becomes the start.
        let u = u.max(low).min(high);
        let span = basis::span(self.degree, &self.knots, u);
        let rows = basis::derivatives::<K>(self.degree, &self.knots, span, u);
        let first = span - self.degree;
        let mut a = [SVector::zeros(); K];
        let mut w = [0.0; K];
        for (k, row) in rows.iter().enumerate() {
            for (j, n) in row[..=self.degree].iter().enumerate() {
                let weighted = n * self.weight(first + j);
                a[k] += self.points[first + j] * weighted;
                w[k] += weighted;
            }
        }
        if self.weights.is_some() { quotient(a, &w) } else { a }
    }

    /// Curvature `|r' × r''| / |r'|³` \[1/mm\] at `u`; NaN where `r' = 0`.
    pub fn curvature_1_mm(&self, u: f64) -> f64 {
        let [_, first, second] = self.derivatives::<3>(u);
        let speed = first.norm();
        let tangent = first / speed;
        (second - tangent * tangent.dot(&second)).norm() / (speed * speed)
    }

    /// The same curve with knot `u` inserted `times` times (Boehm).
    ///
    /// # Errors
    /// A knot outside the open domain, or one that would be there more than `degree` times.
    pub fn with_knot(&self, u: f64, times: usize) -> Result<Self, NurbsError> {
        let (low, high) = self.domain();
        let most = self.degree;
        let present = self.knots.iter().filter(|&&k| k == u).count();
        if !(u > low && u < high) || times > most - present.min(most) {
            return Err(NurbsError::BadInsertion { u, times, low, high, most });
        }
        let mut curve = self.clone();
        for _ in 0..times {
            curve.insert(u);
        }
        Ok(curve)
    }

    fn insert(&mut self, u: f64) {
        let p = self.degree;
        let span = basis::span(p, &self.knots, u);
        let mut points = Vec::with_capacity(self.points.len() + 1);
        let mut weights = Vec::with_capacity(self.points.len() + 1);
        for i in 0..=self.points.len() {
            // P_i' = (1-a) P_{i-1} + a P_i with a = (u - u_i)/(u_{i+p} - u_i) where that knot interval holds u.
            let a = if i + p <= span {
                1.0
            } else if i > span {
                0.0
            } else {
                (u - self.knots[i]) / (self.knots[i + p] - self.knots[i])
            };
            let (before, here) = (i.max(1) - 1, i.min(self.points.len() - 1));
            let (w0, w1) = ((1.0 - a) * self.weight(before), a * self.weight(here));
            let weight = w0 + w1;
            let share = w1 / weight;
            points.push(self.points[before] * (1.0 - share) + self.points[here] * share);
            weights.push(weight);
        }
        self.points = points;
        self.weights = self.weights.is_some().then_some(weights);
        self.knots.insert(span + 1, u);
    }

    /// The curve's pieces between distinct knots, as Bezier curves.
    pub fn bezier_pieces(&self) -> impl Iterator<Item = BezierPiece<D>> + '_ {
        let (p, count) = (self.degree, self.points.len());
        (p..count).filter(|&i| self.knots[i] < self.knots[i + 1]).map(move |i| self.bezier_piece(i))
    }

    /// The piece on the span that begins at knot `span`: control point `j` is the blossom at `p-j` times the span's start and `j`
    /// times its end.
    fn bezier_piece(&self, span: usize) -> BezierPiece<D> {
        let p = self.degree;
        let (from, to) = (self.knots[span], self.knots[span + 1]);
        let mut points = Vec::with_capacity(p + 1);
        let mut weights = Vec::with_capacity(p + 1);
        for j in 0..=p {
            let mut local = [(SVector::<f64, D>::zeros(), 1.0); MAX_DEGREE + 1];
            for (k, entry) in local[..=p].iter_mut().enumerate() {
                let i = span - p + k;
                *entry = (self.points[i], self.weight(i));
            }
            for round in 1..=p {
                let u = if round <= p - j { from } else { to };
                for k in (round..=p).rev() {
                    let (low, high) = (self.knots[span - p + k], self.knots[span + 1 + k - round]);
                    let a = (u - low) / (high - low);
                    local[k] = mix(&local[k - 1], &local[k], a);
                }
            }
            points.push(local[p].0);
            weights.push(local[p].1);
        }
        BezierPiece { from, to, control_points_mm: points, weights: self.weights.is_some().then_some(weights) }
    }

    /// The curve with every control point mapped by `map`, an affine map for the curve to follow.
    ///
    /// # Errors
    /// A mapped coordinate that is not a finite number in range.
    pub fn mapped<const E: usize>(
        &self,
        map: impl Fn(&SVector<f64, D>) -> SVector<f64, E>,
    ) -> Result<NurbsCurve<E>, NurbsError> {
        let points: Vec<_> = self.points.iter().map(map).collect();
        check_points(&points)?;
        Ok(NurbsCurve { degree: self.degree, knots: self.knots.clone(), points, weights: self.weights.clone() })
    }

    /// The same curve run from its end to its start; the domain stays.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let (low, high) = self.domain();
        Self {
            degree: self.degree,
            knots: self.knots.iter().rev().map(|k| low + (high - k)).collect(),
            points: self.points.iter().rev().copied().collect(),
            weights: self.weights.as_ref().map(|w| w.iter().rev().copied().collect()),
        }
    }
}

/// `(1-a) x + a y` of points with weights. Where `a` is 1 or 0 the point is exactly that one.
fn mix<const D: usize>(x: &(SVector<f64, D>, f64), y: &(SVector<f64, D>, f64), a: f64) -> (SVector<f64, D>, f64) {
    let (w0, w1) = ((1.0 - a) * x.1, a * y.1);
    let weight = w0 + w1;
    let share = w1 / weight;
    (x.0 * (1.0 - share) + y.0 * share, weight)
}

/// Derivatives of `a / w` (The NURBS Book, equation 4.8).
pub(super) fn quotient<const D: usize, const K: usize>(a: [SVector<f64, D>; K], w: &[f64; K]) -> [SVector<f64, D>; K] {
    let mut r = a;
    for k in 0..K {
        let mut binomial = 1.0;
        for i in 1..=k {
            binomial *= (k + 1 - i) as f64 / i as f64;
            let before = r[k - i];
            r[k] -= before * (binomial * w[i]);
        }
        r[k] /= w[0];
    }
    r
}
