//! Solid data of one row of cells, which exists only while the row is swept, and the collision of such cells.

use super::Real;
use super::kernel::{Moments, Row};
use super::simd::Lanes;
use crate::lattice::Q;
use crate::math::to_fixed;
use std::ops::Range;

/// Cells with one common entry of solid data: the widest register of single precision.
pub const CHUNK: usize = 16;

/// Method of coupling solids to the fluid: collision of the cells they cover, compiled into the sweep.
pub trait SolidModel: Copy {
    /// Populations relax in pairs of opposite directions, even with one relaxation time: a cell without solids must not be
    /// rounded differently where it shares a register with one that has some.
    const PAIRS: bool;
    /// Solid fractions are of the volume: they add up to at most one, `B = max(0, 1 - sum e_k)`, and divide the momentum of
    /// a cell among bodies. Otherwise `B = prod (1 - phi_k)`.
    const BY_VOLUME: bool;

    /// Collides the register of cells at `x` under the acceleration `a`, writes what the solids exchange to `solids`, and
    /// returns the mean momentum of solid and fluid.
    ///
    /// # Safety
    /// The row has `WIDTH` cells from `x` on.
    unsafe fn collide<T: Real, R: Lanes<T>, const TRT: bool>(
        self,
        g: &mut [R; Q],
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<T>,
        solids: &mut SolidRow<T>,
        x: usize,
    ) -> [R; 3];

    /// What [`collide`](Self::collide) would do to a register of cells.
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        row: &Row<T>,
    ) -> Measure<R>;

    /// Momentum that a cell of solid fraction `e` receives over `rho (u_s - u)`; `t = tau - 1/2`.
    fn drag(self, e: f64, t: f64) -> f64;

    /// Momentum that a body receives along an axis from cells that exchanged momentum `p` and mass `m`, given its solid
    /// fractions and velocities there.
    fn force<T: Real>(p: &[T; CHUNK], m: &[T; CHUNK], fraction: &[T; CHUNK], u: &[T; CHUNK]) -> [T; CHUNK];
}

/// Momentum of a register of cells, as a collision would see it.
pub struct Measure<R> {
    /// That of solid and fluid.
    pub(crate) mean: [R; 3],
    /// What the solids receive, over `u - u_s`.
    pub(crate) received: R,
    /// Part of the deviation from equilibrium that the solids reflect, if they reflect any.
    pub(crate) reflected: Option<R>,
}

/// Solids in a register of cells.
pub struct Covered<R> {
    /// `B`, and `1 - B`.
    pub(crate) open: R,
    pub(crate) solid: R,
    /// `sum e_k`, and one over it.
    pub(crate) fractions: R,
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
    pub(crate) unsafe fn load<T: Real>(solids: &SolidRow<T>, x: usize) -> Self
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
}

/// Solid data of the row that is being swept, lattice units.
///
/// Solids in one cell combine as `u_s = sum phi_k u_k / sum phi_k` (Marquardt et al. 2024), and their fractions to `B` as
/// the [`SolidModel`] says; they are [added](Self::add) in ascending order of particle ids, so that products and sums
/// are the same bits on every decomposition.
pub struct SolidRow<T> {
    /// `B`. All arrays hold whole chunks and one more, so that windows may reach over the end.
    pub(crate) permeability: Vec<T>,
    /// `sum phi_k`.
    pub(crate) fraction_sum: Vec<T>,
    /// `sum phi_k u_k`.
    pub(crate) velocity_sum: [Vec<T>; 3],
    /// Written by the sweep: momentum and (moving, shifted) mass that solids receive, and what is subtracted in the next step,
    /// as the [`SolidModel`] defines it.
    pub(crate) incoming: [Vec<T>; 4],
    pub(crate) outgoing: [Vec<T>; 4],
    /// Chunks with solids; only there the other arrays mean anything.
    used: Vec<bool>,
}

/// [`CHUNK`] numbers from `x` on.
#[inline(always)]
fn window<T>(values: &[T], x: usize) -> &[T; CHUNK] {
    values[x..].first_chunk().expect("a chunk more than the row")
}

/// The same, to be written.
#[inline(always)]
fn window_mut<T>(values: &mut [T], x: usize) -> &mut [T; CHUNK] {
    values[x..].first_chunk_mut().expect("a chunk more than the row")
}

impl<T: Real> SolidRow<T> {
    pub(crate) fn new(chunks: usize) -> Self {
        let cells = (chunks + 1) * CHUNK;
        let zeros = || vec![T::ZERO; cells];
        Self {
            permeability: vec![T::ONE; cells],
            fraction_sum: zeros(),
            velocity_sum: std::array::from_fn(|_| zeros()),
            incoming: std::array::from_fn(|_| zeros()),
            outgoing: std::array::from_fn(|_| zeros()),
            used: vec![false; chunks],
        }
    }

    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        for (chunk, used) in self.used.iter_mut().enumerate().filter(|(_, used)| **used) {
            let cells = chunk * CHUNK..(chunk + 1) * CHUNK;
            self.permeability[cells.clone()].fill(T::ONE);
            self.fraction_sum[cells.clone()].fill(T::ZERO);
            for sum in &mut self.velocity_sum {
                sum[cells.clone()].fill(T::ZERO);
            }
            *used = false;
        }
    }

    /// Adds a particle to the cells `x .. x + count`, `count <= CHUNK`: its solid fractions and velocities (lattice
    /// units); the fractions after the first `count` are zero.
    #[inline(always)]
    pub(crate) fn add<M: SolidModel>(
        &mut self,
        x: usize,
        count: usize,
        fraction: &[T; CHUNK],
        velocity: &[[T; CHUNK]; 3],
    ) {
        self.used[x / CHUNK] = true;
        self.used[(x + count - 1) / CHUNK] = true;
        // Through local arrays, so that the compiler knows that reads and writes do not alias.
        let sum = window_mut(&mut self.fraction_sum, x);
        let mut total = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            total[k] = sum[k] + fraction[k];
        }
        *sum = total;
        let permeability = window_mut(&mut self.permeability, x);
        let mut open = [T::ZERO; CHUNK];
        if M::BY_VOLUME {
            for k in 0..CHUNK {
                let left = T::ONE - total[k];
                open[k] = if left > T::ZERO { left } else { T::ZERO };
            }
        } else {
            for k in 0..CHUNK {
                open[k] = permeability[k] * (T::ONE - fraction[k]);
            }
        }
        *permeability = open;
        for (sum, velocity) in self.velocity_sum.iter_mut().zip(velocity) {
            let sum = window_mut(sum, x);
            let mut total = [T::ZERO; CHUNK];
            for k in 0..CHUNK {
                total[k] = sum[k] + fraction[k] * velocity[k];
            }
            *sum = total;
        }
    }

    /// Takes all solids out of some cells.
    pub(crate) fn clear_fractions(&mut self, cells: Range<usize>) {
        if !self.reaches(&cells) {
            return;
        }
        self.permeability[cells.clone()].fill(T::ONE);
        self.fraction_sum[cells.clone()].fill(T::ZERO);
        for sum in &mut self.velocity_sum {
            sum[cells.clone()].fill(T::ZERO);
        }
    }

    /// Forgets what some cells exchanged.
    pub(crate) fn clear_exchanged(&mut self, cells: Range<usize>) {
        if !self.reaches(&cells) {
            return;
        }
        for moment in self.incoming.iter_mut().chain(&mut self.outgoing) {
            moment[cells.clone()].fill(T::ZERO);
        }
    }

    /// Returns true if some of the cells may have solids.
    fn reaches(&self, cells: &Range<usize>) -> bool {
        self.used[cells.start / CHUNK..cells.end.div_ceil(CHUNK)].contains(&true)
    }

    /// Returns true if a chunk has solids.
    #[inline(always)]
    pub(crate) fn is_used(&self, chunk: usize) -> bool {
        self.used[chunk]
    }

    /// Momentum and mass that came into and left the cells `x .. x + CHUNK`, `[p_x, p_y, p_z, m]` each; those without
    /// solids hold anything.
    #[inline(always)]
    pub(crate) fn exchanged(&self, x: usize) -> [[&[T; CHUNK]; 4]; 2] {
        let ([a, b, c, d], [e, f, g, h]) = (&self.incoming, &self.outgoing);
        [
            [window(a, x), window(b, x), window(c, x), window(d, x)],
            [window(e, x), window(f, x), window(g, x), window(h, x)],
        ]
    }

    /// Solid fraction `1 - B` and velocity `u_s` of a cell.
    pub(crate) fn cell(&self, x: usize) -> (f64, [f64; 3]) {
        let sum: f64 = self.fraction_sum[x].into();
        let velocity = |sums: &Vec<T>| if sum > 0.0 { sums[x].into() / sum } else { 0.0 };
        (1.0 - self.permeability[x].into(), std::array::from_fn(|a| velocity(&self.velocity_sum[a])))
    }

    /// Sum of the solid fractions of all cells, as a fixed-point number.
    pub(crate) fn fraction_total(&self) -> i64 {
        self.permeability.iter().fold(0, |sum, &b| sum.wrapping_add(to_fixed(1.0 - b.into())))
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // these numbers are exact
mod tests {
    use super::*;
    use crate::coupling::{Homogenised, Saturated};
    use crate::math::from_fixed;

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut row = SolidRow::<f64>::new(2);
        let mut add = |cells: &[(usize, f64)], velocity: [f64; 3]| {
            let first = cells[0].0;
            let mut fraction = [0.0; CHUNK];
            for &(x, phi) in cells {
                fraction[x - first] = phi;
            }
            row.add::<Homogenised>(first, cells.len(), &fraction, &velocity.map(|u| [u; CHUNK]));
        };
        add(&[(14, 0.25), (15, 1.0), (16, 0.5), (17, 0.5)], [1.0, 0.0, 2.0]);
        add(&[(16, 0.5)], [3.0, 0.0, 2.0]);
        assert_eq!(row.cell(16), (0.75, [2.0, 0.0, 2.0]));
        assert_eq!(row.cell(14), (0.25, [1.0, 0.0, 2.0]));
        assert!((from_fixed(row.fraction_total()) - (0.25 + 1.0 + 0.75 + 0.5)).abs() < 1e-12);
        row.clear();
        assert_eq!(row.cell(16).0, 0.0);
        assert_eq!(row.fraction_total(), 0);
    }

    #[test]
    fn volume_fractions_add_up_to_at_most_the_whole_cell() {
        let mut row = SolidRow::<f64>::new(1);
        for part in [0.25, 0.5, 0.75] {
            let fraction = std::array::from_fn(|k| if k == 3 { part } else { 0.0 });
            row.add::<Saturated>(0, CHUNK, &fraction, &[[2.0 * part; CHUNK]; 3]);
            assert_eq!(row.cell(2).0, 0.0);
        }
        let (solid, [u, _, _]) = row.cell(3);
        assert_eq!(solid, 1.0);
        assert!((u - 1.75 / 1.5).abs() < 1e-15);
    }
}
