//! A sphere and a spheroid in simple shear between moving plates: `validation/shear`.

use super::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

const SPHERE: &str = include_str!("../../../../validation/shear/sphere.toml");
const SPHEROID: &str = include_str!("../../../../validation/shear/spheroid.toml");
const REFERENCE: &str = include_str!("../../../../validation/shear/reference.csv");

pub(super) const CASE: Case = Case {
    name: "shear",
    question: "spin of a sphere, and Jeffery orbit of a 2:1 spheroid, in simple shear",
    source: "Jeffery (1922), doi:10.1098/rspa.1922.0078",
    parts: &[Part::quick(11.0, sphere), Part::quick(20.0, spheroid)],
};

/// Shear rate (1/s) between the plates of a case.
pub(super) fn shear_rate(setup: &Setup) -> f64 {
    let speed = |name: &str| {
        let wall = setup.walls.iter().find(|wall| wall.name == name);
        wall.map_or(f64::NAN, |wall| wall.velocity(Vec3::zeros(), 0.0).x)
    };
    (speed("z+") - speed("z-")) / setup.domain.size().z
}

/// Runs a case and calls `look(time, particle)` for its particle after every step until it says so.
fn run(setup: &Setup, mut look: impl FnMut(f64, &Particle) -> bool) -> Result<()> {
    let mut run = Simulation::solo(setup)?;
    while run.steps_done() < setup.plan.end_step {
        run.advance(1)?;
        if !look(run.steps_done() as f64 * setup.time_step, &run.particles()[0]) {
            break;
        }
    }
    Ok(())
}

fn sphere(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(SPHERE, CASE.name, &[])?;
    let rate = shear_rate(&setup);
    let (mut spin, mut before, mut samples) = (0.0, 0.0, 0.0);
    run(&setup, |time, sphere| {
        // The flow starts from rest; the last unit of strain counts.
        if rate * time > 4.6 {
            spin += sphere.angular_velocity[1];
            samples += 1.0;
        } else {
            before = sphere.angular_velocity[1];
        }
        true
    })?;
    let reynolds = rate * (0.5 * setup.diameter).powi(2) / setup.expect_fluid().viscosity;
    let expected = 0.5 * (1.0 - 0.108 * reynolds.powf(1.5));
    let quantity = "sphere: spin over shear rate (-)";
    found
        .relative(quantity, spin / samples / rate, expected, 0.01)
        .source("Meibohm et al. (2016), doi:10.1103/PhysRevFluids.1.084203");
    found.note("sphere: Reynolds number of the shear", reynolds);
    found.note("sphere: change of the spin over the last unit of strain", spin / samples / before - 1.0);
    Ok(())
}

fn spheroid(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(SPHEROID, CASE.name, &[])?;
    let rate = shear_rate(&setup);
    // Angle of the long axis in the plane of the flow, without jumps; times at which it lies along the gradient.
    let (mut angle, mut last, mut upright) = (0.0, 0.0, Vec::new());
    let (mut fastest, mut slowest, mut aside) = (0.0_f64, f64::INFINITY, 0.0_f64);
    let mut course = Vec::new();
    run(&setup, |time, particle| {
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
            course.push([angle / PI, spin]);
        }
        upright.len() < 2
    })?;
    let &[first, second] = &upright[..] else {
        return Err(unsteady("half turns of the spheroid", angle / PI));
    };
    let table = Table::new(REFERENCE);
    let period = 2.0 * (second - first) * rate;
    let expected = table.at("r", 2.0, "T_gamma");
    found.relative("spheroid: period times shear rate (-)", period, expected, 0.02);
    let [most, least] = ["phidot_max", "phidot_min"].map(|column| table.at("r", 2.0, column));
    let quantity = "spheroid: fastest over slowest spin (-)";
    found.relative(quantity, fastest / slowest, most / least, 0.05);
    let quantity = "spheroid: sine of the angle to the plane of the flow (-)";
    found.absolute(quantity, aside, 0.0, 0.1).source("symmetry");
    found.note("spheroid: fastest spin over shear rate", fastest);
    found.note("spheroid: slowest spin over shear rate", slowest);
    // By Jeffery, with the angle from the flow.
    let orbit = (0..=200).map(|k| {
        let half_turns = 0.5 + f64::from(k) / 200.0;
        let (sin, cos) = (half_turns * PI).sin_cos();
        [half_turns, most * sin * sin + least * cos * cos]
    });
    found.plot(
        "orbit",
        "Spin of a 2:1 spheroid in shear over half a turn",
        ["angle of the long axis from the flow over pi (-)", "spin over shear rate (-)"],
        [reference("Jeffery", orbit), measured("measured", course)],
    );
    Ok(())
}
