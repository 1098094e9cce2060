//! Solids in a register of cells as the kernels use them; formulas in [`kernel`](super::kernel).

use super::kernel::Number;
use super::simd::Lanes;
use super::solid::SolidRow;

/// Leak that keeps cells within a solid from reflecting everything, and the part of it that overlaps add (sc1 to sc3).
const LEAK: f64 = 0.01;
const FILM: f64 = 20.0;

/// Solids in a register of cells.
pub(crate) struct Covered<R> {
    /// `B`, and `1 - B`.
    pub(crate) open: R,
    pub(crate) solid: R,
    /// `sum e_k`, and one over it.
    fractions: R,
    pub(crate) weight: R,
    /// `u_s`.
    pub(crate) velocity: [R; 3],
}

impl<R> Covered<R> {
    /// Those of the register at cell `x`.
    ///
    /// # Safety
    /// The row has `WIDTH` cells from `x` on.
    #[inline(always)]
    pub(crate) unsafe fn load<T: Number>(solids: &SolidRow<T>, x: usize) -> Self
    where
        R: Lanes<T>,
    {
        // SAFETY: promised by the caller; the arrays hold a chunk more.
        let at = |values: &[T]| unsafe { R::load(values.as_ptr().add(x)) };
        let (open, fractions) = (at(&solids.permeability), at(&solids.fraction_sum));
        let weight = fractions.max(R::splat(T::TINY)).recip();
        let [x_sum, y_sum, z_sum] = &solids.velocity_sum;
        Self {
            open,
            solid: R::splat(T::ONE) - open,
            fractions,
            weight,
            velocity: [at(x_sum) * weight, at(y_sum) * weight, at(z_sum) * weight],
        }
    }

    /// `(1 - e) + l` and `b` of partially saturated cells.
    #[inline(always)]
    pub(crate) fn reflecting<T: Number>(&self, above_half: R) -> (R, R)
    where
        R: Lanes<T>,
    {
        let overlap = (self.fractions - self.solid).max(R::splat(T::ZERO));
        let c = |x: f64| R::splat(T::from_f64(x));
        let through = self.open + c(LEAK) + c(FILM) * (above_half * overlap);
        (through, self.solid * above_half * (through + above_half).recip())
    }

    /// Momentum of a partially saturated cell, that of its solid as it moves.
    #[inline(always)]
    pub(crate) fn with_solid<T: Number>(&self, momentum: R, rho: R, axis: usize) -> R
    where
        R: Lanes<T>,
    {
        momentum - self.solid * (momentum - rho * self.velocity[axis])
    }
}
