//! What a contact is: the part of space that two (enlarged) bodies share.

use super::{Geometry, sampled, sphere_sphere};
use crate::math::{Quat, Vec3};
use crate::shape::Shape;
use crate::wall::Surface;
use std::sync::Arc;

/// Geometry of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Shared volume (m^3).
    pub volume: f64,
    /// Extent along the normal through the centre, the indentation depth of the papers (m).
    pub depth: f64,
    /// Centre of the shared volume, relative to the centre of the first body, world axes (m).
    pub point: Vec3,
    /// Unit normal, from the first body to the second.
    pub normal: Vec3,
    /// Area (m^2): the integral of the outward normal of the first body over the part of its surface that lies in the
    /// second is `area * normal`; the change of the volume with the distance of the bodies is minus that.
    pub area: f64,
    /// First moment of that surface (m^3), the integral of `x` cross the outward normal, `x` relative to the centre of
    /// the first body.
    pub moment: Vec3,
}

/// A shape made ready for contacts: grown by the enlargement.
#[derive(Clone, Debug)]
pub struct Contour {
    /// The shape as it is.
    pub shape: Arc<dyn Shape>,
    /// By how much its surface is grown (m).
    pub enlargement: f64,
}

impl Contour {
    /// Prepares a shape, grown by `enlargement` (m).
    pub fn new(shape: Arc<dyn Shape>, enlargement: f64) -> Self {
        Self { shape, enlargement }
    }

    /// Radius of a sphere about the centre of mass that holds the grown body (m).
    pub fn reach(&self) -> f64 {
        self.shape.circumradius() + self.enlargement
    }
}

/// A body of a pair: its contour and how it is turned.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Geometry.
    pub contour: &'a Contour,
    /// Maps the body frame to the world frame.
    pub orientation: Quat,
}

/// Overlap of two bodies; `None` if they do not touch.
///
/// `offset` (m) is the centre of the second body relative to the first, the nearest image in a periodic box. Pairs
/// without a closed form are sampled with [`sampled::DEFAULT_SAMPLES`].
pub fn measure(geometry: Geometry, first: &Body, second: &Body, offset: Vec3) -> Option<Overlap> {
    let grown = |body: &Body| {
        body.contour
            .shape
            .as_sphere()
            .map(|r| r + body.contour.enlargement)
    };
    let samples = match geometry {
        Geometry::Sampled { samples } => samples,
        Geometry::Exact => match (grown(first), grown(second)) {
            (Some(a), Some(b)) => return sphere_sphere::overlap(a, b, offset),
            _ => sampled::DEFAULT_SAMPLES,
        },
    };
    sampled::overlap(first, second, offset, samples)
}

/// Overlap of a body with a wall, seen from the centre of the body; `None` if they do not touch. The normal points
/// from the body into the wall.
pub fn measure_wall(_geometry: Geometry, body: &Body, wall: &Surface) -> Option<Overlap> {
    let radius = body.contour.shape.as_sphere()? + body.contour.enlargement;
    let (depth, normal) = (radius - wall.distance(Vec3::zeros()), -wall.normal(Vec3::zeros()));
    // The cap of a sphere cut off by a plane.
    let height = radius - depth;
    let volume = std::f64::consts::PI * depth * depth * (3.0 * radius - depth) / 3.0;
    let square = radius * radius - height * height;
    (depth > 0.0).then(|| Overlap {
        volume,
        depth,
        point: normal * (std::f64::consts::PI * square * square / (4.0 * volume)),
        normal,
        area: std::f64::consts::PI * square,
        moment: Vec3::zeros(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;

    #[test]
    fn enlarged_spheres_touch_across_the_gap_between_their_surfaces() {
        let offset = Vec3::new(0.0, 2.1, 0.0);
        let with = |enlargement| {
            let contour = Contour::new(Arc::new(Sphere { radius: 1.0 }), enlargement);
            let body = Body {
                contour: &contour,
                orientation: Quat::identity(),
            };
            measure(Geometry::Exact, &body, &body, offset)
        };
        assert_eq!(with(0.0), None);
        let overlap = with(0.1).unwrap();
        assert!((overlap.depth - 0.1).abs() < 1e-15);
        assert_eq!(overlap.normal, Vec3::y());
    }
}
