//! Bodies on a block of fluid, as data: the cells each covers, its motion, and the momentum it exchanged.
//!
//! [`BlockSolids`] is all that a sweep gets of the particles and all that it returns, whatever device runs it. The sweep
//! on the processor evaluates solid fractions row by row, just before the row collides, and collects momentum just
//! after, all in the first-level cache; nothing is stored per cell of the block.

use super::Real;
use super::solid::{CHUNK, SolidModel, SolidRow};
use crate::math::{sum_fixed, to_fixed};
use std::ops::Range;

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

    /// Sum of the forces `f` of a window whose first cell has offset `n`.
    #[inline(always)]
    fn of_window(f: &[[f64; CHUNK]; 3], n: [i32; 3]) -> Self {
        let (mut lever_y, mut lever_z) = ([0.0; CHUNK], [0.0; CHUNK]);
        for k in 0..CHUNK {
            let nx = f64::from(n[0]) + f64::LANE[k];
            lever_y[k] = nx * f[1][k];
            lever_z[k] = nx * f[2][k];
        }
        // Along the row only the lever in x changes; the other two multiply sums, which is exact in integers.
        let f = [sum_fixed(&f[0]), sum_fixed(&f[1]), sum_fixed(&f[2])];
        Self::of_row(f, sum_fixed(&lever_y), sum_fixed(&lever_z), n[1].into(), n[2].into())
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
    /// Velocity along the row at offsets `ny, nz`: constant and slope over the x distance from the centre.
    #[inline(always)]
    fn along_row(&self, ny: f64, nz: f64) -> ([f64; 3], [f64; 3]) {
        let (v, w) = (self.velocity, self.angular);
        let [ry, rz] = [ny - self.centre[1], nz - self.centre[2]];
        ([v[0] + (w[1] * rz - w[2] * ry), v[1] - w[0] * rz, v[2] + w[0] * ry], [0.0, w[2], -w[1]])
    }

    /// Velocity in the cell at offset `n`.
    pub(crate) fn at(&self, n: [i64; 3]) -> [f64; 3] {
        let n = n.map(|n| n as f64);
        let (constant, slope) = self.along_row(n[1], n[2]);
        std::array::from_fn(|a| constant[a] + slope[a] * (n[0] - self.centre[0]))
    }

    /// Velocities along the row of a segment.
    #[inline(always)]
    fn row<T: Real>(&self, segment: &Segment) -> RowVelocity<T> {
        let [_, ny, nz] = segment.offset.map(f64::from);
        let (constant, slope) = self.along_row(ny, nz);
        RowVelocity {
            constant: constant.map(T::from_f64),
            slope: slope.map(T::from_f64),
            centre: T::from_f64(self.centre[0]),
        }
    }
}

/// Velocity of a body along a row: constant and slope over the x distance from the centre.
struct RowVelocity<T> {
    constant: [T; 3],
    slope: [T; 3],
    centre: T,
}

impl<T: Real> RowVelocity<T> {
    /// Velocities in the cells of a window whose first has offset `n` in x.
    #[inline(always)]
    fn window(&self, n: i32) -> [[T; CHUNK]; 3] {
        // The integer offset first, the centre last: rounded alike wherever a window begins.
        let n = T::from_f64(n.into());
        let mut u = [[T::ZERO; CHUNK]; 3];
        for axis in 0..3 {
            for k in 0..CHUNK {
                u[axis][k] = self.constant[axis] + self.slope[axis] * (n + T::LANE[k] - self.centre);
            }
        }
        u
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
    /// What is subtracted in the next step: momentum that left the covered cells, or that inside the body.
    pub departed: ExchangeSum,
}

/// Consecutive cells of a row that belong to one body (one of its periodic images).
#[derive(Clone, Copy, Debug, Default)]
pub struct Segment {
    /// Index of the body.
    pub body: u32,
    /// First cell of the block.
    pub x: u32,
    /// Number of cells.
    pub count: u32,
    /// Offset of the first cell from the reference cell of the body (of its image that lies here).
    pub offset: [i32; 3],
    /// First and last offset in x of the cells that are wholly solid; empty if they cross.
    pub full: [i32; 2],
}

impl Segment {
    /// One past the last cell.
    pub(crate) fn end(&self) -> u32 {
        self.x + self.count
    }

    /// At most [`CHUNK`] cells from the `done`th on.
    #[inline(always)]
    pub(crate) fn window(&self, done: usize) -> Window {
        let count = (self.count as usize - done).min(CHUNK);
        let offset = [self.offset[0] + done as i32, self.offset[1], self.offset[2]];
        let lane = |n: i32| (n - offset[0]).clamp(0, count as i32) as usize;
        let full = lane(self.full[0])..lane(self.full[1] + 1);
        let full = if full.is_empty() { 0..0 } else { full };
        Window { x: self.x as usize + done, count, offset, full }
    }
}

/// At most [`CHUNK`] cells of a segment.
pub struct Window {
    /// First cell of the block.
    pub x: usize,
    /// Number of cells.
    pub count: usize,
    /// Offset of the first cell.
    pub offset: [i32; 3],
    /// Cells that are wholly solid, counted from the first.
    pub full: Range<usize>,
}

/// All segments of a block, sorted by row; within a row in the order they were added.
#[derive(Clone, Debug, Default)]
pub struct RowSegments {
    segments: Vec<Segment>,
    /// First segment of each row, and one past the last.
    start: Vec<u32>,
}

impl RowSegments {
    /// Sorts `added`, pairs of row and segment; the order within a row is kept.
    pub fn sort(&mut self, rows: usize, added: &[(u32, Segment)]) {
        self.start.clear();
        self.start.resize(rows + 1, 0);
        for &(row, _) in added {
            self.start[row as usize + 1] += 1;
        }
        for row in 0..rows {
            self.start[row + 1] += self.start[row];
        }
        self.segments.clear();
        self.segments.resize(added.len(), Segment::default());
        for &(row, segment) in added {
            let next = &mut self.start[row as usize];
            self.segments[*next as usize] = segment;
            *next += 1;
        }
        // Each start has moved to the end of its row, which is the start of the next.
        self.start.rotate_right(1);
        self.start[0] = 0;
    }

    /// Cells of all segments.
    pub fn cells(&self) -> usize {
        self.segments.iter().map(|segment| segment.count as usize).sum()
    }

    /// Segments of row `y + ny z`; none before the first [`sort`](Self::sort).
    #[inline]
    pub fn row(&self, row: usize) -> &[Segment] {
        match (self.start.get(row), self.start.get(row + 1)) {
            (Some(&first), Some(&end)) => &self.segments[first as usize..end as usize],
            _ => &[],
        }
    }
}

/// Solid fractions of the cells that bodies cover, and the method that couples them to the fluid.
pub trait Bodies {
    /// Collision of covered cells.
    type Model: SolidModel;
    /// Its parameters.
    fn model(&self) -> Self::Model;
    /// Writes the solid fractions of the cells of a window that are not wholly solid; they are zero before.
    fn fractions<T: Real>(&self, body: usize, window: &Window, fraction: &mut [T; CHUNK]);
}

/// The solids on a block of fluid.
pub struct BlockSolids<'a, T, B> {
    /// Covered cells; within a row by ascending id of the particle.
    pub segments: &'a RowSegments,
    /// Motion of each body, and what it exchanged.
    pub bodies: &'a mut [Body],
    /// Geometry of each body.
    pub geometry: B,
    /// Fractions of the row that was filled last, window by window, if they are needed after its collision.
    pub(super) fractions: Option<Vec<[T; CHUNK]>>,
}

impl<'a, T: Real, B: Bodies> BlockSolids<'a, T, B> {
    /// Solids for a sweep.
    pub fn new(segments: &'a RowSegments, bodies: &'a mut [Body], geometry: B) -> Self {
        Self { segments, bodies, geometry, fractions: B::Model::BY_VOLUME.then(Vec::new) }
    }

    /// Adds all solids to a row, which is empty.
    #[inline(always)]
    pub(super) fn fill(&mut self, row: usize, solids: &mut SolidRow<T>) {
        if let Some(fractions) = &mut self.fractions {
            fractions.clear();
        }
        for segment in self.segments.row(row) {
            let velocity = self.bodies[segment.body as usize].motion.row::<T>(segment);
            for done in (0..segment.count as usize).step_by(CHUNK) {
                let window = segment.window(done);
                // One on the cells that are wholly solid, zero elsewhere.
                let (rise, fall) =
                    (&T::STEP[CHUNK - window.full.start..], &T::STEP[CHUNK - window.full.end..]);
                let mut fraction = [T::ZERO; CHUNK];
                for k in 0..CHUNK {
                    fraction[k] = rise[k] - fall[k];
                }
                self.geometry.fractions(segment.body as usize, &window, &mut fraction);
                let velocity = velocity.window(window.offset[0]);
                solids.add::<B::Model>(window.x, window.count, &fraction, &velocity);
                if let Some(fractions) = &mut self.fractions {
                    fractions.push(fraction);
                }
            }
        }
    }

    /// Adds the momentum that a row exchanged in this sweep to its bodies.
    #[inline(always)]
    pub(super) fn collect(&mut self, row: usize, solids: &SolidRow<T>) {
        let (mut fractions, none) = (self.fractions.as_deref().unwrap_or_default().iter(), [T::ZERO; CHUNK]);
        for segment in self.segments.row(row) {
            let Body { motion, exchange, departed, .. } = &mut self.bodies[segment.body as usize];
            let velocity = motion.row::<T>(segment);
            for done in (0..segment.count as usize).step_by(CHUNK) {
                let window = segment.window(done);
                let u = velocity.window(window.offset[0]);
                let kept = if B::Model::BY_VOLUME { fractions.next() } else { Some(&none) };
                let fraction = kept.expect("one for each window");
                let [incoming, outgoing] = solids.exchanged(window.x);
                exchange.add(&received::<T, B::Model>(incoming, fraction, &u, &window), 1);
                departed.add(&received::<T, B::Model>(outgoing, fraction, &u, &window), 1);
            }
        }
    }
}

/// Momentum that a body receives from the cells of a window. Axis by axis, which is twice as fast as all at once.
#[inline(always)]
fn received<T: Real, M: SolidModel>(
    exchanged: [&[T; CHUNK]; 4],
    fraction: &[T; CHUNK],
    u: &[[T; CHUNK]; 3],
    window: &Window,
) -> ExchangeSum {
    let mut f = [[0.0_f64; CHUNK]; 3];
    for axis in 0..3 {
        f[axis] = masked(&M::force(exchanged[axis], exchanged[3], fraction, &u[axis]), window.count);
    }
    ExchangeSum::of_window(&f, window.offset)
}

/// [`CHUNK`] times all bits, then [`CHUNK`] times none.
const FIRST: [u64; 2 * CHUNK] = {
    let mut mask = [0; 2 * CHUNK];
    let mut k = 0;
    while k < CHUNK {
        mask[k] = !0;
        k += 1;
    }
    mask
};

/// The first `count` numbers, then zeros: the other cells belong to other segments, or are beyond the row and
/// undefined. Without a branch.
#[inline(always)]
pub(super) fn masked<T: Real>(force: &[T; CHUNK], count: usize) -> [f64; CHUNK] {
    let mask = &FIRST[CHUNK - count..];
    let mut masked = [0.0_f64; CHUNK];
    // A loop: what `array::from_fn` calls is not compiled for the instruction set of the sweep.
    for k in 0..CHUNK {
        let wide: f64 = force[k].into();
        masked[k] = f64::from_bits(wide.to_bits() & mask[k]);
    }
    masked
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn segments_are_sorted_by_row_and_keep_their_order_within_it() {
        let segment = |body: u32| Segment { body, count: 1, ..Segment::default() };
        let mut segments = RowSegments::default();
        assert!(segments.row(1).is_empty());
        let added = [(2, segment(0)), (0, segment(1)), (2, segment(2)), (1, segment(3))];
        for _ in 0..2 {
            segments.sort(4, &added);
            let bodies = |row| segments.row(row).iter().map(|s| s.body).collect::<Vec<_>>();
            assert_eq!([bodies(0), bodies(1), bodies(2), bodies(3)], [vec![1], vec![3], vec![0, 2], vec![]]);
            assert_eq!(segments.cells(), 4);
        }
    }
}
