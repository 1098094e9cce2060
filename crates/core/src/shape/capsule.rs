//! The capsule, a cylinder with hemispherical ends: all points within a radius of a line segment.

use super::error::check_size;
use super::{Shape, ShapeError, SurfaceMesh, row, surface};
use crate::math::{Quat, Vec3};
use std::f64::consts::PI;

/// A capsule; its axis is the z axis of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    radius: f64,
    half: f64,
}

impl Capsule {
    /// A capsule of this radius; `length` is that of the cylinder, without the ends (m).
    ///
    /// # Errors
    /// A size that is not positive and finite.
    pub fn new(radius: f64, length: f64) -> Result<Self, ShapeError> {
        check_size("radius", radius)?;
        check_size("length", length)?;
        Ok(Self { radius, half: 0.5 * length })
    }

    /// From the nearest point of the axis.
    fn off_axis(&self, point: Vec3) -> Vec3 {
        Vec3::new(point.x, point.y, point.z - point.z.clamp(-self.half, self.half))
    }
}

impl Shape for Capsule {
    fn kind(&self) -> &'static str {
        "capsule"
    }

    fn volume(&self) -> f64 {
        PI * self.radius * self.radius * (2.0 * self.half + 4.0 / 3.0 * self.radius)
    }

    /// Cylinder and half spheres; the centre of a half sphere is 3/8 of the radius off its base.
    fn inertia_per_mass(&self) -> Vec3 {
        let (r, h) = (self.radius, self.half);
        let (cylinder, ball) = (2.0 * h, 4.0 / 3.0 * r);
        let along = cylinder * 0.5 * r * r + ball * 0.4 * r * r;
        let across = cylinder * (0.25 * r * r + h * h / 3.0) + ball * (0.4 * r * r + h * h + 0.75 * h * r);
        Vec3::new(across, across, along) / (cylinder + ball)
    }

    fn circumradius(&self) -> f64 {
        self.radius + self.half
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        self.off_axis(point).norm() - self.radius
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.off_axis(point).try_normalize(0.0).unwrap_or_else(Vec3::x)
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        let end = if direction.z < 0.0 { -self.half } else { self.half };
        direction.normalize() * self.radius + Vec3::new(0.0, 0.0, end)
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let high = (orientation * Vec3::z()).map(|u| self.half * u.abs() + self.radius);
        (-high, high)
    }

    /// Exact: a grown capsule is a capsule, the union of a tube and two balls.
    #[inline]
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let radius = self.radius + growth;
        if radius < 0.0 {
            return None;
        }
        let mut tube = row::Clip::ball(radius + self.half, y, z)?;
        let line = row::Line::new(orientation, y, z);
        let mut found = (f64::INFINITY, f64::NEG_INFINITY);
        let mut join = |low: f64, high: f64| found = (found.0.min(low), found.1.max(high));
        for end in [-self.half, self.half] {
            let from_end = line.origin - Vec3::new(0.0, 0.0, end);
            let middle = -from_end.dot(&line.direction);
            let square = radius * radius - (from_end + line.direction * middle).norm_squared();
            if square >= 0.0 {
                join(middle - square.sqrt(), middle + square.sqrt());
            }
        }
        tube.below(line.direction.z, self.half - line.origin.z);
        tube.below(-line.direction.z, self.half + line.origin.z);
        if let Some((low, high)) = tube.tube(&line, radius).and_then(|()| tube.interval()) {
            join(low, high);
        }
        (found.0 <= found.1).then_some(found)
    }

    /// `16 * 2^refinement` steps around, a quarter of that from the equator to the poles.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        let quarter = 4_i32 << refinement;
        let ring = |n: i32, shift: f64| {
            let angle = 0.5 * PI * f64::from(n) / f64::from(quarter);
            (self.radius * libm::cos(angle), self.radius * libm::sin(angle) + shift)
        };
        let lower = (1 - quarter..=0).map(|n| ring(n, -self.half));
        let upper = (0..quarter).map(|n| ring(n, self.half));
        let profile: Vec<_> = lower.chain(upper).collect();
        surface::lathe(&profile, -self.circumradius(), self.circumradius(), 16 << refinement)
    }
}
