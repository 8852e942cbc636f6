//! Numbers side by side: what the hot loops are generic over, one double or the vector registers of the machine.
//!
//! A loop that is written for [`Lane`] is one piece of code for a single run (`f64`) and for a batch, and gives the same bits in
//! both. [`vectorized`] compiles it for the widest instructions that the machine turns out to have.

mod kernel;
mod wide;

use std::ops::{Add, Mul, Neg, Sub};

pub use kernel::{Kernel, narrow, vectorized};
pub(crate) use wide::Wide;

/// A number, or several that go through the same operations side by side.
///
/// Every operation acts lane by lane and rounds as `f64` does, so that lane `i` of a batch is bit for bit what `f64` gives.
/// Only [`Lane::mul_add`] fuses a product with a sum, where it is written; nothing is fused or reordered behind its back.
pub trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + 'static
{
    /// The outcome of a comparison, lane by lane.
    type Mask: Copy;

    /// The same number in every lane, as many as `self` has.
    #[must_use]
    fn all(self, value: f64) -> Self;

    /// `self * factor + summand`, rounded once: the same number on every machine. Code that runs in a
    /// [`Kernel`] has the instruction for it where the machine has one; elsewhere it is a function of the
    /// mathematics library, and slow.
    #[must_use]
    fn mul_add(self, factor: Self, summand: Self) -> Self;

    /// The larger of `self` and `other`; a NaN in `other` is passed over.
    #[must_use]
    fn max(self, other: Self) -> Self;

    /// The larger of `self` and the magnitude of `other`; a NaN in `other` is passed over.
    #[must_use]
    fn max_abs(self, other: Self) -> Self;

    /// `-limit` where `self` is below it, `limit` where above, else `self`.
    #[must_use]
    fn clamp_abs(self, limit: Self) -> Self;

    /// Where `self > other`.
    fn gt(self, other: Self) -> Self::Mask;

    /// Where `self ≤ other`.
    fn le(self, other: Self) -> Self::Mask;

    /// Where `self` and `other` are not equal; a NaN is equal to nothing.
    fn ne(self, other: Self) -> Self::Mask;

    /// Where both hold.
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// Where one of them holds.
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// Whether the mask holds in every lane.
    fn every(self, mask: Self::Mask) -> bool;

    /// `self` where the mask holds, else `other`.
    #[must_use]
    fn or_else(self, mask: Self::Mask, other: Self) -> Self;
}

impl Lane for f64 {
    type Mask = bool;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        f64::mul_add(self, factor, summand)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    #[inline(always)]
    fn max_abs(self, other: Self) -> Self {
        Lane::max(self, other.abs())
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
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn ne(self, other: Self) -> bool {
        self != other
    }

    #[inline(always)]
    fn and(self, a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn or(self, a: bool, b: bool) -> bool {
        a | b
    }

    #[inline(always)]
    fn every(self, mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn or_else(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }
}
