//! Vortices that become turbulent: `validation/turbulence`.

use super::prelude::*;
use std::f64::consts::TAU;

const TEXT: &str = include_str!("../../../../validation/turbulence/case.toml");

pub(super) const CASE: Case = Case {
    name: "turbulence",
    question: "dissipation of Taylor-Green vortices at a Reynolds number of 1600, 64 and 128 cells",
    source: "van Rees et al. (2011), doi:10.1016/j.jcp.2010.11.031, spectral with 512 cells",
    parts: &[Part::wide(400.0, vortices)],
};

const CELLS: [usize; 2] = [64, 128];
/// The largest dissipation (U^3 / L), and its time (L / U).
const PEAK: f64 = 0.01286;
const TIME: f64 = 8.98;
/// Of its time, with 128 cells.
const WHEN: f64 = 0.03;

/// Kinetic energy over `rho U^2 V` at times in `L / U`.
fn energy(context: &SuiteContext, cells: usize) -> Result<Vec<[f64; 2]>> {
    let refined = cells as f64 / 128.0;
    let own = [
        format!("particles.0.shape.sphere.diameter={}", 2e-4 / refined),
        format!("lattice.time_step={}", 6.3662e-6 / refined),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let (length, speed) = (setup.domain.size().x / TAU, std::f64::consts::FRAC_PI_4);
    let whole = setup.fluid_density() * setup.domain.volume() * speed * speed;
    let unit = setup.time_step * speed / length;
    let every = (0.05 / unit).round() as u64;
    let watch = Watch { context, setup: &setup, threads: context.threads, every };
    watch.rows(|run, rows: &mut Vec<[f64; 2]>| {
        let time = run.steps_done()? as f64 * unit;
        let energy = run.on_root(|run| Ok(run.measure().mean.kinetic_energy))?;
        rows.push([time, energy / whole]);
        Ok(time > 12.0)
    })
}

fn vortices(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let mut curves = vec![reference("spectral, largest", vec![[0.0, PEAK], [12.0, PEAK]])];
    for cells in CELLS {
        let energy = energy(context, cells)?;
        // Over six rows, 0.3 L / U, in which acoustic waves average out.
        let dissipation: Vec<[f64; 2]> = energy
            .windows(7)
            .map(|w| [0.5 * (w[0][0] + w[6][0]), (w[0][1] - w[6][1]) / (w[6][0] - w[0][0])])
            .collect();
        let peak = dissipation.iter().copied().max_by(|a, b| a[1].total_cmp(&b[1])).expect("rows");
        if cells == 128 {
            let quantity = "time of the largest dissipation, 128 cells (L / U)";
            found.relative(quantity, peak[0], TIME, WHEN);
        } else {
            found.note(format!("time of the largest dissipation, {cells} cells (L / U)"), peak[0]);
        }
        // The lattice does not resolve the smallest vortices.
        let quantity = format!("largest dissipation, {cells} cells (U^3 / L)");
        found.absolute(quantity, peak[1], PEAK, f64::INFINITY);
        curves.push(measured(format!("{cells} cells"), dissipation));
    }
    found.plot(
        "dissipation",
        "Taylor-Green vortices at a Reynolds number of 1600",
        ["time (L / U)", "dissipation (U^3 / L)"],
        curves,
    );
    Ok(())
}
