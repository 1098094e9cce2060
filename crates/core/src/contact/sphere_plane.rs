//! The overlap of a sphere and everything below a plane: a cap, in closed form.
//!
//! With radius `R`, depth `d <= 2 R` and `h = R - d`, the height of the centre above the plane,
//!
//! ```text
//! V = pi d^2 (3 R - d) / 3      A = pi (R^2 - h^2)      V x = pi (R^2 - h^2)^2 / 4
//! ```
//!
//! with `x` the distance of the centroid from the centre. A sphere wholly below the plane is the overlap itself.
//! The pressure on the cap acts through the centre: no moment.

use super::clip::Plane;
use super::overlap::Overlap;
use crate::math::Vec3;
use std::f64::consts::PI;

/// Cap of a sphere about the origin below a plane, `None` if it lies above; the normal points below.
#[inline]
pub(super) fn overlap(radius: f64, wall: &Plane) -> Option<Overlap> {
    let depth = radius + wall.offset;
    if depth.is_nan() || depth <= 0.0 {
        return None;
    }
    let depth = depth.min(2.0 * radius);
    let volume = PI * depth * depth * (3.0 * radius - depth) / 3.0;
    // R^2 - h^2, without the difference of large numbers.
    let square = depth * (2.0 * radius - depth);
    Some(Overlap {
        volume,
        depth,
        point: wall.normal * (-PI * square * square / (4.0 * volume)),
        normal: -wall.normal,
        area: PI * square,
        moment: Vec3::zeros(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(height: f64) -> Option<Overlap> {
        overlap(1.5, &Plane { normal: Vec3::z(), offset: -height })
    }

    #[test]
    fn the_volume_and_centre_of_a_cap_are_those_of_its_slices() {
        for height in [1.4, 0.3, 0.0, -1.0] {
            let (n, low) = (100_000, -1.5);
            let step = (-height - low) / f64::from(n);
            let (mut volume, mut first) = (0.0, 0.0);
            for i in 0..n {
                let z = low + (f64::from(i) + 0.5) * step;
                let slice = PI * (2.25 - z * z) * step;
                (volume, first) = (volume + slice, first + slice * z);
            }
            let cap = at(height).unwrap();
            assert!((cap.volume / volume - 1.0).abs() < 1e-8);
            assert!((cap.point.z - first / volume).abs() < 1e-8);
        }
    }

    #[test]
    fn the_area_is_the_rate_at_which_the_volume_grows() {
        for height in [1.4, 0.3, -1.2] {
            let [lower, cap, upper] = [height - 1e-5, height, height + 1e-5].map(|h| at(h).unwrap());
            let rate = (lower.volume - upper.volume) / 2e-5;
            assert!((cap.area / rate - 1.0).abs() < 1e-8);
            assert_eq!(cap.normal, -Vec3::z());
        }
    }

    #[test]
    fn a_sphere_below_the_plane_is_the_overlap_itself_and_one_above_has_none() {
        let (before, after) = (at(-1.5 + 1e-9).unwrap(), at(-1.5 - 1e-9).unwrap());
        assert!((before.volume - after.volume).abs() < 1e-15);
        assert!((before.depth - after.depth).abs() < 2e-9 && (after.depth - 3.0).abs() < 1e-15);
        assert!(after.point.norm() < 1e-15 && after.area.abs() < 1e-15);
        assert!(at(1.5).is_none() && at(f64::NAN).is_none());
    }
}
