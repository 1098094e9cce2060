use super::*;
use crate::contact::clip::Plane;
use crate::contact::tests::{
    self, frame, gradient_error, in_solid, in_sphere, random, random_direction, random_solid, random_turn,
};
use crate::contact::{sphere_plane, sphere_sphere};
use crate::math::Quat;
use crate::shape::Polyhedron;
use rand::Rng;

fn matrix(turn: Quat) -> Mat3 {
    turn.to_rotation_matrix().into_inner()
}

fn cube(edge: f64) -> Solid {
    Solid::new(&Polyhedron::cuboid(Vec3::repeat(edge)), 0.0)
}

#[test]
fn random_pairs_overlap_as_lines_through_them_say() {
    let mut random = random(1);
    let mut touching = 0;
    let mut worst = [0.0_f64; 4];
    while touching < 300 {
        let cuts = random.random_range(0..12);
        let solid = random_solid(&mut random, cuts, 0.0);
        let radius = random.random_range(0.1..1.5);
        let turn = random_turn(&mut random);
        let offset = random_direction(&mut random) * random.random_range(0.0..radius + 0.7);
        let first = in_sphere(radius, Vec3::zeros());
        let second = in_solid(&solid, matrix(turn), offset);
        let Some(overlap) = overlap(radius, &solid, &matrix(turn), offset) else {
            assert!(!tests::any(&first, &second, offset, 1.0));
            continue;
        };
        if overlap.volume < 1e-7 {
            continue;
        }
        touching += 1;
        let truth = tests::lines(&first, &second, &frame(overlap.normal), overlap.point, 3.0, 128).unwrap();
        let size = truth.volume.cbrt();
        let area = overlap.normal * overlap.area;
        let errors = [
            (overlap.volume / truth.volume - 1.0).abs(),
            (overlap.point - truth.centre).norm() / size,
            (area - truth.area).norm() / (overlap.area + size * size),
            truth.moment.norm() / (radius * (overlap.area + size * size)),
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    println!("volume, centre, area, moment off by {worst:?}");
    assert!(worst[0] < 3e-3 && worst[1] < 3e-3 && worst[2] < 5e-3 && worst[3] < 1e-2, "{worst:?}");
}

/// Volume and first moment of the ball of radius `r` about the origin in the box from `lo` to `hi`: areas of slices in
/// closed form, Gauss-Legendre over many slices.
fn sliced(radius: f64, lo: Vec3, hi: Vec3) -> (f64, f64) {
    // Area of the disc of radius `q` in the quadrant `x < a, y < b`.
    fn corner(q: f64, a: f64, b: f64) -> f64 {
        // Integral of the part of [-inf, b] over x from -q to a.
        let (a, b) = (a.clamp(-q, q), b.clamp(-q, q));
        let primitive =
            |x: f64| 0.5 * (x * (q * q - x * x).max(0.0).sqrt() + q * q * (x / q).clamp(-1.0, 1.0).asin());
        let half = (q * q - b * b).max(0.0).sqrt();
        let full = |x: f64| primitive(x) - primitive(-q);
        // For |x| <= half the column ends at b, else at the circle (or there is none, if b < 0).
        let outer = if b >= 0.0 { 2.0 } else { 0.0 };
        let mut area = outer * full(a.min(-half));
        if a > -half {
            let end = a.min(half);
            area += b * (end + half) + primitive(end) - primitive(-half);
        }
        if a > half {
            area += outer * (full(a) - full(half));
        }
        area
    }
    let slice = |z: f64| {
        let q = (radius * radius - z * z).max(0.0).sqrt();
        if q == 0.0 {
            return 0.0;
        }
        corner(q, hi.x, hi.y) - corner(q, lo.x, hi.y) - corner(q, hi.x, lo.y) + corner(q, lo.x, lo.y)
    };
    // The tips are smooth in the angle whose sine is z / R.
    let (from, to) = ((lo.z / radius).clamp(-1.0, 1.0).asin(), (hi.z / radius).clamp(-1.0, 1.0).asin());
    let n = 20000;
    let step = (to - from) / f64::from(n);
    (0..n).fold((0.0, 0.0), |(volume, first), i| {
        let middle = from + (f64::from(i) + 0.5) * step;
        let node = 0.5 * step / 3.0_f64.sqrt();
        [middle - node, middle + node].iter().fold((volume, first), |(v, f), t| {
            let z = radius * t.sin();
            let part = slice(z) * radius * t.cos() * 0.5 * step;
            (v + part, f + part * z)
        })
    })
}

#[test]
fn a_sphere_in_a_cuboid_agrees_with_its_slices_to_ten_digits() {
    let mut random = random(2);
    for edges in [Vec3::new(1.0, 1.0, 1.0), Vec3::new(0.3, 1.0, 2.0)] {
        let solid = Solid::new(&Polyhedron::cuboid(edges), 0.0);
        for _ in 0..40 {
            let centre = Vec3::from_fn(|_, _| random.random_range(-0.9..0.9));
            let radius = random.random_range(0.2..1.2);
            let exact = sliced(radius, -0.5 * edges - centre, 0.5 * edges - centre);
            match overlap(radius, &solid, &Mat3::identity(), -centre) {
                Some(overlap) => {
                    let error = (overlap.volume - exact.0).abs();
                    assert!(error < 3e-9 * exact.0.max(0.01), "{} {exact:?}", overlap.volume);
                    assert!((overlap.point.z * overlap.volume - exact.1).abs() < 3e-9);
                }
                None => assert!(exact.0 < 1e-12, "{exact:?}"),
            }
        }
    }
}

#[test]
fn area_and_moment_are_minus_the_gradient_of_the_volume() {
    let mut random = random(3);
    let mut touching = 0;
    while touching < 200 {
        let solid = random_solid(&mut random, 6, 0.0);
        let turn = random_turn(&mut random);
        let radius = random.random_range(0.2..1.0);
        let offset = random_direction(&mut random) * random.random_range(0.3..radius + 0.6);
        for reversed in [false, true] {
            let at = |turn: Quat, offset: Vec3| {
                if reversed {
                    overlap(radius, &solid, &matrix(turn), -offset).map(|o| o.reversed(offset))
                } else {
                    overlap(radius, &solid, &matrix(turn), offset)
                }
            };
            let Some(overlap) = at(turn, offset) else { continue };
            touching += 1;
            // Turning the second about the first: the reversed pair sees the sphere go round and nothing turn.
            let volume = |shift: Vec3, more: Quat| {
                let turned = if reversed { turn } else { more * turn };
                at(turned, more * offset + shift).map_or(0.0, |o| o.volume)
            };
            let error = gradient_error(&overlap, volume, 1e-5, 1.0);
            assert!(error < 1e-4, "{error} at {overlap:?}");
        }
    }
}

#[test]
fn the_order_of_the_bodies_only_turns_the_normal_round() {
    let solid = cube(1.0);
    let turn = matrix(random_turn(&mut random(4)));
    let offset = Vec3::new(0.5, 0.4, 0.6);
    let one = overlap(0.5, &solid, &turn, offset).unwrap();
    let other = overlap(0.5, &solid, &turn, offset).unwrap().reversed(-offset);
    assert!((one.normal + other.normal).norm() < 1e-15 && (one.area - other.area).abs() < 1e-15);
    assert!((one.point - offset - other.point).norm() < 1e-15);
    // About the centre of the sphere the other moment vanishes, too.
    assert!((other.moment + offset.cross(&other.normal) * other.area).norm() < 1e-15);
}

#[test]
fn a_sphere_on_a_large_face_makes_a_cap_at_any_depth() {
    let solid = cube(10.0);
    for depth in [1e-9, 1e-6, 1e-3, 0.3, 0.999, 1.0, 1.2, 1.9] {
        let height = 1.0 - depth;
        let centre = Vec3::new(0.7, -0.4, 5.0 + height);
        let overlap = overlap(1.0, &solid, &Mat3::identity(), -centre).unwrap();
        let cap = sphere_plane::overlap(1.0, &Plane { normal: Vec3::z(), offset: -height }).unwrap();
        let tolerance = 1e-7_f64.max(1e-14 / depth);
        assert!((overlap.volume / cap.volume - 1.0).abs() < tolerance, "{depth}");
        assert!((overlap.depth / cap.depth - 1.0).abs() < tolerance, "{depth}");
        assert!((overlap.area / cap.area - 1.0).abs() < tolerance, "{depth}");
        assert!(
            (overlap.point - cap.point).norm() < tolerance
                && (overlap.normal - cap.normal).norm() < tolerance
        );
    }
}

#[test]
fn a_sphere_over_an_edge_or_a_corner_is_no_trouble() {
    let solid = cube(1.0);
    let volume = |centre: Vec3| overlap(0.4, &solid, &Mat3::identity(), -centre).map_or(0.0, |o| o.volume);
    // Quarter and eighth of a ball, half a ball at a face; and the foot on an edge or at a corner.
    let ball = 4.0 / 3.0 * PI * 0.4_f64.powi(3);
    assert!((volume(Vec3::new(0.5, 0.0, 0.0)) / ball - 0.5).abs() < 1e-6);
    assert!((volume(Vec3::new(0.5, 0.5, 0.0)) / ball - 0.25).abs() < 1e-6);
    assert!((volume(Vec3::repeat(0.5)) / ball - 0.125).abs() < 1e-6);
    for height in [0.8, 0.6, 0.5 + 1e-6, 0.5, 0.5 - 1e-6, 0.3] {
        let cap = volume(Vec3::new(0.0, 0.0, height));
        for (x, y, part) in [(0.5, 0.0, 0.5), (0.5, 0.5, 0.25), (-0.5, 0.0, 0.5)] {
            for shift in [0.0, 1e-18, 1e-16, -1e-16, 1e-13, 1e-9, -1e-9] {
                let cut = volume(Vec3::new(x + shift, y - shift, height));
                assert!((cut / (part * cap) - 1.0).abs() < 2e-6, "{height} {x} {y} {shift}: {cut} {cap}");
            }
        }
    }
}

#[test]
fn bodies_inside_of_each_other_are_the_overlap_themselves() {
    let solid = cube(1.0);
    let ball = overlap(0.3, &solid, &Mat3::identity(), Vec3::new(0.1, 0.0, 0.05)).unwrap();
    assert!((ball.volume - 4.0 / 3.0 * PI * 0.027).abs() < 1e-14 && (ball.depth - 0.6).abs() < 1e-14);
    assert!(ball.point.norm() < 1e-14 && ball.area < 1e-14);
    for offset in [Vec3::zeros(), Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.2, 0.0, 0.0)] {
        let whole = overlap(3.0, &solid, &Mat3::identity(), offset).unwrap();
        assert!((whole.volume - 1.0).abs() < 1e-12, "{}", whole.volume);
        assert!((whole.point - offset).norm() < 1e-11 && whole.area < 1e-13);
        assert!(whole.depth.is_finite() && (whole.normal.norm() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn the_volume_is_continuous_while_the_centre_passes_through_the_surface() {
    let mut random = random(5);
    let solid = random_solid(&mut random, 5, 0.0);
    for _ in 0..20 {
        let (from, along) = (0.3 * random_direction(&mut random), random_direction(&mut random));
        let mut last = None;
        for n in 0..2000 {
            let centre = from + along * (f64::from(n) * 1e-3);
            let now = overlap(0.5, &solid, &Mat3::identity(), -centre).map_or(0.0, |o| o.volume);
            let step: f64 = now - last.unwrap_or(now);
            assert!(step.abs() < PI * 0.25 * 1e-3 * 1.001, "{step}");
            last = Some(now);
        }
    }
}

#[test]
fn a_polyhedron_that_comes_close_to_a_sphere_gives_nearly_a_lens() {
    use crate::shape::{Shape, Sphere};
    let offset = Vec3::new(0.9, 1.2, 0.8);
    let exact = sphere_sphere::overlap(1.0, 1.0, offset).unwrap();
    let mut last = f64::INFINITY;
    for refinement in [1, 2, 3] {
        let mesh = Sphere { radius: 1.0 }.surface_mesh(refinement);
        let planes: Vec<Plane> =
            mesh.points.iter().map(|p| Plane { normal: p.normalize(), offset: 1.0 }).collect();
        let solid = Solid::from_planes(planes, 1.5, 0.0);
        let overlap = overlap(1.0, &solid, &Mat3::identity(), offset).unwrap();
        let error = (overlap.volume / exact.volume - 1.0).abs();
        assert!(error < 0.4 * last, "{error} after {last}");
        last = error;
    }
}

/// `cargo test --release -- --ignored --nocapture speed_of_a_sphere`
#[test]
#[ignore = "prints timings"]
fn speed_of_a_sphere_at_a_cube() {
    let (mut random, solid) = (random(6), cube(0.8));
    let pairs: Vec<_> = std::iter::repeat_with(|| {
        (matrix(random_turn(&mut random)), random_direction(&mut random) * random.random_range(0.85..1.1))
    })
    .filter(|(turn, offset)| overlap(0.5, &solid, turn, *offset).is_some_and(|o| o.depth < 0.1))
    .take(1000)
    .collect();
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = std::time::Instant::now();
        for (turn, offset) in &pairs {
            std::hint::black_box(overlap(0.5, &solid, turn, *offset));
        }
        best = best.min(start.elapsed().as_secs_f64() / pairs.len() as f64);
    }
    println!("sphere-cube, touching: {:.0} ns", best * 1e9);
}
