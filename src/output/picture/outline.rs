//! Where a plane cuts a convex body.

use crate::math::{Quat, Vec3};
use crate::shape::Shape;
use std::f64::consts::TAU;

/// Points on the outline of a cut: the chords of a circle of 100 pixels stay within 0.02 pixels of it.
const POINTS: u32 = 256;

/// The outline of a body in the plane `origin + a across + b up`, as pairs `(a, b)` in order round it.
///
/// `origin` is relative to the centre of mass, `across` and `up` are unit vectors, world axes. Empty where the
/// plane misses the body. Spheres are cut exactly. Other bodies are convex, so their cut is seen whole from any
/// point inside it: rays from there are bisected on the signed distance. Corners between two rays are cut off.
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
    let distance =
        |a: f64, b: f64| shape.signed_distance(orientation.inverse() * (origin + a * across + b * up));
    let Some((a0, b0)) = inner_point(&distance, (a0, b0), reach) else {
        return Vec::new();
    };
    angles
        .map(|t| {
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
        })
        .collect()
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
}
