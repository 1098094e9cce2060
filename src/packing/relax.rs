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
use super::progress::{Follow, State, body as kept_body, mark, restore};
use crate::contact::{Body, Geometry, GrownShape, PairFinder, intersects_wall, overlap, overlap_wall};
use crate::domain::Domain;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::wall::Surface;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Pushes that move bodies apart.
pub(super) struct Pushing {
    /// Rounds before giving up.
    pub(super) rounds: usize,
    /// Rounds before giving up in which the sum of the overlaps has not shrunk.
    pub(super) patience: usize,
    /// Way beyond what is needed, so that the end is reached in finitely many rounds: by this part of the depth,
    pub(super) overshoot: f64,
    /// and by this part of the reach of the smaller body, as overlaps shrink without end otherwise.
    pub(super) margin: f64,
    /// Way over its reach that a body may go before neighbours are looked for again.
    pub(super) skin: f64,
}

/// Cubes at a volume fraction of 0.3 take some dozen rounds.
const USUAL: Pushing =
    Pushing { rounds: 3000, patience: usize::MAX, overshoot: 0.02, margin: 1e-3, skin: 0.0 };
/// Depth in units of the reach up to which bodies that are moved within limits touch, but do not overlap.
pub const TOUCHING: f64 = 1e-9;
/// Bodies that may not move far give up after this many rounds in which the sum of the overlaps has not shrunk to this part.
const PATIENCE: usize = 200;
const SHRINKS: f64 = 0.99;
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

    /// Shift of the centre (m) and turn, the tangent of half the angle along its axis, that lead here from another pose.
    fn motion_from(&self, domain: &Domain, start: &Self) -> (Vec3, Vec3) {
        let shift = domain.nearest_image(self.position - start.position);
        let turn = self.orientation.quaternion() * start.orientation.quaternion().conjugate();
        // Half a turn has no tangent; any that is large is as good.
        let cosine = if turn.w.abs() > 1e-9 { turn.w } else { 1e-9 };
        (shift, turn.imag() / cosine)
    }

    /// Bound of the distance (m) that the points within `radius` (m) of the centre have moved from another pose, and the angle
    /// of the turn (degrees).
    pub fn moved_from(&self, domain: &Domain, start: &Self, radius: f64) -> (f64, f64) {
        let (shift, turn) = self.motion_from(domain, start);
        let tangent = turn.norm();
        let sine = tangent / (1.0 + tangent * tangent).sqrt();
        (shift.norm() + 2.0 * radius * sine, (2.0 * libm::atan(tangent)).to_degrees())
    }

    /// Moves it back towards `start` until no point within `radius` (m) of the centre is further than `limit` (m) from there.
    fn hold(&mut self, domain: &Domain, start: &Self, radius: f64, limit: f64) {
        let (shift, turn) = self.motion_from(domain, start);
        // The tangent exceeds the sine, of which the chord is made.
        let way = shift.norm() + 2.0 * radius * turn.norm();
        if way > limit {
            let part = limit / way;
            self.position = domain.wrap(start.position + shift * part);
            self.orientation = start.turned(turn * part);
        }
    }
}

/// Orientations that are all equally likely, the same for the same seed on any machine.
pub fn random_orientations(count: usize, seed: u64) -> Vec<Quat> {
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(seed ^ ORIENTATIONS));
    (0..count).map(|_| random_orientation(&mut random)).collect()
}

/// One of them.
pub(super) fn random_orientation(random: &mut Uniform) -> Quat {
    loop {
        let [w, i, j, k] = std::array::from_fn(|_| 2.0 * random.next() - 1.0);
        let square: f64 = w * w + i * i + j * j + k * k;
        // Points of a ball have no preferred direction; those of its cube do.
        if (0.01..=1.0).contains(&square) {
            let scale = 1.0 / square.sqrt();
            return Quat::new_unchecked(Quaternion::new(w * scale, i * scale, j * scale, k * scale));
        }
    }
}

/// Moves all bodies but the first `fixed` ones until no two overlap and none overlaps a wall.
///
/// Returns whether that was reached; fixed ones may overlap each other and the walls. With `limits`, one for each pose, no point of
/// a body moves further than the limit of that body (m), and it gives up once the overlaps no longer shrink.
pub fn relax(
    domain: Domain,
    walls: &[Surface],
    contours: &[GrownShape],
    poses: &mut [Pose],
    fixed: usize,
    limits: Option<&[f64]>,
) -> bool {
    let (patience, way) = match limits {
        Some(limits) => (PATIENCE, Way::Limited(limits)),
        None => (USUAL.patience, Way::Free),
    };
    relax_by(&Pushing { patience, ..USUAL }, domain, walls, contours, poses, fixed, way)
}

/// Limits (m) within which bodies move, or a follower of them.
pub(super) enum Way<'a> {
    Free,
    Limited(&'a [f64]),
    Followed(&'a mut dyn Follow),
}

/// As [`relax`], by other pushes.
pub(super) fn relax_by(
    by: &Pushing,
    domain: Domain,
    walls: &[Surface],
    contours: &[GrownShape],
    poses: &mut [Pose],
    fixed: usize,
    way: Way,
) -> bool {
    let (limits, mut follow) = match way {
        Way::Free => (None, None),
        Way::Limited(limits) => (Some(limits), None),
        Way::Followed(follow) => (None, Some(follow)),
    };
    let starts = poses.to_vec();
    let movers: Vec<Mover> = contours.iter().map(Mover::new).collect();
    let radii: Vec<f64> = poses.iter().map(|p| contours[p.contour].reach()).collect();
    let hold = |pose: &mut Pose, i: usize| {
        if let Some(limits) = limits {
            pose.hold(&domain, &starts[i], radii[i], limits[i]);
        }
    };
    let mut finder = PairFinder::new(domain);
    let reaches: Vec<f64> = radii.iter().map(|radius| radius * (1.0 + by.skin)).collect();
    let (mut pairs, mut found_at) = (Vec::new(), Vec::<Vec3>::new());
    let touching = if limits.is_some() { TOUCHING } else { 0.0 };
    // The sum of all overlaps in units of the reach, and the round since which it has not shrunk.
    let mut least_sum = (f64::INFINITY, 0);
    let mark = follow.as_ref().map_or(0, |_| mark(&domain, &radii, poses));
    let kept = follow.as_mut().and_then(|follow| follow.kept(mark));
    let mut first = 0;
    if let Some(kept) = kept.filter(|kept| kept.mark == mark && kept.bodies.len() == poses.len()) {
        first = kept.rounds;
        found_at = poses.iter_mut().zip(&kept.bodies).map(|(pose, body)| restore(pose, body)).collect();
        pairs = finder.find(&found_at, &reaches).to_vec();
        least_sum = kept.least_sum;
    }
    for round in first..by.rounds {
        let far = |((pose, from), radius): ((&Pose, &Vec3), &f64)| {
            domain.nearest_image(pose.position - from).norm() > by.skin * radius
        };
        if found_at.is_empty() || poses.iter().zip(&found_at).zip(&radii).any(far) {
            found_at = poses.iter().map(|p| p.position).collect();
            pairs = finder.find(&found_at, &reaches).to_vec();
        }
        let (mut overlaps, mut sum) = (0, 0.0);
        for &[a, b] in &pairs {
            let (a, b) = (a as usize, b as usize);
            if b < fixed {
                continue;
            }
            for shift in domain.shifts(radii[a] + radii[b]) {
                let nearest = domain.nearest_image(poses[b].position - poses[a].position);
                let offset = domain.shifted(nearest, shift);
                if by.skin > 0.0 && offset.norm() >= radii[a] + radii[b] {
                    continue;
                }
                let [first, second] = [a, b].map(|i| body(contours, &poses[i]));
                let Some(overlap) = overlap(Geometry::Exact, &first, &second, offset) else {
                    continue;
                };
                let least = radii[a].min(radii[b]);
                if overlap.depth < touching * least {
                    continue;
                }
                overlaps += 1;
                let levers = [overlap.point, overlap.point - offset];
                let mut weights = [a, b].map(|i| &movers[poses[i].contour]).map(Some);
                if a < fixed {
                    weights[0] = None;
                }
                sum += overlap.depth / least;
                let way = overlap.depth * (1.0 + by.overshoot) + by.margin * least;
                push(&domain, poses, [a, b], weights, levers, overlap.normal, way);
                for i in [a, b].into_iter().filter(|i| *i >= fixed) {
                    hold(&mut poses[i], i);
                }
            }
        }
        for i in fixed..poses.len() {
            for wall in walls {
                let seen = wall.seen_from(poses[i].position);
                if seen.distance(Vec3::zeros()) > radii[i] {
                    continue;
                }
                let body = body(contours, &poses[i]);
                let slack = touching * radii[i];
                let (point, normal, depth) = match overlap_wall(Geometry::Exact, &body, &seen) {
                    Some(overlap) if overlap.depth >= slack => (overlap.point, overlap.normal, overlap.depth),
                    // Samples miss the smallest overlaps.
                    None if slack > 0.0 => {
                        let away = seen.normal(Vec3::zeros());
                        if !intersects_wall(&body, &seen.seen_from(away * slack)) {
                            continue;
                        }
                        (Vec3::zeros(), -away, slack)
                    }
                    _ => continue,
                };
                overlaps += 1;
                sum += depth / radii[i];
                let weights = [Some(&movers[poses[i].contour]), None];
                let way = depth * (1.0 + by.overshoot) + by.margin * radii[i];
                push(&domain, poses, [i, i], weights, [point; 2], normal, way);
                hold(&mut poses[i], i);
            }
        }
        if overlaps == 0 {
            return true;
        }
        if sum < SHRINKS * least_sum.0 {
            least_sum = (sum, round);
        } else if round - least_sum.1 > by.patience {
            return false;
        }
        if let Some(follow) = &mut follow {
            let (bodies, rounds) = (poses.iter().zip(&found_at), round + 1);
            let state = || State {
                mark,
                rounds,
                least_sum,
                bodies: bodies.clone().map(|(pose, at)| kept_body(pose, at)).collect(),
            };
            follow.round(rounds, overlaps, &state);
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
pub(super) mod tests;
