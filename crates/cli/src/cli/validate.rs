//! `turbid validate`.

use super::suite::chosen;
use super::terminal::say;
use super::{Changes, RunFlags, run, walltime};
use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use turbid::error::{Error, Result};
use turbid_lab::checks::{self, Score};
use turbid_lab::validate::{self, CASES, Case, Level, SuiteContext};

/// Cases and output of `turbid validate`.
#[derive(Debug, Args)]
pub(super) struct ValidateArguments {
    /// Cases to run, instead of all of the level.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// List the cases and end.
    #[arg(long, conflicts_with_all = ["names", "json", "out"])]
    list: bool,
    /// Extent of the cases; --list gives the time of each level. A case without a quick part is run if it is named.
    #[arg(long, value_enum, default_value = "quick")]
    level: Level,
    /// Write all checks as a list of JSON objects with stable keys.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory for tables and plots. Runs of the full level are kept there too: complete ones are not repeated, stopped ones are
    /// resumed.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// End before this much time has passed: 5400, 90m, 1h30m or 01:30:00. With --out, the same command resumes.
    #[arg(long, value_name = "TIME", value_parser = walltime::parse)]
    max_walltime: Option<Duration>,
    #[command(flatten)]
    changes: Changes,
}

/// Runs the cases; returns true if all checks passed.
pub(super) fn validate(arguments: &ValidateArguments) -> Result<bool> {
    if arguments.list {
        say(&validate::list(CASES));
        return Ok(true);
    }
    let start = Instant::now();
    let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
    let level = arguments.level;
    let meant = |case: &&Case| !arguments.names.is_empty() || case.level() <= level;
    let cases = chosen(&names, &arguments.names)?.into_iter().map(|index| &CASES[index]);
    let cases: Vec<&'static Case> = cases.filter(meant).collect();
    if let Some(out) = &arguments.out {
        checks::prepare(out)?;
    }
    let flags = RunFlags { quiet: false, allow_engine: false, max_walltime: arguments.max_walltime };
    let full = level == Level::Full || cases.iter().any(|case| case.level() == Level::Full);
    let kept = arguments.out.clone().filter(|_| full);
    let answer = if kept.is_some() { run::STOPPING } else { "stopping" };
    let options = run::options(&flags, answer)?;
    let mut context = SuiteContext::new(arguments.changes.all(), arguments.changes.threads.unwrap_or(0));
    context.kept = kept;
    context.stop = options.stop;
    context.deadline = options.max_walltime.map(|limit| start + limit);
    let mut failure = None;
    let outcomes = validate::run(&cases, level, &context, |outcome| {
        say(&checks::table(outcome, false));
        if let Some(out) = &arguments.out {
            // The next cases run all the same.
            let written = checks::write_plots(out, outcome);
            failure = failure.take().or(written.err());
        }
    });
    if let Some(json) = &arguments.json {
        checks::write_json(json, &outcomes)?;
    }
    let score = Score::of(&outcomes);
    let interrupted = score.interrupted > 0;
    if let (read @ 1.., Some(kept)) = (context.read.load(Ordering::Relaxed), &context.kept) {
        let kept = kept.join("kept");
        say(&format!("{read} complete runs were read from {}", kept.display()));
    }
    say(&checks::summary(&outcomes, start.elapsed().as_secs_f64()));
    if let Some(out) = &arguments.out {
        // Complete tables stay until there are others.
        if interrupted {
            say("the same command resumes");
        } else {
            checks::write_tables(out, "validation", &outcomes)?;
        }
    }
    match failure {
        Some(error) => Err(error),
        None if interrupted && score.is_full() => Err(Error::Interrupted),
        None => Ok(score.is_full()),
    }
}
