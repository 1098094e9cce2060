//! The sphere: everything in closed form.

use super::{Shape, SurfaceMesh};
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
        4.0 / 3.0 * PI * self.radius.powi(3)
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

    #[inline]
    fn row_interval(&self, _: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let radius = self.radius + growth;
        let square = radius * radius - y * y - z * z;
        (radius > 0.0 && square >= 0.0).then(|| (-square.sqrt(), square.sqrt()))
    }

    fn as_sphere(&self) -> Option<f64> {
        Some(self.radius)
    }

    /// Icosahedron, each triangle split in four `refinement` times.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        let golden = 0.5 + 0.5 * 5.0_f64.sqrt();
        let mut points = Vec::new();
        for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
            points.push(Vec3::new(a, b, 0.0));
        }
        for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
            points.push(Vec3::new(0.0, a, b));
        }
        for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
            points.push(Vec3::new(b, 0.0, a));
        }
        #[rustfmt::skip]
        let mut triangles: Vec<[u32; 3]> = vec![
            [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
            [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
            [8, 6, 7], [9, 8, 1],
        ];
        for _ in 0..refinement {
            let mut middles = std::collections::HashMap::new();
            let mut finer = Vec::with_capacity(4 * triangles.len());
            for [a, b, c] in triangles {
                let mut middle = |p: u32, q: u32| {
                    *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                        points.push(points[p as usize].normalize() + points[q as usize].normalize());
                        (points.len() - 1) as u32
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            triangles = finer;
        }
        let points = points.iter().map(|p| p.normalize() * self.radius).collect();
        SurfaceMesh { points, triangles }
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
