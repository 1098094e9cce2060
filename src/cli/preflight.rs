//! What a run will be like: derived numbers, cost, and what lies outside the usual range.

mod bodies;
mod output;
pub(super) mod ranks;

use super::machine::{bytes_per_cell, cores, in_bytes, in_time, memory, mlups_per_thread, threads};
use crate::case::{Hertz, Setup};
use crate::contact::ContactModel;
use crate::dem::{EngineChoice, LiggghtsProcess};
use crate::error::{Error, Result};
use crate::fluid::{Collision, Precision, SolidCollision};
use crate::simulation::decompose;

/// Largest usual speed on the lattice (cells per step): compressibility errors grow with its square.
const USUAL_LATTICE_SPEED: f64 = 0.1;
/// Fewest usual steps of a contact.
const USUAL_CONTACT_STEPS: f64 = 50.0;
/// Largest usual depth of a contact in diameters.
const USUAL_DEPTH: f64 = 0.1;

/// Two particles of the first kind in contact, as spheres of their volume.
fn hertz(setup: &Setup, contact: &ContactModel) -> Hertz {
    let template = &setup.templates[0];
    Hertz::new(template, &contact.materials[template.material])
}

/// Weight of one particle of the first kind less its buoyancy (N).
fn submerged_weight(setup: &Setup) -> f64 {
    let template = &setup.templates[0];
    (template.density - setup.units.density).abs() * template.shape.volume() * setup.gravity.norm()
}

/// Memory that a run takes (bytes).
pub(super) fn memory_needed(setup: &Setup) -> f64 {
    setup.domain.cell_count() as f64 * bytes_per_cell(setup.precision)
}

/// Refuses a run that this machine cannot hold.
pub(super) fn refuse_what_does_not_fit(setup: &Setup) -> Result<()> {
    decompose(setup)?;
    if setup.dry {
        return Ok(());
    }
    let needed = memory_needed(setup);
    match memory() {
        Some(memory) if needed > memory => {
            let factor = (memory / needed).cbrt();
            let [x, y, z] = setup.domain.cells;
            let cells = setup.scales.diameter / setup.domain.dx;
            Err(Error::Input(format!(
                "the box of {x} x {y} x {z} cells needs about {}, but this machine has {}; take at most \
                 lattice.cells_per_diameter = {:.1}, or a box smaller by the factor {factor:.2} in each direction",
                in_bytes(needed),
                in_bytes(memory),
                cells * factor
            )))
        }
        _ => Ok(()),
    }
}

/// A row of name, value and remark.
type Row = [String; 3];

fn row(name: &str, value: String, remark: &str) -> Row {
    [name.to_string(), value, remark.to_string()]
}

/// Rows of name, value and remark.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let mut rows = Vec::new();
    let cells = setup.domain.cell_count();
    let size = setup.domain.size();
    if setup.dry {
        let edges = format!("{:.4e} x {:.4e} x {:.4e} m", size.x, size.y, size.z);
        rows.push(row("box", edges, "no fluid"));
    } else {
        let [x, y, z] = setup.domain.cells;
        let size = size / setup.scales.diameter;
        let remark = format!("{x} x {y} x {z}, {:.4} x {:.4} x {:.4} D", size.x, size.y, size.z);
        rows.push(row("cells", cells.to_string(), &remark));
        let remark = memory().map_or(String::new(), |m| format!("of {}", in_bytes(m)));
        rows.push(row("memory", in_bytes(memory_needed(setup)), &remark));
    }
    rows.extend(bodies::wall_rows(setup));
    rows.push(row("particles", setup.particles.len().to_string(), ""));
    rows.push(row(
        "volume fraction",
        format!("{:.5}", setup.scales.volume_fraction),
        "",
    ));
    rows.extend(bodies::shape_rows(setup));
    rows.extend(if setup.dry {
        dry_rows(setup)
    } else {
        fluid_rows(setup)
    });
    rows.extend(engine_row(setup));
    rows.extend(contact_rows(setup));
    if !setup.dry {
        rows.push(cost_row(setup));
    }
    rows.extend(output::rows(setup));
    rows
}

/// What moves the particles, if it is not the native engine.
fn engine_row(setup: &Setup) -> Option<Row> {
    let EngineChoice::Liggghts(options) = &setup.engine else {
        return None;
    };
    let place = match options.process {
        LiggghtsProcess::Worker => "in a process of its own",
        LiggghtsProcess::Own => "in this process",
    };
    let remark = match options.commands.len() {
        0 => place.to_string(),
        n => format!("{place}; commands of the case: {n}"),
    };
    Some(row("engine", "LIGGGHTS".to_string(), &remark))
}

/// What particles without a fluid do.
fn dry_rows(setup: &Setup) -> Vec<Row> {
    let units = &setup.units;
    let remark = format!("averages from step {}", setup.average_from_step);
    let mut rows = vec![
        row("time step", format!("{:.6e} s", units.dt), ""),
        row("steps", setup.end_step.to_string(), &remark),
        row("time", format!("{:.4} s", setup.end_step as f64 * units.dt), ""),
    ];
    if let Some(contact) = &setup.contact {
        let speed = fall_speed(setup);
        if speed > 0.0 {
            let steps = hertz(setup, contact).duration(speed) / units.dt;
            let remark = format!("steps, Hertz impact at {speed:.3} m/s, a fall through the box");
            rows.push(row("contact lasts", format!("{steps:.0}"), &remark));
        }
    }
    rows
}

/// Speed (m/s) after a fall through the box.
fn fall_speed(setup: &Setup) -> f64 {
    // Gravity times the extent of the box along it.
    let drop: f64 = (setup.gravity.iter())
        .zip(setup.domain.size().iter())
        .map(|(g, length)| g.abs() * length)
        .sum();
    (2.0 * drop).sqrt()
}

/// How particles and fluid are coupled.
fn coupling_row(setup: &Setup) -> Row {
    let operator = match setup.solids {
        SolidCollision::ExactDifference => {
            let note = format!("exact difference, ramp of {} cells", setup.solid_ramp_width);
            return row("coupling", "paper".into(), &note);
        }
        SolidCollision::Sc1 => "sc1",
        SolidCollision::Sc2 => "sc2",
        SolidCollision::Sc3 => "sc3",
    };
    let note = format!("partially saturated cells by volume, operator {operator}");
    row("coupling", "saturated".into(), &note)
}

/// Numbers of the lattice and of settling.
fn fluid_rows(setup: &Setup) -> Vec<Row> {
    let (scales, units) = (&setup.scales, &setup.units);
    let speed = |u: f64| u / units.velocity();
    let mach = 3.0_f64.sqrt();
    let collision = match setup.collision {
        Collision::Bgk => "one relaxation time".to_string(),
        Collision::Trt { magic } => format!("two relaxation times, magic parameter {magic:.5}"),
    };
    let mut rows = vec![
        row("density ratio", format!("{:.5}", scales.density_ratio), ""),
        row(
            "diameter",
            format!("{:.6e} m", scales.diameter),
            "of the sphere of equal volume",
        ),
        row(
            "cells per diameter",
            format!("{:.3}", scales.diameter / setup.domain.dx),
            "",
        ),
        row("cell", format!("{:.6e} m", units.dx), ""),
        row("time step", format!("{:.6e} s", units.dt), ""),
        row(
            "relaxation time",
            format!("{:.5}", setup.relaxation_time),
            &format!("time steps; {collision}"),
        ),
        coupling_row(setup),
        row(
            "viscosity",
            format!("{:.6e} m^2/s", scales.viscosity),
            "kinematic",
        ),
    ];
    let averages = format!("averages from step {}", setup.average_from_step);
    if !scales.stokes_time.is_finite() {
        rows.push(row("steps", setup.end_step.to_string(), &averages));
        return rows;
    }
    let on_lattice = |u: f64| format!("on the lattice {:.5}, Mach {:.4}", speed(u), mach * speed(u));
    let star = scales.schiller_naumann_velocity;
    let per_stokes_time = scales.stokes_time / units.dt;
    let stokes_times = setup.end_step as f64 / per_stokes_time;
    rows.extend([
        row("Archimedes number", format!("{:.4}", scales.archimedes), ""),
        row(
            "u_Stokes",
            format!("{:.6e} m/s", scales.stokes_velocity),
            &on_lattice(scales.stokes_velocity),
        ),
        row(
            "u* (one sphere)",
            format!("{star:.6e} m/s"),
            &format!("Schiller-Naumann; {}", on_lattice(star)),
        ),
        row("Re at u*", format!("{:.4}", scales.schiller_naumann_reynolds), ""),
        row(
            "steps per t*",
            format!("{per_stokes_time:.2}"),
            &format!("t* = D / u_Stokes = {:.6e} s", scales.stokes_time),
        ),
        row(
            "steps",
            setup.end_step.to_string(),
            &format!("{stokes_times:.2} t*, {averages}"),
        ),
    ]);
    rows
}

/// Time.
fn cost_row(setup: &Setup) -> Row {
    let cells = setup.domain.cell_count();
    let threads = threads(setup.threads);
    let rate = mlups_per_thread(setup.precision) * threads.min(cores()) as f64;
    let seconds = cells as f64 * setup.end_step as f64 / (rate * 1e6);
    let precision = match setup.precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    };
    row(
        "estimated time",
        in_time(seconds),
        &format!("if {rate:.0} MLUPS in {precision} on {threads} threads; `turbid bench` measures it"),
    )
}

fn contact_rows(setup: &Setup) -> Vec<Row> {
    let Some(contact) = &setup.contact else {
        return vec![row("contacts", "off".to_string(), "")];
    };
    let hertz = hertz(setup, contact);
    let terminal = setup.scales.schiller_naumann_velocity;
    let depth = |d: f64| format!("{:.3} % D", 100.0 * d / setup.scales.diameter);
    let cells = |d: f64| {
        if setup.dry {
            format!("{d:.3e} m")
        } else {
            format!("{:.3} cells", d / setup.domain.dx)
        }
    };
    let mut rows = Vec::new();
    if terminal > 0.0 {
        for (speed, name) in [(terminal, "u*"), (0.1 * terminal, "u* / 10")] {
            let steps = hertz.duration(speed) / setup.units.dt;
            let substeps = match setup.substeps {
                1 => String::new(),
                n => format!(", {n} sub-steps each"),
            };
            let remark = format!("steps, Hertz impact at {name}{substeps}");
            rows.push(row("contact lasts", format!("{steps:.0}"), &remark));
        }
        let impact = hertz.impact_depth(terminal);
        rows.push(row(
            "overlap, impact",
            depth(impact),
            &format!("{}, at u*, dry", cells(impact)),
        ));
    }
    let resting = hertz.static_depth(submerged_weight(setup));
    let weight = if setup.dry { "weight" } else { "submerged weight" };
    let remark = format!("{}, one {weight}", cells(resting));
    rows.push(row("overlap, at rest", depth(resting), &remark));
    rows
}

/// What lies outside the usual range, each with an admissible value.
pub(super) fn advice(setup: &Setup) -> Vec<String> {
    let mut advice = if setup.dry {
        Vec::new()
    } else {
        fluid_advice(setup)
    };
    if let Some(contact) = &setup.contact {
        let hertz = hertz(setup, contact);
        let steps = hertz.duration(setup.scales.schiller_naumann_velocity) / setup.units.dt;
        let resolved = steps * f64::from(setup.substeps);
        if resolved < USUAL_CONTACT_STEPS {
            let substeps = (USUAL_CONTACT_STEPS / steps).ceil();
            let modulus = contact.materials[setup.templates[0].material].youngs_modulus
                * libm::pow(resolved / USUAL_CONTACT_STEPS, 2.5);
            advice.push(format!(
                "an impact at u* lasts {resolved:.1} steps of the particles, below {USUAL_CONTACT_STEPS}; take \
                 contact.substeps = {substeps:.0} or contact.youngs_modulus = {modulus:.3e}"
            ));
        }
        let depth = hertz.static_depth(submerged_weight(setup)) / setup.scales.diameter;
        if depth > USUAL_DEPTH {
            let modulus = contact.materials[setup.templates[0].material].youngs_modulus
                * libm::pow(depth / USUAL_DEPTH, 1.5);
            advice.push(format!(
                "a resting particle sinks {:.1} % of a diameter into its neighbour, above {:.0} %; take \
                 contact.youngs_modulus = {modulus:.3e} or more",
                100.0 * depth,
                100.0 * USUAL_DEPTH
            ));
        }
    }
    if setup.threads > cores() {
        advice.push(format!(
            "{} threads on {} cores only get in each other's way; leave --threads and run.threads out for one per core",
            setup.threads,
            cores()
        ));
    }
    if let Err(e) = refuse_what_does_not_fit(setup) {
        advice.push(e.to_string());
    }
    advice
}

/// What lies outside the usual range of the lattice.
fn fluid_advice(setup: &Setup) -> Vec<String> {
    let mut advice = Vec::new();
    let tau = setup.relaxation_time;
    if tau < 0.51 {
        advice.push(format!(
            "lattice.relaxation_time = {tau:.5} is close to 0.5, where the method becomes unstable; 0.51 to 1 is usual"
        ));
    } else if tau > 1.0 {
        advice.push(format!(
            "lattice.relaxation_time = {tau:.5} is above 1, where surfaces begin to slip; 0.51 to 1 is usual"
        ));
    }
    let per_diameter = setup.scales.diameter / setup.domain.dx;
    if per_diameter < 5.0 {
        advice.push(format!(
            "lattice.cells_per_diameter = {per_diameter:.2} resolves particles poorly; 9 to 27 is usual, 5 the least"
        ));
    }
    let started = setup
        .particles
        .iter()
        .map(|p| p.velocity().norm())
        .fold(0.0, f64::max);
    let walls = setup
        .walls
        .iter()
        .map(|wall| {
            let turning = wall.motion.angular_velocity.norm() * 0.5 * setup.domain.size().norm();
            wall.motion.velocity.norm() + turning
        })
        .fold(0.0, f64::max);
    for (speed, what) in [
        (setup.scales.schiller_naumann_velocity, "the terminal velocity u*"),
        (started, "the fastest particle at the start"),
        (walls, "the fastest wall (at its rim)"),
    ] {
        let lattice = speed / setup.units.velocity();
        if lattice > USUAL_LATTICE_SPEED {
            let tau = 0.5 + (tau - 0.5) * USUAL_LATTICE_SPEED / lattice;
            let cells = per_diameter * lattice / USUAL_LATTICE_SPEED;
            advice.push(format!(
                "{what} is {lattice:.3} cells per step, above {USUAL_LATTICE_SPEED}, where the fluid becomes \
                 compressible; take lattice.relaxation_time = {tau:.4} or lattice.cells_per_diameter = {cells:.0}"
            ));
        }
    }
    advice
}
