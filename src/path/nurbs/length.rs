//! Arc length on a short smooth piece of a curve: the speed as a series of Legendre polynomials.

use crate::path::quadrature::RULE;

/// Terms of the series: one for each node of the quadrature rule.
pub(super) const TERMS: usize = 10;

/// The speed `σ(ξ) = Σ c_k P_k(2ξ - 1)`, interpolated at the 10 Gauss nodes. Its integral, the arc length, follows in closed form
/// from `∫P_k = (P_{k+1} - P_{k-1})/(2k+1)`, and that over the whole piece is Gauss' rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Speed([f64; TERMS]);

impl Speed {
    /// Of a speed given as a function of `ξ` on `[0, 1]`.
    pub(super) fn new(speed: impl Fn(f64) -> f64) -> Self {
        let mut c = [0.0; TERMS];
        for (node, weight) in RULE.iter().flat_map(|&(x, w)| [(-x, w), (x, w)]) {
            let term = 0.5 * weight * speed(0.5 + 0.5 * node);
            let (mut before, mut here) = (0.0, 1.0);
            for (k, c) in c.iter_mut().enumerate() {
                *c += (2 * k + 1) as f64 * term * here;
                (before, here) = (here, legendre(k, node, before, here));
            }
        }
        Self(c)
    }

    /// How far the last terms are from nothing, as a share of the mean speed.
    pub(super) fn rest(&self) -> f64 {
        (self.0[TERMS - 1].abs() + self.0[TERMS - 2].abs()) / self.0[0]
    }

    /// Length of the whole piece.
    pub(super) fn length(&self) -> f64 {
        self.0[0]
    }

    /// Arc length from 0 to `xi`, and the speed there.
    #[inline]
    pub(super) fn at(&self, xi: f64) -> (f64, f64) {
        let x = 2.0 * xi - 1.0;
        let (mut before, mut here) = (1.0, x);
        let mut speed = self.0[0];
        let mut length = self.0[0] * (x + 1.0);
        for (k, inverse) in INVERSE.iter().enumerate().skip(1) {
            let next = legendre(k, x, before, here);
            speed += self.0[k] * here;
            length += self.0[k] * (next - before) * inverse;
            (before, here) = (here, next);
        }
        (0.5 * length, speed)
    }

    /// The parameter where the arc length is `length` (clamped to the piece): Newton from `guess`, kept in a shrinking bracket.
    #[inline]
    pub(super) fn solve(&self, length: f64, guess: f64) -> f64 {
        if !(length > 0.0) {
            return 0.0;
        }
        if length >= self.0[0] {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut xi = guess.max(0.0).min(1.0);
        for _ in 0..60 {
            let (at, speed) = self.at(xi);
            let off = at - length;
            if off < 0.0 {
                low = xi
            } else {
                high = xi
            }
            let newton = xi - off / speed;
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            if (next - xi).abs() <= 1e-15 {
                return next;
            }
            xi = next;
        }
        xi
    }
}

/// `1/(2k+1)`.
const INVERSE: [f64; TERMS] = {
    let mut inverse = [1.0; TERMS];
    let mut k = 1;
    while k < TERMS {
        inverse[k] = 1.0 / (2 * k + 1) as f64;
        k += 1;
    }
    inverse
};

/// `P_{k+1}(x)` from the two before it.
#[inline]
fn legendre(k: usize, x: f64, before: f64, here: f64) -> f64 {
    ((2 * k + 1) as f64 * x * here - k as f64 * before) * (1.0 / (k + 1) as f64)
}
