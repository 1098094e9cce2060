//! The files in an output directory that have the name of a file of a run.

use super::{Kind, LOGS, Numbered, SCRIPT, folders, numbered, top};
use crate::input;
use crate::output::atomic::PARTIAL_SUFFIX;
use crate::output::pieces;
use std::fs::{self, FileType};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A file of a run, or the folder of the pieces of one.
pub(super) struct Own {
    pub(super) path: PathBuf,
    /// The file that it is, or is a piece, an index or the folder of.
    pub(super) of: PathBuf,
    /// The step of that file, if it is numbered.
    pub(super) step: Option<u64>,
    /// True if it was being written.
    pub(super) partial: bool,
    pub(super) folder: bool,
}

impl Own {
    /// Its path in the output directory.
    pub(super) fn below<'a>(&'a self, directory: &Path) -> &'a Path {
        self.path.strip_prefix(directory).unwrap_or(&self.path)
    }
}

/// Removes files, and folders that are empty then. A symbolic link is removed itself.
pub(super) fn remove(all: Vec<Own>) -> io::Result<()> {
    for own in all {
        let removed = if own.folder { fs::remove_dir(&own.path) } else { fs::remove_file(&own.path) };
        match removed {
            Err(error) if own.folder && error.kind() == io::ErrorKind::DirectoryNotEmpty => {}
            removed => removed?,
        }
    }
    Ok(())
}

/// The first symbolic link among the names in the output directory itself.
pub(super) fn link(directory: &Path, more: &[Kind]) -> Option<PathBuf> {
    let files = top(more).into_iter().chain(LOGS.map(str::to_string));
    let mut names = files
        .flat_map(|name| [format!("{name}{PARTIAL_SUFFIX}"), name])
        .chain(folders(more).map(str::to_string))
        .map(|name| directory.join(name));
    names.find(|path| fs::symlink_metadata(path).is_ok_and(|file| file.is_symlink()))
}

/// Those of the files directly in the directory that are there, finished or partial.
pub(super) fn there(directory: &Path, names: &[impl AsRef<str>]) -> Vec<Own> {
    let mut there = Vec::new();
    for name in names.iter().map(AsRef::as_ref) {
        let of = directory.join(name);
        for (path, partial) in
            [(of.clone(), false), (directory.join(format!("{name}{PARTIAL_SUFFIX}")), true)]
        {
            if fs::symlink_metadata(&path).is_ok_and(|file| !file.is_dir()) {
                there.push(Own { path, of: of.clone(), step: None, partial, folder: false });
            }
        }
    }
    there
}

/// All files of a run but its log, finished or partial, whole or in pieces; the folder of pieces behind them.
pub(super) fn all(directory: &Path, more: &[Kind]) -> io::Result<Vec<Own>> {
    let mut all = there(directory, &top(more));
    all.retain(|own| own.partial || !own.of.ends_with(SCRIPT) || is_own_script(&own.path));
    for kind in numbered(more) {
        all.extend(frames(directory, kind)?);
    }
    Ok(all)
}

/// Beginning of the script of a run.
const SCRIPT_HEAD: &[u8] = b"\"\"\"Opens the results of the run in this folder in ParaView";

/// Returns true for a script of a run, of any version; its name is a usual one, and a user may have given it to another file.
pub(super) fn is_own_script(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = input::open_unlinked(path)
        .and_then(|file| file.take(SCRIPT_HEAD.len() as u64).read_to_end(&mut head));
    read.is_ok() && head == SCRIPT_HEAD
}

/// Returns true for the digits of a step behind a name that may be anybody's: ten, or eleven that need as many. No run takes more steps;
/// dates and times have twelve digits or more.
fn is_step(digits: &str) -> bool {
    digits.len() == 10 || digits.len() == 11 && !digits.starts_with('0')
}

/// The files of a kind, as [`all`].
pub(super) fn frames(directory: &Path, kind: Numbered) -> io::Result<Vec<Own>> {
    let mut there = Vec::new();
    let Numbered { folder, prefix, extension } = kind;
    let folder = directory.join(folder);
    if !folder.is_dir() {
        return Ok(there);
    }
    let index = extension.replacen('.', ".p", 1);
    let mut add = |path: PathBuf, frame: &str, partial: bool, kind: FileType| {
        let digits = match prefix {
            "" => frame.rsplit_once('_').map(|(_, digits)| digits).filter(|digits| is_step(digits)),
            prefix => frame.strip_prefix(prefix),
        };
        let step = Some(digits.filter(|digits| pieces::is_number(digits))?.parse().ok()?);
        there.push(Own {
            path,
            of: folder.join(format!("{frame}{extension}")),
            step,
            partial,
            folder: kind.is_dir(),
        });
        Some(())
    };
    for (path, name, partial, kind) in entries(&folder)? {
        let frame = name.strip_suffix(extension).or_else(|| name.strip_suffix(&index));
        match frame {
            Some(frame) if !kind.is_dir() => {
                add(path, frame, partial, kind);
            }
            _ if kind.is_file() => {}
            // A folder of pieces, or a link to one, which nothing must be written through.
            _ => {
                let pieces = if kind.is_dir() { entries(&path)? } else { Vec::new() };
                for (piece, of, partial, kind) in pieces {
                    if !kind.is_dir() && pieces::is_piece(&of, &name, extension) {
                        add(piece, &name, partial, kind);
                    }
                }
                add(path, &name, false, kind);
            }
        }
    }
    Ok(there)
}

/// Contents of a folder: paths, final names, whether they are partial, and their kinds.
fn entries(folder: &Path) -> io::Result<Vec<(PathBuf, String, bool, FileType)>> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        let last = name.strip_suffix(PARTIAL_SUFFIX);
        let (partial, last) = (last.is_some(), last.unwrap_or(&name).to_string());
        all.push((entry.path(), last, partial, entry.file_type()?));
    }
    Ok(all)
}
