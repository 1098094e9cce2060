//! Bodies on a slope: `validation/slope`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/slope/case.toml");

pub(super) const CASE: Case = Case {
    name: "slope",
    question: "cube, cylinder and spheres on a slope: at rest, sliding, rolling",
    source: "rigid bodies under gravity and Coulomb's friction",
    parts: &[
        Part::quick(2.0, |context, found| rest(context, 1.0, found)),
        Part::full(5.0, |context, found| rest(context, 10.0, found)),
        Part::full(5.0, on_its_side),
        Part::quick(1.0, motion),
    ],
};

const GRAVITY: f64 = 9.81;
/// Kinetic and rolling friction (-).
const KINETIC: f64 = 0.4;
const ROLLING: f64 = 0.3;
/// Furthest that a body at rest may creep (m).
const CREEP: f64 = 1e-9;
/// Of accelerations, as a part.
const ACCELERATION: f64 = 5e-3;

/// The bodies under gravity on a slope, after some seconds.
fn start(context: &SuiteContext, slope: f64, own: &[String], seconds: f64) -> Result<(Simulation, f64)> {
    let unit = GRAVITY / slope.hypot(1.0);
    let gravity = format!("driving.gravity=[{:e}, 0.0, {:e}]", slope * unit, -unit);
    let setup = context.setup(TEXT, CASE.name, &[&[gravity], own].concat())?;
    let mut run = Simulation::solo(&setup)?;
    run.advance((seconds / setup.time_step).round() as u64)?;
    Ok((run, setup.time_step))
}

fn rest(context: &SuiteContext, seconds: f64, found: &mut Findings) -> Result<()> {
    let bodies = [(0, "cube"), (1, "cylinder"), (2, "sphere with rolling resistance")];
    creep(context, &[], &bodies, seconds, found)
}

/// Cylinders that resist rolling and twisting, down the slope and across it.
fn on_its_side(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let lying = |x: f64, axis: &str| {
        format!("{{ position = [{x}, 0.015, 2e-3], orientation = {{ axis = {axis}, angle = 90 }} }}")
    };
    let own = [
        "particles.1.material=\"sticky\"".to_string(),
        "contact.twisting=\"marshall\"".to_string(),
        format!("particles.1.list=[{}, {}]", lying(0.02, "[0, 1, 0]"), lying(0.06, "[1, 0, 0]")),
    ];
    let bodies =
        [(1, "cylinder on its side, down the slope,"), (2, "cylinder on its side, across the slope,")];
    creep(context, &own, &bodies, 10.0, found)
}

fn creep(
    context: &SuiteContext,
    own: &[String],
    bodies: &[(usize, &str)],
    seconds: f64,
    found: &mut Findings,
) -> Result<()> {
    let (mut run, dt) = start(context, 0.199, own, 0.5)?;
    let before: Vec<Vec3> = run.particles().iter().map(Particle::position).collect();
    run.advance((seconds / dt).round() as u64)?;
    for &(n, what) in bodies {
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
    let (mut run, dt) = start(context, slope, &[], 0.05)?;
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
