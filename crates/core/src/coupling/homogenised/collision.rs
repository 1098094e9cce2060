//! Collision of homogenised cells, and the momentum that they exchange.

use super::Homogenised;
use crate::fluid::kernel::{Moments, Relaxation, Row, Slots, TwoTimes, put};
use crate::fluid::simd::{Choose, Lanes};
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{Operator, Population, PopulationLanes, Real, SolidModel, SolidRow};

impl SolidModel for Homogenised {
    const PAIRS: bool = false;
    type Regularised = TwoTimes;
    const BY_VOLUME: bool = false;
    const MIDWAY: bool = false;

    #[inline(always)]
    unsafe fn collide<S: Population, R: PopulationLanes<S>, O: Operator>(
        self,
        slots: &Slots<S>,
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<S::Number>,
        solids: &mut SolidRow<S::Number>,
        x: usize,
    ) -> [R; 3] {
        let Moments { deviation, momentum, rho, u } = *cells;
        // SAFETY: promised by the caller; the arrays hold a chunk more than the row.
        unsafe {
            let Covered { solid, velocity, .. } = Covered::<R>::load::<S::Number, Self>(solids, x);
            let mut target = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
            for axis in 0..3 {
                target[axis] = solid.mul_add(velocity[axis] - target[axis], target[axis]);
                put(&mut solids.incoming[axis], x, momentum[axis]);
                put(&mut solids.outgoing[axis], x, rho * target[axis]);
            }
            put(&mut solids.incoming[3], x, deviation - R::load_populations(slots[0].add(x)));
            let relaxation = Relaxation::new::<S::Number, O>(cells, target, row.factors, None);
            let at_rest = relaxation.apply::<S, O>(slots, x, None);
            put(&mut solids.outgoing[3], x, deviation - at_rest);
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
        let (given, mut received) = (covered.solid * cells.rho, cells.u);
        for axis in 0..3 {
            received[axis] = given * (cells.u[axis] - covered.velocity[axis]);
        }
        Measure { mean: cells.momentum, received, reflected: None }
    }

    #[inline(always)]
    fn received<D: Choose<f64>>(self, e: D, _: f64) -> [D; 2] {
        [e, D::splat(1.0) - e]
    }
}
