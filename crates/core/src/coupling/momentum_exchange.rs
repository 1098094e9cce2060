//! Momentum exchange: the momentum that the cells of a particle receive from the fluid, summed exactly.
//!
//! ```text
//! F = (p_in - m_in u_s) - (p_out - m_out u_s)                                                  homogenised cells
//! F = G + S(t) - S(t - dt),   G = -b sum c W_solid,   S = rho V U + sum e rho (u - u_s)        partially saturated cells
//! ```
//!
//! In homogenised cells `p`, `m` are the momentum and mass (minus the weights) that came in and left over all links
//! of a covered cell. Inner links cancel, so the sums are moments that the collision computes anyway. Cells that
//! were covered only before or only now are corrected one by one
//! ([`Fluid::departed`](crate::fluid::Fluid::departed)). `S` is the momentum inside the particle. Derivation:
//! `docs/theory/coupling.md`.
//!
//! References: Wen et al. (2014), doi:10.1016/j.jcp.2014.02.018; Marquardt et al. (2024),
//! doi:10.1016/j.cpc.2024.109321, whose Eq. (16) lacks the opposite index and the minus sign; Noble and Torczynski
//! (1998), doi:10.1142/S0129183198001084.

use super::lines::Segment;
use super::solid_fraction::RigidMotion;
use crate::fluid::{CHUNK, Number, Real, SolidRow};
use crate::math::{sum_fixed, to_fixed};

/// Momentum and angular momentum about the reference cell that a body receives in one time step, as exact sums of
/// fixed-point numbers: add them up in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct ExchangeSum {
    /// `sum F`.
    pub(super) force: [i64; 3],
    /// `sum n x F`, `n` the integer offset from the reference cell.
    pub(super) moment: [i64; 3],
}

impl ExchangeSum {
    /// `self + sign * other`.
    pub(super) fn add(&mut self, other: &Self, sign: i64) {
        for a in 0..3 {
            self.force[a] = self.force[a].wrapping_add(sign.wrapping_mul(other.force[a]));
            self.moment[a] = self.moment[a].wrapping_add(sign.wrapping_mul(other.moment[a]));
        }
    }

    /// The same about a reference cell that lies `shift` before the present one: offsets grow by `shift`.
    pub(super) fn shifted(&self, shift: [i64; 3]) -> Self {
        let (mut moved, f) = (*self, self.force);
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let turn = shift[b].wrapping_mul(f[c]).wrapping_sub(shift[c].wrapping_mul(f[b]));
            moved.moment[a] = moved.moment[a].wrapping_add(turn);
        }
        moved
    }

    /// Contribution of one cell at offset `n` with `exchanged = [p, m]` and solid velocity `u`.
    pub(super) fn of_cell(exchanged: [f64; 4], u: [f64; 3], n: [i64; 3]) -> Self {
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

/// Adds the momentum that the cells of a segment received in this sweep to `incoming` and that which they sent to
/// `outgoing`.
#[inline(always)]
pub(super) fn add_segment<T: Real>(
    segment: &Segment,
    motion: &RigidMotion,
    row: &SolidRow<T>,
    incoming: &mut ExchangeSum,
    outgoing: &mut ExchangeSum,
) {
    let [ny, nz] = [f64::from(segment.offset[1]), f64::from(segment.offset[2])];
    let (constant, slope) = motion.along_row(ny, nz);
    let (constant, slope) = (constant.map(T::from_f64), slope.map(T::from_f64));
    for done in (0..segment.count as usize).step_by(CHUNK) {
        let count = (segment.count as usize - done).min(CHUNK);
        // Offset in x of the first cell of the window.
        let n =
            [i64::from(segment.offset[0]) + done as i64, segment.offset[1].into(), segment.offset[2].into()];
        // The integer offset first, the centre last: rounded alike wherever a window begins.
        let (n0, centre) = (T::from_f64(n[0] as f64), T::from_f64(motion.centre[0]));
        let mut u = [[T::ZERO; CHUNK]; 3];
        for axis in 0..3 {
            for k in 0..CHUNK {
                u[axis][k] = constant[axis] + slope[axis] * (n0 + T::LANE[k] - centre);
            }
        }
        let [came, left] = row.exchanged(segment.x as usize + done);
        add_cells(came, &u, count, n, incoming);
        add_cells(left, &u, count, n, outgoing);
    }
}

/// Adds the parts of a segment in what the solids of its partially saturated cells received and hold to `incoming`,
/// and in what they hold to `outgoing`; its fractions come from `windows`.
#[inline(always)]
pub(super) fn add_shares<'a, T: Real>(
    segment: &Segment,
    windows: &mut impl Iterator<Item = &'a [T; CHUNK]>,
    row: &SolidRow<T>,
    incoming: &mut ExchangeSum,
    outgoing: &mut ExchangeSum,
) {
    for done in (0..segment.count as usize).step_by(CHUNK) {
        let count = (segment.count as usize - done).min(CHUNK);
        let n =
            [i64::from(segment.offset[0]) + done as i64, segment.offset[1].into(), segment.offset[2].into()];
        let shares = windows.next().expect("one for each window");
        let [came, left] = row.exchanged(segment.x as usize + done);
        add_parts(came, shares, count, n, incoming);
        add_parts(left, shares, count, n, outgoing);
    }
}

/// Adds `shares` of what the first `count` cells of a window exchanged, whose first cell has offset `n`.
///
/// As [`add_cells`], axis by axis: with the forces of all axes handed to a function for both, collecting takes twice
/// as long.
#[inline(always)]
fn add_parts<T: Real>(
    exchanged: [&[T; CHUNK]; 4],
    shares: &[T; CHUNK],
    count: usize,
    n: [i64; 3],
    sum: &mut ExchangeSum,
) {
    let mut f = [[0.0_f64; CHUNK]; 3];
    for axis in 0..3 {
        let p = exchanged[axis];
        let mut force = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            force[k] = shares[k] * p[k];
        }
        f[axis] = masked(&force, count);
    }
    sum.add(&levered(&f, n), 1);
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

/// Adds the first `count` cells of a window whose first cell has offset `n`.
#[inline(always)]
fn add_cells<T: Real>(
    exchanged: [&[T; CHUNK]; 4],
    u: &[[T; CHUNK]; 3],
    count: usize,
    n: [i64; 3],
    sum: &mut ExchangeSum,
) {
    let mut f = [[0.0_f64; CHUNK]; 3];
    for axis in 0..3 {
        let (p, m, u) = (exchanged[axis], exchanged[3], &u[axis]);
        let mut force = [T::ZERO; CHUNK];
        for k in 0..CHUNK {
            force[k] = p[k] - u[k] * m[k];
        }
        f[axis] = masked(&force, count);
    }
    sum.add(&levered(&f, n), 1);
}

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

/// The sum over a window whose first cell has offset `n`.
#[inline(always)]
fn levered(f: &[[f64; CHUNK]; 3], n: [i64; 3]) -> ExchangeSum {
    let (mut levered_y, mut levered_z) = ([0.0; CHUNK], [0.0; CHUNK]);
    for k in 0..CHUNK {
        let nx = n[0] as f64 + f64::LANE[k];
        levered_y[k] = nx * f[1][k];
        levered_z[k] = nx * f[2][k];
    }
    // Along the row only the lever in x changes; the other two multiply sums, which is exact in integers.
    let f = [sum_fixed(&f[0]), sum_fixed(&f[1]), sum_fixed(&f[2])];
    ExchangeSum::of_row(f, sum_fixed(&levered_y), sum_fixed(&levered_z), n[1], n[2])
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
}
