//! Checks as CSV and JSON, and the plots of cases.

use super::{Check, Ending, Outcome, all, markdown};
use std::fs;
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::output::{Overlay, write_bytes};
use turbid_plot::Style;

/// Creates the output directory.
///
/// # Errors
/// [`Error::Input`] with a remedy if that is not possible.
pub fn prepare(directory: &Path) -> Result<()> {
    fs::create_dir_all(directory).map_err(|source| {
        Error::Input(format!(
            "cannot write to the output directory {}: {source}\n  choose another one with --out DIR",
            directory.display()
        ))
    })
}

/// A list with one object for each check; what is not finite becomes `null`.
pub fn json(outcomes: &[Outcome]) -> String {
    let mut text = serde_json::to_string_pretty(&all(outcomes)).expect("checks are plain JSON");
    text.push('\n');
    text
}

/// A row for each check, below a header. The cases must be of one kind, all of engines or none.
pub fn csv(checks: &[Check]) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for check in checks {
        table.serialize(check).expect("memory takes any row");
    }
    table.into_inner().expect("memory takes any row")
}

/// Writes [`json`] to a file.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_json(path: &Path, outcomes: &[Outcome]) -> Result<()> {
    write_bytes(path, json(outcomes).as_bytes())
}

/// Writes `NAME.csv`, `NAME.json` and, of checks that do not compare engines, `NAME.md`.
///
/// # Errors
/// [`Error::Io`] if one of them cannot be written.
pub fn write_tables(directory: &Path, name: &str, outcomes: &[Outcome]) -> Result<()> {
    let file = |ending: &str| directory.join(format!("{name}.{ending}"));
    let checks = all(outcomes);
    write_json(&file("json"), outcomes)?;
    write_bytes(&file("csv"), &csv(&checks))?;
    if outcomes.iter().any(|outcome| outcome.engines) {
        return Ok(());
    }
    write_bytes(&file("md"), markdown(&checks).as_bytes())
}

/// Writes the plots of a case as `CASE_NAME.png` and `CASE_NAME.svg`.
///
/// # Errors
/// [`Error::Io`] if one of them cannot be written.
pub fn write_plots(directory: &Path, outcome: &Outcome) -> Result<()> {
    let Ending::Found(found) = &outcome.ending else {
        return Ok(());
    };
    for overlay in &found.overlays {
        overlay.write(directory, &outcome.case, looks(overlay))?;
    }
    Ok(())
}

/// Legend and style of every curve. The reference (`reference: NAME`, or the only other one beside both engines) lies
/// below. Curves of LIGGGHTS are measured; those of the native engine lie on them, with one legend if there are several.
/// Without engines the second of two measured curves lies on the first.
pub(super) fn looks(overlay: &Overlay) -> Vec<(String, Style)> {
    const ENGINES: [(&str, Style); 2] = [("native", Style::Overlaid), ("LIGGGHTS", Style::Measured)];
    // A name with both engines is that of a difference.
    let engine = |name: &str| {
        let mut named = (0..2).filter(|&k| name.contains(ENGINES[k].0));
        let first = named.next().filter(|&k| name.starts_with(ENGINES[k].0));
        first.filter(|_| named.next().is_none())
    };
    let names = || overlay.curves.iter().map(|(name, _)| name.as_str());
    let of = |k: usize| names().filter(|name| engine(name) == Some(k)).count();
    let both = of(0) > 0 && of(1) > 0;
    let is_other = |name: &str| engine(name).is_none() && !name.starts_with("reference");
    let others = names().filter(|name| is_other(name)).count();
    let mut before = 0;
    let look = |name: &str| match engine(name) {
        Some(0) if both && of(0) > 1 => (ENGINES[0].0.to_string(), ENGINES[0].1),
        Some(k) if both || of(k) == 1 => (name.to_string(), ENGINES[k].1),
        Some(_) => (name.to_string(), Style::Measured),
        None if !is_other(name) => {
            let legend = name.strip_prefix("reference: ").unwrap_or(name);
            (legend.to_string(), Style::Reference)
        }
        None if both && others == 1 => (name.to_string(), Style::Reference),
        None => {
            before += 1;
            let second_of_two = !both && others == 2 && before == 2;
            let style = if second_of_two { Style::Overlaid } else { Style::Measured };
            (name.to_string(), style)
        }
    };
    names().map(look).collect()
}
