//! Flow from an inlet to an outlet and beside a plane of symmetry: `validation/open_faces`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/open_faces/case.toml");
const SPHERES: &str = include_str!("../../../../validation/open_faces/spheres.toml");

pub(super) const CASE: Case = Case {
    name: "open_faces",
    question: "Poiseuille flow from an inlet to an outlet, half a channel beside a plane of symmetry, spheres in a row, sound that leaves",
    source: "Hagen and Poiseuille, exact",
    parts: &[
        Part::quick(15.0, channels),
        Part::quick(1.0, half),
        Part::quick(60.0, spheres),
        Part::quick(2.0, sound),
    ],
};

/// Of the order.
const ORDER: f64 = 0.2;
/// Of velocity and pressure with 32 cells between the plates, over their largest values.
const ERROR: f64 = 2e-3;
/// Of the flow through the outlet over that through the inlet, and of what is the same but for rounding.
const MASS: f64 = 1e-6;
const ROUNDING: f64 = 1e-11;
/// Of the drag on spheres between inlet and outlet over that in a periodic box.
const DRAG: f64 = 0.02;
/// Of the energy of a pulse of sound, and of its largest pressure.
const REFLECTED: f64 = 0.01;
const PRESSURE: f64 = 0.01;
/// Cells between the plates.
const HEIGHTS: [usize; 3] = [8, 16, 32];

/// Errors of velocity and pressure over their largest values, root of the mean square, and the flow out over the flow in.
fn channel(context: &SuiteContext, height: usize) -> Result<[f64; 3]> {
    let dx = 1.6e-3 / height as f64;
    let own = [
        format!("domain.size={:?}", [3.2e-3, 4.0 * dx, 1.6e-3]),
        format!("particles.0.shape.sphere.diameter={}", 2.0 * dx),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let ([nx, _, nz], units) = (setup.domain.cells, setup.units());
    let (mean, fluid) = (5e-4, run.fluid().expect("the case has one"));
    let gradient = 12.0 * setup.expect_fluid().viscosity * mean / (1.6e-3 * 1.6e-3);
    let mut squares = [0.0; 2];
    for (z, x) in (0..nz).flat_map(|z| (0..nx).map(move |x| (z, x))) {
        let s = (z as f64 + 0.5) / nz as f64;
        let (rho, u) = fluid.moments([x, 1, z]);
        let velocity = u[0] * units.velocity() / (1.5 * mean) - 4.0 * s * (1.0 - s);
        let exact = gradient * setup.fluid_density() * (nx as f64 - x as f64 - 0.5) * dx;
        let pressure = (rho - 1.0) * units.pressure() - exact;
        squares[0] += velocity * velocity;
        squares[1] += (pressure / (gradient * setup.fluid_density() * 3.2e-3)).powi(2);
    }
    let [velocity, pressure] = squares.map(|sum| (sum / (nx * nz) as f64).sqrt());
    let flows = run.mass_flows();
    Ok([velocity, pressure, -flows[1] / flows[0]])
}

fn channels(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let errors: Vec<[f64; 3]> =
        HEIGHTS.iter().map(|&height| channel(context, height)).collect::<Result<_>>()?;
    for (of, name) in ["velocity", "pressure"].into_iter().enumerate() {
        for n in 1..HEIGHTS.len() {
            let order = (errors[n - 1][of] / errors[n][of]).log2();
            let quantity = format!("order of the {name}, {} to {} cells (-)", HEIGHTS[n - 1], HEIGHTS[n]);
            found.absolute(quantity, order, 2.0, ORDER).source("Chapman-Enskog expansion: second order");
        }
        let quantity = format!("error of the {name} over its largest value, 32 cells (-)");
        found.absolute(quantity, errors[2][of], 0.0, ERROR);
    }
    let quantity = "mass flow through the outlet over that through the inlet (-)";
    found.relative(quantity, errors[2][2], 1.0, MASS).source("balance of mass");
    let points = |of: usize| HEIGHTS.iter().zip(&errors).map(move |(n, e)| [*n as f64, e[of]]);
    let second = HEIGHTS.iter().map(|&n| [n as f64, errors[0][0] * (8.0 / n as f64).powi(2)]);
    let axes = ["cells between the plates (-)", "error over largest value (-)"];
    let curves =
        [reference("second order", second), measured("velocity", points(0)), measured("pressure", points(1))];
    found.plot("convergence", "Poiseuille flow from inlet to outlet", axes, curves).logarithmic([true; 2]);
    Ok(())
}

/// Half a channel beside a plane of symmetry, and the whole one, after the same steps.
fn half(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = ["run.end.steps=1500".to_string()];
    let slip =
        ["domain.size=[3.2e-3, 4e-4, 8e-4]".to_string(), "domain.faces.\"z+\"={free_slip=true}".to_string()];
    let steady = |own: &[String]| -> Result<Vec<[f64; 3]>> {
        let setup = context.setup(TEXT, CASE.name, own)?;
        let mut run = Simulation::solo(&setup)?;
        run.advance(setup.plan.end_step)?;
        let cells = (0..8).flat_map(|z| (0..32).map(move |x| [x, 1, z]));
        Ok(cells.map(|cell| run.fluid().expect("the case has one").moments(cell).1).collect())
    };
    let (whole, half) = (steady(&own)?, steady(&[&own[..], &slip].concat())?);
    let norm = |u: &[f64; 3]| u.iter().map(|u| u * u).sum::<f64>().sqrt();
    let apart = whole.iter().zip(&half).map(|(a, b)| norm(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]));
    let apart = apart.fold(0.0, f64::max) / whole.iter().map(norm).fold(0.0, f64::max);
    let quantity = "half a channel: largest difference of the velocity from the whole one (-)";
    found.absolute(quantity, apart, 0.0, ROUNDING).source("symmetry");
    Ok(())
}

/// The force (N) that a layer of spheres takes from the flow over the superficial velocity (m/s), in the steady state.
fn resistance(context: &SuiteContext, own: &[String]) -> Result<f64> {
    let setup = context.setup(SPHERES, CASE.name, own)?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let velocity = run.measure().mean.velocity.x;
    if setup.domain.is_periodic(0) {
        let mass = setup.fluid_density() * setup.domain.volume();
        return Ok(mass * run.acceleration().x / velocity);
    }
    let middle = run.loads().filter(|(id, _)| *id < 3).map(|(_, load)| load.force.x);
    let (sum, count) = middle.fold((0.0, 0.0), |(sum, count), force| (sum + force, count + 1.0));
    Ok(sum / count / velocity)
}

fn spheres(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let periodic = [
        "domain={ size = [1e-3, 1e-3, 1e-3] }".to_string(),
        "particles.0.list=[[5e-4, 5e-4, 5e-4]]".to_string(),
        "particles.1.list=[]".to_string(),
        "driving.net_flux=[1e-3, 0, 0]".to_string(),
    ];
    let (between, alone) = (resistance(context, &[])?, resistance(context, &periodic)?);
    let quantity =
        "row of spheres: force on a layer between inlet and outlet over that in a periodic box (-)";
    found.relative(quantity, between / alone, 1.0, DRAG).source("the same array in a periodic box");
    Ok(())
}

/// Energy of a pulse of sound that an inlet has sent, 58 cells long, once it has met the outlet, over that before; and the mean pressure 20
/// crossings of the box later, over the largest one of the pulse.
fn pulse(context: &SuiteContext, absorbs: bool) -> Result<[f64; 2]> {
    let (dt, velocity) = (1e-4 / 3.0, 3e-4);
    let own = [
        "domain.size=[1.6e-2, 2e-4, 2e-4]".to_string(),
        format!(
            "domain.faces={{ x-.inlet.velocity.table=[[0, 0, 0, 0], [{}, {velocity}, 0, 0], [{}, 0, 0, 0]], \"x+\".outlet.absorbs_sound={absorbs}, z-.free_slip=true, \"z+\".free_slip=true }}",
            50.0 * dt,
            100.0 * dt
        ),
        "lattice.relaxation_time=0.51".to_string(),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let cells = |run: &Simulation| -> Vec<(f64, [f64; 3])> {
        (0..160).map(|x| run.fluid().expect("the case has one").moments([x, 0, 0])).collect()
    };
    // Kinetic, and of the pressure: c_s^2 = 1/3 (lattice units).
    let energy = |run: &Simulation| -> f64 {
        let of = |(rho, u): (f64, [f64; 3])| 0.5 * u[0] * u[0] + (rho - 1.0) * (rho - 1.0) / 6.0;
        cells(run).into_iter().map(of).sum()
    };
    run.advance(140)?;
    let before = energy(&run);
    run.advance(260)?;
    let left = energy(&run) / before;
    run.advance(20 * 277)?;
    let mean = cells(&run).iter().map(|(rho, _)| rho - 1.0).sum::<f64>() / 160.0;
    let largest = velocity / setup.units().velocity() * 3.0_f64.sqrt();
    Ok([left, mean / largest])
}

fn sound(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let [absorbed, kept] = [pulse(context, true)?, pulse(context, false)?];
    let quantity = "pulse of sound: energy that an outlet that absorbs it leaves in the box (-)";
    found.absolute(quantity, absorbed[0], 0.0, REFLECTED).source("a box without an end");
    let quantity = "pulse of sound: mean pressure 20 crossings later over the largest one of the pulse (-)";
    found.absolute(quantity, absorbed[1], 0.0, PRESSURE).source("the pressure of the outlet");
    found.note("pulse of sound: energy that an outlet that reflects it leaves in the box (-)", kept[0]);
    Ok(())
}
