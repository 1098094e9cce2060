//! Memory layout of the populations of a block.

use super::solid::{CHUNK, GROUP};
use crate::lattice::{C, Q, opposite};

/// Memory slots that hold the populations between two steps (AA pattern).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AaPhase {
    /// `f_i(x)` after streaming lies at `(x, i)`.
    Even,
    /// `f_i(x)` after streaming lies at `(x - c_i, opposite i)`: where its sender left it.
    Odd,
}

impl AaPhase {
    /// The other one; a sweep changes the phase.
    #[must_use]
    pub(crate) fn next(self) -> Self {
        match self {
            Self::Even => Self::Odd,
            Self::Odd => Self::Even,
        }
    }
}

/// Structure of arrays with one layer of ghost cells: `index = i * stride + cell`, `cell = x + pitch * (row)`.
///
/// Rows are padded to whole chunks and a group more, so that kernels may run over the end of a row: the slots of
/// different cells are disjoint, and ghost slots are refreshed by the halo exchange before they are read.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Real cells in each direction.
    pub(crate) size: [usize; 3],
    /// Distance between rows (numbers).
    pub(crate) pitch: usize,
    /// Distance between populations (numbers).
    pub(crate) stride: usize,
}

impl Layout {
    /// Layout of a block of `size` cells for numbers of `bytes` bytes; nothing if an address cannot count them.
    pub(crate) fn new(size: [usize; 3], bytes: usize) -> Option<Self> {
        let pitch = size[0].checked_next_multiple_of(CHUNK)?.checked_add(GROUP)?;
        let rows = size[1].checked_add(2)?.checked_mul(size[2].checked_add(2)?)?;
        // A stride of 5 cache lines modulo the page puts the 19 arrays into different sets of the caches; a power of
        // two would put all into one.
        let (page, shift) = (4096 / bytes, 320 / bytes);
        let numbers = rows.checked_mul(pitch)?.checked_add(2 * CHUNK)?;
        let stride = numbers.checked_next_multiple_of(page)?.checked_add(shift)?;
        // Slots are added to as signed numbers.
        let fits = |len: usize| isize::try_from(len.checked_mul(bytes)?).ok();
        stride.checked_mul(Q).and_then(fits)?;
        Some(Self { size, pitch, stride })
    }

    /// Numbers in all.
    pub(crate) fn len(&self) -> usize {
        Q * self.stride
    }

    /// Chunks that cover a row.
    pub(crate) fn chunks_per_row(&self) -> usize {
        self.size[0].div_ceil(CHUNK)
    }

    /// Slot of a cell within each population; ghosts have coordinate -1 or `size`.
    #[inline(always)]
    pub(crate) fn cell(&self, x: isize, y: isize, z: isize) -> usize {
        debug_assert!(y >= -1 && z >= -1 && x >= -1);
        let row = (z + 1) as usize * (self.size[1] + 2) + (y + 1) as usize;
        (row * self.pitch + CHUNK).wrapping_add_signed(x)
    }

    /// The cell of the block at a slot of [`cell`](Self::cell).
    pub(crate) fn coordinates(&self, slot: usize) -> [usize; 3] {
        let (row, x) = ((slot - CHUNK) / self.pitch, (slot - CHUNK) % self.pitch);
        let rows = self.size[1] + 2;
        [x, row % rows - 1, row / rows - 1]
    }

    /// Distance from a cell to its neighbour along direction `i`.
    #[inline(always)]
    pub(crate) fn step(&self, i: usize) -> isize {
        let [x, y, z] = C[i];
        x + self.pitch as isize * (y + z * (self.size[1] + 2) as isize)
    }

    /// Indices at which the cell at `cell` finds `f_i` after streaming, for each `i`.
    #[inline(always)]
    pub(crate) fn slots(&self, phase: AaPhase, cell: usize) -> [usize; Q] {
        let mut slots = self.slots_from(phase);
        for slot in &mut slots {
            *slot = cell.wrapping_add(*slot);
        }
        slots
    }

    /// Distance from the slot of a cell to that of the population that left it along direction `i` in the last sweep, after which the
    /// phase is `phase`.
    #[inline(always)]
    pub(crate) fn left(&self, phase: AaPhase, i: usize) -> usize {
        match phase {
            AaPhase::Even => (i * self.stride).wrapping_add_signed(self.step(i)),
            AaPhase::Odd => opposite(i) * self.stride,
        }
    }

    /// Offsets to add to the slot of a cell, wrapping, for its [`slots`](Self::slots).
    pub(crate) fn slots_from(&self, phase: AaPhase) -> [usize; Q] {
        // A loop: `array::from_fn` is a call for this many.
        let mut slots = [0; Q];
        for (i, slot) in slots.iter_mut().enumerate() {
            *slot = match phase {
                AaPhase::Even => i * self.stride,
                AaPhase::Odd => (opposite(i) * self.stride).wrapping_add_signed(-self.step(i)),
            };
        }
        slots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_slot_belongs_to_exactly_one_cell_in_both_phases() {
        let layout = Layout::new([5, 4, 3], 4).unwrap();
        for phase in [AaPhase::Even, AaPhase::Odd] {
            let mut seen = HashSet::new();
            for z in 0..3 {
                for y in 0..4 {
                    for x in 0..layout.chunks_per_row() * CHUNK {
                        for slot in layout.slots(phase, layout.cell(x as isize, y, z)) {
                            assert!(slot < layout.len());
                            assert!(seen.insert(slot), "{phase:?} {x} {y} {z}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_block_whose_populations_an_address_cannot_count_has_no_layout() {
        // Each overflows another product or sum; the last only the bytes of all populations.
        for size in [
            [usize::MAX, 4, 4],
            [4, usize::MAX, 4],
            [4, 1 << 33, 1 << 33],
            [1 << 30, 1 << 20, 1 << 20],
            [1 << 20, 1 << 19, 1 << 18],
        ] {
            assert!(Layout::new(size, 8).is_none(), "{size:?}");
        }
        assert!(Layout::new([1 << 14, 1 << 14, 1 << 14], 8).is_some());
    }

    #[test]
    fn the_coordinates_of_a_slot_lead_back_to_it() {
        let layout = Layout::new([21, 4, 3], 8).unwrap();
        for cell in [[0, 0, 0], [20, 0, 1], [7, 3, 2]] {
            let [x, y, z] = cell.map(|c: usize| c as isize);
            assert_eq!(layout.coordinates(layout.cell(x, y, z)), cell);
        }
    }
}
