//! The figures of a time series.

use crate::report::section::Section;
use turbid::output::picture::{SettlingPlot, settling_chart};
use turbid::output::{Estimate, SeriesColumn, SeriesTable, Summary};
use turbid::simulation::settling_references;
use turbid_plot::{Axis, Chart, Series, Style, literal};

/// Least value on a logarithmic axis over the largest.
const SHOWN: f64 = 1e-5;
const TIME: &str = "t";
const T_STAR: &str = "t_star";
const SETTLING: &str = "settling_velocity_over_stokes";
/// Columns of time, and what is the same in all rows.
const WHEN: [&str; 4] = ["step", TIME, T_STAR, "profile"];

/// Endings of the names of the columns of a group, and their labels in the legend.
pub(super) type Endings = &'static [(&'static str, &'static str)];

pub(super) const ALONE: Endings = &[("", "")];
pub(super) const VECTOR: Endings = &[("_x", "x"), ("_y", "y"), ("_z", "z")];
pub(super) const TENSOR: Endings =
    &[("_xx", "xx"), ("_yy", "yy"), ("_zz", "zz"), ("_xy", "xy"), ("_xz", "xz"), ("_yz", "yz")];
const ENERGIES: Endings =
    &[("_fluid", "fluid"), ("_translation", "particles, translation"), ("_rotation", "particles, rotation")];
const SPEEDS: Endings = &[("max_particle_speed", "largest"), ("mean_particle_speed", "mean")];

/// A figure of columns that have one unit: name, title, the beginning of their names, and their endings.
type Group = (&'static str, &'static str, &'static str, Endings);

const GROUPS: [Group; 11] = [
    (LOGARITHMIC, "Kinetic energy", "kinetic_energy", ENERGIES),
    ("contacts", "Contacts", "contacts", ALONE),
    ("overlap", "Largest overlap over the diameter", "max_overlap", ALONE),
    ("particle_speed", "Speed of the particles", "", SPEEDS),
    ("particle_velocity", "Mean velocity of the particles", "mean_particle_velocity", VECTOR),
    ("net_flux", "Mean velocity of the mixture", "net_flux", VECTOR),
    ("momentum", "Momentum", "momentum", VECTOR),
    ("wall_force", "Force of the particles on the walls", "wall_force", VECTOR),
    ("gravitational_energy", "Gravitational energy", "gravitational_energy", ALONE),
    ("contact_stress", "Stress of the particles by contacts", "contact_stress", TENSOR),
    ("hydrodynamic_stress", "Stress of the particles by the fluid", "hydrodynamic_stress", TENSOR),
];

const CONTACTS: Endings = &[("", "all"), ("_without_rattlers", "without rattlers")];
const HEIGHTS: Endings = &[("front_height", "front"), ("bed_height", "bed")];

/// Figures of `structure.csv` and of `fronts.csv`.
const STATISTICS: [Group; 7] = [
    ("coordination", "Contacts of a particle", "coordination", CONTACTS),
    ("cluster_size", "Mean size of the cluster that a particle is in", "cluster_size", ALONE),
    ("largest_cluster", "Part of the particles in the largest cluster", "largest_cluster", ALONE),
    ("fabric", "Fabric tensor of the contacts", "fabric", TENSOR),
    ("orientation", "Orientation tensor of the bodies", "orientation", TENSOR),
    ("velocity_variance", "Variance of the particle velocity", "velocity_variance", TENSOR),
    ("fronts", "Heights of front and bed", "", HEIGHTS),
];

/// The figure whose vertical axis is logarithmic.
const LOGARITHMIC: &str = "kinetic_energy";

/// Vectors of each wall and of each kind of bodies with prescribed motion: the beginning of the names of their columns, and a title.
const OF_BODIES: [(&str, &str); 8] = [
    ("fluid_force", "Force of the fluid on wall"),
    ("fluid_torque", "Torque of the fluid on wall"),
    ("shear_stress", "Shear stress on wall"),
    ("hydrodynamic_force", "Force of the fluid on"),
    ("hydrodynamic_torque", "Torque of the fluid on"),
    ("contact_force", "Contact force on"),
    ("contact_torque", "Contact torque on"),
    ("drag", "Drag on"),
];

type Columns<'a> = Vec<(&'a SeriesColumn, &'a str)>;

/// The columns of a table with these names.
fn columns<'a>(table: &'a SeriesTable, beginning: &str, endings: Endings) -> Columns<'a> {
    let column = |&(ending, label): &(&str, &'static str)| {
        let is = |column: &&SeriesColumn| column.name.strip_prefix(beginning) == Some(ending);
        Some((table.columns.iter().find(is)?, label))
    };
    endings.iter().filter_map(column).collect()
}

/// Adds all figures of a series; columns that are zero throughout are left out.
pub(in crate::report) fn all(section: &mut Section, series: &SeriesTable, summary: Option<&Summary>) {
    let mut groups: Vec<(String, String, Columns)> = of_groups(series, &GROUPS);
    for (what, title) in OF_BODIES {
        for column in &series.columns {
            let body = column.name.strip_prefix(what).and_then(|rest| rest.strip_prefix('_'));
            if let Some(body) = body.and_then(|rest| rest.strip_suffix("_x")) {
                let name = format!("{what}_{body}");
                let columns = columns(series, &name, VECTOR);
                groups.push((name, format!("{title} {body}"), columns));
            }
        }
    }
    settling(section, series, summary);
    draw(section, series, groups);
}

/// Adds all figures of `structure.csv` or `fronts.csv`.
pub(super) fn statistics(section: &mut Section, table: &SeriesTable) {
    draw(section, table, of_groups(table, &STATISTICS));
}

fn of_groups<'a>(table: &'a SeriesTable, groups: &[Group]) -> Vec<(String, String, Columns<'a>)> {
    let group = |&(name, title, beginning, endings): &Group| {
        (name.to_string(), title.to_string(), columns(table, beginning, endings))
    };
    groups.iter().map(group).collect()
}

/// Adds the figures of groups of columns over time, and one of each other column.
fn draw<'a>(section: &mut Section, series: &'a SeriesTable, mut groups: Vec<(String, String, Columns<'a>)>) {
    for column in &series.columns {
        let name = column.name.as_str();
        let mut known = groups.iter().flat_map(|(_, _, columns)| columns);
        if name != SETTLING && !WHEN.contains(&name) && !known.any(|(known, _)| known.name == name) {
            groups.push((name.to_string(), name.replace('_', " "), vec![(column, "")]));
        }
    }
    let moves = |(column, _): &(&SeriesColumn, &str)| {
        column.values.iter().any(|value| *value != 0.0 && value.is_finite())
    };
    for (name, title, mut columns) in groups {
        let logarithmic = name == LOGARITHMIC;
        if columns.iter().any(moves) {
            // A logarithmic axis has no zero.
            columns.retain(|column| !logarithmic || moves(column));
            let chart = over_time(&section.title, series, &title, &columns, logarithmic);
            section.figure(&name, &title, chart.figure(), "");
        }
    }
}

/// Settling velocity with its means.
fn settling(section: &mut Section, series: &SeriesTable, summary: Option<&Summary>) {
    let (Some(t_star), Some(velocity)) = (series.get(T_STAR), series.get(SETTLING)) else {
        return;
    };
    if velocity.iter().all(|value| *value == 0.0) {
        return;
    }
    // There is a mean, and something to compare it with, only where a settling velocity can be steady.
    let steady = summary.filter(|summary| summary.settling_velocity_over_stokes.is_some());
    let estimate = |mean: Option<f64>, standard_error| Some(Estimate { mean: mean?, standard_error });
    let mean = steady.and_then(|summary| {
        let mean = estimate(summary.settling_velocity_over_stokes, summary.standard_error);
        summary.averaged_over.zip(mean)
    });
    let settled = steady.and_then(|summary| {
        let mean = estimate(summary.settled_mean, summary.settled_standard_error);
        summary.transient_end.zip(mean)
    });
    let references = steady.map(|summary| settling_references(&summary.scales, summary.volume_fraction));
    let references = references.as_ref().map_or(&[][..], |references| references);
    let chart =
        settling_chart(&SettlingPlot { case: &section.title, t_star, velocity, mean, settled, references });
    let note = match (steady, settled) {
        (Some(_), None) => {
            "No end of the transient was found; it takes 80 rows of series.csv, and 4 diameters that several particles settle."
        }
        _ => "",
    };
    section.figure("settling_velocity", "Settling velocity", chart.figure(), note);
}

/// Columns over time, which is `t*` where the case has one.
fn over_time(case: &str, series: &SeriesTable, title: &str, columns: &Columns, logarithmic: bool) -> Chart {
    let has = |values: &&[f64]| values.iter().any(|value| *value != 0.0);
    let (times, time) = match (series.get(T_STAR).filter(has), series.get(TIME)) {
        (Some(t_star), _) => (t_star, "time t* = t u_Stokes / D"),
        (None, Some(times)) => (times, "time t (s)"),
        (None, None) => (series.columns[0].values.as_slice(), "row"),
    };
    let unit = columns.first().map_or("-", |(column, _)| column.unit.as_str());
    // The first moments of a start from rest would take most of a logarithmic axis.
    let all = columns.iter().flat_map(|(column, _)| &column.values);
    let least = if logarithmic { SHOWN * all.copied().fold(0.0, f64::max) } else { f64::NEG_INFINITY };
    let shown = |y: f64| if y >= least { y } else { f64::NAN };
    let lines = columns.iter().map(|(column, label)| {
        let points = times.iter().zip(&column.values);
        Series::new(*label, Style::Line, points.map(|(&x, &y)| (x, shown(y))))
    });
    let mut quantity = title.to_string();
    if let Some(first) = quantity.get_mut(..1) {
        first.make_ascii_lowercase();
    }
    Chart::new(
        format!("{}: {quantity}", literal(case)),
        Axis::new(time, false),
        Axis::new(format!("{quantity} ({unit})"), logarithmic),
        lines.collect(),
    )
}
