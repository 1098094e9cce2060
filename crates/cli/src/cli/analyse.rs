//! `turbid analyse`.

use super::terminal::{remark, say};
use clap::Args;
use std::path::PathBuf;
use turbid::error::Result;
use turbid::output::numbers::with_error;
use turbid::simulation;

/// Input and output of `turbid analyse`.
#[derive(Debug, Args)]
pub(super) struct AnalyseArguments {
    /// Output directory of a run.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Directory for averages.json and the tables of means. Default: DIR/analysis.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Time (s) from which means are taken, instead of that of the run.
    #[arg(long, value_name = "TIME")]
    from: Option<f64>,
}

pub(super) fn analyse(arguments: &AnalyseArguments) -> Result<()> {
    let out = arguments.out.clone().unwrap_or_else(|| arguments.directory.join("analysis"));
    let found = simulation::analyse(&arguments.directory, &out, arguments.from)?;
    let width = found.averages.keys().map(String::len).max().unwrap_or(0);
    for (name, of) in &found.averages {
        say(&format!("{name:width$}  {} {}", with_error(Some(of.mean), of.standard_error), of.unit));
    }
    say(&format!(
        "means from t = {:.6} s on, with standard errors; written to {}",
        found.from,
        out.display()
    ));
    for note in &found.notes {
        remark("note", note);
    }
    Ok(())
}
