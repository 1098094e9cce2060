use super::*;
use crate::contact::tests::{self, frame as axes_along, in_sphere, random, random_direction, random_turn};
use crate::contact::{self, Geometry, GrownShape, sphere_plane, sphere_sphere};
use crate::math::Quat;
use crate::shape::{Capsule, Cuboid, Cylinder, Ellipsoid, Shape, Sphere, Superellipsoid, SurfaceMesh};
use rand::Rng;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const SAMPLED: Geometry = Geometry::Sampled { samples: DEFAULT_SAMPLES };

/// Counts what is asked.
#[derive(Debug)]
struct Counting<S> {
    shape: S,
    asked: AtomicU64,
}

impl<S> Counting<S> {
    fn new(shape: S) -> Arc<Self> {
        let asked = AtomicU64::new(0);
        Arc::new(Self { shape, asked })
    }

    fn ask(&self) -> &S {
        self.asked.fetch_add(1, Ordering::Relaxed);
        &self.shape
    }

    fn take(&self) -> u64 {
        self.asked.swap(0, Ordering::Relaxed)
    }
}

impl<S: Shape> Shape for Counting<S> {
    fn kind(&self) -> &'static str {
        self.shape.kind()
    }
    fn volume(&self) -> f64 {
        self.shape.volume()
    }
    fn inertia_per_mass(&self) -> Vec3 {
        self.shape.inertia_per_mass()
    }
    fn circumradius(&self) -> f64 {
        self.shape.circumradius()
    }
    fn thickness(&self) -> f64 {
        self.shape.thickness()
    }
    fn signed_distance(&self, point: Vec3) -> f64 {
        self.ask().signed_distance(point)
    }
    fn gradient(&self, point: Vec3) -> Vec3 {
        self.ask().gradient(point)
    }
    fn support(&self, direction: Vec3) -> Vec3 {
        self.ask().support(direction)
    }
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        self.shape.row_interval(orientation, y, z, growth)
    }
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        self.shape.surface_mesh(refinement)
    }
}

fn grown(shape: impl Shape + 'static, enlargement: f64) -> GrownShape {
    GrownShape::new(Arc::new(shape), enlargement)
}

fn body(grown: &GrownShape, orientation: Quat) -> Body<'_> {
    Body { grown, orientation }
}

/// Largest errors of sampled spheres against the lens: volume, depth, force `sqrt(V d)`, area, angle of the normals
/// (degrees); and how many distances, gradients and supports were asked for at most.
fn compare_with_lens(radius: f64, deep: f64, enlargement: f64, runs: u32) -> ([f64; 5], u64) {
    let mut random = random(7);
    let counting = Counting::new(Sphere { radius });
    let grown = GrownShape::new(counting.clone(), enlargement);
    let body = body(&grown, Quat::identity());
    let (mut worst, mut asked) = ([0.0_f64; 5], 0);
    for _ in 0..runs {
        let offset = random_direction(&mut random) * (2.0 * (radius + enlargement) - deep);
        let exact = sphere_sphere::overlap(radius + enlargement, radius + enlargement, offset).unwrap();
        counting.take();
        let sampled = overlap(&body, &body, offset, 8).expect("no contact is lost");
        asked = asked.max(counting.take());
        let errors = [
            sampled.volume / exact.volume - 1.0,
            sampled.depth / exact.depth - 1.0,
            (sampled.volume * sampled.depth / (exact.volume * exact.depth)).sqrt() - 1.0,
            sampled.area / exact.area - 1.0,
            sampled.normal.angle(&exact.normal).to_degrees(),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error.abs());
        }
        assert!((sampled.point - exact.point).norm() < 0.05 * (radius * deep).sqrt());
    }
    (worst, asked)
}

#[test]
fn sampled_spheres_agree_with_the_lens_far_better_than_the_reference_code_and_at_a_twentieth_of_its_cost() {
    // Depths in cells, radii of 4.5 and 9 cells. The reference code, measured: force 0.93 +- 0.13 at a depth of 0.02,
    // 1.00 +- 0.015 at 0.8, angles of 1 to 7 degrees, up to a quarter of the contacts unseen, 75 000 distances.
    for (radius, deep) in
        [(4.5, 0.02), (4.5, 0.1), (4.5, 0.8), (9.0, 0.1), (9.0, 0.8), (4.5, 1e-6), (4.5, 4.0)]
    {
        let (worst, asked) = compare_with_lens(radius, deep, 0.2, 60);
        println!("{radius} {deep}: {worst:?}, asked {asked}");
        assert!(worst[0] < 0.02 && worst[1] < 0.005, "{worst:?}");
        assert!(worst[2] < 0.01, "force {worst:?}");
        assert!(worst[3] < 0.03, "area {worst:?}");
        assert!(worst[4] < 0.5, "normal {worst:?}");
        assert!(asked < 3700, "{asked}");
    }
}

/// Interval of a line in an ellipsoid.
fn in_ellipsoid(axes: Vec3, turn: Quat, centre: Vec3) -> impl Fn(Vec3, Vec3) -> Option<(f64, f64)> {
    move |from, along| {
        let scaled = |v: Vec3| turn.inverse_transform_vector(&v).component_div(&axes);
        let (arm, along) = (scaled(from - centre), scaled(along));
        let (a, b, c) = (along.norm_squared(), arm.dot(&along), arm.norm_squared() - 1.0);
        let square = b * b - a * c;
        (square > 0.0).then(|| ((-b - square.sqrt()) / a, (-b + square.sqrt()) / a))
    }
}

#[test]
fn sampled_ellipsoids_agree_with_lines_through_them() {
    let axes = Vec3::new(1.0, 0.6, 0.4);
    let counting = Counting::new(Ellipsoid::new(axes).unwrap());
    let grown = GrownShape::new(counting.clone(), 0.0);
    let mut random = random(11);
    let (mut touching, mut worst, mut most, mut sum) = (0, [0.0_f64; 5], 0, 0);
    while touching < 200 {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * random.random_range(0.7..1.9);
        let inside = [in_ellipsoid(axes, turns[0], Vec3::zeros()), in_ellipsoid(axes, turns[1], offset)];
        counting.take();
        let [first, second] = turns.map(|turn| body(&grown, turn));
        let measured = overlap(&first, &second, offset, 8);
        let asked = counting.take();
        let Some(measured) = measured else {
            assert!(!tests::any(&inside[0], &inside[1], 0.5 * offset, 1.0), "not seen");
            continue;
        };
        if measured.depth > 0.3 {
            continue;
        }
        touching += 1;
        (most, sum) = (most.max(asked), sum + asked);
        let frame = axes_along(measured.normal);
        let truth = tests::lines(&inside[0], &inside[1], &frame, measured.point, 2.0, 96).unwrap();
        let errors = [
            (measured.volume / truth.volume - 1.0).abs(),
            (measured.point - truth.centre).norm() / truth.area.norm().sqrt(),
            measured.normal.angle(&truth.area).to_degrees(),
            (measured.area / truth.area.norm() - 1.0).abs(),
            (measured.moment - truth.moment).norm() / truth.area.norm(),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    println!("off by {worst:?}, asked {most} at most, {} on average", sum / touching);
    assert!(worst[0] < 0.03 && worst[1] < 0.02 && worst[2] < 2.5 && worst[3] < 0.05, "{worst:?}");
    assert!(worst[4] < 0.05, "{worst:?}");
    assert!(most < 3700, "{most}");
}

/// Root mean square errors, against 48 lines per direction by distances alone, of 8 lines: volume, depth, area, normal (radians).
/// First of those of the shape, then of those by distances alone.
fn errors(shape: impl Shape + Clone + 'static, enlargement: f64, pairs: u32) -> [[f64; 4]; 2] {
    let by_distances = GrownShape::new(Counting::new(shape.clone()), enlargement);
    let quick = grown(shape, enlargement);
    let (mut random, mut squares, mut count) = (random(23), [[0.0; 4]; 2], 0);
    while count < pairs {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let offset = random_direction(&mut random) * random.random_range(0.7..1.9);
        let at = |grown, lines| {
            let [first, second] = turns.map(|turn| body(grown, turn));
            overlap(&first, &second, offset, lines)
        };
        let measured = at(&quick, 8);
        let deep = 0.25 * quick.shape.thickness();
        let Some(truth) = measured.filter(|o| o.depth < deep).and_then(|_| at(&by_distances, 48)) else {
            continue;
        };
        count += 1;
        for (squares, found) in squares.iter_mut().zip([measured, at(&by_distances, 8)]) {
            let found = found.expect("they overlap");
            let errors = [
                found.volume / truth.volume - 1.0,
                found.depth / truth.depth - 1.0,
                found.area / truth.area - 1.0,
                found.normal.angle(&truth.normal),
            ];
            for (square, error) in squares.iter_mut().zip(errors) {
                *square += error * error;
            }
        }
    }
    squares.map(|squares| squares.map(|square| (square / f64::from(pairs)).sqrt()))
}

#[test]
fn quick_chords_and_boxes_are_as_good_as_those_by_distances() {
    let axes = Vec3::new(1.0, 0.6, 0.4);
    let (ellipsoid, box_like) =
        (Ellipsoid::new(axes).unwrap(), Superellipsoid::new(axes, [0.5, 0.5]).unwrap());
    let rod = Ellipsoid::new(Vec3::new(1.0, 0.15, 0.15)).unwrap();
    for (name, [quick, slow]) in [
        ("ellipsoid", errors(ellipsoid, 0.0, 60)),
        ("grown ellipsoid", errors(ellipsoid, 0.05, 60)),
        ("grown rod", errors(rod, 0.03, 60)),
        ("much grown rod", errors(rod, 0.1, 60)),
        ("superellipsoid", errors(box_like.clone(), 0.0, 4)),
        ("grown superellipsoid", errors(box_like, 0.05, 4)),
    ] {
        println!("{name}: {quick:?}, by distances {slow:?}");
        assert!(quick[0] < 0.005 && quick[1] < 0.002 && quick[2] < 0.02 && quick[3] < 0.012, "{name}");
    }
}

#[test]
fn the_area_is_minus_the_gradient_of_the_volume_to_a_few_per_cent() {
    let grown = grown(Ellipsoid::new(Vec3::new(1.0, 0.6, 0.4)).unwrap(), 0.05);
    let mut random = random(12);
    for _ in 0..40 {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let [first, second] = turns.map(|turn| body(&grown, turn));
        let offset = random_direction(&mut random);
        let at = |shift: Vec3| overlap(&first, &second, offset + shift, 16);
        let Some(here) = at(Vec3::zeros()) else { continue };
        let step = 0.05 * here.depth;
        let gradient = Vec3::from_fn(|i, _| {
            let volume = |s: f64| at(Vec3::ith(i, s)).map_or(0.0, |o| o.volume);
            (volume(step) - volume(-step)) / (2.0 * step)
        });
        let error = (gradient + here.normal * here.area).norm() / here.area;
        assert!(error < 0.05, "{error}: {here:?}");
    }
}

#[test]
fn a_cube_face_down_on_a_wall_is_a_cuboid() {
    let edge = 1.209;
    let cube = grown(Cuboid::new(Vec3::repeat(edge)).unwrap(), 0.0);
    let mut random = random(13);
    for depth in [1e-5, 0.008, 0.1] {
        let turn = random_turn(&mut random);
        let normal = turn * Vec3::z();
        let wall = Surface::Plane { point: -normal * (0.5 * edge - depth), normal };
        let overlap = contact::overlap_wall(SAMPLED, &body(&cube, turn), &wall).unwrap();
        assert!((overlap.volume / (edge * edge * depth) - 1.0).abs() < 0.01, "{overlap:?}");
        assert!(
            (overlap.depth / depth - 1.0).abs() < 1e-3 && (overlap.area / (edge * edge) - 1.0).abs() < 0.01
        );
        assert!(overlap.normal.angle(&-normal) < 1e-3 && overlap.moment.norm() < 0.01 * edge * edge * edge);
    }
}

#[test]
fn sampled_cubes_and_walls_agree_with_the_exact_ones() {
    let cube = grown(Cuboid::new(Vec3::repeat(1.0)).unwrap(), 0.0);
    let mut random = random(14);
    let (mut squares, mut runs, mut worst) = (0.0, 0.0, 0.0_f64);
    for _ in 0..300 {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let [first, second] = turns.map(|turn| body(&cube, turn));
        let offset = random_direction(&mut random) * random.random_range(0.8..1.5);
        let wall = Surface::Plane { point: offset * 0.5, normal: -offset.normalize() };
        for (exact, sampled) in [
            (
                contact::overlap(Geometry::Exact, &first, &second, offset),
                contact::overlap(SAMPLED, &first, &second, offset),
            ),
            (
                contact::overlap_wall(Geometry::Exact, &first, &wall),
                contact::overlap_wall(SAMPLED, &first, &wall),
            ),
        ] {
            let Some(exact) = exact else {
                assert!(sampled.is_none_or(|o| o.volume < 1e-12), "{sampled:?}");
                continue;
            };
            let Some(sampled) = sampled else {
                assert!(exact.volume < 1e-7, "{exact:?}");
                continue;
            };
            let force = |o: &Overlap| (o.volume * o.depth).sqrt();
            let error = force(&sampled) / force(&exact) - 1.0;
            if exact.depth > 1e-3 {
                worst = worst.max(error.abs());
                assert!(sampled.normal.angle(&exact.normal).to_degrees() < 8.0, "{sampled:?} {exact:?}");
            }
            (squares, runs) = (squares + error * error, runs + 1.0);
        }
    }
    println!("force off by {} in the mean, {worst} at most", f64::sqrt(squares / runs));
    assert!(f64::sqrt(squares / runs) < 0.04, "{}", f64::sqrt(squares / runs));
}

#[test]
fn no_contact_is_lost_however_thin() {
    let mut random = random(15);
    let ellipsoid = |x, y, z, enlargement| grown(Ellipsoid::new(Vec3::new(x, y, z)).unwrap(), enlargement);
    let bodies =
        [ellipsoid(1.0, 0.7, 0.5, 0.0), ellipsoid(1.0, 0.7, 0.5, 0.1), ellipsoid(1.0, 0.2, 0.1, 0.02)];
    for (grown, depth) in bodies.iter().flat_map(|grown| [1e-2, 1e-4, 1e-6, 1e-8].map(|depth| (grown, depth)))
    {
        for _ in 0..30 {
            let turns = [random_turn(&mut random), random_turn(&mut random)];
            let [first, second] = turns.map(|turn| body(grown, turn));
            // Both furthest points along a direction, put on each other and moved together.
            let along = random_direction(&mut random);
            let furthest = |turn: Quat, along: Vec3| {
                turn * grown.shape.support(turn.inverse_transform_vector(&along)) + along * grown.enlargement
            };
            let offset = furthest(turns[0], along) - furthest(turns[1], -along) - along * depth;
            let overlap = overlap(&first, &second, offset, 8).expect("they touch");
            assert!((overlap.depth / depth - 1.0).abs() < 0.2, "{depth} {overlap:?}");
            assert!(
                overlap.normal.angle(&along).to_degrees() < 3.0 + 60.0 * depth.sqrt(),
                "{depth} {overlap:?}"
            );
            let apart = offset + along * (depth * (1.0 + 1e-6) + 1e-13);
            assert!(super::overlap(&first, &second, apart, 8).is_none(), "{depth}");
        }
    }
}

#[test]
fn a_sphere_on_a_wall_makes_a_cap_and_one_below_is_whole() {
    let sphere = grown(Sphere { radius: 1.0 }, 0.1);
    for depth in [1e-8, 1e-4, 0.1, 1.0, 2.0, 2.19, 2.3, 5.0] {
        let normal = Vec3::new(0.48, 0.6, 0.64);
        let wall = Surface::Plane { point: normal * (depth - 1.1), normal };
        let exact = contact::overlap_wall(Geometry::Exact, &body(&sphere, Quat::identity()), &wall).unwrap();
        let sampled = contact::overlap_wall(SAMPLED, &body(&sphere, Quat::identity()), &wall).unwrap();
        assert!((sampled.volume / exact.volume - 1.0).abs() < 0.02, "{depth} {sampled:?} {exact:?}");
        assert!((sampled.depth / exact.depth - 1.0).abs() < 0.01, "{depth} {sampled:?} {exact:?}");
        assert!((sampled.point - exact.point).norm() < 0.03 * exact.depth.sqrt());
        assert!(
            (sampled.area - exact.area).abs() < 0.06 * exact.area + if depth > 2.0 { 0.1 } else { 0.0 },
            "{depth}"
        );
        assert!(sampled.normal.angle(&exact.normal) < 0.01 || exact.area < 0.1);
    }
    let plane = crate::contact::clip::Plane { normal: Vec3::z(), offset: -1.2 };
    assert!(sphere_plane::overlap(1.1, &plane).is_none());
}

#[test]
fn bodies_in_pipes_and_at_rods_overlap_as_points_say() {
    let axis = Vec3::new(0.6, 0.0, 0.8);
    let shapes: [(GrownShape, Quat); 3] = [
        (grown(Sphere { radius: 1.0 }, 0.0), Quat::identity()),
        (grown(Capsule::new(0.5, 1.5).unwrap(), 0.0), random_turn(&mut random(16))),
        (grown(Ellipsoid::new(Vec3::new(1.0, 0.7, 0.5)).unwrap(), 0.0), random_turn(&mut random(17))),
    ];
    for (grown, turn) in &shapes {
        for (pipe, distance) in [(true, 2.0), (true, 2.4), (false, 3.4), (false, 3.0)] {
            // The axis passes at `distance`.
            let across = Vec3::new(0.0, 1.0, 0.0);
            let wall = Surface::Cylinder { point: -across * distance, axis, radius: 2.6, pipe };
            let body = body(grown, *turn);
            let (mut count, mut sum) = (0.0, Vec3::zeros());
            let n = 160;
            let step = 2.6 / f64::from(n);
            for k in 0..n {
                for j in 0..n {
                    for i in 0..n {
                        let at =
                            Vec3::new(f64::from(i), f64::from(j), f64::from(k)) * step - Vec3::repeat(1.3);
                        let inside = grown.shape.signed_distance(turn.inverse_transform_vector(&at)) < 0.0;
                        if inside && wall.distance(at) < 0.0 {
                            count += 1.0;
                            sum += at;
                        }
                    }
                }
            }
            let volume = count * step * step * step;
            match contact::overlap_wall(Geometry::Exact, &body, &wall) {
                Some(overlap) => {
                    let name = grown.shape.kind();
                    assert!(
                        (overlap.volume - volume).abs() < 0.03 * volume + 2e-5,
                        "{name} {distance} {overlap:?} {volume}"
                    );
                    if count > 1000.0 {
                        assert!((overlap.point - sum / count).norm() < 0.03, "{name} {distance}");
                        assert!(
                            overlap.depth > 0.0
                                && overlap.normal.dot(&across) * if pipe { 1.0 } else { -1.0 } > 0.9
                        );
                    }
                }
                None => assert!(volume < 1e-5, "{} {distance}: {volume}", grown.shape.kind()),
            }
        }
    }
}

#[test]
fn a_body_wider_than_its_pipe_is_stuck_on_both_sides() {
    let sphere = grown(Sphere { radius: 1.0 }, 0.0);
    let wall =
        Surface::Cylinder { point: Vec3::new(0.01, 0.0, 0.0), axis: Vec3::z(), radius: 0.9, pipe: true };
    let overlap = contact::overlap_wall(Geometry::Exact, &body(&sphere, Quat::identity()), &wall).unwrap();
    // What a hole of radius 0.9 leaves of a sphere, about.
    let left = 4.0 / 3.0 * std::f64::consts::PI * (1.0_f64 - 0.81).powf(1.5);
    assert!((overlap.volume / left - 1.0).abs() < 0.1, "{overlap:?} {left}");
}

#[test]
fn swapping_the_bodies_turns_the_normal_round_and_changes_no_digit() {
    let shapes = [
        grown(Ellipsoid::new(Vec3::new(1.0, 0.7, 0.5)).unwrap(), 0.02),
        grown(Cylinder::new(0.5, 1.2).unwrap(), 0.0),
    ];
    let mut random = random(18);
    for _ in 0..50 {
        let first = body(&shapes[0], random_turn(&mut random));
        let second = body(&shapes[1], random_turn(&mut random));
        let offset = random_direction(&mut random);
        let (one, other) = (overlap(&first, &second, offset, 8), overlap(&second, &first, -offset, 8));
        let (Some(one), Some(other)) = (one, other) else {
            assert!(one.is_none() && other.is_none());
            continue;
        };
        assert_eq!(one.volume.to_bits(), other.volume.to_bits());
        assert_eq!(one.depth.to_bits(), other.depth.to_bits());
        assert_eq!(one.area.to_bits(), other.area.to_bits());
        assert_eq!(one.normal, -other.normal);
        assert!((one.point - offset - other.point).norm() < 1e-15);
        let moved = other.moment + offset.cross(&other.normal) * other.area;
        assert!((one.moment + moved).norm() < 1e-15);
    }
}

#[test]
fn turning_the_whole_changes_the_view_only() {
    let grown = grown(Ellipsoid::new(Vec3::new(1.0, 0.7, 0.5)).unwrap(), 0.0);
    let mut random = random(19);
    for _ in 0..50 {
        let turns = [random_turn(&mut random), random_turn(&mut random)];
        let (offset, turn) = (random_direction(&mut random) * 1.2, random_turn(&mut random));
        let at = |turn: Quat| {
            let [first, second] = turns.map(|t| body(&grown, turn * t));
            overlap(&first, &second, turn * offset, 8)
        };
        let (Some(one), Some(other)) = (at(Quat::identity()), at(turn)) else {
            continue;
        };
        assert!((one.volume / other.volume - 1.0).abs() < 0.03, "{one:?} {other:?}");
        assert!(
            (turn * one.normal).angle(&other.normal) < if one.depth < 0.2 { 0.03 } else { 0.1 },
            "{one:?} {other:?}"
        );
    }
}

#[test]
fn any_pair_in_any_pose_gives_finite_overlaps_or_none() {
    let shapes = [
        grown(Sphere { radius: 0.6 }, 0.0),
        grown(Ellipsoid::new(Vec3::new(1.0, 0.7, 0.5)).unwrap(), 0.01),
        grown(Cylinder::new(0.5, 1.0).unwrap(), 0.0),
        grown(Capsule::new(0.4, 1.0).unwrap(), 0.0),
        grown(Cuboid::new(Vec3::new(1.0, 0.8, 0.6)).unwrap(), 0.02),
    ];
    let quarter = Quat::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_2);
    for a in &shapes {
        for b in &shapes {
            for turn in [Quat::identity(), quarter, random_turn(&mut random(20))] {
                for offset in [0.0, 1e-300, 1e-9, 0.3, 1.0, 1.2, 1.5] {
                    for direction in [Vec3::x(), Vec3::new(0.6, 0.8, 0.0)] {
                        let (first, second) = (body(a, Quat::identity()), body(b, turn));
                        let found = overlap(&first, &second, direction * offset, 8);
                        let Some(o) = found else { continue };
                        let numbers = [o.volume, o.depth, o.area];
                        let kinds = [a.shape.kind(), b.shape.kind()];
                        assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{kinds:?} {o:?}");
                        assert!(o.point.iter().chain(&o.moment).all(|x| x.is_finite()), "{kinds:?} {o:?}");
                        assert!((o.normal.norm() - 1.0).abs() < 1e-12, "{kinds:?} {o:?}");
                        let least = a.shape.volume().min(b.shape.volume());
                        assert!(o.volume < 1.4 * least + 0.1, "{kinds:?} {o:?}");
                    }
                }
            }
        }
    }
    let sphere = body(&shapes[0], Quat::identity());
    let same = overlap(&sphere, &sphere, Vec3::zeros(), 8).unwrap();
    assert!((same.volume / shapes[0].shape.volume() - 1.0).abs() < 0.05 && same.area < 0.1);
}

#[test]
fn boxy_superellipsoids_flat_on_each_other_overlap_nearly_like_boxes() {
    // The exponents are those of the axes' ratios: 0.2 is nearly a box.
    let grown = grown(Superellipsoid::new(Vec3::new(1.0, 0.7, 0.5), [0.2, 0.2]).unwrap(), 0.0);
    let body = body(&grown, Quat::identity());
    let overlap = overlap(&body, &body, Vec3::new(0.0, 0.0, 0.9), 8).unwrap();
    assert!((overlap.depth - 0.1).abs() < 1e-3 && overlap.normal.angle(&Vec3::z()) < 1e-3);
    let cuboid = 2.0 * 1.4 * 0.1;
    assert!(overlap.volume > 0.7 * cuboid && overlap.volume < cuboid, "{overlap:?}");
}

#[test]
fn more_samples_come_closer_to_the_lens() {
    let shapes = [1.0, 0.6].map(|radius| grown(Sphere { radius }, 0.0));
    let [first, second] = shapes.each_ref().map(|grown| body(grown, Quat::identity()));
    let offset = Vec3::new(0.7, 0.9, -0.5);
    let exact = sphere_sphere::overlap(1.0, 0.6, offset).unwrap();
    let error =
        |samples| (overlap(&first, &second, offset, samples).unwrap().volume / exact.volume - 1.0).abs();
    let errors = [error(4), error(8), error(40)];
    println!("{errors:?}");
    assert!(errors[2] < 1e-3 && errors[2] < 0.3 * errors[0], "{errors:?}");
}

#[test]
fn the_interval_of_a_line_ends_on_the_surface() {
    let bodies = [
        grown(Cylinder::new(0.5, 1.2).unwrap(), 0.1),
        grown(Ellipsoid::new(Vec3::new(0.3, 0.7, 0.5)).unwrap(), 0.0),
        grown(Ellipsoid::new(Vec3::new(0.3, 0.7, 0.5)).unwrap(), 0.1),
        // By far more than its radii of curvature.
        grown(Ellipsoid::new(Vec3::new(0.05, 0.6, 0.5)).unwrap(), 0.2),
        grown(Sphere { radius: 0.5 }, -0.1),
    ];
    let mut random = random(21);
    for grown in bodies {
        let body = body(&grown, random_turn(&mut random));
        let side = Side::body(&body, Vec3::new(0.1, 0.2, 0.3));
        let sphere = in_sphere(grown.reach(), Vec3::new(0.1, 0.2, 0.3));
        let mut met = 0;
        for _ in 0..300 {
            let line =
                Line { from: random_direction(&mut random) * 0.5, along: random_direction(&mut random) };
            match side.intervals(&line, -3.0, 3.0, 1e-12)[0] {
                Some((enter, leave)) => {
                    for t in [enter, leave] {
                        assert!(side.distance(line.at(t)).abs() < 1e-11, "{}", grown.shape.kind());
                    }
                    assert!(enter <= leave && sphere(line.from, line.along).is_some());
                    met += 1;
                }
                None => {
                    for n in -300..=300 {
                        assert!(side.distance(line.at(f64::from(n) * 1e-2)) > -1e-12);
                    }
                }
            }
        }
        assert!(met > 50 && met < 300, "{}: {met}", grown.shape.kind());
    }
}

#[test]
fn lines_enter_and_leave_through_the_body_that_their_whole_chords_say() {
    let shapes = [
        grown(Sphere { radius: 0.5 }, 0.0),
        grown(Ellipsoid::new(Vec3::new(0.3, 0.7, 0.5)).unwrap(), 0.0),
        grown(Ellipsoid::new(Vec3::new(0.7, 0.4, 0.5)).unwrap(), 0.1),
        grown(Ellipsoid::new(Vec3::new(0.3, 0.5, 0.6)).unwrap(), 0.05),
        grown(Superellipsoid::new(Vec3::new(0.9, 0.3, 0.3), [0.4, 0.4]).unwrap(), 0.0),
        grown(Superellipsoid::new(Vec3::new(0.5, 0.4, 0.6), [0.5, 0.8]).unwrap(), 0.05),
    ];
    let mut random = random(23);
    let (mut met, mut cut_off) = (0, 0);
    for [a, b] in (0..shapes.len()).flat_map(|a| (0..shapes.len()).map(move |b| [a, b])) {
        for n in 0..200 {
            // Some as they are, so that faces lie alike.
            let turn = if n < 20 { Quat::identity() } else { random_turn(&mut random) };
            let [first, second] = [body(&shapes[a], turn), body(&shapes[b], Quat::identity())];
            let sides =
                [Side::body(&first, Vec3::zeros()), Side::body(&second, random_direction(&mut random) * 0.5)];
            let line =
                Line { from: random_direction(&mut random) * 0.3, along: random_direction(&mut random) };
            // Chords of ellipsoids are whole, those of others are cut off.
            let is_cut = a >= 2 && b >= 2 && n % 2 == 1;
            let [from, to] = if is_cut { [-0.2, 0.3] } else { [-3.0, 3.0] };
            let whole = chords(&sides, &line, from, to, 1e-10)[0];
            let ends = sides.each_ref().map(|side| side.intervals(&line, from, to, 1e-10)[0]);
            let is_tie = |n: fn((f64, f64)) -> f64| match ends.map(|ends| ends.map(n)) {
                [Some(a), Some(b)] => (a - b).abs() < 1e-8 && a > from + 1e-8 && a < to - 1e-8,
                _ => false,
            };
            if whole.gap.abs() < 1e-8 || is_tie(|ends| ends.0) || is_tie(|ends| ends.1) {
                continue;
            }
            let own = if whole.gap > 0.0 { whole.own } else { 0.0 };
            assert!((own_ends(&sides, &line, from, to, 1e-10) - own).abs() < 0.5, "{a} {b} {n} {ends:?}");
            met += usize::from(own != 0.0);
            cut_off += usize::from(is_cut && whole.gap > 0.0);
        }
    }
    assert!(met > 500 && cut_off > 500, "{met} {cut_off}");
}

/// `cargo test --release -- --ignored --nocapture speed_of_sampled`
#[test]
#[ignore = "prints timings"]
fn speed_of_sampled_pairs() {
    let shapes = [
        grown(Sphere { radius: 0.5 }, 0.0),
        grown(Ellipsoid::new(Vec3::new(0.6, 0.5, 0.4)).unwrap(), 0.0),
        grown(Ellipsoid::new(Vec3::new(0.6, 0.5, 0.4)).unwrap(), 0.02),
        grown(Cylinder::new(0.4, 0.8).unwrap(), 0.0),
        grown(Capsule::new(0.4, 0.4).unwrap(), 0.0),
        grown(Superellipsoid::new(Vec3::new(0.6, 0.5, 0.4), [0.5, 0.5]).unwrap(), 0.0),
        grown(Superellipsoid::new(Vec3::new(0.6, 0.5, 0.4), [0.5, 0.5]).unwrap(), 0.02),
        grown(Cuboid::new(Vec3::repeat(0.8)).unwrap(), 0.0),
    ];
    let mut random = random(22);
    for grown in &shapes {
        let (mut touching, mut near) = (Vec::new(), Vec::new());
        while touching.len() < 100 || near.len() < 100 {
            let turns = [random_turn(&mut random), random_turn(&mut random)];
            let offset = random_direction(&mut random) * random.random_range(0.5..2.0) * grown.reach();
            let [first, second] = turns.map(|turn| body(grown, turn));
            match overlap(&first, &second, offset, 8) {
                Some(o) if o.depth < 0.1 => touching.push((turns, offset)),
                None if offset.norm() < 2.0 * grown.reach() => near.push((turns, offset)),
                _ => {}
            }
            if near.is_empty() && grown.shape.as_sphere().is_some() {
                near.extend(std::iter::repeat_n((turns, Vec3::repeat(2.0)), 100));
            }
        }
        for (what, pairs) in [("touching", touching), ("near miss", near)] {
            // Of each pair the least of ten: other programs run as well.
            let mut time = 0.0;
            for (turns, offset) in &pairs {
                let [first, second] = turns.map(|turn| body(grown, turn));
                let once = |_| {
                    let start = std::time::Instant::now();
                    std::hint::black_box(overlap(&first, &second, *offset, 8));
                    start.elapsed().as_secs_f64()
                };
                time += (0..10).map(once).fold(f64::INFINITY, f64::min) / pairs.len() as f64;
            }
            let start = std::time::Instant::now();
            for n in 0..75 {
                for (_, offset) in &pairs {
                    let at = offset * (0.4 + f64::from(n) * 0.002);
                    std::hint::black_box(grown.shape.signed_distance(at));
                }
            }
            let plain = start.elapsed().as_secs_f64() * 1000.0 / pairs.len() as f64;
            let kind = format!("{} grown by {}", grown.shape.kind(), grown.enlargement);
            println!("{kind}, {what}: {:.1} us, 75000 distances {:.1} us", time * 1e6, plain * 1e6);
        }
    }
}
