//! `turbid run`.

use super::terminal::{say, warn};
use super::{RunArguments, load, preflight};
use crate::case::Setup;
use crate::error::{Error, Result};
use crate::output::Summary;
use crate::simulation::{self, RunOptions};
use serde::Deserialize;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Drift of the settling velocity over the averages (relative) from which it is not called steady.
const DRIFT_LIMIT: f64 = 0.05;

/// Exit code after a second signal, as shells have it for an interrupt.
const INTERRUPTED: i32 = 130;

pub(super) fn run(arguments: &RunArguments) -> Result<()> {
    let (setup, stop) = simulation::agreed(prepare(arguments))?;
    if !arguments.quiet {
        for advice in preflight::advice(&setup) {
            warn(&advice);
        }
    }
    let options = RunOptions {
        quiet: arguments.quiet,
        stop,
        ..RunOptions::default()
    };
    let summary = simulation::run(&setup, &options)?;
    if let Some(summary) = summary.filter(|_| !arguments.quiet) {
        say(&Headline::of(&summary).text(&setup.output.directory));
    }
    Ok(())
}

/// The case, and the flag of the signals: what can fail on one process of an MPI job alone.
fn prepare(arguments: &RunArguments) -> Result<(Setup, Arc<AtomicBool>)> {
    let mut setup = load(&arguments.case.case, &arguments.case.changes)?;
    if let Some(out) = &arguments.out {
        setup.output.directory.clone_from(out);
    }
    preflight::refuse_what_does_not_fit(&setup)?;
    Ok((setup, stop_on_signals()?))
}

/// A flag that the first SIGINT or SIGTERM sets; the second ends the process.
fn stop_on_signals() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag unset, so only the second ends the process.
        signal_hook::flag::register_conditional_shutdown(signal, INTERRUPTED, Arc::clone(&stop))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&stop)))
            .map_err(|e| Error::io("handle signals of", Path::new("this process"), e))?;
    }
    Ok(stop)
}

/// What is shown at the end, by the stable keys of the summary.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Headline {
    settling_velocity_over_stokes: Option<f64>,
    settling_velocity_over_schiller_naumann: Option<f64>,
    standard_error: Option<f64>,
    drift: Option<f64>,
    interrupted: bool,
    mlups: Option<f64>,
    state_hash: Option<String>,
    particles: Option<usize>,
    steps: Option<u64>,
}

impl Headline {
    fn of(summary: &Summary) -> Self {
        serde_json::to_value(summary)
            .and_then(serde_json::from_value)
            .unwrap_or_default()
    }

    /// The number the user came for comes first.
    fn text(&self, directory: &Path) -> String {
        let mut lines = Vec::new();
        if let Some(velocity) = self.settling_velocity_over_stokes {
            let error = self
                .standard_error
                .map_or(String::new(), |e| format!(" +- {e:.4}"));
            let other = self
                .settling_velocity_over_schiller_naumann
                .map_or(String::new(), |v| format!(" ({v:.4} of u*)"));
            lines.push(format!(
                "mean settling velocity  {velocity:.4}{error} u_Stokes{other}"
            ));
        }
        if let Some(drift) = self.drift.filter(|drift| drift.abs() > DRIFT_LIMIT) {
            lines.push(format!(
                "not steady              the second half of the averages is {:+.1} % off the first: run longer, or raise \
                 run.average_from",
                100.0 * drift
            ));
        }
        if self.interrupted {
            lines.push("interrupted             by a signal, before the end of the case".to_string());
        }
        if let (Some(particles), Some(steps)) = (self.particles, self.steps) {
            lines.push(format!("particles, steps        {particles}, {steps}"));
        }
        if let Some(mlups) = self.mlups.filter(|mlups| *mlups > 0.0) {
            lines.push(format!("speed                   {mlups:.1} MLUPS"));
        }
        if let Some(hash) = &self.state_hash {
            lines.push(format!("state hash              {hash}"));
        }
        lines.push(format!("files                   {}", directory.display()));
        lines.push("open the .pvd files there in ParaView, e.g.".to_string());
        lines.push(format!(
            "  paraview {}",
            directory.join("particles.pvd").display()
        ));
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settling_velocity_comes_first_and_absent_numbers_are_left_out() {
        let headline = Headline {
            settling_velocity_over_stokes: Some(0.2741),
            standard_error: Some(0.0012),
            drift: Some(-0.2),
            interrupted: true,
            state_hash: Some("0123".to_string()),
            ..Headline::default()
        };
        let text = headline.text(Path::new("out/x"));
        assert!(
            text.starts_with("mean settling velocity  0.2741 +- 0.0012 u_Stokes\n"),
            "{text}"
        );
        assert!(
            text.contains("not steady") && text.contains("-20.0 %") && text.contains("interrupted"),
            "{text}"
        );
        assert!(text.contains("state hash              0123") && !text.contains("MLUPS"));
    }
}
