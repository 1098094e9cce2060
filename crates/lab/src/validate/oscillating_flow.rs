//! Flows that oscillate, and a free sphere in one: `validation/oscillating_flow`.

use super::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};
use turbid::math::nalgebra::Complex;

const PLATES: &str = include_str!("../../../../validation/oscillating_flow/case.toml");
const SPHERE: &str = include_str!("../../../../validation/oscillating_flow/sphere.toml");

pub(super) const CASE: Case = Case {
    name: "oscillating_flow",
    question: "flow between plates by an acceleration, a plate or a pressure that oscillates, and a free sphere in a fluid that does",
    source: "Landau and Lifshitz (1987), Fluid Mechanics, section 24",
    parts: &[
        Part::quick(0.5, |context, found| between_plates(context, found, Drive::Acceleration, 2.0)),
        Part::quick(0.5, |context, found| between_plates(context, found, Drive::Acceleration, 8.0)),
        Part::quick(0.5, |context, found| between_plates(context, found, Drive::Plate, 2.0)),
        Part::quick(0.5, |context, found| between_plates(context, found, Drive::Plate, 8.0)),
        Part::quick(1.0, |context, found| between_plates(context, found, Drive::Pressure, 2.0)),
        Part::quick(2.0, |context, found| between_plates(context, found, Drive::Pressure, 8.0)),
        Part::quick(12.0, |context, found| sphere(context, found, 1.0)),
        Part::quick(12.0, |context, found| sphere(context, found, 2.6)),
    ],
};

/// Of a velocity between plates over the largest one.
const OF_PROFILE: f64 = 0.01;
/// Of the force on the plate over its amplitude.
const OF_FORCE: f64 = 0.02;
/// Of the amplitude of the sphere over that of the fluid, and of its phase (degrees).
const OF_AMPLITUDE: f64 = 0.02;
const OF_PHASE: f64 = 3.0;

type C = Complex<f64>;

/// Drive of a flow between plates.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drive {
    /// The fluid, against plates at rest: Womersley's flow.
    Acceleration,
    /// The upper plate: Stokes' second problem in a layer.
    Plate,
    /// A table over time of the pressure at an outlet, opposite to another one: Womersley's flow.
    Pressure,
}

/// Rows of a table in a period.
const ROWS: u64 = 64;

/// Oscillation along x of this amplitude, a cosine from the time 0 on, with a whole number of steps in a period.
fn oscillation(amplitude: f64, period: u64, time_step: f64) -> String {
    let frequency = 1.0 / (period as f64 * time_step);
    format!(
        "{{ oscillation = {{ amplitude = [{amplitude:e}, 0, 0], frequency = {frequency:e}, phase = 90 }} }}"
    )
}

/// `z` of `Re(z exp(i w t))`, by the sum over whole periods of values at equal distances.
fn harmonic(values: &[(f64, f64)], omega: f64) -> C {
    let sum: C = values.iter().map(|(t, u)| C::from_polar(*u, -omega * t)).sum();
    sum * (2.0 / values.len() as f64)
}

/// The profile over a period, after the transient, against the exact one, at a ratio of half the distance to the depth `sqrt(nu / w)`.
fn between_plates(context: &SuiteContext, found: &mut Findings, drive: Drive, ratio: f64) -> Result<()> {
    // Sound crosses the few cells between the outlets in a small part of a period of many steps.
    let tau = if drive == Drive::Pressure { 0.55 } else { 0.8 };
    let tau = format!("lattice.relaxation_time={tau}");
    let plain = context.setup(PLATES, CASE.name, std::slice::from_ref(&tau))?;
    let (nu, height, dt) = (plain.expect_fluid().viscosity, plain.domain.size().z, plain.time_step);
    let wanted = nu * (2.0 * ratio / height).powi(2);
    let period = (TAU / (wanted * dt)).round() as u64;
    let omega = TAU / (period as f64 * dt);
    // The slowest mode has decayed to a millionth.
    let decayed = 14.0 * height * height / (TAU * FRAC_PI_2 * nu * dt);
    let periods = (decayed / period as f64).ceil() as u64;
    // 0.02 cells per step.
    let speed = 0.02 * plain.units().velocity();
    let own = match drive {
        Drive::Acceleration => {
            format!("driving.body_acceleration={}", oscillation(speed * omega, period, dt))
        }
        Drive::Plate => format!("domain.faces.\"z+\".velocity={}", oscillation(speed, period, dt)),
        Drive::Pressure => {
            let largest = plain.fluid_density() * speed * omega * plain.domain.size().x;
            let row = |n: u64| {
                let time = (n * period) as f64 / ROWS as f64 * dt;
                format!("[{time:e}, {:e}]", largest * (omega * time).cos())
            };
            let rows: Vec<String> = (0..=(periods + 1) * ROWS).map(row).collect();
            format!(
                "domain={{ size = [4e-4, 4e-4, 2.4e-3], periodic = [false, true, false], \
                 faces = {{ x-.outlet.pressure.table = [{}], \"x+\".outlet = {{}} }} }}",
                rows.join(", ")
            )
        }
    };
    let setup = context.setup(PLATES, CASE.name, &[tau, own])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(periods * period)?;

    let plate = setup.walls.iter().position(|wall| wall.name == "z+").expect("the case has one");
    let layers = setup.domain.cells[2];
    let (mut profile, mut force) = (vec![Vec::new(); layers], Vec::new());
    for _ in 0..period {
        let step = run.steps_done() as f64;
        // The velocity in the middle of the coming collision, with half of what drives it.
        let half = 0.5 * run.acceleration().x * dt;
        let time = (step + if drive == Drive::Acceleration { 0.5 } else { 0.0 }) * dt;
        for (z, layer) in profile.iter_mut().enumerate() {
            let moments = run.fluid().expect("the case has one").moments([1, 1, z]);
            layer.push((time, moments.1[0] * setup.units().velocity() + half));
        }
        run.step()?;
        // Of the step, whose middle lies half a step back.
        force.push((run.steps_done() as f64 * dt - 0.5 * dt, run.wall_loads()[plate].force.x));
    }
    let root = (C::i() * (omega / nu)).sqrt();
    let exact = |z: f64| match drive {
        Drive::Acceleration | Drive::Pressure => {
            let wall = (root * (0.5 * height)).cosh();
            // a / (i w) (1 - cosh / cosh), a = w U.
            -C::i() * speed * (C::from(1.0) - (root * (z - 0.5 * height)).cosh() / wall)
        }
        Drive::Plate => (root * z).sinh() / (root * height).sinh() * speed,
    };
    let error = |(z, layer): (usize, &Vec<(f64, f64)>)| {
        (harmonic(layer, omega) - exact((z as f64 + 0.5) * setup.domain.dx)).norm() / speed
    };
    let worst = profile.iter().enumerate().map(error).fold(0.0, f64::max);
    let womersley = "Womersley (1955), doi:10.1113/jphysiol.1955.sp005276, between plates";
    let (what, source) = match drive {
        Drive::Acceleration => ("acceleration", womersley),
        Drive::Pressure => ("table of pressures", womersley),
        Drive::Plate => ("plate", "Stokes (1851), Trans. Camb. Phil. Soc. 9, 8, in a layer"),
    };
    let quantity =
        format!("{what}: largest error of the profile over the amplitude, H / 2 = {ratio} depths (-)");
    found.absolute(quantity, worst, 0.0, OF_PROFILE).source(source);

    // Links at the corners of so short a channel belong to the plate, and bear some of the pressure.
    if drive == Drive::Pressure {
        return Ok(());
    }
    // On the upper plate -mu du/dz, over its area.
    let mu = setup.fluid_density() * nu;
    let slope = match drive {
        Drive::Acceleration | Drive::Pressure => C::i() * speed * root * (root * (0.5 * height)).tanh(),
        Drive::Plate => root / (root * height).tanh() * speed,
    };
    let size = setup.domain.size();
    let expected = slope * (-mu * size.x * size.y);
    let off = (harmonic(&force, omega) - expected).norm() / expected.norm();
    let quantity = format!(
        "{what}: error of the force on the upper plate over its amplitude, H / 2 = {ratio} depths (-)"
    );
    found.absolute(quantity, off, 0.0, OF_FORCE).source(source);
    Ok(())
}

/// Velocity of a free sphere of a ratio of densities over that of the fluid, in amplitude and phase.
///
/// ```text
/// v / u = (1 + K) / (s + K),   K = 9 (1 + x + x^2 / 9) / (2 x^2),   x = R sqrt(i w / nu)
/// ```
fn sphere(context: &SuiteContext, found: &mut Findings, ratio: f64) -> Result<()> {
    let plain = context.setup(SPHERE, CASE.name, &[])?;
    let (nu, radius, dt) = (plain.expect_fluid().viscosity, 0.5 * plain.diameter, plain.time_step);
    // R is the depth sqrt(2 nu / w) to which the boundary layer reaches.
    let each = 8;
    let period = (TAU * radius * radius / (2.0 * nu * dt) / each as f64).round() as u64 * each;
    let omega = TAU / (period as f64 * dt);
    let speed = 0.01 * plain.units().velocity();
    let own = [
        format!("driving.body_acceleration={}", oscillation(speed * omega, period, dt)),
        format!("particles.0.density={:e}", ratio * plain.fluid_density()),
    ];
    let setup = context.setup(SPHERE, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(3 * period)?;
    let (mut body, mut fluid) = (Vec::new(), Vec::new());
    for _ in 0..period / each {
        run.advance(each)?;
        let time = run.time();
        body.push((time, run.particles()[0].velocity().x));
        fluid.push((time, run.measure().mean.velocity.x));
    }
    let measured = harmonic(&body, omega) / harmonic(&fluid, omega);
    let x = (C::i() * (omega / nu)).sqrt() * radius;
    let k = (C::from(1.0) + x + x * x / 9.0) * 4.5 / (x * x);
    let exact = (C::from(1.0) + k) / (C::from(ratio) + k);
    let name = format!("sphere of {ratio} times the density");
    let quantity = format!("{name}: amplitude over that of the fluid (-)");
    found.relative(quantity, measured.norm(), exact.norm(), OF_AMPLITUDE);
    let [measured, exact] = [measured, exact].map(|z| z.arg().to_degrees());
    found.absolute(format!("{name}: phase against the fluid (degrees)"), measured, exact, OF_PHASE);
    Ok(())
}
