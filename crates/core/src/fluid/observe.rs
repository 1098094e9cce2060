//! Observation of the fluid: fields, the hash of its state, and the memory bandwidth of the machine.

use super::bodies::{BlockSolids, Body};
use super::buffer::Buffer;
use super::simd::Single;
use super::solid::SolidModel;
use super::solid_row::SolidRow;
use super::{Flow, FlowRow, Fluid, Population, Stresslet, WallLoad};
use crate::comm::Comm;
use crate::domain::Block;
use crate::error::Result;
use crate::lattice::{C, Q};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Density deviation and velocity of a cell as one would measure them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellState {
    /// `rho - 1`.
    pub density_deviation: f64,
    /// Velocity in the middle of the coming collision, `u + du / 2`.
    pub velocity: [f64; 3],
    /// `1 - B`.
    pub solid_fraction: f64,
}

impl<S: Population> Fluid<S> {
    /// Density and bare velocity of a cell of the block.
    pub fn moments(&self, cell: [usize; 3]) -> (f64, [f64; 3]) {
        let g: [f64; Q] = self.populations(cell).map(S::wide);
        let rho = 1.0 + g.iter().sum::<f64>();
        let u = std::array::from_fn(|a| (0..Q).map(|i| C[i][a] as f64 * g[i]).sum::<f64>() / rho);
        (rho, u)
    }

    /// Calls `visit` for the rows of `cells`, which are of the block, in ascending order, with the flow under the given solids and the
    /// acceleration of the coming sweep: the velocity midway between before and after the collision, `u + du / 2`, with what a cell
    /// [receives](SolidModel::received).
    pub fn each_row<M: SolidModel>(
        &self,
        cells: Block,
        acceleration: [f64; 3],
        solids: &BlockSolids<M>,
        visit: &mut dyn FnMut(&FlowRow),
    ) {
        S::each_row(self, cells, acceleration, solids, visit);
    }

    /// Calls `visit` for all cells of the block that bodies cover, once for each body: with the body, the offset of the cell from its
    /// reference cell, the part of the cell that it covers, and the bare velocity of the fluid.
    pub fn each_covered<M: SolidModel>(
        &self,
        solids: &BlockSolids<M>,
        mut visit: impl FnMut(&Body, [i64; 3], f64, [f64; 3]),
    ) {
        let [nx, ny, nz] = self.layout.size;
        let mut row = SolidRow::<S::Number>::new(self.layout.chunks_per_row());
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            row.clear();
            solids.fill::<S::Number, Single>(y + ny * z, nx, &mut row);
            row.each_covered(|cover, x, part, _| {
                if self.walls.of([x, y, z]).is_none() {
                    let [first, n, m] = cover.offset.map(i64::from);
                    let (body, u) = (&solids.bodies[cover.body as usize], self.moments([x, y, z]).1);
                    visit(body, [first + x as i64, n, m], part.into(), u);
                }
            });
        }
    }

    /// Flow that the next measuring [`sweep`](Self::sweep) would measure, to the bit, and the stresslet of each of the bodies
    /// ([`measure`](super::measure)); nothing changes, and no message is sent.
    pub fn measure<M: SolidModel>(
        &self,
        acceleration: [f64; 3],
        solids: &BlockSolids<M>,
    ) -> (Flow, Vec<Stresslet>) {
        S::measure(self, acceleration, solids)
    }

    /// Force and torque on each wall in the last step over the cells of this block, as exact sums; without the pressure of a
    /// fluid at rest with density 1.
    pub fn wall_loads(&self) -> Vec<WallLoad> {
        self.walls.loads(&self.layout, &self.populations, self.phase)
    }

    /// Number of cells of the block in no wall.
    pub fn fluid_cells(&self) -> usize {
        self.walls.fluid_cells
    }

    /// Hash of all populations of the block, those in walls left out; the wrapping sum over blocks does not depend on
    /// how the box is cut.
    pub fn state_hash(&self) -> u64 {
        let ([nx, ny, nz], lo) = (self.layout.size, self.block.lo);
        let mut sum = 0_u64;
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            if self.walls.of([x, y, z]).is_some() {
                continue;
            }
            let at = [lo[0] + x, lo[1] + y, lo[2] + z];
            let seed = at.iter().fold(0, |seed: u64, &c| seed << 21 | c as u64);
            let g = self.populations([x, y, z]);
            sum = sum.wrapping_add(xxh3_64_with_seed(bytemuck::cast_slice(&g), seed));
        }
        for mean in self.save_means() {
            sum = sum.wrapping_add(xxh3_64_with_seed(bytemuck::bytes_of(&mean), 1 << 63));
        }
        sum
    }
}

/// Streaming bandwidth of this thread (bytes per second, read and write counted): an array far larger than the caches is
/// scaled in place, by all ranks at once; the best of `repeats` after one warm-up. Collective.
///
/// # Errors
/// On every rank, if one of them has no room for the array.
pub fn stream_bandwidth(repeats: u32, comm: &Comm) -> Result<f64> {
    const LEN: usize = 16 << 20;
    let array = Buffer::<f64>::zeroed(LEN, "the array that the bandwidth is measured with");
    let mut data = comm.agree(array)?;
    let mut best = 0.0_f64;
    for repeat in 0..=repeats {
        comm.barrier();
        let start = std::time::Instant::now();
        for x in data.iter_mut() {
            *x = *x * 1.000_1 + 1.0;
        }
        std::hint::black_box(&mut data);
        comm.barrier();
        if repeat > 0 {
            best = best.max(2.0 * (LEN * size_of::<f64>()) as f64 / start.elapsed().as_secs_f64());
        }
    }
    Ok(best)
}
