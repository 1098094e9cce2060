//! `turbid study`.

use super::machine::in_time;
use super::progress::Terminal;
use super::terminal::{columns, say, warn};
use super::{RunFlags, preflight, run};
use clap::Args;
use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::path::PathBuf;
use std::sync::Arc;
use turbid::comm;
use turbid::error::{Error, Result};
use turbid::simulation::RunOptions;
use turbid_lab::checks::{Score, cells};
use turbid_lab::study::record::{Quantity, Record};
use turbid_lab::study::state::State;
use turbid_lab::study::{self, Event, Study};

/// Study and flags of `turbid study`.
#[derive(Debug, Args)]
pub(super) struct StudyArguments {
    /// Study file (TOML).
    #[arg(value_name = "FILE", required_unless_present = "schema")]
    file: Option<PathBuf>,
    /// Directory for all runs and results. Default: out/FOLDER/NAME of the file.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// List the runs with their state and time, and end.
    #[arg(long)]
    list: bool,
    /// Only runs whose names contain this.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Threads; 0 is one per core. Results do not depend on it.
    #[arg(long)]
    threads: Option<usize>,
    /// Print the JSON schema of study files instead.
    #[arg(long, conflicts_with = "file")]
    schema: bool,
    #[command(flatten)]
    flags: RunFlags,
}

/// Runs the rest of a study; returns true if all its checks passed.
pub(super) fn study(arguments: &StudyArguments) -> Result<bool> {
    let Some(file) = &arguments.file else {
        say(&study::file::schema());
        return Ok(true);
    };
    if let Some(launched) = comm::launched().filter(|launched| launched.size > 1) {
        return Err(Error::Input(format!(
            "a study was started on {} processes, but its runs are on threads; start one process, with --threads {}",
            launched.size, launched.size
        )));
    }
    let mut study = Study::load(file, arguments.out.as_deref(), arguments.threads)?;
    for warning in study.warnings() {
        warn(&warning);
    }
    if arguments.list {
        say(&list(&study, arguments.only.as_deref()));
        return Ok(true);
    }
    // From here on a signal ends a run with a checkpoint; before, it ends the program.
    let options = run::options(&arguments.flags, run::STOPPING)?;
    let (quiet, only) = (arguments.flags.quiet, arguments.only.as_deref());
    // Lines every few seconds for hours are of no use.
    let progress = Arc::new(Terminal::new(quiet || !stderr().is_terminal()));
    let options = RunOptions { progress: Some(progress.clone()), ..options };
    let outcome = study::execute(&mut study, &options, only, &preflight::admit, &mut |event| {
        if let Event::Failed { .. } = event {
            progress.clear();
        }
        tell(event, quiet);
    })?;
    let document = study.document()?;
    if !quiet {
        let score = Score::of_checks(&document.checks);
        let mut text = format!("{} of {} runs done, {score}", document.runs.done, document.runs.total);
        if let unsettled @ 1.. = document.unsettled.len() {
            let _ = write!(text, ", means that have not settled in {unsettled} (`settled` in result.csv)");
        }
        if outcome.interrupted {
            text.push_str("; interrupted, the same command resumes");
        }
        let out = study.out.display();
        let _ = write!(text, "\nfiles: {out}; look at them with: turbid report {out}");
        say(&text);
    }
    if outcome.failed > 0 {
        return Err(Error::Agreed {
            code: outcome.code,
            text: format!("{} of the runs failed; all others are done or still open", outcome.failed),
        });
    }
    if outcome.interrupted {
        return Err(Error::Interrupted);
    }
    if document.runs.done < document.runs.total {
        return Ok(true);
    }
    // Also where the study is quiet: they are the reason for its exit code.
    let failed = document.checks.iter().filter(|check| !check.pass);
    for check in failed.clone() {
        let [measured, reference, deviation, tolerance] = cells(check);
        let (quantity, source) = (&check.quantity, &check.source);
        warn(&format!(
            "a check failed: {quantity} is {measured}, the reference {reference} ({source}), the deviation {deviation} of at most {tolerance}"
        ));
    }
    Ok(failed.count() == 0)
}

fn tell(event: Event, quiet: bool) {
    match event {
        Event::Begins { name, number: [number, of], from, seconds } if !quiet => {
            let time = seconds.map_or(String::new(), |seconds| format!(", about {}", in_time(seconds)));
            let from = if from > 0 { format!(", from step {from}") } else { String::new() };
            say(&format!("[{number}/{of}] {name}{from}{time}"));
        }
        Event::Finished(record) if !quiet => {
            say(&format!("       {}", results(record)));
        }
        Event::Failed { name, error } => warn(&format!("the run {name} failed: {error}")),
        Event::Begins { .. } | Event::Finished(_) => {}
    }
}

/// Results of a run in words; quantities that it does not have are left out.
fn results(record: &Record) -> String {
    let mut parts = Vec::new();
    let named = [
        ("settling_velocity_over_stokes", " u_Stokes"),
        ("relative_viscosity", " times the viscosity of the fluid"),
        ("drag_over_stokes", " times the Stokes drag"),
    ];
    for (name, unit) in named {
        // In a run without gravity the settling velocity is zero.
        if let Some(Quantity { value, error }) = record.get(name).filter(|quantity| quantity.value != 0.0) {
            let error = error.map_or(String::new(), |error| format!(" +- {error:.4}"));
            parts.push(format!("{value:.4}{error}{unit}"));
        }
    }
    let positive = |name| record.value(name).filter(|value| *value > 0.0);
    parts.extend(positive("mlups").map(|speed| format!("{speed:.1} MLUPS")));
    parts.extend(positive("wall_seconds").map(in_time));
    parts.join(", ")
}

/// The runs with their state and the time that they take.
fn list(study: &Study, only: Option<&str>) -> String {
    let mut rows = vec![["  run", "cells", "steps", "time", "state"].map(String::from).to_vec()];
    let mut total = 0.0;
    for (at, run) in study.plan.runs.iter().enumerate() {
        if only.is_some_and(|only| !run.name.contains(only)) {
            continue;
        }
        let (time, state) = match &study.states[at] {
            State::Done(record) => {
                let mut state = "done".to_string();
                if record.directory != study.out.join(&run.name) {
                    let _ = write!(state, ", in {}", record.directory.display());
                }
                if record.version != env!("CARGO_PKG_VERSION") {
                    let _ = write!(state, ", by version {}", record.version);
                }
                (record.value("wall_seconds"), state)
            }
            State::Part { step } => (study.seconds_left(at), format!("part, up to step {step}")),
            State::Open { replaces: false } => (study.seconds_left(at), "open".to_string()),
            State::Open { replaces: true } => {
                let state = "open; another run is there and will be replaced";
                (study.seconds_left(at), state.to_string())
            }
        };
        if study.states[at].record().is_none() {
            total += time.unwrap_or(0.0);
        }
        rows.push(vec![
            format!("  {}", run.name),
            run.setup.fluid_cells().to_string(),
            study.steps(at).to_string(),
            time.map_or_else(|| "-".to_string(), in_time),
            state,
        ]);
    }
    let done = study.states.iter().filter(|state| state.record().is_some()).count();
    let basis = match study.measured_over_estimated() {
        Some(_) => "by the speed measured in the finished runs",
        None => "by the cost model of `turbid check`: nothing was measured yet",
    };
    format!(
        "{}\n\n{}\n\n{done} of {} runs done; the others take {}, {basis}",
        study.file.title,
        columns(&rows),
        study.plan.runs.len(),
        in_time(total)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_settling_velocity_of_zero_is_left_out_and_a_relative_viscosity_given() {
        let words = |numbers: &[(&str, f64)]| {
            let quantities =
                numbers.iter().map(|&(name, value)| (name.to_string(), Quantity::exact(value))).collect();
            results(&Record {
                directory: PathBuf::new(),
                version: String::new(),
                averaged_over: None,
                quantities,
            })
        };
        let settles =
            words(&[("settling_velocity_over_stokes", 0.3), ("mlups", 12.0), ("wall_seconds", 5.0)]);
        assert_eq!(settles, "0.3000 u_Stokes, 12.0 MLUPS, 5 s");
        let sheared = words(&[
            ("settling_velocity_over_stokes", 0.0),
            ("relative_viscosity", 1.5),
            ("wall_seconds", 5.0),
        ]);
        assert_eq!(sheared, "1.5000 times the viscosity of the fluid, 5 s");
        let dry = words(&[("settling_velocity_over_stokes", 0.0), ("mlups", 0.0), ("wall_seconds", 5.0)]);
        assert_eq!(dry, "5 s");
    }
}
