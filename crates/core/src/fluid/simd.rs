//! Registers of several cells: the kernels are written once over [`Lanes`].
//!
//! Only operations that IEEE 754 rounds exactly are used (no fused multiply-add, no approximate reciprocal), in one
//! order, so every instruction set gives the same bits.

use super::Simd;
use std::ops::{Add, Mul, Sub};

/// A register of `WIDTH` numbers of type `T`.
///
/// Values of the vector types exist only inside functions compiled for their instruction set, which
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
}

macro_rules! scalar_lanes {
    ($t:ty) => {
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
        }
    };
}
scalar_lanes!(f32);
scalar_lanes!(f64);

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::*;
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Add, Lanes, Mul, Sub};
    #[allow(clippy::wildcard_imports)] // every name in there says where it is from
    use std::arch::x86_64::*;

    macro_rules! operator {
        ($name:ident, $operator:ident, $method:ident, $intrinsic:ident) => {
            impl $operator for $name {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $intrinsic(self.0, other.0) })
                }
            }
        };
    }

    macro_rules! vector_lanes {
        ($($name:ident $t:ident $width:literal $register:ident:
           $load:ident $store:ident $set:ident $add:ident $sub:ident $mul:ident $div:ident $max:ident;)*) => {$(
            /// A vector register.
            #[derive(Clone, Copy)]
            #[repr(transparent)]
            pub(crate) struct $name($register);

            operator!($name, Add, add, $add);
            operator!($name, Sub, sub, $sub);
            operator!($name, Mul, mul, $mul);
            impl Lanes<$t> for $name {
                const WIDTH: usize = $width;
                #[inline(always)]
                unsafe fn load(p: *const $t) -> Self {
                    // SAFETY: promised by the caller; unaligned load.
                    Self(unsafe { $load(p) })
                }
                #[inline(always)]
                unsafe fn store(self, p: *mut $t) {
                    // SAFETY: promised by the caller; unaligned store.
                    unsafe { $store(p, self.0) }
                }
                #[inline(always)]
                fn splat(x: $t) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $set(x) })
                }
                #[inline(always)]
                fn recip(self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $div($set(1.0), self.0) })
                }
                #[inline(always)]
                fn max(self, other: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $max(self.0, other.0) })
                }
            }
        )*};
    }
    vector_lanes! {
        F32x4 f32 4 __m128:
            _mm_loadu_ps _mm_storeu_ps _mm_set1_ps _mm_add_ps
            _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_max_ps;
        F64x2 f64 2 __m128d:
            _mm_loadu_pd _mm_storeu_pd _mm_set1_pd _mm_add_pd
            _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_max_pd;
        F32x8 f32 8 __m256:
            _mm256_loadu_ps _mm256_storeu_ps _mm256_set1_ps _mm256_add_ps
            _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_max_ps;
        F64x4 f64 4 __m256d:
            _mm256_loadu_pd _mm256_storeu_pd _mm256_set1_pd _mm256_add_pd
            _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_max_pd;
        F32x16 f32 16 __m512:
            _mm512_loadu_ps _mm512_storeu_ps _mm512_set1_ps _mm512_add_ps
            _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_max_ps;
        F64x8 f64 8 __m512d:
            _mm512_loadu_pd _mm512_storeu_pd _mm512_set1_pd _mm512_add_pd
            _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_max_pd;
    }
}

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
            Self::Sse2 => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
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
