//! `turbid bench`.

use super::machine::in_bytes;
use super::terminal::{say, table};
use super::{BenchArguments, load, preflight};
use crate::error::Result;
use crate::simulation::{self, BenchOptions, BenchReport};

pub(super) fn bench(arguments: &BenchArguments) -> Result<()> {
    let setup = load(&arguments.case.case, &arguments.case.changes)
        .and_then(|setup| preflight::refuse_what_does_not_fit(&setup).map(|()| setup));
    let setup = simulation::agreed(setup)?;
    let options = BenchOptions {
        steps: arguments.steps,
        warm_up: arguments.warm_up.unwrap_or(arguments.steps),
        no_contact: arguments.no_contact,
        fluid_only: arguments.fluid_only,
    };
    let report = simulation::bench(&setup, &options)?;
    if arguments.json {
        say(&serde_json::to_string_pretty(&report).expect("a report is plain JSON"));
    } else {
        say(&text(&report));
    }
    Ok(())
}

fn text(report: &BenchReport) -> String {
    let row = |name: &str, value: String, remark: String| [name.to_string(), value, remark];
    let samples = report.mlups_samples.iter().map(|s| format!("{s:.1}"));
    let samples = samples.collect::<Vec<_>>().join(", ");
    let bandwidth = format!("of {:.1} GB/s", report.bandwidth_gb_per_s);
    let memory = in_bytes(report.bytes_per_cell * report.cells as f64);
    let mut rows = vec![
        row(
            "speed",
            format!("{:.1} MLUPS", report.mlups),
            format!("median of {samples}"),
        ),
        row(
            "roofline",
            format!("{:.1} %", 100.0 * report.roofline_fraction),
            bandwidth,
        ),
        row("memory", format!("{:.1} B/cell", report.bytes_per_cell), memory),
        row("cells", report.cells.to_string(), report.precision.clone()),
        row("particles", report.particles.to_string(), String::new()),
        row("contacts", report.contacts.to_string(), String::new()),
        row(
            "threads",
            report.threads.to_string(),
            format!("{} ranks", report.ranks),
        ),
    ];
    let step: f64 = report.stages.values().sum();
    for (stage, seconds) in &report.stages {
        let share = format!("{:.1} % of the step", 100.0 * seconds / step);
        rows.push(row(stage, format!("{:.3} ms", 1e3 * seconds), share));
    }
    table(&rows)
}
