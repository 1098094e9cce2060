//! Solid fraction of the cells a particle covers.
//!
//! ```text
//! phi = 1                              d <= -w/2
//! phi = cos^2( pi/2 (d + w/2) / w )    -w/2 < d < w/2        d = signed distance of the cell's centre
//! phi = 0                              d >=  w/2             w = width of the ramp
//! ```
//!
//! Reference: Krause et al. (2017), doi:10.1016/j.partic.2016.11.001; Marquardt et al. (2024), section 2.

use crate::domain::{Block, Domain};
use crate::fluid::{CHUNK, Real, RigidMotion};
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

/// Cells of a row that a particle covers, as offsets from its reference cell: all, and those that are fully solid (a
/// subset, maybe empty).
pub(super) struct Covered {
    pub(super) all: RangeInclusive<i64>,
    full: RangeInclusive<i64>,
    /// Distance of the row from the centre of the particle along y and z (cells).
    r: [f64; 2],
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

    /// Which cells of the row at offsets `(xs, ny, nz)` are covered, or `None` if none is.
    #[inline]
    pub(super) fn row(&self, xs: &RangeInclusive<i64>, ny: i64, nz: i64) -> Option<Covered> {
        let centre = self.motion.centre;
        let r = [ny as f64 - centre[1], nz as f64 - centre[2]];
        let [y, z] = r.map(|r| r * self.dx);
        let clip = |(lo, hi): (f64, f64)| {
            let first = (lo * self.per_dx + centre[0]).ceil() as i64;
            let last = (hi * self.per_dx + centre[0]).floor() as i64;
            first.max(*xs.start())..=last.min(*xs.end())
        };
        let all = clip(
            self.shape
                .row_interval(&self.orientation, y, z, 0.5 * self.ramp)?,
        );
        let full = self
            .shape
            .row_interval(&self.orientation, y, z, -0.5 * self.ramp)
            .map_or(1..=0, clip);
        (!all.is_empty()).then_some(Covered { all, full, r })
    }

    /// Solid fractions and velocities (lattice units) of the chunk of cells whose first has offset `first` in x.
    #[inline]
    pub(super) fn chunk<T: Real>(&self, covered: &Covered, first: i64) -> ([T; CHUNK], [[T; CHUNK]; 3]) {
        let (v, w, centre) = (self.motion.velocity, self.motion.angular, self.motion.centre);
        let [ry, rz] = covered.r;
        let mut fraction = [T::ZERO; CHUNK];
        let inside = |range: &RangeInclusive<i64>| {
            let lane = |n: i64| (n - first).clamp(0, CHUNK as i64) as usize;
            lane(*range.start())..lane(*range.end() + 1)
        };
        let (all, full) = (inside(&covered.all), inside(&covered.full));
        let ramp = |fraction: &mut [T; CHUNK], lanes: Range<usize>| {
            for k in lanes {
                let x = (first + k as i64) as f64 - centre[0];
                let point = self.to_body * (Vec3::new(x, ry, rz) * self.dx);
                fraction[k] = T::from_f64(cosine_ramp(self.shape.signed_distance(point) / self.ramp));
            }
        };
        if full.is_empty() {
            ramp(&mut fraction, all);
        } else {
            fraction[full.clone()].fill(T::ONE);
            ramp(&mut fraction, all.start..full.start);
            ramp(&mut fraction, full.end..all.end);
        }
        let along = first as f64 - centre[0];
        let u = T::from_f64(v[0] + (w[1] * rz - w[2] * ry));
        let (constant, slope) = ([v[1] - w[0] * rz, v[2] + w[0] * ry], [w[2], -w[1]]);
        let mut velocity = [[u; CHUNK]; 3];
        for axis in 0..2 {
            for k in 0..CHUNK {
                velocity[axis + 1][k] = T::from_f64(constant[axis] + slope[axis] * (along + k as f64));
            }
        }
        (fraction, velocity)
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
