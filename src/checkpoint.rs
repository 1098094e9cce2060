//! The state of a run on disk: written by all ranks together, read by any number of them.
//!
//! ```text
//! checkpoints/
//!   step-0000000100/            whole; the last two of a run are kept
//!     manifest.toml             what it is, sizes and checksums of all other files; the last line is its own checksum
//!     case.toml                 the case with its changes
//!     files/00000 ...           what the case names: meshes, positions
//!     part-00000.bin ...        of each rank: head, sections, one record per plane of cells (src/checkpoint/part.rs)
//!   step-0000000200.partial/    being written, or being removed
//!   step-0000000100.replaced/   the old one while one of the same step takes its place
//! ```
//!
//! A checkpoint has its final name only once all its bytes are on disk. Every byte is covered by a checksum (xxh3), so that damaged,
//! truncated or missing files are named on reading. Numbers are plain data of the machine that wrote them. The meaning of the bytes is
//! not known here: cells have a fixed number of bytes; the engine, the coupling and the whole run have sections of bytes.

mod folder;
mod manifest;
mod part;
mod read;
mod write;

use crate::comm::Comm;
use crate::domain::Block;
use crate::error::{Error, Result};
use std::fs::File;
use std::path::Path;

use folder::name_of;
pub use folder::{Found, clear, list};
pub use read::Checkpoint;

/// Name of the folder of checkpoints in the output directory of a run.
pub const FOLDER: &str = "checkpoints";

/// Names in a checkpoint; those of parts are in `part.rs`.
const MANIFEST: &str = "manifest.toml";
const CASE_FILE: &str = "case.toml";
/// Folder of the files that the case names.
const FILES: &str = "files";

fn kept_file(n: usize) -> String {
    format!("{FILES}/{n:05}")
}

/// Identity of a state; the same on every rank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// Steps done.
    pub step: u64,
    /// Cells of the box.
    pub cells: [usize; 3],
    /// Bytes of a cell; 0 in a dry run, which has no planes.
    pub bytes_per_cell: usize,
    /// The case of the run.
    pub case: CaseText,
}

/// A case with everything it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaseText {
    /// Name of the case.
    pub name: String,
    /// Its text, with all changes applied.
    pub text: String,
    /// The files that the case names: the name as it stands there, and the contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// The case as resolved by the program, as JSON: a later version may have other defaults.
    pub resolved: String,
}

/// Contribution of one rank to a checkpoint besides its cells.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// The cells of the rank.
    pub block: Block,
    /// State of the engine.
    pub engine: &'a [u8],
    /// State of the coupling.
    pub coupling: &'a [u8],
    /// Data common to all ranks; of rank 0, empty on all others.
    pub shared: &'a [u8],
}

/// Writes a checkpoint below `directory`, which may be missing. All others are removed but that of the step which is known to be
/// `sound`: the last one that this run has written or resumed from. Collective.
///
/// `plane(z, out)` appends the bytes of the plane `z` of the block, for y, for x, `bytes_per_cell` each. It is called once for each
/// z, ascending, and not at all in a dry run.
///
/// Errors: [`Error::Agreed`], the same on every rank; then nothing has a final name that did not have it before, and nothing
/// partial is left.
pub fn write(
    directory: &Path,
    comm: &Comm,
    sound: Option<u64>,
    head: &Head,
    part: &Part,
    plane: impl FnMut(usize, &mut Vec<u8>),
) -> Result<()> {
    write::write(directory, comm, sound, head, part, plane, &|path| File::create_new(path))
}

/// The newest checkpoint below `directory` with which `attempt` succeeds on all ranks: what it returned here, and for each newer
/// one why it was skipped. Collective.
///
/// `attempt` is called on all ranks with the same checkpoint, whose heads are sound. It may be collective if it makes the same
/// calls on all ranks even when only one of them finds something damaged ([`agreed`]).
///
/// Errors: [`Error::Agreed`], the same on every rank: there is none, or each of them with its defect.
pub fn newest_sound<R>(
    directory: &Path,
    comm: &Comm,
    mut attempt: impl FnMut(&Checkpoint) -> Result<R>,
) -> Result<(R, Vec<String>)> {
    let found = agreed(comm, in_rank_0(comm, || list(directory)))?;
    // Others may see the folder of a remote disk a little later.
    let names: Vec<String> = found.iter().map(|found| name_of(&found.path)).collect();
    let names = comm.all_gather(names.join("\n").into_bytes()).swap_remove(0);
    let mut skipped = Vec::new();
    for name in String::from_utf8_lossy(&names).lines() {
        let opened = agreed(comm, Checkpoint::open(&directory.join(name)));
        match opened.and_then(|checkpoint| agreed(comm, attempt(&checkpoint))) {
            Ok(result) => return Ok((result, skipped)),
            Err(why) => skipped.push(why.to_string()),
        }
    }
    Err(Error::Agreed {
        code: 2,
        text: if skipped.is_empty() {
            format!(
                "there is no checkpoint in {}: name the output directory of a run that has written one, as it does at its end, with \
                 output.checkpoint_every and when it is stopped",
                directory.display()
            )
        } else {
            format!("no checkpoint in {} can be used:\n  {}", directory.display(), skipped.join("\n  "))
        },
    })
}

/// The result of this rank if all have succeeded; else, on all, [`Error::Agreed`] with the error of the first that has failed by
/// itself. Collective.
pub fn agreed<R>(comm: &Comm, result: Result<R>) -> Result<R> {
    if !comm.any(result.is_err()) {
        return result;
    }
    let mine = match result {
        Ok(_) | Err(Error::OtherRank) => Vec::new(),
        Err(error) => [&[error.exit_code() as u8], error.to_string().as_bytes()].concat(),
    };
    let all = comm.all_gather(mine);
    Err(match all.iter().find(|message| !message.is_empty()) {
        Some(first) => {
            let text = String::from_utf8_lossy(&first[1..]).into_owned();
            Error::Agreed { code: i32::from(first[0]), text }
        }
        None => Error::OtherRank,
    })
}

/// Result of `make` on rank 0; the default on the others.
fn in_rank_0<R: Default>(comm: &Comm, make: impl FnOnce() -> Result<R>) -> Result<R> {
    if comm.rank() == 0 { make() } else { Ok(R::default()) }
}

#[cfg(test)]
mod tests;
