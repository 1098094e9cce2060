//! Flow past a fixed sphere: `validation/flow_past_sphere`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/flow_past_sphere/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/flow_past_sphere/reference.csv");

pub(super) const CASE: Case = Case {
    name: "flow_past_sphere",
    question: "drag on a fixed sphere at a Reynolds number of 100",
    source: "Clift, Grace and Weber (1978), Bubbles, Drops, and Particles, Table 5.2",
    parts: &[Part::full(1500.0, steady)],
};

/// Of the drag, and of its change over the last tenth of the run.
const DRAG: f64 = 0.02;
const STEADY: f64 = 0.004;
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
