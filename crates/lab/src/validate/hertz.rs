//! Elastic impacts of spheres by Hertz: `validation/hertz`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/hertz/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/hertz/reference.csv");

pub(super) const CASE: Case = Case {
    name: "hertz",
    question: "elastic impact of two spheres, and of one and a wall: force, duration, depth",
    source: "Hertz (1882); Chung and Ooi (2011), doi:10.1007/s10035-011-0277-0",
    parts: &[Part::quick(1.0, impacts)],
};

const TOLERANCES: [(&str, f64); 2] = [("hertz", 2e-3), ("paper", 1e-2)];

/// One contact: largest force (N) and depth (m), begin and end (s), and force over time.
#[derive(Clone, Default)]
struct Impact {
    force: f64,
    depth: f64,
    from: Option<f64>,
    to: Option<f64>,
    history: Vec<[f64; 2]>,
}

fn impacts(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let table = Table::new(REFERENCE);
    for (law, tolerance) in TOLERANCES {
        let own = [format!("contact.law={law:?}")];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let (dt, radius) = (setup.time_step, 0.5 * setup.diameter);
        let mut run = Simulation::solo(&setup)?;
        let mut both = [Impact::default(), Impact::default()];
        let mut before = [f64::NEG_INFINITY; 2];
        for step in 1..=setup.plan.end_step {
            run.advance(1)?;
            let time = step as f64 * dt;
            let all = run.particles();
            let depths =
                [2.0 * radius - (all[1].position() - all[0].position()).norm(), radius - all[2].position().z];
            for (n, impact) in both.iter_mut().enumerate() {
                // Between two steps, by linear interpolation.
                let at = time - dt * depths[n] / (depths[n] - before[n]);
                if depths[n] > 0.0 && impact.from.is_none() {
                    impact.from = Some(if before[n].is_finite() { at } else { 0.0 });
                } else if depths[n] <= 0.0 && before[n] > 0.0 {
                    impact.to = Some(at);
                }
                impact.depth = impact.depth.max(depths[n]);
            }
            before = depths;
            for state in run.contact_states() {
                let impact = &mut both[usize::from(state.wall().is_some())];
                let force = Vec3::from(state.force).norm();
                impact.force = impact.force.max(force);
                impact.history.push([time * 1e6, force * 1e-3]);
            }
        }
        for (impact, name) in both.iter().zip(["pair", "wall"]) {
            let (Some(from), Some(to)) = (impact.from, impact.to) else {
                return Err(unsteady("depth (m)", impact.depth));
            };
            for (what, measured, column) in [
                ("largest force (N)", impact.force, "force"),
                ("duration (s)", to - from, "duration"),
                ("largest depth (m)", impact.depth, "depth"),
            ] {
                let quantity = format!("{name}, law {law}: {what}");
                let reference = table.of("impact", name, column);
                found.relative(quantity, measured, reference, tolerance);
            }
        }
        if law == "hertz" {
            let peak = [table.of("impact", "pair", "duration"), table.of("impact", "pair", "force")];
            let (end, top) = (peak[0] * 1e6, peak[1] * 1e-3);
            let peak = reference("largest force and end", [[0.0, top], [end, top], [end, 0.0]]);
            found.plot(
                "force",
                "Force between two spheres of glass that meet at 10 m/s each",
                ["time (us)", "force (kN)"],
                [peak, measured("measured", both[0].history.clone())],
            );
        }
    }
    Ok(())
}
