//! Solid data of one row of cells, which exists only while the row is swept.
//!
//! The sweep receives solids row by row through [`Solids`]: it fills a row just before the row collides and reads
//! what came in and went out just after, all in the first-level cache. Nothing is stored per cell of the block.

use super::SolidCollision;
use super::kernel::Number;
use crate::math::to_fixed;
use std::ops::Range;

/// Cells with one common entry of solid data: the widest register of single precision.
pub const CHUNK: usize = 16;

/// Solid data of the row that is being swept, lattice units.
///
/// Several particles in one cell combine as `B = prod (1 - phi_k)` and `u_s = sum phi_k u_k / sum phi_k`
/// (Marquardt et al. 2024); call [`add`](Self::add) in ascending order of particle number, so that the products and
/// sums are the same bits on every decomposition.
///
/// In partially saturated cells the fractions are those of the volume, which add up: `B = max(0, 1 - sum e_k)`.
pub struct SolidRow<T> {
    /// Collision of these cells.
    collision: SolidCollision,
    /// `B`. All arrays hold whole chunks and one more, so that windows may reach over the end.
    pub(crate) permeability: Vec<T>,
    /// `sum phi_k`.
    pub(crate) fraction_sum: Vec<T>,
    /// `sum phi_k u_k`.
    pub(crate) velocity_sum: [Vec<T>; 3],
    /// Written by the sweep: momentum and (moving, shifted) mass that came into the cells. Partially saturated, per
    /// unit of `sum e_k`: momentum that the solids received, `-b sum c W_solid`, and then the next.
    pub(crate) incoming: [Vec<T>; 4],
    /// Written by the sweep: momentum and (moving, shifted) mass that leave the cells. Partially saturated, per unit of
    /// `sum e_k`: momentum left within the solids beyond that of their own motion, `e rho (u' - u_s)`.
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

/// The solids on a block, requested row by row during a sweep.
pub trait Solids<T> {
    /// Adds all solids to row `(y, z)` of the block, which is empty.
    fn fill(&mut self, y: usize, z: usize, row: &mut SolidRow<T>);
    /// Reads the momentum that the row exchanged in this sweep.
    fn collect(&mut self, y: usize, z: usize, row: &SolidRow<T>);
}

/// No solids.
pub struct NoSolids;

impl<T> Solids<T> for NoSolids {
    #[inline(always)]
    fn fill(&mut self, _: usize, _: usize, _: &mut SolidRow<T>) {}
    #[inline(always)]
    fn collect(&mut self, _: usize, _: usize, _: &SolidRow<T>) {}
}

impl<T: Number> SolidRow<T> {
    pub(crate) fn new(chunks: usize, collision: SolidCollision) -> Self {
        let cells = (chunks + 1) * CHUNK;
        let zeros = || vec![T::ZERO; cells];
        Self {
            collision,
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
    pub fn add(&mut self, x: usize, count: usize, fraction: &[T; CHUNK], velocity: &[[T; CHUNK]; 3]) {
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
        if self.collision.is_saturated() {
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
    pub fn exchanged(&self, x: usize) -> [[&[T; CHUNK]; 4]; 2] {
        let ([a, b, c, d], [e, f, g, h]) = (&self.incoming, &self.outgoing);
        [
            [window(a, x), window(b, x), window(c, x), window(d, x)],
            [window(e, x), window(f, x), window(g, x), window(h, x)],
        ]
    }

    /// Solid fraction `1 - B` and velocity `u_s` of a cell.
    pub fn cell(&self, x: usize) -> (f64, [f64; 3]) {
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
    use crate::math::from_fixed;

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut row = SolidRow::<f64>::new(2, SolidCollision::ExactDifference);
        let mut add = |cells: &[(usize, f64)], velocity: [f64; 3]| {
            let first = cells[0].0;
            let mut fraction = [0.0; CHUNK];
            for &(x, phi) in cells {
                fraction[x - first] = phi;
            }
            row.add(first, cells.len(), &fraction, &velocity.map(|u| [u; CHUNK]));
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
    fn shares_of_the_volume_add_up_to_at_most_the_whole_cell() {
        let mut row = SolidRow::<f64>::new(1, SolidCollision::Sc3);
        for share in [0.25, 0.5, 0.75] {
            let fraction = std::array::from_fn(|k| if k == 3 { share } else { 0.0 });
            row.add(0, CHUNK, &fraction, &[[2.0 * share; CHUNK]; 3]);
            assert_eq!(row.cell(2).0, 0.0);
        }
        let (solid, [u, _, _]) = row.cell(3);
        assert_eq!(solid, 1.0);
        assert!((u - 1.75 / 1.5).abs() < 1e-15);
    }
}
