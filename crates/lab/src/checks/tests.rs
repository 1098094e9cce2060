//! Claims about checks and their texts.

use super::*;

const LIGGGHTS: EngineName = EngineName { id: "liggghts", label: "LIGGGHTS" };

fn check(quantity: &str, native: Option<f64>, difference: f64, tolerance: f64) -> Check {
    Check {
        case: "impact".to_string(),
        engines: Some([native, Some(-1.5e-9), None]),
        ..Check::new(quantity, difference, 0.0, tolerance, "rounding, \"alone\"")
    }
}

fn outcome(checks: Vec<Check>) -> Outcome {
    let found = Findings { checks, ..Findings::default() };
    Outcome::new("impact", "two spheres meet", Some(LIGGGHTS), 0.0, Ok(found).into())
}

fn broken() -> Outcome {
    let error = Error::Input("killed by signal 9\nits log".to_string());
    Outcome::new("crash", "a worker dies", Some(LIGGGHTS), 0.0, Ending::Failed(error))
}

#[test]
fn the_columns_of_a_table_stand_below_their_names() {
    let long = "a quantity with a name that is longer than most of them are";
    let text = table(
        &outcome(vec![check("restitution (-)", Some(0.9), 1e-7, 1e-6), check(long, None, 0.0, 1.0)]),
        false,
    );
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("impact: two spheres meet ("));
    let end = |line: &str, word: &str| line.find(word).unwrap() + word.len();
    assert_eq!(end(lines[1], "native"), end(lines[2], "0.90000000"));
    assert_eq!(end(lines[1], "LIGGGHTS"), end(lines[2], "-1.5000000e-9"));
    assert_eq!(end(lines[1], "analytic"), end(lines[2], " - ") - 1);
    assert_eq!(end(lines[1], "difference"), end(lines[2], "1.0e-7"));
    assert_eq!(end(lines[1], "tolerance"), end(lines[2], "1.0e-6"));
    assert!(lines[2].ends_with("  ok") && lines[3].ends_with("  ok") && lines.len() == 4);
}

#[test]
fn reasons_are_given_for_failures_and_for_all_when_asked_for() {
    let outcome = outcome(vec![check("good", None, 1e-7, 1e-6), check("bad", None, 3e-6, 1e-6)]);
    let text = table(&outcome, false);
    assert_eq!(text.matches("rounding, \"alone\"").count(), 1);
    assert!(text.contains("1.0e-6  FAIL\n      300 % of the tolerance used: rounding"), "{text}");
    let text = table(&outcome, true);
    assert!(text.contains("1.0e-6  ok\n      10 % of the tolerance used: rounding"), "{text}");
}

#[test]
fn what_is_only_reported_is_not_called_ok() {
    let text = table(&outcome(vec![check("far", None, 0.3, f64::INFINITY)]), false);
    assert!(text.trim_end().ends_with("0.30       none  reported"), "{text}");
}

#[test]
fn a_case_that_ends_in_an_error_or_checks_nothing_is_a_check_that_fails() {
    let text = table(&broken(), false);
    assert!(text.contains("FAIL  did not complete: killed by signal 9\n  its log"), "{text}");
    let outcomes = [outcome(vec![check("good", None, 0.0, 0.0)]), broken(), outcome(Vec::new())];
    assert!(!Score::of(&outcomes).is_full() && Score::of(&outcomes[..1]).is_full());
    assert_eq!(summary(&outcomes, 12.34), "1 of 3 checks passed, 12.3 s");
    let far =
        outcome(vec![check("far", None, 0.3, f64::INFINITY), check("lost", None, f64::NAN, f64::INFINITY)]);
    assert_eq!(summary(&[far], 1.0), "0 of 1 checks passed, 1 more only reported, 1.0 s");
}

#[test]
fn a_number_that_is_none_or_too_far_passes_nothing_and_one_without_a_limit_is_only_reported() {
    for measured in [f64::NAN, 2.0] {
        assert!(!Check::new("x", measured, 0.5, 1.0, "").pass);
    }
    assert!(Check::new("x", 1.5, 0.5, 1.0, "").pass);
    assert!(!Check::new("x", f64::NAN, 0.0, f64::INFINITY, "").is_reported());
    assert!(!Check::failed("x", "").pass);
}

#[test]
fn points_that_all_lie_to_one_side_have_a_bias_though_each_is_within_its_tolerance() {
    let point = |measured: f64| Check::new("u", measured, 2.0, 0.2, "");
    let low = [1.9, 1.94, 1.86].map(point);
    let bias = Check::bias("u", &low, true).unwrap();
    assert!((bias.measured + 0.05).abs() < 1e-12 && bias.is_reported(), "{bias:?}");
    assert!(bias.quantity.contains("3 points (part of the reference)"), "{bias:?}");
    let absolute = Check::bias("u", &low, false).unwrap();
    assert!((absolute.measured + 0.1).abs() < 1e-12);
    let around = [1.9, 2.1].map(point);
    assert!(Check::bias("u", &around, true).unwrap().measured.abs() < 1e-12);
    let lost = [point(1.9), Check::failed("u", "")];
    assert_eq!(Check::bias("u", &lost, true), None, "one point says nothing of a bias");
    let score = Score::of_checks(&[low.to_vec(), vec![bias]].concat());
    assert_eq!((score.passed, score.checks, score.reported), (3, 3, 1));
}

#[test]
fn checks_without_engines_have_keys_of_their_own_and_survive_being_written_and_read() {
    let missing = Check::failed("y", "Hertz (1882)");
    let reported = Check::new("z", 0.5, 0.0, f64::INFINITY, "");
    let written = serde_json::to_string(&[missing, reported.clone()]).unwrap();
    let list: serde_json::Value = serde_json::from_str(&written).unwrap();
    let mut keys: Vec<&String> = list[0].as_object().unwrap().keys().collect();
    keys.sort_unstable();
    assert_eq!(keys, ["measured", "pass", "quantity", "reference", "source", "tolerance"]);
    assert!(list[0]["measured"].is_null() && list[1]["tolerance"].is_null());
    let read: Vec<Check> = serde_json::from_str(&written).unwrap();
    assert!(read[0].measured.is_nan() && !read[0].pass && read[1] == reported);
}

#[test]
fn the_json_is_a_list_of_objects_with_the_promised_keys() {
    let outcomes = [outcome(vec![check("far", Some(0.1 + 0.2), 0.3, f64::INFINITY)]), broken()];
    let list: serde_json::Value = serde_json::from_str(&json(&outcomes)).unwrap();
    let keys = |row: &serde_json::Value| row.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let mut expected = [
        "case",
        "quantity",
        "measured",
        "reference",
        "tolerance",
        "pass",
        "source",
        "native",
        "other",
        "analytic",
    ];
    expected.sort_unstable();
    for row in list.as_array().unwrap() {
        let mut keys = keys(row);
        keys.sort_unstable();
        assert_eq!(keys, expected);
    }
    assert_eq!(list[0]["native"].as_f64(), Some(0.1 + 0.2));
    assert!(list[0]["tolerance"].is_null() && list[0]["analytic"].is_null() && list[0]["pass"] == true);
    assert!(list[1]["measured"].is_null() && list[1]["pass"] == false);
    assert!(list[1]["source"].as_str().unwrap().contains("signal 9"));
}

#[test]
fn the_csv_has_one_row_for_each_check_and_survives_commas_and_quotes() {
    let bytes = csv(&all(&[
        outcome(vec![check("a, b", Some(1.25), 0.5, 1.0), check("c", None, 0.0, 0.0)]),
        broken(),
    ]));
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    assert_eq!(&reader.headers().unwrap()[0], "case");
    let rows: Vec<csv::StringRecord> = reader.records().map(std::result::Result::unwrap).collect();
    assert_eq!(rows.len(), 3);
    assert_eq!((&rows[0][1], &rows[0][7], &rows[0][6]), ("a, b", "1.25", "rounding, \"alone\""));
    assert_eq!((&rows[1][7], &rows[2][5]), ("", "false"));
}
