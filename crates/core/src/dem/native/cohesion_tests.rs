//! Claims about cohesion: what hangs, what falls, what sticks, and what it leaves alone.

use super::wall_tests::{MATERIAL, RADIUS, TANK, alone, first, mass, plane, run};
use super::*;
use crate::contact::{CohesionLaw, ContactParams, ElasticLaw, PairParams};
use crate::shape::Sphere;
use std::f64::consts::PI;

const DT: f64 = 1e-6;

fn cohesive(cohesion: CohesionLaw, pair: PairParams) -> ContactModel {
    let law = ElasticLaw::Hertz;
    ContactModel { cohesion, ..ContactParams { pair, law, ..MATERIAL }.into() }
}

/// Spheres at these places (m), with the velocities (m/s), in a box with a ceiling.
fn spheres(contact: ContactModel, gravity: f64, all: &[(Vec3, Vec3)]) -> Native {
    let all: Vec<Particle> = (0..)
        .zip(all)
        .map(|(id, (position, velocity))| {
            let mut sphere = Particle::at(id, 0, *position);
            sphere.velocity = (*velocity).into();
            sphere
        })
        .collect();
    let ceiling = plane("ceiling", Vec3::z() * 0.012, -Vec3::z());
    let templates: Arc<[Template]> =
        [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into();
    alone(TANK, contact, vec![ceiling], Vec3::z() * -gravity, templates, &all)
}

#[test]
fn a_sphere_hangs_from_a_ceiling_up_to_the_force_that_pulls_it_off() {
    let weight = mass() * 9.81;
    // The largest force of k A against Hertz, K = 2 pi k R, is 4/27 K^3 / c^2.
    let c = 4.0 / 3.0 * super::wall_tests::modulus() * RADIUS.sqrt();
    let density = |force: f64| (6.75 * force * c * c).cbrt() / (2.0 * PI * RADIUS);
    for (cohesion, part, hangs) in [
        (CohesionLaw::Dmt, 1.005, true),
        (CohesionLaw::Dmt, 0.995, false),
        (CohesionLaw::Sjkr, 1.01, true),
        (CohesionLaw::Sjkr, 0.99, false),
    ] {
        let pull = part * weight;
        let pair = PairParams {
            restitution: 0.3,
            work_of_adhesion: pull / (2.0 * PI * RADIUS),
            cohesion_density: density(pull),
            ..MATERIAL.pair
        };
        // Pressed on where the force is largest, so that it holds if anything does.
        let depth = match cohesion {
            CohesionLaw::Sjkr => (2.0 * 2.0 * PI * RADIUS * density(pull) / (3.0 * c)).powi(2),
            _ => 1e-9,
        };
        let at = Vec3::new(6e-3, 6e-3, 0.012 - RADIUS + depth);
        let mut engine = spheres(cohesive(cohesion, pair), 9.81, &[(at, Vec3::zeros())]);
        run(&mut engine, 45_000, DT);
        let fallen = at.z - first(&engine).position[2];
        println!("{cohesion:?}, pull {part} of the weight: fallen {fallen:.2e} m");
        assert_eq!(fallen < 1e-5, hangs, "{cohesion:?} {part}");
    }
}

#[test]
fn spheres_that_meet_slowly_stick_and_rest_where_cohesion_and_elasticity_balance() {
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let pair =
            PairParams { restitution: 0.5, work_of_adhesion: 0.05, cohesion_density: 2e5, ..MATERIAL.pair };
        let contact = cohesive(cohesion, pair);
        let depth = crate::contact::SpherePair::new(&contact, 0, 2.0 * RADIUS, mass()).static_depth(0.0);
        let half = Vec3::x() * (RADIUS + 1e-7);
        let middle = Vec3::repeat(6e-3);
        let all = [(middle - half, Vec3::x() * 1e-3), (middle + half, Vec3::x() * -1e-3)];
        let mut engine = spheres(contact, 0.0, &all);
        run(&mut engine, 300_000, DT);
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].position());
        let overlap = 2.0 * RADIUS - (b - a).norm();
        println!("{cohesion:?}: depth {overlap:.4e} for {depth:.4e} m");
        assert!((overlap / depth - 1.0).abs() < 0.01, "{cohesion:?}");
        assert_eq!(engine.contacts().count, 1, "also where the forces balance to the last bit");
    }
}

#[test]
fn an_elastic_impact_of_cohesive_spheres_gives_back_the_speed_and_keeps_the_momentum() {
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let pair =
            PairParams { restitution: 1.0, work_of_adhesion: 0.05, cohesion_density: 2e5, ..MATERIAL.pair };
        let half = Vec3::x() * (RADIUS + 1e-7);
        let middle = Vec3::repeat(6e-3);
        let all = [(middle - half, Vec3::x() * 0.2), (middle + half, Vec3::x() * -0.1)];
        let mut engine = spheres(cohesive(cohesion, pair), 0.0, &all);
        run(&mut engine, 60_000, 1e-8);
        assert_eq!(engine.contacts().count, 0, "they have parted");
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity());
        println!("{cohesion:?}: {} and {} m/s", a.x, b.x);
        assert!((a.x + 0.1).abs() < 2e-4 && (b.x - 0.2).abs() < 2e-4, "{cohesion:?}");
        assert!((a + b - Vec3::x() * 0.1).norm() < 1e-15, "{cohesion:?}");
    }
}
