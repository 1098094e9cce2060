//! The mean momenta at outlets that let sound leave: numbers behind the populations of a block, and those of a saved state.

use crate::fluid::Real;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::fluid::walls::Walls;
use crate::lattice::{C, Q};
use crate::math::FIXED_POINT_LIMIT;
use bytemuck::{Pod, Zeroable};
use std::collections::BTreeMap;

/// A mean momentum of a saved state.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SavedMean {
    /// Number of the cell in the box, x fastest.
    cell: u64,
    face: u64,
    mean: f64,
}

/// Faces of a cell.
const FACES: u64 = 6;

impl SavedMean {
    /// False of numbers that no fluid has.
    pub(crate) fn is_sound(&self) -> bool {
        self.mean.abs() < FIXED_POINT_LIMIT && self.face < FACES && self.cell < u64::MAX / FACES
    }

    /// Number of the face of its cell among those of all cells of the box.
    pub(crate) fn id(&self) -> u64 {
        FACES * self.cell + self.face
    }
}

impl<S: Population> Walls<S> {
    /// The mean momenta at the outlets of the block.
    pub(crate) fn save_means(&self, layout: &Layout, populations: &[S]) -> Vec<SavedMean> {
        let mut saved = Vec::new();
        self.face_links.each_mean::<S>(|face, cell, slot| {
            let mean = read_mean::<S>(populations, slot).into();
            saved.push(SavedMean { cell: self.number_in_box(layout, cell), face: face as u64, mean });
        });
        saved
    }

    /// Takes saved ones; what is not among them begins as the momentum that is there, so populations are those that have left cells before
    /// anything of `Odd` was sent back.
    pub(crate) fn restore_means(&self, layout: &Layout, populations: &mut [S], saved: &[SavedMean]) {
        let saved: BTreeMap<_, _> = saved.iter().map(|of| ((of.face, of.cell), of.mean)).collect();
        let left = &self.face_links.left[AaPhase::Odd as usize];
        self.face_links.each_mean::<S>(|face, cell, slot| {
            let key = (face as u64, self.number_in_box(layout, cell));
            let mean = saved.get(&key).copied().unwrap_or_else(|| {
                let along =
                    |i: usize| C[i][face / 2] as f64 * if face.is_multiple_of(2) { -1.0 } else { 1.0 };
                (1..Q).map(|i| along(i) * populations[cell.wrapping_add(left[i])].wide()).sum()
            });
            write_mean(populations, slot, S::Number::from_f64(mean));
        });
    }

    fn number_in_box(&self, layout: &Layout, cell: usize) -> u64 {
        let at = layout.coordinates(cell);
        let [x, y, z] = std::array::from_fn(|a| (at[a] + self.lo[a]) as u64);
        let [nx, ny, _] = self.domain.cells.map(|n| n as u64);
        x + nx * (y + ny * z)
    }
}

/// The number at a slot behind the populations.
#[inline(always)]
pub(super) fn read_mean<S: Population>(populations: &[S], slot: usize) -> S::Number {
    let bytes = size_of::<S::Number>() / size_of::<S>();
    bytemuck::pod_read_unaligned(bytemuck::cast_slice(&populations[slot..slot + bytes]))
}

#[inline(always)]
pub(super) fn write_mean<S: Population>(populations: &mut [S], slot: usize, mean: S::Number) {
    let count = size_of::<S::Number>() / size_of::<S>();
    bytemuck::cast_slice_mut(&mut populations[slot..slot + count]).copy_from_slice(bytemuck::bytes_of(&mean));
}
