//! Claims about spheres and walls.

use super::*;
use crate::contact::{ContactParams, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use crate::shape::Sphere;
use crate::wall::{Motion, Surface};

pub(super) const MATERIAL: ContactParams = ContactParams {
    material: Material { youngs_modulus: 1e7, poisson_ratio: 0.25 },
    pair: PairParams {
        restitution: 0.8,
        friction_static: 0.32,
        friction_kinetic: 0.16,
        transition_velocity: 1e-3,
        rolling_friction: 0.0,
        work_of_adhesion: 0.0,
        cohesion_density: 0.0,
    },
    enlargement: 0.0,
    geometry: Geometry::Exact,
    law: ElasticLaw::OverlapVolume,
    damping: DampingLaw::HuntCrossley,
};

/// Closed in z, 12 mm wide.
pub(super) const TANK: Domain =
    Domain { faces: Domain::faces([true, true, false]), cells: [12, 12, 12], dx: 1e-3 };
pub(super) const RADIUS: f64 = 1e-3;
const DENSITY: f64 = 2500.0;
pub(super) const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

fn contact(pair: PairParams) -> ContactModel {
    ContactParams { pair, ..MATERIAL }.into()
}

/// The part of space behind a plane.
pub(super) fn plane(name: &str, point: Vec3, normal: Vec3) -> Wall {
    Wall {
        name: name.into(),
        surface: Surface::Plane { point, normal: normal.normalize() },
        motion: Motion::default(),
        material: 0,
    }
}

pub(super) fn floor() -> Wall {
    plane("z-", Vec3::zeros(), Vec3::z())
}

fn spheres() -> Arc<[Template]> {
    [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: DENSITY, material: 0 }].into()
}

pub(super) fn mass() -> f64 {
    spheres()[0].mass()
}

/// One engine on one rank.
pub(super) fn alone(
    domain: Domain,
    contact: ContactModel,
    walls: Vec<Wall>,
    gravity: Vec3,
    templates: Arc<[Template]>,
    all: &[Particle],
) -> Native {
    let params =
        NativeParams { contact: Some(contact), walls, gravity, substeps: 1, ..NativeParams::default() };
    let cut = Decomposition::new(domain, 1).unwrap();
    Native::new(params, cut, 0, templates, all).unwrap()
}

pub(super) fn engine(pair: PairParams, walls: Vec<Wall>, gravity: Vec3, all: &[Particle]) -> Native {
    alone(TANK, contact(pair), walls, gravity, spheres(), all)
}

/// Advances by some steps with no loads.
pub(super) fn run(engine: &mut Native, steps: usize, dt: f64) {
    for _ in 0..steps {
        let loads = vec![Load::default(); engine.particles().owned];
        engine.advance(&Comm::Solo, &loads, dt).unwrap();
    }
}

pub(super) fn first(engine: &Native) -> &Particle {
    &engine.particles().particles[0]
}

/// Duration of an impact on a wall by Hertz (s), with mass (kg), radius (m), modulus (Pa) and speed (m/s).
fn duration(mass: f64, radius: f64, modulus: f64, speed: f64) -> f64 {
    let stiffness = 16.0 / 15.0 * modulus * radius.sqrt();
    2.943 * (mass / stiffness).powf(0.4) * speed.powf(-0.2)
}

pub(super) fn modulus() -> f64 {
    PairLaw::new(&MATERIAL.into(), 0, 0).modulus
}

#[test]
fn by_hertz_and_tsuji_a_sphere_leaves_a_wall_with_the_set_restitution_and_no_memory() {
    let speed = 0.1;
    for (set, ratio, sunk) in [(0.8, 1.02472, 0.91830), (0.5, 1.09337, 0.78747)] {
        let contact = ContactParams {
            pair: PairParams { restitution: set, ..MATERIAL.pair },
            law: ElasticLaw::Hertz,
            damping: DampingLaw::Tsuji,
            ..MATERIAL
        };
        let mut falling = Particle::at(3, 0, Vec3::new(3e-3, 4e-3, RADIUS - 1e-15));
        falling.velocity = [0.0, 0.0, -speed];
        let mut engine = alone(TANK, contact.into(), vec![floor()], Vec3::zeros(), spheres(), &[falling]);
        let elastic = duration(mass(), RADIUS, modulus(), speed);
        let dt = elastic / 1000.0;
        let (mut deepest, mut steps) = (0.0_f64, 0);
        while steps < 10 || engine.contacts().count > 0 {
            run(&mut engine, 1, dt);
            deepest = deepest.max(engine.contacts().max_depth);
            assert_eq!(engine.records().memory(), 0);
            steps += 1;
        }
        let parting = first(&engine).velocity[2];
        let time = f64::from(steps) * dt - (first(&engine).position[2] - RADIUS) / parting;
        let [e, t, d] = [parting / speed, time / elastic, deepest / (elastic * speed / 2.943)];
        println!("{set}: e {e:.6}, duration {t:.5} for {ratio}, depth {d:.5} for {sunk}");
        assert!((e - set).abs() < 2e-4);
        assert!((t / ratio - 1.0).abs() < 1e-3 && (d / sunk - 1.0).abs() < 1e-3);
    }
}

#[test]
fn a_sphere_that_drops_on_a_wall_rebounds_with_the_set_restitution_and_one_memory() {
    for (set, expected) in [(0.5, 0.50017), (0.926, 0.926), (1.0, 1.0)] {
        let pair = PairParams { restitution: set, ..MATERIAL.pair };
        let mut falling = Particle::at(3, 0, Vec3::new(3e-3, 4e-3, RADIUS - 1e-12));
        falling.velocity = [0.0, 0.0, -0.1];
        let mut engine = engine(pair, vec![floor()], Vec3::zeros(), &[falling]);
        let dt = duration(mass(), RADIUS, modulus(), 0.1) / 100.0;
        for step in 1..=60 {
            run(&mut engine, 1, dt);
            let (key, memory) = engine.records().iter().next().unwrap();
            assert!(key.first == 3 && memory.len() == 1, "at step {step}");
            assert_eq!(ContactState::wall_of(key.second), Some(0));
            let state = engine.contact_states(&Comm::Solo)[0];
            assert_eq!((state.first, state.wall()), (3, Some(0)));
            assert!(state.force[2] > 0.0 && state.normal[2] < -0.999);
        }
        run(&mut engine, 100, dt);
        let contacts = engine.contacts();
        assert_eq!((contacts.begun, contacts.count), (1, 0), "met once and parted");
        let measured = first(&engine).velocity[2] / 0.1;
        println!("restitution set {set}, expected {expected}, measured {measured:.5}");
        assert!((measured - expected).abs() < 0.002, "set {set}, measured {measured}");
    }
}

/// Friction `mu` at any speed worth the name, restitution `e`.
pub(super) fn sliding(mu: f64, restitution: f64) -> PairParams {
    PairParams {
        restitution,
        friction_static: mu,
        friction_kinetic: mu,
        transition_velocity: 1e-6,
        ..MATERIAL.pair
    }
}

#[test]
fn an_oblique_impact_that_slides_to_the_end_follows_rigid_body_theory() {
    // The impulses are J = m (1 + e) V cos and mu J, and I = 2/5 m R^2.
    let (mu, e, speed) = (0.1, 0.9, 0.1);
    for degrees in [45.0_f64, 60.0] {
        let angle = degrees.to_radians();
        assert!(angle.tan() > 3.5 * mu * (1.0 + e), "it slides");
        let mut thrown = Particle::at(0, 0, Vec3::new(3e-3, 4e-3, RADIUS));
        thrown.velocity = [speed * angle.sin(), 0.0, -speed * angle.cos()];
        let mut engine = engine(sliding(mu, e), vec![floor()], Vec3::zeros(), &[thrown]);
        let dt = duration(mass(), RADIUS, modulus(), speed * angle.cos()) / 200.0;
        run(&mut engine, 300, dt);
        assert_eq!(engine.contacts().count, 0, "parted");
        let after = first(&engine);
        let normal = after.velocity[2] / (speed * angle.cos());
        let tangential = after.velocity[0] / thrown.velocity[0];
        let expected = 1.0 - mu * (1.0 + e) / angle.tan();
        let spin = after.angular_velocity[1] * RADIUS / (2.5 * mu * (1.0 + e) * speed * angle.cos());
        println!(
            "{degrees} degrees: e {normal:.4}, e_t {tangential:.4} for {expected:.4}, spin off by {:.1e}",
            spin - 1.0
        );
        assert!((normal - e).abs() < 0.002);
        assert!((tangential - expected).abs() < 0.01, "{tangential}, {expected}");
        assert!((spin - 1.0).abs() < 0.02, "{spin}");
    }
}

#[test]
fn a_sphere_placed_in_touching_rest_settles_to_the_hertz_depth_and_never_gains_energy() {
    for restitution in [0.1, 0.5, 0.7, 0.926] {
        let pair = PairParams { restitution, ..MATERIAL.pair };
        let placed = Particle::at(0, 0, Vec3::new(3e-3, 4e-3, RADIUS));
        let mut engine = engine(pair, vec![floor()], GRAVITY, &[placed]);
        // F = 4/3 E* sqrt(R) d^1.5 holds the weight.
        let stiffness = 4.0 / 3.0 * modulus() * RADIUS.sqrt();
        let depth = (mass() * 9.81 / stiffness).powf(2.0 / 3.0);
        let period = std::f64::consts::TAU / (1.5 * 9.81 / depth).sqrt();
        let energy = |engine: &Native| {
            let (height, speed) = (first(engine).position[2] - RADIUS, first(engine).velocity[2]);
            let pressed = (-height).max(0.0);
            0.4 * stiffness * pressed.powf(2.5) + mass() * (9.81 * height + 0.5 * speed * speed)
        };
        let scale = mass() * 9.81 * depth;
        let mut most = 0.0_f64;
        for _ in 0..100 * 100 {
            run(&mut engine, 1, period / 100.0);
            most = most.max(energy(&engine) / scale);
        }
        let end = first(&engine);
        println!(
            "e = {restitution}: most energy {most:.1e}, depth off by {:.1e}, speed {:.1e} of the fall",
            (RADIUS - end.position[2]) / depth - 1.0,
            end.velocity[2].abs() / (9.81 * depth).sqrt()
        );
        assert!(most < 0.01, "bounded by what it started with, 0");
        assert!(end.velocity[2].abs() < 0.06 * (9.81 * depth).sqrt());
        // Strong damping, latched at next to no speed, lets it sink only slowly.
        if restitution > 0.6 {
            assert!(((RADIUS - end.position[2]) / depth - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn an_elastic_sphere_in_a_closed_box_hits_all_six_walls_and_keeps_its_energy() {
    let domain = Domain { faces: Domain::faces([false; 3]), ..TANK };
    let size = domain.size().x;
    let walls: Vec<Wall> = (0..3)
        .flat_map(|axis| {
            let normal = Vec3::ith(axis, 1.0);
            [plane("low", Vec3::zeros(), normal), plane("high", normal * size, -normal)]
        })
        .collect();
    let mut thrown = Particle::at(0, 0, Vec3::new(5e-3, 6e-3, 7e-3));
    thrown.velocity = [1.3, -1.0, 0.7];
    let mut engine = alone(domain, contact(sliding(0.0, 1.0)), walls, Vec3::zeros(), spheres(), &[thrown]);
    let dt = duration(mass(), RADIUS, modulus(), 1.3) / 50.0;
    let energy = thrown.velocity().norm_squared();
    let (mut hit, mut off) = (std::collections::BTreeSet::new(), 0.0_f64);
    for _ in 0..60_000 {
        run(&mut engine, 1, dt);
        hit.extend(engine.contact_states(&Comm::Solo).iter().map(|state| state.wall().unwrap()));
        if engine.contacts().count == 0 {
            off = off.max((first(&engine).velocity().norm_squared() / energy - 1.0).abs());
        }
        let position = first(&engine).position();
        assert!(position.min() > 0.9 * RADIUS && position.max() < size - 0.9 * RADIUS);
    }
    println!("{} impacts, energy off by at most {off:.1e}", engine.contacts().begun);
    assert_eq!(hit.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
    assert!(engine.contacts().begun > 50 && off < 1e-3, "{off}");
}

#[test]
fn walls_carry_the_weight_of_what_lies_on_them() {
    // A pyramid of four in a pit with three sides.
    let slope = |turn: f64| {
        let (sin, cos) = turn.sin_cos();
        let inwards = Vec3::new(cos, sin, 0.0);
        plane("slope", Vec3::new(6e-3, 6e-3, 0.0) - inwards * 1.45e-3, inwards + 0.3 * Vec3::z())
    };
    let third = std::f64::consts::TAU / 3.0;
    let walls = vec![floor(), slope(0.1), slope(0.1 + third), slope(0.1 + 2.0 * third)];
    let middle = Vec3::new(6e-3, 6e-3, 1e-3);
    let all: Vec<Particle> = (0..4_u64)
        .map(|n| {
            let (sin, cos) = (third * n as f64).sin_cos();
            let place = if n < 3 {
                middle + Vec3::new(cos, sin, 0.0) * 1.17e-3
            } else {
                middle + Vec3::z() * 1.65e-3
            };
            Particle::at(n, 0, place)
        })
        .collect();
    let mut engine = engine(MATERIAL.pair, walls, GRAVITY, &all);
    run(&mut engine, 100_000, 2e-6);
    let states = engine.contact_states(&Comm::Solo);
    let keys: Vec<_> = states.iter().map(|s| (s.first, s.second)).collect();
    assert!(keys.is_sorted() && states.len() > 8, "{keys:?}");
    let on_particles: Vec3 =
        (states.iter().filter(|s| s.wall().is_some())).map(|s| Vec3::from(s.force)).sum();
    let weight = 4.0 * mass() * 9.81;
    println!("{} contacts, walls push with {:?} weights", states.len(), on_particles / weight);
    assert!((on_particles / weight - Vec3::z()).norm() < 1e-3);
}

#[test]
fn unlike_walls_have_their_own_law_with_each_material() {
    // Two spheres of two materials drop on two halves of a floor of two materials.
    let soft = Material { youngs_modulus: 1e6, ..MATERIAL.material };
    let of = |restitution| PairParams { restitution, ..MATERIAL.pair };
    let model = ContactModel {
        materials: vec![MATERIAL.material, soft],
        pairs: vec![of(0.9), of(0.6), of(0.6), of(0.5)],
        ..ContactModel::default()
    };
    let templates: Arc<[Template]> =
        [0, 1].map(|material| Template { material, ..spheres()[0].clone() }).into();
    for (of_wall, expected) in [(0, [0.9, 0.6]), (1, [0.6, 0.5])] {
        let all = [0, 1].map(|n| {
            let mut falling = Particle::at(n as u64, n, Vec3::new(3e-3 + 5e-3 * n as f64, 4e-3, RADIUS));
            falling.velocity = [0.0, 0.0, -0.1];
            falling
        });
        let mut wall = floor();
        wall.material = of_wall;
        let mut engine = alone(TANK, model.clone(), vec![wall], Vec3::zeros(), templates.clone(), &all);
        run(&mut engine, 1000, 2e-6);
        assert_eq!(engine.contacts().count, 0, "parted");
        for (particle, e) in engine.particles().owned().iter().zip(expected) {
            assert!((particle.velocity[2] / 0.1 - e).abs() < 0.003, "{:?}", particle.velocity);
        }
    }
}

#[test]
fn what_gets_behind_a_wall_or_out_of_the_box_is_named_with_the_wall() {
    let deep = Particle::at(17, 0, Vec3::new(3e-3, 4e-3, 0.4e-3));
    let behind = Particle::at(18, 0, Vec3::new(3e-3, 4e-3, 0.5e-3));
    let mut fast = Particle::at(19, 0, Vec3::new(3e-3, 4e-3, 11.9e-3));
    fast.velocity = [0.0, 0.0, 500.0];
    let shelf = plane("shelf", Vec3::new(0.0, 0.0, 2e-3), Vec3::z());
    let model = || Some(contact(MATERIAL.pair));
    for (particle, contact, walls, words) in [
        (deep, model(), vec![floor()], "and wall `z-`: overlap 6.000e-4 m deep"),
        (behind, model(), vec![shelf], "1.500e-3 m behind the wall `shelf`"),
        (fast, model(), vec![], "leaves the domain through its face z+, where there is no wall"),
        (fast, None, vec![plane("z+", Vec3::z() * 12e-3, -Vec3::z())], "through its wall `z+`"),
    ] {
        let params = NativeParams { contact, walls, substeps: 1, ..NativeParams::default() };
        let cut = Decomposition::new(TANK, 1).unwrap();
        let mut engine = Native::new(params, cut, 0, spheres(), &[particle]).unwrap();
        let error = engine.advance(&Comm::Solo, &[Load::default()], 1e-6).unwrap_err();
        println!("{error}");
        assert_eq!(error.exit_code(), 3);
        let (text, id) = (error.to_string(), format!("particle {} at (3.0", particle.id));
        assert!(text.contains(words) && text.contains(&id), "{text}");
        let place = first(&engine).position();
        assert!((0.0..=12e-3).contains(&place.z), "it stays in the box: {place:?}");
    }
}

#[test]
fn only_periodic_directions_need_room_for_images() {
    // Closed in z and only two diameters high.
    let low = Domain { cells: [12, 12, 4], ..TANK };
    let all =
        [Particle::at(0, 0, Vec3::new(3e-3, 3e-3, 2e-3)), Particle::at(1, 0, Vec3::new(8e-3, 3e-3, 2e-3))];
    let with = |periodic| {
        let params =
            NativeParams { contact: Some(contact(MATERIAL.pair)), substeps: 1, ..NativeParams::default() };
        let cut = Decomposition::new(Domain { faces: Domain::faces(periodic), ..low }, 1).unwrap();
        let wide = spheres()
            .iter()
            .map(|t| Template { shape: Arc::new(Sphere { radius: 2.9e-3 }), ..t.clone() })
            .collect();
        Native::new(params, cut, 0, wide, &all)
    };
    assert!(with([true, true, false]).is_ok());
    assert!(with([true; 3]).unwrap_err().to_string().contains("4.000000e-3 m wide"));
}
