//! Profiles along the axes of the box, `profiles.csv`, and their means over time, `profile_means.csv`.

use super::growing::SeriesWriter;
use super::series::{SeriesTable, definitions, heads};
use super::statistics::{Estimate, estimate_mean};
use super::write_bytes;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

/// Quantities of `profiles.csv`, one row per profile, time and bin: names, units and definitions of their columns. Number densities by section follow.
const QUANTITIES: &str = "\
profile (-): Number of the profile in `output.profiles`, from 0.
step (-): Steps done.
t (s): Time, `step * time_step`.
position (m): Middle of the bin along the axis.
solid_fraction (-): Volume of the bodies within the bin over that of the bin; bodies are cut at its ends, spheres and polyhedra exactly.
number_density (1/m^3): Particles whose centres are in the bin over its volume.
particle_velocity_{x,y,z} (m/s): Their mean velocity; empty without particles, as are the next two.
particle_velocity_variance_{xx,yy,zz,xy,xz,yz} (m^2/s^2): Mean of `(v_i - <v_i>) (v_j - <v_j>)`; a third of the trace is the granular temperature.
angular_velocity_{x,y,z} (1/s): Their mean angular velocity.
contact_stress_{xx,yy,zz,xy,xz,yz} (Pa): As in `series.csv`, of the contacts whose point is in the bin, over its volume; empty if the engine does not tell its contacts.
fluid_velocity_{x,y,z} (m/s): Mean over the part of the cells that no body covers; empty without a fluid, as are the next two.
fluid_velocity_variance_{xx,yy,zz,xy,xz,yz} (m^2/s^2): Mean of `(u_i - <u_i>) (u_j - <u_j>)` there.
pressure (Pa): Mean pressure there.
";

/// Numbers that tell the bin and the time, in front.
const KEYS: usize = 4;

/// Header of `profiles.csv`: name and unit of every column but those of the number densities by section.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));

/// Definition of every quantity, by the name of its column without the axis.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| definitions(QUANTITIES));

/// Head of the column of the number density of a section.
fn of_section(section: usize) -> String {
    format!("number_density_particles.{section} (1/m^3)")
}

/// Creates `profiles.csv` for a case with this number of sections of particles.
pub fn create(path: &Path, sections: usize) -> Result<SeriesWriter> {
    SeriesWriter::with_columns(path, COLUMNS.iter().cloned().chain((0..sections).map(of_section)))
}

/// Writes `profile_means.csv`: of each bin in `profiles.csv` the mean of every quantity over the rows from a time (s) on, and its standard error, which knows
/// how long the values are correlated ([`statistics`](super::statistics)); empty where there are no values, or too few for an error.
///
/// # Errors
/// Of reading and writing the files.
pub fn write_means(profiles: &Path, means: &Path, from: f64) -> Result<()> {
    let table = SeriesTable::read(profiles)?;
    let column = |name: &str| table.get(name).unwrap_or_default();
    let [profile, time, position] = ["profile", "t", "position"].map(column);
    // Bits of numbers that are not negative have their order.
    let mut bins: BTreeMap<[u64; 2], Vec<usize>> = BTreeMap::new();
    for row in (0..profile.len()).filter(|&row| time[row] >= from) {
        bins.entry([profile[row], position[row]].map(f64::to_bits)).or_default().push(row);
    }
    let values = &table.columns[KEYS..];
    let mut head = vec!["profile (-)".to_string(), "position (m)".to_string(), "rows (-)".to_string()];
    for column in values {
        head.extend(["", "_error"].map(|of| format!("{}{of} ({})", column.name, column.unit)));
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| Error::io("write", means, error.into());
    writer.write_record(&head).map_err(failed)?;
    for (bin, rows) in &bins {
        let [profile, position] = bin.map(f64::from_bits);
        let mut record = vec![profile.to_string(), position.to_string(), rows.len().to_string()];
        for column in values {
            let known: Vec<f64> =
                rows.iter().map(|&row| column.values[row]).filter(|value| !value.is_nan()).collect();
            let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
            let estimate: Option<Estimate> = estimate_mean(&known);
            record.push(text(estimate.map(|estimate| estimate.mean)));
            record.push(text(estimate.and_then(|estimate| estimate.standard_error)));
        }
        writer.write_record(&record).map_err(failed)?;
    }
    let bytes = writer.into_inner().map_err(|error| Error::io("write", means, error.into_error()))?;
    write_bytes(means, &bytes)
}
