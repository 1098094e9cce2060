//! The overlap of two spheres: a lens, in closed form.

use super::Overlap;
use crate::math::Vec3;
use std::f64::consts::PI;

/// Centres closer than this part of the sum of the radii have no direction from one to the other.
const COINCIDENT: f64 = 1e-12;

/// Lens of two spheres, or `None` if they do not touch.
///
/// With radii `a` and `b`, distance `D` of the centres, `s = a + b` and depth `d = s - D`
///
/// ```text
/// V = pi d^2 (D^2 + 2 D s - 3 (a - b)^2) / (12 D)
/// ```
///
/// The first moments of the two caps about their plane cancel, so the centroid lies at `D V_b / V` from the first
/// centre, where `V_b = pi h^2 (3 b - h) / 3`, `h = d (2 a - d) / (2 D)` is the cap cut off the second sphere.
///
/// A sphere inside the other is the overlap itself; its diameter is the depth, so that volume, depth and point are
/// continuous there. The normal of (nearly) coinciding centres is arbitrary, namely x; an engine stops at overlaps
/// far less deep. The pressure on either cap acts through its centre, so the moment vanishes.
#[inline]
pub fn overlap(radius_a: f64, radius_b: f64, offset: Vec3) -> Option<Overlap> {
    let sum = radius_a + radius_b;
    let distance = offset.norm();
    let depth = sum - distance;
    if depth.is_nan() || depth <= 0.0 {
        return None;
    }
    let coincident = distance <= COINCIDENT * sum;
    let inverse = 1.0 / distance;
    let normal = if coincident { Vec3::x() } else { offset * (1.0 / distance) };
    if coincident || distance <= (radius_a - radius_b).abs() {
        let radius = radius_a.min(radius_b);
        return Some(Overlap {
            volume: 4.0 / 3.0 * PI * radius * radius * radius,
            depth: 2.0 * radius,
            point: if radius_a < radius_b { Vec3::zeros() } else { offset },
            normal,
            area: 0.0,
            moment: Vec3::zeros(),
        });
    }
    let difference = radius_a - radius_b;
    let volume = PI
        * depth
        * depth
        * (distance * (distance + 2.0 * sum) - 3.0 * difference * difference)
        * (inverse / 12.0);
    let height = depth * (2.0 * radius_a - depth) * (0.5 * inverse);
    let cap = PI * height * height * (3.0 * radius_b - height) / 3.0;
    // The disc in which the spheres meet has the same area vector as either cap.
    let plane = 0.5 * (distance + difference * sum * inverse);
    Some(Overlap {
        volume,
        depth,
        point: offset * (cap / volume),
        normal,
        area: PI * (radius_a * radius_a - plane * plane).max(0.0),
        moment: Vec3::zeros(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume and first moment along x of the lens, by slices of area `pi min(a^2 - x^2, b^2 - (D - x)^2)`.
    fn sliced(a: f64, b: f64, distance: f64) -> (f64, f64) {
        let (lo, hi) = ((distance - b).max(-a), a.min(distance + b));
        let n = 200_000;
        let h = (hi - lo) / f64::from(n);
        (0..n).fold((0.0, 0.0), |(volume, moment), i| {
            let x = lo + (f64::from(i) + 0.5) * h;
            let slice = PI * (a * a - x * x).min(b * b - (distance - x).powi(2)) * h;
            (volume + slice, moment + slice * x)
        })
    }

    #[test]
    fn volume_and_centre_agree_with_slices_for_any_radii_and_depth() {
        for (a, b, distance) in [
            (1.0, 1.0, 1.9),
            (1.0, 1.0, 0.3),
            (1.0, 0.2, 1.1),
            (0.2, 1.0, 0.85),
            (0.5, 2.0, 1.6),
            (2.0, 0.5, 1.2),
        ] {
            let lens = overlap(a, b, Vec3::new(distance, 0.0, 0.0)).unwrap();
            let (volume, moment) = sliced(a, b, distance);
            assert!((lens.volume / volume - 1.0).abs() < 1e-8, "{a} {b} {distance}");
            assert!((lens.point.x - moment / volume).abs() < 1e-8, "{a} {b} {distance}");
        }
    }

    #[test]
    fn a_sphere_that_slips_inside_the_other_changes_volume_depth_and_point_continuously() {
        for (a, b) in [(1.0, 0.4), (0.4, 1.0)] {
            let at = |d: f64| overlap(a, b, Vec3::new(0.0, d, 0.0)).unwrap();
            let (outside, inside) = (at(0.6 + 1e-9), at(0.6 - 1e-9));
            assert!((outside.volume - inside.volume).abs() < 1e-8);
            assert!((outside.depth - inside.depth).abs() < 1e-8);
            assert!((outside.point - inside.point).norm() < 1e-8);
        }
    }

    #[test]
    fn coinciding_centres_give_a_finite_overlap() {
        for offset in [Vec3::zeros(), Vec3::new(1e-200, 0.0, 0.0), Vec3::repeat(-1e-15)] {
            for b in [1.0, 0.5] {
                let whole = overlap(1.0, b, offset).unwrap();
                assert!(whole.volume.is_finite() && whole.point.iter().all(|x| x.is_finite()));
                assert!((whole.normal.norm() - 1.0).abs() < 1e-12);
                assert!((whole.depth - 2.0 * b).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn separate_touching_and_undefined_spheres_do_not_overlap() {
        for distance in [2.5, 2.0, f64::NAN] {
            assert_eq!(overlap(1.0, 1.0, Vec3::new(distance, 0.0, 0.0)), None);
        }
    }

    #[test]
    fn the_order_of_the_spheres_only_turns_the_normal_round() {
        let offset = Vec3::new(0.3, -0.8, 0.5);
        let (one, other) = (overlap(0.7, 0.4, offset).unwrap(), overlap(0.4, 0.7, -offset).unwrap());
        assert!((one.volume / other.volume - 1.0).abs() < 1e-14);
        assert!((one.normal + other.normal).norm() < 1e-15);
        assert!((one.point - (other.point + offset)).norm() < 1e-14);
    }
}
