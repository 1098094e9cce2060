//! Heights of the front of a settling suspension and of its bed over time, `fronts.csv`, from the profiles along the direction of settling.
//!
//! ```text
//! phi_0 = sum phi^2 / sum phi           at the first time: the mean over the particles of the fraction about them
//! front    highest crossing of phi_0 / 2                       bed    highest crossing of (phi_0 + 0.555) / 2
//! ```
//!
//! Heights count from the face towards which the particles settle; the fraction is interpolated between the middles of the bins. The front is
//! that between suspension and clear fluid, at half of the fraction as where light or attenuation is measured (Davis and Hassen 1988,
//! doi:10.1017/S0022112088003051); the bed begins half-way to the loosest random packing of spheres (Onoda and Liniger 1990,
//! doi:10.1103/PhysRevLett.64.2727). The velocity of the front is the slope of the line by least squares from where the front has come down by a
//! diameter to where it is a quarter of its first height above the bed (Kynch 1952, doi:10.1039/TF9524800166: it is constant until both meet).

use super::atomic::write_table;
use super::averages::Average;
use super::series::{SeriesTable, definitions, heads};
use super::statistics::estimate_slope;
use crate::error::Result;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

/// Quantities of `fronts.csv`, one row per time.
const QUANTITIES: &str = "\
profile (-): Number of the profile in `output.profiles`, from 0: the first one along the settling direction of a box that is closed in it.
step (-): Steps done.
t (s): Time, `step * time_step`.
front_height (m): Height of the front between suspension and clear fluid, where the solid fraction falls through half of that at the start.
bed_height (m): Height of the bed, where the solid fraction falls through the middle between that at the start and 0.555; 0 before there is one.
";

/// Header of `fronts.csv`.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));
/// Definition of every quantity.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| definitions(QUANTITIES));

/// Solid fraction of the loosest random packing of spheres.
const LOOSE: f64 = 0.555;
/// Part of the first height of the front over the bed that is left at the end of the fit.
const LEFT: f64 = 0.25;
/// Name of the velocity of the front in the averages.
pub const VELOCITY: &str = "front_velocity";

/// A profile along the direction of settling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its number.
    pub profile: usize,
    /// Length of the box along its axis (m).
    pub length: f64,
    /// The particles settle against its axis.
    pub downwards: bool,
    /// Diameter of the first kind of particle (m).
    pub diameter: f64,
}

/// A time with the heights (m) of front and bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heights {
    /// Steps done.
    pub step: f64,
    /// Time (s).
    pub time: f64,
    /// Height of the front (m).
    pub front: f64,
    /// Height of the bed (m).
    pub bed: f64,
}

impl Column {
    /// Heights at all times of `profiles.csv`; empty without particles.
    pub fn heights(&self, profiles: &SeriesTable) -> Vec<Heights> {
        let column = |name: &str| profiles.get(name).unwrap_or_default();
        let [profile, step, time] = ["profile", "step", "t"].map(column);
        let [position, fraction] = ["position", "solid_fraction"].map(column);
        let mut moments: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for row in (0..profile.len()).filter(|&row| profile[row] as usize == self.profile) {
            moments.entry(step[row] as u64).or_default().push(row);
        }
        let mut start = None;
        let heights = moments.values().filter_map(|rows| {
            let mut bins: Vec<[f64; 2]> = rows
                .iter()
                .map(|&row| {
                    let z = position[row];
                    [if self.downwards { z } else { self.length - z }, fraction[row]]
                })
                .collect();
            bins.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let sum = |power: i32| bins.iter().map(|bin| bin[1].powi(power)).sum::<f64>();
            let first = *start.get_or_insert_with(|| sum(2) / sum(1));
            let row = rows[0];
            first.is_finite().then(|| Heights {
                step: step[row],
                time: time[row],
                front: self.crossing(&bins, 0.5 * first),
                bed: self.crossing(&bins, 0.5 * (first + LOOSE)),
            })
        });
        heights.collect()
    }

    /// Greatest height (m) at which the fraction in bins, from the lowest on, falls through a value; 0 if it is nowhere reached.
    fn crossing(&self, bins: &[[f64; 2]], value: f64) -> f64 {
        let Some(below) = bins.iter().rposition(|bin| bin[1] >= value) else { return 0.0 };
        let [z, fraction] = bins[below];
        match bins.get(below + 1) {
            Some([above, less]) => z + (above - z) * (fraction - value) / (fraction - less),
            None => self.length,
        }
    }

    /// Velocity (m/s) at which the front comes down, positive in the direction of settling, and its error; `None` without an interval of the fit.
    pub fn velocity(&self, heights: &[Heights]) -> Option<Average> {
        let first = heights.first()?.front;
        let points = heights
            .iter()
            .skip_while(|at| at.front > first - self.diameter)
            .take_while(|at| at.front - at.bed > LEFT * first);
        let points: Vec<[f64; 2]> = points.map(|at| [at.time, -at.front]).collect();
        Some(Average::of("m/s", estimate_slope(&points)?))
    }

    /// Writes `fronts.csv` from `profiles.csv`, and returns the velocity of the front.
    ///
    /// # Errors
    /// Of reading and writing the files.
    pub fn write(&self, profiles: &Path, fronts: &Path) -> Result<Option<(String, Average)>> {
        let heights = self.heights(&SeriesTable::read(profiles)?);
        let rows = heights.iter().map(|at| {
            let row = [self.profile as f64, at.step, at.time, at.front, at.bed];
            row.map(|number| number.to_string()).into()
        });
        write_table(fronts, &COLUMNS, rows)?;
        Ok(self.velocity(&heights).map(|velocity| (VELOCITY.to_string(), velocity)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::series::SeriesColumn;
    use super::*;

    const COLUMN: Column = Column { profile: 1, length: 10.0, downwards: true, diameter: 0.5 };

    /// A front that falls at 0.1 from 9 in a suspension of 0.2, over a bed of 0.6 that rises at 0.04, in bins of 0.5.
    fn profiles(downwards: bool) -> SeriesTable {
        let mut rows = Vec::new();
        for step in 0..60 {
            let time = f64::from(step);
            let (front, bed) = (9.0 - 0.1 * time, 0.04 * time);
            for bin in 0..20 {
                let [low, high] = [0, 1].map(|end| 0.5 * f64::from(bin + end));
                let part = |to: f64| (to.clamp(low, high) - low) / 0.5;
                let fraction = 0.6 * part(bed) + 0.2 * (part(front) - part(bed));
                let z = 0.5 * (low + high);
                rows.push([1.0, time, time, if downwards { z } else { 10.0 - z }, fraction]);
            }
        }
        let names = ["profile", "step", "t", "position", "solid_fraction"];
        let column = |(k, name): (usize, &str)| SeriesColumn {
            name: name.to_string(),
            unit: "-".to_string(),
            values: rows.iter().map(|row| row[k]).collect(),
        };
        SeriesTable { columns: names.into_iter().enumerate().map(column).collect() }
    }

    #[test]
    fn heights_are_those_of_sharp_fronts_within_an_eighth_of_a_bin_and_the_velocity_within_a_hundredth() {
        for downwards in [true, false] {
            let column = Column { downwards, ..COLUMN };
            let heights = column.heights(&profiles(downwards));
            assert_eq!(heights.len(), 60);
            for at in &heights {
                assert!((at.front - (9.0 - 0.1 * at.time)).abs() < 0.125 * 0.5, "{at:?}");
                // A bed that fills less than a bin is not seen.
                assert!(at.time < 15.0 || (at.bed - 0.04 * at.time).abs() < 0.25 * 0.5, "{at:?}");
            }
            let velocity = column.velocity(&heights).unwrap();
            assert!((velocity.mean - 0.1).abs() < 0.001, "{velocity:?}");
            assert!(velocity.standard_error.unwrap() < 0.001, "{velocity:?}");
        }
    }

    #[test]
    fn without_particles_there_is_no_front() {
        let mut empty = profiles(true);
        empty.columns[4].values.fill(0.0);
        assert!(COLUMN.heights(&empty).is_empty() && COLUMN.velocity(&[]).is_none());
    }
}
