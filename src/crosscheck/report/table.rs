//! The table on the terminal.

use super::{Outcome, Row, Score};
use crate::crosscheck::Case;
use std::fmt::Write;

/// Width of the column of quantities, at least.
const QUANTITY: usize = 44;
/// Width of a column of values.
const VALUE: usize = 14;
/// Width of the columns of difference and tolerance.
const SMALL: usize = 11;

/// The cases of the suite, one line each.
pub fn list(cases: &[Case]) -> String {
    let width = cases.iter().map(|case| case.id.len()).max().unwrap_or(0);
    let lines = cases
        .iter()
        .map(|case| format!("  {:width$}  {}", case.id, case.title));
    lines.collect::<Vec<_>>().join("\n")
}

/// One case: a line for each check; with the tolerance and its reason for all if `explain`, else for those that fail.
pub fn table(outcome: &Outcome, explain: bool) -> String {
    let Outcome {
        case, title, seconds, ..
    } = outcome;
    let mut text = format!("{case}: {title} ({seconds:.1} s)\n");
    if let Err(error) = &outcome.result {
        let words = error.to_string().replace('\n', "\n  ");
        add(
            &mut text,
            format_args!("  FAIL  did not come to its end: {words}"),
        );
        return text;
    }
    let rows = outcome.rows();
    let longest = rows.iter().map(|row| row.quantity.chars().count()).max();
    let width = longest.unwrap_or(0).max(QUANTITY);
    add(
        &mut text,
        format_args!(
            "  {:width$}{:>VALUE$}{:>VALUE$}{:>VALUE$}{:>SMALL$}{:>SMALL$}",
            "", "native", "LIGGGHTS", "analytic", "difference", "tolerance"
        ),
    );
    for row in &rows {
        let verdict = match (row.pass, row.tolerance.is_finite()) {
            (true, true) => "ok",
            (true, false) => "reported",
            (false, _) => "FAIL",
        };
        add(
            &mut text,
            format_args!(
                "  {:width$}{:>VALUE$}{:>VALUE$}{:>VALUE$}{:>SMALL$}{:>SMALL$}  {verdict}",
                row.quantity,
                value(row.native),
                value(row.liggghts),
                value(row.analytic),
                small(row.difference),
                small(row.tolerance),
            ),
        );
        if explain || !row.pass {
            add(&mut text, format_args!("      {}{}", used(row), row.reason));
        }
    }
    text
}

/// How much of the tolerance is used.
fn used(row: &Row) -> String {
    let part = row.difference.abs() / row.tolerance;
    match part {
        part if !part.is_finite() || !row.tolerance.is_finite() => String::new(),
        part if part >= 10.0 => format!("{} times the tolerance: ", small(part)),
        part if part >= 1e-4 => format!("{} % of the tolerance used: ", significant(100.0 * part, 2)),
        _ => "less than 0.01 % of the tolerance used: ".to_string(),
    }
}

/// The last line.
pub fn summary(outcomes: &[Outcome], seconds: f64) -> String {
    let Score {
        passed,
        checks,
        reported,
    } = Score::of(outcomes);
    let more = match reported {
        0 => String::new(),
        count => format!(", {count} more only reported"),
    };
    format!("{passed} of {checks} checks passed{more}, {seconds:.1} s")
}

fn value(value: Option<f64>) -> String {
    match value {
        None => "-".to_string(),
        // Counts.
        Some(x) if x.abs() < 1e6 && x.fract() == 0.0 => format!("{x:.0}"),
        Some(x) if (1e-3..1e6).contains(&x.abs()) => significant(x, 8),
        Some(x) => format!("{x:.6e}"),
    }
}

fn small(value: f64) -> String {
    match value {
        x if x.is_nan() => "-".to_string(),
        0.0 => "0".to_string(),
        x if x.is_infinite() => "none".to_string(),
        x if (0.1..1000.0).contains(&x.abs()) => significant(x, 2),
        x => format!("{x:.1e}"),
    }
}

/// A number from a thousandth to a million with so many significant digits.
fn significant(value: f64, digits: i32) -> String {
    // The exponent of the number after rounding.
    let rounded = format!("{value:.*e}", (digits - 1) as usize);
    let exponent = rounded
        .split('e')
        .nth(1)
        .and_then(|text| text.parse::<i32>().ok());
    let before = exponent.unwrap_or(0) + 1;
    format!("{value:.*}", (digits - before).max(0) as usize)
}

fn add(text: &mut String, line: std::fmt::Arguments) {
    writeln!(text, "{line}").expect("memory takes any text");
}
