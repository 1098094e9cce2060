//! The section about a study.

use super::section::Section;
use super::{Source, read_json};
use crate::checks::{Check, Score, bold_failure, cells};
use crate::study::document::{Document, FILE};
use turbid::error::Result;
use turbid::output::numbers::duration;

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
        "Turbid {}, {} of {} runs done in {spent}{left}. Made again by\n\n```sh\n{}\n```",
        document.version, runs.done, runs.total, document.command
    ));
    if !document.checks.is_empty() {
        section.heading("Checks");
        section.text(&format!("{score}."));
        let columns = ["quantity", "measured", "reference", "deviation", "tolerance", "", "source"];
        section.table("", &columns, &document.checks.iter().map(row).collect::<Vec<_>>());
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
        section.table(&table.title, &columns, &table.rows);
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

fn row(check: &Check) -> Vec<String> {
    let [measured, reference, deviation, tolerance] = cells(check);
    let (quantity, source) = (check.quantity.clone(), check.source.clone());
    vec![quantity, measured, reference, deviation, tolerance, bold_failure(check), source]
}
