//! Pages about runs and studies: what a directory holds, as figures, tables and checks.
//!
//! ```text
//! OUT/
//!   REPORT.md              everything on one page
//!   figures/NAME.svg       each figure it shows
//!   figures/NAME.png
//!   STUDY.csv              what the runs of a study found, if OUT is another directory
//! ```
//!
//! A directory is that of a run (`summary.json`, `series.csv`), of a study (`study.json`), or one that holds several of them one
//! level down. Files of earlier reports are replaced, and no others are touched.

mod find;
mod markdown;
mod run;
mod study;

use crate::study::result::FILE as RESULT;
use find::{Kind, Source};
use std::fs;
use std::path::{Path, PathBuf};
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::picture::{Figure, Format, write_figure};
use turbid::output::write_bytes;

/// Name of the page.
pub const FILE: &str = "REPORT.md";
/// Folder of the figures beside it.
const FIGURES: &str = "figures";

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The page.
    pub page: PathBuf,
    /// Runs and studies on it.
    pub sections: usize,
    /// Figures on it.
    pub figures: usize,
    /// Checks on it that passed, and all of them.
    pub checks: [usize; 2],
}

/// What is told of one run or study.
#[derive(Debug, Default)]
struct Section {
    title: String,
    /// Numbers of this section in the table at the head of a page with several: heads and values, the same for all of a kind.
    row: Vec<(&'static str, String)>,
    /// Checks that passed, and all of them.
    checks: [usize; 2],
    blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Debug)]
enum Block {
    /// A heading within the section.
    Heading(String),
    /// Markdown.
    Text(String),
    Table {
        title: String,
        columns: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    Figure {
        name: String,
        title: String,
        figure: Box<Figure>,
        note: String,
    },
}

/// Draws what `directory` holds into `out`, figures in the given formats.
///
/// # Errors
/// [`Error::Input`] if there is nothing to draw, or a file is not what its name says; [`Error::Io`] if one cannot be read or written.
pub fn report(directory: &Path, out: &Path, formats: &[Format]) -> Result<Report> {
    let sources = find::sources(directory)?;
    let mut sections = Vec::new();
    for source in &sources {
        sections.push(section(source, sources.len() == 1)?);
    }
    prepare(out)?;
    if out != directory {
        for (source, section) in sources.iter().zip(&mut sections) {
            section.blocks.extend(rows(source, out)?);
        }
    }
    let alone = sections.len() == 1;
    let mut figures = 0;
    for (source, section) in sources.iter().zip(&sections) {
        for block in &section.blocks {
            let Block::Figure { name, figure, .. } = block else {
                continue;
            };
            for &format in formats {
                let file = figure_file(source, name, alone, format);
                write_figure(&out.join(FIGURES).join(file), figure, format)?;
            }
            figures += 1;
        }
    }
    let page = markdown::page(&find::name(directory), &sources, &sections, formats);
    let path = out.join(FILE);
    write_bytes(&path, page.as_bytes())?;
    let sum = |which: usize| sections.iter().map(|section| section.checks[which]).sum();
    Ok(Report { page: path, sections: sections.len(), figures, checks: [sum(0), sum(1)] })
}

fn section(source: &Source, alone: bool) -> Result<Section> {
    match source.kind {
        Kind::Run => run::section(source, alone),
        Kind::Study => study::section(source),
    }
}

/// The rows of a study beside a page that is elsewhere, and what the page says of them.
fn rows(source: &Source, out: &Path) -> Result<Option<Block>> {
    let from = source.directory.join(RESULT);
    if source.kind != Kind::Study || !from.is_file() {
        return Ok(None);
    }
    let bytes =
        input::read_unlinked(&from, input::TABLE).map_err(|source| Error::io("read", &from, source))?;
    let name = format!("{}.csv", plain(&source.name));
    write_bytes(&out.join(&name), &bytes)?;
    Ok(Some(Block::Text(format!("All runs: [{name}]({name})."))))
}

fn prepare(out: &Path) -> Result<()> {
    let folder = out.join(FIGURES);
    fs::create_dir_all(&folder).map_err(|source| {
        Error::Input(format!(
            "cannot write to {}: {source}\n  choose another directory with --out DIR",
            folder.display()
        ))
    })
}

/// Name of the file of a figure, without its folder.
fn figure_file(source: &Source, name: &str, alone: bool, format: Format) -> String {
    let before = if alone { String::new() } else { format!("{}_", plain(&source.name)) };
    format!("{before}{}.{}", plain(name), format.extension())
}

/// Of a name what a file may be called.
fn plain(text: &str) -> String {
    let keep = |c: char| {
        if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }
    };
    text.chars().map(keep).collect()
}

#[cfg(test)]
mod tests;
