//! Vectors, rotations, functions of time, profiles, and the fixed-point sums that make results independent of summation order.

mod profile;
mod reproducible;
mod time_function;

pub use nalgebra;
pub use profile::{Grid, Patch, Profile};
pub use reproducible::{ReproducibleSum, magnitude};
pub use time_function::TimeFunction;

/// Vector in three dimensions.
pub type Vec3 = nalgebra::Vector3<f64>;
/// Three by three matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// Rotation; maps the body frame to the world frame.
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// Area of a triangle.
pub fn triangle_area([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// The one of some points that is furthest along a direction; the first of several.
#[inline]
pub fn furthest(points: impl IntoIterator<Item = Vec3>, direction: &Vec3) -> Vec3 {
    let mut best = (f64::NEG_INFINITY, Vec3::zeros());
    for point in points {
        let height = direction.dot(&point);
        if height > best.0 {
            best = (height, point);
        }
    }
    best.1
}

/// Low and high corner of the box around points.
#[inline]
pub fn bounding_box(points: impl IntoIterator<Item = Vec3>) -> (Vec3, Vec3) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for i in 0..3 {
            // One instruction each, unlike `f64::min` and `max`, which see to NaN in either place.
            low[i] = if point[i] < low[i] { point[i] } else { low[i] };
            high[i] = if point[i] > high[i] { point[i] } else { high[i] };
        }
    }
    (low.into(), high.into())
}

/// Binary digits after the point of a [`to_fixed`] number.
pub const FIXED_POINT_BITS: u32 = 42;
/// Numbers below this have a [`to_fixed`] number.
pub const FIXED_POINT_LIMIT: f64 = (1_u64 << (51 - FIXED_POINT_BITS)) as f64;
const FIXED_ONE: f64 = (1_u64 << FIXED_POINT_BITS) as f64;
/// `1.5 * 2^52 / 2^FIXED_POINT_BITS`: adding it leaves the rounded fixed-point number in the mantissa.
pub(crate) const FIXED_MAGIC: f64 = 1.5 * (1_u64 << (52 - FIXED_POINT_BITS)) as f64;

/// Added to a number, puts the nearest integer into the last bits of the sum.
pub(crate) const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;

/// `x.floor()` for `|x| < 2^30`, of which several are found at once on every processor.
#[inline(always)]
pub(crate) fn floor(x: f64) -> i32 {
    let near = x + ROUND;
    near.to_bits() as i32 - i32::from(near - ROUND > x)
}

/// `x.ceil()` for `|x| < 2^30`, likewise.
#[inline(always)]
pub(crate) fn ceil(x: f64) -> i32 {
    let near = x + ROUND;
    near.to_bits() as i32 + i32::from(near - ROUND < x)
}

/// Rounds `x` to a multiple of `2^-FIXED_POINT_BITS` and returns that multiple.
///
/// Sums of such integers are exact (wrapping), hence the same in any order. Valid for `|x| < 2^(51 - 42) = 512`;
/// larger values saturate nothing and are meaningless, so callers sum quantities of order one (lattice units).
/// Compiles to an addition and an integer subtraction, so loops over it vectorise.
#[inline(always)]
pub fn to_fixed(x: f64) -> i64 {
    ((x + FIXED_MAGIC).to_bits() as i64).wrapping_sub(FIXED_MAGIC.to_bits() as i64)
}

/// The same for `|x| < 2^(63 - 42) = 2,097,152`, rounded to half away from zero.
#[inline]
pub fn to_fixed_wide(x: f64) -> i64 {
    (x * FIXED_ONE).round() as i64
}

/// The number that a sum of [`to_fixed`] numbers stands for.
#[inline]
pub fn from_fixed(n: i64) -> f64 {
    n as f64 / FIXED_ONE
}

/// The same for a sum in two words: large boxes hold more than a single one can.
#[inline]
pub fn from_fixed_wide(n: i128) -> f64 {
    n as f64 / FIXED_ONE
}

/// A wide sum as two words that can be added up separately, over up to 2^23 ranks.
pub fn split_wide(n: i128) -> [i64; 2] {
    [(n & 0xff_ffff_ffff) as i64, (n >> 40) as i64]
}

/// The wide sum that two added-up words stand for.
pub fn join_wide([low, high]: [i64; 2]) -> i128 {
    i128::from(low) + (i128::from(high) << 40)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_and_ceiling_are_those_of_the_standard_library() {
        for x in [-2.0, -1.5, -0.5, -0.1, 0.0, 0.1, 0.5, 0.999, 1.0, 1.5, 7.5, 1e9 + 0.5, -1e9] {
            assert_eq!([floor(x), ceil(x)], [f64::floor(x) as i32, f64::ceil(x) as i32], "{x}");
        }
    }

    #[test]
    fn fixed_point_numbers_round_trip_to_half_a_unit() {
        for x in [0.0, 1.0, -1.0, 0.1, -0.3, 511.0, -511.9, 1e-12, -3.3e-13] {
            assert!((from_fixed(to_fixed(x)) - x).abs() <= 0.5 / FIXED_ONE, "{x}");
        }
        assert_eq!(to_fixed(0.0), 0);
    }

    #[test]
    fn fixed_point_sums_do_not_depend_on_the_order() {
        let xs: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.7).sin() * 3.0).collect();
        let forward = xs.iter().fold(0_i64, |s, &x| s.wrapping_add(to_fixed(x)));
        let backward = xs.iter().rev().fold(0_i64, |s, &x| s.wrapping_add(to_fixed(x)));
        assert_eq!(forward, backward);
    }

    #[test]
    fn wide_sums_survive_being_added_up_in_two_words() {
        // Ten million solid cells, more than one word holds, and negative sums.
        let parts =
            [i128::from(to_fixed(1.0)) * 7_000_000, i128::from(to_fixed(-0.3)) * 10_000_001, -1, 0, 12345];
        let words = parts.map(split_wide).iter().fold([0, 0], |sum, w| [sum[0] + w[0], sum[1] + w[1]]);
        assert_eq!(join_wide(words), parts.iter().sum::<i128>());
        assert!((from_fixed_wide(i128::from(to_fixed(0.3)) * 10_000_000) - 3e6).abs() < 1e-5);
    }
}
