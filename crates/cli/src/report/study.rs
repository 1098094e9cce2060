//! The section about a study.

use super::section::{Block, Section};
use super::{Source, html, read_json};
use turbid::error::Result;
use turbid::input;
use turbid::output::numbers::{self, duration};
use turbid_lab::checks::{Check, Score, bold_failure, cells};
use turbid_lab::study::document::{Document, FILE, RESULT};

/// Largest table of runs that is shown (bytes).
const RUNS: u64 = 16 << 20;

pub(super) fn describe(section: &mut Section, source: &Source) -> Result<()> {
    let document: Document = read_json(&source.directory.join(FILE), "`turbid study` writes it anew")?;
    let (runs, score) = (document.runs, Score::of_checks(&document.checks));
    let spent = duration(runs.seconds_spent);
    section.title.clone_from(&document.title);
    section.checks = [score.passed, score.checks];
    section.row = vec![
        ("study", document.title.clone()),
        ("runs", format!("{} of {}", runs.done, runs.total)),
        ("time spent", spent.clone()),
        ("checks passed", format!("{} of {}", score.passed, score.checks)),
    ];
    let is_open = runs.done < runs.total;
    let left = if is_open { format!(", about {} left", duration(runs.seconds_left)) } else { String::new() };
    section.text(&format!(
        "Turbid {}, {} of {} runs done in {spent}{left}. Made again by",
        document.version, runs.done, runs.total
    ));
    section.blocks.push(Block::Code("sh", document.command));
    if !document.checks.is_empty() {
        section.heading("Checks");
        section.text(&format!("{score}."));
        let columns = ["quantity", "measured", "reference", "deviation", "tolerance", "", "source"];
        section.table("", &columns, document.checks.iter().map(row).collect());
    }
    if let Some(runs) = runs_table(source) {
        section.blocks.push(Block::Html("Runs", runs));
    }
    if !document.figures.is_empty() {
        section.heading("Figures");
    }
    for figure in &document.figures {
        let chart = &figure.chart;
        section.figure(&figure.name, &chart.title, chart.figure(), &chart.note);
    }
    if !document.tables.is_empty() {
        section.heading("Tables");
    }
    for table in &document.tables {
        let columns: Vec<&str> = table.columns.iter().map(String::as_str).collect();
        section.table(&table.title, &columns, table.rows.clone());
        if !table.note.is_empty() {
            section.text(&table.note);
        }
    }
    if !document.unsettled.is_empty() {
        section.heading("Means that have not settled");
        section.text(&format!(
            "The settling velocity still changes where the averages of these runs begin, or no end of its transient was found; \
             take a longer run or a later `run.average_from`: {}.",
            document.unsettled.join(", ")
        ));
    }
    Ok(())
}

/// The table of all runs with filters, each with a link to its folder; none if it cannot be read.
fn runs_table(source: &Source) -> Option<String> {
    let bytes = input::read_unlinked(&source.directory.join(RESULT), RUNS).ok()?;
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(&bytes[..]);
    let columns: Vec<String> = reader.headers().ok()?.iter().map(|name| name.replace('_', " ")).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    // Numbers get five digits, without zeros at their end; names and versions stay.
    let cell = |cell: &str| match cell.parse::<f64>() {
        Ok(value) if value != 0.0 && value.abs() < 1e-3 => numbers::number(value, 5),
        Ok(value) if cell.contains('.') => {
            format!("{value:.4e}").parse().map_or_else(|_| cell.to_string(), |short: f64| short.to_string())
        }
        _ => cell.to_string(),
    };
    let rows = reader.records().map(|row| row.ok().map(|row| row.iter().map(cell).collect()));
    let rows: Vec<Vec<String>> = rows.collect::<Option<_>>()?;
    let address = |row: &Vec<String>| {
        let name = row.first()?;
        let from = source.from_page.as_ref().filter(|_| source.directory.join(name).is_dir())?;
        Some(format!("{from}{name}/"))
    };
    let addresses: Vec<Option<String>> = rows.iter().map(address).collect();
    (!rows.is_empty()).then(|| html::table(&columns, &rows, &addresses, true))
}

fn row(check: &Check) -> Vec<String> {
    let [measured, reference, deviation, tolerance] = cells(check);
    let (quantity, source) = (check.quantity.clone(), check.source.clone());
    vec![quantity, measured, reference, deviation, tolerance, bold_failure(check), source]
}
