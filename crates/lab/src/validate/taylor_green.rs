//! A Taylor-Green vortex on finer and finer lattices: `validation/taylor_green`.

use super::prelude::*;
use super::shear_wave::{fluid, step};
use std::f64::consts::TAU;

const TEXT: &str = include_str!("../../../../validation/taylor_green/case.toml");

pub(super) const CASE: Case = Case {
    name: "taylor_green",
    question: "order of convergence on a decaying Taylor-Green vortex, 16 to 64 cells",
    source: "Taylor and Green (1937), doi:10.1098/rspa.1937.0036, exact in the plane",
    parts: &[Part::quick(1.0, vortex)],
};

const LENGTHS: [usize; 3] = [16, 32, 64];
/// Amplitude with 32 cells (cells per step); smaller on finer lattices, so that the Mach number falls with the cell.
const SPEED: f64 = 0.02;
/// Of the velocity at half decay with 64 cells, over its amplitude there.
const ERROR: f64 = 2e-3;
/// Of the order.
const ORDER: f64 = 0.2;

/// Root of the mean square error of the velocity at the time of half decay, over the amplitude there.
fn error(setup: &Setup) -> Result<f64> {
    let length = setup.domain.cells[0];
    let speed = SPEED * 32.0 / length as f64;
    // SI: a wrong conversion of the viscosity or of time is seen.
    let (k, rate) = (TAU / length as f64, {
        let k = TAU / setup.domain.size().x;
        2.0 * setup.expect_fluid().viscosity * k * k
    });
    let flow = |x: usize, y: usize, time: f64| {
        let (a, b) = (k * (x as f64 + 0.5), k * (y as f64 + 0.5));
        let u = speed * (-rate * time).exp();
        let velocity = [u * a.cos() * b.sin(), -u * a.sin() * b.cos(), 0.0];
        (velocity, -0.75 * u * u * ((2.0 * a).cos() + (2.0 * b).cos()))
    };
    let mut fluid = fluid(setup)?;
    fluid.set_equilibrium(|[x, y, _]| {
        let (velocity, density) = flow(x, y, 0.0);
        (1.0 + density, velocity)
    });
    let steps = (2.0_f64.ln() / (rate * setup.time_step)).round();
    for _ in 0..steps as u64 {
        step(&mut fluid);
    }
    let cells = (0..length).flat_map(|x| (0..length).map(move |y| (x, y)));
    let square: f64 = cells
        .map(|(x, y)| {
            let exact = flow(x, y, steps * setup.time_step).0;
            let here = fluid.moments([x, y, 1]).1;
            (0..3).map(|a| (here[a] - exact[a]).powi(2)).sum::<f64>()
        })
        .sum();
    Ok((square / (length * length) as f64).sqrt() / (0.5 * speed))
}

fn vortex(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let mut errors = Vec::new();
    for length in LENGTHS {
        let cell = 6.4e-3 / length as f64;
        let own = [
            format!("domain.size=[6.4e-3, 6.4e-3, {:e}]", 4.0 * cell),
            format!("particles.0.shape.sphere.diameter={:e}", 2.0 * cell),
        ];
        errors.push(error(&context.setup(TEXT, CASE.name, &own)?)?);
    }
    for n in 1..LENGTHS.len() {
        let order = (errors[n - 1] / errors[n]).log2();
        let quantity = format!("order, {} to {} cells (-)", LENGTHS[n - 1], LENGTHS[n]);
        found.absolute(quantity, order, 2.0, ORDER).source("Chapman-Enskog expansion: second order");
    }
    let quantity = "error of the velocity at half decay, 64 cells (-)";
    found.absolute(quantity, errors[2], 0.0, ERROR);
    let points = LENGTHS.iter().zip(&errors).map(|(n, e)| [*n as f64, *e]);
    let second = LENGTHS.iter().map(|&n| {
        let n = n as f64;
        [n, errors[0] * (16.0 / n).powi(2)]
    });
    let axes = ["cells per length of the vortex (-)", "error over amplitude (-)"];
    let curves = [reference("second order", second), measured("measured", points)];
    found
        .plot("convergence", "Error of a Taylor-Green vortex at half decay", axes, curves)
        .logarithmic([true; 2]);
    Ok(())
}
