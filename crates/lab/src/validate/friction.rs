//! Oblique impacts with friction: `validation/friction`.

use super::prelude::*;
use std::f64::consts::PI;
use turbid::dem::Load;

const TEXT: &str = include_str!("../../../../validation/friction/case.toml");
const OBLIQUE: &str = include_str!("../../../../validation/friction/oblique.toml");
const BLOCK: &str = include_str!("../../../../validation/friction/block.toml");
const GAS: &str = include_str!("../../../../validation/friction/gas.toml");
const MAW: &str = include_str!("../../../../validation/friction/maw.csv");
const REFERENCE: &str = include_str!("../../../../validation/friction/reference.csv");

pub(super) const CASE: Case = Case {
    name: "friction",
    question: "oblique impacts of spheres: tangential restitution, spin and angle of rebound; a block that sticks and slips; energy of a gas of rough spheres",
    source: "Kharaz, Gorham and Salman (2001), doi:10.1016/S0032-5910(01)00283-2",
    parts: &[
        Part::quick(1.0, throws),
        Part::quick(1.0, rebounds),
        Part::quick(1.0, slips),
        Part::full(60.0, gas),
    ],
};

const THEORY: &str = "impulses of rigid bodies that slide to the end: mu (1 + e) of the normal momentum";
/// Speed before the impact (m/s).
const SPEED: f64 = 3.9;
/// Measured.
const FRICTION: f64 = 0.092;
const RESTITUTION: f64 = 0.98;
/// Work of adhesion of the gas (J/m^2).
const WORK: f64 = 0.1;
/// Of the energy and of the momentum of the gas, over those at the start.
const GAIN: f64 = 1e-4;
const ROUNDING: f64 = 1e-12;
/// Of the tangential restitution: against theory and against the experiment, absolute.
const TANGENTIAL: [f64; 2] = [2e-3, 0.02];
/// Of the angular velocity: against theory and against the experiment, as a part.
const SPIN: [f64; 2] = [5e-3, 0.1];

fn throws(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let table = Table::new(REFERENCE);
    let columns = ["angle", "value"];
    let [tangential, spin] =
        ["tangential_restitution", "omega_rad_s"].map(|word| table.points(Some(word), columns));
    let angles: Vec<f64> = tangential.iter().chain(&spin).map(|point| point[0]).collect();
    let list: Vec<String> = (0..)
        .zip(&angles)
        .map(|(n, degrees)| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (x, along, down) = (0.02 + 0.03 * f64::from(n), SPEED * sin, -SPEED * cos);
            format!("{{ position = [{x:e}, 0.01, 2.5000001e-3], velocity = [{along:e}, 0.0, {down:e}] }}")
        })
        .collect();
    let own = [format!("particles.0.list=[{}]", list.join(", "))];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let contacts = run.dem().contacts();
    if (contacts.begun, contacts.count) != (angles.len() as u64, 0) {
        return Err(unsteady("contacts that have not ended", contacts.count as f64));
    }
    let radius = 0.5 * setup.diameter;
    let slide = |angle: f64| 1.0 - FRICTION * (1.0 + RESTITUTION) / angle.to_radians().tan();
    let turn = |angle: f64| 2.5 * FRICTION * (1.0 + RESTITUTION) * SPEED * angle.to_radians().cos() / radius;
    let (mut slid, mut turned) = (Vec::new(), Vec::new());
    for (n, after) in run.particles().iter().enumerate() {
        let (angle, before) = (angles[n], setup.particles[n].velocity());
        let normal = -after.velocity().z / before.z;
        let quantity = format!("normal restitution at {angle:.1} degrees (-)");
        found.absolute(quantity, normal, RESTITUTION, 2e-3).source("as set");
        if let Some(&[_, experiment]) = tangential.get(n) {
            let measured = after.velocity().x / before.x;
            let quantity = format!("tangential restitution at {angle:.1} degrees (-)");
            found.absolute(quantity.clone(), measured, slide(angle), TANGENTIAL[0]).source(THEORY);
            let quantity = format!("{quantity}, experiment");
            found.absolute(quantity, measured, experiment, TANGENTIAL[1]);
            slid.push([angle, measured]);
        } else {
            let experiment = spin[n - tangential.len()][1];
            let measured = after.angular_velocity().y;
            let quantity = format!("angular velocity at {angle:.1} degrees (1/s)");
            found.relative(quantity.clone(), measured, turn(angle), SPIN[0]).source(THEORY);
            let quantity = format!("{quantity}, experiment");
            found.relative(quantity, measured, experiment, SPIN[1]);
            turned.push([angle, measured]);
        }
    }
    let over = |law: &dyn Fn(f64) -> f64| (34..=65).map(|a| [f64::from(a), law(f64::from(a))]).collect();
    let mut plot = |name, title, axis, law: Vec<[f64; 2]>, experiment: Vec<_>, points: Vec<_>| {
        let curves = [
            reference("rigid bodies", law),
            measured("experiment, Kharaz et al. (2001)", experiment),
            overlaid("measured", points),
        ];
        found.plot(name, title, ["angle from the normal (degrees)", axis], curves);
    };
    let title = "Tangential restitution of spheres on a plate";
    plot("tangential", title, "tangential restitution (-)", over(&slide), tangential, slid);
    let title = "Spin of spheres after the impact on a plate";
    plot("spin", title, "angular velocity (1/s)", over(&turn), spin, turned);
    Ok(())
}

/// Speed of the spheres across the floor (m/s), their coefficient of friction, and `psi` over the tangent of the angle and the coefficient.
const ACROSS: f64 = 0.01;
const ROUGH: f64 = 0.3;
const LOCAL: f64 = 1.4 / 1.7;
/// Of the ratio of the local angles, absolute.
const ANGLE: f64 = 0.02;

/// Local angles of rebound of elastic spheres by a law of friction, for these of incidence.
fn rebound(context: &SuiteContext, law: &str, angles: &[f64]) -> Result<Vec<f64>> {
    let list: Vec<String> = (0..)
        .zip(angles)
        .map(|(n, psi)| {
            let (x, along) = (5e-3 + 8e-3 * f64::from(n), psi * ROUGH * ACROSS / LOCAL);
            format!(
                "{{ position = [{x:e}, 5e-3, 1.00000001e-3], velocity = [{along:e}, 0.0, {:e}] }}",
                -ACROSS
            )
        })
        .collect();
    let own = [format!("particles.0.list=[{}]", list.join(", ")), format!("contact.friction={law:?}")];
    let statics = (law == "mindlin").then(|| format!("contact.friction_static={ROUGH:e}"));
    let setup = context.setup(OBLIQUE, CASE.name, &[&own[..], statics.as_slice()].concat())?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let contacts = run.dem().contacts();
    if (contacts.begun, contacts.count) != (angles.len() as u64, 0) {
        return Err(unsteady("contacts that have not ended", contacts.count as f64));
    }
    let surface = |after: &Particle| after.velocity().x - after.angular_velocity().y * 0.5 * setup.diameter;
    Ok(run.particles().iter().map(|after| surface(after) / after.velocity().z * LOCAL / ROUGH).collect())
}

fn rebounds(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let theory = Table::new(MAW).points(None, ["psi_1", "psi_2"]);
    let angles: Vec<f64> = theory.iter().map(|point| point[0]).collect();
    let [partial, single] = ["mindlin_deresiewicz", "mindlin"].map(|law| rebound(context, law, &angles));
    let (partial, single) = (partial?, single?);
    for ([psi, expected], found_psi) in theory.iter().zip(&partial) {
        let quantity = format!("angle of rebound over that of incidence, psi_1 {psi:.1} (-)");
        found
            .absolute(quantity, found_psi / psi, expected / psi, ANGLE)
            .source("Maw, Barber and Fawcett (1976), doi:10.1016/0043-1648(76)90201-2");
    }
    let over =
        |rebounds: Vec<f64>| angles.iter().zip(rebounds).map(|(psi, of)| [*psi, of]).collect::<Vec<_>>();
    let curves = [
        reference("Maw, Barber and Fawcett (1976)", theory.clone()),
        measured("mindlin", over(single)),
        overlaid("mindlin_deresiewicz", over(partial)),
    ];
    let axes = ["local angle of incidence (-)", "local angle of rebound (-)"];
    found.plot("rebound", "Oblique impacts of elastic spheres", axes, curves);
    Ok(())
}

/// Static and kinetic coefficient of the block.
const COEFFICIENTS: [f64; 2] = [0.5, 0.35];
/// Speed (m/s) of the end of its spring, and its angular frequency (1/s) on the spring.
const PULL: f64 = 0.01;
const RATE: f64 = 200.0;
const GRAVITY: f64 = 9.81;
/// Of its period, and of the swing of the force, as a part.
const SLIP: f64 = 5e-3;

fn slips(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(BLOCK, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance((0.1 / setup.time_step).round() as u64)?;
    let (start, from) = (run.time(), run.particles()[0].position().x);
    let mass = setup.templates[0].mass();
    let stretch = move |time: f64, x: f64| PULL * (time - start) - (x - from);
    run.set_external_load(move |time, block| {
        let force = Vec3::x() * (mass * RATE * RATE * stretch(time, block.position().x));
        Load { force, torque: Vec3::zeros() }
    });
    // Of each slip its beginning, the largest force before it and the smallest one after it, over the weight.
    let mut found_slips: Vec<[f64; 3]> = Vec::new();
    let (mut was_slow, mut largest) = (true, 0.0_f64);
    while run.steps_done() < setup.plan.end_step {
        let force = RATE * RATE / GRAVITY * stretch(run.time(), run.particles()[0].position().x);
        run.advance(1)?;
        let is_slow = run.particles()[0].velocity().x < 0.2 * PULL;
        largest = largest.max(force);
        if was_slow && !is_slow {
            found_slips.push([run.time(), largest, force]);
            largest = 0.0;
        }
        if let Some(slip) = found_slips.last_mut() {
            slip[2] = slip[2].min(force);
        }
        was_slow = is_slow;
    }
    let [fixed, kinetic] = COEFFICIENTS;
    let swing = (fixed - kinetic) * GRAVITY / (RATE * RATE);
    let period = 2.0 * swing / PULL + 2.0 * (PI - (swing * RATE / PULL).atan()) / RATE;
    let amplitude = RATE * RATE / GRAVITY * swing.hypot(PULL / RATE);
    let count = found_slips.len() - 1;
    // The first slip begins from rest.
    let mean = |n: usize| found_slips[1..count].iter().map(|slip| slip[n]).sum::<f64>() / (count - 1) as f64;
    let exact = "exact: it sticks up to the static coefficient and slips with the kinetic one";
    let measured = (found_slips[count][0] - found_slips[0][0]) / count as f64;
    found
        .relative("block on a floor, pulled by a spring: period (s)".to_owned(), measured, period, SLIP)
        .source(exact);
    for (n, what, expected) in [(1, "largest", kinetic + amplitude), (2, "smallest", kinetic - amplitude)] {
        let quantity = format!("block on a floor, pulled by a spring: {what} force over its weight (-)");
        found.absolute(quantity, mean(n), expected, SLIP * amplitude).source(exact);
    }
    Ok(())
}

/// Energy and momentum of a gas of rough elastic spheres over a million steps, without cohesion and with it.
fn gas(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    for cohesion in ["none", "dmt"] {
        let mut own = vec![format!("contact.cohesion={cohesion:?}")];
        own.extend((cohesion != "none").then(|| format!("contact.work_of_adhesion={WORK:?}")));
        let mut setup = context.setup(GAS, CASE.name, &own)?;
        for (n, sphere) in (1..).zip(&mut setup.particles) {
            // Fractional parts of square roots of primes.
            let part = |step: f64| 2.0 * (f64::from(n) * step).fract() - 1.0;
            sphere.velocity = [0.414_214, 0.732_051, 0.236_068].map(|step| 0.1 * part(step));
            sphere.angular_velocity = [0.645_751, 0.316_625, 0.605_551].map(|step| 100.0 * part(step));
        }
        let (mass, inertia) = (setup.templates[0].mass(), setup.templates[0].inertia().x);
        let reduced = 0.25 * setup.diameter;
        let modulus = setup.contact.as_ref().map_or(f64::NAN, |model| {
            let material = model.materials[0];
            0.5 * material.youngs_modulus / (1.0 - material.poisson_ratio * material.poisson_ratio)
        });
        let pull = if cohesion == "none" { 0.0 } else { 2.0 * PI * WORK * reduced };
        // Of motion, of Hertz's contacts and of cohesion; springs along the surface have more.
        let energy = |run: &Simulation| {
            let moving = run.particles().iter().map(|sphere| {
                let (v, w) = (sphere.velocity(), sphere.angular_velocity());
                0.5 * (mass * v.norm_squared() + inertia * w.norm_squared())
            });
            let states = run.contact_states();
            let pressed = states.iter().map(|state| {
                8.0 / 15.0 * modulus * reduced.sqrt() * state.depth.powf(2.5) - pull * state.depth
            });
            moving.sum::<f64>() + pressed.sum::<f64>()
        };
        let momentum = |run: &Simulation| -> Vec3 {
            run.particles().iter().map(|sphere| sphere.velocity() * mass).sum()
        };
        let mut run = Simulation::solo(&setup)?;
        let (start, before) = (energy(&run), momentum(&run));
        let mut most = 0.0_f64;
        let looks = 1000;
        for _ in 0..looks {
            run.advance(setup.plan.end_step / looks)?;
            most = most.max(energy(&run) / start - 1.0);
        }
        let what = if cohesion == "none" { String::new() } else { format!(", cohesion {cohesion}") };
        found
            .absolute(
                format!("gas of rough spheres{what}: largest gain of energy in 1e6 steps (-)"),
                most,
                0.0,
                GAIN,
            )
            .source("none: friction and cohesion take energy only");
        found
            .absolute(
                format!("gas of rough spheres{what}: energy left after 1e6 steps (-)"),
                energy(&run) / start,
                0.0,
                f64::INFINITY,
            )
            .source("reported: friction takes it");
        let scale = (2.0 * mass * start).sqrt();
        found
            .absolute(
                format!("gas of rough spheres{what}: change of momentum in 1e6 steps (-)"),
                (momentum(&run) - before).norm() / scale,
                0.0,
                ROUNDING,
            )
            .source("none: forces are opposite, rounding");
        found.note(
            format!("gas of rough spheres{what}: contacts that began"),
            run.dem().contacts().begun as f64,
        );
    }
    Ok(())
}
