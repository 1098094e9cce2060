//! Outline of a body in a plane that cuts it.

use crate::math::{Quat, Vec3};
use crate::shape::{Shape, SurfaceMesh};
use std::f64::consts::TAU;
use std::ops::Deref;

/// Refinement of the meshes that are cut: their edges turn by about two degrees.
pub(super) const REFINEMENT: u32 = 5;
/// Points on the outline of a sphere.
const POINTS: u32 = 256;

/// Points on each straight or curved piece of the outline of a part, and depth (radii of the body) from which on they lie in another part.
const PIECES: u32 = 64;
const TOUCHING: f64 = 1e-3;

/// Lines of the outline of a body of several parts: those of its parts that lie in no other one. `meshes` are the surfaces of the parts;
/// otherwise as [`cut`].
pub(super) fn lines(
    shape: &dyn Shape,
    meshes: &[SurfaceMesh],
    orientation: &Quat,
    origin: Vec3,
    [across, up]: [Vec3; 2],
) -> Vec<[(f64, f64); 2]> {
    let (mut lines, size) = (Vec::new(), shape.circumradius());
    for (n, (part, mesh)) in shape.parts().iter().zip(meshes).enumerate() {
        let turn = orientation * part.orientation;
        let outline = cut(&*part.shape, &mesh, &turn, origin - orientation * part.position, across, up);
        let hidden = |(a, b): (f64, f64)| {
            let point = orientation.inverse_transform_vector(&(origin + a * across + b * up));
            let mut others = shape.parts().iter().enumerate().filter(|(k, _)| *k != n);
            others.any(|(_, other)| {
                let own = other.orientation.inverse_transform_vector(&(point - other.position));
                other.shape.signed_distance(own) < TOUCHING * size
            })
        };
        for (from, to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let apart = (to.0 - from.0).hypot(to.1 - from.1);
            let pieces = (f64::from(PIECES) * apart / size).ceil().max(1.0);
            let at = |k: f64| {
                let part = k / pieces;
                (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1))
            };
            let seen = (0..pieces as u32).map(f64::from).filter(|k| !hidden(at(k + 0.5)));
            lines.extend(seen.map(|k| [at(k), at(k + 1.0)]));
        }
    }
    lines
}

/// The outline of a convex body in the plane `origin + a across + b up`, as pairs `(a, b)` in order round it.
///
/// `origin` is relative to the centre of mass, `across` and `up` are unit vectors, world axes; `mesh` is the surface of the body, which
/// spheres do not need. Empty where the plane misses the body. Spheres and bodies with flat faces are cut exactly.
pub(super) fn cut(
    shape: &dyn Shape,
    mesh: &impl Deref<Target = SurfaceMesh>,
    orientation: &Quat,
    origin: Vec3,
    across: Vec3,
    up: Vec3,
) -> Vec<(f64, f64)> {
    let (a, b) = (-origin.dot(&across), -origin.dot(&up));
    let height = (origin + a * across + b * up).norm();
    if height >= shape.circumradius() {
        return Vec::new();
    }
    if let Some(radius) = shape.as_sphere() {
        let radius = (radius * radius - height * height).sqrt();
        let angles = (0..POINTS).map(|i| TAU * f64::from(i) / f64::from(POINTS));
        return angles.map(|t| (a + radius * t.cos(), b + radius * t.sin())).collect();
    }
    let [origin, across, up] = [origin, across, up].map(|v| orientation.inverse() * v);
    let normal = across.cross(&up);
    // A point in the plane counts as above it, so every edge is cut once or not at all.
    let height = |point: &Vec3| {
        let height = (point - origin).dot(&normal);
        if height == 0.0 { f64::MIN_POSITIVE } else { height }
    };
    let heights: Vec<f64> = mesh.points.iter().map(height).collect();
    let mut points = Vec::new();
    for &[i, j, k] in &mesh.triangles {
        for (i, j) in [(i as usize, j as usize), (j as usize, k as usize), (k as usize, i as usize)] {
            // Each edge belongs to two triangles and runs upwards in one of them.
            if heights[i] < 0.0 && heights[j] > 0.0 {
                let part = heights[i] / (heights[i] - heights[j]);
                let arm = mesh.points[i].lerp(&mesh.points[j], part) - origin;
                points.push((arm.dot(&across), arm.dot(&up)));
            }
        }
    }
    let n = points.len() as f64;
    let middle = (points.iter()).fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let angle = |p: &(f64, f64)| (p.1 - middle.1).atan2(p.0 - middle.0);
    points.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Composite, Cuboid, Cylinder, Part, Sphere, Superellipsoid};
    use std::sync::Arc;

    fn outline(shape: &dyn Shape, turn: &Quat, origin: Vec3, across: Vec3) -> Vec<(f64, f64)> {
        cut(shape, &&shape.surface_mesh(REFINEMENT), turn, origin, across, Vec3::z())
    }

    fn area(outline: &[(f64, f64)]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        let pairs = outline.iter().zip(next);
        0.5 * pairs.map(|(p, q)| p.0 * q.1 - q.0 * p.1).sum::<f64>().abs()
    }

    #[test]
    fn a_sphere_is_cut_in_a_circle_of_the_right_size_and_position() {
        let sphere = Sphere { radius: 1.0 };
        let origin = Vec3::new(3.0, 0.6, -2.0);
        for (a, b) in outline(&sphere, &Quat::identity(), origin, Vec3::x()) {
            assert!(((a + 3.0).hypot(b - 2.0) - 0.8).abs() < 1e-12);
        }
        let above = Vec3::new(0.0, 1.01, 0.0);
        assert!(outline(&sphere, &Quat::identity(), above, Vec3::x()).is_empty());
    }

    #[test]
    fn a_turned_cube_is_cut_in_its_polygon() {
        let cube = Cuboid::new(Vec3::repeat(2.0)).unwrap();
        let area_at =
            |turn: &Quat, height: f64| area(&outline(&cube, turn, Vec3::new(0.3, height, -0.2), Vec3::x()));
        let quarter = std::f64::consts::FRAC_PI_4;
        // About the normal of the plane: the square turns.
        let turn = Quat::from_axis_angle(&Vec3::y_axis(), quarter);
        assert!((area_at(&turn, 0.9) / 4.0 - 1.0).abs() < 1e-12);
        assert!(area_at(&turn, 1.1) < 1e-12);
        // About an axis in the plane: a wedge of width 2 (sqrt 2 - h) and length 2, far from the centre of mass.
        let turn = Quat::from_axis_angle(&Vec3::x_axis(), quarter);
        let wedge = 2.0 * (2.0_f64.sqrt() - 1.3) * 2.0;
        assert!((area_at(&turn, 1.3) / wedge - 1.0).abs() < 1e-12);
        // Through edges and corners.
        let diagonal = outline(&cube, &Quat::identity(), Vec3::zeros(), Vec3::new(1.0, 1.0, 0.0).normalize());
        assert!((area(&diagonal) / (4.0 * 2.0_f64.sqrt()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_cross_of_bars_has_the_outline_of_a_cross() {
        let bar = |edges: [f64; 3]| Part {
            shape: Arc::new(Cuboid::new(edges.into()).unwrap()),
            position: Vec3::zeros(),
            orientation: Quat::identity(),
        };
        let (cross, _) = Composite::new(vec![bar([3.0, 1.0, 1.0]), bar([1.0, 1.0, 3.0])]).unwrap();
        let meshes: Vec<SurfaceMesh> =
            cross.parts().iter().map(|part| part.shape.surface_mesh(REFINEMENT)).collect();
        let axes = [Vec3::x(), Vec3::z()];
        let found = lines(&cross, &meshes, &Quat::identity(), Vec3::y() * 0.2, axes);
        let length: f64 = found.iter().map(|[p, q]| (p.0 - q.0).hypot(p.1 - q.1)).sum();
        // Four ends, and eight sides of the arms.
        assert!((length / 12.0 - 1.0).abs() < 0.01, "{length}");
    }

    #[test]
    fn every_point_of_the_outline_of_a_curved_body_lies_on_its_surface() {
        let bodies: [Box<dyn Shape>; 2] = [
            Box::new(Superellipsoid::new(Vec3::new(1.0, 0.8, 0.6), [0.5, 0.5]).unwrap()),
            Box::new(Cylinder::new(0.7, 1.6).unwrap()),
        ];
        for (shape, turn) in bodies.iter().flat_map(|shape| [0.0, 0.4].map(|turn| (shape, turn))) {
            let turn = Quat::from_euler_angles(turn, 0.5, 1.1);
            let origin = Vec3::new(0.1, 0.2, -0.2);
            let outline = outline(&**shape, &turn, origin, Vec3::x());
            assert!(outline.len() > 100);
            for (a, b) in outline {
                let point = turn.inverse() * (origin + a * Vec3::x() + b * Vec3::z());
                assert!(shape.signed_distance(point).abs() < 0.02, "{}", shape.kind());
            }
        }
    }
}
