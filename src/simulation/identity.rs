//! Identity of a run, by which summaries, checkpoints and rows of a study are recognised as of the same set-up.
//!
//! Every key and every name of a choice is spelled out below, those of the contact model in the tests, so that renaming a type or a field
//! changes no identity. The hash is that of one text in [canonical form](canonical), which has
//!
//! - of the fluid its density, collision, coupling, force balance, flux control and its target, body acceleration and flow at the start;
//! - gravity, sub-steps, walls, faces that are inlets, outlets or slip (if there are some), and the contact model with all materials and pairs;
//! - what is inserted and removed, where and when, if something is;
//! - volume, inertia, density and material of each template, its motion as far as it is prescribed, and what acts on it;
//! - the contents of the files that the case names.
//!
//! It lacks the other numbers of [`identity`], the run plan, and what the text of the case decides alone: position and motion of the
//! particles, and commands for LIGGGHTS.

use crate::case::insertion::{Amount, RemovedFrom};
use crate::case::{FluidSetup, Insertion, Removal, Setup, StartFlow};
use crate::contact::{ContactModel, ElasticLaw, FrictionLaw, Geometry};
use crate::coupling::{ForceBalance, Method};
use crate::domain::Face;
use crate::fluid::Collision;
use crate::math::{Grid, Patch, Profile, TimeFunction, Vec3};
use crate::packing::insertion::{Bodies, Region};
use crate::particle::{PrescribedMotion, Template};
use crate::wall::{Inlet, PlacedMesh, Surface, Wall};
use serde_json::{Value as Json, json};
use std::fmt::Write;
use xxhash_rust::xxh3::xxh3_64;

/// Derived numbers that decide a run, by the keys of `summary.json`: two runs whose cases read alike may differ here, where a
/// default has changed between versions.
pub fn identity(setup: &Setup) -> Json {
    let fluid = setup.fluid.as_ref();
    json!({
        "volume_fraction": setup.volume_fraction,
        "cells": setup.fluid_cells(),
        "dx": setup.domain.dx,
        "time_step": setup.time_step,
        "relaxation_time": relaxation_time(fluid),
        "precision": setup.plan.precision.name(),
        "dry": fluid.is_none(),
        "collision": fluid.map(|fluid| fluid.collision.name()),
        "coupling": fluid.map(|fluid| coupling_name(&fluid.coupling)),
        "force_balance": fluid.map(|fluid| balance_name(fluid.force_balance)),
        "setup_hash": setup_hash(setup),
    })
}

/// Id of a run, which tells its checkpoints from those of another one: of [`identity`] and the particles at the start, so that it is the
/// same for a run that is repeated. `origin` names the state with which a branch begins.
pub(super) fn run_id(setup: &Setup, origin: &str) -> String {
    let start = setup.totals().hash;
    format!("{:016x}", xxh3_64(format!("{} {start} {origin}", identity(setup)).as_bytes()))
}

/// Relaxation time (time steps) as files give it: 1 without a fluid.
pub(super) fn relaxation_time(fluid: Option<&FluidSetup>) -> f64 {
    fluid.map_or(1.0, |fluid| fluid.relaxation_time)
}

/// XXH3 (64 bits, 16 hexadecimal digits) of the numbers that the [module](self) lists, in canonical form.
pub(super) fn setup_hash(setup: &Setup) -> String {
    if let Some(placed) = &setup.placed {
        // Of files that this process has not read, too.
        return placed.setup_hash.clone();
    }
    let mut text = String::new();
    canonical(&physics(setup), &mut text);
    format!("{:016x}", xxh3_64(text.as_bytes()))
}

/// The numbers that the [module](self) lists.
pub(super) fn physics(setup: &Setup) -> Json {
    let file = |(name, bytes): &(String, Vec<u8>)| json!([name, format!("{:016x}", xxh3_64(bytes))]);
    let templates = setup.templates.iter().zip(&setup.motions).zip(&setup.applied);
    let mut physics = json!({
        "contact": setup.contact.as_ref().map(contact),
        "files": setup.provenance.files.iter().map(file).collect::<Vec<_>>(),
        "fluid": setup.fluid.as_ref().map(fluid),
        "gravity": vector(setup.gravity),
        "substeps": setup.substeps,
        "templates": templates.map(|(of, applied)| template(of, applied)).collect::<Vec<_>>(),
        "walls": setup.walls.iter().map(wall).collect::<Vec<_>>(),
    });
    if !setup.domain.faces.iter().all(|face| face.is_plain()) {
        physics["faces"] = setup.domain.faces.iter().map(|face| face_of(*face)).collect();
        physics["inlets"] = setup.inlets.iter().map(|(n, inlet)| json!([n, inlet_of(inlet)])).collect();
        if !setup.pressures.is_empty() {
            physics["pressures"] = setup.pressures.iter().map(|(n, of)| json!([n, function(of)])).collect();
        }
    }
    if !setup.insertions.is_empty() {
        physics["insertion"] = setup.insertions.iter().map(insertion).collect();
    }
    if !setup.removals.is_empty() {
        physics["removal"] = setup.removals.iter().map(removal).collect();
    }
    physics
}

/// Appends JSON without spaces, its keys sorted, and every number as the shortest decimal that reads back as the same `f64`, in
/// scientific notation (`1.5e-3`, `2e0`; never `-0e0`). What is absent or not finite is `null`.
fn canonical(value: &Json, text: &mut String) {
    match value {
        Json::Number(number) => {
            let number = number.as_f64().expect("all are finite") + 0.0;
            let _ = write!(text, "{number:e}");
        }
        Json::Array(values) => {
            text.push('[');
            for (n, value) in values.iter().enumerate() {
                text.push_str(if n > 0 { "," } else { "" });
                canonical(value, text);
            }
            text.push(']');
        }
        Json::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(key, _)| *key);
            text.push('{');
            for (n, (key, value)) in entries.into_iter().enumerate() {
                let _ = write!(text, "{}{}:", if n > 0 { "," } else { "" }, json!(key));
                canonical(value, text);
            }
            text.push('}');
        }
        Json::Null | Json::Bool(_) | Json::String(_) => {
            let _ = write!(text, "{value}");
        }
    }
}

fn vector(v: Vec3) -> [f64; 3] {
    v.into()
}

fn collision(collision: Collision) -> Json {
    let (magic, smagorinsky) = match collision {
        Collision::Bgk => (None, None),
        Collision::Trt { magic } => (Some(magic), None),
        Collision::RecursiveRegularised { magic, smagorinsky } => (Some(magic), Some(smagorinsky)),
    };
    let mut all = json!({ "magic_parameter": magic, "operator": collision.name() });
    if let Some(smagorinsky) = smagorinsky {
        all["smagorinsky"] = json!(smagorinsky);
    }
    all
}

fn fluid(fluid: &FluidSetup) -> Json {
    let (operator, ramp_width) = match fluid.coupling {
        Method::Homogenised(homogenised) => ("exact_difference", Some(homogenised.ramp)),
        Method::Saturated(saturated) => (saturated.operator.name(), None),
    };
    let mut json = json!({
        "body_acceleration": function(&fluid.body_acceleration),
        "collision": collision(fluid.collision),
        "coupling": { "operator": operator, "ramp_width": ramp_width },
        "density": fluid.density,
        "force_balance": balance_name(fluid.force_balance),
        "zero_net_flux": fluid.net_flux.map(|flux| flux.is_some()),
    });
    let target = Vec3::from(fluid.net_flux.map(Option::unwrap_or_default));
    if target != Vec3::zeros() {
        json["net_flux"] = json!(vector(target));
    }
    if let Some(start) = fluid.start {
        json["start"] = start_flow(start);
    }
    json
}

fn start_flow(flow: StartFlow) -> Json {
    match flow {
        StartFlow::Linear { axis, lower, gradient, stressed } => {
            let mut json = json!({ "axis": axis, "gradient": vector(gradient), "lower": vector(lower) });
            if stressed {
                json["stressed"] = true.into();
            }
            json
        }
        StartFlow::Slit { axis, height, mean } => {
            json!({ "axis": axis, "height": height, "mean": vector(mean) })
        }
        StartFlow::Pipe { axis, radius, mean } => {
            json!({ "axis": axis.map(vector), "mean": vector(mean), "radius": radius })
        }
        StartFlow::TaylorGreen { axes, waves, speed } => {
            // Those of vortices in a plane have no direction across it.
            let varied = if waves[2] > 0.0 { 3 } else { 2 };
            json!({ "axes": axes[..varied], "speed": speed, "waves": waves[..varied] })
        }
    }
}

/// By the names of its fields, without those that are `None`, so that a new one changes no identity of a case without it; and by the names
/// that identities were first made with.
fn contact(model: &ContactModel) -> Json {
    let mut contact = json!(model);
    let fields = contact.as_object_mut().expect("a struct");
    fields.retain(|_, value| !value.is_null());
    if model.law == ElasticLaw::OverlapVolume {
        fields["law"] = json!("paper");
    }
    if model.friction == FrictionLaw::NassauerKuna {
        fields.remove("friction");
    }
    for law in ["rolling", "twisting", "cohesion"] {
        if fields[law] == "none" {
            fields.remove(law);
        }
    }
    for pair in fields["pairs"].as_array_mut().expect("a list").iter_mut().filter_map(Json::as_object_mut) {
        for name in ["rolling_friction", "work_of_adhesion", "cohesion_density"] {
            if pair[name] == json!(0.0) {
                pair.remove(name);
            }
        }
    }
    fields.remove("geometry");
    let samples = match model.geometry {
        Geometry::Exact => None,
        Geometry::Sampled { samples } => Some(samples),
    };
    fields.insert("samples".to_string(), json!(samples));
    contact
}

fn template((template, prescribed): (&Template, &PrescribedMotion), applied: &[Vec3; 2]) -> Json {
    let shape = &template.shape;
    let mut json = json!({
        "density": template.density,
        "inertia_per_mass": vector(shape.inertia_per_mass()),
        "material": template.material,
        "shape": shape.kind(),
        "volume": shape.volume(),
    });
    if *applied != [Vec3::zeros(); 2] {
        json["applied"] = json!(applied.map(vector));
    }
    if !prescribed.is_free() {
        json["motion"] = motion(prescribed);
    }
    let parts = shape.parts().iter().map(|part| {
        json!({
            "inertia_per_mass": vector(part.shape.inertia_per_mass()),
            "orientation": <[f64; 4]>::from(part.orientation.coords),
            "position": vector(part.position),
            "shape": part.shape.kind(),
            "volume": part.shape.volume(),
        })
    });
    let parts: Vec<Json> = parts.collect();
    if !parts.is_empty() {
        json["parts"] = parts.into();
    }
    json
}

fn function(function: &TimeFunction) -> Json {
    match function {
        TimeFunction::Constant(value) => json!(vector(*value)),
        TimeFunction::Oscillation { mean, amplitude, frequency, phase } => json!({
            "amplitude": vector(*amplitude),
            "frequency": frequency,
            "mean": vector(*mean),
            "phase": phase,
        }),
        TimeFunction::Table(rows) => {
            rows.iter().map(|(time, value)| json!([time, vector(*value)])).collect::<Vec<_>>().into()
        }
    }
}

fn motion(motion: &PrescribedMotion) -> Json {
    json!({
        "angular_velocity": function(&motion.angular_velocity),
        "free": motion.free,
        "free_rotation": motion.free_rotation,
        "velocity": function(&motion.velocity),
    })
}

fn face_of(face: Face) -> Json {
    match face {
        Face::Periodic => json!("periodic"),
        Face::Wall => json!("wall"),
        Face::FreeSlip => json!("free_slip"),
        Face::Inlet => json!("inlet"),
        Face::Outlet { excess, relaxation, patch } => {
            let mut outlet = json!({ "outlet": excess });
            if let Some(rate) = relaxation {
                outlet["relaxation"] = json!(rate);
            }
            if let Some(patch) = patch {
                outlet["patch"] = patch_of(patch);
            }
            outlet
        }
    }
}

fn patch_of(patch: &Patch) -> Json {
    match patch {
        Patch::Disc { centre, axis, radius } => json!({ "axis": axis, "centre": centre, "radius": radius }),
        Patch::Rectangle { lower, upper, axis } => json!({ "axis": axis, "lower": lower, "upper": upper }),
        Patch::Several(parts) => parts.iter().map(patch_of).collect(),
    }
}

fn region_of(region: &Region) -> Json {
    json!([vector(region.lower), vector(region.upper)])
}

fn insertion(insertion: &Insertion) -> Json {
    let Bodies { seed, fractions, orientation, velocity } = &insertion.bodies;
    let (rate, fraction) = match insertion.amount {
        Amount::Rate(rate) => (Some(rate), None),
        Amount::VolumeFraction(fraction) => (None, Some(fraction)),
    };
    let limit = |number: u64| (number < u64::MAX).then_some(number);
    json!({
        "count": limit(insertion.most),
        "every": insertion.every,
        "fractions": fractions,
        "orientation": orientation.map(|of| <[f64; 4]>::from(of.coords)),
        "rate": rate,
        "region": region_of(&insertion.region),
        // All digits: a number would be rounded.
        "seed": seed.to_string(),
        "steps": [Some(insertion.steps[0]), limit(insertion.steps[1])],
        "velocity": velocity.map(vector),
        "volume_fraction": fraction,
    })
}

fn removal(removal: &Removal) -> Json {
    let from = match &removal.from {
        RemovedFrom::Region(region) => json!({ "region": region_of(region) }),
        RemovedFrom::Plane(surface) => json!({ "plane": surface_of(surface) }),
        RemovedFrom::Outlet(surface) => json!({ "outlet": surface_of(surface) }),
    };
    json!({ "from": from, "section": removal.section })
}

fn inlet_of(Inlet { velocity, profile, patch }: &Inlet) -> Json {
    let mut inlet = json!({ "profile": profile_of(profile), "velocity": function(velocity) });
    if let Some(patch) = patch {
        inlet["patch"] = patch_of(patch);
    }
    inlet
}

fn profile_of(profile: &Profile) -> Json {
    match profile {
        Profile::Uniform => json!("uniform"),
        Profile::Parabolic(walls) => json!({ "parabolic": walls }),
        Profile::Round { centre, axis, radius } => {
            json!({ "axis": axis, "centre": centre, "radius": radius })
        }
        Profile::Table { grid, unit } => {
            let Grid { axes, points, values } = &**grid;
            json!({ "axes": axes, "points": points, "unit": unit, "values": values })
        }
        Profile::Each(parts) => parts
            .iter()
            .map(|(patch, part)| json!({ "patch": patch_of(patch), "profile": profile_of(part) }))
            .collect(),
    }
}

fn surface_of(surface: &Surface) -> Json {
    match *surface {
        Surface::Plane { point, normal } => {
            json!({ "kind": "plane", "normal": vector(normal), "point": vector(point) })
        }
        Surface::Cylinder { point, axis, radius, .. } => json!({
            "axis": vector(axis),
            "kind": surface_name(surface),
            "point": vector(point),
            "radius": radius,
        }),
        Surface::Mesh(PlacedMesh { ref mesh, position, orientation }) => json!({
            "content": format!("{:016x}", mesh.digest()),
            "kind": "mesh",
            "orientation": orientation.coords.as_slice(),
            "position": vector(position),
            "side": mesh.free().to_string(),
        }),
    }
}

fn wall(wall: &Wall) -> Json {
    json!({
        "angular_velocity": function(&wall.motion.angular_velocity),
        "material": wall.material,
        "name": wall.name,
        "pivot": vector(wall.motion.pivot),
        "surface": surface_of(&wall.surface),
        "velocity": function(&wall.motion.velocity),
    })
}

pub(super) fn surface_name(surface: &Surface) -> &'static str {
    match surface {
        Surface::Plane { .. } => "plane",
        Surface::Cylinder { pipe: true, .. } => "pipe",
        Surface::Cylinder { .. } => "rod",
        Surface::Mesh(_) => "mesh",
    }
}

/// As in the case file.
pub(super) fn balance_name(balance: ForceBalance) -> &'static str {
    match balance {
        ForceBalance::Mixture => "mixture",
        ForceBalance::FluidOnly => "fluid_only",
    }
}

/// The name that identities were first made with.
fn coupling_name(method: &Method) -> &'static str {
    match method {
        Method::Homogenised(_) => "paper",
        Method::Saturated(_) => method.name(),
    }
}

#[cfg(test)]
mod tests;
