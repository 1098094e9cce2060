//! A particle on the lattice: its periodic images that reach a block, and the cells of each row that it covers.

use super::CouplingParams;
use super::faces::{FacePlane, between};
use crate::domain::{Block, Domain};
use crate::fluid::{RigidMotion, Window};
use crate::math::{Mat3, Quat, Vec3};
use crate::shape::{Shape, Sphere};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// `x.floor()`, which is a library call on processors without the instruction.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(x < towards_zero as f64)
}

/// Half the diagonal of a cell.
pub(super) const HALF_DIAGONAL: f64 = 0.8660254037844386;

/// Access to the geometry of a body.
pub(super) enum Geometry {
    /// A sphere of this radius (m), whose geometry is not worth a call.
    Sphere(f64),
    /// Flat faces.
    Flat(Vec<FacePlane>),
    /// By the methods of the shape.
    Smooth,
}

/// One particle on the lattice.
pub(super) struct Mapper {
    pub(super) shape: Arc<dyn Shape>,
    pub(super) geometry: Geometry,
    orientation: Quat,
    pub(super) to_body: Mat3,
    pub(super) motion: RigidMotion,
    pub(super) dx: f64,
    pub(super) per_dx: f64,
    /// Width of the layer of partly solid cells (m), and one over it.
    layer: f64,
    pub(super) per_layer: f64,
    /// Half of it in cells.
    half_layer: f64,
    /// Distance by which the surface is moved in (cells).
    pub(super) shift: f64,
}

impl Mapper {
    /// With the surface moved in by `shift` (cells).
    pub(super) fn new(
        shape: &Arc<dyn Shape>,
        orientation: Quat,
        motion: RigidMotion,
        params: &CouplingParams,
        shift: f64,
    ) -> Self {
        let (dx, cells) = (params.units.dx, 2.0 * params.method.half_layer());
        let to_world = orientation.to_rotation_matrix().into_inner();
        Self {
            geometry: match (shape.as_sphere(), shape.as_polyhedron()) {
                (Some(radius), _) => Geometry::Sphere(radius),
                (None, Some(polyhedron)) => Geometry::Flat(FacePlane::all(polyhedron, &to_world, dx, shift)),
                (None, None) => Geometry::Smooth,
            },
            shape: shape.clone(),
            orientation,
            to_body: to_world.transpose(),
            motion,
            dx,
            per_dx: 1.0 / dx,
            layer: cells * dx,
            per_layer: 1.0 / (cells * dx),
            half_layer: 0.5 * cells,
            shift,
        }
    }

    /// Position of cell `k` of a window in x, from the centre (cells).
    #[inline(always)]
    pub(super) fn x(&self, window: &Window, k: usize) -> f64 {
        (f64::from(window.offset[0]) + k as f64) - self.motion.centre[0]
    }

    /// Positions of a row in y and z, from the centre (cells).
    #[inline(always)]
    pub(super) fn row_distance(&self, window: &Window) -> [f64; 2] {
        let ([_, ny, nz], [_, y, z]) = (window.offset, self.motion.centre);
        [f64::from(ny) - y, f64::from(nz) - z]
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
        let (low, high) = match self.geometry {
            Geometry::Sphere(radius) => (Vec3::repeat(-radius), Vec3::repeat(radius)),
            _ => self.shape.bounds(&self.orientation),
        };
        // Cells with their centre within the layer, and one more against rounding.
        let first: [i64; 3] =
            std::array::from_fn(|a| floor((low[a] - self.layer) * self.per_dx + self.motion.centre[a]) - 1);
        let last: [i64; 3] =
            std::array::from_fn(|a| floor((high[a] + self.layer) * self.per_dx + self.motion.centre[a]) + 2);
        for image in 0..27_i64 {
            let shift = [image % 3 - 1, image / 3 % 3 - 1, image / 9 - 1];
            if (0..3).any(|a| shift[a] != 0 && !domain.periodic[a]) {
                continue;
            }
            let base: [i64; 3] = std::array::from_fn(|a| {
                reference[a] + shift[a] * domain.cells[a] as i64 - block.lo[a] as i64
            });
            let offsets = std::array::from_fn(|a| {
                let size = (block.hi[a] - block.lo[a]) as i64;
                first[a].max(-base[a])..=last[a].min(size - 1 - base[a])
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
        let [y, z] = [ny as f64 - centre[1], nz as f64 - centre[2]];
        let clip = |(lo, hi): (f64, f64)| {
            let first = -floor(-(lo + centre[0]));
            let last = floor(hi + centre[0]);
            [first.max(*xs.start()), last.min(*xs.end())]
        };
        let interval = |growth: f64| {
            let (y, z) = (y * self.dx, z * self.dx);
            let found = match self.geometry {
                Geometry::Sphere(radius) => Sphere { radius }.row_interval(&self.orientation, y, z, growth),
                _ => self.shape.row_interval(&self.orientation, y, z, growth),
            };
            found.map(|(lo, hi)| (lo * self.per_dx, hi * self.per_dx))
        };
        let (outer, inner) = match &self.geometry {
            Geometry::Flat(planes) => between(planes, y, z, self.half_layer)?,
            _ => (interval(0.5 * self.layer)?, interval(-0.5 * self.layer)),
        };
        let (mut all, full) = (clip(outer), inner.map_or([1, 0], clip));
        if !matches!(self.geometry, Geometry::Sphere(_)) {
            // The intervals may be a little too long, beyond edges between faces for instance.
            let covered = |n: i64| self.distance(n as f64 - centre[0], y, z) * self.per_layer < 0.5;
            while all[0] <= all[1] && !covered(all[0]) {
                all[0] += 1;
            }
            while all[0] <= all[1] && !covered(all[1]) {
                all[1] -= 1;
            }
        }
        (all[0] <= all[1]).then_some((all, full))
    }

    /// Signed distance (m) of a point relative to the centre (cells, world axes); where it is above half the layer, it
    /// may be anything above that.
    #[inline(always)]
    pub(super) fn distance(&self, x: f64, y: f64, z: f64) -> f64 {
        if let Geometry::Sphere(radius) = self.geometry {
            return (x * x + (y * y + z * z)).sqrt() * self.dx - radius;
        }
        if let Geometry::Flat(planes) = &self.geometry {
            let height = planes
                .iter()
                .map(|plane| plane.height(x, plane.rest(y, z)))
                .fold(f64::NEG_INFINITY, f64::max);
            // Inside, the nearest face is the nearest surface; outside it may be an edge or a corner.
            if height <= 0.0 || height >= self.half_layer {
                return height * self.dx;
            }
        }
        // Corners move further than faces.
        let moved = match self.geometry {
            Geometry::Flat(_) => 3.0 * self.shift * self.dx,
            _ => 0.0,
        };
        moved + self.shape.signed_distance(self.to_body * (Vec3::new(x, y, z) * self.dx))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_the_floor() {
        for x in [-2.0, -1.5, -0.1, 0.0, 0.1, 0.999, 1.0, 7.5] {
            assert_eq!(floor(x), f64::floor(x) as i64);
        }
    }
}
