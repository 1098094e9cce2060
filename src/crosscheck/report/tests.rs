//! Claims about what a report says.

use super::files::{csv, json, looks};
use super::*;
use crate::crosscheck::{CASES, Moment, Overlay};
use crate::math::Vec3;
use std::fs;
use turbid_plot::Style;

fn check(quantity: &str, native: Option<f64>, difference: f64, tolerance: f64) -> Check {
    Check {
        case: "impact",
        quantity: quantity.to_string(),
        native,
        liggghts: Some(-1.5e-9),
        analytic: None,
        difference,
        tolerance,
        reason: "rounding, \"alone\"",
        pass: difference <= tolerance,
    }
}

fn outcome(checks: Vec<Check>) -> Outcome {
    let found = Findings {
        checks,
        ..Findings::default()
    };
    Outcome::of("impact", "two spheres meet", || Ok(found))
}

fn broken() -> Outcome {
    Outcome::of("crash", "a worker dies", || {
        Err(Error::Input("killed by signal 9\nits log".to_string()))
    })
}

#[test]
fn the_columns_of_a_table_stand_below_their_names() {
    let long = "a quantity with a name that is longer than most of them are";
    let text = table(
        &outcome(vec![
            check("restitution (-)", Some(0.9), 1e-7, 1e-6),
            check(long, None, 0.0, 1.0),
        ]),
        false,
    );
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("impact: two spheres meet ("));
    let end = |line: &str, word: &str| line.find(word).unwrap() + word.len();
    assert_eq!(end(lines[1], "native"), end(lines[2], "0.90000000"));
    assert_eq!(end(lines[1], "LIGGGHTS"), end(lines[2], "-1.500000e-9"));
    assert_eq!(end(lines[1], "analytic"), end(lines[2], " - ") - 1);
    assert_eq!(end(lines[1], "difference"), end(lines[2], "1.0e-7"));
    assert_eq!(end(lines[1], "tolerance"), end(lines[2], "1.0e-6"));
    assert!(lines[2].ends_with("  ok") && lines[3].ends_with("  ok") && lines.len() == 4);
}

#[test]
fn reasons_are_given_for_failures_and_for_all_when_asked_for() {
    let outcome = outcome(vec![
        check("good", None, 1e-7, 1e-6),
        check("bad", None, 3e-6, 1e-6),
    ]);
    let text = table(&outcome, false);
    assert_eq!(text.matches("rounding, \"alone\"").count(), 1);
    assert!(
        text.contains("1.0e-6  FAIL\n      300 % of the tolerance used: rounding"),
        "{text}"
    );
    let text = table(&outcome, true);
    assert!(
        text.contains("1.0e-6  ok\n      10 % of the tolerance used: rounding"),
        "{text}"
    );
}

#[test]
fn what_is_only_reported_is_not_called_ok() {
    let text = table(&outcome(vec![check("far", None, 0.3, f64::INFINITY)]), false);
    assert!(text.trim_end().ends_with("0.30       none  reported"), "{text}");
}

#[test]
fn a_case_that_ends_in_an_error_or_checks_nothing_is_a_check_that_fails() {
    let text = table(&broken(), false);
    assert!(
        text.contains("FAIL  did not come to its end: killed by signal 9\n  its log"),
        "{text}"
    );
    let outcomes = [
        outcome(vec![check("good", None, 0.0, 0.0)]),
        broken(),
        outcome(Vec::new()),
    ];
    assert!(!Score::of(&outcomes).is_full() && Score::of(&outcomes[..1]).is_full());
    assert_eq!(summary(&outcomes, 12.34), "1 of 3 checks passed, 12.3 s");
    let far = outcome(vec![
        check("far", None, 0.3, f64::INFINITY),
        check("lost", None, f64::NAN, f64::INFINITY),
    ]);
    assert_eq!(
        summary(&[far], 1.0),
        "0 of 1 checks passed, 1 more only reported, 1.0 s"
    );
}

#[test]
fn a_difference_that_is_no_number_or_too_large_passes_nothing_whatever_the_case_says() {
    for difference in [f64::NAN, 2.0] {
        let claimed = Check {
            pass: true,
            ..check("claimed", None, difference, 1.0)
        };
        assert!(!outcome(vec![claimed]).rows()[0].pass);
    }
}

#[test]
fn the_json_is_a_list_of_objects_with_the_promised_keys() {
    let outcomes = [
        outcome(vec![check("far", Some(0.1 + 0.2), 0.3, f64::INFINITY)]),
        broken(),
    ];
    let list: serde_json::Value = serde_json::from_str(&json(&outcomes)).unwrap();
    let keys = |row: &serde_json::Value| row.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let mut expected = [
        "case",
        "quantity",
        "native",
        "liggghts",
        "analytic",
        "difference",
        "tolerance",
        "reason",
        "pass",
    ];
    expected.sort_unstable();
    for row in list.as_array().unwrap() {
        let mut keys = keys(row);
        keys.sort_unstable();
        assert_eq!(keys, expected);
    }
    assert_eq!(list[0]["native"].as_f64(), Some(0.1 + 0.2));
    assert!(list[0]["tolerance"].is_null() && list[0]["analytic"].is_null() && list[0]["pass"] == true);
    assert!(list[1]["difference"].is_null() && list[1]["pass"] == false);
    assert!(list[1]["reason"].as_str().unwrap().contains("signal 9"));
}

#[test]
fn the_csv_has_one_row_for_each_check_and_survives_commas_and_quotes() {
    let bytes = csv(&[
        outcome(vec![
            check("a, b", Some(1.25), 0.5, 1.0),
            check("c", None, 0.0, 0.0),
        ]),
        broken(),
    ]);
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    assert_eq!(&reader.headers().unwrap()[0], "case");
    let rows: Vec<csv::StringRecord> = reader.records().map(std::result::Result::unwrap).collect();
    assert_eq!(rows.len(), 3);
    assert_eq!(
        (&rows[0][1], &rows[0][2], &rows[0][7]),
        ("a, b", "1.25", "rounding, \"alone\"")
    );
    assert_eq!((&rows[1][2], &rows[2][8]), ("", "false"));
}

fn overlay(names: &[&str]) -> Overlay {
    Overlay {
        name: "force".to_string(),
        title: "force".to_string(),
        axes: ["d (m)".to_string(), "F (N)".to_string()],
        logarithmic: [false; 2],
        curves: names
            .iter()
            .map(|name| ((*name).to_string(), vec![[0.0, 0.0], [1.0, 1.0]]))
            .collect(),
    }
}

#[test]
fn curves_have_the_style_of_their_engine_and_the_only_other_is_the_reference() {
    let styles = |names: &[&str]| -> Vec<Style> {
        let looks = looks(&overlay(names));
        looks.into_iter().map(|look| look.1).collect()
    };
    let usual = [Style::Overlaid, Style::Measured, Style::Reference];
    assert_eq!(styles(&["native", "LIGGGHTS", "Hertz"]), usual);
    assert_eq!(
        styles(&["analytic", "native", "LIGGGHTS"]),
        [usual[2], usual[0], usual[1]]
    );
    assert_eq!(styles(&["native - LIGGGHTS"]), [Style::Measured]);
    assert_eq!(
        styles(&["native", "LIGGGHTS", "x", "y"])[2..],
        [Style::Measured; 2]
    );
    let two = overlay(&[
        "native, e = 0.9",
        "LIGGGHTS, e = 0.9",
        "native, e = 0.5",
        "LIGGGHTS, e = 0.5",
    ]);
    let two: Vec<String> = looks(&two).into_iter().map(|look| look.0).collect();
    assert_eq!(
        two,
        ["native", "LIGGGHTS, e = 0.9", "native", "LIGGGHTS, e = 0.5"]
    );
}

#[test]
fn a_case_leaves_its_plots_and_trajectories_and_the_next_run_clears_only_them() {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path().join("out");
    assert_eq!(prepare(&directory, &["impact"]).unwrap(), directory.join("logs"));
    let sphere = (Vec3::new(-1.0, 0.0, 3.0), Vec3::x(), Vec3::zeros(), 0.5);
    let moment = |time| Moment {
        time,
        spheres: [
            vec![sphere, (Vec3::zeros(), Vec3::x(), Vec3::zeros(), 0.25)],
            vec![sphere],
        ],
    };
    let found = Findings {
        checks: vec![check("good", None, 0.0, 0.0)],
        overlays: vec![overlay(&["native", "LIGGGHTS"])],
        moments: vec![moment(0.0), moment(0.5)],
    };
    let outcomes = [Outcome::of("impact", "", || Ok(found))];
    write_case(&directory, &outcomes[0]).unwrap();
    write_tables(&directory, &outcomes).unwrap();
    let own = [
        "impact_force.png",
        "impact_force.svg",
        "impact_native.pvd",
        "impact_liggghts.pvd",
        "impact_native/0000.vtp",
        "impact_liggghts/0001.vtp",
    ];
    for name in own {
        assert!(directory.join(name).metadata().unwrap().len() > 100, "{name}");
    }
    let pvd = fs::read_to_string(directory.join("impact_native.pvd")).unwrap();
    assert!(pvd.contains("timestep=\"0.5\"") && pvd.contains("file=\"impact_native/0001.vtp\""));
    let foreign = ["impactful.png", "notes.txt", "other_native.pvd", "logs/other.log"];
    for name in foreign {
        fs::write(directory.join(name), "x").unwrap();
    }
    fs::write(directory.join("logs/impact-0.9.log"), "x").unwrap();
    prepare(&directory, &["impact"]).unwrap();
    for name in own.iter().chain(&["logs/impact-0.9.log"]) {
        assert!(!directory.join(name).exists(), "{name} is stale");
    }
    for name in foreign.iter().chain(&["crosscheck.csv"]) {
        assert!(directory.join(name).exists(), "{name} is not of the case");
    }
}

#[test]
fn the_list_names_every_case_with_what_it_shows() {
    let text = crate::crosscheck::list();
    assert_eq!(text.lines().count(), CASES.len());
    for (line, case) in text.lines().zip(CASES) {
        assert!(
            line.trim_start().starts_with(case.id) && line.ends_with(case.title),
            "{line}"
        );
    }
}
