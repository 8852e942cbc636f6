//! Where the points of a sampled sweep lie in the unit cube. Point `i` depends on seed, number of points and `i` alone: no state.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::Method;
use super::hash::mix;
use super::sobol;

/// A key for each use of a seed.
fn key(seed: u64, purpose: u64) -> u64 {
    mix(mix(seed) ^ purpose.wrapping_mul(0xd6e8_feb8_6659_fd93))
}

/// A permutation of `0..count` that is computed number by number: a Feistel network over the next power of four, walked
/// until it comes back below `count` (Black and Rogaway 2002).
#[derive(Debug, Clone, Copy)]
struct Permutation {
    count: u64,
    half_bits: u32,
    key: u64,
}

impl Permutation {
    fn new(count: u64, key: u64) -> Self {
        let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
        Self { count, half_bits: bits.div_ceil(2).max(1), key }
    }

    fn at(&self, index: u64) -> u64 {
        let mask = (1 << self.half_bits) - 1;
        let mut value = index;
        loop {
            let (mut left, mut right) = (value >> self.half_bits, value & mask);
            for round in 0..6 {
                (left, right) = (right, left ^ (mix(self.key ^ mix(right << 3 | round)) & mask));
            }
            value = left << self.half_bits | right;
            if value < self.count {
                return value;
            }
        }
    }
}

/// The points of a sampled sweep in the unit cube.
#[derive(Debug, Clone)]
pub(super) struct Sampling {
    method: Method,
    seed: u64,
    count: u64,
    permutations: Vec<Permutation>,
    directions: Vec<[u32; 32]>,
}

impl Sampling {
    /// `method` is not [`Method::Grid`].
    pub(super) fn new(method: Method, seed: u64, count: u64, dimensions: usize) -> Self {
        let permutation = |d: usize| Permutation::new(count, key(seed, 1 + d as u64));
        Self {
            method,
            seed,
            count,
            permutations: (0..dimensions).map(permutation).collect(),
            directions: (0..dimensions).map(sobol::directions).collect(),
        }
    }

    /// Coordinates of point `index`, one a dimension, all in (0, 1).
    pub(super) fn point(&self, index: u64) -> Vec<f64> {
        let dimensions = self.directions.len();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(key(self.seed, 0).wrapping_add(mix(index)));
        match self.method {
            Method::LatinHypercube => {
                let stratum = |permutation: &Permutation| {
                    // Twenty bits within the stratum: the sum is exact, and never on the border to the next one.
                    let within = ((random.next_u64() >> 44) as f64 + 0.5) / 1_048_576.0;
                    (permutation.at(index) as f64 + within) / self.count as f64
                };
                self.permutations.iter().map(stratum).collect()
            }
            Method::Sobol => {
                let coordinate = |(d, directions): (usize, &[u32; 32])| {
                    sobol::scrambled(sobol::digits(directions, index), key(self.seed, 0x100 + d as u64))
                };
                self.directions.iter().enumerate().map(coordinate).collect()
            }
            Method::MonteCarlo | Method::Grid => {
                (0..dimensions).map(|_| ((random.next_u64() >> 12) as f64 + 0.5) * 2_f64.powi(-52)).collect()
            }
        }
    }
}

/// Quantile of the standard normal distribution, `Φ(x) = u`, for `u` in (0, 1); relative error about 1e-16.
///
/// Source: M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution", Applied Statistics 37
/// (1988), PPND16.
pub(super) fn normal_quantile(u: f64) -> f64 {
    const A: [f64; 8] = [
        3.387_132_872_796_366_5,
        133.141_667_891_784_38,
        1_971.590_950_306_551_3,
        13_731.693_765_509_46,
        45_921.953_931_549_87,
        67_265.770_927_008_7,
        33_430.575_583_588_13,
        2_509.080_928_730_122_7,
    ];
    const B: [f64; 8] = [
        1.0,
        42.313_330_701_600_91,
        687.187_007_492_057_9,
        5_394.196_021_424_751,
        21_213.794_301_586_597,
        39_307.895_800_092_71,
        28_729.085_735_721_943,
        5_226.495_278_852_545,
    ];
    const C: [f64; 8] = [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        0.241_780_725_177_450_6,
        0.022_723_844_989_269_184,
        7.745_450_142_783_414e-4,
    ];
    const D: [f64; 8] = [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        0.689_767_334_985_1,
        0.148_103_976_427_480_08,
        0.015_198_666_563_616_457,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ];
    const E: [f64; 8] = [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        0.296_560_571_828_504_87,
        0.026_532_189_526_576_124,
        0.001_242_660_947_388_078_4,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ];
    const F: [f64; 8] = [
        1.0,
        0.599_832_206_555_888,
        0.136_929_880_922_735_8,
        0.014_875_361_290_850_615,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_8e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_939_8e-15,
    ];
    let ratio = |r: f64, above: &[f64; 8], below: &[f64; 8]| {
        let horner = |c: &[f64; 8]| c.iter().rev().fold(0.0, |sum, c| sum * r + c);
        horner(above) / horner(below)
    };
    let q = u - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(0.180_625 - q * q, &A, &B);
    }
    let r = libm::sqrt(-libm::log(if q < 0.0 { u } else { 1.0 - u }));
    let x = if r <= 5.0 { ratio(r - 1.6, &C, &D) } else { ratio(r - 5.0, &E, &F) };
    if q < 0.0 { -x } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_normal_quantiles_against_scipy() {
        // `scipy.stats.norm.ppf`.
        for (u, x) in [
            (1e-10, -6.361_340_902_404_056),
            (0.001, -3.090_232_306_167_813),
            (0.02425, -1.972_961_051_311_885),
            (0.3, -0.524_400_512_708_041),
            (0.5, 0.0),
            (0.97, 1.880_793_608_151_250_9),
        ] {
            let ours = normal_quantile(u);
            // A few roundings of the coefficients' last digits.
            assert!((ours - x).abs() <= 1e-14 * f64::max(1.0, x.abs()), "{u}: {ours} instead of {x}");
        }
        assert!(normal_quantile(2_f64.powi(-53)).is_finite() && normal_quantile(1.0 - 2_f64.powi(-53)).is_finite());
    }

    #[test]
    fn a_permutation_takes_every_number_once() {
        for count in [1, 2, 3, 5, 16, 17, 1000, 4097] {
            let permutation = Permutation::new(count, mix(count));
            let mut seen: Vec<u64> = (0..count).map(|i| permutation.at(i)).collect();
            assert!(count < 16 || seen.iter().enumerate().any(|(i, v)| i as u64 != *v));
            seen.sort_unstable();
            assert!(seen.iter().copied().eq(0..count), "{count}");
        }
    }
}
