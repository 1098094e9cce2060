//! `turbid resume`.

use super::{ResumeArguments, run};
use crate::error::Result;
use crate::simulation;

pub(super) fn resume(arguments: &ResumeArguments) -> Result<()> {
    let options = simulation::agreed(run::options(&arguments.manner))?;
    let directory = &arguments.directory;
    let summary = simulation::resume(directory, &arguments.set, arguments.threads, &options)?;
    run::show(summary.as_ref(), directory, &options);
    Ok(())
}
