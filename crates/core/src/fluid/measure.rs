//! Measurement of all cells between two steps, equal to that of a measuring sweep, without changing anything; and the
//! stresslets of the particles, for the stress of a suspension.
//!
//! ```text
//! S = sum over cells of (r g + g r) / 2 - tau Q,     r from the centre of the particle, in cells of several its share
//! tau Q = c Pi_neq    c = b in sc1, 1 - tau / T in sc3: what is reflected does not relax, so the solid itself carries stress
//! tau Q = 0           sc2 and exact difference, except for terms of second order in u
//! stress on plates = mu rate + (S_xz + contacts) / V - <rho u_x u_z>      exact in steady shear, both couplings, any grid
//! ```
//!
//! `g` is the momentum that the solid of a cell takes in a step: `(1 - B) rho (u - u_s)`, in partially saturated
//! cells `G`. All is a function of the state between two steps, so it costs nothing where it is not
//! requested. Derivation: `docs/theory/coupling.md`.
//!
//! Reference: Batchelor (1970), doi:10.1017/S0022112070000745.

use super::bodies::BlockSolids;
use super::dispatch::{observe_row, row_of};
use super::kernel::{Measured, Moments, Row, moments, put};
use super::population::{Population, PopulationLanes};
use super::simd::{Lanes, Registers};
use super::solid::{CHUNK, Covered, Measure, SolidModel};
use super::solid_row::SolidRow;
use super::{Flow, Fluid, Real};
use crate::lattice::Q;
use crate::math::to_fixed;

/// Measures all rows of a block: the flow, and the stresslets of the bodies.
///
/// # Safety
/// The function that this is inlined into is compiled for the instructions of `R` and `V`, and the processor has them.
#[inline(always)]
pub(super) unsafe fn measure_block<S: Population, R: PopulationLanes<S>, V: Registers, M: SolidModel>(
    fluid: &Fluid<S>,
    acceleration: [f64; 3],
    solids: &BlockSolids<M>,
) -> (Flow, Vec<Stresslet>) {
    let ([nx, ny, nz], lo, layout) = (fluid.layout.size, fluid.block.lo, &fluid.layout);
    let (row, model) = (row_of(fluid, acceleration), solids.model);
    let mut solid = SolidRow::new(row.chunks);
    let zeros = || vec![S::Number::ZERO; row.chunks * CHUNK];
    let mut measured = Measured { momentum: std::array::from_fn(|_| zeros()), bare: None };
    let mut reflected = std::array::from_fn(|_| zeros());
    let (mut flow, mut stresslets) = (Flow::default(), vec![[0; 6]; solids.bodies.len()]);
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        let walls = fluid.walls.row(y, z);
        solid.clear();
        solids.fill::<S::Number, V>(y + ny * z, nx, &mut solid);
        if let Some(walls) = walls {
            walls.each(|cells| solid.clear_fractions(cells));
        }
        let indices = layout.slots(fluid.phase, layout.cell(0, y as isize, z as isize));
        let slots = indices.map(|index| fluid.populations[index..][..row.chunks * CHUNK].as_ptr());
        let dead = walls.map_or(&[][..], |walls| &walls.dead);
        // SAFETY: the slices above are as long as the chunks.
        unsafe {
            measure_row::<S, R, _>(&slots, &row, model, dead, &mut solid, &mut measured, &mut reflected);
        }
        if let Some(walls) = walls {
            walls.each(|cells| solid.clear_exchanged(cells));
            walls.each(|cells| measured.clear(cells));
        }
        observe_row(&measured, nx, [lo[0], lo[1] + y, lo[2] + z], &mut flow);
        flow.solid += i128::from(solid.fraction_total());
        add_stresslets(solids, &solid, &reflected, &mut stresslets);
    }
    (flow, stresslets)
}

/// Stresslet of a body over the cells of a block as exact sums of fixed-point numbers: `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
pub type Stresslet = [i128; 6];

/// Adds the moments of `g` in a row about the centres of its bodies, less what they reflect.
fn add_stresslets<T: Real, M: SolidModel>(
    solids: &BlockSolids<M>,
    solid: &SolidRow<T>,
    reflected: &[Vec<T>; 6],
    sums: &mut [Stresslet],
) {
    solid.each_covered(|cover, x, _, share| {
        if solid.fraction[x] <= T::ZERO {
            return;
        }
        let centre = solids.bodies[cover.body as usize].motion.centre;
        let n = cover.offset.map(f64::from);
        let [ry, rz] = [n[1] - centre[1], n[2] - centre[2]];
        let [fx, fy, fz] = [0, 1, 2].map(|axis| share * solid.incoming[axis][x].into());
        let rx = (n[0] + x as f64) - centre[0];
        let moments = [
            rx * fx,
            ry * fy,
            rz * fz,
            0.5 * (rx * fy + ry * fx),
            0.5 * (rx * fz + rz * fx),
            0.5 * (ry * fz + rz * fy),
        ];
        for ((sum, moment), reflected) in sums[cover.body as usize].iter_mut().zip(moments).zip(reflected) {
            *sum += i128::from(to_fixed(moment)) - i128::from(to_fixed(share * reflected[x].into()));
        }
    });
}

/// Flux of momentum minus that of equilibrium: `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
#[inline(always)]
fn deviation_of_flux<T: Real, R: Lanes<T>>(
    g: &[R; Q],
    &Moments { deviation, momentum, u, .. }: &Moments<R>,
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

/// Measurements of a [`sweep_row`](super::kernel::sweep_row) of the row, without changing anything: its `measured`,
/// `incoming` of the solids as the momentum that they would receive in their cells, and the fraction
/// of the deviation of the flux of momentum from equilibrium that solids would reflect.
///
/// # Safety
/// For every `i`, `chunks * CHUNK` numbers can be read at `slots[i]`.
#[inline(always)]
unsafe fn measure_row<S: Population, R: PopulationLanes<S>, M: SolidModel>(
    slots: &[*const S; Q],
    row: &Row<S::Number>,
    model: M,
    dead: &[bool],
    solids: &mut SolidRow<S::Number>,
    measured: &mut Measured<S::Number>,
    reflected: &mut [Vec<S::Number>; 6],
) {
    for chunk in (0..row.chunks).filter(|&chunk| dead.get(chunk) != Some(&true)) {
        for first in (0..CHUNK).step_by(R::WIDTH) {
            let x = chunk * CHUNK + first;
            let mut g = [R::splat(S::Number::ONE); Q];
            for (g, slot) in g.iter_mut().zip(slots) {
                // SAFETY: x + WIDTH <= chunks * CHUNK, promised readable by the caller.
                *g = unsafe { R::load_scaled(slot.add(x)) };
            }
            let cells = moments::<S, R>(&g);
            let mut mean =
                if M::MIDWAY { cells.driven(row.acceleration.map(R::splat)) } else { cells.momentum };
            if solids.is_used(x, R::WIDTH) {
                // SAFETY: x + WIDTH <= chunks * CHUNK.
                let covered = unsafe { Covered::<R>::load::<S::Number, M>(solids, x) };
                let measure: Measure<R> = model.measure(&cells, &covered, row);
                mean = measure.mean;
                if let Some(b) = measure.reflected {
                    for g in &mut g {
                        *g = g.unscaled();
                    }
                    for (reflected, stress) in reflected.iter_mut().zip(deviation_of_flux(&g, &cells)) {
                        // SAFETY: the array has `chunks * CHUNK` numbers.
                        unsafe { put(reflected, x, b * stress) };
                    }
                }
                for (incoming, received) in solids.incoming.iter_mut().zip(measure.received) {
                    // SAFETY: the array has a chunk more than the row.
                    unsafe { put(incoming, x, received) };
                }
            }
            for axis in 0..3 {
                // SAFETY: the array has `chunks * CHUNK` numbers.
                unsafe { put(&mut measured.momentum[axis], x, mean[axis]) };
            }
        }
    }
}
