//! Drag factor of a simple-cubic array of fixed spheres: `validation/sphere_array`.

use super::context::unsteady;
use super::reference::Table;
use super::{Case, Findings, Part, SuiteContext};
use std::f64::consts::PI;
use turbid::case::Setup;
use turbid::comm::Comm;
use turbid::domain::Decomposition;
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::particle::Particle;
use turbid::simulation::Simulation;

const TEXT: &str = include_str!("../../../../validation/sphere_array/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/sphere_array/reference.csv");

pub(super) const CASE: Case = Case {
    name: "sphere_array",
    question: "drag factor K of a fixed simple-cubic array of spheres in slow flow",
    source: "Zick and Homsy (1982), doi:10.1017/S0022112082000627",
    parts: &[
        Part::quick(2.0, |context| drag(context, &Array::at(0.027, 33, 1))),
        Part::quick(1.0, |context| drag(context, &Array::at(0.064, 25, 1))),
        Part::quick(1.0, |context| drag(context, &Array::at(0.064, 25, 1).aside())),
        Part::quick(2.0, |context| drag(context, &Array::at(0.125, 20, 2))),
        Part::quick(3.0, |context| drag(context, &Array::at(0.125, 20, 2).aside())),
        Part::quick(1.0, |context| drag(context, &Array::at(0.216, 17, 2))),
        Part::quick(1.0, |context| drag(context, &Array::at(0.25, 16, 2))),
        Part::quick(3.0, |context| drag(context, &Array::at(0.064, 25, 1).fluid(0.55))),
        Part::quick(3.0, |context| drag(context, &Array::at(0.25, 16, 2).fluid(0.55))),
        Part::quick(1.0, |context| drag(context, &Array::at(0.064, 25, 1).fluid(1.0))),
        Part::quick(1.0, |context| drag(context, &Array::at(0.25, 16, 2).fluid(1.0))),
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

/// What is run. A sphere must not be larger than half the box, so that dense arrays need `copies` of them in each direction.
struct Array {
    volume_fraction: f64,
    /// Distance of neighbours (cells).
    edge: usize,
    copies: usize,
    /// Distance of the centres from the middle of a cell (cells).
    shift: [f64; 3],
    relaxation_time: f64,
}

impl Array {
    fn at(volume_fraction: f64, edge: usize, copies: usize) -> Self {
        Self { volume_fraction, edge, copies, shift: [0.0; 3], relaxation_time: 0.65 }
    }

    /// With another relaxation time.
    fn fluid(self, relaxation_time: f64) -> Self {
        Self { relaxation_time, ..self }
    }

    /// At a place without symmetry.
    fn aside(self) -> Self {
        Self { shift: [0.3, -0.2, 0.45], ..self }
    }
}

/// Runs to the steady state and checks `K = rho a L^3 / (6 pi mu R U)`.
fn drag(context: &SuiteContext, array: &Array) -> Result<Findings> {
    let &Array { volume_fraction, edge, copies, shift, .. } = array;
    let length = edge as f64 * CELL;
    let radius = 0.5 * length * (6.0 * volume_fraction / PI).cbrt();
    let diameter = 2.0 * radius;
    let side = copies * edge;
    let centres: Vec<[f64; 3]> = (0..copies.pow(3))
        .map(|n| {
            let place = [n % copies, n / copies % copies, n / (copies * copies)];
            std::array::from_fn(|a| ((edge / 2 + edge * place[a]) as f64 + 0.5 + shift[a]) * CELL)
        })
        .collect();
    let size = side as f64 * CELL;
    let own = [
        format!("domain.size=[{size:e}, {size:e}, {size:e}]"),
        format!("lattice.cells_per_diameter={:e}", diameter / CELL),
        format!("lattice.relaxation_time={:e}", array.relaxation_time),
        format!("particles.0.shape.sphere.diameter={diameter:e}"),
        format!("particles.0.list={centres:?}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (viscosity, acceleration) =
        (setup.expect_fluid().viscosity, setup.expect_fluid().body_acceleration.z);
    let key = format!("{volume_fraction}");
    let expected = Table::new(REFERENCE).of("phi", &key, "K");
    // The mass of the cell over the drag per velocity.
    let time_constant = length.powi(3) / (6.0 * PI * viscosity * radius * expected);
    let interval = (time_constant / setup.time_step).ceil() as u64;

    let decomposition = Decomposition::solo(setup.domain);
    let mut run = Simulation::with_prescribed_motion(&setup, &decomposition, Comm::Solo)?;
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

    let tau = setup.expect_fluid().relaxation_time;
    let cells = diameter / setup.domain.dx;
    let place = if shift.iter().all(|s| s.abs() < 1e-9) { "centre" } else { "aside" };
    let name = format!("phi {volume_fraction}, tau {tau}, {cells:.1} cells, {place}");
    let mut found = Findings::default();
    let drag_factor = acceleration * length.powi(3) / (6.0 * PI * viscosity * radius * velocity);
    found.relative(format!("K, {name}"), drag_factor, expected, TOLERANCE);

    // Independent of the flow: in the steady state the sphere takes up all momentum that is fed in where it is not.
    let cell = setup.domain.dx.powi(3);
    let free = if setup.expect_fluid().solids.is_saturated() {
        // Each cell is driven as far as it is fluid, and fractions are exact.
        (1.0 - volume_fraction) * length.powi(3)
    } else {
        cells_beside(&setup, radius) as f64 * cell / copies.pow(3) as f64
    };
    let fed = setup.fluid_density() * acceleration * free;
    let force = run.loads().next().map_or(f64::NAN, |(_, load)| load.force.z);
    found.relative(format!("force over that fed in, {name}"), force / fed, 1.0, BALANCE);
    found.from("balance of momentum");
    found.note(format!("Reynolds number, {name}"), velocity * diameter / viscosity);
    Ok(found)
}

/// Cells that no sphere touches with the ramp of its solid fraction.
fn cells_beside(setup: &Setup, radius: f64) -> usize {
    let reach = radius + setup.expect_fluid().fraction.half_layer() * setup.domain.dx;
    let [nx, ny, nz] = setup.domain.cells;
    let clear = |n: &usize| {
        let cell = [n % nx, n / nx % ny, n / (nx * ny)];
        let place = Vec3::from(cell.map(|c| (c as f64 + 0.5) * setup.domain.dx));
        let distance = |p: &Particle| setup.domain.nearest_image(place - p.position()).norm();
        setup.particles.iter().all(|p| distance(p) >= reach)
    };
    (0..nx * ny * nz).filter(clear).count()
}
