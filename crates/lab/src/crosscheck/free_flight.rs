//! Free flight under loads: constant, and another one in every step.
//!
//! Under loads that are constant during a step of length `h` each, a sphere flies exactly
//!
//! ```text
//! v' = v + h F / m,   x' = x + h v + h^2 F / (2 m),   w' = w + h T / I
//! ```

use super::prelude::*;

const STEPS: usize = 500;

const STEP: f64 = 1e-5;

const EXACT: Limit =
    (1e-12, "over the largest value at any step: rounding of 500 steps of up to 10 sub-steps");

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
    (0..STEPS).map(|_| if random { [draw(), draw()] } else { first }).collect()
}

fn states(particles: &[Particle]) -> [State; 2] {
    [0, 1].map(|id| state(&particles[id]))
}

/// The exact flight, at the start and after every step.
fn exact(system: &Setup, loads: &[[Load; 2]]) -> Vec<[State; 2]> {
    let mut frames = vec![states(&system.particles)];
    for loads in loads {
        let last = frames[frames.len() - 1];
        frames.push([0, 1].map(|id| {
            let [x, v, w] = last[id];
            let mass = mass(system, id);
            let inertia = 0.4 * mass * radius(system, id).powi(2);
            let acceleration = loads[id].force / mass;
            [
                x + (v + acceleration * (0.5 * STEP)) * STEP,
                v + acceleration * STEP,
                w + loads[id].torque * (STEP / inertia),
            ]
        }));
    }
    frames
}

fn flight(mut engine: Box<dyn DemEngine>, loads: &[[Load; 2]]) -> Result<Vec<[State; 2]>> {
    let mut frames = vec![states(engine.particles().owned())];
    for loads in loads {
        engine.advance(&Comm::Solo, loads, STEP)?;
        frames.push(states(engine.particles().owned()));
    }
    Ok(frames)
}

pub(super) fn loaded(against: &Against, findings: &mut Findings) -> Result<()> {
    for (kind, substeps) in [("constant", 1), ("constant", 10), ("random", 1), ("random", 10)] {
        let mut system = glass(format!("free-flight-{kind}-{substeps}"), 1.0, 0.0, SAME);
        system.substeps = substeps;
        let velocity = Vec3::new(0.1, -0.05, 0.02);
        add(&mut system, 0, Vec3::repeat(3e-3), velocity).angular_velocity = [10.0, 20.0, -5.0];
        add(&mut system, 0, Vec3::repeat(7e-3), Vec3::zeros());
        let loads = loads(kind == "random");
        let exact = exact(&system, &loads);
        let [native, other] = [native(&system)?, against.engine(&system)?];
        let (native, other) = (flight(native, &loads)?, flight(other, &loads)?);
        for (i, name) in ["position (m)", "velocity (m/s)", "spin (1/s)"].into_iter().enumerate() {
            let all =
                |frames: &[[State; 2]]| frames.iter().flatten().map(|state| state[i]).collect::<Vec<_>>();
            let largest = worst(all(&exact).iter().map(Vec3::norm));
            let off = |frames: &[[State; 2]]| {
                let both = all(frames).into_iter().zip(all(&exact));
                worst(both.map(|(a, b)| (a - b).norm())) / largest
            };
            let difference = worst([off(&native), off(&other)]);
            let values = [&native, &other, &exact].map(|frames| Some(frames[STEPS][0][i].x));
            let quantity =
                format!("{name}, {kind} loads, sub-steps: {substeps}; shown: x of the first at the end");
            findings.given(quantity, values, difference, EXACT);
        }
        if (kind, substeps) == ("random", 10) {
            let curve = |frames: &Vec<[State; 2]>| -> Points {
                let points = frames.iter().enumerate();
                points.map(|(k, frame)| [k as f64 * STEP * 1e3, frame[0][1].x]).collect()
            };
            findings.plot_both(
                "velocity",
                "Free flight under random loads, 10 sub-steps",
                ["time (ms)", "velocity along x (m/s)"],
                [&native, &other].map(curve),
                Some(("exact", curve(&exact))),
            );
        }
    }
    Ok(())
}
