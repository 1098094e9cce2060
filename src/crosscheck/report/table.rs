//! The table on the terminal.

use super::{Outcome, Row, Score};
use crate::output::numbers::{significant, small, value};
use std::fmt::Write;

/// Width of the column of quantities, at least.
const QUANTITY: usize = 44;
/// Width of a column of values.
const VALUE: usize = 14;
/// Width of the columns of difference and tolerance.
const SMALL: usize = 11;

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

fn add(text: &mut String, line: std::fmt::Arguments) {
    writeln!(text, "{line}").expect("memory takes any text");
}
