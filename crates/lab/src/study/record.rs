//! Results of a run of a study, as named numbers.
//!
//! | quantities | of |
//! |---|---|
//! | every number of `summary.json`, those of `scales` by their own names | a run |
//! | every column of `series.csv`: its mean over the interval of the averages, with its standard error as for the settling velocity | a run |
//! | every column of `structure.csv`, self-diffusion coefficients and the velocity of the front, where a run has them, with their errors | a run |
//! | `contacts_per_particle`, `max_overlap`, `net_flux_over_stokes` | a run |
//! | `<window>_velocity`: settling velocity over that of Stokes, mean over a window of time by trapezia, without an error | a run |
//! | every number of `turbid bench --json`, `contacts_per_particle`, `memory_bytes` | a benchmark |
//! | `share_map`, `share_fluid`, ...: part of the time that a stage takes | both |

use super::prelude::*;
use serde::Deserialize;
use turbid::math::Vec3;
use turbid::output::series::COLUMNS;
use turbid::output::{SeriesTable, dynamics, estimate_settling, fronts, structure, summary};

pub(super) const BENCH_FILE: &str = "bench.json";
pub(super) const SHARE: &str = "share_";

/// Standard errors by which a mean may differ from the one after the transient.
const NOISE: f64 = 2.0;

const OF_A_BENCHMARK: &str = "mlups roofline_fraction bandwidth_gb_per_s messages_per_step bytes_per_step collectives_per_step \
    bytes_per_cell memory_per_rank_bytes ranks_per_process cells particles contacts threads ranks \
    fluid_only_mlups four_way_over_fluid_only dem_share nanoseconds_per_fluid_cell nanoseconds_per_covered_cell \
    nanoseconds_per_contact roofline_fraction_with_particles memory_bytes contacts_per_particle wall_seconds steps";

/// The names of all quantities of runs, or of benchmarks, except those of [`SHARE`].
pub(super) fn names(bench: bool) -> Vec<&'static str> {
    if bench {
        return OF_A_BENCHMARK.split_whitespace().collect();
    }
    let columns = COLUMNS.iter().filter_map(|head| head.split(" (").next());
    let numbers = summary::NUMBERS.split_whitespace().chain(columns);
    let structure = structure::COLUMNS.iter().filter_map(|head| head.split(" (").next());
    let numbers = numbers.chain(structure.skip(2)).chain(dynamics::DIFFUSION).chain([fronts::VELOCITY]);
    numbers.chain(["contacts_per_particle", "net_flux_over_stokes"]).collect()
}

/// A number with its standard error, if that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    pub value: f64,
    pub error: Option<f64>,
}

impl Quantity {
    pub fn exact(value: f64) -> Self {
        Self { value, error: None }
    }
}

#[derive(Clone, Debug)]
pub struct Record {
    pub directory: PathBuf,
    pub version: String,
    /// Interval of `t*` of the averages, if something settles.
    pub averaged_over: Option<[f64; 2]>,
    pub quantities: BTreeMap<String, Quantity>,
}

impl Record {
    /// With the numbers of a JSON object and the parts of the time that its stages take.
    fn new(directory: &Path, version: &Json, json: &Json) -> Self {
        let mut record = Self {
            directory: directory.to_path_buf(),
            version: version.as_str().unwrap_or_default().to_string(),
            averaged_over: None,
            quantities: numbers(json).map(|(name, value)| (name.clone(), Quantity::exact(value))).collect(),
        };
        let total: f64 = numbers(&json["stages"]).map(|(_, time)| time).sum();
        for (stage, time) in numbers(&json["stages"]) {
            record.put(&format!("{SHARE}{stage}"), time / total);
        }
        record
    }

    fn put(&mut self, name: &str, value: f64) {
        if value.is_finite() {
            self.quantities.insert(name.to_string(), Quantity::exact(value));
        }
    }

    pub fn get(&self, name: &str) -> Option<Quantity> {
        self.quantities.get(name).copied()
    }

    pub fn value(&self, name: &str) -> Option<f64> {
        self.get(name).map(|quantity| quantity.value)
    }

    /// Returns whether the averages of a run are those of a steady state: the transient of its settling velocity ends before
    /// they begin, or makes a difference of at most [`NOISE`] standard errors. No if no end of the transient was found, as in a series too
    /// short to tell; none for runs without a settling velocity, or in which nothing settles.
    pub fn is_settled(&self) -> Option<bool> {
        let mean = self.value("settling_velocity_over_stokes").filter(|mean| *mean != 0.0)?;
        let settled = self.value("transient_end").zip(self.value("settled_mean"));
        Some(settled.is_some_and(|(end, settled)| {
            let error = self.value("settled_standard_error").unwrap_or(0.0);
            self.averaged_over.is_some_and(|[begin, _]| end <= begin)
                || (mean - settled).abs() <= NOISE * error
        }))
    }

    /// Results of a finished run with this summary, with means over some windows of time.
    pub fn of_run(
        directory: &Path,
        summary: &Json,
        setup: &Setup,
        windows: &[Located<WindowSection>],
    ) -> Result<Self> {
        let mut record = Self::new(directory, &summary["version"], summary);
        record.averaged_over = Option::deserialize(&summary["averaged_over"]).ok().flatten();
        for (name, quantity) in &mut record.quantities {
            quantity.error = match name.as_str() {
                "settling_velocity_over_stokes" => summary["standard_error"].as_f64(),
                "settled_mean" => summary["settled_standard_error"].as_f64(),
                name => summary[format!("{name}_standard_error")].as_f64(),
            };
        }
        for (name, value) in numbers(&summary["scales"]) {
            record.put(name, value);
        }
        let series = SeriesTable::read(&OutputFiles::new(directory).series())?;
        let by_time =
            Option::deserialize(&summary["averaged_over_time"]).ok().flatten().map(|over| ("t", over));
        let averaged = within(&series, by_time.or(record.averaged_over.map(|over| ("t_star", over))));
        // What a suspension does depends on its arrangement, as its velocity does.
        let distance = record.value("averaged_over_distance").unwrap_or(f64::INFINITY);
        for column in &averaged.columns {
            let mean = estimate_settling(&column.values, distance).filter(|mean| mean.mean.is_finite());
            if let Some(mean) = mean {
                let quantity = Quantity { value: mean.mean, error: mean.standard_error };
                record.quantities.entry(column.name.clone()).or_insert(quantity);
            }
        }
        for (name, average) in summary["averages"].as_object().into_iter().flatten() {
            if let Some(value) = average["mean"].as_f64() {
                let quantity = Quantity { value, error: average["standard_error"].as_f64() };
                record.quantities.entry(name.clone()).or_insert(quantity);
            }
        }
        let particles = summary["particles"].as_f64().unwrap_or(f64::NAN);
        record.put("contacts_per_particle", mean(&averaged, "contacts") / particles);
        let flux = Vec3::from(["x", "y", "z"].map(|axis| mean(&averaged, &format!("net_flux_{axis}"))));
        let along = flux.dot(&(setup.gravity / setup.gravity.norm()));
        if let Some(fluid) = &setup.fluid {
            record.put("net_flux_over_stokes", along / fluid.scales.stokes_velocity);
        }
        for Located { value: window, .. } in windows {
            if let Some(mean) = mean_velocity(&series, [window.from, window.to]) {
                record.put(&window.quantity(), mean);
            }
        }
        let value = |name: &str| summary[name].as_f64();
        let steps = value("steps").unwrap_or(f64::NAN);
        // Of an interrupted run the time of the last part is known: all steps count at its speed.
        let done = steps - value("resumed_from").unwrap_or(0.0);
        let seconds = value("wall_seconds").unwrap_or(f64::NAN);
        record.put("wall_seconds", seconds * steps / done);
        record.put("mlups", done * value("cells").unwrap_or(f64::NAN) / seconds / 1e6);
        Ok(record)
    }

    /// Results of a benchmark, from the contents of [`BENCH_FILE`].
    pub fn of_bench(directory: &Path, json: &Json) -> Self {
        let report = &json["report"];
        let mut record = Self::new(directory, &json["version"], report);
        let [bytes_per_cell, cells, contacts, particles] =
            ["bytes_per_cell", "cells", "contacts", "particles"]
                .map(|name| report[name].as_f64().unwrap_or(f64::NAN));
        record.put("memory_bytes", bytes_per_cell * cells);
        record.put("contacts_per_particle", contacts / particles);
        record.put("wall_seconds", json["seconds"].as_f64().unwrap_or(f64::NAN));
        record.put("steps", json["steps"].as_f64().unwrap_or(f64::NAN));
        record
    }
}

fn numbers(json: &Json) -> impl Iterator<Item = (&String, f64)> {
    let entries = json.as_object().into_iter().flatten();
    entries.filter_map(|(name, value)| Some((name, value.as_f64()?)))
}

fn column<'a>(series: &'a SeriesTable, name: &str) -> &'a [f64] {
    series.get(name).unwrap_or_default()
}

/// The rows in an interval of a column of times; all without one.
fn within(series: &SeriesTable, interval: Option<(&str, [f64; 2])>) -> SeriesTable {
    let Some((times, [from, to])) = interval else {
        return series.clone();
    };
    let times = column(series, times);
    let mut inside = series.clone();
    for column in &mut inside.columns {
        let mut row = 0..;
        column
            .values
            .retain(|_| row.next().and_then(|row| times.get(row)).is_none_or(|t| (from..=to).contains(t)));
    }
    inside
}

fn mean(series: &SeriesTable, name: &str) -> f64 {
    let values = column(series, name);
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean of the settling velocity over an interval of `t*` by trapezia, interpolated at its ends; none if the rows end before.
fn mean_velocity(series: &SeriesTable, [from, to]: [f64; 2]) -> Option<f64> {
    let (times, velocities) = (column(series, "t_star"), column(series, "settling_velocity_over_stokes"));
    let rows: Vec<(f64, f64)> = times.iter().copied().zip(velocities.iter().copied()).collect();
    let is_covered = rows.first()?.0 <= from && from < to && to <= rows.last()?.0;
    let area = rows.windows(2).map(|pair| {
        let ((a, u), (b, v)) = (pair[0], pair[1]);
        let (low, high) = (from.max(a), to.min(b));
        let at = |t: f64| u + (v - u) * (t - a) / (b - a);
        if low < high { 0.5 * (at(low) + at(high)) * (high - low) } else { 0.0 }
    });
    is_covered.then(|| area.sum::<f64>() / (to - from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_mean_is_settled_if_the_transient_ends_before_it_begins_or_makes_no_difference() {
        let record = |numbers: &[(&str, f64)]| Record {
            directory: PathBuf::new(),
            version: String::new(),
            averaged_over: Some([30.0, 90.0]),
            quantities: (numbers.iter())
                .map(|&(name, value)| (name.to_string(), Quantity { value, error: None }))
                .collect(),
        };
        let of = |mean: f64, end: f64| {
            record(&[
                ("settling_velocity_over_stokes", mean),
                ("transient_end", end),
                ("settled_mean", 0.3),
                ("settled_standard_error", 0.01),
            ])
        };
        assert_eq!(of(0.4, 30.0).is_settled(), Some(true));
        assert_eq!(of(0.4, 31.0).is_settled(), Some(false));
        assert_eq!(of(0.31, 31.0).is_settled(), Some(true), "the same within its error");
        let endless = record(&[("settling_velocity_over_stokes", 0.3)]);
        assert_eq!(endless.is_settled(), Some(false));
        assert_eq!(record(&[("mlups", 100.0)]).is_settled(), None);
        assert_eq!(of(0.0, 31.0).is_settled(), None, "nothing settles in a shear flow without gravity");
    }

    #[test]
    fn numbers_of_a_summary_have_their_standard_errors() {
        let place = tempfile::tempdir().unwrap();
        fs::write(OutputFiles::new(place.path()).series(), "t (s),contacts (-)\n0,100\n1,4\n2,6\n").unwrap();
        let summary = serde_json::json!({
            "drag_over_stokes": 4.3, "drag_over_stokes_standard_error": 0.02, "permeability": 1e-8,
            "settling_velocity_over_stokes": 0.2, "standard_error": 0.01, "averaged_over_time": [1.0, 2.0],
            "particles": 5,
        });
        let case = turbid::case::from_text(
            "domain.size = [4e-3, 4e-3, 4e-3]\nfluid = { density = 1000, viscosity = 1e-5 }\nrun.end.steps = 8\n\
             lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }\n\
             particles = [{ shape.sphere.diameter = 1e-3, density = 2000, count = 1 }]",
            "one",
            &[],
        );
        let record = Record::of_run(place.path(), &summary, &case.unwrap(), &[]).unwrap();
        let error = |name: &str| record.get(name).unwrap().error;
        assert_eq!(error("drag_over_stokes"), Some(0.02));
        assert_eq!(error("settling_velocity_over_stokes"), Some(0.01));
        assert_eq!(error("permeability"), None);
        assert_eq!(record.value("contacts_per_particle"), Some(1.0), "without an interval of t*, by time");
    }

    #[test]
    fn means_are_taken_over_the_rows_of_the_interval_alone() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        fs::write(&path, "t_star (-),contacts (-)\n0,100\n1,4\n2,6\n3,100\n").unwrap();
        let series = within(&SeriesTable::read(&path).unwrap(), Some(("t_star", [1.0, 2.0])));
        assert!((mean(&series, "contacts") - 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_mean_over_a_window_of_a_broken_line_is_exact_wherever_its_ends_are() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        // 2 t until t = 1, then 2.
        fs::write(&path, "t_star (-),settling_velocity_over_stokes (-)\n0,0\n1,2\n3,2\n").unwrap();
        let series = SeriesTable::read(&path).unwrap();
        let over = |window| mean_velocity(&series, window);
        assert!((over([0.5, 2.5]).unwrap() - 1.875).abs() < 1e-12);
        assert!((over([0.0, 3.0]).unwrap() - 5.0 / 3.0).abs() < 1e-12);
        assert!((over([1.2, 1.3]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(over([2.0, 3.1]), None, "the rows end before");
        assert_eq!(over([2.0, 2.0]), None);
    }

    #[test]
    fn the_parts_of_the_stages_add_up_to_one() {
        let json = serde_json::json!({ "stages": { "fluid": 3.0, "map": 1.0 } });
        let record = Record::new(Path::new(""), &json["version"], &json);
        assert!((record.value("share_fluid").unwrap() - 0.75).abs() < 1e-12);
        assert!((record.value("share_map").unwrap() - 0.25).abs() < 1e-12);
    }
}
