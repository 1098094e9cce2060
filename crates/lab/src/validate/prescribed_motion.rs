//! Loads on a sphere whose motion is prescribed: `validation/prescribed_motion`.

use super::prelude::*;
use std::f64::consts::{PI, TAU};

const TEXT: &str = include_str!("../../../../validation/prescribed_motion/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/prescribed_motion/reference.csv");

pub(super) const CASE: Case = Case {
    name: "prescribed_motion",
    question: "torque on a rotating sphere, drag on a dragged one, force on an oscillating one, in slow flow",
    source: "Stokes (1851), Trans. Camb. Phil. Soc. 9, 8",
    parts: &[
        Part::quick(1.0, |context, found| rotation(context, found, 2)),
        Part::quick(2.0, |context, found| rotation(context, found, 3)),
        Part::quick(1.0, dragging),
        Part::quick(15.0, oscillation),
    ],
};

const TOLERANCE: f64 = 0.01;
/// Of both parts of the force on an oscillating sphere.
const OF_OSCILLATION: f64 = 0.02;
/// Largest relative change of the torque in `STRETCH` steps that counts as steady.
const STEADY: f64 = 1e-5;
const STRETCH: u64 = 100;

/// Force (N) and torque (N m) of the only particle on the fluid.
fn on_fluid(run: &Simulation) -> [Vec3; 2] {
    run.loads().next().map_or([Vec3::zeros(); 2], |(_, load)| [-load.force, -load.torque])
}

/// Torque on a rotating sphere in a periodic cube of `edge` diameters.
fn rotation(context: &SuiteContext, found: &mut Findings, edge: u32) -> Result<()> {
    let own = if edge == 2 {
        Vec::new()
    } else {
        vec![format!("domain.size={{ diameters = [{edge}, {edge}, {edge}] }}")]
    };
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let spin = run.particles()[0].angular_velocity();
    let mut torque = 0.0;
    loop {
        run.advance(STRETCH)?;
        let before = std::mem::replace(&mut torque, on_fluid(&run)[1].dot(&spin.normalize()));
        if (torque - before).abs() < STEADY * torque {
            break;
        }
        if run.steps_done() >= setup.plan.end_step {
            return Err(unsteady("torque (N m)", torque));
        }
    }
    let (mu, radius) = (setup.fluid_density() * setup.expect_fluid().viscosity, 0.5 * setup.diameter);
    let free = 8.0 * PI * mu * radius.powi(3) * spin.norm();
    let expected = Table::new(REFERENCE).of("quantity", &format!("rotation_{edge}"), "value");
    found
        .relative(format!("torque over 8 pi mu R^3 w, L = {edge} D (-)"), torque / free, expected, TOLERANCE)
        .source("Hasimoto's (1959) sum for rotlets");
    Ok(())
}

/// Drag on a sphere that is moved through a periodic cube whose net flux is zero.
fn dragging(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = [
        "domain.size=[2.5e-3, 2.5e-3, 2.5e-3]",
        "lattice.cells_per_diameter=12.407",
        "lattice.relaxation_time=1.0",
        "particles.0.shape.sphere.diameter=1.2407e-3",
        "particles.0.motion={ velocity = [0, 0, 4e-4] }",
    ]
    .map(String::from);
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (viscosity, diameter) = (setup.expect_fluid().viscosity, setup.diameter);
    let mut run = Simulation::solo(&setup)?;
    let speed = run.particles()[0].velocity().z;
    // The drag over the passage of four cells, once the flow is steady.
    let passage = (4.0 * setup.domain.dx / (speed * setup.time_step)).round() as u64;
    run.advance((4.0 * diameter * diameter / viscosity / setup.time_step) as u64)?;
    let (mut force, mut flux) = (0.0, 0.0);
    for _ in 0..passage {
        run.step()?;
        force += on_fluid(&run)[0].z / passage as f64;
        flux += run.mean_flow().velocity.z / passage as f64;
    }
    let stokes = 3.0 * PI * setup.fluid_density() * viscosity * diameter * speed;
    let expected = Table::new(REFERENCE).of("quantity", "drag", "value");
    found
        .relative("K of a dragged sphere, phi 0.064 (-)", force / stokes, expected, TOLERANCE)
        .source("Zick and Homsy (1982), doi:10.1017/S0022112082000627");
    found
        .absolute("net flux over the velocity of the sphere (-)", flux / speed, 0.0, 1e-3)
        .source("what the controller is for");
    Ok(())
}

/// Force on a sphere that oscillates in a periodic cube of four diameters, over the second period.
fn oscillation(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = [
        "domain.size={ diameters = [4, 4, 4] }",
        "fluid.precision=\"f32\"",
        "lattice.relaxation_time=0.6",
        "particles.0.list=[[2.4e-3, 2.4e-3, 2.4e-3]]",
        // R = delta, the depth to which the oscillation reaches; an amplitude of 0.12 R.
        "particles.0.motion={ velocity = { oscillation = { amplitude = [0, 0, 4e-3], frequency = 8.841941282883074 } } }",
    ]
    .map(String::from);
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (nu, radius) = (setup.expect_fluid().viscosity, 0.5 * setup.diameter);
    let mass = setup.fluid_density() * setup.templates[0].shape.volume();
    let mut run = Simulation::solo(&setup)?;
    let omega = 2.0 * nu / (radius * radius);
    let amplitude = setup.motions[0].velocity.largest().z;
    let period = (TAU / omega / setup.time_step).round() as u64;
    run.advance(period)?;
    let (mut with_velocity, mut with_acceleration) = (0.0, 0.0);
    for _ in 0..period {
        // The load of a step is its mean over the step.
        let phase = omega * (run.steps_done() as f64 + 0.5) * setup.time_step;
        run.step()?;
        let force = on_fluid(&run)[0].z * 2.0 / period as f64;
        with_velocity += force * phase.sin();
        with_acceleration += force * phase.cos();
    }
    let table = Table::new(REFERENCE);
    let stokes = 6.0 * PI * setup.fluid_density() * nu * radius * amplitude;
    for (name, key, measured) in [
        ("force in phase with the velocity over 6 pi mu R U (-)", "in_phase", with_velocity / stokes),
        (
            "force in phase with the acceleration over the displaced mass (-)",
            "out_of_phase",
            with_acceleration / (mass * omega * amplitude),
        ),
    ] {
        found.relative(name, measured, table.of("quantity", key, "value"), OF_OSCILLATION);
    }
    found.note("steps in a period", period as f64);
    Ok(())
}
