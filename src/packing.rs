//! Initial positions: random packings, and files of positions.
//!
//! Random points are pushed apart pair by pair until no two spheres are closer than allowed. Bodies of other shapes
//! start from there, as spheres of the same volume, and are [relaxed](relax) further. Then all are [mixed](mix) until
//! they are distributed as in a fluid of hard bodies, and in dense packings [squeezed](dense). Bodies that come during a run are [inserted](insertion). Only `+ - * /`, square roots and streams of random numbers are
//! used: the same seed gives the same bits on any machine.

pub mod dense;
pub mod insertion;
pub mod mix;
mod neighbours;
pub mod positions;
pub mod progress;
pub mod relax;

use crate::contact::PairFinder;
use crate::domain::Domain;
use crate::math::Vec3;
use crate::wall::Surface;
use neighbours::Bins;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Largest solid volume fraction (-) at which bodies are put at random and pushed apart; where it is more, they are [squeezed](dense).
pub const MAX_VOLUME_FRACTION: f64 = 0.45;
/// Largest solid volume fraction accepted (-), which no random packing reaches.
pub const MAX_DENSE_FRACTION: f64 = 0.74;
/// Volume fraction at which bodies that are squeezed begin (-).
pub const LOOSE: f64 = 0.4;
/// Largest volume fraction of the spheres with their gaps (-); random close packing ends at 0.64.
pub const MAX_GROWN_FRACTION: f64 = 0.52;
/// Smallest gap between surfaces in diameters if the case gives none, as in the data set of Marquardt et al. (2024).
pub const DEFAULT_GAP: f64 = 0.0278;
/// Rounds of pushing before giving up; a volume fraction of 0.45 takes a few hundred.
const MAX_ROUNDS: usize = 5000;
/// Rounds after which spheres that fixed ones still push, or that do not escape from walls, begin elsewhere: they may be caught between these.
const CAUGHT: usize = 500;
/// Pushes of all walls after which a sphere escapes from them or not; where two make a narrow edge it takes many.
const ESCAPE: usize = 100;
/// Draws for a place that is clear of fixed spheres and walls.
const DRAWS: usize = 1000;
/// Push a little further than needed, so that the end is reached in finitely many rounds.
const OVERSHOOT: f64 = 1.0 + 1e-3;

/// A sphere to be placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Radius (m).
    pub radius: f64,
    /// Half of the gap to other spheres (m); the gap of two spheres is the sum of their halves.
    pub half_gap: f64,
}

impl Ball {
    fn reach(&self) -> f64 {
        self.radius + self.half_gap
    }
}

/// Number of bodies of `body_volume` (m^3) whose volume is at least a fraction (-) of `volume` (m^3).
pub fn count_for_volume_fraction(volume: f64, fraction: f64, body_volume: f64) -> u64 {
    // A fraction that was computed from a whole number of bodies gives that number back.
    (fraction * volume / body_volume - 1e-9).ceil().max(1.0) as u64
}

/// Numbers in `[0, 1)`, the same on any machine.
#[derive(Debug)]
struct Uniform(ChaCha8Rng);

impl Uniform {
    fn next(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }
}

/// Positions (m) of `balls`, random and no closer than they may be to each other, to `fixed` ones, and to walls.
///
/// `None` if there is no room for them.
pub fn pack(
    domain: &Domain,
    walls: &[Surface],
    fixed: &[(Vec3, Ball)],
    balls: &[Ball],
    seed: u64,
) -> Option<Vec<Vec3>> {
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(seed));
    let size = domain.size();
    let mut positions: Vec<Vec3> = fixed.iter().map(|(position, _)| *position).collect();
    let mut draw = || {
        let (x, y, z) = (random.next(), random.next(), random.next());
        domain.wrap(Vec3::new(x, y, z).component_mul(&size))
    };
    // Those that begin behind a wall would all end up beside it.
    positions.extend(balls.iter().map(|_| {
        let first = draw();
        let behind = |at: &Vec3| walls.iter().any(|wall| wall.is_wall(*at));
        if behind(&first) {
            (1..DRAWS).map(|_| draw()).find(|at| !behind(at)).unwrap_or(first)
        } else {
            first
        }
    }));
    let reaches: Vec<f64> = (fixed.iter().map(|(_, ball)| ball)).chain(balls).map(Ball::reach).collect();
    let mut finder = PairFinder::new(*domain);
    for round in 1..=MAX_ROUNDS {
        let mut pushed = vec![false; positions.len()];
        // Fixed ones may be as close to each other as they like.
        let mut moved = false;
        for [a, b] in finder.find(&positions, &reaches).iter().map(|pair| pair.map(|i| i as usize)) {
            if b < fixed.len() {
                continue;
            }
            let wanted = reaches[a] + reaches[b];
            let apart = domain.nearest_image(positions[b] - positions[a]);
            // An earlier push of this round may have parted them already.
            let distance = apart.norm();
            if distance >= wanted {
                continue;
            }
            let direction = if distance > 1e-9 * wanted { apart / distance } else { Vec3::x() };
            let push = (wanted * OVERSHOOT - distance) * direction;
            let share = if a < fixed.len() { 0.0 } else { 0.5 };
            pushed[b] |= a < fixed.len();
            positions[a] = domain.wrap(positions[a] - share * push);
            positions[b] = domain.wrap(positions[b] + (1.0 - share) * push);
            moved = true;
        }
        for i in fixed.len()..positions.len() {
            moved |= push_off(domain, walls, &mut positions[i], reaches[i]);
        }
        if !moved {
            return Some(positions.split_off(fixed.len()));
        }
        if round % CAUGHT == 0 {
            let is_caught = |i: &usize| pushed[*i] || !escapes(domain, walls, positions[*i], reaches[*i]);
            let caught: Vec<usize> = (fixed.len()..positions.len()).filter(is_caught).collect();
            let known = positions[..fixed.len()].to_vec();
            let bins = Bins::new(domain, known.into_iter().zip(reaches.iter().copied()));
            for i in caught {
                let is_clear = |at: &Vec3| {
                    let apart = |j: usize| domain.nearest_image(positions[j] - at).norm();
                    !bins.any(at, reaches[i], |j| apart(j) < reaches[i] + reaches[j])
                        && walls.iter().all(|wall| wall.distance_up_to(*at, reaches[i]) >= reaches[i])
                };
                let clear = (0..DRAWS).map(|_| draw()).find(is_clear);
                positions[i] = clear.unwrap_or(positions[i]);
            }
        }
    }
    None
}

/// Pushes a sphere away from each wall in turn; returns true if one did.
fn push_off(domain: &Domain, walls: &[Surface], at: &mut Vec3, reach: f64) -> bool {
    let mut is_pushed = false;
    for wall in walls {
        let distance = wall.distance_up_to(*at, reach);
        if distance < reach {
            let push = (reach * OVERSHOOT - distance) * wall.normal(*at);
            *at = domain.wrap(*at + push);
            is_pushed = true;
        }
    }
    is_pushed
}

/// Returns true if walls alone push a sphere to a place that is clear of them.
fn escapes(domain: &Domain, walls: &[Surface], mut at: Vec3, reach: f64) -> bool {
    (0..ESCAPE).any(|_| !push_off(domain, walls, &mut at, reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Quat;
    use crate::wall::{FreeSide, PlacedMesh, WallMesh};
    use std::sync::Arc;

    fn cube(diameters: usize) -> Domain {
        Domain { faces: Domain::faces([true; 3]), cells: [diameters * 9; 3], dx: 1.0 / 9.0 }
    }

    fn cuboid(low: Vec3, high: Vec3, free: FreeSide) -> Surface {
        let corner =
            |n: u32| Vec3::from_fn(|axis, _| if n >> axis & 1 == 1 { high[axis] } else { low[axis] });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let facets = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mesh = Arc::new(WallMesh::new((0..8).map(corner).collect(), facets, Some(free)).unwrap());
        Surface::Mesh(PlacedMesh { mesh, position: Vec3::zeros(), orientation: Quat::identity() })
    }

    const BALL: Ball = Ball { radius: 0.5, half_gap: 0.5 * DEFAULT_GAP };

    #[test]
    fn the_number_of_spheres_is_that_of_the_published_study() {
        let volume = std::f64::consts::PI / 6.0;
        for (edge, fraction, count) in [(10, 0.1, 191), (12, 0.1, 331), (12, 0.3, 991), (15, 0.3, 1934)] {
            assert_eq!(count_for_volume_fraction(cube(edge).volume(), fraction, volume), count);
        }
        let exact = 191.0 * volume / 1000.0;
        assert_eq!(count_for_volume_fraction(cube(10).volume(), exact, volume), 191);
    }

    #[test]
    fn spheres_keep_their_distance_through_every_face_up_to_the_largest_volume_fraction() {
        for (edge, fraction) in [(2, 0.2), (4, 0.35), (15, 0.3), (15, 0.45)] {
            let domain = cube(edge);
            let volume = std::f64::consts::PI / 6.0;
            let count = count_for_volume_fraction(domain.volume(), fraction, volume) as usize;
            let positions = pack(&domain, &[], &[], &vec![BALL; count], 7).unwrap();
            assert_eq!(positions.len(), count);
            for (i, a) in positions.iter().enumerate() {
                assert_eq!(domain.wrap(*a), *a);
                for b in &positions[..i] {
                    let distance = domain.nearest_image(a - b).norm();
                    assert!(distance >= 1.0 + DEFAULT_GAP, "{distance}");
                }
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_other_positions() {
        let domain = cube(6);
        let once = pack(&domain, &[], &[], &[BALL; 80], 3).unwrap();
        assert_eq!(once, pack(&domain, &[], &[], &[BALL; 80], 3).unwrap());
        assert_ne!(once, pack(&domain, &[], &[], &[BALL; 80], 4).unwrap());
        // Stored, so that a change of the random numbers or of the pushing is noticed.
        assert_eq!(once[0].x.to_bits(), 3.954_396_976_792_451_4_f64.to_bits());
    }

    #[test]
    fn fixed_spheres_stay_and_are_kept_clear_of() {
        let domain = cube(4);
        let fixed = [(Vec3::new(0.05, 2.0, 3.9), BALL), (Vec3::new(2.0, 2.0, 2.0), BALL)];
        let positions = pack(&domain, &[], &fixed, &[BALL; 30], 1).unwrap();
        for (centre, _) in fixed {
            for p in &positions {
                assert!(domain.nearest_image(p - centre).norm() >= 1.0 + DEFAULT_GAP);
            }
        }
    }

    #[test]
    fn spheres_caught_between_fixed_ones_begin_elsewhere() {
        // A bed whose gaps have room for the middle of a sphere, but not for a sphere.
        let domain = cube(6);
        let at = |n: usize| {
            Vec3::new((n % 5) as f64, (n / 5 % 5) as f64, (n / 25) as f64) * 1.2 + Vec3::repeat(0.3)
        };
        let fixed: Vec<(Vec3, Ball)> = (0..75).map(|n| (at(n), BALL)).collect();
        let positions = pack(&domain, &[], &fixed, &[BALL; 60], 1).unwrap();
        for (centre, _) in &fixed {
            assert!(positions.iter().all(|p| domain.nearest_image(p - centre).norm() >= 1.0 + DEFAULT_GAP));
        }
    }

    #[test]
    fn spheres_caught_between_walls_begin_elsewhere() {
        // Half a diameter above the floor lies a plate as wide as the box: a sixth of all are drawn below it.
        let domain = Domain { faces: Domain::faces([true, true, false]), ..cube(6) };
        let plate = cuboid(Vec3::new(-1.0, -1.0, 0.5), Vec3::new(7.0, 7.0, 0.8), FreeSide::Outside);
        let plane = |z, up: f64| Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::z() * up };
        let walls = [plane(0.0, 1.0), plane(6.0, -1.0), plate];
        let positions = pack(&domain, &walls, &[], &[BALL; 60], 1).unwrap();
        assert!(positions.iter().all(|at| at.z > 1.3 && at.z < 5.5));
    }

    #[test]
    fn a_sphere_escapes_from_a_corner_of_a_mesh_but_not_from_a_gap() {
        let vessel = |height| cuboid(Vec3::zeros(), Vec3::new(6.0, 6.0, height), FreeSide::Inside);
        let corner = Vec3::new(0.2, 5.9, 0.3);
        assert!(escapes(&cube(6), &[vessel(2.0)], corner, 0.5));
        assert!(!escapes(&cube(6), &[vessel(0.9)], corner, 0.5));
    }

    #[test]
    fn a_wall_across_the_box_has_as_many_spheres_beside_it_as_a_face() {
        let domain = Domain { faces: Domain::faces([true, true, false]), ..cube(16) };
        let plane = |z, up: f64| Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::z() * up };
        let walls = [plane(0.0, 1.0), plane(16.0, -1.0), plane(8.0, -1.0)];
        let positions = pack(&domain, &walls, &[], &[BALL; 400], 5).unwrap();
        let beside = |z: f64| positions.iter().filter(|at| (at.z - z).abs() < 1.0).count();
        let [face, wall] = [0.0, 8.0].map(beside);
        assert!(positions.iter().all(|at| at.z < 7.5), "all in the free half");
        assert!((wall as f64 / face as f64 - 1.0).abs() < 0.3, "{wall} beside the wall, {face} at the face");
        // A pipe: those further than 3.25 from the axis are 78 % of what is drawn within 7; with those from behind the wall they would be 87 %.
        let pipe = Surface::Cylinder { point: Vec3::repeat(8.0), axis: Vec3::z(), radius: 7.0, pipe: true };
        let positions = pack(&cube(16), &[pipe], &[], &[BALL; 400], 5).unwrap();
        let outer = positions.iter().filter(|at| (at.xy() - Vec3::repeat(8.0).xy()).norm() > 3.25);
        let part = outer.count() as f64 / 400.0;
        assert!((part - 0.784).abs() < 0.05, "{part}");
    }

    #[test]
    fn what_has_no_room_is_refused_instead_of_squeezed() {
        assert!(pack(&cube(2), &[], &[], &[BALL; 14], 1).is_none());
    }
}
