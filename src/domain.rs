//! The box, its periodic directions, its cells, and the blocks that ranks own.
//!
//! Cell `(i, j, k)` covers `[i, i+1) dx` and has its centre at `(i + 1/2) dx`; the box starts at the origin.

use crate::math::Vec3;

/// A box of cubic cells, periodic in some directions and closed by walls in the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Number of cells in each direction.
    pub cells: [usize; 3],
    /// Edge of a cell (m).
    pub dx: f64,
    /// Which directions are periodic; in the others positions stay as they are and have no images.
    pub periodic: [bool; 3],
}

impl Domain {
    /// Edges of the box (m).
    pub fn size(&self) -> Vec3 {
        Vec3::from_fn(|i, _| self.cells[i] as f64 * self.dx)
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Volume (m^3).
    pub fn volume(&self) -> f64 {
        self.size().product()
    }

    /// The image of `position` inside the box, `0 <= x < size` in each periodic direction.
    pub fn wrap(&self, position: Vec3) -> Vec3 {
        let size = self.size();
        Vec3::from_fn(|i, _| {
            let (x, length) = (position[i], size[i]);
            if !self.periodic[i] {
                return x;
            }
            let wrapped = x - length * (x / length).floor();
            // Rounding can give `length` itself for a tiny negative `x`.
            if wrapped >= length || wrapped < 0.0 {
                0.0
            } else {
                wrapped
            }
        })
    }

    /// The shortest periodic image of a difference of two wrapped positions.
    pub fn nearest_image(&self, difference: Vec3) -> Vec3 {
        let size = self.size();
        Vec3::from_fn(|i, _| {
            let (d, length) = (difference[i], size[i]);
            if self.periodic[i] && d > 0.5 * length {
                d - length
            } else if self.periodic[i] && d < -0.5 * length {
                d + length
            } else {
                d
            }
        })
    }

    /// The shorter of a distance (not negative) along axis `i` and its way round the back, where there is one.
    #[inline]
    pub fn shorter_way(&self, i: usize, distance: f64) -> f64 {
        if self.periodic[i] {
            distance.min(self.cells[i] as f64 * self.dx - distance)
        } else {
            distance
        }
    }

    /// The cell that holds a wrapped position; the nearest one for a position beyond a wall.
    pub fn cell_of(&self, position: Vec3) -> [usize; 3] {
        std::array::from_fn(|i| ((position[i] / self.dx) as usize).min(self.cells[i] - 1))
    }
}

/// A box of cells, `lo <= cell < hi`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// First cell.
    pub lo: [usize; 3],
    /// One past the last cell.
    pub hi: [usize; 3],
}

impl Block {
    /// Number of cells in each direction.
    pub fn size(&self) -> [usize; 3] {
        std::array::from_fn(|i| self.hi[i] - self.lo[i])
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.size().iter().product()
    }
}

/// How the box is cut into one block per rank: a Cartesian grid of near-cubic blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Decomposition {
    /// The whole box.
    pub domain: Domain,
    /// Number of blocks in each direction.
    pub grid: [usize; 3],
}

impl Decomposition {
    /// Cuts `domain` into `ranks` blocks with the least surface; between equals the one with the longest rows.
    ///
    /// `None` if no grid of `ranks` blocks leaves every block at least four cells wide; see [`max_ranks`](Self::max_ranks).
    pub fn new(domain: Domain, ranks: usize) -> Option<Self> {
        let mut best: Option<([usize; 3], f64)> = None;
        for px in (1..=ranks.min(domain.cells[0] / MIN_BLOCK)).filter(|p| ranks.is_multiple_of(*p)) {
            for py in (1..=(ranks / px).min(domain.cells[1] / MIN_BLOCK))
                .filter(|p| (ranks / px).is_multiple_of(*p))
            {
                let grid = [px, py, ranks / px / py];
                if (0..3).any(|i| domain.cells[i] / grid[i] < MIN_BLOCK) {
                    continue;
                }
                let [x, y, z] = std::array::from_fn(|i| domain.cells[i] as f64 / grid[i] as f64);
                // Faces between ranks only; strided x faces cost more than contiguous y and z faces.
                let cut = |p: usize, area: f64| if p > 1 { area } else { 0.0 };
                let surface = 1.5 * cut(grid[0], y * z) + 1.01 * cut(grid[1], x * z) + cut(grid[2], x * y);
                if best.is_none_or(|(_, least)| surface < least) {
                    best = Some((grid, surface));
                }
            }
        }
        best.map(|(grid, _)| Self { domain, grid })
    }

    /// The largest rank count not above `wanted` that [`new`](Self::new) accepts.
    pub fn max_ranks(domain: Domain, wanted: usize) -> usize {
        let most = domain.cells.iter().map(|n| n / MIN_BLOCK).product();
        (1..=wanted.min(most))
            .rev()
            .find(|&n| Self::new(domain, n).is_some())
            .unwrap_or(1)
    }

    /// Number of ranks.
    pub fn ranks(&self) -> usize {
        self.grid.iter().product()
    }

    /// Place of a rank in the grid of blocks; x runs fastest.
    pub fn place(&self, rank: usize) -> [usize; 3] {
        [
            rank % self.grid[0],
            rank / self.grid[0] % self.grid[1],
            rank / self.grid[0] / self.grid[1],
        ]
    }

    /// Rank at a place in the grid of blocks, taken periodically.
    pub fn rank_at(&self, place: [isize; 3]) -> usize {
        let [x, y, z] = std::array::from_fn(|i| place[i].rem_euclid(self.grid[i] as isize) as usize);
        x + self.grid[0] * (y + self.grid[1] * z)
    }

    /// Block of a rank.
    pub fn block(&self, rank: usize) -> Block {
        let place = self.place(rank);
        let cut = |i: usize, p: usize| self.domain.cells[i] * p / self.grid[i];
        Block {
            lo: std::array::from_fn(|i| cut(i, place[i])),
            hi: std::array::from_fn(|i| cut(i, place[i] + 1)),
        }
    }

    /// The rank whose block holds a wrapped position.
    pub fn owner(&self, position: Vec3) -> usize {
        let cell = self.domain.cell_of(position);
        self.rank_at(std::array::from_fn(|i| {
            // The largest p with cells * p / grid <= cell.
            ((cell[i] * self.grid[i] + self.grid[i] - 1) / self.domain.cells[i]).min(self.grid[i] - 1)
                as isize
        }))
    }

    /// Whether some periodic image of a wrapped position lies within `reach` (m) of the rank's block.
    ///
    /// The distance is taken direction by direction (a box grown by `reach`), so this is never too small.
    pub fn is_within(&self, rank: usize, position: Vec3, reach: f64) -> bool {
        let block = self.block(rank);
        (0..3).all(|i| {
            let (lo, hi) = (
                block.lo[i] as f64 * self.domain.dx,
                block.hi[i] as f64 * self.domain.dx,
            );
            // Nearest image of the position to the middle of the block.
            let offset = (position[i] - 0.5 * (lo + hi)).abs();
            self.domain.shorter_way(i, offset) <= 0.5 * (hi - lo) + reach
        })
    }

    /// All other ranks whose blocks come within `reach` (m) of this rank's block, ascending.
    pub fn neighbours(&self, rank: usize, reach: f64) -> Vec<usize> {
        let own = self.block(rank);
        let near = |a: &Block, b: &Block, i: usize| {
            let centre = |b: &Block| 0.5 * (b.lo[i] + b.hi[i]) as f64;
            let offset = (centre(a) - centre(b)).abs();
            let distance = self.domain.shorter_way(i, offset * self.domain.dx);
            distance - 0.5 * ((a.hi[i] - a.lo[i]) + (b.hi[i] - b.lo[i])) as f64 * self.domain.dx <= reach
        };
        (0..self.ranks())
            .filter(|&other| other != rank && (0..3).all(|i| near(&own, &self.block(other), i)))
            .collect()
    }
}

/// Smallest number of cells of a block in any direction.
const MIN_BLOCK: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Domain = Domain {
        periodic: [true; 3],
        cells: [21, 34, 47],
        dx: 0.5,
    };

    #[test]
    fn blocks_cover_every_cell_once_for_any_rank_count() {
        for ranks in [1, 2, 3, 4, 5, 6, 7, 8, 12] {
            let cut = Decomposition::new(BOX, ranks).unwrap();
            let total: usize = (0..ranks).map(|r| cut.block(r).cell_count()).sum();
            assert_eq!(total, BOX.cell_count());
            for rank in 0..ranks {
                let block = cut.block(rank);
                for corner in 0..8 {
                    let cell: [usize; 3] = std::array::from_fn(|i| {
                        if corner >> i & 1 == 0 {
                            block.lo[i]
                        } else {
                            block.hi[i] - 1
                        }
                    });
                    for inside in [0.0, 0.25, 0.499] {
                        let at = Vec3::from_fn(|i, _| cell[i] as f64 * 0.5 + inside);
                        assert_eq!(cut.owner(at), rank);
                        assert!(cut.is_within(rank, at, 0.0));
                    }
                }
            }
        }
    }

    #[test]
    fn a_position_on_the_edge_of_the_box_has_exactly_one_image_inside() {
        let size = BOX.size();
        for x in [
            -1e-25,
            0.0,
            size.x,
            f64::from_bits(size.x.to_bits() - 1),
            -size.x,
            3.0 * size.x,
        ] {
            let wrapped = BOX.wrap(Vec3::new(x, 0.0, 0.0)).x;
            assert!((0.0..size.x).contains(&wrapped), "{x} went to {wrapped}");
        }
    }

    #[test]
    fn the_nearest_image_is_never_longer_than_half_the_box() {
        let d = BOX.nearest_image(Vec3::new(9.0, -10.0, 23.0));
        assert_eq!(d, Vec3::new(-1.5, 7.0, -0.5));
    }

    #[test]
    fn a_count_that_would_make_blocks_too_thin_is_refused_and_the_next_smaller_named() {
        let small = Domain {
            periodic: [true; 3],
            cells: [8, 8, 8],
            dx: 1.0,
        };
        assert!(Decomposition::new(small, 3).is_none());
        assert_eq!(Decomposition::max_ranks(small, 100), 8);
    }

    #[test]
    fn neighbours_are_mutual_and_complete() {
        for ranks in [2, 3, 4, 6, 8, 12] {
            let cut = Decomposition::new(BOX, ranks).unwrap();
            for rank in 0..ranks {
                for &other in &cut.neighbours(rank, 0.5) {
                    assert!(cut.neighbours(other, 0.5).contains(&rank));
                }
                // Every rank one step away in the grid is a neighbour.
                let [x, y, z] = cut.place(rank).map(|p| p as isize);
                for d in 0..27_isize {
                    let other = cut.rank_at([x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1]);
                    assert!(other == rank || cut.neighbours(rank, 0.0).contains(&other));
                }
            }
        }
    }
}
