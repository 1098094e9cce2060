//! Drag on random arrays of fixed spheres: `validation/random_array`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/random_array/case.toml");
const DENSE: &str = include_str!("../../../../validation/random_array/dense.toml");
const REFERENCE: &str = include_str!("../../../../validation/random_array/reference.csv");

pub(super) const CASE: Case = Case {
    name: "random_array",
    question: "mean drag on a fixed random array of spheres in slow flow, volume fractions 0.1 to 0.55",
    source: "van der Hoef, Beetstra and Kuipers (2005), doi:10.1017/S0022112004003295",
    parts: &[
        Part::full(40.0, |context, found| drag(context, found, 0.1)),
        Part::full(30.0, |context, found| drag(context, found, 0.2)),
        Part::full(25.0, |context, found| drag(context, found, 0.3)),
        Part::full(60.0, dense),
    ],
};

const TOLERANCE: f64 = 0.1;
/// Of a single arrangement of 39 spheres.
const DENSE_TOLERANCE: f64 = 0.15;
/// Of the drag at one relaxation time over that at another.
const SPREAD: f64 = 0.015;
/// Largest relative change of the mean velocity, in the time constant of its approach or in four crossings of sound, that counts as steady.
const STEADY: f64 = 1e-3;

const ARRANGEMENTS: u32 = 3;
fn drag(context: &SuiteContext, found: &mut Findings, volume_fraction: f64) -> Result<()> {
    let expected = Table::new(REFERENCE).at("phi", volume_fraction, "F");
    let mut sum = 0.0;
    for seed in 1..=ARRANGEMENTS {
        let (factor, reynolds) = arrangement(context, volume_fraction, seed, expected)?;
        sum += factor;
        found.note(format!("F, phi {volume_fraction}, arrangement {seed}"), factor);
        found.note(format!("its Reynolds number, arrangement {seed}"), reynolds);
    }
    let quantity = format!("F, phi {volume_fraction}, mean of {ARRANGEMENTS} arrangements (-)");
    let mean = sum / f64::from(ARRANGEMENTS);
    found.relative(quantity, mean, expected, TOLERANCE);
    Ok(())
}

fn arrangement(context: &SuiteContext, volume_fraction: f64, seed: u32, expected: f64) -> Result<(f64, f64)> {
    let own = [format!("particles.0.volume_fraction={volume_fraction}"), format!("particles.0.seed={seed}")];
    resistance(context, TEXT, &own, expected)
}

/// `F = (1 - phi) rho a L^3 / (n 3 pi mu D U)`, without the mean pressure gradient on the spheres themselves, and the Reynolds
/// number; `expected` says about how long it takes.
fn resistance(context: &SuiteContext, text: &str, own: &[String], expected: f64) -> Result<(f64, f64)> {
    let setup = context.setup(text, CASE.name, own)?;
    let (phi, diameter) = (setup.volume_fraction, setup.diameter);
    let count = setup.particles.len() as f64;
    let viscosity = setup.expect_fluid().viscosity;
    let (acceleration, volume) = (setup.expect_fluid().body_acceleration.at(0.0).z, setup.domain.volume());
    let unit = count * 3.0 * PI * viscosity * diameter;
    let time_constant = (1.0 - phi) * volume / (unit * expected);
    // Sound that the start makes takes some crossings of the box to fade, in dense arrays longer.
    let crossings = 4.0 * 3.0_f64.sqrt() * setup.domain.cells[2] as f64;
    let interval = (time_constant / setup.time_step).max(crossings).ceil() as u64;
    let watch = Watch { context, setup: &setup, threads: 1, every: interval };
    let course: Vec<f64> = watch.rows(|run, rows: &mut Vec<f64>| {
        let before = rows.last().copied().unwrap_or(0.0);
        let velocity = run.on_root(|run| Ok(run.mean_flow().velocity.z))?;
        rows.push(velocity);
        Ok((velocity - before).abs() < STEADY * velocity.abs())
    })?;
    let [.., before, velocity] = course[..] else {
        return Err(unsteady("looks at the mean velocity", course.len() as f64));
    };
    if (velocity - before).abs() >= STEADY * velocity.abs() {
        return Err(unsteady("mean velocity (m/s)", velocity));
    }
    let factor = (1.0 - phi) * acceleration * volume / (unit * velocity);
    Ok((factor, velocity * diameter / viscosity))
}

/// The same dense arrangement at all relaxation times.
fn dense(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let expected = Table::new(REFERENCE).at("phi", 0.5513, "F");
    let factor = |tau: f64| {
        resistance(context, DENSE, &[format!("lattice.relaxation_time={tau}")], expected)
            .map(|(factor, _)| factor)
    };
    let middle = factor(0.65)?;
    found.relative("F, phi 0.55, one arrangement (-)", middle, expected, DENSE_TOLERANCE);
    for tau in [0.55, 0.8, 1.0] {
        let quantity = format!("F, phi 0.55, relaxation time {tau}, over that of 0.65 (-)");
        found
            .relative(quantity, factor(tau)? / middle, 1.0, SPREAD)
            .source("steady creeping flow does not depend on it");
    }
    Ok(())
}
