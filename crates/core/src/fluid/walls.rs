//! Walls made of whole cells: half-way bounce-back, at rest or moving.
//!
//! A population that a fluid cell `x` sends towards a wall cell `w = x - c_i` returns within the same step:
//!
//! ```text
//! f_i(x) = f'_-i(x) + 6 w_i c_i . u_w       u_w = velocity of the wall at x - c_i / 2, density 1
//! ```
//!
//! and the wall gains the momentum `-(f'_-i(x) + f_i(x)) c_i`. In place this is one copy per link after a sweep,
//! from `near = (x, i)` to `far = (w, -i)` on entering [`AaPhase::Odd`], back on entering [`AaPhase::Even`]. Links
//! across the ends of rows ([`RowEnds`]) and between two cells of the block are done within the sweep. Wall cells
//! that share a chunk with fluid are swept and then emptied ([`WallRow::clear`]). Details: `docs/theory/fluid.md`.
//!
//! References: Ladd (1994), doi:10.1017/S0022112094001771 (moving walls); Krüger et al. (2017), The Lattice
//! Boltzmann Method, Eqs. (5.26) and (5.79).

use super::Real;
use super::layout::{AaPhase, Layout};
use super::rows::RowOrder;
use super::solid::CHUNK;
use crate::domain::{Block, Domain};
use crate::error::Result;
use crate::lattice::{C, Q, W, opposite};
use crate::math::to_fixed;
use crate::memory;
use std::ops::Range;

/// Steady rigid motion of a wall, lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WallMotion {
    /// Velocity of the pivot (cells per time step).
    pub velocity: [f64; 3],
    /// Angular velocity about the pivot (1 / time step).
    pub angular_velocity: [f64; 3],
    /// A point of the wall (cells from the corner of the box).
    pub pivot: [f64; 3],
}

impl WallMotion {
    fn moves(&self) -> bool {
        self.velocity.iter().chain(&self.angular_velocity).any(|&v| v != 0.0)
    }

    /// Velocity at a position (cells from the corner of the box; cell `n` has its centre at `n + 1/2`).
    pub fn at(&self, place: [f64; 3]) -> [f64; 3] {
        let (w, r): (_, [f64; 3]) =
            (self.angular_velocity, std::array::from_fn(|a| place[a] - self.pivot[a]));
        std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            self.velocity[a] + (w[b] * r[c] - w[c] * r[b])
        })
    }
}

/// The walls round and in a box, lattice units.
pub struct Boundary<'a> {
    /// Motion of each wall.
    pub motions: &'a [WallMotion],
    /// The wall a cell belongs to, an index into `motions`; of every cell beyond a closed face it must know one.
    /// Cells are those of the box, and up to one beyond in directions that are not periodic.
    pub wall_of: &'a dyn Fn([i64; 3]) -> Option<usize>,
}

impl Boundary<'_> {
    /// No walls: for a box that is periodic in all directions.
    pub const fn none() -> Self {
        Boundary { motions: &[], wall_of: &|_| None }
    }
}

/// Momentum that a wall received in a time step: sums of fixed-point numbers
/// ([`from_fixed_wide`](crate::math::from_fixed_wide)), lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WallLoad {
    /// Force.
    pub force: [i128; 3],
    /// Torque about the pivot of its motion.
    pub torque: [i128; 3],
}

/// Of cells in no wall.
const NO_WALL: u16 = u16::MAX;

/// Links of consecutive cells along x in the same direction to the same wall.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Slot `(x, i)` of the first link; the direction gives the distance of `(w, -i)` from it.
    near: usize,
    count: u32,
    /// First of the corrections, or `NO_CORRECTION`.
    correction: u32,
    wall: u16,
    direction: u8,
}

/// Of links to walls at rest.
const NO_CORRECTION: u32 = u32::MAX;

/// Consecutive wall cells of a row.
#[derive(Clone, Copy, Debug)]
struct WallCells {
    start: usize,
    end: usize,
    wall: u16,
}

/// A row of the block with wall cells in it.
#[derive(Debug)]
pub(crate) struct WallRow<T> {
    cells: Vec<WallCells>,
    /// By chunk: all cells are wall and need no sweep.
    pub(crate) dead: Vec<bool>,
    /// Other chunks with wall cells: 1 in fluid, 0 in walls.
    mixed: Vec<(usize, [T; CHUNK])>,
}

/// All walls of a block.
pub(crate) struct Walls<T> {
    motions: Vec<WallMotion>,
    /// Links to wall cells beyond the block, which wait for the halo exchange.
    late: Vec<Run>,
    /// Links between cells of the block, by the row whose sweep completes them, and where each row begins; no row at
    /// all if there is none. The memory they touch is in the cache then.
    early: Vec<Run>,
    early_rows: Vec<usize>,
    /// From `(x, i)` to `(w, -i)`, by direction.
    to_far: [isize; Q],
    /// `6 w_i c_i . u_w` of the links to moving walls.
    corrections: Vec<T>,
    /// At the two ends of rows, where they meet closed faces.
    ends: Vec<RowEnds<T>>,
    /// Wall cells of the block by row; no row at all if there is none.
    rows: Vec<Option<Box<WallRow<T>>>>,
    size: [usize; 3],
    /// In which rows are swept.
    order: RowOrder,
    fluid_cells: usize,
}

/// The links across a closed face that rows end at, five to a row.
struct RowEnds<T> {
    directions: [usize; 5],
    /// Last cell of a row, and the ghost beyond.
    last: isize,
    ghost: isize,
    /// By row, then by direction; empty if nothing moves.
    corrections: Vec<T>,
    /// By row, then by direction; `NO_WALL` where the last cell belongs to a wall itself.
    walls: Vec<u16>,
}

/// The wall of every cell of a block and its ghosts.
struct Map {
    size: [usize; 3],
    lo: [usize; 3],
    walls: Vec<u16>,
}

impl Map {
    fn new(domain: &Domain, block: Block, boundary: &Boundary) -> Result<Self> {
        assert!(boundary.motions.len() < NO_WALL.into());
        let size = block.size();
        let cells = domain.cells.map(|n| n as i64);
        let cells_with_ghosts = size.iter().map(|n| n + 2).product();
        let mut walls = memory::with_capacity(cells_with_ghosts, "the map of the walls")?;
        let [xs, ys, zs]: [_; 3] = std::array::from_fn(|a| block.lo[a] as i64 - 1..block.hi[a] as i64 + 1);
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let (mut cell, mut beyond) = ([x, y, z], false);
                    for a in 0..3 {
                        if domain.periodic[a] {
                            cell[a] = cell[a].rem_euclid(cells[a]);
                        } else {
                            beyond |= !(0..cells[a]).contains(&cell[a]);
                        }
                    }
                    let wall = (boundary.wall_of)(cell);
                    assert!(wall.is_some() || !beyond, "{cell:?} lies in a wall");
                    assert!(wall.is_none_or(|wall| wall < boundary.motions.len()));
                    walls.push(wall.map_or(NO_WALL, |wall| wall as u16));
                }
            }
        }
        let lo = block.lo;
        Ok(Self { size, lo, walls })
    }

    /// The wall of a cell of the block or a ghost.
    fn at(&self, x: isize, y: isize, z: isize) -> u16 {
        let [nx, ny, _] = self.size.map(|n| n as isize + 2);
        self.walls[((x + 1) + nx * ((y + 1) + ny * (z + 1))) as usize]
    }

    /// `6 w_i c_i . u_w` for the link of a cell of the block in direction `i`: from its position in the whole box, so
    /// it is the same on every rank.
    fn correction<T: Real>(&self, motion: &WallMotion, cell: [isize; 3], i: usize) -> T {
        let middle =
            std::array::from_fn(|a| (cell[a] + self.lo[a] as isize) as f64 + 0.5 * (1.0 - C[i][a] as f64));
        let u = motion.at(middle);
        let cu: f64 = (0..3).map(|a| C[i][a] as f64 * u[a]).sum();
        T::from_f64(6.0 * W[i] * cu)
    }
}

impl<T: Real> Walls<T> {
    pub(crate) fn new(
        layout: &Layout,
        order: RowOrder,
        domain: &Domain,
        block: Block,
        boundary: &Boundary,
    ) -> Result<Self> {
        let size = layout.size;
        let mut walls = Self {
            motions: boundary.motions.to_vec(),
            late: Vec::new(),
            early: Vec::new(),
            early_rows: Vec::new(),
            to_far: std::array::from_fn(|i| {
                (opposite(i) as isize - i as isize) * layout.stride as isize - layout.step(i)
            }),
            corrections: Vec::new(),
            ends: Vec::new(),
            rows: Vec::new(),
            size,
            order,
            fluid_cells: block.cell_count(),
        };
        if boundary.motions.is_empty() {
            assert_eq!(domain.periodic, [true; 3], "closed faces are walls");
            return Ok(walls);
        }
        let map = Map::new(domain, block, boundary)?;
        let closed =
            [!domain.periodic[0] && block.lo[0] == 0, !domain.periodic[0] && block.hi[0] == domain.cells[0]];
        walls.find_ends(&map, closed);
        walls.find_runs(layout, &map, closed);
        walls.find_cells(&map);
        Ok(walls)
    }

    fn find_ends(&mut self, map: &Map, closed: [bool; 2]) {
        let [nx, ny, nz] = self.size.map(|n| n as isize);
        for (last, ghost, _) in [(0, -1, closed[0]), (nx - 1, nx, closed[1])].into_iter().filter(|end| end.2)
        {
            let inwards = (1..Q).filter(|&i| C[i][0] == last - ghost);
            let mut directions = [0; 5];
            directions.iter_mut().zip(inwards).for_each(|(to, i)| *to = i);
            let mut ends = RowEnds { directions, last, ghost, corrections: Vec::new(), walls: Vec::new() };
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                let in_fluid = map.at(last, y, z) == NO_WALL;
                for i in directions {
                    let wall = map.at(ghost, y - C[i][1], z - C[i][2]);
                    ends.walls.push(if in_fluid { wall } else { NO_WALL });
                    let motion = &self.motions[usize::from(wall)];
                    ends.corrections.push(map.correction(motion, [last, y, z], i));
                }
            }
            if ends.corrections.iter().all(|&c| c == T::ZERO) {
                ends.corrections.clear();
            }
            self.ends.push(ends);
        }
    }

    fn find_runs(&mut self, layout: &Layout, map: &Map, closed: [bool; 2]) {
        let [nx, ny, nz] = self.size.map(|n| n as isize);
        let mut early: Vec<(usize, Run)> = Vec::new();
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            for i in 1..Q {
                let [cx, cy, cz] = C[i];
                let other = self.order.row(y - cy, z - cz);
                let beyond = other.is_none();
                // The later of the two rows.
                let own = [y as usize, z as usize];
                let later = other.filter(|&other| self.order.is_before(own, other)).unwrap_or(own);
                let completed = later[1] * ny as usize + later[0];
                // The others are done at the ends of rows.
                let first = isize::from(closed[0] && cx > 0);
                let end = nx - isize::from(closed[1] && cx < 0);
                let mut last: Option<(bool, Run)> = None;
                let mut put = |run: Option<(bool, Run)>, late: &mut Vec<Run>| match run {
                    Some((true, run)) => late.push(run),
                    Some((false, run)) => early.push((completed, run)),
                    None => {}
                };
                for x in first..end {
                    let wall = map.at(x - cx, y - cy, z - cz);
                    if wall == NO_WALL || map.at(x, y, z) != NO_WALL {
                        put(last.take(), &mut self.late);
                        continue;
                    }
                    let is_late = beyond || !(0..nx).contains(&(x - cx));
                    if last.is_some_and(|(late, run)| run.wall != wall || late != is_late) {
                        put(last.take(), &mut self.late);
                    }
                    let motion = self.motions[usize::from(wall)];
                    let (_, run) = last.get_or_insert_with(|| {
                        let run = Run {
                            near: i * layout.stride + layout.cell(x, y, z),
                            count: 0,
                            correction: if motion.moves() {
                                self.corrections.len() as u32
                            } else {
                                NO_CORRECTION
                            },
                            wall,
                            direction: i as u8,
                        };
                        (is_late, run)
                    });
                    run.count += 1;
                    if motion.moves() {
                        self.corrections.push(map.correction(&motion, [x, y, z], i));
                    }
                }
                put(last.take(), &mut self.late);
            }
        }
        assert!(self.corrections.len() < NO_CORRECTION as usize);
        if early.is_empty() {
            return;
        }
        early.sort_by_key(|&(row, _)| row);
        let rows = 0..=(ny * nz) as usize;
        self.early_rows = rows.map(|row| early.partition_point(|e| e.0 < row)).collect();
        self.early = early.into_iter().map(|(_, run)| run).collect();
    }

    fn find_cells(&mut self, map: &Map) {
        let [nx, ny, nz] = self.size;
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let walls: Vec<u16> = (0..nx).map(|x| map.at(x as isize, y as isize, z as isize)).collect();
            self.rows.push(WallRow::new(&walls).map(Box::new));
        }
        let rows = self.rows.iter().flatten();
        let wall_cells: usize = rows.flat_map(|row| &row.cells).map(|cells| cells.end - cells.start).sum();
        self.fluid_cells -= wall_cells;
        if wall_cells == 0 {
            self.rows.clear();
        }
    }

    /// Returns true if there are none in the whole box.
    pub(crate) fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Number of cells of the block in no wall.
    pub(crate) fn fluid_cells(&self) -> usize {
        self.fluid_cells
    }

    /// Row `(y, z)`, if it has wall cells.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, z: usize) -> Option<&WallRow<T>> {
        self.rows.get(z * self.size[1] + y)?.as_deref()
    }

    /// The wall of a cell of the block.
    pub(crate) fn of(&self, [x, y, z]: [usize; 3]) -> Option<&WallMotion> {
        let cells = &self.row(y, z)?.cells;
        let cells = cells.iter().find(|cells| (cells.start..cells.end).contains(&x))?;
        Some(&self.motions[usize::from(cells.wall)])
    }

    /// Returns true if rows end at a closed face on some side.
    pub(crate) fn at_row_ends(&self) -> bool {
        !self.ends.is_empty()
    }

    /// Bounces the links at the ends of rows that the sweep of row `(y, z)`, the last so far, has completed: both
    /// ends of a link must have been swept, for the second would overwrite it (the ghost of a row that ends within a
    /// chunk is swept, too). `entered` is the phase after the sweep.
    #[inline(never)]
    pub(crate) fn bounce_row_ends(
        &self,
        layout: &Layout,
        entered: AaPhase,
        populations: &mut [T],
        y: usize,
        z: usize,
    ) {
        let (own, y, z) = ([y, z], y as isize, z as isize);
        for ends in &self.ends {
            for (k, &i) in ends.directions.iter().enumerate() {
                let [_, cy, cz] = C[i];
                let mut bounce = |y: isize, z: isize| {
                    let near = i * layout.stride + layout.cell(ends.last, y, z);
                    let far = opposite(i) * layout.stride + layout.cell(ends.ghost, y - cy, z - cz);
                    let (from, to) = match entered {
                        AaPhase::Odd => (near, far),
                        AaPhase::Even => (far, near),
                    };
                    let mut g = populations[from];
                    if !ends.corrections.is_empty() {
                        g = g + ends.corrections[ends.link(self.size, y, z, k)];
                    }
                    populations[to] = g;
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

    /// Bounces the links between cells of the block that the sweep of row `(y, z)`, the last so far, has completed.
    #[inline(never)]
    pub(crate) fn bounce_row(&self, entered: AaPhase, populations: &mut [T], y: usize, z: usize) {
        let row = z * self.size[1] + y;
        if let (Some(&first), Some(&end)) = (self.early_rows.get(row), self.early_rows.get(row + 1)) {
            self.bounce(&self.early[first..end], entered, populations);
        }
    }

    /// Bounces the links that lead out of the block, after the halo exchange.
    pub(crate) fn bounce_late(&self, entered: AaPhase, populations: &mut [T]) {
        self.bounce(&self.late, entered, populations);
    }

    #[inline(always)]
    fn bounce(&self, runs: &[Run], entered: AaPhase, populations: &mut [T]) {
        for run in runs {
            let far = self.far(run);
            let (from, to) = match entered {
                AaPhase::Odd => (run.near, far),
                AaPhase::Even => (far, run.near),
            };
            let count = run.count as usize;
            if let Some(corrections) = self.corrections_of(run) {
                for (k, &correction) in corrections.iter().enumerate() {
                    populations[to + k] = populations[from + k] + correction;
                }
            } else if count < CHUNK {
                for k in 0..count {
                    populations[to + k] = populations[from + k];
                }
            } else {
                populations.copy_within(from..from + count, to);
            }
        }
    }

    #[inline(always)]
    fn corrections_of(&self, run: &Run) -> Option<&[T]> {
        let first = run.correction as usize;
        (run.correction != NO_CORRECTION).then(|| &self.corrections[first..first + run.count as usize])
    }

    /// Slot `(w, -i)` of the first link of a run.
    #[inline(always)]
    fn far(&self, run: &Run) -> usize {
        run.near.wrapping_add_signed(self.to_far[usize::from(run.direction)])
    }

    /// Sets `far` of every link so that `near`, given in the phase `Even`, is what came back from it.
    pub(crate) fn begin(&self, layout: &Layout, populations: &mut [T]) {
        for run in self.late.iter().chain(&self.early) {
            let (far, corrections) = (self.far(run), self.corrections_of(run));
            for k in 0..run.count as usize {
                let correction = corrections.map_or(T::ZERO, |corrections| corrections[k]);
                populations[far + k] = populations[run.near + k] - correction;
            }
        }
        for ends in &self.ends {
            ends.each(layout, self.size, |link, _, _, near, far| {
                let correction = ends.corrections.get(link).copied().unwrap_or(T::ZERO);
                populations[far] = populations[near] - correction;
            });
        }
    }

    /// Force on every wall in the last step over the links of the block, and torque about its pivot, as sums of
    /// fixed-point numbers; without those of a fluid at rest with density 1.
    pub(crate) fn loads(&self, layout: &Layout, lo: [usize; 3], populations: &[T]) -> Vec<WallLoad> {
        let mut loads = vec![WallLoad::default(); self.motions.len()];
        let mut add = |wall: u16, i: usize, cell: [usize; 3], near: usize, far: usize| {
            let (near, far): (f64, f64) = (populations[near].into(), populations[far].into());
            let load = &mut loads[usize::from(wall)];
            let c = C[i].map(|c| c as f64);
            let pivot = self.motions[usize::from(wall)].pivot;
            let r: [f64; 3] =
                std::array::from_fn(|a| (cell[a] + lo[a]) as f64 + 0.5 * (1.0 - c[a]) - pivot[a]);
            for a in 0..3 {
                let (b, d) = ((a + 1) % 3, (a + 2) % 3);
                load.force[a] -= i128::from(to_fixed((near + far) * c[a]));
                load.torque[a] -= i128::from(to_fixed((near + far) * (r[b] * c[d] - r[d] * c[b])));
            }
        };
        for run in self.late.iter().chain(&self.early) {
            let (far, i) = (self.far(run), usize::from(run.direction));
            let [x, y, z] = layout.coordinates(run.near - i * layout.stride);
            for k in 0..run.count as usize {
                add(run.wall, i, [x + k, y, z], run.near + k, far + k);
            }
        }
        for ends in &self.ends {
            ends.each(layout, self.size, |link, i, cell, near, far| {
                if ends.walls[link] != NO_WALL {
                    add(ends.walls[link], i, cell, near, far);
                }
            });
        }
        loads
    }
}

impl<T: Real> WallRow<T> {
    /// From the wall of every cell; `None` if all are fluid.
    fn new(walls: &[u16]) -> Option<Self> {
        let (mut cells, mut dead, mut mixed) = (Vec::<WallCells>::new(), Vec::new(), Vec::new());
        for (x, &wall) in walls.iter().enumerate().filter(|&(_, &wall)| wall != NO_WALL) {
            match cells.last_mut() {
                Some(cells) if cells.end == x && cells.wall == wall => cells.end += 1,
                _ => cells.push(WallCells { start: x, end: x + 1, wall }),
            }
        }
        for (chunk, walls) in walls.chunks(CHUNK).enumerate() {
            let fluid = walls.iter().filter(|&&wall| wall == NO_WALL).count();
            dead.push(fluid == 0);
            if fluid > 0 && fluid < walls.len() {
                let mut mask = [T::ONE; CHUNK];
                for (mask, &wall) in mask.iter_mut().zip(walls) {
                    *mask = if wall == NO_WALL { T::ONE } else { T::ZERO };
                }
                mixed.push((chunk, mask));
            }
        }
        (!cells.is_empty()).then_some(Self { cells, dead, mixed })
    }

    /// Calls `visit` for all stretches of wall cells.
    #[inline(always)]
    pub(crate) fn each(&self, mut visit: impl FnMut(Range<usize>)) {
        for cells in &self.cells {
            visit(cells.start..cells.end);
        }
    }

    /// Empties the wall cells, whose populations lie at `places` (of the first cell of the row).
    #[inline(never)]
    pub(crate) fn clear(&self, places: &[usize; Q], populations: &mut [T]) {
        for (chunk, mask) in &self.mixed {
            for place in places {
                let cells = &mut populations[place + chunk * CHUNK..][..CHUNK];
                for k in 0..CHUNK {
                    cells[k] = cells[k] * mask[k];
                }
            }
        }
    }
}

impl<T> RowEnds<T> {
    /// Number of a link: the `k`th of a row.
    #[inline(always)]
    fn link(&self, size: [usize; 3], y: isize, z: isize, k: usize) -> usize {
        (z as usize * size[1] + y as usize) * self.directions.len() + k
    }

    /// Calls `visit(link, direction, cell, near, far)` for all links.
    fn each(
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

#[cfg(test)]
mod flow_tests;
#[cfg(test)]
mod tests;
