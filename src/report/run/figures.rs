//! The figures of a time series.

use super::super::Block;
use crate::output::picture::{SettlingPlot, settling_chart};
use crate::output::{Estimate, SeriesColumn, SeriesTable, Summary};
use crate::simulation::settling_references;
use turbid_plot::{Axis, Chart, Series, Style};

/// A figure of columns that have one unit.
struct Group {
    name: &'static str,
    title: &'static str,
    /// Names of the columns, and what they are called in the legend.
    columns: &'static [(&'static str, &'static str)],
    logarithmic: bool,
}

/// The part of the largest value from which values are shown on a logarithmic axis.
const SHOWN: f64 = 1e-5;
const TIME: &str = "t";
pub(super) const T_STAR: &str = "t_star";
pub(super) const SETTLING: &str = "settling_velocity_over_stokes";
/// Columns that say when.
const WHEN: [&str; 3] = ["step", TIME, T_STAR];

const GROUPS: [Group; 11] = [
    Group {
        name: "kinetic_energy",
        title: "Kinetic energy",
        columns: &[
            ("kinetic_energy_fluid", "fluid"),
            ("kinetic_energy_translation", "particles, translation"),
            ("kinetic_energy_rotation", "particles, rotation"),
        ],
        logarithmic: true,
    },
    Group {
        name: "contacts",
        title: "Contacts",
        columns: &[("contacts", "")],
        logarithmic: false,
    },
    Group {
        name: "overlap",
        title: "Largest overlap over the diameter",
        columns: &[("max_overlap", "")],
        logarithmic: false,
    },
    Group {
        name: "particle_speed",
        title: "Speed of the particles",
        columns: &[("max_particle_speed", "largest"), ("mean_particle_speed", "mean")],
        logarithmic: false,
    },
    Group {
        name: "particle_velocity",
        title: "Mean velocity of the particles",
        columns: &[
            ("mean_particle_velocity_x", "x"),
            ("mean_particle_velocity_y", "y"),
            ("mean_particle_velocity_z", "z"),
        ],
        logarithmic: false,
    },
    Group {
        name: "net_flux",
        title: "Mean velocity of the mixture",
        columns: &[("net_flux_x", "x"), ("net_flux_y", "y"), ("net_flux_z", "z")],
        logarithmic: false,
    },
    Group {
        name: "momentum",
        title: "Momentum",
        columns: &[("momentum_x", "x"), ("momentum_y", "y"), ("momentum_z", "z")],
        logarithmic: false,
    },
    Group {
        name: "wall_force",
        title: "Force of the particles on the walls",
        columns: &[
            ("wall_force_x", "x"),
            ("wall_force_y", "y"),
            ("wall_force_z", "z"),
        ],
        logarithmic: false,
    },
    Group {
        name: "gravitational_energy",
        title: "Gravitational energy",
        columns: &[("gravitational_energy", "")],
        logarithmic: false,
    },
    Group {
        name: "contact_stress",
        title: "Stress of the particles by contacts",
        columns: &[
            ("contact_stress_xx", "xx"),
            ("contact_stress_yy", "yy"),
            ("contact_stress_zz", "zz"),
            ("contact_stress_xy", "xy"),
            ("contact_stress_xz", "xz"),
            ("contact_stress_yz", "yz"),
        ],
        logarithmic: false,
    },
    Group {
        name: "hydrodynamic_stress",
        title: "Stress of the particles by the fluid",
        columns: &[
            ("hydrodynamic_stress_xx", "xx"),
            ("hydrodynamic_stress_yy", "yy"),
            ("hydrodynamic_stress_zz", "zz"),
            ("hydrodynamic_stress_xy", "xy"),
            ("hydrodynamic_stress_xz", "xz"),
            ("hydrodynamic_stress_yz", "yz"),
        ],
        logarithmic: false,
    },
];

/// Vectors of each wall: the beginning of the names of their columns, and a title.
const OF_WALLS: [(&str, &str); 2] = [
    ("fluid_force", "Force of the fluid on wall"),
    ("shear_stress", "Shear stress on wall"),
];

/// All figures that the series has something for; what is zero throughout is left out.
pub(super) fn all(case: &str, series: &SeriesTable, summary: Option<&Summary>) -> Vec<Block> {
    let mut blocks = Vec::new();
    blocks.extend(settling(case, series, summary));
    let moves = |column: &SeriesColumn| {
        column
            .values
            .iter()
            .any(|value| *value != 0.0 && value.is_finite())
    };
    let mut known: Vec<&str> = vec![SETTLING];
    known.extend(WHEN);
    for group in &GROUPS {
        let columns: Vec<(&SeriesColumn, &str)> = (group.columns.iter())
            .filter_map(|(name, label)| {
                let found = series.columns.iter().find(|column| column.name == *name)?;
                Some((found, *label))
            })
            // On a logarithmic axis there is no place for what is zero.
            .filter(|(column, _)| !group.logarithmic || moves(column))
            .collect();
        known.extend(group.columns.iter().map(|(name, _)| *name));
        if columns.iter().any(|(column, _)| moves(column)) {
            let title = group.title.to_string();
            blocks.push(over_time(
                case,
                series,
                group.name,
                title,
                &columns,
                group.logarithmic,
            ));
        }
    }
    for (what, title) in OF_WALLS {
        let walls = series.columns.iter().filter_map(|column| {
            let wall = column.name.strip_prefix(what)?.strip_prefix('_')?;
            wall.strip_suffix("_x")
        });
        for wall in walls {
            let name = format!("{what}_{wall}");
            let columns: Vec<(&SeriesColumn, &str)> = (["x", "y", "z"].into_iter())
                .filter_map(|axis| {
                    let is = |column: &&SeriesColumn| column.name == format!("{name}_{axis}");
                    Some((series.columns.iter().find(is)?, axis))
                })
                .collect();
            known.extend(columns.iter().map(|(column, _)| column.name.as_str()));
            if columns.iter().any(|(column, _)| moves(column)) {
                let title = format!("{title} {wall}");
                blocks.push(over_time(case, series, &name, title, &columns, false));
            }
        }
    }
    // Whatever else there is, each for itself.
    for column in series
        .columns
        .iter()
        .filter(|column| !known.contains(&column.name.as_str()))
    {
        if moves(column) {
            let title = column.name.replace('_', " ");
            blocks.push(over_time(
                case,
                series,
                &column.name,
                title,
                &[(column, "")],
                false,
            ));
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
        let estimate = Estimate {
            mean: summary.settling_velocity_over_stokes?,
            standard_error: summary.standard_error,
        };
        Some((summary.averaged_over?, estimate))
    });
    let settled = steady.and_then(|summary| {
        let estimate = Estimate {
            mean: summary.settled_mean?,
            standard_error: summary.settled_standard_error,
        };
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
    let least = if logarithmic {
        SHOWN * all.copied().fold(0.0, f64::max)
    } else {
        f64::NEG_INFINITY
    };
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
    Block::Figure {
        name: name.to_string(),
        title,
        figure: Box::new(chart.figure()),
        note: String::new(),
    }
}

fn decapitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_ascii_lowercase());
    first.into_iter().chain(letters).collect()
}
