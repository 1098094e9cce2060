//! Solid data of one row of cells, which exists only while the row is swept.

use super::Real;
use super::bodies::RowVelocity;
use super::segments::{CoverCount, Segment};
use super::simd::{Choose, Lanes, Registers};
use super::solid::{CHUNK, GROUP, SolidModel};
use super::spheres::SphereCells;
use crate::math::to_fixed;
use std::ops::Range;

/// Solid data of the row that is being swept, lattice units.
///
/// Solids in one cell combine as `u_s = sum phi_k u_k / sum phi_k` (Marquardt et al. 2024), and their fractions to `B` as
/// the [`SolidModel`] says; they are [added](Self::add_group) in ascending order of particle ids, so that products and sums
/// are the same bits on every decomposition. A body alone in a cell gives its own velocity.
pub struct SolidRow<T> {
    /// `sum e_k` by volume, otherwise `1 - B`. All arrays hold whole chunks and one more, so that groups of cells may
    /// reach over the end.
    pub(crate) fraction: Vec<T>,
    /// `u_s`; anything where the fraction is zero.
    pub(crate) velocity: [Vec<T>; 3],
    /// `sum phi_k` and `sum phi_k u_k` in cells that several bodies cover; zeros in the others of their groups.
    total: Vec<T>,
    velocity_sum: [Vec<T>; 3],
    /// Written by the sweep: momentum and (moving, shifted) mass that solids receive, and what is subtracted in the next step,
    /// as the [`SolidModel`] defines it.
    pub(crate) incoming: [Vec<T>; 4],
    pub(crate) outgoing: [Vec<T>; 4],
    /// Of each group of cells: 1 if bodies may cover some, more if several cover the same; 0 where what the sweep writes means nothing.
    present: Vec<u8>,
    /// The bodies, in ascending order of ids, the solid fractions of each in its cells, whole groups of which the last is 0, and their
    /// number.
    pub(super) covers: Vec<RowCover>,
    fractions: Vec<f32>,
    filled: usize,
    /// Covered cells of all rows since this was last reset.
    pub(super) count: CoverCount,
}

/// Cells of a row that a body may cover.
#[derive(Clone, Copy)]
pub(super) struct RowCover {
    /// Index of the body.
    pub(super) body: u32,
    /// Offsets from the reference cell of the body (of its image that lies here): of the first cell of the row in x, and of the row.
    pub(super) offset: [i32; 3],
    /// First cell, and number of cells.
    pub(super) x: usize,
    pub(super) count: usize,
    /// Index of the fraction of the first.
    fractions: usize,
}

/// Writes [`GROUP`] numbers from `x` on.
#[inline(always)]
fn put_group<T>(values: &mut [T], x: usize, group: [T; GROUP]) {
    *values[x..].first_chunk_mut().expect("a chunk more than the row") = group;
}

/// [`GROUP`] numbers from `x` on.
#[inline(always)]
fn group<T: Copy>(values: &[T], x: usize) -> [T; GROUP] {
    *values[x..].first_chunk().expect("a chunk more than the row")
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
            present: vec![0; cells / GROUP],
            covers: Vec::new(),
            fractions: Vec::new(),
            filled: 0,
            count: CoverCount::default(),
        }
    }

    /// Takes all bodies out.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        for RowCover { x, count, .. } in self.covers.drain(..) {
            for at in x / GROUP..(x + count).div_ceil(GROUP) {
                if self.present[at] > 1 {
                    put_group(&mut self.total, at * GROUP, [T::ZERO; GROUP]);
                }
                put_group(&mut self.fraction, at * GROUP, [T::ZERO; GROUP]);
                self.present[at] = 0;
            }
        }
        self.filled = 0;
    }

    /// Makes room for a number of bodies.
    #[inline(always)]
    pub(super) fn reserve(&mut self, bodies: usize) {
        let most = bodies * (self.fraction.len() + GROUP);
        if self.fractions.len() < most {
            self.fractions.resize(most, 0.0);
        }
    }

    /// Adds a body with cells from `x` on, whose [groups](Self::add_group) and the zeros after them follow; returns true if no other is near.
    #[inline(always)]
    fn add(&mut self, body: u32, offset: [i32; 3], x: usize, count: usize) -> bool {
        let fractions = self.filled;
        self.filled += count.next_multiple_of(GROUP) + GROUP;
        self.covers.push(RowCover { body, offset, x, count, fractions });
        let (first, last) = (x / GROUP, (x + count - 1) / GROUP);
        // The last group may reach over the last cell.
        let mut alone = self.present[last + 1] == 0;
        for present in &mut self.present[first..=last] {
            alone &= *present == 0;
            *present |= 1;
        }
        alone
    }

    /// Adds a sphere that covers these cells.
    #[inline(always)]
    pub(super) fn add_sphere<M: SolidModel, V: Registers>(
        &mut self,
        body: u32,
        offset: [i32; 3],
        cells: &SphereCells,
        velocity: &RowVelocity<T>,
    ) {
        let ([count, cut], to) = (cells.number(), self.filled);
        self.count.add([count, cut]);
        let n = cells.all[0];
        let alone = self.add(body, offset, (n - offset[0]) as usize, count);
        for done in (0..count).step_by(GROUP) {
            let n = n + done as i32;
            let phi = cells.group::<V>(n);
            put_group(&mut self.fractions, to + done, phi);
            self.add_group::<M, V>((n - offset[0]) as usize, n, &phi, velocity, alone);
        }
        put_group(&mut self.fractions, to + count.next_multiple_of(GROUP), [0.0; GROUP]);
    }

    /// Adds a body with the cells of a segment, the fractions of those that its surface cuts being `cut`.
    #[inline(always)]
    pub(super) fn add_segment<M: SolidModel, V: Registers>(
        &mut self,
        segment: &Segment,
        cut: &[f32],
        offset: [i32; 3],
        velocity: &RowVelocity<T>,
    ) {
        let (x, count, to) = (segment.x as usize, usize::from(segment.count), self.filled);
        let (head, tail) = (usize::from(segment.head), usize::from(segment.tail));
        self.count.add([count, head + tail]);
        let alone = self.add(segment.body, offset, x, count);
        // What lies behind each part is overwritten by the next.
        for done in (0..head).step_by(GROUP) {
            put_group(&mut self.fractions, to + done, group(cut, done));
        }
        for done in (head..count - tail).step_by(GROUP) {
            put_group(&mut self.fractions, to + done, [1.0; GROUP]);
        }
        for done in (0..tail).step_by(GROUP) {
            put_group(&mut self.fractions, to + count - tail + done, group(cut, head + done));
        }
        put_group(&mut self.fractions, to + count, [0.0; GROUP]);
        put_group(&mut self.fractions, to + count.next_multiple_of(GROUP), [0.0; GROUP]);
        for done in (0..count).step_by(GROUP) {
            let (phi, n) = (group(&self.fractions, to + done), offset[0] + (x + done) as i32);
            self.add_group::<M, V>(x + done, n, &phi, velocity, alone);
        }
    }

    /// Adds the fractions of a body to the group of cells from `x` on, the first of which has the offset `n`.
    #[inline(always)]
    fn add_group<M: SolidModel, V: Registers>(
        &mut self,
        x: usize,
        n: i32,
        phi: &[f32; GROUP],
        velocity: &RowVelocity<T>,
        alone: bool,
    ) {
        assert!(x + GROUP <= self.fraction.len());
        if alone {
            for lane in (0..GROUP).step_by(T::In::<V>::WIDTH) {
                let (x, u) = (x + lane, velocity.lanes::<T::In<V>>(n + lane as i32));
                // SAFETY: all arrays are as long as the one just checked.
                unsafe {
                    T::load_f32::<V>(phi.as_ptr().add(lane)).store(self.fraction.as_mut_ptr().add(x));
                    for axis in 0..3 {
                        u[axis].store(self.velocity[axis].as_mut_ptr().add(x));
                    }
                }
            }
            return;
        }
        let zero = T::In::<V>::splat(T::ZERO);
        let (mut both, mut others) = (false, [zero; GROUP]);
        for lane in (0..GROUP).step_by(T::In::<V>::WIDTH) {
            let (x, u) = (x + lane, velocity.lanes::<T::In<V>>(n + lane as i32));
            // SAFETY: all arrays are as long as the one just checked.
            unsafe {
                let e = T::load_f32::<V>(phi.as_ptr().add(lane));
                let to = self.fraction.as_mut_ptr().add(x);
                let before = T::In::<V>::load(to);
                others[lane / T::In::<V>::WIDTH] = before;
                before.if_greater(zero, before, e).store(to);
                both |= before.min(e).any_greater(zero);
                for axis in 0..3 {
                    let to = self.velocity[axis].as_mut_ptr().add(x);
                    before.if_greater(zero, T::In::<V>::load(to), u[axis]).store(to);
                }
            }
        }
        if both {
            let mut of_others = [T::ZERO; GROUP];
            for lane in (0..GROUP).step_by(T::In::<V>::WIDTH) {
                // SAFETY: a register fits into the group from `lane` on.
                unsafe { others[lane / T::In::<V>::WIDTH].store(of_others.as_mut_ptr().add(lane)) };
            }
            self.share_group::<M>(x, n, phi, &of_others, velocity);
        }
    }

    /// Adds a body to those cells of a group that others cover, too.
    #[cold]
    fn share_group<M: SolidModel>(
        &mut self,
        x: usize,
        n: i32,
        phi: &[f32; GROUP],
        others: &[T; GROUP],
        velocity: &RowVelocity<T>,
    ) {
        for k in (0..GROUP).filter(|&k| others[k] > T::ZERO && phi[k] > 0.0) {
            self.present[(x + k) / GROUP] |= 2;
            self.share_cell::<M>(x + k, phi[k].into(), velocity.lanes(n + k as i32));
        }
    }

    /// Adds the fraction `phi` of a body that moves with `u` to a cell that others cover.
    fn share_cell<M: SolidModel>(&mut self, x: usize, phi: T, u: [T; 3]) {
        let before = self.fraction[x];
        if self.total[x] == T::ZERO {
            self.total[x] = before;
            for axis in 0..3 {
                self.velocity_sum[axis][x] = T::ZERO + before * self.velocity[axis][x];
            }
        }
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
            self.velocity[axis][x] = if alone { u[axis] } else { T::from_f64(sum.into() / total.into()) };
        }
    }

    /// Solid fractions of a body, and zeros after them.
    #[inline(always)]
    pub(super) fn fractions(&self, cover: &RowCover) -> &[f32] {
        &self.fractions[cover.fractions..cover.fractions + cover.count.next_multiple_of(GROUP) + GROUP]
    }

    /// Parts `phi / sum phi_k` of a body, with these solid fractions, in the cells from `x` on.
    #[inline(always)]
    pub(super) fn shares(&self, x: usize, phi: &[f32]) -> [f64; GROUP] {
        let mut shares = [0.0; GROUP];
        for ((share, &phi), &total) in
            shares.iter_mut().zip(phi).zip(&self.total[x..]).filter(|((_, phi), _)| **phi > 0.0)
        {
            *share = if total > T::ZERO { f64::from(phi) / total.into() } else { 1.0 };
        }
        shares
    }

    /// Returns true if several bodies cover the same of `width` cells from `x` on, at most [`GROUP`].
    #[inline(always)]
    pub(super) fn is_shared(&self, x: usize, width: usize) -> bool {
        (self.present[x / GROUP] | self.present[(x + width - 1) / GROUP]) > 1
    }

    /// Calls `visit` with each body and cell that it covers, its fraction there, and its [share](Self::shares).
    pub(super) fn each_covered(&self, mut visit: impl FnMut(&RowCover, usize, f32, f64)) {
        for cover in &self.covers {
            for (x, phi) in (cover.x..cover.x + cover.count).zip(self.fractions(cover)) {
                if *phi > 0.0 {
                    visit(cover, x, *phi, self.shares(x, &[*phi])[0]);
                }
            }
        }
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
        self.present[cells.start / GROUP..cells.end.div_ceil(GROUP)].iter().any(|present| *present > 0)
    }

    /// Returns true if some of `width` cells from `x` on may have solids.
    #[inline(always)]
    pub(crate) fn is_used(&self, x: usize, width: usize) -> bool {
        let some = |at: usize| self.present[at] > 0;
        some(x / GROUP) || (width > GROUP && some(x / GROUP + 1))
    }

    /// Solid fraction `1 - B`, its excess over all bodies, and velocity `u_s` of a cell.
    #[cfg(test)]
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
    use super::super::simd::Single;
    use super::*;
    use crate::coupling::{Homogenised, Saturated};
    use crate::math::from_fixed;

    fn moving(velocity: [f64; 3]) -> RowVelocity<f64> {
        RowVelocity { constant: velocity, slope: [0.0; 2], centre: 0.0 }
    }

    /// Adds a body to the cells from `x` on.
    fn add<T: Real, M: SolidModel>(
        row: &mut SolidRow<T>,
        x: usize,
        fractions: &[f32],
        velocity: &RowVelocity<T>,
    ) {
        let count = fractions.len() as u16;
        let mut cut = fractions.to_vec();
        cut.resize(fractions.len() + GROUP, 0.0);
        let segment = Segment { x: x as u32, count, head: count, ..Segment::default() };
        row.reserve(4);
        row.add_segment::<M, Single>(&segment, &cut, [0; 3], velocity);
    }

    /// Shares of all bodies in a cell, in their order.
    fn shares(row: &SolidRow<f64>, x: usize) -> Vec<f64> {
        let mut all = Vec::new();
        row.each_covered(|_, at, _, share| {
            if at == x {
                all.push(share);
            }
        });
        all
    }

    #[test]
    fn several_particles_in_a_cell_combine_by_product_and_weighted_mean() {
        let mut row = SolidRow::<f64>::new(2);
        add::<_, Homogenised>(&mut row, 14, &[0.25, 1.0, 0.5, 0.5], &moving([1.0, 0.0, 2.0]));
        add::<_, Homogenised>(&mut row, 16, &[0.5], &moving([3.0, 0.0, 2.0]));
        assert_eq!(row.cell(16), (0.75, 0.0, [2.0, 0.0, 2.0]));
        assert_eq!(row.cell(14), (0.25, 0.0, [1.0, 0.0, 2.0]));
        assert_eq!(shares(&row, 16), [0.5, 0.5]);
        assert_eq!([shares(&row, 14), shares(&row, 13)], [vec![1.0], vec![]]);
        assert!((from_fixed(row.fraction_total()) - (0.25 + 1.0 + 0.75 + 0.5)).abs() < 1e-12);
        row.clear();
        assert_eq!(row.cell(16).0, 0.0);
        assert_eq!(row.fraction_total(), 0);
    }

    #[test]
    fn volume_fractions_add_up_to_at_most_the_whole_cell() {
        let mut row = SolidRow::<f64>::new(1);
        for part in [0.25, 0.5, 0.75] {
            let velocity = moving([2.0 * f64::from(part); 3]);
            add::<_, Saturated>(&mut row, 0, &[0.0, 0.0, 0.0, part], &velocity);
            assert_eq!(row.cell(2).0, 0.0);
        }
        let (solid, overlap, [u, _, _]) = row.cell(3);
        assert_eq!((solid, overlap), (1.0, 0.5));
        assert!((u - 1.75 / 1.5).abs() < 1e-15);
    }

    #[test]
    fn bodies_that_overlap_at_rest_have_no_film_between_them() {
        let mut row = SolidRow::<f64>::new(1);
        let mut add = |fractions: &[f32], speed: f64| {
            add::<_, Saturated>(&mut row, 0, fractions, &moving([speed, 0.0, 0.0]));
            (row.cell(0), row.cell(1))
        };
        add(&[0.75, 0.5], 0.0);
        assert_eq!(add(&[0.75, 0.25], 0.0), ((1.0, 0.0, [0.0; 3]), (0.75, 0.0, [0.0; 3])));
        // One that moves along them is not welded to them.
        assert_eq!(add(&[1.0, 0.5], 2.5).0.1, 1.5);
        assert_eq!([shares(&row, 0)[0], shares(&row, 1)[1]], [0.3, 0.2]);
    }

    #[test]
    fn a_body_alone_gives_the_same_bits_whether_others_have_cells_of_its_groups_or_not() {
        let velocity = RowVelocity { constant: [0.1, 0.2, -0.3], slope: [0.01, 0.02], centre: 0.3 };
        for count in [1, 5, 9, 17, 20, 27] {
            let fractions: Vec<f32> = (0..count).map(|k| 0.1 + 0.03 * k as f32).collect();
            let (mut alone, mut among) = (SolidRow::<f32>::new(3), SolidRow::<f32>::new(3));
            let velocity = velocity.to::<f32>();
            add::<_, Homogenised>(&mut alone, 3, &fractions, &velocity);
            let other = moving([0.5; 3]).to::<f32>();
            for x in [0, 3 + count] {
                add::<_, Homogenised>(&mut among, x, &[0.7, 0.4, 0.2], &other);
            }
            add::<_, Homogenised>(&mut among, 3, &fractions, &velocity);
            for x in 3..3 + count {
                assert_eq!(alone.cell(x), among.cell(x), "{count} {x}");
            }
            assert_eq!(among.cell(1).0, f64::from(0.4_f32));
        }
    }
}
