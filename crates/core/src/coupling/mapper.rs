//! A particle on the lattice: its periodic images that reach a block, and the cells of each row that it covers.

use super::CouplingParams;
use super::cover::Rows;
use super::faces::{FacePlane, between};
use crate::domain::{Block, Domain};
use crate::fluid::{GROUP, LatticeSphere, RigidMotion};
use crate::math::{Mat3, Quat, Vec3, floor};
use crate::shape::{Passage, Shape, Sphere};
use std::ops::RangeInclusive;
use std::sync::Arc;

pub(super) use crate::fluid::HALF_DIAGONAL;

/// Access to the geometry of a body.
pub(super) enum Geometry {
    /// A sphere of this radius (m), whose geometry is not worth a call.
    Sphere(f64),
    /// Flat faces.
    Flat(Vec<FacePlane>),
    /// An ellipsoid with these semi-axes (m).
    Ellipsoid(Vec3),
    /// A cylinder of this radius and half length (m).
    Cylinder(f64, f64),
    /// By the methods of the shape.
    Smooth,
}

/// A periodic image of a body.
#[derive(Clone)]
pub(super) struct Image {
    /// Index of the body.
    pub(super) body: u32,
    /// Offsets from the reference cell, clipped to the block.
    pub(super) offsets: [RangeInclusive<i64>; 3],
    /// Difference of the cell of the block and an offset.
    pub(super) base: [i64; 3],
    /// Rows of the block in y.
    pub(super) rows: i64,
}

impl Image {
    /// Row of the block at these offsets in y and z.
    pub(super) fn row(&self, [ny, nz]: [i64; 2]) -> u32 {
        let [_, by, bz] = self.base;
        ((ny + by) + self.rows * (nz + bz)) as u32
    }
}

/// Calls `visit` for every periodic image of a body with this index that may touch the block; it covers no cells but those with offsets from
/// the first to the last from its reference cell.
pub(super) fn images_within(
    [first, last]: [[i64; 3]; 2],
    domain: &Domain,
    block: Block,
    reference: [i64; 3],
    body: u32,
    mut visit: impl FnMut(&Image),
) {
    // Of each axis, the images that reach into the block.
    let along = |a: usize| {
        (-1..=1).filter(move |shift| *shift == 0 || domain.is_periodic(a)).filter_map(move |shift| {
            let base = reference[a] + shift * domain.cells[a] as i64 - block.lo[a] as i64;
            let size = (block.hi[a] - block.lo[a]) as i64;
            let offsets = first[a].max(-base)..=last[a].min(size - 1 - base);
            (!offsets.is_empty()).then_some((offsets, base))
        })
    };
    for (z, bz) in along(2) {
        for (y, by) in along(1) {
            for (x, bx) in along(0) {
                let rows = (block.hi[1] - block.lo[1]) as i64;
                visit(&Image { body, offsets: [x, y.clone(), z.clone()], base: [bx, by, bz], rows });
            }
        }
    }
}

/// Distance (cells) beyond the surface of a body moved in by `shift` within which cells may be covered. Where three faces meet that are
/// moved out, the corner moves farther.
fn margin(half_layer: f64, shift: f64) -> f64 {
    half_layer + if shift < 0.0 { -3.0 * shift } else { 0.0 }
}

/// [`images_within`] for a sphere whose centre is at `centre` from its reference cell.
pub(super) fn sphere_images(
    sphere: LatticeSphere,
    centre: [f64; 3],
    domain: &Domain,
    block: Block,
    reference: [i64; 3],
    body: u32,
    visit: impl FnMut(&Image),
) {
    let margin = margin(HALF_DIAGONAL, sphere.shift);
    let first = centre.map(|centre| i64::from(floor(-sphere.radius - margin + centre)));
    let last = centre.map(|centre| i64::from(floor(sphere.radius + margin + centre)) + 1);
    images_within([first, last], domain, block, reference, body, visit);
}

/// One particle on the lattice.
pub(super) struct Mapper {
    pub(super) shape: Arc<dyn Shape>,
    pub(super) geometry: Geometry,
    pub(super) orientation: Quat,
    pub(super) to_body: Mat3,
    pub(super) motion: RigidMotion,
    pub(super) dx: f64,
    pub(super) per_dx: f64,
    /// Width of the layer of partly solid cells (m), and one over it.
    layer: f64,
    pub(super) per_layer: f64,
    /// Half of it in cells.
    pub(super) half_layer: f64,
    /// Distance by which the surface is moved in (cells).
    pub(super) shift: f64,
    /// The body of which it is a part that shares space with others, and its number.
    pub(super) of: Option<(Arc<dyn Shape>, usize)>,
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
            geometry: if let Some(radius) = shape.as_sphere() {
                Geometry::Sphere(radius)
            } else if let Some(polyhedron) = shape.as_polyhedron() {
                Geometry::Flat(FacePlane::all(polyhedron, &to_world, dx, shift))
            } else if let Some(semi_axes) = shape.as_ellipsoid() {
                Geometry::Ellipsoid(semi_axes)
            } else if let Some((radius, half)) = shape.as_cylinder() {
                Geometry::Cylinder(radius, half)
            } else {
                Geometry::Smooth
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
            of: None,
        }
    }

    /// Its surface, if it is a sphere of this radius (m).
    pub(super) fn sphere(&self, radius: f64) -> LatticeSphere {
        LatticeSphere { radius: radius * self.per_dx, shift: self.shift }
    }

    /// Calls `visit` for every periodic image of the body, whose index is `body`, that may touch the block, or would if it moved by `skin`
    /// cells.
    pub(super) fn each_image(
        &self,
        domain: &Domain,
        block: Block,
        reference: [i64; 3],
        body: u32,
        skin: f64,
        visit: impl FnMut(&Image),
    ) {
        let (low, high) = match self.geometry {
            Geometry::Sphere(radius) => (Vec3::repeat(-radius), Vec3::repeat(radius)),
            _ => self.shape.bounds(&self.orientation),
        };
        let margin = margin(self.half_layer, self.shift) + skin;
        let mut first: [i64; 3] =
            std::array::from_fn(|a| i64::from(floor(low[a] * self.per_dx - margin + self.motion.centre[a])));
        let mut last: [i64; 3] = std::array::from_fn(|a| {
            i64::from(floor(high[a] * self.per_dx + margin + self.motion.centre[a])) + 1
        });
        if let Some(Passage { axis, .. }) = self.shape.passage() {
            // Every cell along it is covered once.
            let cells = domain.cells[axis] as i64;
            (first[axis], last[axis]) = (-(cells / 2), cells - 1 - cells / 2);
        }
        images_within([first, last], domain, block, reference, body, visit);
    }

    /// Distance (cells) of the middle of a cell at an offset from the reference cell to the surface as the fluid takes it, and its gradient.
    pub(super) fn plane(&self, offset: [i64; 3]) -> (f64, Vec3) {
        let at = Vec3::from_fn(|axis, _| offset[axis] as f64 - self.motion.centre[axis]);
        let (distance, gradient) = self.shape.distance_and_gradient(self.to_body * (at * self.dx));
        (distance * self.per_dx + self.shift, self.to_body.tr_mul(&gradient))
    }

    /// True if it shares space with another part of its body.
    pub(super) fn shares(&self, other: &Self) -> bool {
        let numbers = self.of.as_ref().zip(other.of.as_ref());
        numbers.is_some_and(|((whole, own), (_, its))| whole.shared_with(*own).contains(&(*its as u32)))
    }

    /// Offsets of the covered cells of the row at `y, z` (cells from the centre), and of those fully solid (maybe none, then
    /// crossing), or `None` if none is covered.
    #[inline]
    pub(super) fn row(&self, y: f64, z: f64) -> Option<([i32; 2], [i32; 2])> {
        let centre = self.motion.centre;
        let clip = |(lo, hi): (f64, f64)| [-floor(-(lo + centre[0])), floor(hi + centre[0])];
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
            let covered = |n: i32| self.distance(f64::from(n) - centre[0], y, z) * self.per_layer < 0.5;
            while all[0] <= all[1] && !covered(all[0]) {
                all[0] += 1;
            }
            while all[0] <= all[1] && !covered(all[1]) {
                all[1] -= 1;
            }
        }
        (all[0] <= all[1]).then_some((all, full))
    }

    /// The same for the rows at `y` in the layer `z`.
    pub(super) fn rows(&self, y: &[f64; GROUP], z: f64) -> Rows {
        let mut rows = Rows { all: [[1; GROUP], [0; GROUP]], full: [[1; GROUP], [0; GROUP]] };
        for k in 0..GROUP {
            if let Some((all, full)) = self.row(y[k], z) {
                for end in 0..2 {
                    (rows.all[end][k], rows.full[end][k]) = (all[end], full[end]);
                }
            }
        }
        rows
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
        self.shape.signed_distance(self.to_body * (Vec3::new(x, y, z) * self.dx))
    }
}
