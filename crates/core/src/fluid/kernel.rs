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
use super::population::{Population, PopulationLanes};
use super::regularised::Regularised;
use super::simd::{Lanes, prefetch};
use super::solid::{CHUNK, SolidModel};
use super::solid_row::SolidRow;
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

impl<R: Copy> Moments<R> {
    /// Momentum midway between before and after a collision that adds `gained`.
    #[inline(always)]
    pub(crate) fn midway<T: Real>(&self, gained: [R; 3]) -> [R; 3]
    where
        R: Lanes<T>,
    {
        let mut midway = self.momentum;
        for axis in 0..3 {
            midway[axis] = R::splat(T::from_f64(0.5)).mul_add(gained[axis], midway[axis]);
        }
        midway
    }

    /// The same where there is no solid, under an acceleration.
    #[inline(always)]
    pub(crate) fn driven<T: Real>(&self, a: [R; 3]) -> [R; 3]
    where
        R: Lanes<T>,
    {
        self.midway([self.rho * a[0], self.rho * a[1], self.rho * a[2]])
    }
}

/// Collision operator of cells without solids, compiled into the sweep.
pub trait Operator {
    /// Even and odd part of a pair of opposite populations relax apart.
    const PAIRS: bool;
    /// Of the deviation from equilibrium only what [`Regularised`] keeps is left; cells with solids relax in pairs.
    const REGULARISED: bool = false;
}

/// One relaxation time.
pub(crate) struct OneTime;
impl Operator for OneTime {
    const PAIRS: bool = false;
}

/// Two relaxation times.
pub struct TwoTimes;
impl Operator for TwoTimes {
    const PAIRS: bool = true;
}

/// The recursive regularised collision.
pub struct Recursive;
impl Operator for Recursive {
    const PAIRS: bool = true;
    const REGULARISED: bool = true;
}

/// Moments of a register of cells from scaled populations.
#[inline(always)]
pub(crate) fn moments<S: Population, R: PopulationLanes<S>>(g: &[R; Q]) -> Moments<R> {
    let pair = |i: usize| (g[i] + g[i + 1], g[i] - g[i + 1]);
    let ((s1, d1), (s3, d3), (s5, d5)) = (pair(1), pair(3), pair(5));
    let ((s7, d7), (s9, d9), (s11, d11)) = (pair(7), pair(9), pair(11));
    let ((s13, d13), (s15, d15), (s17, d17)) = (pair(13), pair(15), pair(17));
    let deviation = (((g[0] + s1) + (s3 + s5)) + ((s7 + s9) + (s11 + s13)) + (s15 + s17)).unscaled();
    let rho = R::splat(S::Number::ONE) + deviation;
    let over_rho = rho.recip();
    let momentum = [
        (d1 + ((d7 + d9) + (d11 + d13))).unscaled(),
        (d3 + ((d7 - d9) + (d15 + d17))).unscaled(),
        (d5 + ((d11 - d13) + (d15 - d17))).unscaled(),
    ];
    let u = [momentum[0] * over_rho, momentum[1] * over_rho, momentum[2] * over_rho];
    Moments { deviation, momentum, rho, u }
}

/// Factors `1 - 1/tau` of the even and the odd part of a deviation from equilibrium; with one relaxation time the first.
#[derive(Clone, Copy)]
pub(crate) struct RelaxationFactors<T> {
    pub(crate) even: T,
    pub(crate) odd: T,
}

/// Solids that reflect populations (sc3), by weights that are 0 where there is no solid.
#[derive(Clone, Copy)]
pub(crate) struct Reflection<R> {
    /// Part of the momentum relative to the solid that is reflected.
    pub(crate) b: R,
    /// Loss of relaxation of the even part, as a fraction of its rate, and gain of that of the odd part.
    pub(crate) even: R,
    pub(crate) odd: R,
    /// `u_s`.
    pub(crate) velocity: [R; 3],
}

/// Change of the populations of a register of cells by a collision: relaxation, and the push to a velocity `u*`.
///
/// ```text
/// even part of a pair   (k (f_i + f_-i) / 2) + w_i (B + 4.5 rho (c.Q.c)),   Q = u* u* - k u u,   B = (1 - k) (rho - 1) - 1.5 rho tr Q
/// odd part of a pair    (k_odd (f_i - f_-i) / 2) + 3 w_i rho c.(u* - k_odd u)
/// ```
#[derive(Clone, Copy)]
pub(crate) struct Relaxation<R> {
    /// Factors of the population at rest (`k`), and of sums and differences of pairs.
    rest: R,
    half: R,
    half_odd: R,
    /// `B` times the weights along axes and diagonals.
    base: [R; 2],
    /// `rho Q / 8`: `xx`, `yy`, `zz`, then twice `xy`, `xz`, `yz`.
    quadratic: [R; 6],
    /// `rho (u* - k_odd u) / 12`.
    linear: [R; 3],
}

impl<R: Copy> Relaxation<R> {
    /// Relaxes the cells and pushes them to the velocity `target`, with two relaxation times if the operator has them.
    ///
    /// With a solid that reflects the even part of a pair relaxes less and the odd part more, until all of `f_i + f_-i` stays and
    /// `f_i - f_-i` changes sign; the momentum changes by `rho ((1 - b) (u* - u) - 2 b (u - u_s))`. Cells without a solid get
    /// the same bits as with two relaxation times and without a reflection.
    #[inline(always)]
    pub(crate) fn new<T: Real, O: Operator>(
        cells: &Moments<R>,
        target: [R; 3],
        factors: RelaxationFactors<T>,
        reflected: Option<Reflection<R>>,
    ) -> Self
    where
        R: Lanes<T>,
    {
        let Moments { deviation, rho, u, .. } = *cells;
        let c = |x: f64| R::splat(T::from_f64(x));
        let k = R::splat(factors.even);
        let k_odd = if O::PAIRS { R::splat(factors.odd) } else { k };
        let (mut rest, mut half_odd) = (k, c(0.5) * k_odd);
        let (mut deviation, mut scale) = ((R::splat(T::ONE) - k) * deviation, c(0.125) * rho);
        let mut odd = u;
        for axis in 0..3 {
            odd[axis] = k_odd.neg_mul_add(u[axis], target[axis]);
        }
        if let Some(Reflection { b, even, odd: more, velocity: v }) = reflected {
            let open = R::splat(T::ONE) - even;
            rest = open.mul_add(rest, even);
            half_odd = c(0.5).neg_mul_add(more, half_odd);
            (deviation, scale) = (open * deviation, open * scale);
            for axis in 0..3 {
                let relative = (target[axis] - v[axis]) + (u[axis] - v[axis]);
                odd[axis] = more.mul_add(u[axis], b.neg_mul_add(relative, odd[axis]));
            }
        }
        let ku = [k * u[0], k * u[1], k * u[2]];
        let product = |a: usize, b: usize| target[a].mul_sub(target[b], ku[a] * u[b]);
        let double = scale + scale;
        let (xx, yy, zz) = (scale * product(0, 0), scale * product(1, 1), scale * product(2, 2));
        let base = c(12.0).neg_mul_add((xx + yy) + zz, deviation);
        let along = c(1.0 / 12.0) * rho;
        Self {
            rest,
            half: c(0.5) * rest,
            half_odd,
            base: [c(1.0 / 18.0) * base, c(1.0 / 36.0) * base],
            quadratic: [xx, yy, zz, double * product(0, 1), double * product(0, 2), double * product(1, 2)],
            linear: [along * odd[0], along * odd[1], along * odd[2]],
        }
    }

    /// The population at rest afterwards.
    #[inline(always)]
    pub(crate) fn at_rest<T: Real>(&self, g: R) -> R
    where
        R: Lanes<T>,
    {
        self.rest.mul_add(g, R::splat(T::from_f64(6.0)) * self.base[0])
    }

    /// The populations `g_i, g_-i` of the pair that begins with direction `i` afterwards; even and odd part apart if `O::PAIRS`.
    #[inline(always)]
    pub(crate) fn pair<T: Real, O: Operator>(&self, i: usize, [there, back]: [R; 2]) -> [R; 2]
    where
        R: Lanes<T>,
    {
        let ([axis, diagonal], [xx, yy, zz, xy, xz, yz], [x, y, z]) =
            (self.base, self.quadratic, self.linear);
        let (e, o) = match i {
            1 => (axis + (xx + xx), x + x),
            3 => (axis + (yy + yy), y + y),
            5 => (axis + (zz + zz), z + z),
            7 => ((diagonal + (xx + yy)) + xy, x + y),
            9 => ((diagonal + (xx + yy)) - xy, x - y),
            11 => ((diagonal + (xx + zz)) + xz, x + z),
            13 => ((diagonal + (xx + zz)) - xz, x - z),
            15 => ((diagonal + (yy + zz)) + yz, y + z),
            _ => ((diagonal + (yy + zz)) - yz, y - z),
        };
        if O::PAIRS {
            let even = self.half.mul_add(there + back, e);
            let odd = self.half_odd.mul_add(there - back, o);
            [even + odd, even - odd]
        } else {
            [self.rest.mul_add(there, e + o), self.rest.mul_add(back, e - o)]
        }
    }

    /// The same for scaled populations.
    #[inline(always)]
    fn scaled<S: Population>(&self) -> Self
    where
        R: PopulationLanes<S>,
    {
        let (mut all, Self { base: [axis, diagonal], .. }) = (*self, *self);
        all.base = [axis.scaled(), diagonal.scaled()];
        // Loops: what `map` calls is not always inlined.
        for term in &mut all.quadratic {
            *term = term.scaled();
        }
        for term in &mut all.linear {
            *term = term.scaled();
        }
        all
    }

    /// Changes the populations of the cells at `x` in memory, and returns the one at rest. They are read again, as there are
    /// more of them than registers, unless they are `kept`, scaled, since it takes a conversion.
    ///
    /// # Safety
    /// `WIDTH` numbers can be read and written at `x` of all slots.
    #[inline(always)]
    pub(crate) unsafe fn apply<S: Population, O: Operator>(
        &self,
        slots: &Slots<S>,
        x: usize,
        kept: Option<&[R; Q]>,
    ) -> R
    where
        R: PopulationLanes<S>,
    {
        let scaled = self.scaled::<S>();
        // SAFETY: promised by the caller.
        unsafe {
            let at_rest = scaled.at_rest(match kept {
                Some(g) => g[0],
                None => R::load_scaled(slots[0].add(x)),
            });
            at_rest.store_scaled(slots[0].add(x));
            for i in (1..Q).step_by(2) {
                let pair = match kept {
                    Some(g) => [g[i], g[i + 1]],
                    None => [R::load_scaled(slots[i].add(x)), R::load_scaled(slots[i + 1].add(x))],
                };
                store_pair(slots, x, i, scaled.pair::<S::Number, O>(i, pair));
            }
            at_rest.unscaled()
        }
    }
}

/// Writes a pair of opposite, scaled populations where the next step reads them.
///
/// # Safety
/// `WIDTH` numbers can be written at `x` of all slots.
#[inline(always)]
pub(crate) unsafe fn store_pair<S: Population, R: PopulationLanes<S>>(
    slots: &Slots<S>,
    x: usize,
    i: usize,
    [there, back]: [R; 2],
) {
    // SAFETY: promised by the caller.
    unsafe {
        there.store_scaled(slots[i + 1].add(x));
        back.store_scaled(slots[i].add(x));
    }
}

/// Memory slots of the populations of the first cell of a row: `slots[i]` is read as `f_i` and written as `f'` of the
/// opposite direction.
pub(crate) type Slots<S> = [*mut S; Q];

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
    /// `tau`, and the [factor of eddies](super::regularised::eddy_factor).
    pub(super) relaxation_time: T,
    pub(super) eddies: T,
}

/// Momentum of solids and fluid along a row, written by a measuring sweep; at least `chunks * CHUNK` numbers each.
pub(crate) struct Measured<T> {
    pub(crate) momentum: [Vec<T>; 3],
    /// Of the fluid alone, in a sweep that is asked for rows.
    pub(crate) bare: Option<Bare<T>>,
}

/// Velocity and density deviation of the populations along a row; as long.
pub(crate) struct Bare<T> {
    pub(crate) u: [Vec<T>; 3],
    pub(crate) deviation: Vec<T>,
}

impl<T: Real> Bare<T> {
    pub(crate) fn new(chunks: usize) -> Self {
        let zeros = || vec![T::ZERO; chunks * CHUNK];
        Self { u: std::array::from_fn(|_| zeros()), deviation: zeros() }
    }

    /// # Safety
    /// Called where the instructions of `R` may be used; the row has whole registers from `x` on.
    #[inline(always)]
    pub(crate) unsafe fn put<R: Lanes<T>>(&mut self, x: usize, cells: &Moments<R>) {
        // SAFETY: promised by the caller.
        unsafe {
            put(&mut self.deviation, x, cells.deviation);
            (0..3).for_each(|a| put(&mut self.u[a], x, cells.u[a]));
        }
    }
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
pub(super) const LINE: usize = 64;
/// Prefetch distance of populations (bytes). Measured: half and twice are a few per cent slower, none by a third.
pub(super) const AHEAD: usize = 768;

/// Collides and streams one row in place, without chunks that are `dead`; the list may be shorter than the row, or
/// empty.
///
/// # Safety
/// For every `i`, `chunks * CHUNK` numbers can be read and written at `slots[i]`, and no two of these ranges overlap.
#[inline(always)]
pub(crate) unsafe fn sweep_row<
    S: Population,
    R: PopulationLanes<S>,
    M: SolidModel,
    O: Operator,
    const MEASURE: bool,
>(
    slots: &Slots<S>,
    row: &Row<S::Number>,
    model: M,
    dead: &[bool],
    solids: &mut SolidRow<S::Number>,
    measured: &mut Measured<S::Number>,
) {
    let [ax, ay, az] = row.acceleration;
    let a = [R::splat(ax), R::splat(ay), R::splat(az)];
    for chunk in 0..row.chunks {
        if dead.get(chunk) == Some(&true) {
            continue;
        }
        for first in (0..CHUNK).step_by(R::WIDTH) {
            let x = chunk * CHUNK + first;
            if x.is_multiple_of(LINE / size_of::<S>()) {
                for slot in slots {
                    prefetch(slot.wrapping_add(x).wrapping_byte_add(AHEAD));
                }
            }
            // A loop: what `array::from_fn` calls is not always inlined, and then not compiled for the instruction set.
            let mut g = [R::splat(S::Number::ONE); Q];
            for (g, slot) in g.iter_mut().zip(slots) {
                // SAFETY: x + WIDTH <= chunks * CHUNK, promised readable by the caller.
                *g = unsafe { R::load_scaled(slot.add(x)) };
            }
            let cells = moments::<S, R>(&g);
            let mean = if solids.is_used(x, R::WIDTH) {
                // SAFETY: x + WIDTH <= chunks * CHUNK.
                let mean = unsafe { model.collide::<S, R, O>(slots, &cells, a, row, solids, x) };
                if O::REGULARISED {
                    // SAFETY: as for the loads; the arrays of solids hold a chunk more than the row.
                    unsafe {
                        let solid = R::load(solids.fraction.as_ptr().add(x));
                        Regularised::new::<S>(&g, &cells, a, row).store::<S>(slots, x, Some(solid));
                    }
                }
                mean
            } else if O::REGULARISED {
                // SAFETY: as for the loads.
                unsafe { Regularised::new::<S>(&g, &cells, a, row).store::<S>(slots, x, None) };
                if M::MIDWAY { cells.driven(a) } else { cells.momentum }
            } else {
                let u = cells.u;
                let target = [u[0] + a[0], u[1] + a[1], u[2] + a[2]];
                let relaxation = Relaxation::new::<S::Number, O>(&cells, target, row.factors, None);
                let kept = if S::IS_CONVERTED { Some(&g) } else { None };
                // SAFETY: as for the loads.
                unsafe { relaxation.apply::<S, O>(slots, x, kept) };
                if M::MIDWAY { cells.driven(a) } else { cells.momentum }
            };
            if MEASURE {
                for axis in 0..3 {
                    // SAFETY: the array has at least `chunks * CHUNK` numbers.
                    unsafe { put(&mut measured.momentum[axis], x, mean[axis]) };
                }
                if let Some(bare) = &mut measured.bare {
                    // SAFETY: as above.
                    unsafe { bare.put::<R>(x, &cells) };
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
