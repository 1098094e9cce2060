//! The page.

use super::find::{Kind, Source};
use super::{Block, FIGURES, Section, figure_file};
use std::fmt::Write;
use turbid::output::picture::Format;

/// Everything on one page.
pub(super) fn page(name: &str, sources: &[Source], sections: &[Section], formats: &[Format]) -> String {
    let mut text = String::new();
    if let ([source], [section]) = (sources, sections) {
        add(&mut text, format_args!("# {}\n", section.title));
        blocks(&mut text, source, section, true, formats);
    } else {
        add(&mut text, format_args!("# {name}\n"));
        for kind in [Kind::Study, Kind::Run] {
            let of_kind = |pair: &(&Source, &Section)| pair.0.kind == kind;
            let rows: Vec<_> = sources.iter().zip(sections).filter(of_kind).collect();
            overview(&mut text, &rows);
        }
        for (source, section) in sources.iter().zip(sections) {
            add(&mut text, format_args!("## {}\n", heading(source, section)));
            blocks(&mut text, source, section, false, formats);
        }
    }
    add(&mut text, format_args!("Drawn by `turbid report`, version {}.", env!("CARGO_PKG_VERSION")));
    text
}

fn heading(source: &Source, section: &Section) -> String {
    if section.title == source.name {
        section.title.clone()
    } else {
        format!("{} (`{}`)", section.title, source.name)
    }
}

/// One row for each section of a kind.
fn overview(text: &mut String, sections: &[(&Source, &Section)]) {
    let Some((_, first)) = sections.first() else {
        return;
    };
    let columns: Vec<String> = first.row.iter().map(|(head, _)| (*head).to_string()).collect();
    let rows: Vec<Vec<String>> = (sections.iter())
        .map(|(_, section)| section.row.iter().map(|(_, value)| value.clone()).collect())
        .collect();
    table(text, &columns, &rows);
}

fn blocks(text: &mut String, source: &Source, section: &Section, alone: bool, formats: &[Format]) {
    let level = if alone { "##" } else { "###" };
    for block in &section.blocks {
        match block {
            Block::Heading(heading) => add(text, format_args!("{level} {heading}\n")),
            Block::Text(words) => add(text, format_args!("{words}\n")),
            Block::Table { title, columns, rows } => {
                if !title.is_empty() {
                    add(text, format_args!("{level}# {}\n", one_line(title)));
                }
                table(text, columns, rows);
            }
            Block::Figure { name, title, note, .. } => {
                let title = one_line(title);
                let file = |format| format!("{FIGURES}/{}", figure_file(source, name, alone, format));
                let shown = if formats.contains(&Format::Png) { Format::Png } else { Format::Svg };
                add(text, format_args!("{level}# {title}\n"));
                add(text, format_args!("![{title}]({})\n", file(shown)));
                let mut below = one_line(note);
                if shown == Format::Png && formats.contains(&Format::Svg) {
                    let space = if below.is_empty() { "" } else { " " };
                    let _ = write!(below, "{space}[SVG]({})", file(Format::Svg));
                }
                if !below.is_empty() {
                    add(text, format_args!("{below}\n"));
                }
            }
        }
    }
}

/// A table whose rows all have as many cells as its head.
fn table(text: &mut String, columns: &[String], rows: &[Vec<String>]) {
    let cell = |word: Option<&String>| one_line(word.map_or("", String::as_str)).replace('|', "\\|");
    let line = |cells: &[String]| {
        let cells: Vec<String> = (0..columns.len()).map(|i| cell(cells.get(i))).collect();
        format!("| {} |", cells.join(" | "))
    };
    add(text, format_args!("{}", line(columns)));
    add(text, format_args!("|{}", "---|".repeat(columns.len())));
    for row in rows {
        add(text, format_args!("{}", line(row)));
    }
    text.push('\n');
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn add(text: &mut String, line: std::fmt::Arguments) {
    writeln!(text, "{line}").expect("memory takes any text");
}
