//! Overlap of a sphere and a convex polyhedron, in closed form.
//!
//! From the centre `O` of the sphere (radius `R`), with face `i` at the signed height `h_i` and `F_i` its part
//! inside the sphere:
//!
//! ```text
//! V     = [O inside] 4/3 pi R^3 + sum h_i / 3 int_{F_i} (1 - R^3 / r^3) dA
//! V x_c = sum n_i / 2 int_{F_i} (r^2 - R^2) dA          from O
//! S     = sum n_i int_{F_i} dA                          of the polyhedron; that of the sphere is -S
//! ```
//!
//! The pressure on the sphere has no moment about `O`, so that on the polyhedron acts there. The integrals go edge
//! by edge (`docs/theory/contact.md`). Where `O` is on the surface, it is moved inwards by [`NUDGE`] of the radius.
//!
//! # Reference
//! Derived here. Other closed forms: Strobl, Formella, Pöschel (2016), doi:10.1016/j.jcp.2016.02.003.

use super::clip::distances;
use super::overlap::Overlap;
use super::solid::{Edge, Solid};
use crate::math::{Mat3, Vec3};
use std::f64::consts::PI;

/// Smallest distance of the centre from the surface, in radii.
const NUDGE: f64 = 1e-8;
/// Area vectors below this part of the square of the size have no direction.
const NOWHERE: f64 = 1e-12;

/// Overlap of a sphere, the first body, with a polyhedron turned by `to_world`, `offset` (m) from the sphere to the
/// polyhedron.
pub(super) fn overlap(radius: f64, solid: &Solid, to_world: &Mat3, offset: Vec3) -> Option<Overlap> {
    let centre = -to_world.tr_mul(&offset);
    let Sums { volume, first, area } = sums(radius, solid, centre)?;
    let point = first / volume;
    // Of the sphere.
    let norm = area.norm();
    let size = libm::cbrt(volume);
    let normal = if norm > NOWHERE * size * size {
        -area / norm
    } else {
        (-centre).try_normalize(0.0).unwrap_or_else(Vec3::x)
    };
    let depth = thickness(radius, solid, centre, point, normal);
    (depth > 0.0).then(|| Overlap {
        volume,
        depth,
        point: to_world * point,
        normal: to_world * normal,
        area: norm,
        moment: Vec3::zeros(),
    })
}

/// Integrals over the overlap, from the centre of the sphere.
struct Sums {
    volume: f64,
    first: Vec3,
    /// Of the polyhedron.
    area: Vec3,
}

fn sums(radius: f64, solid: &Solid, centre: Vec3) -> Option<Sums> {
    let centre = off_the_surface(radius, solid, centre)?;
    let (mut inside, mut met) = (true, false);
    let mut sums = Sums { volume: 0.0, first: Vec3::zeros(), area: Vec3::zeros() };
    for (face, plane) in solid.planes.iter().enumerate() {
        let height = -plane.height(&centre);
        inside &= height > 0.0;
        if height >= radius {
            continue;
        }
        let disc = Disc::new(radius, height);
        let Some(part) = disc.in_face(solid.edges(face), centre) else {
            continue;
        };
        met = true;
        sums.volume += part.volume;
        sums.first += plane.normal * (0.5 * part.square);
        sums.area += plane.normal * part.area;
    }
    if inside {
        sums.volume += 4.0 / 3.0 * PI * radius * radius * radius;
    }
    ((inside || met) && sums.volume > 0.0).then_some(sums)
}

/// The centre, moved inwards if it lies on the surface; `None` if the sphere lies beyond a face.
fn off_the_surface(radius: f64, solid: &Solid, centre: Vec3) -> Option<Vec3> {
    let highest = solid.planes.iter().fold(f64::NEG_INFINITY, |top, plane| top.max(plane.height(&centre)));
    let near = NUDGE * radius;
    if highest >= radius {
        None
    } else if highest.abs() < near && solid.inner > 0.0 {
        // Every plane lies at least `inner` from the origin: this is far enough for all that are near.
        Some(centre * (1.0 - 2.0 * near / solid.inner))
    } else {
        Some(centre)
    }
}

/// The disc that the sphere cuts out of the plane of a face.
struct Disc {
    radius: f64,
    /// Of its plane over the centre of the sphere (m).
    height: f64,
    sign: f64,
    /// Square of its radius (m^2), and its radius (m).
    square: f64,
    rim: f64,
}

/// Contribution of one face.
#[derive(Default)]
struct Part {
    volume: f64,
    area: f64,
    /// Integral of `r^2 - R^2`.
    square: f64,
}

impl Disc {
    fn new(radius: f64, height: f64) -> Self {
        let square = (radius - height) * (radius + height);
        Self {
            radius,
            height,
            sign: if height < 0.0 { -1.0 } else { 1.0 },
            square,
            rim: square.max(0.0).sqrt(),
        }
    }

    /// Integrals over the part of the face in the disc; `None` if there is none.
    fn in_face(&self, edges: &[Edge], centre: Vec3) -> Option<Part> {
        let nearest = edges.iter().fold(f64::INFINITY, |near, edge| near.min(-edge.across.height(&centre)));
        if nearest <= -self.rim {
            return None;
        }
        let (mut part, mut angle) = (Part::default(), 2.0 * PI);
        let mut met = true;
        if nearest < self.rim {
            (met, angle) = (false, 0.0);
            for edge in edges {
                let (p, l) = (-edge.across.height(&centre), edge.along.dot(&centre));
                let [from, to] = edge.ends.map(|end| end - l);
                let half = (self.square - p * p).max(0.0).sqrt();
                let (enter, leave) = (from.clamp(-half, half), to.clamp(-half, half));
                if half > 0.0 && enter < leave {
                    met = true;
                    self.add_chord(&mut part, p, enter, leave);
                    angle += turned(p, from, enter) + turned(p, leave, to);
                } else {
                    angle += turned(p, from, to);
                }
            }
            // Without an edge in it the disc lies in the face or beside it.
            met |= angle > PI;
        }
        let cap = self.radius - self.height.abs();
        part.volume -= angle * self.sign * cap * cap * (2.0 * self.radius + self.height.abs()) / 6.0;
        part.area += angle * 0.5 * self.square;
        part.square -= angle * 0.25 * self.square * self.square;
        met.then_some(part)
    }

    /// Adds the triangle of the foot and the stretch of an edge, at the distance `p`, that lies in the disc.
    fn add_chord(&self, part: &mut Part, p: f64, from: f64, to: f64) {
        let a = self.height.abs();
        let lag = |l: f64| {
            let square = p * p + l * l;
            let r = (a * a + square).sqrt();
            libm::atan2(-l * p * square, (r + a) * (p * p * r + a * l * l))
        };
        let area = p * (to - from);
        let cubes = (to * to * to - from * from * from) / 3.0;
        part.area += 0.5 * area;
        part.square += 0.25 * p * (p * p * (to - from) + cubes) - 0.5 * self.square * area;
        part.volume += self.height * area / 6.0
            + self.sign * self.radius * self.radius * self.radius / 3.0 * (lag(to) - lag(from));
    }
}

/// Angle from `(p, from)` to `(p, to)` about the origin.
fn turned(p: f64, from: f64, to: f64) -> f64 {
    if from >= to {
        return 0.0;
    }
    libm::atan2(p * (to - from), p * p + from * to)
}

/// Length in both bodies of the line along `normal` through `point`, from the centre of the sphere (m).
fn thickness(radius: f64, solid: &Solid, centre: Vec3, point: Vec3, normal: Vec3) -> f64 {
    let middle = -point.dot(&normal);
    let half = (radius * radius - (point + normal * middle).norm_squared()).max(0.0).sqrt();
    let (ahead, behind) = distances(solid.planes.iter(), &(centre + point), &normal);
    ahead.min(half + middle) + behind.min(half - middle)
}

#[cfg(test)]
mod tests;
