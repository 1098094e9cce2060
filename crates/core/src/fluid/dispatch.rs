//! Sweeps over a block, compiled once per precision and instruction set, chosen at run time.

use super::bodies::BlockSolids;
use super::flow_row::{RowReader, visit_rows};
use super::kernel::{Bare, Measured, Operator, RelaxationFactors, Row, Slots, sweep_row};
use super::layout::{AaPhase, Layout};
use super::measure::measure_block;
use super::population::{F16, Population, PopulationLanes};
use super::regularised::eddy_factor;
use super::simd::{Choose, Lanes, Registers, Single, Tally};
use super::solid::{CHUNK, SolidModel};
use super::solid_row::SolidRow;
use super::walls::{WallRow, Walls};
use super::{Flow, FlowRow, Fluid, SPEED_LIMIT, Simd, Stresslet};
use crate::domain::Block;
use crate::lattice::{C, Q};
use crate::math::to_fixed;
use bytemuck::Pod;

/// Number type of the kernels: `f32` or `f64`.
pub trait Real: Pod + Send + Sync + PartialOrd + From<f32> + Into<f64> + Lanes<Self> {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 0, 1, 2, ...
    const LANE: [Self; CHUNK];
    /// Rounds.
    fn from_f64(x: f64) -> Self;
    #[doc(hidden)]
    /// Registers of this type.
    type In<V: Registers>: Choose<Self>;
    #[doc(hidden)]
    /// # Safety
    /// As many numbers as a register of this type holds can be read at `p`.
    unsafe fn load_f32<V: Registers>(p: *const f32) -> Self::In<V>;
    #[doc(hidden)]
    /// # Safety
    /// As many numbers as a register holds can be read at `p`.
    unsafe fn widen<D: Tally>(p: *const Self) -> D;
}

/// A sweep of a part of the rows of a block.
#[doc(hidden)]
pub struct Sweep<'a, 'b, S: Population, M> {
    pub(super) fluid: &'a mut Fluid<S>,
    /// The rows next to other ranks in y and z, or the others.
    pub(super) first: bool,
    pub(super) acceleration: [f64; 3],
    pub(super) solids: &'a mut BlockSolids<'b, M>,
    /// Gets measurements before the collisions.
    pub(super) flow: Option<&'a mut Flow>,
    /// Gets the rows before the collisions, but those wholly in walls.
    pub(super) rows: Option<&'a mut dyn FnMut(&FlowRow)>,
}

/// [`BlockSolids::fill`], [`BlockSolids::collect`], [`Walls::bounce_row`] and [`RowReader::read`], compiled for an instruction set and apart from the
/// sweep, so that they do not compete for registers.
type RowFunctions<'a, S, T, M> = (
    unsafe fn(&BlockSolids<'a, M>, usize, usize, &mut SolidRow<T>),
    unsafe fn(&mut BlockSolids<'a, M>, &SolidRow<T>),
    unsafe fn(&Walls<S>, AaPhase, &mut [S], [usize; 2]),
    unsafe fn(&mut RowReader, &Fluid<S>, [usize; 2], M, bool, &mut dyn FnMut(&FlowRow)),
);

/// Sweeps a part of the rows of a block; meanwhile messages move on.
///
/// # Safety
/// The function that this is inlined into is compiled for the instructions of `R`, and the processor has those and the ones
/// that the row functions are compiled for.
#[inline(always)]
unsafe fn sweep_block<
    'b,
    S: Population,
    R: PopulationLanes<S>,
    M: SolidModel,
    O: Operator,
    const WALLS: bool,
>(
    sweep: Sweep<'_, 'b, S, M>,
    (fill, collect, bounce, read): RowFunctions<'b, S, S::Number, M>,
) {
    let Sweep { fluid, first, acceleration, solids, mut flow, rows } = sweep;
    let mut rows = rows.map(|visit| (RowReader::new(fluid, 0..fluid.layout.size[0], acceleration), visit));
    fluid.measured.bare = rows.is_some().then(|| Bare::new(fluid.layout.chunks_per_row()));
    let [nx, ny, nz] = fluid.layout.size;
    let (layout, order, lo) = (fluid.layout.clone(), fluid.order, fluid.block.lo);
    let base = fluid.populations.root();
    let (row, model) = (row_of(fluid, acceleration), solids.model);
    let (from_first, wrap) = (layout.slots_from(fluid.phase), WrapX::new(&layout, fluid.phase));
    for z in 0..nz {
        fluid.halo.progress();
        for y in 0..ny {
            if order.is_first([y, z]) != first {
                continue;
            }
            let walls = if WALLS { fluid.walls.row(y, z) } else { None };
            if walls.is_some_and(WallRow::is_dead) {
                // Only links of its neighbours end in it.
                let (populations, entered) = (&mut fluid.populations, fluid.phase.next());
                // SAFETY: promised by the caller.
                unsafe { bounce(&fluid.walls, entered, populations, [y, z]) };
                if !fluid.wrap_x {
                    fluid.walls.bounce_row_ends(&layout, entered, populations, y, z);
                }
                continue;
            }
            let covered = solids.reach(y + ny * z);
            if covered {
                // SAFETY: promised by the caller.
                unsafe { fill(solids, y + ny * z, nx, &mut fluid.solid_row) };
            }
            if let Some(walls) = walls {
                walls.each(|cells| fluid.solid_row.clear_fractions(cells));
            }
            let cell = layout.cell(0, y as isize, z as isize);
            let mut slots: Slots<S> = [base; Q];
            for (slot, from_first) in slots.iter_mut().zip(from_first) {
                // SAFETY: slots of real cells are inside the buffer (tested in `layout`).
                *slot = unsafe { base.add(cell.wrapping_add(from_first)) };
            }
            let (solid, measured) = (&mut fluid.solid_row, &mut fluid.measured);
            let dead = walls.map_or(&[][..], |walls| &walls.dead);
            // SAFETY: every slot of a row of whole chunks is inside the buffer and belongs to one cell only (tested in
            // `layout`), so the ranges can be written and do not overlap.
            unsafe {
                if flow.is_some() || rows.is_some() {
                    sweep_row::<S, R, M, O, true>(&slots, &row, model, dead, solid, measured);
                } else {
                    sweep_row::<S, R, M, O, false>(&slots, &row, model, dead, solid, measured);
                }
            }
            if let Some(walls) = walls {
                walls.clear(&layout, fluid.phase, cell, &mut fluid.populations);
                walls.each(|cells| solid.clear_exchanged(cells));
                if flow.is_some() {
                    walls.each(|cells| measured.clear(cells));
                }
            }
            if let Some(flow) = flow.as_deref_mut() {
                observe_row(measured, nx, [lo[0], lo[1] + y, lo[2] + z], flow);
                flow.solid += i128::from(solid.fraction_total());
            }
            if let Some((reader, visit)) = &mut rows {
                // SAFETY: promised by the caller.
                unsafe { read(reader, fluid, [y, z], model, covered, *visit) };
            }
            if covered {
                // SAFETY: promised by the caller.
                unsafe { collect(solids, &fluid.solid_row) };
                fluid.solid_row.clear();
            }
            let (populations, entered) = (&mut fluid.populations, fluid.phase.next());
            if WALLS {
                // SAFETY: promised by the caller.
                unsafe { bounce(&fluid.walls, entered, populations, [y, z]) };
            }
            if fluid.wrap_x {
                wrap.row(populations, cell, [y as isize, z as isize]);
            } else if WALLS {
                fluid.walls.bounce_row_ends(&layout, entered, populations, y, z);
            }
        }
    }
}

/// Parameters of all rows of a block.
pub(super) fn row_of<S: Population>(fluid: &Fluid<S>, acceleration: [f64; 3]) -> Row<S::Number> {
    let [even, odd, x, y, z, above_half, relaxation_time, eddies] = parameters_of(fluid, acceleration);
    Row {
        chunks: fluid.layout.chunks_per_row(),
        factors: RelaxationFactors { even, odd },
        acceleration: [x, y, z],
        above_half,
        relaxation_time,
        eddies,
    }
}

/// Factors of the relaxation of the even and the odd part, the acceleration, `tau - 1/2`, `tau`, and the factor of eddies.
pub(super) fn parameters_of<S: Population, T: Real>(fluid: &Fluid<S>, [x, y, z]: [f64; 3]) -> [T; 8] {
    let ([even, odd], eddies) = (fluid.relaxation_times, eddy_factor(fluid.params.collision.smagorinsky()));
    [1.0 - 1.0 / even, 1.0 - 1.0 / odd, x, y, z, even - 0.5, even, eddies].map(T::from_f64)
}

/// Adds the first `nx` cells of a measured row, which begins at cell `at` of the box.
#[inline(always)]
pub(super) fn observe_row<T: Real>(measured: &Measured<T>, nx: usize, at: [usize; 3], flow: &mut Flow) {
    let [px, py, pz] = &measured.momentum;
    let (mut total, mut square, mut most, mut good) = ([0_i64; 3], 0_i64, 0.0_f64, true);
    for ((&px, &py), &pz) in px[..nx].iter().zip(&py[..nx]).zip(&pz[..nx]) {
        let p: [f64; 3] = [px.into(), py.into(), pz.into()];
        let pp = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        for axis in 0..3 {
            total[axis] = total[axis].wrapping_add(to_fixed(p[axis]));
        }
        square = square.wrapping_add(to_fixed(pp));
        most = if pp > most { pp } else { most };
        good &= pp < SPEED_LIMIT * SPEED_LIMIT;
    }
    for axis in 0..3 {
        flow.momentum[axis] += i128::from(total[axis]);
    }
    flow.square += i128::from(square);
    flow.max_speed = flow.max_speed.max(most.sqrt());
    // The first in the order of the box, in whatever order rows come.
    let key = |cell: [usize; 3]| [cell[2], cell[1], cell[0]];
    if !good && flow.fault.is_none_or(|(cell, _)| key(at) < key(cell)) {
        let speed = |x: usize| -> f64 {
            let p: [f64; 3] = [px[x].into(), py[x].into(), pz[x].into()];
            (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt()
        };
        flow.fault = (0..nx)
            .find(|&x| speed(x) >= SPEED_LIMIT || speed(x).is_nan())
            .map(|x| ([at[0] + x, at[1], at[2]], speed(x)));
    }
}

/// Periodicity along x within the block, for a row just swept: its populations are still in the cache, while a halo
/// exchange of x faces would touch a line of memory for every number.
///
/// From `Even` the ghosts at both ends of the row are filled; from `Odd` the values that the row wrote to ghosts are
/// copied back.
pub(super) struct WrapX {
    /// Of each population that crosses: where it goes, whence it comes, both from the first cell of the row, and the row in which both
    /// lie relative to this one.
    copies: [([usize; 2], [isize; 2]); 10],
    size: [isize; 2],
}

impl WrapX {
    /// For a sweep from a phase.
    pub(super) fn new(layout: &Layout, swept: AaPhase) -> Self {
        let [nx, ny, nz] = layout.size.map(|n| n as isize);
        let mut copies = [([0; 2], [0; 2]); 10];
        let crossing = (1..Q).filter(|&j| C[j][0] != 0);
        for (copy, j) in copies.iter_mut().zip(crossing) {
            let (ghost, real) = if C[j][0] > 0 { (nx, 0) } else { (-1, nx - 1) };
            let (to, from, row) = match swept {
                AaPhase::Even => (ghost, real, [0; 2]),
                AaPhase::Odd => (real, ghost, [C[j][1], C[j][2]]),
            };
            let first = layout.cell(0, 0, 0);
            let at = |x| (j * layout.stride + layout.cell(x, row[0], row[1])).wrapping_sub(first);
            *copy = ([at(to), at(from)], row);
        }
        Self { copies, size: [ny, nz] }
    }

    /// Slots of all copies of a block, to and from.
    pub(super) fn slots(&self, layout: &Layout) -> [Vec<u64>; 2] {
        let ([ny, nz], mut slots) = (self.size, [Vec::new(), Vec::new()]);
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let cell = layout.cell(0, y, z);
            for (pair, [dy, dz]) in &self.copies {
                if (0..ny).contains(&(y + dy)) && (0..nz).contains(&(z + dz)) {
                    for (slots, slot) in slots.iter_mut().zip(pair) {
                        slots.push(cell.wrapping_add(*slot) as u64);
                    }
                }
            }
        }
        slots
    }

    /// Wraps the row at `y, z`, whose first cell is `cell`.
    #[inline(always)]
    pub(super) fn row<T: Copy>(&self, populations: &mut [T], cell: usize, [y, z]: [isize; 2]) {
        let [ny, nz] = self.size;
        let inner = y > 0 && y + 1 < ny && z > 0 && z + 1 < nz;
        for ([to, from], [dy, dz]) in &self.copies {
            if inner || ((0..ny).contains(&(y + dy)) && (0..nz).contains(&(z + dz))) {
                populations[cell.wrapping_add(*to)] = populations[cell.wrapping_add(*from)];
            }
        }
    }
}

macro_rules! compiled_for {
    ($s:ty, $t:ty, $lanes:ty, $registers:ty, [$sweep:ident, $fill:ident, $collect:ident, $bounce:ident, $read:ident] $(, $feature:literal)?) => {
        $(#[target_feature(enable = $feature)])?
        #[inline(never)]
        fn $fill<M: SolidModel>(solids: &BlockSolids<M>, row: usize, nx: usize, data: &mut SolidRow<$t>) {
            solids.fill::<$t, $registers>(row, nx, data);
        }
        $(#[target_feature(enable = $feature)])?
        #[inline(never)]
        fn $collect<M: SolidModel>(solids: &mut BlockSolids<M>, data: &SolidRow<$t>) {
            // SAFETY: the registers need the same instructions as this function.
            unsafe { solids.collect::<$t, $registers>(data) };
        }
        $(#[target_feature(enable = $feature)])?
        #[inline(never)]
        fn $bounce(walls: &Walls<$s>, entered: AaPhase, populations: &mut [$s], row: [usize; 2]) {
            walls.bounce_row(entered, populations, row, false);
        }
        $(#[target_feature(enable = $feature)])?
        #[inline(never)]
        fn $read<M: SolidModel>(
            reader: &mut RowReader,
            fluid: &Fluid<$s>,
            row: [usize; 2],
            model: M,
            covered: bool,
            visit: &mut dyn FnMut(&FlowRow),
        ) {
            let solids = (covered.then_some(&fluid.solid_row), model);
            let bare = fluid.measured.bare.as_ref().expect("kept by the sweep of the row");
            // SAFETY: `$registers` need the same instructions as this function.
            visit(unsafe { reader.read::<$s, $registers, M>(fluid, row, bare, solids) });
        }
        $(#[target_feature(enable = $feature)])?
        fn $sweep<M: SolidModel, O: Operator, const WALLS: bool>(sweep: Sweep<$s, M>) {
            // SAFETY: `$lanes` and the four functions need the same instructions as this one.
            unsafe { sweep_block::<$s, $lanes, M, O, WALLS>(sweep, ($fill::<M>, $collect::<M>, $bounce, $read::<M>)) };
        }
    };
    ($s:ty, $lanes:ty, $registers:ty, measure $measure:ident $(, $feature:literal)?) => {
        $(#[target_feature(enable = $feature)])?
        fn $measure<M: SolidModel>(fluid: &Fluid<$s>, a: [f64; 3], solids: &BlockSolids<M>) -> (Flow, Vec<Stresslet>) {
            // SAFETY: `$lanes` and `$registers` need the same instructions as this function.
            unsafe { measure_block::<$s, $lanes, $registers, M>(fluid, a, solids) }
        }
    };
    ($s:ty, $lanes:ty, $registers:ty, rows $rows:ident $(, $feature:literal)?) => {
        $(#[target_feature(enable = $feature)])?
        fn $rows<M: SolidModel>(
            fluid: &Fluid<$s>,
            cells: Block,
            a: [f64; 3],
            solids: &BlockSolids<M>,
            visit: &mut dyn FnMut(&FlowRow),
        ) {
            // SAFETY: `$lanes` and `$registers` need the same instructions as this function.
            unsafe { visit_rows::<$s, $lanes, $registers, M>(fluid, cells, a, solids, visit) }
        }
    };
}

/// Calls the function that is compiled for the instruction set of the fluid.
#[cfg(target_arch = "x86_64")]
macro_rules! call {
    ($simd:expr, [$scalar:expr, $sse2:expr, $avx2:expr, $avx512:expr]($($argument:expr),*)) => {
        match $simd {
            // SAFETY: `Fluid::new` checked that the processor has the instructions.
            Simd::Avx512 => unsafe { $avx512($($argument),*) },
            // SAFETY: `Fluid::new` checked that the processor has the instructions.
            Simd::Avx2 => unsafe { $avx2($($argument),*) },
            // SAFETY: `Fluid::new` checked that the processor has the instructions.
            Simd::Sse2 => unsafe { $sse2($($argument),*) },
            Simd::Scalar => $scalar($($argument),*),
        }
    };
}

macro_rules! real {
    ($t:ty, $in:ident $from:ident, |$p:ident| $widen:expr) => {
        impl Real for $t {
            type In<V: Registers> = V::$in;
            #[inline(always)]
            unsafe fn load_f32<V: Registers>(p: *const f32) -> Self::In<V> {
                // SAFETY: promised by the caller.
                unsafe { V::$in::$from(p) }
            }
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const LANE: [Self; CHUNK] =
                [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as Self
            }

            #[inline(always)]
            unsafe fn widen<D: Tally>($p: *const Self) -> D {
                // SAFETY: promised by the caller: as many numbers can be read.
                unsafe { $widen }
            }
        }
    };
}
real!(f32, F load, |p| D::widen(p));
real!(f64, D widen, |p| D::load(p));

macro_rules! population {
    ($s:ty as $t:ty: $is_converted:literal, $sse2:ident, $avx2:ident, $avx512:ident, |$stored:ident| $read:expr, |$g:ident| $round:expr,
     |$kept:ident, $mask:ident| $masked:expr) => {
        impl Population for $s {
            type Number = $t;
            const IS_CONVERTED: bool = $is_converted;

            #[inline(always)]
            fn read(self) -> $t {
                let $stored = self;
                $read
            }

            #[inline(always)]
            fn round($g: $t) -> Self {
                $round
            }

            #[inline(always)]
            fn masked(self, $mask: $t) -> Self {
                let $kept = self;
                $masked
            }

            fn sweep<M: SolidModel, O: Operator, const WALLS: bool>(sweep: Sweep<Self, M>) {
                compiled_for!($s, $t, $t, Single, [scalar, fill_scalar, collect_scalar, bounce_scalar, read_scalar]);
                #[cfg(target_arch = "x86_64")]
                {
                    use super::simd::{Narrow, Wide, $avx2, $avx512, $sse2};
                    compiled_for!(
                        $s,
                        $t,
                        $sse2,
                        Narrow,
                        [sse2, fill_sse2, collect_sse2, bounce_sse2, read_sse2],
                        "fma,f16c"
                    );
                    compiled_for!(
                        $s,
                        $t,
                        $avx2,
                        Wide,
                        [avx2, fill_avx2, collect_avx2, bounce_avx2, read_avx2],
                        "avx2,fma,f16c"
                    );
                    compiled_for!(
                        $s,
                        $t,
                        $avx512,
                        Wide,
                        [avx512, fill_avx512, collect_avx512, bounce_avx512, read_avx512],
                        "avx512f"
                    );
                    call!(
                        sweep.fluid.params.simd,
                        [
                            scalar::<M, O, WALLS>,
                            sse2::<M, O, WALLS>,
                            avx2::<M, O, WALLS>,
                            avx512::<M, O, WALLS>
                        ](sweep)
                    );
                }
                #[cfg(not(target_arch = "x86_64"))]
                scalar::<M, O, WALLS>(sweep);
            }

            fn measure<M: SolidModel>(
                fluid: &Fluid<Self>,
                a: [f64; 3],
                solids: &BlockSolids<M>,
            ) -> (Flow, Vec<Stresslet>) {
                compiled_for!($s, $t, Single, measure scalar);
                #[cfg(target_arch = "x86_64")]
                {
                    use super::simd::{Narrow, Wide, $avx2, $avx512, $sse2};
                    compiled_for!($s, $sse2, Narrow, measure sse2, "fma,f16c");
                    compiled_for!($s, $avx2, Wide, measure avx2, "avx2,fma,f16c");
                    compiled_for!($s, $avx512, Wide, measure avx512, "avx512f");
                    call!(
                        fluid.params.simd,
                        [scalar::<M>, sse2::<M>, avx2::<M>, avx512::<M>](fluid, a, solids)
                    )
                }
                #[cfg(not(target_arch = "x86_64"))]
                scalar::<M>(fluid, a, solids)
            }

            fn each_row<M: SolidModel>(
                fluid: &Fluid<Self>,
                cells: Block,
                a: [f64; 3],
                solids: &BlockSolids<M>,
                visit: &mut dyn FnMut(&FlowRow),
            ) {
                compiled_for!($s, $t, Single, rows scalar);
                #[cfg(target_arch = "x86_64")]
                {
                    use super::simd::{Narrow, Wide, $avx2, $avx512, $sse2};
                    compiled_for!($s, $sse2, Narrow, rows sse2, "fma,f16c");
                    compiled_for!($s, $avx2, Wide, rows avx2, "avx2,fma,f16c");
                    compiled_for!($s, $avx512, Wide, rows avx512, "avx512f");
                    call!(
                        fluid.params.simd,
                        [scalar::<M>, sse2::<M>, avx2::<M>, avx512::<M>](fluid, cells, a, solids, visit)
                    )
                }
                #[cfg(not(target_arch = "x86_64"))]
                scalar::<M>(fluid, cells, a, solids, visit)
            }
        }
    };
}
population!(f32 as f32: false, F32x4, F32x8, F32x16, |g| g, |g| g, |g, mask| g * mask);
population!(f64 as f64: false, F64x2, F64x4, F64x8, |g| g, |g| g, |g, mask| g * mask);
population!(F16 as f32: true, F32x4, F32x8, F32x16, |g| g.number(), |g| Self::from_number(g),
    |g, mask| if mask == 0.0 { Self::default() } else { g });
