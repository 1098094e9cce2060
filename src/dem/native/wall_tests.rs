//! Claims about spheres and walls.

use super::*;
use crate::contact::{ContactParams, ElasticLaw, Geometry, Material, PairParams};
use crate::shape::Sphere;
use crate::wall::Motion;

pub(super) const MATERIAL: ContactParams = ContactParams {
    material: Material {
        youngs_modulus: 1e7,
        poisson_ratio: 0.25,
    },
    pair: PairParams {
        restitution: 0.8,
        friction_static: 0.32,
        friction_kinetic: 0.16,
        transition_velocity: 1e-3,
    },
    enlargement: 0.0,
    geometry: Geometry::Exact,
    law: ElasticLaw::Paper,
};

/// Closed in z, 12 mm wide.
pub(super) const TANK: Domain = Domain {
    periodic: [true, true, false],
    cells: [12, 12, 12],
    dx: 1e-3,
};
const RADIUS: f64 = 1e-3;
const DENSITY: f64 = 2500.0;

fn contact(pair: PairParams) -> ContactModel {
    ContactParams { pair, ..MATERIAL }.into()
}

/// The part of space behind a plane.
pub(super) fn plane(name: &str, point: Vec3, normal: Vec3) -> Wall {
    Wall {
        name: name.into(),
        surface: Surface::Plane {
            point,
            normal: normal.normalize(),
        },
        motion: Motion::default(),
        material: 0,
    }
}

pub(super) fn floor() -> Wall {
    plane("z-", Vec3::zeros(), Vec3::z())
}

fn spheres() -> Arc<[Template]> {
    [Template {
        shape: Arc::new(Sphere { radius: RADIUS }),
        density: DENSITY,
        material: 0,
    }]
    .into()
}

fn mass() -> f64 {
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
    let params = NativeParams {
        contact: Some(contact),
        walls,
        gravity,
        substeps: 1,
    };
    let cut = Decomposition::new(domain, 1).unwrap();
    Native::new(params, cut, 0, templates, all).unwrap()
}

fn engine(pair: PairParams, walls: Vec<Wall>, gravity: Vec3, all: &[Particle]) -> Native {
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

fn modulus() -> f64 {
    PairLaw::new(&MATERIAL.into(), 0, 0).modulus
}

#[test]
fn a_sphere_that_drops_on_a_wall_rebounds_with_the_set_restitution_and_one_memory() {
    for (set, expected) in [(0.5, 0.50017), (0.926, 0.926), (1.0, 1.0)] {
        let pair = PairParams {
            restitution: set,
            ..MATERIAL.pair
        };
        let mut falling = Particle::at(3, 0, Vec3::new(3e-3, 4e-3, RADIUS - 1e-12));
        falling.velocity = [0.0, 0.0, -0.1];
        let mut engine = engine(pair, vec![floor()], Vec3::zeros(), &[falling]);
        let dt = duration(mass(), RADIUS, modulus(), 0.1) / 100.0;
        for step in 1..=60 {
            run(&mut engine, 1, dt);
            let records = engine.records();
            assert_eq!((records[0].first, records[0].age), (3, step));
            assert_eq!(ContactState::wall_of(records[0].second), Some(0));
            let state = engine.contact_states()[0];
            assert_eq!((state.first, state.wall()), (3, Some(0)));
            assert!(state.force[2] > 0.0 && state.normal[2] < -0.999);
        }
        run(&mut engine, 100, dt);
        let contacts = engine.contacts();
        assert_eq!((contacts.begun, contacts.count), (1, 0), "met once and parted");
        let measured = first(&engine).velocity[2] / 0.1;
        println!("restitution set {set}, expected {expected}, measured {measured:.5}");
        assert!(
            (measured - expected).abs() < 0.002,
            "set {set}, measured {measured}"
        );
    }
}
