//! Drag factor of a simple-cubic array of fixed spheres: `validation/sphere_array`.

use super::prelude::*;
use std::f64::consts::PI;
use turbid::coupling::Method;

const TEXT: &str = include_str!("../../../../validation/sphere_array/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/sphere_array/reference.csv");

pub(super) const CASE: Case = Case {
    name: "sphere_array",
    question: "drag factor K of a fixed simple-cubic array of spheres in slow flow",
    source: "Zick and Homsy (1982), doi:10.1017/S0022112082000627",
    parts: &[
        Part::quick(2.0, |context, found| drag(context, found, 0.027, [33, 1], CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, [25, 1], CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, [25, 1], ASIDE, 0.65)),
        Part::quick(2.0, |context, found| drag(context, found, 0.125, [20, 2], CENTRE, 0.65)),
        Part::quick(3.0, |context, found| drag(context, found, 0.125, [20, 2], ASIDE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.216, [17, 2], CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.25, [16, 2], CENTRE, 0.65)),
        Part::quick(3.0, |context, found| drag(context, found, 0.064, [25, 1], CENTRE, 0.55)),
        Part::quick(3.0, |context, found| drag(context, found, 0.25, [16, 2], CENTRE, 0.55)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, [25, 1], CENTRE, 1.0)),
        Part::quick(1.0, |context, found| drag(context, found, 0.25, [16, 2], CENTRE, 1.0)),
    ],
};

/// Of the drag factor, at all relaxation times.
const TOLERANCE: f64 = 0.02;
/// Edge of a cell (m), as in the case file.
const CELL: f64 = 1e-4;
/// The force on the sphere is to be within this of the driving force on the fluid: what is left of the approach to the steady
/// state is a third of it.
const BALANCE: f64 = 1e-3;
/// Largest relative change of the mean velocity, in the time constant of its approach, that counts as steady.
const STEADY: f64 = 5e-4;

/// Distance of the centres from the middle of a cell (cells); the second one has no symmetry.
const CENTRE: [f64; 3] = [0.0; 3];
const ASIDE: [f64; 3] = [0.3, -0.2, 0.45];

/// Runs to the steady state and checks `K = rho a L^3 / (6 pi mu R U)`. Neighbours are `edge` cells apart; a sphere must not be
/// larger than half the box, so that dense arrays need `copies` of them in each direction.
fn drag(
    context: &SuiteContext,
    found: &mut Findings,
    volume_fraction: f64,
    [edge, copies]: [usize; 2],
    shift: [f64; 3],
    relaxation_time: f64,
) -> Result<()> {
    let length = edge as f64 * CELL;
    let radius = 0.5 * length * (6.0 * volume_fraction / PI).cbrt();
    let diameter = 2.0 * radius;
    let side = copies * edge;
    let centres: Vec<[f64; 3]> = (0..copies.pow(3))
        .map(|n| {
            let cell = [n % copies, n / copies % copies, n / (copies * copies)];
            std::array::from_fn(|a| ((edge / 2 + edge * cell[a]) as f64 + 0.5 + shift[a]) * CELL)
        })
        .collect();
    let size = side as f64 * CELL;
    let own = [
        format!("domain.size=[{size:e}, {size:e}, {size:e}]"),
        format!("lattice.cells_per_diameter={:e}", diameter / CELL),
        format!("lattice.relaxation_time={relaxation_time:e}"),
        format!("particles.0.shape.sphere.diameter={diameter:e}"),
        format!("particles.0.list={centres:?}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let fluid = setup.expect_fluid();
    let (viscosity, acceleration) = (fluid.viscosity, fluid.body_acceleration.at(0.0).z);
    let expected = Table::new(REFERENCE).of("phi", &volume_fraction.to_string(), "K");
    // The mass of the cell over the drag per velocity.
    let time_constant = length.powi(3) / (6.0 * PI * viscosity * radius * expected);
    let interval = (time_constant / setup.time_step).ceil() as u64;

    let mut run = Simulation::solo(&setup)?;
    let mut velocity = 0.0;
    loop {
        run.advance(interval)?;
        let before = std::mem::replace(&mut velocity, run.mean_flow().velocity.z);
        if (velocity - before).abs() < STEADY * velocity.abs() {
            break;
        }
        if run.steps_done() >= setup.plan.end_step {
            return Err(unsteady("mean velocity (m/s)", velocity));
        }
    }

    let (tau, cells) = (fluid.relaxation_time, diameter / setup.domain.dx);
    let position = if shift.iter().all(|s| s.abs() < 1e-9) { "centre" } else { "aside" };
    let name = format!("phi {volume_fraction}, tau {tau}, {cells:.1} cells, {position}");
    let drag_factor = acceleration * length.powi(3) / (6.0 * PI * viscosity * radius * velocity);
    found.relative(format!("K, {name}"), drag_factor, expected, TOLERANCE);

    // Independent of the flow: in the steady state the sphere takes up all momentum that is fed in where it is not.
    let cell = setup.domain.dx.powi(3);
    let free = if matches!(fluid.coupling, Method::Saturated(_)) {
        // Each cell is driven as far as it is fluid, and fractions are exact.
        (1.0 - volume_fraction) * length.powi(3)
    } else {
        cells_beside(&setup, radius) as f64 * cell / copies.pow(3) as f64
    };
    let fed = setup.fluid_density() * acceleration * free;
    let force = run.loads().next().map_or(f64::NAN, |(_, load)| load.force.z);
    found
        .relative(format!("force over that fed in, {name}"), force / fed, 1.0, BALANCE)
        .source("balance of momentum");
    found.note(format!("Reynolds number, {name}"), velocity * diameter / viscosity);
    Ok(())
}

/// Cells that no sphere touches with the ramp of its solid fraction.
fn cells_beside(setup: &Setup, radius: f64) -> usize {
    let reach = radius + setup.expect_fluid().coupling.half_layer() * setup.domain.dx;
    let [nx, ny, nz] = setup.domain.cells;
    let clear = |n: &usize| {
        let cell = [n % nx, n / nx % ny, n / (nx * ny)];
        let centre = Vec3::from(cell.map(|c| (c as f64 + 0.5) * setup.domain.dx));
        let distance = |p: &Particle| setup.domain.nearest_image(centre - p.position()).norm();
        setup.particles.iter().all(|p| distance(p) >= reach)
    };
    (0..nx * ny * nz).filter(clear).count()
}
