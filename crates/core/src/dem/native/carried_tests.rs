//! Claims about spheres that walls carry: pistons, belts, turntables, pipes.

use super::wall_tests::{
    GRAVITY, MATERIAL, RADIUS, engine, first, floor, mass, modulus, plane, run, sliding,
};
use super::*;
use crate::contact::PairParams;
use crate::wall::{Motion, Surface};

/// A sphere that lies on the floor under gravity as deep as its weight presses it.
fn lying(id: u64, x: f64, y: f64) -> Particle {
    let stiffness = 4.0 / 3.0 * modulus() * RADIUS.sqrt();
    let depth = (mass() * 9.81 / stiffness).powf(2.0 / 3.0);
    Particle::at(id, 0, Vec3::new(x, y, RADIUS - depth))
}

#[test]
fn a_piston_and_a_paddle_knock_a_resting_sphere_away_at_twice_their_speed() {
    // Both reach the sphere after 10 ms at 0.1 m/s: the piston by 1 mm, the paddle, 5 mm from its axis, by 0.2.
    let mut piston = floor();
    piston.motion.velocity = (Vec3::z() * 0.1).into();
    let pivot = Vec3::new(1e-3, 0.0, 1e-3);
    let mut paddle = plane("paddle", pivot, Vec3::new(0.2_f64.sin(), 0.0, 0.2_f64.cos()));
    paddle.motion.angular_velocity = (Vec3::y() * -20.0).into();
    paddle.motion.pivot = pivot;
    for wall in [piston, paddle] {
        let resting = Particle::at(0, 0, Vec3::new(6e-3, 3e-3, 2e-3));
        let mut engine = engine(sliding(0.0, 1.0), vec![wall], Vec3::zeros(), &[resting]);
        run(&mut engine, 9_900, 1e-6);
        assert_eq!(engine.contacts().begun, 0, "not yet there");
        run(&mut engine, 600, 1e-6);
        assert_eq!((engine.contacts().begun, engine.contacts().count), (1, 0));
        let velocity = first(&engine).velocity();
        println!("knocked away at {:?} of twice the speed", velocity / 0.2);
        assert!((velocity / 0.2 - Vec3::z()).norm() < 5e-3);
    }
}

#[test]
fn a_belt_speeds_a_sphere_up_with_mu_g_until_it_rolls_at_two_sevenths_of_the_speed() {
    let mut belt = floor();
    belt.motion.velocity = Vec3::new(0.05, 0.0, 0.0).into();
    let pair = PairParams { transition_velocity: 1e-4, ..sliding(0.2, 0.5) };
    let mut engine = engine(pair, vec![belt], GRAVITY, &[lying(0, 3e-3, 6e-3)]);
    // It slides until mu g t = 2/7 V, at 7.3 ms.
    run(&mut engine, 500, 1e-5);
    let speed = first(&engine).velocity[0];
    println!("after 5 ms {:.5} of mu g t", speed / (0.2 * 9.81 * 5e-3));
    assert!((speed / (0.2 * 9.81 * 5e-3) - 1.0).abs() < 5e-3);
    run(&mut engine, 1000, 1e-5);
    let (speed, spin) = (first(&engine).velocity[0], first(&engine).angular_velocity[1]);
    println!("rolls at {:.5} of 2/7", speed / 0.05 * 3.5);
    assert!((speed / 0.05 - 2.0 / 7.0).abs() < 2e-3, "{speed}");
    assert!((speed - spin * RADIUS - 0.05).abs() < 1e-4, "the belt does not slip under it");
}

#[test]
fn a_sphere_on_a_turntable_rolls_in_a_circle_at_two_sevenths_of_its_rate() {
    // dv/dt = 2/7 W x v for a sphere that rolls on a plate turning at W (Weltner 1979).
    let rate: f64 = 20.0;
    let mut plate = floor();
    plate.motion.angular_velocity = (Vec3::z() * rate).into();
    plate.motion.pivot = Vec3::new(6e-3, 6e-3, 0.0);
    let mut sphere = lying(0, 8e-3, 6e-3);
    let velocity = Vec3::new(0.01, 0.0, 0.0);
    let matter = (Vec3::z() * rate).cross(&Vec3::new(2e-3, 0.0, 0.0));
    // No slip: v - w x R z = the speed of the plate below.
    let spin = Vec3::z().cross(&(velocity - matter)) / RADIUS;
    sphere.velocity = velocity.into();
    sphere.angular_velocity = spin.into();
    let pair = PairParams { transition_velocity: 1e-5, ..sliding(0.3, 0.5) };
    let mut engine = engine(pair, vec![plate], GRAVITY, &[sphere]);
    let turn = std::f64::consts::TAU / (2.0 / 7.0 * rate);
    let dt = 1e-5;
    let quarter = (0.25 * turn / dt).round() as usize;
    run(&mut engine, quarter, dt);
    let there = first(&engine).velocity();
    println!("after a quarter {there:?}");
    assert!((there - Vec3::new(0.0, 0.01, 0.0)).norm() < 3e-4);
    run(&mut engine, 3 * quarter, dt);
    let back = first(&engine).velocity();
    let missed = (first(&engine).position() - sphere.position()).norm();
    println!("after a turn {back:?}, missed by {missed:.1e} m");
    assert!((back - velocity).norm() < 6e-4);
    assert!(missed < 0.05 * 0.01 / (2.0 / 7.0 * rate), "{missed:e} m from where it began");
}

/// A pipe of 5 mm along y.
fn pipe() -> Wall {
    Wall {
        name: "pipe".into(),
        surface: Surface::Cylinder {
            point: Vec3::new(6e-3, 0.0, 6e-3),
            axis: Vec3::y(),
            radius: 5e-3,
            pipe: true,
        },
        motion: Motion::default(),
        material: 0,
    }
}

#[test]
fn a_sphere_in_a_pipe_swings_like_a_pendulum_slower_if_it_rolls() {
    // Small swings of length R_pipe - R: rolling adds 2/5 of the inertia.
    for (friction, inertia) in [(0.0, 1.0_f64), (0.5, 1.4)] {
        let pair = PairParams { transition_velocity: 1e-6, ..sliding(friction, 0.5) };
        let arm: f64 = 4e-3;
        let angle: f64 = 0.05;
        let place = Vec3::new(6e-3 + arm * angle.sin(), 3e-3, 6e-3 - arm * angle.cos());
        let mut engine = engine(pair, vec![pipe()], GRAVITY, &[Particle::at(0, 0, place)]);
        let period = std::f64::consts::TAU * (inertia * arm / 9.81).sqrt();
        let dt = period / 20_000.0;
        let mut crossings = Vec::new();
        let mut last = first(&engine).position[0] - 6e-3;
        for n in 0..44_000 {
            run(&mut engine, 1, dt);
            let now = first(&engine).position[0] - 6e-3;
            if now * last < 0.0 {
                crossings.push(f64::from(n) * dt);
            }
            last = now;
        }
        let measured = crossings[2] - crossings[0];
        println!("friction {friction}: period off by {:.1e}", measured / period - 1.0);
        assert!((measured / period - 1.0).abs() < 5e-3, "{}", measured / period);
    }
}

#[test]
fn a_sphere_lies_still_at_the_bottom_of_a_pipe() {
    let mut engine =
        engine(MATERIAL.pair, vec![pipe()], GRAVITY, &[Particle::at(0, 0, Vec3::new(6e-3, 3e-3, 2e-3))]);
    run(&mut engine, 20_000, 2e-6);
    let particle = first(&engine);
    assert!((particle.position() - Vec3::new(6e-3, 3e-3, 2e-3)).norm() < 0.01 * RADIUS);
    assert!(particle.velocity().norm() < 1e-5, "{:?}", particle.velocity);
}
