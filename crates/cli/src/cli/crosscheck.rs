//! `turbid crosscheck`.

use super::terminal::say;
use super::{Changes, load, preflight, suite};
use crate::checks::{self, Ending, Outcome, Score};
use crate::crosscheck::{self, CASES, files, own_case};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;
use turbid::engine::{HAS_LIGGGHTS, liggghts_is_missing};
use turbid::error::{Error, Result};

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

/// Lists the suite, or runs it or a case; returns true if all checks passed.
pub(super) fn crosscheck(arguments: &CrosscheckArguments) -> Result<bool> {
    if arguments.list {
        say(&crosscheck::list());
        return Ok(true);
    }
    if !HAS_LIGGGHTS {
        return Err(liggghts_is_missing("`turbid crosscheck`"));
    }
    let start = Instant::now();
    let outcomes = match &arguments.file {
        Some(file) => own(arguments, file)?,
        None => whole_suite(arguments)?,
    };
    if let Some(json) = &arguments.json {
        checks::write_json(json, &outcomes)?;
    }
    say(&checks::summary(&outcomes, start.elapsed().as_secs_f64()));
    Ok(Score::of(&outcomes).is_full())
}

/// The suite, or those of its cases that are named, in its order. A case that fails does not keep the next one from running.
fn whole_suite(arguments: &CrosscheckArguments) -> Result<Vec<Outcome>> {
    if !arguments.changes.set.is_empty() || arguments.changes.threads.is_some() {
        return Err(Error::Input(
            "--set and --threads change a case file, but none is given; the cases of the suite are fixed"
                .to_string(),
        ));
    }
    let known: Vec<&str> = CASES.iter().map(|case| case.id).collect();
    let chosen = suite::chosen(&known, &arguments.only)?;
    let logs = arguments.out.join("logs");
    checks::prepare(&logs)?;
    let mut outcomes = Vec::new();
    for case in chosen.into_iter().map(|index| &CASES[index]) {
        let outcome = Outcome::of_engines(case.id, case.title, || (case.run)(Some(&logs)));
        say(&checks::table(&outcome, arguments.tolerance_report));
        files::write_case(&arguments.out, &outcome)?;
        outcomes.push(outcome);
        // Results so far are on disk, whatever becomes of the rest.
        checks::write_tables(&arguments.out, "crosscheck", &outcomes)?;
    }
    Ok(outcomes)
}

/// A user's case.
fn own(arguments: &CrosscheckArguments, file: &Path) -> Result<Vec<Outcome>> {
    let setup = load(file, &arguments.changes)?;
    preflight::refuse_what_does_not_fit(&setup)?;
    let logs = arguments.out.join("logs");
    checks::prepare(&logs)?;
    let mut parting = String::new();
    let outcome = Outcome::of_engines(own_case::ID, &setup.provenance.name, || {
        let (findings, text) = own_case::run(&setup, arguments.time, Some(&logs))?;
        parting = text;
        Ok(findings)
    });
    if let Ending::Failed(error) = outcome.ending {
        return Err(error);
    }
    say(&checks::table(&outcome, arguments.tolerance_report));
    say(&parting);
    let outcomes = vec![outcome];
    checks::write_tables(&arguments.out, "crosscheck", &outcomes)?;
    Ok(outcomes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_the_suite_are_unique_and_fit_for_file_names() {
        let mut ids: Vec<&str> = CASES.iter().map(|case| case.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), CASES.len());
        let fit = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        assert!(ids.iter().all(|id| id.chars().all(fit) && *id != own_case::ID));
    }
}
