//! Flow through a packed bed of spheres between an inlet and an outlet: `validation/packed_bed`.

use super::prelude::*;
use serde::{Deserialize, Serialize};

const TEXT: &str = include_str!("../../../../validation/packed_bed/case.toml");

pub(super) const CASE: Case = Case {
    name: "packed_bed",
    question: "pressure drop of a packed bed between inlet and outlet, against Ergun and the same bed in a periodic box",
    source: "Ergun (1952), Chem. Eng. Prog. 48, 89",
    parts: &[Part::full(900.0, bed)],
};

/// Of the pressure gradient over that of Ergun.
const ERGUN: f64 = 0.1;
/// Of the pressure gradient over that of the same bed in a periodic box.
const PERIODIC: f64 = 0.02;
/// Of flux and pressure gradient between two looks, which is steady.
const STEADY: f64 = 2e-4;
const EVERY: u64 = 1000;
/// Periods of the bed behind each other, and lengths of a period free before and behind them.
const PERIODS: usize = 3;
const FREE: [f64; 2] = [0.5, 0.75];

/// Superficial velocity (m/s) and pressure gradient (Pa/m) at a time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Look {
    velocity: f64,
    gradient: f64,
}

/// Means over the plane of cells `z` of the velocity (m/s) through it and of the pressure (Pa), in all cells: what passes is the velocity of fields.
fn plane(run: &mut Simulation, z: usize) -> Result<[f64; 2]> {
    let fields = run.fields()?;
    let (mut velocity, mut pressure, mut count) = (0.0, 0.0, 0.0);
    for (n, _) in run.block().cells().enumerate().filter(|(_, cell)| cell[2] == z) {
        velocity += f64::from(fields.velocity[n][2]);
        pressure += f64::from(fields.pressure[n]);
        count += 1.0;
    }
    Ok([velocity / count, pressure / count])
}

/// The steady flow.
fn steady(
    context: &SuiteContext,
    setup: &Setup,
    look: fn(&mut Simulation, f64) -> Result<Look>,
) -> Result<Look> {
    let watch = Watch { context, setup, threads: 1, every: EVERY };
    let period = setup.domain.size().x;
    let looks: Vec<Look> = watch.rows(|run, looks: &mut Vec<Look>| {
        let now = run.on_root(move |run| look(run, period))?;
        let change = looks.last().map_or(f64::INFINITY, |before| {
            (now.velocity / before.velocity - 1.0).abs() + (now.gradient / before.gradient - 1.0).abs()
        });
        looks.push(now);
        Ok(change < STEADY)
    })?;
    let last = *looks.last().ok_or_else(|| unsteady("looks at the flow", 0.0))?;
    if looks.len() as u64 * EVERY >= setup.plan.end_step {
        return Err(unsteady("velocity through the bed (m/s)", last.velocity));
    }
    Ok(last)
}

fn bed(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let periodic = context.setup(TEXT, CASE.name, &[])?;
    let driven =
        steady(context, &periodic, |run, _| Ok(Look { velocity: plane(run, 0)?[0], gradient: 1.0 }))?;
    let fluid = periodic.expect_fluid();
    let (viscosity, density) = (fluid.viscosity, periodic.fluid_density());
    let gradient = density * fluid.body_acceleration.at(0.0).z;
    let [width, period] = [periodic.domain.size().x, periodic.domain.size().z];
    let places: Vec<[f64; 3]> = (0..PERIODS)
        .flat_map(|n| {
            let above = (FREE[0] + n as f64) * period;
            periodic.particles.iter().map(move |p| [p.position[0], p.position[1], p.position[2] + above])
        })
        .collect();
    // The pressure of the outlet puts the middle of the bed at the reference density, with which the fluid comes in.
    let outlet = -0.5 * PERIODS as f64 * period * gradient;
    let height = (FREE[0] + PERIODS as f64 + FREE[1]) * period;
    let own = [
        format!("domain.size=[{width:e}, {width:e}, {height:e}]"),
        format!(
            "domain.faces={{ z-.inlet.velocity=[0, 0, {:e}], \"z+\".outlet.pressure={outlet:e} }}",
            driven.velocity
        ),
        "domain.periodic=[true, true, false]".to_string(),
        "driving.body_acceleration=[0, 0, 0]".to_string(),
        format!(
            "particles.0={{ shape.sphere.diameter={:e}, density={density}, motion=\"fixed\", list={places:?} }}",
            periodic.diameter
        ),
    ];
    let between = context.setup(TEXT, CASE.name, &own)?;
    // From the beginning to the end of the period in the middle.
    let pressed = steady(context, &between, |run, period| {
        let cells = run.block().hi[0];
        let first = (FREE[0] * cells as f64) as usize + cells;
        let [[velocity, before], [_, behind]] = [plane(run, first)?, plane(run, first + cells)?];
        Ok(Look { velocity, gradient: (before - behind) / period })
    })?;
    let (phi, diameter, u) = (periodic.volume_fraction, periodic.diameter, pressed.velocity);
    let open = (1.0 - phi).powi(3);
    let ergun = 150.0 * phi * phi / open * density * viscosity * u / (diameter * diameter)
        + 1.75 * phi / open * density * u * u / diameter;
    found.note("Reynolds number (-)", u * diameter / viscosity);
    found.note("velocity through the middle over that at the inlet (-)", u / driven.velocity);
    found.relative(
        "pressure gradient of the bed between inlet and outlet (Pa/m)",
        pressed.gradient,
        ergun,
        ERGUN,
    );
    found
        .relative(
            "pressure gradient between inlet and outlet over that of the same bed in a periodic box (-)",
            pressed.gradient / gradient,
            1.0,
            PERIODIC,
        )
        .source("the same bed in a periodic box");
    Ok(())
}
