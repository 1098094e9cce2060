//! LIGGGHTS behind the engine trait, in processes of its own: motion, contacts and saving.

mod commands;
mod failures;

use crate::common::PROGRAM;
use std::path::PathBuf;
use std::sync::Arc;
use turbid::comm::{Comm, SavedParts, on_threads};
use turbid::contact::{ContactModel, DampingLaw, ElasticLaw, Material, PairParams};
use turbid::dem::{DemEngine, Load, Native, NativeParams};
use turbid::domain::{Decomposition, Domain};
use turbid::engine::liggghts::{Liggghts, LiggghtsParams};
use turbid::math::Vec3;
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;
use turbid::wall::{Motion, Surface, Wall};

/// Radius of all spheres (m).
const RADIUS: f64 = 0.5e-3;

/// A periodic box of 16 diameters.
const DOMAIN: Domain = Domain { faces: Domain::faces([true; 3]), cells: [32; 3], dx: RADIUS };

fn contact(youngs_modulus: f64, restitution: f64, friction: f64) -> ContactModel {
    ContactModel {
        materials: vec![Material { youngs_modulus, poisson_ratio: 0.22 }],
        pairs: vec![PairParams {
            restitution,
            friction_static: friction,
            friction_kinetic: friction,
            transition_velocity: 1e-6,
            rolling_friction: 0.0,
            work_of_adhesion: 0.0,
            cohesion_density: 0.0,
        }],
        law: ElasticLaw::Hertz,
        damping: DampingLaw::Tsuji,
        ..ContactModel::default()
    }
}

fn params(contact: Option<ContactModel>) -> LiggghtsParams {
    LiggghtsParams {
        contact,
        substeps: 1,
        program: Some(PathBuf::from(PROGRAM)),
        ..LiggghtsParams::default()
    }
}

fn templates() -> Arc<[Template]> {
    Arc::new([Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }])
}

fn engine(params: LiggghtsParams, all: &[Particle]) -> turbid::Result<Liggghts> {
    let cut = Decomposition::new(DOMAIN, 1).unwrap();
    Liggghts::new(params, cut, &Comm::Solo, templates(), all)
}

fn moving(id: u64, position: [f64; 3], velocity: [f64; 3]) -> Particle {
    let mut particle = Particle::at(id, 0, Vec3::from(position));
    particle.velocity = velocity;
    particle
}

/// Three spheres that meet obliquely, one of them through the face x = 0.
fn three() -> Vec<Particle> {
    let (d, l) = (2.0 * RADIUS, 16e-3);
    vec![
        moving(3, [0.1 * d, 0.5 * l, 0.5 * l], [0.0, 0.1, 0.0]),
        moving(10, [1.05 * d, 0.5 * l, 0.5 * l], [-0.2, 0.0, 0.05]),
        moving(12, [l - 0.88 * d, 0.5 * l, 0.51 * l], [0.3, 0.0, 0.0]),
    ]
}

const REST: Load = Load { force: Vec3::new(0.0, 0.0, 0.0), torque: Vec3::new(0.0, 0.0, 0.0) };

/// With commands of the user.
fn with_commands(commands: &[&str]) -> LiggghtsParams {
    LiggghtsParams {
        commands: commands.iter().map(|&c| c.to_owned()).collect(),
        ..params(Some(contact(1e7, 0.7, 0.3)))
    }
}

/// The engine after this many steps of `dt` (s) under no load.
fn advanced(mut engine: Liggghts, steps: u32, dt: f64) -> turbid::Result<Liggghts> {
    let loads = vec![REST; engine.particles().owned];
    for _ in 0..steps {
        engine.advance(&Comm::Solo, &loads, dt)?;
    }
    Ok(engine)
}

#[test]
fn asking_for_contacts_does_not_disturb_the_motion() {
    let params = params(Some(contact(1e7, 0.7, 0.3)));
    let plain = advanced(engine(params.clone(), &three()).unwrap(), 1000, 1e-6).unwrap();
    let mut asked = engine(params, &three()).unwrap();
    let mut seen = 0;
    for _ in 0..1000 {
        asked.advance(&Comm::Solo, &[REST; 3], 1e-6).unwrap();
        seen += asked.contact_states(&Comm::Solo).len();
    }
    assert!(seen > 100, "{seen} contacts seen");
    assert_eq!(plain.particles().owned(), asked.particles().owned());
}

#[test]
fn a_save_during_contacts_resumes_to_the_bit_and_does_not_disturb_the_run_that_saved_it() {
    // A fourth sphere drifts to a face without being in contact: lists made before it are not those made after.
    let mut all = three();
    all.push(moving(13, [0.3e-3, 2e-3, 2e-3], [-0.4, 0.0, 0.0]));
    let params = params(Some(contact(1e7, 0.7, 0.3)));
    let plain = advanced(engine(params.clone(), &all).unwrap(), 1000, 1e-6).unwrap();
    let mut first = engine(params.clone(), &all).unwrap();
    let mut steps = 0;
    while first.contacts().max_depth < 5e-6 {
        first = advanced(first, 1, 1e-6).unwrap();
        steps += 1;
    }
    let spinning = (first.particles().owned().iter()).any(|p| p.angular_velocity().norm() > 0.0);
    assert!(spinning, "there is friction to be remembered");
    let saved = first.save(&Comm::Solo).unwrap();
    let mut second = engine(params, &all).unwrap();
    second.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[saved])).unwrap();
    assert_eq!(first.contacts(), second.contacts());
    let [first, second] = [first, second].map(|lgg| advanced(lgg, 1000 - steps, 1e-6).unwrap());
    assert_eq!(first.particles().owned(), second.particles().owned());
    assert_eq!(first.contacts(), second.contacts());
    // The lists are in another order than without saving: rounding may differ, and nothing else.
    for (a, b) in plain.particles().owned().iter().zip(first.particles().owned()) {
        assert!((a.velocity() - b.velocity()).norm() < 1e-10, "{a:?} {b:?}");
        assert!((a.position() - b.position()).norm() < 1e-13, "{a:?} {b:?}");
    }
}

#[test]
fn what_is_damaged_or_of_another_case_is_not_restored_and_the_engine_continues() {
    let mut one = engine(params(None), &three()).unwrap();
    let saved = one.save(&Comm::Solo).unwrap();
    let refused = |one: &mut Liggghts, part: Vec<u8>| {
        let error = one.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[part])).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains("liggghts"), "{error}");
    };
    for length in [0, 7, 20, saved.len() / 2, saved.len() - 1] {
        refused(&mut one, saved[..length].to_vec());
    }
    for at in (0..saved.len()).step_by(saved.len() / 500) {
        let mut damaged = saved.clone();
        damaged[at] ^= 4;
        refused(&mut one, damaged);
    }
    one = advanced(one, 3, 1e-6).unwrap();
    let mut other = engine(params(None), &three()[..2]).unwrap();
    refused(&mut other, saved.clone());
    one.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[saved])).unwrap();
    advanced(one, 3, 1e-6).unwrap();
}

#[test]
fn a_sphere_that_is_grown_for_contacts_keeps_its_moment_of_inertia() {
    let mut grown = contact(1e7, 0.9, 0.3);
    grown.enlargement = 0.2 * RADIUS;
    for substeps in [1, 7] {
        let params = LiggghtsParams { substeps, ..params(Some(grown.clone())) };
        let mut lgg = engine(params, &three()[..1]).unwrap();
        let load = Load { force: Vec3::new(1e-8, 2e-8, -3e-8), torque: Vec3::new(1e-12, -2e-12, 3e-12) };
        for _ in 0..100 {
            lgg.advance(&Comm::Solo, &[load], 1e-5).unwrap();
        }
        let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
        let particle = lgg.particles().owned()[0];
        let spin = load.torque * (1e-3 / (0.4 * mass * RADIUS * RADIUS));
        let velocity = load.force * (1e-3 / mass) + Vec3::new(0.0, 0.1, 0.0);
        assert!((particle.angular_velocity() - spin).norm() < 1e-12 * spin.norm());
        assert!((particle.velocity() - velocity).norm() < 1e-12 * velocity.norm());
    }
}

#[test]
fn an_off_centre_impact_of_grown_spheres_turns_them_as_their_own_inertia_says() {
    // Angular momentum about the centre of mass: what the flight loses, the spins gain.
    let mut model = contact(1e7, 1.0, 0.3);
    model.enlargement = 0.1 * RADIUS;
    let middle = 8e-3;
    let pair = [
        moving(0, [middle, middle, middle], [0.0; 3]),
        moving(1, [middle + 2.3 * RADIUS, middle + RADIUS, middle], [-0.3, 0.0, 0.0]),
    ];
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let total = |engine: &Liggghts| -> f64 {
        (engine.particles().owned().iter())
            .map(|p| {
                mass * p.position().cross(&p.velocity()).z
                    + 0.4 * mass * RADIUS * RADIUS * p.angular_velocity[2]
            })
            .sum()
    };
    let before = engine(params(Some(model)), &pair).unwrap();
    let start = total(&before);
    let after = advanced(before, 4000, 2e-7).unwrap();
    assert_eq!(after.contacts().begun, 1);
    assert_eq!(after.contacts().count, 0);
    let spin = after.particles().owned()[0].angular_velocity[2];
    assert!(spin.abs() > 10.0, "{spin}");
    assert!((total(&after) / start - 1.0).abs() < 1e-11, "{} {start}", total(&after));
}

#[test]
fn one_to_four_ranks_get_the_same_bits() {
    let run = |ranks: usize| {
        let cut = Decomposition::new(DOMAIN, ranks).unwrap();
        let mut all: Vec<Particle> = on_threads(ranks, |comm| {
            let params = params(Some(contact(1e7, 0.7, 0.3)));
            let handed: Vec<Particle> = three().into_iter().skip(comm.rank()).step_by(ranks).collect();
            let mut lgg = Liggghts::new(params, cut.clone(), &comm, templates(), &handed).unwrap();
            for step in 0..500 {
                let loads: Vec<Load> = (lgg.particles().owned().iter())
                    .map(|p| Load {
                        force: Vec3::new(1e-9, 0.0, 0.0) * (p.id as f64 + f64::from(step)),
                        torque: Vec3::zeros(),
                    })
                    .collect();
                lgg.advance(&comm, &loads, 2e-6).unwrap();
            }
            lgg.particles().owned().to_vec()
        })
        .concat();
        all.sort_by_key(|p| p.id);
        all
    };
    let one = run(1);
    assert_eq!(one.len(), 3);
    for ranks in [2, 3, 4] {
        assert_eq!(one, run(ranks), "{ranks} ranks");
    }
}

#[test]
fn the_forces_of_single_contacts_add_up_to_those_of_the_particles() {
    // Damped: forces depend on velocities, and must be those that acted.
    let mut lgg = engine(params(Some(contact(1e7, 0.7, 0.0))), &three()).unwrap();
    let mut seen = 0;
    for _ in 0..600 {
        lgg = advanced(lgg, 1, 1e-6).unwrap();
        let states = lgg.contact_states(&Comm::Solo);
        seen += states.len();
        for particle in lgg.particles().owned() {
            let total: Vec3 = (states.iter())
                .map(|state| match particle.id {
                    id if id == state.first => Vec3::from(state.force),
                    id if id == state.second => -Vec3::from(state.force),
                    _ => Vec3::zeros(),
                })
                .sum();
            let force = Vec3::from(particle.contact_force);
            assert!((total - force).norm() <= 1e-9 * force.norm(), "{total} {force}");
        }
    }
    assert!(seen > 50);
}

#[test]
fn elastic_contacts_have_the_force_of_hertz_away_from_each_other() {
    let mut lgg = engine(params(Some(contact(1e7, 1.0, 0.0))), &three()).unwrap();
    let mut seen = 0;
    for _ in 0..600 {
        lgg = advanced(lgg, 1, 1e-6).unwrap();
        for state in lgg.contact_states(&Comm::Solo) {
            let stiffness = 4.0 / 3.0 * (1e7 / (2.0 * (1.0 - 0.22 * 0.22))) * (0.5 * RADIUS).sqrt();
            let along = Vec3::from(state.force).dot(&Vec3::from(state.normal));
            let hertz = stiffness * state.depth.powf(1.5);
            assert!((along / hertz + 1.0).abs() < 1e-6, "{along} {hertz}");
            seen += 1;
        }
    }
    assert!(seen > 50);
}

/// A closed box with walls on its z faces.
fn tank(velocity: Vec3) -> (Domain, Vec<Wall>) {
    let domain = Domain { faces: Domain::faces([true, true, false]), ..DOMAIN };
    let wall = |name: &str, height: f64, up: f64, velocity: Vec3| Wall {
        name: name.to_owned(),
        surface: Surface::Plane { point: Vec3::new(0.0, 0.0, height), normal: Vec3::z() * up },
        motion: Motion { velocity: velocity.into(), ..Motion::default() },
        material: 0,
    };
    let top = domain.size().z;
    (domain, vec![wall("z-", 0.0, 1.0, velocity), wall("z+", top, -1.0, Vec3::zeros())])
}

#[test]
fn a_sphere_that_rests_on_a_floor_presses_with_its_weight_and_a_sliding_floor_takes_it_along() {
    let (domain, walls) = tank(Vec3::new(0.02, 0.0, 0.0));
    let params = LiggghtsParams {
        walls,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        substeps: 10,
        ..params(Some(contact(1e6, 0.3, 0.5)))
    };
    let cut = Decomposition::new(domain, 1).unwrap();
    let all = [moving(0, [8e-3, 8e-3, RADIUS], [0.0; 3])];
    let mut lgg = Liggghts::new(params, cut, &Comm::Solo, templates(), &all).unwrap();
    for _ in 0..3000 {
        lgg.advance(&Comm::Solo, &[REST], 2e-5).unwrap();
    }
    let states = lgg.contact_states(&Comm::Solo);
    assert_eq!(states.len(), 1);
    assert_eq!(states[0].wall(), Some(0));
    let weight = 9.81 * 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    assert!((states[0].force[2] / weight - 1.0).abs() < 1e-3, "{states:?} {weight}");
    assert_eq!(Vec3::from(states[0].normal), -Vec3::z());
    let sphere = lgg.particles().owned()[0];
    // It rolls on: at the point of contact it moves as the floor does.
    let below = sphere.velocity[0] - sphere.angular_velocity[1] * RADIUS;
    assert!((below / 0.02 - 1.0).abs() < 1e-2, "{below}");
}

#[test]
fn under_weight_and_changing_loads_damped_bounces_are_those_of_the_native_engine_to_rounding() {
    let (domain, walls) = tank(Vec3::zeros());
    let model = Some(contact(1e7, 0.6, 0.0));
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    let all = [
        moving(2, [8e-3, 8e-3, 1.02 * RADIUS], [0.0, 0.0, -0.05]),
        moving(7, [8e-3, 8e-3, 3.05 * RADIUS], [0.0, 0.0, -0.2]),
    ];
    for substeps in [1, 4] {
        let cut = || Decomposition::new(domain, 1).unwrap();
        let params = LiggghtsParams { walls: walls.clone(), gravity, substeps, ..params(model.clone()) };
        let mut lgg = Liggghts::new(params, cut(), &Comm::Solo, templates(), &all).unwrap();
        let params = NativeParams {
            contact: model.clone(),
            walls: walls.clone(),
            gravity,
            substeps,
            ..NativeParams::default()
        };
        let mut native = Native::new(params, cut(), 0, templates(), &all).unwrap();
        for step in 0..3000_u32 {
            // Of the size of the weight.
            let push = |k: u32| 1e-5 * (f64::from((step * 7 + k * 5) % 11) - 5.0);
            let loads = [0, 1].map(|k| Load { force: Vec3::new(0.0, 0.0, push(k)), torque: Vec3::zeros() });
            for engine in [&mut lgg as &mut dyn DemEngine, &mut native] {
                engine.advance(&Comm::Solo, &loads, 2e-6).unwrap();
            }
            for (a, b) in native.particles().owned().iter().zip(lgg.particles().owned()) {
                let apart = (a.position() - b.position()).norm();
                assert!(apart < 1e-9 * RADIUS, "step {step}, {substeps} sub-steps: {apart:e}");
            }
        }
        assert!(native.contacts().begun >= 2 && lgg.contacts().begun >= 2);
    }
}
