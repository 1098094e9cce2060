//! Claims about the films of fluid.

use super::*;
use crate::contact::nearest::Ellipsoidal;
use crate::contact::tests::{random, random_direction, random_turn};
use crate::math::Quat;
use crate::math::nalgebra::{Matrix2, Matrix3x2, Vector2};
use crate::shape::Polyhedron;
use crate::wall::Surface;
use rand::Rng;

const VISCOSITY: f64 = 0.7;

/// Everything singular is missing, and all logarithms are `log`.
fn everything(cell: f64, gap: f64, log: f64) -> Lubrication {
    let tangential = [Tangential::plain([libm::expm1(log) * gap / cell; 2]); 2];
    let unresolved =
        Unresolved { range: 1e9, linear: [0.0; 2], curved: 0.0, square: 0.0, bulging: 0.0, tangential };
    Lubrication { viscosity: VISCOSITY, roughness: 0.0, cell, unresolved }
}

/// The film of two spheres, or of one at a wall.
fn film(lubrication: &Lubrication, radii: [f64; 2], normal: Vec3, gap: f64) -> Film {
    let partner = if radii[1].is_infinite() { Partner::Wall } else { Partner::Body };
    let mean = radii.map(|radius| 1.0 / radius).iter().sum();
    lubrication.film(&Gap::of_spheres(radii, normal, gap), mean, partner).unwrap()
}

fn side(velocity: Vec3, spin: Vec3) -> Side {
    Side { velocity, spin, rates: [0.0; 2] }
}

fn resistance(film: &Film) -> f64 {
    film.0.iter().map(|term| term.resistance).fold(0.0, f64::max)
}

#[test]
fn the_singular_resistances_of_two_spheres_are_those_of_jeffrey_and_onishi_for_any_ratio_of_radii() {
    let (a, gap, log) = (1.3, 1e-9, 4.0);
    let (along, across, turning) = (Vec3::z(), Vec3::x(), Vec3::y());
    let still = side(Vec3::zeros(), Vec3::zeros());
    for l in [0.2, 0.5, 1.0, 3.0, 10.0_f64] {
        let film = film(&everything(0.1, gap, log), [a, l * a], along, gap);
        let act = |first: &Side| film.act([first, &still], 0.0);
        let same = |value: f64, expected: f64| {
            assert!((value / expected - 1.0).abs() < 1e-7, "{value} {expected}");
        };
        let m = PI * VISCOSITY * a;
        // Squeezing: X^A, of which the gap is measured in means of the radii.
        let squeezed = act(&side(along, Vec3::zeros()));
        let x = 2.0 * l * l / (1.0 + l).powi(3) * (0.5 * (1.0 + l) * a / gap);
        same(squeezed.force.z, -6.0 * m * x);
        assert!(squeezed.torques == [Vec3::zeros(); 2]);
        // A velocity across the line of centres: Y^A and Y^B.
        let sheared = act(&side(across, Vec3::zeros()));
        let (y_a, y_b) = (
            4.0 * l * (2.0 + l + 2.0 * l * l) / (15.0 * (1.0 + l).powi(3)),
            l * (4.0 + l) / (5.0 * (1.0 + l).powi(2)),
        );
        same(sheared.force.x, -6.0 * m * y_a * log);
        same(sheared.torques[0].y, -4.0 * m * a * y_b * log);
        // A spin: Y^B again, by reciprocity, and Y^C of both spheres.
        let spun = act(&side(Vec3::zeros(), turning));
        same(spun.force.x, -4.0 * m * a * y_b * log);
        same(spun.torques[0].y, -8.0 * m * a * a * 2.0 * l / (5.0 * (1.0 + l)) * log);
        same(spun.torques[1].y, -8.0 * m * a * a * l * l / (10.0 * (1.0 + l)) * log);
    }
}

#[test]
fn the_singular_resistances_at_a_wall_are_those_of_goldman_cox_and_brenner() {
    let (a, gap, log) = (1.3, 1e-9, 4.0);
    let film = film(&everything(0.1, gap, log), [a, f64::INFINITY], -Vec3::z(), gap);
    let still = side(Vec3::zeros(), Vec3::zeros());
    let act = |first: &Side| film.act([first, &still], 0.0);
    let same =
        |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-7, "{value} {expected}");
    let m = PI * VISCOSITY * a;
    same(act(&side(-Vec3::z(), Vec3::zeros())).force.z, 6.0 * m * a / gap);
    let (moved, spun) = (act(&side(Vec3::x(), Vec3::zeros())), act(&side(Vec3::zeros(), Vec3::y())));
    same(moved.force.x, -6.0 * m * 8.0 / 15.0 * log);
    same(moved.torques[0].y, 8.0 * m * a * 0.1 * log);
    same(spun.force.x, 6.0 * m * a * 2.0 / 15.0 * log);
    same(spun.torques[0].y, -8.0 * m * a * a * 0.4 * log);
}

#[test]
fn surfaces_of_any_curvature_that_slide_and_roll_dissipate_what_the_lubrication_equation_says() {
    // In the frame of the gap the surfaces move along themselves, at q_1 and q_2: div(H^3 grad p) = 6 mu (q_1 + q_2).grad H.
    // Dissipation: mu (q_1 - q_2)^2 / H + H^3 (grad p)^2 / (12 mu), of which the logarithm comes from where H = x.K x / 2.
    let mut random = random(12);
    for _ in 0..20 {
        let [first, second] = [0; 2].map(|_| {
            let (sin, cos) = random.random_range(0.0..3.0_f64).sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let [k, l] = [0; 2].map(|_| random.random_range(0.4..1.5));
            turn * Matrix2::new(k, 0.0, 0.0, l) * turn.transpose()
        });
        let sum = first + second;
        let mut pick = || Vector2::from_fn(|_, _| random.random_range(-1.0..1.0_f64));
        // Velocities of the surfaces at the nearest points, and rates at which their normals tilt.
        let (velocities, tilts) = ([pick(), pick()], [pick(), pick()]);
        let moved = first * velocities[0] + second * velocities[1] - (tilts[0] - tilts[1]);
        let frame = sum.try_inverse().unwrap() * moved;
        let [one, other] = velocities.map(|velocity| velocity - frame);
        let matrix = sum + Matrix2::from_diagonal_element(2.0 * sum.trace());
        let d = matrix.try_inverse().unwrap() * sum * (one + other) * 6.0;
        // Of p = -d.x / H^2.
        let flow = |x: Vector2<f64>, gap: f64| {
            let height = gap + 0.5 * x.dot(&(sum * x));
            (sum * x * (2.0 * d.dot(&x) / height) - d) * height
        };
        let (x, step) = (pick(), 1e-5);
        let divergence: f64 = (0..2)
            .map(|i| {
                let aside = Vector2::ith(i, step);
                (flow(x + aside, 1.0)[i] - flow(x - aside, 1.0)[i]) / (2.0 * step)
            })
            .sum();
        assert!((divergence - 6.0 * (one + other).dot(&(sum * x))).abs() < 1e-8, "{divergence}");
        let angles = (0..360).map(|k| (f64::from(k) * PI / 180.0).sin_cos());
        let around = angles.map(|(sin, cos)| {
            let x = Vector2::new(cos, sin);
            let height = 0.5 * x.dot(&(sum * x));
            (one - other).norm_squared() / height + flow(x, 0.0).norm_squared() / (12.0 * height.powi(3))
        });
        // int dr / r = ln(1 / h) / 2.
        let expected = VISCOSITY * 0.5 * around.sum::<f64>() * PI / 180.0;

        let (width, normal) = (1e-9, Vec3::z());
        let across = Matrix3x2::from_columns(&[Vec3::x(), Vec3::y()]);
        let place = (width, normal, [normal * (-0.5 * width), normal * (0.5 * width)]);
        let gap = Gap::new(place, &across, [first.try_inverse(), second.try_inverse()]).unwrap();
        let film = everything(0.1, width, 1.0).film(&gap, 0.0, Partner::Body).unwrap();
        let at = |flat: Vector2<f64>| across * flat;
        // A normal tilts at omega x n.
        let sides = [0, 1].map(|k| side(at(velocities[k]), normal.cross(&at(tilts[k]))));
        let Action { force, torques } = film.act([&sides[0], &sides[1]], 0.0);
        let power = force.dot(&(sides[0].velocity - sides[1].velocity))
            + torques[0].dot(&sides[0].spin)
            + torques[1].dot(&sides[1].spin);
        assert!((-power / expected - 1.0).abs() < 1e-6, "{power} {expected}");
    }
}

#[test]
fn two_spheres_that_move_like_one_rigid_body_feel_nothing_and_any_other_motion_costs_energy() {
    let mut random = random(8);
    for _ in 0..2000 {
        let radii = [random.random_range(0.1..3.0), random.random_range(0.1..3.0)];
        let gap = random.random_range(1e-3..0.1);
        let normal = random_direction(&mut random);
        let film = film(&everything(0.05, gap, random.random_range(0.1..5.0)), radii, normal, gap);
        let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
        let offset = normal * (radii[0] + radii[1] + gap);
        let rigid = [side(u, spin), side(u + spin.cross(&offset), spin)];
        let felt = film.act([&rigid[0], &rigid[1]], 0.0);
        let scale = VISCOSITY * 400.0 / gap;
        assert!(felt.force.norm() < 1e-12 * scale && felt.torques.iter().all(|t| t.norm() < 1e-12 * scale));

        let sides = [side(u, spin), side(v, other)];
        let Action { force, torques } = film.act([&sides[0], &sides[1]], 0.0);
        assert!(force.dot(&(u - v)) + torques[0].dot(&spin) + torques[1].dot(&other) < 0.0);
        // Forces are opposite; so their moment is that of the force on the second.
        let moment = torques[0] + torques[1] - offset.cross(&force);
        assert!(moment.norm() < 1e-12 * scale, "{moment}");
    }
}

#[test]
fn films_at_walls_are_symmetric_and_any_motion_costs_energy_for_all_relaxation_times_and_gaps() {
    let kinds = [0.53, 0.65, 0.8, 1.0].map(|time| [Unresolved::homogenised(time), Unresolved::saturated()]);
    for unresolved in kinds.into_iter().flatten() {
        let lubrication = Lubrication { viscosity: VISCOSITY, roughness: 1e-4, cell: 0.1, unresolved };
        for gap in [1e-5, 1e-3, 0.01, 0.03, 0.05, 0.1, 0.15, 0.2, 0.25] {
            if gap >= lubrication.range() {
                continue;
            }
            let film = film(&lubrication, [0.5, f64::INFINITY], -Vec3::z(), gap);
            let still = side(Vec3::zeros(), Vec3::zeros());
            let act = |velocity: f64, spin: f64| {
                let first = side(Vec3::x() * velocity, Vec3::y() * spin);
                let Action { force, torques } = film.act([&first, &still], 0.0);
                [-force.x, -torques[0].y]
            };
            let ([a, b], [c, d]) = (act(1.0, 0.0), act(0.0, 1.0));
            assert!((b - c).abs() < 1e-12 * (a * d).sqrt(), "{gap}: {b} {c}");
            assert!(a >= 0.0 && d >= 0.0 && a * d - b * c > -1e-12 * a * d, "{gap}: {a} {b} {d}");
        }
    }
}

#[test]
fn ellipsoids_with_equal_axes_have_the_film_of_spheres() {
    let mut random = random(9);
    for _ in 0..200 {
        let [a, b, width] = [0.5..2.0, 0.5..2.0, 1e-3..0.1].map(|range| random.random_range(range));
        let lubrication = Lubrication {
            viscosity: VISCOSITY,
            roughness: 1e-4,
            cell: 0.1,
            unresolved: Unresolved::saturated(),
        };
        let bodies = [a, b].map(|r: f64| Ellipsoidal::new(Vec3::repeat(r), &random_turn(&mut random)));
        let normal = random_direction(&mut random);
        let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
        let wall = Surface::Plane { point: normal * (a + width), normal: -normal };
        let cases = [
            ([a, b], bodies[0].gap(&bodies[1], normal * (a + b + width), 1.0), Partner::Body),
            ([a, f64::INFINITY], bodies[0].gap_to_wall(&wall, 1.0), Partner::Wall),
        ];
        for (radii, gap, partner) in cases {
            let still = side(Vec3::zeros(), Vec3::zeros());
            let sides = [side(u, spin), if partner == Partner::Wall { still } else { side(v, other) }];
            let mean = radii.map(|radius| 1.0 / radius).iter().sum();
            let act = |film: Film| film.act([&sides[0], &sides[1]], 0.0);
            let sphere = act(film(&lubrication, radii, normal, width));
            let local = act(lubrication.film(&gap.unwrap(), mean, partner).unwrap());
            let scale = sphere.force.norm().max(1e-3 / width);
            // The gap is a difference of lengths.
            let rounding = 1e-13 / width * scale;
            assert!((local.force - sphere.force).norm() < rounding);
            let count = if partner == Partner::Wall { 1 } else { 2 };
            for k in 0..count {
                assert!((local.torques[k] - sphere.torques[k]).norm() < rounding);
            }
        }
    }
}

#[test]
fn two_ellipsoids_that_move_like_one_rigid_body_feel_nothing_and_any_other_motion_keeps_momenta_and_costs_energy()
 {
    let mut random = random(10);
    let lubrication = everything(0.05, 0.05, 1.0);
    let mut found = 0;
    for _ in 0..2000 {
        let [first, second] = [0; 2].map(|_| {
            let axes = Vec3::from_fn(|_, _| random.random_range(0.3..1.5));
            Ellipsoidal::new(axes, &random_turn(&mut random))
        });
        let offset = random_direction(&mut random) * 2.0;
        let Some(gap) = first.gap(&second, offset, 1.0) else { continue };
        found += 1;
        let film = lubrication.film(&gap, 1.0, Partner::Body).unwrap();
        let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
        let rigid = [side(u, spin), side(u + spin.cross(&offset), spin)];
        let felt = film.act([&rigid[0], &rigid[1]], 0.0);
        let scale = 1e-11 * resistance(&film);
        assert!(felt.force.norm() < scale && felt.torques.iter().all(|t| t.norm() < scale));
        let sides = [side(u, spin), side(v, other)];
        let Action { force, torques } = film.act([&sides[0], &sides[1]], 0.0);
        assert!(force.dot(&(u - v)) + torques[0].dot(&spin) + torques[1].dot(&other) < 0.0);
        assert!((torques[0] + torques[1] - offset.cross(&force)).norm() < scale);
        let flipped = lubrication.film(&gap.flipped(), 1.0, Partner::Body).unwrap();
        let back = flipped.act([&sides[1], &sides[0]], 0.0);
        assert!((back.force + force).norm() < scale && (back.torques[0] - torques[1]).norm() < scale);
    }
    assert!(found > 300, "{found}");
}

#[test]
fn one_film_brings_two_bodies_no_further_than_to_rest_relative_to_each_other_however_long_the_sub_step() {
    let mut random = random(11);
    let mut found = 0;
    for _ in 0..500 {
        let [first, second] = [0; 2].map(|_| {
            let axes = Vec3::from_fn(|_, _| random.random_range(0.3..1.5));
            Ellipsoidal::new(axes, &random_turn(&mut random))
        });
        let Some(gap) = first.gap(&second, random_direction(&mut random) * 2.0, 1.0) else { continue };
        found += 1;
        let film = everything(0.05, 0.05, 1.0).film(&gap, 1.0, Partner::Body).unwrap();
        let bodies = [0; 2].map(|_| {
            let turn = random_turn(&mut random).to_rotation_matrix().into_inner();
            let moments = Vec3::from_fn(|_, _| random.random_range(0.5..5.0));
            let inertia = turn * Mat3::from_diagonal(&moments) * turn.transpose();
            Mobility { mass: random.random_range(0.2..2.0), inertia }
        });
        let rates = film.rates(bodies.each_ref());
        let sides: [Side; 2] = std::array::from_fn(|k| {
            let [velocity, spin] = [0; 2].map(|_| random_direction(&mut random));
            Side { velocity, spin, rates: rates[k] }
        });
        let dt = 10.0_f64.powf(random.random_range(-4.0..6.0));
        let Action { force, torques } = film.act([&sides[0], &sides[1]], dt);
        let energy = |push: f64| -> f64 {
            let of = |k: usize| {
                let (body, sign) = (bodies[k], if k == 0 { push } else { -push });
                let velocity = sides[k].velocity + force * (sign * body.mass);
                let spin = sides[k].spin + body.inertia * torques[k] * push.abs();
                let moment = body.inertia.try_inverse().unwrap() * spin;
                velocity.norm_squared() / body.mass + spin.dot(&moment)
            };
            of(0) + of(1)
        };
        assert!(energy(dt) <= energy(0.0) * (1.0 + 1e-12), "{dt}");
    }
    assert!(found > 80, "{found}");
}

#[test]
fn a_sphere_at_a_face_has_the_film_of_a_flat_body_and_none_beyond_the_rim_which_it_reaches_without_a_step() {
    let cube = Polyhedron::cuboid(Vec3::repeat(2.0));
    let (turn, width) = (random_turn(&mut random(13)), 0.02);
    let ball = Ellipsoidal::new(Vec3::repeat(0.5), &Quat::identity());
    let gap = |x: f64| {
        let centre = turn * Vec3::new(x, 0.1, 1.5 + width);
        ball.gap_to_face((&cube, &turn), -centre, 0.3)
    };
    let middle = gap(0.0).unwrap();
    assert!((middle.width - width).abs() < 1e-12 && (middle.normal + turn * Vec3::z()).norm() < 1e-12);
    assert!((middle.points[1] - turn * Vec3::new(0.0, 0.1, 1.0)).norm() < 1e-12);
    let spheres = Gap::of_spheres([0.5, f64::INFINITY], middle.normal, width);
    assert!((middle.reduced() / spheres.reduced() - 1.0).abs() < 1e-12);
    assert!((middle.difference[0][0] + 1.0).abs() < 1e-12 && middle.difference[0][1].abs() < 1e-12);
    // d / sqrt(d^2 + 2 R h).
    for (x, part) in [(0.0, 0.9 / 0.83_f64.sqrt()), (0.9, 0.1 / 0.03_f64.sqrt()), (0.9999, 7.07e-4)] {
        let found = gap(x).unwrap().part;
        assert!((found / part - 1.0).abs() < 1e-3, "{x}: {found} {part}");
    }
    assert!(gap(1.0001).is_none() && gap(-1.2).is_none());
}

#[test]
fn the_force_ends_without_a_step_at_the_range_and_stays_the_same_below_the_roughness() {
    let unresolved = Unresolved::saturated();
    let lubrication = Lubrication { viscosity: 1.0, roughness: 1e-3, cell: 0.1, unresolved };
    let squeezing = |gap: f64| {
        let gap = Gap::of_spheres([1.0, 2.0], Vec3::z(), gap);
        lubrication.film(&gap, 1.5, Partner::Body).map_or(0.0, |film| film.0[0].resistance)
    };
    assert!(squeezing(0.3001) == 0.0 && squeezing(-1e-9) == 0.0 && squeezing(f64::NAN) == 0.0);
    assert!(squeezing(0.2999) < 1e-3 * squeezing(0.1));
    assert_eq!(squeezing(1e-9).to_bits(), squeezing(1e-3).to_bits());
    assert!(squeezing(1e-3) > 1.5 * squeezing(2e-3));
}
