//! Steady flows along, across and round cylinders: `validation/round_walls`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/round_walls/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/round_walls/reference.csv");

pub(super) const CASE: Case = Case {
    name: "round_walls",
    question: "flow through pipes, drag on square arrays of rods, torque on a turning rod, wherever the axes are",
    source: "Hagen and Poiseuille, exact",
    parts: &[
        Part::quick(2.0, pipes),
        Part::quick(5.0, convergence),
        Part::quick(2.0, |context, found| rods(context, found, "0.1", 34, 0.01)),
        Part::quick(1.0, |context, found| rods(context, found, "0.3", 20, 0.02)),
        Part::quick(1.0, |context, found| rods(context, found, "0.5", 16, 0.13)),
        Part::quick(1.0, turning_rod),
    ],
};

/// Edge of a cell (m), and viscosity (m^2/s), as in the case file.
const CELL: f64 = 1e-4;
const VISCOSITY: f64 = 1e-6;
/// Of the flow through a pipe of 20 cells, and of 12, from where it is of second order.
const FLOW: f64 = 5e-3;
const TORQUE: f64 = 0.01;
/// Positions of an axis between cells (cells); rods must keep 1.2 cells away from the faces.
const OFF: [[f64; 2]; 4] = [[0.0, 0.0], [0.4, 0.4], [0.3, 0.15], [0.37, 0.03]];

/// Flow along x (m^3/s) in the middle of the steps through all cells, over the length of the box, once it is steady.
pub(super) fn flow(setup: &Setup) -> Result<f64> {
    let mut run = Simulation::solo(setup)?;
    run.advance(setup.plan.end_step)?;
    // Bodies take up what drives the fluid: the sum over all cells is the same before and after a collision.
    let driven = if setup.particles.is_empty() { 0.5 } else { 0.0 };
    let half = driven * run.acceleration().x * setup.time_step;
    let [nx, ny, nz] = setup.domain.cells;
    let cells = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let fluid = run.fluid().expect("the case has one");
    let free = cells.filter(|&cell| {
        let centre = Vec3::from_fn(|a, _| (cell[a] as f64 + 0.5) * setup.domain.dx);
        !setup.walls.iter().any(|wall| wall.surface.is_wall(centre))
    });
    let sum: f64 = free.map(|cell| fluid.moments(cell).1[0] * setup.units().velocity() + half).sum();
    Ok(sum * CELL * CELL / nx as f64)
}

/// The flow through a pipe along x over that of Hagen and Poiseuille.
fn through(context: &SuiteContext, cells: f64, off: [f64; 2], relaxation_time: f64) -> Result<f64> {
    let (width, diameter) = (cells + 4.0, cells * CELL);
    let [y, z] = off.map(|off| (0.5 * width + off) * CELL);
    // 12 times the decay to 1/e of the slowest mode.
    let end = 12.0 * diameter * diameter / (4.0 * 5.78 * VISCOSITY);
    let acceleration = 3e-3 * (20.0 / cells).powi(3);
    let own = [
        format!("domain.size={:?}", [4.0 * CELL, width * CELL, width * CELL]),
        format!("walls.0.pipe.point={:?}", [0.0, y, z]),
        format!("walls.0.pipe.diameter={diameter}"),
        format!("lattice.relaxation_time={relaxation_time}"),
        format!("driving.body_acceleration={:?}", [acceleration, 0.0, 0.0]),
        format!("run.end.time={end}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    Ok(flow(&setup)? / (PI * diameter.powi(4) * acceleration / (128.0 * VISCOSITY)))
}

fn pipes(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    for (off, relaxation_time) in OFF.into_iter().zip([0.8, 0.55, 1.0]) {
        let flow = through(context, 20.0, off, relaxation_time)?;
        let quantity = format!(
            "pipe of 20 cells: flow over the exact one, axis off by {off:?} cells, tau {relaxation_time} (-)"
        );
        found.relative(quantity, flow, 1.0, FLOW);
    }
    Ok(())
}

fn convergence(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    for cells in [12.0, 24.0, 48.0] {
        let flow = through(context, cells, [0.21, 0.47], 1.0)?;
        let tolerance = FLOW * (12.0_f64 / cells).powi(2);
        found.relative(format!("pipe of {cells} cells: flow over the exact one (-)"), flow, 1.0, tolerance);
    }
    Ok(())
}

/// A square array of rods along z, `width` cells apart, across a flow along x.
fn rods(context: &SuiteContext, found: &mut Findings, phi: &str, width: usize, tolerance: f64) -> Result<()> {
    let (side, reference) = (width as f64 * CELL, Table::new(REFERENCE).of("phi", phi, "drag"));
    let fraction: f64 = phi.parse().expect("a number");
    let diameter = side * (4.0 * fraction / PI).sqrt();
    // Mean velocity for a Reynolds number far below 1.
    let acceleration = reference * VISCOSITY * 1e-4 / (side * side);
    for off in OFF {
        let [x, y] = off.map(|off| 0.5 * side + off * CELL);
        let own = [
            format!("domain.size={:?}", [side, side, 4.0 * CELL]),
            format!(
                "walls=[{{name=\"rod\", rod={{point=[{x}, {y}, 0.0], axis=[0, 0, 1], diameter={diameter}}}}}]"
            ),
            "lattice.relaxation_time=1.0".to_string(),
            format!("driving.body_acceleration={:?}", [acceleration, 0.0, 0.0]),
            format!("run.end.time={}", 4.0 * side * side / (PI * PI * VISCOSITY)),
        ];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        // `flow` is per area of the box across z and its length x.
        let mean = flow(&setup)? / (side * 4.0 * CELL);
        let drag = acceleration * side * side / (VISCOSITY * mean);
        let quantity = format!("rods, volume fraction {phi}: F / (mu U), axis off by {off:?} cells (-)");
        found
            .relative(quantity, drag, reference, tolerance)
            .source("Sangani and Acrivos (1982), doi:10.1016/0301-9322(82)90029-5");
    }
    Ok(())
}

/// A rod that turns in a pipe at rest, twice as wide.
fn turning_rod(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let (r, width, rate) = (8.0 * CELL, 36.0, 0.1);
    for off in [OFF[0], OFF[3]] {
        let [y, z] = off.map(|off| (0.5 * width + off) * CELL);
        let round = |name: &str, radius: f64| {
            format!("{name}={{point=[0.0, {y}, {z}], axis=[1, 0, 0], diameter={}}}", 2.0 * radius)
        };
        let own = [
            format!("domain.size={:?}", [4.0 * CELL, width * CELL, width * CELL]),
            format!(
                "walls=[{{name=\"pipe\", {}}}, {{name=\"rod\", {}, angular_velocity=[{rate}, 0, 0]}}]",
                round("pipe", 2.0 * r),
                round("rod", r)
            ),
            "driving.body_acceleration=[0, 0, 0]".to_string(),
            format!("run.end.time={}", 30.0 * r * r / (PI * PI * VISCOSITY)),
        ];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let mut run = Simulation::solo(&setup)?;
        run.advance(setup.plan.end_step)?;
        let before = run.wall_loads();
        run.advance(1)?;
        let length = setup.domain.size().x;
        let exact = 4.0 * PI * setup.fluid_density() * VISCOSITY * rate * r * r * 4.0 / 3.0 * length;
        for (n, (name, sign)) in [("pipe", 1.0), ("rod", -1.0)].into_iter().enumerate() {
            let torque = 0.5 * sign * (before[n].torque + run.wall_loads()[n].torque).x;
            let quantity = format!(
                "turning rod: torque on the {name} over the exact one, axes off by {off:?} cells (-)"
            );
            found.relative(quantity, torque / exact, 1.0, TORQUE).source("Couette, exact");
        }
    }
    Ok(())
}
