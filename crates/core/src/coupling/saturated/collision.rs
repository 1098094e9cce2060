//! Collision of partially saturated cells, and the momentum that they exchange.

use super::Saturated;
use crate::fluid::kernel::{Moments, Recursive, Reflection, Relaxation, Row, Slots, put, store_pair};
use crate::fluid::simd::{Choose, Lanes};
use crate::fluid::solid::{Covered, Measure};
use crate::fluid::{Operator, Population, PopulationLanes, Real, SolidModel, SolidRow};
use crate::lattice::{C, Q, W};
use serde::{Deserialize, Serialize};

/// Leak that keeps cells within a solid from reflecting everything, and the part of it that overlaps add (sc1 to sc3).
const LEAK: f64 = 0.01;
const FILM: f64 = 20.0;
/// Weight of the part of a cell that is open: with it the fluid feels surfaces where they are, but for a few hundredths of a cell.
const OPEN: f64 = 0.6;
/// Share of the fraction in the weight of a cell; the rest is of its square.
const PLAIN: f64 = 0.25;

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
    type Regularised = Recursive;
    const BY_VOLUME: bool = true;
    const MIDWAY: bool = true;

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
        let Moments { momentum, rho, u, .. } = *cells;
        // SAFETY: promised by the caller.
        let covered = unsafe { Covered::<R>::load::<S::Number, Self>(solids, x) };
        let Covered { open, solid, velocity, .. } = covered;
        let reflection = reflection(&covered, row);
        let b = reflection.b;
        let Exchange { gained, force } = self.exchange(cells, &covered, b, a);
        let mut target = u;
        for axis in 0..3 {
            target[axis] = open.mul_add(a[axis], u[axis]);
            let inside = solid * rho.neg_mul_add(velocity[axis], momentum[axis] + gained[axis]);
            // SAFETY: the arrays hold a chunk more than the row.
            unsafe {
                put(&mut solids.incoming[axis], x, force[axis] + inside);
                put(&mut solids.outgoing[axis], x, inside);
            }
        }
        // SAFETY: promised by the caller.
        unsafe {
            if self.operator == SolidOperator::Sc3 {
                Relaxation::new::<S::Number, O>(cells, target, row.factors, Some(reflection))
                    .apply::<S, O>(slots, x, None);
            } else {
                let fluid = Relaxation::new::<S::Number, O>(cells, target, row.factors, None);
                self.pull::<S, R, O>(&fluid, slots, cells, row, x, (b, velocity));
            }
        }
        with_solid(&covered, cells, gained)
    }

    #[inline(always)]
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        row: &Row<T>,
    ) -> Measure<R> {
        let Reflection { b, even, .. } = reflection(covered, row);
        let Exchange { gained, force } = self.exchange(cells, covered, b, row.acceleration.map(R::splat));
        let reflected = match self.operator {
            SolidOperator::Sc1 => Some(b),
            SolidOperator::Sc2 => None,
            SolidOperator::Sc3 => Some(even),
        };
        Measure { mean: with_solid(covered, cells, gained), received: force, reflected }
    }

    fn kernel_options(self) -> String {
        let (name, momentum) = (self.operator.name().to_uppercase(), self.operator.momentum());
        format!("-D{name} -DMOMENTUM={momentum:?}")
    }

    #[inline(always)]
    fn received<D: Choose<f64>>(self, e: D, t: f64) -> [D; 2] {
        let (of, open) = (D::splat, D::splat(1.0) - e);
        let x = e * (of(PLAIN) + of(1.0 - PLAIN) * e) * of(t);
        let b = x.over(of(OPEN) * open + of(LEAK) + x);
        [of(self.operator.momentum()) * b, open * (of(1.0) - b)]
    }
}

/// Momentum that a register of cells gains, and that its solids receive.
struct Exchange<R> {
    gained: [R; 3],
    force: [R; 3],
}

impl Saturated {
    /// Of what drives the cell, `rho (1 - e) a`, the solid takes the part `b` at once.
    #[inline(always)]
    fn exchange<T: Real, R: Lanes<T>>(
        self,
        &Moments { rho, u, .. }: &Moments<R>,
        covered: &Covered<R>,
        b: R,
        a: [R; 3],
    ) -> Exchange<R> {
        let given = (b * rho) * R::splat(T::from_f64(self.operator.momentum()));
        let (mut gained, mut force) = (u, u);
        for axis in 0..3 {
            let fed = rho * (covered.open * a[axis]);
            force[axis] = given.mul_add(u[axis] - covered.velocity[axis], b * fed);
            gained[axis] = fed - force[axis];
        }
        Exchange { gained, force }
    }

    /// Collides cells by one of the operators that work on single populations: `f' = relaxed + b (pulled - relaxed)`.
    ///
    /// # Safety
    /// As for [`SolidModel::collide`].
    #[inline(always)]
    unsafe fn pull<S: Population, R: PopulationLanes<S>, O: Operator>(
        self,
        fluid: &Relaxation<R>,
        slots: &Slots<S>,
        cells: &Moments<R>,
        row: &Row<S::Number>,
        x: usize,
        (b, velocity): (R, [R; 3]),
    ) {
        let to_solid = Relaxation::new::<S::Number, O>(cells, velocity, row.factors, None);
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
                let relaxed = fluid.pair::<S::Number, O>(i, pair);
                let pulled = if sc2 {
                    to_solid.pair::<S::Number, O>(i, pair)
                } else {
                    [pair[1] + bounced(cells, velocity, i), pair[0] + bounced(cells, velocity, i + 1)]
                };
                let [there, back] = [mix(relaxed[0], pulled[0]), mix(relaxed[1], pulled[1])];
                store_pair(slots, x, i, [there.scaled(), back.scaled()]);
            }
        }
    }
}

/// `b = w(1)`, `w(q)` and `2 r w(r)` with `w(s) = s x / (0.6 (1 - e) + l + s x)`, `x = e (1/4 + 3/4 e) t`, `q = 1 / (2 tau)`,
/// `r = 1 - 1 / (2 tau_odd)`. All are exactly 0 where there is no solid: such a cell must not depend on the others in its register.
#[inline(always)]
fn reflection<T: Real, R: Lanes<T>>(covered: &Covered<R>, row: &Row<T>) -> Reflection<R> {
    let c = |x: f64| R::splat(T::from_f64(x));
    let Covered { open, solid, overlap, velocity } = *covered;
    let (t, one) = (R::splat(row.above_half), R::splat(T::ONE));
    let through = (c(FILM) * t).mul_add(overlap, c(OPEN).mul_add(open, c(LEAK)));
    let (q, r) = (one - R::splat(row.factors.even), one + R::splat(row.factors.odd));
    let x = (t * solid) * c(1.0 - PLAIN).mul_add(solid, c(PLAIN));
    let (qx, rx) = ((c(0.5) * q) * x, (c(0.5) * r) * x);
    let (all, even, odd) = (through + x, through + qx, through + rx);
    // One division for all.
    let over = ((all * even) * odd).recip();
    Reflection {
        b: (x * (even * odd)) * over,
        even: (qx * (all * odd)) * over,
        odd: (r * (rx * (all * even))) * over,
        velocity,
    }
}

/// Momentum of cells midway, that of their solid as it moves.
#[inline(always)]
fn with_solid<T: Real, R: Lanes<T>>(covered: &Covered<R>, cells: &Moments<R>, gained: [R; 3]) -> [R; 3] {
    let mut mean = cells.midway(gained);
    for axis in 0..3 {
        mean[axis] = mean[axis] - covered.solid * (mean[axis] - cells.rho * covered.velocity[axis]);
    }
    mean
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
