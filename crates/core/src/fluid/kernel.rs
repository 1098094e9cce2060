//! Collision and in-place streaming, written once for every precision and instruction set.
//!
//! Populations are stored minus their weights, `g_i = f_i - w_i`, so that single precision keeps small deviations.
//!
//! ```text
//! f' = f - (f - feq(rho, u)) / tau + feq(rho, u*) - feq(rho, u),     rho u = sum c_i f_i      exact difference
//! u* = B (u + a) + (1 - B) u_s,   B = prod (1 - phi_k)                                        homogenised cells
//! f' = f + (1 - b) W_fluid + b W_solid,   b = e t / ((1 - e) + t + l),   t = tau - 1/2        partially saturated cells
//! ```
//!
//! with body acceleration `a`, solid fractions `phi_k` and velocity `u_s`, volume fraction `e`, leak `l`.
//! `docs/theory/fluid.md` has TRT, the operators sc1 to sc3 ([`SolidCollision`]), the leak, and streaming
//! ([`Layout::places`](super::layout::Layout::places)).
//!
//! References: Kupershtokh et al. (2009), doi:10.1016/j.camwa.2009.02.024; Krause et al. (2017),
//! doi:10.1016/j.partic.2016.11.001; Marquardt et al. (2024), doi:10.1016/j.cpc.2024.109321 (its Eq. (15) has the
//! wrong sign: `u* - u = (1 - B)(u_s - u)`); Ginzburg et al. (2008), Commun. Comput. Phys. 3, 427; Noble and
//! Torczynski (1998), doi:10.1142/S0129183198001084; Rettinger and Ruede (2017),
//! doi:10.1016/j.compfluid.2017.05.033.

use super::SolidCollision;
use super::covered::Covered;
use super::simd::{Lanes, prefetch};
use super::solid::{CHUNK, SolidRow};
use crate::lattice::{C, Q, W, opposite};
use std::ops::{Add, Mul, Range, Sub};

/// Density deviation, momentum, density and velocity of a register of cells.
#[inline(always)]
pub(crate) fn moments<T: Number, R: Lanes<T>>(g: &[R; Q]) -> (R, [R; 3], R, [R; 3]) {
    let pair = |i: usize| (g[i] + g[i + 1], g[i] - g[i + 1]);
    let ((s1, d1), (s3, d3), (s5, d5)) = (pair(1), pair(3), pair(5));
    let ((s7, d7), (s9, d9), (s11, d11)) = (pair(7), pair(9), pair(11));
    let ((s13, d13), (s15, d15), (s17, d17)) = (pair(13), pair(15), pair(17));
    let deviation = ((g[0] + s1) + (s3 + s5)) + ((s7 + s9) + (s11 + s13)) + (s15 + s17);
    let rho = R::splat(T::ONE) + deviation;
    let over_rho = rho.recip();
    let momentum =
        [d1 + ((d7 + d9) + (d11 + d13)), d3 + ((d7 - d9) + (d15 + d17)), d5 + ((d11 - d13) + (d15 - d17))];
    let u = [momentum[0] * over_rho, momentum[1] * over_rho, momentum[2] * over_rho];
    (deviation, momentum, rho, u)
}

/// Relaxation factors of a deviation from equilibrium: `1 - 1/tau` of its even and of its odd part. One relaxation
/// time ignores the second.
#[derive(Clone, Copy)]
pub(crate) struct Keep<T> {
    pub(crate) even: T,
    pub(crate) odd: T,
}

/// Relaxes a register of cells at velocity `u` and pushes it to `target`, with two relaxation times if `TRT`.
///
/// With a solid (sc3) the fraction `1 - b` of the cell is relaxed and the fraction `b` reflected: in the even part of
/// a pair `f_i + f_-i` stays, in the odd part `f_i - f_-i` turns round and gains that of the equilibrium at twice
/// `u_s`. Cells of `b = 0` come to the same bits as with two relaxation times and without a solid.
#[inline(always)]
fn relax<T: Number, R: Lanes<T>, const TRT: bool>(
    g: &mut [R; Q],
    deviation: R,
    rho: R,
    u: [R; 3],
    target: [R; 3],
    keep: Keep<T>,
    reflected: Option<&Saturation<R>>,
) {
    // f' = keep (f - feq(u)) + feq(u*), per pair of opposite directions an even part e and an odd part o.
    let c = |x: f64| R::splat(T::from_f64(x));
    let k = R::splat(keep.even);
    let k_odd = if TRT { R::splat(keep.odd) } else { k };
    let (mut rest, mut half, mut half_odd) = (k, c(0.5) * k, c(0.5) * k_odd);
    let square = |v: [R; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let mut base = (R::splat(T::ONE) - k) * deviation - c(1.5) * rho * (square(target) - k * square(u));
    let (mut quadratic, linear) = (c(4.5) * rho, c(3.0) * rho);
    let mut odd = [target[0] - k_odd * u[0], target[1] - k_odd * u[1], target[2] - k_odd * u[2]];
    if let Some(solid) = reflected {
        let b = solid.weight;
        let (open, half_b) = (R::splat(T::ONE) - b, c(0.5) * b);
        (rest, half, half_odd) = (open * rest + b, open * half + half_b, open * half_odd - half_b);
        (base, quadratic) = (open * base, open * quadratic);
        for (odd, v) in odd.iter_mut().zip(solid.velocity) {
            *odd = open * *odd + b * (v + v);
        }
    }
    let scaled = |w: f64| (c(w) * base, c(w) * quadratic, c(w) * linear);
    let (axis, diagonal) = (scaled(1.0 / 18.0), scaled(1.0 / 36.0));

    g[0] = rest * g[0] + c(1.0 / 3.0) * base;
    macro_rules! pair {
        ($i:literal, $w:ident, $along:expr) => {{
            let along = $along;
            let (cu, ct, co) = (along(u), along(target), along(odd));
            let e = $w.0 + $w.1 * (ct * ct - k * (cu * cu));
            let o = $w.2 * co;
            if TRT || reflected.is_some() {
                let even = half * (g[$i] + g[$i + 1]) + e;
                let odd = half_odd * (g[$i] - g[$i + 1]) + o;
                (g[$i], g[$i + 1]) = (even + odd, even - odd);
            } else {
                g[$i] = k * g[$i] + (e + o);
                g[$i + 1] = k * g[$i + 1] + (e - o);
            }
        }};
    }
    pair!(1, axis, |v: [R; 3]| v[0]);
    pair!(3, axis, |v: [R; 3]| v[1]);
    pair!(5, axis, |v: [R; 3]| v[2]);
    pair!(7, diagonal, |v: [R; 3]| v[0] + v[1]);
    pair!(9, diagonal, |v: [R; 3]| v[0] - v[1]);
    pair!(11, diagonal, |v: [R; 3]| v[0] + v[2]);
    pair!(13, diagonal, |v: [R; 3]| v[0] - v[2]);
    pair!(15, diagonal, |v: [R; 3]| v[1] + v[2]);
    pair!(17, diagonal, |v: [R; 3]| v[1] - v[2]);
}

/// Solid operator of a register of cells, sc1 and sc2, mixed with the relaxed populations of `before`; cells of
/// weight 0 keep every bit.
#[inline(always)]
fn saturate<T: Number, R: Lanes<T>, const TRT: bool>(
    g: &mut [R; Q],
    before: &[R; Q],
    solid: &Saturation<R>,
    row: &Row<T>,
) {
    let Saturation { weight: b, deviation, rho, u, velocity: v } = *solid;
    let c = |x: f64| R::splat(T::from_f64(x));
    let mut pulled = *before;
    if row.solids == SolidCollision::Sc2 {
        relax::<T, R, TRT>(&mut pulled, deviation, rho, u, v, row.keep, None);
    } else {
        // f_-i + feq_i(u_s) - feq_-i(u): with weights taken off, even and odd parts of the difference.
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
    for i in 0..Q {
        g[i] = g[i] + b * (pulled[i] - g[i]);
    }
}

/// Partially saturated cells.
struct Saturation<R> {
    /// `b`.
    weight: R,
    deviation: R,
    rho: R,
    /// Velocity of the fluid.
    u: [R; 3],
    /// Velocity of the solid.
    velocity: [R; 3],
}

/// Memory slots of the populations of the first cell of a row: `places[i]` is read as `f_i` and written as `f'` of the
/// opposite direction.
pub(crate) type Places<T> = [*mut T; Q];

/// Data of a row besides its populations.
pub(crate) struct Row<T> {
    /// Number of registers of [`CHUNK`] cells.
    pub(crate) chunks: usize,
    /// Relaxation factors.
    pub(crate) keep: Keep<T>,
    /// Body acceleration.
    pub(crate) acceleration: [T; 3],
    /// Collision of cells that solids cover.
    pub(crate) solids: SolidCollision,
    /// `t = tau - 1/2`.
    pub(crate) above_half: T,
    /// Momentum that the operator of the solids takes, over `rho (u_s - u)`.
    pub(crate) reflection: T,
}

/// Momentum of solids and fluid along a row, written by a measuring sweep; at least `chunks * CHUNK` numbers each.
pub(crate) struct Measured<T> {
    pub(crate) momentum: [Vec<T>; 3],
}

impl<T: Number> Measured<T> {
    /// Forgets some cells.
    pub(crate) fn clear(&mut self, cells: Range<usize>) {
        for momentum in &mut self.momentum {
            momentum[cells.clone()].fill(T::ZERO);
        }
    }
}

/// Bytes of a cache line.
const LINE: usize = 64;
/// Prefetch distance of populations (bytes). Measured: half and twice the distance are a few per cent
/// slower, none at all by a third.
const AHEAD: usize = 768;

/// Collides and streams one row in place, without chunks that are `dead`; the list may be shorter than the row, or
/// empty.
///
/// # Safety
/// For every `i`, `chunks * CHUNK` numbers can be read and written at `places[i]`, and no two of these ranges overlap.
#[inline(always)]
pub(crate) unsafe fn sweep_row<T: Number, R: Lanes<T>, const TRT: bool, const MEASURE: bool>(
    places: &Places<T>,
    row: &Row<T>,
    dead: &[bool],
    solids: &mut SolidRow<T>,
    measured: &mut Measured<T>,
) {
    let [ax, ay, az] = row.acceleration;
    let a = [R::splat(ax), R::splat(ay), R::splat(az)];
    let one = R::splat(T::ONE);
    for chunk in 0..row.chunks {
        if dead.get(chunk) == Some(&true) {
            continue;
        }
        let is_solid = solids.is_used(chunk);
        for first in (0..CHUNK).step_by(R::WIDTH) {
            let x = chunk * CHUNK + first;
            if x.is_multiple_of(LINE / size_of::<T>()) {
                for place in places {
                    prefetch(place.wrapping_add(x).wrapping_byte_add(AHEAD));
                }
            }
            // A loop: what `array::from_fn` calls is not always inlined, and then not compiled for the instruction set.
            let mut g = [one; Q];
            for (g, place) in g.iter_mut().zip(places) {
                // SAFETY: x + WIDTH <= chunks * CHUNK, promised readable by the caller.
                *g = unsafe { R::load(place.add(x)) };
            }
            let (deviation, momentum, rho, u) = moments(&g);
            let mut target = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
            let (mut saturation, mut mean) = (None, momentum);
            if is_solid {
                // SAFETY: x + WIDTH <= chunks * CHUNK.
                let covered = unsafe { Covered::<R>::load(solids, x) };
                let Covered { open, solid, weight, velocity, .. } = covered;
                // SAFETY: as above, and the arrays hold a chunk more.
                let put = |values: &mut [T], r: R| unsafe { r.store(values.as_mut_ptr().add(x)) };
                if row.solids == SolidCollision::ExactDifference {
                    for axis in 0..3 {
                        target[axis] = target[axis] + solid * (velocity[axis] - target[axis]);
                        put(&mut solids.incoming[axis], momentum[axis]);
                        put(&mut solids.outgoing[axis], rho * target[axis]);
                    }
                    put(&mut solids.incoming[3], deviation - g[0]);
                } else {
                    let t = R::splat(row.above_half);
                    let (through, b) = covered.reflecting(t);
                    // Exactly one where there is no solid: such a cell must not depend on the others in its register.
                    let share = one - solid * through * (through + open * t).recip();
                    let given = b * rho * R::splat(row.reflection);
                    for axis in 0..3 {
                        let push = share * a[axis];
                        target[axis] = u[axis] + push;
                        let force = given * (u[axis] - velocity[axis]);
                        let left = momentum[axis] + (one - b) * rho * push - force;
                        let inside = solid * (left - rho * velocity[axis]);
                        mean[axis] = covered.with_solid(momentum[axis], rho, axis);
                        put(&mut solids.incoming[axis], weight * (force + inside));
                        put(&mut solids.outgoing[axis], weight * inside);
                    }
                    saturation = Some(Saturation { weight: b, deviation, rho, u, velocity });
                }
            }
            if MEASURE {
                for axis in 0..3 {
                    let place = &mut measured.momentum[axis][x..x + R::WIDTH];
                    // SAFETY: the slice above has WIDTH numbers.
                    unsafe { mean[axis].store(place.as_mut_ptr()) };
                }
            }
            match &saturation {
                Some(saturation) if row.solids == SolidCollision::Sc3 => {
                    relax::<T, R, TRT>(&mut g, deviation, rho, u, target, row.keep, Some(saturation));
                }
                Some(saturation) => {
                    let before = g;
                    relax::<T, R, TRT>(&mut g, deviation, rho, u, target, row.keep, None);
                    saturate::<T, R, TRT>(&mut g, &before, saturation, row);
                }
                None => {
                    relax::<T, R, TRT>(&mut g, deviation, rho, u, target, row.keep, None);
                    if is_solid {
                        // SAFETY: as above.
                        unsafe { (deviation - g[0]).store(solids.outgoing[3].as_mut_ptr().add(x)) };
                    }
                }
            }
            // SAFETY: as for the loads.
            unsafe {
                g[0].store(places[0].add(x));
                for i in (1..Q).step_by(2) {
                    g[i].store(places[i + 1].add(x));
                    g[i + 1].store(places[i].add(x));
                }
            }
        }
    }
}

/// Constants and conversions the kernels need of a storage type.
pub trait Number:
    Copy + PartialOrd + Into<f64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Smaller than any solid fraction that matters, larger than zero.
    const TINY: Self;
    /// 0, 1, 2, ...
    const LANE: [Self; CHUNK];
    /// [`CHUNK`] zeros, then [`CHUNK`] ones.
    const STEP: [Self; 2 * CHUNK];
    /// Rounds.
    fn from_f64(x: f64) -> Self;
}

macro_rules! number {
    ($t:ty) => {
        impl Number for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const TINY: Self = 1e-30;
            const LANE: [Self; CHUNK] = {
                let mut lane = [0.0; CHUNK];
                let mut k = 0;
                while k < CHUNK {
                    lane[k] = k as Self;
                    k += 1;
                }
                lane
            };
            const STEP: [Self; 2 * CHUNK] = {
                let mut step = [0.0; 2 * CHUNK];
                let mut k = CHUNK;
                while k < 2 * CHUNK {
                    step[k] = 1.0;
                    k += 1;
                }
                step
            };
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as Self
            }
        }
    };
}
number!(f32);
number!(f64);
