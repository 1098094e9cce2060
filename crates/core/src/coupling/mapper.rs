//! A particle on the lattice: its periodic images that reach a block, and the cells of each row that it covers.

use super::CouplingParams;
use super::faces::{FacePlane, between};
use super::method::{CouplingMethod, with_method};
use crate::domain::{Block, Domain};
use crate::fluid::{RigidMotion, Window};
use crate::math::{Mat3, Quat, Vec3};
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::{Shape, Sphere};
use std::ops::RangeInclusive;

/// `x.floor()`, which is a library call on processors without the instruction.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(x < towards_zero as f64)
}

/// Half the diagonal of a cell.
pub(super) const HALF_DIAGONAL: f64 = 0.8660254037844386;

/// Access to the geometry of a body.
#[derive(Clone, Copy)]
pub(super) enum Geometry<'a> {
    /// A sphere of this radius (m), whose geometry is not worth a call.
    Sphere(f64),
    /// Flat faces.
    Flat(&'a [FacePlane]),
    /// By the methods of the shape.
    Smooth,
}

/// One particle on the lattice.
pub(super) struct Mapper<'a> {
    pub(super) shape: &'a dyn Shape,
    pub(super) geometry: Geometry<'a>,
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

impl<'a> Mapper<'a> {
    /// `planes` are those of [`FacePlane::collect`], `shift` is the distance by which the surface is moved in (cells).
    pub(super) fn new(
        shape: &'a dyn Shape,
        particle: &Particle,
        motion: RigidMotion,
        planes: &'a [FacePlane],
        params: &CouplingParams,
        shift: f64,
    ) -> Self {
        let (dx, cells) = (params.units.dx, 2.0 * params.method.half_layer());
        let orientation = particle.orientation();
        Self {
            shape,
            geometry: match shape.as_sphere() {
                Some(radius) => Geometry::Sphere(radius),
                None if planes.is_empty() => Geometry::Smooth,
                None => Geometry::Flat(planes),
            },
            orientation,
            to_body: orientation.to_rotation_matrix().matrix().transpose(),
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
        let [_, ny, nz] = window.offset.map(f64::from);
        [ny - self.motion.centre[1], nz - self.motion.centre[2]]
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
        let in_cells = |(lo, hi): (f64, f64)| (lo * self.per_dx, hi * self.per_dx);
        let (outer, inner) = match self.geometry {
            Geometry::Sphere(radius) => {
                let interval = |growth: f64| {
                    let (y, z) = (y * self.dx, z * self.dx);
                    Sphere { radius }.row_interval(&self.orientation, y, z, growth).map(in_cells)
                };
                (interval(0.5 * self.layer)?, interval(-0.5 * self.layer))
            }
            Geometry::Flat(planes) => between(planes, y, z, self.half_layer)?,
            Geometry::Smooth => {
                let interval = |growth: f64| {
                    let (y, z) = (y * self.dx, z * self.dx);
                    self.shape.row_interval(&self.orientation, y, z, growth).map(in_cells)
                };
                (interval(0.5 * self.layer)?, interval(-0.5 * self.layer))
            }
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
        if let Geometry::Flat(planes) = self.geometry {
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

/// Surfaces of the particles that are mapped.
#[derive(Default)]
pub(super) struct Surfaces {
    /// Faces of the flat-faced ones, and where those of each begin; one past the last.
    planes: Vec<FacePlane>,
    first_plane: Vec<u32>,
    /// Distance by which the surface of each template is moved in (cells).
    shifts: Vec<f64>,
}

impl Surfaces {
    /// Finds those of all particles.
    pub(super) fn find(&mut self, particles: &ParticleStore, params: &CouplingParams) {
        let dx = params.units.dx;
        if self.shifts.len() != particles.templates.len() {
            let shift =
                |t: &Template| with_method!(params.method, method => method.surface_shift(&*t.shape, dx));
            self.shifts = particles.templates.iter().map(shift).collect();
        }
        self.planes.clear();
        self.first_plane.clear();
        for particle in &particles.particles {
            self.first_plane.push(self.planes.len() as u32);
            let to_world = particle.orientation().to_rotation_matrix().into_inner();
            let shift = self.shifts[particle.template as usize];
            let shape = &*particles.template(particle).shape;
            FacePlane::collect(shape, &to_world, dx, shift, &mut self.planes);
        }
        self.first_plane.push(self.planes.len() as u32);
    }

    /// Particle `i` of those that were [found](Self::find).
    pub(super) fn mapper<'a>(
        &'a self,
        particles: &'a ParticleStore,
        i: usize,
        motion: RigidMotion,
        params: &CouplingParams,
    ) -> Mapper<'a> {
        let particle = &particles.particles[i];
        let planes = &self.planes[self.first_plane[i] as usize..self.first_plane[i + 1] as usize];
        let shift = self.shifts[particle.template as usize];
        Mapper::new(&*particles.template(particle).shape, particle, motion, planes, params, shift)
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
