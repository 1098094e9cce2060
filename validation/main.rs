//! The quick level of `turbid validate`, as a user runs it: prints measured values, references and tolerances.
//!
//! `cargo test --release --test validation -- --nocapture`

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Place, words};

#[test]
fn every_case_of_the_quick_level_is_within_its_tolerances() {
    let place = Place::empty();
    let output = place.turbid(&["validate", "--json", "checks.json"]).output().unwrap();
    println!("{}", words(&output));
    let checks = place.json("checks.json");
    let checks = checks.as_array().unwrap();
    for check in checks {
        let number = |key: &str| check[key].as_f64().unwrap_or(f64::NAN);
        let off = (number("measured") - number("reference")).abs();
        let within = off <= number("tolerance");
        assert!(within && check["pass"] == true, "{check}");
        assert!(check["source"].as_str().is_some_and(|source| source.len() > 5), "{check}");
    }
    assert!(output.status.success(), "{}", words(&output));
    assert!(checks.len() > 50, "{} checks", checks.len());
}

#[test]
fn the_full_level_ends_in_time_and_leaves_what_it_can_go_on_with() {
    let place = Place::empty();
    let said = place.ends(4, &["validate", "wet_impact", "--max-walltime", "4", "--out", "."]);
    assert!(said.contains("stopped before its end") && said.contains("the same command resumes"), "{said}");
    let kept = std::fs::read_dir(place.path("kept")).unwrap();
    let left = kept.map(|entry| entry.unwrap().path().join("checkpoints"));
    assert_eq!(left.filter(|folder| folder.is_dir()).count(), 1, "{said}");
}
