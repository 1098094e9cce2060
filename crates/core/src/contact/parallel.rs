//! Overlap of bodies that go [through](crate::shape::Through) the periodic faces of a box: that of the piece in the box.
//!
//! Two parallel ones, and one and a wall along it, overlap over the whole length `l` of the box. They are pieces of that length side by
//! side, each grown by the enlargement `e` at its ends, too, so `l / (l + 2 e)` of their overlap counts. Two cylinders with grown radii `a`
//! and `b`, distance `D` of their axes and depth `d = a + b - D` share a lens, of which the chord has the half length `h`:
//!
//! ```text
//! h = a sin p = b sin q,   cos p = (D^2 + a^2 - b^2) / (2 a D),   cos q = (D^2 + b^2 - a^2) / (2 b D)
//! V = l (A_a + A_b),   A_a = a^2 (p - sin p cos p),   A_b = b^2 (q - sin q cos q)
//! ```
//!
//! The first moments of both segments about the chord cancel, so the centroid lies at `D A_b / (A_a + A_b)` from the first axis. The area
//! vector of either surface is that of the chord, `2 h l`, and the pressure on it acts through the axis. A cylinder within the other is the
//! overlap itself. A plane cuts off one segment.

use super::Overlap;
use crate::math::Vec3;
use std::f64::consts::PI;

/// Axes closer than this part of the sum of the radii have no direction from one to the other.
const COINCIDENT: f64 = 1e-12;

/// Overlap of two cylinders over a length (m); `offset` (m) leads across both from the first axis to the other.
pub(super) fn cylinders([a, b]: [f64; 2], length: f64, offset: Vec3) -> Option<Overlap> {
    let (sum, distance) = (a + b, offset.norm());
    let depth = sum - distance;
    if depth.is_nan() || depth <= 0.0 {
        return None;
    }
    let coincident = distance <= COINCIDENT * sum;
    if coincident || distance <= (a - b).abs() {
        let radius = a.min(b);
        return Some(Overlap {
            volume: PI * radius * radius * length,
            depth: 2.0 * radius,
            point: if a < b { Vec3::zeros() } else { offset },
            // Any direction across, if there is none.
            normal: if coincident { Vec3::x() } else { offset / distance },
            area: 0.0,
            moment: Vec3::zeros(),
        });
    }
    let square = distance * distance + (a - b) * sum;
    let plane = 0.5 * square / distance;
    let half = ((a - plane) * (a + plane)).max(0.0).sqrt();
    // The arc tangent does not cancel where the overlap is small.
    let segment = |radius: f64, plane: f64| radius * radius * libm::atan2(half, plane) - half * plane;
    let (first, second) = (segment(a, plane), segment(b, distance - plane));
    let shared = first + second;
    Some(Overlap {
        volume: shared * length,
        depth,
        point: offset * (second / shared),
        normal: offset / distance,
        area: 2.0 * half * length,
        moment: Vec3::zeros(),
    })
}

/// Overlap of a cylinder over a length (m) with a plane along it, at a `distance` (m) from its axis along `normal`, which points into the
/// wall: the segment that it cuts off, whose first moment about the axis is `2/3 h^3`.
pub(super) fn cylinder_at_plane(
    radius: f64,
    length: f64,
    (distance, normal): (f64, Vec3),
) -> Option<Overlap> {
    let depth = radius - distance;
    if depth.is_nan() || depth <= 0.0 {
        return None;
    }
    // A cylinder that has passed the plane is whole behind it.
    let half = ((radius - distance) * (radius + distance)).max(0.0).sqrt();
    let segment = radius * radius * libm::atan2(half, distance) - half * distance;
    let centre = 2.0 / 3.0 * half * half * half / segment;
    Some(Overlap {
        volume: segment * length,
        depth: depth.min(2.0 * radius),
        point: normal * centre,
        normal,
        area: 2.0 * half * length,
        moment: Vec3::zeros(),
    })
}

impl Overlap {
    /// The part of it that counts, `part`, of an overlap of pieces along an axis of the box, with nothing along that axis.
    pub(super) fn of_piece(self, part: f64, axis: usize) -> Self {
        let across = |mut vector: Vec3| {
            vector[axis] = 0.0;
            vector
        };
        let mut moment = Vec3::zeros();
        moment[axis] = self.moment[axis] * part;
        let normal = across(self.normal);
        let length = normal.norm();
        Self {
            volume: self.volume * part,
            area: self.area * part * length,
            normal: normal / length,
            point: across(self.point),
            moment,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::overlap::{Body, GrownShape, overlap, overlap_wall};
    use crate::contact::{Geometry, sampled};
    use crate::math::Quat;
    use crate::shape::{Cuboid, Cylinder, Shape, Through};
    use crate::wall::Surface;
    use std::sync::Arc;

    fn through(piece: impl Shape + 'static, enlargement: f64) -> GrownShape {
        let body = Through::new(Arc::new(piece), 2, Vec3::z()).unwrap();
        GrownShape::new(Arc::new(body), enlargement)
    }

    fn body(grown: &GrownShape) -> Body<'_> {
        Body { grown, orientation: Quat::identity() }
    }

    /// Area and first moment along x of the lens, by slices.
    fn sliced(a: f64, b: f64, distance: f64) -> [f64; 2] {
        let (lo, hi) = ((distance - b).max(-a), a.min(distance + b));
        let n = 400_000;
        let h = (hi - lo) / f64::from(n);
        (0..n).fold([0.0, 0.0], |[area, moment], i| {
            let x = lo + (f64::from(i) + 0.5) * h;
            let chord = |radius: f64, x: f64| (radius * radius - x * x).max(0.0).sqrt();
            let part = 2.0 * h * chord(a, x).min(chord(b, x - distance));
            [area + part, moment + part * x]
        })
    }

    #[test]
    fn the_lens_of_two_cylinders_is_what_slices_say_also_where_one_hides_the_other_s_axis() {
        for (a, b, distance) in [(1.0, 1.0, 1.9), (1.0, 0.4, 1.1), (0.3, 1.2, 1.0), (1.0, 0.8, 0.5)] {
            let [area, moment] = sliced(a, b, distance);
            let direction = Vec3::new(0.6, 0.8, 0.0);
            let lens = cylinders([a, b], 2.5, direction * distance).unwrap();
            assert!((lens.volume - 2.5 * area).abs() < 1e-6 * lens.volume, "{a} {b} {distance}");
            assert!((lens.point - direction * (moment / area)).norm() < 1e-6, "{a} {b} {distance}");
            // The change of the volume with the distance.
            let [less, more] =
                [-1e-6, 1e-6].map(|by| cylinders([a, b], 2.5, direction * (distance + by)).unwrap().volume);
            assert!(((less - more) / 2e-6 - lens.area).abs() < 1e-5 * lens.area);
        }
        assert!(cylinders([1.0, 0.5], 1.0, Vec3::x() * 1.5).is_none());
        // Small overlaps of equal ones: h = sqrt(R d), V = 4/3 h d l.
        let depth = 1e-8;
        let lens = cylinders([1.0; 2], 1.0, Vec3::x() * (2.0 - depth)).unwrap();
        assert!((lens.volume / (4.0 / 3.0 * depth.sqrt() * depth) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn parallel_bodies_overlap_over_the_length_of_the_box_wherever_they_are_along_it() {
        let length = 3.0;
        let disc = || Cylinder::new(1.0, length).unwrap();
        let square = || Cuboid::new(Vec3::new(2.0, 2.0, length)).unwrap();
        let e = 0.02;
        let grown = [through(disc(), e), through(square(), e)];
        let across = Vec3::new(1.95, 0.1, 0.0);
        for (one, other) in [(0, 0), (1, 1), (0, 1), (1, 0)] {
            let bodies = [body(&grown[one]), body(&grown[other])];
            let at = |z: f64| overlap(Geometry::Exact, &bodies[0], &bodies[1], across + Vec3::z() * z);
            let found = at(0.0).unwrap();
            assert_eq!(at(1.4), Some(found));
            assert!(found.point.z.abs().max(found.normal.z.abs()) < f64::MIN_POSITIVE);
            // Of pieces in a box that is twice as long: twice as much.
            let twice = [
                through(Cylinder::new(1.0, 2.0 * length).unwrap(), e),
                through(Cuboid::new(Vec3::new(2.0, 2.0, 2.0 * length)).unwrap(), e),
            ];
            let long = [body(&twice[one]), body(&twice[other])];
            let long = overlap(Geometry::Exact, &long[0], &long[1], across).unwrap();
            let part = long.volume / found.volume;
            assert!((part - 2.0).abs() < 1e-3, "{part}");
            assert!((long.depth - found.depth).abs() < 1e-3 * found.depth);
        }
        // Squares face to face: width times depth times length.
        let squares = overlap(Geometry::Exact, &body(&grown[1]), &body(&grown[1]), Vec3::x() * 1.97).unwrap();
        assert!((squares.volume - 0.07 * 2.04 * length).abs() < 1e-12);
        assert!((squares.area - 2.04 * length).abs() < 1e-12);
        // A sample of two cylinders.
        let discs = [body(&grown[0]), body(&grown[0])];
        let exact = overlap(Geometry::Exact, &discs[0], &discs[1], across).unwrap();
        let sampled = Geometry::Sampled { samples: 8 * sampled::DEFAULT_SAMPLES };
        let sampled = overlap(sampled, &discs[0], &discs[1], across).unwrap();
        assert!((sampled.volume / exact.volume - 1.0).abs() < 0.02, "{sampled:?} {exact:?}");
    }

    #[test]
    fn a_body_that_goes_through_the_box_overlaps_a_wall_along_it_over_the_length_of_the_box() {
        let length = 3.0;
        let square = through(Cuboid::new(Vec3::new(2.0, 2.0, length)).unwrap(), 0.02);
        let disc = through(Cylinder::new(1.0, length).unwrap(), 0.02);
        let floor = Surface::Plane { point: Vec3::y() * -0.98, normal: Vec3::y() };
        let found = overlap_wall(Geometry::Exact, &body(&square), &floor).unwrap();
        assert!((found.volume - 0.04 * 2.04 * length).abs() < 1e-12);
        assert_eq!((found.point.z, found.normal), (0.0, -Vec3::y()));
        let (found, radius, depth) =
            (overlap_wall(Geometry::Exact, &body(&disc), &floor).unwrap(), 1.02, 0.04_f64);
        let half = (depth * (2.0 * radius - depth)).sqrt();
        let segment = radius * radius * (half / radius).asin() - half * (radius - depth);
        assert!((found.volume / (segment * length) - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.depth - depth).abs() < 1e-12);
        // Half of it is behind a plane through the axis, and all of it behind one beyond.
        let behind = |distance| cylinder_at_plane(2.0, length, (distance, Vec3::x())).unwrap();
        assert!((behind(0.0).volume - 2.0 * PI * length).abs() < 1e-12);
        assert!((behind(0.0).point.x - 8.0 / (3.0 * PI)).abs() < 1e-12);
        assert!((behind(-2.5).volume - 4.0 * PI * length).abs() < 1e-12);
        // A rod beside it has no closed form: samples.
        let rod = Surface::Cylinder { point: Vec3::x() * 2.99, axis: Vec3::z(), radius: 2.0, pipe: false };
        let found = overlap_wall(Geometry::Exact, &body(&disc), &rod).unwrap();
        let exact = cylinders([1.02, 2.0], length, Vec3::x() * 2.99).unwrap();
        assert!((found.volume / exact.volume - 1.0).abs() < 0.02, "{found:?} {exact:?}");
    }
}
