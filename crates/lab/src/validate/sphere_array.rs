//! Drag factor of a cubic array of fixed spheres: `validation/sphere_array`.

use super::prelude::*;
use std::f64::consts::PI;
use turbid::coupling::{CONTROL_INTERVAL, Method, SurfaceShift};

const TEXT: &str = include_str!("../../../../validation/sphere_array/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/sphere_array/reference.csv");
const SPHEROIDS: &str = include_str!("../../../../validation/sphere_array/spheroids.csv");
const SPHEROID_SOURCE: &str = "own solution by the Fourier series of the periodic Stokeslet";

pub(super) const CASE: Case = Case {
    name: "sphere_array",
    question: "drag factor K of a fixed cubic array of spheres in slow flow, volume fractions up to 0.5",
    source: "Zick and Homsy (1982), doi:10.1017/S0022112082000627",
    parts: &[
        Part::quick(2.0, |context, found| drag(context, found, 0.027, 33, CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, 25, CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, 25, ASIDE, 0.65)),
        Part::quick(2.0, |context, found| drag(context, found, 0.125, 20, CENTRE, 0.65)),
        Part::quick(3.0, |context, found| drag(context, found, 0.125, 20, ASIDE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.216, 17, CENTRE, 0.65)),
        Part::quick(1.0, |context, found| drag(context, found, 0.25, 16, CENTRE, 0.65)),
        Part::quick(3.0, |context, found| drag(context, found, 0.064, 25, CENTRE, 0.55)),
        Part::quick(3.0, |context, found| drag(context, found, 0.25, 16, CENTRE, 0.55)),
        Part::quick(1.0, |context, found| drag(context, found, 0.064, 25, CENTRE, 1.0)),
        Part::quick(1.0, |context, found| drag(context, found, 0.25, 16, CENTRE, 1.0)),
        Part::quick(1.0, |context, found| drag(context, found, 0.45, 13, ASIDE, 0.55)),
        Part::quick(1.0, |context, found| drag(context, found, 0.45, 13, ASIDE, 1.0)),
        Part::quick(2.0, |context, found| dense(context, found, 0.4, 21, 0.55)),
        Part::quick(2.0, |context, found| dense(context, found, 0.4, 21, 1.0)),
        Part::quick(2.0, |context, found| dense(context, found, 0.5, 19, 0.55)),
        Part::quick(2.0, |context, found| dense(context, found, 0.5, 19, 0.8)),
        Part::quick(2.0, |context, found| dense(context, found, 0.5, 19, 1.0)),
        Part::quick(20.0, |context, found| spheroid(context, found, 2.0)),
        Part::quick(20.0, |context, found| spheroid(context, found, 0.5)),
    ],
};

/// Of the drag factor, at all relaxation times, of the dense arrays, and of what the direction of a spheroid makes of it.
const TOLERANCE: f64 = 0.02;
const DENSE: f64 = 0.015;
const SPHEROID: f64 = 0.01;
/// Edge of a cell (m), as in the case file.
const CELL: f64 = 1e-4;
/// The force on the sphere is to be within this of the driving force on the fluid: what is left of the approach to the steady
/// state is a third of it.
const BALANCE: f64 = 1e-3;
/// Largest relative change of the mean velocity, in the time constant of its approach, that counts as steady.
const STEADY: f64 = 5e-4;

/// Least steps between two looks: in a dense array the flow is soon as fast as its force lets it, and is measured now and then only.
const LEAST: u64 = 20 * CONTROL_INTERVAL;

/// Distance of the centres from the middle of a cell (cells); the second one has no symmetry.
const CENTRE: [f64; 3] = [0.0; 3];
const ASIDE: [f64; 3] = [0.3, -0.2, 0.45];

/// A lattice of spheres: its name, the column of its reference, and the places of those of a unit cell in it.
struct Array {
    name: &'static str,
    column: &'static str,
    places: &'static [[f64; 3]],
}

const SIMPLE: Array = Array { name: "", column: "K", places: &[[0.0; 3]] };
const FACE_CENTRED: Array = Array {
    name: "face-centred, ",
    column: "K_face_centred",
    places: &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
};

/// One unit cell of an array, with an edge of `cells` cells.
struct Bed {
    array: &'static Array,
    volume_fraction: f64,
    cells: usize,
    shift: [f64; 3],
    relaxation_time: f64,
}

/// As [`settled`], of a simple-cubic array.
fn drag(
    context: &SuiteContext,
    found: &mut Findings,
    volume_fraction: f64,
    cells: usize,
    shift: [f64; 3],
    relaxation_time: f64,
) -> Result<()> {
    settled(context, found, &Bed { array: &SIMPLE, volume_fraction, cells, shift, relaxation_time })
}

/// The same of a face-centred one, aside.
fn dense(
    context: &SuiteContext,
    found: &mut Findings,
    volume_fraction: f64,
    edge: usize,
    relaxation_time: f64,
) -> Result<()> {
    let (array, cells, shift) = (&FACE_CENTRED, edge, ASIDE);
    settled(context, found, &Bed { array, volume_fraction, cells, shift, relaxation_time })
}

/// Runs to the steady state and checks `K = rho a L^3 / (6 pi mu R U)` for each sphere.
fn settled(context: &SuiteContext, found: &mut Findings, bed: &Bed) -> Result<()> {
    let Bed { array, volume_fraction, cells, shift, relaxation_time } = *bed;
    let tolerance = if volume_fraction >= 0.4 { DENSE } else { TOLERANCE };
    let count = array.places.len() as f64;
    let length = cells as f64 * CELL;
    let diameter = length * (6.0 * volume_fraction / (PI * count)).cbrt();
    let radius = 0.5 * diameter;
    let place = |place: &[f64; 3]| place_in(cells, *place, shift);
    let centres: Vec<[f64; 3]> = array.places.iter().map(place).collect();
    let own = [
        format!("lattice.relaxation_time={relaxation_time:e}"),
        format!("particles.0.shape.sphere.diameter={diameter:e}"),
        format!("particles.0.list={centres:?}"),
    ];
    let expected = Table::new(REFERENCE).of("phi", &volume_fraction.to_string(), array.column);
    let (setup, run, velocity, drag_factor) = steady(context, &own, length, diameter, count, expected)?;
    let fluid = setup.expect_fluid();

    let (tau, cells) = (fluid.relaxation_time, diameter / setup.domain.dx);
    let position = if shift.iter().all(|s| s.abs() < 1e-9) { "centre" } else { "aside" };
    let name = format!("{}phi {volume_fraction}, tau {tau}, {cells:.1} cells, {position}", array.name);
    found.relative(format!("K, {name}"), drag_factor, expected, tolerance);

    // Independent of the flow: in the steady state the sphere takes up all momentum that is fed in where it is not.
    let cell = setup.domain.dx.powi(3);
    let free = if matches!(fluid.coupling, Method::Saturated(_)) {
        // Each cell is driven as far as it is fluid: outside of the surface that the fluid feels, with exact fractions.
        let SurfaceShift { plane, curvature, .. } = SurfaceShift::FITTED;
        let felt = radius - (plane * setup.domain.dx - curvature * setup.domain.dx.powi(2) / radius);
        (1.0 - volume_fraction * (felt / radius).powi(3)) * length.powi(3)
    } else {
        cells_beside(&setup, radius) as f64 * cell
    };
    let fed = setup.fluid_density() * fluid.body_acceleration.at(0.0).z * free / count;
    let force = run.loads().next().map_or(f64::NAN, |(_, load)| load.force.z);
    found
        .relative(format!("force over that fed in, {name}"), force / fed, 1.0, BALANCE)
        .source("balance of momentum");
    found.note(format!("Reynolds number, {name}"), velocity * diameter / fluid.viscosity);
    Ok(())
}

/// Place (m) in a unit cell of `edge` cells, at a fraction of it and a shift (cells) from the middle of a cell.
fn place_in(edge: usize, place: [f64; 3], shift: [f64; 3]) -> [f64; 3] {
    let at = |a: usize| (edge / 2) as f64 + edge as f64 * place[a] + 0.5 + shift[a];
    std::array::from_fn(|a| at(a).rem_euclid(edge as f64) * CELL)
}

/// A unit cell of this edge with `count` bodies as large as spheres of a diameter, run until the mean velocity is steady, by its changes
/// in the time constant of its approach with the `expected` drag factor; that velocity, and the drag factor.
fn steady(
    context: &SuiteContext,
    own: &[String],
    length: f64,
    diameter: f64,
    count: f64,
    expected: f64,
) -> Result<(Setup, Simulation, f64, f64)> {
    let box_and_grid = [
        format!("domain.size=[{length:e}, {length:e}, {length:e}]"),
        format!("lattice.cells_per_diameter={:e}", diameter / CELL),
    ];
    let setup = context.setup(TEXT, CASE.name, &[&box_and_grid[..], own].concat())?;
    let fluid = setup.expect_fluid();
    let resistance = count * 3.0 * PI * fluid.viscosity * diameter;
    // The mass of the cell over the drag per velocity.
    let time_constant = length.powi(3) / (resistance * expected);
    let interval = ((time_constant / setup.time_step).ceil() as u64).max(LEAST);
    let mut run = Simulation::solo(&setup)?;
    let mut velocity = 0.0;
    loop {
        run.advance(interval)?;
        let before = std::mem::replace(&mut velocity, run.mean_flow().velocity.z);
        if (velocity - before).abs() < STEADY * velocity.abs() {
            let driven = fluid.body_acceleration.at(0.0).z * length.powi(3);
            return Ok((setup, run, velocity, driven / (resistance * velocity)));
        }
        if run.steps_done() >= setup.plan.end_step {
            return Err(unsteady("mean velocity (m/s)", velocity));
        }
    }
}

/// Checks the drag on a spheroid with these polar over equatorial semi-axes in a simple-cubic array, broadside minus axial.
fn spheroid(context: &SuiteContext, found: &mut Findings, ratio: f64) -> Result<()> {
    const EDGE: usize = 33;
    const VOLUME_FRACTION: f64 = 0.027;
    let length = EDGE as f64 * CELL;
    let diameter = length * (6.0 * VOLUME_FRACTION / PI).cbrt();
    let [polar, equatorial] = [2.0 / 3.0, -1.0 / 3.0].map(|power| diameter * ratio.powf(power));
    let axes = [[equatorial, equatorial, polar], [polar, equatorial, equatorial]];
    let of = |column: &str| Table::new(SPHEROIDS).of("ratio", &ratio.to_string(), column);
    let expected = [of("K_axial"), of("K_broadside")];
    let mut drag = [0.0; 2];
    for ((drag, axes), expected) in drag.iter_mut().zip(axes).zip(expected) {
        let own = [
            "lattice.relaxation_time=1".to_owned(),
            format!("particles.0.shape={{ ellipsoid = {{ axes = {axes:?} }} }}"),
            format!("particles.0.list=[{:?}]", place_in(EDGE, [0.0; 3], ASIDE)),
        ];
        (_, _, _, *drag) = steady(context, &own, length, diameter, 1.0, expected)?;
    }
    let cells = diameter / CELL;
    let name = |what: &str| format!("{what}, spheroid {ratio} to 1, phi {VOLUME_FRACTION}, {cells:.1} cells");
    for (what, at) in [("K, axial", 0), ("K, broadside", 1)] {
        found.relative(name(what), drag[at], expected[at], TOLERANCE).source(SPHEROID_SOURCE);
    }
    found
        .relative(name("K, broadside minus axial"), drag[1] - drag[0], expected[1] - expected[0], SPHEROID)
        .source(SPHEROID_SOURCE);
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
