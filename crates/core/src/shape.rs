//! Rigid bodies, convex or of convex parts: geometry in the body frame, which is centred at the centre of mass and aligned
//! with the principal axes.

mod apart;
pub mod capsule;
pub mod composite;
pub mod cuboid;
pub mod cylinder;
pub mod ellipsoid;
pub mod error;
mod hull;
pub mod polyhedron;
mod row;
pub mod sphere;
pub mod superellipsoid;
mod surface;
pub mod through;

use crate::math::{Quat, Vec3, triangle_area};
pub use capsule::Capsule;
pub use composite::Composite;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use error::ShapeError;
pub use polyhedron::{Face, Placement, Polyhedron};
pub use sphere::Sphere;
use std::fmt::Debug;
use std::sync::Arc;
pub use superellipsoid::Superellipsoid;
pub use through::{Passage, Through};

/// Closed triangle mesh of a surface, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// Corners in the body frame (m).
    pub points: Vec<Vec3>,
    /// Three corner indices per triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Mean curvature of a surface; `A` area, `V` volume, edges of length `L` at which the normal turns by `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// Mean curvature, `(int H dA + 1/2 sum L t) / A` (1/m).
    pub mean: f64,
    /// Part without the edges, `(int H dA + 1/2 sum L t max(0, cos t)) / A` (1/m): small turns count as smooth.
    pub smooth: f64,
    /// Sharpness of the edges relative to a cube, `V^(1/3) sum L w(t) / (2 A)` with `2 w = 1 - cos t + min(4, tan^2(t/2))`. Falls to
    /// 0 for polyhedra that come near to smooth bodies.
    pub sharpness: f64,
}

/// A convex part of a rigid body.
#[derive(Clone, Debug)]
pub struct Part {
    /// Geometry in a frame of its own.
    pub shape: Arc<dyn Shape>,
    /// Origin of that frame in the frame of the body (m).
    pub position: Vec3,
    /// Maps the frame of the part to that of the body.
    pub orientation: Quat,
}

/// A rigid body: convex, or of several convex [parts](Self::parts).
pub trait Shape: Send + Sync + Debug {
    /// Name of the kind for messages, e.g. `"sphere"`.
    fn kind(&self) -> &'static str;

    /// Volume (m^3).
    fn volume(&self) -> f64;

    /// Principal moments of inertia per unit of mass (m^2).
    fn inertia_per_mass(&self) -> Vec3;

    /// Radius of the smallest sphere about the centre of mass that holds the body (m).
    fn circumradius(&self) -> f64;

    /// Smallest distance between two parallel planes that hold the body between them (m).
    fn thickness(&self) -> f64;

    /// Signed distance of a body-frame point to the surface (m), negative inside; exact, also outside.
    fn signed_distance(&self, point: Vec3) -> f64;

    /// Gradient of [`signed_distance`](Self::signed_distance): the unit vector from the nearest point of the surface to
    /// `point` outside, the opposite inside. Where several points are nearest (centre, inside of an edge), one of them.
    fn gradient(&self, point: Vec3) -> Vec3;

    /// Both at once.
    fn distance_and_gradient(&self, point: Vec3) -> (f64, Vec3) {
        (self.signed_distance(point), self.gradient(point))
    }

    /// The gauge, by what factor the body has to grow about its centre to reach the point, and its gradient (1/m), if it has a formula.
    fn gauge(&self, _point: Vec3) -> Option<(f64, Vec3)> {
        None
    }

    /// The point of the body that lies furthest along `direction` (body frame, any length but 0).
    fn support(&self, direction: Vec3) -> Vec3;

    /// Half edges of the box along the world axes that contains the body rotated by `orientation`, each way: the low
    /// corner relative to the centre of mass, then the high one.
    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let reach = |axis: usize, sign: f64| {
            let direction = orientation.inverse_transform_vector(&Vec3::ith(axis, sign));
            orientation.transform_vector(&self.support(direction))[axis]
        };
        (Vec3::from_fn(|axis, _| reach(axis, -1.0)), Vec3::from_fn(|axis, _| reach(axis, 1.0)))
    }

    /// Interval in which the line `(x, y, z), x in R` is inside the body grown by `growth` (m, may be negative).
    ///
    /// World axes, relative to the centre of mass of a body rotated by `orientation`. The set where the signed
    /// distance is at most `growth` is one interval, as the body is convex. For `growth >= 0` the result holds that
    /// interval and may be a little longer; for `growth < 0` it is the interval or a little shorter. `None` where
    /// there is none.
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let line = row::Line::new(orientation, y, z);
        let bracket = row::Clip::ball(self.circumradius() + growth.max(0.0), y, z)?;
        let distance = |x: f64| {
            let slope = self.gradient(line.at(x)).dot(&line.direction);
            (self.signed_distance(line.at(x)), slope)
        };
        row::convex(distance, bracket, growth, growth < 0.0, 1e-9 * self.thickness())
    }

    /// The convex parts; empty for a convex body, which is its own only part. Contacts, films and covered cells are those of parts,
    /// mass and extent those of the whole.
    fn parts(&self) -> &[Part] {
        &[]
    }

    /// Thickness of a part (m) where both ends are surface of the body; infinite where none is, and for splinters.
    fn thickness_of(&self, _part: usize) -> f64 {
        self.thickness()
    }

    /// Parts with which a part shares space, so that contacts and cells there are not counted twice.
    fn shared_with(&self, _part: usize) -> &[u32] {
        &[]
    }

    /// The way the body goes through the periodic faces of the box, if it does: it is its own continuation, without ends.
    fn passage(&self) -> Option<Passage> {
        None
    }

    /// The piece in the box of a body that goes through it.
    fn piece(&self) -> Option<Arc<dyn Shape>> {
        None
    }

    /// The radius if the body is a sphere: pairs of spheres have closed-form contacts.
    fn as_sphere(&self) -> Option<f64> {
        None
    }

    /// The semi-axes (m) if the body is an ellipsoid: cells on its surface are evaluated several at a time.
    fn as_ellipsoid(&self) -> Option<Vec3> {
        None
    }

    /// Radius and half length (m) if the body is a cylinder: cells on its rims are cut by its side and its ends.
    fn as_cylinder(&self) -> Option<(f64, f64)> {
        None
    }

    /// Vertices and faces if the body has only flat faces: pairs of these have exact contacts.
    fn as_polyhedron(&self) -> Option<&Polyhedron> {
        None
    }

    /// Mean curvature and sharpness of the surface; here of one without edges.
    ///
    /// After Minkowski the integral of the mean curvature is `2 pi b`, `b` the mean width.
    fn curvature(&self) -> Curvature {
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
            width += 2.0 * weight * self.support(unit).dot(&unit);
        }
        let area = |refinement| -> f64 {
            let mesh = self.surface_mesh(refinement);
            let corners = |triangle: &[u32; 3]| triangle.map(|i| mesh.points[i as usize]);
            mesh.triangles.iter().map(corners).map(triangle_area).sum()
        };
        // The error falls with the square of the edges of the triangles, which are halved.
        let area = (4.0 * area(4) - area(3)) / 3.0;
        let mean = std::f64::consts::TAU * width / area;
        Curvature { mean, smooth: mean, sharpness: 0.0 }
    }

    /// Triangulation for pictures; `refinement` 0 is coarsest.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        surface::icosphere(refinement, |point| self.support(point))
    }

    /// Diameter of the sphere of equal volume (m).
    fn equivalent_diameter(&self) -> f64 {
        // The cell size follows from it: the system's own root may differ from machine to machine.
        libm::cbrt(6.0 * self.volume() / std::f64::consts::PI)
    }
}

#[cfg(test)]
mod tests;
