//! Estimate of the files that a run writes, and of their size.

use super::{Row, in_bytes, row};
use crate::case::Setup;
use crate::output::{PATHS, particle_series, series};
use crate::particle::{FEW_TRIANGLES, surface_triangles};
use crate::simulation::Simulation;

/// Bytes of a particle as a point.
const POINT: f64 = 360.0;
/// Bytes of a triangle of a surface, with its share of points.
const TRIANGLE: f64 = 35.0;
/// Bytes of a contact and its two lines of force chains.
const CONTACT: f64 = 160.0;
/// Contacts that a particle in a bed is responsible for.
const CONTACTS_EACH: f64 = 3.0;
/// Bytes of a picture.
const PICTURE: f64 = 3e5;
/// Bytes of a number in a table.
const NUMBER: f64 = 14.0;
/// Bytes of a particle in a checkpoint.
const SAVED_PARTICLE: f64 = 600.0;
/// Checkpoints that are kept, and the new one beside them.
const CHECKPOINTS: u64 = 3;

/// Files of one kind.
struct Files {
    name: &'static str,
    count: u64,
    /// Bytes of each.
    bytes: f64,
    remark: &'static str,
}

impl Files {
    fn total(&self) -> f64 {
        self.count as f64 * self.bytes
    }
}

/// A row for each kind of files, and their sum.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let files = files(setup);
    let total: f64 = files.iter().map(Files::total).sum();
    let mut rows: Vec<Row> = (files.iter().filter(|files| files.count > 0))
        .map(|files| {
            let remark = format!("{} of {}{}", files.count, in_bytes(files.bytes), files.remark);
            row(files.name, in_bytes(files.total()), &remark)
        })
        .collect();
    let directory = format!("in {}, at most about", setup.plan.output.directory.display());
    rows.push(row("all output", in_bytes(total), &directory));
    rows
}

fn files(setup: &Setup) -> Vec<Files> {
    let plan = &setup.plan.output;
    // Those due, the first state included, and the last state.
    let due = |every: u64| {
        let end = setup.plan.end_step;
        end.checked_div(every)
            .map_or(0, |n| n + 1 + u64::from(!end.is_multiple_of(every)))
    };
    let particles = setup.particles.len() as f64;
    let cells = setup.fluid_cells();
    let fine = surface_triangles(
        &setup.templates,
        setup.particles.iter().map(|p| (p.template as usize, 1)),
    );
    // Many are drawn once less refined.
    let triangles = if fine > FEW_TRIANGLES { fine / 4 } else { fine };
    let row_bytes = NUMBER
        * (series::COLUMNS.len() as f64
            + particles.min(PATHS as f64) * particle_series::COLUMNS.len() as f64);
    let rows = due(plan.series_every);
    let saved = if cells == 0 {
        0.0
    } else {
        Simulation::checkpoint_bytes(setup)
    };
    let of = |name, count, bytes, remark| Files {
        name,
        count,
        bytes,
        remark,
    };
    vec![
        of(
            "field output",
            due(plan.fields_every),
            20.0 * cells as f64,
            " before compression",
        ),
        of(
            "particle output",
            due(plan.particles_every),
            POINT * particles,
            "",
        ),
        of(
            "surface output",
            due(plan.surfaces_every),
            TRIANGLE * triangles as f64,
            "",
        ),
        of(
            "contact output",
            due(plan.contacts_every),
            CONTACT * CONTACTS_EACH * particles,
            ", a bed's contacts",
        ),
        of("pictures", due(plan.picture_every), PICTURE, ""),
        of("tables", u64::from(rows > 0), rows as f64 * row_bytes, ""),
        of(
            "checkpoints",
            CHECKPOINTS,
            saved + SAVED_PARTICLE * particles,
            ", the last two and a new one",
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;
    use crate::simulation::{RunOptions, run};
    use std::path::Path;

    const CASE: &str = r"
        [domain]
        size = { diameters = [4, 4, 4] }
        periodic = [true, true, false]
        [fluid]
        density = 1000.0
        archimedes = 1000
        [lattice]
        cells_per_diameter = 6
        relaxation_time = 0.55
        [[particles]]
        shape = { sphere = { diameter = 1.5e-3 } }
        density = 3300.0
        volume_fraction = 0.2
        [run]
        end = { steps = 20 }
        [output]
        series_every = { steps = 1 }
        fields_every = { steps = 10 }
        particles_every = { steps = 10 }
        picture_every = { steps = 10 }
        checkpoint_every = { steps = 20 }
    ";

    /// Bytes below a folder.
    fn on_disk(folder: &Path) -> f64 {
        let entries = std::fs::read_dir(folder).unwrap().map(Result::unwrap);
        let bytes = entries.map(|entry| {
            if entry.file_type().unwrap().is_dir() {
                on_disk(&entry.path())
            } else {
                entry.metadata().unwrap().len() as f64
            }
        });
        bytes.sum()
    }

    #[test]
    fn a_run_writes_about_as_many_bytes_of_each_kind_as_are_foreseen() {
        let folder = tempfile::tempdir().unwrap();
        let mut setup = from_text(CASE, "case", &[]).unwrap();
        setup.plan.output.directory = folder.path().to_path_buf();
        let options = RunOptions {
            quiet: true,
            ..RunOptions::default()
        };
        run(&setup, &options).unwrap();
        for files in files(&setup) {
            let (name, range) = match files.name {
                // Solid, and what is at rest, compress well.
                "field output" => ("fields", 1.0..4.0),
                "particle output" => ("particles", 0.5..2.0),
                "surface output" => ("surfaces", 0.5..2.0),
                "pictures" => ("pictures", 0.5..20.0),
                // One of the three that there is room for.
                "checkpoints" => ("checkpoints", 2.0..6.0),
                _ => continue,
            };
            let there = on_disk(&folder.path().join(name));
            let ratio = files.total() / there;
            assert!(
                range.contains(&ratio),
                "{}: {} foreseen, {there} written",
                files.name,
                files.total()
            );
        }
        let tables = ["series.csv", "particle_series.csv"].map(|name| folder.path().join(name));
        let there: u64 = tables.iter().map(|path| path.metadata().unwrap().len()).sum();
        let foreseen = files(&setup)
            .iter()
            .find(|files| files.name == "tables")
            .unwrap()
            .total();
        let ratio = foreseen / there as f64;
        assert!(
            (0.5..2.0).contains(&ratio),
            "{foreseen} foreseen, {there} written"
        );
    }
}
