//! Claims about the van der Waals force over gaps.

use super::wall_tests::{MATERIAL, RADIUS, TANK, alone, first, mass, plane, run};
use super::*;
use crate::contact::{ContactParams, ElasticLaw, PairParams, VanDerWaals};
use crate::shape::Sphere;
use crate::shape::composite::tests::dumbbell;

const DT: f64 = 1e-6;
/// Gaps (m) that a test resolves; the pull of a sphere and a wall in contact is 1e-4 N, about the weight of the sphere.
const LAW: VanDerWaals = VanDerWaals { hamaker_constant: 6e-13, smallest_gap: 1e-6, cut_off: 2e-5 };

fn model(van_der_waals: VanDerWaals, restitution: f64) -> ContactModel {
    let pair = PairParams { restitution, ..MATERIAL.pair };
    let contact: ContactModel = ContactParams { pair, law: ElasticLaw::Hertz, ..MATERIAL }.into();
    ContactModel { van_der_waals: Some(van_der_waals), ..contact }
}

fn sphere(radius: f64) -> Template {
    Template { shape: Arc::new(Sphere { radius }), density: 2500.0, material: 0 }
}

/// Gap (m) between two bodies along x, and the speed (m/s) at which it closes.
fn gap(engine: &Native, radii: f64) -> [f64; 2] {
    let [a, b] = [0, 1].map(|i| &engine.particles().particles[i]);
    [(b.position() - a.position()).norm() - radii, (a.velocity() - b.velocity()).x]
}

#[test]
fn spheres_that_are_let_go_over_a_gap_meet_with_the_work_of_the_force_and_bounce_back_to_where_they_were() {
    let (radii, start) = ([RADIUS, 0.5 * RADIUS], 5e-6);
    let reduced = radii[0] * radii[1] / (radii[0] + radii[1]);
    let templates: Arc<[Template]> = radii.map(sphere).into();
    let [one, other] = [0, 1].map(|i| templates[i].mass());
    let middle = Vec3::repeat(6e-3);
    let all = [(0, middle), (1, middle + Vec3::x() * (radii[0] + radii[1] + start))];
    let all = all.map(|(k, at)| Particle::at(k as u64, k, at));
    let mut engine = alone(TANK, model(LAW, 1.0), Vec::new(), Vec3::zeros(), templates, &all);
    while engine.contacts().begun == 0 {
        run(&mut engine, 1, 1e-7);
        assert!(engine.contact_states(&Comm::Solo).len() == 1 && engine.contacts().count < 2);
    }
    let [depth, speed] = gap(&engine, radii[0] + radii[1]);
    let work = LAW.energy(start, reduced) - LAW.energy(depth, reduced);
    let expected = (2.0 * work * (1.0 / one + 1.0 / other)).sqrt();
    println!("closes at {speed:.6e} for {expected:.6e} m/s");
    assert!((speed / expected - 1.0).abs() < 1e-3);
    // Out to where they turn again.
    while gap(&engine, 0.0)[1] >= 0.0 {
        run(&mut engine, 1, 1e-7);
    }
    while gap(&engine, 0.0)[1] < 0.0 {
        run(&mut engine, 1, 1e-7);
    }
    let [back, _] = gap(&engine, radii[0] + radii[1]);
    println!("back at a gap of {back:.4e} for {start:.4e} m");
    assert!((LAW.energy(back, reduced) - LAW.energy(start, reduced)).abs() < 5e-3 * work);
    let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity());
    assert!((a * one + b * other).norm() < 1e-14 * one * speed, "momentum");
}

#[test]
fn a_sphere_hangs_from_a_ceiling_up_to_the_force_at_the_smallest_gap_and_is_free_beyond_the_cut_off() {
    let ceiling = || vec![plane("ceiling", Vec3::z() * 0.012, -Vec3::z())];
    for (part, hangs) in [(1.005, true), (0.995, false)] {
        let gravity = LAW.pull(0.0, RADIUS) / (part * mass());
        let at = Vec3::new(6e-3, 6e-3, 0.012 - RADIUS);
        let mut engine = alone(
            TANK,
            model(LAW, 0.3),
            ceiling(),
            Vec3::z() * -gravity,
            [sphere(RADIUS)].into(),
            &[Particle::at(0, 0, at)],
        );
        run(&mut engine, 45_000, DT);
        let fallen = at.z - first(&engine).position[2];
        println!("pull {part} of the weight: fallen {fallen:.2e} m");
        assert_eq!(fallen < LAW.smallest_gap, hangs, "{part}");
    }
    for (gap, pull) in [(0.99 * LAW.cut_off, LAW.pull(0.99 * LAW.cut_off, RADIUS)), (1.01 * LAW.cut_off, 0.0)]
    {
        let at = Particle::at(0, 0, Vec3::new(6e-3, 6e-3, 0.012 - RADIUS - gap));
        let mut engine =
            alone(TANK, model(LAW, 0.3), ceiling(), Vec3::zeros(), [sphere(RADIUS)].into(), &[at]);
        run(&mut engine, 1, 1e-12);
        let found = first(&engine).contact_force[2];
        assert!((found - pull).abs() <= 1e-9 * pull, "{gap}: {found} for {pull}");
        assert_eq!((engine.contacts().count, engine.contacts().begun), (0, 0));
    }
}

#[test]
fn spheres_of_a_dumb_bell_are_drawn_without_angular_momentum() {
    let templates: Arc<[Template]> =
        [Template { shape: dumbbell(RADIUS), density: 2500.0, material: 0 }, sphere(RADIUS)].into();
    let offset = templates[0].shape.parts()[1].position;
    let at = Vec3::repeat(6e-3);
    let above = offset + Vec3::new(1e-3, 2e-3, 3e-3).normalize() * (2.0 * RADIUS + 5e-6);
    let all = [Particle::at(0, 0, at), Particle::at(1, 1, at + above)];
    let masses = [0, 1].map(|i| templates[i].mass());
    let mut engine = alone(TANK, model(LAW, 1.0), Vec::new(), Vec3::zeros(), templates, &all);
    run(&mut engine, 300, DT);
    let [a, b] = [0, 1].map(|i| engine.particles().particles[i]);
    let orbital = |p: &Particle, mass: f64| (p.position() - at).cross(&p.velocity()) * mass;
    let spins = Vec3::from(a.angular_momentum) + Vec3::from(b.angular_momentum);
    let total = orbital(&a, masses[0]) + orbital(&b, masses[1]) + spins;
    assert!(Vec3::from(a.angular_momentum).norm() > 1e-13 && engine.contacts().begun == 0);
    assert!(total.norm() < 1e-12 * orbital(&b, masses[1]).norm(), "{total:?}");
    assert!(
        (a.velocity() * masses[0] + b.velocity() * masses[1]).norm()
            < 1e-14 * b.velocity().norm() * masses[1]
    );
}
