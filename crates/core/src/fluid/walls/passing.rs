//! Faces of the box that pass on populations: free slip, and outlets of a given pressure.
//!
//! A cell `y` beside such a face sends populations back not into itself, but into the cells `x` beside it, by what its own collision
//! has left. With `t` the part of `c_i` along the face, `x = y + t`, and `r` the direction `i` mirrored by the face:
//!
//! ```text
//! f_i(x) = f'_r(y)                              free slip: specular reflection
//! f_i(x) = f'_i(y) + 2 w_i (rho_w - rho(y))     outlet: what left a like cell beyond, of the density 2 rho_w - rho(y)
//! rho = 3/2 sum_(i > 0) f'_i - 3/4 (rho u)^2    without the population at rest, which interpolated links change later
//! ```
//!
//! The face lies half a cell beyond `y`; a flow that does not change along its normal, with a linear pressure, passes exactly. So a cell
//! writes all that comes back right after its own row is swept, also into ghosts, which the halo exchange takes to their owners
//! ([`halo`](crate::fluid::halo)). Derivation: `docs/theory/fluid.md`.
//!
//! References: Krüger et al. (2017), The Lattice Boltzmann Method, section 5.3.7 (free slip); Guo, Zheng, Shi (2002),
//! doi:10.1088/1009-1963/11/4/310 (extrapolation of what is not in equilibrium).

use super::Walls;
use super::find::{Back, Map};
use crate::domain::Face;
use crate::fluid::Real;
use crate::fluid::layout::{AaPhase, Layout};
use crate::fluid::population::Population;
use crate::fluid::solid::CHUNK;
use crate::lattice::{C, Q, W};

/// A population that a cell sends back.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Way {
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
    /// Of an outlet its density minus 1.
    excess: Option<T>,
}

/// All that the faces of a block pass on.
pub(super) struct Passing<T> {
    /// By row; no row at all if there is none.
    rows: Vec<Vec<Stretch<T>>>,
    ways: Vec<Way>,
    /// Distances from a cell to its `f_i` after streaming, and to the `f'_i` that left it, by the phase entered.
    arrived: [[usize; Q]; 2],
    left: [[usize; Q]; 2],
}

/// All that cells pass on, as a device does it, by the phase entered.
pub(crate) struct PassList<T> {
    /// Slots that are copied by free slip, to and from.
    pub(crate) slips: [Vec<u64>; 2],
    /// Slots of cells at outlets, and the density there minus 1.
    pub(crate) cells: Vec<u64>,
    pub(crate) excess: Vec<T>,
    /// First way of each cell, and one past the last of all; slots from and to, and `2 w_i`.
    pub(crate) first: Vec<u32>,
    pub(crate) from: Vec<u64>,
    pub(crate) to: Vec<u64>,
    pub(crate) weights: Vec<T>,
}

impl<T: Real> Passing<T> {
    pub(super) fn new(layout: &Layout) -> Self {
        let phases = [AaPhase::Even, AaPhase::Odd];
        Self {
            rows: Vec::new(),
            ways: Vec::new(),
            arrived: phases.map(|phase| layout.slots_from(phase)),
            left: phases.map(|phase| std::array::from_fn(|i| layout.left(phase, i))),
        }
    }

    /// Finds the cells beside faces of the block; `wrap_x` if it is its own neighbour in x.
    pub(super) fn find(&mut self, layout: &Layout, map: &Map, faces: [Face; 6], wrap_x: bool) {
        let [nx, ny, nz] = layout.size.map(|n| n as isize);
        for (n, face) in faces.into_iter().enumerate().filter(|(n, face)| face.passes() && map.is_at(*n)) {
            self.rows.resize_with((ny * nz) as usize, Vec::new);
            let excess = if let Face::Outlet { excess } = face { Some(T::from_f64(excess)) } else { None };
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
                        self.rows[(z * ny + y) as usize].push(Stretch {
                            cell: layout.cell(same[0].0, y, z),
                            count: same.len(),
                            ways: [first, self.ways.len()],
                            excess,
                        });
                    }
                }
            }
        }
    }

    /// Passes on what the cells of a row, the last one swept, have sent.
    #[inline(always)]
    pub(super) fn apply<S: Population<Number = T>>(
        &self,
        row: usize,
        entered: AaPhase,
        populations: &mut [S],
    ) {
        for stretch in self.rows.get(row).into_iter().flatten() {
            self.apply_to(stretch, entered, populations);
        }
    }

    #[inline(always)]
    fn apply_to<S: Population<Number = T>>(
        &self,
        stretch: &Stretch<T>,
        entered: AaPhase,
        populations: &mut [S],
    ) {
        let Stretch { cell, count, ways: [first, end], excess } = *stretch;
        let (arrived, left) = (&self.arrived[entered as usize], &self.left[entered as usize]);
        let c = |x: f64| T::from_f64(x);
        let mut more = [T::ZERO; CHUNK];
        if let Some(excess) = excess {
            let (mut sum, mut momentum) = ([T::ZERO; CHUNK], [[T::ZERO; CHUNK]; 3]);
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
                *more = excess - (c(1.5) * sum[k] - c(0.75) * square);
            }
        }
        for way in &self.ways[first..end] {
            let (i, sent) = (usize::from(way.arrives), usize::from(way.sent));
            let from = cell.wrapping_add(left[sent]);
            let to = cell.wrapping_add_signed(way.shift).wrapping_add(arrived[i]);
            if excess.is_none() {
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
    /// from what is there. `outwards` has pairs of slots `(x, i)` and `(w, -i)` of all links that faces pass on.
    pub(super) fn begin<S: Population<Number = T>>(
        &self,
        populations: &mut [S],
        outwards: impl Iterator<Item = [usize; 2]>,
    ) {
        for [here, beyond] in outwards {
            populations[beyond] = populations[here];
        }
        let all = || self.rows.iter().flatten();
        for stretch in all().filter(|stretch| stretch.excess.is_none()) {
            for way in &self.ways[stretch.ways[0]..stretch.ways[1]] {
                let from = stretch.cell.wrapping_add(self.left[0][usize::from(way.sent)]);
                let to = stretch.cell.wrapping_add_signed(way.shift);
                let to = to.wrapping_add(self.arrived[0][usize::from(way.arrives)]);
                populations.copy_within(to..to + stretch.count, from);
            }
        }
        for stretch in all().filter(|stretch| stretch.excess.is_some()) {
            self.apply_to(stretch, AaPhase::Even, populations);
        }
    }

    /// As a device does it.
    fn list(&self, entered: AaPhase) -> PassList<T> {
        let mut list = PassList {
            slips: Default::default(),
            cells: Vec::new(),
            excess: Vec::new(),
            first: vec![0],
            from: Vec::new(),
            to: Vec::new(),
            weights: Vec::new(),
        };
        let (arrived, left) = (&self.arrived[entered as usize], &self.left[entered as usize]);
        for stretch in self.rows.iter().flatten() {
            for cell in stretch.cell..stretch.cell + stretch.count {
                for way in &self.ways[stretch.ways[0]..stretch.ways[1]] {
                    let (i, sent) = (usize::from(way.arrives), usize::from(way.sent));
                    let from = cell.wrapping_add(left[sent]) as u64;
                    let to = cell.wrapping_add_signed(way.shift).wrapping_add(arrived[i]) as u64;
                    if stretch.excess.is_some() {
                        list.from.push(from);
                        list.to.push(to);
                        list.weights.push(T::from_f64(2.0 * W[i]));
                    } else {
                        list.slips[0].push(to);
                        list.slips[1].push(from);
                    }
                }
                if let Some(excess) = stretch.excess {
                    list.cells.push(cell as u64);
                    list.excess.push(excess);
                    list.first.push(list.from.len() as u32);
                }
            }
        }
        list
    }
}

impl<S: Population> Walls<S> {
    /// All that faces pass on, as a device does it on entering a phase, and distances from a cell to what has left it.
    pub(crate) fn passed(&self, entered: AaPhase) -> (PassList<S::Number>, &[usize; Q]) {
        (self.passing.list(entered), &self.passing.left[entered as usize])
    }
}

/// The ways along which a cell of the block sends populations back from a face.
fn ways(layout: &Layout, map: &Map, cell: [isize; 3], face: usize, wrap_x: bool) -> Vec<Way> {
    let inwards = if face.is_multiple_of(2) { 1 } else { -1 };
    let nx = layout.size[0] as isize;
    let mut ways = Vec::new();
    for i in (1..Q).filter(|&i| C[i][face / 2] == inwards) {
        let along: [isize; 3] = std::array::from_fn(|a| if a == face / 2 { 0 } else { C[i][a] });
        // Beside another face that passes on, a population may come back into the cell itself.
        let places = [along, [0; 3]];
        for place in &places[..if along == [0; 3] { 1 } else { 2 }] {
            let at: [isize; 3] = std::array::from_fn(|a| cell[a] + place[a]);
            let Some(Back::Passed { face: by, source, sent }) = map.back(at, i) else { continue };
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
                ways.push(Way { arrives: i as u8, sent: sent as u8, shift });
            }
        }
    }
    ways
}
