//! `result.csv`: a row for each run that has ended.

use super::Study;
use super::record::{Record, SHARE};
use super::state::State;
use std::collections::BTreeSet;
use turbid::error::Result;
use turbid::output::write_bytes;

/// Name of the file in the directory of a study.
pub(crate) const FILE: &str = "result.csv";

/// Quantities of a run; those that it does not have stay empty.
const OF_A_RUN: &str = "archimedes volume_fraction particles cells_per_diameter relaxation_time \
    settling_velocity_over_stokes standard_error drift averaged_from averaged_to settled \
    contacts_per_particle max_overlap net_flux_over_stokes cells steps mlups wall_seconds";

/// Quantities of a benchmark, before the shares of the stages.
const OF_A_BENCHMARK: &str = "cells particles contacts_per_particle mlups roofline_fraction bandwidth_gb_per_s memory_bytes \
    threads steps wall_seconds";

/// Writes the file; it appears whole.
pub(super) fn write_csv(study: &Study) -> Result<()> {
    let names = columns(study);
    let mut table = csv::Writer::from_writer(Vec::new());
    let axes = &study.plan.axes;
    let head = ["run"].into_iter().chain(axes.iter().map(|axis| axis.name.as_str()));
    let head = head.chain(names.iter().map(String::as_str)).chain(["version"]);
    table.write_record(head).expect("memory takes any row");
    for (run, state) in study.plan.runs.iter().zip(&study.states) {
        let Some(record) = state.record() else {
            continue;
        };
        let values = axes.iter().zip(&run.at).map(|(axis, &at)| axis.values[at].name.clone());
        let row = [run.name.clone()].into_iter().chain(values);
        let row = row.chain(names.iter().map(|name| cell(record, name)));
        let row = row.chain([record.version.clone()]);
        table.write_record(row).expect("memory takes any row");
    }
    let text = table.into_inner().expect("memory takes any row");
    write_bytes(&study.out.join(FILE), &text)
}

fn columns(study: &Study) -> Vec<String> {
    let is_bench = study.file.bench.is_some();
    let names = if is_bench { OF_A_BENCHMARK } else { OF_A_RUN };
    let mut names: Vec<String> = names.split_whitespace().map(String::from).collect();
    if is_bench {
        let records = study.states.iter().filter_map(State::record);
        let shares =
            records.flat_map(|record| record.quantities.keys().filter(|name| name.starts_with(SHARE)));
        let shares: BTreeSet<&String> = shares.collect();
        names.extend(shares.into_iter().cloned());
    }
    let windows = study.file.windows.iter().map(|window| &window.value.name.value);
    names.extend(windows.map(|window| format!("{window}_velocity")));
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
