//! Derived numbers and cost of a run, and advice on values outside the usual range.

mod bodies;
mod contacts;
mod errors;
mod flow;
mod output;
pub(super) mod ranks;

use super::machine::{cores, in_bytes, in_time};
use super::terminal::{Row, row};
use turbid::case::{FluidSetup, Setup};
use turbid::comm;
use turbid::engine::{EngineChoice, EngineProcess};
use turbid::error::{Error, Result};
use turbid::fluid::Precision;
use turbid::memory::{self, Room};
use turbid::simulation::{bytes_per_cell, decompose, seconds_of_files, time_estimate};

/// Memory (bytes) for the cells and for the particles of a run.
fn memory_parts(setup: &Setup) -> [f64; 2] {
    let cells = setup.fluid_cells();
    [
        cells as f64 * bytes_per_cell(setup.plan.precision),
        setup.expected_particles() as f64 * memory::PER_PARTICLE,
    ]
}

/// The tightest limit on the memory of all processes of a run together.
fn nearest_limit() -> Option<Room> {
    let (all, here) = comm::launched().map_or((1, 1), |launched| (launched.size, launched.here));
    let rooms = memory::rooms().into_iter().map(|room| {
        let processes = if room.each { 1 } else { here };
        Room { bytes: room.bytes * all as f64 / processes as f64, ..room }
    });
    rooms.min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// Refuses a run that this machine cannot hold.
pub(super) fn refuse_what_does_not_fit(setup: &Setup) -> Result<()> {
    decompose(setup)?;
    match nearest_limit() {
        Some(room) => refuse_above(setup, &room),
        None => Ok(()),
    }
}

/// Refuses a run that this machine cannot hold; returns what [`advice`] there is on one that it can.
pub(super) fn admit(setup: &Setup) -> Result<Vec<String>> {
    refuse_what_does_not_fit(setup)?;
    Ok(advice(setup))
}

/// Refuses a run that takes more than there is.
fn refuse_above(setup: &Setup, room: &Room) -> Result<()> {
    let [cells, particles] = memory_parts(setup);
    let needed = cells + particles;
    if needed <= room.bytes {
        return Ok(());
    }
    let [x, y, z] = setup.domain.cells;
    let (box_of, remedy) = if cells <= 0.0 || particles > room.bytes {
        (String::new(), "take fewer particles".to_string())
    } else {
        let factor = ((room.bytes - particles) / cells).cbrt();
        let per_diameter = factor * setup.diameter / setup.domain.dx;
        (
            format!("the box of {x} x {y} x {z} cells with "),
            format!(
                "take at most lattice.cells_per_diameter = {per_diameter:.1}, or a box smaller by the factor {factor:.2} in each \
                 direction"
            ),
        )
    };
    Err(Error::Input(format!(
        "{box_of}{} particles needs about {}, but {}; {remedy}",
        setup.expected_particles(),
        in_bytes(needed),
        room.limit
    )))
}

/// Least and largest diameter of particles (m), of the spheres of equal volume.
fn diameters(setup: &Setup) -> (f64, f64) {
    let all = setup.templates.iter().map(|template| template.shape.equivalent_diameter());
    all.fold((f64::INFINITY, 0.0), |(least, most), one| (least.min(one), most.max(one)))
}

/// Derived numbers and cost.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let mut rows = Vec::new();
    let size = setup.domain.size();
    if setup.fluid.is_some() {
        let [x, y, z] = setup.domain.cells;
        let size = size / setup.diameter;
        let remark = format!("{x} x {y} x {z}, {:.4} x {:.4} x {:.4} D", size.x, size.y, size.z);
        rows.push(row("cells", setup.fluid_cells().to_string(), remark));
    } else {
        let edges = format!("{:.4e} x {:.4e} x {:.4e} m", size.x, size.y, size.z);
        rows.push(row("box", edges, "no fluid"));
    }
    let remark = nearest_limit().map_or(String::new(), |room| room.limit);
    rows.push(row("memory", in_bytes(memory_parts(setup).iter().sum()), remark));
    rows.extend(bodies::wall_rows(setup));
    rows.push(row("particles", setup.start_count().to_string(), ""));
    let [actual, requested] = [setup.volume_fraction, setup.requested_volume_fraction];
    let remark = if (actual - requested).abs() > 1e-9 {
        format!("{requested:.5} requested: rounded up to whole particles")
    } else {
        String::new()
    };
    rows.push(row("volume fraction", format!("{actual:.5}"), remark));
    rows.extend(bodies::change_rows(setup));
    rows.extend(bodies::particle_rows(setup));
    rows.extend((setup.fluid.as_ref()).map_or_else(|| dry_rows(setup), |fluid| flow::rows(setup, fluid)));
    rows.extend(setup.fluid.iter().flat_map(|fluid| errors::rows(setup, fluid)));
    rows.extend(engine_row(setup));
    rows.extend(contacts::rows(setup));
    rows.extend(setup.fluid.as_ref().and_then(|_| time_row(setup)));
    rows.extend(output::rows(setup));
    rows
}

/// The engine, if it is not the native one.
fn engine_row(setup: &Setup) -> Option<Row> {
    let host = |process| match process {
        EngineProcess::Worker => "in a process of its own",
        EngineProcess::Own => "in this process",
    };
    match &setup.engine {
        EngineChoice::Native => None,
        EngineChoice::Liggghts(options) => {
            let process = host(options.process);
            let remark = match options.commands.len() {
                0 => process.to_string(),
                n => format!("{process}; commands of the case: {n}"),
            };
            Some(row("engine", "LIGGGHTS", remark))
        }
        EngineChoice::Lammps(options) => Some(row("engine", "LAMMPS", host(options.process))),
        EngineChoice::Process(program) => {
            Some(row("engine", program.command.join(" "), "in a process of its own"))
        }
    }
}

/// Rows of a case without a fluid.
fn dry_rows(setup: &Setup) -> Vec<Row> {
    let remark = format!("averages from step {}", setup.plan.average_from_step);
    vec![
        row("time step", format!("{:.6e} s", setup.time_step), ""),
        row("steps", setup.plan.end_step.to_string(), remark),
        row("time", format!("{:.4} s", setup.end_time()), ""),
    ]
}

/// Estimated time; none if the case cannot run.
fn time_row(setup: &Setup) -> Option<Row> {
    let estimate = time_estimate(setup).ok()?;
    let files = seconds_of_files(setup);
    let seconds = setup.plan.end_step as f64 * estimate.seconds_per_step + files;
    let files = if files >= 1.0 { format!(", {} of it for files", in_time(files)) } else { String::new() };
    let precision = setup.plan.precision.name();
    let rate = setup.domain.cell_count() as f64 / estimate.seconds_per_step / 1e6;
    let ranks = match comm::launched() {
        Some(launched) if launched.size > 1 => "processes",
        _ => "threads",
    };
    Some(row(
        "estimated time",
        in_time(seconds),
        format!(
            "{rate:.0} MLUPS in {precision} on {} {ranks}{files}, with the built-in costs",
            estimate.ranks
        ),
    ))
}

/// Values outside the usual range, each with an admissible one.
pub(super) fn advice(setup: &Setup) -> Vec<String> {
    let mut advice = (setup.fluid.as_ref()).map_or_else(Vec::new, |fluid| fluid_advice(setup, fluid));
    advice.extend(contacts::advice(setup));
    if setup.plan.threads > cores() {
        advice.push(format!(
            "{} threads on {} cores only get in each other's way; leave --threads and run.threads out for one per core",
            setup.plan.threads,
            cores()
        ));
    }
    if let Err(e) = refuse_what_does_not_fit(setup) {
        advice.push(e.to_string());
    }
    advice
}

/// The same, of the lattice.
fn fluid_advice(setup: &Setup, fluid: &FluidSetup) -> Vec<String> {
    let mut advice = Vec::new();
    let tau = fluid.relaxation_time;
    if tau < 0.51 {
        advice.push(format!(
            "lattice.relaxation_time = {tau:.5} is close to 0.5, where the method becomes unstable; 0.51 to 1 is usual"
        ));
    } else if tau > 1.0 {
        advice.push(format!(
            "lattice.relaxation_time = {tau:.5} is above 1, where surfaces begin to slip; 0.51 to 1 is usual"
        ));
    }
    if setup.plan.precision == Precision::F16 {
        advice.push(
            "fluid.precision = \"f16\" rounds populations to 11 bits: bodies that settle at Reynolds numbers of 8 and 32 do so as in f64 \
             within 0.01 %, but creeping flows are slowed, a settling sphere of Re 0.05 by 1.3 to 1.8 %, flow through fixed arrays and \
             between plates by up to 10 % (validation/precision); there take \"f32\""
                .to_string(),
        );
    }
    let per_diameter = setup.diameter / setup.domain.dx;
    let smallest = diameters(setup).0 / setup.domain.dx;
    if smallest < 5.0 {
        let sized = if smallest < 0.999 * per_diameter {
            format!(", and the smallest have {smallest:.2} cells")
        } else {
            String::new()
        };
        advice.push(format!(
            "lattice.cells_per_diameter = {per_diameter:.2} resolves particles poorly{sized}; 9 to 27 is usual, 5 the least"
        ));
    }
    advice
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid::case::from_text;

    const TEXT: &str = "domain.size = [4e-3, 4e-3, 4e-3]\n\
                        domain.periodic = [true, true, false]\n\
                        fluid = { density = 1000, viscosity = 1e-6 }\n\
                        lattice = { cells_per_diameter = 5, relaxation_time = 0.6 }\n\
                        driving = { gravity = 9.81, body_acceleration = [1e-4, 0, 0] }\n\
                        contact = { youngs_modulus = 1e6, restitution = 0.5, substeps = 1 }\n\
                        run.end.steps = 100\n\
                        [[particles]]\n\
                        shape.sphere.diameter = 1e-3\n\
                        density = 1100.0\n\
                        list = [{ position = [1e-3, 1e-3, 1e-3], velocity = [1e-3, 0, 0] }, [3e-3, 3e-3, 3e-3]]\n";

    #[test]
    fn no_remedy_names_a_number_that_is_not_finite() {
        let keys = [
            "domain.size.2",
            "fluid.density",
            "fluid.viscosity",
            "lattice.cells_per_diameter",
            "lattice.relaxation_time",
            "driving.gravity",
            "driving.body_acceleration.0",
            "contact.youngs_modulus",
            "contact.restitution",
            "contact.enlargement",
            "particles.0.shape.sphere.diameter",
            "particles.0.density",
            "particles.0.list.0.velocity.0",
        ];
        let mut said = 0;
        for key in keys {
            for value in
                ["5e-324", "1e-300", "1e-30", "1e-20", "1e-9", "1e3", "1e9", "1e20", "1e30", "1e300", "1e308"]
            {
                let texts = match from_text(TEXT, "case", &[format!("{key}={value}")]) {
                    Err(error) => vec![error.to_string()],
                    Ok(setup) => [setup.provenance.warnings.clone(), advice(&setup)].concat(),
                };
                for text in texts {
                    let mut words = text.split(|c: char| !c.is_ascii_alphanumeric());
                    assert!(
                        !words.any(|word| ["inf", "NaN", "nan"].contains(&word)),
                        "{key} = {value}: {text}"
                    );
                    said += 1;
                }
            }
        }
        assert!(said > 50, "{said}");
    }
}
