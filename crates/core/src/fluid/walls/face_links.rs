//! Faces of the box whose populations come from a neighbour: free slip, and outlets of a given pressure.
//!
//! A cell `y` beside such a face sends populations back not into itself, but into the cells `x` beside it, by what its own collision
//! has left. With `t` the part of `c_i` along the face, `x = y + t`, and `r` the direction `i` mirrored by the face:
//!
//! ```text
//! f_i(x) = f'_r(y)                              free slip: specular reflection
//! f_i(x) = f'_i(y) + 2 w_i (rho_w - rho(y))     outlet: what left a like cell beyond, of the density 2 rho_w - rho(y)
//! rho = 3/2 sum_(i > 0) f'_i - 3/4 (rho u)^2    without the population at rest, which interpolated links change later
//! rho_w = 1 + 3 p_w + (j - m') / c_s            m' = m + K (j - m); j = rho u along the normal, outwards; without reflection
//! ```
//!
//! The last line lets sound leave ([`Absorption`]); else `rho_w = 1 + 3 p_w`. The face lies half a cell beyond `y`; a flow that does not change along its normal, with a linear pressure, passes exactly. So a cell
//! writes all that comes back right after its own row is swept, also into ghosts, which the halo exchange takes to their owners
//! ([`halo`](crate::fluid::halo)). Derivation: `docs/theory/fluid.md`.
//!
//! References: Krüger et al. (2017), The Lattice Boltzmann Method, section 5.3.7 (free slip); Guo, Zheng, Shi (2002),
//! doi:10.1088/1009-1963/11/4/310 (extrapolation of what is not in equilibrium); Poinsot, Lele (1992),
//! doi:10.1016/0021-9991(92)90046-2, and Izquierdo, Fueyo (2008), doi:10.1103/PhysRevE.78.046707 (characteristic conditions).

mod means;

use super::Walls;
use super::find::{Back, Map};
use crate::domain::Face;
use crate::fluid::Real;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::fluid::simd::prefetch;
use crate::fluid::solid::CHUNK;
use crate::lattice::{C, Q, W};
pub(crate) use means::SavedMean;
use means::{read_mean, write_mean};

/// `1 / c_s`, the root of 3 (time steps per cell).
const INVERSE_SPEED_OF_SOUND: f64 = 1.732_050_807_568_877_2;

/// A population that a cell sends back.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FaceLink {
    /// Direction in which it arrives, and the one that the cell has sent it in.
    arrives: u8,
    sent: u8,
    /// From the cell to the one where it arrives.
    shift: isize,
}

/// Consecutive cells along x that send back along the same ways.
#[derive(Clone, Copy, Debug)]
struct Stretch<T> {
    /// Slot of the first one.
    cell: usize,
    count: usize,
    ways: [usize; 2],
    outlet: Option<Outlet<T>>,
}

#[derive(Clone, Copy, Debug)]
struct Outlet<T> {
    /// Density minus 1, now and without what the motion of its wall adds.
    excess: T,
    of_face: f64,
    wall: u16,
    /// None if sound is reflected.
    absorption: Option<Absorption<T>>,
}

/// The mean momentum `m` of cells at an outlet that lets sound leave: numbers of type `T` behind the populations, in the same memory, so that
/// hosts and devices have them with these.
#[derive(Clone, Copy, Debug)]
struct Absorption<T> {
    /// `K` (1 / time step).
    rate: T,
    /// 1 along the axis of the face, -1 against it.
    outwards: T,
    /// Face of the box.
    face: usize,
    /// Of the first cell, among all means of the block.
    first: usize,
}

/// Treatment of the mean momenta when outlets send back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Means {
    /// They begin as the momentum that is there.
    Begin,
    /// They follow it by a step.
    Follow,
    /// They are those of a saved state.
    Keep,
}

impl Means {
    /// Those of a sweep, or `again` of a saved state.
    pub(super) fn of(again: bool) -> Self {
        if again { Self::Keep } else { Self::Follow }
    }
}

/// All links of the faces of a block that other cells send back.
pub(super) struct FaceLinks<T> {
    /// Row by row.
    stretches: Vec<Stretch<T>>,
    /// First stretch of each row, and one past the last of all; no row at all if there is none.
    rows: Vec<u32>,
    ways: Vec<FaceLink>,
    /// Slot of the first mean, and their number.
    means: [usize; 2],
    /// Distances from a cell to its `f_i` after streaming, and to the `f'_i` that left it, by the phase entered.
    arrived: [[usize; Q]; 2],
    left: [[usize; Q]; 2],
}

/// All links of faces as a device applies them, by the phase entered.
pub(crate) struct FaceLinkList<T> {
    /// Slots that are copied by free slip, to and from.
    pub(crate) slips: [Vec<u64>; 2],
    /// Slots of cells at outlets, and the density there minus 1.
    pub(crate) cells: Vec<u64>,
    pub(crate) excess: Vec<T>,
    /// Rates `K`, 0 where sound is reflected; axes, and 1 or -1 outwards; slots of the mean momenta.
    pub(crate) rates: Vec<T>,
    pub(crate) axes: Vec<u32>,
    pub(crate) outwards: Vec<T>,
    pub(crate) means: Vec<u64>,
    /// First way of each cell, and one past the last of all; slots from and to, and `2 w_i`.
    pub(crate) first: Vec<u32>,
    pub(crate) from: Vec<u64>,
    pub(crate) to: Vec<u64>,
    pub(crate) weights: Vec<T>,
}

impl<T: Real> FaceLinks<T> {
    pub(super) fn new(layout: &Layout) -> Self {
        let phases = [AaPhase::Even, AaPhase::Odd];
        Self {
            stretches: Vec::new(),
            rows: Vec::new(),
            ways: Vec::new(),
            means: [layout.len(), 0],
            arrived: phases.map(|phase| layout.slots_from(phase)),
            left: phases.map(|phase| std::array::from_fn(|i| layout.left(phase, i))),
        }
    }

    /// Finds the cells beside faces of the block; `wrap_x` if it is its own neighbour in x.
    pub(super) fn find(&mut self, layout: &Layout, map: &Map, faces: &[Face; 6], wrap_x: bool) {
        let [nx, ny, nz] = layout.size.map(|n| n as isize);
        let mut rows: Vec<Vec<Stretch<T>>> = Vec::new();
        for (n, &face) in
            faces.iter().enumerate().filter(|(n, face)| face.sends_to_neighbours() && map.is_at(*n))
        {
            rows.resize_with((ny * nz) as usize, Vec::new);
            let outwards = T::from_f64(if n.is_multiple_of(2) { -1.0 } else { 1.0 });
            let mut beside = [0..nx, 0..ny, 0..nz];
            let (axis, size) = (n / 2, layout.size[n / 2] as isize);
            beside[axis] = if n.is_multiple_of(2) { 0..1 } else { size - 1..size };
            let [xs, ys, zs] = beside;
            for (z, y) in zs.flat_map(|z| ys.clone().map(move |y| (z, y))) {
                let cells = xs.clone().map(|x| (x, ways(layout, map, [x, y, z], n, wrap_x)));
                let cells: Vec<_> = cells.filter(|(_, ways)| !ways.is_empty()).collect();
                for same in cells.chunk_by(|a, b| a.0 + 1 == b.0 && a.1 == b.1) {
                    for same in same.chunks(CHUNK) {
                        let first = self.ways.len().saturating_sub(same[0].1.len());
                        let first = if self.ways[first..] == same[0].1 { first } else { self.ways.len() };
                        self.ways.truncate(first);
                        self.ways.extend(&same[0].1);
                        let first_mean = self.means[1];
                        let outlet = if let Face::Outlet { excess, relaxation, .. } = face {
                            let absorption = relaxation.map(|rate| {
                                let rate = T::from_f64(rate);
                                Absorption { rate, outwards, face: n, first: first_mean }
                            });
                            self.means[1] += if absorption.is_some() { same.len() } else { 0 };
                            let (wall, of_face) = (map.faces[n], excess);
                            Some(Outlet { excess: T::from_f64(excess), of_face, wall, absorption })
                        } else {
                            None
                        };
                        rows[(z * ny + y) as usize].push(Stretch {
                            cell: layout.cell(same[0].0, y, z),
                            count: same.len(),
                            ways: [first, self.ways.len()],
                            outlet,
                        });
                    }
                }
            }
        }
        // One after the other, as they are read.
        for row in &rows {
            self.rows.push(self.stretches.len() as u32);
            self.stretches.extend(row);
        }
        if !rows.is_empty() {
            self.rows.push(self.stretches.len() as u32);
        }
    }

    /// Gives outlets their densities in the coming step, from what the motion of their wall adds.
    pub(super) fn set_pressures(&mut self, added: impl Fn(u16) -> f64) {
        for outlet in self.stretches.iter_mut().filter_map(|stretch| stretch.outlet.as_mut()) {
            outlet.excess = T::from_f64(outlet.of_face + added(outlet.wall));
        }
    }

    /// Numbers of type `S` behind the populations of a block.
    pub(super) fn tail<S: Population<Number = T>>(&self) -> usize {
        self.means[1] * (size_of::<T>() / size_of::<S>())
    }

    /// Sends back what the cells of a row, the last one swept, have sent.
    #[inline(always)]
    pub(super) fn apply<S: Population<Number = T>>(
        &self,
        row: usize,
        entered: AaPhase,
        populations: &mut [S],
        means: Means,
    ) {
        let Some(&[first, end]) = self.rows.get(row..row + 2) else { return };
        // Those of the row that is probably the next: the sweep has driven them out of the cache.
        let next = self.stretches.as_ptr().wrapping_add(end as usize);
        (0..size_of::<Stretch<T>>()).step_by(64).for_each(|byte| prefetch(next.wrapping_byte_add(byte)));
        for stretch in &self.stretches[first as usize..end as usize] {
            // Rows that end at the face have one cell each.
            if stretch.count == 1 {
                self.apply_to::<S, 1>(stretch, entered, populations, means);
            } else {
                self.apply_to::<S, CHUNK>(stretch, entered, populations, means);
            }
        }
    }

    /// For a stretch of at most `MOST` cells; of `MOST` if that is 1.
    #[inline(always)]
    fn apply_to<S: Population<Number = T>, const MOST: usize>(
        &self,
        stretch: &Stretch<T>,
        entered: AaPhase,
        populations: &mut [S],
        means: Means,
    ) {
        let Stretch { cell, count, ways: [first, end], outlet } = *stretch;
        let count = if MOST == 1 { 1 } else { count };
        let (arrived, left) = (&self.arrived[entered as usize], &self.left[entered as usize]);
        let c = |x: f64| T::from_f64(x);
        let mut more = [T::ZERO; MOST];
        if let Some(Outlet { excess, absorption, .. }) = outlet {
            let (mut sum, mut momentum) = ([T::ZERO; MOST], [[T::ZERO; MOST]; 3]);
            for (i, left) in left.iter().enumerate().skip(1) {
                let from = &populations[cell.wrapping_add(*left)..][..count];
                for (k, g) in from.iter().enumerate() {
                    let g = g.read();
                    sum[k] = sum[k] + g;
                    for (momentum, along) in momentum.iter_mut().zip(C[i]) {
                        momentum[k] = momentum[k] + c(along as f64) * g;
                    }
                }
            }
            for (k, more) in more.iter_mut().enumerate().take(count) {
                let [x, y, z] = momentum.map(|of| of[k]);
                let square = (x * x + y * y) + z * z;
                let wanted = match absorption {
                    None => excess,
                    Some(Absorption { rate, outwards, face, first }) => {
                        let (now, slot) = (outwards * momentum[face / 2][k], self.mean_slot::<S>(first + k));
                        let before = read_mean(populations, slot);
                        let mean = match means {
                            Means::Begin => now,
                            Means::Follow => before + rate * (now - before),
                            Means::Keep => before,
                        };
                        write_mean(populations, slot, mean);
                        excess + c(INVERSE_SPEED_OF_SOUND) * (now - mean)
                    }
                };
                *more = wanted - (c(1.5) * sum[k] - c(0.75) * square);
            }
        }
        for way in &self.ways[first..end] {
            let (i, sent) = (usize::from(way.arrives), usize::from(way.sent));
            let from = cell.wrapping_add(left[sent]);
            let to = cell.wrapping_add_signed(way.shift).wrapping_add(arrived[i]);
            if outlet.is_none() {
                populations.copy_within(from..from + count, to);
                continue;
            }
            let weight = c(2.0 * W[i]);
            for (k, more) in more.iter().enumerate().take(count) {
                populations[to + k] = S::round(populations[from + k].read() + weight * *more);
            }
        }
    }

    /// Sets what cells have sent so that what is there in the phase `Even` came back from it, by free slip; what outlets send back follows
    /// from what is there.
    pub(super) fn begin<S: Population<Number = T>>(&self, populations: &mut [S]) {
        let all = || self.stretches.iter();
        for stretch in all().filter(|stretch| stretch.outlet.is_none()) {
            for way in &self.ways[stretch.ways[0]..stretch.ways[1]] {
                let from = stretch.cell.wrapping_add(self.left[0][usize::from(way.sent)]);
                let to = stretch.cell.wrapping_add_signed(way.shift);
                let to = to.wrapping_add(self.arrived[0][usize::from(way.arrives)]);
                populations.copy_within(to..to + stretch.count, from);
            }
        }
        for stretch in all().filter(|stretch| stretch.outlet.is_some()) {
            self.apply_to::<S, CHUNK>(stretch, AaPhase::Even, populations, Means::Begin);
        }
    }

    /// Slot of a mean of the block.
    #[inline(always)]
    fn mean_slot<S: Population<Number = T>>(&self, number: usize) -> usize {
        self.means[0] + number * (size_of::<T>() / size_of::<S>())
    }

    /// Calls `visit(face, cell, slot)` for each mean of the block.
    fn each_mean<S: Population<Number = T>>(&self, mut visit: impl FnMut(usize, usize, usize)) {
        for stretch in &self.stretches {
            let absorption = stretch.outlet.and_then(|outlet| outlet.absorption);
            if let Some(Absorption { face, first, .. }) = absorption {
                (0..stretch.count)
                    .for_each(|k| visit(face, stretch.cell + k, self.mean_slot::<S>(first + k)));
            }
        }
    }

    /// As a device does it.
    fn list<S: Population<Number = T>>(&self, entered: AaPhase) -> FaceLinkList<T> {
        let mut list = FaceLinkList {
            slips: Default::default(),
            cells: Vec::new(),
            excess: Vec::new(),
            rates: Vec::new(),
            axes: Vec::new(),
            outwards: Vec::new(),
            means: Vec::new(),
            first: vec![0],
            from: Vec::new(),
            to: Vec::new(),
            weights: Vec::new(),
        };
        let (arrived, left) = (&self.arrived[entered as usize], &self.left[entered as usize]);
        for stretch in &self.stretches {
            for k in 0..stretch.count {
                let cell = stretch.cell + k;
                for way in &self.ways[stretch.ways[0]..stretch.ways[1]] {
                    let (i, sent) = (usize::from(way.arrives), usize::from(way.sent));
                    let from = cell.wrapping_add(left[sent]) as u64;
                    let to = cell.wrapping_add_signed(way.shift).wrapping_add(arrived[i]) as u64;
                    if stretch.outlet.is_some() {
                        list.from.push(from);
                        list.to.push(to);
                        list.weights.push(T::from_f64(2.0 * W[i]));
                    } else {
                        list.slips[0].push(to);
                        list.slips[1].push(from);
                    }
                }
                if let Some(Outlet { excess, absorption, .. }) = stretch.outlet {
                    list.cells.push(cell as u64);
                    list.excess.push(excess);
                    let absorbs = absorption.unwrap_or(Absorption {
                        rate: T::ZERO,
                        outwards: T::ZERO,
                        face: 0,
                        first: 0,
                    });
                    list.rates.push(absorbs.rate);
                    list.axes.push(absorbs.face as u32 / 2);
                    list.outwards.push(absorbs.outwards);
                    list.means.push(self.mean_slot::<S>(absorbs.first + k) as u64);
                    list.first.push(list.from.len() as u32);
                }
            }
        }
        list
    }
}

impl<S: Population> Walls<S> {
    /// All links of faces as a device applies them on entering a phase, and distances from a cell to what has left it.
    pub(crate) fn face_links(&self, entered: AaPhase) -> (FaceLinkList<S::Number>, &[usize; Q]) {
        (self.face_links.list::<S>(entered), &self.face_links.left[entered as usize])
    }

    /// Densities of the outlets in the coming step, in the order of [`FaceLinkList::excess`].
    pub(crate) fn outlet_densities(&self) -> Vec<S::Number> {
        let stretches = self.face_links.stretches.iter();
        stretches
            .flat_map(|of| std::iter::repeat_n(of.outlet, of.count))
            .flatten()
            .map(|of| of.excess)
            .collect()
    }

    /// Numbers behind the populations of the block that belong to its outlets.
    pub(crate) fn tail(&self) -> usize {
        self.face_links.tail::<S>()
    }
}

/// The ways along which a cell of the block sends populations back from a face.
fn ways(layout: &Layout, map: &Map, cell: [isize; 3], face: usize, wrap_x: bool) -> Vec<FaceLink> {
    let inwards = if face.is_multiple_of(2) { 1 } else { -1 };
    let nx = layout.size[0] as isize;
    let mut ways = Vec::new();
    for i in (1..Q).filter(|&i| C[i][face / 2] == inwards) {
        let along: [isize; 3] = std::array::from_fn(|a| if a == face / 2 { 0 } else { C[i][a] });
        // Beside another such face a population may come back into the cell itself.
        let places = [along, [0; 3]];
        for place in &places[..if along == [0; 3] { 1 } else { 2 }] {
            let at: [isize; 3] = std::array::from_fn(|a| cell[a] + place[a]);
            let Some(Back::Neighbour { face: by, source, sent }) = map.back(at, i) else { continue };
            if by == face && source == cell {
                let wrapped = if wrap_x && at[0] < 0 {
                    nx
                } else if wrap_x && at[0] >= nx {
                    -nx
                } else {
                    0
                };
                let shift = layout.cell(at[0], at[1], at[2]) as isize + wrapped;
                let shift = shift - layout.cell(cell[0], cell[1], cell[2]) as isize;
                ways.push(FaceLink { arrives: i as u8, sent: sent as u8, shift });
            }
        }
    }
    ways
}

#[cfg(test)]
mod sound_tests;
#[cfg(test)]
mod tests;
