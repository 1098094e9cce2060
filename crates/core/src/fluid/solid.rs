//! Solid data of one row of cells, which exists only while the row is swept, and the collision of such cells.

use super::Real;
use super::bodies::{RowVelocity, Segment};
use super::kernel::{Moments, Row, Slots};
use super::population::{Population, PopulationLanes};
use super::simd::Lanes;
use crate::math::to_fixed;
use std::ops::Range;

/// Cells of the widest register of single precision: rows are padded to a multiple of this.
pub const CHUNK: usize = 16;

/// Cells that are looked at together where bodies cover some of them.
pub const GROUP: usize = 8;

/// Method of coupling solids to the fluid: collision of the cells they cover, compiled into the sweep.
pub trait SolidModel: Copy {
    /// Populations relax in pairs of opposite directions, even with one relaxation time: a cell without solids must not be
    /// rounded differently where it shares a register with one that has some.
    const PAIRS: bool;
    /// Solid fractions are of the volume: they add up to at most one, `B = max(0, 1 - sum e_k)`, and divide the momentum of
    /// a cell among bodies. Otherwise `B = prod (1 - phi_k)`, and each body receives what its own velocity says.
    const BY_VOLUME: bool;
    /// Measured momentum is that midway between before and after the collision, as velocities of fields are; otherwise that before it.
    const MIDWAY: bool;

    /// Collides the register of cells at `x` in place under the acceleration `a`, writes what the solids exchange to
    /// `solids`, and returns the measured momentum of solid and fluid.
    ///
    /// # Safety
    /// `WIDTH` numbers can be read and written at `x` of all slots, and the row has as many cells from there on.
    unsafe fn collide<S: Population, R: PopulationLanes<S>, const TRT: bool>(
        self,
        slots: &Slots<S>,
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<S::Number>,
        solids: &mut SolidRow<S::Number>,
        x: usize,
    ) -> [R; 3];

    /// Measures the change that [`collide`](Self::collide) would make to a register of cells.
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        row: &Row<T>,
    ) -> Measure<R>;

    /// Options of the preprocessor for the kernels of a device, besides `BY_VOLUME`.
    fn kernel_options(self) -> String {
        String::new()
    }

    /// Momentum that a cell of solid fraction `e` receives over `rho (u_s - u)` and over `rho a`; `t = tau - 1/2`.
    fn received(self, e: f64, t: f64) -> [f64; 2];
}

/// Momentum of a register of cells, as a collision would see it.
pub struct Measure<R> {
    /// That of solid and fluid.
    pub(crate) mean: [R; 3],
    /// Momentum that the solids receive.
    pub(crate) received: [R; 3],
    /// Part of the deviation from equilibrium that the solids keep from relaxing, if they do.
    pub(crate) reflected: Option<R>,
}

/// Solids in a register of cells.
pub struct Covered<R> {
    /// `B`, and `1 - B`.
    pub(crate) open: R,
    pub(crate) solid: R,
    /// By how much the volumes of several bodies exceed the cell.
    pub(crate) overlap: R,
    /// `u_s`; anything where there is no solid.
    pub(crate) velocity: [R; 3],
}

impl<R> Covered<R> {
    /// Those of the register at cell `x`.
    ///
    /// # Safety
    /// The row has `WIDTH` cells from `x` on.
    #[inline(always)]
    pub(crate) unsafe fn load<T: Real, M: SolidModel>(solids: &SolidRow<T>, x: usize) -> Self
    where
        R: Lanes<T>,
    {
        // SAFETY: promised by the caller; the arrays hold a chunk more.
        let at = |values: &[T]| unsafe { R::load(values.as_ptr().add(x)) };
        let (one, fraction) = (R::splat(T::ONE), at(&solids.fraction));
        let overlap = if M::BY_VOLUME { (fraction - one).max(R::splat(T::ZERO)) } else { R::splat(T::ZERO) };
        let solid = fraction - overlap;
        let [x_velocity, y_velocity, z_velocity] = &solids.velocity;
        Self { open: one - solid, solid, overlap, velocity: [at(x_velocity), at(y_velocity), at(z_velocity)] }
    }
}

/// Solid data of the row that is being swept, lattice units.
///
/// Solids in one cell combine as `u_s = sum phi_k u_k / sum phi_k` (Marquardt et al. 2024), and their fractions to `B` as
/// the [`SolidModel`] says; they are [added](Self::add) in ascending order of particle ids, so that products and sums
/// are the same bits on every decomposition. A body alone in a cell gives its own velocity.
pub struct SolidRow<T> {
    /// `sum e_k` by volume, otherwise `1 - B`. All arrays hold whole chunks and one more, so that groups of cells may
    /// reach over the end.
    pub(crate) fraction: Vec<T>,
    /// `u_s`; anything where the fraction is zero.
    pub(crate) velocity: [Vec<T>; 3],
    /// `sum phi_k` and `sum phi_k u_k` where segments overlap.
    total: Vec<T>,
    velocity_sum: [Vec<T>; 3],
    /// Written by the sweep: momentum and (moving, shifted) mass that solids receive, and what is subtracted in the next step,
    /// as the [`SolidModel`] defines it.
    pub(crate) incoming: [Vec<T>; 4],
    pub(crate) outgoing: [Vec<T>; 4],
    /// Groups with solids; only there what the sweep writes means anything.
    used: Vec<bool>,
}

/// Writes [`GROUP`] numbers from `x` on.
#[inline(always)]
fn put_group<T>(values: &mut [T], x: usize, group: [T; GROUP]) {
    *values[x..].first_chunk_mut().expect("a chunk more than the row") = group;
}

/// [`GROUP`] of the fractions from one on, in the precision of the populations.
#[inline(always)]
fn real<T: Real>(cut: &[f32], from: usize) -> [T; GROUP] {
    let group: &[f32; GROUP] = cut[from..].first_chunk().expect("a group more than the cut cells");
    let mut all = [T::ZERO; GROUP];
    for k in 0..GROUP {
        all[k] = group[k].into();
    }
    all
}

impl<T: Real> SolidRow<T> {
    pub(crate) fn new(chunks: usize) -> Self {
        let cells = (chunks + 1) * CHUNK;
        let zeros = || vec![T::ZERO; cells];
        Self {
            fraction: zeros(),
            velocity: std::array::from_fn(|_| zeros()),
            total: zeros(),
            velocity_sum: std::array::from_fn(|_| zeros()),
            incoming: std::array::from_fn(|_| zeros()),
            outgoing: std::array::from_fn(|_| zeros()),
            used: vec![false; cells / GROUP],
        }
    }

    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        for (n, used) in self.used.iter_mut().enumerate().filter(|(_, used)| **used) {
            put_group(&mut self.fraction, n * GROUP, [T::ZERO; GROUP]);
            *used = false;
        }
    }

    /// Marks cells as covered.
    #[inline(always)]
    fn cover(&mut self, segment: &Segment) {
        let (first, last) = (segment.x as usize / GROUP, (segment.end() as usize - 1) / GROUP);
        for used in &mut self.used[first..=last] {
            *used = true;
        }
    }

    /// Puts a body into the cells of a segment that no other covers: its solid fractions, those of cut cells being `cut`, and
    /// velocities. What lies behind the segment is overwritten; segments come in ascending order of cells.
    #[inline(always)]
    pub(super) fn put<R: Lanes<T>>(&mut self, segment: &Segment, cut: &[f32], velocity: &RowVelocity<T>) {
        self.cover(segment);
        let (x, end) = (segment.x as usize, segment.end() as usize);
        let (head, tail) = (usize::from(segment.head), usize::from(segment.tail));
        let mut done = 0;
        while done < head {
            put_group(&mut self.fraction, x + done, real(cut, done));
            done += GROUP;
        }
        let mut at = x + head;
        while at < end - tail {
            put_group(&mut self.fraction, at, [T::ONE; GROUP]);
            at += GROUP;
        }
        done = 0;
        while done < tail {
            put_group(&mut self.fraction, end - tail + done, real(cut, head + done));
            done += GROUP;
        }
        put_group(&mut self.fraction, end, [T::ZERO; GROUP]);
        assert!(end + R::WIDTH <= self.fraction.len());
        let [to_x, to_y, to_z] = &mut self.velocity;
        done = 0;
        while done < end - x {
            let [ux, uy, uz] = velocity.lanes::<R>(segment.offset[0] + done as i32);
            // SAFETY: all arrays are as long as the one just checked.
            unsafe {
                ux.store(to_x.as_mut_ptr().add(x + done));
                uy.store(to_y.as_mut_ptr().add(x + done));
                uz.store(to_z.as_mut_ptr().add(x + done));
            }
            done += R::WIDTH;
        }
    }

    /// Empties cells that several bodies may cover.
    pub(super) fn open_cells(&mut self, cells: Range<usize>) {
        for sum in [&mut self.total, &mut self.fraction].into_iter().chain(&mut self.velocity_sum) {
            sum[cells.clone()].fill(T::ZERO);
        }
    }

    /// Adds a body to cells that others may cover as well, in ascending order of ids.
    pub(super) fn add<M: SolidModel>(&mut self, segment: &Segment, cut: &[f32], velocity: &RowVelocity<T>) {
        self.cover(segment);
        for k in 0..segment.count as usize {
            let (x, phi) = (segment.x as usize + k, T::from(segment.fraction(cut, k)));
            if phi > T::ZERO {
                let (before, u) = (self.fraction[x], velocity.lanes::<T>(segment.offset[0] + k as i32));
                self.total[x] = self.total[x] + phi;
                let total = self.total[x];
                let open = (T::ONE - before) * (T::ONE - phi);
                let alone = total == phi;
                // Bodies that overlap at rest have no film between them.
                let rest = (0..3).all(|a| u[a] == T::ZERO && (alone || self.velocity[a][x] == T::ZERO));
                self.fraction[x] = match (M::BY_VOLUME, alone) {
                    (true, _) | (_, true) if rest && total > T::ONE => T::ONE,
                    (true, _) | (_, true) => total,
                    _ => T::ONE - open,
                };
                for axis in 0..3 {
                    let sum = self.velocity_sum[axis][x] + phi * u[axis];
                    self.velocity_sum[axis][x] = sum;
                    self.velocity[axis][x] =
                        if alone { u[axis] } else { T::from_f64(sum.into() / total.into()) };
                }
            }
        }
    }

    /// Part `phi / sum phi_k` of a body in a cell that several may cover.
    #[inline(always)]
    pub(super) fn share(&self, x: usize, phi: f32) -> f64 {
        if phi > 0.0 { f64::from(phi) / self.total[x].into() } else { 0.0 }
    }

    /// Takes all solids out of some cells.
    pub(crate) fn clear_fractions(&mut self, cells: Range<usize>) {
        if self.reaches(&cells) {
            self.fraction[cells].fill(T::ZERO);
        }
    }

    /// Forgets what some cells exchanged.
    pub(crate) fn clear_exchanged(&mut self, cells: Range<usize>) {
        if !self.reaches(&cells) {
            return;
        }
        for moment in self.incoming.iter_mut().chain(&mut self.outgoing) {
            moment[cells.clone()].fill(T::ZERO);
        }
    }

    /// Returns true if some of the cells may have solids.
    fn reaches(&self, cells: &Range<usize>) -> bool {
        self.used[cells.start / GROUP..cells.end.div_ceil(GROUP)].contains(&true)
    }

    /// Returns true if some of `width` cells from `x` on may have solids.
    #[inline(always)]
    pub(crate) fn is_used(&self, x: usize, width: usize) -> bool {
        let mut used = self.used[x / GROUP];
        if width > GROUP {
            used |= self.used[x / GROUP + 1];
        }
        used
    }

    /// Solid fraction `1 - B`, its excess over all bodies, and velocity `u_s` of a cell.
    pub(crate) fn cell(&self, x: usize) -> (f64, f64, [f64; 3]) {
        let fraction: f64 = self.fraction[x].into();
        let velocity = |values: &Vec<T>| if fraction > 0.0 { values[x].into() } else { 0.0 };
        let solid = if fraction > 1.0 { 1.0 } else { fraction };
        (solid, fraction - solid, std::array::from_fn(|a| velocity(&self.velocity[a])))
    }

    /// Sum of the solid fractions of all cells, as a fixed-point number.
    pub(crate) fn fraction_total(&self) -> i64 {
        let solid = |&e: &T| if e > T::ONE { 1.0 } else { e.into() };
        self.fraction.iter().fold(0, |sum, e| sum.wrapping_add(to_fixed(solid(e))))
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // these numbers are exact
mod tests {
    use super::*;
    use crate::coupling::{Homogenised, Saturated};
    use crate::math::from_fixed;

    /// A segment of cut cells from `x` on, and their fractions.
    fn segment(x: u32, fractions: &[f32]) -> (Segment, Vec<f32>) {
        let count = fractions.len() as u16;
        let mut cut = fractions.to_vec();
        cut.resize(fractions.len() + GROUP, 0.0);
        (Segment { x, count, head: count, ..Segment::default() }, cut)
    }

    fn moving(velocity: [f64; 3]) -> RowVelocity<f64> {
        RowVelocity { constant: velocity, slope: [0.0; 2], centre: 0.0 }
    }

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut row = SolidRow::<f64>::new(2);
        row.open_cells(14..18);
        let mut add = |x: u32, fractions: &[f32], velocity: [f64; 3]| {
            let (segment, cut) = segment(x, fractions);
            row.add::<Homogenised>(&segment, &cut, &moving(velocity));
        };
        add(14, &[0.25, 1.0, 0.5, 0.5], [1.0, 0.0, 2.0]);
        add(16, &[0.5], [3.0, 0.0, 2.0]);
        assert_eq!(row.cell(16), (0.75, 0.0, [2.0, 0.0, 2.0]));
        assert_eq!(row.cell(14), (0.25, 0.0, [1.0, 0.0, 2.0]));
        assert_eq!([row.share(16, 0.5), row.share(14, 0.25), row.share(14, 0.0)], [0.5, 1.0, 0.0]);
        assert!((from_fixed(row.fraction_total()) - (0.25 + 1.0 + 0.75 + 0.5)).abs() < 1e-12);
        row.clear();
        assert_eq!(row.cell(16).0, 0.0);
        assert_eq!(row.fraction_total(), 0);
    }

    #[test]
    fn volume_fractions_add_up_to_at_most_the_whole_cell() {
        let mut row = SolidRow::<f64>::new(1);
        row.open_cells(0..4);
        for part in [0.25, 0.5, 0.75] {
            let (segment, cut) = segment(0, &[0.0, 0.0, 0.0, part]);
            row.add::<Saturated>(&segment, &cut, &moving([2.0 * f64::from(part); 3]));
            assert_eq!(row.cell(2).0, 0.0);
        }
        let (solid, overlap, [u, _, _]) = row.cell(3);
        assert_eq!((solid, overlap), (1.0, 0.5));
        assert!((u - 1.75 / 1.5).abs() < 1e-15);
    }

    #[test]
    fn bodies_that_overlap_at_rest_have_no_film_between_them() {
        let mut row = SolidRow::<f64>::new(1);
        row.open_cells(0..2);
        let mut add = |fractions: &[f32], speed: f64| {
            let (segment, cut) = segment(0, fractions);
            row.add::<Saturated>(&segment, &cut, &moving([speed, 0.0, 0.0]));
            (row.cell(0), row.cell(1))
        };
        add(&[0.75, 0.5], 0.0);
        assert_eq!(add(&[0.75, 0.25], 0.0), ((1.0, 0.0, [0.0; 3]), (0.75, 0.0, [0.0; 3])));
        // One that moves along them is not welded to them.
        assert_eq!(add(&[1.0, 0.5], 2.5).0.1, 1.5);
        assert_eq!([row.share(0, 0.75), row.share(1, 0.25)], [0.3, 0.2]);
    }

    #[test]
    fn a_body_alone_gives_the_same_bits_whether_others_may_cover_its_cells_or_not() {
        let velocity = RowVelocity { constant: [0.1, 0.2, -0.3], slope: [0.01, 0.02], centre: 0.3 };
        for (head, count, tail) in [(3, 12, 2), (9, 9, 0), (0, 20, 0), (1, 1, 0), (10, 27, 9), (2, 4, 2)] {
            let cut: Vec<f32> = (0..head + tail + GROUP as u16).map(|k| 0.1 + 0.03 * f32::from(k)).collect();
            let segment = Segment { x: 3, count, head, tail, offset: [-7, 0, 0], ..Segment::default() };
            let (mut alone, mut among) = (SolidRow::<f32>::new(2), SolidRow::<f32>::new(2));
            let velocity = velocity.to::<f32>();
            alone.put::<f32>(&segment, &cut, &velocity);
            among.open_cells(3..3 + usize::from(count));
            among.add::<Homogenised>(&segment, &cut, &velocity);
            for x in 0..32 {
                assert_eq!(alone.cell(x), among.cell(x), "{segment:?} {x}");
                assert_eq!(alone.is_used(x, 1), among.is_used(x, 1));
            }
        }
    }
}
