//! Wall cells of a row.

use super::NO_WALL;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::solid::CHUNK;
use crate::fluid::{Population, Real};
use crate::lattice::Q;
use std::ops::Range;

/// A row of the block with wall cells in it.
#[derive(Debug)]
pub(crate) struct WallRow<T> {
    /// Consecutive wall cells, and the wall.
    pub(super) cells: Vec<(Range<usize>, u16)>,
    /// By chunk: all cells are wall and need no sweep.
    pub(crate) dead: Vec<bool>,
    /// Other chunks with wall cells: 1 in fluid, 0 in walls.
    mixed: Vec<(usize, [T; CHUNK])>,
}

impl<T: Real> WallRow<T> {
    /// From the wall of every cell; `None` if all are fluid.
    pub(super) fn new(walls: &[u16]) -> Option<Self> {
        let (mut x, mut cells, mut dead, mut mixed) = (0, Vec::new(), Vec::new(), Vec::new());
        for same in walls.chunk_by(PartialEq::eq) {
            if same[0] != NO_WALL {
                cells.push((x..x + same.len(), same[0]));
            }
            x += same.len();
        }
        for (chunk, walls) in walls.chunks(CHUNK).enumerate() {
            let fluid = walls.iter().filter(|&&wall| wall == NO_WALL).count();
            dead.push(fluid == 0);
            if fluid > 0 && fluid < walls.len() {
                let is_wall = |k: usize| walls.get(k).is_some_and(|&wall| wall != NO_WALL);
                let mask = std::array::from_fn(|k| if is_wall(k) { T::ZERO } else { T::ONE });
                mixed.push((chunk, mask));
            }
        }
        (!cells.is_empty()).then_some(Self { cells, dead, mixed })
    }

    /// All cells are wall.
    #[inline(always)]
    pub(crate) fn is_dead(&self) -> bool {
        !self.dead.contains(&false)
    }

    /// Calls `visit` for all stretches of wall cells.
    #[inline(always)]
    pub(crate) fn each(&self, mut visit: impl FnMut(Range<usize>)) {
        for (cells, _) in &self.cells {
            visit(cells.clone());
        }
    }

    /// Empties the wall cells of chunks that are swept, of the row whose first cell is at slot `cell`.
    #[inline(always)]
    pub(crate) fn clear<S: Population<Number = T>>(
        &self,
        layout: &Layout,
        phase: AaPhase,
        cell: usize,
        populations: &mut [S],
    ) {
        if !self.mixed.is_empty() {
            self.clear_mixed(&layout.slots(phase, cell), populations);
        }
    }

    #[inline(never)]
    fn clear_mixed<S: Population<Number = T>>(&self, slots: &[usize; Q], populations: &mut [S]) {
        for (chunk, mask) in &self.mixed {
            for slot in slots {
                let cells = &mut populations[slot + chunk * CHUNK..][..CHUNK];
                for k in 0..CHUNK {
                    cells[k] = cells[k].masked(mask[k]);
                }
            }
        }
    }
}
