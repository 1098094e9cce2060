//! `turbid resume`.

use super::{ResumeArguments, preflight, run};
use turbid::case::Setup;
use turbid::error::Result;
use turbid::simulation::{self, RunOptions};

pub(super) fn resume(arguments: &ResumeArguments) -> Result<()> {
    let (setup, options) = simulation::agreed(prepare(arguments))?;
    let summary = simulation::resume(&setup, &options)?;
    run::ended(summary.as_ref(), &setup.plan.output.directory, arguments.manner.quiet)
}

/// The saved case, and what the signals set: what can fail on one process of an MPI job alone.
fn prepare(arguments: &ResumeArguments) -> Result<(Setup, RunOptions)> {
    let options = run::options(&arguments.manner, run::STOPPING)?;
    let setup = simulation::saved_setup(&arguments.directory, &arguments.set, arguments.threads)?;
    preflight::refuse_what_does_not_fit(&setup)?;
    Ok((setup, options))
}
