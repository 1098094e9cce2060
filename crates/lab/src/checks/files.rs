//! Checks as CSV and JSON, and the plots of cases.

use super::{Check, Ending, Figure, Outcome, all, judged, markdown};
use std::fs;
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::output::numbers::small;
use turbid::output::picture::{Format, write_figure};
use turbid::output::write_bytes;
use turbid_plot::{Bars, Figure as Picture};

/// Creates the output directory; an error with a remedy if that is not possible.
pub fn prepare(directory: &Path) -> Result<()> {
    fs::create_dir_all(directory).map_err(|source| {
        Error::Input(format!(
            "cannot write to the output directory {}: {source}\n  choose another one with --out DIR",
            directory.display()
        ))
    })
}

/// A list with one object for each check; what is not finite becomes `null`.
pub fn json(outcomes: &[Outcome]) -> String {
    let mut text = serde_json::to_string_pretty(&all(outcomes)).expect("checks are plain JSON");
    text.push('\n');
    text
}

/// A row for each check, below a header. All of them compare engines, or none.
pub fn csv(checks: &[Check]) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for check in checks {
        table.serialize(check).expect("memory takes any row");
    }
    table.into_inner().expect("memory takes any row")
}

/// The checks of a table that [`csv()`] has written; errors in words.
pub fn read_csv(text: &str) -> std::result::Result<Vec<Check>, String> {
    let mut table = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    table.deserialize().collect::<std::result::Result<_, _>>().map_err(|error| error.to_string())
}

pub fn write_json(path: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_bytes(path, json(outcomes).as_bytes())
}

/// Writes `NAME.csv`, `NAME.json` and `NAME.md`.
pub fn write_tables(directory: &Path, name: &str, outcomes: &[Outcome]) -> Result<()> {
    let file = |ending: &str| directory.join(format!("{name}.{ending}"));
    let checks = all(outcomes);
    write_json(&file("json"), outcomes)?;
    write_bytes(&file("csv"), &csv(&checks))?;
    write_bytes(&file("md"), markdown(&checks).as_bytes())
}

/// Writes the plots of a case as `CASE_NAME.png` and `CASE_NAME.svg`.
pub fn write_plots(directory: &Path, outcome: &Outcome) -> Result<()> {
    let Ending::Found(found) = &outcome.ending else {
        return Ok(());
    };
    found.figures.iter().try_for_each(|Figure { name, chart }| {
        write_picture(directory, &format!("{}_{name}", outcome.case), &chart.figure())
    })
}

/// Writes `NAME.png` and `NAME.svg`, with a bar for each case: the largest part of a tolerance that one of its checks uses.
pub fn write_bars(directory: &Path, name: &str, outcomes: &[Outcome]) -> Result<()> {
    let row = |outcome: &Outcome| {
        let (passed, checks, used) = judged(&outcome.checks())?;
        let text = format!("{} %, {passed} of {checks} checks", small(100.0 * used));
        Some((outcome.case.clone(), used, text))
    };
    let engine = outcomes.iter().find_map(|outcome| outcome.engine).unwrap_or_default().label;
    let title = format!("native and {engine}: largest part of a tolerance that is used");
    let limit = ("limit".to_string(), 1.0, "100 %".to_string());
    let figure = Bars { title, rows: outcomes.iter().filter_map(row).chain([limit]).collect() }.figure();
    write_picture(directory, name, &figure)
}

fn write_picture(directory: &Path, name: &str, picture: &Picture) -> Result<()> {
    [Format::Png, Format::Svg].into_iter().try_for_each(|format| {
        write_figure(&directory.join(format!("{name}.{}", format.extension())), picture, format)
    })
}
