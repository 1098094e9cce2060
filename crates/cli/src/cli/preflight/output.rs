//! The files that a run writes, and their size, as its writers estimate them.

use crate::cli::machine::in_bytes;
use crate::cli::terminal::{Row, row};
use turbid::case::Setup;
use turbid::simulation::{FileEstimate, file_estimates};

/// A row for each kind of files, and their sum.
pub(super) fn rows(setup: &Setup) -> Vec<Row> {
    let files = file_estimates(setup);
    let total: f64 = files.iter().map(FileEstimate::total).sum();
    let mut rows: Vec<Row> = (files.iter())
        .map(|files| {
            let remark = format!("{} of {}{}", files.count, in_bytes(files.bytes), files.remark);
            row(files.name, in_bytes(files.total()), remark)
        })
        .collect();
    let directory = format!("in {}, at most about", setup.plan.output.directory.display());
    rows.push(row("all output", in_bytes(total), &directory));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use turbid::case::from_text;
    use turbid::simulation::{RunOptions, run};

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
        let options = RunOptions::default();
        run(&setup, &options).unwrap();
        for files in file_estimates(&setup) {
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
            assert!(range.contains(&ratio), "{}: {} foreseen, {there} written", files.name, files.total());
        }
        let tables = ["series.csv", "particle_series.csv"].map(|name| folder.path().join(name));
        let there: u64 = tables.iter().map(|path| path.metadata().unwrap().len()).sum();
        let foreseen = file_estimates(&setup).iter().find(|files| files.name == "tables").unwrap().total();
        let ratio = foreseen / there as f64;
        assert!((0.5..2.0).contains(&ratio), "{foreseen} foreseen, {there} written");
    }
}
