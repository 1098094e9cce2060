//! Collision of partially saturated cells, and the momentum that they exchange.

use super::{Saturated, SolidOperator};
use crate::fluid::kernel::{Moments, Row, put, relax};
use crate::fluid::simd::Lanes;
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{CHUNK, Real, SolidModel, SolidRow};
use crate::lattice::{C, Q, W, opposite};

/// Leak that keeps cells within a solid from reflecting everything, and the part of it that overlaps add (sc1 to sc3).
const LEAK: f64 = 0.01;
const FILM: f64 = 20.0;

impl SolidModel for Saturated {
    const PAIRS: bool = true;
    const BY_VOLUME: bool = true;

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
        let Moments { momentum, rho, u, .. } = *cells;
        let (one, t) = (R::splat(T::ONE), R::splat(row.above_half));
        // SAFETY: promised by the caller.
        let covered = unsafe { Covered::<R>::load(solids, x) };
        let Covered { open, solid, weight, velocity, .. } = covered;
        let (through, b) = reflected(&covered, t);
        // Exactly one where there is no solid: such a cell must not depend on the others in its register.
        let driven = one - solid * through * (through + open * t).recip();
        let given = b * rho * R::splat(T::from_f64(self.operator.momentum()));
        let (mut target, mut mean) = (u, momentum);
        for axis in 0..3 {
            let push = driven * a[axis];
            target[axis] = u[axis] + push;
            let force = given * (u[axis] - velocity[axis]);
            let left = momentum[axis] + (one - b) * rho * push - force;
            let inside = solid * (left - rho * velocity[axis]);
            mean[axis] = with_solid(&covered, cells, axis);
            // SAFETY: the arrays hold a chunk more than the row.
            unsafe {
                put(&mut solids.incoming[axis], x, weight * (force + inside));
                put(&mut solids.outgoing[axis], x, weight * inside);
            }
        }
        if self.operator == SolidOperator::Sc3 {
            relax::<T, R, TRT>(g, cells, target, row.factors, Some((b, velocity)));
        } else {
            let before = *g;
            relax::<T, R, TRT>(g, cells, target, row.factors, None);
            let mut pulled = before;
            if self.operator == SolidOperator::Sc2 {
                relax::<T, R, TRT>(&mut pulled, cells, velocity, row.factors, None);
            } else {
                bounce_back(&mut pulled, &before, cells, velocity);
            }
            // Cells of weight 0 keep every bit.
            for i in 0..Q {
                g[i] = g[i] + b * (pulled[i] - g[i]);
            }
        }
        mean
    }

    #[inline(always)]
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        row: &Row<T>,
    ) -> Measure<R> {
        let (_, b) = reflected(covered, R::splat(row.above_half));
        Measure {
            mean: [
                with_solid(covered, cells, 0),
                with_solid(covered, cells, 1),
                with_solid(covered, cells, 2),
            ],
            received: b * cells.rho * R::splat(T::from_f64(self.operator.momentum())),
            reflected: (self.operator != SolidOperator::Sc2).then_some(b),
        }
    }

    fn drag(self, e: f64, t: f64) -> f64 {
        self.operator.momentum() * e * t / (1.0 - e + t)
    }

    #[inline(always)]
    fn force<T: Real>(p: &[T; CHUNK], _: &[T; CHUNK], fraction: &[T; CHUNK], _: &[T; CHUNK]) -> [T; CHUNK] {
        let mut force = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            force[k] = fraction[k] * p[k];
        }
        force
    }
}

/// `(1 - e) + l` and `b`.
#[inline(always)]
fn reflected<T: Real, R: Lanes<T>>(covered: &Covered<R>, above_half: R) -> (R, R) {
    let overlap = (covered.fractions - covered.solid).max(R::splat(T::ZERO));
    let c = |x: f64| R::splat(T::from_f64(x));
    let through = covered.open + c(LEAK) + c(FILM) * (above_half * overlap);
    (through, covered.solid * above_half * (through + above_half).recip())
}

/// Momentum of a cell, that of its solid as it moves.
#[inline(always)]
fn with_solid<T: Real, R: Lanes<T>>(covered: &Covered<R>, cells: &Moments<R>, axis: usize) -> R {
    let momentum = cells.momentum[axis];
    momentum - covered.solid * (momentum - cells.rho * covered.velocity[axis])
}

/// `f_-i + feq_i(u_s) - feq_-i(u)`: with weights taken off, even and odd parts of the difference.
#[inline(always)]
fn bounce_back<T: Real, R: Lanes<T>>(
    pulled: &mut [R; Q],
    before: &[R; Q],
    &Moments { rho, u, .. }: &Moments<R>,
    v: [R; 3],
) {
    let c = |x: f64| R::splat(T::from_f64(x));
    let square = |v: [R; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let base = c(1.5) * rho * (square(u) - square(v));
    for (i, c_i) in C.iter().enumerate() {
        let along = |v: [R; 3]| (0..3).fold(c(0.0), |sum, axis| sum + c(c_i[axis] as f64) * v[axis]);
        let (cu, cv) = (along(u), along(v));
        let quadratic = c(4.5) * rho * (cv * cv - cu * cu);
        let change = base + quadratic + c(3.0) * rho * (cu + cv);
        pulled[i] = before[opposite(i)] + c(W[i]) * change;
    }
}
