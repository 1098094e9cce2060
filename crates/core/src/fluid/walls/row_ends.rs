//! Links across the ends of rows, done within the sweep.

use super::{LinkRule, Walls, ends_of};
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::lattice::{C, opposite};

/// The links across a closed face that rows end at, five to a row.
pub(super) struct RowEnds<T> {
    pub(super) directions: [usize; 5],
    /// Last cell of a row, and the ghost beyond.
    pub(super) last: isize,
    pub(super) ghost: isize,
    /// Of each direction, the link that the sweep of an [inner row](crate::fluid::rows::RowOrder::is_inner) completes: from the slot of the row's first cell to
    /// the slots `(x, i)` and `(w, -i)`, and from the row's first link to its number.
    pub(super) inner: [([isize; 2], isize); 5],
    pub(super) rule: LinkRule,
    /// Data of the rule, by row, then by direction.
    pub(super) numbers: Vec<T>,
    /// By row, then by direction; `NO_WALL` where the last cell belongs to a wall itself.
    pub(super) walls: Vec<u16>,
}

impl<S: Population> Walls<S> {
    /// Bounces the links at the ends of rows of which the sweep of row `(y, z)`, the last so far, has swept the second end,
    /// which would overwrite the link; `entered` is the phase after the sweep.
    #[inline(never)]
    pub(crate) fn bounce_row_ends(
        &self,
        layout: &Layout,
        entered: AaPhase,
        populations: &mut [S],
        y: usize,
        z: usize,
    ) {
        let (own, y, z) = ([y, z], y as isize, z as isize);
        if self.order.is_inner(own) {
            let base = layout.cell(0, y, z);
            for ends in &self.ends {
                let first = ends.link(self.size, y, z, 0);
                for (slots, link) in ends.inner {
                    let slots = slots.map(|slot| base.wrapping_add_signed(slot));
                    let numbers = ends.numbers_of(first.wrapping_add_signed(link));
                    ends.rule.apply(populations, ends_of(slots, entered), 1, numbers);
                }
            }
            return;
        }
        for ends in &self.ends {
            for (k, &i) in ends.directions.iter().enumerate() {
                let [_, cy, cz] = C[i];
                let mut bounce = |y: isize, z: isize| {
                    let near = i * layout.stride + layout.cell(ends.last, y, z);
                    let far = opposite(i) * layout.stride + layout.cell(ends.ghost, y - cy, z - cz);
                    let numbers = ends.numbers_of(ends.link(self.size, y, z, k));
                    ends.rule.apply(populations, ends_of([near, far], entered), 1, numbers);
                };
                // The row of the ghost is this one, an earlier one, or none of the block.
                let ghost = self.order.row(y - cy, z - cz);
                if ghost.is_none_or(|ghost| !self.order.is_before(own, ghost)) {
                    bounce(y, z);
                }
                // An earlier row has its ghost in this one.
                if let Some(earlier) = self.order.row(y + cy, z + cz)
                    && self.order.is_before(earlier, own)
                {
                    bounce(y + cy, z + cz);
                }
            }
        }
    }
}

impl<T> RowEnds<T> {
    /// [`inner`](Self::inner) of a block of a size: links of the row itself unless their ghosts are in a later one, and those of an earlier
    /// row whose ghosts are in this one.
    pub(super) fn inner_links(
        directions: [usize; 5],
        [last, ghost]: [isize; 2],
        layout: &Layout,
    ) -> [([isize; 2], isize); 5] {
        let (ny, stride) = (layout.size[1] as isize, layout.stride);
        let slot = |i: usize, x: isize, y: isize, z: isize| {
            (i * stride + layout.cell(x, y + 1, z + 1)) as isize - layout.cell(0, 1, 1) as isize
        };
        std::array::from_fn(|k| {
            let [_, cy, cz] = C[directions[k]];
            let [y, z] = if (cz, cy) < (0, 0) { [cy, cz] } else { [0, 0] };
            let near = slot(directions[k], last, y, z);
            let far = slot(opposite(directions[k]), ghost, y - cy, z - cz);
            ([near, far], (z * ny + y) * directions.len() as isize + k as isize)
        })
    }

    /// Number of a link: the `k`th of a row.
    #[inline(always)]
    pub(super) fn link(&self, size: [usize; 3], y: isize, z: isize, k: usize) -> usize {
        (z as usize * size[1] + y as usize) * self.directions.len() + k
    }

    #[inline(always)]
    pub(super) fn numbers_of(&self, link: usize) -> &[T] {
        &self.numbers[self.rule.numbers() * link..][..self.rule.numbers()]
    }

    /// Calls `visit(link, direction, cell, near, far)` for all links.
    pub(super) fn each(
        &self,
        layout: &Layout,
        size: [usize; 3],
        mut visit: impl FnMut(usize, usize, [usize; 3], usize, usize),
    ) {
        let [_, ny, nz] = size.map(|n| n as isize);
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            for (k, &i) in self.directions.iter().enumerate() {
                let near = i * layout.stride + layout.cell(self.last, y, z);
                let far = opposite(i) * layout.stride + layout.cell(self.ghost, y - C[i][1], z - C[i][2]);
                let cell = [self.last, y, z].map(|c| c as usize);
                visit(self.link(size, y, z, k), i, cell, near, far);
            }
        }
    }
}
