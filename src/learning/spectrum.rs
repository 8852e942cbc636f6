//! Discrete Fourier transform of lengths that are powers of two.

use std::f64::consts::TAU;

use nalgebra::Complex;

/// The roots of unity that transforms of one length need.
pub(super) struct Transform {
    /// `exp(-2πi k/n)` for the first half.
    roots: Vec<Complex<f64>>,
}

impl Transform {
    /// Of at least `length` samples.
    pub(super) fn at_least(length: usize) -> Self {
        let half = length.next_power_of_two().max(2) / 2;
        let root = |k: usize| {
            let (sin, cos) = libm::sincos(-0.5 * TAU * k as f64 / half as f64);
            Complex::new(cos, sin)
        };
        Self { roots: (0..half).map(root).collect() }
    }

    /// How many samples it takes.
    pub(super) fn length(&self) -> usize {
        2 * self.roots.len()
    }

    /// `X[m] = Σ x[k] exp(-2πi m k/n)`; what is missing of `values` is zero, what is too much is left out.
    pub(super) fn forward(&self, values: impl IntoIterator<Item = f64>) -> Vec<Complex<f64>> {
        let mut out: Vec<Complex<f64>> = values.into_iter().map(|x| Complex::new(x, 0.0)).collect();
        out.resize(self.length(), Complex::new(0.0, 0.0));
        self.transform(&mut out);
        out
    }

    /// The way back, of a real signal.
    pub(super) fn back(&self, mut spectrum: Vec<Complex<f64>>) -> Vec<f64> {
        spectrum.resize(self.length(), Complex::new(0.0, 0.0));
        // The forward transform of the conjugate is the conjugate of the inverse, but for the factor.
        for x in &mut spectrum {
            *x = x.conj();
        }
        self.transform(&mut spectrum);
        let scale = 1.0 / self.length() as f64;
        spectrum.into_iter().map(|x| x.re * scale).collect()
    }

    /// Cooley and Tukey, in place, radix 2.
    fn transform(&self, values: &mut [Complex<f64>]) {
        let n = values.len();
        let mut reversed = 0;
        for k in 1..n {
            let mut bit = n >> 1;
            while reversed & bit != 0 {
                reversed ^= bit;
                bit >>= 1;
            }
            reversed |= bit;
            if k < reversed {
                values.swap(k, reversed);
            }
        }
        let mut half = 1;
        while half < n {
            let stride = self.roots.len() / half;
            for block in values.chunks_exact_mut(2 * half) {
                let (low, high) = block.split_at_mut(half);
                for ((a, b), root) in low.iter_mut().zip(high).zip(self.roots.iter().step_by(stride)) {
                    let turned = *b * root;
                    *b = *a - turned;
                    *a += turned;
                }
            }
            half *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_transform_against_its_sum_and_its_inverse() {
        for n in [2_usize, 4, 8, 64, 128] {
            let transform = Transform::at_least(n - 1);
            assert_eq!(transform.length(), n);
            let x: Vec<f64> = (0..n).map(|k| ((k * k + 3) % 17) as f64 - 8.0).collect();
            let spectrum = transform.forward(x.iter().copied());
            for (m, found) in spectrum.iter().enumerate() {
                let term = |(k, x): (usize, &f64)| Complex::from_polar(*x, -TAU * ((m * k) % n) as f64 / n as f64);
                let sum: Complex<f64> = x.iter().enumerate().map(term).sum();
                assert!((found - sum).norm() < 1e-10, "{n} {m}");
            }
            let back = transform.back(spectrum);
            assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }
}
