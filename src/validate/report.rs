//! What a validation says: a table to read, JSON, CSV and markdown for others, plots.

use super::{Case, Check, Findings, Level, Outcome, Overlay, Score};
use crate::error::{Error, Result};
use crate::output::numbers::{significant, small};
use crate::output::write_bytes;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use turbid_plot::Style;

/// Width of the column of quantities, at least.
const QUANTITY: usize = 44;
/// Width of a column of numbers.
const VALUE: usize = 13;

/// The cases: level, time, question and source of each; then the time of each level.
pub fn list(cases: &[Case]) -> String {
    let width = cases.iter().map(|case| case.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for case in cases {
        let time = |level| duration(case.seconds(level));
        let times = match (
            case.level(),
            case.seconds(Level::Full) > case.seconds(Level::Quick),
        ) {
            (Level::Quick, false) => format!("quick, {}", time(Level::Quick)),
            (Level::Quick, true) => format!("quick, {}; full, {}", time(Level::Quick), time(Level::Full)),
            (Level::Full, _) => format!("full, {}", time(Level::Full)),
        };
        add(
            &mut text,
            format_args!("  {:width$}  {} ({times})", case.name, case.question),
        );
        add(&mut text, format_args!("  {:width$}  {}", "", case.source));
        if let Some(why) = case.missing {
            add(&mut text, format_args!("  {:width$}  not here: {why}", ""));
        }
    }
    let all = |level| duration(cases.iter().map(|case| case.seconds(level)).sum());
    let [quick, full] = [Level::Quick, Level::Full].map(all);
    add(
        &mut text,
        format_args!("times are of one core; together: quick, {quick}; full, {full}"),
    );
    text
}

/// A time of computation on one core.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{} s", significant(s.max(1.0), 1)),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{} h", significant(s / 3600.0, 2)),
    }
}

/// One case: a line for each check, then what has no reference.
pub fn table(outcome: &Outcome) -> String {
    let Outcome { case, seconds, .. } = outcome;
    let mut text = format!("{}: {}", case.name, case.question);
    let found = match &outcome.result {
        None => {
            let why = case.missing.unwrap_or_default();
            add(&mut text, format_args!("\n  not available, not counted: {why}"));
            return text;
        }
        Some(Err(Error::Interrupted)) => {
            text.push_str("\n  stopped before its end");
            return text;
        }
        Some(Err(error)) => {
            let words = error.to_string().replace('\n', "\n  ");
            add(
                &mut text,
                format_args!("\n  FAIL  did not come to its end: {words}"),
            );
            return text;
        }
        Some(Ok(found)) => found,
    };
    add(&mut text, format_args!(" ({seconds:.1} s)"));
    let quantities = (found.checks.iter().map(|check| &check.quantity))
        .chain(found.notes.iter().map(|(quantity, _)| quantity));
    let longest = quantities.map(|quantity| quantity.chars().count()).max();
    let width = longest.unwrap_or(0).max(QUANTITY);
    add(
        &mut text,
        format_args!(
            "  {:width$}{:>VALUE$}{:>VALUE$}{:>VALUE$}{:>VALUE$}",
            "", "measured", "reference", "deviation", "tolerance"
        ),
    );
    for check in &found.checks {
        let [measured, reference, deviation, tolerance] = words(check);
        let verdict = if check.pass { "ok" } else { "FAIL" };
        add(
            &mut text,
            format_args!(
                "  {:width$}{measured:>VALUE$}{reference:>VALUE$}{deviation:>VALUE$}{tolerance:>VALUE$}  {verdict}",
                check.quantity
            ),
        );
    }
    for (quantity, value) in &found.notes {
        let value = number(*value);
        add(&mut text, format_args!("  {quantity:width$}{value:>VALUE$}"));
    }
    text
}

/// The last line.
pub fn summary(outcomes: &[Outcome], seconds: f64) -> String {
    let Score {
        passed,
        checks,
        missing,
        interrupted,
    } = Score::of(outcomes);
    let stopped = match interrupted {
        0 => String::new(),
        1 => ", one case stopped before its end".to_string(),
        count => format!(", {count} cases stopped before their end"),
    };
    let more = match missing {
        0 => String::new(),
        1 => ", one case not available".to_string(),
        count => format!(", {count} cases not available"),
    };
    format!("{passed} of {checks} checks passed{more}{stopped}, {seconds:.1} s")
}

/// Measured value, reference, deviation and tolerance; the latter two as parts of the reference where it is not zero.
fn words(check: &Check) -> [String; 4] {
    let Check {
        measured,
        reference,
        tolerance,
        ..
    } = *check;
    let off = measured - reference;
    let part = 100.0 * tolerance / reference.abs();
    let (deviation, allowed) = if (1e-3..1000.0).contains(&part) {
        (
            format!("{:+.2} %", 100.0 * off / reference.abs()),
            format!("{} %", small(part)),
        )
    } else {
        (format!("{off:+.1e}"), small(tolerance))
    };
    [number(measured), number(reference), deviation, allowed]
}

fn number(x: f64) -> String {
    match x {
        x if x.is_nan() => "-".to_string(),
        x if x.abs() < 1e6 && x.fract() == 0.0 => format!("{x:.0}"),
        x if (1e-3..1e6).contains(&x.abs()) => significant(x, 5),
        x => format!("{x:.4e}"),
    }
}

/// All checks; a case that did not come to its end has one that fails.
fn checks(outcomes: &[Outcome]) -> Vec<Check> {
    let of = |outcome: &Outcome| match &outcome.result {
        Some(Ok(found)) => found.checks.clone(),
        Some(Err(error)) if !matches!(error, Error::Interrupted) => vec![Check {
            case: outcome.case.name,
            quantity: format!("comes to its end: {error}"),
            measured: f64::NAN,
            reference: f64::NAN,
            tolerance: 0.0,
            pass: false,
            source: outcome.case.source,
        }],
        Some(Err(_)) | None => Vec::new(),
    };
    outcomes.iter().flat_map(of).collect()
}

/// A list with one object for each check; what is not finite becomes `null`.
pub fn json(outcomes: &[Outcome]) -> String {
    let mut text = serde_json::to_string_pretty(&checks(outcomes)).expect("checks are plain JSON");
    text.push('\n');
    text
}

/// Writes [`json`] to a file.
pub fn write_json(path: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_bytes(path, json(outcomes).as_bytes())
}

/// Creates the directory.
pub fn prepare(directory: &Path) -> Result<()> {
    fs::create_dir_all(directory).map_err(|source| {
        Error::Input(format!(
            "cannot write to the output directory {}: {source}\n  choose another one with --out DIR",
            directory.display()
        ))
    })
}

/// Writes the plots of a case.
pub fn write_plots(directory: &Path, outcome: &Outcome) -> Result<()> {
    let Some(Ok(Findings { overlays, .. })) = &outcome.result else {
        return Ok(());
    };
    for overlay in overlays {
        overlay.write(directory, outcome.case.name, looks(overlay))?;
    }
    Ok(())
}

/// Legend and style of every curve: references lie below, pale; of two measured curves the second is drawn over the first.
fn looks(overlay: &Overlay) -> Vec<(String, Style)> {
    let measured = |name: &str| !name.starts_with("reference");
    let two = overlay.curves.iter().filter(|(name, _)| measured(name)).count() == 2;
    let mut before = 0;
    let look = |name: &str| {
        let style = match (measured(name), before) {
            (false, _) => Style::Reference,
            (true, 1) if two => Style::Overlaid,
            (true, _) => Style::Measured,
        };
        before += usize::from(measured(name));
        (
            name.strip_prefix("reference: ").unwrap_or(name).to_string(),
            style,
        )
    };
    overlay.curves.iter().map(|(name, _)| &**name).map(look).collect()
}

/// Writes `validation.csv`, `validation.json` and `validation.md`.
pub fn write_tables(directory: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_json(&directory.join("validation.json"), outcomes)?;
    write_bytes(&directory.join("validation.csv"), &csv(outcomes))?;
    write_bytes(&directory.join("validation.md"), markdown(outcomes).as_bytes())
}

fn csv(outcomes: &[Outcome]) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for check in checks(outcomes) {
        table.serialize(check).expect("memory takes any row");
    }
    table.into_inner().expect("memory takes any row")
}

/// All checks as one table.
pub fn markdown(outcomes: &[Outcome]) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let mut text = format!("Turbid {version}: {}.\n\n", {
        let Score { passed, checks, .. } = Score::of(outcomes);
        format!("{passed} of {checks} checks passed")
    });
    text.push_str("| case | quantity | measured | reference | deviation | tolerance | |\n|---|---|---|---|---|---|---|\n");
    for check in checks(outcomes) {
        let [measured, reference, deviation, tolerance] = words(&check);
        let verdict = if check.pass { "ok" } else { "**FAIL**" };
        let quantity = check.quantity.replace(['\n', '|'], " ");
        add(
            &mut text,
            format_args!(
                "| {} | {quantity} | {measured} | {reference} | {deviation} | {tolerance} | {verdict} |",
                check.case
            ),
        );
    }
    text
}

fn add(text: &mut String, line: std::fmt::Arguments) {
    writeln!(text, "{line}").expect("memory takes any text");
}
