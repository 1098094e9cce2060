//! The circular cylinder with flat ends: everything in closed form.

use super::error::check_size;
use super::{Curvature, Shape, ShapeError, SurfaceMesh, row, surface};
use crate::math::{Quat, Vec3};
use std::f64::consts::PI;

/// A cylinder; its axis is the z axis of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    radius: f64,
    half: f64,
}

impl Cylinder {
    /// A cylinder of this radius and length (m).
    ///
    /// # Errors
    /// A size that is not positive and finite.
    pub fn new(radius: f64, length: f64) -> Result<Self, ShapeError> {
        check_size("radius", radius)?;
        check_size("length", length)?;
        Ok(Self { radius, half: 0.5 * length })
    }
}

impl Shape for Cylinder {
    fn kind(&self) -> &'static str {
        "cylinder"
    }

    fn volume(&self) -> f64 {
        2.0 * PI * self.radius * self.radius * self.half
    }

    fn inertia_per_mass(&self) -> Vec3 {
        let square = self.radius * self.radius;
        let across = 0.25 * square + self.half * self.half / 3.0;
        Vec3::new(across, across, 0.5 * square)
    }

    fn circumradius(&self) -> f64 {
        Vec3::new(self.radius, 0.0, self.half).norm()
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius.min(self.half)
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        let side = point.xy().norm() - self.radius;
        let end = point.z.abs() - self.half;
        if side > 0.0 && end > 0.0 { Vec3::new(side, end, 0.0).norm() } else { side.max(end) }
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        let from_axis = Vec3::new(point.x, point.y, 0.0);
        let side = from_axis.norm() - self.radius;
        let end = point.z.abs() - self.half;
        let outwards = from_axis.try_normalize(0.0).unwrap_or_else(Vec3::x);
        let upwards = Vec3::new(0.0, 0.0, if point.z < 0.0 { -1.0 } else { 1.0 });
        if side > 0.0 && end > 0.0 {
            let scale = side.max(end);
            (outwards * (side / scale) + upwards * (end / scale)).normalize()
        } else if side > end {
            outwards
        } else {
            upwards
        }
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        let across = Vec3::new(direction.x, direction.y, 0.0);
        let rim = across.try_normalize(0.0).unwrap_or_else(Vec3::zeros) * self.radius;
        rim + Vec3::new(0.0, 0.0, if direction.z < 0.0 { -self.half } else { self.half })
    }

    fn as_cylinder(&self) -> Option<(f64, f64)> {
        Some((self.radius, self.half))
    }

    fn curvature(&self) -> Curvature {
        let (side, rims) = (2.0 * PI * self.half, PI * PI * self.radius);
        let area = 2.0 * PI * self.radius * (self.radius + 2.0 * self.half);
        Curvature {
            mean: (side + rims) / area,
            // Only the side, which is moved in by its own curvature.
            smooth: 0.0,
            sharpness: libm::cbrt(self.volume()) * 2.0 * PI * self.radius / area,
        }
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let axis = orientation * Vec3::z();
        let high = axis.map(|u| self.half * u.abs() + self.radius * (1.0 - u * u).max(0.0).sqrt());
        (-high, high)
    }

    /// The cylinder with radius and half length grown by `growth`: exact inwards, outwards a little long beside the
    /// rims.
    #[inline]
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let (radius, half) = (self.radius + growth, self.half + growth);
        if radius < 0.0 || half < 0.0 {
            return None;
        }
        let line = row::Line::new(orientation, y, z);
        let mut clip = row::Clip::ball(self.circumradius() + growth.max(0.0), y, z)?;
        clip.below(line.direction.z, half - line.origin.z);
        clip.below(-line.direction.z, half + line.origin.z);
        clip.tube(&line, radius)?;
        clip.interval()
    }

    /// Prism with `16 * 2^refinement` sides.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        let profile = [(self.radius, -self.half), (self.radius, self.half)];
        surface::lathe(&profile, -self.half, self.half, 16 << refinement)
    }
}
