//! Vector registers of x86-64.

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
       $fma:ident $fms:ident $fnma:ident $sqrt:ident |$a:ident, $b:ident, $then:ident, $otherwise:ident| $chosen:expr;)*) => {$(
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
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: the type exists only where its instruction set is enabled.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn if_greater(self, other: Self, then: Self, otherwise: Self) -> Self {
                let ($a, $b, $then, $otherwise) = (self.0, other.0, then.0, otherwise.0);
                // SAFETY: the type exists only where its instruction set and FMA, which implies AVX, are enabled.
                Self(unsafe { $chosen })
            }
        }
    )*};
}
macro_rules! choose {
    ($($name:ident $t:ident: $div:ident $min:ident $andnot:ident $movemask:ident ($($greater:tt)*);)*) => {$(
        impl Choose<$t> for $name {
            #[inline(always)]
            fn over(self, other: Self) -> Self {
                // SAFETY: the type exists only where its instruction set is enabled.
                Self(unsafe { $div(self.0, other.0) })
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: the type exists only where its instruction set is enabled.
                Self(unsafe { $min(self.0, other.0) })
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
    F32x4 f32: _mm_div_ps _mm_min_ps _mm_andnot_ps _mm_movemask_ps (_mm_cmpgt_ps);
    F64x2 f64: _mm_div_pd _mm_min_pd _mm_andnot_pd _mm_movemask_pd (_mm_cmpgt_pd);
    F32x8 f32: _mm256_div_ps _mm256_min_ps _mm256_andnot_ps _mm256_movemask_ps (_mm256_cmp_ps::<_CMP_GT_OQ>);
    F64x4 f64: _mm256_div_pd _mm256_min_pd _mm256_andnot_pd _mm256_movemask_pd (_mm256_cmp_pd::<_CMP_GT_OQ>);
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
        let halves = [_mm256_permute2x128_si256::<0x20>(ab, cd), _mm256_permute2x128_si256::<0x31>(ab, cd)];
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
        _mm_fmadd_ps _mm_fmsub_ps _mm_fnmadd_ps _mm_sqrt_ps
        |a, b, then, otherwise| _mm_blendv_ps(otherwise, then, _mm_cmpgt_ps(a, b));
    F64x2 f64 2 __m128d:
        _mm_loadu_pd _mm_storeu_pd _mm_set1_pd _mm_add_pd
        _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_max_pd
        _mm_fmadd_pd _mm_fmsub_pd _mm_fnmadd_pd _mm_sqrt_pd
        |a, b, then, otherwise| _mm_blendv_pd(otherwise, then, _mm_cmpgt_pd(a, b));
    F32x8 f32 8 __m256:
        _mm256_loadu_ps _mm256_storeu_ps _mm256_set1_ps _mm256_add_ps
        _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_max_ps
        _mm256_fmadd_ps _mm256_fmsub_ps _mm256_fnmadd_ps _mm256_sqrt_ps
        |a, b, then, otherwise| _mm256_blendv_ps(otherwise, then, _mm256_cmp_ps::<_CMP_GT_OQ>(a, b));
    F64x4 f64 4 __m256d:
        _mm256_loadu_pd _mm256_storeu_pd _mm256_set1_pd _mm256_add_pd
        _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_max_pd
        _mm256_fmadd_pd _mm256_fmsub_pd _mm256_fnmadd_pd _mm256_sqrt_pd
        |a, b, then, otherwise| _mm256_blendv_pd(otherwise, then, _mm256_cmp_pd::<_CMP_GT_OQ>(a, b));
    F32x16 f32 16 __m512:
        _mm512_loadu_ps _mm512_storeu_ps _mm512_set1_ps _mm512_add_ps
        _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_max_ps
        _mm512_fmadd_ps _mm512_fmsub_ps _mm512_fnmadd_ps _mm512_sqrt_ps
        |a, b, then, otherwise| _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b), otherwise, then);
    F64x8 f64 8 __m512d:
        _mm512_loadu_pd _mm512_storeu_pd _mm512_set1_pd _mm512_add_pd
        _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_max_pd
        _mm512_fmadd_pd _mm512_fmsub_pd _mm512_fnmadd_pd _mm512_sqrt_pd
        |a, b, then, otherwise| _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b), otherwise, then);
}
