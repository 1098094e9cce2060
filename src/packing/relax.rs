//! Bodies of any shape with random orientations, pushed and rotated apart until none touches another or a wall.
//!
//! Pair by pair, with the overlap `(d, p, n)` of the two bodies, grown by half of their gap (depth, point, normal),
//! as a rigid constraint of position-based dynamics: with the generalised inverse masses
//!
//! ```text
//! w = 1 / V + (r x n) . I^-1 (r x n) / V,     r = p - x,  I = inertia per unit of mass, V = volume
//! l = (d + overshoot) / (w_a + w_b)
//! x -= l n / V,   turned by  - l I^-1 (r x n) / V      (the first body; the second the other way)
//! ```
//!
//! Walls do not move. Pushes within a round are sequential. Only `+ - * /` and square roots: the same seed gives the
//! same bits on any machine.
//!
//! # Reference
//! Mueller, Macklin, Chentanez, Jeschke, Kim (2020), Detailed rigid body simulation with extended position based dynamics,
//! Computer Graphics Forum 39, section 3.3, without compliance.

use super::Uniform;
use crate::contact::{Body, Geometry, GrownShape, PairFinder, overlap, overlap_wall};
use crate::domain::Domain;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::wall::Surface;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Rounds before giving up; cubes at a volume fraction of 0.3 take some dozen.
const MAX_ROUNDS: usize = 3000;
/// Push a little further than needed, so that the end is reached in finitely many rounds: by this part of the depth,
const OVERSHOOT: f64 = 0.02;
/// and by this part of the reach of the smaller body, as overlaps shrink without end otherwise.
const MARGIN: f64 = 1e-3;
/// Largest turn of one push: the tangent of half the angle.
const LARGEST_TURN: f64 = 0.1;
/// Tells the stream of random orientations from that of positions with the same seed.
const ORIENTATIONS: u64 = 0x6F72_6965_6E74;

/// Position and orientation of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Index of its contour, which is grown by half of the gap that it keeps.
    pub contour: usize,
    /// Centre of mass (m), wrapped.
    pub position: Vec3,
    /// Maps the body frame to the world frame.
    pub orientation: Quat,
}

impl Pose {
    /// Its orientation after a turn about an axis of the world frame; the tangent of half the angle along that axis.
    pub(super) fn turned(&self, tangent: Vec3) -> Quat {
        let turned = Quaternion::from_parts(1.0, tangent) * self.orientation.quaternion();
        let scale = 1.0 / turned.norm_squared().sqrt();
        Quat::new_unchecked(turned * scale)
    }
}

/// Orientations that are all equally likely, the same for the same seed on any machine.
pub fn random_orientations(count: usize, seed: u64) -> Vec<Quat> {
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(seed ^ ORIENTATIONS));
    let mut draw = || loop {
        let [w, i, j, k] = std::array::from_fn(|_| 2.0 * random.next() - 1.0);
        let square: f64 = w * w + i * i + j * j + k * k;
        // Points of a ball have no preferred direction; those of its cube do.
        if (0.01..=1.0).contains(&square) {
            let scale = 1.0 / square.sqrt();
            return Quat::new_unchecked(Quaternion::new(w * scale, i * scale, j * scale, k * scale));
        }
    };
    (0..count).map(|_| draw()).collect()
}

/// Moves all bodies but the first `fixed` ones until no two overlap and none overlaps a wall.
///
/// Returns whether that was reached; fixed ones may overlap each other and the walls.
pub fn relax(
    domain: Domain,
    walls: &[Surface],
    contours: &[GrownShape],
    poses: &mut [Pose],
    fixed: usize,
) -> bool {
    let movers: Vec<Mover> = contours.iter().map(Mover::new).collect();
    let radii: Vec<f64> = poses.iter().map(|p| contours[p.contour].reach()).collect();
    let mut finder = PairFinder::new(domain);
    for _ in 0..MAX_ROUNDS {
        let positions: Vec<Vec3> = poses.iter().map(|p| p.position).collect();
        let mut touched = false;
        for &[a, b] in finder.find(&positions, &radii) {
            let (a, b) = (a as usize, b as usize);
            if b < fixed {
                continue;
            }
            let offset = domain.nearest_image(poses[b].position - poses[a].position);
            let [first, second] = [a, b].map(|i| body(contours, &poses[i]));
            let Some(overlap) = overlap(Geometry::Exact, &first, &second, offset) else {
                continue;
            };
            touched = true;
            let levers = [overlap.point, overlap.point - offset];
            let mut weights = [a, b].map(|i| &movers[poses[i].contour]).map(Some);
            if a < fixed {
                weights[0] = None;
            }
            let way = overlap.depth * (1.0 + OVERSHOOT) + MARGIN * radii[a].min(radii[b]);
            push(&domain, poses, [a, b], weights, levers, overlap.normal, way);
        }
        for i in fixed..poses.len() {
            for wall in walls {
                let seen = wall.seen_from(poses[i].position);
                if seen.distance(Vec3::zeros()) > radii[i] {
                    continue;
                }
                let Some(overlap) = overlap_wall(Geometry::Exact, &body(contours, &poses[i]), &seen) else {
                    continue;
                };
                touched = true;
                let mover = Some(&movers[poses[i].contour]);
                push(
                    &domain,
                    poses,
                    [i, i],
                    [mover, None],
                    [overlap.point; 2],
                    overlap.normal,
                    overlap.depth * (1.0 + OVERSHOOT) + MARGIN * radii[i],
                );
            }
        }
        if !touched {
            return true;
        }
    }
    false
}

pub(super) fn body<'a>(contours: &'a [GrownShape], pose: &Pose) -> Body<'a> {
    Body { grown: &contours[pose.contour], orientation: pose.orientation }
}

/// Mobility of a body: the inverses of its volume and of its moments of inertia, density 1.
#[derive(Clone, Copy, Debug)]
struct Mover {
    volume: f64,
    moments: Vec3,
}

impl Mover {
    fn new(contour: &GrownShape) -> Self {
        let volume = contour.shape.volume();
        Self { volume: 1.0 / volume, moments: contour.shape.inertia_per_mass().map(|i| 1.0 / (volume * i)) }
    }

    /// Turn of a body per push along `normal` at `lever`, world axes, and its generalised inverse mass.
    fn answer(&self, orientation: &Quat, lever: Vec3, normal: Vec3) -> (Vec3, f64) {
        let arm = orientation.inverse_transform_vector(&lever.cross(&normal));
        let turn = self.moments.component_mul(&arm);
        (orientation.transform_vector(&turn), self.volume + arm.dot(&turn))
    }
}

/// Moves two bodies apart by `way` (m) along `normal`; one without a mover stays.
fn push(
    domain: &Domain,
    poses: &mut [Pose],
    bodies: [usize; 2],
    movers: [Option<&Mover>; 2],
    levers: [Vec3; 2],
    normal: Vec3,
    way: f64,
) {
    let answers: [Option<(Vec3, f64, f64)>; 2] = std::array::from_fn(|i| {
        movers[i].map(|mover| {
            let (turn, weight) = mover.answer(&poses[bodies[i]].orientation, levers[i], normal);
            (turn, weight, mover.volume)
        })
    });
    let total: f64 = answers.iter().flatten().map(|(_, weight, _)| weight).sum();
    let size = way / total;
    for (i, sign) in [(0, -1.0), (1, 1.0)] {
        let Some((turn, _, volume)) = answers[i] else {
            continue;
        };
        let pose = &mut poses[bodies[i]];
        let shift = normal * (sign * size * volume);
        pose.position = domain.wrap(pose.position + shift);
        let mut tangent = turn * (0.5 * sign * size);
        let length = tangent.norm();
        if length > LARGEST_TURN {
            tangent *= LARGEST_TURN / length;
        }
        pose.orientation = pose.turned(tangent);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::{Ball, count_for_volume_fraction, pack};
    use crate::shape::{Cuboid, Shape, Sphere};
    use std::sync::Arc;

    const GAP: f64 = 0.03;

    fn domain(cells: usize) -> Domain {
        Domain { periodic: [true; 3], cells: [cells; 3], dx: 0.1 }
    }

    /// Bodies of equal volume (that of a sphere of diameter 1) at a volume fraction, not yet relaxed.
    fn thrown(domain: &Domain, shape: Arc<dyn Shape>, fraction: f64) -> (Vec<GrownShape>, Vec<Pose>) {
        let count = count_for_volume_fraction(domain.volume(), fraction, shape.volume()) as usize;
        let ball = Ball { radius: 0.5 * shape.equivalent_diameter(), half_gap: 0.5 * GAP };
        let positions = pack(domain, &[], &[], &vec![ball; count], 1).unwrap();
        let poses = positions.into_iter().zip(random_orientations(count, 1));
        let poses = poses.map(|(position, orientation)| Pose { contour: 0, position, orientation });
        (vec![GrownShape::new(shape, 0.5 * GAP)], poses.collect())
    }

    /// Number of pairs that overlap, and of bodies that overlap a wall, without any gap.
    fn overlaps(domain: &Domain, walls: &[Surface], shape: &Arc<dyn Shape>, poses: &[Pose]) -> usize {
        let bare = [GrownShape::new(shape.clone(), 0.0)];
        let mut count = 0;
        for (i, a) in poses.iter().enumerate() {
            for b in &poses[..i] {
                let offset = domain.nearest_image(b.position - a.position);
                count +=
                    usize::from(overlap(Geometry::Exact, &body(&bare, a), &body(&bare, b), offset).is_some());
            }
            for wall in walls {
                let seen = wall.seen_from(a.position);
                count += usize::from(overlap_wall(Geometry::Exact, &body(&bare, a), &seen).is_some());
            }
        }
        count
    }

    #[test]
    fn cubes_at_a_volume_fraction_of_three_tenths_come_apart() {
        let edge = libm::cbrt(std::f64::consts::PI / 6.0);
        let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::repeat(edge)).unwrap());
        let domain = domain(50);
        let (contours, mut poses) = thrown(&domain, shape.clone(), 0.3);
        let before = overlaps(&domain, &[], &shape, &poses);
        assert!(before > 20, "{before} overlaps to begin with");
        assert!(relax(domain, &[], &contours, &mut poses, 0));
        assert_eq!(overlaps(&domain, &[], &shape, &poses), 0);
    }

    #[test]
    fn slabs_between_walls_stay_inside() {
        let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::new(1.2, 1.0, 0.4)).unwrap());
        let domain = Domain { periodic: [true, true, false], ..domain(40) };
        let walls = [(0.0, 1.0), (4.0, -1.0)]
            .map(|(z, up)| Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::new(0.0, 0.0, up) });
        let (contours, mut poses) = thrown(&domain, shape.clone(), 0.2);
        assert!(overlaps(&domain, &walls, &shape, &poses) > 5);
        assert!(relax(domain, &walls, &contours, &mut poses, 0));
        assert_eq!(overlaps(&domain, &walls, &shape, &poses), 0);
    }

    #[test]
    fn fixed_bodies_stay_where_they_are() {
        let shape: Arc<dyn Shape> = Arc::new(Sphere { radius: 0.5 });
        let domain = domain(30);
        let (contours, mut poses) = thrown(&domain, shape, 0.1);
        poses[1].position = poses[0].position + Vec3::new(0.2, 0.1, 0.0);
        let before = poses.clone();
        assert!(relax(domain, &[], &contours, &mut poses, 1));
        assert_eq!(poses[0], before[0]);
        assert_ne!(poses[1], before[1]);
    }

    #[test]
    fn random_orientations_prefer_no_direction() {
        let all = random_orientations(4000, 7);
        // The mean of R_ij^2 over all rotations is 1/3, that of R_ij is 0.
        for (i, j) in (0..9).map(|n| (n / 3, n % 3)) {
            let entries = all.iter().map(|q| q.to_rotation_matrix()[(i, j)]);
            let (sum, square) = entries.fold((0.0, 0.0), |(s, q), r| (s + r, q + r * r));
            assert!((sum / 4000.0).abs() < 0.03 && (square / 4000.0 - 1.0 / 3.0).abs() < 0.02);
        }
    }
}
