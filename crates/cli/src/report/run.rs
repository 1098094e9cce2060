//! The section about a run.

pub(super) mod figures;
mod means;

use super::film;
use super::section::{Block, Section};
use super::{Source, read_json};
use std::path::PathBuf;
use turbid::error::Result;
use turbid::output::numbers::{self, duration, with_error};
use turbid::output::{LEAST_DISTANCE, OutputFiles, SeriesTable, Summary, directory};
use turbid_plot::Bars;

/// Kinds of particles of which each has a row; a file of positions may have thousands of sizes.
const LISTED_SHAPES: usize = 20;

/// A run has the title of its case if it is alone, or else, as the runs of a study have one case, that of its directory. Its pictures take
/// some `share` (bytes) of what is `left` of the page, which becomes less by what they take.
pub(super) fn describe(section: &mut Section, source: &Source, share: u64, left: &mut u64) -> Result<()> {
    let files = OutputFiles::new(&source.directory);
    let present = |path: PathBuf| path.is_file().then_some(path);
    let summary: Option<Summary> =
        present(files.summary()).map(|path| read_json(&path, "run the case again")).transpose()?;
    let series = present(files.series()).map(|path| SeriesTable::read(&path)).transpose()?;
    section.row = row(&source.name, summary.as_ref());
    match &summary {
        Some(summary) => {
            if section.is_alone {
                section.title.clone_from(&summary.case);
            }
            section.text(&head(summary));
            if !summary.warnings.is_empty() {
                section.blocks.push(Block::Warnings(summary.warnings.clone()));
            }
        }
        None => section
            .text("The run has left no summary: it is still running, or was interrupted (`turbid resume`)."),
    }
    let time_step = summary.as_ref().map(|summary| summary.time_step);
    let strips = film::strips(&source.directory, share, left, time_step);
    if !strips.is_empty() {
        section.blocks.push(Block::Html("Pictures", strips));
    }
    if let Some(summary) = &summary {
        section.heading("Numbers");
        tables(section, summary);
    }
    if let Some(series) = &series {
        section.heading("Over time");
        figures::all(section, series, summary.as_ref());
    }
    statistics(section, &files, summary.as_ref())?;
    if let Some(summary) = &summary {
        stages(section, summary);
        section.heading("Case");
        section.blocks.push(Block::Code("toml", summary.input.trim_end().to_string()));
    }
    Ok(())
}

/// Profiles, fronts, structure and dynamics, as far as the run has them.
fn statistics(section: &mut Section, files: &OutputFiles, summary: Option<&Summary>) -> Result<()> {
    let table = |name: &str| {
        let path = files.table(name);
        path.is_file().then(|| SeriesTable::read(&path)).transpose()
    };
    if let Some(summary) = summary.filter(|summary| !summary.averages.is_empty()) {
        averages(section, summary);
    }
    if let Some(means) = table(directory::PROFILE_MEANS)? {
        section.heading("Profiles");
        means::profiles(section, &means, &axes_of_profiles(summary));
    }
    if let Some(fronts) = table(directory::FRONTS)? {
        section.heading("Fronts");
        figures::statistics(section, &fronts);
    }
    if let Some(numbers) = table(directory::STRUCTURE)? {
        section.heading("Structure");
        figures::statistics(section, &numbers);
    }
    if let Some(pairs) = table(directory::PAIR_DISTRIBUTION_MEANS)? {
        means::pairs(section, &pairs);
    }
    if let Some(factors) = table(directory::STRUCTURE_FACTOR_MEANS)? {
        means::factors(section, &factors);
    }
    if let Some(forces) = table(directory::CONTACT_FORCE_MEANS)? {
        means::forces(section, &forces);
    }
    if let Some(dynamics) = table(directory::DYNAMICS_MEANS)? {
        section.heading("Dynamics");
        means::dynamics(section, &dynamics);
    }
    Ok(())
}

/// Abscissas of the profiles, and their directions in words, from the case.
fn axes_of_profiles(summary: Option<&Summary>) -> Vec<[String; 2]> {
    let case: Option<toml::Table> = summary.and_then(|summary| summary.input.parse().ok());
    let profiles = case.as_ref().and_then(|case| case.get("output")?.get("profiles")?.as_array());
    let axis = |profile: &toml::Value| {
        let axis = profile.get("axis")?.as_str()?;
        Some(match profile.get("about") {
            None => [format!("{axis} (m)"), format!("along {axis}")],
            Some(_) => ["distance from the axis (m)".to_string(), format!("about {axis}")],
        })
    };
    profiles.into_iter().flatten().filter_map(axis).collect()
}

/// The table of the means over time.
fn averages(section: &mut Section, summary: &Summary) {
    let rows = summary.averages.iter().map(|(name, of)| {
        vec![
            name.clone(),
            with_error(Some(of.mean), of.standard_error),
            of.unit.clone(),
            known(of.transient_end),
            with_error(of.settled_mean, of.settled_standard_error),
        ]
    });
    let head = ["quantity", "mean", "unit", "transient ends at t (s)", "mean after it"];
    section.table("Means over time", &head, rows.collect());
    section.text("Errors are standard errors of the mean, from the autocorrelation time or from blocks.");
}

fn row(name: &str, summary: Option<&Summary>) -> Vec<(&'static str, String)> {
    let of = |value: fn(&Summary) -> String| summary.map_or_else(|| "-".into(), value);
    vec![
        ("run", name.to_string()),
        ("particles", of(|s| s.particles.to_string())),
        ("phi", of(|s| number(s.volume_fraction))),
        ("Ar", of(|s| number(s.scales.archimedes.round()))),
        ("u / u_Stokes", of(|s| with_error(s.settling_velocity_over_stokes, s.standard_error))),
        ("from t*", of(|s| known(s.averaged_over.map(|[from, _]| from)))),
        ("transient ends at t*", of(|s| known(s.transient_end))),
        ("u / u_Stokes after it", of(|s| with_error(s.settled_mean, s.settled_standard_error))),
        ("relative viscosity", of(|s| with_error(s.relative_viscosity, s.relative_viscosity_standard_error))),
        ("drag / Stokes drag", of(|s| with_error(s.drag_over_stokes, s.drag_over_stokes_standard_error))),
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
    // Time is counted since then.
    let since = summary.resumed_from.map_or(String::new(), |first| {
        format!(", the last {} of them, since the run was resumed,", summary.steps - first)
    });
    format!(
        "Turbid {}: {} particles, {fluid}, {} steps{since} in {} on {threads}{end}. State hash `{}`.",
        summary.version,
        summary.particles,
        summary.steps,
        duration(summary.wall_seconds),
        summary.state_hash
    )
}

fn tables(section: &mut Section, summary: &Summary) {
    if summary.settling_velocity_over_stokes.is_some() {
        settling(section, summary);
    }
    resistance(section, summary);
    let scales = &summary.scales;
    // Numbers that are zero or not finite are left out.
    let fluid = |value: f64| if summary.dry { 0.0 } else { value };
    let mut rows: Vec<Vec<String>> = [
        ("volume fraction phi", summary.volume_fraction, ""),
        ("diameter D", scales.diameter, "m"),
        ("density ratio", fluid(scales.density_ratio), ""),
        ("viscosity nu", fluid(scales.viscosity), "m²/s"),
        ("Archimedes number Ar", fluid(scales.archimedes), ""),
        ("Stokes velocity u_Stokes", fluid(scales.stokes_velocity), "m/s"),
        ("Stokes time D / u_Stokes, the unit of t*", fluid(scales.stokes_time), "s"),
        ("velocity u* of one sphere (Schiller, Naumann)", fluid(scales.schiller_naumann_velocity), "m/s"),
        ("Reynolds number at u*", fluid(scales.schiller_naumann_reynolds), ""),
        ("cells per diameter N", fluid(summary.cells_per_diameter), ""),
        ("edge of a cell", fluid(summary.dx), "m"),
        ("time step", summary.time_step, "s"),
        ("relaxation time tau", fluid(summary.relaxation_time), "time steps"),
        ("largest Mach number", summary.mach.unwrap_or(0.0), ""),
        ("speed", summary.mlups, "million cells/s"),
    ]
    .into_iter()
    .filter(|(_, value, _)| value.is_finite() && *value != 0.0)
    .map(|(name, value, unit)| vec![name.to_string(), number(value), unit.to_string()])
    .collect();
    let choices = [
        ("collision", &summary.collision),
        ("coupling", &summary.coupling),
        ("force balance", &summary.force_balance),
    ];
    for (name, choice) in choices {
        rows.extend(choice.iter().map(|choice| vec![name.into(), choice.clone(), String::new()]));
    }
    let (listed, others) = summary.shapes.split_at(summary.shapes.len().min(LISTED_SHAPES));
    for shape in listed {
        let name = format!("{}, D = {} m", shape.kind, number(shape.equivalent_diameter));
        rows.push(vec![name, shape.count.to_string(), "particles".into()]);
    }
    if !others.is_empty() {
        let diameters = || others.iter().map(|shape| shape.equivalent_diameter);
        let [least, most] =
            [diameters().fold(f64::INFINITY, f64::min), diameters().fold(0.0, f64::max)].map(number);
        let name = format!("{} further sizes, D = {least} to {most} m", others.len());
        let count: usize = others.iter().map(|shape| shape.count).sum();
        rows.push(vec![name, count.to_string(), "particles".into()]);
    }
    section.table("Set-up", &["quantity", "value", "unit"], rows);
}

/// The settling velocity with its statistics.
fn settling(section: &mut Section, summary: &Summary) {
    let dash = || "-".to_string();
    let averaged = summary.averaged_over;
    let end = summary.transient_end.map_or_else(
        || {
            format!(
                "not found before the last {LEAST_DISTANCE} D settled: run longer, or write more rows of series.csv if it has fewer than 80"
            )
        },
        number,
    );
    let distance = summary.averaged_over_distance.map_or_else(dash, |distance| {
        let few =
            if distance < LEAST_DISTANCE { ", too few for an error: all are of one arrangement" } else { "" };
        format!("{} D{few}", number(distance))
    });
    let rows = [
        ("mean over u_Stokes", with_error(summary.settling_velocity_over_stokes, summary.standard_error)),
        ("mean over u*", known(summary.settling_velocity_over_schiller_naumann)),
        (
            "averaged over t*",
            averaged.map_or_else(dash, |[from, to]| format!("{} to {}", number(from), number(to))),
        ),
        ("settled relative to the mixture meanwhile", distance),
        (
            "second half against first",
            summary.drift.map_or_else(dash, |drift| format!("{:+.1} %", 100.0 * drift)),
        ),
        ("end of the transient, t*", end),
        ("mean over u_Stokes from there", with_error(summary.settled_mean, summary.settled_standard_error)),
    ];
    let rows = rows.map(|(name, value)| vec![name.to_string(), value]);
    section.table("Settling velocity", &["quantity", "value"], rows.to_vec());
    section.text("Errors are standard errors of the mean, from the autocorrelation time.");
}

/// Resistance of a flow between plates or through fixed bodies.
fn resistance(section: &mut Section, summary: &Summary) {
    let of = summary;
    let quantities = [
        ("relative viscosity", of.relative_viscosity, of.relative_viscosity_standard_error, ""),
        ("shear rate", of.shear_rate, None, "1/s"),
        ("strain at the end", of.shear_strain, None, ""),
        ("Reynolds number of the shear, rate D² / nu", of.shear_reynolds, None, ""),
        ("superficial velocity U", of.superficial_velocity, of.superficial_velocity_standard_error, "m/s"),
        ("drag on all fixed bodies, without buoyancy", of.drag, of.drag_standard_error, "N"),
        ("drag over Stokes drag at U", of.drag_over_stokes, of.drag_over_stokes_standard_error, ""),
        ("permeability", of.permeability, of.permeability_standard_error, "m²"),
    ];
    let known = quantities.into_iter().filter(|(_, value, ..)| value.is_some());
    let mut rows: Vec<Vec<String>> = known
        .map(|(name, value, error, unit)| vec![name.to_string(), with_error(value, error), unit.to_string()])
        .collect();
    if rows.is_empty() {
        return;
    }
    if let Some([from, to]) = summary.averaged_over_time {
        rows.push(vec!["averaged over t".into(), format!("{} to {}", number(from), number(to)), "s".into()]);
    }
    if let Some(drift) = summary.drift.filter(|_| summary.settling_velocity_over_stokes.is_none()) {
        let change = format!("{:+.1} %", 100.0 * drift);
        rows.push(vec!["second half against first".into(), change, String::new()]);
    }
    section.table("Resistance of the flow", &["quantity", "value", "unit"], rows);
}

/// The part of the time that each stage takes.
fn stages(section: &mut Section, summary: &Summary) {
    let total: f64 = summary.stages.values().sum();
    let mut stages: Vec<(&String, f64)> = summary.stages.iter().map(|(name, &s)| (name, s)).collect();
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    if total > 0.0 {
        let title = "Time of the stages of a time step";
        let part = |(name, seconds): (&String, f64)| {
            (name.clone(), seconds / total, format!("{:.1} %", 100.0 * seconds / total))
        };
        let rows = stages.into_iter().map(part).collect();
        let bars = Bars { title: format!("{title} ({} ms)", number(1e3 * total)), rows };
        section.figure("stages", title, bars.figure(), "");
    }
}

/// Four digits, or a dash.
fn known(x: Option<f64>) -> String {
    number(x.unwrap_or(f64::NAN))
}

fn number(x: f64) -> String {
    numbers::number(x, 4)
}
