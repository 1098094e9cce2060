//! The overlap of a cylinder and everything below a plane.
//!
//! With the radius `R`, the half length `h`, the axis `z`, and `x` across it such that the plane is `s x + k z = c`, `s, k >= 0`, the point at the distance `l`
//! along the cut is `x = c s + k l`, `z = c k - s l`, where the cut is `2 w` wide, `w = sqrt(R^2 - x^2)`. It ends where the cylinder does, `|x| = R` or
//! `|z| = h`. Below it the cylinder is `z + h` long, and as long as it is, `2 h`, where `x` is less than `x_1`, that of the cut at `z = h`:
//!
//! ```text
//! A = int 2 w dl      V = int (z + h) 2 w k dl + int_{-R}^{x_1} 2 h 2 w dx
//! ```
//!
//! and so on for the first moments of both. The integrals are sums over Gauss-Legendre points in `t`, `l = l_m + l_w sin(pi t / 2)`, in which the integrands
//! are smooth: within 2e-6 of the volume, and without steps where a body moves. The pressure on the cylinder acts like one on the cut, through the middle of that.

use super::clip::Plane;
use super::overlap::Overlap;
use crate::math::{Mat3, Vec3};

/// Sines and weights `(pi / 2) cos(pi t / 2) w` at twelve Gauss-Legendre points in `t`, of one half of the interval.
const POINTS: [[f64; 2]; 6] = [
    [0.195_449_901_296_615_3, 0.383_811_387_169_612_6],
    [0.546_172_650_044_045_7, 0.307_232_536_338_333_7],
    [0.797_148_030_287_808_7, 0.192_688_367_427_253_7],
    [0.935_389_981_011_445_5, 0.088_917_367_531_001_03],
    [0.988_679_397_399_765_8, 0.025_204_290_664_194_65],
    [0.999_580_558_542_768_1, 0.002_146_050_869_604_284_5],
];

/// The integral of a vector over an interval, whose integrand may begin and end like a square root; zero of an empty interval.
fn integral<const N: usize>([from, to]: [f64; 2], of: impl Fn(f64) -> [f64; N]) -> [f64; N] {
    let mut sums = [0.0; N];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    if half > 0.0 {
        for [sine, weight] in POINTS {
            let ends = [of(middle - half * sine), of(middle + half * sine)];
            for (n, sum) in sums.iter_mut().enumerate() {
                *sum += half * weight * (ends[0][n] + ends[1][n]);
            }
        }
    }
    sums
}

/// Part of a cylinder about the origin below a plane, `None` if it lies above; the normal points up.
///
/// `to_world` turns the frame in which the axis is `z` to that of the plane.
pub(super) fn overlap([radius, half]: [f64; 2], to_world: &Mat3, wall: &Plane) -> Option<Overlap> {
    let up = to_world.tr_mul(&wall.normal);
    // Both ends are alike: `z` points to the one that is higher above the plane.
    let along = Vec3::z() * if up.z < 0.0 { -1.0 } else { 1.0 };
    let (k, c) = (up.z.abs(), wall.offset);
    let s = up.xy().norm();
    let across = if s > 0.0 { Vec3::new(up.x / s, up.y / s, 0.0) } else { Vec3::x() };
    if c.is_nan() || c <= -(s * radius + k * half) {
        return None;
    }
    let (x, z) = (|l: f64| c * s + k * l, |l: f64| c * k - s * l);
    // Twice the half width.
    let width = |x: f64| 2.0 * ((radius - x) * (radius + x)).max(0.0).sqrt();
    // Where the cut meets the lines x = -R, x = R and z = h, z = -h; a line that it is parallel to does not end it.
    let meets = |speed: f64, ends: [f64; 2]| {
        if speed > 0.0 { ends.map(|end| end / speed) } else { [f64::NEG_INFINITY, f64::INFINITY] }
    };
    let sides = meets(k, [-radius - c * s, radius - c * s]);
    let ends = meets(s, [c * k - half, c * k + half]);
    let cut = [sides[0].max(ends[0]), sides[1].min(ends[1])];
    // A plane beyond an end or a side that it is parallel to does not cut.
    let misses = (s <= 0.0 && c.abs() >= k * half) || (k <= 0.0 && c.abs() >= s * radius);
    let cut = if misses { [0.0; 2] } else { cut };
    let [area, area_x, area_z, volume, first_x, first_z] = integral(cut, |l| {
        let (x, z) = (x(l), z(l));
        let width = width(x);
        let below = width * k * (z + half);
        [width, width * x, width * z, below, below * x, below * 0.5 * (z - half)]
    });
    // Where the overlap is as long as the cylinder: up to the line in which the plane meets the upper end.
    let whole = if s > 0.0 {
        ((c - k * half) / s).clamp(-radius, radius)
    } else if c >= k * half {
        radius
    } else {
        -radius
    };
    let [full, full_x] = integral([-radius, whole], |x| [2.0 * half * width(x), 2.0 * half * width(x) * x]);
    let volume = volume + full;
    if volume.is_nan() || volume <= 0.0 {
        return None;
    }
    let (centre_x, centre_z) = ((first_x + full_x) / volume, first_z / volume);
    // From the centre up (1) or down (-1) to the surface.
    let to_surface = |sign: f64| {
        let part = |end: f64, at: f64, speed: f64| {
            if speed > 0.0 { (end - sign * at) / speed } else { f64::INFINITY }
        };
        part(radius, centre_x, s).min(part(half, centre_z, k))
    };
    let depth = to_surface(-1.0) + to_surface(1.0).min(c - s * centre_x - k * centre_z);
    let in_world = |x: f64, z: f64| to_world * (across * x + along * z);
    let normal = -wall.normal;
    (depth > 0.0).then(|| Overlap {
        volume,
        depth,
        point: in_world(centre_x, centre_z),
        normal,
        area,
        moment: in_world(area_x, area_z).cross(&normal),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::tests::{random, random_direction, random_turn};

    const SIZE: [f64; 2] = [1.2, 0.7];

    /// Midpoint sums of the volume and its first moment over the part below the plane.
    fn by_points(to_world: &Mat3, wall: &Plane) -> (f64, Vec3) {
        let [radius, half] = SIZE;
        let up = to_world.tr_mul(&wall.normal);
        let n = 400;
        let (mut volume, mut first) = (0.0, Vec3::zeros());
        for i in 0..n * n {
            let place = |m: i32| radius * (2.0 * (f64::from(m) + 0.5) / f64::from(n) - 1.0);
            let (x, y) = (place(i % n), place(i / n));
            if x * x + y * y >= radius * radius {
                continue;
            }
            // Exact along the axis: z up.z <= c - x up.x - y up.y.
            let end = (wall.offset - x * up.x - y * up.y) / up.z;
            let [from, to] = if up.z > 0.0 { [-half, end.min(half)] } else { [end.max(-half), half] };
            let long = (to - from).max(0.0) * (2.0 * radius / f64::from(n)) * (2.0 * radius / f64::from(n));
            volume += long;
            first += Vec3::new(x, y, 0.5 * (from + to)) * long;
        }
        (volume, to_world * first / volume)
    }

    #[test]
    fn volume_and_centre_are_those_of_the_part_below_the_plane() {
        let mut random = random(5);
        for turn in 0..40 {
            let to_world = random_turn(&mut random).to_rotation_matrix().into_inner();
            let normal = random_direction(&mut random);
            let reach = SIZE[0].hypot(SIZE[1]);
            let wall = Plane { normal, offset: reach * (2.0 * f64::from(turn) / 39.0 - 1.0) };
            let (volume, centre) = by_points(&to_world, &wall);
            let found = overlap(SIZE, &to_world, &wall);
            assert_eq!(found.is_some(), volume > 0.0, "{turn}");
            let Some(found) = found.filter(|_| volume > 0.1) else { continue };
            assert!((found.volume / volume - 1.0).abs() < 2e-3, "{turn}: {} {volume}", found.volume);
            assert!((found.point - centre).norm() < 2e-3, "{turn}: {} {centre}", found.point);
            assert_eq!(found.normal, -normal);
        }
    }

    /// Volume of the part below a plane that the lowest point is `depth` below, the axis having the angle `tilt` with the normal; without
    /// differences of large numbers.
    fn volume_of(tilt: f64, depth: f64) -> f64 {
        let [radius, half] = SIZE;
        let (s, k) = (libm::sin(tilt), libm::cos(tilt));
        // Angle at the axis of half the arc of a disc that reaches this far below the plane.
        let arc = |depth: f64| 2.0 * libm::asin((depth / (2.0 * radius)).clamp(0.0, 1.0).sqrt());
        let n = 40_000;
        let sum = |width: f64, of: &dyn Fn(f64) -> f64| -> f64 {
            (0..n).map(|i| of(width * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() * width
                / f64::from(n)
        };
        if k > 0.5 {
            // Columns along the axis.
            let widest = if s > 0.0 { arc(depth / s) } else { std::f64::consts::PI };
            return sum(widest, &|u| {
                let (sine, fall) = (libm::sin(u), libm::sin(0.5 * u));
                let long = (depth - 2.0 * s * radius * fall * fall) / k;
                2.0 * radius * radius * sine * sine * long.clamp(0.0, 2.0 * half)
            });
        }
        // Discs across it.
        let long = if k > 0.0 { (depth / k).min(2.0 * half) } else { 2.0 * half };
        sum(long, &|above| {
            let twice = 2.0 * arc((depth - k * above) / s);
            let square = twice * twice;
            let less = if twice < 0.1 {
                twice * square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
            } else {
                twice - libm::sin(twice)
            };
            0.5 * radius * radius * less
        })
    }

    #[test]
    fn volumes_are_right_from_upright_to_lying_and_from_flat_to_deep() {
        let [radius, half] = SIZE;
        let right = std::f64::consts::FRAC_PI_2;
        for tilt in
            [0.0, 1e-15, 1e-9, 1e-5, 1e-2, 0.3, 1.0, 1.3, right - 1e-2, right - 1e-5, right - 1e-9, right]
        {
            let to_world =
                crate::math::Quat::from_axis_angle(&Vec3::y_axis(), tilt).to_rotation_matrix().into_inner();
            for depth in [1e-8, 1e-6, 1e-4, 1e-2, 0.3, 0.9] {
                let lowest = libm::sin(tilt) * radius + libm::cos(tilt) * half;
                let wall = Plane { normal: Vec3::z(), offset: depth - lowest };
                let (found, expected) = (overlap(SIZE, &to_world, &wall).unwrap(), volume_of(tilt, depth));
                let error = found.volume / expected - 1.0;
                assert!(error.abs() < 3e-6, "tilt {tilt}, depth {depth}: {} {expected}", found.volume);
                assert!(
                    found.depth > 0.3 * depth && found.depth < depth * (1.0 + 1e-7),
                    "{tilt} {depth}: {}",
                    found.depth
                );
            }
        }
    }

    #[test]
    fn the_area_is_the_rate_at_which_the_volume_grows_and_the_moment_that_at_which_it_grows_in_a_turn() {
        let mut random = random(6);
        for turn in 0..200 {
            let orientation = random_turn(&mut random);
            let normal = random_direction(&mut random);
            let offset = 1.2 * (2.0 * f64::from(turn) / 199.0 - 1.0);
            let at = |turn: Vec3, offset: f64| {
                let turned = crate::math::Quat::from_scaled_axis(turn) * orientation;
                overlap(SIZE, &turned.to_rotation_matrix().into_inner(), &Plane { normal, offset })
            };
            let Some(found) = at(Vec3::zeros(), offset) else { continue };
            let rate = |step: &dyn Fn(f64) -> Option<Overlap>| {
                let [low, high] = [-1e-4, 1e-4].map(|by| step(by).map_or(0.0, |overlap| overlap.volume));
                (high - low) / 2e-4
            };
            let grows = rate(&|by| at(Vec3::zeros(), offset + by));
            assert!((grows - found.area).abs() < 1e-4, "{turn}: {} {grows}", found.area);
            for a in 0..3 {
                // Turning the body: dV = moment . angle, as the surface moves into the wall.
                let grows = rate(&|by| at(Vec3::ith(a, by), offset));
                assert!((grows - found.moment[a]).abs() < 1e-3, "{turn}: {} {grows}", found.moment[a]);
            }
        }
    }

    #[test]
    fn upright_and_lying_cylinders_have_discs_and_segments() {
        let lying = Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let floor = |offset: f64| Plane { normal: Vec3::z(), offset };
        let [radius, half] = SIZE;
        let depth = 0.01;
        let upright = overlap(SIZE, &Mat3::identity(), &floor(-half + depth)).unwrap();
        let disc = std::f64::consts::PI * radius * radius;
        assert!(
            (upright.area / disc - 1.0).abs() < 1e-12
                && (upright.volume / (disc * depth) - 1.0).abs() < 1e-12
        );
        assert!((upright.depth / depth - 1.0).abs() < 1e-12 && upright.moment.norm() < 1e-12);
        let on_side = overlap(SIZE, &lying, &floor(-radius + depth)).unwrap();
        let chord = 2.0 * (depth * (2.0 * radius - depth)).sqrt();
        assert!((on_side.area / (chord * 2.0 * half) - 1.0).abs() < 1e-12);
        let angle = 2.0 * libm::asin(0.5 * chord / radius);
        let segment = 0.5 * radius * radius * (angle - libm::sin(angle));
        assert!((on_side.volume / (segment * 2.0 * half) - 1.0).abs() < 1e-9, "{}", on_side.volume);
        assert!((on_side.depth / depth - 1.0).abs() < 1e-12 && on_side.moment.norm() < 1e-12);
        for turned in [Mat3::identity(), lying] {
            let whole = overlap(SIZE, &turned, &floor(5.0)).unwrap();
            assert!((whole.volume / (disc * 2.0 * half) - 1.0).abs() < 1e-12);
            assert!(whole.point.norm() < 1e-12 && whole.area.abs() < 1e-12);
            assert!(overlap(SIZE, &turned, &floor(-1.3)).is_none());
        }
    }
}
