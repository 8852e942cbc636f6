//! Eigenvalues of a symmetric matrix by Jacobi's rotations: basic arithmetic only, the same bits everywhere.

/// A square matrix, by rows.
pub(super) type Matrix = Vec<Vec<f64>>;

/// The unit matrix.
pub(super) fn unit(n: usize) -> Matrix {
    (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect()
}

/// Eigenvalues and eigenvectors (the columns of the matrix) of a symmetric matrix.
///
/// Cyclic Jacobi, see Golub and Van Loan, "Matrix Computations", section 8.5; converges quadratically, a handful of sweeps.
pub(super) fn symmetric(matrix: &Matrix) -> (Vec<f64>, Matrix) {
    let n = matrix.len();
    let (mut a, mut vectors) = (matrix.clone(), unit(n));
    for _ in 0..50 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let diagonal: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        if !(off > 1e-32 * diagonal) {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut a, &mut vectors, p, q);
            }
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), vectors)
}

/// The rotation that makes `a[p][q]` vanish.
fn rotate(a: &mut Matrix, vectors: &mut Matrix, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut().chain(vectors.iter_mut()) {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (row_p, row_q) = (a[p].clone(), a[q].clone());
    for (k, (x, y)) in row_p.into_iter().zip(row_q).enumerate() {
        (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
#[allow(clippy::needless_range_loop)] // two matrices share the indices
mod tests {
    use super::*;
    use crate::optimize::Random;

    #[test]
    fn validates_vectors_and_values_give_the_matrix_back() {
        let mut random = Random::new(3);
        for n in 1..=12 {
            let mut matrix = unit(n);
            for i in 0..n {
                for j in 0..=i {
                    matrix[i][j] = random.normal();
                    matrix[j][i] = matrix[i][j];
                }
            }
            let (values, vectors) = symmetric(&matrix);
            for i in 0..n {
                for j in 0..n {
                    let back: f64 = (0..n).map(|k| vectors[i][k] * values[k] * vectors[j][k]).sum();
                    // A few roundings of numbers below 10.
                    assert!((back - matrix[i][j]).abs() < 1e-13, "{n}: {back} {}", matrix[i][j]);
                    let product: f64 = (0..n).map(|k| vectors[k][i] * vectors[k][j]).sum();
                    assert!((product - f64::from(u8::from(i == j))).abs() < 1e-13);
                }
            }
        }
    }
}
