//! Vector registers as a [`Lane`].

// Plain loops over the registers: closures and iterators of the standard library would not become part of a kernel.
#![allow(clippy::needless_range_loop)]

use std::ops::{Add, Mul, Neg, Sub};

use pulp::Simd;

use super::Lane;

/// `B` registers of the vector instructions `S`, each of `S::F64_LANES` numbers; in memory none lies across two cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Wide<S: Simd, const B: usize> {
    simd: S,
    registers: [S::f64s; B],
}

impl<S: Simd, const B: usize> Wide<S, B> {
    /// How many numbers there are.
    pub(crate) const LANES: usize = B * S::F64_LANES;

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self { simd, registers: [simd.splat_f64s(value); B] }
    }

    /// One number a lane, in the order of the lanes; 0 where there is none.
    pub(crate) fn pack(simd: S, mut values: impl Iterator<Item = f64>) -> Self {
        let mut wide = Self::splat(simd, 0.0);
        for register in &mut wide.registers {
            for lane in pulp::bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(register)) {
                *lane = values.next().unwrap_or(0.0);
            }
        }
        wide
    }

    /// As [`pack`](Self::pack), with the instructions of `self`.
    pub(crate) fn packed(self, values: impl Iterator<Item = f64>) -> Self {
        Self::pack(self.simd, values)
    }

    /// The numbers in the order of the lanes.
    pub(crate) fn lanes(&self) -> &[f64] {
        pulp::bytemuck::cast_slice(&self.registers)
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(S, S::f64s, S::f64s) -> S::f64s) -> Self {
        let mut result = self;
        for i in 0..B {
            result.registers[i] = f(self.simd, self.registers[i], other.registers[i]);
        }
        result
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(S, S::f64s, S::f64s) -> S::m64s) -> [S::m64s; B] {
        let mut mask = [f(self.simd, self.registers[0], other.registers[0]); B];
        for i in 1..B {
            mask[i] = f(self.simd, self.registers[i], other.registers[i]);
        }
        mask
    }
}

impl<S: Simd, const B: usize> Add for Wide<S, B> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, S::add_f64s)
    }
}

impl<S: Simd, const B: usize> Sub for Wide<S, B> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, S::sub_f64s)
    }
}

impl<S: Simd, const B: usize> Mul for Wide<S, B> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, S::mul_f64s)
    }
}

impl<S: Simd, const B: usize> Neg for Wide<S, B> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.zip(self, |simd, a, _| simd.neg_f64s(a))
    }
}

impl<S: Simd, const B: usize> Lane for Wide<S, B> {
    type Mask = [S::m64s; B];

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        let mut result = self;
        for i in 0..B {
            result.registers[i] = self.simd.mul_add_f64s(self.registers[i], factor.registers[i], summand.registers[i]);
        }
        result
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // The second operand where either is a NaN.
        self.zip(other, |simd, a, b| simd.max_f64s(b, a))
    }

    #[inline(always)]
    fn max_abs(self, other: Self) -> Self {
        self.zip(other, |simd, a, b| simd.max_f64s(simd.abs_f64s(b), a))
    }

    #[inline(always)]
    fn clamp_abs(self, limit: Self) -> Self {
        self.zip(limit, |simd, a, limit| simd.min_f64s(limit, simd.max_f64s(simd.neg_f64s(limit), a)))
    }

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        self.compare(other, S::greater_than_f64s)
    }

    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.compare(other, S::less_than_or_equal_f64s)
    }

    #[inline(always)]
    fn ne(self, other: Self) -> Self::Mask {
        self.compare(other, |simd, a, b| simd.not_m64s(simd.equal_f64s(a, b)))
    }

    #[inline(always)]
    fn and(self, mut a: Self::Mask, b: Self::Mask) -> Self::Mask {
        for i in 0..B {
            a[i] = self.simd.and_m64s(a[i], b[i]);
        }
        a
    }

    #[inline(always)]
    fn or(self, mut a: Self::Mask, b: Self::Mask) -> Self::Mask {
        for i in 0..B {
            a[i] = self.simd.or_m64s(a[i], b[i]);
        }
        a
    }

    #[inline(always)]
    fn every(self, mask: Self::Mask) -> bool {
        let mut every = mask[0];
        for i in 1..B {
            every = self.simd.and_m64s(every, mask[i]);
        }
        // Whatever counts as the first: there is none.
        self.simd.first_true_m64s(self.simd.not_m64s(every)) == S::F64_LANES
    }

    #[inline(always)]
    fn or_else(self, mask: Self::Mask, other: Self) -> Self {
        let mut result = self;
        for i in 0..B {
            result.registers[i] = self.simd.select_f64s(mask[i], self.registers[i], other.registers[i]);
        }
        result
    }
}
