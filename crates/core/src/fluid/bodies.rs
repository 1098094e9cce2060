//! Bodies on a block of fluid, as data: the cells each covers, its motion, and the momentum it exchanged.
//!
//! [`BlockSolids`] is all that a sweep gets of the particles and all that it returns, whatever device runs it. The sweep
//! on the processor spreads them over a row just before the row collides, and collects momentum just after, all in the
//! first-level cache; only cells that a surface cuts have a number in memory, their solid fraction.

use super::Real;
use super::segments::{RowSegments, Segment};
use super::simd::{Lanes, Registers, Tally};
use super::solid::SolidModel;
use super::solid_row::{RowCover, SolidRow};
use super::spheres::SphereRows;
use crate::math::{FIXED_MAGIC, to_fixed};

/// Momentum and angular momentum about the reference cell that a body receives in one time step, as exact sums of
/// fixed-point numbers: add them up in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ExchangeSum {
    /// `sum F`.
    pub force: [i64; 3],
    /// `sum n x F`, `n` the integer offset from the reference cell.
    pub moment: [i64; 3],
}

impl ExchangeSum {
    /// `self + sign * other`.
    pub(crate) fn add(&mut self, other: &Self, sign: i64) {
        for a in 0..3 {
            self.force[a] = self.force[a].wrapping_add(sign.wrapping_mul(other.force[a]));
            self.moment[a] = self.moment[a].wrapping_add(sign.wrapping_mul(other.moment[a]));
        }
    }

    /// The same about a reference cell that lies `shift` before the present one: offsets grow by `shift`.
    pub(crate) fn shifted(&self, shift: [i64; 3]) -> Self {
        let (mut moved, f) = (*self, self.force);
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let turn = shift[b].wrapping_mul(f[c]).wrapping_sub(shift[c].wrapping_mul(f[b]));
            moved.moment[a] = moved.moment[a].wrapping_add(turn);
        }
        moved
    }

    /// Contribution of one cell at offset `n` with `exchanged = [p, m]` and solid velocity `u`.
    pub(crate) fn of_cell(exchanged: [f64; 4], u: [f64; 3], n: [i64; 3]) -> Self {
        let f: [f64; 3] = std::array::from_fn(|a| exchanged[a] - u[a] * exchanged[3]);
        let [xy, xz] = [f[1], f[2]].map(|f| to_fixed(n[0] as f64 * f));
        Self::of_row(f.map(to_fixed), xy, xz, n[1], n[2])
    }

    /// From the sums along a row of `F`, `n_x F_y` and `n_x F_z`.
    #[inline(always)]
    fn of_row([fx, fy, fz]: [i64; 3], xy: i64, xz: i64, ny: i64, nz: i64) -> Self {
        let moment = [
            ny.wrapping_mul(fz).wrapping_sub(nz.wrapping_mul(fy)),
            nz.wrapping_mul(fx).wrapping_sub(xz),
            xy.wrapping_sub(ny.wrapping_mul(fx)),
        ];
        Self { force: [fx, fy, fz], moment }
    }
}

/// Rigid motion of a body about its centre, lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidMotion {
    /// Velocity of the centre.
    pub velocity: [f64; 3],
    /// Angular velocity (1 / time step).
    pub angular: [f64; 3],
    /// Position of the centre relative to the reference cell of the body (cells).
    pub centre: [f64; 3],
}

impl RigidMotion {
    /// Velocity along the row at offsets `ny, nz`: constant, and slope of y and z over the x distance from the centre.
    #[inline(always)]
    fn along_row(&self, ny: f64, nz: f64) -> ([f64; 3], [f64; 2]) {
        let (v, w) = (self.velocity, self.angular);
        let [ry, rz] = [ny - self.centre[1], nz - self.centre[2]];
        ([v[0] + (w[1] * rz - w[2] * ry), v[1] - w[0] * rz, v[2] + w[0] * ry], [w[2], -w[1]])
    }

    /// Velocity in the cell at offset `n`.
    pub(crate) fn at(&self, n: [i64; 3]) -> [f64; 3] {
        let n = n.map(|n| n as f64);
        let ([x, y, z], [sy, sz]) = self.along_row(n[1], n[2]);
        let from_centre = n[0] - self.centre[0];
        [x, y + sy * from_centre, z + sz * from_centre]
    }

    /// Velocities along the row with these offsets.
    #[inline(always)]
    pub(super) fn row(&self, [_, ny, nz]: [i32; 3]) -> RowVelocity<f64> {
        let (constant, slope) = self.along_row(ny.into(), nz.into());
        RowVelocity { constant, slope, centre: self.centre[0] }
    }
}

/// Velocity of a body along a row: a constant and, for y and z, a slope over the x distance from the centre.
#[derive(Clone, Copy)]
pub(super) struct RowVelocity<T> {
    pub(super) constant: [T; 3],
    pub(super) slope: [T; 2],
    pub(super) centre: T,
}

impl RowVelocity<f64> {
    /// The same in the precision of the populations.
    #[inline(always)]
    pub(super) fn to<T: Real>(&self) -> RowVelocity<T> {
        let ([x, y, z], [sy, sz]) = (self.constant, self.slope);
        RowVelocity {
            constant: [T::from_f64(x), T::from_f64(y), T::from_f64(z)],
            slope: [T::from_f64(sy), T::from_f64(sz)],
            centre: T::from_f64(self.centre),
        }
    }
}

impl<T: Real> RowVelocity<T> {
    /// Velocities in the register of cells whose first has offset `n` in x.
    #[inline(always)]
    pub(super) fn lanes<R: Lanes<T>>(&self, n: i32) -> [R; 3] {
        // SAFETY: there are as many lanes as in the widest register.
        let lanes = unsafe { R::load(T::LANE.as_ptr()) };
        // The integer offset first, the centre last: rounded alike wherever a register begins.
        let x = (R::splat(T::from_f64(n.into())) + lanes) - R::splat(self.centre);
        let [ux, uy, uz] = self.constant.map(R::splat);
        let [sy, sz] = self.slope.map(R::splat);
        [ux, uy + sy * x, uz + sz * x]
    }
}

/// A body on the lattice.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Id of the particle.
    pub id: u64,
    /// The cell of the box that offsets count from.
    pub reference: [i64; 3],
    /// Its motion.
    pub motion: RigidMotion,
    /// Momentum exchange of this step: received now, minus what departed in the step before.
    pub exchange: ExchangeSum,
    /// Momentum to subtract in the next step: that which left the covered cells, or that inside the body.
    pub departed: ExchangeSum,
}

/// The solids on a block of fluid.
pub struct BlockSolids<'a, M> {
    /// Covered cells, of all bodies that are not in `spheres`, each in one of the two; in a row in ascending order of ids.
    pub segments: [&'a RowSegments; 2],
    /// Spheres whose cells are found when their rows are swept.
    pub spheres: &'a SphereRows,
    /// Motion of each body, and what it exchanged.
    pub bodies: &'a mut [Body],
    /// Collision of covered cells.
    pub model: M,
    /// Data for a device in place of the covered cells.
    pub images: Option<&'a super::Images>,
}

impl<M: SolidModel> BlockSolids<'_, M> {
    /// Returns true if bodies may cover cells of a row.
    #[inline(always)]
    pub(super) fn reach(&self, row: usize) -> bool {
        !(self.segments.iter().all(|of| of.row(row).is_empty()) && self.spheres.row(row).is_empty())
    }

    /// Adds all solids to a row of `nx` cells, which is empty.
    #[inline(always)]
    pub(super) fn fill<T: Real, V: Registers>(&self, row: usize, nx: usize, solids: &mut SolidRow<T>) {
        let (mut segments, spheres) = (self.segments.map(|of| of.row(row)), self.spheres.row(row));
        solids.reserve(segments[0].len() + segments[1].len() + spheres.len());
        if !spheres.is_empty() {
            let [y, z] = self.spheres.place(row);
            for image in spheres {
                let image = &self.spheres.images[*image as usize];
                let body = &self.bodies[image.body as usize];
                self.add_segments::<T, V>(&mut segments, body.id, solids);
                let offset = [-image.base[0], y - image.base[1], z - image.base[2]];
                if let Some(cells) = image.cells(body.motion.centre, offset, nx as i32) {
                    let velocity = body.motion.row(offset).to();
                    solids.add_sphere::<M, V>(image.body, offset, &cells, &velocity);
                }
            }
        }
        self.add_segments::<T, V>(&mut segments, u64::MAX, solids);
    }

    /// Adds the segments of bodies with ids of at most `last`, in ascending order of ids, and takes them from both lists.
    #[inline(always)]
    fn add_segments<T: Real, V: Registers>(
        &self,
        lists: &mut [&[Segment]; 2],
        last: u64,
        solids: &mut SolidRow<T>,
    ) {
        loop {
            let next = lists.map(|list| list.first().map(|of| self.bodies[of.body as usize].id));
            let list = match next {
                [Some(a), Some(b)] => usize::from(b < a),
                [None, Some(_)] => 1,
                _ => 0,
            };
            if next[list].is_none_or(|id| id > last) {
                return;
            }
            let (segment, rest) = lists[list].split_first().expect("just found");
            lists[list] = rest;
            let [nx, ny, nz] = segment.offset;
            let offset = [nx - segment.x as i32, ny, nz];
            let velocity = self.bodies[segment.body as usize].motion.row(offset).to();
            solids.add_segment::<M, V>(segment, self.segments[list].cut(segment), offset, &velocity);
        }
    }

    /// Adds the momentum that a row exchanged in this sweep to its bodies.
    ///
    /// # Safety
    /// The function that this is inlined into is compiled for the instructions of `V`, and the processor has them.
    #[inline(always)]
    pub(super) unsafe fn collect<T: Real, V: Registers>(&mut self, solids: &SolidRow<T>) {
        for cover in &solids.covers {
            let Body { motion, exchange, departed, .. } = &mut self.bodies[cover.body as usize];
            let [incoming, outgoing] = received::<T, V, M>(solids, cover, &motion.row(cover.offset));
            exchange.add(&incoming, 1);
            departed.add(&outgoing, 1);
        }
    }
}

/// Momentum that a body receives from its cells of a row, and the momentum to subtract in the next step.
#[inline(always)]
fn received<T: Real, V: Registers, M: SolidModel>(
    solids: &SolidRow<T>,
    cover: &RowCover,
    velocity: &RowVelocity<f64>,
) -> [ExchangeSum; 2] {
    let (&RowCover { x: first, count, offset: [n, ny, nz], .. }, fractions) =
        (cover, solids.fractions(cover));
    assert!(first + count + V::D::WIDTH <= solids.fraction.len() && count + V::D::WIDTH <= fractions.len());
    let zero = V::D::splat(0.0);
    let mut tallies = [[zero; 5]; 2];
    // No closures: they would not be compiled for the instruction set.
    for done in (0..count).step_by(V::D::WIDTH) {
        let x = first + done;
        let n = n + x as i32;
        // By volume cells that several bodies cover are shared; otherwise each gets what its own velocity says.
        let shares = if M::BY_VOLUME && solids.is_shared(x, V::D::WIDTH) {
            Some(solids.shares(x, &fractions[done..done + V::D::WIDTH]))
        } else {
            None
        };
        // SAFETY: all arrays of the row are as long as the one just checked, and there are more lanes than in a register.
        unsafe {
            let share = match &shares {
                Some(shares) => V::D::load(shares.as_ptr()),
                None => V::D::widen(fractions.as_ptr().add(done)).if_greater(zero, V::D::splat(1.0), zero),
            };
            let along = V::D::splat(n.into()) + V::D::load(f64::LANE.as_ptr());
            for (tallies, exchanged) in tallies.iter_mut().zip([&solids.incoming, &solids.outgoing]) {
                let [px, py, pz, m] = exchanged;
                let mut f = [
                    T::widen::<V::D>(px.as_ptr().add(x)),
                    T::widen::<V::D>(py.as_ptr().add(x)),
                    T::widen::<V::D>(pz.as_ptr().add(x)),
                ];
                if !M::BY_VOLUME {
                    let (m, u) = (T::widen::<V::D>(m.as_ptr().add(x)), velocity.lanes::<V::D>(n));
                    f = [f[0] - u[0] * m, f[1] - u[1] * m, f[2] - u[2] * m];
                }
                f = [share * f[0], share * f[1], share * f[2]];
                let all = [f[0], f[1], f[2], along * f[1], along * f[2]];
                for k in 0..5 {
                    tallies[k] = tallies[k].tally(all[k]);
                }
            }
        }
    }
    let lanes = count.next_multiple_of(V::D::WIDTH) as i64;
    let offset = (FIXED_MAGIC.to_bits() as i64).wrapping_mul(lanes);
    let z_levers = V::D::totals([tallies[0][4], tallies[1][4], zero, zero]);
    let mut sums = [ExchangeSum::default(); 2];
    for way in 0..2 {
        let [fx, fy, fz, ly, _] = tallies[way];
        let [fx, fy, fz, ly] = V::D::totals([fx, fy, fz, ly]);
        let force = [fx.wrapping_sub(offset), fy.wrapping_sub(offset), fz.wrapping_sub(offset)];
        let (ly, lz) = (ly.wrapping_sub(offset), z_levers[way].wrapping_sub(offset));
        sums[way] = ExchangeSum::of_row(force, ly, lz, ny.into(), nz.into());
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::simd::Single;
    use super::super::solid::GROUP;
    use super::*;
    use crate::coupling::{Homogenised, Saturated};
    use crate::math::from_fixed;

    #[test]
    fn a_sum_about_another_reference_cell_gains_the_moment_of_its_force() {
        let (exchanged, u) = ([0.3, -0.2, 0.1, 0.05], [0.01, 0.02, -0.03]);
        let near = ExchangeSum::of_cell(exchanged, u, [1, -2, 3]);
        let far = ExchangeSum::of_cell(exchanged, u, [5, -4, 9]);
        let shifted = near.shifted([4, -2, 6]);
        for a in 0..3 {
            assert_eq!(shifted.force[a], far.force[a]);
            assert!((from_fixed(shifted.moment[a]) - from_fixed(far.moment[a])).abs() < 1e-11);
        }
    }

    /// The slow truth: cell by cell.
    #[test]
    fn momentum_along_a_row_adds_up_to_that_of_the_cells_of_each_body() {
        let values =
            |from: f64| -> Vec<f32> { (0..64).map(|k| (from + 0.1 * f64::from(k)).sin() as f32).collect() };
        let motion =
            RigidMotion { velocity: [0.1, -0.2, 0.3], angular: [0.01, 0.02, -0.03], centre: [0.2; 3] };
        for (count, other) in [1, 7, 8, 9, 16, 21].into_iter().flat_map(|count| [(count, 30), (count, 9)]) {
            let mut solids = SolidRow::<f32>::new(3);
            solids.reserve(2);
            for (x, count, part) in [(5, count, 0.75), (other, 6, 0.25)] {
                let cut = vec![part; count + GROUP];
                let segment =
                    Segment { x: x as u32, count: count as u16, head: count as u16, ..Segment::default() };
                let velocity = motion.row([-8, 2, 4]).to();
                solids.add_segment::<Saturated, Single>(&segment, &cut, [-8, 2, 4], &velocity);
            }
            solids.incoming = [values(0.0), values(1.0), values(2.0), values(3.0)];
            let all = solids.incoming.clone();
            let sum = |m: bool| {
                (0..count).fold(ExchangeSum::default(), |mut sum, k| {
                    let x = 5 + k;
                    let share = if !m && (other..other + 6).contains(&x) { 0.75 } else { 1.0 };
                    let p = all.each_ref().map(|p| share * f64::from(p[x]));
                    let p = if m { p } else { [p[0], p[1], p[2], 0.0] };
                    let n = [x as i64 - 8, 2, 4];
                    sum.add(&ExchangeSum::of_cell(p, motion.at(n), n), 1);
                    sum
                })
            };
            let near = |a: [ExchangeSum; 2], b: ExchangeSum| {
                let [a, _] = a;
                let pairs = a.force.into_iter().chain(a.moment).zip(b.force.into_iter().chain(b.moment));
                pairs.for_each(|(a, b)| assert!(from_fixed(a - b).abs() < 1e-5, "{a} {b}"));
            };
            let cover = solids.covers[0];
            let velocity = motion.row(cover.offset);
            near(received::<f32, Single, Homogenised>(&solids, &cover, &velocity), sum(true));
            // By volume the sweep leaves zeros where nothing is covered.
            let covered = |x: usize| (5..5 + count).contains(&x) || (other..other + 6).contains(&x);
            for p in &mut solids.incoming {
                (0..64).filter(|x| !covered(*x)).for_each(|x| p[x] = 0.0);
            }
            near(received::<f32, Single, Saturated>(&solids, &cover, &velocity), sum(false));
        }
    }
}
