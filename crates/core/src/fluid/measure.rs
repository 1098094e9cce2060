//! Measurement of all cells between two steps, equal to that of a measuring sweep, without changing anything.

use super::covered::Covered;
use super::dispatch::{observe_row, row_of};
use super::kernel::{Measured, Number, Row, moments};
use super::simd::Lanes;
use super::solid::{CHUNK, SolidRow, Solids};
use super::{Flow, Fluid, Real, SolidCollision};
use crate::lattice::Q;
use crate::math::to_fixed;

/// Looks at all rows of a block.
///
/// # Safety
/// The function that this is inlined into is compiled for the instructions of `R`, and the processor has them.
#[inline(always)]
pub(super) unsafe fn measure_block<T: Real, R: Lanes<T>, S: Solids<T>>(
    fluid: &Fluid<T>,
    solids: &mut S,
) -> (Flow, [i128; 6]) {
    let ([nx, ny, nz], lo, layout) = (fluid.layout.size, fluid.block.lo, &fluid.layout);
    let row = row_of(fluid, [0.0; 3]);
    let mut solid = SolidRow::new(row.chunks, fluid.solids);
    let mut measured = Measured { momentum: std::array::from_fn(|_| vec![T::ZERO; row.chunks * CHUNK]) };
    let mut held: [Vec<T>; 6] = std::array::from_fn(|_| vec![T::ZERO; row.chunks * CHUNK]);
    let (mut flow, mut all_held) = (Flow::default(), [0; 6]);
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        let walls = fluid.walls.row(y, z);
        solid.clear();
        solids.fill(y, z, &mut solid);
        if let Some(walls) = walls {
            walls.each(|cells| solid.clear_fractions(cells));
        }
        let indices = layout.places(fluid.phase, layout.cell(0, y as isize, z as isize));
        let places = indices.map(|index| fluid.populations[index..][..row.chunks * CHUNK].as_ptr());
        let dead = walls.map_or(&[][..], |walls| &walls.dead);
        // SAFETY: the slices above are as long as the chunks.
        unsafe { measure_row::<T, R>(&places, &row, dead, &mut solid, &mut measured, &mut held) };
        if let Some(walls) = walls {
            walls.each(|cells| solid.clear_exchanged(cells));
            walls.each(|cells| measured.clear(cells));
        }
        observe_row(&measured, nx, [lo[0], lo[1] + y, lo[2] + z], &mut flow);
        flow.solid += i128::from(solid.fraction_total());
        if fluid.solids.is_saturated() {
            let covered = (0..nx).filter(|&x| solid.is_used(x / CHUNK) && solid.permeability[x] < T::ONE);
            for x in covered {
                for (all, held) in all_held.iter_mut().zip(&held) {
                    *all += i128::from(to_fixed(held[x].into()));
                }
            }
        }
        solids.collect(y, z, &solid);
    }
    (flow, all_held)
}

/// Flux of momentum minus that of equilibrium: `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
#[inline(always)]
fn deviation_of_flux<T: Number, R: Lanes<T>>(
    g: &[R; Q],
    deviation: R,
    momentum: [R; 3],
    u: [R; 3],
) -> [R; 6] {
    let even = |i: usize| g[i] + g[i + 1];
    let (xy, yx) = (even(7), even(9));
    let (xz, zx) = (even(11), even(13));
    let (yz, zy) = (even(15), even(17));
    let pressure = R::splat(T::from_f64(1.0 / 3.0)) * deviation;
    [
        even(1) + ((xy + yx) + (xz + zx)) - pressure - momentum[0] * u[0],
        even(3) + ((xy + yx) + (yz + zy)) - pressure - momentum[1] * u[1],
        even(5) + ((xz + zx) + (yz + zy)) - pressure - momentum[2] * u[2],
        xy - yx - momentum[0] * u[1],
        xz - zx - momentum[0] * u[2],
        yz - zy - momentum[1] * u[2],
    ]
}

/// Returns the measurements of a [`sweep_row`](super::kernel::sweep_row) of the row, without changing anything.
/// `incoming` of the solids gets the momentum that they would receive in their cells, per unit of `sum e_k`; `held`
/// is the fraction of the deviation of the flux of momentum from equilibrium that partially saturated cells would
/// keep from relaxing, where there are solids.
///
/// # Safety
/// For every `i`, `chunks * CHUNK` numbers can be read at `places[i]`.
#[inline(always)]
unsafe fn measure_row<T: Number, R: Lanes<T>>(
    places: &[*const T; Q],
    row: &Row<T>,
    dead: &[bool],
    solids: &mut SolidRow<T>,
    measured: &mut Measured<T>,
    held: &mut [Vec<T>; 6],
) {
    for chunk in (0..row.chunks).filter(|&chunk| dead.get(chunk) != Some(&true)) {
        let is_solid = solids.is_used(chunk);
        for first in (0..CHUNK).step_by(R::WIDTH) {
            let x = chunk * CHUNK + first;
            let mut g = [R::splat(T::ONE); Q];
            for (g, place) in g.iter_mut().zip(places) {
                // SAFETY: x + WIDTH <= chunks * CHUNK, promised readable by the caller.
                *g = unsafe { R::load(place.add(x)) };
            }
            let (deviation, momentum, rho, u) = moments(&g);
            let mut mean = momentum;
            if is_solid {
                // SAFETY: x + WIDTH <= chunks * CHUNK.
                let covered = unsafe { Covered::<R>::load(solids, x) };
                let given = if row.solids == SolidCollision::ExactDifference {
                    covered.solid * rho
                } else {
                    let (_, b) = covered.reflecting(R::splat(row.above_half));
                    for axis in 0..3 {
                        mean[axis] = covered.with_solid(momentum[axis], rho, axis);
                    }
                    if row.solids != SolidCollision::Sc2 {
                        let stress = deviation_of_flux(&g, deviation, momentum, u);
                        for (held, stress) in held.iter_mut().zip(stress) {
                            let place = &mut held[x..x + R::WIDTH];
                            // SAFETY: the slice above has WIDTH numbers.
                            unsafe { (b * stress).store(place.as_mut_ptr()) };
                        }
                    }
                    b * rho * R::splat(row.reflection)
                };
                for axis in 0..3 {
                    let force = covered.weight * (given * (u[axis] - covered.velocity[axis]));
                    let place = &mut solids.incoming[axis][x..x + R::WIDTH];
                    // SAFETY: the slice above has WIDTH numbers.
                    unsafe { force.store(place.as_mut_ptr()) };
                }
            }
            for axis in 0..3 {
                let place = &mut measured.momentum[axis][x..x + R::WIDTH];
                // SAFETY: the slice above has WIDTH numbers.
                unsafe { mean[axis].store(place.as_mut_ptr()) };
            }
        }
    }
}
