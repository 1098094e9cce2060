//! Triangulations for several shapes.

use super::SurfaceMesh;
use crate::math::Vec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Images under `surface` of unit vectors: those of an icosahedron, each triangle split in four `refinement` times.
pub(super) fn icosphere(refinement: u32, surface: impl Fn(Vec3) -> Vec3) -> SurfaceMesh {
    let golden = 0.5 + 0.5 * 5.0_f64.sqrt();
    let signs = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)];
    let mut points = Vec::new();
    points.extend(signs.map(|(a, b)| Vec3::new(a, b, 0.0)));
    points.extend(signs.map(|(a, b)| Vec3::new(0.0, a, b)));
    points.extend(signs.map(|(a, b)| Vec3::new(b, 0.0, a)));
    #[rustfmt::skip]
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1],
    ];
    for _ in 0..refinement {
        let mut middles = BTreeMap::new();
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
    let points = points.iter().map(|point| surface(point.normalize())).collect();
    SurfaceMesh { points, triangles }
}

/// A profile of radius and height, both poles left out, turned about the z axis in `around` steps, with poles at the
/// heights `bottom` and `top`; the profile runs from bottom to top.
pub(super) fn lathe(profile: &[(f64, f64)], bottom: f64, top: f64, around: u32) -> SurfaceMesh {
    let mut points = vec![Vec3::new(0.0, 0.0, bottom), Vec3::new(0.0, 0.0, top)];
    for &(radius, height) in profile {
        for n in 0..around {
            let angle = 2.0 * PI * f64::from(n) / f64::from(around);
            points.push(Vec3::new(radius * libm::cos(angle), radius * libm::sin(angle), height));
        }
    }
    let rings = profile.len() as u32;
    let at = |ring: u32, n: u32| 2 + ring * around + n % around;
    let mut triangles = Vec::new();
    for n in 0..around {
        triangles.push([0, at(0, n + 1), at(0, n)]);
        triangles.push([1, at(rings - 1, n), at(rings - 1, n + 1)]);
        for ring in 1..rings {
            let [a, b] = [at(ring - 1, n), at(ring - 1, n + 1)];
            let [c, d] = [at(ring, n), at(ring, n + 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    SurfaceMesh { points, triangles }
}
