//! The state of a block as plain bytes, for checkpoints: independent of how the box is cut and of the phase.
//!
//! The saved populations are those that *left* each cell in the last sweep, `f_i(x + c_i)` after streaming; those
//! reflected by a wall follow from what was sent there. Cells in walls have zeros. On resuming, these numbers are put
//! where a sweep from [`AaPhase::Even`] leaves them, and all that follows such a sweep is repeated.

use super::dispatch::WrapX;
use super::walls::SavedMean;
use super::{AaPhase, Fluid, Population};
use crate::domain::Block;
use crate::lattice::Q;
use crate::math::FIXED_POINT_LIMIT;

impl<S: Population> Fluid<S> {
    /// Bytes of a saved cell: one number for each direction, in the order of the lattice.
    pub const SAVED_BYTES: usize = Q * size_of::<S>();

    /// Appends the cells of plane `z` of the box, which crosses the block: rows in ascending order, cells along each.
    pub fn save_plane(&self, z: usize, out: &mut Vec<u8>) {
        let [nx, ny, _] = self.layout.size;
        let z = z - self.block.lo[2];
        let mut left = [S::zeroed(); Q];
        for (y, x) in (0..ny).flat_map(|y| (0..nx).map(move |x| (y, x))) {
            let cell = self.layout.cell(x as isize, y as isize, z as isize);
            let in_wall = self.walls.of([x, y, z]).is_some();
            for (i, left) in left.iter_mut().enumerate() {
                *left =
                    if in_wall { S::zeroed() } else { self.populations[self.walls.left(self.left(cell, i))] };
            }
            out.extend_from_slice(bytemuck::cast_slice(&left));
        }
    }

    /// Slot of the population that left the cell at `cell` along direction `i` in the last sweep.
    #[inline]
    pub(super) fn left(&self, cell: usize, i: usize) -> usize {
        cell.wrapping_add(self.layout.left(self.phase, i))
    }

    /// Restores saved `cells` of the box, which lie in the block, as [`save_plane`](Self::save_plane) has
    /// written them. When all cells of the block are taken, [`resume`](Self::resume) makes the fluid whole.
    ///
    /// # Errors
    /// The cell with a population that is not finite or too large for the sums of a sweep.
    pub fn restore(&mut self, cells: Block, bytes: &[u8]) -> Result<(), String> {
        self.phase = AaPhase::Odd;
        let mut saved = bytes.chunks_exact(Self::SAVED_BYTES);
        let lo = self.block.lo;
        for z in cells.lo[2]..cells.hi[2] {
            for y in cells.lo[1]..cells.hi[1] {
                for x in cells.lo[0]..cells.hi[0] {
                    let [i, j, k] = [x - lo[0], y - lo[1], z - lo[2]];
                    let cell = self.layout.cell(i as isize, j as isize, k as isize);
                    let left = saved.next().expect("bytes of all cells");
                    for (i, g) in left.chunks_exact(size_of::<S>()).enumerate() {
                        let (slot, population) = (self.left(cell, i), bytemuck::pod_read_unaligned::<S>(g));
                        let size = population.wide().abs();
                        if size.is_nan() || size >= FIXED_POINT_LIMIT {
                            return Err(format!(
                                "the population {i} of the cell ({x}, {y}, {z}) is that of no fluid"
                            ));
                        }
                        self.populations[slot] = population;
                    }
                }
            }
        }
        assert!(saved.next().is_none(), "bytes of these cells only");
        Ok(())
    }

    /// The mean momenta at outlets of the block that let sound leave, in plain numbers; all blocks together have all.
    pub(crate) fn save_means(&self) -> Vec<SavedMean> {
        self.walls.save_means(&self.layout, &self.populations)
    }

    /// Takes those of an earlier run, after [`restore`](Self::restore) and before [`resume`](Self::resume). Where there is none, as the outlet
    /// reflected sound, the mean begins as the momentum that is there.
    pub(crate) fn restore_means(&mut self, saved: &[SavedMean]) {
        self.phase = AaPhase::Odd;
        self.walls.restore_means(&self.layout, &mut self.populations, saved);
    }

    /// Resumes from the cells that have been [restored](Self::restore): what follows a sweep. Collective.
    pub fn resume(&mut self) {
        self.phase = AaPhase::Odd;
        let ([_, ny, nz], wrap) = (self.layout.size, WrapX::new(&self.layout, AaPhase::Even));
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            self.walls.bounce_row(AaPhase::Odd, &mut self.populations, [y, z], true);
            if self.wrap_x {
                let at = [y as isize, z as isize];
                wrap.row(&mut self.populations, self.layout.cell(0, at[0], at[1]), at);
            } else {
                self.walls.bounce_row_ends(&self.layout, AaPhase::Odd, &mut self.populations, y, z);
            }
        }
        // Not `exchange`: what was saved has the mass that interpolated links leave.
        self.halo.exchange(&mut self.populations, self.phase);
        self.walls.bounce_late(self.phase, &mut self.populations, true);
    }
}

#[cfg(test)]
impl<S: Population> Fluid<S> {
    /// Restores the cells that a saved block and that of the fluid have in common, one by one.
    pub(super) fn restore_common(&mut self, saved: Block, bytes: &[u8]) {
        let mine = self.block();
        let mut cells = bytes.chunks_exact(Self::SAVED_BYTES);
        for z in saved.lo[2]..saved.hi[2] {
            for y in saved.lo[1]..saved.hi[1] {
                for x in saved.lo[0]..saved.hi[0] {
                    let (cell, bytes) = ([x, y, z], cells.next().unwrap());
                    if (0..3).all(|a| (mine.lo[a]..mine.hi[a]).contains(&cell[a])) {
                        let hi = cell.map(|n| n + 1);
                        self.restore(Block { lo: cell, hi }, bytes).unwrap();
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Boundary, Collision, FluidParams, NO_SHEETS, Simd, WallMotion};
    use super::*;
    use crate::comm::{Comm, on_threads};
    use crate::coupling::sweep_alone;
    use crate::domain::{Decomposition, Domain};

    const PARAMS: FluidParams =
        FluidParams { relaxation_time: 0.7, collision: Collision::Trt { magic: 0.1875 }, simd: Simd::Scalar };
    const ACCELERATION: [f64; 3] = [1e-4, -2e-4, 3e-5];

    /// A box with a moving wall at one face, one at rest at the other, and one that turns inside.
    fn boxed(periodic: [bool; 3]) -> (Domain, Vec<WallMotion>) {
        let domain = Domain { faces: Domain::faces(periodic), cells: [13, 10, 11], dx: 1.0 };
        let motion = |velocity, angular_velocity| WallMotion {
            velocity,
            angular_velocity,
            pivot: [6.0, 5.0, 5.0],
            ..WallMotion::default()
        };
        let motions = vec![
            motion([0.01, -0.02, 0.0], [0.0; 3]),
            motion([0.0; 3], [0.0; 3]),
            motion([0.0; 3], [0.0, 0.0, 0.003]),
        ];
        (domain, motions)
    }

    fn wall_of(domain: &Domain, cell: [i64; 3]) -> Option<usize> {
        let cells = domain.cells.map(|n| n as i64);
        let beyond = |a: usize, high: bool| {
            !domain.is_periodic(a) && if high { cell[a] >= cells[a] } else { cell[a] < 0 }
        };
        if beyond(2, true) {
            Some(0)
        } else if (0..3).any(|a| beyond(a, false) || beyond(a, true)) {
            Some(1)
        } else {
            let inside = (5..8).contains(&cell[0]) && (4..7).contains(&cell[1]) && cell[2] >= 3;
            (inside && !domain.is_periodic(0)).then_some(2)
        }
    }

    fn fluid(domain: &Domain, motions: &[WallMotion], ranks: usize, comm: &Comm) -> Fluid<f32> {
        let cut = Decomposition::new(*domain, ranks).unwrap();
        // The wall inside is round, as far as its links know.
        let part_of_link =
            &|_, cell: [i64; 3], _| 0.1 + 0.2 * (cell[0] + cell[1] + cell[2]).rem_euclid(5) as f64;
        let boundary =
            Boundary { motions, wall_of: &|cell| wall_of(domain, cell), part_of_link, between: NO_SHEETS };
        Fluid::new(&cut, comm, &PARAMS, &boundary).unwrap()
    }

    fn advance(fluid: &mut Fluid<f32>, steps: usize) {
        for _ in 0..steps {
            sweep_alone(fluid, ACCELERATION, false);
            fluid.exchange();
        }
    }

    /// Hash of all populations, what left cells of the first block, and forces on walls, after the steps.
    fn outcome(fluid: &Fluid<f32>, comm: &Comm) -> Vec<i64> {
        let mut sums = vec![fluid.state_hash() as i64];
        let [nx, ny, nz] = fluid.layout.size;
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let departed = fluid.departed([x, y, z]);
            let index = x + fluid.block.lo[0] + 100 * (y + fluid.block.lo[1] + 100 * (z + fluid.block.lo[2]));
            sums[0] = departed.iter().fold(sums[0], |sum, p| {
                sum.wrapping_add((p.to_bits() as i64).wrapping_mul(2 * index as i64 + 1))
            });
        }
        for load in fluid.wall_loads() {
            sums.extend(load.force.iter().chain(&load.torque).map(|&sum| sum as i64));
        }
        comm.sum(&mut sums);
        sums
    }

    #[test]
    fn a_fluid_between_walls_continues_to_the_bit_on_any_ranks_from_both_phases() {
        for periodic in [[true; 3], [true, false, false], [false; 3]] {
            let (domain, motions) = boxed(periodic);
            for before in [0, 4, 5] {
                let runs = on_threads(3, |comm| {
                    let mut fluid = fluid(&domain, &motions, 3, &comm);
                    advance(&mut fluid, before);
                    let block = fluid.block();
                    let mut bytes = Vec::new();
                    for z in block.lo[2]..block.hi[2] {
                        fluid.save_plane(z, &mut bytes);
                    }
                    let now = outcome(&fluid, &comm);
                    advance(&mut fluid, 3);
                    (block, bytes, now, outcome(&fluid, &comm))
                });
                for ranks in [1, 2, 4, 6] {
                    on_threads(ranks, |comm| {
                        let mut fluid = fluid(&domain, &motions, ranks, &comm);
                        // What is there does not matter.
                        advance(&mut fluid, ranks);
                        for (block, bytes, ..) in &runs {
                            fluid.restore_common(*block, bytes);
                        }
                        fluid.resume();
                        assert_eq!(outcome(&fluid, &comm), runs[0].2, "{periodic:?} {before} {ranks}");
                        advance(&mut fluid, 3);
                        assert_eq!(outcome(&fluid, &comm), runs[0].3, "{periodic:?} {before} {ranks}");
                    });
                }
            }
        }
    }
}
