//! Solid fraction of the cells that a particle covers.
//!
//! ```text
//! phi = 1                              d <= -w/2
//! phi = cos^2( pi/2 (d + w/2) / w )    -w/2 < d < w/2        d = signed distance of the cell's centre
//! phi = 0                              d >=  w/2             w = width of the ramp
//! ```
//!
//! or, for partially saturated cells, the exact volume fraction ([`volume_fraction`](super::volume_fraction)).
//! There flat faces are moved out by `0.1 E` cells, `E = V^(1/3) sum L (1 - cos t) / (2 A)` over the edges of
//! length `L` at which the normals turn by `t`, since a lattice does not resolve the singular stress at an edge
//! (`docs/theory/coupling.md`).
//!
//! Reference: Krause et al. (2017), doi:10.1016/j.partic.2016.11.001; Marquardt et al. (2024), section 2.

use super::faces::{FacePlane, between};
use super::lines::Segment;
use super::surface::{BLOCK, Surface, put};
use super::volume_fraction::{LEAST, at_least, behind, behind_plane, curved};
use crate::domain::{Block, Domain};
use crate::fluid::{CHUNK, Real, SolidRow};
use crate::math::{Mat3, Quat, Vec3};
use crate::particle::Particle;
use crate::shape::{Shape, Sphere};
use std::ops::{Range, RangeInclusive};

/// The ramp as a function of the signed distance over the width of the ramp; any argument.
///
/// `cos^2(pi/2 (s + 1/2)) = (1 - sin(pi s)) / 2` with the Taylor series of the sine, accurate to 1e-11: the system's
/// trigonometric functions differ between machines, and these numbers feed the state.
#[inline(always)]
pub(super) fn cosine_ramp(s: f64) -> f64 {
    if s <= -0.5 {
        return 1.0;
    }
    if s >= 0.5 {
        return 0.0;
    }
    let x = std::f64::consts::PI * s;
    let x2 = x * x;
    // In pairs of pairs: shorter chains of dependent operations than term by term.
    let (x4, c) = (x2 * x2, &SINE);
    let (low, high) =
        ((c[0] + c[1] * x2) + (c[2] + c[3] * x2) * x4, (c[4] + c[5] * x2) + (c[6] + c[7] * x2) * x4);
    0.5 * (1.0 - x * (low + high * (x4 * x4)))
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

/// `x.floor()`, which is a library call on processors without the instruction.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(x < towards_zero as f64)
}

/// Rigid motion of a particle about its centre, lattice units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RigidMotion {
    /// Velocity of the centre.
    pub(super) velocity: [f64; 3],
    /// Angular velocity (1 / time step).
    pub(super) angular: [f64; 3],
    /// Position of the centre relative to the reference cell of the particle (cells).
    pub(super) centre: [f64; 3],
}

impl RigidMotion {
    /// Velocity along the row at offsets `ny, nz`: constant and slope over the x distance from the centre.
    #[inline(always)]
    pub(super) fn along_row(&self, ny: f64, nz: f64) -> ([f64; 3], [f64; 3]) {
        let (v, w) = (self.velocity, self.angular);
        let [ry, rz] = [ny - self.centre[1], nz - self.centre[2]];
        ([v[0] + (w[1] * rz - w[2] * ry), v[1] - w[0] * rz, v[2] + w[0] * ry], [0.0, w[2], -w[1]])
    }

    /// Velocity in the cell at offset `n`.
    pub(super) fn at(&self, n: [i64; 3]) -> [f64; 3] {
        let n = n.map(|n| n as f64);
        let (constant, slope) = self.along_row(n[1], n[2]);
        std::array::from_fn(|a| constant[a] + slope[a] * (n[0] - self.centre[0]))
    }
}

/// By how much the surface of a body is moved in (cells). Smooth bodies, to count as a plane in each cell: by their
/// mean curvature, taken as the same everywhere. Flat faces are moved out, for their edges: see the head of this
/// module.
///
/// `(k_1 + k_2) / 24` in the mean over the surface is `M / (12 A)` with the area `A` and, after Minkowski, the
/// integral of the mean curvature `M = 2 pi b`, `b` the mean width.
pub(super) fn shift_of(shape: &dyn Shape, dx: f64, out: f64) -> f64 {
    if let Some(radius) = shape.as_sphere() {
        return curved(2.0 * dx / radius);
    }
    if let Some(polyhedron) = shape.as_polyhedron() {
        return -out * polyhedron.sharpness();
    }
    // Lebedev's 26 points, exact for polynomials of degree 7: axes, diagonals of faces, diagonals of the cube.
    let mut width = 0.0;
    for n in 0..27 {
        let direction = Vec3::from([n % 3, n / 3 % 3, n / 9].map(|k| f64::from(k - 1)));
        let weight = match direction.norm_squared() as i32 {
            1 => 1.0 / 21.0,
            2 => 4.0 / 105.0,
            3 => 9.0 / 280.0,
            _ => continue,
        };
        let unit = direction.normalize();
        width += 2.0 * weight * shape.support(unit).dot(&unit);
    }
    let mesh = shape.surface_mesh(2);
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|i| mesh.points[i as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
        .sum();
    std::f64::consts::TAU * width / (12.0 * area) * dx
}

/// Half the diagonal of a cell.
const HALF_DIAGONAL: f64 = 0.8660254037844386;

/// Distances from the centre of a sphere below this count as this (cells): far within, in any direction.
const NEAR: f64 = 1e-3;

/// Solid fraction of a cell as a function of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fraction {
    /// A cosine ramp of this width (cells) of the distance of the cell's centre.
    Ramp(f64),
    /// Volume fraction of the cell; the flat faces of a cube are moved out by this distance (cells), those of other
    /// bodies as their edges ask for.
    Volume(f64),
}

impl Fraction {
    /// Volume fractions with faces moved so that the drag is right.
    pub const VOLUME: Self = Self::Volume(0.1);

    /// Half the width of the layer (cells) outside of which cells are wholly solid or wholly fluid.
    pub fn half_layer(self) -> f64 {
        match self {
            Self::Ramp(width) => 0.5 * width,
            Self::Volume(_) => HALF_DIAGONAL,
        }
    }
}

/// Access to the geometry of a body.
#[derive(Clone, Copy)]
enum Geometry<'a> {
    /// A sphere of this radius (m), whose geometry is not worth a call.
    Sphere(f64),
    /// Flat faces.
    Flat(&'a [FacePlane]),
    /// By the methods of the shape.
    Smooth,
}

/// One particle on the lattice.
pub(super) struct Mapper<'a> {
    shape: &'a dyn Shape,
    geometry: Geometry<'a>,
    orientation: Quat,
    to_body: Mat3,
    motion: RigidMotion,
    dx: f64,
    per_dx: f64,
    /// Width of the ramp (m).
    ramp: f64,
    per_ramp: f64,
    /// Half of it in cells.
    half_ramp: f64,
    /// True if the fractions are volume fractions.
    by_volume: bool,
    /// By how much the surface is moved in (cells).
    shift: f64,
}

impl<'a> Mapper<'a> {
    /// `planes` are those of [`FacePlane::collect`].
    pub(super) fn new(
        shape: &'a dyn Shape,
        particle: &Particle,
        motion: RigidMotion,
        planes: &'a [FacePlane],
        dx: f64,
        fraction: Fraction,
        shift: f64,
    ) -> Self {
        let ramp_cells = 2.0 * fraction.half_layer();
        let orientation = particle.orientation();
        let to_body = orientation.to_rotation_matrix().matrix().transpose();
        Self {
            shape,
            geometry: match shape.as_sphere() {
                Some(radius) => Geometry::Sphere(radius),
                None if planes.is_empty() => Geometry::Smooth,
                None => Geometry::Flat(planes),
            },
            orientation,
            to_body,
            motion,
            dx,
            per_dx: 1.0 / dx,
            ramp: ramp_cells * dx,
            per_ramp: 1.0 / (ramp_cells * dx),
            half_ramp: 0.5 * ramp_cells,
            by_volume: matches!(fraction, Fraction::Volume(_)),
            shift,
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
        let (low, high) = match self.geometry {
            Geometry::Sphere(radius) => (Vec3::repeat(-radius), Vec3::repeat(radius)),
            _ => self.shape.bounds(&self.orientation),
        };
        // Cells with their centre within the ramp, and one more against rounding.
        let first: [i64; 3] =
            std::array::from_fn(|a| floor((low[a] - self.ramp) * self.per_dx + self.motion.centre[a]) - 1);
        let last: [i64; 3] =
            std::array::from_fn(|a| floor((high[a] + self.ramp) * self.per_dx + self.motion.centre[a]) + 2);
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
                (interval(0.5 * self.ramp)?, interval(-0.5 * self.ramp))
            }
            Geometry::Flat(planes) => between(planes, y, z, self.half_ramp)?,
            Geometry::Smooth => {
                let interval = |growth: f64| {
                    let (y, z) = (y * self.dx, z * self.dx);
                    self.shape.row_interval(&self.orientation, y, z, growth).map(in_cells)
                };
                (interval(0.5 * self.ramp)?, interval(-0.5 * self.ramp))
            }
        };
        let (mut all, full) = (clip(outer), inner.map_or([1, 0], clip));
        if !matches!(self.geometry, Geometry::Sphere(_)) {
            // The intervals may be a little too long, beyond edges between faces for instance.
            let covered = |n: i64| self.distance(n as f64 - centre[0], y, z) * self.per_ramp < 0.5;
            while all[0] <= all[1] && !covered(all[0]) {
                all[0] += 1;
            }
            while all[0] <= all[1] && !covered(all[1]) {
                all[1] -= 1;
            }
        }
        (all[0] <= all[1]).then_some((all, full))
    }

    /// Signed distance (m) of a point relative to the centre (cells, world axes); where it is above half the ramp, it
    /// may be anything above that.
    #[inline(always)]
    fn distance(&self, x: f64, y: f64, z: f64) -> f64 {
        if let Geometry::Sphere(radius) = self.geometry {
            return (x * x + (y * y + z * z)).sqrt() * self.dx - radius;
        }
        if let Geometry::Flat(planes) = self.geometry {
            let height = planes
                .iter()
                .map(|plane| plane.height(x, plane.rest(y, z)))
                .fold(f64::NEG_INFINITY, f64::max);
            // Inside, the nearest face is the nearest surface; outside it may be an edge or a corner.
            if height <= 0.0 || height >= self.half_ramp {
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

    /// Writes the solid fractions and velocities of a segment to the row that is being swept, and the fractions to
    /// the end of `shares`.
    #[inline(always)]
    pub(super) fn fill<T: Real>(
        &self,
        segment: &Segment,
        row: &mut SolidRow<T>,
        mut shares: Option<&mut Vec<[T; CHUNK]>>,
    ) {
        let [nx, ny, nz] = segment.offset.map(f64::from);
        let (constant, slope) = self.motion.along_row(ny, nz);
        let (constant, slope) = (constant.map(T::from_f64), slope.map(T::from_f64));
        let [ry, rz] = [ny - self.motion.centre[1], nz - self.motion.centre[2]];
        for done in (0..segment.count as usize).step_by(CHUNK) {
            let count = (segment.count as usize - done).min(CHUNK);
            // The integer offset first, the centre last: rounded alike wherever a window begins.
            let (n0, centre) = (nx + done as f64, self.motion.centre[0]);
            let lane = |n: i32| (n - segment.offset[0] - done as i32).clamp(0, count as i32) as usize;
            let full = lane(segment.full[0])..lane(segment.full[1] + 1);
            let full = if full.is_empty() { 0..0 } else { full };
            // One on `full`, zero elsewhere.
            let (rise, fall) = (&T::STEP[CHUNK - full.start..], &T::STEP[CHUNK - full.end..]);
            let mut fraction = [T::ZERO; CHUNK];
            for k in 0..CHUNK {
                fraction[k] = rise[k] - fall[k];
            }
            let surface = Surface { start: full.start, end: full.end, count };
            match (self.by_volume, self.geometry) {
                (true, Geometry::Sphere(radius)) => {
                    self.sphere_shares(&mut fraction, surface, [n0, ry, rz], radius);
                }
                (true, Geometry::Flat(planes)) => {
                    self.flat_shares(&mut fraction, surface, [n0, ry, rz], planes);
                }
                _ => {
                    self.ramp(&mut fraction, 0..full.start, [n0, ry, rz]);
                    self.ramp(&mut fraction, full.end..count, [n0, ry, rz]);
                }
            }
            let mut velocity = [[T::ZERO; CHUNK]; 3];
            for axis in 0..3 {
                for k in 0..CHUNK {
                    velocity[axis][k] =
                        constant[axis] + slope[axis] * (T::from_f64(n0) + T::LANE[k] - T::from_f64(centre));
                }
            }
            row.add(segment.x as usize + done, count, &fraction, &velocity);
            if let Some(shares) = &mut shares {
                shares.push(fraction);
            }
        }
    }

    /// Volume fraction of the cell with its centre at a point relative to the centre of a smooth body (cells, world
    /// axes).
    #[inline(always)]
    fn share(&self, x: f64, y: f64, z: f64) -> f64 {
        let point = self.to_body * (Vec3::new(x, y, z) * self.dx);
        let distance = self.shape.signed_distance(point) * self.per_dx;
        let normal = self.to_body.tr_mul(&self.shape.gradient(point));
        behind_plane(distance + self.shift, normal.into())
    }

    /// Adds the volume fractions of cells on the surface of a sphere, where there are none yet, [`BLOCK`] at a time
    /// and without branches: most of the cost of a particle on the lattice.
    #[inline(always)]
    fn sphere_shares<T: Real>(&self, fraction: &mut [T; CHUNK], surface: Surface, r: [f64; 3], radius: f64) {
        let (square, depth) = (r[1] * r[1] + r[2] * r[2], self.shift - radius * self.per_dx);
        // The normal is the vector from the centre, as long as it is: no division.
        let least = LEAST * (radius * self.per_dx);
        let (my, mz) = (at_least(r[1], least), at_least(r[2], least));
        let mut shares = [T::ZERO; 2 * CHUNK];
        for first in (0..surface.cells()).step_by(BLOCK) {
            let x = surface.places(first, r[0], self.motion.centre[0]);
            let mut share = [0.0_f64; BLOCK];
            for k in 0..BLOCK {
                let length = (x[k] * x[k] + square).sqrt();
                let length = if length > NEAR { length } else { NEAR };
                share[k] = behind((length + depth) * length, [at_least(x[k], least), my, mz]);
            }
            put(&mut shares, first, &share);
        }
        surface.add(&shares, fraction);
    }

    /// The same for a body with flat faces.
    #[inline(always)]
    fn flat_shares<T: Real>(
        &self,
        fraction: &mut [T; CHUNK],
        surface: Surface,
        r: [f64; 3],
        planes: &[FacePlane],
    ) {
        let mut shares = [T::ZERO; 2 * CHUNK];
        for first in (0..surface.cells()).step_by(BLOCK) {
            let x = surface.places(first, r[0], self.motion.centre[0]);
            put(&mut shares, first, &FacePlane::shares(planes, &x, r[1], r[2]));
        }
        surface.add(&shares, fraction);
    }

    /// Solid fractions of cells on the surface; `r` is the offset of the first cell in x and the
    /// distances of the row from the centre in y and z (cells).
    #[inline(always)]
    fn ramp<T: Real>(&self, fraction: &mut [T; CHUNK], lanes: Range<usize>, r: [f64; 3]) {
        if self.by_volume {
            for k in lanes {
                let x = (r[0] + k as f64) - self.motion.centre[0];
                fraction[k] = T::from_f64(self.share(x, r[1], r[2]));
            }
            return;
        }
        for k in lanes {
            let x = (r[0] + k as f64) - self.motion.centre[0];
            let distance = self.distance(x, r[1], r[2]);
            fraction[k] = T::from_f64(cosine_ramp(distance * self.per_ramp));
        }
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
