//! `turbid run`, end to end: what a run leaves behind when it ends, is stopped, or diverges.

use crate::common::case::{SPHERES, changed};
use crate::common::child::{Guard, poll, rows};
use crate::common::vtk::{Image, point_data, polygons};
use crate::common::{Place, words};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use turbid::output::series::COLUMNS;

const PARTICLES: usize = 13;
const CELLS: usize = 32 * 32 * 32;

/// The spheres for 60 steps, with all kinds of files.
fn case() -> String {
    let output = "average_from = { steps = 20 }

[output]
series_every = { steps = 2 }
fields_every = { steps = 30 }
particles_every = { steps = 20 }
picture_every = { steps = 30 }
";
    changed(SPHERES, &[("steps = 10", "steps = 60")]) + output
}

/// A run of the case into the folder `result`.
struct Run(Place);

impl Run {
    fn new() -> Self {
        Self(Place::new(&case()))
    }

    fn out(&self) -> PathBuf {
        self.0.path("result")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let run = ["run", "case.toml", "--out", "result"];
        self.0.turbid(&[&run, arguments].concat())
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn summary(&self) -> serde_json::Value {
        self.0.summary("result")
    }

    /// Rows of `series.csv`, each checked to be complete.
    fn series(&self) -> Vec<Vec<f64>> {
        let mut reader = csv::Reader::from_path(self.out().join("series.csv")).unwrap();
        assert_eq!(reader.headers().unwrap(), COLUMNS.to_vec());
        let numbers = |row: csv::StringRecord| row.iter().map(|x| x.parse().unwrap()).collect();
        reader.records().map(|row| numbers(row.unwrap())).collect()
    }

    /// Files of a folder of the output, in order.
    fn files(&self, folder: &str) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            std::fs::read_dir(self.out().join(folder)).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }

    /// Every file that a collection names, which must be those in the folder; and their times, which must ascend.
    fn collection(&self, name: &str) -> Vec<PathBuf> {
        let text = std::fs::read_to_string(self.out().join(name).with_extension("pvd")).unwrap();
        assert!(text.trim_end().ends_with("</VTKFile>"), "{text}");
        let all = |key: &str| -> Vec<String> {
            let marker = format!(" {key}=\"");
            text.split(&marker).skip(1).map(|part| part.split('"').next().unwrap().to_owned()).collect()
        };
        let times: Vec<f64> = all("timestep").iter().map(|t| t.parse().unwrap()).collect();
        assert!(times.is_sorted(), "{times:?}");
        let files: Vec<PathBuf> = all("file").iter().map(|file| self.out().join(file)).collect();
        assert_eq!((files.len(), &files), (times.len(), &self.files(name)));
        files
    }

    /// Reads every file of the run with other readers than the program's own code.
    fn check_all_files(&self) {
        for path in self.collection("fields") {
            check_fields(&path);
        }
        for path in self.collection("particles") {
            check_particles(&path);
        }
        assert_eq!(self.collection("contacts").len(), self.collection("force_chains").len());
        for path in self.files("pictures") {
            check_picture(&path);
        }
        check_picture(&self.out().join("settling_velocity.png"));
        let left: Vec<String> = self
            .files("")
            .iter()
            .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
            // `resume.rs` looks into it.
            .filter(|name| name != "checkpoints")
            .collect();
        let promised = [
            "contacts",
            "contacts.pvd",
            "fields",
            "fields.pvd",
            "force_chains",
            "force_chains.pvd",
            "open.py",
            "particle_series.csv",
            "particles",
            "particles.pvd",
            "pictures",
            "run.id",
            "series.csv",
            "settling_velocity.png",
            "summary.json",
            "surfaces",
            "surfaces.pvd",
        ];
        assert_eq!(left, promised);
    }
}

fn check_fields(path: &Path) {
    let image = Image::read(path);
    assert!(image.header().contains("WholeExtent=\"0 32 0 32 0 32\""));
    for (name, components) in [("velocity", 3), ("pressure", 1), ("solid_fraction", 1)] {
        let values = image.named(name);
        assert_eq!(values.len(), components * CELLS, "{name}");
        assert!(values.iter().all(|x| x.is_finite()), "{name}");
    }
    let solid: f32 = image.named("solid_fraction").iter().sum();
    assert!((solid / CELLS as f32 - 0.1).abs() < 0.01, "{solid}");
}

fn check_particles(path: &Path) {
    let [piece] = &polygons(path)[..] else { panic!("not one piece") };
    let mut ids = point_data(piece, "id");
    ids.dedup();
    assert_eq!(ids, (0..PARTICLES).map(|i| i as f64).collect::<Vec<_>>());
    for name in ["velocity", "contact_force"] {
        assert!(point_data(piece, name).iter().all(|x| x.is_finite()), "{name}");
    }
}

fn check_picture(path: &Path) {
    let mut reader =
        png::Decoder::new(BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert!(pixels.iter().any(|&p| p != pixels[0]), "{} is empty", path.display());
}

#[test]
fn a_run_writes_everything_it_promises() {
    let place = Run::new();
    let output = place.run(&[]);
    let said = words(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("mean settling velocity"), "{said}");

    place.check_all_files();
    assert_eq!(place.files("fields").len(), 3);
    assert_eq!(place.files("particles").len(), 4);
    // None of the fluid at rest.
    assert_eq!(place.files("pictures").len(), 4, "a slice and a view");
    let steps: Vec<f64> = place.series().iter().map(|row| row[0]).collect();
    assert_eq!(steps, (0..=30).map(|i| f64::from(2 * i)).collect::<Vec<_>>());

    let summary = place.summary();
    for (key, expected) in [("particles", PARTICLES), ("cells", CELLS), ("steps", 60)] {
        assert_eq!(summary[key], expected, "{key}");
    }
    for key in [
        "settling_velocity_over_stokes",
        "settling_velocity_over_schiller_naumann",
        "averaged_over_distance",
        "volume_fraction",
        "mlups",
    ] {
        assert!(summary[key].as_f64().is_some_and(|x| x > 0.0), "{key}: {}", summary[key]);
    }
    let stages = summary["stages"].as_object().unwrap();
    for stage in ["map", "fluid", "halo", "loads", "dem", "observe", "pictures"] {
        assert!(stages[stage].as_f64().is_some(), "{stage}");
    }
    assert_eq!(summary["interrupted"], false);
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["state_hash"].as_str().unwrap().len(), 16);
    assert!(summary["input"].as_str().unwrap().contains("cells_per_diameter"));

    // The mean is that of the series from the step on that the case names.
    let series = place.series();
    let later: Vec<f64> = series.iter().filter(|row| row[0] >= 20.0).map(|row| row[3]).collect();
    let mean = later.iter().sum::<f64>() / later.len() as f64;
    let written = summary["settling_velocity_over_stokes"].as_f64().unwrap();
    assert!((written / mean - 1.0).abs() < 1e-12, "{written} {mean}");
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    // A number of whole particles, without a word about the volume fraction.
    let case = case().replace("volume_fraction = 0.1", "count = 13");
    let hash = |threads: &str| {
        let place = Run(Place::new(&case));
        let output = place.run(&["--threads", threads, "--quiet"]);
        assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
        let summary = place.summary();
        assert_eq!(summary["threads"], threads.parse::<usize>().unwrap());
        summary["state_hash"].as_str().unwrap().to_owned()
    };
    let one = hash("1");
    assert_eq!(hash("2"), one);
    assert_eq!(hash("3"), one);
}

/// Starts a run without end and stops it once it has written some rows.
fn stopped_by(signal: i32, place: &Run) {
    let endless = ["--quiet", "--set", "run.end={ steps = 100000000 }"];
    let turbid = place.command(&endless);
    // Whoever runs the tests may have them ignore SIGHUP.
    let mut command = Command::new("env");
    command.arg("--default-signal=HUP").arg(turbid.get_program()).args(turbid.get_args());
    command.current_dir(place.0.folder());
    let mut child = Guard::of(command);
    let series = place.out().join("series.csv");
    poll("the first rows", || (rows(&series) > 20).then_some(()));
    child.send(signal);
    child.ends_with(4);
}

#[test]
fn a_run_that_is_told_to_stop_ends_cleanly_with_readable_files() {
    for signal in [libc::SIGTERM, libc::SIGINT, libc::SIGHUP] {
        let place = Run::new();
        stopped_by(signal, &place);
        place.check_all_files();
        let (summary, series) = (place.summary(), place.series());
        assert_eq!(summary["interrupted"], true);
        // The last row, field, particles and picture are those of the last step.
        let last = summary["steps"].as_u64().unwrap();
        assert!(series.len() >= 20 && last < 100_000_000);
        assert_eq!(series.last().unwrap()[0] as u64, last);
        for (folder, prefix) in [("fields", "fields"), ("particles", "particles"), ("pictures", "view")] {
            let name = place.files(folder).pop().unwrap();
            let name = name.file_stem().unwrap().to_string_lossy().into_owned();
            assert_eq!(name, format!("{prefix}_{last:010}"));
        }
    }
}

/// Runs into divergence and returns what is said; what was written until then must be readable.
fn diverges(arguments: &[&str]) -> String {
    let place = Run::new();
    let output = place.run(&[&["--quiet"], arguments].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(output.stdout.is_empty());
    assert!(!place.series().is_empty());
    for path in place.collection("fields") {
        check_fields(&path);
    }
    for path in place.collection("particles") {
        check_particles(&path);
    }
    assert!(!place.out().join("summary.json").exists());
    said
}

/// The number after a word.
fn number_after(said: &str, word: &str) -> f64 {
    let rest = said.split(word).nth(1).unwrap_or_else(|| panic!("no `{word}` in {said}"));
    let number = rest.trim_start().split([':', ' ', ',']).next().unwrap();
    number.parse().unwrap_or_else(|_| panic!("no number after `{word}` in {said}"))
}

#[test]
fn a_fluid_that_becomes_too_fast_stops_the_run_with_step_position_and_quantity() {
    for threads in ["1", "2"] {
        // Thrown by what they overlap at the start.
        let said = diverges(&[
            "--threads",
            threads,
            "--set",
            "particles.0.minimum_gap=0",
            "--set",
            "contact.enlargement=1",
            "--set",
            "contact.youngs_modulus=2e6",
        ]);
        let step = number_after(&said, "diverged at step");
        assert!((0.0..60.0).contains(&step), "{said}");
        // Well above the limit already when it is next looked at.
        let speed = number_after(&said, "fluid velocity");
        assert!((0.4..1.0).contains(&speed), "{said}");
        assert!(said.contains(" at (") && said.contains(") m "), "{said}");
    }
}

#[test]
fn a_particle_that_is_thrown_stops_the_run_with_step_place_and_quantity() {
    // Hard bodies that overlap from the start.
    let said = diverges(&[
        "--set",
        "particles.0.minimum_gap=0",
        "--set",
        "contact.enlargement=1",
        "--set",
        "contact.youngs_modulus=1e12",
    ]);
    let step = number_after(&said, "diverged at step");
    assert!((0.0..60.0).contains(&step), "{said}");
    let (_, diverged) = said.split_once("diverged").unwrap();
    assert!(number_after(diverged, "particle") < PARTICLES as f64, "{said}");
    assert!(said.contains("more than a cell"), "{said}");
}

#[test]
fn warnings_about_numbers_of_the_case_are_in_the_summary_and_in_the_report() {
    let place = Place::new(&changed(&case(), &[("steps = 60", "steps = 24")]));
    let set = ["--set", "lattice.relaxation_time=1.2", "--set", "fluid.archimedes=1"];
    place.well(&[&["run", "case.toml", "--quiet", "--out", "out"], &set[..]].concat());
    place.well(&["report", "out"]);
    let warning = "lattice.relaxation_time = 1.20000 is above 1";
    for file in ["out/summary.json", "out/REPORT.md", "out/report.html"] {
        assert!(place.text(file).contains(warning), "{file}");
    }
}
