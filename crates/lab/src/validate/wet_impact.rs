//! Impacts of a sphere on a wall in a viscous fluid: `validation/wet_impact`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/wet_impact/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/wet_impact/reference.csv");

pub(super) const CASE: Case = Case {
    name: "wet_impact",
    question: "rebound of a sphere from a wall in a viscous fluid over the Stokes number, 5 to 190",
    source: "Joseph et al. (2001), doi:10.1017/S0022112001003470; Legendre et al. (2005), Phys. Fluids 17, 097105",
    parts: &[Part::wide(60.0, impacts)],
};

/// Stokes numbers `rho_p D U / (9 mu)` of the throws.
const STOKES: [f64; 6] = [12.0, 20.0, 35.0, 50.0, 100.0, 200.0];
/// Reynolds number of the throws, as in the case file.
const REYNOLDS: f64 = 25.0;
/// Gap (diameters) at which the speed of approach is taken.
const NEAR: f64 = 0.25;
/// Gap (diameters) beyond which a sphere has left the wall, and the film at it.
const LEFT: f64 = 0.05;
/// Young's modulus per density of the sphere (Pa m^3/kg), so that all contacts last as long.
const MODULUS: f64 = 5.0;

fn impacts(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let (mut points, mut paths) = (Vec::new(), Vec::new());
    for stokes in STOKES {
        let density = 1000.0 * 9.0 * stokes / REYNOLDS;
        let own = [
            format!("particles.0.density={density:e}"),
            format!("contact.youngs_modulus={:e}", MODULUS * density),
        ];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let dry = setup.contact.as_ref().map_or(1.0, |contact| contact.pair(0, 0).restitution);
        let course = sphere_course(context, &setup, context.threads, f64::NEG_INFINITY)?;
        let lowest = course.iter().map(|at| at[1]).fold(f64::INFINITY, f64::min);
        let near = course.iter().find(|at| at[1] < NEAR);
        let approach = near.map(|at| -at[2]).ok_or_else(|| unsteady("least gap to the wall (D)", lowest))?;
        // The largest speed away from the wall after it has left; zero if it never does.
        let away = course.iter().filter(|at| at[1] > LEFT);
        let rebound = away.map(|at| at[2]).fold(0.0, f64::max);
        let viscosity = setup.expect_fluid().viscosity * setup.fluid_density();
        let near = density * setup.diameter * approach / (9.0 * viscosity);
        let part = rebound / approach / dry;
        found.note(format!("Stokes number near the wall, thrown at {stokes}"), near);
        found.note(format!("restitution over dry, thrown at {stokes}"), part);
        let deep = (-lowest * setup.diameter).max(0.0) / setup.diameter;
        found.note(format!("deepest overlap (D), thrown at {stokes}"), deep);
        points.push([near, part]);
        paths.push(measured(format!("St {stokes}"), course.iter().step_by(4).map(|at| [at[0], at[1]])));
    }
    let table = Table::new(REFERENCE);
    let column = |name| table.points(None, ["St", name]);
    for &[stokes, part] in &points {
        let [low, high] = ["low", "high"].map(|name| interpolated(&column(name), stokes));
        let quantity = format!("restitution over dry at St {stokes:.1}, of the experiments (-)");
        found.absolute(&quantity, part, 0.5 * (low + high), 0.5 * (high - low));
    }
    let plot = found.plot(
        "restitution",
        "Restitution in a viscous fluid over that without",
        ["Stokes number (-)", "restitution over dry (-)"],
        [
            reference("Legendre et al. (2005)", column("e")),
            measured("experiments, lowest", column("low")),
            measured("experiments, highest", column("high")),
            measured("measured", points),
        ],
    );
    plot.logarithmic([true, false]);
    let axes = ["time (s)", "gap over diameter (-)"];
    found.plot("paths", "Gap between sphere and wall", axes, paths);
    Ok(())
}
