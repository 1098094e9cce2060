//! `turbid study` from end to end, as a user types it.

use crate::common::case::{SPHERES, changed};
use crate::common::child::{Guard, poll, rows};
use crate::common::{Place, in_tree};
use std::fs;
use std::process::{Command, Output, Stdio};

/// The spheres for 120 steps, tables only.
fn case() -> String {
    changed(
        SPHERES,
        &[
            ("relaxation_time = 0.55", "relaxation_time = 0.6"),
            ("[run]", "[driving]\nforce_balance = \"fluid_only\"\n[run]"),
            ("steps = 10 }", "steps = 120 }\naverage_from = { steps = 40 }"),
        ],
    ) + "[output]
series_every = { steps = 2 }
fields_every = \"never\"
particles_every = \"never\"
picture_every = \"never\"
"
}

const STUDY: &str = r#"
title = "Two volume fractions"
case = "case.toml"
[[window]]
name = "early"
from = 0.5
to = 1.0
[[axis]]
name = "phi"
label = "volume fraction (-)"
key = "particles.0.volume_fraction"
values = [0.1, 0.2]
[[axis]]
name = "seed"
key = "particles.0.seed"
values = [1, 2]
average = true
[[figure]]
name = "velocity"
title = "Settling velocity"
x = "phi"
y = "settling_velocity_over_stokes"
references = [{ law = "richardson_zaki" }]
[[table]]
name = "contacts"
title = "Contacts"
rows = ["phi"]
columns = [{ label = "contacts per sphere", y = "contacts_per_particle" }]
[[check]]
kind = "ordered"
above = 0.0
"#;

/// A folder with the case and a study of it.
struct Folder(Place);

impl Folder {
    fn new(study: &str) -> Self {
        let place = Place::new(&case());
        place.write("study.toml", study);
        Self(place)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        self.0.turbid(&[&["study"], arguments].concat())
    }

    fn study(&self, arguments: &[&str]) -> Output {
        self.command(arguments).stdin(Stdio::null()).output().unwrap()
    }

    /// Output of a study that ends well.
    fn well(&self, arguments: &[&str]) -> String {
        let output = self.study(arguments);
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {}, {complaint}", output.status);
        String::from_utf8(output.stdout).unwrap()
    }

    /// `result.csv` without what depends on the clock.
    fn result(&self, out: &str) -> Vec<Vec<String>> {
        let mut reader = csv::Reader::from_path(self.path(out).join("result.csv")).unwrap();
        let heads = reader.headers().unwrap().clone();
        let timing = |head: &str| ["mlups", "wall_seconds"].contains(&head);
        let kept: Vec<usize> = (0..heads.len()).filter(|&k| !timing(&heads[k])).collect();
        assert_eq!(kept.len() + 2, heads.len());
        let rows = reader.records().map(|row| {
            let row = row.unwrap();
            kept.iter().map(|&k| row[k].to_string()).collect()
        });
        rows.collect()
    }

    fn document(&self, out: &str) -> serde_json::Value {
        self.0.json(&format!("{out}/study.json"))
    }
}

#[test]
fn a_stopped_study_resumes_and_ends_with_the_numbers_of_one_that_was_not() {
    let place = Folder::new(STUDY);
    place.well(&["study.toml", "--out", "whole", "--quiet", "--threads", "2"]);

    let parts = ["study.toml", "--out", "parts", "--threads", "1"];
    let mut child = Guard(place.command(&parts).spawn().unwrap());
    let series = place.path("parts/phi0.2_seed1/series.csv");
    poll("rows of the second run", || (rows(&series) >= 6).then_some(()));
    child.send(libc::SIGTERM);
    child.ends_with(4);
    assert_eq!(place.result("parts").len(), 1);
    let list = place.well(&["study.toml", "--out", "parts", "--list"]);
    assert!(list.contains("phi0.2_seed1") && list.contains("part, up to step "), "{list}");
    assert!(list.contains("1 of 4 runs done") && list.contains("measured"), "{list}");

    let said = place.well(&parts);
    assert!(said.contains("[1/3] phi0.2_seed1, from step "), "{said}");
    assert!(said.contains("4 of 4 runs done, 2 of 2 checks passed"), "{said}");
    assert_eq!(place.result("parts"), place.result("whole"));
    assert!(!place.path("parts/phi0.2_seed1/checkpoints").exists(), "they are of no use any more");
    let [mut parts, mut whole] = ["parts", "whole"].map(|out| place.document(out));
    for document in [&mut parts, &mut whole] {
        assert_eq!(document["runs"]["done"], 4);
        document["runs"]["seconds_spent"] = 0.into();
        document["command"].take();
    }
    assert_eq!(parts, whole);
    let points = &whole["figures"][0]["panels"][0]["series"][0]["points"];
    assert_eq!(points.as_array().unwrap().len(), 2);
    assert!(points[0]["y"].as_f64() > points[1]["y"].as_f64() && points[1]["error"].as_f64() > Some(0.0));
}

#[test]
fn what_has_ended_is_not_repeated_and_a_longer_study_does_only_what_is_new() {
    let place = Folder::new(STUDY);
    let first = place.well(&["study.toml", "--out", "a", "--only", "phi0.1"]);
    assert!(first.contains("2 of 4 runs done"), "{first}");
    let ended = || fs::metadata(place.path("a/phi0.1_seed1/summary.json")).unwrap().modified().unwrap();
    let before = ended();
    let second = place.well(&["study.toml", "--out", "a"]);
    assert!(second.contains("[2/2] phi0.2_seed2") && !second.contains("] phi0.1"), "{second}");
    assert_eq!(ended(), before);
    // Another study beside it takes what is the same.
    let other = STUDY.replace("case = ", "shares = [\"a\"]\ncase = ").replace("[0.1, 0.2]", "[0.2, 0.15]");
    fs::write(place.path("other.toml"), other).unwrap();
    let list = place.well(&["other.toml", "--out", "b", "--list"]);
    assert!(list.contains("2 of 4 runs done") && list.contains("done, in a/phi0.2_seed1"), "{list}");
}

#[test]
fn a_quiet_study_tells_its_failed_checks_and_its_runs_keep_no_checkpoint() {
    let impossible = STUDY.replace("above = 0.0", "above = 100.0").replace("values = [1, 2]", "values = [1]");
    let place = Folder::new(&impossible);
    let output = place.study(&["study.toml", "--out", "out", "--quiet"]);
    assert_eq!((output.status.code(), &output.stdout[..]), (Some(3), &b""[..]));
    let said = String::from_utf8(output.stderr).unwrap();
    let failed = place.document("out")["checks"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|check| check["pass"] == false)
        .count();
    assert!(failed > 0 && said.matches("warning: a check failed: ").count() == failed, "{said}");
    assert!(
        !place.path("out/phi0.1_seed1/checkpoints").exists()
            && place.path("out/phi0.1_seed1/series.csv").exists()
    );
}

#[test]
fn a_run_that_fails_is_reported_and_the_others_are_done_all_the_same() {
    // Hard bodies that overlap from the start.
    let thrown = "{ name = \"thrown\", set = { \"particles.0.volume_fraction\" = 0.1, \"particles.0.minimum_gap\" = 0, \
                  \"contact.enlargement\" = 1, \"contact.youngs_modulus\" = 1e12 } }";
    let place = Folder::new(
        &STUDY
            .replace("values = [0.1, 0.2]", &format!("values = [{thrown}, 0.2]"))
            .replace("references = [{ law = \"richardson_zaki\" }]\n", "only = { phi = 0.2 }\n")
            .replace("x = \"phi\"", "x = \"seed\""),
    );
    let output = place.study(&["study.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(3));
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(
        complaint.contains("the run thrown_seed1 failed") && complaint.contains("2 of the runs failed"),
        "{complaint}"
    );
    assert_eq!(place.result("out").len(), 2);
}

#[test]
fn benchmarks_have_a_speed_and_the_shares_of_the_stages() {
    let study = STUDY.replace("[[window]]", "[bench]\nsteps = 2\n[[window]]");
    let study = study.split("[[figure]]").next().unwrap();
    let place = Folder::new(study);
    place.well(&["study.toml", "--out", "out", "--quiet", "--only", "seed1"]);
    let mut reader = csv::Reader::from_path(place.path("out/result.csv")).unwrap();
    let heads = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.unwrap()).collect();
    assert_eq!(rows.len(), 2);
    let number = |name: &str| -> f64 {
        let column = heads.iter().position(|head| head == name).unwrap();
        rows[0][column].parse().unwrap()
    };
    assert!(number("mlups") > 0.0 && number("memory_bytes") > 1e6);
    let shares: f64 =
        ["map", "fluid", "loads", "dem", "halo"].iter().map(|stage| number(&format!("share_{stage}"))).sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
    let again = place.well(&["study.toml", "--out", "out", "--list"]);
    assert!(again.contains("2 of 4 runs done"), "{again}");
    let threads = place.well(&["study.toml", "--out", "out", "--list", "--threads", "1"]);
    let default = std::thread::available_parallelism().unwrap().get();
    assert_eq!(threads.contains("0 of 4 runs done"), default != 1, "{threads}");
    fs::write(place.path("study.toml"), study.replace("steps = 2", "steps = 3")).unwrap();
    let longer = place.well(&["study.toml", "--out", "out", "--list"]);
    assert!(longer.contains("0 of 4 runs done"), "{longer}");
}

#[test]
fn the_studies_of_the_reference_are_sound() {
    let folder = in_tree("validation/hindered_settling");
    let place = Folder::new(STUDY);
    let mut found = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.extension().is_none_or(|extension| extension != "toml") || name == "case.toml" {
            continue;
        }
        let list = place.well(&[path.to_str().unwrap(), "--out", &name, "--list"]);
        assert!(list.contains("0 of ") && list.contains("nothing was measured"), "{name}: {list}");
        found += 1;
    }
    assert!(found >= 7, "{found}");
}
