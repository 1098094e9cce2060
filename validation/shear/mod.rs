//! A sphere and a spheroid in simple shear between moving plates; see the README of this folder.

use crate::support::{compare, note, reference, setup_of};
use std::f64::consts::{FRAC_PI_2, PI};
use turbid::case::Setup;
use turbid::comm::Comm;
use turbid::domain::Decomposition;
use turbid::math::Vec3;
use turbid::particle::Particle;
use turbid::simulation::Simulation;

const CASE: &str = "shear";

/// Shear rate (1/s) between the plates of a case.
fn shear_rate(setup: &Setup) -> f64 {
    let speed = |name: &str| {
        let wall = setup.walls.iter().find(|wall| wall.name == name).unwrap();
        wall.velocity(Vec3::zeros(), 0.0).x
    };
    (speed("z+") - speed("z-")) / setup.domain.size().z
}

/// Runs a case and calls `look(time, particle)` for its particle after every step until it says so.
fn run(setup: &Setup, decomposition: &Decomposition, mut look: impl FnMut(f64, &Particle) -> bool) {
    let mut simulation = Simulation::<f64>::new(setup, decomposition, Comm::Solo).unwrap();
    while simulation.steps_done() < setup.end_step {
        simulation.step().unwrap();
        let time = simulation.steps_done() as f64 * setup.units.dt;
        if !look(time, &simulation.dem().particles().particles[0]) {
            break;
        }
    }
}

#[test]
fn a_sphere_in_shear_turns_at_half_the_shear_rate() {
    let (setup, decomposition) = setup_of(CASE, "sphere", &[]);
    let rate = shear_rate(&setup);
    let (mut spin, mut before, mut samples) = (0.0, 0.0, 0.0);
    run(&setup, &decomposition, |time, sphere| {
        // The flow starts from rest; the last unit of strain counts.
        if rate * time > 4.6 {
            spin += sphere.angular_velocity[1];
            samples += 1.0;
        } else {
            before = sphere.angular_velocity[1];
        }
        true
    });
    let reynolds = rate * (0.5 * setup.scales.diameter).powi(2) / setup.scales.viscosity;
    let expected = 0.5 * rate * (1.0 - 0.108 * reynolds.powf(1.5));
    note("sphere: Reynolds number of the shear", reynolds);
    note(
        "sphere: change of the spin over the last unit of strain",
        spin / samples / before - 1.0,
    );
    compare(
        "sphere: spin over shear rate",
        spin / samples / rate,
        expected / rate,
        0.02,
    );
}

#[test]
fn a_spheroid_in_shear_follows_its_jeffery_orbit() {
    let (setup, decomposition) = setup_of(CASE, "spheroid", &[]);
    let rate = shear_rate(&setup);
    // Angle of the long axis in the plane of the flow, without jumps; times at which it lies along the gradient.
    let (mut angle, mut last, mut upright) = (0.0, 0.0, Vec::new());
    let (mut fastest, mut slowest, mut aside) = (0.0_f64, f64::INFINITY, 0.0_f64);
    run(&setup, &decomposition, |time, particle| {
        let axis = particle.orientation() * Vec3::x();
        aside = aside.max(axis.y.abs());
        // From the flow towards the gradient; the shear turns it the other way.
        let now = -f64::atan2(axis.z, axis.x);
        let turned = (now - last + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
        last = now;
        for quarter in [1.0, 3.0] {
            let target = quarter * FRAC_PI_2;
            if angle < target && angle + turned >= target {
                upright.push(time);
            }
        }
        angle += turned;
        let spin = particle.angular_velocity[1] / rate;
        if !upright.is_empty() {
            fastest = fastest.max(spin);
            slowest = slowest.min(spin);
        }
        upright.len() < 2
    });
    note(
        "spheroid: how far the axis leaves the plane of the flow (sine)",
        aside,
    );
    assert!(aside < 0.1);
    assert_eq!(upright.len(), 2, "turned by {} half turns only", angle / PI);
    let expected = reference(CASE, "r", 2.0, "T_gamma");
    compare(
        "spheroid: period times shear rate",
        2.0 * (upright[1] - upright[0]) * rate,
        expected,
        0.05,
    );
    note("spheroid: fastest spin over shear rate, 0.8 by Jeffery", fastest);
    note("spheroid: slowest spin over shear rate, 0.2 by Jeffery", slowest);
    compare("spheroid: ratio of the extremes", fastest / slowest, 4.0, 0.15);
}
