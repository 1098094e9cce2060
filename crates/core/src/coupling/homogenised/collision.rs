//! Collision of homogenised cells, and the momentum that they exchange.

use super::Homogenised;
use crate::fluid::kernel::{Moments, Row, put, relax};
use crate::fluid::simd::Lanes;
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{CHUNK, Real, SolidModel, SolidRow};
use crate::lattice::Q;

impl SolidModel for Homogenised {
    const PAIRS: bool = false;
    const BY_VOLUME: bool = false;

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
    fn force<T: Real>(p: &[T; CHUNK], m: &[T; CHUNK], _: &[T; CHUNK], u: &[T; CHUNK]) -> [T; CHUNK] {
        let mut force = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            force[k] = p[k] - u[k] * m[k];
        }
        force
    }
}
