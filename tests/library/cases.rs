//! Every case under `cases/` reads, resolves to the numbers of its `.expect.toml`, has the state it promises there after
//! some steps, and carries a current schema.

use crate::common::{Place, in_tree};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use turbid::case::{self, Setup};
use turbid::output::OutputFiles;
use turbid::simulation::{self, RunOptions};

/// Cell updates that a test can afford.
const AFFORDABLE: u64 = 200_000_000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Expectations {
    /// Steps that a test runs.
    after_steps: u64,
    /// Numbers known before the first step.
    setup: Vec<Expectation>,
    /// Columns of the last row of `series.csv` after these steps.
    expect: Vec<Expectation>,
}

/// A labelled number with its tolerance, which is the sum of both kinds.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Expectation {
    quantity: String,
    value: f64,
    #[serde(default)]
    relative: f64,
    #[serde(default)]
    absolute: f64,
}

impl Expectation {
    fn check(&self, case: &str, actual: f64) {
        let allowed = self.relative * self.value.abs() + self.absolute;
        assert!(
            (actual - self.value).abs() <= allowed,
            "{case}: {} is {actual}, expected {} +- {allowed}",
            self.quantity,
            self.value
        );
    }
}

fn cases() -> Vec<PathBuf> {
    let folder = in_tree("cases");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .filter(|path| !path.to_string_lossy().ends_with(".expect.toml"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 3, "cases have gone missing: {paths:?}");
    paths
}

fn expectations(case: &Path) -> Expectations {
    let path = case.with_extension("expect.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let expected: Expectations = toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert!(!expected.setup.is_empty() && !expected.expect.is_empty(), "{} promises nothing", path.display());
    expected
}

/// The last row of a time series: names without units, and values.
fn last_row(series: &Path) -> Vec<(String, f64)> {
    let mut reader = csv::Reader::from_path(series).unwrap();
    let names = reader.headers().unwrap().clone();
    let last = reader.records().last().unwrap().unwrap();
    let name = |heading: &str| heading.split(' ').next().unwrap().to_owned();
    names.iter().zip(&last).map(|(heading, value)| (name(heading), value.parse().unwrap())).collect()
}

fn quantity(setup: &Setup, name: &str) -> f64 {
    let scales = || setup.expect_fluid().scales;
    match name {
        "particles" => setup.particles.len() as f64,
        "cells" => setup.fluid_cells() as f64,
        "end_step" => setup.plan.end_step as f64,
        "volume_fraction" => setup.volume_fraction,
        "archimedes" => scales().archimedes,
        "schiller_naumann_over_stokes" => scales().schiller_naumann_velocity / scales().stokes_velocity,
        other => panic!("unknown quantity {other}"),
    }
}

#[test]
fn every_case_resolves_to_the_numbers_it_promises() {
    for path in cases() {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let setup = case::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(setup.provenance.warnings, Vec::<String>::new(), "{name}");
        assert_eq!(setup.plan.output.directory, Path::new("out").join(&name), "{name}");
        let expected = expectations(&path);
        for expectation in &expected.setup {
            expectation.check(&name, quantity(&setup, &expectation.quantity));
        }
        // Of a dry run those of ten particles are as many as those of a thousand cells.
        let mut begun = setup.clone();
        begun.plan.end_step = expected.after_steps;
        let each =
            if setup.fluid.is_some() { setup.domain.cell_count() } else { 100 * begun.expected_particles() };
        let updates = expected.after_steps * each as u64;
        assert!(expected.after_steps > 0 && updates <= AFFORDABLE, "{name}: {updates} cell updates");
    }
}

#[test]
fn every_case_is_after_some_steps_in_the_state_it_promises() {
    for path in cases() {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let expected = expectations(&path);
        let mut setup = case::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let directory = tempfile::tempdir().unwrap();
        setup.plan.end_step = expected.after_steps;
        let output = &mut setup.plan.output;
        output.directory = directory.path().to_path_buf();
        output.series_every = expected.after_steps;
        (output.fields_every, output.particles_every, output.picture_every) = (0, 0, 0);
        (output.contacts_every, output.surfaces_every) = (0, 0);
        let options = RunOptions::default();
        let summary = simulation::run(&setup, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        let summary = summary.expect("the only process has the summary");
        assert_eq!((summary.steps, summary.interrupted), (expected.after_steps, false));

        let row = last_row(&OutputFiles::new(directory.path()).series());
        for expectation in &expected.expect {
            let (_, actual) = row
                .iter()
                .find(|(column, _)| *column == expectation.quantity)
                .unwrap_or_else(|| panic!("{name}: no column {}", expectation.quantity));
            expectation.check(&name, *actual);
        }
    }
}

#[test]
fn every_case_begins_with_its_schema_and_says_what_it_shows_how_long_it_takes_and_what_to_look_at() {
    for path in cases() {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("#:schema ./case.schema.json\n# "), "{}", path.display());
        for word in ["# Shows", "# Takes", "# Look at"] {
            assert!(text.contains(word), "{} lacks `{word}`", path.display());
        }
    }
}

#[test]
fn the_schema_for_editors_is_that_of_the_program() {
    let stored = std::fs::read_to_string(in_tree("cases/case.schema.json")).unwrap();
    assert!(
        stored == case::schema(),
        "out of date; run: cargo run -- check --schema > cases/case.schema.json"
    );
}

#[test]
fn every_key_of_the_schema_is_described() {
    let schema: serde_json::Value = serde_json::from_str(&case::schema()).unwrap();
    let mut keys = 0;
    let mut open = vec![&schema];
    while let Some(value) = open.pop() {
        if let Some(properties) = value.get("properties").and_then(|p| p.as_object()) {
            for (key, property) in properties {
                // The one key of a choice is described by the choice.
                let described = if properties.len() == 1 { [property, value] } else { [property; 2] };
                assert!(
                    described.iter().any(|d| d.get("description").is_some()),
                    "`{key}` has no description"
                );
                keys += 1;
            }
        }
        match value {
            // Conditions name keys that are described elsewhere.
            serde_json::Value::Object(object) => {
                open.extend(
                    object.iter().filter(|(key, _)| *key != "dependentSchemas").map(|(_, value)| value),
                );
            }
            serde_json::Value::Array(array) => open.extend(array),
            _ => {}
        }
    }
    assert!(keys > 50, "{keys}");
}

#[test]
fn no_case_warns_about_its_own_settings() {
    for path in cases() {
        let said = Place::empty().well(&["check", path.to_str().unwrap()]);
        assert!(!said.contains("warning"), "{said}");
    }
}

#[test]
fn the_gallery_gives_the_times_that_the_cases_give() {
    let gallery = std::fs::read_to_string(in_tree("docs/gallery.md")).unwrap();
    for path in cases() {
        let name = format!("cases/{}", path.file_name().unwrap().to_str().unwrap());
        let text = std::fs::read_to_string(&path).unwrap();
        let (_, takes) = text.split_once("# Takes").unwrap();
        let (time, _) = takes.split_once(" on two cores").unwrap();
        let row = gallery.lines().find(|line| line.starts_with(&format!("| `{name}`"))).unwrap();
        let given = row.trim_end_matches(" |").rsplit("| ").next().unwrap();
        assert_eq!(given, time.trim(), "{name}");
    }
}
