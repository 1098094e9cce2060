//! The summary of a run.

use crate::case::{Scales, Setup};
use crate::fluid::Simd;
use crate::output::{NetFluxControl, ReferenceScales, ShapeSummary, Summary, WallSummary};
use crate::simulation::Simulation;
use crate::simulation::identity::{
    balance_name, collision_name, precision_name, relaxation_time, setup_hash, surface_name,
};
use std::collections::BTreeMap;

/// The summary of a run that has resumed after `first` steps, so many seconds ago; what the samples say is added by their
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
    let scales = reference_scales(setup);
    let per_step = |seconds: f64| seconds / done.max(1) as f64;
    let stages: BTreeMap<String, f64> = (simulation.timings.stages().iter())
        .map(|&(name, seconds)| (name.to_owned(), per_step(seconds)))
        .collect();
    let cells = setup.fluid_cells();
    Summary {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        case: setup.provenance.name.clone(),
        resumed_from: (first > 0).then_some(first),
        particles: setup.particles.len(),
        volume_fraction: setup.volume_fraction,
        cells_per_diameter: setup.diameter / setup.domain.dx,
        scales,
        cells,
        steps,
        dx: setup.domain.dx,
        time_step: setup.time_step,
        relaxation_time: relaxation_time(fluid),
        mlups: done as f64 * cells as f64 / wall_seconds / 1e6,
        wall_seconds,
        stages,
        precision: precision_name(setup.plan.precision).to_owned(),
        simd: instruction_set(setup).to_owned(),
        ranks: simulation.comm.size(),
        threads: simulation.comm.size(),
        state_hash: format!("{hash:016x}"),
        dry: fluid.is_none(),
        shapes: shapes(setup),
        walls: walls(setup),
        collision: fluid.map(|fluid| collision_name(fluid.collision).to_owned()),
        coupling: fluid.map(|fluid| fluid.coupling.name().to_owned()),
        force_balance: fluid.map(|fluid| balance_name(fluid.force_balance).to_owned()),
        net_flux_control: fluid.map(|fluid| {
            let record = simulation.control_record();
            NetFluxControl {
                directions: fluid.zero_net_flux,
                mean_acceleration: record.mean(steps).into(),
                largest_acceleration: record.largest,
            }
        }),
        setup_hash: Some(setup_hash(setup)),
        input: setup.provenance.text.clone(),
        ..Summary::default()
    }
}

/// The instruction set that the kernels of a case use here.
pub fn instruction_set(setup: &Setup) -> &'static str {
    setup.plan.simd.unwrap_or_else(Simd::best).name()
}

/// Without a fluid what has no meaning is zero or infinite.
fn reference_scales(setup: &Setup) -> ReferenceScales {
    let nothing = Scales {
        density_ratio: f64::INFINITY,
        archimedes: 0.0,
        stokes_velocity: 0.0,
        stokes_time: f64::INFINITY,
        schiller_naumann_velocity: 0.0,
        schiller_naumann_reynolds: 0.0,
    };
    let fluid = setup.fluid.as_ref();
    let scales = fluid.map_or(nothing, |fluid| fluid.scales);
    ReferenceScales {
        diameter: setup.diameter,
        viscosity: fluid.map_or(0.0, |fluid| fluid.viscosity),
        density_ratio: scales.density_ratio,
        archimedes: scales.archimedes,
        galileo: scales.archimedes.sqrt(),
        stokes_velocity: scales.stokes_velocity,
        stokes_time: scales.stokes_time,
        schiller_naumann_velocity: scales.schiller_naumann_velocity,
        schiller_naumann_reynolds: scales.schiller_naumann_reynolds,
    }
}

fn shapes(setup: &Setup) -> Vec<ShapeSummary> {
    let count = |index: usize| (setup.particles.iter()).filter(|p| p.template as usize == index).count();
    (setup.templates.iter().enumerate())
        .map(|(index, template)| ShapeSummary {
            kind: template.shape.kind().to_owned(),
            equivalent_diameter: template.shape.equivalent_diameter(),
            density: template.density,
            count: count(index),
        })
        .collect()
}

fn walls(setup: &Setup) -> Vec<WallSummary> {
    (setup.walls.iter())
        .map(|wall| WallSummary {
            name: wall.name.clone(),
            kind: surface_name(&wall.surface).to_owned(),
            velocity: wall.motion.velocity.into(),
            angular_velocity: wall.motion.angular_velocity.into(),
        })
        .collect()
}
