//! Collision and in-place streaming, written once for every precision and instruction set.
//!
//! Populations are stored minus their weights, `g_i = f_i - w_i`, so that single precision keeps small deviations.
//!
//! ```text
//! f' = f - (f - feq(rho, u)) / tau + feq(rho, u + a) - feq(rho, u),     rho u = sum c_i f_i,  a = body acceleration
//! ```
//!
//! Cells that solids cover collide as their [`SolidModel`] says. `docs/theory/fluid.md` has TRT and streaming
//! ([`Layout::slots`](super::layout::Layout::slots)).
//!
//! References: Kupershtokh et al. (2009), doi:10.1016/j.camwa.2009.02.024; Ginzburg et al. (2008), Commun. Comput.
//! Phys. 3, 427.

use super::Real;
use super::simd::{Lanes, prefetch};
use super::solid::{CHUNK, SolidModel, SolidRow};
use crate::lattice::Q;
use std::ops::Range;

/// Density deviation, momentum, density and velocity of a register of cells.
#[derive(Clone, Copy)]
pub struct Moments<R> {
    pub(crate) deviation: R,
    pub(crate) momentum: [R; 3],
    pub(crate) rho: R,
    pub(crate) u: [R; 3],
}

/// Moments of a register of cells.
#[inline(always)]
pub(crate) fn moments<T: Real, R: Lanes<T>>(g: &[R; Q]) -> Moments<R> {
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
    Moments { deviation, momentum, rho, u }
}

/// Factors `1 - 1/tau` of the even and the odd part of a deviation from equilibrium; with one relaxation time the first.
#[derive(Clone, Copy)]
pub(crate) struct RelaxationFactors<T> {
    pub(crate) even: T,
    pub(crate) odd: T,
}

/// Relaxes a register of cells and pushes it to the velocity `target`, with two relaxation times if `TRT`.
///
/// With `reflected = (b, u_s)` (sc3) the fraction `1 - b` of the cell is relaxed and the fraction `b` reflected: in the even
/// part of a pair `f_i + f_-i` stays, in the odd part `f_i - f_-i` changes sign and gains that of the equilibrium at twice
/// `u_s`. Cells of `b = 0` get the same bits as with two relaxation times and without a solid.
#[inline(always)]
pub(crate) fn relax<T: Real, R: Lanes<T>, const TRT: bool>(
    g: &mut [R; Q],
    cells: &Moments<R>,
    target: [R; 3],
    factors: RelaxationFactors<T>,
    reflected: Option<(R, [R; 3])>,
) {
    let Moments { deviation, rho, u, .. } = *cells;
    // f' = k (f - feq(u)) + feq(u*), per pair of opposite directions an even part e and an odd part o.
    let c = |x: f64| R::splat(T::from_f64(x));
    let k = R::splat(factors.even);
    let k_odd = if TRT { R::splat(factors.odd) } else { k };
    let (mut rest, mut half, mut half_odd) = (k, c(0.5) * k, c(0.5) * k_odd);
    let square = |v: [R; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let mut base = (R::splat(T::ONE) - k) * deviation - c(1.5) * rho * (square(target) - k * square(u));
    let (mut quadratic, linear) = (c(4.5) * rho, c(3.0) * rho);
    let mut odd = [target[0] - k_odd * u[0], target[1] - k_odd * u[1], target[2] - k_odd * u[2]];
    if let Some((b, velocity)) = reflected {
        let (open, half_b) = (R::splat(T::ONE) - b, c(0.5) * b);
        (rest, half, half_odd) = (open * rest + b, open * half + half_b, open * half_odd - half_b);
        (base, quadratic) = (open * base, open * quadratic);
        for (odd, v) in odd.iter_mut().zip(velocity) {
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

/// Memory slots of the populations of the first cell of a row: `slots[i]` is read as `f_i` and written as `f'` of the
/// opposite direction.
pub(crate) type Slots<T> = [*mut T; Q];

/// Data of a row besides its populations.
pub struct Row<T> {
    /// Number of registers of [`CHUNK`] cells.
    pub(crate) chunks: usize,
    /// Relaxation factors.
    pub(crate) factors: RelaxationFactors<T>,
    /// Body acceleration.
    pub(crate) acceleration: [T; 3],
    /// `t = tau - 1/2`.
    pub(crate) above_half: T,
}

/// Momentum of solids and fluid along a row, written by a measuring sweep; at least `chunks * CHUNK` numbers each.
pub(crate) struct Measured<T> {
    pub(crate) momentum: [Vec<T>; 3],
}

impl<T: Real> Measured<T> {
    /// Forgets some cells.
    pub(crate) fn clear(&mut self, cells: Range<usize>) {
        for momentum in &mut self.momentum {
            momentum[cells.clone()].fill(T::ZERO);
        }
    }
}

/// Bytes of a cache line.
const LINE: usize = 64;
/// Prefetch distance of populations (bytes). Measured: half and twice are a few per cent slower, none by a third.
const AHEAD: usize = 768;

/// Collides and streams one row in place, without chunks that are `dead`; the list may be shorter than the row, or
/// empty.
///
/// # Safety
/// For every `i`, `chunks * CHUNK` numbers can be read and written at `slots[i]`, and no two of these ranges overlap.
#[inline(always)]
pub(crate) unsafe fn sweep_row<T: Real, R: Lanes<T>, M: SolidModel, const TRT: bool, const MEASURE: bool>(
    slots: &Slots<T>,
    row: &Row<T>,
    model: M,
    dead: &[bool],
    solids: &mut SolidRow<T>,
    measured: &mut Measured<T>,
) {
    let [ax, ay, az] = row.acceleration;
    let a = [R::splat(ax), R::splat(ay), R::splat(az)];
    for chunk in 0..row.chunks {
        if dead.get(chunk) == Some(&true) {
            continue;
        }
        let is_solid = solids.is_used(chunk);
        for first in (0..CHUNK).step_by(R::WIDTH) {
            let x = chunk * CHUNK + first;
            if x.is_multiple_of(LINE / size_of::<T>()) {
                for slot in slots {
                    prefetch(slot.wrapping_add(x).wrapping_byte_add(AHEAD));
                }
            }
            // A loop: what `array::from_fn` calls is not always inlined, and then not compiled for the instruction set.
            let mut g = [R::splat(T::ONE); Q];
            for (g, slot) in g.iter_mut().zip(slots) {
                // SAFETY: x + WIDTH <= chunks * CHUNK, promised readable by the caller.
                *g = unsafe { R::load(slot.add(x)) };
            }
            let cells = moments(&g);
            let mean = if is_solid {
                // SAFETY: x + WIDTH <= chunks * CHUNK.
                unsafe { model.collide::<T, R, TRT>(&mut g, &cells, a, row, solids, x) }
            } else {
                let u = cells.u;
                let target = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
                relax::<T, R, TRT>(&mut g, &cells, target, row.factors, None);
                cells.momentum
            };
            if MEASURE {
                for axis in 0..3 {
                    // SAFETY: the array has at least `chunks * CHUNK` numbers.
                    unsafe { put(&mut measured.momentum[axis], x, mean[axis]) };
                }
            }
            // SAFETY: as for the loads.
            unsafe {
                g[0].store(slots[0].add(x));
                for i in (1..Q).step_by(2) {
                    g[i].store(slots[i + 1].add(x));
                    g[i + 1].store(slots[i].add(x));
                }
            }
        }
    }
}

/// Writes a register to `values` from `x` on.
///
/// # Safety
/// `values` has `WIDTH` numbers from `x` on.
#[inline(always)]
pub(crate) unsafe fn put<T, R: Lanes<T>>(values: &mut [T], x: usize, r: R) {
    debug_assert!(x + R::WIDTH <= values.len());
    // SAFETY: promised by the caller.
    unsafe { r.store(values.as_mut_ptr().add(x)) };
}
