//! The Sobol sequence with nested uniform (Owen) scrambling.
//!
//! Direction numbers: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J.
//! Sci. Comput. 30 (2008), file new-joe-kuo-6. Scrambling: A. B. Owen, "Randomly permuted (t,m,s)-nets and
//! (t,s)-sequences" (1995): every binary digit is flipped or not by a bit that depends on the digits before it, which
//! keeps the net and makes each point uniform. The bit is a hash of seed, dimension and digits, so that a point needs no state.

use super::hash::mix;

/// Most variables of a Sobol sweep.
pub(super) const MAX_DIMENSIONS: usize = 21;

/// From the second dimension on: degree `s` and inner coefficients `a` of the primitive polynomial, initial `m_i`.
const JOE_KUO: [(u32, u32, &[u32]); MAX_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Direction numbers of one dimension, the first binary digit in the top bit.
pub(super) fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0; 32];
    let Some((s, a, m)) = dimension.checked_sub(1).and_then(|d| JOE_KUO.get(d)) else {
        for (i, v) in v.iter_mut().enumerate() {
            *v = 1 << (31 - i);
        }
        return v;
    };
    let degree = m.len();
    for i in 0..32 {
        v[i] = if i < degree {
            m[i] << (31 - i)
        } else {
            let mut next = v[i - degree] ^ (v[i - degree] >> s);
            for k in 1..degree {
                if (a >> (degree - 1 - k)) & 1 == 1 {
                    next ^= v[i - k];
                }
            }
            next
        };
    }
    v
}

/// The first 32 binary digits of a point, before scrambling.
pub(super) fn digits(directions: &[u32; 32], index: u64) -> u32 {
    directions.iter().enumerate().filter(|(bit, _)| (index >> bit) & 1 == 1).fold(0, |x, (_, v)| x ^ v)
}

/// A scrambled coordinate in (0, 1): 32 digits of the net, and 20 random ones behind them.
pub(super) fn scrambled(digits: u32, key: u64) -> f64 {
    let mut out = 0_u64;
    for bit in (0..32).rev() {
        // The digits before this one, with a leading one so that prefixes of different length differ.
        let prefix = (u64::from(digits) >> bit >> 1) | (1 << (31 - bit));
        let flip = mix(key ^ mix(prefix)) & 1;
        out = (out << 1) | (u64::from(digits >> bit) & 1) ^ flip;
    }
    let rest = mix(key ^ mix(u64::from(digits) | 1 << 32)) >> 44;
    ((out << 20 | rest) as f64 + 0.5) * 2_f64.powi(-52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `scipy.stats.qmc.Sobol(21, scramble=False, bits=32)` 1.16, points 15 and 12345, times 2³². (scipy goes through the
    /// points in Gray-code order: its point i is ours of number i ^ (i >> 1).)
    #[test]
    fn validates_direction_numbers_against_scipy() {
        let gray = |i: u64| i ^ (i >> 1);
        let ours = |i: u64| -> Vec<u32> { (0..MAX_DIMENSIONS).map(|d| digits(&directions(d), gray(i))).collect() };
        #[rustfmt::skip]
        assert_eq!(ours(15), [
            268435456, 4026531840, 2415919104, 1342177280, 2952790016, 805306368, 3489660928, 1342177280, 1342177280,
            2952790016, 268435456, 805306368, 1342177280, 2415919104, 4026531840, 3489660928, 4026531840, 4026531840,
            1342177280, 2952790016, 3489660928,
        ]);
        #[rustfmt::skip]
        assert_eq!(ours(12345), [
            2752774144, 3493593088, 688652288, 2262564864, 3816030208, 252968960, 546570240, 486801408, 3443785728,
            1845231616, 319029248, 2571894784, 3998482432, 4045144064, 148111360, 2752249856, 268697600, 218890240,
            1371799552, 1475084288, 855900160,
        ]);
    }

    #[test]
    fn scrambling_keeps_the_net() {
        for dimension in 0..MAX_DIMENSIONS {
            let v = directions(dimension);
            let mut cells: Vec<f64> =
                (0..1024).map(|i| (scrambled(digits(&v, i), mix(dimension as u64)) * 1024.0).floor()).collect();
            cells.sort_by(f64::total_cmp);
            assert!(cells.iter().copied().eq((0..1024).map(f64::from)), "dimension {dimension}");
        }
    }
}
