//! The summary of a run.

use crate::case::Setup;
use crate::coupling::ForceBalance;
use crate::fluid::{Collision, Precision, Simd, SolidCollision};
use crate::output::{Estimate, NetFluxControl, ReferenceScales, ShapeSummary, Summary, WallSummary};
use crate::simulation::Simulation;
use crate::wall::Surface;
use std::collections::BTreeMap;
use std::fmt::Write;
use xxhash_rust::xxh3::xxh3_64;

/// What was found out on the way.
#[derive(Clone, Copy)]
pub(super) struct Outcome {
    /// Settling velocity over that of Stokes.
    pub(super) estimate: Option<Estimate>,
    pub(super) drift: Option<f64>,
    /// `t*` of the end of the transient, and settling velocity over that of Stokes from there.
    pub(super) settled: Option<(f64, Estimate)>,
    pub(super) averaged_over: Option<[f64; 2]>,
    pub(super) max_mach: f64,
    /// Of the suspension over that of the fluid, between two plates.
    pub(super) viscosity: Option<Estimate>,
    pub(super) hash: u64,
    pub(super) interrupted: bool,
    /// Steps done before this run, which has gone on from there.
    pub(super) first: u64,
    pub(super) wall_seconds: f64,
}

pub(super) fn summary(setup: &Setup, simulation: &Simulation, outcome: Outcome) -> Summary {
    let Outcome {
        estimate,
        drift,
        settled,
        averaged_over,
        max_mach,
        viscosity,
        hash,
        interrupted,
        first,
        wall_seconds,
    } = outcome;
    let steps = simulation.step;
    let done = steps - first;
    let scales = setup.scales;
    let over_schiller_naumann = scales.stokes_velocity / scales.schiller_naumann_velocity;
    let per_step = |seconds: f64| seconds / done.max(1) as f64;
    let stages: BTreeMap<String, f64> = (simulation.timings.stages().iter())
        .map(|&(name, seconds)| (name.to_owned(), per_step(seconds)))
        .collect();
    let cells = if setup.dry { 0 } else { setup.domain.cell_count() };
    let wet = !setup.dry;
    Summary {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        case: setup.name.clone(),
        interrupted,
        resumed_from: (first > 0).then_some(first),
        settling_velocity_over_stokes: estimate.map(|e| e.mean),
        settling_velocity_over_schiller_naumann: estimate.map(|e| e.mean * over_schiller_naumann),
        standard_error: estimate.and_then(|e| e.standard_error),
        drift,
        transient_end: settled.map(|(end, _)| end),
        settled_mean: settled.map(|(_, e)| e.mean),
        settled_standard_error: settled.and_then(|(_, e)| e.standard_error),
        averaged_over,
        particles: setup.particles.len(),
        volume_fraction: scales.volume_fraction,
        scales: reference_scales(setup),
        cells,
        steps,
        dx: setup.domain.dx,
        time_step: setup.units.dt,
        relaxation_time: setup.relaxation_time,
        mlups: done as f64 * cells as f64 / wall_seconds / 1e6,
        wall_seconds,
        stages,
        precision: precision_name(setup.precision).to_owned(),
        simd: instruction_set(setup).to_owned(),
        ranks: simulation.comm.size(),
        threads: simulation.comm.size(),
        state_hash: format!("{hash:016x}"),
        dry: setup.dry,
        mach: wet.then_some(max_mach),
        relative_viscosity: viscosity.map(|e| e.mean),
        relative_viscosity_standard_error: viscosity.and_then(|e| e.standard_error),
        cells_per_diameter: scales.diameter / setup.domain.dx,
        shapes: shapes(setup),
        walls: walls(setup),
        collision: wet.then(|| collision_name(setup.collision).to_owned()),
        coupling: wet.then(|| coupling_name(setup.solids).to_owned()),
        force_balance: wet.then(|| balance_name(setup.force_balance).to_owned()),
        net_flux_control: wet.then(|| {
            let record = simulation.control_record();
            NetFluxControl {
                directions: setup.zero_net_flux,
                mean_acceleration: record.mean(steps).into(),
                largest_acceleration: record.largest,
            }
        }),
        parameters: Some(parameters(setup)),
        input: setup.text.clone(),
    }
}

/// What the summary of a run says of its set-up, by the keys of its JSON: two runs whose cases read alike may still differ here,
/// where a default has changed between versions.
pub fn identity(setup: &Setup) -> serde_json::Value {
    let wet = !setup.dry;
    serde_json::json!({
        "volume_fraction": setup.scales.volume_fraction,
        "cells": if wet { setup.domain.cell_count() } else { 0 },
        "dx": setup.domain.dx,
        "time_step": setup.units.dt,
        "relaxation_time": setup.relaxation_time,
        "precision": precision_name(setup.precision),
        "dry": setup.dry,
        "collision": wet.then(|| collision_name(setup.collision)),
        "coupling": wet.then(|| coupling_name(setup.solids)),
        "force_balance": wet.then(|| balance_name(setup.force_balance)),
        "parameters": parameters(setup),
    })
}

/// Checksum over the other numbers that decide the run, but for the places of the particles, as the case leaves them to the
/// program: 16 hexadecimal digits.
fn parameters(setup: &Setup) -> String {
    // What is printed of a number is enough to get it back.
    let mut text = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        setup.collision,
        setup.solids,
        setup.solid_ramp_width,
        setup.contact,
        setup.walls,
        setup.substeps,
        setup.gravity,
        setup.zero_net_flux,
        setup.body_acceleration,
    );
    for template in setup.templates.iter() {
        let shape = &template.shape;
        let (kind, volume, inertia) = (shape.kind(), shape.volume(), shape.inertia_per_mass());
        let rest = (template.density, template.material);
        let _ = write!(text, " {kind} {volume} {inertia:?} {rest:?}");
    }
    for (name, bytes) in &setup.files {
        let _ = write!(text, " {name} {:x}", xxh3_64(bytes));
    }
    format!("{:016x}", xxh3_64(text.as_bytes()))
}

/// The instruction set that the kernels of a case use here.
pub fn instruction_set(setup: &Setup) -> &'static str {
    setup.simd.unwrap_or_else(Simd::best).name()
}

fn reference_scales(setup: &Setup) -> ReferenceScales {
    let scales = setup.scales;
    ReferenceScales {
        diameter: scales.diameter,
        viscosity: scales.viscosity,
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
    let count = |index: usize| {
        (setup.particles.iter())
            .filter(|p| p.template as usize == index)
            .count()
    };
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
    let kind = |surface: &Surface| match surface {
        Surface::Plane { .. } => "plane",
        Surface::Cylinder { pipe: true, .. } => "pipe",
        Surface::Cylinder { .. } => "rod",
    };
    (setup.walls.iter())
        .map(|wall| WallSummary {
            name: wall.name.clone(),
            kind: kind(&wall.surface).to_owned(),
            velocity: wall.motion.velocity.into(),
            angular_velocity: wall.motion.angular_velocity.into(),
        })
        .collect()
}

pub(in crate::simulation) fn precision_name(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    }
}

/// As in the case file.
fn collision_name(collision: Collision) -> &'static str {
    match collision {
        Collision::Bgk => "bgk",
        Collision::Trt { .. } => "trt",
    }
}

/// As in the case file.
fn coupling_name(solids: SolidCollision) -> &'static str {
    if solids.is_saturated() {
        "saturated"
    } else {
        "paper"
    }
}

/// As in the case file.
fn balance_name(balance: ForceBalance) -> &'static str {
    match balance {
        ForceBalance::Mixture => "mixture",
        ForceBalance::FluidOnly => "fluid_only",
    }
}
