//! B-spline basis functions on a knot vector.

use super::error::{MAX_DEGREE, NurbsError};

/// One value for each of the `degree + 1` basis functions that do not vanish on a span.
pub(crate) type Row = [f64; MAX_DEGREE + 1];

/// Degree and knots make sense for `count` control points.
pub(super) fn check(degree: usize, knots: &[f64], count: usize) -> Result<(), NurbsError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(NurbsError::BadDegree { degree });
    }
    if count < degree + 1 {
        return Err(NurbsError::TooFewControlPoints { given: count, degree });
    }
    if knots.len() != count + degree + 1 {
        return Err(NurbsError::WrongKnotCount {
            given: knots.len(),
            needed: count + degree + 1,
            degree,
            points: count,
        });
    }
    for (index, &value) in knots.iter().enumerate() {
        if !value.is_finite() {
            return Err(NurbsError::BadKnot { index, value });
        }
        if index > 0 && value < knots[index - 1] {
            return Err(NurbsError::DecreasingKnots { index, before: knots[index - 1], value });
        }
    }
    let (low, high) = (knots[degree], knots[count]);
    let span = high - low;
    // Spans that rounding eats up have no parameter inside.
    if !(span.is_finite() && span > 1e-12 * low.abs().max(high.abs())) {
        return Err(NurbsError::EmptyDomain { low, high });
    }
    let mut first = 0;
    for index in 0..knots.len() {
        if knots[index] != knots[first] {
            first = index;
        }
        let inside = low < knots[index] && knots[index] < high;
        let most = if inside { degree } else { degree + 1 };
        if index + 1 - first > most {
            return Err(NurbsError::TooManyEqualKnots { index, value: knots[index], most });
        }
    }
    Ok(())
}

/// The span that holds `u`: the index `i` with `u_i ≤ u < u_{i+1}`, `u` clamped to the domain (its end: the last span that
/// is not empty). NaN goes to the start.
pub(crate) fn span(degree: usize, knots: &[f64], u: f64) -> usize {
    let count = knots.len() - degree - 1;
    let inner = &knots[degree + 1..count];
    let end = knots[count];
    degree + if u >= end { inner.partition_point(|&k| k < end) } else { inner.partition_point(|&k| k <= u) }
}

/// The basis functions `N_{span-p} … N_span` at `u` with their derivatives up to order `K - 1` (The NURBS Book, algorithm
/// A2.3).
pub(crate) fn derivatives<const K: usize>(degree: usize, knots: &[f64], span: usize, u: f64) -> [Row; K] {
    let p = degree;
    let mut ndu = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
    let (mut left, mut right) = ([0.0; MAX_DEGREE + 1], [0.0; MAX_DEGREE + 1]);
    ndu[0][0] = 1.0;
    for j in 1..=p {
        left[j] = u - knots[span + 1 - j];
        right[j] = knots[span + j] - u;
        let mut saved = 0.0;
        for r in 0..j {
            ndu[j][r] = right[r + 1] + left[j - r];
            let share = ndu[r][j - 1] / ndu[j][r];
            ndu[r][j] = saved + right[r + 1] * share;
            saved = left[j - r] * share;
        }
        ndu[j][j] = saved;
    }
    let mut out = [[0.0; MAX_DEGREE + 1]; K];
    for j in 0..=p {
        out[0][j] = ndu[j][p];
    }
    let highest = (K - 1).min(p);
    for r in 0..=p {
        let mut a = [[0.0; MAX_DEGREE + 1]; 2];
        let (mut old, mut new) = (0, 1);
        a[0][0] = 1.0;
        for k in 1..=highest {
            let rest = p - k;
            let mut d = 0.0;
            if r >= k {
                a[new][0] = a[old][0] / ndu[rest + 1][r - k];
                d = a[new][0] * ndu[r - k][rest];
            }
            let first = if r + 1 >= k { 1 } else { k - r };
            let last = if r <= rest + 1 { k - 1 } else { p - r };
            for j in first..=last {
                a[new][j] = (a[old][j] - a[old][j - 1]) / ndu[rest + 1][r + j - k];
                d += a[new][j] * ndu[r + j - k][rest];
            }
            if r <= rest {
                a[new][k] = -a[old][k - 1] / ndu[rest + 1][r];
                d += a[new][k] * ndu[r][rest];
            }
            out[k][r] = d;
            (old, new) = (new, old);
        }
    }
    let mut factor = p as f64;
    for (k, row) in out.iter_mut().enumerate().skip(1).take(highest) {
        for value in &mut row[..=p] {
            *value *= factor;
        }
        factor *= (p - k) as f64;
    }
    out
}

/// The basis functions alone (algorithm A2.2): a third of the time.
pub(crate) fn values(degree: usize, knots: &[f64], span: usize, u: f64) -> Row {
    let mut n = [0.0; MAX_DEGREE + 1];
    n[0] = 1.0;
    for j in 1..=degree {
        let mut saved = 0.0;
        for r in 0..j {
            let (right, left) = (knots[span + r + 1] - u, u - knots[span + 1 + r - j]);
            let share = n[r] / (right + left);
            n[r] = saved + right * share;
            saved = left * share;
        }
        n[j] = saved;
    }
    n
}
