//! Interpolated bounce-back: links that meet the wall elsewhere than half-way, cell by cell.
//!
//! A link of cell `x` meets the wall at the part `q` of its way `-c_i`. What comes back is a combination of populations along the
//! link, all at `x`: what was sent, what left the other way, and what has just arrived from there, so no cell further away is needed.
//!
//! ```text
//! f_i(x) = f'_-i + B (f_-i - f'_i) + H (f'_i - f'_-i) + M
//! f_0(x) = f_0 - sum (B (f_-i - f'_i) + H (f'_i - f'_-i) + M - 6 w_i c_i . u_w)
//! s = 2 / (1 + 2 q + 2 g),    B = 1 - 2 q s,    H = 2 g s,    M = 6 s w_i c_i . u_w
//! g = max(0, 3/4 q^2 - magic) / (tau - 1/2),    magic = (tau - 1/2) (tau_odd - 1/2)
//! ```
//!
//! `g = 0` is the central linear interpolation CLI, and with `q = 1/2` half-way bounce-back. `g` puts walls of channels along the lattice
//! exactly there and damps what alternates from step to step. The second line keeps the mass of the cell. Derivation:
//! `docs/theory/fluid.md`.
//!
//! References: Ginzburg, Verhaeghe, d'Humieres (2008), Commun. Comput. Phys. 3, 427 (CLI, `q^2` from magic); Marson, Thorimbert, Chopard,
//! Ginzburg, Latt (2021), doi:10.1103/PhysRevE.103.053308 (families of such rules).

use super::WallMotion;
use crate::fluid::Real;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::fluid::solid::CHUNK;
use crate::lattice::{Q, opposite};

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
    /// Whether a wall at `part` of a link is not half-way; a surface that is not on it counts as half-way.
    pub(super) fn is_needed(part: f64) -> bool {
        (0.0..=1.0).contains(&part) && (part - 0.5).abs() > TOLERANCE
    }

    /// `B` and `H`; `s = 1 + B - H`.
    fn numbers(&self, [even, odd]: [f64; 2]) -> [f64; 2] {
        let (q, above_half) = (self.part, even - 0.5);
        let g = (0.75 * q * q / above_half - (odd - 0.5)).max(0.0);
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
    /// True if another one follows along x, with links that are applied together with these.
    fn continues(&self, next: &Self) -> bool {
        let ways =
            |cell: &Self| cell.links.iter().map(|link| (link.direction, link.wall)).collect::<Vec<_>>();
        self.slot + 1 == next.slot && self.completed == next.completed && ways(self) == ways(next)
    }

    /// Consecutive cells along x with links in the same directions to the same walls, at most [`CHUNK`].
    fn stretches(row: &[Self]) -> impl Iterator<Item = &[Self]> {
        row.chunk_by(Self::continues).flat_map(|cells| cells.chunks(CHUNK))
    }
}

/// Cells that are done together.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Slot of the first one.
    cell: usize,
    count: u32,
    /// Their links, and the first of their numbers.
    links: [u32; 2],
    numbers: u32,
}

/// All interpolated links of a block.
pub(super) struct Interpolated<T> {
    /// By the row whose sweep completes them; no row at all if there is none.
    early: Vec<Vec<Stretch>>,
    late: Vec<Stretch>,
    /// Direction and wall.
    links: Vec<(u8, u16)>,
    /// Of a stretch: `sum (M - 6 w_i c_i . u_w)` by cell; then `B`, `H`, `M` of each link, each by cell.
    numbers: Vec<T>,
    /// Distances from a cell to its `f_i` after streaming, by phase.
    slots: [[usize; Q]; 2],
    relaxation_times: [f64; 2],
}

/// Interpolated links as a device applies them.
#[derive(Default)]
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
        let (early, late, links, numbers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { early, late, links, numbers, slots, relaxation_times }
    }

    /// Adds cells of a row in ascending order, beside walls at rest.
    pub(super) fn add(&mut self, row: &[Cell]) {
        for cells in Cell::stretches(row) {
            let first = &cells[0];
            let begin = self.links.len() as u32;
            let stretch = Stretch {
                cell: first.slot,
                count: cells.len() as u32,
                links: [begin, begin + first.links.len() as u32],
                numbers: u32::try_from(self.numbers.len()).expect("links of one block"),
            };
            self.links.extend(first.links.iter().map(|link| (link.direction as u8, link.wall)));
            let still = || cells.iter().map(|_| T::ZERO);
            self.numbers.extend(still());
            for n in 0..first.links.len() {
                for k in 0..2 {
                    let number = |cell: &Cell| T::from_f64(cell.links[n].numbers(self.relaxation_times)[k]);
                    self.numbers.extend(cells.iter().map(number));
                }
                self.numbers.extend(still());
            }
            match first.completed {
                Some(row) => {
                    self.early.resize_with(self.early.len().max(row + 1), Vec::new);
                    self.early[row].push(stretch);
                }
                None => self.late.push(stretch),
            }
        }
    }

    /// Gives walls of which this is true their motion in the coming step; the block has its corner at `lo`.
    pub(super) fn set_motions(
        &mut self,
        layout: &Layout,
        lo: [usize; 3],
        motions: &[WallMotion],
        which: impl Fn(&WallMotion) -> bool,
    ) {
        for &Stretch { cell, count, links, numbers } in self.early.iter().flatten().chain(&self.late) {
            let links = &self.links[links[0] as usize..links[1] as usize];
            if !links.iter().any(|&(_, wall)| which(&motions[usize::from(wall)])) {
                continue;
            }
            let (at, n) = (layout.coordinates(cell), count as usize);
            let [x, y, z] = std::array::from_fn(|a| (lo[a] + at[a]) as isize);
            let (masses, numbers) = self.numbers[numbers as usize..].split_at_mut(n);
            masses.fill(T::ZERO);
            for (&(i, wall), numbers) in links.iter().zip(numbers.chunks_exact_mut(3 * n)) {
                for k in 0..n {
                    let pushed = motions[usize::from(wall)].correction::<T>([x + k as isize, y, z], i.into());
                    let more = (numbers[k] - numbers[n + k]) * pushed;
                    numbers[2 * n + k] = pushed + more;
                    masses[k] = masses[k] + more;
                }
            }
        }
    }

    /// Applies the links that the sweep of a row has completed, or those that wait for the halo exchange; `again` if they have
    /// been applied to this step before, as in the state that is saved: then the mass is right already.
    pub(super) fn apply<S: Population<Number = T>>(
        &self,
        row: Option<usize>,
        entered: AaPhase,
        populations: &mut [S],
        again: bool,
    ) {
        let stretches = row.map_or(Some(&self.late), |row| self.early.get(row));
        for stretch in stretches.into_iter().flatten() {
            self.apply_to(stretch, entered, populations, again);
        }
    }

    fn apply_to<S: Population<Number = T>>(
        &self,
        &Stretch { cell, count, links, numbers }: &Stretch,
        entered: AaPhase,
        populations: &mut [S],
        again: bool,
    ) {
        let ([now, before], n) = (self.phases(entered), count as usize);
        let (masses, mut numbers) = self.numbers[numbers as usize..].split_at(n);
        let mut gained = [T::ZERO; CHUNK];
        gained[..n].copy_from_slice(masses);
        for &(direction, _) in &self.links[links[0] as usize..links[1] as usize] {
            let (i, j) = (usize::from(direction), opposite(usize::from(direction)));
            let [to, arrived] = [now[i], now[j]].map(|slot| cell.wrapping_add(slot));
            let [sent, left] = [before[i], before[j]].map(|slot| cell.wrapping_add(slot));
            for k in 0..n {
                let (sent, left) = (populations[sent + k].read(), populations[left + k].read());
                let arrived = populations[arrived + k].read();
                let change = numbers[k] * (arrived - left) + numbers[n + k] * (left - sent);
                gained[k] = gained[k] + change;
                populations[to + k] = S::round(sent + (change + numbers[2 * n + k]));
            }
            numbers = &numbers[3 * n..];
        }
        if !again {
            for (rest, &gained) in populations[cell..cell + n].iter_mut().zip(&gained) {
                *rest = S::round(rest.read() - gained);
            }
        }
    }

    /// Distances to `f_i` after streaming, and to the `f'_-i` that was before it in the same cell, entering a phase.
    fn phases(&self, entered: AaPhase) -> [&[usize; Q]; 2] {
        [&self.slots[entered as usize], &self.slots[entered.next() as usize]]
    }

    /// Bounces what is there in the phase `Even` as if it had been sent, so that the state is one that follows from what cells sent.
    pub(super) fn begin<S: Population<Number = T>>(&self, populations: &mut [S]) {
        self.each(|_, [near, far], _, _| populations[far] = populations[near]);
        for row in (0..self.early.len()).map(Some).chain([None]) {
            self.apply(row, AaPhase::Even, populations, false);
        }
    }

    /// Calls `visit` for all links: slots of cell, `near` and `far`, direction, and wall.
    pub(super) fn each(&self, mut visit: impl FnMut(usize, [usize; 2], usize, u16)) {
        for stretch in self.early.iter().flatten().chain(&self.late) {
            let n = stretch.count as usize;
            let links = &self.links[stretch.links[0] as usize..stretch.links[1] as usize];
            for &(direction, wall) in links {
                let i = usize::from(direction);
                for k in 0..n {
                    let cell = stretch.cell + k;
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
                let (n, numbers) = (stretch.count as usize, &self.numbers[stretch.numbers as usize..]);
                let links = &self.links[stretch.links[0] as usize..stretch.links[1] as usize];
                for k in 0..n {
                    list.cells.push((stretch.cell + k) as u64);
                    list.directions.extend(links.iter().map(|&(direction, _)| u32::from(direction)));
                    list.first.push(list.directions.len() as u32);
                    list.numbers.extend((0..=3 * links.len()).map(|number| numbers[number * n + k]));
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
        let [b, h] = link.numbers(times);
        assert!(b.abs() < 1e-15 && h.abs() < 1e-15, "{b} {h}");
    }
}
