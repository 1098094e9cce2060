//! Order in which a block sweeps its rows: those from which messages are packed come first, so that these travel
//! while the rest is swept.

use crate::domain::Decomposition;

/// The order of the rows of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowOrder {
    /// Rows of a plane, and planes.
    size: [usize; 2],
    /// True where another rank is beyond the lower and the upper side in y, then in z.
    neighbour: [[bool; 2]; 2],
}

impl RowOrder {
    /// For the block of `rank`.
    pub(crate) fn new(decomposition: &Decomposition, rank: usize) -> Self {
        let [_, ny, nz] = decomposition.block(rank).size();
        let at = decomposition.grid_index(rank);
        let (grid, periodic) = (decomposition.grid, decomposition.domain.periodic());
        let beyond = |a: usize| {
            let more = grid[a] > 1;
            [more && (periodic[a] || at[a] > 0), more && (periodic[a] || at[a] + 1 < grid[a])]
        };
        Self { size: [ny, nz], neighbour: [beyond(1), beyond(2)] }
    }

    /// Returns true if some rows come first.
    pub(crate) fn has_first(&self) -> bool {
        self.neighbour != [[false; 2]; 2]
    }

    /// Returns true if row `[y, z]` of the block is next to another rank in y or z.
    #[inline(always)]
    pub(crate) fn is_first(&self, row: [usize; 2]) -> bool {
        (0..2).any(|a| {
            let [low, high] = self.neighbour[a];
            (low && row[a] == 0) || (high && row[a] + 1 == self.size[a])
        })
    }

    /// Returns true if row `a`, as `[y, z]`, is swept before row `b`.
    #[inline(always)]
    pub(crate) fn is_before(&self, a: [usize; 2], b: [usize; 2]) -> bool {
        let turn = |row| (!self.is_first(row), row[1], row[0]);
        turn(a) < turn(b)
    }

    /// Returns true if row `[y, z]` and its neighbours are rows of the block that are swept in the order of `z`, then of `y`.
    #[inline(always)]
    pub(crate) fn is_inner(&self, row: [usize; 2]) -> bool {
        let margin = if self.has_first() { 2 } else { 1 };
        (0..2).all(|a| row[a] >= margin && row[a] + margin < self.size[a])
    }

    /// `[y, z]` as a row of the block, if it is one.
    #[inline(always)]
    pub(crate) fn row(&self, y: isize, z: isize) -> Option<[usize; 2]> {
        let row = [y as usize, z as usize];
        (y >= 0 && z >= 0 && row[0] < self.size[0] && row[1] < self.size[1]).then_some(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;

    fn order(periodic: [bool; 3], ranks: usize, rank: usize) -> (RowOrder, [usize; 2]) {
        let domain = Domain { cells: [16, 24, 40], faces: Domain::faces(periodic), dx: 1.0 };
        let cut = Decomposition::new(domain, ranks).unwrap();
        let [_, ny, nz] = cut.block(rank).size();
        (RowOrder::new(&cut, rank), [ny, nz])
    }

    #[test]
    fn the_parts_hold_every_row_once_and_the_first_come_before_the_rest() {
        for ranks in [1, 2, 4, 6] {
            let (order, [ny, nz]) = order([true; 3], ranks, ranks - 1);
            let rows: Vec<[usize; 2]> = (0..nz).flat_map(|z| (0..ny).map(move |y| [y, z])).collect();
            let part = |first| rows.iter().copied().filter(move |&row| order.is_first(row) == first);
            let turns: Vec<_> = part(true).chain(part(false)).collect();
            assert!(turns.windows(2).all(|w| order.is_before(w[0], w[1])));
            assert_eq!(part(true).count() > 0, order.has_first(), "{ranks} ranks");
        }
    }

    #[test]
    fn neighbours_of_inner_rows_are_swept_in_the_order_of_z_then_y() {
        for ranks in [1, 2, 4, 6] {
            let (order, [ny, nz]) = order([true; 3], ranks, ranks - 1);
            let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| [y, z]));
            let inner: Vec<[usize; 2]> = rows.filter(|&row| order.is_inner(row)).collect();
            assert!(inner.len() >= (ny - 4) * (nz - 4), "{ranks} ranks");
            for [y, z] in inner {
                for (other, before) in
                    [([y - 1, z], true), ([y, z - 1], true), ([y + 1, z], false), ([y, z + 1], false)]
                {
                    assert_eq!(order.row(other[0] as isize, other[1] as isize), Some(other));
                    assert_eq!(order.is_before(other, [y, z]), before, "{ranks} ranks, {other:?}");
                }
            }
        }
    }

    #[test]
    fn only_rows_next_to_another_rank_come_first() {
        // One block, two along z, and four along y and z.
        let (alone, [ny, nz]) = order([true; 3], 1, 0);
        assert!(!alone.has_first() && !alone.is_first([0, 0]));
        assert_eq!([ny, nz], [24, 40]);
        let (two, [_, nz]) = order([true; 3], 2, 0);
        assert_eq!(nz, 20);
        assert!(two.is_first([3, 0]) && two.is_first([3, 19]));
        assert!(!two.is_first([0, 1]));
        // The lower of two between closed faces.
        let (lower, _) = order([true, true, false], 2, 0);
        assert!(!lower.is_first([3, 0]) && lower.is_first([3, 19]));
    }
}
