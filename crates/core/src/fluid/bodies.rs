//! Bodies on a block of fluid, as data: the cells each covers, its motion, and the momentum it exchanged.
//!
//! [`BlockSolids`] is all that a sweep gets of the particles and all that it returns, whatever device runs it. The sweep
//! on the processor spreads them over a row just before the row collides, and collects momentum just after, all in the
//! first-level cache; only cells that a surface cuts have a number in memory, their solid fraction.

use super::Real;
use super::simd::{Lanes, Registers, Tally};
use super::solid::{GROUP, SolidModel, SolidRow};
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

    /// Velocities along the row of a segment.
    #[inline(always)]
    pub(super) fn row(&self, segment: &Segment) -> RowVelocity<f64> {
        let [_, ny, nz] = segment.offset.map(f64::from);
        let (constant, slope) = self.along_row(ny, nz);
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

/// Consecutive cells of a row that belong to one body (one of its periodic images): some that its surface cuts (`head`), some
/// wholly solid, some cut (`tail`).
#[derive(Clone, Copy, Debug, Default)]
pub struct Segment {
    /// Index of the body.
    pub body: u32,
    /// First cell of the block.
    pub x: u32,
    /// Number of cells.
    pub count: u16,
    /// Cut cells at the start.
    pub head: u16,
    /// Cut cells at the end.
    pub tail: u16,
    /// Number of consecutive segments, this one among them, of which each overlaps another; 0 if it is alone in its cells.
    pub together: u16,
    /// Offset of the first cell from the reference cell of the body (of its image that lies here).
    pub offset: [i32; 3],
    /// Index of the solid fraction of the first cut cell; those of head and tail are side by side.
    pub cut: u32,
}

impl Segment {
    /// One past the last cell.
    pub(crate) fn end(&self) -> u32 {
        self.x + u32::from(self.count)
    }

    /// Solid fraction of the `k`th cell, those of the cut cells being `cut`.
    #[inline(always)]
    pub(crate) fn fraction(&self, cut: &[f32], k: usize) -> f32 {
        let (head, end) = (usize::from(self.head), usize::from(self.count - self.tail));
        match k {
            k if k < head => cut[k],
            k if k >= end => cut[head + (k - end)],
            _ => 1.0,
        }
    }
}

/// Number of cells that bodies cover in a block, each counted once for each body that covers it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoverCount {
    /// Cells.
    pub cells: usize,
    /// Those that a surface cuts.
    pub cut: usize,
    /// Segments of rows that they form.
    pub segments: usize,
}

/// The cells that bodies cover in the rows of a block: segments sorted by row, and the solid fractions of cut cells.
#[derive(Clone, Debug, Default)]
pub struct RowSegments {
    segments: Vec<Segment>,
    /// First segment of each row, and one past the last.
    start: Vec<u32>,
    /// Solid fractions of cut cells, and [`GROUP`] more numbers.
    cut: Vec<f32>,
}

impl RowSegments {
    /// Leaves all rows empty; returns the memory of the fractions.
    pub fn clear(&mut self) -> Vec<f32> {
        // The segments stay where they are, so that sorting others need not write each twice.
        self.start.clear();
        let mut cut = std::mem::take(&mut self.cut);
        cut.clear();
        cut
    }

    /// Sorts `added`, pairs of row and segment. In a row they come by ascending cells; those that overlap stay in the order in
    /// which they were added. `cut` are the fractions that they refer to.
    pub fn sort(&mut self, rows: usize, added: &[(u32, Segment)], cut: Vec<f32>) {
        self.start.clear();
        self.start.resize(rows + 1, 0);
        for (row, _) in added {
            self.start[*row as usize + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        // Each is written below.
        self.segments.resize(added.len(), Segment::default());
        for (row, segment) in added {
            let next = &mut self.start[*row as usize];
            self.segments[*next as usize] = *segment;
            *next += 1;
        }
        // Each start has moved to the end of its row, which is the start of the next.
        let mut first = 0;
        for start in &mut self.start {
            let end = std::mem::replace(start, first);
            if end - first > 1 {
                sort_row(&mut self.segments[first as usize..end as usize]);
            }
            first = end;
        }
        self.cut = cut;
        self.cut.extend([0.0; GROUP]);
    }

    /// Numbers of all.
    pub fn count(&self) -> CoverCount {
        let cells = |of: fn(&Segment) -> u16| self.segments.iter().map(|s| usize::from(of(s))).sum();
        CoverCount {
            cells: cells(|segment| segment.count),
            cut: cells(|segment| segment.head + segment.tail),
            segments: self.segments.len(),
        }
    }

    /// Segments of row `y + ny z`; none before the first [`sort`](Self::sort).
    #[inline]
    pub fn row(&self, row: usize) -> &[Segment] {
        match (self.start.get(row), self.start.get(row + 1)) {
            (Some(&first), Some(&end)) => &self.segments[first as usize..end as usize],
            _ => &[],
        }
    }

    /// Solid fractions of the cut cells of a segment, head then tail, followed by those of other segments.
    #[inline(always)]
    pub(super) fn cut(&self, segment: &Segment) -> &[f32] {
        &self.cut[segment.cut as usize..]
    }
}

/// Sorts the segments of a row, see [`RowSegments::sort`].
fn sort_row(segments: &mut [Segment]) {
    if segments.windows(2).all(|pair| pair[0].end() <= pair[1].x) {
        return;
    }
    // In the order of their addition, for which bodies have no index.
    let mut order: Vec<(u32, Segment)> = (0..).zip(segments.iter().copied()).collect();
    order.sort_by_key(|(_, segment)| segment.x);
    let mut first = 0;
    while first < order.len() {
        let (mut end, mut next) = (order[first].1.end(), first + 1);
        while next < order.len() && order[next].1.x < end {
            end = end.max(order[next].1.end());
            next += 1;
        }
        let together = &mut order[first..next];
        if together.len() > 1 {
            together.sort_unstable_by_key(|(at, _)| *at);
            let count = together.len() as u16;
            for (_, segment) in together {
                segment.together = count;
            }
        }
        first = next;
    }
    for (to, (_, segment)) in segments.iter_mut().zip(order) {
        *to = segment;
    }
}

/// The solids on a block of fluid.
pub struct BlockSolids<'a, M> {
    /// Covered cells.
    pub segments: &'a RowSegments,
    /// Motion of each body, and what it exchanged.
    pub bodies: &'a mut [Body],
    /// Collision of covered cells.
    pub model: M,
    /// Data for a device in place of the covered cells.
    pub images: Option<&'a super::Images>,
}

impl<M: SolidModel> BlockSolids<'_, M> {
    /// Adds all solids to a row, which is empty.
    #[inline(always)]
    pub(super) fn fill<T: Real, R: Lanes<T>>(&self, row: usize, solids: &mut SolidRow<T>) {
        let segments = self.segments.row(row);
        let mut together = 0;
        for (at, segment) in segments.iter().enumerate() {
            let velocity = self.bodies[segment.body as usize].motion.row(segment).to::<T>();
            let cut = self.segments.cut(segment);
            if segment.together == 0 {
                solids.put::<R>(segment, cut, &velocity);
                continue;
            }
            if together == 0 {
                together = segment.together;
                let all = &segments[at..at + usize::from(together)];
                let (first, end) = all.iter().fold((u32::MAX, 0), |(a, b), s| (a.min(s.x), b.max(s.end())));
                solids.open_cells(first as usize..end as usize);
            }
            solids.add::<M>(segment, cut, &velocity);
            together -= 1;
        }
    }

    /// Adds the momentum that a row exchanged in this sweep to its bodies.
    ///
    /// # Safety
    /// The function that this is inlined into is compiled for the instructions of `V`, and the processor has them.
    #[inline(always)]
    pub(super) unsafe fn collect<T: Real, V: Registers>(&mut self, row: usize, solids: &SolidRow<T>) {
        for segment in self.segments.row(row) {
            let Body { motion, exchange, departed, .. } = &mut self.bodies[segment.body as usize];
            let [incoming, outgoing] = if segment.together > 0 && M::BY_VOLUME {
                let cut = self.segments.cut(segment);
                [&solids.incoming, &solids.outgoing].map(|p| received_of_shared(p, segment, cut, solids))
            } else {
                received::<T, V, M>(solids, segment, &motion.row(segment))
            };
            exchange.add(&incoming, 1);
            departed.add(&outgoing, 1);
        }
    }
}

/// Momentum that a body receives from the cells of a segment that it alone covers, and the momentum to subtract in the next step.
#[inline(always)]
fn received<T: Real, V: Registers, M: SolidModel>(
    solids: &SolidRow<T>,
    segment: &Segment,
    velocity: &RowVelocity<f64>,
) -> [ExchangeSum; 2] {
    let (x, count) = (segment.x as usize, usize::from(segment.count));
    assert!(x + count + V::D::WIDTH <= solids.fraction.len());
    let whole = count - count % V::D::WIDTH;
    let cells = count.next_multiple_of(V::D::WIDTH) as i64;
    let offset = (FIXED_MAGIC.to_bits() as i64).wrapping_mul(cells);
    let [first, ny, nz] = segment.offset;
    let zero = V::D::splat(0.0);
    // One after the other: sums of both do not fit into registers. No closures: they would not be compiled for the instruction set.
    let (mut z_levers, mut others) = ([zero; 2], [[0; 4]; 2]);
    for (way, exchanged) in [&solids.incoming, &solids.outgoing].into_iter().enumerate() {
        let mut tallies = [zero; 5];
        let mut done = 0;
        // SAFETY: all arrays of the row are as long as the one just checked; the mask has as many lanes as the widest register.
        unsafe {
            while done < whole {
                let (x, n) = (x + done, first + done as i32);
                add_register::<T, _, M>(&mut tallies, exchanged, velocity, x, n, None);
                done += V::D::WIDTH;
            }
            if done < count {
                let (x, n) = (x + done, first + done as i32);
                let mask = V::D::load(first_lanes(count - done));
                add_register::<T, _, M>(&mut tallies, exchanged, velocity, x, n, Some(mask));
            }
        }
        let [fx, fy, fz, ly, lz] = tallies;
        others[way] = V::D::totals([fx, fy, fz, ly]);
        z_levers[way] = lz;
    }
    let z_levers = V::D::totals([z_levers[0], z_levers[1], zero, zero]);
    let mut sums = [ExchangeSum::default(); 2];
    for way in 0..2 {
        let ([fx, fy, fz, ly], lz) = (others[way], z_levers[way]);
        let force = [fx.wrapping_sub(offset), fy.wrapping_sub(offset), fz.wrapping_sub(offset)];
        let (ly, lz) = (ly.wrapping_sub(offset), lz.wrapping_sub(offset));
        sums[way] = ExchangeSum::of_row(force, ly, lz, ny.into(), nz.into());
    }
    sums
}

/// Adds the register of cells at `x`, whose first has offset `n` in x, to sums of `F`, `n_x F_y` and `n_x F_z`; of the cells of
/// the mask if there is one.
///
/// # Safety
/// The arrays of the row have `WIDTH` numbers from `x` on.
#[inline(always)]
unsafe fn add_register<T: Real, D: Tally, M: SolidModel>(
    sums: &mut [D; 5],
    [px, py, pz, m]: &[Vec<T>; 4],
    velocity: &RowVelocity<f64>,
    x: usize,
    n: i32,
    mask: Option<D>,
) {
    // SAFETY: there are more lanes than in a register.
    let along = unsafe { D::splat(n.into()) + D::load(f64::LANE.as_ptr()) };
    // SAFETY: promised by the caller.
    let at = |p: &Vec<T>| unsafe { p.as_ptr().add(x) };
    // SAFETY: as above.
    let mut f = unsafe { [T::widen::<D>(at(px)), T::widen::<D>(at(py)), T::widen::<D>(at(pz))] };
    if !M::BY_VOLUME {
        // SAFETY: as above.
        let (m, u) = (unsafe { T::widen::<D>(at(m)) }, velocity.lanes::<D>(n));
        f = [f[0] - u[0] * m, f[1] - u[1] * m, f[2] - u[2] * m];
    }
    if let Some(mask) = mask {
        f = [f[0].masked(mask), f[1].masked(mask), f[2].masked(mask)];
    }
    let all = [f[0], f[1], f[2], along * f[1], along * f[2]];
    for k in 0..5 {
        sums[k] = sums[k].tally(all[k]);
    }
}

/// The same, by its share in each cell.
fn received_of_shared<T: Real>(
    exchanged: &[Vec<T>; 4],
    segment: &Segment,
    cut: &[f32],
    solids: &SolidRow<T>,
) -> ExchangeSum {
    let ([px, py, pz, _], [nx, ny, nz]) = (exchanged, segment.offset.map(i64::from));
    let mut sum = ExchangeSum::default();
    for k in 0..usize::from(segment.count) {
        let x = segment.x as usize + k;
        let share = solids.share(x, segment.fraction(cut, k));
        // Where nothing is covered the sweep wrote nothing, and there may be no number.
        if share > 0.0 {
            let [fx, fy, fz] = [px, py, pz].map(|p| share * p[x].into());
            sum.add(&ExchangeSum::of_cell([fx, fy, fz, 0.0], [0.0; 3], [nx + k as i64, ny, nz]), 1);
        }
    }
    sum
}

/// All bits of the first `count` of eight lanes, and none of the others, which belong to other segments or to nothing.
#[inline(always)]
fn first_lanes(count: usize) -> *const f64 {
    static FIRST: [u64; 2 * GROUP] = {
        let mut mask = [0; 2 * GROUP];
        let mut k = 0;
        while k < GROUP {
            mask[k] = !0;
            k += 1;
        }
        mask
    };
    FIRST[GROUP - if count < GROUP { count } else { GROUP }..].as_ptr().cast()
}

#[cfg(test)]
mod tests {
    use super::super::simd::Single;
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

    #[test]
    fn segments_are_sorted_by_row_and_cell_and_keep_their_order_where_they_overlap() {
        let segment = |body: u32, x: u32, count: u16| Segment { body, x, count, ..Segment::default() };
        let mut segments = RowSegments::default();
        assert!(segments.row(1).is_empty());
        let added = [
            (2, segment(0, 5, 6)),
            (0, segment(1, 0, 1)),
            (2, segment(2, 11, 2)),
            (2, segment(3, 3, 3)),
            (1, segment(4, 0, 1)),
            (2, segment(5, 0, 3)),
        ];
        for _ in 0..2 {
            segments.sort(4, &added, Vec::new());
            let bodies = |row| segments.row(row).iter().map(|s| (s.body, s.together)).collect::<Vec<_>>();
            assert_eq!([bodies(0), bodies(1), bodies(3)], [vec![(1, 0)], vec![(4, 0)], vec![]]);
            // The first two share a cell; added in this order.
            assert_eq!(bodies(2), [(5, 0), (0, 2), (3, 2), (2, 0)]);
            assert_eq!(segments.count().cells, 16);
        }
    }

    /// The slow truth: cell by cell.
    #[test]
    fn momentum_along_a_segment_adds_up_to_that_of_its_cells() {
        let values =
            |from: f64| -> Vec<f32> { (0..64).map(|k| (from + 0.1 * f64::from(k)).sin() as f32).collect() };
        let mut solids = SolidRow::<f32>::new(3);
        solids.incoming = [values(0.0), values(1.0), values(2.0), values(3.0)];
        let motion =
            RigidMotion { velocity: [0.1, -0.2, 0.3], angular: [0.01, 0.02, -0.03], centre: [0.2; 3] };
        for count in [1, 7, 8, 9, 16, 21] {
            let segment = Segment { x: 5, count, offset: [-3, 2, 4], ..Segment::default() };
            let velocity = motion.row(&segment);
            let sum = |m: bool| {
                (0..i64::from(count)).fold(ExchangeSum::default(), |mut sum, k| {
                    let p = solids.incoming.each_ref().map(|p| p[5 + k as usize].into());
                    let p = if m { p } else { [p[0], p[1], p[2], 0.0] };
                    let n = [k - 3, 2, 4];
                    sum.add(&ExchangeSum::of_cell(p, motion.at(n), n), 1);
                    sum
                })
            };
            let near = |a: [ExchangeSum; 2], b: ExchangeSum| {
                let [a, _] = a;
                let pairs = a.force.into_iter().chain(a.moment).zip(b.force.into_iter().chain(b.moment));
                pairs.for_each(|(a, b)| assert!(from_fixed(a - b).abs() < 1e-5, "{a} {b}"));
            };
            near(received::<f32, Single, Saturated>(&solids, &segment, &velocity), sum(false));
            near(received::<f32, Single, Homogenised>(&solids, &segment, &velocity), sum(true));
        }
    }
}
