//! Sweeps over a block, compiled once per precision and instruction set, chosen at run time.

use super::kernel::{LANE, Measured, Number, Places, Row, RowVelocity, exchange_chunk, sweep_row};
use super::layout::{Layout, Phase};
use super::simd::{Lanes, prefetch};
use super::solid::CHUNK;
use super::{ExchangeSum, Flow, Fluid, RigidMotion, SPEED_LIMIT, Simd, SolidRow};
use crate::lattice::{C, Q};
use crate::math::to_fixed;
use bytemuck::Pod;

/// Storage type of populations: `f32` or `f64`.
pub trait Real: Number + Pod + Send + Sync + Into<f64> {
    #[doc(hidden)]
    fn sweep(fluid: &mut Fluid<Self>, acceleration: [f64; 3], flow: Option<&mut Flow>);
    #[doc(hidden)]
    fn momentum_exchange(
        fluid: &Fluid<Self>,
        rows: &[SolidRow],
        motions: &[RigidMotion],
        sums: &mut [ExchangeSum],
    );
}

/// Sweeps all rows of a block.
#[inline(always)]
fn sweep_block<T: Real, R: Lanes<T>>(
    fluid: &mut Fluid<T>,
    acceleration: [f64; 3],
    mut flow: Option<&mut Flow>,
) {
    let [nx, ny, nz] = fluid.layout.size;
    let (layout, lo) = (fluid.layout.clone(), fluid.block.lo);
    let base = fluid.populations.as_mut_ptr();
    for z in 0..nz {
        for y in 0..ny {
            let places = layout.places(fluid.phase, layout.cell(0, y as isize, z as isize));
            // SAFETY: places of real cells lie inside the buffer (tested in `layout`).
            let places: Places<T> = places.map(|place| unsafe { base.add(place) });
            let row = Row {
                chunks: layout.chunks_per_row(),
                solid_index: fluid.solid.row(y, z),
                solid: &fluid.solid,
                keep: T::from_f64(1.0 - 1.0 / fluid.relaxation_time),
                acceleration: acceleration.map(T::from_f64),
            };
            // SAFETY: every place of a row of whole chunks lies inside the buffer and belongs to one cell only (tested in
            // `layout`), so the ranges can be written and do not overlap.
            unsafe {
                if let Some(flow) = flow.as_deref_mut() {
                    sweep_row::<T, R, true>(&places, &row, &mut fluid.measured);
                    observe_row(&fluid.measured, nx, [lo[0], lo[1] + y, lo[2] + z], flow);
                } else {
                    sweep_row::<T, R, false>(&places, &row, &mut fluid.measured);
                }
            }
            if fluid.wrap_x {
                wrap_row_x(
                    &layout,
                    fluid.phase,
                    &mut fluid.populations,
                    y as isize,
                    z as isize,
                );
            }
        }
    }
}

/// Adds the first `nx` cells of a measured row, which begins at cell `at` of the box.
#[inline(always)]
fn observe_row<T: Real>(measured: &Measured<T>, nx: usize, at: [usize; 3], flow: &mut Flow) {
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
        flow.momentum[axis] = flow.momentum[axis].wrapping_add(total[axis]);
    }
    flow.square = flow.square.wrapping_add(square);
    flow.max_speed = flow.max_speed.max(most.sqrt());
    if !good && flow.fault.is_none() {
        let speed = |x: usize| -> f64 {
            let p: [f64; 3] = [px[x].into(), py[x].into(), pz[x].into()];
            (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt()
        };
        flow.fault = (0..nx)
            .find(|&x| !(speed(x) < SPEED_LIMIT))
            .map(|x| ([at[0] + x, at[1], at[2]], speed(x)));
    }
}

/// Periodicity along x within the block, for a row just swept: its populations are still in the cache, while a halo
/// exchange of x faces would touch a line of memory for every number.
///
/// From `Home` the ghosts at both ends of the row are filled; from `Away` what the row wrote to ghosts returns.
#[inline(always)]
fn wrap_row_x<T: Real>(layout: &Layout, swept: Phase, populations: &mut [T], y: isize, z: isize) {
    let [nx, ny, nz] = layout.size.map(|n| n as isize);
    for j in (1..Q).filter(|&j| C[j][0] != 0) {
        let (ghost, real) = if C[j][0] > 0 { (nx, 0) } else { (-1, nx - 1) };
        let at = |x: isize, y: isize, z: isize| j * layout.stride + layout.cell(x, y, z);
        match swept {
            Phase::Home => populations[at(ghost, y, z)] = populations[at(real, y, z)],
            Phase::Away => {
                let (y, z) = (y + C[j][1], z + C[j][2]);
                if (0..ny).contains(&y) && (0..nz).contains(&z) {
                    populations[at(real, y, z)] = populations[at(ghost, y, z)];
                }
            }
        }
    }
}

/// How many rows ahead of its use the memory of a row is asked for: rows of a body are short and far apart.
const ROWS_AHEAD: usize = 3;

/// Sums of one body, lane by lane: force, then moment about the reference cell.
type LaneSums = [[i64; CHUNK]; 6];

/// Momentum exchange over all rows.
#[inline(always)]
fn exchange_rows<T: Real, R: Lanes<T>>(
    fluid: &Fluid<T>,
    rows: &[SolidRow],
    motions: &[RigidMotion],
    sums: &mut [ExchangeSum],
) {
    let layout = &fluid.layout;
    let base = fluid.populations.as_ptr();
    let sign = T::from_f64(if fluid.phase == Phase::Home { 1.0 } else { -1.0 });
    let steps: [isize; Q] = std::array::from_fn(|i| (i * layout.stride) as isize + layout.step(i));
    // Rows of a body come together, so its sums stay in lanes until the next body begins.
    let mut lanes: LaneSums = [[0; CHUNK]; 6];
    for (i, row) in rows.iter().enumerate() {
        let [x, y, z] = row.cell.map(|c| c as isize);
        debug_assert!(x as u32 + row.count <= layout.size[0] as u32);
        if let Some(coming) = rows.get(i + ROWS_AHEAD) {
            let cell = layout.cell(
                coming.cell[0] as isize,
                coming.cell[1] as isize,
                coming.cell[2] as isize,
            );
            for i in 0..Q {
                prefetch(base.wrapping_add(i * layout.stride + cell));
                prefetch(base.wrapping_offset(steps[i] + cell as isize));
            }
        }
        let motion = &motions[row.body as usize];
        let n = row.offset.map(f64::from);
        let [ry, rz] = [n[1] - motion.centre[1], n[2] - motion.centre[2]];
        let (v, w) = (motion.velocity, motion.angular);
        // Velocity along the row: constant, plus slope times x.
        let constant = [v[0] + (w[1] * rz - w[2] * ry), v[1] - w[0] * rz, v[2] + w[0] * ry].map(T::from_f64);
        let slope = [0.0, w[2], -w[1]].map(T::from_f64);
        let first = layout.cell(x, y, z);
        for done in (0..row.count as usize).step_by(CHUNK) {
            let (cell, count) = (first + done, (row.count as usize - done).min(CHUNK));
            // SAFETY: the places of a real cell and of its neighbours lie inside the buffer, and so do the up to CHUNK
            // numbers after them: rows are padded by a chunk and the buffer by another.
            let (near, far) = unsafe {
                (
                    std::array::from_fn(|i| base.add(i * layout.stride + cell)),
                    std::array::from_fn(|i| base.offset(steps[i] + cell as isize)),
                )
            };
            let along = T::from_f64(n[0] + done as f64 - motion.centre[0]);
            let velocity = RowVelocity {
                constant,
                slope,
                along,
            };
            let mut force = [[T::ZERO; CHUNK]; 3];
            // SAFETY: the pointers can be read as shown above.
            unsafe { exchange_chunk::<T, R>(&near, &far, count, &velocity, sign, &mut force) };
            add_lanes(&force, count, [n[0] + done as f64, n[1], n[2]], &mut lanes);
        }
        if rows.get(i + 1).is_none_or(|next| next.body != row.body) {
            let sum = &mut sums[row.body as usize];
            for (total, lanes) in sum.force.iter_mut().chain(&mut sum.moment).zip(&mut lanes) {
                *total = lanes.iter().fold(*total, |sum, &lane| sum.wrapping_add(lane));
                *lanes = [0; CHUNK];
            }
        }
    }
}

/// Adds force and moment of the first `count` cells; the first lies at offset `n` from the reference cell.
#[inline(always)]
fn add_lanes<T: Real>(force: &[[T; CHUNK]; 3], count: usize, n: [f64; 3], lanes: &mut LaneSums) {
    for k in 0..CHUNK {
        // The lanes after the end of the row hold anything, even what is not a number.
        let f = force.map(|f| if k < count { f[k].into() } else { 0.0 });
        let nx = n[0] + LANE[k];
        let terms = [
            f[0],
            f[1],
            f[2],
            n[1] * f[2] - n[2] * f[1],
            n[2] * f[0] - nx * f[2],
            nx * f[1] - n[1] * f[0],
        ];
        for (sum, term) in lanes.iter_mut().zip(terms) {
            sum[k] = sum[k].wrapping_add(to_fixed(term));
        }
    }
}

macro_rules! real {
    ($t:ty, $sse2:ident, $avx2:ident, $avx512:ident) => {
        impl Real for $t {
            fn sweep(fluid: &mut Fluid<Self>, acceleration: [f64; 3], flow: Option<&mut Flow>) {
                #[cfg(target_arch = "x86_64")]
                {
                    use super::simd::{$avx2, $avx512, $sse2};
                    #[target_feature(enable = "avx2")]
                    fn avx2(fluid: &mut Fluid<$t>, acceleration: [f64; 3], flow: Option<&mut Flow>) {
                        sweep_block::<$t, $avx2>(fluid, acceleration, flow);
                    }
                    #[target_feature(enable = "avx512f")]
                    fn avx512(fluid: &mut Fluid<$t>, acceleration: [f64; 3], flow: Option<&mut Flow>) {
                        sweep_block::<$t, $avx512>(fluid, acceleration, flow);
                    }
                    match fluid.simd {
                        // SAFETY: `Fluid::new` checked that the processor has the instructions.
                        Simd::Avx512 => return unsafe { avx512(fluid, acceleration, flow) },
                        // SAFETY: `Fluid::new` checked that the processor has the instructions.
                        Simd::Avx2 => return unsafe { avx2(fluid, acceleration, flow) },
                        Simd::Sse2 => return sweep_block::<$t, $sse2>(fluid, acceleration, flow),
                        Simd::Scalar => {}
                    }
                }
                sweep_block::<$t, $t>(fluid, acceleration, flow);
            }

            fn momentum_exchange(
                fluid: &Fluid<Self>,
                rows: &[SolidRow],
                motions: &[RigidMotion],
                sums: &mut [ExchangeSum],
            ) {
                #[cfg(target_arch = "x86_64")]
                {
                    use super::simd::{$avx2, $avx512, $sse2};
                    #[target_feature(enable = "avx2")]
                    fn avx2(
                        fluid: &Fluid<$t>,
                        rows: &[SolidRow],
                        motions: &[RigidMotion],
                        sums: &mut [ExchangeSum],
                    ) {
                        exchange_rows::<$t, $avx2>(fluid, rows, motions, sums);
                    }
                    #[target_feature(enable = "avx512f")]
                    fn avx512(
                        fluid: &Fluid<$t>,
                        rows: &[SolidRow],
                        motions: &[RigidMotion],
                        sums: &mut [ExchangeSum],
                    ) {
                        exchange_rows::<$t, $avx512>(fluid, rows, motions, sums);
                    }
                    match fluid.simd {
                        // SAFETY: `Fluid::new` checked that the processor has the instructions.
                        Simd::Avx512 => return unsafe { avx512(fluid, rows, motions, sums) },
                        // SAFETY: `Fluid::new` checked that the processor has the instructions.
                        Simd::Avx2 => return unsafe { avx2(fluid, rows, motions, sums) },
                        Simd::Sse2 => return exchange_rows::<$t, $sse2>(fluid, rows, motions, sums),
                        Simd::Scalar => {}
                    }
                }
                exchange_rows::<$t, $t>(fluid, rows, motions, sums);
            }
        }
    };
}
real!(f32, F32x4, F32x8, F32x16);
real!(f64, F64x2, F64x4, F64x8);
