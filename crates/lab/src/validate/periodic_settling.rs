//! One sphere settling slowly in a periodic cube: `validation/periodic_settling`.

use super::prelude::*;
use turbid::coupling::{CONTROL_INTERVAL, ForceBalance};

const TEXT: &str = include_str!("../../../../validation/periodic_settling/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/periodic_settling/reference.csv");

pub(super) const CASE: Case = Case {
    name: "periodic_settling",
    question: "settling velocity of one sphere in a periodic cube, both force balances",
    source: "Sangani and Acrivos (1982), doi:10.1016/0301-9322(82)90047-7",
    parts: &[
        Part::quick(7.0, balances),
        Part::quick(6.0, |context, found| settle(context, found, 4, ForceBalance::Mixture).map(|_| ())),
    ],
};

const TOLERANCE: f64 = 0.01;
/// Largest relative change of the velocity in `STRETCH` steps that counts as steady.
const STEADY: f64 = 2e-4;
/// Of the ratio of both balances: what it is off depends on the drag, which is the same in both.
const RATIO: f64 = 1e-3;
/// A multiple of the interval at which the flow is measured.
const STRETCH: u64 = 20 * CONTROL_INTERVAL;

fn balances(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let mixture = settle(context, found, 3, ForceBalance::Mixture)?;
    let fluid_only = settle(context, found, 3, ForceBalance::FluidOnly)?;
    let phi = Table::new(REFERENCE).at("L_over_D", 3.0, "phi");
    let quantity = "U of fluid_only over that of mixture, L = 3 D (-)";
    found
        .relative(quantity, fluid_only / mixture, 1.0 / (1.0 - phi), RATIO)
        .source("gravity g / (1 - phi) in place of g");
    Ok(())
}

/// Settling velocity over the Stokes velocity in a cube of `edge` diameters, averaged over the passage of one cell.
fn settle(context: &SuiteContext, found: &mut Findings, edge: u32, balance: ForceBalance) -> Result<f64> {
    let mixture = balance == ForceBalance::Mixture;
    let word = if mixture { "mixture" } else { "fluid_only" };
    let own = [
        format!("domain.size={{ diameters = [{edge}, {edge}, {edge}] }}"),
        format!("driving.force_balance={word:?}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let fluid = setup.expect_fluid();
    let stokes = fluid.scales.stokes_velocity;
    let (mut before, mut steady) = (0.0, false);
    let (mut sum, mut samples, mut acceleration, mut flux) = (0.0, 0.0, 0.0, 0.0);
    let mut passed = 0.0_f64;
    while passed.abs() < setup.domain.dx {
        run.advance(STRETCH)?;
        let mean = run.mean_flow().velocity.z;
        let velocity = mean - run.particles()[0].velocity().z;
        if steady {
            passed += velocity * STRETCH as f64 * setup.time_step;
            sum += velocity;
            samples += 1.0;
            acceleration += run.acceleration().z;
            flux += mean;
        }
        // On the way through the lattice the velocity never stops changing altogether.
        steady |= (velocity - before).abs() < STEADY * velocity.abs();
        before = velocity;
        if run.steps_done() >= setup.plan.end_step {
            return Err(unsteady("velocity (m/s)", velocity));
        }
    }
    let name = format!("L = {edge} D, {word}");
    let (velocity, acceleration) = (sum / samples, acceleration / samples);
    let phi = setup.volume_fraction;
    // What carries the weight: all of the box, or the fluid in it.
    let carrier = if mixture { 1.0 } else { 1.0 - phi };
    let table = Table::new(REFERENCE);
    let expected = table.at("L_over_D", f64::from(edge), "sangani_acrivos") / carrier;
    found.relative(format!("U / U_Stokes, {name} (-)"), velocity / stokes, expected, TOLERANCE);
    let weight = phi * (fluid.scales.density_ratio - 1.0) * setup.gravity.norm();
    for (what, value) in [
        ("steps", run.steps_done() as f64),
        ("Reynolds number", velocity * setup.diameter / fluid.viscosity),
        ("net flux over velocity", flux / samples / velocity),
        ("acceleration over that of the balance", acceleration * carrier / weight),
    ] {
        found.note(format!("{what}, {name}"), value);
    }
    Ok(velocity / stokes)
}
