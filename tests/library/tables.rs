//! Tables in the pages of `validation/`, made of the CSV of checks: `UPDATE=1 cargo test --test library tables` writes them anew.
//!
//! ```text
//! <!-- checks: FILE CASE -->   the checks of a case            <!-- suite: FILE -->    a row for each case of `turbid validate`
//! <!-- scores: FILE ... -->    a row for each file             <!-- kinds: FILE -->    a row for each beginning of a quantity, to `;`
//! <!-- errors: FILE -->        the rows of a table of errors
//! ```
//!
//! Paths are below `validation/`; a table goes to the next `<!-- end -->`.

use crate::common::in_tree;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::output::numbers::small;
use turbid_lab::checks::{Check, bold_failure, cells, judged, markdown_table, read_csv};
use turbid_lab::validate::{CASES, Level};

fn read(file: &str) -> Vec<Check> {
    let path = in_tree("validation").join(file);
    read_csv(&fs::read_to_string(&path).unwrap())
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Number of checks that passed, and the largest part of a tolerance that one of them uses.
fn score(checks: &[&Check]) -> [String; 2] {
    match judged(checks.iter().copied()) {
        None => ["reported".to_string(), String::new()],
        Some((passed, count, used)) => [format!("{passed} of {count}"), format!("{} %", small(100.0 * used))],
    }
}

/// The rows of one case.
fn of_case(file: &str, case: &str) -> String {
    let rows = read(file).into_iter().filter(|check| check.case == case).map(|check| {
        let [measured, reference, deviation, tolerance] = cells(&check);
        let verdict = bold_failure(&check);
        vec![check.quantity, measured, reference, deviation, tolerance, verdict]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    assert!(!rows.is_empty(), "{file} has no checks of {case}");
    markdown_table(&["quantity", "measured", "reference", "deviation", "tolerance", ""], &rows)
}

fn suite(file: &str) -> String {
    let checks = read(file);
    let row = |case: &turbid_lab::validate::Case| {
        let own: Vec<&Check> = checks.iter().filter(|check| check.case == case.name).collect();
        let full = if case.level() == Level::Full { " (full)" } else { "" };
        let link = format!("[{0}]({0}){full}", case.name);
        [vec![link, case.question.to_string(), case.source.to_string()], score(&own).to_vec()].concat()
    };
    let rows: Vec<Vec<String>> = CASES.iter().map(row).collect();
    markdown_table(&["folder", "question", "reference", "checks passed", "of a tolerance at most"], &rows)
}

fn scores(files: &[&str]) -> String {
    let row = |file: &&str| {
        let checks = read(file);
        let name = Path::new(file).file_name().unwrap().to_str().unwrap();
        [vec![format!("[{name}]({name})")], score(&checks.iter().collect::<Vec<_>>()).to_vec()].concat()
    };
    let rows: Vec<Vec<String>> = files.iter().map(row).collect();
    markdown_table(&["table", "checks passed", "of a tolerance at most"], &rows)
}

/// Deviations from the reference, summed up by kind.
fn kinds(file: &str) -> String {
    let checks = read(file);
    let kind = |check: &Check| check.quantity.split(';').next().unwrap().to_string();
    let mut names: Vec<String> = Vec::new();
    for check in checks.iter().filter(|check| check.reference.is_finite()) {
        let name = kind(check);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let rows = names.into_iter().map(|name| {
        let own: Vec<&Check> =
            checks.iter().filter(|check| kind(check) == name && check.reference.is_finite()).collect();
        let relative = own.iter().all(|check| check.reference != 0.0);
        let unit = |check: &Check| if relative { check.reference.abs() } else { 1.0 };
        let off: Vec<f64> =
            own.iter().map(|check| (check.measured - check.reference) / unit(check)).collect();
        let least = off.iter().copied().fold(f64::INFINITY, f64::min);
        let most = off.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let percent = |off: f64| format!("{:+.2} %", 100.0 * off);
        let part = own[0].tolerance / unit(own[0]);
        let tolerance = if part.is_finite() { format!("{} %", small(100.0 * part)) } else { "none".into() };
        let [passed, _] = score(&own);
        vec![name, off.len().to_string(), percent(least), percent(most), percent(mean), tolerance, passed]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    markdown_table(&["", "rows", "from", "to", "mean", "tolerance", "passed"], &rows)
}

/// A table of errors as it is.
fn errors(file: &str) -> String {
    let text = fs::read_to_string(in_tree("validation").join(file)).unwrap();
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let rows = reader.records().map(|record| {
        let of = record.unwrap();
        let folder = &of[9];
        vec![
            of[0].to_string(),
            of[1].replace('_', " "),
            of[2].to_string(),
            of[3].to_string(),
            format!("{} to {}", &of[4], &of[5]),
            of[6].to_string(),
            format!("{:+} to {:+} %", of[7].parse::<f64>().unwrap(), of[8].parse::<f64>().unwrap()),
            format!("[{folder}](../validation/{folder})"),
        ]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let header =
        ["coupling", "quantity", "bodies", "cells", "relaxation times", "precision", "error", "table"];
    markdown_table(&header, &rows)
}

/// The page with its tables made anew, and their number.
fn renewed(page: &str) -> (String, usize) {
    let (mut out, mut rest, mut count) = (String::new(), page, 0);
    while let Some(at) = ["checks", "suite", "scores", "kinds", "errors"]
        .iter()
        .filter_map(|kind| rest.find(&format!("<!-- {kind}: ")))
        .min()
    {
        let (head, after) = rest[at..].split_once(" -->\n").expect("a marker is a line");
        let words: Vec<&str> = head.split_whitespace().skip(1).collect();
        let table = match words[..] {
            ["checks:", file, case] => of_case(file, case),
            ["suite:", file] => suite(file),
            ["scores:", ref files @ ..] => scores(files),
            ["kinds:", file] => kinds(file),
            ["errors:", file] => errors(file),
            _ => panic!("{head}"),
        };
        let _ = write!(out, "{}{head} -->\n\n{table}\n", &rest[..at]);
        rest = &after[after.find("<!-- end -->").expect("a table has an end")..];
        count += 1;
    }
    (out + rest, count)
}

fn pages() -> Vec<PathBuf> {
    let root = in_tree("validation");
    let folders = fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().path());
    let others = [root.join("README.md"), in_tree("docs").join("limits.md")];
    let pages = folders.map(|folder| folder.join("README.md")).chain(others);
    pages.filter(|page| page.is_file()).collect()
}

#[test]
fn every_table_of_a_page_is_the_one_that_its_csv_makes() {
    let mut count = 0;
    for path in pages() {
        let page = fs::read_to_string(&path).unwrap();
        let (new, tables) = renewed(&page);
        count += tables;
        if page != new && std::env::var_os("UPDATE").is_some() {
            fs::write(&path, new).unwrap();
        } else {
            let path = path.display();
            assert!(page == new, "{path} is out of date; run: UPDATE=1 cargo test --test library tables");
        }
    }
    assert!(count > 15, "{count} tables");
}

#[test]
fn the_page_of_every_case_of_the_suite_has_its_checks() {
    for case in CASES.iter().filter(|case| !case.parts.is_empty() && case.name != "liggghts") {
        let page = in_tree("validation").join(case.name).join("README.md");
        let text = fs::read_to_string(&page).unwrap();
        let marker = format!("<!-- checks: result/validation.csv {} -->", case.name);
        assert!(text.contains(&marker), "{} lacks {marker}", page.display());
    }
}

#[test]
fn a_number_that_was_typed_into_a_table_is_taken_out() {
    let page = "before\n<!-- scores: engines/python.csv -->\n| typed |\n<!-- end -->\nafter\n";
    let (new, count) = renewed(page);
    assert_eq!(count, 1);
    assert!(!new.contains("typed") && new.contains("[python.csv](python.csv)"), "{new}");
    assert!(new.starts_with("before\n") && new.ends_with("<!-- end -->\nafter\n"), "{new}");
    assert_eq!(renewed(&new), (new.clone(), 1));
}
