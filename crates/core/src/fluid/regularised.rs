//! Recursive regularised collision, stable at relaxation times near 1/2, and the viscosity of eddies that the lattice does not resolve.
//!
//! Of the deviation from equilibrium only its second moment is kept, and the third moments that follow from it:
//!
//! ```text
//! f'_i = w_i (rho + 3 c.q + 4.5 (c c - I/3) : P + third),     q = rho u*,     P = q u* + k Pi,     k = 1 - 1 / tau
//! Pi   = sum c c f - rho I / 3 - rho u u
//! T_abb = u*_a P_bb + 2 u*_b k Pi_ab                           third moments, a != b
//! third = -9 c_a (T_abb + T_acc)                               along the axis a
//!         9 (c_a T_abb + c_b T_baa)                            along a diagonal of a and b
//! ```
//!
//! With Smagorinsky's constant `C` the relaxation time of a cell is that of the fluid and of eddies of the viscosity `C^2 |S|`:
//!
//! ```text
//! tau_all = (tau + sqrt(tau^2 + 18 sqrt(2) C^2 |Pi| / rho)) / 2,     |Pi|^2 = Pi : Pi,     |S| = sqrt(2 S : S)
//! ```
//!
//! References: Malaspinas (2015), arXiv:1505.06900, and Coreixas et al. (2017), doi:10.1103/PhysRevE.96.033306 (the recursion);
//! Hou et al. (1996), Fields Inst. Commun. 6, 151 (Smagorinsky from the deviation).

use super::Real;
use super::kernel::{Moments, Row, Slots, store_pair};
use super::population::{Population, PopulationLanes};
use crate::lattice::Q;

/// Change of the relaxation time by eddies, `18 sqrt(2) C^2`; 0 without.
pub(super) fn eddy_factor(smagorinsky: f64) -> f64 {
    18.0 * std::f64::consts::SQRT_2 * smagorinsky * smagorinsky
}

/// Relaxation time of a fluid of the relaxation time `tau` whose rate of strain is `S`, with eddies: `tau + 3 C^2 |S|`.
pub(super) fn with_eddies(tau: f64, smagorinsky: f64, [xx, yy, zz, xy, xz, yz]: [f64; 6]) -> f64 {
    let square = (xx * xx + yy * yy + zz * zz) + 2.0 * (xy * xy + xz * xz + yz * yz);
    tau + 3.0 * smagorinsky * smagorinsky * (2.0 * square).sqrt()
}

/// A register of cells after the collision.
pub(super) struct Regularised<R> {
    /// Of the even part, weights along axes and diagonals, and `P / 8`: `xx`, `yy`, `zz`, then twice `xy`, `xz`, `yz`.
    base: [R; 2],
    quadratic: [R; 6],
    /// Of the odd part, along axes, and along diagonals of each axis with each, in the order `xy`, `xz`, `yx`, `yz`, `zx`, `zy`.
    along: [R; 3],
    across: [R; 6],
}

impl<R: Copy> Regularised<R> {
    /// Collides cells with scaled populations `g` under an acceleration.
    #[inline(always)]
    pub(super) fn new<S: Population>(g: &[R; Q], cells: &Moments<R>, a: [R; 3], row: &Row<S::Number>) -> Self
    where
        R: PopulationLanes<S>,
    {
        let c = |x: f64| R::splat(S::Number::from_f64(x));
        let Moments { deviation, momentum: p, rho, u } = *cells;
        let sum = |i: usize| g[i] + g[i + 1];
        let [s7, s9, s11, s13, s15, s17] = [sum(7), sum(9), sum(11), sum(13), sum(15), sum(17)];
        let isotropic = c(1.0 / 3.0) * deviation;
        let normal = |along: R, one: R, other: R, axis: usize| {
            p[axis].neg_mul_add(u[axis], ((along + one) + other).unscaled() - isotropic)
        };
        let shear = |plus: R, minus: R, a: usize, b: usize| p[a].neg_mul_add(u[b], (plus - minus).unscaled());
        let mut pi = [
            normal(sum(1), s7 + s9, s11 + s13, 0),
            normal(sum(3), s7 + s9, s15 + s17, 1),
            normal(sum(5), s11 + s13, s15 + s17, 2),
            shear(s7, s9, 0, 1),
            shear(s11, s13, 0, 2),
            shear(s15, s17, 1, 2),
        ];
        let mut k = R::splat(row.factors.even);
        if row.eddies > S::Number::ZERO {
            let [xx, yy, zz, xy, xz, yz] = pi;
            let diagonal = xx.mul_add(xx, yy.mul_add(yy, zz * zz));
            let size = c(2.0).mul_add(xy.mul_add(xy, xz.mul_add(xz, yz * yz)), diagonal).sqrt();
            let (tau, over_rho) = (R::splat(row.relaxation_time), rho.recip());
            let root = R::splat(row.eddies) * (size * over_rho);
            let all = c(0.5) * (tau + tau.mul_add(tau, root).sqrt());
            k = R::splat(S::Number::ONE) - all.recip();
        }
        // Loops: what `map` calls is not always inlined.
        for moment in &mut pi {
            *moment = k * *moment;
        }
        let [xx, yy, zz, xy, xz, yz] = pi;
        let t = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
        let q = [rho * t[0], rho * t[1], rho * t[2]];
        let normal = [q[0].mul_add(t[0], xx), q[1].mul_add(t[1], yy), q[2].mul_add(t[2], zz)];
        let third = |a: usize, b: usize, shear: R| t[a].mul_add(normal[b], (t[b] + t[b]) * shear);
        let third = [
            third(0, 1, xy),
            third(0, 2, xz),
            third(1, 0, xy),
            third(1, 2, yz),
            third(2, 0, xz),
            third(2, 1, yz),
        ];
        let (mut along, mut across) = (q, third);
        for axis in 0..3 {
            let linear = c(1.0 / 12.0) * q[axis];
            let both = [third[2 * axis], third[2 * axis + 1]];
            along[axis] = c(0.5).neg_mul_add(both[0] + both[1], linear + linear).scaled();
            for k in 0..2 {
                across[2 * axis + k] = c(0.25).mul_add(both[k], linear).scaled();
            }
        }
        let eighth = c(0.125);
        let diagonal = [eighth * normal[0], eighth * normal[1], eighth * normal[2]];
        let base = c(12.0).neg_mul_add((diagonal[0] + diagonal[1]) + diagonal[2], deviation);
        let shear = |shear: R, a: usize, b: usize| (c(0.25) * q[a].mul_add(t[b], shear)).scaled();
        Self {
            base: [(c(1.0 / 18.0) * base).scaled(), (c(1.0 / 36.0) * base).scaled()],
            quadratic: [
                diagonal[0].scaled(),
                diagonal[1].scaled(),
                diagonal[2].scaled(),
                shear(xy, 0, 1),
                shear(xz, 0, 2),
                shear(yz, 1, 2),
            ],
            along,
            across,
        }
    }

    /// The scaled populations of the pair that begins with direction `i`.
    #[inline(always)]
    fn pair<S: Population>(&self, i: usize) -> [R; 2]
    where
        R: PopulationLanes<S>,
    {
        let ([axis, diagonal], [xx, yy, zz, xy, xz, yz]) = (self.base, self.quadratic);
        let ([x, y, z], [x_y, x_z, y_x, y_z, z_x, z_y]) = (self.along, self.across);
        let (even, odd) = match i {
            1 => (axis + (xx + xx), x),
            3 => (axis + (yy + yy), y),
            5 => (axis + (zz + zz), z),
            7 => ((diagonal + (xx + yy)) + xy, x_y + y_x),
            9 => ((diagonal + (xx + yy)) - xy, x_y - y_x),
            11 => ((diagonal + (xx + zz)) + xz, x_z + z_x),
            13 => ((diagonal + (xx + zz)) - xz, x_z - z_x),
            15 => ((diagonal + (yy + zz)) + yz, y_z + z_y),
            _ => ((diagonal + (yy + zz)) - yz, y_z - z_y),
        };
        [even + odd, even - odd]
    }

    /// Writes the cells at `x`; of a register in which solids cover some, only the others.
    ///
    /// # Safety
    /// `WIDTH` populations can be read and written at `x` of all slots.
    #[inline(always)]
    pub(super) unsafe fn store<S: Population>(&self, slots: &Slots<S>, x: usize, solid: Option<R>)
    where
        R: PopulationLanes<S>,
    {
        let zero = R::splat(S::Number::ZERO);
        // SAFETY: promised by the caller.
        let open = |slot: usize, g: R| unsafe {
            match solid {
                Some(solid) => solid.if_greater(zero, R::load_scaled(slots[slot].add(x)), g),
                None => g,
            }
        };
        // SAFETY: promised by the caller.
        unsafe {
            let six = R::splat(S::Number::from_f64(6.0));
            open(0, six * self.base[0]).store_scaled(slots[0].add(x));
            for i in (1..Q).step_by(2) {
                let [there, back] = self.pair::<S>(i);
                store_pair(slots, x, i, [open(i + 1, there), open(i, back)]);
            }
        }
    }
}
