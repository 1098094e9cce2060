//! What is told of a run.

mod figures;

use super::find::Source;
use super::{Block, Section};
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::numbers::{self, duration, with_error};
use turbid::output::{OutputFiles, SeriesTable, Summary};
use turbid_plot::Bars;

/// A run is called after its case if it is `alone`, or else, as the runs of a study share a case, after its directory.
pub(super) fn section(source: &Source, alone: bool) -> Result<Section> {
    let files = OutputFiles::new(&source.directory);
    let present = |path: std::path::PathBuf| path.is_file().then_some(path);
    let summary = present(files.summary()).map(|path| read_summary(&path)).transpose()?;
    let series = present(files.series()).map(|path| SeriesTable::read(&path)).transpose()?;
    let case = summary.as_ref().filter(|_| alone);
    let title = case.map_or(&source.name, |summary| &summary.case);
    let mut blocks = Vec::new();
    match &summary {
        Some(summary) => {
            blocks.push(Block::Text(head(summary)));
            blocks.push(Block::Heading("Numbers".into()));
            blocks.extend(tables(summary));
        }
        None => blocks.push(Block::Text(
            "The run has left no summary: it is going on, or has ended before its time (`turbid resume`)."
                .into(),
        )),
    }
    if let Some(series) = &series {
        blocks.push(Block::Heading("Over time".into()));
        blocks.extend(figures::all(title, series, summary.as_ref()));
    }
    if let Some(summary) = &summary {
        blocks.extend(stages(summary));
        blocks.push(Block::Heading("Case".into()));
        blocks.push(Block::Text(format!("```toml\n{}\n```", summary.input.trim_end())));
    }
    Ok(Section { title: title.clone(), row: row(source, summary.as_ref()), checks: [0; 2], blocks })
}

fn read_summary(path: &Path) -> Result<Summary> {
    let text = input::read_text(path, input::RECORD).map_err(|source| Error::io("read", path, source))?;
    serde_json::from_str(&text).map_err(|error| {
        Error::Input(format!(
            "{}: {error}\n  this is no summary of `turbid run`, or that of another version; run the case again",
            path.display()
        ))
    })
}

fn row(source: &Source, summary: Option<&Summary>) -> Vec<(&'static str, String)> {
    let of = |value: fn(&Summary) -> String| summary.map_or_else(|| "-".into(), value);
    vec![
        ("run", source.name.clone()),
        ("particles", of(|s| s.particles.to_string())),
        ("phi", of(|s| number(s.volume_fraction))),
        ("Ar", of(|s| number(s.scales.archimedes.round()))),
        ("u / u_Stokes", of(|s| with_error(s.settling_velocity_over_stokes, s.standard_error))),
        ("from t*", of(|s| known(s.averaged_over.map(|[from, _]| from)))),
        ("transient ends at t*", of(|s| known(s.transient_end))),
        ("u / u_Stokes after it", of(|s| with_error(s.settled_mean, s.settled_standard_error))),
        ("time", of(|s| duration(s.wall_seconds))),
    ]
}

fn head(summary: &Summary) -> String {
    let fluid = if summary.dry { "no fluid".to_string() } else { format!("{} cells", summary.cells) };
    let end = if summary.interrupted { "; interrupted before its end" } else { "" };
    let threads = match summary.threads {
        1 => "one thread".to_string(),
        threads => format!("{threads} threads"),
    };
    format!(
        "Turbid {}: {} particles, {fluid}, {} steps in {} on {threads}{end}. State hash `{}`.",
        summary.version,
        summary.particles,
        summary.steps,
        duration(summary.wall_seconds),
        summary.state_hash
    )
}

fn tables(summary: &Summary) -> Vec<Block> {
    let mut blocks = Vec::new();
    if summary.settling_velocity_over_stokes.is_some() {
        blocks.push(settling(summary));
    }
    let scales = &summary.scales;
    let finite = |name: &str, value: f64, unit: &str| {
        let value = (value.is_finite() && value != 0.0).then(|| number(value))?;
        Some(vec![name.to_string(), value, unit.to_string()])
    };
    let wet = |value: f64| if summary.dry { 0.0 } else { value };
    let mut rows: Vec<Vec<String>> = [
        finite("volume fraction phi", summary.volume_fraction, ""),
        finite("diameter D", scales.diameter, "m"),
        finite("density ratio", wet(scales.density_ratio), ""),
        finite("viscosity nu", wet(scales.viscosity), "m²/s"),
        finite("Archimedes number Ar", wet(scales.archimedes), ""),
        finite("Stokes velocity u_Stokes", wet(scales.stokes_velocity), "m/s"),
        finite("Stokes time D / u_Stokes, the unit of t*", wet(scales.stokes_time), "s"),
        finite("velocity u* of one sphere (Schiller, Naumann)", wet(scales.schiller_naumann_velocity), "m/s"),
        finite("Reynolds number at u*", wet(scales.schiller_naumann_reynolds), ""),
        finite("cells per diameter N", wet(summary.cells_per_diameter), ""),
        finite("edge of a cell", wet(summary.dx), "m"),
        finite("time step", summary.time_step, "s"),
        finite("relaxation time tau", wet(summary.relaxation_time), "time steps"),
        finite("largest Mach number", summary.mach.unwrap_or(0.0), ""),
        finite("speed", summary.mlups, "million cells/s"),
    ]
    .into_iter()
    .flatten()
    .collect();
    for (name, choice) in [
        ("collision", &summary.collision),
        ("coupling", &summary.coupling),
        ("force balance", &summary.force_balance),
    ] {
        rows.extend(choice.iter().map(|choice| vec![name.into(), choice.clone(), String::new()]));
    }
    for shape in &summary.shapes {
        rows.push(vec![
            format!("{}, D = {} m", shape.kind, number(shape.equivalent_diameter)),
            shape.count.to_string(),
            "particles".into(),
        ]);
    }
    blocks.push(Block::Table {
        title: "Set-up".into(),
        columns: ["quantity", "value", "unit"].map(String::from).into(),
        rows,
    });
    blocks
}

/// What was found out about settling.
fn settling(summary: &Summary) -> Block {
    let row = |name: &str, value: String| vec![name.to_string(), value];
    let interval = summary
        .averaged_over
        .map_or_else(|| "-".into(), |[from, to]| format!("{} to {}", number(from), number(to)));
    let drift = summary.drift.map_or_else(|| "-".into(), |drift| format!("{:+.1} %", 100.0 * drift));
    let end = match summary.transient_end {
        Some(end) => number(end),
        None => "not found: run longer, with 80 rows of series.csv at least".into(),
    };
    Block::Table {
        title: "Settling velocity".into(),
        columns: ["quantity", "value"].map(String::from).into(),
        rows: vec![
            row(
                "mean over u_Stokes",
                with_error(summary.settling_velocity_over_stokes, summary.standard_error),
            ),
            row("mean over u*", known(summary.settling_velocity_over_schiller_naumann)),
            row("averaged over t*", interval),
            row("second half against first", drift),
            row("end of the transient, t*", end),
            row(
                "mean over u_Stokes from there",
                with_error(summary.settled_mean, summary.settled_standard_error),
            ),
        ],
    }
}

/// Where the time goes.
fn stages(summary: &Summary) -> Option<Block> {
    let total: f64 = summary.stages.values().sum();
    let mut stages: Vec<(&String, f64)> = summary.stages.iter().map(|(name, &s)| (name, s)).collect();
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    (total > 0.0).then(|| Block::Figure {
        name: "stages".into(),
        title: "Share of the stages of a time step".into(),
        figure: Box::new(
            Bars {
                title: format!("Share of the stages of a time step ({} ms)", number(1e3 * total)),
                rows: (stages.into_iter())
                    .map(|(name, seconds)| {
                        let share = format!("{:.1} %", 100.0 * seconds / total);
                        (name.clone(), seconds / total, share)
                    })
                    .collect(),
            }
            .figure(),
        ),
        note: String::new(),
    })
}

/// Four digits, or a dash.
fn known(x: Option<f64>) -> String {
    number(x.unwrap_or(f64::NAN))
}

fn number(x: f64) -> String {
    numbers::number(x, 4)
}
