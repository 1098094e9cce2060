//! The sphere: everything in closed form.

use super::{Curvature, Shape, SurfaceMesh, surface};
use crate::math::{Quat, Vec3};
use std::f64::consts::PI;

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Radius (m).
    pub radius: f64,
}

impl Shape for Sphere {
    fn kind(&self) -> &'static str {
        "sphere"
    }

    fn volume(&self) -> f64 {
        4.0 / 3.0 * PI * (self.radius * self.radius * self.radius)
    }

    fn inertia_per_mass(&self) -> Vec3 {
        Vec3::repeat(0.4 * self.radius * self.radius)
    }

    fn circumradius(&self) -> f64 {
        self.radius
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        point.norm() - self.radius
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        point.try_normalize(0.0).unwrap_or_else(Vec3::x)
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        direction.normalize() * self.radius
    }

    fn bounds(&self, _: &Quat) -> (Vec3, Vec3) {
        (Vec3::repeat(-self.radius), Vec3::repeat(self.radius))
    }

    #[inline]
    fn row_interval(&self, _: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let radius = self.radius + growth;
        let square = radius * radius - y * y - z * z;
        (radius > 0.0 && square >= 0.0).then(|| (-square.sqrt(), square.sqrt()))
    }

    fn curvature(&self) -> Curvature {
        Curvature { mean: 1.0 / self.radius, smooth: 1.0 / self.radius, sharpness: 0.0 }
    }

    fn as_sphere(&self) -> Option<f64> {
        Some(self.radius)
    }

    /// Icosahedron, each triangle split in four `refinement` times.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        surface::icosphere(refinement, |point| point * self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_row_interval_ends_on_the_grown_surface() {
        let sphere = Sphere { radius: 2.0 };
        let (lo, hi) = sphere.row_interval(&Quat::identity(), 0.5, -1.0, 0.25).unwrap();
        for x in [lo, hi] {
            assert!((sphere.signed_distance(Vec3::new(x, 0.5, -1.0)) - 0.25).abs() < 1e-14);
        }
        assert!(sphere.row_interval(&Quat::identity(), 2.3, 0.0, 0.25).is_none());
    }

    #[test]
    fn the_surface_mesh_is_closed_points_outwards_and_fills_the_sphere() {
        let sphere = Sphere { radius: 3.0 };
        for refinement in [0, 2, 4] {
            let mesh = sphere.surface_mesh(refinement);
            assert_eq!(
                mesh.points.len() + mesh.triangles.len(),
                3 * mesh.triangles.len() / 2 + 2,
                "Euler's formula"
            );
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| mesh.points[i as usize]);
                    let part = a.dot(&b.cross(&c)) / 6.0;
                    assert!(part > 0.0, "counter-clockwise from outside");
                    part
                })
                .sum();
            assert!(
                (volume / sphere.volume() - 1.0).abs() < [0.4, 0.0, 0.04, 0.0, 0.003][refinement as usize]
            );
        }
    }
}
