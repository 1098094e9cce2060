//! Going on with a run from its last checkpoint.

use super::run::{MoreWriters, Origin, RunOptions, run_from};
use crate::case::{self, Setup};
use crate::checkpoint::{self, CaseText};
use crate::comm::Comm;
use crate::error::Result;
use crate::output::{OutputFiles, Summary};
use std::path::Path;

/// Goes on with the run of this case, from the newest checkpoint in its output directory that is sound, to its end. The summary is
/// as that of [`run`](super::run()).
///
/// # Errors
/// [`Error::Input`](crate::error::Error::Input) if there is no sound checkpoint; else as [`run`](super::run()).
pub fn resume(setup: &Setup, options: &RunOptions) -> Result<Option<Summary>> {
    resume_with(setup, options, &|_| Vec::new())
}

/// As [`resume`], with the caller's own writers that [`run_with`](super::run_with()) had.
///
/// # Errors
/// As [`resume`]; what a writer says.
pub fn resume_with(setup: &Setup, options: &RunOptions, more: &MoreWriters) -> Result<Option<Summary>> {
    run_from(setup, options, more, Origin::Checkpoint)
}

/// The case of the run whose output directory this is, from the newest checkpoint whose case and heads are sound; `changes` are
/// options for keys of `[run]` and `[output]`.
///
/// # Errors
/// [`Error::Input`](crate::error::Error::Input) if there is no such checkpoint, or for a change that would make another run of it.
pub fn saved_setup(directory: &Path, changes: &[String], threads: Option<usize>) -> Result<Setup> {
    let folder = OutputFiles::new(directory).checkpoints();
    let newest = |checkpoint: &checkpoint::Checkpoint| Ok(checkpoint.head().clone());
    let (head, _) = checkpoint::newest_sound(&folder, &Comm::Solo, newest)?;
    let CaseText { name, text, files, .. } = &head.case;
    let mut setup = case::from_saved(name, text, files, changes)?;
    setup.plan.output.directory = directory.to_path_buf();
    setup.plan.threads = threads.unwrap_or(setup.plan.threads);
    Ok(setup)
}
