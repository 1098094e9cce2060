//! Bodies on a slope: `validation/slope`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/slope/case.toml");

pub(super) const CASE: Case = Case {
    name: "slope",
    question: "cube, cylinder and spheres on a slope: at rest, sliding, rolling",
    source: "rigid bodies under gravity and Coulomb's friction",
    parts: &[Part::quick(2.0, rest), Part::full(5.0, rest_for_long), Part::quick(1.0, motion)],
};

const GRAVITY: f64 = 9.81;
/// Kinetic and rolling friction (-).
const KINETIC: f64 = 0.4;
const ROLLING: f64 = 0.3;
/// Furthest that a body at rest may creep (m).
const CREEP: f64 = 1e-9;
/// Of accelerations, as a part.
const ACCELERATION: f64 = 5e-3;

/// Shapes of the second body: contacts of a cylinder are sampled, which takes its time.
const CYLINDER: &str = "{ cylinder = { diameter = 4e-3, length = 2e-3 } }";
const SMALL_CUBE: &str = "{ cube = { edge = 2e-3 } }";

/// The bodies under gravity on a slope, after some seconds.
fn start(context: &SuiteContext, (slope, second): (f64, &str), seconds: f64) -> Result<(Simulation, f64)> {
    let unit = GRAVITY / slope.hypot(1.0);
    let gravity = format!("driving.gravity=[{:e}, 0.0, {:e}]", slope * unit, -unit);
    let own = [gravity, format!("particles.1.shape={second}")];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance((seconds / setup.time_step).round() as u64)?;
    Ok((run, setup.time_step))
}

fn rest(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    at_rest(context, (CYLINDER, "cylinder"), 1.0, found)
}

fn rest_for_long(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    at_rest(context, (SMALL_CUBE, "small cube"), 10.0, found)
}

fn at_rest(
    context: &SuiteContext,
    (second, name): (&str, &str),
    seconds: f64,
    found: &mut Findings,
) -> Result<()> {
    let (mut run, dt) = start(context, (0.199, second), 0.5)?;
    let before: Vec<Vec3> = run.particles().iter().map(Particle::position).collect();
    run.advance((seconds / dt).round() as u64)?;
    for (n, what) in ["cube", name, "sphere with rolling resistance"].into_iter().enumerate() {
        let crept = (run.particles()[n].position() - before[n]).norm();
        let quantity = format!("way of a {what} at rest on a slope of 0.199 in {seconds} s (m)");
        found
            .absolute(quantity, crept, 0.0, CREEP)
            .source("the angle of friction is 0.46 rad, the slope 0.20");
    }
    Ok(())
}

fn motion(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let slope: f64 = 0.6;
    let (mut run, dt) = start(context, (slope, CYLINDER), 0.05)?;
    let before: Vec<f64> = run.particles().iter().map(|body| body.velocity().x).collect();
    let steps = (0.1 / dt).round();
    run.advance(steps as u64)?;
    let unit = GRAVITY / slope.hypot(1.0);
    for (n, what, expected, source) in [
        (0, "sliding cube", unit * (slope - KINETIC), "g (sin - mu_k cos)"),
        (1, "sliding cylinder", unit * (slope - KINETIC), "g (sin - mu_k cos)"),
        (2, "sphere with rolling resistance", unit * (slope - ROLLING) * 5.0 / 7.0, "5/7 g (sin - mu_r cos)"),
        (3, "rolling sphere", unit * slope * 5.0 / 7.0, "5/7 g sin"),
    ] {
        let measured = (run.particles()[n].velocity().x - before[n]) / (steps * dt);
        let quantity = format!("acceleration of a {what} on a slope of 0.6 (m/s^2)");
        found.relative(quantity, measured, expected, ACCELERATION).source(source);
    }
    Ok(())
}
