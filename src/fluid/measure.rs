//! A look at all cells between two steps: what a measuring sweep would find, without a change.

use super::covered::Covered;
use super::dispatch::{observe_row, row_of};
use super::kernel::{Measured, Number, Row, moments};
use super::simd::Lanes;
use super::solid::{CHUNK, SolidRow, Solids};
use super::{Flow, Fluid, Real, SolidCollision};
use crate::lattice::Q;

/// Looks at all rows of a block.
///
/// # Safety
/// The function that this is inlined into is compiled for the instructions of `R`, and the processor has them.
#[inline(always)]
pub(super) unsafe fn measure_block<T: Real, R: Lanes<T>, S: Solids<T>>(
    fluid: &Fluid<T>,
    solids: &mut S,
) -> Flow {
    let ([nx, ny, nz], lo, layout) = (fluid.layout.size, fluid.block.lo, &fluid.layout);
    let row = row_of(fluid, [0.0; 3]);
    let mut solid = SolidRow::new(row.chunks, fluid.solids);
    let mut measured = Measured {
        momentum: std::array::from_fn(|_| vec![T::ZERO; row.chunks * CHUNK]),
    };
    let mut flow = Flow::default();
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
        unsafe { measure_row::<T, R>(&places, &row, dead, &mut solid, &mut measured) };
        if let Some(walls) = walls {
            walls.each(|cells| solid.clear_exchanged(cells));
            walls.each(|cells| measured.clear(cells));
        }
        observe_row(&measured, nx, [lo[0], lo[1] + y, lo[2] + z], &mut flow);
        flow.solid += i128::from(solid.fraction_total());
        solids.collect(y, z, &solid);
    }
    flow
}

/// Finds what a measuring [`sweep_row`](super::kernel::sweep_row) of the row would find, and changes nothing. As `incoming` of the solids stands what
/// these would receive of the momentum in their cells, per unit of `sum e_k`.
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
            let (_, momentum, rho, u) = moments(&g);
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
