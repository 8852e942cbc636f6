//! Normal random numbers, quickly.

use std::sync::LazyLock;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Layers under the bell, of the same area.
const LAYERS: usize = 256;
/// Where the lowest layer's tail begins, and the area of each layer under `exp(-x²/2)`.
const TAIL: f64 = 3.654_152_885_361_009;
const AREA: f64 = 0.004_928_673_233_974_658;

/// Right end of each layer, and the height there: the same on every machine.
struct Layers {
    x: [f64; LAYERS + 1],
    y: [f64; LAYERS + 1],
}

static SHAPE: LazyLock<Layers> = LazyLock::new(|| {
    let height = |x: f64| libm::exp(-0.5 * x * x);
    let mut x = [0.0; LAYERS + 1];
    // The lowest layer is as wide as a box of its area would be.
    (x[0], x[1]) = (AREA / height(TAIL), TAIL);
    for i in 2..LAYERS {
        x[i] = (-2.0 * libm::log(AREA / x[i - 1] + height(x[i - 1]))).sqrt();
    }
    Layers { x, y: x.map(height) }
});

/// Standard normal numbers of a seed, the same on every platform: the ziggurat, nearly always one random word, a product and a
/// comparison.
///
/// Source: G. Marsaglia, W. W. Tsang, "The ziggurat method for generating random variables", Journal of Statistical Software 5, 2000;
/// layer and place are from different bits (J. A. Doornik, "An improved ziggurat method to generate normal random samples", 2005).
#[derive(Debug, Clone)]
pub(in crate::servo) struct Normal {
    random: Xoshiro256PlusPlus,
}

impl Normal {
    pub(in crate::servo) fn new(seed: u64) -> Self {
        Self { random: Xoshiro256PlusPlus::seed_from_u64(seed) }
    }

    #[inline(always)]
    pub(in crate::servo) fn next(&mut self) -> f64 {
        let shape = &*SHAPE;
        let (layer, place) = Self::throw(self.random.next_u64());
        let x = place * shape.x[layer];
        if x.abs() < shape.x[layer + 1] { x } else { self.outside(layer, place) }
    }

    /// A layer, and a place from -1 to 1 in it.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // the lowest bits; all bits
    fn throw(word: u64) -> (usize, f64) {
        ((word & 0xff) as usize, ((word as i64) >> 11) as f64 * (1.0 / 4503599627370496.0))
    }

    fn uniform(&mut self) -> f64 {
        // Not zero: its logarithm is wanted.
        ((self.random.next_u64() >> 11) as f64 + 0.5) * (0.5 * f64::EPSILON)
    }

    /// Where a layer sticks out of the bell, and the tail.
    #[cold]
    #[inline(never)]
    fn outside(&mut self, mut layer: usize, mut place: f64) -> f64 {
        let shape = &*SHAPE;
        loop {
            let x = place * shape.x[layer];
            if x.abs() < shape.x[layer + 1] {
                return x;
            }
            if layer == 0 {
                loop {
                    let beyond = -libm::log(self.uniform()) / TAIL;
                    if -2.0 * libm::log(self.uniform()) > beyond * beyond {
                        return (TAIL + beyond).copysign(place);
                    }
                }
            }
            let height = shape.y[layer] + self.uniform() * (shape.y[layer + 1] - shape.y[layer]);
            if height < libm::exp(-0.5 * x * x) {
                return x;
            }
            (layer, place) = Self::throw(self.random.next_u64());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_layers_close() {
        // The topmost layer ends at the top of the bell, and has the area of the others.
        let shape = &*SHAPE;
        let top = shape.x[LAYERS - 1] * (1.0 - shape.y[LAYERS - 1]);
        assert!((top / AREA - 1.0).abs() < 1e-6, "{top}");
    }

    #[test]
    fn validates_distribution() {
        let (n, mut normal) = (400_000, Normal::new(5));
        let mut drawn: Vec<f64> = (0..n).map(|_| normal.next()).collect();
        let moment = |p: i32| drawn.iter().map(|x| x.powi(p)).sum::<f64>() / f64::from(n);
        // Five standard deviations of each estimate: Var x^p = E x^2p - (E x^p)².
        let root = f64::from(n).sqrt();
        for (p, mean, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0), (6, 15.0, 10170.0)] {
            assert!((moment(p) - mean).abs() < 5.0 * f64::sqrt(variance) / root, "{p}: {}", moment(p));
        }
        // Kolmogorov and Smirnov, and what lies beyond the lowest layer.
        let beyond = drawn.iter().filter(|x| x.abs() > TAIL).count() as f64;
        drawn.sort_by(f64::total_cmp);
        let below = |x: f64| 0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2);
        let apart = drawn.iter().enumerate().map(|(i, x)| (below(*x) - (i as f64 + 0.5) / f64::from(n)).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart * root < 1.95, "{apart}");
        let foreseen = 2.0 * below(-TAIL) * f64::from(n);
        assert!((beyond - foreseen).abs() < 5.0 * foreseen.sqrt(), "{beyond} {foreseen}");
    }
}
