//! `turbid bench`.

use super::machine::in_bytes;
use super::terminal::{Row, row, say, speaks, table};
use super::{BenchArguments, costs, load, preflight};
use std::fmt::Write;
use turbid::error::Result;
use turbid::simulation::{self, TimeEstimate};
use turbid_lab::bench::{self, BenchOptions, BenchReport, Spread};

/// Measures a case and prints its speed.
pub(super) fn bench(arguments: &BenchArguments) -> Result<()> {
    let setup = load(&arguments.case.case, &arguments.case.changes)
        .and_then(|setup| preflight::refuse_what_does_not_fit(&setup).map(|()| setup));
    let setup = simulation::agreed(setup)?;
    let options = BenchOptions {
        steps: arguments.steps,
        warm_up: arguments.warm_up.unwrap_or(arguments.steps),
        no_contact: arguments.no_contact,
        fluid_only: arguments.fluid_only,
        allow_engine: arguments.allow_engine,
    };
    let report = bench::bench(&setup, &options)?;
    if let Some(file) = arguments.calibrate.as_deref().filter(|_| speaks()) {
        costs::write(file, &report.cost_factors)?;
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&report).expect("a report is plain JSON"));
    } else {
        let whole = !options.fluid_only && !options.no_contact;
        let estimate = whole.then(|| simulation::time_estimate(&setup)).transpose()?;
        say(&text(&report, estimate.as_ref()));
    }
    Ok(())
}

/// Costs of particles; without rows for what the case does not have.
fn costs(report: &BenchReport) -> Vec<Row> {
    let costs = &report.costs;
    let percent = |part: Option<f64>| part.map(|part| format!("{:.1} %", 100.0 * part));
    let time = |time: Option<f64>| time.map(|time| format!("{time:.2} ns"));
    let covered: usize = report.by_rank.iter().map(|rank| rank.covered_cells).sum();
    let rows = [
        (
            "four-way over fluid only",
            percent(costs.four_way_over_fluid_only),
            format!("of {:.1} MLUPS", costs.fluid_only_mlups.unwrap_or(f64::NAN)),
        ),
        (
            "roofline with particles",
            percent(costs.roofline_fraction_with_particles),
            "populations, cut cells and segments".to_owned(),
        ),
        ("a fluid cell", time(costs.nanoseconds_per_fluid_cell), String::new()),
        ("a covered cell", time(costs.nanoseconds_per_covered_cell), format!("more, {covered} cells")),
        ("a contact", time(costs.nanoseconds_per_contact), "the whole stage `dem`".to_owned()),
    ];
    rows.into_iter().filter_map(|(name, value, remark)| Some(row(name, value?, remark))).collect()
}

fn text(report: &BenchReport, estimate: Option<&TimeEstimate>) -> String {
    let samples = report.mlups_samples.iter().map(|s| format!("{s:.1}"));
    let samples = samples.collect::<Vec<_>>().join(", ");
    let bandwidth = format!("of {:.1} GB/s", report.bandwidth_gb_per_s);
    let memory = in_bytes(report.bytes_per_cell * report.cells as f64);
    let mut rows = vec![
        row("speed", format!("{:.1} MLUPS", report.mlups), format!("median of {samples}")),
        row("roofline", format!("{:.1} %", 100.0 * report.roofline_fraction), bandwidth),
        row("memory", format!("{:.1} B/cell", report.bytes_per_cell), memory),
        row("cells", report.cells.to_string(), &report.precision),
        row("particles", report.particles.to_string(), ""),
        row("contacts", report.contacts.to_string(), ""),
        row("threads", report.threads.to_string(), format!("{} ranks", report.ranks)),
    ];
    rows.extend(costs(report));
    if let Some(estimate) = estimate {
        let rate = report.cells as f64 / estimate.seconds_per_step / 1e6;
        let value = format!("{rate:.1} MLUPS");
        rows.push(row("estimated", value, "with the built-in costs"));
    }
    let stages = &report.stages_over_ranks;
    let step: f64 = stages.values().map(|seconds| seconds.mean).sum();
    let times = |what: String, seconds: &Spread| {
        let mut remark = format!("{:.1} % of the step{what}", 100.0 * seconds.mean / step);
        if report.ranks > 1 {
            let [least, most] = [seconds.min, seconds.max].map(|s| 1e3 * s);
            let _ = write!(remark, ", {least:.3} to {most:.3} over the ranks");
        }
        (format!("{:.3} ms", 1e3 * seconds.mean), remark)
    };
    for (stage, seconds) in stages {
        let (value, remark) = times(String::new(), seconds);
        rows.push(row(stage, value, remark));
    }
    for kernel in &report.kernels {
        let value = format!("{:.3} ms", 1e3 * kernel.seconds);
        let rate = kernel.bytes / kernel.seconds / 1e9;
        rows.push(row(
            format!("kernel {}", kernel.name),
            value,
            format!("{} in a step, {rate:.1} GB/s", in_bytes(kernel.bytes)),
        ));
    }
    if report.ranks == 1 {
        return table(&rows);
    }
    let [x, y, z] = report.grid;
    rows.push(row("blocks", format!("{x} x {y} x {z}"), ""));
    for (kind, seconds) in &report.waiting_over_ranks {
        let (value, remark) = times(", within the stages".to_owned(), seconds);
        rows.push(row(format!("sending, waiting: {kind}"), value, remark));
    }
    rows.push(row(
        "messages per step",
        format!("{:.1}", report.messages_per_step),
        format!(
            "{:.0} bytes, of the rank with the most; {:.2} calls of all ranks",
            report.bytes_per_step, report.collectives_per_step
        ),
    ));
    if let Some(network) = &report.network {
        rows.push(row(
            "a message",
            format!("{:.1} us", 1e6 * network.seconds_per_message),
            format!(
                "and {:.2} us per kB; {:.1} us for a reduction",
                1e9 * network.seconds_per_byte,
                1e6 * network.seconds_per_reduction
            ),
        ));
    }
    rows.push(row(
        "memory per rank",
        in_bytes(report.memory_per_rank_bytes as f64),
        format!("{} ranks per process", report.ranks_per_process),
    ));
    format!("{}\n  each rank: --json", table(&rows))
}
