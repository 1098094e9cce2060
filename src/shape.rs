//! Rigid convex bodies: geometry in the body frame, which is centred at the centre of mass and aligned with the
//! principal axes.

pub mod sphere;

use crate::math::{Quat, Vec3};
pub use sphere::Sphere;
use std::fmt::Debug;

/// Closed triangle mesh of a surface, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// Corners in the body frame (m).
    pub points: Vec<Vec3>,
    /// Three corner indices per triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// A rigid convex body.
pub trait Shape: Send + Sync + Debug {
    /// Name of the kind for messages, e.g. `"sphere"`.
    fn kind(&self) -> &'static str;

    /// Volume (m^3).
    fn volume(&self) -> f64;

    /// Principal moments of inertia per unit of mass (m^2).
    fn inertia_per_mass(&self) -> Vec3;

    /// Radius of the smallest sphere about the centre of mass that holds the body (m).
    fn circumradius(&self) -> f64;

    /// Signed distance of a body-frame point to the surface (m), negative inside.
    fn signed_distance(&self, point: Vec3) -> f64;

    /// Where the line `(x, y, z), x in R` meets the body grown by `growth` (m, may be negative).
    ///
    /// World axes, relative to the centre of mass of a body turned by `orientation`: returns `x_min <= x_max` such
    /// that the signed distance is at most `growth` exactly on `[x_min, x_max]`, or `None` where it never is.
    /// Convexity makes the set one interval.
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)>;

    /// The radius if the body is a sphere: pairs of spheres have closed-form contacts.
    fn as_sphere(&self) -> Option<f64> {
        None
    }

    /// Triangulation for pictures; `refinement` 0 is coarsest.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh;

    /// Diameter of the sphere of equal volume (m).
    fn equivalent_diameter(&self) -> f64 {
        // The cell size follows from it: the system's own root may differ from machine to machine.
        libm::cbrt(6.0 * self.volume() / std::f64::consts::PI)
    }
}
