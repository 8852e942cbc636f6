//! Eigenvalues of small real matrices, where the decomposition may fail.

use nalgebra::linalg::{Schur, balancing::balance_parlett_reinsch};
use nalgebra::{Complex, DMatrix};

/// Entries beyond this are no loop, and squares of them would overflow.
const LARGEST: f64 = 1e100;

/// Most iterations.
const MOST: usize = 10_000;

/// All eigenvalues; none where the iteration does not converge, or where the matrix is not made of sensible numbers.
///
/// Balanced first (B. N. Parlett, C. Reinsch, "Balancing a matrix for calculation of eigenvalues and eigenvectors", Numerische Mathematik
/// 13, 1969): the states of a drive have units of very different sizes.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if !matrix.iter().all(|x| x.abs() <= LARGEST) {
        return None;
    }
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    let schur = Schur::try_new(balanced, f64::EPSILON, MOST)?;
    let found: Vec<Complex<f64>> = schur.complex_eigenvalues().iter().copied().collect();
    found.iter().all(|value| value.re.is_finite() && value.im.is_finite()).then_some(found)
}

/// The largest magnitude of an eigenvalue of `I + matrix`; infinite where the matrix is not made of sensible numbers.
pub(super) fn radius(matrix: &DMatrix<f64>) -> f64 {
    match eigenvalues(matrix) {
        Some(found) => {
            let excess = found.iter().map(|d| 2.0 * d.re + d.norm_sqr()).fold(-1.0, f64::max);
            (1.0 + excess).max(0.0).sqrt()
        }
        None => radius_by_powers(matrix),
    }
}

/// The same by repeated squaring: `‖Aⁿ‖^(1/n)` with `n = 2^60`.
fn radius_by_powers(matrix: &DMatrix<f64>) -> f64 {
    if !matrix.iter().all(|x| x.abs() <= LARGEST) {
        return f64::INFINITY;
    }
    let mut power = matrix + DMatrix::identity(matrix.nrows(), matrix.ncols());
    // ln ‖Aⁿ‖/n, gathered as the powers are scaled back to one.
    let (mut sum, mut share) = (0.0, 1.0);
    for _ in 0..60 {
        let norm = power.norm();
        if norm == 0.0 {
            return 0.0;
        }
        sum += share * libm::log(norm);
        power /= norm;
        power = &power * &power;
        share *= 0.5;
    }
    libm::exp(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_radius_by_two_routes() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for n in 1..12 {
            for _ in 0..20 {
                let matrix = DMatrix::from_fn(n, n, |_, _| next());
                let (a, b) = (radius(&matrix), radius_by_powers(&matrix));
                assert!((a - b).abs() < 1e-9 * a, "{n}: {a} {b}");
            }
        }
        assert_eq!(radius(&DMatrix::from_element(2, 2, f64::NAN)), f64::INFINITY);
        assert_eq!(radius(&DMatrix::from_element(2, 2, 1e200)), f64::INFINITY);
    }
}
