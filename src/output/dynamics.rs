//! Table of the motion of particles over time, `dynamics.csv`, and the self-diffusion coefficient that follows from it.
//!
//! ```text
//! <dx_a^2>(s) = <(dx_a - <dx_a>)^2>      displacements from the origin of a block over the lag s
//! D_a = 1/2 d<dx_a^2> / ds               slope of the line by least squares through the later half of the lags of a block
//! ```
//!
//! Blocks follow each other and are taken as independent: the error of `D` is that of the mean over them
//! ([`estimate_independent`]). It is the coefficient of long times if the lags are longer than velocities and arrangements are remembered; a
//! shorter block gives less.
//!
//! # Reference
//! Allen and Tildesley (2017), Computer Simulation of Liquids, sections 2.7 and 8.4.

use super::averages::Average;
use super::means::Bins;
use super::series::{SeriesTable, definitions, heads};
use super::statistics::{estimate_independent, estimate_slope};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Quantities of `dynamics.csv`, one row per sample.
const QUANTITIES: &str = "\
block (-): Number of the block, from 0.
origin (s): Time of its first sample, from which displacements count; the last one of the block before.
lag (s): Time since then.
step (-): Steps done.
t (s): Time, `step * time_step`.
tracers (-): Number of particles that are followed: all that move freely in boxes of up to 4096, else every second, third, ... by their ids.
mean_squared_displacement_{x,y,z} (m^2): Mean of `(dx - <dx>)^2` over the tracers, `dx` the displacement since the origin, not wrapped into the box, and \
    `<dx>` the mean of all of them. In a shear flow the direction of the flow also has what the flow carries apart.
velocity_autocorrelation_{x,y,z} (m^2/s^2): Mean of `(v(0) - <v(0)>) (v(s) - <v(s)>)` over the tracers, `v(0)` at the origin; at the origin itself \
    the variance.
";

/// Header of `dynamics.csv`.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));
/// Definition of every quantity, by the name of its column without the axis.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| definitions(QUANTITIES));
/// The bins of `dynamics.csv`: lags.
pub const BINS: Bins = Bins { keys: &["lag"], time: "origin", front: 5, independent: true };

/// Names of the averages that follow from the displacements.
pub const DIFFUSION: [&str; 4] = ["diffusion_x", "diffusion_y", "diffusion_z", "diffusion"];

/// The self-diffusion coefficients (m^2/s) along the axes, and the mean of the three, from the whole blocks of `dynamics.csv` that begin at a time (s) or
/// later. Nothing without such a block.
pub fn diffusion(table: &SeriesTable, from: f64) -> Vec<(String, Average)> {
    let column = |name: &str| table.get(name).unwrap_or_default();
    let (block, origin, lag) = (column("block"), column("origin"), column("lag"));
    let mut blocks: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for row in (0..block.len()).filter(|&row| origin[row] >= from) {
        blocks.entry(block[row] as u64).or_default().push(row);
    }
    let longest = blocks.values().map(Vec::len).max().unwrap_or(0);
    blocks.retain(|_, rows| rows.len() == longest && longest > 2);
    let mut of_axes: [Vec<f64>; 4] = Default::default();
    for rows in blocks.values() {
        let later = &rows[rows.len() / 2..];
        let slopes = ["x", "y", "z"].map(|axis| {
            let squares = column(&format!("mean_squared_displacement_{axis}"));
            let points: Vec<[f64; 2]> = later.iter().map(|&row| [lag[row], squares[row]]).collect();
            0.5 * estimate_slope(&points).map_or(f64::NAN, |slope| slope.mean)
        });
        slopes.iter().zip(&mut of_axes).for_each(|(slope, of)| of.push(*slope));
        of_axes[3].push(slopes.iter().sum::<f64>() / 3.0);
    }
    let named = DIFFUSION.iter().zip(&of_axes);
    named
        .filter_map(|(name, values)| {
            Some((name.to_string(), Average::of("m^2/s", estimate_independent(values)?)))
        })
        .collect()
}
