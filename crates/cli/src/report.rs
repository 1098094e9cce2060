//! Pages about runs and studies: the contents of a directory as figures, tables and checks.
//!
//! ```text
//! OUT/
//!   REPORT.md              everything on one page
//!   report.html            the same, with pictures, all runs and values under the pointer, in one file
//!   figures/NAME.svg       each figure it shows
//!   figures/NAME.png
//!   STUDY.csv              the runs of a study, if OUT is another directory
//! ```
//!
//! A directory is that of a run (`summary.json`, `series.csv`), of a study (`study.json`), or one that holds several of them one
//! level down. Files of earlier reports are replaced, and no others are touched.

mod files;
mod film;
mod html;
mod markdown;
mod run;
mod section;
mod study;

pub(crate) use film::{PICTURE, films};
pub(crate) use html::shell;
use section::{Block, Section};
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::numbers;
use turbid::output::picture::{Format, write_figure};
use turbid::output::{OutputFiles, SeriesColumn, SeriesTable, write_bytes};
use turbid_lab::checks::prepare;
use turbid_lab::study::document::{FILE as STUDY, RESULT};

/// Names of the pages.
pub const FILE: &str = "REPORT.md";
const HTML: &str = "report.html";
/// Folder of the figures beside it.
const FIGURES: &str = "figures";
/// Most bytes of pictures in `report.html`.
const PICTURES: u64 = 16 << 20;

/// Contents of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Path of the page in markdown.
    pub page: PathBuf,
    /// Path of the page in HTML.
    pub html: PathBuf,
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
    /// Path from the page to the directory, empty or with a slash at its end; none if it is not below the page.
    from_page: Option<String>,
}

/// Draws the contents of `directory` into `out`, figures in the given formats.
///
/// # Errors
/// [`Error::Input`] if there is nothing to draw, or a file is not of its kind; [`Error::Io`] if one cannot be read or written.
pub fn report(directory: &Path, out: &Path, formats: &[Format]) -> Result<Report> {
    let mut sources = sources(directory)?;
    for source in &mut sources {
        source.from_page = from_page(out, &source.directory);
    }
    let (mut left, mut behind) = (PICTURES, sources.len() as u64);
    let is_alone = sources.len() == 1;
    let mut sections = Vec::new();
    for source in &sources {
        let mut section = Section::new(&source.name, is_alone, formats);
        if source.is_study {
            study::describe(&mut section, source)?;
        } else {
            run::describe(&mut section, source, left / behind, &mut left)?;
        }
        behind -= 1;
        sections.push(section);
    }
    let folder = out.join(FIGURES);
    if folder.is_symlink() {
        return Err(Error::Input(format!(
            "{} is a symbolic link, and a report writes files of its own there\n  remove the link, or choose another directory with \
             --out DIR",
            folder.display()
        )));
    }
    prepare(&folder)?;
    for (source, section) in sources.iter().zip(&mut sections).filter(|(source, _)| source.is_study) {
        let from = source.directory.join(RESULT);
        if out != directory && from.is_file() {
            let bytes =
                input::read_unlinked(&from, input::TABLE).map_err(|error| Error::io("read", &from, error))?;
            let name = format!("{}.csv", section::plain(&source.name));
            write_bytes(&out.join(&name), &bytes)?;
            section.blocks.push(Block::Link("All runs".to_string(), name));
        }
    }
    for (source, section) in sources.iter().zip(&mut sections) {
        if let Some(list) = files::list(source) {
            section.blocks.push(Block::Html("Files", list));
        }
    }
    let figures = sections.iter().flat_map(Section::figures);
    for (stem, figure) in figures.clone() {
        for &format in formats {
            let file = format!("{stem}.{}", format.extension());
            write_figure(&out.join(FIGURES).join(file), figure, format)?;
        }
    }
    let path = out.join(FILE);
    let (name, html) = (name(directory), out.join(HTML));
    write_bytes(&path, page(&name, &sources, &sections).as_bytes())?;
    let title = if is_alone { &sections[0].title } else { &name };
    write_bytes(&html, html::page(title, &overviews(&sources, &sections), &sections).as_bytes())?;
    let checks = [0, 1].map(|which| sections.iter().map(|section| section.checks[which]).sum());
    Ok(Report { page: path, html, figures: figures.count(), checks })
}

/// The curves of a run so far, for a page that shows them while they grow.
#[derive(Debug, Default)]
pub(crate) struct Curves {
    /// Figures in HTML.
    pub(crate) figures: String,
    /// The newest row in HTML.
    pub(crate) newest_row: String,
    /// Names and numbers of the newest row.
    pub(crate) newest: Vec<(String, f64)>,
}

/// Draws the curves of the run in `directory`, which has this title, or says why it cannot.
pub(crate) fn curves(directory: &Path, title: &str) -> Result<Curves> {
    let series = SeriesTable::read(&OutputFiles::new(directory).series())?;
    let mut section = Section::new(title, true, &[]);
    run::figures::all(&mut section, &series, None);
    let last = || {
        let newest = series.columns.iter().filter_map(|column| Some((column, *column.values.last()?)));
        newest.filter(|(_, value)| !value.is_nan())
    };
    let row = |(column, value): (&SeriesColumn, f64)| {
        vec![column.name.replace('_', " "), numbers::number(value, 5), column.unit.clone()]
    };
    let rows: Vec<_> = last().map(row).collect();
    let table = html::table(&["quantity", "value", "unit"], &rows, &[], false);
    Ok(Curves {
        figures: html::blocks(&section, "curve"),
        newest_row: format!("<h2>Newest row of series.csv</h2>\n{table}"),
        newest: last().map(|(column, value)| (column.name.clone(), value)).collect(),
    })
}

/// Reads a file of JSON.
fn read_json<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<T> {
    let bytes =
        input::read_unlinked(path, input::RECORD).map_err(|source| Error::io("read", path, source))?;
    serde_json::from_slice(&bytes).map_err(|error| {
        let path = path.display();
        Error::Input(format!("{path}: {error}\n  it is damaged, or of another version; {remedy}"))
    })
}

/// Everything on one page; of several sections with tables of all studies and of all runs at its head.
fn page(name: &str, sources: &[Source], sections: &[Section]) -> String {
    let last = format!("Drawn by `turbid report`, version {}.\n", env!("CARGO_PKG_VERSION"));
    if let [section] = sections {
        return format!("# {}\n\n{}{last}", markdown::inline(&section.title), section.markdown());
    }
    let mut parts = vec![format!("# {}\n\n", markdown::inline(name))];
    for (heads, rows) in overviews(sources, sections) {
        parts.push(section::table(&heads, &rows) + "\n");
    }
    for (source, section) in sources.iter().zip(sections) {
        let same = section.title == source.name;
        let of = if same { String::new() } else { format!(" (`{}`)", source.name.replace('`', "'")) };
        let title = markdown::inline(&(section.title.clone() + &of));
        parts.push(format!("## {title}\n\n{}", section.markdown()));
    }
    parts.push(last);
    parts.concat()
}

/// Heads and rows of the tables of all studies and of all runs; none if there is only one of them.
fn overviews<'a>(sources: &[Source], sections: &'a [Section]) -> Vec<(Vec<&'a str>, Vec<Vec<String>>)> {
    let of_kind = |is_study: bool| {
        let pairs = sources.iter().zip(sections).filter(move |(source, _)| source.is_study == is_study);
        let rows: Vec<_> = pairs.map(|(_, section)| &section.row).collect();
        let heads = rows.first()?.iter().map(|(head, _)| *head).collect();
        let cells = rows.iter().map(|row| row.iter().map(|(_, value)| value.clone()).collect());
        Some((heads, cells.collect()))
    };
    let kinds = [true, false].into_iter().filter(|_| sections.len() > 1);
    kinds.filter_map(of_kind).collect()
}

/// Path from a page in `out` to a directory, empty or with a slash at its end; none if it is not below.
fn from_page(out: &Path, directory: &Path) -> Option<String> {
    let [out, directory] = [out, directory].map(fs::canonicalize);
    let below = directory.ok()?.strip_prefix(out.ok()?).ok()?.to_str()?.to_string();
    Some(if below.is_empty() { below } else { below + "/" })
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
    found.then(|| Source {
        directory: directory.to_path_buf(),
        name: name(directory),
        is_study,
        from_page: None,
    })
}

/// The last part of a directory's path, also of `.`.
pub(crate) fn name(directory: &Path) -> String {
    let whole = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_path_buf());
    whole.file_name().map_or_else(|| "report".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests;
