//! `result.csv`: a row for each run that has ended.

use super::Study;
use super::record::Record;
use crate::error::Result;
use crate::output::write_bytes;

/// Name of the file in the directory of a study.
pub(crate) const FILE: &str = "result.csv";

/// Quantities of a run; those that it does not have stay empty.
const OF_A_RUN: [&str; 18] = [
    "archimedes",
    "volume_fraction",
    "particles",
    "cells_per_diameter",
    "relaxation_time",
    "settling_velocity_over_stokes",
    "standard_error",
    "drift",
    "averaged_from",
    "averaged_to",
    "settled",
    "contacts_per_particle",
    "max_overlap",
    "net_flux_over_stokes",
    "cells",
    "steps",
    "mlups",
    "wall_seconds",
];

/// Quantities of a benchmark, before the shares of the stages.
const OF_A_BENCHMARK: [&str; 10] = [
    "cells",
    "particles",
    "contacts_per_particle",
    "mlups",
    "roofline_fraction",
    "bandwidth_gb_per_s",
    "memory_bytes",
    "threads",
    "steps",
    "wall_seconds",
];

/// Writes the file; it appears whole.
pub(super) fn write_csv(study: &Study) -> Result<()> {
    let names = columns(study);
    let mut table = csv::Writer::from_writer(Vec::new());
    let axes = study.plan.axes.iter().map(|axis| axis.name.as_str());
    let head = std::iter::once("run")
        .chain(axes)
        .chain(names.iter().map(String::as_str))
        .chain(["version"]);
    table.write_record(head).expect("memory takes any row");
    for (run, state) in study.plan.runs.iter().zip(&study.states) {
        let Some(record) = state.record() else {
            continue;
        };
        let values = (study.plan.axes.iter().zip(&run.at)).map(|(axis, &at)| axis.values[at].name.clone());
        let row = std::iter::once(run.name.clone())
            .chain(values)
            .chain(names.iter().map(|name| cell(record, name)))
            .chain([record.version.clone()]);
        table.write_record(row).expect("memory takes any row");
    }
    let text = table.into_inner().expect("memory takes any row");
    write_bytes(&study.out.join(FILE), &text)
}

fn columns(study: &Study) -> Vec<String> {
    let mut names: Vec<String> = if study.file.bench.is_some() {
        let mut shares: Vec<String> = (study.states.iter().filter_map(|state| state.record()))
            .flat_map(|record| {
                record
                    .quantities
                    .keys()
                    .filter(|name| name.starts_with("share_"))
                    .cloned()
            })
            .collect();
        shares.sort();
        shares.dedup();
        OF_A_BENCHMARK
            .map(String::from)
            .into_iter()
            .chain(shares)
            .collect()
    } else {
        OF_A_RUN.map(String::from).to_vec()
    };
    names.extend((study.file.windows.iter()).map(|window| format!("{}_velocity", window.value.name.value)));
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
