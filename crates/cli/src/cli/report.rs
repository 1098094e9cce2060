//! `turbid report`.

use super::terminal::say;
use crate::report;
use clap::Args;
use std::path::PathBuf;
use turbid::error::Result;
use turbid::output::picture::Format;

/// Input and output of `turbid report`.
#[derive(Debug, Args)]
pub(super) struct ReportArguments {
    /// Output directory of a run or of a study, or a directory that holds several of them.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Directory for the pages and their figures, instead of DIR.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Formats of the figures.
    #[arg(long, value_parser = ["svg", "png"], value_delimiter = ',', default_values = ["svg", "png"])]
    format: Vec<String>,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<()> {
    let out = arguments.out.as_ref().unwrap_or(&arguments.directory);
    let mut formats = Vec::new();
    for name in &arguments.format {
        let format = if name == "svg" { Format::Svg } else { Format::Png };
        if !formats.contains(&format) {
            formats.push(format);
        }
    }
    let done = report::report(&arguments.directory, out, &formats)?;
    let [passed, checks] = done.checks;
    let checks = match checks {
        0 => String::new(),
        _ => format!(", {passed} of {checks} checks passed"),
    };
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let pages = format!("{}, {}", done.page.display(), done.html.display());
    say(&format!("{pages}: {}{checks}", count(done.figures, "figure")));
    Ok(())
}
