//! Collision of partially saturated cells, and the momentum that they exchange.

use super::Saturated;
use crate::fluid::kernel::{Moments, Relaxation, Row, Slots, put, store_pair};
use crate::fluid::simd::Lanes;
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{Population, PopulationLanes, Real, SolidModel, SolidRow};
use crate::lattice::{C, Q, W};
use serde::{Deserialize, Serialize};

/// Leak that keeps cells within a solid from reflecting everything, and the part of it that overlaps add (sc1 to sc3).
const LEAK: f64 = 0.01;
const FILM: f64 = 20.0;

/// Collision in solid cells of the coupling "saturated".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolidOperator {
    /// Bounce-back of the deviation from equilibrium.
    Sc1,
    /// Equilibrium of the solid, and what relaxation leaves.
    Sc2,
    /// Bounce-back off a moving wall.
    #[default]
    Sc3,
}

impl SolidOperator {
    /// All operators.
    pub const ALL: [Self; 3] = [Self::Sc1, Self::Sc2, Self::Sc3];

    /// Name in case files and, in capitals, in the kernels of a device.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sc1 => "sc1",
            Self::Sc2 => "sc2",
            Self::Sc3 => "sc3",
        }
    }

    /// Momentum that the operator gives to a wholly solid cell, over `rho (u_s - u)`.
    pub(crate) fn momentum(self) -> f64 {
        if self == Self::Sc3 { 2.0 } else { 1.0 }
    }
}

impl SolidModel for Saturated {
    const PAIRS: bool = true;
    const BY_VOLUME: bool = true;

    #[inline(always)]
    unsafe fn collide<S: Population, R: PopulationLanes<S>, const TRT: bool>(
        self,
        slots: &Slots<S>,
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<S::Number>,
        solids: &mut SolidRow<S::Number>,
        x: usize,
    ) -> [R; 3] {
        let Moments { momentum, rho, u, .. } = *cells;
        let (one, t) = (R::splat(S::Number::ONE), R::splat(row.above_half));
        // SAFETY: promised by the caller.
        let covered = unsafe { Covered::<R>::load::<S::Number, Self>(solids, x) };
        let Covered { solid, velocity, .. } = covered;
        // Exactly one where there is no solid: such a cell must not depend on the others in its register.
        let (b, driven) = reflected(&covered, t);
        let given = (b * rho) * R::splat(S::Number::from_f64(self.operator.momentum()));
        let kept = (one - b) * (rho * driven);
        let (mut target, mut mean) = (u, momentum);
        for axis in 0..3 {
            target[axis] = driven.mul_add(a[axis], u[axis]);
            let force = given * (u[axis] - velocity[axis]);
            let left = kept.mul_add(a[axis], momentum[axis]) - force;
            let inside = solid * rho.neg_mul_add(velocity[axis], left);
            mean[axis] = with_solid(&covered, cells, axis);
            // SAFETY: the arrays hold a chunk more than the row.
            unsafe {
                put(&mut solids.incoming[axis], x, force + inside);
                put(&mut solids.outgoing[axis], x, inside);
            }
        }
        // SAFETY: promised by the caller.
        unsafe {
            if self.operator == SolidOperator::Sc3 {
                Relaxation::new::<S::Number, TRT>(cells, target, row.factors, Some((b, velocity)))
                    .apply::<S, true>(slots, x, None);
            } else {
                let fluid = Relaxation::new::<S::Number, TRT>(cells, target, row.factors, None);
                self.pull::<S, R, TRT>(&fluid, slots, cells, row, x, (b, velocity));
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
        let (b, _) = reflected(covered, R::splat(row.above_half));
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

    fn kernel_options(self) -> String {
        let (name, momentum) = (self.operator.name().to_uppercase(), self.operator.momentum());
        format!("-D{name} -DMOMENTUM={momentum:?}")
    }

    fn drag(self, e: f64, t: f64) -> f64 {
        self.operator.momentum() * e * t / (1.0 - e + t)
    }
}

impl Saturated {
    /// Collides cells by one of the operators that work on single populations: `f' = relaxed + b (pulled - relaxed)`.
    ///
    /// # Safety
    /// As for [`SolidModel::collide`].
    #[inline(always)]
    unsafe fn pull<S: Population, R: PopulationLanes<S>, const TRT: bool>(
        self,
        fluid: &Relaxation<R>,
        slots: &Slots<S>,
        cells: &Moments<R>,
        row: &Row<S::Number>,
        x: usize,
        (b, velocity): (R, [R; 3]),
    ) {
        let to_solid = Relaxation::new::<S::Number, TRT>(cells, velocity, row.factors, None);
        // Cells of weight 0 keep every bit.
        let mix = |relaxed: R, pulled: R| b.mul_add(pulled - relaxed, relaxed);
        let sc2 = self.operator == SolidOperator::Sc2;
        // SAFETY: promised by the caller.
        unsafe {
            let g = R::load_populations(slots[0].add(x));
            let pulled = if sc2 { to_solid.at_rest(g) } else { g + bounced(cells, velocity, 0) };
            mix(fluid.at_rest(g), pulled).store_populations(slots[0].add(x));
            for i in (1..Q).step_by(2) {
                let pair = [R::load_populations(slots[i].add(x)), R::load_populations(slots[i + 1].add(x))];
                let relaxed = fluid.pair::<S::Number, true>(i, pair);
                let pulled = if sc2 {
                    to_solid.pair::<S::Number, true>(i, pair)
                } else {
                    [pair[1] + bounced(cells, velocity, i), pair[0] + bounced(cells, velocity, i + 1)]
                };
                let [there, back] = [mix(relaxed[0], pulled[0]), mix(relaxed[1], pulled[1])];
                store_pair(slots, x, i, [there.scaled(), back.scaled()]);
            }
        }
    }
}

/// `b = e t / T`, `T = (1 - e) + t + l`, and the part of the acceleration that acts, `1 - e q / (q + (1 - e) t)` with `q = T - t`.
#[inline(always)]
fn reflected<T: Real, R: Lanes<T>>(covered: &Covered<R>, above_half: R) -> (R, R) {
    let c = |x: f64| R::splat(T::from_f64(x));
    let Covered { open, solid, overlap, .. } = *covered;
    let through = (c(FILM) * above_half).mul_add(overlap, open + c(LEAK));
    let (total, mixed) = (through + above_half, open.mul_add(above_half, through));
    // One division for both.
    let over = solid * (total * mixed).recip();
    ((above_half * mixed) * over, (through * total).neg_mul_add(over, R::splat(T::ONE)))
}

/// Momentum of a cell, that of its solid as it moves.
#[inline(always)]
fn with_solid<T: Real, R: Lanes<T>>(covered: &Covered<R>, cells: &Moments<R>, axis: usize) -> R {
    let momentum = cells.momentum[axis];
    momentum - covered.solid * (momentum - cells.rho * covered.velocity[axis])
}

/// `feq_i(u_s) - feq_-i(u)`, what bounce-back adds to `f_-i`.
#[inline(always)]
fn bounced<T: Real, R: Lanes<T>>(&Moments { rho, u, .. }: &Moments<R>, v: [R; 3], i: usize) -> R {
    let c = |x: f64| R::splat(T::from_f64(x));
    let square = |v: [R; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let along = |v: [R; 3]| (0..3).fold(c(0.0), |sum, axis| c(C[i][axis] as f64).mul_add(v[axis], sum));
    let (cu, cv) = (along(u), along(v));
    let quadratic = c(4.5) * (cv * cv - cu * cu) + c(1.5) * (square(u) - square(v));
    c(W[i]) * (rho * (quadratic + c(3.0) * (cu + cv)))
}
