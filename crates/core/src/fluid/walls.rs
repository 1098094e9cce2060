//! Walls: half-way bounce-back where a link meets its wall half-way, and interpolated bounce-back elsewhere ([`interpolated`]).
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
//! that share a chunk with fluid are swept and then emptied ([`WallRow::clear`]). An inlet is a wall that moves along its normal; free slip
//! and outlets: [`face_links`]. Details: `docs/theory/fluid.md`.
//!
//! References: Ladd (1994), doi:10.1017/S0022112094001771 (moving walls); Krüger et al. (2017), The Lattice
//! Boltzmann Method, Eqs. (5.26) and (5.79).

mod cells;
mod face_links;
mod find;
mod interpolated;
mod motion;
mod row_ends;
mod rule;

use super::Real;
use super::layout::{AaPhase, Layout};
use super::population::Population;
use super::rows::RowOrder;
use super::solid::CHUNK;
use crate::domain::{Block, Domain, Face};
use crate::error::Result;
use crate::lattice::{C, Q, opposite};
use crate::math::to_fixed;
pub(crate) use cells::WallRow;
pub(crate) use face_links::{FaceLinkList, SavedMean};
use face_links::{FaceLinks, Means};
use find::Map;
pub(crate) use interpolated::CellList;
use interpolated::Interpolated;
pub use motion::WallMotion;
use row_ends::RowEnds;
pub(crate) use rule::LinkRule;
use std::collections::HashMap;

/// The walls round and in a box, lattice units.
pub struct Boundary<'a> {
    /// Motion of each wall.
    pub motions: &'a [WallMotion],
    /// The wall a cell belongs to, an index into `motions`; of every cell beyond a closed face it must know one.
    /// Cells are those of the box, and up to one beyond in directions that are not periodic.
    pub wall_of: &'a dyn Fn([i64; 3]) -> Option<usize>,
    /// Part of the way from the centre of a cell, along a direction of the lattice to the centre of a cell of a wall, at which the
    /// surface of that wall is met; not asked beyond closed faces, which are half-way.
    pub part_of_link: PartOfLink<'a>,
    /// Walls that the links from a cell of fluid to its neighbours meet, by direction of the lattice; none if there are none. Asked for
    /// links between two cells of fluid, which a sheet or a thin part of a wall lies between.
    pub between: Between<'a>,
}

/// [`Boundary::part_of_link`] of a wall, a cell and a direction.
pub type PartOfLink<'a> = &'a dyn Fn(usize, [i64; 3], [isize; 3]) -> f64;

/// [`Boundary::between`] of a cell.
pub type Between<'a> = &'a dyn Fn([i64; 3]) -> Option<[Option<usize>; Q]>;

/// [`Boundary::between`] without sheets.
pub const NO_SHEETS: Between<'static> = &|_| None;

/// [`Boundary::part_of_link`] of walls made of whole cells.
pub const HALF_WAY: PartOfLink<'static> = &|_, _, _| 0.5;

impl Boundary<'_> {
    /// No walls: for a box that is periodic in all directions.
    pub const fn none() -> Self {
        Boundary { motions: &[], wall_of: &|_| None, part_of_link: HALF_WAY, between: NO_SHEETS }
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
    /// Mass that came from it into the fluid.
    pub mass: i128,
}

/// Of cells in no wall.
const NO_WALL: u16 = u16::MAX;

/// Links of consecutive cells along x in the same direction to the same wall, all by one rule.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Slot `(x, i)` of the first link; the direction gives the distance of `(w, -i)` from it.
    near: usize,
    count: u32,
    rule: LinkRule,
    /// First of the numbers that the rule has for them.
    numbers: u32,
    wall: u16,
    direction: u8,
}

/// All walls of a block.
pub(crate) struct Walls<S: Population> {
    motions: Vec<WallMotion>,
    domain: Domain,
    /// Links to wall cells beyond the block, which wait for the halo exchange.
    late: Vec<Run>,
    /// Links between cells of the block, by the row whose sweep completes them, so that the memory they touch is in the
    /// cache; no row at all if there is none.
    early: Vec<Vec<Run>>,
    /// Links of faces whose populations come from a neighbour.
    face_runs: Vec<Run>,
    face_links: FaceLinks<S::Number>,
    /// From `(x, i)` to `(w, -i)`, by direction.
    to_far: [isize; Q],
    /// Data of the rules of runs, link by link.
    numbers: Vec<S::Number>,
    /// Links that meet their walls elsewhere than half-way.
    interpolated: Interpolated<S::Number>,
    /// At the two ends of rows, where they meet closed faces.
    ends: Vec<RowEnds<S::Number>>,
    /// Wall cells of the block by row; no row at all if there is none.
    rows: Vec<Option<Box<WallRow<S::Number>>>>,
    size: [usize; 3],
    /// Corner of the block in the box.
    lo: [usize; 3],
    /// The two slots of each link of [`LinkRule::TwoSided`], from either to the other: they hold what came back for what was sent from there.
    exchanged: HashMap<usize, usize>,
    /// In which rows are swept.
    order: RowOrder,
    /// Number of cells of the block in no wall.
    pub(crate) fluid_cells: usize,
}

impl<S: Population> Walls<S> {
    pub(crate) fn new(
        layout: &Layout,
        order: RowOrder,
        domain: &Domain,
        block: Block,
        boundary: &Boundary,
        relaxation_times: [f64; 2],
    ) -> Result<Self> {
        let size = layout.size;
        let mut walls = Self {
            motions: boundary.motions.to_vec(),
            domain: *domain,
            late: Vec::new(),
            early: Vec::new(),
            face_runs: Vec::new(),
            face_links: FaceLinks::new(layout),
            to_far: std::array::from_fn(|i| {
                (opposite(i) as isize - i as isize) * layout.stride as isize - layout.step(i)
            }),
            numbers: Vec::new(),
            interpolated: Interpolated::new(layout, relaxation_times),
            ends: Vec::new(),
            rows: Vec::new(),
            size,
            lo: block.lo,
            exchanged: HashMap::new(),
            order,
            fluid_cells: block.cell_count(),
        };
        if boundary.motions.is_empty() {
            assert_eq!(domain.faces, [Face::Periodic; 6], "the other faces are walls");
            return Ok(walls);
        }
        let map = Map::new(domain, block, boundary)?;
        let closed =
            [0, 1].map(|face| map.is_at(face) && matches!(domain.faces[face], Face::Wall | Face::Inlet));
        walls.find_ends(layout, &map, closed);
        walls.find_runs(layout, &map, closed, boundary.part_of_link);
        walls.interpolated.set_motions(layout, (walls.lo, domain), &walls.motions, WallMotion::moves);
        walls.find_cells(&map);
        let wrap_x = domain.is_periodic(0) && size[0] == domain.cells[0];
        walls.face_links.find(layout, &map, &domain.faces, wrap_x);
        walls.face_links.set_pressures(|wall| boundary.motions[usize::from(wall)].excess);
        Ok(walls)
    }

    /// Returns true if there are none in the whole box.
    pub(crate) fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Row `(y, z)`, if it has wall cells.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, z: usize) -> Option<&WallRow<S::Number>> {
        self.rows.get(z * self.size[1] + y)?.as_deref()
    }

    /// Calls `visit` with the wall cells of a row and the motion of their wall.
    pub(crate) fn each_of_row(&self, [y, z]: [usize; 2], mut visit: impl FnMut(usize, &WallMotion)) {
        for (cells, wall) in self.row(y, z).into_iter().flat_map(|row| &row.cells) {
            cells.clone().for_each(|x| visit(x, &self.motions[usize::from(*wall)]));
        }
    }

    /// The wall of a cell of the block.
    pub(crate) fn of(&self, [x, y, z]: [usize; 3]) -> Option<&WallMotion> {
        let (_, wall) = self.row(y, z)?.cells.iter().find(|(cells, _)| cells.contains(&x))?;
        Some(&self.motions[usize::from(*wall)])
    }

    /// Slot of a population that left its cell, which is in this one unless both sides of a sheet have exchanged it.
    #[inline]
    pub(crate) fn left(&self, slot: usize) -> usize {
        if self.exchanged.is_empty() { slot } else { self.exchanged.get(&slot).copied().unwrap_or(slot) }
    }

    /// Bounces the links between cells of the block that the sweep of row `(y, z)`, the last so far, has completed; `again` if
    /// populations are those of a saved state.
    #[inline(always)]
    pub(crate) fn bounce_row(
        &self,
        entered: AaPhase,
        populations: &mut [S],
        [y, z]: [usize; 2],
        again: bool,
    ) {
        let row = z * self.size[1] + y;
        if let Some(runs) = self.early.get(row) {
            self.bounce(runs, entered, populations);
        }
        self.face_links.apply(row, entered, populations, Means::of(again));
        self.interpolated.apply(Some(row), entered, populations, again);
    }

    /// Bounces the links that wait for the halo exchange; `again` as there.
    pub(crate) fn bounce_late(&self, entered: AaPhase, populations: &mut [S], again: bool) {
        self.bounce(&self.late, entered, populations);
        self.interpolated.apply(None, entered, populations, again);
    }

    #[inline(always)]
    fn bounce(&self, runs: &[Run], entered: AaPhase, populations: &mut [S]) {
        for run in runs {
            let slots = ends_of([run.near, self.far(run)], entered);
            run.rule.apply(populations, slots, run.count as usize, self.numbers_of(run));
        }
    }

    #[inline(always)]
    fn numbers_of(&self, run: &Run) -> &[S::Number] {
        &self.numbers[run.numbers as usize..][..run.rule.numbers() * run.count as usize]
    }

    /// Slot `(w, -i)` of the first link of a run.
    #[inline(always)]
    fn far(&self, run: &Run) -> usize {
        run.near.wrapping_add_signed(self.to_far[usize::from(run.direction)])
    }

    /// Sets `far` of every link so that `near`, given in the phase `Even`, is what came back from it.
    pub(crate) fn begin(&self, layout: &Layout, populations: &mut [S]) {
        for run in self.late.iter().chain(self.early.iter().flatten()) {
            if run.rule == LinkRule::TwoSided {
                continue;
            }
            let (far, numbers, each) = (self.far(run), self.numbers_of(run), run.rule.numbers());
            for k in 0..run.count as usize {
                populations[far + k] = run.rule.sent(populations[run.near + k], &numbers[each * k..]);
            }
        }
        for ends in &self.ends {
            ends.each(layout, self.size, |link, _, _, near, far| {
                populations[far] = ends.rule.sent(populations[near], ends.numbers_of(link));
            });
        }
        self.interpolated.each(|_, [near, far], _, _| populations[far] = populations[near]);
        // What outlets send back depends on all that their cells have sent.
        for run in &self.face_runs {
            let (i, far) = (usize::from(run.direction), self.far(run));
            let here = run.near + opposite(i) * layout.stride - i * layout.stride;
            populations.copy_within(here..here + run.count as usize, far);
        }
        self.exchange_sides(populations);
        self.face_links.begin(populations);
    }

    /// The same for interpolated links, which change `near`, once what faces send back has crossed to other blocks.
    pub(crate) fn begin_interpolated(&self, populations: &mut [S]) {
        self.interpolated.begin(populations);
    }

    /// Bounces sheets, once what faces send back has crossed to other blocks: [`begin`](Self::begin) has left what was sent there.
    pub(crate) fn begin_sheets(&self, populations: &mut [S]) {
        for run in self.late.iter().chain(self.early.iter().flatten()) {
            // What came back off other walls at rest is already there.
            if run.rule == LinkRule::Resting {
                run.rule.apply(populations, [self.far(run), run.near], run.count as usize, &[]);
            }
        }
        self.exchange_sides(populations);
    }

    /// Exchanges what was sent to both sides of sheets within the block, and what came back.
    fn exchange_sides(&self, populations: &mut [S]) {
        let runs = self.late.iter().chain(self.early.iter().flatten());
        for run in runs.filter(|run| run.rule == LinkRule::TwoSided) {
            run.rule.apply(populations, [self.far(run), run.near], run.count as usize, &[]);
        }
    }

    /// All links as a device applies them, a list for each rule: those within the block, then those that wait for the halo exchange.
    pub(crate) fn links(&self, layout: &Layout) -> [Vec<LinkList<S::Number>>; 2] {
        let [mut early, mut late] = [(); 2].map(|()| LinkRule::ALL.map(LinkList::new));
        for run in self.early.iter().flatten() {
            early[run.rule as usize].add(run.near, self.far(run), run.count as usize, self.numbers_of(run));
        }
        for run in &self.late {
            late[run.rule as usize].add(run.near, self.far(run), run.count as usize, self.numbers_of(run));
        }
        for ends in &self.ends {
            ends.each(layout, self.size, |link, _, _, near, far| {
                early[ends.rule as usize].add(near, far, 1, ends.numbers_of(link));
            });
        }
        [early.into(), late.into()]
    }

    /// Interpolated links as a device applies them: those within the block, then those that wait for the halo exchange.
    pub(crate) fn cells(&self) -> [CellList<S::Number>; 2] {
        self.interpolated.lists()
    }

    /// Of each cell of the block: 0 in fluid, 1 in a wall, 2 if it is not swept; empty if there is no cell in a wall.
    pub(crate) fn flags(&self) -> Vec<u8> {
        let [nx, ny, nz] = self.size;
        if self.rows.is_empty() {
            return Vec::new();
        }
        let mut flags = vec![0; nx * ny * nz];
        for (row, flags) in self.rows.iter().zip(flags.chunks_mut(nx)) {
            let Some(row) = row else { continue };
            row.each(|cells| flags[cells].fill(1));
            for (flags, _) in flags.chunks_mut(CHUNK).zip(&row.dead).filter(|(_, dead)| **dead) {
                flags.fill(2);
            }
        }
        flags
    }

    /// Force on every wall in the last step over the links of the block, and torque about its pivot, as sums of
    /// fixed-point numbers; without those of a fluid at rest with density 1.
    pub(crate) fn loads(&self, layout: &Layout, populations: &[S], entered: AaPhase) -> Vec<WallLoad> {
        let mut loads = vec![WallLoad::default(); self.motions.len()];
        let (wide, signed) =
            (|slot: usize| populations[slot].wide(), |cell: [usize; 3]| cell.map(|n| n as isize));
        let mut add = |wall: u16, i: usize, cell: [isize; 3], near: f64, far: f64| {
            let load = &mut loads[usize::from(wall)];
            let [sent, arrived] = ends_of([near, far], entered);
            load.mass += i128::from(to_fixed(arrived - sent));
            let c = C[i].map(|c| c as f64);
            let pivot = self.motions[usize::from(wall)].pivot;
            let r: [f64; 3] = std::array::from_fn(|a| {
                (cell[a] + self.lo[a] as isize) as f64 + 0.5 * (1.0 - c[a]) - pivot[a]
            });
            for a in 0..3 {
                let (b, d) = ((a + 1) % 3, (a + 2) % 3);
                load.force[a] -= i128::from(to_fixed((near + far) * c[a]));
                load.torque[a] -= i128::from(to_fixed((near + far) * (r[b] * c[d] - r[d] * c[b])));
            }
        };
        for run in self.late.iter().chain(self.early.iter().flatten()).chain(&self.face_runs) {
            let (far, i) = (self.far(run), usize::from(run.direction));
            let [x, y, z] = signed(layout.coordinates(run.near - i * layout.stride));
            for k in 0..run.count as usize {
                let (cell, [near, far]) =
                    ([x + k as isize, y, z], [run.near, far].map(|slot| wide(slot + k)));
                if run.rule == LinkRule::TwoSided {
                    // What came back to either side is what it had sent.
                    let [beyond, own] = ends_of([near, far], entered);
                    add(run.wall, i, cell, own, own);
                    add(run.wall, opposite(i), std::array::from_fn(|a| cell[a] - C[i][a]), beyond, beyond);
                } else {
                    add(run.wall, i, cell, near, far);
                }
            }
        }
        self.interpolated.each(|cell, [near, far], i, wall| {
            add(wall, i, signed(layout.coordinates(cell)), wide(near), wide(far));
        });
        for ends in &self.ends {
            ends.each(layout, self.size, |link, i, cell, near, far| {
                if ends.walls[link] != NO_WALL {
                    add(ends.walls[link], i, signed(cell), wide(near), wide(far));
                }
            });
        }
        loads
    }
}

/// Origin and destination of a population on entering a phase, of the two ends of a link.
#[inline(always)]
fn ends_of<T>([near, far]: [T; 2], entered: AaPhase) -> [T; 2] {
    if entered == AaPhase::Odd { [near, far] } else { [far, near] }
}

/// Links of one rule as pairs of slots, `near` in the fluid and `far` in the wall, with their numbers.
pub(crate) struct LinkList<T> {
    pub(crate) rule: LinkRule,
    pub(crate) near: Vec<u64>,
    pub(crate) far: Vec<u64>,
    pub(crate) numbers: Vec<T>,
}

impl<T: Real> LinkList<T> {
    fn new(rule: LinkRule) -> Self {
        Self { rule, near: Vec::new(), far: Vec::new(), numbers: Vec::new() }
    }

    fn add(&mut self, near: usize, far: usize, count: usize, numbers: &[T]) {
        self.near.extend((0..count).map(|k| (near + k) as u64));
        self.far.extend((0..count).map(|k| (far + k) as u64));
        self.numbers.extend_from_slice(numbers);
    }
}

#[cfg(test)]
mod flow_tests;
#[cfg(test)]
mod tests;
