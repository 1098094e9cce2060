//! The box with right angles: distance in closed form.

use super::{Curvature, Polyhedron, Shape, ShapeError, SurfaceMesh, row};
use crate::math::{Quat, Vec3};

/// A box, edges along the axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Cuboid {
    half: Vec3,
    polyhedron: Polyhedron,
}

impl Cuboid {
    /// A box with these edges (m).
    ///
    /// # Errors
    /// An edge that is not positive and finite.
    pub fn new(edges: Vec3) -> Result<Self, ShapeError> {
        for edge in &edges {
            super::error::check_size("edge", *edge)?;
        }
        Ok(Self { half: edges * 0.5, polyhedron: Polyhedron::cuboid(edges) })
    }
}

impl Shape for Cuboid {
    fn curvature(&self) -> Curvature {
        self.as_polyhedron().expect("flat faces").curvature()
    }

    fn kind(&self) -> &'static str {
        "cuboid"
    }

    fn volume(&self) -> f64 {
        8.0 * self.half.x * self.half.y * self.half.z
    }

    fn inertia_per_mass(&self) -> Vec3 {
        let square = self.half.component_mul(&self.half) / 3.0;
        Vec3::new(square.y + square.z, square.z + square.x, square.x + square.y)
    }

    fn circumradius(&self) -> f64 {
        self.half.norm()
    }

    fn thickness(&self) -> f64 {
        2.0 * self.half.min()
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        let beyond = point.abs() - self.half;
        let highest = largest(beyond);
        if highest <= 0.0 {
            return highest;
        }
        let square = |x: f64| if x > 0.0 { x * x } else { 0.0 };
        (square(beyond.x) + square(beyond.y) + square(beyond.z)).sqrt()
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        let beyond = point.abs() - self.half;
        let sign = point.map(|x| if x < 0.0 { -1.0 } else { 1.0 });
        if largest(beyond) > 0.0 {
            // Scaled first: squares of tiny lengths would vanish.
            let outside = beyond.map(|x| x.max(0.0)) / largest(beyond);
            return outside.normalize().component_mul(&sign);
        }
        Vec3::ith(beyond.imax(), sign[beyond.imax()])
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        direction.zip_map(&self.half, |d, half| if d < 0.0 { -half } else { half })
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let high = orientation.to_rotation_matrix().matrix().abs() * self.half;
        (-high, high)
    }

    /// Slabs grown by `growth`: exact inwards, outwards a little long beside edges.
    #[inline]
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let mut clip = row::Clip::ball(self.circumradius() + growth.max(0.0), y, z)?;
        let line = row::Line::new(orientation, y, z);
        for axis in 0..3 {
            let half = self.half[axis] + growth;
            // Both ways: a box that has shrunk to less than nothing leaves no x.
            clip.below(line.direction[axis], half - line.origin[axis]);
            clip.below(-line.direction[axis], half + line.origin[axis]);
        }
        clip.interval()
    }

    fn as_polyhedron(&self) -> Option<&Polyhedron> {
        Some(&self.polyhedron)
    }

    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        self.polyhedron.surface_mesh(refinement)
    }
}

#[inline]
fn largest(v: Vec3) -> f64 {
    let xy = if v.x > v.y { v.x } else { v.y };
    if xy > v.z { xy } else { v.z }
}
