//! Where a plane cuts a convex body.

use crate::math::{Quat, Vec3};
use crate::shape::{Polyhedron, Shape};
use std::f64::consts::TAU;

/// Points on the outline of a cut: the chords of a circle of 100 pixels stay within 0.02 pixels of it.
const POINTS: u32 = 256;
/// An outline that turns by more between two chords gets a point in between.
const TURN: f64 = 0.05;
/// As long as the chords are longer than this part of the body.
const SHORTEST: f64 = 1e-3;

/// The outline of a body in the plane `origin + a across + b up`, as pairs `(a, b)` in order round it.
///
/// `origin` is relative to the centre of mass, `across` and `up` are unit vectors, world axes. Empty where the plane
/// misses the body. Spheres and bodies with flat faces are cut exactly. The cut of any other body is convex, too, so it is
/// seen whole from any point inside it: rays from there are bisected on the signed distance, and where the outline turns
/// there are more of them, so that corners look sharp.
pub(super) fn cut(
    shape: &dyn Shape,
    orientation: &Quat,
    origin: Vec3,
    across: Vec3,
    up: Vec3,
) -> Vec<(f64, f64)> {
    let reach = shape.circumradius();
    let (a0, b0) = (-origin.dot(&across), -origin.dot(&up));
    let height = (origin + a0 * across + b0 * up).norm();
    if height >= reach {
        return Vec::new();
    }
    let angles = (0..POINTS).map(|i| TAU * f64::from(i) / f64::from(POINTS));
    if let Some(radius) = shape.as_sphere() {
        let radius = (radius * radius - height * height).sqrt();
        return angles
            .map(|t| (a0 + radius * t.cos(), b0 + radius * t.sin()))
            .collect();
    }
    let turned = |v: Vec3| orientation.inverse() * v;
    if let Some(body) = shape.as_polyhedron() {
        return cut_faces(body, turned(origin), turned(across), turned(up));
    }
    let distance = |a: f64, b: f64| shape.signed_distance(turned(origin + a * across + b * up));
    let Some((a0, b0)) = inner_point(&distance, (a0, b0), reach) else {
        return Vec::new();
    };
    let at = |t: f64| {
        let (mut inside, mut outside) = (0.0, 2.0 * reach);
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if distance(a0 + middle * t.cos(), b0 + middle * t.sin()) < 0.0 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        (a0 + inside * t.cos(), b0 + inside * t.sin())
    };
    let coarse: Vec<(f64, (f64, f64))> = angles.map(|t| (t, at(t))).collect();
    refine(coarse, at, SHORTEST * reach)
}

/// Adds points between neighbours where the outline turns.
fn refine(
    mut points: Vec<(f64, (f64, f64))>,
    at: impl Fn(f64) -> (f64, f64),
    shortest: f64,
) -> Vec<(f64, f64)> {
    // A corner lies in one gap; each round halves the gaps on both sides of it.
    for _ in 0..10 {
        let n = points.len();
        let chord = |i: usize| {
            let ((_, p), (_, q)) = (points[i % n], points[(i + 1) % n]);
            (q.0 - p.0, q.1 - p.1)
        };
        let turns = |i: usize| {
            let (u, v) = (chord(i), chord(i + 1));
            (u.0 * v.1 - u.1 * v.0).atan2(u.0 * v.0 + u.1 * v.1).abs() > TURN
        };
        let turning: Vec<bool> = (0..n).map(turns).collect();
        let mut finer = Vec::with_capacity(n + 16);
        for (i, point) in points.iter().enumerate() {
            finer.push(*point);
            let (dx, dy) = chord(i);
            let before = turning[(i + n - 1) % n];
            if (before || turning[i]) && dx.hypot(dy) > shortest {
                let next = if i + 1 < n { points[i + 1].0 } else { TAU };
                let middle = 0.5 * (point.0 + next);
                finer.push((middle, at(middle)));
            }
        }
        if finer.len() == n {
            break;
        }
        points = finer;
    }
    points.into_iter().map(|(_, point)| point).collect()
}

/// The polygon in which a plane cuts a body with flat faces, everything in the body frame.
fn cut_faces(body: &Polyhedron, origin: Vec3, across: Vec3, up: Vec3) -> Vec<(f64, f64)> {
    let normal = across.cross(&up);
    // A vertex in the plane counts as above it, so every edge is cut once or not at all.
    let height = |corner: u32| {
        let height = (body.vertices[corner as usize] - origin).dot(&normal);
        if height == 0.0 { f64::MIN_POSITIVE } else { height }
    };
    let mut points = Vec::new();
    for face in &body.faces {
        let next = face.corners.iter().cycle().skip(1);
        for (&i, &j) in face.corners.iter().zip(next) {
            let (h, k) = (height(i), height(j));
            // Each edge belongs to two faces and runs upwards in one of them.
            if h < 0.0 && k > 0.0 {
                let (p, q) = (body.vertices[i as usize], body.vertices[j as usize]);
                let arm = p.lerp(&q, h / (h - k)) - origin;
                points.push((arm.dot(&across), arm.dot(&up)));
            }
        }
    }
    let n = points.len() as f64;
    let middle = points
        .iter()
        .fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let angle = |p: &(f64, f64)| (p.1 - middle.1).atan2(p.0 - middle.0);
    points.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
    points
}

/// A point of the plane inside the body, by descent on the signed distance, which is convex.
///
/// Descent along the axes and diagonals can stop short on a ridge, so a cut thinner than a thousandth of the body
/// may be missed.
fn inner_point(distance: &impl Fn(f64, f64) -> f64, start: (f64, f64), reach: f64) -> Option<(f64, f64)> {
    let (mut best, mut least) = (start, distance(start.0, start.1));
    let mut step = 0.5 * reach;
    while step > 1e-3 * reach {
        let around = (0..8_i32).map(|i| {
            let angle = TAU / 8.0 * f64::from(i);
            (best.0 + step * angle.cos(), best.1 + step * angle.sin())
        });
        let next = around
            .map(|p| (p, distance(p.0, p.1)))
            .min_by(|x, y| x.1.total_cmp(&y.1))?;
        if next.1 < least {
            (best, least) = next;
        } else {
            step *= 0.5;
        }
    }
    (least < 0.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Sphere, SurfaceMesh};

    /// A cube by its exact signed distance.
    #[derive(Debug)]
    struct Cube(f64);

    impl Shape for Cube {
        fn kind(&self) -> &'static str {
            "cube"
        }
        fn volume(&self) -> f64 {
            8.0 * self.0.powi(3)
        }
        fn inertia_per_mass(&self) -> Vec3 {
            Vec3::repeat(2.0 / 3.0 * self.0 * self.0)
        }
        fn circumradius(&self) -> f64 {
            3.0_f64.sqrt() * self.0
        }
        fn thickness(&self) -> f64 {
            2.0 * self.0
        }
        fn gradient(&self, point: Vec3) -> Vec3 {
            point.normalize()
        }
        fn support(&self, direction: Vec3) -> Vec3 {
            direction.map(|d| self.0.copysign(d))
        }
        fn signed_distance(&self, point: Vec3) -> f64 {
            let beyond = point.abs() - Vec3::repeat(self.0);
            beyond.sup(&Vec3::zeros()).norm() + beyond.max().min(0.0)
        }
        fn row_interval(&self, _: &Quat, _: f64, _: f64, _: f64) -> Option<(f64, f64)> {
            None
        }
        fn surface_mesh(&self, _: u32) -> SurfaceMesh {
            SurfaceMesh::default()
        }
    }

    fn area(outline: &[(f64, f64)]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline
            .iter()
            .zip(next)
            .map(|(p, q)| p.0 * q.1 - q.0 * p.1)
            .sum::<f64>()
    }

    #[test]
    fn a_sphere_is_cut_in_a_circle_of_the_right_size_and_place() {
        let sphere = Sphere { radius: 1.0 };
        let origin = Vec3::new(3.0, 0.6, -2.0);
        let outline = cut(&sphere, &Quat::identity(), origin, Vec3::x(), Vec3::z());
        for (a, b) in outline {
            assert!(((a + 3.0).hypot(b - 2.0) - 0.8).abs() < 1e-12);
        }
        let above = Vec3::new(0.0, 1.01, 0.0);
        assert!(cut(&sphere, &Quat::identity(), above, Vec3::x(), Vec3::z()).is_empty());
    }

    #[test]
    fn a_turned_cube_is_cut_in_its_polygon() {
        let cube = Cube(1.0);
        let cut_at = |turn: &Quat, height: f64| {
            area(&cut(
                &cube,
                turn,
                Vec3::new(0.3, height, -0.2),
                Vec3::x(),
                Vec3::z(),
            ))
            .abs()
        };
        let quarter = std::f64::consts::FRAC_PI_4;
        // About the normal of the plane: the square turns.
        let turn = Quat::from_axis_angle(&Vec3::y_axis(), quarter);
        assert!((cut_at(&turn, 0.9) / 4.0 - 1.0).abs() < 0.01);
        assert!(cut_at(&turn, 1.1) < 1e-12);
        // About an axis in the plane: a wedge of width 2 (sqrt 2 - h) and length 2, far from the centre of mass.
        let turn = Quat::from_axis_angle(&Vec3::x_axis(), quarter);
        let wedge = 2.0 * (2.0_f64.sqrt() - 1.3) * 2.0;
        assert!((cut_at(&turn, 1.3) / wedge - 1.0).abs() < 0.02);
    }

    /// The cube again, by its faces.
    #[derive(Debug)]
    struct Faces(Cube, Polyhedron);

    impl Shape for Faces {
        fn kind(&self) -> &'static str {
            "cube"
        }
        fn volume(&self) -> f64 {
            self.0.volume()
        }
        fn inertia_per_mass(&self) -> Vec3 {
            self.0.inertia_per_mass()
        }
        fn circumradius(&self) -> f64 {
            self.0.circumradius()
        }
        fn thickness(&self) -> f64 {
            self.0.thickness()
        }
        fn gradient(&self, point: Vec3) -> Vec3 {
            self.0.gradient(point)
        }
        fn support(&self, direction: Vec3) -> Vec3 {
            self.0.support(direction)
        }
        fn signed_distance(&self, point: Vec3) -> f64 {
            self.0.signed_distance(point)
        }
        fn row_interval(&self, _: &Quat, _: f64, _: f64, _: f64) -> Option<(f64, f64)> {
            None
        }
        fn as_polyhedron(&self) -> Option<&Polyhedron> {
            Some(&self.1)
        }
        fn surface_mesh(&self, _: u32) -> SurfaceMesh {
            SurfaceMesh::default()
        }
    }

    #[test]
    fn rays_find_the_corners_that_the_faces_have() {
        let (cube, exact) = (Cube(1.0), Faces(Cube(1.0), Polyhedron::cuboid(Vec3::repeat(2.0))));
        for (i, height) in [0.0, 0.3, -0.7, 1.2].into_iter().enumerate() {
            let turn = Quat::from_euler_angles(0.3 * i as f64, 0.5, 1.1);
            let origin = Vec3::new(0.3, height, -0.2);
            let of = |shape: &dyn Shape| cut(shape, &turn, origin, Vec3::x(), Vec3::z());
            let (rays, faces) = (of(&cube), of(&exact));
            assert!((3..=6).contains(&faces.len()), "{}", faces.len());
            assert!((area(&rays) / area(&faces) - 1.0).abs() < 1e-5);
            for corner in &faces {
                let nearest = rays
                    .iter()
                    .map(|p| (p.0 - corner.0).hypot(p.1 - corner.1))
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest < 3e-3, "{nearest}");
            }
        }
    }

    #[test]
    fn a_plane_through_corners_and_edges_still_cuts_a_polygon() {
        let exact = Faces(Cube(1.0), Polyhedron::cuboid(Vec3::repeat(2.0)));
        let of = |across: Vec3| {
            cut(
                &exact,
                &Quat::identity(),
                Vec3::zeros(),
                across.normalize(),
                Vec3::z(),
            )
        };
        let diagonal = of(Vec3::new(1.0, 1.0, 0.0));
        assert!((area(&diagonal) / (4.0 * 2.0_f64.sqrt()) - 1.0).abs() < 1e-12);
        assert!((area(&of(Vec3::x())) / 4.0 - 1.0).abs() < 1e-12);
    }
}
