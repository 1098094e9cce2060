//! What a directory holds.

use crate::study::document;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::error::{Error, Result};
use turbid::output::OutputFiles;

/// A directory that can be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Source {
    pub(super) directory: PathBuf,
    /// Its last part.
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Run,
    Study,
}

/// What is in `directory`, or in the directories in it, by name.
pub(super) fn sources(directory: &Path) -> Result<Vec<Source>> {
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
            "nothing to report: {} holds neither a run (summary.json, series.csv) nor a study ({}), and no directory in it does\n  \
             give the output directory of `turbid run` or `turbid study`, or one that holds several of them",
            directory.display(),
            document::FILE
        )));
    }
    Ok(below)
}

fn source(directory: &Path) -> Option<Source> {
    let files = OutputFiles::new(directory);
    let kind = if directory.join(document::FILE).is_file() {
        Kind::Study
    } else if files.summary().is_file() || files.series().is_file() {
        Kind::Run
    } else {
        return None;
    };
    Some(Source { directory: directory.to_path_buf(), name: name(directory), kind })
}

/// The last part of a directory's path, also of `.`.
pub(super) fn name(directory: &Path) -> String {
    let whole = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_path_buf());
    whole.file_name().map_or_else(|| "report".into(), |name| name.to_string_lossy().into_owned())
}
