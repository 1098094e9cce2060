//! What a run of a study has left, as named numbers.
//!
//! | quantities | of |
//! |---|---|
//! | every number of `summary.json`, those of `scales` by their own names | a run |
//! | every column of `series.csv`: its mean over the interval of the averages, with its standard error | a run |
//! | `contacts_per_particle`, `max_overlap`, `net_flux_over_stokes` | a run |
//! | `<window>_velocity`: settling velocity over that of Stokes, mean over a window of time by trapezia, without an error | a run |
//! | every number of `turbid bench --json`, `contacts_per_particle`, `memory_bytes` | a benchmark |
//! | `share_map`, `share_fluid`, ...: part of the time that a stage takes | both |

use super::file::WindowSection;
use serde::Deserialize;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use turbid::case::Setup;
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::output::series::COLUMNS;
use turbid::output::{OutputFiles, SeriesTable, estimate_mean, summary};

/// Name of the file with what a benchmark has measured.
pub const BENCH_FILE: &str = "bench.json";
/// Beginning of the names of shares of the time.
pub const SHARE: &str = "share_";

/// Standard errors by which a mean may differ from the one behind the transient.
const NOISE: f64 = 2.0;

/// Numbers of a benchmark.
const OF_A_BENCHMARK: &str = "mlups roofline_fraction bandwidth_gb_per_s messages_per_step bytes_per_step collectives_per_step \
    bytes_per_cell memory_per_rank_bytes ranks_per_process cells particles contacts threads ranks \
    memory_bytes contacts_per_particle wall_seconds steps";

/// The names of all quantities of runs, or of benchmarks, but shares of the time.
pub fn names(bench: bool) -> Vec<&'static str> {
    if bench {
        return OF_A_BENCHMARK.split_whitespace().collect();
    }
    let columns = COLUMNS.iter().filter_map(|head| head.split(" (").next());
    (summary::NUMBERS.split_whitespace().chain(columns))
        .chain(["contacts_per_particle", "net_flux_over_stokes"])
        .collect()
}

/// A number, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Its value.
    pub value: f64,
    /// Its standard error, if it is known.
    pub error: Option<f64>,
}

impl Quantity {
    /// Without a known error.
    pub fn exact(value: f64) -> Self {
        Self { value, error: None }
    }
}

/// Adds a number that is one.
fn put(quantities: &mut BTreeMap<String, Quantity>, name: &str, value: f64) {
    if value.is_finite() {
        quantities.insert(name.to_string(), Quantity::exact(value));
    }
}

/// What a run has left.
#[derive(Clone, Debug)]
pub struct Record {
    /// Its directory.
    pub directory: PathBuf,
    /// Version of the program that ran it.
    pub version: String,
    /// Interval of `t*` of the averages.
    pub averaged_over: Option<[f64; 2]>,
    /// Numbers by name.
    pub quantities: BTreeMap<String, Quantity>,
}

impl Record {
    /// A number by its name.
    pub fn get(&self, name: &str) -> Option<Quantity> {
        self.quantities.get(name).copied()
    }

    /// The value of a number by its name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.get(name).map(|quantity| quantity.value)
    }

    /// Whether the averages of a run are those of a steady state: the transient of its settling velocity ends before they begin, or
    /// makes no more than [`NOISE`] standard errors of a difference. No if no end of the transient was found, as in a series too
    /// short to tell; none for runs without a settling velocity.
    pub fn is_settled(&self) -> Option<bool> {
        let mean = self.value("settling_velocity_over_stokes")?;
        let settled = (self.value("transient_end")).zip(self.value("settled_mean"));
        Some(settled.is_some_and(|(end, settled)| {
            let error = self.value("settled_standard_error").unwrap_or(0.0);
            self.averaged_over.is_some_and(|[begin, _]| end <= begin)
                || (mean - settled).abs() <= NOISE * error
        }))
    }

    /// Of a run that has ended, whose summary is `summary`, with means over some windows of time.
    ///
    /// # Errors
    /// [`Error::Io`](turbid::error::Error::Io) or [`Error::Input`](turbid::error::Error::Input) if its series cannot be read.
    pub fn of_run<'a>(
        directory: &Path,
        summary: &Json,
        setup: &Setup,
        windows: impl Iterator<Item = &'a WindowSection>,
    ) -> Result<Self> {
        let mut quantities = numbers(summary);
        let averaged_over = Option::deserialize(&summary["averaged_over"]).ok().flatten();
        if let Some(error) = summary["standard_error"].as_f64()
            && let Some(velocity) = quantities.get_mut("settling_velocity_over_stokes")
        {
            velocity.error = Some(error);
        }
        quantities.extend(numbers(&summary["scales"]));
        shares(&mut quantities, &summary["stages"]);
        let series = Series::read(&OutputFiles::new(directory).series())?;
        let averaged = series.within(averaged_over);
        for (name, values) in &averaged.columns {
            if let Some(mean) = estimate_mean(values) {
                let (value, error) = (mean.mean, mean.standard_error);
                quantities.entry(name.clone()).or_insert(Quantity { value, error });
            }
        }
        let mut put = |name: &str, value: f64| put(&mut quantities, name, value);
        let particles = summary["particles"].as_f64().unwrap_or(f64::NAN);
        put("contacts_per_particle", averaged.mean("contacts") / particles);
        let flux = Vec3::from(["x", "y", "z"].map(|axis| averaged.mean(&format!("net_flux_{axis}"))));
        let along = flux.dot(&(setup.gravity / setup.gravity.norm()));
        if let Some(fluid) = &setup.fluid {
            put("net_flux_over_stokes", along / fluid.scales.stokes_velocity);
        }
        for window in windows {
            if let Some(mean) = series.over([window.from, window.to]) {
                put(&format!("{}_velocity", window.name.value), mean);
            }
        }
        let value = |name: &str| summary[name].as_f64();
        let steps = value("steps").unwrap_or(f64::NAN);
        // Of a run that was interrupted the time of the last part is known: all steps count at its speed.
        let done = steps - value("resumed_from").unwrap_or(0.0);
        let seconds = value("wall_seconds").unwrap_or(f64::NAN);
        put("wall_seconds", seconds * steps / done);
        put("mlups", done * value("cells").unwrap_or(f64::NAN) / seconds / 1e6);
        Ok(Self {
            directory: directory.to_path_buf(),
            version: summary["version"].as_str().unwrap_or_default().to_string(),
            averaged_over,
            quantities,
        })
    }

    /// Of a benchmark; `left` is what [`BENCH_FILE`] holds.
    pub fn of_bench(directory: &Path, left: &Json) -> Self {
        let report = &left["report"];
        let mut quantities = numbers(report);
        let of = |name: &str| report[name].as_f64().unwrap_or(f64::NAN);
        for (name, value) in [
            ("memory_bytes", of("bytes_per_cell") * of("cells")),
            ("contacts_per_particle", of("contacts") / of("particles")),
            ("wall_seconds", left["seconds"].as_f64().unwrap_or(f64::NAN)),
            ("steps", left["steps"].as_f64().unwrap_or(f64::NAN)),
        ] {
            put(&mut quantities, name, value);
        }
        shares(&mut quantities, &report["stages"]);
        Self {
            directory: directory.to_path_buf(),
            version: left["version"].as_str().unwrap_or_default().to_string(),
            averaged_over: None,
            quantities,
        }
    }
}

/// The numbers of a JSON object.
fn numbers(json: &Json) -> BTreeMap<String, Quantity> {
    let entries = json.as_object().into_iter().flatten();
    let numbers = entries.filter_map(|(name, value)| Some((name.clone(), Quantity::exact(value.as_f64()?))));
    numbers.collect()
}

/// Adds the part of the time that each stage takes.
fn shares(quantities: &mut BTreeMap<String, Quantity>, stages: &Json) {
    let times = numbers(stages);
    let total: f64 = times.values().map(|time| time.value).sum();
    for (stage, time) in times {
        put(quantities, &format!("{SHARE}{stage}"), time.value / total);
    }
}

/// The columns of `series.csv` by name.
struct Series {
    columns: BTreeMap<String, Vec<f64>>,
}

impl Series {
    fn read(path: &Path) -> Result<Self> {
        let columns = SeriesTable::read(path)?.columns.into_iter();
        let columns = columns.map(|column| (column.name, column.values)).collect();
        Ok(Self { columns })
    }

    fn column(&self, name: &str) -> &[f64] {
        self.columns.get(name).map_or(&[], Vec::as_slice)
    }

    /// The rows of an interval of `t*`; all where there is none.
    fn within(&self, interval: Option<[f64; 2]>) -> Self {
        let times = self.column("t_star");
        let inside = |row: usize| match (interval, times.get(row)) {
            (Some([from, to]), Some(t)) => (from..=to).contains(t),
            _ => true,
        };
        let keep = |values: &Vec<f64>| -> Vec<f64> {
            let rows = values.iter().enumerate().filter(|(row, _)| inside(*row));
            rows.map(|(_, value)| *value).collect()
        };
        let columns = self.columns.iter().map(|(name, values)| (name.clone(), keep(values)));
        Self { columns: columns.collect() }
    }

    fn mean(&self, name: &str) -> f64 {
        let values = self.column(name);
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Mean of the settling velocity over an interval of `t*` by trapezia, with values in between at its ends; none if the rows do not
    /// reach so far.
    fn over(&self, [from, to]: [f64; 2]) -> Option<f64> {
        let (times, velocities) = (self.column("t_star"), self.column("settling_velocity_over_stokes"));
        let rows: Vec<(f64, f64)> = times.iter().copied().zip(velocities.iter().copied()).collect();
        let reach = rows.first()?.0 <= from && from < to && to <= rows.last()?.0;
        let area = rows.windows(2).map(|pair| {
            let ((a, u), (b, v)) = (pair[0], pair[1]);
            let (low, high) = (from.max(a), to.min(b));
            let at = |t: f64| u + (v - u) * (t - a) / (b - a);
            if low < high { 0.5 * (at(low) + at(high)) * (high - low) } else { 0.0 }
        });
        reach.then(|| area.sum::<f64>() / (to - from))
    }
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
    }

    #[test]
    fn means_are_taken_over_the_rows_of_the_interval_alone() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        fs::write(&path, "t_star (-),contacts (-)\n0,100\n1,4\n2,6\n3,100\n").unwrap();
        let series = Series::read(&path).unwrap().within(Some([1.0, 2.0]));
        assert!((series.mean("contacts") - 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_mean_over_a_window_of_a_broken_line_is_exact_wherever_its_ends_are() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        // 2 t until t = 1, then 2.
        fs::write(&path, "t_star (-),settling_velocity_over_stokes (-)\n0,0\n1,2\n3,2\n").unwrap();
        let series = Series::read(&path).unwrap();
        assert!((series.over([0.5, 2.5]).unwrap() - 1.875).abs() < 1e-12);
        assert!((series.over([0.0, 3.0]).unwrap() - 5.0 / 3.0).abs() < 1e-12);
        assert!((series.over([1.2, 1.3]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(series.over([2.0, 3.1]), None, "the rows end before");
        assert_eq!(series.over([2.0, 2.0]), None);
    }

    #[test]
    fn the_shares_of_the_stages_add_up_to_one() {
        let mut quantities = BTreeMap::new();
        shares(&mut quantities, &serde_json::json!({"fluid": 3.0, "map": 1.0}));
        assert!((quantities["share_fluid"].value - 0.75).abs() < 1e-12);
        assert!((quantities["share_map"].value - 0.25).abs() < 1e-12);
    }
}
