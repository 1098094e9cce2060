//! The folder of checkpoints: the entries that belong to a run, and their removal.

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// A checkpoint under a final name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Steps done when it was written.
    pub step: u64,
    /// Its directory.
    pub path: PathBuf,
}

/// Suffixes behind the step: of a checkpoint that is being written or removed, of a whole one that makes way for another of the same
/// step, and of all others.
const PARTIAL: &str = ".partial";
const REPLACED: &str = ".replaced";
const WHOLE: &str = "";

pub(super) fn name(step: u64) -> String {
    format!("step-{step:010}")
}

/// The last part of a path.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Folder in which the checkpoint of a step is written.
pub(super) fn partial(directory: &Path, step: u64) -> PathBuf {
    directory.join(name(step) + PARTIAL)
}

/// The whole checkpoints in a folder, newest first; none if there is no folder.
pub fn list(directory: &Path) -> Result<Vec<Found>> {
    let mut whole = entries(directory)?;
    whole.retain(|(_, suffix)| *suffix != PARTIAL);
    whole.sort_by_key(|(found, suffix)| (std::cmp::Reverse(found.step), *suffix));
    Ok(whole.into_iter().map(|(found, _)| found).collect())
}

/// Removes all checkpoints in a folder, whole or not, and the folder if nothing else is in it.
pub fn clear(directory: &Path) -> Result<()> {
    for (found, _) in entries(directory)? {
        remove(&found.path)?;
    }
    // Fails if there is something that is not ours, and that stays.
    let _ = fs::remove_dir(directory);
    Ok(())
}

pub(super) fn clear_partial(directory: &Path) -> Result<()> {
    let entries = entries(directory)?;
    entries.iter().filter(|(_, suffix)| *suffix == PARTIAL).try_for_each(|(found, _)| remove(&found.path))
}

/// Gives a checkpoint that is on disk its final name, in place of an old one of the same step.
pub(super) fn put_in_place(directory: &Path, step: u64) -> Result<()> {
    let (new, last) = (partial(directory, step), directory.join(name(step)));
    let aside = directory.join(name(step) + REPLACED);
    let rename = |from: &Path, to: &Path| fs::rename(from, to).map_err(|e| Error::io("rename", from, e));
    if last.is_dir() {
        if aside.is_dir() {
            remove(&aside)?;
        }
        rename(&last, &aside)?;
        sync_folder(directory)?;
    }
    if let Err(error) = rename(&new, &last) {
        if aside.is_dir() {
            let _ = fs::rename(&aside, &last);
        }
        return Err(error);
    }
    sync_folder(directory)
}

/// Removes all checkpoints but that of `step` and the one before it that is known to be `sound`: the others are damaged, or later
/// than that from which the run was resumed.
pub(super) fn thin_out(directory: &Path, step: u64, sound: Option<u64>) -> Result<()> {
    let mut kept = Vec::new();
    for found in list(directory)? {
        // Of two of one step the first is the one that counts.
        if [Some(step), sound].contains(&Some(found.step)) && !kept.contains(&found.step) {
            kept.push(found.step);
        } else {
            remove(&found.path)?;
        }
    }
    Ok(())
}

/// Removes a checkpoint, so that no half of it has a final name at any time.
fn remove(path: &Path) -> Result<()> {
    let attempt = || -> io::Result<()> {
        let name = name_of(path);
        if name.ends_with(PARTIAL) {
            return fs::remove_dir_all(path);
        }
        let doomed = path.with_file_name(name + PARTIAL);
        if doomed.is_dir() {
            fs::remove_dir_all(&doomed)?;
        }
        fs::rename(path, &doomed)?;
        fs::remove_dir_all(&doomed)
    };
    attempt().map_err(|e| Error::io("remove", path, e))
}

/// Makes the names in a folder last.
pub(super) fn sync_folder(directory: &Path) -> Result<()> {
    match File::open(directory).and_then(|folder| folder.sync_all()) {
        // Some file systems know no such thing.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {
            Ok(())
        }
        result => result.map_err(|e| Error::io("write", directory, e)),
    }
}

/// Folders of checkpoints, with their suffixes.
fn entries(directory: &Path) -> Result<Vec<(Found, &'static str)>> {
    let attempt = || -> io::Result<Vec<_>> {
        let mut ours = Vec::new();
        for entry in fs::read_dir(directory)? {
            let entry = entry?;
            let of_ours = entry.file_name().to_str().and_then(parse);
            if let Some((step, suffix)) = of_ours
                && entry.file_type().is_ok_and(|kind| kind.is_dir())
            {
                ours.push((Found { step, path: entry.path() }, suffix));
            }
        }
        Ok(ours)
    };
    match attempt() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        result => result.map_err(|e| Error::io("read", directory, e)),
    }
}

/// Step and suffix, from a name.
fn parse(text: &str) -> Option<(u64, &'static str)> {
    let (stem, suffix) = [PARTIAL, REPLACED, WHOLE]
        .into_iter()
        .find_map(|suffix| Some((text.strip_suffix(suffix)?, suffix)))?;
    // One that is moved aside may be on its way out.
    let stem = stem.strip_suffix(REPLACED).unwrap_or(stem);
    let step = stem.strip_prefix("step-")?.parse().ok()?;
    (name(step) == stem).then_some((step, suffix))
}
