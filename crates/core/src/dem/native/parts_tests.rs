//! Claims about bodies of several parts.

use super::mixed_tests::{shaken, templates};
use super::wall_tests::{GRAVITY, MATERIAL, TANK, alone, first, floor, modulus, run};
use super::*;
use crate::contact::{ContactParams, PairParams};
use crate::math::Quat;
use crate::shape::composite::tests::{dumbbell, halves};
use crate::shape::{Composite, Cuboid, Part};

const RADIUS: f64 = 1e-3;

fn made_of(shape: Arc<dyn Shape>) -> Arc<[Template]> {
    [Template { shape, density: 2500.0, material: 0 }].into()
}

#[test]
fn a_body_that_falls_flat_on_two_parts_has_a_contact_and_a_memory_of_each() {
    let speed = 0.1;
    let mut falling = Particle::at(3, 0, Vec3::new(3e-3, 4e-3, RADIUS - 1e-12));
    falling.velocity = [0.0, 0.0, -speed];
    let templates = made_of(dumbbell(RADIUS));
    // Each sphere bears its own half of the mass.
    let (mass, modulus) = (0.5 * templates[0].mass(), modulus());
    let duration = 2.868 * (mass * mass / (RADIUS * modulus * modulus * speed)).powf(0.2);
    let model = ContactParams { pair: PairParams { restitution: 1.0, ..MATERIAL.pair }, ..MATERIAL };
    let mut engine = alone(TANK, model.into(), vec![floor()], Vec3::zeros(), templates, &[falling]);
    for _ in 0..50 {
        run(&mut engine, 1, duration / 200.0);
        let states = engine.contact_states(&Comm::Solo);
        let keys: Vec<ContactKey> = states.iter().map(ContactState::key).collect();
        assert_eq!(keys.iter().map(|key| key.parts).collect::<Vec<_>>(), [[0, 0], [1, 0]]);
        assert_eq!(engine.records().iter().map(|(key, _)| key).collect::<Vec<_>>(), keys);
        assert!((states[0].force[2] / states[1].force[2] - 1.0).abs() < 1e-9);
        assert!((states[1].point[0] - states[0].point[0] - 2.0 * RADIUS).abs() < 1e-9);
    }
    run(&mut engine, 400, duration / 200.0);
    assert_eq!((engine.contacts().begun, engine.contacts().count), (2, 0));
    let after = first(&engine);
    assert!((after.velocity[2] / speed - 1.0).abs() < 2e-3, "{after:?}");
    assert!(after.angular_velocity().norm() * RADIUS < 1e-6 * speed, "{after:?}");
}

/// A box that falls on a corner, a little tilted.
fn on_a_corner(id: u64, at: Vec3) -> Particle {
    let down = Quat::rotation_between(&(EDGES * -0.5), &-Vec3::z()).unwrap();
    let mut body = Particle::at(id, 0, at);
    body.set_orientation(&(Quat::from_scaled_axis(Vec3::new(0.1, 0.15, 0.0)) * down));
    body.velocity = [0.0, 0.0, -0.3];
    body
}

/// Edges of a box (m).
const EDGES: Vec3 = Vec3::new(1.2e-3, 1.0e-3, 0.8e-3);

#[test]
fn a_box_cut_in_two_bounces_off_a_floor_and_off_its_like_as_the_box_does() {
    let below = Vec3::repeat(6e-3);
    let above = below + Vec3::new(0.3e-3, 0.0, 0.5 * EDGES.z + 0.5 * EDGES.norm());
    let floored = vec![on_a_corner(0, Vec3::new(6e-3, 6e-3, 0.5 * EDGES.norm()))];
    for (walls, bodies) in
        [(vec![floor()], floored), (Vec::new(), vec![Particle::at(0, 0, below), on_a_corner(1, above)])]
    {
        let shapes: [Arc<dyn Shape>; 2] = [Arc::new(Cuboid::new(EDGES).unwrap()), halves(EDGES)];
        let [mut whole, mut cut] =
            shapes.map(|shape| alone(TANK, MATERIAL.into(), walls.clone(), GRAVITY, made_of(shape), &bodies));
        let (mut steps, mut touched) = (0, 0);
        while touched == 0 || whole.contacts().count > 0 {
            run(&mut whole, 1, 2e-6);
            run(&mut cut, 1, 2e-6);
            let [one, other] = [&whole, &cut].map(|engine| engine.contact_states(&Comm::Solo));
            assert_eq!(one.len(), other.len(), "step {steps}");
            for (one, other) in one.iter().zip(&other) {
                let off = Vec3::from(one.force) - Vec3::from(other.force);
                assert!(off.norm() < 1e-6 * Vec3::from(one.force).norm(), "{one:?} {other:?}");
            }
            touched += one.len();
            steps += 1;
            assert!(steps < 5000, "{touched} contacts");
        }
        assert!(touched > 10, "{touched}");
        for (a, b) in whole.particles().particles.iter().zip(&cut.particles().particles) {
            assert!((a.position() - b.position()).norm() < 1e-7 * EDGES.x, "{a:?} {b:?}");
            assert!((a.velocity() - b.velocity()).norm() < 1e-6 * 0.3, "{a:?} {b:?}");
            assert!((a.angular_velocity() - b.angular_velocity()).norm() * EDGES.x < 1e-6 * 0.3);
        }
    }
}

/// Spheres of this radius (m) at places along x (m).
fn spheres_at(radius: f64, places: &[f64]) -> Arc<dyn Shape> {
    let at = |x: &f64| Part {
        shape: Arc::new(crate::shape::Sphere { radius }),
        position: Vec3::x() * *x,
        orientation: Quat::identity(),
    };
    Arc::new(Composite::new(places.iter().map(at).collect()).unwrap().0)
}

/// Highest force (N) of an impact on a floor at 0.1 m/s, and the speed after it over that before.
fn impact(shape: Arc<dyn Shape>) -> (f64, f64) {
    let model = ContactParams { pair: PairParams { restitution: 1.0, ..MATERIAL.pair }, ..MATERIAL };
    let mut falling = Particle::at(3, 0, Vec3::new(3e-3, 4e-3, RADIUS - 1e-12));
    falling.velocity = [0.0, 0.0, -0.1];
    let mut engine = alone(TANK, model.into(), vec![floor()], Vec3::zeros(), made_of(shape), &[falling]);
    let (mut highest, mut steps) = (0.0_f64, 0);
    while steps < 10 || engine.contacts().count > 0 {
        run(&mut engine, 1, 1e-7);
        let total: Vec3 =
            engine.contact_states(&Comm::Solo).iter().map(|state| Vec3::from(state.force)).sum();
        highest = highest.max(total.norm());
        steps += 1;
    }
    (highest, first(&engine).velocity[2] / 0.1)
}

#[test]
fn parts_in_the_same_place_are_as_stiff_as_one_of_them_and_parts_beside_each_other_as_all_of_them() {
    let [one, two, three] = [&[0.0][..], &[0.0, 0.0], &[0.0; 3]].map(|at| impact(spheres_at(RADIUS, at)));
    for (force, speed) in [two, three] {
        assert!((force / one.0 - 1.0).abs() < 1e-3, "{force} {}", one.0);
        assert!((speed / one.1 - 1.0).abs() < 1e-3);
    }
    // Nowhere near each other at the floor: as two contacts.
    let apart = spheres_at(RADIUS, &[0.0, 0.8 * RADIUS]);
    let share = apart.volume() / (2.0 * spheres_at(RADIUS, &[0.0]).volume());
    // By F ~ (m/2)^(3/5) for each half, of an impact whose force grows with the power 3/2 of the depth.
    let expected = 2.0 * one.0 * share.powf(0.6);
    let (force, speed) = impact(apart);
    assert!((force / expected - 1.0).abs() < 0.02, "{force} {expected}");
    assert!((speed - 1.0).abs() < 2e-3, "{speed}");
}

#[test]
fn a_body_without_forces_keeps_its_angular_momentum() {
    let shape = halves(Vec3::new(3.0 * RADIUS, RADIUS, 0.6 * RADIUS));
    let mut free = Particle::at(0, 0, Vec3::repeat(6e-3));
    let templates = made_of(shape);
    let spin = Vec3::new(90.0, 200.0, -40.0);
    free.angular_velocity = spin.into();
    let mut engine = alone(TANK, MATERIAL.into(), Vec::new(), Vec3::zeros(), templates.clone(), &[free]);
    let begun = Vec3::from(first(&engine).angular_momentum);
    let expected = free.orientation() * templates[0].inertia().component_mul(&spin);
    run(&mut engine, 20_000, 1e-6);
    let now = Vec3::from(first(&engine).angular_momentum);
    assert!(
        (now - begun).norm() < 1e-12 * begun.norm() && (begun - expected).norm() < 1e-12 * expected.norm()
    );
    let turn = first(&engine).orientation();
    let seen =
        turn * templates[0].inertia().component_mul(&(turn.inverse() * first(&engine).angular_velocity()));
    assert!((seen - begun).norm() < 1e-6 * begun.norm(), "{seen} {begun}");
}

#[test]
fn spheres_and_bodies_of_two_parts_move_to_the_same_bits_on_1_2_4_and_8_ranks() {
    let mut all = templates().to_vec();
    all[0] = Template { shape: spheres_at(0.6e-3, &[0.0, 0.3e-3]), ..all[0].clone() };
    all[2] = Template { shape: dumbbell(0.4e-3), ..all[2].clone() };
    let all: Arc<[Template]> = all.into();
    let (alone, begun, _, contacts) = shaken(1, &all);
    let states = bytemuck::pod_collect_to_vec::<u8, ContactState>(&contacts);
    assert!(states.iter().filter(|state| state.parts[1] == 1).count() > 20);
    for ranks in [2, 4, 8] {
        let (together, theirs, _, their_contacts) = shaken(ranks, &all);
        assert_eq!(theirs, begun, "contacts on {ranks} ranks");
        assert!(together == alone && their_contacts == contacts, "{ranks} ranks differ");
    }
}
