//! Results of a study: `study.json`, resolved to numbers, which `turbid report` draws, and `result.csv`, a row for each finished
//! run.

use super::prelude::*;
pub use crate::checks::Figure;
use serde::{Deserialize, Serialize};

/// Name of the document in the directory of a study.
pub const FILE: &str = "study.json";
/// Name of the table of all runs beside it.
pub const RESULT: &str = "result.csv";

/// Columns of `result.csv` for a run; quantities that it does not have stay empty.
const OF_A_RUN: &str = "archimedes volume_fraction particles cells_per_diameter relaxation_time \
    settling_velocity_over_stokes standard_error drift averaged_from averaged_to settled \
    contacts_per_particle max_overlap net_flux_over_stokes cells steps mlups wall_seconds \
    relative_viscosity relative_viscosity_standard_error shear_rate shear_strain shear_reynolds \
    superficial_velocity superficial_velocity_standard_error drag drag_standard_error \
    drag_over_stokes drag_over_stokes_standard_error permeability permeability_standard_error";

/// The same for a benchmark, before the parts of the time of the stages.
const OF_A_BENCHMARK: &str = "cells particles contacts_per_particle mlups roofline_fraction bandwidth_gb_per_s memory_bytes \
    threads steps wall_seconds";

/// Definition of every column of `result.csv` that is neither a key of `summary.json` nor one of `turbid bench --json`.
pub const DEFINITIONS: [(&str, &str); 8] = [
    ("averaged_from", "Beginning of the interval of the averages (t*)."),
    ("averaged_to", "Its end (t*)."),
    (
        "settled",
        "1 if the average begins after the transient of the settling velocity, 0 if not; empty if nothing settles.",
    ),
    ("contacts_per_particle", "Mean number of contacts over the number of particles (-)."),
    ("max_overlap", "Mean over the averages of the column of `series.csv` (-)."),
    ("net_flux_over_stokes", "Mean velocity of the mixture along gravity over the Stokes velocity (-)."),
    ("memory_bytes", "Memory of the fluid, all ranks (B)."),
    ("wall_seconds", "Time of all steps (s)."),
];

/// Columns of `result.csv` after those of the axes, of runs or of benchmarks; those of windows, and of benchmarks the parts of the time,
/// follow.
pub fn result_columns(bench: bool) -> impl Iterator<Item = &'static str> {
    (if bench { OF_A_BENCHMARK } else { OF_A_RUN }).split_whitespace()
}

/// A study in numbers. Its JSON keys are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Document {
    pub title: String,
    pub version: String,
    pub command: String,
    pub figures: Vec<Figure>,
    pub tables: Vec<Table>,
    pub checks: Vec<Check>,
    pub runs: Runs,
    /// Names of the runs whose means have not settled, by [`Record::is_settled`].
    #[serde(default)]
    pub unsettled: Vec<String>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    pub name: String,
    pub title: String,
    pub columns: Vec<String>,
    /// Rows, each as long as `columns`.
    pub rows: Vec<Vec<String>>,
    /// Below it; may be empty.
    #[serde(default)]
    pub note: String,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    pub done: usize,
    pub total: usize,
    /// Time that the steps of all runs have taken so far (s).
    pub seconds_spent: f64,
    /// Time that the others will take, estimated (s).
    pub seconds_left: f64,
}

impl Document {
    pub fn write(&self, directory: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("plain data always serialises") + "\n";
        write_bytes(&directory.join(FILE), text.as_bytes())
    }
}

pub(super) fn write_csv(study: &Study) -> Result<()> {
    let names = columns(study);
    let axes = &study.plan.axes;
    let head = axes.iter().map(|axis| axis.name.as_str()).chain(names.iter().map(String::as_str));
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["run"].into_iter().chain(head).chain(["version"])).expect("memory takes any row");
    for (run, state) in study.plan.runs.iter().zip(&study.states) {
        let Some(record) = state.record() else {
            continue;
        };
        let mut row = vec![run.name.clone()];
        row.extend(axes.iter().zip(&run.at).map(|(axis, &at)| axis.values[at].name.clone()));
        row.extend(names.iter().map(|name| cell(record, name)));
        row.push(record.version.clone());
        table.write_record(row).expect("memory takes any row");
    }
    let text = table.into_inner().expect("memory takes any row");
    write_bytes(&study.out.join(RESULT), &text)
}

fn columns(study: &Study) -> Vec<String> {
    let is_bench = study.file.bench.is_some();
    let mut names: Vec<String> = result_columns(is_bench).map(String::from).collect();
    if is_bench {
        let quantities =
            study.states.iter().filter_map(State::record).flat_map(|record| record.quantities.keys());
        let parts: BTreeSet<&String> = quantities.filter(|name| name.starts_with(SHARE)).collect();
        names.extend(parts.into_iter().cloned());
    }
    names.extend(study.window_quantities());
    names
}

fn cell(record: &Record, name: &str) -> String {
    let value = match name {
        "averaged_from" => record.averaged_over.map(|over| over[0]),
        "averaged_to" => record.averaged_over.map(|over| over[1]),
        "settled" => record.is_settled().map(|is| f64::from(u8::from(is))),
        _ => record.value(name),
    };
    value.map_or_else(String::new, |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid_plot::{Chart, Panel, Point, Series, Style};

    #[test]
    fn a_document_survives_being_written_and_read() {
        let point = Point { x: 0.1, y: 0.27, error: None };
        let series = Series { label: "spheres".into(), style: Style::Dashed, points: vec![point] };
        let panel = Panel { title: "Ar 500".into(), series: vec![series], ..Panel::default() };
        let document = Document {
            title: "A study".into(),
            figures: vec![Figure {
                name: "velocity".into(),
                chart: Chart { panels: vec![panel], ..Chart::default() },
            }],
            runs: Runs { done: 1, total: 2, seconds_spent: 3.5, seconds_left: 4.0 },
            ..Document::default()
        };
        let place = tempfile::tempdir().unwrap();
        document.write(place.path()).unwrap();
        let text = std::fs::read_to_string(place.path().join(FILE)).unwrap();
        assert_eq!(serde_json::from_str::<Document>(&text).unwrap(), document);
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["figures"][0]["panels"][0]["series"][0]["style"], "dashed");
        assert!(json["figures"][0]["panels"][0]["series"][0]["points"][0]["error"].is_null());
    }
}
