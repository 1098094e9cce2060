//! Checks as tables on the terminal and in markdown.

use super::{Check, Ending, Outcome, Score};
use std::fmt::Write;
use turbid::output::numbers::{self, significant, small};

/// One case: a line for each check, with the part of its tolerance that is used and its reason if it fails, or for all if
/// `explain`; then numbers without a reference.
pub fn table(outcome: &Outcome, explain: bool) -> String {
    let text = format!("{}: {}", outcome.case, outcome.title);
    let found = match &outcome.ending {
        Ending::Missing(why) => return format!("{text}\n  not available, not counted: {why}\n"),
        Ending::Stopped => return format!("{text}\n  stopped before its end\n"),
        Ending::Failed(error) => {
            let words = error.to_string().replace('\n', "\n  ");
            return format!("{text}\n  FAIL  did not complete: {words}\n");
        }
        Ending::Found(found) => found,
    };
    let heads: &[&str] = match outcome.engine {
        Some(engine) => &["", "native", engine.label, "analytic", "difference", "tolerance"],
        None => &["", "measured", "reference", "deviation", "tolerance"],
    };
    let mut rows = vec![heads.iter().map(ToString::to_string).collect()];
    rows.extend(found.checks.iter().map(|check| {
        let cells = match check.engines {
            Some(values) => (values.iter().map(|x| numbers::number(x.unwrap_or(f64::NAN), 8)))
                .chain([check.measured, check.tolerance].map(small))
                .collect(),
            None => cells(check).to_vec(),
        };
        [vec![check.quantity.clone()], cells].concat()
    }));
    rows.extend(found.notes.iter().map(|(quantity, value)| vec![quantity.clone(), number(*value)]));
    let mut text = format!("{text} ({:.1} s)\n", outcome.seconds);
    for (at, line) in aligned(&rows).into_iter().enumerate() {
        let check = at.checked_sub(1).and_then(|at| found.checks.get(at));
        let verdict = check.map_or_else(String::new, |check| format!("  {}", check.verdict()));
        let _ = writeln!(text, "  {line}{verdict}");
        if let Some(check) = check.filter(|check| outcome.engine.is_some() && (explain || !check.pass)) {
            let _ = writeln!(text, "      {}{}", used(check), check.source);
        }
    }
    text
}

/// Rows of cells in columns: the first one begins at the left, all others end below each other.
pub fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cells = |k: usize| rows.iter().filter_map(move |row| row.get(k));
    let width = |k: usize| cells(k).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(k, (cell, &width))| match k {
            0 => format!("{cell:width$}"),
            _ => format!("{cell:>0$}", width + 2),
        });
        cells.collect()
    };
    rows.iter().map(line).collect()
}

/// Part of the tolerance that is used, in words.
fn used(check: &Check) -> String {
    let part = (check.measured - check.reference).abs() / check.tolerance;
    match part {
        part if !part.is_finite() || !check.tolerance.is_finite() => String::new(),
        part if part >= 10.0 => format!("{} times the tolerance: ", small(part)),
        part if part >= 1e-4 => format!("{} % of the tolerance used: ", significant(100.0 * part, 2)),
        _ => "less than 0.01 % of the tolerance used: ".to_string(),
    }
}

/// Measured value, reference, deviation and tolerance; the latter two as parts of the reference where it is not zero.
pub fn cells(check: &Check) -> [String; 4] {
    let Check { measured, reference, tolerance, .. } = *check;
    let off = measured - reference;
    let part = 100.0 * tolerance / reference.abs();
    let (deviation, allowed) = if (1e-3..1000.0).contains(&part) {
        let deviation = format!("{:+.2} %", 100.0 * off / reference.abs());
        (deviation, format!("{} %", small(part)))
    } else if off.is_nan() {
        ("-".to_string(), small(tolerance))
    } else {
        (format!("{off:+.1e}"), small(tolerance))
    };
    [number(measured), number(reference), deviation, allowed]
}

fn number(x: f64) -> String {
    numbers::number(x, 5)
}

/// The last line, about all cases together.
pub fn summary(outcomes: &[Outcome], seconds: f64) -> String {
    let score = Score::of(outcomes);
    let mut text = score.to_string();
    if score.reported > 0 {
        let _ = write!(text, ", {} more only reported", score.reported);
    }
    for (count, what) in [(score.missing, "not available"), (score.interrupted, "stopped before the end")] {
        let _ = match count {
            0 => Ok(()),
            1 => write!(text, ", one case {what}"),
            count => write!(text, ", {count} cases {what}"),
        };
    }
    let _ = write!(text, ", {seconds:.1} s");
    text
}

pub fn markdown(checks: &[Check]) -> String {
    let columns = ["case", "quantity", "measured", "reference", "deviation", "tolerance", ""];
    let row = |check: &Check| {
        let names = [check.case.clone(), check.quantity.clone()];
        names.into_iter().chain(cells(check)).chain([bold_failure(check)]).collect()
    };
    let rows: Vec<Vec<String>> = checks.iter().map(row).collect();
    let score = Score::of_checks(checks);
    format!("Turbid {}: {score}.\n\n{}", env!("CARGO_PKG_VERSION"), markdown_table(&columns, &rows))
}

pub fn bold_failure(check: &Check) -> String {
    if check.pass { check.verdict().to_string() } else { format!("**{}**", check.verdict()) }
}

/// A table in markdown; missing cells at the end of a row are empty.
pub fn markdown_table(columns: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let cells: Vec<String> = cells.map(|cell| one_line(cell).replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let head = line(&mut columns.iter().copied());
    let rows = rows.iter().map(|row| {
        let cells = row.iter().map(String::as_str).chain(std::iter::repeat(""));
        line(&mut cells.take(columns.len()))
    });
    format!("{head}|{}\n{}", "---|".repeat(columns.len()), rows.collect::<String>())
}

pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
