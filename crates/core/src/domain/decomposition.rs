//! Decomposition of the box: the block of a rank, the owner of a position, and neighbouring blocks.
//!
//! The blocks are a grid of cuts through the whole box. A rank stores the cuts along each axis and nothing per rank,
//! so that memory and time do not grow with the number of ranks.

use super::weights::{FACES, MIN_BLOCK, equal_cuts};
use super::{Block, Domain, Weights};
use crate::math::Vec3;

/// Decomposition of the box into one block per rank: a Cartesian grid of blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Decomposition {
    /// The whole box.
    pub domain: Domain,
    /// Number of blocks in each direction.
    pub grid: [usize; 3],
    /// First cell of each block along each axis, and one past the last cell of the box.
    ///
    /// # Shape
    /// `cuts[axis].len() == grid[axis] + 1`, ascending from 0 to `domain.cells[axis]`
    pub cuts: [Vec<usize>; 3],
}

impl Decomposition {
    /// Cuts `domain` into `ranks` blocks of (nearly) equal size with the least surface; between equals the one with the
    /// longest rows.
    ///
    /// `None` if no grid of `ranks` blocks leaves every block at least four cells wide; see
    /// [`max_ranks`](Self::max_ranks).
    pub fn new(domain: Domain, ranks: usize) -> Option<Self> {
        let edges = |grid: [usize; 3]| domain.edges(grid);
        let grid = best_grid(&domain, ranks, |grid| surface(grid, edges(grid)))?;
        Some(Self::with_grid(domain, grid))
    }

    /// Cuts `domain` into `ranks` blocks of nearly the same work: of all grids the one whose heaviest block, with
    /// what its faces cost, has the least.
    ///
    /// `None` as in [`new`](Self::new).
    pub fn balanced(domain: Domain, ranks: usize, weights: &Weights) -> Option<Self> {
        let total = weights.total();
        // By axis and number of slabs.
        let mut heaviest: [Vec<Option<f64>>; 3] =
            std::array::from_fn(|axis| vec![None; domain.cells[axis] / MIN_BLOCK + 1]);
        let grid = best_grid(&domain, ranks, |grid| {
            let mut work = total;
            for axis in 0..3 {
                let known = &mut heaviest[axis][grid[axis]];
                work *= *known.get_or_insert_with(|| weights.cut(axis, grid[axis]).1);
            }
            work + weights.face * 2.0 * surface(grid, domain.edges(grid))
        })?;
        Some(Self { cuts: std::array::from_fn(|axis| weights.cut(axis, grid[axis]).0), domain, grid })
    }

    /// Work of the heaviest block, with its faces.
    pub fn heaviest(&self, weights: &Weights) -> f64 {
        weights.heaviest_block(&self.cuts)
            + weights.face * 2.0 * surface(self.grid, self.domain.edges(self.grid))
    }

    /// The whole box as one block, for one rank.
    pub fn solo(domain: Domain) -> Self {
        Self::with_grid(domain, [1; 3])
    }

    /// Blocks of (nearly) equal size in a grid of the caller's choice.
    pub fn with_grid(domain: Domain, grid: [usize; 3]) -> Self {
        Self { cuts: std::array::from_fn(|axis| equal_cuts(domain.cells[axis], grid[axis])), domain, grid }
    }

    /// Blocks between cuts of the caller's choice, as in [`cuts`](Self::cuts).
    pub fn with_cuts(domain: Domain, cuts: [Vec<usize>; 3]) -> Self {
        for (axis, cuts) in cuts.iter().enumerate() {
            assert!(
                cuts.len() > 1
                    && cuts[0] == 0
                    && cuts[cuts.len() - 1] == domain.cells[axis]
                    && cuts.windows(2).all(|w| w[0] < w[1]),
                "cuts {cuts:?} of {} cells",
                domain.cells[axis]
            );
        }
        Self { grid: std::array::from_fn(|axis| cuts[axis].len() - 1), domain, cuts }
    }

    /// The largest number of ranks up to `wanted` that [`new`](Self::new) accepts.
    pub fn max_ranks(domain: Domain, wanted: usize) -> usize {
        let most = domain.cells.iter().map(|n| n / MIN_BLOCK).product();
        (1..=wanted.min(most)).rev().find(|&ranks| best_grid(&domain, ranks, |_| 0.0).is_some()).unwrap_or(1)
    }

    /// Number of ranks.
    pub fn ranks(&self) -> usize {
        self.grid.iter().product()
    }

    /// Grid index of a rank; x runs fastest.
    pub fn grid_index(&self, rank: usize) -> [usize; 3] {
        [rank % self.grid[0], rank / self.grid[0] % self.grid[1], rank / self.grid[0] / self.grid[1]]
    }

    /// Rank at a grid index, taken periodically.
    pub fn rank_at(&self, place: [isize; 3]) -> usize {
        self.rank_of(std::array::from_fn(|i| place[i].rem_euclid(self.grid[i] as isize) as usize))
    }

    /// Rank at a grid index.
    pub fn rank_of(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.grid[0] * (y + self.grid[1] * z)
    }

    /// Block of a rank.
    pub fn block(&self, rank: usize) -> Block {
        let place = self.grid_index(rank);
        Block {
            lo: std::array::from_fn(|i| self.cuts[i][place[i]]),
            hi: std::array::from_fn(|i| self.cuts[i][place[i] + 1]),
        }
    }

    /// Ends of the slab with index `p` along an axis (m).
    pub fn slab(&self, axis: usize, p: usize) -> [f64; 2] {
        [p, p + 1].map(|p| self.cuts[axis][p] as f64 * self.domain.dx)
    }

    /// The rank whose block holds a wrapped position. Beyond a closed face it is the rank at that face.
    pub fn owner(&self, position: Vec3) -> usize {
        let cell = self.domain.cell_of(position);
        self.rank_of(std::array::from_fn(|i| self.cuts[i].partition_point(|&cut| cut <= cell[i]) - 1))
    }

    /// All other ranks whose blocks come within `reach` (m) of this rank's block, ascending.
    pub fn neighbours(&self, rank: usize, reach: f64) -> Vec<usize> {
        let place = self.grid_index(rank);
        let mut near = self.ranks_in(std::array::from_fn(|axis| self.slabs_near(axis, place[axis], reach)));
        near.retain(|&other| other != rank);
        near
    }

    /// The ranks at all grid indices that these slabs of the three axes have in common, ascending.
    pub(crate) fn ranks_in(&self, [xs, ys, zs]: [Vec<usize>; 3]) -> Vec<usize> {
        let mut ranks = Vec::with_capacity(xs.len() * ys.len() * zs.len());
        for &z in &zs {
            for &y in &ys {
                ranks.extend(xs.iter().map(|&x| self.rank_of([x, y, z])));
            }
        }
        ranks
    }

    /// The slabs of an axis that come within `reach` (m) of the one with index `p`, that one included, ascending.
    /// Looks at no slab beyond the first that is too far away.
    fn slabs_near(&self, axis: usize, p: usize, reach: f64) -> Vec<usize> {
        let (cuts, cells) = (&self.cuts[axis], self.domain.cells[axis]);
        let periodic = self.domain.is_periodic(axis);
        // In whole cells, so that it is the same number from both sides.
        let gap = |q: usize| {
            let (first, second) = (p.min(q), p.max(q));
            let inner = cuts[second] - cuts[first + 1];
            let outer = cuts[first] + cells - cuts[second + 1];
            if periodic { inner.min(outer) } else { inner }
        };
        around(p, self.grid[axis], periodic, |q| gap(q) as f64 * self.domain.dx <= reach)
    }
}

/// The indices along an axis of `count` that `accepts` holds for, ascending: `p`, for which it does, and those on
/// both sides up to the first for which it does not; across the ends if `periodic`.
pub(crate) fn around(p: usize, count: usize, periodic: bool, accepts: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut places = vec![p];
    // Steps upwards, then downwards to the indices not yet visited.
    let mut up = 0;
    while up + 1 < count && (periodic || p + up + 1 < count) && accepts((p + up + 1) % count) {
        up += 1;
        places.push((p + up) % count);
    }
    let mut down = 0;
    while up + down + 1 < count && (periodic || down < p) && accepts((p + count - down - 1) % count) {
        down += 1;
        places.push((p + count - down) % count);
    }
    places.sort_unstable();
    places
}

impl Domain {
    /// Mean edges of the blocks of a grid (cells).
    fn edges(&self, grid: [usize; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.cells[i] as f64 / grid[i] as f64)
    }
}

/// Area of the faces of a block between ranks (cells), one of each pair, weighted by their cost.
fn surface(grid: [usize; 3], [x, y, z]: [f64; 3]) -> f64 {
    let faces = [y * z, x * z, x * y];
    (0..3).filter(|&i| grid[i] > 1).map(|i| FACES[i] * faces[i]).sum()
}

/// The grid of `ranks` blocks of the least cost of those whose blocks can be four cells wide; between equals the one
/// with the fewest cuts across x, then y.
fn best_grid(domain: &Domain, ranks: usize, mut cost: impl FnMut([usize; 3]) -> f64) -> Option<[usize; 3]> {
    let most = domain.cells.map(|cells| cells / MIN_BLOCK);
    let mut best: Option<([usize; 3], f64)> = None;
    for px in (1..=ranks.min(most[0])).filter(|p| ranks.is_multiple_of(*p)) {
        let rest = ranks / px;
        for py in (1..=rest.min(most[1])).filter(|p| rest.is_multiple_of(*p)) {
            let grid = [px, py, rest / py];
            if grid[2] > most[2] {
                continue;
            }
            let cost = cost(grid);
            if best.is_none_or(|(_, least)| cost < least) {
                best = Some((grid, cost));
            }
        }
    }
    best.map(|(grid, _)| grid)
}

#[cfg(test)]
mod tests;
