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
use crate::fluid::{Real, RigidMotion};
use crate::math::{Mat3, Quat, Vec3};
use crate::particle::Particle;
use crate::shape::Shape;
use std::ops::RangeInclusive;

/// The ramp as a function of the signed distance over the width of the ramp; any argument.
///
/// `cos^2(pi/2 (s + 1/2)) = (1 - sin(pi s)) / 2` with the Taylor series of the sine, accurate to 1e-15: the system's
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
    let mut series = 1.0;
    // 1 - xx/(2 3) (1 - xx/(4 5) (1 - ...))
    for k in (1..=10).rev() {
        series = 1.0 - xx * series / f64::from(2 * k * (2 * k + 1));
    }
    0.5 * (1.0 - x * series)
}

/// Solid fractions and velocities (lattice units) of consecutive cells of a row.
pub(super) struct RowCells<T> {
    pub(super) fraction: Vec<T>,
    pub(super) velocity: [Vec<T>; 3],
}

impl<T> RowCells<T> {
    pub(super) fn new() -> Self {
        Self {
            fraction: Vec::new(),
            velocity: [const { Vec::new() }; 3],
        }
    }
}

/// One particle on the lattice.
pub(super) struct Mapper<'a> {
    shape: &'a dyn Shape,
    orientation: Quat,
    to_body: Mat3,
    motion: RigidMotion,
    dx: f64,
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

    /// Fills `cells` for the row at offsets `(.., ny, nz)` and returns the first offset, or `None` if the row is empty.
    #[inline]
    pub(super) fn row<T: Real>(
        &self,
        xs: RangeInclusive<i64>,
        ny: i64,
        nz: i64,
        cells: &mut RowCells<T>,
    ) -> Option<i64> {
        let centre = self.motion.centre;
        let [y, z] = [
            (ny as f64 - centre[1]) * self.dx,
            (nz as f64 - centre[2]) * self.dx,
        ];
        let clip = |(lo, hi): (f64, f64)| {
            let first = (lo / self.dx + centre[0]).ceil() as i64;
            let last = (hi / self.dx + centre[0]).floor() as i64;
            first.max(*xs.start())..=last.min(*xs.end())
        };
        let covered = clip(
            self.shape
                .row_interval(&self.orientation, y, z, 0.5 * self.ramp)?,
        );
        let full = self
            .shape
            .row_interval(&self.orientation, y, z, -0.5 * self.ramp)
            .map_or(1..=0, clip);
        cells.fraction.clear();
        cells.velocity.iter_mut().for_each(Vec::clear);
        let mut first = None;
        let (v, w) = (self.motion.velocity, self.motion.angular);
        let r = [ny as f64 - centre[1], nz as f64 - centre[2]];
        for n in covered {
            let x = n as f64 - centre[0];
            let fraction = if full.contains(&n) {
                1.0
            } else {
                let point = self.to_body * Vec3::new(x * self.dx, y, z);
                cosine_ramp(self.shape.signed_distance(point) / self.ramp)
            };
            if fraction <= 0.0 {
                // Round-off at an end of the interval; the set is convex, so nothing follows a gap.
                if first.is_some() {
                    break;
                }
                continue;
            }
            first.get_or_insert(n);
            cells.fraction.push(T::from_f64(fraction));
            cells.velocity[0].push(T::from_f64(v[0] + (w[1] * r[1] - w[2] * r[0])));
            cells.velocity[1].push(T::from_f64(v[1] + (w[2] * x - w[0] * r[1])));
            cells.velocity[2].push(T::from_f64(v[2] + (w[0] * r[0] - w[1] * x)));
        }
        first
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
            assert!((cosine_ramp(s) - exact).abs() < 1e-15, "{s}");
        }
    }
}
