//! `turbid crosscheck`.

use super::terminal::{say, speaks};
use super::{Changes, load, preflight, suite};
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::{Path, PathBuf};
use std::time::Instant;
use turbid::comm;
use turbid::error::{Error, Result};
use turbid_lab::checks::suite::{Level, run};
use turbid_lab::checks::{self, Ending, Outcome, Score};
use turbid_lab::crosscheck::{self, Against, CASES, files, own_case};

/// Cases and output of `turbid crosscheck`.
#[derive(Debug, Args)]
pub(super) struct CrosscheckArguments {
    /// Case file (TOML) of spheres to run through both engines, instead of the suite.
    #[arg(value_name = "CASE.toml")]
    file: Option<PathBuf>,
    #[command(flatten)]
    changes: Changes,
    /// List the cases of the suite and end.
    #[arg(long, conflicts_with_all = ["file", "only", "json"])]
    list: bool,
    /// Engine to compare the native one with; YADE and LAMMPS are programs, which need only their Debian packages.
    #[arg(long, value_name = "ENGINE", default_value = "liggghts", value_parser = PossibleValuesParser::new(Against::ids()))]
    engine: String,
    /// Program that speaks the engine protocol, to compare the native engine with it: the rest of the command line.
    #[arg(long, value_name = "PROGRAM", num_args = 1.., allow_hyphen_values = true, conflicts_with = "engine")]
    engine_command: Vec<String>,
    /// Run this case of the suite only; may be repeated.
    #[arg(long = "case", value_name = "ID", conflicts_with = "file")]
    only: Vec<String>,
    /// Print for every check why it has its tolerance, and how much of it is used.
    #[arg(long)]
    tolerance_report: bool,
    /// Write all checks as a list of JSON objects with stable keys.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory for tables, plots, trajectories and logs.
    #[arg(long, value_name = "DIR", default_value = "out/crosscheck")]
    out: PathBuf,
    /// Physical time to run the case file for, instead of to its end.
    #[arg(long, value_name = "SECONDS", requires = "file")]
    time: Option<f64>,
}

impl CrosscheckArguments {
    /// True if the other engine can have a part in each process of an MPI job.
    pub(super) fn is_for_all_processes(&self) -> bool {
        let has_parts = ["liggghts", "lammps"].contains(&self.engine.as_str());
        has_parts && self.engine_command.is_empty() && self.file.is_none() && !self.list
    }
}

/// Lists the suite, or runs it or a case; returns true if all checks passed.
pub(super) fn crosscheck(arguments: &CrosscheckArguments) -> Result<bool> {
    if arguments.list {
        say(&crosscheck::list());
        return Ok(true);
    }
    let several = comm::launched().is_some_and(|launched| launched.size > 1);
    let parts = if several && arguments.is_for_all_processes() {
        Against::in_parts(&arguments.engine, &arguments.out)?
    } else {
        None
    };
    let against = match parts {
        Some(parts) => parts,
        None => Against::chosen(&arguments.engine, &arguments.engine_command, &arguments.out)?,
    };
    let start = Instant::now();
    let outcomes = match &arguments.file {
        Some(file) => own(arguments, file, &against)?,
        None => whole_suite(arguments, &against)?,
    };
    if let Some(json) = arguments.json.as_ref().filter(|_| speaks()) {
        checks::write_json(json, &outcomes)?;
    }
    say(&checks::summary(&outcomes, start.elapsed().as_secs_f64()));
    Ok(Score::of(&outcomes).is_full())
}

/// The suite, or those of its cases that are named, in its order. A case that fails does not keep the next one from running.
fn whole_suite(arguments: &CrosscheckArguments, against: &Against) -> Result<Vec<Outcome>> {
    if !arguments.changes.set.is_empty() || arguments.changes.threads.is_some() {
        return Err(Error::Input(
            "--set and --threads change a case file, but none is given; the cases of the suite are fixed"
                .to_string(),
        ));
    }
    let known: Vec<&str> = CASES.iter().map(|case| case.name).collect();
    let chosen = suite::chosen(&known, &arguments.only)?;
    if speaks() {
        against.prepare(&arguments.out)?;
    }
    let mut outcomes = Vec::new();
    for case in chosen.into_iter().map(|index| &CASES[index]) {
        let found = run(&[case], Level::Quick, against, |outcome| {
            say(&checks::table(outcome, arguments.tolerance_report));
        });
        outcomes.extend(found);
        if speaks() {
            files::write_case(&arguments.out, outcomes.last().expect("it was added"))?;
            // Results so far are on disk, whatever becomes of the rest.
            checks::write_tables(&arguments.out, "crosscheck", &outcomes)?;
        }
    }
    if speaks() {
        checks::write_bars(&arguments.out, "crosscheck", &outcomes)?;
    }
    Ok(outcomes)
}

/// A user's case.
fn own(arguments: &CrosscheckArguments, file: &Path, against: &Against) -> Result<Vec<Outcome>> {
    let setup = load(file, &arguments.changes)?;
    preflight::refuse_what_does_not_fit(&setup)?;
    if speaks() {
        against.prepare(&arguments.out)?;
    }
    let (start, mut parting) = (Instant::now(), String::new());
    let found = own_case::run(&setup, arguments.time, against).map(|(findings, text)| {
        parting = text;
        findings
    });
    let (name, seconds) = (&setup.provenance.name, start.elapsed().as_secs_f64());
    let outcome = Outcome::new(own_case::ID, name, Some(against.name), seconds, found.into());
    match outcome.ending {
        Ending::Failed(error) => return Err(error),
        Ending::Missing(why) => return Err(Error::Input(why)),
        Ending::Found(_) | Ending::Stopped => {}
    }
    say(&checks::table(&outcome, arguments.tolerance_report));
    say(&parting);
    let outcomes = vec![outcome];
    if speaks() {
        checks::write_tables(&arguments.out, "crosscheck", &outcomes)?;
    }
    Ok(outcomes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_the_suite_are_unique_and_fit_for_file_names() {
        let mut ids: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), CASES.len());
        let fit = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        assert!(ids.iter().all(|id| id.chars().all(fit) && *id != own_case::ID));
    }
}
