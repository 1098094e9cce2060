//! The figures of a time series.

use super::super::Block;
use turbid::output::picture::{SettlingPlot, settling_chart};
use turbid::output::{Estimate, SeriesColumn, SeriesTable, Summary};
use turbid::simulation::settling_references;
use turbid_plot::{Axis, Chart, Series, Style};

/// The part of the largest value from which values are shown on a logarithmic axis.
const SHOWN: f64 = 1e-5;
const TIME: &str = "t";
pub(super) const T_STAR: &str = "t_star";
pub(super) const SETTLING: &str = "settling_velocity_over_stokes";
/// Columns that say when.
const WHEN: [&str; 3] = ["step", TIME, T_STAR];

/// What columns of a group have behind their common beginning, and what they are called in the legend.
type Endings = &'static [(&'static str, &'static str)];

const ALONE: Endings = &[("", "")];
const VECTOR: Endings = &[("_x", "x"), ("_y", "y"), ("_z", "z")];
const TENSOR: Endings =
    &[("_xx", "xx"), ("_yy", "yy"), ("_zz", "zz"), ("_xy", "xy"), ("_xz", "xz"), ("_yz", "yz")];
const ENERGIES: Endings =
    &[("_fluid", "fluid"), ("_translation", "particles, translation"), ("_rotation", "particles, rotation")];
const SPEEDS: Endings = &[("max_particle_speed", "largest"), ("mean_particle_speed", "mean")];

/// Figures of columns that have one unit: name, title, and the columns.
const GROUPS: [(&str, &str, &str, Endings); 11] = [
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

/// The figure whose vertical axis is logarithmic.
const LOGARITHMIC: &str = "kinetic_energy";

/// Vectors of each wall: the beginning of the names of their columns, and a title.
const OF_WALLS: [(&str, &str); 2] =
    [("fluid_force", "Force of the fluid on wall"), ("shear_stress", "Shear stress on wall")];

/// Name and title of a figure, and its columns with their labels.
type Group<'a> = (String, String, Vec<(&'a SeriesColumn, &'a str)>);

/// All figures that the series has something for; what is zero throughout is left out.
pub(super) fn all(case: &str, series: &SeriesTable, summary: Option<&Summary>) -> Vec<Block> {
    let columns = |beginning: &str, endings: Endings| -> Vec<(&SeriesColumn, &str)> {
        let column = |&(ending, label)| {
            let is = |column: &&SeriesColumn| column.name.strip_prefix(beginning) == Some(ending);
            Some((series.columns.iter().find(is)?, label))
        };
        endings.iter().filter_map(column).collect()
    };
    let mut groups: Vec<Group> = (GROUPS.iter())
        .map(|&(name, title, beginning, endings)| (name.into(), title.into(), columns(beginning, endings)))
        .collect();
    for (what, title) in OF_WALLS {
        for column in &series.columns {
            let wall = column.name.strip_prefix(what).and_then(|rest| rest.strip_prefix('_'));
            if let Some(wall) = wall.and_then(|rest| rest.strip_suffix("_x")) {
                let name = format!("{what}_{wall}");
                let columns = columns(&name, VECTOR);
                groups.push((name, format!("{title} {wall}"), columns));
            }
        }
    }
    // Whatever else there is, each for itself.
    for column in &series.columns {
        let name = column.name.as_str();
        let mut known = groups.iter().flat_map(|(_, _, columns)| columns);
        if name != SETTLING && !WHEN.contains(&name) && !known.any(|(known, _)| known.name == name) {
            groups.push((name.to_string(), name.replace('_', " "), vec![(column, "")]));
        }
    }
    let moves = |(column, _): &(&SeriesColumn, &str)| {
        let mut values = column.values.iter();
        values.any(|value| *value != 0.0 && value.is_finite())
    };
    let mut blocks: Vec<Block> = settling(case, series, summary).into_iter().collect();
    for (name, title, mut columns) in groups {
        let logarithmic = name == LOGARITHMIC;
        if columns.iter().any(moves) {
            // On a logarithmic axis there is no place for what is zero.
            columns.retain(|column| !logarithmic || moves(column));
            blocks.push(over_time(case, series, &name, title, &columns, logarithmic));
        }
    }
    blocks
}

/// Settling velocity with its means.
fn settling(case: &str, series: &SeriesTable, summary: Option<&Summary>) -> Option<Block> {
    let (t_star, velocity) = (series.get(T_STAR)?, series.get(SETTLING)?);
    if velocity.iter().all(|value| *value == 0.0) {
        return None;
    }
    // Only where a settling velocity can be steady is there a mean, and something to compare it with.
    let steady = summary.filter(|summary| summary.settling_velocity_over_stokes.is_some());
    let mean = steady.and_then(|summary| {
        let estimate =
            Estimate { mean: summary.settling_velocity_over_stokes?, standard_error: summary.standard_error };
        Some((summary.averaged_over?, estimate))
    });
    let settled = steady.and_then(|summary| {
        let estimate =
            Estimate { mean: summary.settled_mean?, standard_error: summary.settled_standard_error };
        Some((summary.transient_end?, estimate))
    });
    let references = steady.map(|summary| settling_references(&summary.scales, summary.volume_fraction));
    let chart = settling_chart(&SettlingPlot {
        case,
        t_star,
        velocity,
        mean,
        settled,
        references: references.as_ref().map_or(&[], |references| &references[..]),
    });
    let note = match (steady, settled) {
        (Some(_), None) => "No end of the transient was found; it takes 80 rows of series.csv at least.",
        _ => "",
    };
    Some(Block::Figure {
        name: "settling_velocity".into(),
        title: "Settling velocity".into(),
        figure: Box::new(chart.figure()),
        note: note.into(),
    })
}

/// Columns over time, which is `t*` where the case has one.
fn over_time(
    case: &str,
    series: &SeriesTable,
    name: &str,
    title: String,
    columns: &[(&SeriesColumn, &str)],
    logarithmic: bool,
) -> Block {
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
    let chart = Chart::new(
        format!("{case}: {}", decapitalised(&title)),
        Axis::new(time, false),
        Axis::new(format!("{} ({unit})", decapitalised(&title)), logarithmic),
        lines.collect(),
    );
    Block::Figure { name: name.to_string(), title, figure: Box::new(chart.figure()), note: String::new() }
}

fn decapitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_ascii_lowercase());
    first.into_iter().chain(letters).collect()
}
