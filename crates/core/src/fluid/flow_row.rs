//! The flow row by row, as fields show it, and exact sums over its cells that are the same bits on any ranks and instruction set.

use super::bodies::BlockSolids;
use super::kernel::{AHEAD, Bare, LINE, moments, put};
use super::observe::CellState;
use super::population::{Population, PopulationLanes};
use super::simd::{Choose, Lanes, Registers, Tally, Vectorised, prefetch, vectorise};
use super::solid::{CHUNK, SolidModel};
use super::solid_row::SolidRow;
use super::{Fluid, Real, Simd};
use crate::domain::Block;
use crate::lattice::Q;
use crate::math::{FIXED_MAGIC, to_fixed};
use std::ops::{Mul, Range};

/// Sums over cells, each weighted by the open part of its cell: 1, the velocity, its products (`xx`, `yy`, `zz`, `xy`, `xz`, `yz`),
/// the density deviation; fixed-point numbers of lattice units, as those of [`to_fixed`].
pub type FlowSums = [i64; FLOW_SUMS];
/// Number of the [`FlowSums`].
pub const FLOW_SUMS: usize = 11;

/// Velocity, density and solid fraction of the cells of a row, lattice units.
#[derive(Debug)]
pub struct FlowRow {
    corner: [usize; 3],
    cells: Range<usize>,
    simd: Simd,
    /// Of whole chunks; cells beside those of the row are solid.
    solid: Vec<f64>,
    velocity: [Vec<f64>; 3],
    deviation: Vec<f64>,
}

impl FlowRow {
    fn new(chunks: usize, cells: Range<usize>, simd: Simd) -> Self {
        let zeros = || vec![0.0; chunks * CHUNK];
        let velocity = std::array::from_fn(|_| zeros());
        Self { corner: [0; 3], cells, simd, solid: vec![1.0; chunks * CHUNK], velocity, deviation: zeros() }
    }

    /// The first cell of the row of the block, in the box.
    pub fn corner(&self) -> [usize; 3] {
        self.corner
    }

    /// The cells, in the box, and their state.
    pub fn each(&self) -> impl Iterator<Item = ([usize; 3], CellState)> {
        let [x0, y, z] = self.corner;
        self.cells.clone().map(move |x| {
            let state = CellState {
                density_deviation: self.deviation[x],
                velocity: std::array::from_fn(|a| self.velocity[a][x]),
                solid_fraction: self.solid[x],
            };
            ([x0 + x, y, z], state)
        })
    }

    /// The terms of one cell; the axes of its velocity may be turned.
    pub fn of_cell(state: &CellState) -> FlowSums {
        terms(1.0 - state.solid_fraction, state.velocity, state.density_deviation).map(to_fixed)
    }

    /// The sums over the row.
    pub fn sums(&self) -> FlowSums {
        let mut sums = [0; FLOW_SUMS];
        vectorise(self.simd, OverRow { row: self, sums: &mut sums });
        sums
    }

    /// Takes what lies beside the cells of the row out of all sums.
    fn close(&mut self, cells: Range<usize>) {
        self.solid[cells.clone()].fill(1.0);
        for values in self.velocity.iter_mut().chain([&mut self.deviation]) {
            values[cells.clone()].fill(0.0);
        }
    }

    /// Sets the state of a register of cells from their bare velocity and their solids, if there are some in the row.
    ///
    /// # Safety
    /// Called where the instructions of `V` may be used; all arrays have whole registers from `x` on.
    #[inline(always)]
    unsafe fn put_state<T: Real, V: Registers, M: SolidModel>(
        &mut self,
        x: usize,
        Bare { u, deviation }: &Bare<T>,
        (solids, model): (Option<&SolidRow<T>>, M),
        (t, half): (f64, [f64; 3]),
    ) {
        // SAFETY: promised by the caller.
        let widened = |values: &[T]| unsafe { T::widen::<V::D>(values.as_ptr().add(x)) };
        let [zero, one] = [0.0, 1.0].map(V::D::splat);
        let used = solids.filter(|solids| solids.is_used(x, V::D::WIDTH));
        let solid = used.map_or(zero, |solids| widened(&solids.fraction).min(one));
        let [drag, driven] = model.received(solid, t);
        // SAFETY: promised by the caller.
        unsafe {
            put(&mut self.solid, x, solid);
            put(&mut self.deviation, x, widened(deviation));
            for a in 0..3 {
                let (u, half) = (widened(&u[a]), V::D::splat(half[a]));
                let velocity = match used {
                    None => u + half,
                    Some(solids) => {
                        let of_solid = solid.if_greater(zero, widened(&solids.velocity[a]), zero);
                        u + (driven * half + drag * V::D::splat(0.5) * (of_solid - u))
                    }
                };
                put(&mut self.velocity[a], x, velocity);
            }
        }
    }

    /// The terms of a register of cells.
    ///
    /// # Safety
    /// Called where the instructions of `D` may be used; `x` is a multiple of its width, in the chunks of the row.
    #[inline(always)]
    unsafe fn terms<D: Tally>(&self, x: usize) -> [D; FLOW_SUMS] {
        debug_assert!(x + D::WIDTH <= self.solid.len());
        // SAFETY: all arrays are of whole chunks, of which registers are a part.
        let load = |values: &[f64]| unsafe { D::load(values.as_ptr().add(x)) };
        let [x, y, z] = &self.velocity;
        terms(D::splat(1.0) - load(&self.solid), [load(x), load(y), load(z)], load(&self.deviation))
    }
}

/// The terms of cells by their open part, velocity, and density deviation.
#[inline(always)]
fn terms<N: Copy + Mul<Output = N>>(open: N, u: [N; 3], deviation: N) -> [N; FLOW_SUMS] {
    let [x, y, z] = [open * u[0], open * u[1], open * u[2]];
    let [xx, yy, zz] = [x * u[0], y * u[1], z * u[2]];
    [open, x, y, z, xx, yy, zz, x * u[1], x * u[2], y * u[2], open * deviation]
}

/// Work of [`FlowRow::sums`].
struct OverRow<'a> {
    row: &'a FlowRow,
    sums: &'a mut FlowSums,
}

impl Vectorised for OverRow<'_> {
    #[inline(always)]
    fn run<V: Registers>(self) {
        let zero = V::D::splat(0.0);
        let mut sums = [zero; FLOW_SUMS];
        for x in (0..self.row.solid.len()).step_by(V::D::WIDTH) {
            // SAFETY: whole registers of the row.
            let terms = unsafe { self.row.terms::<V::D>(x) };
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum = sum.tally(term);
            }
        }
        let count = self.row.solid.len() as i64;
        for (sums, four) in self.sums.chunks_mut(4).zip(sums.chunks(4)) {
            let four = std::array::from_fn(|k| four.get(k).copied().unwrap_or(zero));
            for (sum, total) in sums.iter_mut().zip(V::D::totals(four)) {
                *sum = without_magic(total, count);
            }
        }
    }
}

/// The sum of `count` fixed-point numbers from the total of a [`Tally`].
fn without_magic(total: i64, count: i64) -> i64 {
    total.wrapping_sub(count.wrapping_mul(FIXED_MAGIC.to_bits() as i64))
}

/// Rows whose [`SumsAlongRows`] are right.
const MOST_ROWS: i64 = 1 << 20;

/// The sums of several rows, for each cell along them.
#[derive(Debug, Default)]
pub struct SumsAlongRows {
    tallies: [Vec<f64>; FLOW_SUMS],
    rows: i64,
}

impl SumsAlongRows {
    /// Adds a row, as long as the others; returns true if no more can be added before they are [taken](Self::take).
    pub fn add(&mut self, row: &FlowRow) -> bool {
        for tallies in &mut self.tallies {
            tallies.resize(row.solid.len(), 0.0);
        }
        self.rows += 1;
        vectorise(row.simd, AlongRow { row, tallies: &mut self.tallies });
        self.rows == MOST_ROWS
    }

    /// The sums of each cell along the rows, which start at zero again.
    pub fn take(&mut self) -> Vec<FlowSums> {
        let rows = std::mem::take(&mut self.rows);
        let sum = |k: usize, x: usize| without_magic(self.tallies[k][x].to_bits() as i64, rows);
        let sums = (0..self.tallies[0].len()).map(|x| std::array::from_fn(|k| sum(k, x))).collect();
        self.tallies.iter_mut().for_each(|tallies| tallies.fill(0.0));
        sums
    }
}

/// Work of [`SumsAlongRows::add`].
struct AlongRow<'a> {
    row: &'a FlowRow,
    tallies: &'a mut [Vec<f64>; FLOW_SUMS],
}

impl Vectorised for AlongRow<'_> {
    #[inline(always)]
    fn run<V: Registers>(self) {
        for x in (0..self.row.solid.len()).step_by(V::D::WIDTH) {
            // SAFETY: whole registers of the row, with as many tallies.
            unsafe {
                for (tallies, term) in self.tallies.iter_mut().zip(self.row.terms::<V::D>(x)) {
                    let tally = V::D::load(tallies.as_ptr().add(x)).tally(term);
                    put(tallies, x, tally);
                }
            }
        }
    }
}

/// Finds the flow in the rows of a block before they collide.
pub(super) struct RowReader {
    flow: FlowRow,
    /// Relaxation time less 1/2, and half the acceleration.
    half: (f64, [f64; 3]),
}

impl RowReader {
    /// Of these cells of the rows under the acceleration of the coming sweep.
    pub(super) fn new<S: Population>(fluid: &Fluid<S>, cells: Range<usize>, acceleration: [f64; 3]) -> Self {
        let flow = FlowRow::new(fluid.layout.chunks_per_row(), cells, fluid.params.simd);
        Self { flow, half: (fluid.relaxation_times[0] - 0.5, acceleration.map(|a| 0.5 * a)) }
    }

    /// The cells of whole chunks in which those of the rows are.
    fn whole(&self) -> Range<usize> {
        self.flow.cells.start / CHUNK * CHUNK..self.flow.cells.end.next_multiple_of(CHUNK)
    }

    /// The flow in the row at `y, z` of the block from what its populations are and its solids, if it has some.
    ///
    /// # Safety
    /// The function that this is inlined into is compiled for the instructions of `V`, and the processor has them.
    #[inline(always)]
    pub(super) unsafe fn read<S: Population, V: Registers, M: SolidModel>(
        &mut self,
        fluid: &Fluid<S>,
        [y, z]: [usize; 2],
        bare: &Bare<S::Number>,
        solids: (Option<&SolidRow<S::Number>>, M),
    ) -> &FlowRow {
        let (lo, whole) = (fluid.block.lo, self.whole());
        let Self { flow, half } = self;
        let xs = flow.cells.clone();
        flow.corner = [lo[0], lo[1] + y, lo[2] + z];
        for x in whole.clone().step_by(V::D::WIDTH) {
            // SAFETY: registers divide chunks, of which the arrays have whole ones, those of solids one more.
            unsafe { flow.put_state::<S::Number, V, M>(x, bare, solids, *half) };
        }
        flow.close(whole.start..xs.start);
        flow.close(xs.end..whole.end);
        fluid.walls.each_of_row([y, z], |x, motion| {
            if xs.contains(&x) {
                let centre = [x, y, z].map(|k| k as f64 + 0.5);
                let velocity = motion.at(std::array::from_fn(|a| lo[a] as f64 + centre[a]));
                (flow.solid[x], flow.deviation[x]) = (1.0, 0.0);
                (0..3).for_each(|a| flow.velocity[a][x] = velocity[a]);
            }
        });
        flow
    }
}

/// [`Fluid::each_row`].
///
/// # Safety
/// The function that this is inlined into is compiled for the instructions of `R` and `V`, and the processor has them.
#[inline(always)]
pub(super) unsafe fn visit_rows<S: Population, R: PopulationLanes<S>, V: Registers, M: SolidModel>(
    fluid: &Fluid<S>,
    cells: Block,
    acceleration: [f64; 3],
    solids: &BlockSolids<M>,
    visit: &mut dyn FnMut(&FlowRow),
) {
    let (layout, lo) = (&fluid.layout, fluid.block.lo);
    let [xs, ys, zs]: [Range<usize>; 3] = std::array::from_fn(|a| cells.lo[a] - lo[a]..cells.hi[a] - lo[a]);
    let mut reader = RowReader::new(fluid, xs, acceleration);
    let (whole, mut bare) = (reader.whole(), Bare::new(layout.chunks_per_row()));
    let mut solid = SolidRow::<S::Number>::new(layout.chunks_per_row());
    for (z, y) in zs.flat_map(|z| ys.clone().map(move |y| (z, y))) {
        let covered = solids.reach(y + layout.size[1] * z);
        if covered {
            solids.fill::<S::Number, V>(y + layout.size[1] * z, layout.size[0], &mut solid);
        }
        let indices = layout.slots(fluid.phase, layout.cell(0, y as isize, z as isize));
        let slots = indices.map(|index| fluid.populations[index..][..bare.deviation.len()].as_ptr());
        for x in whole.clone().step_by(R::WIDTH) {
            if x.is_multiple_of(LINE / size_of::<S>()) {
                for slot in slots {
                    prefetch(slot.wrapping_add(x).wrapping_byte_add(AHEAD));
                }
            }
            let mut g = [R::splat(S::Number::ONE); Q];
            for (g, slot) in g.iter_mut().zip(slots) {
                // SAFETY: registers divide chunks, and the slices above are of whole ones, as the arrays.
                *g = unsafe { R::load_scaled(slot.add(x)) };
            }
            // SAFETY: as above.
            unsafe { bare.put::<R>(x, &moments::<S, R>(&g)) };
        }
        let of_row = (covered.then_some(&solid), solids.model);
        // SAFETY: promised by the caller.
        visit(unsafe { reader.read::<S, V, M>(fluid, [y, z], &bare, of_row) });
        if covered {
            solid.clear();
        }
    }
}
