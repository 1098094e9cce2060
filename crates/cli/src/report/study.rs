//! What is told of a study.

use super::find::Source;
use super::{Block, Section};
use crate::checks::{self, Check, Score};
use crate::study::document::Document;
use turbid::error::Result;
use turbid::output::numbers::duration;

pub(super) fn section(source: &Source) -> Result<Section> {
    Ok(of(&Document::read(&source.directory)?))
}

fn of(document: &Document) -> Section {
    let mut blocks = vec![Block::Text(head(document))];
    let score = Score::of_checks(&document.checks);
    let checks = [score.passed, score.checks];
    if !document.checks.is_empty() {
        blocks.push(Block::Heading("Checks".into()));
        blocks.push(Block::Text(format!("{score}.")));
        blocks.push(check_table(&document.checks));
    }
    if !document.figures.is_empty() {
        blocks.push(Block::Heading("Figures".into()));
    }
    blocks.extend(document.figures.iter().map(|figure| Block::Figure {
        name: figure.name.clone(),
        title: figure.chart.title.clone(),
        figure: Box::new(figure.chart.figure()),
        note: figure.chart.note.clone(),
    }));
    if !document.tables.is_empty() {
        blocks.push(Block::Heading("Tables".into()));
    }
    blocks.extend(document.tables.iter().map(|table| Block::Table {
        title: table.title.clone(),
        columns: table.columns.clone(),
        rows: table.rows.clone(),
    }));
    if !document.unsettled.is_empty() {
        blocks.push(Block::Heading("Means that have not settled".into()));
        blocks.push(Block::Text(format!(
            "The settling velocity still changes where the averages of these runs begin, or no end of its transient was found; \
             take a longer run or a later `run.average_from`: {}.",
            document.unsettled.join(", ")
        )));
    }
    let runs = document.runs;
    Section {
        title: document.title.clone(),
        row: vec![
            ("study", document.title.clone()),
            ("runs", format!("{} of {}", runs.done, runs.total)),
            ("time spent", duration(runs.seconds_spent)),
            ("checks passed", format!("{} of {}", checks[0], checks[1])),
        ],
        checks,
        blocks,
    }
}

fn head(document: &Document) -> String {
    let runs = document.runs;
    let left = if runs.done < runs.total {
        format!(", about {} left", duration(runs.seconds_left))
    } else {
        String::new()
    };
    format!(
        "Turbid {}, {} of {} runs done in {}{left}. Made again by\n\n```sh\n{}\n```",
        document.version,
        runs.done,
        runs.total,
        duration(runs.seconds_spent),
        document.command
    )
}

fn check_table(checks: &[Check]) -> Block {
    let row = |check: &Check| {
        let verdict = match (check.pass, check.is_reported()) {
            (_, true) => "",
            (true, _) => "pass",
            (false, _) => "**FAIL**",
        };
        let numbers = checks::cells(check);
        [vec![check.quantity.clone()], numbers.to_vec(), vec![verdict.to_string(), check.source.clone()]]
            .concat()
    };
    let columns = ["quantity", "measured", "reference", "deviation", "tolerance", "", "source"];
    Block::Table {
        title: String::new(),
        columns: columns.map(String::from).into(),
        rows: checks.iter().map(row).collect(),
    }
}
