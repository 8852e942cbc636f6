//! Roots of small real polynomials, without allocation: the positive ones by isolation, all of them by Aberth's method.

use nalgebra::Complex;

/// Coefficients by rising power; room for the largest product that the analysis forms.
pub(super) type Poly = [f64; 10];

/// Lengths of [`Poly`].
const ROOM: usize = 10;

/// The positive roots of a polynomial where it changes its sign, rising.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Roots {
    values: [f64; ROOM],
    count: usize,
}

impl Roots {
    pub(super) fn as_slice(&self) -> &[f64] {
        &self.values[..self.count]
    }

    fn push(&mut self, value: f64) {
        if let Some(place) = self.values.get_mut(self.count) {
            *place = value;
            self.count += 1;
        }
    }
}

/// Roots outside of this range, and of its inverse, are none: nothing of the analysis lies there.
const FARTHEST: f64 = 1e60;

/// The roots in `(0, ∞)` where `p` (by rising power) changes its sign.
///
/// Between two neighbouring roots of the derivative there is at most one: from the derivative of degree one upwards every
/// root is bracketed by those of the next derivative and then found by Newton's method inside its bracket. Roots of even
/// multiplicity are no change of sign and are left out.
pub(super) fn positive_roots(p: &Poly) -> Roots {
    let Some(high) = p.iter().rposition(|c| *c != 0.0) else { return Roots::default() };
    // Zero is no positive root.
    let low = p.iter().position(|c| *c != 0.0).unwrap_or(high);
    let degree = high - low;
    let coefficients = &p[low..=high];
    if degree == 0 || coefficients.iter().any(|c| !c.is_finite()) {
        return Roots::default();
    }
    // Fujiwara's bound, of the polynomial and of the one with the inverse roots.
    let bound = |lead: f64, others: &mut dyn Iterator<Item = f64>| {
        2.0 * (1..).zip(others).map(|(k, c)| libm::pow((c / lead).abs(), 1.0 / f64::from(k))).fold(0.0, f64::max)
    };
    let farthest = bound(coefficients[degree], &mut coefficients[..degree].iter().rev().copied()).min(FARTHEST);
    let nearest = 1.0 / bound(coefficients[0], &mut coefficients[1..].iter().copied()).min(FARTHEST);
    // A hair wider, since a root may lie on the bound itself.
    let ends = (nearest * (1.0 - 1e-9), farthest * (1.0 + 1e-9));

    // derivatives[k]: the k-th one, of degree `degree - k`.
    let mut derivatives = [[0.0; ROOM]; ROOM];
    derivatives[0][..=degree].copy_from_slice(coefficients);
    for k in 1..degree {
        for i in 0..=degree - k {
            derivatives[k][i] = (i + 1) as f64 * derivatives[k - 1][i + 1];
        }
    }
    let mut roots = Roots::default();
    for k in (0..degree).rev() {
        let of = &derivatives[k][..=degree - k];
        let mut found = Roots::default();
        let mut from = (ends.0, horner(of, ends.0).0);
        for &x in roots.as_slice().iter().chain([&ends.1]) {
            let to = (x, horner(of, x).0);
            if from.1 == 0.0 {
                found.push(from.0);
            } else if (from.1 < 0.0) != (to.1 < 0.0) && to.1 != 0.0 {
                found.push(bracketed(of, from.0, to.0, from.1 < 0.0));
            }
            from = to;
        }
        roots = found;
    }
    roots
}

/// Value and slope.
fn horner(p: &[f64], x: f64) -> (f64, f64) {
    p.iter().rev().fold((0.0, 0.0), |(value, slope), c| (value * x + c, slope * x + value))
}

/// The one root in `(low, high)`, both positive: Newton's method, halving (the logarithm, where the bracket is wide) when
/// it leaves the bracket or makes little headway.
fn bracketed(p: &[f64], mut low: f64, mut high: f64, rising: bool) -> f64 {
    let middle = |a: f64, b: f64| if b > 4.0 * a { a.sqrt() * b.sqrt() } else { 0.5 * (a + b) };
    let mut x = middle(low, high);
    for i in 1..200 {
        let (value, slope) = horner(p, x);
        if value == 0.0 {
            return x;
        }
        if (value > 0.0) == rising {
            high = x
        } else {
            low = x
        }
        let newton = x - value / slope;
        let next = if newton > low && newton < high && i % 8 != 0 { newton } else { middle(low, high) };
        if (next - x).abs() <= 4e-16 * x || high - low <= 4e-16 * x {
            return next;
        }
        x = next;
    }
    x
}

/// `p` times `q`; what finds no room is zero by construction.
pub(super) fn product(p: &Poly, q: &Poly) -> Poly {
    let mut out = [0.0; ROOM];
    for (i, a) in p.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        for (place, b) in out[i..].iter_mut().zip(q) {
            *place += a * b;
        }
    }
    out
}

/// `a' b - a b'`, zero where `a/b` is stationary. The highest coefficients cancel exactly.
pub(super) fn wronskian(a: &Poly, b: &Poly) -> Poly {
    let mut out = [0.0; ROOM];
    for (i, p) in a.iter().enumerate().filter(|(_, p)| **p != 0.0) {
        for (j, q) in b.iter().enumerate().filter(|(j, _)| *j != i) {
            if let Some(place) = (i + j).checked_sub(1).and_then(|k| out.get_mut(k)) {
                *place += (i as f64 - j as f64) * (p * q);
            }
        }
    }
    out
}

/// Most roots that [`all_roots`] finds.
pub(super) const MOST_ROOTS: usize = 4;

/// All roots of `p` (by rising power, the last one not zero, degree at most [`MOST_ROOTS`]); the rest of the array is zero.
///
/// Aberth's simultaneous iteration: it needs no deflation, so that no root spoils another, and its corrections are relative
/// to each root, small ones too.
pub(super) fn all_roots(p: &[f64]) -> [Complex<f64>; MOST_ROOTS] {
    let mut roots = [Complex::new(0.0, 0.0); MOST_ROOTS];
    // Roots at zero are exact.
    let low = p.iter().position(|c| *c != 0.0).unwrap_or(0);
    let p = &p[low..];
    let degree = p.len().saturating_sub(1).min(MOST_ROOTS);
    if degree == 0 {
        return roots;
    }
    let radii = starting_radii(&p[..=degree]);
    for (k, root) in roots[..degree].iter_mut().enumerate() {
        // Not symmetric to the real axis: no two may stay together.
        let angle = 0.7 + 2.4 * k as f64;
        *root = Complex::new(radii[k] * libm::cos(angle), radii[k] * libm::sin(angle));
    }
    for _ in 0..100 {
        let mut settled = true;
        for k in 0..degree {
            let z = roots[k];
            let (mut value, mut slope) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
            for c in p.iter().rev() {
                slope = slope * z + value;
                value = value * z + c;
            }
            if value == Complex::new(0.0, 0.0) {
                continue;
            }
            let repulsion: Complex<f64> =
                (0..degree).filter(|j| *j != k && roots[*j] != z).map(|j| (z - roots[j]).inv()).sum();
            // 1 / (p'/p - Σ 1/(z - z_j))
            let step = (slope / value - repulsion).inv();
            if step.re.is_finite() && step.im.is_finite() {
                roots[k] = z - step;
                settled &= step.norm_sqr() <= 1e-31 * z.norm_sqr();
            }
        }
        if settled {
            break;
        }
    }
    pair(&mut roots[..degree]);
    roots
}

/// Roots of a real polynomial are real or come in pairs; made exactly so.
fn pair(roots: &mut [Complex<f64>]) {
    let mut open = [true; MOST_ROOTS];
    for k in 0..roots.len() {
        if !open[k] {
            continue;
        }
        let mirror = roots[k].conj();
        // The nearest to the mirror image; a real root is that itself.
        let apart = |j: usize| (roots[j] - mirror).norm_sqr();
        let other = (k..roots.len()).filter(|j| open[*j]).min_by(|i, j| apart(*i).total_cmp(&apart(*j))).unwrap_or(k);
        if other == k {
            roots[k].im = 0.0;
        } else {
            roots[other] = mirror;
        }
        (open[k], open[other]) = (false, false);
    }
}

/// Magnitudes near those of the roots: the slopes of the upper hull of the coefficients' logarithms (Bini's choice).
fn starting_radii(p: &[f64]) -> [f64; MOST_ROOTS] {
    let mut radii = [1.0; MOST_ROOTS];
    let degree = p.len() - 1;
    let height = |i: usize| if p[i] == 0.0 { f64::NEG_INFINITY } else { libm::log(p[i].abs()) };
    let mut from = 0;
    while from < degree {
        // The next corner of the hull is the one that is reached most steeply.
        let slope = |to: usize| (height(to) - height(from)) / (to - from) as f64;
        let to = (from + 1..=degree).fold(degree, |best, to| if slope(to) > slope(best) { to } else { best });
        let radius = libm::exp(-slope(to));
        radii[from..to].fill(if radius.is_finite() && radius > 0.0 { radius } else { 1.0 });
        from = to;
    }
    radii
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn from_roots(roots: &[Complex<f64>]) -> Vec<f64> {
        let mut p = vec![Complex::new(1.0, 0.0)];
        for root in roots {
            let mut next = vec![Complex::new(0.0, 0.0); p.len() + 1];
            for (i, c) in p.iter().enumerate() {
                next[i + 1] += c;
                next[i] -= c * root;
            }
            p = next;
        }
        p.iter().map(|c| c.re).collect()
    }

    #[test]
    fn validates_positive_roots_of_polynomials_with_known_ones() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        for _ in 0..2000 {
            let count = rng.random_range(1..6_usize);
            // At least a factor of 2 apart, over ten decades: conditioned well enough for nine digits.
            let mut magnitude = 10f64.powf(rng.random_range(-6.0..0.0));
            let mut roots = Vec::new();
            for _ in 0..count {
                magnitude *= rng.random_range(2.0..30.0);
                roots.push(if rng.random_bool(0.7) { magnitude } else { -magnitude });
            }
            let p = from_roots(&roots.iter().map(|r| Complex::new(*r, 0.0)).collect::<Vec<_>>());
            let mut padded = [0.0; ROOM];
            // A common factor x and a negative sign change nothing.
            padded[1..=p.len()].copy_from_slice(&p.iter().map(|c| -3.0 * c).collect::<Vec<_>>());
            let found = positive_roots(&padded);
            let expected: Vec<f64> = roots.iter().copied().filter(|r| *r > 0.0).collect();
            assert_eq!(found.as_slice().len(), expected.len(), "{roots:?} {found:?}");
            for (a, b) in found.as_slice().iter().zip(&expected) {
                assert!((a / b - 1.0).abs() < 1e-9, "{roots:?} {found:?}");
            }
        }
    }

    #[test]
    fn degenerate_polynomials_have_no_positive_roots() {
        for p in [vec![], vec![0.0; 3], vec![2.0], vec![0.0, 1.0], vec![1.0, 0.0, 1.0], vec![f64::NAN, 1.0]] {
            let mut padded = [0.0; ROOM];
            padded[..p.len()].copy_from_slice(&p);
            assert!(positive_roots(&padded).as_slice().is_empty(), "{p:?}");
        }
    }

    #[test]
    fn validates_all_roots_of_polynomials_with_known_ones() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
        for _ in 0..2000 {
            let mut roots = Vec::new();
            let count = rng.random_range(1..=MOST_ROOTS);
            while roots.len() < count {
                let magnitude = 10f64.powf(rng.random_range(-9.0..3.0));
                if roots.len() + 2 <= count && rng.random_bool(0.5) {
                    let angle = rng.random_range(0.2..2.9_f64);
                    let root = Complex::new(magnitude * angle.cos(), magnitude * angle.sin());
                    roots.extend([root, root.conj()]);
                } else {
                    roots.push(Complex::new(if rng.random_bool(0.5) { magnitude } else { -magnitude }, 0.0));
                }
            }
            let close = |a: &Complex<f64>, b: &Complex<f64>| (a - b).norm() < 0.05 * a.norm().max(b.norm());
            if (0..count).any(|i| (0..i).any(|j| close(&roots[i], &roots[j]))) {
                continue;
            }
            let p = from_roots(&roots);
            let found = all_roots(&p);
            for root in &roots {
                let nearest = found[..count].iter().map(|z| (z - root).norm()).fold(f64::INFINITY, f64::min);
                // Relative to each root, small ones too; 5 % apart costs up to four digits of sixteen.
                assert!(nearest < 1e-9 * root.norm(), "{roots:?} {found:?}");
            }
        }
    }
}
