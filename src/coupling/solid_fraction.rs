//! Solid fraction of the cells a particle covers.
//!
//! ```text
//! phi = 1                              d <= -w/2
//! phi = cos^2( pi/2 (d + w/2) / w )    -w/2 < d < w/2        d = signed distance of the cell's centre
//! phi = 0                              d >=  w/2             w = width of the ramp
//! ```
//!
//! Reference: Krause et al. (2017), doi:10.1016/j.partic.2016.11.001; Marquardt et al. (2024), section 2.

use super::lines::Segment;
use crate::domain::{Block, Domain};
use crate::fluid::{CHUNK, Real, SolidRow};
use crate::math::{Mat3, Quat, Vec3};
use crate::particle::Particle;
use crate::shape::Shape;
use std::ops::{Range, RangeInclusive};

/// The ramp as a function of the signed distance over the width of the ramp; any argument.
///
/// `cos^2(pi/2 (s + 1/2)) = (1 - sin(pi s)) / 2` with the Taylor series of the sine, accurate to 1e-11: the system's
/// trigonometric functions differ between machines, and these numbers feed the state.
#[inline]
pub fn cosine_ramp(s: f64) -> f64 {
    if s <= -0.5 {
        return 1.0;
    }
    if s >= 0.5 {
        return 0.0;
    }
    let x = std::f64::consts::PI * s;
    let xx = x * x;
    let series = SINE
        .iter()
        .rev()
        .fold(0.0, |sum, coefficient| sum * xx + coefficient);
    0.5 * (1.0 - x * series)
}

/// `(-1)^k / (2 k + 1)!`
const SINE: [f64; 8] = {
    let mut coefficients = [1.0; 8];
    let mut k = 1;
    while k < 8 {
        coefficients[k] = -coefficients[k - 1] / ((2 * k) as f64 * (2 * k + 1) as f64);
        k += 1;
    }
    coefficients
};

/// Rigid motion of a particle about its centre, lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RigidMotion {
    /// Velocity of the centre.
    pub(super) velocity: [f64; 3],
    /// Angular velocity (1 / time step).
    pub(super) angular: [f64; 3],
    /// Where the centre lies, relative to the reference cell of the particle (cells).
    pub(super) centre: [f64; 3],
}

impl RigidMotion {
    /// Velocity along the row at offsets `ny, nz`: constant and slope over the x distance from the centre.
    #[inline(always)]
    pub(super) fn along_row(&self, ny: f64, nz: f64) -> ([f64; 3], [f64; 3]) {
        let (v, w) = (self.velocity, self.angular);
        let [ry, rz] = [ny - self.centre[1], nz - self.centre[2]];
        (
            [v[0] + (w[1] * rz - w[2] * ry), v[1] - w[0] * rz, v[2] + w[0] * ry],
            [0.0, w[2], -w[1]],
        )
    }

    /// Velocity in the cell at offset `n`.
    pub(super) fn at(&self, n: [f64; 3]) -> [f64; 3] {
        let (constant, slope) = self.along_row(n[1], n[2]);
        std::array::from_fn(|a| constant[a] + slope[a] * (n[0] - self.centre[0]))
    }
}

/// One particle on the lattice.
pub(super) struct Mapper<'a> {
    shape: &'a dyn Shape,
    orientation: Quat,
    to_body: Mat3,
    motion: RigidMotion,
    dx: f64,
    per_dx: f64,
    /// Width of the ramp (m).
    ramp: f64,
    per_ramp: f64,
}

impl<'a> Mapper<'a> {
    pub(super) fn new(
        shape: &'a dyn Shape,
        particle: &Particle,
        motion: RigidMotion,
        dx: f64,
        ramp_cells: f64,
    ) -> Self {
        let orientation = particle.orientation();
        let to_body = orientation.to_rotation_matrix().matrix().transpose();
        Self {
            shape,
            orientation,
            to_body,
            motion,
            dx,
            per_dx: 1.0 / dx,
            ramp: ramp_cells * dx,
            per_ramp: 1.0 / (ramp_cells * dx),
        }
    }

    /// Calls `visit(offsets, base)` for every periodic image that may touch the block: ranges of offsets from the
    /// reference cell, clipped to the block, and what to add to an offset to get the cell of the block.
    pub(super) fn each_image(
        &self,
        domain: &Domain,
        block: Block,
        reference: [i64; 3],
        mut visit: impl FnMut([RangeInclusive<i64>; 3], [i64; 3]),
    ) {
        let reach = ((self.shape.circumradius() + self.ramp) / self.dx).ceil() as i64 + 1;
        for image in 0..27_i64 {
            let shift = [image % 3 - 1, image / 3 % 3 - 1, image / 9 - 1];
            let base: [i64; 3] = std::array::from_fn(|a| {
                reference[a] + shift[a] * domain.cells[a] as i64 - block.lo[a] as i64
            });
            let offsets = std::array::from_fn(|a| {
                let size = (block.hi[a] - block.lo[a]) as i64;
                (-reach).max(-base[a])..=reach.min(size - 1 - base[a])
            });
            if offsets.iter().all(|range| !range.is_empty()) {
                visit(offsets, base);
            }
        }
    }

    /// Offsets of the covered cells of the row at offsets `(xs, ny, nz)`, and of those fully solid (maybe none, then
    /// crossing), or `None` if none is covered.
    #[inline]
    pub(super) fn row(&self, xs: &RangeInclusive<i64>, ny: i64, nz: i64) -> Option<([i64; 2], [i64; 2])> {
        let centre = self.motion.centre;
        let [y, z] = [
            (ny as f64 - centre[1]) * self.dx,
            (nz as f64 - centre[2]) * self.dx,
        ];
        let clip = |(lo, hi): (f64, f64)| {
            let first = (lo * self.per_dx + centre[0]).ceil() as i64;
            let last = (hi * self.per_dx + centre[0]).floor() as i64;
            [first.max(*xs.start()), last.min(*xs.end())]
        };
        let all = clip(
            self.shape
                .row_interval(&self.orientation, y, z, 0.5 * self.ramp)?,
        );
        let full = self
            .shape
            .row_interval(&self.orientation, y, z, -0.5 * self.ramp)
            .map_or([1, 0], clip);
        (all[0] <= all[1]).then_some((all, full))
    }

    /// Writes the solid fractions and velocities of a segment to the row that is being swept.
    #[inline(always)]
    pub(super) fn fill<T: Real>(&self, segment: &Segment, row: &mut SolidRow<T>) {
        let [ny, nz] = [f64::from(segment.offset[1]), f64::from(segment.offset[2])];
        let (constant, slope) = self.motion.along_row(ny, nz);
        let [ry, rz] = [ny - self.motion.centre[1], nz - self.motion.centre[2]];
        let (first, end) = (segment.x as usize, segment.end() as usize);
        for chunk in first / CHUNK..=(end - 1) / CHUNK {
            let begin = chunk * CHUNK;
            // Offset in x of the first cell of the chunk.
            let n0 = i64::from(segment.offset[0]) + begin as i64 - first as i64;
            let along = n0 as f64 - self.motion.centre[0];
            let mut fraction = [T::ZERO; CHUNK];
            let lane = |n: i64| (n - n0).clamp(0, CHUNK as i64) as usize;
            let all = first.max(begin) - begin..end.min(begin + CHUNK) - begin;
            let full = lane(i64::from(segment.full[0]))..lane(i64::from(segment.full[1]) + 1);
            if full.is_empty() {
                self.ramp(&mut fraction, all, [along, ry, rz]);
            } else {
                for (k, fraction) in fraction.iter_mut().enumerate() {
                    *fraction = if k >= full.start && k < full.end {
                        T::ONE
                    } else {
                        T::ZERO
                    };
                }
                self.ramp(&mut fraction, all.start..full.start, [along, ry, rz]);
                self.ramp(&mut fraction, full.end..all.end, [along, ry, rz]);
            }
            let mut velocity = [[T::ZERO; CHUNK]; 3];
            for axis in 0..3 {
                for k in 0..CHUNK {
                    velocity[axis][k] = T::from_f64(constant[axis] + slope[axis] * (along + k as f64));
                }
            }
            row.add(chunk, &fraction, &velocity);
        }
    }

    /// Solid fractions of cells on the surface; `r` points from the centre to the first cell of the chunk (cells).
    #[inline]
    fn ramp<T: Real>(&self, fraction: &mut [T; CHUNK], lanes: Range<usize>, r: [f64; 3]) {
        for k in lanes {
            let point = self.to_body * (Vec3::new(r[0] + k as f64, r[1], r[2]) * self.dx);
            fraction[k] = T::from_f64(cosine_ramp(self.shape.signed_distance(point) * self.per_ramp));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_is_the_squared_cosine() {
        for i in -60..=60 {
            let s = f64::from(i) / 100.0;
            let exact = match s {
                s if s <= -0.5 => 1.0,
                s if s >= 0.5 => 0.0,
                s => (std::f64::consts::FRAC_PI_2 * (s + 0.5)).cos().powi(2),
            };
            assert!((cosine_ramp(s) - exact).abs() < 1e-11, "{s}");
        }
    }
}
