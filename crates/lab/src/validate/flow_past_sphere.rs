//! Drag on a sphere in a uniform flow: `validation/flow_past_sphere`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/flow_past_sphere/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/flow_past_sphere/reference.csv");

pub(super) const CASE: Case = Case {
    name: "flow_past_sphere",
    question: "drag on a fixed sphere in a uniform flow at a Reynolds number of 100",
    source: "Clift, Grace and Weber (1978), Table 5.2",
    parts: &[Part::full(150.0, drag)],
};

const DRAG: f64 = 0.02;
const DIAMETER: f64 = 1e-3;
const VELOCITY: f64 = 0.1;
/// Distances of the planes of symmetry beside the sphere (diameters).
const WIDTHS: [f64; 2] = [4.0, 6.0];

/// Coefficient of drag between planes at a distance (diameters).
fn coefficient(context: &SuiteContext, width: f64) -> Result<f64> {
    let own = [format!("domain.size.diameters=[16, {width}, {width}]")];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let area = PI * DIAMETER * DIAMETER / 4.0;
    // Of the quarter in the box.
    let unit = 0.25 * 0.5 * setup.fluid_density() * VELOCITY * VELOCITY * area;
    let now = |run: &Simulation| run.loads().map(|(_, load)| load.force.x).sum::<f64>() / unit;
    let tenth = setup.plan.end_step / 10;
    run.advance(setup.plan.end_step - tenth)?;
    let before = now(&run);
    run.advance(tenth)?;
    if (now(&run) / before - 1.0).abs() > 0.25 * DRAG {
        return Err(unsteady("the drag on the sphere changes by", now(&run) / before - 1.0));
    }
    Ok(now(&run))
}

fn drag(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let [near, far] = [coefficient(context, WIDTHS[0])?, coefficient(context, WIDTHS[1])?];
    // Linear in the part of the cross-section that the sphere takes.
    let [blocked, less] = WIDTHS.map(|width| PI / 16.0 / (width * width));
    let free = far - (near - far) * less / (blocked - less);
    let reference = Table::new(REFERENCE).at("reynolds", 100.0, "drag");
    found.relative("Reynolds number 100: coefficient of drag without blockage (-)", free, reference, DRAG);
    for (width, drag) in WIDTHS.into_iter().zip([near, far]) {
        found.note(format!("coefficient of drag, planes {width} diameters away (-)"), drag);
    }
    Ok(())
}
