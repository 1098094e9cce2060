//! Flow past a fixed sphere: `validation/flow_past_sphere`.

use super::cylinder::frequency;
use super::mesh_walls::spheres;
use super::prelude::*;
use super::vessels::add_mesh;
use std::f64::consts::PI;
use turbid::wall::Motion;

const TEXT: &str = include_str!("../../../../validation/flow_past_sphere/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/flow_past_sphere/reference.csv");

pub(super) const CASE: Case = Case {
    name: "flow_past_sphere",
    question: "drag on a fixed sphere at Reynolds numbers of 100 and 300, and the frequency of its vortices",
    source: "Clift, Grace and Weber (1978), Bubbles, Drops, and Particles, Table 5.2",
    parts: &[Part::full(1500.0, steady), Part::full(2400.0, shedding)],
};

/// Of the drag, and of its change over the last tenth of the run.
const DRAG: f64 = 0.02;
const STEADY: f64 = 0.004;
/// Of the Strouhal number, mean drag and mean lift while vortices leave the sphere: published drags are 4 % apart, lifts 12 %.
const STROUHAL: f64 = 0.05;
const SHEDDING_DRAG: f64 = 0.05;
const LIFT: f64 = 0.1;
const SHEDDING_SOURCE: &str = "Johnson and Patel (1999), doi:10.1017/S0022112098003206";
/// Diameter of the sphere (m), and velocity of the fluid (m/s).
const DIAMETER: f64 = 1e-3;
const VELOCITY: f64 = 0.1;

fn steady(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let unit = setup.fluid_density() * (VELOCITY * DIAMETER).powi(2) * PI / 8.0;
    let every = ((0.1 * DIAMETER / VELOCITY / setup.time_step) as u64).max(1);
    let watch = Watch { context, setup: &setup, threads: context.threads, every };
    // Coefficient of drag, ten times in the time that the fluid takes for a diameter.
    let course = watch.rows(|run, rows: &mut Vec<f64>| {
        rows.push(run.loads()?[0].force.x / unit);
        Ok(false)
    })?;
    let (last, before) = (course[course.len() - 1], course[course.len() * 9 / 10]);
    if (last / before - 1.0).abs() > STEADY {
        return Err(unsteady("the drag on the sphere changes by", last / before - 1.0));
    }
    let reference = Table::new(REFERENCE).at("reynolds", 100.0, "drag");
    found.relative("Reynolds number 100: coefficient of drag (-)", last, reference, DRAG);
    Ok(())
}

/// A sphere of facets of 32 cells, at a Reynolds number of 300, in a channel without friction at its sides.
fn shedding(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let [length, width, ahead] = [13.0, 6.0, 4.0];
    let slip = ["y-", "y+", "z-", "z+"].map(|face| format!("domain.faces.\"{face}\"={{ free_slip = true }}"));
    let own = [
        format!("domain.size={{ diameters = [{length}, {width}, {width}] }}"),
        format!("fluid.viscosity={:e}", VELOCITY * DIAMETER / 300.0),
        "lattice.cells_per_diameter=32".to_string(),
        "lattice.relaxation_time=0.53".to_string(),
        "lattice.magic_parameter=0.02".to_string(),
        format!(
            "particles=[{{ shape = {{ sphere = {{ diameter = {DIAMETER:e} }} }}, density = 1000, list = [] }}]"
        ),
        "run.end.time=0.9".to_string(),
    ];
    let mut setup = context.setup(TEXT, CASE.name, &[&own[..], &slip[..]].concat())?;
    // Aside, lest the wake stay symmetrical for long.
    let centre = DIAMETER * Vec3::new(ahead, 0.5 * width + 0.05, 0.5 * width);
    add_mesh(&mut setup, "sphere", spheres(&[centre], 0.5 * DIAMETER, 4), Motion::default());

    let unit = setup.fluid_density() * (VELOCITY * DIAMETER).powi(2) * PI / 8.0;
    let every = ((0.1 * DIAMETER / VELOCITY / setup.time_step) as u64).max(1);
    let watch = Watch { context, setup: &setup, threads: context.threads, every };
    let (dt, sphere) = (setup.time_step, setup.walls.len() - 1);
    // Time (s) and coefficients of drag and lift, ten times in the time that the fluid takes for a diameter.
    let course = watch.rows(|run, rows: &mut Vec<[f64; 3]>| {
        let force = run.on_root(move |run| Ok(run.wall_loads()[sphere].force))?;
        rows.push([run.steps_done()? as f64 * dt, force.x / unit, force.y / unit]);
        Ok(false)
    })?;
    let late = &course[course.len() / 2..];
    let Some((frequency, [first, last])) = frequency(late.iter().map(|row| [row[0], row[2]])) else {
        return Err(unsteady("no vortices leave the sphere; its last lift is", late[late.len() - 1][2]));
    };
    let periods = late.iter().filter(|row| (first..last).contains(&row[0]));
    let mean =
        |column: usize| periods.clone().map(|row| row[column]).sum::<f64>() / periods.clone().count() as f64;
    let reference = |column: &str| Table::new(REFERENCE).at("reynolds", 300.0, column);
    for (what, value, column, tolerance) in [
        ("Strouhal number", frequency * DIAMETER / VELOCITY, "strouhal", STROUHAL),
        ("coefficient of drag", mean(1), "drag", SHEDDING_DRAG),
        ("coefficient of lift", mean(2).abs(), "lift", LIFT),
    ] {
        let quantity = format!("Reynolds number 300: {what} (-)");
        found.relative(quantity, value, reference(column), tolerance).source(SHEDDING_SOURCE);
    }
    let lift = course.iter().filter(|row| row[0] > 0.1).map(|row| [row[0], row[2].abs()]);
    let axes = ["t (s)", "coefficient of lift (-)"];
    found.plot("lift", "Lift of a sphere at a Reynolds number of 300", axes, [measured("lift", lift)]);
    Ok(())
}
