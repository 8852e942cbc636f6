//! Symmetric positive definite systems with two side diagonals.

/// The matrix `A` with `A_ii`, `A_i,i+1` and `A_i,i+2`; after [`Banded::factor`] its factors `L D Lᵀ`.
#[derive(Debug, Clone)]
pub(super) struct Banded {
    rows: Vec<[f64; 3]>,
}

impl Banded {
    pub(super) fn new(size: usize) -> Self {
        Self { rows: vec![[0.0; 3]; size] }
    }

    pub(super) fn clear(&mut self) {
        self.rows.fill([0.0; 3]);
    }

    /// Adds `weight · w wᵀ` at the coefficients `first … first + 2`.
    #[inline]
    pub(super) fn add(&mut self, first: usize, w: [f64; 3], weight: f64) {
        let Some(rows) = self.rows.get_mut(first..first + 3) else { return };
        let [p, q, r] = w.map(|value| value * weight);
        rows[0][0] += p * w[0];
        rows[0][1] += p * w[1];
        rows[0][2] += p * w[2];
        rows[1][0] += q * w[1];
        rows[1][1] += q * w[2];
        rows[2][0] += r * w[2];
    }

    pub(super) fn add_diagonal(&mut self, row: usize, value: f64) {
        if let Some(row) = self.rows.get_mut(row) {
            row[0] += value;
        }
    }

    /// Factorises in place; a pivot that rounding made too small is raised.
    pub(super) fn factor(&mut self) {
        // AxisDerivatives i holds D_i, L_{i+1,i} and L_{i+2,i}.
        let (mut before, mut before_that) = ([0.0; 3], [0.0; 3]);
        for row in &mut self.rows {
            let [a, b, c] = *row;
            let pivot = a - before[0] * before[1] * before[1] - before_that[0] * before_that[2] * before_that[2];
            // A row of zeros stays out of the game.
            let pivot = pivot.max(1e-14 * a).max(f64::MIN_POSITIVE);
            let next = (b - before[0] * before[1] * before[2]) / pivot;
            *row = [pivot, next, c / pivot];
            (before_that, before) = (before, *row);
        }
    }

    /// Solves `L D Lᵀ x = b` in place.
    pub(super) fn solve(&self, x: &mut [f64]) {
        let n = self.rows.len().min(x.len());
        let (mut one, mut two) = ((0.0, [0.0; 3]), (0.0, [0.0; 3]));
        for (value, row) in x.iter_mut().zip(&self.rows) {
            *value -= one.1[1] * one.0 + two.1[2] * two.0;
            two = one;
            one = (*value, *row);
        }
        let (mut one, mut two) = (0.0, 0.0);
        for (value, row) in x[..n].iter_mut().zip(&self.rows[..n]).rev() {
            *value = *value / row[0] - row[1] * one - row[2] * two;
            (two, one) = (one, *value);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn validates_the_solution_against_the_product() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        for size in [3, 4, 5, 17, 200] {
            let mut matrix = Banded::new(size);
            let mut terms = Vec::new();
            for first in 0..size - 2 {
                for _ in 0..4 {
                    let w: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
                    matrix.add(first, w, 2.0);
                    terms.push((first, w));
                }
            }
            (0..size).for_each(|row| matrix.add_diagonal(row, 0.1));
            let wanted: Vec<f64> = (0..size).map(|_| rng.random_range(-1.0..1.0)).collect();
            let mut x: Vec<f64> = wanted.iter().map(|v| 0.1 * v).collect();
            for (first, w) in &terms {
                let product: f64 = (0..3).map(|k| w[k] * wanted[first + k]).sum();
                (0..3).for_each(|k| x[first + k] += 2.0 * w[k] * product);
            }
            matrix.factor();
            matrix.solve(&mut x);
            for (found, wanted) in x.iter().zip(&wanted) {
                assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
            }
        }
    }
}
