//! Random numbers that are the same on every platform.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Uniform and normal random numbers from a seed: Xoshiro256++ and `libm`, so that a seed gives the same numbers
/// everywhere.
#[derive(Debug, Clone)]
pub struct Random {
    rng: Xoshiro256PlusPlus,
    /// The polar method makes two normal numbers at a time.
    spare: Option<f64>,
}

impl Random {
    /// Numbers of this seed.
    pub fn new(seed: u64) -> Self {
        Self { rng: Xoshiro256PlusPlus::seed_from_u64(seed), spare: None }
    }

    /// The stream of number `index` of a seed: streams do not depend on each other, nor on the order in which they are used.
    pub fn stream(seed: u64, index: u64) -> Self {
        let mut keys = Xoshiro256PlusPlus::seed_from_u64(seed);
        // An odd factor: different indices stay different.
        Self::new(keys.next_u64() ^ index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Uniform in `0 ≤ x < 1`, a multiple of 2⁻⁵³.
    pub fn uniform(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    /// Uniform in `low ≤ x < high` (but for rounding).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Standard normal (Marsaglia's polar method).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                let factor = (-2.0 * libm::log(square) / square).sqrt();
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }
}
