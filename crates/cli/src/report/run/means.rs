//! The figures of tables of means over time with their errors: profiles, pair distributions, contact forces, displacements.

use super::figures::{ALONE, Endings, TENSOR, VECTOR};
use crate::report::section::Section;
use turbid::output::numbers::number;
use turbid::output::structure::{MOST_SECTIONS, SECTORS, angle, kinds, of_kinds};
use turbid::output::{SeriesColumn, SeriesTable};
use turbid_plot::{Axis, Chart, Point, Series, Style, literal};

/// Columns that share a figure: title, the beginning of their names, and their endings with labels.
type Group = (&'static str, &'static str, Endings);

const DIAGONAL: Endings = &[("_xx", "xx"), ("_yy", "yy"), ("_zz", "zz")];
const VELOCITIES: Endings = &[
    ("particle_velocity_x", "particles, x"),
    ("particle_velocity_y", "particles, y"),
    ("particle_velocity_z", "particles, z"),
    ("fluid_velocity_x", "fluid, x"),
    ("fluid_velocity_y", "fluid, y"),
    ("fluid_velocity_z", "fluid, z"),
];
const PROFILES: [Group; 7] = [
    ("solid fraction", "solid_fraction", ALONE),
    ("mean velocity", "", VELOCITIES),
    ("variance of the particle velocity", "particle_velocity_variance", DIAGONAL),
    ("angular velocity of the particles", "angular_velocity", VECTOR),
    ("pressure", "pressure", ALONE),
    ("stress by contacts", "contact_stress", TENSOR),
    ("stress by the fluid", "hydrodynamic_stress", TENSOR),
];
const DISPLACEMENT: Group = ("mean squared displacement", "mean_squared_displacement", VECTOR);
const MEMORY: Group = ("velocity autocorrelation", "velocity_autocorrelation", VECTOR);
const PAIRS: Group = ("pair distribution", "pair_distribution", ALONE);
const FACTOR: Group = ("structure factor", "structure_factor", ALONE);
const NOTE: &str = "Means over time; bars: standard error.";

/// A curve of each of `values` over an abscissa, in these rows, without those that are zero throughout.
fn curves(table: &SeriesTable, x: &[f64], rows: &[usize], values: &[(&SeriesColumn, &str)]) -> Vec<Series> {
    let curve = |(column, label): &(&SeriesColumn, &str)| {
        let errors = table.get(&format!("{}_error", column.name)).unwrap_or_default();
        let point = |&row: &usize| Point {
            x: x[row],
            y: column.values[row],
            error: errors.get(row).copied().filter(|error| error.is_finite()),
        };
        let points: Vec<Point> = rows.iter().map(point).collect();
        let shows = points.iter().any(|point| point.y.is_finite() && point.y != 0.0);
        shows.then(|| Series { label: (*label).to_string(), style: Style::Measured, points })
    };
    values.iter().filter_map(curve).collect()
}

/// Adds a figure, if there is something in it.
fn figure(section: &mut Section, name: &str, title: &str, [x, y]: [Axis; 2], series: Vec<Series>) {
    if series.is_empty() {
        return;
    }
    let mut chart = Chart::new(format!("{}: {title}", literal(&section.title)), x, y, series);
    chart.note = NOTE.to_string();
    let mut heading = title.to_string();
    heading[..1].make_ascii_uppercase();
    section.figure(name, &heading, chart.figure(), "");
}

/// Adds a figure of each group of columns over an abscissa, both axes of which may be logarithmic.
fn groups(
    section: &mut Section,
    table: &SeriesTable,
    rows: &[usize],
    (x, label, logarithmic): (&str, &str, bool),
    groups: &[Group],
    (prefix, what): (&str, &str),
) {
    let Some(x) = table.get(x) else { return };
    for (title, beginning, endings) in groups {
        let named = endings.iter().filter_map(|(ending, label)| {
            let is = |column: &&SeriesColumn| column.name.strip_prefix(beginning) == Some(*ending);
            Some((table.columns.iter().find(is)?, *label))
        });
        let named: Vec<_> = named.collect();
        let series = curves(table, x, rows, &named);
        let Some(unit) = named.first().map(|(column, _)| &column.unit) else { continue };
        let of = if what.is_empty() { String::new() } else { format!(" {what}") };
        let axes = [Axis::new(label, logarithmic), Axis::new(format!("{title} ({unit})"), logarithmic)];
        let name = format!("{prefix}{}", title.replace(' ', "_"));
        figure(section, &name, &format!("{title}{of}"), axes, series);
    }
}

/// Adds the figures of each profile; `axes` are abscissas and directions in words, as far as they are known.
pub(super) fn profiles(section: &mut Section, means: &SeriesTable, axes: &[[String; 2]]) {
    let profile = means.get("profile").unwrap_or_default();
    let count = profile.iter().copied().fold(-1.0, f64::max) as usize + usize::from(!profile.is_empty());
    for number in 0..count {
        let rows: Vec<usize> = (0..profile.len()).filter(|&row| profile[row] as usize == number).collect();
        let unknown = || ["position (m)".to_string(), format!("in profile {number}")];
        let [axis, what] = axes.get(number).cloned().unwrap_or_else(unknown);
        let prefix = format!("profile_{number}_");
        groups(section, means, &rows, ("position", &axis, false), &PROFILES, (&prefix, &what));
    }
}

/// Adds the figures of displacements and of the memory of velocities.
pub(super) fn dynamics(section: &mut Section, means: &SeriesTable) {
    let rows: Vec<usize> = (0..means.get("lag").map_or(0, <[f64]>::len)).collect();
    // The first is the origin, which a logarithmic axis has not.
    let later = rows.get(1..).unwrap_or_default();
    groups(section, means, later, ("lag", "time lag (s)", true), &[DISPLACEMENT], ("", ""));
    groups(section, means, &rows, ("lag", "time lag (s)", false), &[MEMORY], ("", ""));
}

/// Adds the figure of the distribution of contact forces.
pub(super) fn forces(section: &mut Section, means: &SeriesTable) {
    let (Some(x), Some(density)) = (means.get("force_over_mean"), means.get("probability_density")) else {
        return;
    };
    // A logarithmic axis has no zero.
    let rows: Vec<usize> = (0..x.len()).filter(|&row| density[row] > 0.0).collect();
    let column = means.columns.iter().find(|column| column.name == "probability_density");
    let series = column.map(|column| curves(means, x, &rows, &[(column, "")])).unwrap_or_default();
    let axes =
        [Axis::new("normal force over its mean (-)", false), Axis::new("probability density (-)", true)];
    figure(section, "contact_forces", "distribution of the normal forces of contacts", axes, series);
}

/// Adds the figure of the structure factor.
pub(super) fn factors(section: &mut Section, means: &SeriesTable) {
    let rows: Vec<usize> = (0..means.get("wave_number").map_or(0, <[f64]>::len)).collect();
    groups(section, means, &rows, ("wave_number", "wave number (1/m)", false), &[FACTOR], ("", ""));
}

/// Adds the figure of the pair distributions of pairs of sections, if there are several.
fn pairs_of_sections(section: &mut Section, means: &SeriesTable, x: &[f64]) {
    let named = kinds(MOST_SECTIONS).filter_map(|[a, b]| {
        let column = means.columns.iter().find(|column| column.name == of_kinds([a, b]))?;
        Some((column, format!("particles {a} and {b}")))
    });
    let named: Vec<_> = named.collect();
    let rows: Vec<usize> = (0..x.len()).collect();
    let columns: Vec<_> = named.iter().map(|(column, label)| (*column, label.as_str())).collect();
    let series = curves(means, x, &rows, &columns);
    let axes = [Axis::new("distance of the centres (m)", false), Axis::new("pair distribution (-)", false)];
    figure(section, "pairs_of_sections", "pair distribution by sections of particles", axes, series);
}

/// Adds the figures of the pair distribution: over the distance, of pairs of sections, and by direction where it is largest.
pub(super) fn pairs(section: &mut Section, means: &SeriesTable) {
    let (Some(x), Some(pairs)) = (means.get("separation"), means.get("pair_distribution")) else { return };
    let rows: Vec<usize> = (0..x.len()).collect();
    groups(section, means, &rows, ("separation", "distance of the centres (m)", false), &[PAIRS], ("", ""));
    pairs_of_sections(section, means, x);
    let Some(peak) = rows.into_iter().max_by(|&a, &b| pairs[a].total_cmp(&pairs[b])) else { return };
    let value = |sector: usize, of: &str| {
        Some(means.get(&format!("pair_distribution_at_{}{of}", angle(sector)))?[peak])
    };
    let points = (0..SECTORS).filter_map(|sector| {
        let error = value(sector, "_error").filter(|error| error.is_finite());
        Some(Point { x: angle(sector) as f64, y: value(sector, "")?, error })
    });
    let points: Vec<Point> = points.collect();
    if points.is_empty() {
        return;
    }
    let axes = [
        Axis::new("angle of the pair in the plane (degrees)", false),
        Axis::new(format!("pair distribution at {} m (-)", number(x[peak], 3)), false),
    ];
    let series = vec![Series { label: String::new(), style: Style::Measured, points }];
    figure(section, "pair_directions", "pair distribution by direction", axes, series);
}
