//! Effective viscosity of a sheared suspension: `validation/shear_viscosity`.

use super::prelude::*;
use super::shear::shear_rate;
use turbid::output::estimate_mean;

const TEXT: &str = include_str!("../../../../validation/shear_viscosity/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/shear_viscosity/reference.csv");

pub(super) const CASE: Case = Case {
    name: "shear_viscosity",
    question: "viscosity of a sheared suspension of spheres, volume fractions 0.05 to 0.2",
    source: "Eilers (1941), doi:10.1007/BF01503023",
    parts: &[Part::wide(60.0, suspensions)],
};

/// Of what the spheres add to the viscosity.
const TOLERANCE: f64 = 0.25;
/// Strain from which on the stress is averaged.
const FROM: f64 = 3.0;
const EVERY: u64 = 40;

fn suspensions(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let table = Table::new(REFERENCE);
    let mut points = Vec::new();
    for phi in [0.05, 0.1, 0.2] {
        let own = [format!("particles.0.volume_fraction={phi}")];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let [low, high] = ["z-", "z+"].map(|name| {
            let wall = setup.walls.iter().position(|wall| wall.name == name);
            wall.expect("the case has plates")
        });
        let (size, rate) = (setup.domain.size(), shear_rate(&setup));
        let watch = Watch { context, setup: &setup, threads: context.threads, every: EVERY };
        // Strain, and stress on the plates (Pa).
        let series: Vec<[f64; 2]> = watch.rows(|run, rows: &mut Vec<_>| {
            let loads = run.on_root(|run| Ok(run.wall_loads()))?;
            let stress = 0.5 * (loads[low].force.x - loads[high].force.x) / (size.x * size.y);
            rows.push([rate * run.steps_done()? as f64 * setup.time_step, stress]);
            Ok(false)
        })?;
        let plain = setup.fluid_density() * setup.expect_fluid().viscosity * rate;
        let steady = series.iter().filter(|at| at[0] > FROM).map(|at| at[1] / plain);
        let steady: Vec<f64> = steady.collect();
        let Some(mean) = estimate_mean(&steady) else {
            return Err(unsteady("strain", FROM));
        };
        let expected = table.at("phi", phi, "eilers");
        let quantity = format!("viscosity over that of the fluid, less one, phi {phi} (-)");
        found.relative(quantity, mean.mean - 1.0, expected - 1.0, TOLERANCE);
        let error = mean.standard_error.unwrap_or(f64::NAN);
        found.note(format!("its standard error, phi {phi}"), error);
        points.push([phi, mean.mean]);
    }
    let columns = |name| table.points(None, ["phi", name]);
    found.plot(
        "viscosity",
        "Viscosity of a sheared suspension over that of the fluid",
        ["volume fraction (-)", "relative viscosity (-)"],
        [
            reference("Batchelor and Green (1972)", columns("batchelor_green")),
            measured("Eilers", columns("eilers")),
            overlaid("measured", points),
        ],
    );
    Ok(())
}
