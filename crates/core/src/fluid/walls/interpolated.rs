//! Interpolated bounce-back: links that meet the wall elsewhere than half-way, cell by cell.
//!
//! A link of cell `x` meets the wall at the part `q` of its way `-c_i`. What comes back is a combination of populations along the
//! link, all at `x`: what was sent, what left the other way, and what has just arrived from there, so no cell further away is needed.
//!
//! ```text
//! f_i(x) = f'_-i + B (f_-i - f'_i) + H (f'_i - f'_-i) + M
//! f_0(x) = f_0 - sum (B (f_-i - f'_i) + H (f'_i - f'_-i) + M - 6 w_i c_i . u_w)
//! s = 2 / (1 + 2 q + 2 g),    B = 1 - 2 q s,    H = 2 g s,    M = 6 s w_i c_i . u_w
//! g = max(0, 3/2 q^2 - 3/4 q + 1/8 - magic) / (tau - 1/2),    magic = (tau - 1/2) (tau_odd - 1/2)
//! ```
//!
//! `g = 0` is the central linear interpolation CLI, and with `q = 1/2` half-way bounce-back. `g` makes the flow through channels along the
//! lattice exact and damps what alternates from step to step. The second line keeps the mass of the cell. Derivation:
//! `docs/theory/fluid.md`.
//!
//! References: Ginzburg, Verhaeghe, d'Humieres (2008), Commun. Comput. Phys. 3, 427 (CLI); Marson, Thorimbert, Chopard,
//! Ginzburg, Latt (2021), doi:10.1103/PhysRevE.103.053308 (families of such rules).

use super::WallMotion;
use crate::domain::Domain;
use crate::fluid::Real;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::fluid::solid::CHUNK;
use crate::lattice::{Q, opposite};
use std::collections::HashMap;

/// Relative difference from 1/2 below which a link is half-way.
const TOLERANCE: f64 = 1e-9;

/// A link that meets its wall at `part` of its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub(super) direction: usize,
    pub(super) wall: u16,
    pub(super) part: f64,
}

impl Link {
    /// True of a wall at `part` of a link that is not half-way; a surface that is not on it counts as half-way.
    pub(super) fn is_needed(part: f64) -> bool {
        (0.0..=1.0).contains(&part) && (part - 0.5).abs() > TOLERANCE
    }

    /// `B` and `H`; `s = 1 + B - H`.
    fn weights(&self, [even, odd]: [f64; 2]) -> [f64; 2] {
        let (q, above_half) = (self.part, even - 0.5);
        let g = ((1.5 * q * q - 0.75 * q + 0.125) / above_half - (odd - 0.5)).max(0.0);
        let s = 2.0 / (1.0 + 2.0 * q + 2.0 * g);
        [1.0 - 2.0 * q * s, 2.0 * g * s]
    }
}

/// A cell with such links.
pub(super) struct Cell {
    pub(super) slot: usize,
    /// The last row that is swept before the links can be applied; none if they need populations from beyond the block.
    pub(super) completed: Option<usize>,
    pub(super) links: Vec<Link>,
}

impl Cell {
    /// Directions and walls.
    fn ways(&self) -> impl Iterator<Item = (u8, u16)> {
        self.links.iter().map(|link| (link.direction as u8, link.wall))
    }

    /// True if another one follows along x, with links that are applied together with these.
    fn continues(&self, next: &Self) -> bool {
        self.slot + 1 == next.slot && self.completed == next.completed && self.ways().eq(next.ways())
    }
}

/// Consecutive cells along x with links in the same directions to the same walls, which are done together.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Slot of the first one.
    cell: usize,
    /// One of [`COUNTS`].
    count: u32,
    shape: Shape,
    /// First number of its walls that move, if one does: of a cell `sum (M - 6 w_i c_i . u_w)`, then `M` of each link.
    pushed: Option<u32>,
}

/// Links of a stretch, and the first of their weights; stretches may have the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    links: [u32; 2],
    weights: u32,
}

/// The shapes so far, by links and parts of ways.
pub(super) type Shapes = HashMap<(Vec<(u8, u16)>, Vec<u64>), Shape>;

/// Cells of a stretch; the loops over them are compiled for each.
const COUNTS: [usize; 3] = [CHUNK, 4, 1];

/// All interpolated links of a block.
pub(super) struct Interpolated<T> {
    /// By the row whose sweep completes them; no row at all if there is none.
    early: Vec<Vec<Stretch>>,
    late: Vec<Stretch>,
    /// Direction and wall.
    links: Vec<(u8, u16)>,
    /// Of a stretch `B` and `H` of each link, each by cell.
    weights: Vec<T>,
    pushed: Vec<T>,
    /// Distances from a cell to its `f_i` after streaming, by phase.
    slots: [[usize; Q]; 2],
    relaxation_times: [f64; 2],
}

/// Interpolated links as a device applies them.
pub(crate) struct CellList<T> {
    /// Slots of the cells.
    pub(crate) cells: Vec<u64>,
    /// First link of each cell, and one past the last of all.
    pub(crate) first: Vec<u32>,
    pub(crate) directions: Vec<u32>,
    /// Of a cell one, and three of each link.
    pub(crate) numbers: Vec<T>,
}

impl<T: Real> Interpolated<T> {
    /// None yet; with the relaxation times of the even and the odd part.
    pub(super) fn new(layout: &Layout, relaxation_times: [f64; 2]) -> Self {
        let slots = [AaPhase::Even, AaPhase::Odd].map(|phase| layout.slots_from(phase));
        let (early, late, links) = (Vec::new(), Vec::new(), Vec::new());
        Self { early, late, links, weights: Vec::new(), pushed: Vec::new(), slots, relaxation_times }
    }

    /// Adds cells of a row in ascending order, beside walls whose motions follow.
    pub(super) fn add(&mut self, row: &[Cell], motions: &[WallMotion], shapes: &mut Shapes) {
        for mut cells in row.chunk_by(Cell::continues) {
            while let Some(first) = cells.first() {
                let count = COUNTS.into_iter().find(|&count| count <= cells.len()).expect("1 is one of them");
                let (these, rest) = cells.split_at(count);
                let pushed = self.pushed.len() as u32;
                let moves = first.ways().any(|(_, wall)| motions[usize::from(wall)].moves());
                if moves {
                    self.pushed.resize(self.pushed.len() + (1 + first.links.len()) * count, T::ZERO);
                }
                let stretch = Stretch {
                    cell: first.slot,
                    count: count as u32,
                    shape: self.shape(these, shapes),
                    pushed: moves.then_some(pushed),
                };
                match first.completed {
                    Some(row) => {
                        self.early.resize_with(self.early.len().max(row + 1), Vec::new);
                        self.early[row].push(stretch);
                    }
                    None => self.late.push(stretch),
                }
                cells = rest;
            }
        }
        assert!(u32::try_from(self.pushed.len().max(self.weights.len())).is_ok(), "links of one block");
    }

    /// The shape of the cells of a stretch, which others may have, too.
    fn shape(&mut self, cells: &[Cell], shapes: &mut Shapes) -> Shape {
        let of_links = |n: usize| cells.iter().map(move |cell| &cell.links[n]);
        let all = || (0..cells[0].links.len()).flat_map(of_links);
        let key = (cells[0].ways().collect(), all().map(|link| link.part.to_bits()).collect());
        *shapes.entry(key).or_insert_with(|| {
            let [links, weights] = [self.links.len(), self.weights.len()].map(|n| n as u32);
            self.links.extend(cells[0].ways());
            for n in 0..cells[0].links.len() {
                for k in 0..2 {
                    let weight = |link: &Link| T::from_f64(link.weights(self.relaxation_times)[k]);
                    self.weights.extend(of_links(n).map(weight));
                }
            }
            Shape { links: [links, self.links.len() as u32], weights }
        })
    }

    /// Links of a stretch.
    #[inline(always)]
    fn links(&self, stretch: &Stretch) -> &[(u8, u16)] {
        let [first, end] = stretch.shape.links.map(|n| n as usize);
        &self.links[first..end]
    }

    /// Gives walls of which this is true their motion in the coming step; the block has its corner at `lo` in the box.
    pub(super) fn set_motions(
        &mut self,
        layout: &Layout,
        (lo, domain): ([usize; 3], &Domain),
        motions: &[WallMotion],
        which: impl Fn(&WallMotion) -> bool,
    ) {
        let mut pushed = std::mem::take(&mut self.pushed);
        for stretch in self.early.iter().flatten().chain(&self.late) {
            let (links, Some(first)) = (self.links(stretch), stretch.pushed) else { continue };
            if !links.iter().any(|&(_, wall)| which(&motions[usize::from(wall)])) {
                continue;
            }
            let (at, n) = (layout.coordinates(stretch.cell), stretch.count as usize);
            let [x, y, z] = std::array::from_fn(|a| (lo[a] + at[a]) as isize);
            let (masses, numbers) = pushed[first as usize..].split_at_mut(n);
            masses.fill(T::ZERO);
            let weights = self.weights[stretch.shape.weights as usize..].chunks_exact(2 * n);
            for ((&(i, wall), numbers), weights) in links.iter().zip(numbers.chunks_exact_mut(n)).zip(weights)
            {
                for k in 0..n {
                    let push =
                        motions[usize::from(wall)].correction::<T>([x + k as isize, y, z], i.into(), domain);
                    let more = (weights[k] - weights[n + k]) * push;
                    numbers[k] = push + more;
                    masses[k] = masses[k] + more;
                }
            }
        }
        self.pushed = pushed;
    }

    /// Applies the links that the sweep of a row has completed, or those that wait for the halo exchange; `again` if they have
    /// been applied to this step before, as in the state that is saved: then the mass is right already.
    #[inline(always)]
    pub(super) fn apply<S: Population<Number = T>>(
        &self,
        row: Option<usize>,
        entered: AaPhase,
        populations: &mut [S],
        again: bool,
    ) {
        let stretches = row.map_or(Some(&self.late), |row| self.early.get(row));
        for stretch in stretches.into_iter().flatten() {
            match stretch.count as usize {
                CHUNK => self.apply_to::<S, CHUNK>(stretch, entered, populations, again),
                4 => self.apply_to::<S, 4>(stretch, entered, populations, again),
                _ => self.apply_to::<S, 1>(stretch, entered, populations, again),
            }
        }
    }

    #[inline(always)]
    fn apply_to<S: Population<Number = T>, const N: usize>(
        &self,
        stretch: &Stretch,
        entered: AaPhase,
        populations: &mut [S],
        again: bool,
    ) {
        let ([now, before], cell) = (self.phases(entered), stretch.cell);
        let numbers =
            |from: &[T], n: usize| -> [T; N] { *from[n * N..].first_chunk().expect("of each cell") };
        let read = |populations: &[S], slot: usize| -> [T; N] {
            let from: &[S; N] = populations[slot..].first_chunk().expect("cells of a row");
            std::array::from_fn(|k| from[k].read())
        };
        let weights = &self.weights[stretch.shape.weights as usize..];
        let pushed = stretch.pushed.map(|first| &self.pushed[first as usize..]);
        let mut gained = pushed.map_or([T::ZERO; N], |pushed| numbers(pushed, 0));
        for (n, &(direction, _)) in self.links(stretch).iter().enumerate() {
            let (i, j) = (usize::from(direction), opposite(usize::from(direction)));
            let [sent, left, arrived] =
                [before[i], before[j], now[j]].map(|slot| read(populations, cell.wrapping_add(slot)));
            let [b, h] = [0, 1].map(|k| numbers(weights, 2 * n + k));
            let mut change: [T; N] =
                std::array::from_fn(|k| b[k] * (arrived[k] - left[k]) + h[k] * (left[k] - sent[k]));
            gained = std::array::from_fn(|k| gained[k] + change[k]);
            if let Some(pushed) = pushed {
                let pushed = numbers(pushed, 1 + n);
                change = std::array::from_fn(|k| change[k] + pushed[k]);
            }
            let to = populations[cell.wrapping_add(now[i])..].first_chunk_mut::<N>().expect("cells of a row");
            *to = std::array::from_fn(|k| S::round(sent[k] + change[k]));
        }
        if !again {
            let rest = read(populations, cell);
            let to = populations[cell..].first_chunk_mut::<N>().expect("cells of a row");
            *to = std::array::from_fn(|k| S::round(rest[k] - gained[k]));
        }
    }

    /// Distances to `f_i` after streaming, and to the `f'_-i` that was before it in the same cell, entering a phase.
    #[inline(always)]
    fn phases(&self, entered: AaPhase) -> [&[usize; Q]; 2] {
        [&self.slots[entered as usize], &self.slots[entered.next() as usize]]
    }

    /// Bounces what is there in the phase `Even` as if it had been sent, as [`Walls::begin`](super::Walls::begin) has set it, so that the state
    /// is one that follows from what cells sent.
    pub(super) fn begin<S: Population<Number = T>>(&self, populations: &mut [S]) {
        for row in (0..self.early.len()).map(Some).chain([None]) {
            self.apply(row, AaPhase::Even, populations, false);
        }
    }

    /// Calls `visit` for all links: slots of cell, `near` and `far`, direction, and wall.
    pub(super) fn each(&self, mut visit: impl FnMut(usize, [usize; 2], usize, u16)) {
        for stretch in self.early.iter().flatten().chain(&self.late) {
            for &(direction, wall) in self.links(stretch) {
                let i = usize::from(direction);
                for cell in stretch.cell..stretch.cell + stretch.count as usize {
                    let ends = [0, 1].map(|phase| cell.wrapping_add(self.slots[phase][i]));
                    visit(cell, ends, i, wall);
                }
            }
        }
    }

    /// As a device applies them: those within the block, and those that wait for the halo exchange.
    pub(super) fn lists(&self) -> [CellList<T>; 2] {
        let list = |stretches: &mut dyn Iterator<Item = &Stretch>| {
            let mut list =
                CellList { cells: Vec::new(), first: vec![0], directions: Vec::new(), numbers: Vec::new() };
            for stretch in stretches {
                let (n, links) = (stretch.count as usize, self.links(stretch));
                let weights = &self.weights[stretch.shape.weights as usize..];
                let pushed =
                    |at: usize| stretch.pushed.map_or(T::ZERO, |first| self.pushed[first as usize + at]);
                for k in 0..n {
                    list.cells.push((stretch.cell + k) as u64);
                    list.directions.extend(links.iter().map(|&(direction, _)| u32::from(direction)));
                    list.first.push(list.directions.len() as u32);
                    list.numbers.push(pushed(k));
                    for l in 0..links.len() {
                        let [b, h] = [0, 1].map(|number| weights[(2 * l + number) * n + k]);
                        list.numbers.extend([b, h, pushed((1 + l) * n + k)]);
                    }
                }
            }
            list
        };
        [list(&mut self.early.iter().flatten()), list(&mut self.late.iter())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_and_with_the_magic_of_exact_channels_a_link_returns_what_was_sent() {
        let times = [0.8, 0.5 + 0.1875 / 0.3];
        let link = Link { direction: 1, wall: 0, part: 0.5 };
        assert!(!Link::is_needed(0.5) && Link::is_needed(0.4) && !Link::is_needed(f64::NAN));
        let [b, h] = link.weights(times);
        assert!(b.abs() < 1e-15 && h.abs() < 1e-15, "{b} {h}");
    }
}
