//! Solid data, kept only for the chunks of cells that hold some solid.

use super::kernel::Number;
use crate::math::to_fixed;

/// Cells that share one entry of solid data: the widest register of single precision.
pub const CHUNK: usize = 16;

/// What the particles do to [`CHUNK`] neighbouring cells of a row, lattice units.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct SolidChunk<T> {
    /// `B = prod (1 - phi_k)`.
    pub(crate) permeability: [T; CHUNK],
    /// `sum phi_k`.
    pub(crate) fraction_sum: [T; CHUNK],
    /// `sum phi_k u_k`.
    pub(crate) velocity_sum: [[T; CHUNK]; 3],
}

/// Sparse field of solid fractions and velocities on one block.
///
/// Several particles in one cell combine as `B = prod (1 - phi_k)` and `u_s = sum phi_k u_k / sum phi_k`
/// (Marquardt et al. 2024); call [`add`](Self::add) in ascending order of particle number, so that the
/// products and sums are the same bits on every decomposition.
pub struct SolidField<T> {
    rows: usize,
    chunks_per_row: usize,
    /// Entry of each chunk of the block, 0 for none.
    index: Vec<u32>,
    /// Entry 0 is never read.
    chunks: Vec<SolidChunk<T>>,
    /// Chunks that have an entry.
    used: Vec<u32>,
}

impl<T: Number> SolidField<T> {
    pub(crate) fn new(size: [usize; 3], chunks_per_row: usize) -> Self {
        Self {
            rows: size[1],
            chunks_per_row,
            index: vec![0; chunks_per_row * size[1] * size[2]],
            chunks: vec![Self::EMPTY],
            used: Vec::new(),
        }
    }

    const EMPTY: SolidChunk<T> = SolidChunk {
        permeability: [T::ONE; CHUNK],
        fraction_sum: [T::ZERO; CHUNK],
        velocity_sum: [[T::ZERO; CHUNK]; 3],
    };

    /// Forgets all solids.
    pub fn clear(&mut self) {
        for &chunk in &self.used {
            self.index[chunk as usize] = 0;
        }
        self.used.clear();
        self.chunks.truncate(1);
    }

    /// Adds a particle to the cells of a chunk: its solid fractions and velocities (lattice units), zero fraction where it
    /// is not.
    #[inline]
    pub fn add(
        &mut self,
        y: usize,
        z: usize,
        chunk: usize,
        fraction: &[T; CHUNK],
        velocity: &[[T; CHUNK]; 3],
    ) {
        let place = (z * self.rows + y) * self.chunks_per_row + chunk;
        let entry = self.index[place] as usize;
        if entry == 0 {
            // The usual case of one particle in a chunk, written as the general one below would.
            self.index[place] = self.chunks.len() as u32;
            self.used.push(place as u32);
            self.chunks.push(SolidChunk {
                permeability: fraction.map(|phi| T::ONE - phi),
                fraction_sum: *fraction,
                velocity_sum: velocity.map(|u| std::array::from_fn(|k| fraction[k] * u[k])),
            });
            return;
        }
        let cells = &mut self.chunks[entry];
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

    pub(crate) fn chunks(&self) -> &[SolidChunk<T>] {
        &self.chunks
    }

    /// Entries of the chunks of a row.
    pub(crate) fn row(&self, y: usize, z: usize) -> &[u32] {
        let row = (z * self.rows + y) * self.chunks_per_row;
        &self.index[row..row + self.chunks_per_row]
    }

    /// Solid fraction `1 - B` and velocity `u_s` of a cell.
    pub fn cell(&self, x: usize, y: usize, z: usize) -> (f64, [f64; 3]) {
        let (entry, k) = (self.row(y, z)[x / CHUNK] as usize, x % CHUNK);
        if entry == 0 {
            return (0.0, [0.0; 3]);
        }
        let cells = &self.chunks[entry];
        let sum: f64 = cells.fraction_sum[k].into();
        let velocity = cells
            .velocity_sum
            .map(|sums| if sum > 0.0 { sums[k].into() / sum } else { 0.0 });
        (1.0 - cells.permeability[k].into(), velocity)
    }

    /// Sum of the solid fractions of all cells, as a fixed-point number.
    pub fn fraction_total(&self) -> i64 {
        let cells = self.chunks.iter().skip(1).flat_map(|chunk| chunk.permeability);
        cells.fold(0, |sum, b| sum.wrapping_add(to_fixed(1.0 - b.into())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::from_fixed;

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut field = SolidField::<f64>::new([20, 2, 2], 2);
        let mut add = |cells: &[(usize, f64)], velocity: [f64; 3]| {
            for chunk in 0..2 {
                let mut fraction = [0.0; CHUNK];
                for &(x, phi) in cells.iter().filter(|&&(x, _)| x / CHUNK == chunk) {
                    fraction[x % CHUNK] = phi;
                }
                field.add(1, 1, chunk, &fraction, &velocity.map(|u| [u; CHUNK]));
            }
        };
        add(&[(14, 0.25), (15, 1.0), (16, 0.5), (17, 0.5)], [1.0, 0.0, 2.0]);
        add(&[(16, 0.5)], [3.0, 0.0, 2.0]);
        assert_eq!(field.cell(16, 1, 1), (0.75, [2.0, 0.0, 2.0]));
        assert_eq!(field.cell(14, 1, 1), (0.25, [1.0, 0.0, 2.0]));
        assert_eq!(field.cell(14, 0, 1).0, 0.0);
        assert!((from_fixed(field.fraction_total()) - (0.25 + 1.0 + 0.75 + 0.5)).abs() < 1e-12);
        field.clear();
        assert_eq!(field.cell(16, 1, 1).0, 0.0);
        assert_eq!(field.fraction_total(), 0);
    }
}
