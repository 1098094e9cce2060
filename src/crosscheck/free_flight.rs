//! Free flight under loads: constant, and another one in every step.
//!
//! Under loads that are constant during a step of length `h` each, a sphere flies exactly
//!
//! ```text
//! v' = v + h F / m,   x' = x + h v + h^2 F / (2 m),   w' = w + h T / I
//! ```

use super::tools::{DENSITY, RADIUS, Random, SAME, Scene, given, worst};
use super::{Findings, Overlay};
use crate::comm::Comm;
use crate::dem::{DemEngine, Load};
use crate::error::Result;
use crate::math::Vec3;
use std::path::Path;

/// Steps, each with its load.
const STEPS: usize = 500;

/// Length of a step (s).
const STEP: f64 = 1e-5;

const EXACT: &str = "largest difference to the exact parabolas at any step, over the largest value at any step: rounding of \
                     500 steps of up to 10 sub-steps";

/// Position (m), velocity (m/s) and spin (1/s).
#[derive(Clone, Copy, Debug)]
struct Flight([Vec3; 3]);

const NAMES: [&str; 3] = ["position (m)", "velocity (m/s)", "spin (1/s)"];

/// Loads of every step on both spheres.
fn loads(random: bool) -> Vec<[Load; 2]> {
    let mass = DENSITY * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let mut numbers = Random(7);
    // Accelerations of up to 100 m/s^2, so that the spheres move by about a radius.
    let mut draw = || Load {
        force: numbers.vector() * (100.0 * mass),
        torque: numbers.vector() * (100.0 * mass * RADIUS),
    };
    let first = [draw(), draw()];
    (0..STEPS)
        .map(|_| if random { [draw(), draw()] } else { first })
        .collect()
}

/// The exact flight of every sphere, frame by frame.
fn exact(scene: &Scene, loads: &[[Load; 2]]) -> Vec<[Flight; 2]> {
    let start = [0, 1].map(|id| {
        let p = &scene.particles[id];
        Flight([p.position(), p.velocity(), p.angular_velocity()])
    });
    let mut frames = vec![start];
    for loads in loads {
        let last = frames[frames.len() - 1];
        frames.push(std::array::from_fn(|id| {
            let Flight([x, v, w]) = last[id];
            let (mass, inertia) = (scene.mass(id), 0.4 * scene.mass(id) * scene.radius(id).powi(2));
            let acceleration = loads[id].force / mass;
            Flight([
                x + (v + acceleration * (0.5 * STEP)) * STEP,
                v + acceleration * STEP,
                w + loads[id].torque * (STEP / inertia),
            ])
        }));
    }
    frames
}

/// The flight in an engine.
fn flown(engine: &mut dyn DemEngine, loads: &[[Load; 2]]) -> Result<Vec<[Flight; 2]>> {
    let state = |engine: &dyn DemEngine| {
        let owned = engine.particles().owned();
        [0, 1].map(|id| {
            let p = &owned[id];
            Flight([p.position(), p.velocity(), p.angular_velocity()])
        })
    };
    let mut frames = vec![state(engine)];
    for loads in loads {
        engine.advance(&Comm::Solo, loads, STEP)?;
        frames.push(state(engine));
    }
    Ok(frames)
}

/// H17 and H18: constant and random loads, with 1 and 10 sub-steps.
pub(super) fn loaded(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for random in [false, true] {
        for substeps in [1, 10] {
            let kind = if random { "random" } else { "constant" };
            let mut scene = Scene::glass(format!("free-flight-{kind}-{substeps}"), 1.0, 0.0, SAME);
            scene.substeps = substeps;
            scene.add(
                0,
                Vec3::new(3e-3, 3e-3, 3e-3),
                Vec3::new(0.1, -0.05, 0.02),
                Vec3::new(10.0, 20.0, -5.0),
            );
            scene.add(0, Vec3::new(7e-3, 7e-3, 7e-3), Vec3::zeros(), Vec3::zeros());
            let loads = loads(random);
            let exact = exact(&scene, &loads);
            let native = flown(&mut scene.native()?, &loads)?;
            let liggghts = flown(&mut scene.liggghts(directory)?, &loads)?;
            for (i, name) in NAMES.iter().enumerate() {
                let frames = exact.iter().flatten();
                let largest = worst(frames.map(|flight| flight.0[i].norm()));
                let off = |frames: &[[Flight; 2]]| {
                    let pairs = frames.iter().flatten().zip(exact.iter().flatten());
                    worst(pairs.map(|(a, b)| (a.0[i] - b.0[i]).norm())) / largest
                };
                let difference = worst([off(&native), off(&liggghts)]);
                let last = |frames: &[[Flight; 2]]| Some(frames[STEPS][0].0[i].x);
                let values = [last(&native), last(&liggghts), last(&exact)];
                let quantity =
                    format!("{name}, {kind} loads, sub-steps: {substeps}; shown: x of the first at the end");
                findings.push(given(quantity, values, difference, 1e-12, EXACT));
            }
            if random && substeps == 10 {
                findings.overlays.push(plot([&native, &liggghts, &exact]));
            }
        }
    }
    Ok(findings)
}

/// Velocity of the first sphere along x.
fn plot(ways: [&Vec<[Flight; 2]>; 3]) -> Overlay {
    let curve = |frames: &Vec<[Flight; 2]>| {
        let points = frames.iter().enumerate();
        points
            .map(|(k, frame)| [k as f64 * STEP * 1e3, frame[0].0[1].x])
            .collect()
    };
    let names = ["native", "LIGGGHTS", "exact"];
    Overlay::new(
        "velocity",
        "Free flight under random loads, 10 sub-steps",
        ["time (ms)", "velocity along x (m/s)"],
        names
            .iter()
            .zip(ways)
            .map(|(name, way)| ((*name).to_owned(), curve(way))),
    )
}
