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
}

/// Registers in which lanes can be chosen by comparison: for geometry.
pub trait Choose<T>: Lanes<T> {
    /// `self / other`.
    fn over(self, other: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// `self < other ? self : other` lane by lane.
    fn min(self, other: Self) -> Self;
    /// `self > other ? then : otherwise` lane by lane.
    fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self;
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
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self {
                if self > other { then } else { otherwise }
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
        }
    };
}
scalar_lanes!(f32);
scalar_lanes!(f64);

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::*;
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Add, Choose, FIXED_MAGIC, Lanes, Mul, Registers, Sub, Tally};
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
           $load:ident $store:ident $set:ident $add:ident $sub:ident $mul:ident $div:ident $max:ident
           $fma:ident $fms:ident $fnma:ident;)*) => {$(
            /// A vector register.
            #[derive(Clone, Copy)]
            #[repr(transparent)]
            pub(crate) struct $name(pub(in crate::fluid) $register);

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
                #[inline(always)]
                fn mul_add(self, factor: Self, term: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set and FMA are enabled.
                    Self(unsafe { $fma(self.0, factor.0, term.0) })
                }
                #[inline(always)]
                fn mul_sub(self, factor: Self, term: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set and FMA are enabled.
                    Self(unsafe { $fms(self.0, factor.0, term.0) })
                }
                #[inline(always)]
                fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set and FMA are enabled.
                    Self(unsafe { $fnma(self.0, factor.0, term.0) })
                }
            }
        )*};
    }
    macro_rules! choose {
        ($($name:ident $t:ident: $div:ident $sqrt:ident $min:ident $andnot:ident $movemask:ident $blend:ident ($($greater:tt)*);)*) => {$(
            impl Choose<$t> for $name {
                #[inline(always)]
                fn over(self, other: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $div(self.0, other.0) })
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $sqrt(self.0) })
                }
                #[inline(always)]
                fn min(self, other: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $min(self.0, other.0) })
                }
                #[inline(always)]
                fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self {
                    // SAFETY: the type exists only where its instruction set and FMA, which implies AVX, are enabled.
                    Self(unsafe { $blend(otherwise.0, then.0, $($greater)*(self.0, other.0)) })
                }
                #[inline(always)]
                fn any_greater(self, other: Self) -> bool {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    unsafe { $movemask($($greater)*(self.0, other.0)) != 0 }
                }
                #[inline(always)]
                fn size(self) -> Self {
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $andnot(Self::splat(-0.0).0, self.0) })
                }
            }
        )*};
    }
    choose! {
        F32x4 f32: _mm_div_ps _mm_sqrt_ps _mm_min_ps _mm_andnot_ps _mm_movemask_ps _mm_blendv_ps (_mm_cmpgt_ps);
        F64x2 f64: _mm_div_pd _mm_sqrt_pd _mm_min_pd _mm_andnot_pd _mm_movemask_pd _mm_blendv_pd (_mm_cmpgt_pd);
        F32x8 f32: _mm256_div_ps _mm256_sqrt_ps _mm256_min_ps _mm256_andnot_ps _mm256_movemask_ps _mm256_blendv_ps
            (_mm256_cmp_ps::<_CMP_GT_OQ>);
        F64x4 f64: _mm256_div_pd _mm256_sqrt_pd _mm256_min_pd _mm256_andnot_pd _mm256_movemask_pd _mm256_blendv_pd
            (_mm256_cmp_pd::<_CMP_GT_OQ>);
    }

    macro_rules! tally {
        ($($name:ident: $add:ident $to_integers:ident $to_numbers:ident $low:ident $high:ident $put:ident
           |$p:ident, $x:ident| $widen:expr, $narrow:expr;)*) => {$(
            impl Tally for $name {
                #[inline(always)]
                unsafe fn widen($p: *const f32) -> Self {
                    // SAFETY: promised by the caller.
                    Self(unsafe { $widen })
                }
                #[inline(always)]
                unsafe fn narrow(self, $p: *mut f32) {
                    let $x = self.0;
                    // SAFETY: promised by the caller.
                    unsafe { $narrow }
                }
                #[inline(always)]
                fn tally(self, x: Self) -> Self {
                    let x = x + Self::splat(FIXED_MAGIC);
                    // SAFETY: the type exists only where its instruction set is enabled.
                    Self(unsafe { $to_numbers($add($to_integers(self.0), $to_integers(x.0))) })
                }
                #[inline(always)]
                fn totals([a, b, c, d]: [Self; 4]) -> [i64; 4] {
                    let mut totals = [0; 4];
                    // SAFETY: the type exists only where its instruction set is enabled.
                    unsafe {
                        // Sums of neighbouring lanes of two registers, side by side.
                        let (a, b) = ($to_integers(a.0), $to_integers(b.0));
                        let (c, d) = ($to_integers(c.0), $to_integers(d.0));
                        let ab = $add($low(a, b), $high(a, b));
                        let cd = $add($low(c, d), $high(c, d));
                        $put(totals.as_mut_ptr(), ab, cd);
                    }
                    totals
                }
            }
        )*};
    }
    /// Writes the totals of four registers from those of neighbouring lanes.
    ///
    /// # Safety
    /// Four numbers can be written at `to`.
    #[inline(always)]
    unsafe fn put_narrow(to: *mut i64, ab: __m128i, cd: __m128i) {
        // SAFETY: promised by the caller; unaligned stores.
        unsafe {
            _mm_storeu_si128(to.cast(), ab);
            _mm_storeu_si128(to.add(2).cast(), cd);
        }
    }

    /// The same; wide registers hold two halves.
    ///
    /// # Safety
    /// Four numbers can be written at `to`, and the caller is compiled for AVX2.
    #[inline(always)]
    unsafe fn put_wide(to: *mut i64, ab: __m256i, cd: __m256i) {
        // SAFETY: promised by the caller; unaligned store.
        unsafe {
            let halves =
                [_mm256_permute2x128_si256::<0x20>(ab, cd), _mm256_permute2x128_si256::<0x31>(ab, cd)];
            _mm256_storeu_si256(to.cast(), _mm256_add_epi64(halves[0], halves[1]));
        }
    }

    tally! {
        F64x2: _mm_add_epi64 _mm_castpd_si128 _mm_castsi128_pd
            _mm_unpacklo_epi64 _mm_unpackhi_epi64 put_narrow
            |p, x| _mm_cvtps_pd(_mm_castsi128_ps(_mm_loadl_epi64(p.cast()))),
            _mm_storel_epi64(p.cast(), _mm_castps_si128(_mm_cvtpd_ps(x)));
        F64x4: _mm256_add_epi64 _mm256_castpd_si256 _mm256_castsi256_pd
            _mm256_unpacklo_epi64 _mm256_unpackhi_epi64 put_wide
            |p, x| _mm256_cvtps_pd(_mm_loadu_ps(p)), _mm_storeu_ps(p, _mm256_cvtpd_ps(x));
    }

    /// 128-bit registers.
    pub(crate) struct Narrow;
    impl Registers for Narrow {
        type F = F32x4;
        type D = F64x2;
    }

    /// 256-bit registers.
    pub(crate) struct Wide;
    impl Registers for Wide {
        type F = F32x8;
        type D = F64x4;
    }

    vector_lanes! {
        F32x4 f32 4 __m128:
            _mm_loadu_ps _mm_storeu_ps _mm_set1_ps _mm_add_ps
            _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_max_ps
            _mm_fmadd_ps _mm_fmsub_ps _mm_fnmadd_ps;
        F64x2 f64 2 __m128d:
            _mm_loadu_pd _mm_storeu_pd _mm_set1_pd _mm_add_pd
            _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_max_pd
            _mm_fmadd_pd _mm_fmsub_pd _mm_fnmadd_pd;
        F32x8 f32 8 __m256:
            _mm256_loadu_ps _mm256_storeu_ps _mm256_set1_ps _mm256_add_ps
            _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_max_ps
            _mm256_fmadd_ps _mm256_fmsub_ps _mm256_fnmadd_ps;
        F64x4 f64 4 __m256d:
            _mm256_loadu_pd _mm256_storeu_pd _mm256_set1_pd _mm256_add_pd
            _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_max_pd
            _mm256_fmadd_pd _mm256_fmsub_pd _mm256_fnmadd_pd;
        F32x16 f32 16 __m512:
            _mm512_loadu_ps _mm512_storeu_ps _mm512_set1_ps _mm512_add_ps
            _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_max_ps
            _mm512_fmadd_ps _mm512_fmsub_ps _mm512_fnmadd_ps;
        F64x8 f64 8 __m512d:
            _mm512_loadu_pd _mm512_storeu_pd _mm512_set1_pd _mm512_add_pd
            _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_max_pd
            _mm512_fmadd_pd _mm512_fmsub_pd _mm512_fnmadd_pd;
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
