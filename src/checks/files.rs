//! Checks as CSV and JSON, and the plots of cases.

use super::{Check, Ending, Outcome, all, markdown};
use crate::error::{Error, Result};
use crate::output::picture::{Curve, CurveStyle};
use crate::output::{Overlay, write_bytes};
use std::fs;
use std::path::Path;

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
        overlay.write(directory, &outcome.case, &curves(overlay))?;
    }
    Ok(())
}

/// The curves with their styles: of the native engine dashed, of LIGGGHTS solid, the reference (`reference: NAME`, or the only
/// other one beside both engines) pale, below all. Without engines what was measured is solid and dashed; of more than two
/// curves each has its own colour. Where several curves are of one engine, the rest of each name stands beside the curve.
pub(super) fn curves(overlay: &Overlay) -> Vec<Curve<'_>> {
    const ENGINES: [(&str, CurveStyle); 2] =
        [("native", CurveStyle::Dashed), ("LIGGGHTS", CurveStyle::Solid)];
    // A name with both engines is that of a difference.
    let engine = |name: &str| {
        let named: Vec<usize> = (0..2).filter(|&k| name.contains(ENGINES[k].0)).collect();
        named
            .first()
            .copied()
            .filter(|&k| named.len() == 1 && name.starts_with(ENGINES[k].0))
    };
    let names = || overlay.curves.iter().map(|(name, _)| name.as_str());
    let of = |k: usize| names().filter(|name| engine(name) == Some(k)).count();
    let (both, several) = (of(0) > 0 && of(1) > 0, of(0).max(of(1)) > 1);
    let is_other = |name: &str| engine(name).is_none() && !name.starts_with("reference");
    let others = names().filter(|name| is_other(name)).count();
    let (mut labels, mut other) = (Vec::new(), 0);
    let mut curves = Vec::new();
    for (name, points) in &overlay.curves {
        let (name, style, rest) = match engine(name) {
            Some(k) if several => {
                let (short, style) = ENGINES[k];
                (short, style, name[short.len()..].trim_matches([' ', ',', ':']))
            }
            Some(k) => (name.as_str(), ENGINES[k].1, ""),
            None if !is_other(name) => (
                name.strip_prefix("reference: ").unwrap_or(name),
                CurveStyle::Pale,
                "",
            ),
            None if both && others == 1 => (name.as_str(), CurveStyle::Pale, ""),
            None => {
                other += 1;
                let style = match other {
                    1 if !both && others <= 2 => CurveStyle::Solid,
                    2 if !both && others <= 2 => CurveStyle::Dashed,
                    count => CurveStyle::Other(count - 1),
                };
                (name.as_str(), style, "")
            }
        };
        // What is the same for both engines is said once.
        let label = if labels.contains(&rest) { "" } else { rest };
        labels.push(rest);
        curves.push(Curve {
            name,
            style,
            label,
            points,
        });
    }
    curves
}
