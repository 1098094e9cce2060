//! Registers of several cells: the kernels are written once over [`Lanes`].
//!
//! Only operations that IEEE 754 rounds exactly are used (among them fused multiply-add, where it is written; no
//! approximate reciprocal), in one order, so every instruction set gives the same bits.

use super::Simd;
use crate::math::FIXED_MAGIC;
use std::ops::{Add, Mul, Sub};

/// A register of `WIDTH` numbers of type `T`.
///
/// Values of the vector types exist only inside functions compiled for their instruction set, FMA and F16C, which
/// [`dispatch`](super::dispatch) guarantees; that is what makes the intrinsics inside sound.
pub trait Lanes<T>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Numbers in the register.
    const WIDTH: usize;
    /// # Safety
    /// `WIDTH` numbers can be read at `p`.
    unsafe fn load(p: *const T) -> Self;
    /// # Safety
    /// `WIDTH` numbers can be written at `p`.
    unsafe fn store(self, p: *mut T);
    /// The same number in every lane.
    fn splat(x: T) -> Self;
    /// `1 / self`.
    fn recip(self) -> Self;
    /// `self > other ? self : other` lane by lane.
    fn max(self, other: Self) -> Self;
    /// `self * factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self * factor - term`, rounded once.
    fn mul_sub(self, factor: Self, term: Self) -> Self;
    /// `term - self * factor`, rounded once.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// `self > other ? then : otherwise` lane by lane.
    fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self;
}

/// Registers for geometry.
pub trait Choose<T>: Lanes<T> {
    /// `self / other`.
    fn over(self, other: Self) -> Self;
    /// `self < other ? self : other` lane by lane.
    fn min(self, other: Self) -> Self;
    /// Returns true if `self > other` in some lane.
    fn any_greater(self, other: Self) -> bool;

    /// The size of the number.
    fn size(self) -> Self;
}

/// Registers in which fixed-point numbers are added up, as integers in the place of the numbers; 0 is 0.
pub trait Tally: Lanes<f64> {
    /// # Safety
    /// `WIDTH` numbers can be read at `p`.
    unsafe fn widen(p: *const f32) -> Self;
    /// Writes the numbers in single precision.
    ///
    /// # Safety
    /// `WIDTH` numbers can be written at `p`.
    unsafe fn narrow(self, p: *mut f32);
    /// Adds the fixed-point number of `x`, and the bits of [`FIXED_MAGIC`], lane by lane.
    fn tally(self, x: Self) -> Self;
    /// Sums of the integers in all lanes of each, wrapping.
    fn totals(sums: [Self; 4]) -> [i64; 4];
}

/// Registers of both precisions of one instruction set.
pub trait Registers {
    type F: Choose<f32>;
    type D: Choose<f64> + Tally;
}

/// Work that is compiled for each instruction set; `run` must be inlined always.
pub(crate) trait Vectorised {
    fn run<V: Registers>(self);
}

/// Does the work with these instructions, which the processor must have; they do not change a bit.
pub(crate) fn vectorise(simd: Simd, work: impl Vectorised) {
    assert!(simd.is_available(), "{simd:?} on a processor that has it");
    #[cfg(target_arch = "x86_64")]
    {
        macro_rules! compiled_for {
            ($name:ident $registers:ty: $feature:literal) => {
                #[target_feature(enable = $feature)]
                fn $name(work: impl Vectorised) {
                    work.run::<$registers>();
                }
            };
        }
        compiled_for!(sse2 Narrow: "fma");
        compiled_for!(avx2 Wide: "avx2,fma");
        compiled_for!(avx512 Wide: "avx512f");
        match simd {
            // SAFETY: just checked.
            Simd::Avx512 => unsafe { avx512(work) },
            // SAFETY: just checked.
            Simd::Avx2 => unsafe { avx2(work) },
            // SAFETY: just checked.
            Simd::Sse2 => unsafe { sse2(work) },
            Simd::Scalar => work.run::<Single>(),
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    work.run::<Single>();
}

impl Tally for f64 {
    #[inline(always)]
    unsafe fn widen(p: *const f32) -> Self {
        // SAFETY: promised by the caller.
        unsafe { (*p).into() }
    }
    #[inline(always)]
    unsafe fn narrow(self, p: *mut f32) {
        // SAFETY: promised by the caller.
        unsafe { *p = self as f32 }
    }
    #[inline(always)]
    fn tally(self, x: Self) -> Self {
        Self::from_bits(self.to_bits().wrapping_add((x + FIXED_MAGIC).to_bits()))
    }
    #[inline(always)]
    fn totals([a, b, c, d]: [Self; 4]) -> [i64; 4] {
        [a.to_bits() as i64, b.to_bits() as i64, c.to_bits() as i64, d.to_bits() as i64]
    }
}

/// One number at a time.
pub(crate) struct Single;

impl Registers for Single {
    type F = f32;
    type D = f64;
}

macro_rules! scalar_lanes {
    ($t:ty) => {
        impl Choose<$t> for $t {
            #[inline(always)]
            fn over(self, other: Self) -> Self {
                self / other
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn any_greater(self, other: Self) -> bool {
                self > other
            }
            #[inline(always)]
            fn size(self) -> Self {
                self.abs()
            }
        }

        impl Lanes<$t> for $t {
            const WIDTH: usize = 1;
            #[inline(always)]
            unsafe fn load(p: *const $t) -> Self {
                // SAFETY: promised by the caller.
                unsafe { *p }
            }
            #[inline(always)]
            unsafe fn store(self, p: *mut $t) {
                // SAFETY: promised by the caller.
                unsafe { *p = self }
            }
            #[inline(always)]
            fn splat(x: $t) -> Self {
                x
            }
            #[inline(always)]
            fn recip(self) -> Self {
                1.0 / self
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                <$t>::mul_add(self, factor, term)
            }
            #[inline(always)]
            fn mul_sub(self, factor: Self, term: Self) -> Self {
                <$t>::mul_add(self, factor, -term)
            }
            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                <$t>::mul_add(-self, factor, term)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self {
                if self > other { then } else { otherwise }
            }
        }
    };
}
scalar_lanes!(f32);
scalar_lanes!(f64);

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::*;
#[cfg(target_arch = "x86_64")]
mod x86;

impl Simd {
    /// The best instruction set of this processor.
    pub fn best() -> Self {
        [Self::Avx512, Self::Avx2, Self::Sse2]
            .into_iter()
            .find(|simd| simd.is_available())
            .unwrap_or(Self::Scalar)
    }

    /// Its name in case files and summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Returns true if this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => is_x86_feature_detected!("fma") && is_x86_feature_detected!("f16c"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && Self::Sse2.is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f"),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// Asks for the cache line at `p`, any address, soon to be used: 19 to 36 streams are more than the hardware follows.
#[inline(always)]
pub(crate) fn prefetch<T>(p: *const T) {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    // SAFETY: a prefetch reads nothing and cannot fault.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(p.cast());
    }
    #[cfg(any(not(target_arch = "x86_64"), miri))]
    let _ = p;
}
