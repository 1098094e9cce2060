//! Storage types of the populations, apart from the numbers that kernels compute with.
//!
//! ```text
//! f32, f64    as they are
//! F16         IEEE 754 binary16 of 2^15 g, rounded to the nearest, ties to even; computed with in f32
//! ```
//!
//! `2^15` puts `|g| < 2` into the range of binary16 and its subnormal numbers at a spacing of `2^-39`. Reading is exact, and the
//! conversions of the processor (F16C) and of the crate `half` give the same bits.
//!
//! Reference: Lehmann et al. (2022), doi:10.1103/PhysRevE.106.015308 (there FP16S).

use super::bodies::BlockSolids;
use super::dispatch::{Real, Sweep};
use super::kernel::Operator;
use super::simd::Lanes;
use super::solid::SolidModel;
use super::{Flow, FlowRow, Fluid, Stresslet};
use crate::domain::Block;
use bytemuck::{Pod, Zeroable};
use half::f16;

/// Storage type of populations: [`F16`], `f32` or `f64`.
pub trait Population: Pod + Send + Sync {
    /// Number type of the kernels.
    type Number: Real + PopulationLanes<Self>;
    /// Reading takes a conversion, which is not done twice for the collision of a cell.
    const IS_CONVERTED: bool;

    /// The number stored; exact.
    fn read(self) -> Self::Number;
    /// Rounds.
    fn round(x: Self::Number) -> Self;
    /// Times a mask of 0 or 1.
    #[must_use]
    fn masked(self, mask: Self::Number) -> Self;
    #[doc(hidden)]
    fn sweep<M: SolidModel, O: Operator, const WALLS: bool>(sweep: Sweep<Self, M>);
    #[doc(hidden)]
    fn measure<M: SolidModel>(
        fluid: &Fluid<Self>,
        acceleration: [f64; 3],
        solids: &BlockSolids<M>,
    ) -> (Flow, Vec<Stresslet>);

    #[doc(hidden)]
    fn each_row<M: SolidModel>(
        fluid: &Fluid<Self>,
        cells: Block,
        acceleration: [f64; 3],
        solids: &BlockSolids<M>,
        visit: &mut dyn FnMut(&FlowRow),
    );

    /// The population as a number that is not rounded further.
    fn wide(self) -> f64 {
        self.read().into()
    }
}

/// A register of numbers whose populations are stored as `S`. *Scaled* is what the storage holds: a power of two times the
/// population, so that sums and products with scaled numbers are rounded as those without.
pub trait PopulationLanes<S: Population>: Lanes<S::Number> {
    /// # Safety
    /// `WIDTH` populations can be read at `p`.
    unsafe fn load_scaled(p: *const S) -> Self;
    /// # Safety
    /// `WIDTH` populations can be written at `p`.
    unsafe fn store_scaled(self, p: *mut S);
    /// From populations.
    #[must_use]
    fn scaled(self) -> Self;
    /// To populations.
    #[must_use]
    fn unscaled(self) -> Self;

    /// # Safety
    /// As for [`load_scaled`](Self::load_scaled).
    #[inline(always)]
    unsafe fn load_populations(p: *const S) -> Self {
        // SAFETY: promised by the caller.
        unsafe { Self::load_scaled(p) }.unscaled()
    }
    /// # Safety
    /// As for [`store_scaled`](Self::store_scaled).
    #[inline(always)]
    unsafe fn store_populations(self, p: *mut S) {
        // SAFETY: promised by the caller.
        unsafe { self.scaled().store_scaled(p) }
    }
}

/// A population in 16 bits: binary16 of `2^15 g`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub struct F16(f16);

impl F16 {
    /// Factor of a population before it is rounded, and its divisor after it is read.
    pub(super) const SCALE: f32 = 32_768.0;
    pub(super) const UNSCALE: f32 = 1.0 / Self::SCALE;

    /// Rounds, without the instructions of the processor.
    #[inline(always)]
    pub(super) fn from_number(g: f32) -> Self {
        Self(f16::from_f32(g * Self::SCALE))
    }

    /// The population, without the instructions of the processor.
    #[inline(always)]
    pub(super) fn number(self) -> f32 {
        self.0.to_f32() * Self::UNSCALE
    }
}

impl<S: Population<Number = S>, R: Lanes<S>> PopulationLanes<S> for R {
    #[inline(always)]
    unsafe fn load_scaled(p: *const S) -> Self {
        // SAFETY: promised by the caller.
        unsafe { R::load(p) }
    }
    #[inline(always)]
    unsafe fn store_scaled(self, p: *mut S) {
        // SAFETY: promised by the caller.
        unsafe { self.store(p) }
    }
    #[inline(always)]
    fn scaled(self) -> Self {
        self
    }
    #[inline(always)]
    fn unscaled(self) -> Self {
        self
    }
}

impl PopulationLanes<F16> for f32 {
    #[inline(always)]
    unsafe fn load_scaled(p: *const F16) -> Self {
        // SAFETY: promised by the caller.
        unsafe { *p }.0.to_f32()
    }
    #[inline(always)]
    unsafe fn store_scaled(self, p: *mut F16) {
        // SAFETY: promised by the caller.
        unsafe { *p = F16(f16::from_f32(self)) }
    }
    #[inline(always)]
    fn scaled(self) -> Self {
        self * F16::SCALE
    }
    #[inline(always)]
    fn unscaled(self) -> Self {
        self * F16::UNSCALE
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::simd::{F32x4, F32x8, F32x16, Lanes};
    use super::{F16, PopulationLanes};
    #[allow(clippy::wildcard_imports)] // every name in there says where it is from
    use std::arch::x86_64::*;

    macro_rules! converted {
        ($($name:ident: $load:ident $store:ident $read:ident $round:ident;)*) => {$(
            impl PopulationLanes<F16> for $name {
                #[inline(always)]
                unsafe fn load_scaled(p: *const F16) -> Self {
                    // SAFETY: promised by the caller; unaligned load. The type exists only where F16C or AVX-512 is enabled.
                    Self(unsafe { $read($load(p.cast())) })
                }
                #[inline(always)]
                unsafe fn store_scaled(self, p: *mut F16) {
                    // SAFETY: promised by the caller; unaligned store. The type exists only where F16C or AVX-512 is enabled.
                    unsafe { $store(p.cast(), $round::<_MM_FROUND_TO_NEAREST_INT>(self.0)) }
                }
                #[inline(always)]
                fn scaled(self) -> Self {
                    self * Self::splat(F16::SCALE)
                }
                #[inline(always)]
                fn unscaled(self) -> Self {
                    self * Self::splat(F16::UNSCALE)
                }
            }
        )*};
    }
    converted! {
        F32x4: _mm_loadl_epi64 _mm_storel_epi64 _mm_cvtph_ps _mm_cvtps_ph;
        F32x8: _mm_loadu_si128 _mm_storeu_si128 _mm256_cvtph_ps _mm256_cvtps_ph;
        F32x16: _mm256_loadu_si256 _mm256_storeu_si256 _mm512_cvtph_ps _mm512_cvtps_ph;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_population_of_16_bits_reads_as_its_value_and_is_stored_as_itself() {
        for bits in 0..=u16::MAX {
            let stored = F16(f16::from_bits(bits));
            let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
            if exponent == 31 {
                assert!(!stored.wide().is_finite());
                continue;
            }
            let size =
                if exponent == 0 { fraction } else { (1024.0 + fraction) * f64::from(1 << (exponent - 1)) };
            let value = size / f64::from(1 << 24) / f64::from(F16::SCALE);
            let value = if bits >> 15 == 0 { value } else { -value };
            assert_eq!(stored.wide().to_bits(), value.to_bits(), "{bits:#06x}");
            assert_eq!(F16::round(stored.read()).0.to_bits(), bits);
        }
    }

    #[test]
    fn a_population_is_rounded_to_the_nearest_of_16_bits_ties_to_even() {
        let all: Vec<f32> = (0..0x7c00).map(|bits| F16(f16::from_bits(bits)).number()).collect();
        for (low, pair) in (0_u16..).zip(all.windows(2)) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let even = low + (low & 1);
            for (g, bits) in [(middle, even), (middle.next_down(), low), (middle.next_up(), low + 1)] {
                assert_eq!(F16::round(g).0.to_bits(), bits, "{g:e}");
                assert_eq!(F16::round(-g).0.to_bits(), bits | 0x8000, "{g:e}");
            }
        }
        assert!(F16::round(1.999).wide().is_finite() && F16::round(2.0).wide().is_infinite());
    }

    #[cfg(target_arch = "x86_64")]
    mod registers {
        use super::super::super::simd::{F32x4, F32x8, F32x16};
        use super::*;
        use crate::fluid::Simd;

        /// Numbers and populations through registers of one kind, and one by one.
        #[inline(always)]
        fn compare<R: PopulationLanes<F16>>(numbers: &[f32; 16], stored: &[F16; 16]) {
            let (mut rounded, mut read) = ([F16::default(); 16], [0.0; 16]);
            for x in (0..16).step_by(R::WIDTH) {
                // SAFETY: registers have a divisor of 16 lanes.
                unsafe {
                    R::load(numbers.as_ptr().add(x)).store_populations(rounded.as_mut_ptr().add(x));
                    R::load_populations(stored.as_ptr().add(x)).store(read.as_mut_ptr().add(x));
                }
            }
            for k in 0..16 {
                let bits = F16::round(numbers[k]).0.to_bits();
                assert_eq!(rounded[k].0.to_bits(), bits, "{:e} {:#010x}", numbers[k], numbers[k].to_bits());
                assert_eq!(read[k].to_bits(), stored[k].read().to_bits(), "{:#06x}", stored[k].0.to_bits());
            }
        }

        #[target_feature(enable = "fma,f16c")]
        fn sse2(numbers: &[f32; 16], stored: &[F16; 16]) {
            compare::<F32x4>(numbers, stored);
        }
        #[target_feature(enable = "avx2,fma,f16c")]
        fn avx2(numbers: &[f32; 16], stored: &[F16; 16]) {
            compare::<F32x8>(numbers, stored);
        }
        #[target_feature(enable = "avx512f")]
        fn avx512(numbers: &[f32; 16], stored: &[F16; 16]) {
            compare::<F32x16>(numbers, stored);
        }

        #[test]
        fn registers_read_and_round_populations_of_16_bits_to_the_same_bits_as_single_numbers() {
            // All populations, and floats of all exponents with most patterns of the bits that rounding looks at.
            for block in 0..1_u32 << 18 {
                let stored = std::array::from_fn(|k| F16(f16::from_bits((16 * block + k as u32) as u16)));
                let numbers = std::array::from_fn(|k| {
                    f32::from_bits((16 * block + k as u32).wrapping_mul(1021).rotate_left(block >> 13))
                });
                compare::<f32>(&numbers, &stored);
                // SAFETY: the processor has the instructions.
                unsafe {
                    if Simd::Sse2.is_available() {
                        sse2(&numbers, &stored);
                    }
                    if Simd::Avx2.is_available() {
                        avx2(&numbers, &stored);
                    }
                    if Simd::Avx512.is_available() {
                        avx512(&numbers, &stored);
                    }
                }
            }
        }
    }
}
