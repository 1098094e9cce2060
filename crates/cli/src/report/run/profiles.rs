//! The figures of the profiles: means over time along the axes of the box.

use crate::report::section::Section;
use turbid::output::SeriesTable;
use turbid_plot::{Axis, Chart, Point, Series, Style, literal};

/// Columns that share a figure, with their labels: title, unit, and the columns.
type Group = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const GROUPS: [Group; 6] = [
    ("solid fraction", "-", &[("solid_fraction", "")]),
    (
        "mean velocity",
        "m/s",
        &[
            ("particle_velocity_x", "particles, x"),
            ("particle_velocity_y", "particles, y"),
            ("particle_velocity_z", "particles, z"),
            ("fluid_velocity_x", "fluid, x"),
            ("fluid_velocity_y", "fluid, y"),
            ("fluid_velocity_z", "fluid, z"),
        ],
    ),
    (
        "variance of the particle velocity",
        "m^2/s^2",
        &[
            ("particle_velocity_variance_xx", "xx"),
            ("particle_velocity_variance_yy", "yy"),
            ("particle_velocity_variance_zz", "zz"),
        ],
    ),
    (
        "angular velocity of the particles",
        "1/s",
        &[("angular_velocity_x", "x"), ("angular_velocity_y", "y"), ("angular_velocity_z", "z")],
    ),
    ("pressure", "Pa", &[("pressure", "")]),
    (
        "stress by contacts",
        "Pa",
        &[
            ("contact_stress_xx", "xx"),
            ("contact_stress_yy", "yy"),
            ("contact_stress_zz", "zz"),
            ("contact_stress_xy", "xy"),
            ("contact_stress_xz", "xz"),
            ("contact_stress_yz", "yz"),
        ],
    ),
];

/// Adds a figure of each group for each profile, without what is zero throughout.
pub(super) fn all(section: &mut Section, means: &SeriesTable) {
    let column = |name: &str| means.get(name).unwrap_or_default();
    let (profile, position) = (column("profile"), column("position"));
    let count = profile.iter().copied().fold(-1.0, f64::max) as i64 + 1;
    for number in 0..count {
        let rows: Vec<usize> =
            (0..profile.len()).filter(|&row| profile[row].to_bits() == (number as f64).to_bits()).collect();
        for (title, unit, columns) in GROUPS {
            let curve = |(name, label): &(&str, &str)| {
                let (values, errors) = (means.get(name)?, column(&format!("{name}_error")));
                let point = |&row: &usize| Point {
                    x: position[row],
                    y: values[row],
                    error: errors.get(row).copied().filter(|error| error.is_finite()),
                };
                let points: Vec<Point> = rows.iter().map(point).collect();
                let shows = points.iter().any(|point| point.y.is_finite() && point.y != 0.0);
                shows.then(|| Series { label: (*label).to_string(), style: Style::Measured, points })
            };
            let series: Vec<Series> = columns.iter().filter_map(curve).collect();
            if series.is_empty() {
                continue;
            }
            let mut chart = Chart::new(
                format!("{}: {title}, profile {number}", literal(&section.title)),
                Axis::new("position (m)", false),
                Axis::new(format!("{title} ({unit})"), false),
                series,
            );
            chart.note = "Means over time; bars: standard error.".to_string();
            let name = format!("profile_{number}_{}", title.replace(' ', "_"));
            section.figure(&name, &format!("Profile {number}: {title}"), chart.figure(), "");
        }
    }
}
