//! The number type of the loop: one double, or several side by side.

use std::ops::{Add, Mul, Neg, Sub};

/// A number, or several that go through the same operations side by side.
///
/// Every operation acts lane by lane and rounds as `f64` does, so that lane `i` of a batch is bit for bit what `f64` gives.
pub trait Lane:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + 'static
{
    /// The outcome of a comparison, lane by lane.
    type Mask: Copy + Default;

    /// The same number in every lane.
    fn splat(value: f64) -> Self;

    /// `-limit` where `self` is below it, `limit` where above, else `self`.
    #[must_use]
    fn clamp_abs(self, limit: Self) -> Self;

    /// Where `self > other`.
    fn gt(self, other: Self) -> Self::Mask;

    /// Where `self` and `other` differ.
    fn ne(self, other: Self) -> Self::Mask;

    /// Where both hold.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// `a` where the mask holds, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
}

impl Lane for f64 {
    type Mask = bool;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn clamp_abs(self, limit: Self) -> Self {
        let low = if self < -limit { -limit } else { self };
        if low > limit { limit } else { low }
    }

    #[inline(always)]
    fn gt(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn ne(self, other: Self) -> bool {
        self != other
    }

    #[inline(always)]
    fn and(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}

/// `N` numbers side by side; the compiler turns the loops into vector instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Default for Lanes<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|a| -a))
    }
}

/// A mask of [`Lanes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneMask<const N: usize>(pub [bool; N]);

impl<const N: usize> Default for LaneMask<N> {
    fn default() -> Self {
        Self([false; N])
    }
}

impl<const N: usize> Lane for Lanes<N> {
    type Mask = LaneMask<N>;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn clamp_abs(self, limit: Self) -> Self {
        self.zip(limit, f64::clamp_abs)
    }

    #[inline(always)]
    fn gt(self, other: Self) -> LaneMask<N> {
        LaneMask(std::array::from_fn(|i| self.0[i] > other.0[i]))
    }

    #[inline(always)]
    fn ne(self, other: Self) -> LaneMask<N> {
        LaneMask(std::array::from_fn(|i| self.0[i] != other.0[i]))
    }

    #[inline(always)]
    fn and(a: LaneMask<N>, b: LaneMask<N>) -> LaneMask<N> {
        LaneMask(std::array::from_fn(|i| a.0[i] & b.0[i]))
    }

    #[inline(always)]
    fn select(mask: LaneMask<N>, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
}
