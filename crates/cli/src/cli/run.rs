//! `turbid run` and `turbid resume`.

use super::live::{self, LiveFlags};
use super::progress::Terminal;
use super::terminal::{remark, say, warn};
use super::{ResumeArguments, RunArguments, RunFlags, load_together, preflight, signals, with_device};
use std::path::Path;
use std::sync::Arc;
use turbid::case::Setup;
use turbid::error::{Error, Result};
use turbid::output::{LEAST_DISTANCE, OutputFiles, Summary};
use turbid::simulation::{self, Branch, RunOptions};

/// Drift of the settling velocity over the averages (relative) from which it is not called steady.
const DRIFT_LIMIT: f64 = 0.05;

/// Answer to the first SIGINT of a run that keeps checkpoints.
pub(super) const STOPPING: &str = "stopping, writing a checkpoint";

pub(super) fn run(arguments: &RunArguments) -> Result<()> {
    // Signals first: reading and packing may take a while.
    let mut options = simulation::agreed(options_of_run(&arguments.flags, &arguments.live))?;
    options.overwrite = arguments.overwrite;
    let mut setup = load_together(&arguments.case.case, &arguments.case.changes)?;
    if let Some(out) = &arguments.out {
        setup.plan.output.directory.clone_from(out);
    }
    simulation::agreed(preflight::refuse_what_does_not_fit(&setup))?;
    advise(&mut setup, arguments.flags.quiet);
    let summary = simulation::run(&setup, &options)?;
    ended(summary.as_ref(), &setup.plan.output.directory, arguments.flags.quiet)
}

/// Adds what the numbers of a case give reason to warn of to its warnings, so that the summary has it, and prints it.
fn advise(setup: &mut Setup, quiet: bool) {
    let advice = preflight::advice(setup);
    for text in advice.iter().filter(|_| !quiet) {
        warn(text);
    }
    setup.provenance.warnings.extend(advice);
}

/// Resumes a run from its last checkpoint, or branches one off.
pub(super) fn resume(arguments: &ResumeArguments) -> Result<()> {
    let (quiet, directory) = (arguments.flags.quiet, &arguments.directory);
    if let Some(out) = &arguments.out {
        let (mut branch, options) = simulation::agreed(prepare_branch(arguments, out))?;
        let (note, warnings) = branch.setup.provenance.warnings.split_last().expect("what it does");
        for warning in warnings {
            warn(warning);
        }
        if !quiet {
            remark("note", note);
        }
        advise(&mut branch.setup, quiet);
        return ended(simulation::branch(&branch, &options)?.as_ref(), out, quiet);
    }
    // All processes come to the checkpoint, or none.
    let options = simulation::agreed(options_of_run(&arguments.flags, &arguments.live))?;
    let set = with_device(&arguments.set, arguments.device.as_ref());
    let setup = simulation::saved_setup(directory, &set, arguments.threads)?;
    simulation::agreed(preflight::refuse_what_does_not_fit(&setup))?;
    if let Some(summary) = simulation::finished(&setup).filter(|_| !quiet) {
        let (shown, steps) = (directory.display(), summary.steps);
        remark(
            "note",
            &format!(
                "the run is complete, with all of its {steps} steps; it can be extended, turbid resume {shown} --set run.end.steps={}, or \
                 branched off, with --out NEW as well",
                2 * steps
            ),
        );
    }
    let summary = simulation::resume(&setup, &options)?;
    ended(summary.as_ref(), directory, quiet)
}

/// The case of a branch, and options that signals set: all that can fail on one process of an MPI job alone.
fn prepare_branch(arguments: &ResumeArguments, out: &Path) -> Result<(Branch, RunOptions)> {
    // All processes come to the checkpoint, or none.
    let options = simulation::agreed(options_of_run(&arguments.flags, &arguments.live))?;
    let set = with_device(&arguments.set, arguments.device.as_ref());
    let branch = Branch::new(&arguments.directory, &set, arguments.threads, out)?;
    preflight::refuse_what_does_not_fit(&branch.setup)?;
    Ok((branch, options))
}

/// Options of one run, with progress on the terminal and on a page.
fn options_of_run(flags: &RunFlags, live: &LiveFlags) -> Result<RunOptions> {
    let mut options = options(flags, STOPPING)?;
    let terminal = Arc::new(Terminal::new(flags.quiet));
    options.progress = Some(terminal.clone());
    live::serve(live, &mut options, &terminal)?;
    Ok(options)
}

/// Options of runs, by their flags and from now on by [signals]; `answer` is printed at the first one.
pub(super) fn options(flags: &RunFlags, answer: &'static str) -> Result<RunOptions> {
    let options = RunOptions {
        max_walltime: flags.max_walltime,
        allow_engine: flags.allow_engine,
        ..RunOptions::default()
    };
    signals::listen(&options, answer)?;
    Ok(options)
}

/// Prints the results of a run, unless it is quiet. Collective.
///
/// # Errors
/// [`Error::Interrupted`], or what all processes of an MPI job make of it, if the run was stopped before its end.
pub(super) fn ended(summary: Option<&Summary>, directory: &Path, quiet: bool) -> Result<()> {
    if let Some(summary) = summary.filter(|_| !quiet) {
        say(&headline(summary, directory));
    }
    simulation::agreed(match summary {
        Some(summary) if summary.interrupted => Err(Error::Interrupted),
        _ => Ok(()),
    })
}

/// The number the user came for comes first.
fn headline(summary: &Summary, directory: &Path) -> String {
    let mut lines = Vec::new();
    if let Some(velocity) = summary.settling_velocity_over_stokes {
        let error = plus_minus(summary.standard_error);
        let other = (summary.settling_velocity_over_schiller_naumann)
            .map_or(String::new(), |v| format!(" ({v:.4} of u*)"));
        lines.push(format!("mean settling velocity  {velocity:.4}{error} u_Stokes{other}"));
        let short = summary.averaged_over_distance.filter(|distance| *distance < LEAST_DISTANCE);
        lines.extend(short.map(|distance| {
            format!(
                "error unknown           the particles settled by {distance:.1} D in the averages, which are of one arrangement: run until \
                 they settle by {LEAST_DISTANCE} D or more"
            )
        }));
    }
    if let Some(viscosity) = summary.relative_viscosity {
        let error = plus_minus(summary.relative_viscosity_standard_error);
        lines.push(format!("relative viscosity      {viscosity:.4}{error} (shear stress on both plates over that of the fluid alone)"));
    }
    if let Some(drag) = summary.drag_over_stokes {
        let error = plus_minus(summary.drag_over_stokes_standard_error);
        let with_error = |value: Option<f64>, error: Option<f64>| {
            let error = error.map_or(String::new(), |error| format!(" +- {error:.1e}"));
            format!("{:.4e}{error}", value.unwrap_or(f64::NAN))
        };
        let velocity = with_error(summary.superficial_velocity, summary.superficial_velocity_standard_error);
        let permeability = with_error(summary.permeability, summary.permeability_standard_error);
        lines.push(format!("drag over Stokes drag   {drag:.4}{error} (all fixed bodies, without buoyancy)"));
        lines.push(format!("superficial velocity    {velocity} m/s, permeability {permeability} m^2"));
    }
    if let Some(drift) = summary.drift.filter(|drift| drift.abs() > DRIFT_LIMIT) {
        lines.push(format!(
            "not steady              the second half of the averages is {:+.1} % off the first: run longer, or raise \
             run.average_from",
            100.0 * drift
        ));
    }
    lines.extend(transient(summary));
    if summary.interrupted {
        lines.push(format!(
            "interrupted             before the end of the case; resume with: turbid resume {}",
            directory.display()
        ));
    }
    lines.push(format!("particles, steps        {}, {}", summary.particles, summary.steps));
    if summary.mlups > 0.0 {
        lines.push(format!("speed                   {:.1} MLUPS", summary.mlups));
    }
    lines.push(format!("state hash              {}", summary.state_hash));
    lines.push(format!("files                   {}", directory.display()));
    let files = OutputFiles::new(directory);
    if files.has_own_script() {
        lines.push(format!("open in ParaView        paraview --script={}", files.script().display()));
    }
    lines.join("\n")
}

/// Text on the transient, where the averages may contain some of it.
fn transient(summary: &Summary) -> Option<String> {
    let [from, _] = summary.averaged_over?;
    let Some((end, mean)) = summary.transient_end.zip(summary.settled_mean) else {
        return Some(format!(
            "not settled             no end of the transient was found after which particles settle by {LEAST_DISTANCE} D: run longer, or \
                 write more rows of series.csv if it has fewer than 80 (output.series_every)"
        ));
    };
    let error = plus_minus(summary.settled_standard_error);
    (from < end).then(|| {
        format!(
            "holds the transient     the averages begin at t* {from:.1}, the transient ends at t* {end:.1}; from there \
             {mean:.4}{error}: set run.average_from = {{ stokes_times = {:.0} }}",
            end.ceil()
        )
    })
}

/// An error behind its value, if it is known.
fn plus_minus(error: Option<f64>) -> String {
    error.map_or(String::new(), |e| format!(" +- {e:.4}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settling_velocity_comes_first_and_absent_numbers_are_left_out() {
        let summary = Summary {
            settling_velocity_over_stokes: Some(0.2741),
            standard_error: Some(0.0012),
            drift: Some(-0.2),
            interrupted: true,
            state_hash: "0123".to_string(),
            ..Summary::default()
        };
        let text = headline(&summary, Path::new("out/x"));
        assert!(text.starts_with("mean settling velocity  0.2741 +- 0.0012 u_Stokes\n"), "{text}");
        assert!(
            text.contains("not steady")
                && text.contains("-20.0 %")
                && text.contains("resume with: turbid resume out/x"),
            "{text}"
        );
        assert!(text.contains("state hash              0123") && !text.contains("MLUPS"));
    }

    #[test]
    fn averages_of_one_arrangement_are_told() {
        let at = |distance| Summary {
            settling_velocity_over_stokes: Some(0.05),
            averaged_over_distance: distance,
            ..Summary::default()
        };
        let text = |distance| headline(&at(distance), Path::new("out/x"));
        assert!(text(Some(0.3)).contains("settled by 0.3 D in the averages"), "{}", text(Some(0.3)));
        assert!(!text(Some(4.1)).contains("one arrangement") && !text(None).contains("one arrangement"));
    }

    #[test]
    fn averages_that_begin_within_the_transient_are_told_and_how_to_avoid_it() {
        let at = |transient_end: Option<f64>| Summary {
            settling_velocity_over_stokes: Some(0.27),
            averaged_over: Some([40.0, 120.0]),
            transient_end,
            settled_mean: transient_end.map(|_| 0.26),
            settled_standard_error: Some(0.001),
            ..Summary::default()
        };
        let text = |end| headline(&at(end), Path::new("out/x"));
        let late = text(Some(55.5));
        assert!(
            late.contains("begin at t* 40.0, the transient ends at t* 55.5; from there 0.2600 +- 0.0010")
                && late.contains("run.average_from = { stokes_times = 56 }"),
            "{late}"
        );
        assert!(!text(Some(30.0)).contains("transient"));
        assert!(text(None).contains("run longer"));
        assert!(!headline(&Summary::default(), Path::new("out/x")).contains("transient"));
    }
}
