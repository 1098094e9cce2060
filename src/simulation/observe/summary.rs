//! The summary of a run.

use crate::case::{FluidSetup, Setup};
use crate::output::{NetFluxControl, ReferenceScales, ShapeSummary, Summary, WallSummary};
use crate::simulation::Simulation;
use crate::simulation::identity::{balance_name, relaxation_time, setup_hash, surface_name};

/// The summary of a run that began or resumed after `first` steps; the averages are added by their
/// [writer](crate::simulation::Writer::finish).
pub(super) fn summary(
    setup: &Setup,
    simulation: &Simulation,
    hash: u64,
    first: u64,
    wall_seconds: f64,
) -> Summary {
    let steps = simulation.step;
    let done = steps - first;
    let fluid = setup.fluid.as_ref();
    let stages = simulation.timings.stages().iter();
    let cells = setup.fluid_cells();
    Summary {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        case: setup.provenance.name.clone(),
        resumed_from: (first > 0).then_some(first),
        particles: simulation.counts().iter().sum::<i64>() as usize,
        volume_fraction: setup.volume_fraction,
        requested_volume_fraction: Some(setup.requested_volume_fraction),
        cells_per_diameter: setup.diameter / setup.domain.dx,
        scales: reference_scales(setup),
        cells,
        steps,
        dx: setup.domain.dx,
        time_step: setup.time_step,
        relaxation_time: relaxation_time(fluid),
        mlups: done as f64 * cells as f64 / wall_seconds / 1e6,
        wall_seconds,
        stages: stages.map(|&(name, s)| (name.to_owned(), s / done.max(1) as f64)).collect(),
        precision: setup.plan.precision.name().to_owned(),
        simd: instruction_set(setup).to_owned(),
        device: device_name(setup),
        ranks: simulation.comm.size(),
        threads: simulation.comm.size(),
        state_hash: format!("{hash:016x}"),
        dry: fluid.is_none(),
        shapes: shapes(setup, simulation.counts()),
        walls: walls(setup, simulation.time()),
        collision: fluid.map(|fluid| fluid.collision.name().to_owned()),
        coupling: fluid.map(|fluid| fluid.coupling.name().to_owned()),
        force_balance: fluid.map(|fluid| balance_name(fluid.force_balance).to_owned()),
        net_flux_control: fluid.map(|fluid| {
            let record = simulation.control_record();
            NetFluxControl {
                directions: fluid.net_flux.map(|flux| flux.is_some()),
                target: fluid.net_flux.map(Option::unwrap_or_default),
                mean_acceleration: record.mean(steps).into(),
                largest_acceleration: record.largest,
            }
        }),
        setup_hash: Some(setup_hash(setup)),
        input: setup.provenance.text.clone(),
        ..Summary::default()
    }
}

/// Names of the devices that compute the fluid of a case, if it is not the processor.
pub fn device_name(setup: &Setup) -> Option<String> {
    let name = |number: &usize| Some(crate::device::devices().get(*number)?.name.clone());
    let mut names: Vec<String> = setup.plan.devices.iter().filter_map(name).collect();
    names.dedup();
    (!names.is_empty()).then(|| names.join(", "))
}

/// The instruction set that the kernels of a case use here.
pub fn instruction_set(setup: &Setup) -> &'static str {
    setup.plan.instruction_set().name()
}

/// Reference scales; without a fluid what has no meaning is zero or infinite.
fn reference_scales(setup: &Setup) -> ReferenceScales {
    let none = ReferenceScales {
        diameter: setup.diameter,
        density_ratio: f64::INFINITY,
        stokes_time: f64::INFINITY,
        ..ReferenceScales::default()
    };
    setup.fluid.as_ref().map_or(none, |FluidSetup { viscosity, scales, .. }| ReferenceScales {
        diameter: setup.diameter,
        viscosity: *viscosity,
        density_ratio: scales.density_ratio,
        archimedes: scales.archimedes,
        galileo: scales.archimedes.sqrt(),
        stokes_velocity: scales.stokes_velocity,
        stokes_time: scales.stokes_time,
        schiller_naumann_velocity: scales.schiller_naumann_velocity,
        schiller_naumann_reynolds: scales.schiller_naumann_reynolds,
    })
}

fn shapes(setup: &Setup, counts: &[i64]) -> Vec<ShapeSummary> {
    (setup.templates.iter().enumerate())
        .map(|(index, template)| ShapeSummary {
            kind: template.shape.kind().to_owned(),
            equivalent_diameter: template.shape.equivalent_diameter(),
            density: template.density,
            count: counts[index] as usize,
        })
        .collect()
}

fn walls(setup: &Setup, time: f64) -> Vec<WallSummary> {
    (setup.walls.iter())
        .map(|wall| WallSummary {
            name: wall.name.clone(),
            kind: surface_name(&wall.surface).to_owned(),
            velocity: wall.motion.velocity.at(time).into(),
            angular_velocity: wall.motion.angular_velocity.at(time).into(),
        })
        .collect()
}
