//! One light sphere that rises from rest in a periodic cube: `validation/rising_sphere`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/rising_sphere/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/rising_sphere/reference.csv");

pub(super) const CASE: Case = Case {
    name: "rising_sphere",
    question: "a sphere much lighter than the fluid: how it starts to rise, and its terminal velocity",
    source: "Basset (1888), Maxey and Riley (1983), doi:10.1063/1.864230; Sangani and Acrivos (1982)",
    parts: &[
        Part::quick(2.0, |context, found| rise(context, found, 0.05, 8, 0.65)),
        Part::quick(2.0, |context, found| rise(context, found, 0.5, 8, 0.65)),
        Part::full(15.0, |context, found| rise(context, found, 0.05, 12, 0.65)),
        Part::full(15.0, |context, found| rise(context, found, 0.5, 12, 0.65)),
        Part::full(5.0, |context, found| rise(context, found, 0.05, 12, 1.0)),
    ],
};

/// Of the velocity in the early motion, and of the terminal velocity.
const EARLY: f64 = 0.05;
const TERMINAL: f64 = 0.03;
/// Times, in units of `D^2 / nu`, at which the early motion is compared: sound has passed the box, vorticity has not.
const TIMES: [f64; 2] = [0.1, 0.2];
/// Time after which the sphere is steady.
const END: f64 = 4.0;
/// Largest relative change of the velocity in the last quarter of it.
const STEADY: f64 = 0.01;

/// A sphere of this density ratio at this resolution and relaxation time.
fn rise(
    context: &SuiteContext,
    found: &mut Findings,
    ratio: f64,
    cells: u32,
    relaxation_time: f64,
) -> Result<()> {
    let own = [
        format!("particles.0.density={}", 1000.0 * ratio),
        format!("lattice.cells_per_diameter={cells}"),
        format!("lattice.relaxation_time={relaxation_time}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let fluid = setup.expect_fluid();
    let viscous = setup.diameter * setup.diameter / fluid.viscosity;
    let velocity = |run: &Simulation| run.particles()[0].velocity().z - run.mean_flow().velocity.z;
    let name = format!("density ratio {ratio}, {cells} cells, relaxation time {relaxation_time}");
    for time in TIMES {
        run.run_until(time * viscous)?;
        let expected = basset(&setup, run.time());
        let quantity = format!("U at t = {time} D^2 / nu over that of Basset, {name} (-)");
        found
            .relative(quantity, velocity(&run) / expected, 1.0, EARLY)
            .source("Basset-Boussinesq-Oseen equation, added mass 1/2, at rest at t = 0");
    }
    run.run_until(0.75 * END * viscous)?;
    let before = velocity(&run);
    run.run_until(END * viscous)?;
    let last = velocity(&run);
    if (last - before).abs() > STEADY * last.abs() {
        return Err(unsteady("velocity (m/s)", last));
    }
    let expected = Table::new(REFERENCE).at("L_over_D", 4.0, "sangani_acrivos");
    let terminal = last / fluid.scales.stokes_velocity.abs();
    found.relative(format!("U / U_Stokes, {name} (-)"), terminal, expected, TERMINAL);
    found.note(format!("steps, {name}"), run.steps_done() as f64);
    Ok(())
}

/// Velocity (m/s) of the sphere at a time (s) after
///
/// ```text
/// (s + 1/2) dU/dt = (1 - s) g (1 - phi) - 18 nu / D^2 U - 9 / D sqrt(nu / pi) int dU/dt' / sqrt(t - t') dt'
/// ```
///
/// in 1000 steps with the kernel integrated exactly over each. The mean pressure gradient, which bears the buoyancy of the
/// mixture, takes the part `phi` of it.
fn basset(setup: &Setup, time: f64) -> f64 {
    const STEPS: usize = 1000;
    let fluid = setup.expect_fluid();
    let (nu, d, s) = (fluid.viscosity, setup.diameter, fluid.scales.density_ratio);
    let driven = (1.0 - s) * setup.gravity.norm() * (1.0 - setup.volume_fraction);
    let (drag, history, dt) = (18.0 * nu / (d * d), 9.0 / d * (nu / PI).sqrt(), time / STEPS as f64);
    let kernel: Vec<f64> =
        (0..STEPS).map(|n| 2.0 * dt.sqrt() * ((n as f64 + 1.0).sqrt() - (n as f64).sqrt())).collect();
    let (mut u, mut rates) = (0.0, Vec::with_capacity(STEPS));
    for n in 0..STEPS {
        let past: f64 = rates.iter().zip(kernel[1..=n].iter().rev()).map(|(a, k)| a * k).sum();
        let inertia = s + 0.5 + history * kernel[0] + 0.5 * drag * dt;
        let rate: f64 = (driven - drag * u - history * past) / inertia;
        rates.push(rate);
        u += rate * dt;
    }
    u
}
