//! Pages about runs and studies: the contents of a directory as figures, tables and checks.
//!
//! ```text
//! OUT/
//!   REPORT.md              everything on one page
//!   figures/NAME.svg       each figure it shows
//!   figures/NAME.png
//!   STUDY.csv              the runs of a study, if OUT is another directory
//! ```
//!
//! A directory is that of a run (`summary.json`, `series.csv`), of a study (`study.json`), or one that holds several of them one
//! level down. Files of earlier reports are replaced, and no others are touched.

mod run;
mod section;
mod study;

use crate::checks::{markdown_table, prepare};
use crate::study::document::{FILE as STUDY, RESULT};
use section::Section;
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::picture::{Format, write_figure};
use turbid::output::{OutputFiles, write_bytes};

/// Name of the page.
pub const FILE: &str = "REPORT.md";
/// Folder of the figures beside it.
const FIGURES: &str = "figures";

/// Contents of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Path of the page.
    pub page: PathBuf,
    /// Number of figures.
    pub figures: usize,
    /// Checks that passed, and all of them.
    pub checks: [usize; 2],
}

/// A directory that can be drawn.
struct Source {
    directory: PathBuf,
    /// Last part of its path.
    name: String,
    is_study: bool,
}

/// Draws the contents of `directory` into `out`, figures in the given formats.
///
/// # Errors
/// [`Error::Input`] if there is nothing to draw, or a file is not of its kind; [`Error::Io`] if one cannot be read or written.
pub fn report(directory: &Path, out: &Path, formats: &[Format]) -> Result<Report> {
    let sources = sources(directory)?;
    let is_alone = sources.len() == 1;
    let mut sections = Vec::new();
    for source in &sources {
        let mut section = Section::new(&source.name, is_alone, formats);
        if source.is_study {
            study::describe(&mut section, source)?;
        } else {
            run::describe(&mut section, source)?;
        }
        sections.push(section);
    }
    prepare(&out.join(FIGURES))?;
    for (source, section) in sources.iter().zip(&mut sections).filter(|(source, _)| source.is_study) {
        let from = source.directory.join(RESULT);
        if out != directory && from.is_file() {
            let bytes =
                input::read_unlinked(&from, input::TABLE).map_err(|error| Error::io("read", &from, error))?;
            let name = format!("{}.csv", section::plain(&source.name));
            write_bytes(&out.join(&name), &bytes)?;
            section.text(&format!("All runs: [{name}]({name})."));
        }
    }
    let figures = sections.iter().flat_map(|section| &section.figures);
    for (stem, figure) in figures.clone() {
        for &format in formats {
            let file = format!("{stem}.{}", format.extension());
            write_figure(&out.join(FIGURES).join(file), figure, format)?;
        }
    }
    let path = out.join(FILE);
    write_bytes(&path, page(&name(directory), &sources, &sections).as_bytes())?;
    let checks = [0, 1].map(|which| sections.iter().map(|section| section.checks[which]).sum());
    Ok(Report { page: path, figures: figures.count(), checks })
}

/// Reads a file of JSON.
fn read_json<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<T> {
    let text = input::read_text(path, input::RECORD).map_err(|source| Error::io("read", path, source))?;
    serde_json::from_str(&text).map_err(|error| {
        let path = path.display();
        Error::Input(format!("{path}: {error}\n  it is damaged, or of another version; {remedy}"))
    })
}

/// Everything on one page; of several sections with tables of all studies and of all runs at its head.
fn page(name: &str, sources: &[Source], sections: &[Section]) -> String {
    let last = format!("Drawn by `turbid report`, version {}.\n", env!("CARGO_PKG_VERSION"));
    if let [section] = sections {
        return format!("# {}\n\n{}{last}", section.title, section.markdown);
    }
    let mut parts = vec![format!("# {name}\n\n")];
    for is_study in [true, false] {
        let pairs = sources.iter().zip(sections).filter(|(source, _)| source.is_study == is_study);
        let rows: Vec<_> = pairs.map(|(_, section)| &section.row).collect();
        if let Some(first) = rows.first() {
            let heads: Vec<&str> = first.iter().map(|(head, _)| *head).collect();
            let cells = rows.iter().map(|row| row.iter().map(|(_, value)| value.clone()).collect());
            parts.push(markdown_table(&heads, &cells.collect::<Vec<_>>()) + "\n");
        }
    }
    for (source, section) in sources.iter().zip(sections) {
        let same = section.title == source.name;
        let of = if same { String::new() } else { format!(" (`{}`)", source.name) };
        parts.push(format!("## {}{of}\n\n{}", section.title, section.markdown));
    }
    parts.push(last);
    parts.concat()
}

/// The run or study in `directory`, or those in the directories in it, by name.
fn sources(directory: &Path) -> Result<Vec<Source>> {
    let list = fs::read_dir(directory).map_err(|source| Error::io("read", directory, source))?;
    if let Some(source) = source(directory) {
        return Ok(vec![source]);
    }
    let mut below = Vec::new();
    for entry in list {
        let entry = entry.map_err(|source| Error::io("read", directory, source))?;
        below.extend(source(&entry.path()));
    }
    below.sort_by(|a, b| a.name.cmp(&b.name));
    if below.is_empty() {
        return Err(Error::Input(format!(
            "nothing to report: {} holds neither a run (summary.json, series.csv) nor a study ({STUDY}), and no directory in it does\n  \
             give the output directory of `turbid run` or `turbid study`, or one that holds several of them",
            directory.display()
        )));
    }
    Ok(below)
}

fn source(directory: &Path) -> Option<Source> {
    let files = OutputFiles::new(directory);
    let is_study = directory.join(STUDY).is_file();
    let found = is_study || files.summary().is_file() || files.series().is_file();
    found.then(|| Source { directory: directory.to_path_buf(), name: name(directory), is_study })
}

/// The last part of a directory's path, also of `.`.
fn name(directory: &Path) -> String {
    let whole = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_path_buf());
    whole.file_name().map_or_else(|| "report".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests;
