//! Runs in which one file operation fails, whichever it is: the program says so and ends, or does without, and what it leaves is
//! complete and can be resumed.

#![cfg(target_os = "linux")]

mod common;
#[path = "failing_files/interpose.rs"]
mod interpose;

use common::case::{SPHERES, changed};
use common::{Place, files_below};
use interpose::{count_and_fail, turn};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use turbid::case;
use turbid::error::Result;
use turbid::simulation::{self, RunOptions};

/// Spheres near contact in a small box, and every kind of output but pictures, which take the longest to draw.
fn case() -> String {
    let case = changed(
        SPHERES,
        &[
            ("[4, 4, 4]", "[2.4, 2.4, 2.4]"),
            ("cells_per_diameter = 8", "cells_per_diameter = 5"),
            ("volume_fraction = 0.1\nseed = 1", "file = \"positions.csv\""),
            ("end = { steps = 10 }", "end = { steps = 3 }\naverage_from = { steps = 0 }"),
        ],
    );
    case + OUTPUT
}

const OUTPUT: &str = r#"
[output]
directory = "out"
series_every = { steps = 1 }
fields_every = { steps = 3 }
particles_every = { steps = 3 }
picture_every = "never"
checkpoint_every = { steps = 1 }
"#;
const POSITIONS: &str = "x,y,z\n0.75e-3,0.75e-3,0.75e-3\n2.25e-3,2.25e-3,2.25e-3\n";

/// A folder with the case, and its output directory.
struct Run(Place);

impl Run {
    fn new() -> Self {
        let place = Place::new(&case());
        place.write("positions.csv", POSITIONS);
        Self(place)
    }

    fn out(&self) -> PathBuf {
        self.0.path("out")
    }

    /// As `turbid run case.toml` on `threads` threads, up to a step.
    fn run(&self, threads: usize, end: u64) -> Result<()> {
        let out = self.out();
        let out = out.to_str().unwrap();
        let changes = [format!("run.end.steps={end}"), format!("output.directory={out:?}")];
        let mut setup = case::load(&self.0.path("case.toml"), &changes)?;
        setup.plan.threads = threads;
        simulation::run(&setup, &RunOptions::default()).map(|_| ())
    }

    /// As `turbid resume out`.
    fn resume(&self, threads: usize) -> Result<()> {
        let end = ["run.end.steps=3".to_string()];
        let setup = simulation::saved_setup(&self.out(), &end, Some(threads))?;
        simulation::resume(&setup, &RunOptions::default()).map(|_| ())
    }

    fn checkpoints(&self) -> usize {
        let folder = self.out().join(turbid::checkpoint::FOLDER);
        turbid::checkpoint::list(&folder).unwrap().len()
    }

    /// All files of the output, but those that depend on the machine.
    fn files(&self) -> Files {
        let read = |(name, path)| (name, std::fs::read(path).unwrap());
        files_below(&self.out()).into_iter().map(read).collect()
    }

    /// The numbers that tell two states apart.
    fn state(&self) -> String {
        let summary = self.0.summary("out");
        assert_eq!(summary["steps"], 3);
        summary["state_hash"].to_string()
    }
}

/// Files of which each run has other bytes (times, ranks) though they are whole.
fn varies(name: &Path) -> bool {
    name == Path::new("summary.json") || name.starts_with(turbid::checkpoint::FOLDER)
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Holds what a run that has failed leaves against what was there before and what the undisturbed one leaves.
fn nothing_is_half_written(place: &Run, before: &Files, whole: &Files, when: &str) {
    for (name, bytes) in place.files() {
        // What was not touched yet.
        if before.get(&name) == Some(&bytes) {
            continue;
        }
        let shown = name.to_string_lossy();
        assert!(!shown.contains(".tmp"), "{when}: {shown} is left");
        // An old checkpoint of which something could not be removed no longer has a final name.
        let removing = ["unlink", "rmdir"].iter().any(|word| when.contains(word));
        assert!(removing || !shown.contains(".partial"), "{when}: {shown} is left");
        if varies(&name) {
            continue;
        }
        let wanted = whole.get(&name).unwrap_or_else(|| panic!("{when}: {shown} is new"));
        let sound = match name.extension().and_then(|e| e.to_str()) {
            // Rows are added to it, and readers leave out a torn last one.
            Some("csv") => wanted.starts_with(&bytes),
            // Lists of the frames up to now.
            Some("pvd") => bytes.trim_ascii_end().ends_with(b"</VTKFile>"),
            _ => *wanted == bytes,
        };
        assert!(sound, "{when}: {shown} is not whole");
    }
}

/// Lets one operation after another fail, every n-th, in what `disturbed` does in the place that `prepare` makes; then resumes
/// undisturbed.
fn sweep(prepare: impl Fn() -> Run, disturbed: impl Fn(&Run) -> Result<()>, threads: usize, every: usize) {
    let _turn = turn();
    let reference = prepare();
    let (done, operations) = count_and_fail(None, || disturbed(&reference));
    done.unwrap();
    let (state, whole) = (reference.state(), reference.files());
    let mut failures = 0;
    for n in (0..operations.len()).step_by(every) {
        let place = prepare();
        let before = place.files();
        let (done, seen) = count_and_fail(Some(n), || disturbed(&place));
        let when = format!("operation {n}, {}", seen.get(n).map_or("none", String::as_str));
        nothing_is_half_written(&place, &before, &whole, &when);
        if let Err(error) = done {
            assert_eq!(error.exit_code(), 2, "{when}: {error}");
            failures += 1;
            if place.checkpoints() == 0 {
                let error = place.resume(threads).unwrap_err();
                assert_eq!(error.exit_code(), 2, "{when}: {error}");
                continue;
            }
            place.resume(threads).unwrap_or_else(|error| panic!("{when}: {error}"));
        }
        assert_eq!(place.state(), state, "{when}");
        let left = place.files();
        for (name, bytes) in whole.iter().filter(|(name, _)| !varies(name)) {
            assert!(left.get(name) == Some(bytes), "{when}: {} differs", name.display());
        }
    }
    println!("{failures} of {} operations matter", operations.len());
    assert!(
        operations.len() > 40 && 4 * every * failures > operations.len(),
        "{failures} of {} operations matter",
        operations.len()
    );
}

#[test]
fn whichever_file_operation_of_a_run_fails_it_ends_with_2_and_its_checkpoints_resume_to_the_bit() {
    sweep(Run::new, |place| place.run(1, 3), 1, 1);
}

#[test]
fn whichever_file_operation_of_a_run_on_two_threads_fails_both_end() {
    sweep(Run::new, |place| place.run(2, 3), 2, 5);
}

#[test]
fn whichever_file_operation_of_a_resumed_run_fails_the_checkpoint_it_came_from_still_resumes() {
    let prepare = || {
        let place = Run::new();
        place.run(1, 2).unwrap();
        place
    };
    sweep(prepare, |place| place.resume(1), 1, 4);
}
