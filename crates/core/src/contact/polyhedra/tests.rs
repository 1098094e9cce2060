use super::*;
use crate::contact::sphere_sphere;
use crate::contact::tests::{
    self, frame, gradient_error, in_solid, random, random_direction, random_solid, random_turn,
};
use crate::math::Quat;
use crate::shape::{Polyhedron, Shape, Sphere};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

fn matrix(turn: Quat) -> Mat3 {
    turn.to_rotation_matrix().into_inner()
}

fn cube(edge: f64) -> Solid {
    Solid::new(&Polyhedron::cuboid(Vec3::repeat(edge)), 0.0)
}

fn measured(a: &Solid, b: &Solid, turns: [Quat; 2], offset: Vec3) -> Option<Overlap> {
    overlap(a, &matrix(turns[0]), b, &matrix(turns[1]), offset, &mut Hint::default())
}

/// Largest errors against lines: volume (-), centre (in parts of the root of the volume), angle of the normal
/// (degrees), area (-), moment (in parts of area times edge).
const BOUNDS: [f64; 5] = [3e-3, 8e-3, 0.5, 1e-2, 1e-2];

/// Overlaps of random pairs against lines.
fn compare_with_lines(seed: u64, runs: u32, make: impl Fn(&mut ChaCha8Rng) -> Solid) {
    let mut random = random(seed);
    let (mut touching, mut worst) = (0, [0.0_f64; 5]);
    while touching < runs {
        let (a, b) = (make(&mut random), make(&mut random));
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * random.random_range(0.6..1.6);
        let Some(overlap) = measured(&a, &b, turns, offset) else {
            let first = in_solid(&a, matrix(turns[0]), Vec3::zeros());
            let second = in_solid(&b, matrix(turns[1]), offset);
            let missed = tests::any(&first, &second, 0.5 * offset, 1.0);
            assert!(!missed, "an overlap was not seen");
            continue;
        };
        if overlap.volume < 1e-8 {
            continue; // a needle between lines
        }
        touching += 1;
        // Long and thin overlaps that lie askew want more lines.
        let mut errors = [f64::INFINITY; 5];
        for n in [64, 192, 768] {
            if errors.iter().zip(BOUNDS).all(|(error, bound)| *error < bound) {
                break;
            }
            let truth = tests::lines(
                &in_solid(&a, matrix(turns[0]), Vec3::zeros()),
                &in_solid(&b, matrix(turns[1]), offset),
                &frame(overlap.normal),
                overlap.point,
                2.0,
                n,
            )
            .expect("lines meet what is there");
            errors = [
                (overlap.volume / truth.volume - 1.0).abs(),
                (overlap.point - truth.centre).norm() / truth.volume.cbrt(),
                overlap.normal.angle(&truth.area).to_degrees(),
                (overlap.area / truth.area.norm() - 1.0).abs(),
                (overlap.moment - truth.moment).norm() / truth.area.norm(),
            ];
        }
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    println!("volume, centre, angle, area, moment off by {worst:?}");
    assert!(worst.iter().zip(BOUNDS).all(|(worst, bound)| *worst < bound));
}

#[test]
fn a_thousand_random_pairs_of_cubes_overlap_as_lines_through_them_say() {
    compare_with_lines(1, 1000, |_| cube(1.0));
}

#[test]
fn a_thousand_random_pairs_of_polyhedra_overlap_as_lines_through_them_say() {
    compare_with_lines(2, 1000, |random| {
        let cuts = random.random_range(0..20);
        random_solid(random, cuts, 0.02)
    });
}

#[test]
fn area_and_moment_are_minus_the_gradient_of_the_volume() {
    let mut random = random(3);
    let mut touching = 0;
    while touching < 200 {
        let [a, b] = [0, 10].map(|cuts| random_solid(&mut random, cuts, 0.0));
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * random.random_range(0.4..1.2);
        let Some(overlap) = measured(&a, &b, turns, offset) else {
            continue;
        };
        touching += 1;
        let volume = |shift: Vec3, turn: Quat| {
            measured(&a, &b, [turns[0], turn * turns[1]], turn * offset + shift).map_or(0.0, |o| o.volume)
        };
        let error = gradient_error(&overlap, volume, 1e-6, 1.0);
        assert!(error < 1e-4, "{error} at {overlap:?}");
    }
}

#[test]
fn the_depth_is_the_thickness_along_the_normal_through_the_centre() {
    let mut random = random(4);
    let (a, b) = (cube(1.0), cube(0.8));
    for _ in 0..200 {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * 0.85;
        let Some(overlap) = measured(&a, &b, turns, offset) else {
            continue;
        };
        let ends = [
            in_solid(&a, matrix(turns[0]), Vec3::zeros())(overlap.point, overlap.normal),
            in_solid(&b, matrix(turns[1]), offset)(overlap.point, overlap.normal),
        ]
        .map(Option::unwrap);
        let thickness = ends[0].1.min(ends[1].1) - ends[0].0.max(ends[1].0);
        assert!((overlap.depth - thickness).abs() < 1e-12);
    }
}

#[test]
fn swapping_or_turning_the_pair_changes_nothing_but_the_view() {
    let mut random = random(5);
    for n in 0..300 {
        let [a, b] = [n % 7, n % 3].map(|cuts| random_solid(&mut random, cuts, 0.01));
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * random.random_range(0.4..1.1);
        let Some(one) = measured(&a, &b, turns, offset) else {
            continue;
        };
        let other = measured(&b, &a, [turns[1], turns[0]], -offset).unwrap();
        assert!((one.volume - other.volume).abs() < 1e-13);
        assert!((one.normal * one.area + other.normal * other.area).norm() < 1e-12);
        assert!((one.point - offset - other.point).norm() * one.volume < 1e-12);
        let moved = other.moment + offset.cross(&(other.normal * other.area));
        assert!((one.moment + moved).norm() < 1e-12);
        let turn = random_turn(&mut random);
        let turned = measured(&a, &b, [turn * turns[0], turn * turns[1]], turn * offset).unwrap();
        assert!((one.volume - turned.volume).abs() < 1e-13);
        assert!((turn * one.point - turned.point).norm() * one.volume < 1e-12);
        assert!((turn * one.moment - turned.moment).norm() < 1e-12);
    }
}

#[test]
fn cubes_face_to_face_overlap_in_a_cuboid_wherever_their_sides_lie_flush() {
    let a = cube(1.0);
    for turn in [Quat::identity(), random_turn(&mut random(6))] {
        for (shift, area) in [
            (Vec3::new(0.9, 0.0, 0.0), 1.0),
            (Vec3::new(0.9, 0.25, 0.0), 0.75),
            (Vec3::new(0.9, 0.25, -0.5), 0.375),
        ] {
            let overlap = measured(&a, &a, [turn; 2], turn * shift).unwrap();
            assert!((overlap.volume - 0.1 * area).abs() < 1e-14);
            let edges = shift.map(|x| 1.0 - x.abs());
            let faces = Vec3::from_fn(|i, _| shift[i].signum() * edges.product() / edges[i]);
            let expected = faces.component_mul(&shift.map(|x| f64::from(u8::from(x != 0.0))));
            assert!((turn * expected - overlap.normal * overlap.area).norm() < 1e-13);
            assert!((overlap.point - turn * shift * 0.5).norm() < 1e-14);
        }
    }
}

#[test]
fn a_small_cube_flush_with_a_side_of_a_large_one_is_the_same_seen_from_either() {
    let (large, small) = (cube(2.0), cube(1.0));
    // Flush at the top, half out at the front.
    let shift = Vec3::new(1.0, 0.0, 0.5);
    let one = measured(&large, &small, [Quat::identity(); 2], shift).unwrap();
    let other = measured(&small, &large, [Quat::identity(); 2], -shift).unwrap();
    assert!((one.volume - 0.5).abs() < 1e-14);
    // The mean of moving up, which takes nothing in the flush face, and of moving down, which takes all of it.
    assert!((one.normal * one.area - Vec3::new(1.0, 0.0, 0.25)).norm() < 1e-14);
    assert!((one.normal * one.area + other.normal * other.area).norm() < 1e-14);
}

#[test]
fn degenerate_poses_give_finite_overlaps_or_none() {
    let (a, b) = (cube(1.0), cube(0.5));
    let eighth = std::f64::consts::FRAC_PI_4;
    let diagonal = Quat::rotation_between(&Vec3::repeat(1.0), &Vec3::x()).unwrap();
    let turns = [
        Quat::identity(),
        Quat::from_axis_angle(&Vec3::z_axis(), eighth),
        Quat::from_axis_angle(&Vec3::x_axis(), eighth),
        diagonal,
    ];
    let root = 0.5_f64.sqrt();
    let distances =
        [0.0, 1e-300, 1e-16, 0.25, 0.5, 0.75, 1.0, root, 0.5 + root, 0.5 + 0.75_f64.sqrt(), 2.0 * root];
    for (first, second) in [(&a, &a), (&a, &b), (&b, &a)] {
        for turn in turns {
            for other in turns {
                for x in distances {
                    for y in distances {
                        for z in [0.0, 0.5, 1.0] {
                            let Some(o) = measured(first, second, [turn, other], Vec3::new(x, y, z)) else {
                                continue;
                            };
                            let numbers = [o.volume, o.depth, o.area];
                            assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{o:?}");
                            assert!(o.point.iter().chain(&o.moment).all(|x| x.is_finite()), "{o:?}");
                            assert!((o.normal.norm() - 1.0).abs() < 1e-12, "{o:?}");
                            assert!(o.volume < 1.0 + 1e-12 && o.point.norm() < 1.0);
                        }
                    }
                }
            }
        }
    }
    let whole = measured(&a, &a, [diagonal; 2], Vec3::zeros()).unwrap();
    assert!((whole.volume - 1.0).abs() < 1e-14 && whole.area < 1e-14 && whole.point.norm() < 1e-14);
    let inside = measured(&b, &a, [diagonal, Quat::identity()], Vec3::new(0.01, 0.0, 0.0)).unwrap();
    assert!((inside.volume - 0.125).abs() < 1e-15 && (inside.normal - Vec3::x()).norm() < 1e-14);
}

#[test]
fn thin_overlaps_are_as_exact_as_thick_ones() {
    let a = cube(1.0);
    for depth in [1e-2, 1e-4, 1e-6, 1e-8] {
        // A corner, straight down on a face.
        let upright = Quat::rotation_between(&Vec3::repeat(-1.0), &-Vec3::z()).unwrap();
        let height = 0.5 + 0.75_f64.sqrt() - depth;
        let overlap = measured(&a, &a, [Quat::identity(), upright], Vec3::new(0.1, 0.2, height)).unwrap();
        // Legs of the cut corner are sqrt(3) times its height.
        let volume = (3.0_f64.sqrt() * depth).powi(3) / 6.0;
        assert!((overlap.volume / volume - 1.0).abs() < 1e-14 / depth, "{depth}");
        assert!((overlap.normal - Vec3::z()).norm() < 1e-12 / depth);
        assert!((overlap.depth / depth - 1.0).abs() < 1e-14 / depth);
    }
}

#[test]
fn a_sphere_of_more_and_more_facets_comes_to_the_lens() {
    let offset = Vec3::new(0.9, 1.2, 0.8);
    let exact = sphere_sphere::overlap(1.0, 1.0, offset).unwrap();
    let mut last = f64::INFINITY;
    for refinement in [1, 2, 3] {
        let mesh = Sphere { radius: 1.0 }.surface_mesh(refinement);
        let planes: Vec<Plane> =
            mesh.points.iter().map(|p| Plane { normal: p.normalize(), offset: 1.0 }).collect();
        let solid = Solid::from_planes(planes, 1.5, 0.0);
        let overlap = measured(&solid, &solid, [Quat::identity(); 2], offset).unwrap();
        let error = (overlap.volume / exact.volume - 1.0).abs();
        assert!(error < 0.4 * last, "{error} after {last}");
        assert!(overlap.normal.angle(&exact.normal) < 0.1 * error.sqrt());
        last = error;
    }
    assert!(last < 0.05, "{last}");
}

#[test]
fn a_grown_cube_is_a_larger_cube() {
    let grown = Solid::new(&Polyhedron::cuboid(Vec3::repeat(0.8)), 0.1);
    let plain = cube(1.0);
    let turns = [random_turn(&mut random(8)), random_turn(&mut random(9))];
    let offset = Vec3::new(0.5, 0.6, 0.7);
    let [one, other] = [&grown, &plain].map(|solid| measured(solid, solid, turns, offset).unwrap());
    assert!((one.volume - other.volume).abs() < 1e-15 && (grown.reach - plain.reach).abs() < 1e-15);
    assert_eq!((grown.vertices.len(), grown.planes.len()), (8, 6));
}

#[test]
fn a_corner_of_many_faces_and_doubled_planes_are_no_trouble() {
    // A pyramid over a square, grown: its tip has four faces; every plane twice.
    let mut planes: Vec<Plane> = [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()]
        .map(|side| Plane { normal: (side + Vec3::z()).normalize(), offset: 0.5_f64.sqrt() * 0.5 })
        .to_vec();
    planes.push(Plane { normal: -Vec3::z(), offset: 0.2 });
    let doubled: Vec<Plane> = planes.iter().flat_map(|p| [*p, *p]).collect();
    for enlargement in [0.0, 0.05] {
        let solid = Solid::from_planes(doubled.clone(), 1.0, enlargement);
        assert_eq!((solid.planes.len(), solid.vertices.len()), (5, 5));
        let height = 0.7 + enlargement * (1.0 + 2.0_f64.sqrt());
        let whole = measured(&solid, &cube(5.0), [Quat::identity(); 2], Vec3::zeros()).unwrap();
        assert!((whole.volume - 4.0 / 3.0 * height.powi(3)).abs() < 1e-12);
    }
}

#[test]
fn a_polyhedron_in_a_wall_is_its_overlap_with_a_huge_cube() {
    let mut random = random(10);
    let huge = cube(20.0);
    for _ in 0..200 {
        let solid = random_solid(&mut random, 8, 0.0);
        let (turn, wall) = (random_turn(&mut random), random_turn(&mut random));
        let depth = random.random_range(-0.4..0.6);
        let normal = wall * Vec3::z();
        let plane = Plane { normal, offset: -depth };
        let one = overlap_plane(&solid, &matrix(turn), &plane);
        let other = measured(&solid, &huge, [turn, wall], normal * (-10.0 - depth));
        let (Some(one), Some(other)) = (one, other) else {
            assert!(one.is_none() && other.is_none());
            continue;
        };
        assert!((one.volume / other.volume - 1.0).abs() < 1e-9);
        assert!((one.depth / other.depth - 1.0).abs() < 1e-6);
        assert!((one.point - other.point).norm() < 1e-9 && (one.moment - other.moment).norm() < 1e-12);
        assert!((one.area - other.area).abs() < 1e-12 && one.normal == -normal);
    }
}

#[test]
fn a_cube_that_sinks_through_a_wall_stays_finite_and_continuous() {
    let (a, turn) = (cube(1.0), matrix(random_turn(&mut random(11))));
    let at = |offset: f64| {
        let normal = Vec3::z();
        overlap_plane(&a, &turn, &Plane { normal, offset })
    };
    let mut last: Option<Overlap> = None;
    for n in -1000..=1000 {
        let now = at(f64::from(n) * 1e-3);
        if let (Some(now), Some(last)) = (now, last) {
            assert!((now.volume - last.volume).abs() < 2e-3 && (now.depth - last.depth).abs() < 5e-3);
            assert!(now.area.is_finite() && now.normal == -Vec3::z());
        }
        last = now;
    }
    assert!((last.unwrap().volume - 1.0).abs() < 1e-14);
}

#[test]
fn a_hint_changes_no_overlap_whatever_pair_it_is_of() {
    let mut random = random(15);
    let solids: Vec<Solid> = (0..6).map(|_| random_solid(&mut random, 4, 0.0)).chain([cube(0.8)]).collect();
    let (mut hint, mut touching, mut used) = (Hint::default(), 0, 0);
    for _ in 0..2000 {
        let [a, b] = [0, 1].map(|_| &solids[random.random_range(0..solids.len())]);
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let towards = random_direction(&mut random);
        // Towards each other, so that the hint is first that of another pair and then of the step before.
        for step in 0..8 {
            let offset = towards * (1.5 - 0.1 * f64::from(step));
            let without = measured(a, b, turns, offset);
            let before = hint;
            let with = overlap(a, &matrix(turns[0]), b, &matrix(turns[1]), offset, &mut hint);
            assert_eq!(with, without);
            touching += usize::from(with.is_some());
            used += usize::from(with.is_none() && hint == before && hint != Hint::default());
        }
    }
    assert!(touching > 1000 && used > 1000, "{touching} {used}");
}

/// `cargo test --release -- --ignored --nocapture speed_of_polyhedra`
#[test]
#[ignore = "prints timings"]
fn speed_of_polyhedra() {
    use std::hint::black_box;
    let mut random = random(12);
    let stone = {
        let planes: Vec<Plane> = (0..50)
            .map(|_| Plane { normal: random_direction(&mut random), offset: random.random_range(0.48..0.5) })
            .collect();
        Solid::from_planes(planes, 1.5, 0.0)
    };
    for (name, solid) in [("cube-cube", cube(0.8)), ("stone-stone", stone)] {
        let (mut touching, mut near) = (Vec::new(), Vec::new());
        while touching.len() < 1000 || near.len() < 1000 {
            let turns = [random_turn(&mut random), random_turn(&mut random)].map(matrix);
            let offset = random_direction(&mut random) * random.random_range(0.8..1.4);
            match overlap(&solid, &turns[0], &solid, &turns[1], offset, &mut Hint::default()) {
                Some(o) if o.depth < 0.1 => touching.push((turns, offset)),
                None if offset.norm() < 2.0 * solid.reach => near.push((turns, offset)),
                _ => {}
            }
        }
        for (what, pairs) in [("touching", touching), ("near miss", near)] {
            let mut best = f64::INFINITY;
            // After the first round those of the step before, as in a run.
            let mut hints = vec![Hint::default(); pairs.len()];
            for _ in 0..20 {
                let start = std::time::Instant::now();
                for ((turns, offset), hint) in pairs.iter().zip(&mut hints) {
                    black_box(overlap(&solid, &turns[0], &solid, &turns[1], *offset, hint));
                }
                best = best.min(start.elapsed().as_secs_f64() / pairs.len() as f64);
            }
            println!("{name}, {what}: {:.0} ns ({} faces)", best * 1e9, solid.planes.len());
        }
    }
}
