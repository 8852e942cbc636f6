//! The instructions that the machine has, chosen when the program runs.

use std::sync::OnceLock;

use pulp::{Arch, NullaryFnOnce};

/// Work that [`vectorized`] or [`narrow`] runs.
pub trait Kernel {
    /// What it gives.
    type Output;

    /// Does the work. Mark it `#[inline(always)]`, and everything that it calls in its innermost loop: only what becomes
    /// part of it is compiled for those instructions.
    fn run(self) -> Self::Output;
}

struct Work<K>(K);

impl<K: Kernel> NullaryFnOnce for Work<K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.0.run()
    }
}

/// Runs `kernel`, compiled for the widest vector instructions of this machine (AVX-512, AVX2 with fused multiply-add, NEON, or
/// what every such machine has). The result is the same number on all of them; the time is not.
#[inline]
pub fn vectorized<K: Kernel>(kernel: K) -> K::Output {
    static MACHINE: OnceLock<Arch> = OnceLock::new();
    MACHINE.get_or_init(Arch::new).dispatch(Work(kernel))
}

/// The same for work on single numbers, a few side by side at most: registers of four doubles at the widest. (Wider ones take units
/// away from the instructions around them, and what is put together in them is slow to be taken out again: a drive with every effect
/// takes a third longer.)
#[inline]
pub fn narrow<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::x86::V3;
        static MACHINE: OnceLock<Option<V3>> = OnceLock::new();
        if let Some(simd) = MACHINE.get_or_init(V3::try_new) {
            return simd.vectorize(Work(kernel));
        }
    }
    vectorized(kernel)
}
