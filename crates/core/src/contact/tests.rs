//! Set-up of tests, and their slow reference: overlaps by many parallel lines, from the intervals of the lines inside each body.
//!
//! Lines along each of three axes give the volume (three times), and the component of the area vector along that
//! axis: `int n_k dA` over the surface of the first body in the second is the cross-section of the lines that leave the
//! overlap through the first body minus that of those that enter through it. The moment needs the same sums only.

use super::clip::Plane;
use super::overlap::Overlap;
use super::solid::Solid;
use super::{ContactModel, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use crate::math::{Mat3, Quat, Vec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The same for everything that touches, SI units: a [`ContactModel`] of one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactParams {
    pub(crate) material: Material,
    pub(crate) pair: PairParams,
    pub(crate) enlargement: f64,
    pub(crate) geometry: Geometry,
    pub(crate) law: ElasticLaw,
    pub(crate) damping: DampingLaw,
}

impl From<ContactParams> for ContactModel {
    #[allow(clippy::needless_update, reason = "parameters to come are not set here")]
    fn from(params: ContactParams) -> Self {
        Self {
            materials: vec![params.material],
            pairs: vec![params.pair],
            enlargement: params.enlargement,
            geometry: params.geometry,
            law: params.law,
            damping: params.damping,
            ..Self::default()
        }
    }
}

/// Interval in which the line through a point along a unit vector is inside a body.
pub(super) type Interval<'a> = dyn Fn(Vec3, Vec3) -> Option<(f64, f64)> + 'a;

pub(super) fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(super) fn random_direction(random: &mut ChaCha8Rng) -> Vec3 {
    loop {
        let v = Vec3::from_fn(|_, _| random.random_range(-1.0..1.0));
        if (0.1..1.0).contains(&v.norm()) {
            return v.normalize();
        }
    }
}

pub(super) fn random_turn(random: &mut ChaCha8Rng) -> Quat {
    let q = nalgebra_quaternion(random);
    Quat::from_quaternion(q)
}

fn nalgebra_quaternion(random: &mut ChaCha8Rng) -> crate::math::nalgebra::Quaternion<f64> {
    loop {
        let q = crate::math::nalgebra::Quaternion::from(crate::math::nalgebra::Vector4::from_fn(|_, _| {
            random.random_range(-1.0..1.0)
        }));
        if (0.1..1.0).contains(&q.norm()) {
            return q;
        }
    }
}

/// A cuboid of edges about 1 with corners and edges cut off by `cuts` random planes.
pub(super) fn random_solid(random: &mut ChaCha8Rng, cuts: u32, enlargement: f64) -> Solid {
    let mut planes: Vec<Plane> = (0..6)
        .map(|side| Plane {
            normal: Vec3::ith(side / 2, if side % 2 == 0 { 1.0 } else { -1.0 }),
            offset: random.random_range(0.4..0.6),
        })
        .collect();
    for _ in 0..cuts {
        planes.push(Plane { normal: random_direction(random), offset: random.random_range(0.4..0.65) });
    }
    Solid::from_planes(planes, 1.1, enlargement)
}

/// Interval of a line in a solid at a position.
pub(super) fn in_solid(
    solid: &Solid,
    turn: Mat3,
    centre: Vec3,
) -> impl Fn(Vec3, Vec3) -> Option<(f64, f64)> + '_ {
    move |from, along| {
        let (from, along) = (turn.tr_mul(&(from - centre)), turn.tr_mul(&along));
        let (mut lo, mut hi) = (f64::NEG_INFINITY, f64::INFINITY);
        for plane in &solid.planes {
            let (height, slope) = (plane.height(&from), plane.normal.dot(&along));
            if slope > 0.0 {
                hi = hi.min(-height / slope);
            } else if slope < 0.0 {
                lo = lo.max(-height / slope);
            } else if height > 0.0 {
                return None;
            }
        }
        (lo < hi).then_some((lo, hi))
    }
}

/// Interval of a line in a sphere.
pub(super) fn in_sphere(radius: f64, centre: Vec3) -> impl Fn(Vec3, Vec3) -> Option<(f64, f64)> {
    move |from, along| {
        let arm = from - centre;
        let middle = -arm.dot(&along);
        let square = radius * radius - (arm + along * middle).norm_squared();
        (square > 0.0).then(|| (middle - square.sqrt(), middle + square.sqrt()))
    }
}

/// Volume, centre, area vector and moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Truth {
    pub volume: f64,
    pub centre: Vec3,
    pub area: Vec3,
    pub moment: Vec3,
}

/// The overlap of the bodies given by the intervals, by `n` times `n` lines along each column of `frame`. It lies
/// within `reach` of `about`.
pub(super) fn lines(
    first: &Interval,
    second: &Interval,
    frame: &Mat3,
    about: Vec3,
    reach: f64,
    n: u32,
) -> Option<Truth> {
    let about = frame.tr_mul(&about);
    // A small one falls between wide lines: the box grows until it holds all of it.
    [24, 96, 384].into_iter().find_map(|coarse| {
        [1024.0, 256.0, 64.0, 16.0, 4.0, 1.0].iter().find_map(|part| {
            let half = Vec3::repeat(reach / part);
            let inside = *part > 1.0;
            in_box(first, second, frame, [about - half, about + half], [coarse, n], inside)
        })
    })
}

/// Returns true if any of some lines meets an overlap within `reach` of `about`.
pub(super) fn any(first: &Interval, second: &Interval, about: Vec3, reach: f64) -> bool {
    let half = Vec3::repeat(reach);
    let corners = [about - half, about + half];
    in_box(first, second, &Mat3::identity(), corners, [32, 8], false).is_some()
}

/// The same in a box; `None` if the overlap sticks out of it and must not.
fn in_box(
    first: &Interval,
    second: &Interval,
    frame: &Mat3,
    [mut lo, mut hi]: [Vec3; 2],
    [coarse, n]: [u32; 2],
    inside: bool,
) -> Option<Truth> {
    let mut truth = None;
    // The box is tightened a few times before it counts; it grows into thin ends as the lines come closer.
    for pass in 0..9 {
        let n = match pass {
            0 => coarse,
            8 => n,
            _ => 32,
        };
        let step = (hi - lo) / f64::from(n);
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (mut volume, mut moments) = (Vec3::zeros(), Vec3::zeros());
        let mut area = Vec3::zeros();
        // `levers[(i, k)]` is the integral of `x_i n_k`.
        let mut levers = Mat3::zeros();
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let cell = step[i] * step[j];
            let along: Vec3 = frame.column(k).into();
            for a in 0..n {
                for b in 0..n {
                    let mut at = Vec3::zeros();
                    at[i] = lo[i] + (f64::from(a) + 0.5) * step[i];
                    at[j] = lo[j] + (f64::from(b) + 0.5) * step[j];
                    let from = frame * at;
                    let (Some(one), Some(two)) = (first(from, along), second(from, along)) else {
                        continue;
                    };
                    let (enter, leave) = (one.0.max(two.0), one.1.min(two.1));
                    if enter >= leave {
                        continue;
                    }
                    let own = f64::from(u8::from(one.1 < two.1)) - f64::from(u8::from(one.0 > two.0));
                    at[k] = enter;
                    (low, high) = (low.inf(&at), high.sup(&at));
                    at[k] = leave;
                    (low, high) = (low.inf(&at), high.sup(&at));
                    volume[k] += cell * (leave - enter);
                    moments[k] += 0.5 * cell * (leave * leave - enter * enter);
                    area[k] += cell * own;
                    levers[(i, k)] += cell * own * at[i];
                    levers[(j, k)] += cell * own * at[j];
                }
            }
        }
        if low.x > high.x {
            return None;
        }
        if inside && pass == 0 && (0..3).any(|k| low[k] < lo[k] + step[k] || high[k] > hi[k] - step[k]) {
            return None;
        }
        let moment = Vec3::from_fn(|k, _| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            levers[(i, j)] - levers[(j, i)]
        });
        truth = Some(Truth {
            volume: volume.mean(),
            centre: frame * moments.component_div(&volume),
            area: frame * area,
            moment: frame * moment,
        });
        (lo, hi) = (low - step, high + step);
    }
    truth
}

/// Axes with the third along `normal`.
pub(super) fn frame(normal: Vec3) -> Mat3 {
    let other = if normal.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let u = normal.cross(&other).normalize();
    Mat3::from_columns(&[u, normal.cross(&u), normal])
}

/// Checks area vector and moment of `measured` against differences of the volume: `volume(shift, rotation)` is that
/// with the second body turned about the centre of the first, then shifted. Returns the largest error, in parts of
/// the area and of the area times `size`.
pub(super) fn gradient_error(
    measured: &Overlap,
    volume: impl Fn(Vec3, Quat) -> f64,
    step: f64,
    size: f64,
) -> f64 {
    let gradient = Vec3::from_fn(|i, _| {
        let shift = Vec3::ith(i, step * size);
        (volume(shift, Quat::identity()) - volume(-shift, Quat::identity())) / (2.0 * step * size)
    });
    let torque = Vec3::from_fn(|i, _| {
        let turn = |angle: f64| Quat::from_scaled_axis(Vec3::ith(i, angle));
        (volume(Vec3::zeros(), turn(step)) - volume(Vec3::zeros(), turn(-step))) / (2.0 * step)
    });
    let scale = measured.area.max(0.01 * size * size);
    let area = (gradient + measured.normal * measured.area).norm() / scale;
    area.max((torque + measured.moment).norm() / (scale * size))
}
