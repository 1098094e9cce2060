//! The quick level of `turbid validate`, as a user runs it: prints measured values, references and tolerances.
//!
//! `cargo test --release --test validation -- --nocapture`

use serde_json::Value;
use std::process::Command;

#[test]
fn every_case_of_the_quick_level_is_within_its_tolerances() {
    let directory = tempfile::tempdir().unwrap();
    let json = directory.path().join("checks.json");
    let output = Command::new(env!("CARGO_BIN_EXE_turbid"))
        .arg("validate")
        .arg("--json")
        .arg(&json)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    println!("{said}");
    let text = std::fs::read_to_string(&json).unwrap_or_else(|error| panic!("{error}\n{said}"));
    let checks: Vec<Value> = serde_json::from_str(&text).unwrap();
    for check in &checks {
        let number = |key: &str| check[key].as_f64().unwrap_or(f64::NAN);
        let off = (number("measured") - number("reference")).abs();
        let within = off <= number("tolerance");
        assert!(within && check["pass"] == true, "{check}");
        assert!(
            check["source"].as_str().is_some_and(|source| source.len() > 5),
            "{check}"
        );
    }
    assert!(output.status.success(), "{said}");
    assert!(checks.len() > 50, "{} checks", checks.len());
}

#[test]
fn the_full_level_ends_in_time_and_leaves_what_it_can_go_on_with() {
    let directory = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_turbid"))
        .args(["validate", "wet_impact", "--max-walltime", "4", "--out"])
        .arg(directory.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(
        said.contains("stopped before its end") && said.contains("the same command goes on"),
        "{said}"
    );
    let kept = std::fs::read_dir(directory.path().join("kept")).unwrap();
    let left = kept.map(|entry| entry.unwrap().path().join("checkpoints"));
    assert_eq!(left.filter(|folder| folder.is_dir()).count(), 1, "{said}");
}
