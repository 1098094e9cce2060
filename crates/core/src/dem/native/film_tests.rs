//! Claims about films of fluid between moving bodies.

use super::tests::{CROWDED, cluster, gathered, shake, shaken};
use super::wall_tests::{GRAVITY, MATERIAL, RADIUS, TANK, alone, first, floor, mass, run};
use super::*;
use crate::comm::on_threads;
use crate::contact::Lubrication;
use crate::contact::lubrication::{Tangential, Unresolved};
use crate::math::{Quat, TimeFunction};
use crate::particle::PrescribedMotion;
use crate::shape::composite::tests::part;
use crate::shape::{Composite, Ellipsoid, Sphere};
use crate::wall::Motion;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

const VISCOSITY: f64 = 0.1;

/// All that is singular about the normal resistance is missing, and some of the rest.
const FILM: Lubrication = Lubrication {
    viscosity: VISCOSITY,
    roughness: 1e-6,
    cell: 1e-3,
    unresolved: Unresolved {
        range: 1.0,
        linear: [0.0; 2],
        curved: 0.0,
        square: 0.0,
        bulging: 0.0,
        tangential: [Tangential::plain([0.1, 0.3]); 2],
    },
};

fn lubricated(lubrication: Lubrication) -> ContactModel {
    ContactModel { lubrication: Some(lubrication), ..MATERIAL.into() }
}

fn spheres() -> Arc<[Template]> {
    [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into()
}

/// In a ball of the same radius.
fn ellipsoids() -> Arc<[Template]> {
    let shape = Ellipsoid::new(Vec3::new(RADIUS, 0.9 * RADIUS, 0.7 * RADIUS)).unwrap();
    [Template { shape: Arc::new(shape), density: 2500.0, material: 0 }].into()
}

/// Two ellipsoids that touch, in a ball of the same radius.
fn twins() -> Arc<[Template]> {
    let half = |x: f64| part(Ellipsoid::new(Vec3::new(0.5, 0.45, 0.35) * RADIUS).unwrap(), Vec3::x() * x);
    let (shape, _) = Composite::new([-0.5 * RADIUS, 0.5 * RADIUS].map(half).into()).unwrap();
    [Template { shape: Arc::new(shape), density: 2500.0, material: 0 }].into()
}

/// Two spheres in the middle of the tank.
fn pair(gap: f64) -> [Particle; 2] {
    let half = Vec3::x() * (RADIUS + 0.5 * gap);
    [-half, half].map(|offset| Particle::at(u64::from(offset.x > 0.0), 0, Vec3::repeat(6e-3) + offset))
}

#[test]
fn two_spheres_pushed_together_close_their_gap_exponentially_down_to_the_roughness_with_any_sub_step() {
    // dh/dt = -F h / (6 pi mu R^2), R = a / 2, as inertia is negligible.
    let resistance = 6.0 * PI * VISCOSITY * 0.25 * RADIUS * RADIUS;
    let (rate, begin) = (2.0, 1e-4);
    let push = Vec3::x() * (rate * resistance);
    // The relaxation time of the velocity is 1 ms at first and 10 us at the end.
    for (dt, tolerance) in [(1e-5, 0.003), (1e-4, 0.003), (1e-3, 0.01), (4e-3, 0.03)] {
        let mut engine = alone(TANK, lubricated(FILM), Vec::new(), Vec3::zeros(), spheres(), &pair(begin));
        let loads = [push, -push].map(|force| Load { force, torque: Vec3::zeros() });
        let steps = (2.2 / dt) as u64;
        for step in 1..=steps {
            engine.advance(&Comm::Solo, &loads, dt).unwrap();
            let [a, b] = [0, 1].map(|i| engine.particles().particles[i].position[0]);
            let (gap, expected) = (b - a - 2.0 * RADIUS, begin * (-rate * step as f64 * dt).exp());
            assert!(
                step as f64 * dt < 0.1 || (gap / expected - 1.0).abs() < tolerance,
                "{dt} s, step {step}: {gap} {expected}"
            );
        }
    }
}

#[test]
fn films_between_many_bodies_only_take_energy_and_keep_both_momenta_however_long_the_sub_step() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut noise = |size: f64| Vec3::from_fn(|_, _| random.random_range(-size..size));
    let all: Vec<Particle> = (0..27_u64)
        .map(|n| {
            let place = Vec3::new((n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64) - Vec3::repeat(1.0);
            let mut particle = Particle::at(n, 0, Vec3::repeat(6e-3) + place * 2.02e-3 + noise(6e-6));
            (particle.velocity, particle.angular_velocity) = (noise(1e-4).into(), noise(0.1).into());
            particle.set_orientation(&Quat::from_scaled_axis(noise(2.0)));
            particle
        })
        .collect();
    for (templates, viscosity) in
        [spheres(), ellipsoids(), twins()].iter().flat_map(|t| [1e-3, 0.1, 1e3].map(|v| (t, v)))
    {
        let inertia = Inertia::of(&templates[0]);
        let model = lubricated(Lubrication { viscosity, ..FILM });
        let mut engine = alone(TANK, model, Vec::new(), Vec3::zeros(), templates.clone(), &all);
        let dt = 1e-2;
        let state = |engine: &Native| {
            let (mut energy, mut linear, mut angular) = (0.0, Vec3::zeros(), Vec3::zeros());
            for particle in &engine.particles().particles {
                // Half a step before the prediction.
                let velocity =
                    particle.velocity() - Vec3::from(particle.contact_force) * (0.5 * dt / inertia.mass);
                let spin =
                    Vec3::from(particle.angular_momentum) - Vec3::from(particle.contact_torque) * (0.5 * dt);
                let turning = inertia.angular_velocity(&particle.orientation(), spin);
                energy += inertia.mass * velocity.norm_squared() + spin.dot(&turning);
                linear += velocity * inertia.mass;
                // The velocity is constant along the way, so any point of it will do.
                angular +=
                    spin + (particle.position() - Vec3::repeat(6e-3)).cross(&(velocity * inertia.mass));
            }
            (0.5 * energy, linear, angular)
        };
        run(&mut engine, 1, dt);
        let (mut before, linear, angular) = state(&engine);
        let begin = before;
        for _ in 0..50 {
            run(&mut engine, 1, dt);
            let now = state(&engine);
            assert!(now.0 < before, "{viscosity} Pa s: {} after {before}", now.0);
            before = now.0;
            assert!((now.1 - linear).norm() < 1e-12 * (begin * inertia.mass).sqrt());
            assert!((now.2 - angular).norm() < 1e-9 * (begin * inertia.mass).sqrt() * 6e-3);
        }
        assert_eq!(engine.contacts().count, 0);
        assert!(viscosity < 0.01 || before < 0.3 * begin, "{viscosity} Pa s: {before} of {begin}");
    }
}

#[test]
fn a_sphere_that_moves_with_a_wall_feels_no_film_and_one_at_rest_is_dragged_along_and_turned() {
    let speed = Vec3::new(0.01, 0.0, 0.0);
    let wall = Wall { motion: Motion { velocity: speed.into(), ..Motion::default() }, ..floor() };
    let mut particle = Particle::at(3, 0, Vec3::new(5e-3, 6e-3, RADIUS + 1e-4));
    for carried in [true, false] {
        particle.velocity = if carried { speed.into() } else { [0.0; 3] };
        let mut engine =
            alone(TANK, lubricated(FILM), vec![wall.clone()], Vec3::zeros(), spheres(), &[particle]);
        run(&mut engine, 1, 1e-6);
        let moved = first(&engine);
        if carried {
            assert!(Vec3::from(moved.contact_force).norm() < 1e-12 * mass());
        } else {
            // F_s + c F_r and l n x (F_s + F_r), the sphere above the wall.
            let unit = PI * VISCOSITY * RADIUS * speed.x;
            let [sliding, rolling] = [2.0 * unit * 2.0_f64.ln(), 1.2 * unit * 4.0_f64.ln()];
            let fade = 1.0 - 1e-4;
            let torque = -(RADIUS + 0.5e-4) * (sliding - rolling) * fade;
            assert!((moved.contact_force[0] / ((sliding + rolling) * fade) - 1.0).abs() < 1e-3);
            assert!(
                (moved.contact_torque[1] / torque - 1.0).abs() < 1e-3,
                "{:?} {torque}",
                moved.contact_torque
            );
        }
    }
}

#[test]
fn a_sphere_that_sinks_to_the_floor_takes_as_long_as_its_film_says() {
    // Its weight over the film: dh/dt = -m g h / (6 pi mu a^2).
    let rate = -mass() * GRAVITY.z / (6.0 * PI * 50.0 * RADIUS * RADIUS);
    let model = lubricated(Lubrication { viscosity: 50.0, ..FILM });
    let particle = Particle::at(3, 0, Vec3::new(5e-3, 6e-3, RADIUS + 1e-4));
    let mut engine = alone(TANK, model, vec![floor()], GRAVITY, spheres(), &[particle]);
    let steps = (3.0 / rate / 1e-3) as usize;
    run(&mut engine, steps, 1e-3);
    let (gap, expected) = (first(&engine).position[2] - RADIUS, 1e-4 * (-rate * steps as f64 * 1e-3).exp());
    assert!((gap / expected - 1.0).abs() < 0.01, "{gap} {expected}");
    let state = engine.contact_states(&Comm::Solo)[0];
    assert!((Vec3::from(state.force).z / (-mass() * GRAVITY.z) - 1.0).abs() < 1e-3, "{state:?}");
    assert_eq!((engine.contacts().count, state.depth), (0, 0.0));
}

#[test]
fn a_lubricated_cluster_moves_to_the_same_bits_on_1_to_8_ranks() {
    let all = cluster();
    let mut params = shaken();
    let cell = CROWDED.dx;
    let film = Lubrication {
        viscosity: 0.01,
        roughness: 1e-6,
        cell,
        unresolved: Unresolved { range: 0.3, ..FILM.unresolved },
    };
    params.contact.as_mut().unwrap().lubrication = Some(film);
    let shaken = |templates: &Arc<[Template]>, steps: usize, ranks: usize| {
        let results = on_threads(ranks, |comm| {
            let cut = Decomposition::new(CROWDED, ranks).unwrap();
            let mut engine = Native::new(params.clone(), cut, comm.rank(), templates.clone(), &all).unwrap();
            shake(&mut engine, &comm, steps);
            let apart = engine.contact_states(&Comm::Solo).iter().filter(|state| state.depth == 0.0).count();
            let mut numbers = [apart as i64, engine.contacts().count as i64];
            comm.sum(&mut numbers);
            (gathered(&comm, &engine), numbers)
        });
        results.into_iter().next().unwrap()
    };
    let slim = Ellipsoid::new(Vec3::new(0.85, 0.8, 0.7) * RADIUS).unwrap();
    let slim = Template { shape: Arc::new(slim), density: 2500.0, material: 0 };
    let mixed = [spheres()[0].clone(), slim].into();
    for (templates, steps, films) in [(super::tests::templates(), 60, 30), (mixed, 10, 20)] {
        let (alone, numbers) = shaken(&templates, steps, 1);
        assert!(numbers[0] > films && numbers[1] > 10, "films and contacts: {numbers:?}");
        for ranks in [2, 3, 4, 8] {
            assert!(shaken(&templates, steps, ranks) == (alone.clone(), numbers), "{ranks} ranks differ");
        }
    }
}

#[test]
fn an_ellipsoid_that_sinks_flat_to_the_floor_takes_as_long_as_the_curvature_below_it_says() {
    let [a, b, c] = [RADIUS, 0.9 * RADIUS, 0.7 * RADIUS];
    let curvatures = [c / (a * a), c / (b * b)];
    let resistance =
        12.0 * PI * 50.0 / ((curvatures[0] + curvatures[1]) * (curvatures[0] * curvatures[1]).sqrt());
    let weight = -ellipsoids()[0].mass() * GRAVITY.z;
    let rate = weight / resistance;
    let model = lubricated(Lubrication { viscosity: 50.0, ..FILM });
    let particle = Particle::at(3, 0, Vec3::new(5e-3, 6e-3, c + 1e-4));
    let mut engine = alone(TANK, model, vec![floor()], GRAVITY, ellipsoids(), &[particle]);
    let steps = (3.0 / rate / 1e-3) as usize;
    run(&mut engine, steps, 1e-3);
    let (gap, expected) = (first(&engine).position[2] - c, 1e-4 * (-rate * steps as f64 * 1e-3).exp());
    assert!((gap / expected - 1.0).abs() < 0.01, "{gap} {expected}");
}

#[test]
fn an_ellipsoid_driven_at_a_tilted_one_turns_it_by_forces_and_torques_that_are_balanced() {
    let driven =
        PrescribedMotion { velocity: TimeFunction::Constant(Vec3::x() * 1e-3), ..PrescribedMotion::fixed() };
    let template = ellipsoids()[0].clone();
    let params = NativeParams {
        contact: Some(lubricated(FILM)),
        substeps: 1,
        motions: vec![driven, PrescribedMotion::default()],
        ..NativeParams::default()
    };
    let [mut a, mut b] = pair(0.0);
    b.template = 1;
    a.set_orientation(&Quat::from_scaled_axis(Vec3::new(0.0, 0.5, 0.0)));
    b.set_orientation(&Quat::from_scaled_axis(Vec3::new(0.0, 1.2, 0.3)));
    let cut = Decomposition::new(TANK, 1).unwrap();
    let mut engine = Native::new(params, cut, 0, [template.clone(), template].into(), &[a, b]).unwrap();
    run(&mut engine, 50, 1e-3);
    let state = engine.contact_states(&Comm::Solo)[0];
    let (point, force) = (Vec3::from(state.point), Vec3::from(state.force));
    let [first, second] = [0, 1].map(|i| engine.particles().particles[i]);
    for (body, sign) in [(first, 1.0), (second, -1.0)] {
        assert!((Vec3::from(body.contact_force) - force * sign).norm() < 1e-12 * force.norm());
    }
    let torques = [first, second].map(|body| Vec3::from(body.contact_torque));
    let moment = (second.position() - first.position()).cross(&force);
    // The bodies have moved on since.
    assert!((torques[0] + torques[1] - moment).norm() < 1e-2 * torques[1].norm(), "{torques:?} {moment}");
    let lever = point - second.position();
    let couple = torques[1] + lever.cross(&force);
    assert!(couple.norm() > 0.05 * torques[1].norm(), "rolling has a couple: {couple}");
    // They slide and roll.
    let across = force.cross(&Vec3::from(state.normal)).norm() / force.norm();
    assert!(across > 1e-3, "{across}");
    // The second is light: the film lets the bodies approach slowly.
    let spin = Vec3::from(second.angular_velocity).norm();
    assert!(spin > 1e-2 && second.velocity[0] > 1e-4, "{spin} {:?}", second.velocity);
}

#[test]
fn two_spheres_that_are_driven_together_feel_the_film_of_their_velocity_and_one_that_is_held_takes_all_of_the_other()
 {
    let speed = Vec3::new(1e-3, 0.0, 0.0);
    let driven = |velocity: Vec3| PrescribedMotion {
        velocity: TimeFunction::Constant(velocity),
        ..PrescribedMotion::fixed()
    };
    // At a gap of 1e-4 m.
    let resistance = 6.0 * PI * VISCOSITY * 0.25 * RADIUS * RADIUS / 1e-4 * (1.0 - 1e-4);
    for (motions, velocity) in [
        (vec![driven(speed), driven(-speed)], 2.0 * speed.x),
        (vec![driven(speed), PrescribedMotion::fixed()], speed.x),
        (vec![driven(speed), PrescribedMotion::default()], speed.x),
    ] {
        let templates: Arc<[Template]> = [spheres()[0].clone(), spheres()[0].clone()].into();
        let free = motions[1].is_free();
        let contact = Some(lubricated(FILM));
        let params = NativeParams { contact, substeps: 1, motions, ..NativeParams::default() };
        let [a, mut b] = pair(1e-4);
        b.template = 1;
        let cut = Decomposition::new(TANK, 1).unwrap();
        let mut engine = Native::new(params, cut, 0, templates, &[a, b]).unwrap();
        // Long against the time in which the film stops the other sphere.
        run(&mut engine, if free { 20 } else { 1 }, 1e-3);
        let [first, second] = [0, 1].map(|i| engine.particles().particles[i]);
        if free {
            assert!((second.velocity[0] / speed.x - 1.0).abs() < 1e-2, "{:?}", second.velocity);
        } else {
            let force = first.contact_force[0];
            assert!(
                (force / (-resistance * velocity) - 1.0).abs() < 1e-3,
                "{force} {}",
                -resistance * velocity
            );
            assert_eq!(second.contact_force[0].to_bits(), (-force).to_bits());
        }
    }
}
