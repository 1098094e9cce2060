//! What a contact is: the part of space that two (enlarged) bodies share.

use super::{Geometry, sampled, sphere_sphere};
use crate::math::{Quat, Vec3};
use crate::shape::Shape;

/// Geometry of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Shared volume (m^3).
    pub volume: f64,
    /// Extent along the normal, the indentation depth of the papers (m).
    pub depth: f64,
    /// Centre of the shared volume, relative to the centre of the first body, world axes (m).
    pub point: Vec3,
    /// Unit normal, from the first body to the second.
    pub normal: Vec3,
}

/// A body of a pair: its shape and how it is turned.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Geometry.
    pub shape: &'a dyn Shape,
    /// Maps the body frame to the world frame.
    pub orientation: Quat,
}

/// Overlap of two bodies, each grown by `enlargement` (m); `None` if they do not touch.
///
/// `offset` (m) is the centre of the second body relative to the first, the nearest image in a periodic box. Pairs
/// without a closed form are sampled with [`sampled::DEFAULT_SAMPLES`].
pub fn measure(
    geometry: Geometry,
    first: &Body,
    second: &Body,
    offset: Vec3,
    enlargement: f64,
) -> Option<Overlap> {
    let samples = match geometry {
        Geometry::Sampled { samples } => samples,
        Geometry::Exact => match (first.shape.as_sphere(), second.shape.as_sphere()) {
            (Some(a), Some(b)) => return sphere_sphere::overlap(a + enlargement, b + enlargement, offset),
            _ => sampled::DEFAULT_SAMPLES,
        },
    };
    sampled::overlap(first, second, offset, enlargement, samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;

    #[test]
    fn enlarged_spheres_touch_across_the_gap_between_their_surfaces() {
        let sphere = Sphere { radius: 1.0 };
        let body = Body {
            shape: &sphere,
            orientation: Quat::identity(),
        };
        let offset = Vec3::new(0.0, 2.1, 0.0);
        let with = |enlargement| measure(Geometry::Exact, &body, &body, offset, enlargement);
        assert_eq!(with(0.0), None);
        let overlap = with(0.1).unwrap();
        assert!((overlap.depth - 0.1).abs() < 1e-15);
        assert_eq!(overlap.normal, Vec3::y());
    }
}
