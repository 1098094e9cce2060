//! A shear wave decays with the viscosity that the case asks for: `validation/shear_wave`.

use super::prelude::*;
use std::f64::consts::TAU;
use turbid::comm::Comm;
use turbid::coupling::AnyFluid;
use turbid::domain::Decomposition;
use turbid::fluid::{Boundary, FluidParams, Simd};

const TEXT: &str = include_str!("../../../../validation/shear_wave/case.toml");

pub(super) const CASE: Case = Case {
    name: "shear_wave",
    question: "viscosity from the decay of a shear wave, relaxation times 0.53 to 1",
    source: "Navier-Stokes equations, exact: exp(-nu k^2 t)",
    parts: &[Part::quick(1.0, waves)],
};

/// Amplitude at the start (cells per step).
const AMPLITUDE: f64 = 0.01;
/// Of the viscosity.
const TOLERANCE: f64 = 5e-3;

/// The fluid of a case without its particles, at rest.
pub(super) fn fluid(setup: &Setup) -> Result<AnyFluid> {
    let fluid = setup.expect_fluid();
    let params = FluidParams {
        relaxation_time: fluid.relaxation_time,
        collision: fluid.collision,
        simd: setup.plan.simd.unwrap_or_else(Simd::best),
    };
    let open = Boundary::none();
    AnyFluid::new(setup.plan.precision, &Decomposition::solo(setup.domain), &Comm::Solo, &params, &open)
}

/// One step of a fluid that nothing drives.
pub(super) fn step(fluid: &mut AnyFluid) {
    fluid.sweep_alone([0.0; 3]);
    fluid.exchange();
}

/// Amplitude (cells per step) of the wave after every step.
fn decay(setup: &Setup) -> Result<Vec<f64>> {
    let length = setup.domain.cells[2];
    let wave = |z: usize| (TAU * (z as f64 + 0.5) / length as f64).sin();
    let mut fluid = fluid(setup)?;
    fluid.set_equilibrium(|[_, _, z]| (1.0, [AMPLITUDE * wave(z), 0.0, 0.0]));
    let amplitude = |fluid: &AnyFluid| {
        let sum: f64 = (0..length).map(|z| fluid.moments([1, 2, z]).1[0] * wave(z)).sum();
        2.0 * sum / length as f64
    };
    let mut amplitudes = vec![amplitude(&fluid)];
    for _ in 0..setup.plan.end_step {
        step(&mut fluid);
        amplitudes.push(amplitude(&fluid));
    }
    Ok(amplitudes)
}

fn waves(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let mut curves = Vec::new();
    for (tau, precision) in
        [(0.53, "f64"), (0.55, "f64"), (0.55, "f32"), (0.65, "f64"), (0.8, "f64"), (1.0, "f64")]
    {
        let own = [format!("lattice.relaxation_time={tau}"), format!("fluid.precision={precision:?}")];
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let amplitudes = decay(&setup)?;
        // The first tenth belongs to the start from equilibrium.
        let (first, last) = (amplitudes.len() / 10, amplitudes.len() - 1);
        let time = (last - first) as f64 * setup.time_step;
        let k = TAU / setup.domain.size().z;
        let viscosity = (amplitudes[first] / amplitudes[last]).ln() / (k * k * time);
        let fluid = setup.expect_fluid();
        let quantity = format!("viscosity, tau {}, {precision} (m^2/s)", fluid.relaxation_time);
        found.relative(quantity, viscosity, fluid.viscosity, TOLERANCE);
        if precision == "f64" {
            let scaled = amplitudes.iter().enumerate().step_by(20).map(|(n, amplitude)| {
                let rate = fluid.viscosity * k * k;
                [rate * n as f64 * setup.time_step, amplitude / AMPLITUDE]
            });
            let early = scaled.filter(|point| point[0] < 1.5);
            curves.push(measured(format!("tau {}", fluid.relaxation_time), early));
        }
    }
    let exact = (0..=100).map(|n| [0.015 * f64::from(n), (-0.015 * f64::from(n)).exp()]);
    curves.insert(0, reference("exponential", exact));
    let axes = ["time times viscous rate (-)", "amplitude over that of the start (-)"];
    found.plot("decay", "Amplitude of a shear wave of 32 cells", axes, curves);
    Ok(())
}
