//! Solid data of one row of cells, which exists only while the row is swept.
//!
//! Solids are told to the sweep row by row through [`Solids`]: it fills a row just before the row collides and looks at
//! what came in and went out just after, all in the first-level cache. Nothing is stored per cell of the block.

use super::kernel::Number;
use crate::math::to_fixed;

/// Cells that share one entry of solid data: the widest register of single precision.
pub const CHUNK: usize = 16;

/// What solids do to [`CHUNK`] neighbouring cells and what these exchanged with their neighbours, lattice units.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct SolidChunk<T> {
    /// `B = prod (1 - phi_k)`.
    pub(crate) permeability: [T; CHUNK],
    /// `sum phi_k`.
    pub(crate) fraction_sum: [T; CHUNK],
    /// `sum phi_k u_k`.
    pub(crate) velocity_sum: [[T; CHUNK]; 3],
    /// Written by the sweep: momentum and (moving, shifted) mass that came into the cells.
    pub(crate) incoming: [[T; CHUNK]; 4],
    /// Written by the sweep: momentum and (moving, shifted) mass that leave the cells.
    pub(crate) outgoing: [[T; CHUNK]; 4],
}

/// Solid data of the row that is being swept.
///
/// Several particles in one cell combine as `B = prod (1 - phi_k)` and `u_s = sum phi_k u_k / sum phi_k`
/// (Marquardt et al. 2024); call [`add`](Self::add) in ascending order of particle number, so that the products and
/// sums are the same bits on every decomposition.
pub struct SolidRow<T> {
    chunks: Vec<SolidChunk<T>>,
    used: Vec<bool>,
}

/// The solids on a block, asked row by row during a sweep.
pub trait Solids<T> {
    /// Adds all solids to row `(y, z)` of the block, which is empty.
    fn fill(&mut self, y: usize, z: usize, row: &mut SolidRow<T>);
    /// Looks at what the row exchanged in this sweep.
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
    const EMPTY: SolidChunk<T> = SolidChunk {
        permeability: [T::ONE; CHUNK],
        fraction_sum: [T::ZERO; CHUNK],
        velocity_sum: [[T::ZERO; CHUNK]; 3],
        incoming: [[T::ZERO; CHUNK]; 4],
        outgoing: [[T::ZERO; CHUNK]; 4],
    };

    pub(crate) fn new(chunks: usize) -> Self {
        Self {
            chunks: vec![Self::EMPTY; chunks],
            used: vec![false; chunks],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.used.fill(false);
    }

    /// Adds a particle to the cells of a chunk: its solid fractions and velocities (lattice units), zero fraction where it
    /// is not.
    #[inline(always)]
    pub fn add(&mut self, chunk: usize, fraction: &[T; CHUNK], velocity: &[[T; CHUNK]; 3]) {
        let cells = &mut self.chunks[chunk];
        if !self.used[chunk] {
            // The usual case of one particle in a chunk, written as the general one below would.
            self.used[chunk] = true;
            for k in 0..CHUNK {
                cells.permeability[k] = T::ONE - fraction[k];
            }
            cells.fraction_sum = *fraction;
            for (sum, velocity) in cells.velocity_sum.iter_mut().zip(velocity) {
                for k in 0..CHUNK {
                    sum[k] = fraction[k] * velocity[k];
                }
            }
            return;
        }
        for k in 0..CHUNK {
            cells.permeability[k] = cells.permeability[k] * (T::ONE - fraction[k]);
            cells.fraction_sum[k] = cells.fraction_sum[k] + fraction[k];
        }
        for (sum, velocity) in cells.velocity_sum.iter_mut().zip(velocity) {
            for k in 0..CHUNK {
                sum[k] = sum[k] + fraction[k] * velocity[k];
            }
        }
    }

    /// The chunk if it holds solids.
    #[inline(always)]
    pub(crate) fn chunk_mut(&mut self, chunk: usize) -> Option<&mut SolidChunk<T>> {
        if self.used[chunk] {
            Some(&mut self.chunks[chunk])
        } else {
            None
        }
    }

    /// Momentum and mass that came into and left the cells of a chunk with solids: `[p_x, p_y, p_z, m]` each.
    #[inline(always)]
    pub fn exchanged(&self, chunk: usize) -> (&[[T; CHUNK]; 4], &[[T; CHUNK]; 4]) {
        debug_assert!(self.used[chunk]);
        (&self.chunks[chunk].incoming, &self.chunks[chunk].outgoing)
    }

    /// Solid fraction `1 - B` and velocity `u_s` of a cell.
    pub fn cell(&self, x: usize) -> (f64, [f64; 3]) {
        if !self.used[x / CHUNK] {
            return (0.0, [0.0; 3]);
        }
        let (cells, k) = (&self.chunks[x / CHUNK], x % CHUNK);
        let sum: f64 = cells.fraction_sum[k].into();
        let velocity = cells
            .velocity_sum
            .map(|sums| if sum > 0.0 { sums[k].into() / sum } else { 0.0 });
        (1.0 - cells.permeability[k].into(), velocity)
    }

    /// Sum of the solid fractions of all cells, as a fixed-point number.
    pub(crate) fn fraction_total(&self) -> i64 {
        let used = self.chunks.iter().zip(&self.used).filter(|(_, used)| **used);
        used.flat_map(|(chunk, _)| chunk.permeability)
            .fold(0, |sum, b| sum.wrapping_add(to_fixed(1.0 - b.into())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::from_fixed;

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut row = SolidRow::<f64>::new(2);
        let mut add = |cells: &[(usize, f64)], velocity: [f64; 3]| {
            for chunk in 0..2 {
                let mut fraction = [0.0; CHUNK];
                for &(x, phi) in cells.iter().filter(|&&(x, _)| x / CHUNK == chunk) {
                    fraction[x % CHUNK] = phi;
                }
                row.add(chunk, &fraction, &velocity.map(|u| [u; CHUNK]));
            }
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
}
