//! Collision of homogenised cells, and the momentum that they exchange.

use super::Homogenised;
use crate::fluid::kernel::{Moments, Row, put, relax};
use crate::fluid::simd::Lanes;
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{Body, CHUNK, ExchangeSum, Real, Segment, SolidModel, SolidRow, masked};
use crate::lattice::Q;

impl SolidModel for Homogenised {
    const PAIRS: bool = false;
    const BY_FRACTION: bool = false;

    #[inline(always)]
    fn permeability<T: Real>(before: &[T; CHUNK], fraction: &[T; CHUNK], _: &[T; CHUNK]) -> [T; CHUNK] {
        let mut open = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            open[k] = before[k] * (T::ONE - fraction[k]);
        }
        open
    }

    #[inline(always)]
    unsafe fn collide<T: Real, R: Lanes<T>, const TRT: bool>(
        self,
        g: &mut [R; Q],
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<T>,
        solids: &mut SolidRow<T>,
        x: usize,
    ) -> [R; 3] {
        let Moments { deviation, momentum, rho, u } = *cells;
        // SAFETY: promised by the caller; the arrays hold a chunk more than the row.
        unsafe {
            let Covered { solid, velocity, .. } = Covered::<R>::load(solids, x);
            let mut target = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
            for axis in 0..3 {
                target[axis] = target[axis] + solid * (velocity[axis] - target[axis]);
                put(&mut solids.incoming[axis], x, momentum[axis]);
                put(&mut solids.outgoing[axis], x, rho * target[axis]);
            }
            put(&mut solids.incoming[3], x, deviation - g[0]);
            relax::<T, R, TRT>(g, cells, target, row.factors, None);
            put(&mut solids.outgoing[3], x, deviation - g[0]);
        }
        momentum
    }

    #[inline(always)]
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        _: &Row<T>,
    ) -> Measure<R> {
        Measure { mean: cells.momentum, received: covered.solid * cells.rho, reflected: None }
    }

    fn drag(self, e: f64, _: f64) -> f64 {
        e
    }

    #[inline(always)]
    fn collect<T: Real>(segment: &Segment, _: &mut &[[T; CHUNK]], solids: &SolidRow<T>, body: &mut Body) {
        let velocity = body.motion.row::<T>(segment);
        for done in (0..segment.count as usize).step_by(CHUNK) {
            let window = segment.window(done);
            let u = velocity.window(window.offset[0]);
            let [incoming, outgoing] = solids.exchanged(window.x);
            body.exchange.add(&over_cells(incoming, &u, window.count, window.offset), 1);
            body.departed.add(&over_cells(outgoing, &u, window.count, window.offset), 1);
        }
    }
}

/// Sum of `p - m u` over the first `count` cells of a window whose first cell has offset `n`.
#[inline(always)]
fn over_cells<T: Real>(
    exchanged: [&[T; CHUNK]; 4],
    u: &[[T; CHUNK]; 3],
    count: usize,
    n: [i32; 3],
) -> ExchangeSum {
    let mut f = [[0.0_f64; CHUNK]; 3];
    for axis in 0..3 {
        let (p, m, u) = (exchanged[axis], exchanged[3], &u[axis]);
        let mut force = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            force[k] = p[k] - u[k] * m[k];
        }
        f[axis] = masked(&force, count);
    }
    ExchangeSum::of_window(&f, n)
}
