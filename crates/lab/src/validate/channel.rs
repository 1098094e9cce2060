//! Steady flows between walls: `validation/channel`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/channel/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/channel/reference.csv");

pub(super) const CASE: Case = Case {
    name: "channel",
    question: "Poiseuille flow between plates and in a square and a 1:2 duct, forces on the walls, the viscosity of eddies",
    source: "White (2006), Viscous Fluid Flow, Eq. (3-48)",
    parts: &[
        Part::quick(0.5, plates),
        Part::quick(0.5, |context, found| duct(context, found, "square", [16, 16])),
        Part::quick(1.0, |context, found| duct(context, found, "one_to_two", [16, 32])),
        Part::quick(1.0, eddies),
    ],
};

/// Edge of a cell (m), as in the case file.
const CELL: f64 = 1e-4;
/// Of the profile between plates: exact on the lattice with the magic parameter 3/16; the rest is the approach.
const PLATES: f64 = 1e-6;
/// Of the largest and the mean velocity in a duct of 16 cells.
const DUCT: f64 = 5e-3;
/// Of the profile with the viscosity of eddies, over its maximum, with 24 cells.
const EDDIES: f64 = 5e-3;
/// Of the force on the walls against that on the fluid.
const FORCE: f64 = 1e-4;

/// Velocity along x (m/s) in the middle of the steps, of the cells of the plane `x = 1`, row by row; and the force on the
/// walls along x over that on the fluid.
fn steady(setup: &Setup) -> Result<(Vec<f64>, f64)> {
    let mut run = Simulation::solo(setup)?;
    run.advance(setup.plan.end_step)?;
    let half = 0.5 * run.acceleration().x * setup.time_step;
    let [_, ny, nz] = setup.domain.cells;
    let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
    let profile = rows.map(|(y, z)| {
        run.fluid().expect("the case has one").moments([1, y, z]).1[0] * setup.units().velocity() + half
    });
    let profile = profile.collect();
    let drag: f64 = run.wall_loads().iter().map(|load| load.force.x).sum();
    let fed =
        setup.fluid_density() * setup.domain.volume() * setup.expect_fluid().body_acceleration.at(0.0).x;
    Ok((profile, drag / fed))
}

fn plates(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let (profile, force) = steady(&setup)?;
    let [_, ny, nz] = setup.domain.cells;
    let (fluid, height) = (setup.expect_fluid(), setup.domain.size().z);
    let fastest = fluid.body_acceleration.at(0.0).x * height * height / (8.0 * fluid.viscosity);
    let points = (0..nz).map(|z| [(z as f64 + 0.5) / nz as f64, profile[1 + ny * z] / fastest]);
    let points: Vec<[f64; 2]> = points.collect();
    let exact = |s: f64| 4.0 * s * (1.0 - s);
    let worst = points.iter().map(|[s, u]| (u - exact(*s)).abs()).fold(0.0, f64::max);
    let quantity = "plates: largest error of the profile over its maximum (-)";
    found.absolute(quantity, worst, 0.0, PLATES).source(
        "Ginzburg and d'Humieres (2003), doi:10.1103/PhysRevE.68.066614: exact with the parameter 3/16",
    );
    found
        .relative("plates: force on the walls over that on the fluid (-)", force, 1.0, FORCE)
        .source("balance of momentum");
    let parabola = (0..=100).map(|k| [0.01 * f64::from(k), exact(0.01 * f64::from(k))]);
    let axes = ["height over distance (-)", "velocity over largest (-)"];
    let curves = [reference("parabola", parabola), measured("measured", points)];
    found.plot("plates", "Flow between two plates", axes, curves);
    Ok(())
}

/// Plates with the viscosity of Smagorinsky's eddies, which is greatest at the walls.
fn eddies(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    const CONSTANT: f64 = 0.5;
    let lattice = format!(
        "lattice={{ cells_per_diameter = 2, relaxation_time = 0.51, collision = \"recursive_regularised\", \
         smagorinsky = {CONSTANT} }}"
    );
    let own =
        ["domain.size=[4e-4, 4e-4, 2.4e-3]", "driving.body_acceleration=[0.6, 0.0, 0.0]", "run.end.time=6"];
    let own: Vec<String> = own.map(str::to_string).into_iter().chain([lattice]).collect();
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (profile, force) = steady(&setup)?;
    let [_, ny, nz] = setup.domain.cells;
    let (fluid, height) = (setup.expect_fluid(), setup.domain.size().z);
    let (nu, a) = (fluid.viscosity, fluid.body_acceleration.at(0.0).x);
    let square = (CONSTANT * CELL) * (CONSTANT * CELL);
    // The stress a s at the distance s from the middle is (nu + (C dx)^2 |u'|) |u'|.
    let integral = |s: f64| {
        let root = (nu * nu + 4.0 * square * a * s).sqrt();
        root * root * root / (12.0 * square * square * a) - nu * s / (2.0 * square)
    };
    let exact = |z: f64| integral(0.5 * height) - integral((z - 0.5 * height).abs());
    let fastest = exact(0.5 * height);
    let points = (0..nz).map(|z| [(z as f64 + 0.5) / nz as f64, profile[1 + ny * z] / fastest]);
    let points: Vec<[f64; 2]> = points.collect();
    let worst = points.iter().map(|[s, u]| (u - exact(s * height) / fastest).abs()).fold(0.0, f64::max);
    let quantity = "plates, Smagorinsky's constant 0.5: largest error of the profile over its maximum (-)";
    found
        .absolute(quantity, worst, 0.0, EDDIES)
        .source("integral of (nu + (C dx)^2 |u'|) u' = a (H / 2 - z)");
    let without = a * height * height / (8.0 * nu);
    let quantity = "plates, Smagorinsky's constant 0.5: largest velocity over that without eddies (-)";
    let middle = 0.5 * (profile[1 + ny * (nz / 2 - 1)] + profile[1 + ny * (nz / 2)]);
    let beside = exact(0.5 * height + 0.5 * CELL);
    found.relative(quantity, middle / without, beside / without, EDDIES).source("the same");
    let quantity = "plates, Smagorinsky's constant 0.5: force on the walls over that on the fluid (-)";
    found.relative(quantity, force, 1.0, FORCE).source("balance of momentum");
    let curve = (0..=100).map(|k| 0.01 * f64::from(k)).map(|s| [s, exact(s * height) / fastest]);
    let axes = ["height over distance (-)", "velocity over largest (-)"];
    let curves = [reference("exact", curve), measured("measured", points)];
    found.plot("eddies", "Flow between two plates with the viscosity of eddies", axes, curves);
    Ok(())
}

/// A duct of `ny` by `nz` cells, the shorter side first.
fn duct(context: &SuiteContext, found: &mut Findings, name: &str, [ny, nz]: [usize; 2]) -> Result<()> {
    let size = [4, ny, nz].map(|n| n as f64 * CELL);
    let own = [format!("domain.size={size:?}"), "domain.periodic=[true, false, false]".to_string()];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (profile, force) = steady(&setup)?;
    let [_, ny, nz] = setup.domain.cells;
    let (fluid, side) = (setup.expect_fluid(), setup.domain.size().y);
    let unit = fluid.body_acceleration.at(0.0).x * side * side / fluid.viscosity;
    // The axis lies between cells; the mean of the four beside it is that of the parabola there.
    let at = |y: usize, z: usize| profile[y + ny * z];
    let beside = |n: usize| [n / 2 - 1, n / 2];
    let four = beside(ny).into_iter().flat_map(|y| beside(nz).map(|z| at(y, z)));
    let inner: f64 = four.sum::<f64>() / 4.0;
    // The cells around these give the curvature on both axes: u(0) = u(h/2) + (u(h/2) - u(3h/2)) / 8.
    let ring = |y: usize, z: usize| 0.5 * (at(y, z) + at(ny - 1 - y, nz - 1 - z));
    let falls = (inner - ring(ny / 2 - 2, nz / 2)) + (inner - ring(ny / 2, nz / 2 - 2));
    let largest = (inner + falls / 8.0) / unit;
    let mean = profile.iter().sum::<f64>() / (ny * nz) as f64 / unit;
    let table = Table::new(REFERENCE);
    for (what, measured, column) in [("largest", largest, "u_max"), ("mean", mean, "u_mean")] {
        let quantity = format!("{name} duct: {what} velocity over a A^2 / nu (-)");
        found.relative(quantity, measured, table.of("duct", name, column), DUCT);
    }
    let quantity = format!("{name} duct: force on the walls over that on the fluid (-)");
    found.relative(quantity, force, 1.0, FORCE).source("balance of momentum");
    Ok(())
}
