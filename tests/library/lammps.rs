//! LAMMPS behind the engine trait, in processes of its own: motion, contacts and saving.

use crate::common::{PROGRAM, has, has_lammps, words};
use std::sync::Arc;
use turbid::comm::{Comm, SavedParts};
use turbid::contact::{ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Material, PairParams};
use turbid::dem::{DemEngine, Load};
use turbid::domain::{Decomposition, Domain};
use turbid::engine::lammps;
use turbid::engine::process::{External, ExternalParams, Host};
use turbid::math::Vec3;
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;
use turbid::wall::{Motion, Surface, Wall};

/// Radius of all spheres (m).
const RADIUS: f64 = 0.5e-3;

/// Time step (s).
const STEP: f64 = 1e-6;

fn contact(restitution: f64, friction: f64) -> ContactModel {
    ContactModel {
        materials: vec![Material { youngs_modulus: 1e7, poisson_ratio: 0.22 }],
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
        friction: FrictionLaw::MindlinDisplacement,
        ..ContactModel::default()
    }
}

fn params(contact: Option<ContactModel>, substeps: u32) -> ExternalParams {
    let mut params = lammps::params(false, None, None, Arc::default());
    if let Host::Process(program) = &mut params.host {
        program.command[0] = PROGRAM.into();
    }
    ExternalParams { contact, substeps, ..params }
}

/// In a box of 16 diameters, periodic in these directions.
fn engine(params: ExternalParams, periodic: [bool; 3], all: &[Particle]) -> turbid::Result<External> {
    let domain = Domain { faces: Domain::faces(periodic), cells: [32; 3], dx: RADIUS };
    let templates = [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }];
    External::new(params, Decomposition::new(domain, 1).unwrap(), &Comm::Solo, Arc::new(templates), all)
}

fn floor(height: f64) -> Wall {
    Wall {
        name: "floor".to_owned(),
        surface: Surface::Plane { point: Vec3::new(0.0, 0.0, height), normal: Vec3::z() },
        motion: Motion::default(),
        material: 0,
    }
}

fn moving(id: u64, position: [f64; 3], velocity: [f64; 3]) -> Particle {
    let mut particle = Particle::at(id, 0, Vec3::from(position));
    particle.velocity = velocity;
    particle
}

/// Makes this many steps under the same load on each particle.
fn advance(engine: &mut External, load: Load, steps: u32) {
    let loads = vec![load; engine.particles().owned];
    for _ in 0..steps {
        engine.advance(&Comm::Solo, &loads, STEP).unwrap();
    }
}

#[test]
fn under_constant_loads_a_sphere_moves_along_the_parabola() {
    if !has_lammps() {
        return;
    }
    let sphere = moving(7, [4e-3, 5e-3, 6e-3], [0.1, 0.0, 0.2]);
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    let params = ExternalParams { gravity, ..params(None, 3) };
    let mut lammps = engine(params, [true; 3], &[sphere]).unwrap();
    let mass = lammps.particles().templates[0].mass();
    let load = Load { force: Vec3::new(0.0, 3.0 * mass, 0.0), torque: Vec3::new(1e-12, 0.0, 0.0) };
    advance(&mut lammps, load, 200);
    let (t, a) = (200.0 * STEP, Vec3::new(0.0, 3.0, -9.81));
    let moved = lammps.particles().owned()[0];
    let position = sphere.position() + sphere.velocity() * t + a * (0.5 * t * t);
    assert!((moved.position() - position).norm() < 1e-13 * position.norm());
    let spin = load.torque * (t / (0.4 * mass * RADIUS * RADIUS));
    assert!((moved.angular_velocity() - spin).norm() < 1e-11 * spin.norm());
}

#[test]
fn an_impact_has_the_restitution_of_the_case() {
    if !has_lammps() {
        return;
    }
    let (l, gap) = (8e-3, 1.02 * RADIUS);
    let pair = [moving(0, [l - gap, l, l], [0.1, 0.0, 0.0]), moving(5, [l + gap, l, l], [-0.1, 0.0, 0.0])];
    let mut lammps = engine(params(Some(contact(0.6, 0.0)), 1), [true; 3], &pair).unwrap();
    advance(&mut lammps, Load::default(), 1000);
    let [a, b] = [0, 1].map(|k| lammps.particles().owned()[k].velocity);
    assert!(((b[0] - a[0]) / 0.2 - 0.6).abs() < 1e-3, "{a:?} {b:?}");
}

#[test]
fn a_save_during_contacts_changes_nothing_and_resumes_to_the_bit() {
    if !has_lammps() {
        return;
    }
    // One slides on the floor; two rub against each other through a face, and have moved since the lists were made.
    let all = [
        moving(1, [4e-3, 4e-3, 1.99 * RADIUS], [0.3, 0.0, 0.0]),
        moving(3, [0.9 * RADIUS, 8e-3, 8e-3], [-0.02, 0.3, 0.1]),
        moving(9, [16e-3 - 1.07 * RADIUS, 8e-3, 8e-3], [0.1, 0.0, 0.1]),
    ];
    let params = ExternalParams {
        gravity: Vec3::new(0.0, 0.0, -9.81),
        walls: vec![floor(RADIUS)],
        ..params(Some(contact(0.7, 0.3)), 2)
    };
    let start = || engine(params.clone(), [true, true, false], &all).unwrap();
    let mut plain = start();
    advance(&mut plain, Load::default(), 400);
    let mut first = start();
    advance(&mut first, Load::default(), 30);
    let kinds: Vec<bool> = first.contact_states(&Comm::Solo).iter().map(|one| one.second < 100).collect();
    assert_eq!(kinds.len(), 2, "with the floor and with each other: {kinds:?}");
    let saved = first.save(&Comm::Solo).unwrap();
    let mut second = start();
    second.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[saved])).unwrap();
    for engine in [&mut first, &mut second] {
        advance(engine, Load::default(), 370);
    }
    assert_eq!(first.particles().owned(), second.particles().owned());
    for (a, b) in plain.particles().owned().iter().zip(first.particles().owned()) {
        assert!((a.velocity() - b.velocity()).norm() < 1e-12, "{a:?} {b:?}");
        assert!((a.angular_velocity() - b.angular_velocity()).norm() < 1e-8, "{a:?} {b:?}");
    }
}

#[test]
fn what_lammps_refuses_comes_back_in_its_own_words() {
    if !has_lammps() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut params = ExternalParams { walls: vec![floor(RADIUS)], ..params(Some(contact(0.7, 0.3)), 1) };
    if let Host::Process(program) = &mut params.host {
        program.log = Some(folder.path().join("lammps.log"));
    }
    let all = [moving(1, [4e-3, 4e-3, 4e-3], [0.0; 3])];
    let error = engine(params, [true; 3], &all).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    let said = error.to_string();
    for words in ["LAMMPS refuses", "exit code 1", "Cannot use wall in periodic dimension"] {
        assert!(said.contains(words), "{said}");
    }
}

/// Set in the process that LAMMPS is to end.
const ENDED: &str = "TURBID_TEST_ENDED_BY_LAMMPS";

#[test]
fn in_this_process_lammps_says_why_it_ends_the_run() {
    if !has_lammps() {
        return;
    }
    if std::env::var_os(ENDED).is_some() {
        let walls = vec![floor(RADIUS)];
        let contact = Some(contact(0.7, 0.3));
        let params = ExternalParams { walls, contact, ..lammps::params(true, None, None, Arc::default()) };
        let refused = engine(params, [true; 3], &[moving(1, [4e-3, 4e-3, 4e-3], [0.0; 3])]);
        panic!("LAMMPS has ended nothing: {refused:?}");
    }
    let output = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "lammps::in_this_process_lammps_says_why_it_ends_the_run", "--nocapture"])
        .env(ENDED, "1")
        .output()
        .unwrap();
    let said = words(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    has(&said, &["error: LAMMPS has failed: ERROR: Cannot use wall in periodic dimension"]);
}
