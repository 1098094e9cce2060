//! Claims about mixed bodies: they lie as in a fluid of hard bodies in equilibrium, and keep what packing promises.

use super::*;
use crate::contact::{Geometry, overlap, overlap_wall};
use crate::math::Quat;
use crate::packing::relax::{random_orientations, relax};
use crate::packing::{Ball, count_for_volume_fraction, pack};
use crate::shape::{Cuboid, Ellipsoid, Shape, Sphere};
use rand_chacha::rand_core::RngCore;
use std::f64::consts::PI;
use std::sync::Arc;

fn cube(edge: usize) -> Domain {
    Domain { faces: Domain::faces([true; 3]), cells: [edge; 3], dx: 1.0 }
}

/// Bodies of the volume of a sphere of diameter 1, packed and turned at random, not yet mixed; they keep a gap.
fn packed(
    domain: &Domain,
    walls: &[Surface],
    shape: &Arc<dyn Shape>,
    fraction: f64,
    gap: f64,
    seed: u64,
) -> (Vec<GrownShape>, Vec<Pose>) {
    let count = count_for_volume_fraction(domain.volume(), fraction, shape.volume()) as usize;
    let ball = Ball { radius: 0.5, half_gap: 0.5 * gap };
    let positions = pack(domain, walls, &[], &vec![ball; count], seed).unwrap();
    let sphere = shape.as_sphere().is_some();
    let poses = positions.into_iter().zip(random_orientations(count, seed));
    let poses = poses.map(|(position, orientation)| Pose {
        contour: 0,
        position,
        orientation: if sphere { Quat::identity() } else { orientation },
    });
    let contours = vec![GrownShape::new(shape.clone(), 0.5 * gap)];
    let mut poses: Vec<Pose> = poses.collect();
    if !sphere {
        assert!(relax(*domain, walls, &contours, &mut poses, 0, None));
    }
    (contours, poses)
}

fn ball() -> Arc<dyn Shape> {
    Arc::new(Sphere { radius: 0.5 })
}

/// A cuboid of the volume of a sphere of diameter 1.
fn cuboid(edges: [f64; 3]) -> Arc<dyn Shape> {
    let scale = libm::cbrt(PI / 6.0 / edges.iter().product::<f64>());
    Arc::new(Cuboid::new(Vec3::from(edges) * scale).unwrap())
}

/// Pair distribution at contact of spheres of diameter 1, continued from two shells of this width with a constant
/// slope of its logarithm.
fn at_contact(domain: &Domain, boxes: &[Vec<Pose>], diameter: f64) -> f64 {
    const SHELL: f64 = 0.05;
    let mut shells = [0.0; 2];
    for poses in boxes {
        let density = poses.len() as f64 / domain.volume();
        let all = (boxes.len() * poses.len()) as f64 * 0.5 * density * 4.0 / 3.0 * PI * diameter.powi(3);
        for (i, a) in poses.iter().enumerate() {
            for b in &poses[..i] {
                let distance = domain.nearest_image(a.position - b.position).norm() / diameter;
                let shell = ((distance - 1.0) / SHELL).floor();
                if shell < 2.0 {
                    let (from, to) = (1.0 + SHELL * shell, 1.0 + SHELL * (shell + 1.0));
                    shells[shell.max(0.0) as usize] += 1.0 / (all * (to.powi(3) - from.powi(3)));
                }
            }
        }
    }
    shells[0] * (shells[0] / shells[1]).sqrt()
}

#[test]
fn spheres_touch_as_often_as_carnahan_and_starling_say() {
    // With a gap they are in equilibrium as spheres that much wider.
    for (fraction, gap) in [(0.1, 0.0), (0.3, 0.0), (0.3, 0.0278)] {
        let domain = cube(12);
        let mut contact = [Vec::new(), Vec::new()];
        for seed in 0..8 {
            let (contours, mut poses) = packed(&domain, &[], &ball(), fraction, gap, seed);
            contact[0].push(poses.clone());
            mix(&domain, &[], &contours, &mut poses, 0, seed);
            contact[1].push(poses);
        }
        let [before, after] = contact.map(|boxes| at_contact(&domain, &boxes, 1.0 + gap));
        let phi = fraction * (1.0_f64 + gap).powi(3);
        let expected = (1.0 - 0.5 * phi) / (1.0 - phi).powi(3);
        println!("phi {fraction}, gap {gap}: {before:.3}, {after:.3} for {expected:.3}");
        // Chance: 3500 pairs in either shell at 0.3, 200 at 0.1; times 1.6 by the continuation.
        let chance = if fraction > 0.2 { 0.08 } else { 0.3 };
        assert!((after / expected - 1.0).abs() < chance, "{after} for {expected}");
        assert!(before > 2.5 * expected, "{before} before");
    }
}

#[test]
fn the_density_varies_over_the_box_as_the_compressibility_says() {
    let (edge, phi) = (12, 0.3_f64);
    let domain = cube(edge);
    let (mut sum, mut waves) = (0.0, 0.0);
    for seed in 0..8 {
        let (contours, mut poses) = packed(&domain, &[], &ball(), phi, 0.0, seed);
        mix(&domain, &[], &contours, &mut poses, 0, seed);
        for wave in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [1.0, 0.0, 1.0],
        ] {
            let phase = |p: &Pose| 2.0 * PI / edge as f64 * Vec3::from(wave).dot(&p.position);
            let (c, s) = poses.iter().fold((0.0, 0.0), |(c, s), p| (c + phase(p).cos(), s + phase(p).sin()));
            sum += (c * c + s * s) / poses.len() as f64;
            waves += 1.0;
        }
    }
    // Structure factor of long waves by Carnahan and Starling; 1 for points at random, and for pushed ones.
    let expected = (1.0 - phi).powi(4) / ((1.0 + 2.0 * phi).powi(2) + phi.powi(3) * (phi - 4.0));
    let measured = sum / waves;
    println!("structure factor {measured:.3} for {expected:.3}");
    // 48 exponentially distributed numbers: 15 % by chance.
    assert!((measured / expected - 1.0).abs() < 0.5, "{measured} for {expected}");
}

#[test]
fn two_slabs_lie_as_if_thrown_until_they_do_not_overlap() {
    const THROWS: u64 = 3000;
    let (domain, shape) = (cube(2), cuboid([3.0, 2.0, 1.0]));
    let contours = vec![GrownShape::new(shape, 0.0)];
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(1));
    // Parts of the pairs whose centres are near, and whose shortest axes are about parallel.
    let look = |poses: &[Pose]| {
        let distance = domain.nearest_image(poses[1].position - poses[0].position).norm();
        let [a, b] = [0, 1].map(|i| poses[i].orientation * Vec3::z());
        [distance < 1.0, distance < 1.0 && a.dot(&b).abs() > 0.8]
            .map(|x| f64::from(u8::from(x)) / THROWS as f64)
    };
    let mut parts = [[0.0; 2]; 2];
    for seed in 0..THROWS {
        let mut poses = loop {
            let turns = random_orientations(2, random.0.next_u64());
            let poses: [Pose; 2] = std::array::from_fn(|i| Pose {
                contour: 0,
                position: Vec3::from_fn(|_, _| 2.0 * random.next()),
                orientation: turns[i],
            });
            let offset = domain.nearest_image(poses[1].position - poses[0].position);
            if !intersects(&body(&contours, &poses[0]), &body(&contours, &poses[1]), offset) {
                break poses;
            }
        };
        let thrown = look(&poses);
        // From one state, so that nothing is left of the throws.
        poses[0].position = Vec3::repeat(0.5);
        poses[1].position = Vec3::repeat(1.5);
        for pose in &mut poses {
            pose.orientation = Quat::identity();
        }
        mix(&domain, &[], &contours, &mut poses, 0, seed);
        let mixed = look(&poses);
        for i in 0..2 {
            parts[0][i] += thrown[i];
            parts[1][i] += mixed[i];
        }
    }
    println!("{parts:?}");
    for i in 0..2 {
        let [thrown, mixed] = [parts[0][i], parts[1][i]];
        // Four standard deviations of the difference.
        let chance = 4.0 * (2.0 * thrown * (1.0 - thrown) / THROWS as f64).sqrt();
        assert!(thrown > 0.03 && (mixed - thrown).abs() < chance, "{mixed} for {thrown} +- {chance}");
    }
}

#[test]
fn bodies_keep_their_gap_and_stay_between_walls() {
    let domain = Domain { faces: Domain::faces([true, true, false]), ..cube(7) };
    let walls = [(0.0, 1.0), (7.0, -1.0)]
        .map(|(z, up)| Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::new(0.0, 0.0, up) });
    let ellipsoid = Arc::new(Ellipsoid::new(Vec3::new(0.8, 0.4, 0.390_625)).unwrap());
    let shapes: [Arc<dyn Shape>; 4] = [ball(), cuboid([1.0; 3]), cuboid([3.0, 2.0, 1.0]), ellipsoid];
    for shape in shapes {
        let (contours, mut poses) = packed(&domain, &walls, &shape, 0.2, 0.03, 5);
        let before = poses.clone();
        mix(&domain, &walls, &contours, &mut poses, 0, 5);
        let moved = poses.iter().zip(&before).filter(|(a, b)| a != b).count();
        assert_eq!(moved, poses.len(), "{}: all have moved", shape.kind());
        for (i, a) in poses.iter().enumerate() {
            assert_eq!(domain.wrap(a.position), a.position);
            for b in &poses[..i] {
                let offset = domain.nearest_image(b.position - a.position);
                let overlap = overlap(Geometry::Exact, &body(&contours, a), &body(&contours, b), offset);
                assert!(overlap.is_none(), "{}: {overlap:?}", shape.kind());
            }
            for wall in &walls {
                let overlap = overlap_wall(Geometry::Exact, &body(&contours, a), &wall.seen_from(a.position));
                assert!(overlap.is_none(), "{}: {overlap:?}", shape.kind());
            }
        }
    }
}

#[test]
fn fixed_bodies_stay_and_the_same_seed_gives_the_same_bits() {
    let domain = cube(6);
    let (contours, before) = packed(&domain, &[], &cuboid([1.0; 3]), 0.2, 0.0, 1);
    let mixed = |seed| {
        let mut poses = before.clone();
        mix(&domain, &[], &contours, &mut poses, 3, seed);
        poses
    };
    let once = mixed(2);
    assert_eq!(once[..3], before[..3]);
    assert_eq!(once, mixed(2));
    assert_ne!(once, mixed(3));
}

#[test]
fn spheres_of_one_to_twenty_fill_their_part_and_lie_where_a_search_among_all_puts_them() {
    let (domain, radii, part) = (cube(5), [1.0, 0.05], 0.15);
    let volumes = radii.map(|r| 4.0 / 3.0 * PI * r * r * r);
    let rest = part - 4.0 * volumes[0] / domain.volume();
    let small = count_for_volume_fraction(domain.volume(), rest, volumes[1]) as usize;
    let kinds = [vec![0; 4], vec![1; small]].concat();
    let filled: f64 = kinds.iter().map(|&kind| volumes[kind]).sum();
    assert!(filled >= part * domain.volume() && filled - volumes[1] < part * domain.volume());
    let balls: Vec<Ball> =
        kinds.iter().map(|&kind| Ball { radius: radii[kind], half_gap: 0.01 * radii[kind] }).collect();
    let positions = pack(&domain, &[], &[], &balls, 1).unwrap();
    let poses = positions.into_iter().zip(&kinds);
    let mut poses: Vec<Pose> =
        poses.map(|(position, &contour)| Pose { contour, position, orientation: Quat::identity() }).collect();
    let contours =
        radii.map(|radius| GrownShape::new(Arc::new(Sphere { radius }) as Arc<dyn Shape>, 0.01 * radius));
    mix(&domain, &[], &contours, &mut poses, 0, 1);
    for (i, a) in poses.iter().enumerate() {
        for b in &poses[..i] {
            let apart = domain.nearest_image(a.position - b.position).norm();
            assert!(apart >= 1.01 * (radii[a.contour] + radii[b.contour]), "{apart}");
        }
    }
    // Stored from bins as wide as the widest sphere, in which all near are looked at: two minutes.
    let stored = [
        (0, [2.431_159_385_082_777_7, 0.062_409_971_107_227_11, 1.880_211_623_989_148_7]),
        (small, [1.368_356_618_363_210_5, 3.509_374_446_248_554_3, 1.026_301_841_713_103_6]),
    ];
    for (number, position) in stored {
        assert_eq!(poses[number].position, Vec3::from(position));
    }
    let sum = poses.iter().fold(Vec3::zeros(), |sum, pose| sum + pose.position);
    assert_eq!(sum, Vec3::new(9_788.344_155_301_435, 9_422.074_557_053_516, 9_653.429_970_541_869));
}
