//! Polynomials in Bernstein form on `[0, 1]`: products, derivatives, values and real roots.

/// Binomial coefficient `C(n, k)` for the small degrees used here.
fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
}

/// The product of two polynomials; `C` must be `A + B - 1`.
pub(super) fn product<const A: usize, const B: usize, const C: usize>(a: &[f64; A], b: &[f64; B]) -> [f64; C] {
    const { assert!(A + B == C + 1) };
    let mut c = [0.0; C];
    for (i, &x) in a.iter().enumerate() {
        for (j, &y) in b.iter().enumerate() {
            c[i + j] += binomial(A - 1, i) * binomial(B - 1, j) / binomial(C - 1, i + j) * x * y;
        }
    }
    c
}

/// The derivative; `B` must be `A - 1`.
pub(super) fn derivative<const A: usize, const B: usize>(a: &[f64; A]) -> [f64; B] {
    const { assert!(A == B + 1) };
    std::array::from_fn(|i| B as f64 * (a[i + 1] - a[i]))
}

/// Value and derivative at `x`, by de Casteljau.
fn value<const N: usize>(a: &[f64; N], x: f64) -> (f64, f64) {
    let mut b = *a;
    for round in (2..N).rev() {
        for k in 0..round {
            b[k] += x * (b[k + 1] - b[k]);
        }
    }
    let rise = b[1] - b[0];
    (b[0] + x * rise, (N - 1) as f64 * rise)
}

/// Tells `visit` every real root in `[0, 1]` (a cluster closer than 1e-9 may be told once).
pub(super) fn roots<const N: usize>(a: &[f64; N], visit: &mut impl FnMut(f64)) {
    isolate(a, 0.0, 1.0, visit);
}

/// Roots of the piece `a` that stands for `[low, high]` of the whole (Descartes' rule, halving).
fn isolate<const N: usize>(a: &[f64; N], low: f64, high: f64, visit: &mut impl FnMut(f64)) {
    let changes = a.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    match changes {
        0 => {}
        1 => visit(low + (high - low) * bracketed(a)),
        _ if high - low < 1e-9 => visit(0.5 * (low + high)),
        _ => {
            let (mut left, mut right) = (*a, *a);
            for round in (1..N).rev() {
                for k in 0..round {
                    right[k] = 0.5 * (right[k] + right[k + 1]);
                }
                left[N - round] = right[0];
            }
            let middle = 0.5 * (low + high);
            isolate(&left, low, middle, visit);
            isolate(&right, middle, high, visit);
        }
    }
}

/// The one root of a polynomial whose coefficients change sign once: Newton kept inside a shrinking bracket.
fn bracketed<const N: usize>(a: &[f64; N]) -> f64 {
    let rising = a[N - 1] >= 0.0;
    let (mut low, mut high) = (0.0, 1.0);
    let mut x = 0.5;
    for _ in 0..80 {
        let (f, slope) = value(a, x);
        if (f < 0.0) == rising {
            low = x
        } else {
            high = x
        }
        let newton = x - f / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-15 {
            return next;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_product_derivative_and_roots_of_known_polynomials() {
        // (x - 1/4)(x - 3/4) in Bernstein form, squared root structure checked by its roots.
        let first: [f64; 2] = [-0.25, 0.75];
        let second: [f64; 2] = [-0.75, 0.25];
        let both: [f64; 3] = product(&first, &second);
        let mut found = Vec::new();
        roots(&both, &mut |x| found.push(x));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[0] - 0.25).abs() < 1e-15 && (found[1] - 0.75).abs() < 1e-15, "{found:?}");
        let slope: [f64; 2] = derivative(&both);
        // d/dx (x² - x + 3/16) = 2x - 1.
        assert_eq!(slope, [-1.0, 1.0]);
        assert!((value(&both, 0.1).0 - (0.01 - 0.1 + 0.1875)).abs() < 1e-16);
    }

    #[test]
    fn a_polynomial_without_roots_has_none() {
        roots(&[1.0, 0.2, 3.0, 0.5], &mut |x| panic!("a root at {x}"));
    }
}
