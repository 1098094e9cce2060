//! Random positions for bodies that are inserted into a region one after another: random sequential addition.
//!
//! Template, velocity and orientation of the n-th body follow from the seed and n alone, the positions that are tried for it from the
//! seed, n and the number of the attempt. So no state of a generator has to be kept.
//!
//! # Reference
//! Widom (1966), Random sequential addition of hard spheres to a volume, doi:10.1063/1.1726548.

use super::Uniform;
use super::neighbours::Bins;
use super::relax::{Pose, body, random_orientation};
use crate::contact::{GrownShape, intersects, intersects_wall};
use crate::domain::Domain;
use crate::math::{Quat, Vec3};
use crate::wall::Surface;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Positions that are tried for a body in one attempt.
const DRAWS: usize = 500;
/// Distance in the stream of random numbers from one attempt to the next, more than all draws take.
const WORDS: u128 = 1 << 16;
/// New bodies that are compared one by one before they are sorted into bins, and their least part of all.
const UNSORTED: usize = 64;
const LEAST_PART: usize = 64;

/// A box of positions (m), its faces included; without thickness a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Lower corner (m).
    pub lower: Vec3,
    /// Upper corner (m).
    pub upper: Vec3,
}

impl Region {
    /// True of a position in it.
    pub fn has(&self, at: Vec3) -> bool {
        (0..3).all(|i| (self.lower[i]..=self.upper[i]).contains(&at[i]))
    }

    /// True if it has a position in common with another one.
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|i| self.lower[i] <= other.upper[i] && other.lower[i] <= self.upper[i])
    }

    /// True if it has more than faces in common with another one.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|i| self.lower[i] < other.upper[i] && other.lower[i] < self.upper[i])
    }

    /// Edges (m).
    pub fn edges(&self) -> Vec3 {
        self.upper - self.lower
    }

    /// Its corners (m).
    pub fn corners(&self) -> impl Iterator<Item = Vec3> {
        let Self { lower, upper } = *self;
        (0..8).map(move |n| Vec3::from_fn(|i, _| if n >> i & 1 == 1 { upper[i] } else { lower[i] }))
    }

    /// Distance (m) of the nearest image of a position.
    pub fn distance(&self, domain: &Domain, at: Vec3) -> f64 {
        let from_middle = domain.nearest_image(at - 0.5 * (self.lower + self.upper)).abs();
        (from_middle - 0.5 * self.edges()).map(|beyond| beyond.max(0.0)).norm()
    }
}

/// The bodies of an insertion, in an endless random order.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// Seed of all that is random.
    pub seed: u64,
    /// Templates, and the fraction of the number that each has (-).
    pub fractions: Vec<(usize, f64)>,
    /// Orientation; random without one.
    pub orientation: Option<Quat>,
    /// Mean velocity, and the largest deviation from it along each axis (m/s).
    pub velocity: [Vec3; 2],
}

/// A body without a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewBody {
    /// Its template.
    pub template: usize,
    /// Velocity (m/s).
    pub velocity: Vec3,
    /// Maps the body frame to the world frame.
    pub orientation: Quat,
}

impl Bodies {
    fn stream(&self, number: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(number);
        random
    }

    /// The n-th body, counted from 0.
    pub fn nth(&self, n: u64) -> NewBody {
        let mut random = Uniform(self.stream(n.wrapping_mul(2)));
        let mut part = random.next();
        let chosen = self.fractions.iter().find(|(_, fraction)| {
            part -= fraction;
            part < 0.0
        });
        // Rounding may leave a rest.
        let template = chosen.or(self.fractions.last()).map_or(0, |(template, _)| *template);
        let [mean, spread] = self.velocity;
        let velocity = mean + Vec3::from_fn(|i, _| (2.0 * random.next() - 1.0) * spread[i]);
        let orientation = self.orientation.unwrap_or_else(|| random_orientation(&mut random));
        NewBody { template, velocity, orientation }
    }

    /// Random numbers for the position of the n-th body in an attempt.
    fn tries(&self, n: u64, attempt: u64) -> Uniform {
        let mut random = self.stream(n.wrapping_mul(2).wrapping_add(1));
        random.set_word_pos(u128::from(attempt) * WORDS);
        Uniform(random)
    }
}

/// Bodies and walls round those that are inserted.
#[derive(Debug)]
pub struct Obstacles<'a> {
    domain: Domain,
    walls: &'a [Surface],
    contours: &'a [GrownShape],
    poses: Vec<Pose>,
    /// Has the first of `poses`.
    bins: Bins,
    sorted: usize,
}

impl<'a> Obstacles<'a> {
    /// Walls, and bodies with `poses`, whose contours are grown by half of the gap that bodies keep.
    pub fn new(domain: Domain, walls: &'a [Surface], contours: &'a [GrownShape], poses: Vec<Pose>) -> Self {
        let mut all = Self {
            domain,
            walls,
            contours,
            poses: Vec::new(),
            bins: Bins::new(&domain, std::iter::empty()),
            sorted: 0,
        };
        all.poses = poses;
        all.sort();
        all
    }

    fn sort(&mut self) {
        let reach = |pose: &Pose| (pose.position, self.contours[pose.contour].reach());
        self.bins = Bins::new(&self.domain, self.poses.iter().map(reach));
        self.sorted = self.poses.len();
    }

    /// The n-th body at a random position of a region where it overlaps nothing, if an attempt finds one; then it is an obstacle to
    /// the next.
    pub fn insert(
        &mut self,
        bodies: &Bodies,
        n: u64,
        attempt: u64,
        region: &Region,
    ) -> Option<(NewBody, Pose)> {
        let new = bodies.nth(n);
        let pose = self.position(&new, &mut bodies.tries(n, attempt), region)?;
        self.poses.push(pose);
        if self.poses.len() - self.sorted >= UNSORTED.max(self.sorted / LEAST_PART) {
            self.sort();
        }
        Some((new, pose))
    }

    fn position(&self, new: &NewBody, random: &mut Uniform, region: &Region) -> Option<Pose> {
        let sphere = self.contours[new.template].shape.as_sphere().is_some();
        let orientation = if sphere { Quat::identity() } else { new.orientation };
        let mut draw = || Vec3::from_fn(|i, _| region.lower[i] + random.next() * region.edges()[i]);
        let mut tries = (0..DRAWS).map(|_| Pose {
            contour: new.template,
            position: self.domain.wrap(draw()),
            orientation,
        });
        tries.find(|pose| self.is_free(pose, sphere))
    }

    fn is_free(&self, pose: &Pose, sphere: bool) -> bool {
        let (contours, domain) = (self.contours, &self.domain);
        let (new, reach) = (body(contours, pose), contours[pose.contour].reach());
        let clear = |wall: &Surface| {
            let distance = wall.distance_up_to(pose.position, reach);
            distance >= reach
                || (!sphere && distance > 0.0 && !intersects_wall(&new, &wall.seen_from(pose.position)))
        };
        let meets = |other: &Pose| {
            let near = reach + contours[other.contour].reach();
            let meets = |offset: Vec3| {
                offset.norm_squared() < near * near && intersects(&new, &body(contours, other), offset)
            };
            let difference = other.position - pose.position;
            meets(domain.nearest_image(difference)) || domain.images(difference, near).any(meets)
        };
        self.walls.iter().all(clear)
            && !self.poses[self.sorted..].iter().any(meets)
            && !self.bins.any(&pose.position, reach, |i| meets(&self.poses[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Body;
    use crate::shape::{Composite, Cuboid, Part, Sphere};
    use std::sync::Arc;

    const CUBE: usize = 1;

    fn contours() -> Vec<GrownShape> {
        let cube = Cuboid::new(Vec3::repeat(0.8)).unwrap();
        vec![GrownShape::new(Arc::new(Sphere { radius: 0.5 }), 0.01), GrownShape::new(Arc::new(cube), 0.01)]
    }

    fn bodies() -> Bodies {
        let velocity = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.1, 0.0, 0.0)];
        Bodies { seed: 3, fractions: vec![(0, 0.75), (CUBE, 0.25)], orientation: None, velocity }
    }

    fn domain() -> Domain {
        Domain { faces: Domain::faces([true, true, false]), cells: [40, 40, 80], dx: 0.1 }
    }

    const REGION: Region = Region { lower: Vec3::new(0.0, 0.0, 1.0), upper: Vec3::new(4.0, 4.0, 8.0) };

    /// As many of the first bodies as an attempt finds room for.
    fn fill(poses: Vec<Pose>, attempt: u64) -> Vec<(NewBody, Pose)> {
        let walls = [Surface::Plane { point: Vec3::new(0.0, 0.0, 8.0), normal: -Vec3::z() }];
        let contours = contours();
        let mut all = Obstacles::new(domain(), &walls, &contours, poses);
        (0..).map_while(|n| all.insert(&bodies(), n, attempt, &REGION)).collect()
    }

    #[test]
    fn inserted_bodies_overlap_neither_each_other_nor_those_that_are_there_nor_a_wall() {
        let at = |x, y, z| Pose { contour: 0, position: Vec3::new(x, y, z), orientation: Quat::identity() };
        let there = vec![at(0.05, 2.0, 4.0), at(3.0, 3.0, 2.0)];
        let found = fill(there.clone(), 7);
        assert!(found.len() > 40, "{}", found.len());
        let contours = contours();
        let all: Vec<Pose> = there.into_iter().chain(found.iter().map(|(_, pose)| *pose)).collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                let offset = domain().nearest_image(b.position - a.position);
                assert!(!intersects(&body(&contours, a), &body(&contours, b), offset));
            }
        }
        for (_, pose) in &found {
            let lowest = if pose.contour == CUBE { 0.41 } else { 0.51 };
            assert!(REGION.has(pose.position) && pose.position.z <= 8.0 - lowest);
        }
    }

    #[test]
    fn bodies_of_several_parts_keep_clear_part_by_part() {
        let bar = |edges: [f64; 3], z: f64| Part {
            shape: Arc::new(Cuboid::new(edges.into()).unwrap()),
            position: Vec3::z() * z,
            orientation: Quat::identity(),
        };
        let (hammer, _) = Composite::new(vec![bar([0.2, 0.2, 2.0], 0.0), bar([1.0, 0.2, 0.2], 0.9)]).unwrap();
        let contours = vec![GrownShape::new(Arc::new(hammer), 0.01)];
        let hammers = Bodies { fractions: vec![(0, 1.0)], ..bodies() };
        let mut all = Obstacles::new(domain(), &[], &contours, Vec::new());
        let found: Vec<Pose> =
            (0..).map_while(|n| all.insert(&hammers, n, 7, &REGION)).map(|f| f.1).collect();
        assert!(found.len() > 60, "{}", found.len());
        let part = |pose: &Pose, n: usize| {
            let part = &contours[0].shape.parts()[n];
            let grown = GrownShape::new(part.shape.clone(), 0.0);
            (grown, pose.position + pose.orientation * part.position, pose.orientation * part.orientation)
        };
        let mut near = 0;
        for (i, a) in found.iter().enumerate() {
            for b in &found[..i] {
                let offset = domain().nearest_image(b.position - a.position);
                near += usize::from(offset.norm() < 2.0 * contours[0].shape.circumradius());
                for [k, l] in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                    let ((one, at, turn), (other, to, its)) = (part(a, k), part(b, l));
                    let [first, second] =
                        [(&one, turn), (&other, its)].map(|(grown, orientation)| Body { grown, orientation });
                    assert!(!intersects(&first, &second, domain().nearest_image(to - at)));
                }
            }
        }
        assert!(near > 50, "{near}");
    }

    #[test]
    fn bodies_follow_from_the_seed_and_their_number_and_have_the_fractions_and_velocities_of_the_case() {
        let all: Vec<NewBody> = (0..4000).map(|n| bodies().nth(n)).collect();
        assert_eq!(all[17], bodies().nth(17));
        let cubes = all.iter().filter(|new| new.template == CUBE).count();
        assert!((900..1100).contains(&cubes), "{cubes}");
        let mean = all.iter().map(|new| new.velocity).sum::<Vec3>() / 4000.0;
        assert!((mean - Vec3::new(0.0, 0.0, -1.0)).norm() < 5e-3, "{mean}");
        assert!(all.iter().all(|new| new.velocity.x.abs() <= 0.1));
        assert_ne!(all[0], Bodies { seed: 4, ..bodies() }.nth(0));
    }

    #[test]
    fn another_attempt_tries_other_positions_for_the_same_body() {
        let [first, again, other] = [7, 7, 8].map(|attempt| fill(Vec::new(), attempt)[0]);
        assert_eq!(first, again);
        assert!(first.0 == other.0 && first.1.position != other.1.position);
    }
}
