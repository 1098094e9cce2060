//! Forecast of the work and the messages of every rank in a time step.

use crate::cli::machine::in_bytes;
use crate::cli::terminal::columns;
use turbid::case::Setup;
use turbid::engine::EngineChoice;
use turbid::simulation::{Forecast, RankForecast};

/// Largest number of ranks that get a row each; of more, least, mean and most are shown.
const SHOWN: usize = 32;

/// The forecast in tables.
pub(in crate::cli) fn text(setup: &Setup, forecast: &Forecast) -> String {
    let [x, y, z] = forecast.grid;
    let count = forecast.ranks.len();
    let mut lines = vec![format!("{count} ranks, blocks {x} x {y} x {z}, per time step")];
    lines.push(if count > SHOWN { extremes(&forecast.ranks) } else { each(&forecast.ranks) });
    let percent = |part: f64| format!("{:.1} %", 100.0 * part);
    lines.push(columns(&[
        vec!["  balance".into(), percent(forecast.balance()), "mean over largest work".into()],
        vec![
            "  efficiency".into(),
            percent(forecast.efficiency()),
            format!(
                "with {:.2} us per message and {:.1} GB/s, nothing hidden behind work",
                1e6 * forecast.message[0],
                1e-9 / forecast.message[1]
            ),
        ],
        vec![
            "  start".into(),
            in_bytes(forecast.placing),
            "on rank 0, which reads the case and places all particles".into(),
        ],
    ]));
    if setup.engine.is_in_parts() {
        lines.push("  with the messages to and from the engine, without those among its processes".into());
    } else if setup.engine != EngineChoice::Native {
        lines.push("  with the messages to and from the engine, without the time that it takes".into());
    }
    lines.join("\n")
}

/// A row for each rank and for what it sends to each neighbour.
fn each(ranks: &[RankForecast]) -> String {
    let heads =
        ["  rank", "block", "cells", "covered", "particles", "ghosts", "contacts", "memory", "work", "sends"];
    let mut rows = vec![heads.map(String::from).to_vec()];
    rows[0].push("to (populations + particles)".to_string());
    for (rank, forecast) in ranks.iter().enumerate() {
        let [x, y, z] = forecast.size;
        let to: Vec<String> = (forecast.sends.iter())
            .map(|(peer, to)| format!("{peer}: {} + {}", in_kilobytes(to.halo), in_kilobytes(to.particles)))
            .collect();
        rows.push(vec![
            format!("  {rank}"),
            format!("{x} x {y} x {z}"),
            forecast.cells().to_string(),
            whole(forecast.covered),
            forecast.particles.to_string(),
            forecast.ghosts.to_string(),
            forecast.contacts.to_string(),
            in_bytes(forecast.memory),
            in_milliseconds(forecast.work),
            in_kilobytes(forecast.bytes()) + " kB",
            to.join(", "),
        ]);
    }
    columns(&rows)
}

/// A name, the quantity of a rank, and its format.
type Quantity = (&'static str, fn(&RankForecast) -> f64, fn(f64) -> String);

/// Least, mean and most of everything, and the rank with the most.
fn extremes(ranks: &[RankForecast]) -> String {
    let quantities: [Quantity; 10] = [
        ("cells", |rank| rank.cells() as f64, whole),
        ("covered cells", |rank| rank.covered, whole),
        ("particles", |rank| rank.particles as f64, whole),
        ("ghosts", |rank| rank.ghosts as f64, whole),
        ("contacts", |rank| rank.contacts as f64, whole),
        ("memory", |rank| rank.memory, in_bytes),
        ("work", |rank| rank.work, in_milliseconds),
        ("neighbours", |rank| rank.sends.len() as f64, whole),
        ("bytes sent", |rank| rank.bytes() as f64, whole),
        ("most bytes to one", most_to_one, whole),
    ];
    let mut rows = vec![["  quantity", "least", "mean", "most", "at rank"].map(String::from).to_vec()];
    for (name, of, words) in quantities {
        let values: Vec<f64> = ranks.iter().map(of).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let most = values.iter().copied().fold(0.0, f64::max);
        let worst = values.iter().position(|&value| value >= most).unwrap_or(0);
        rows.push(vec![format!("  {name}"), words(least), words(mean), words(most), worst.to_string()]);
    }
    columns(&rows)
}

fn most_to_one(rank: &RankForecast) -> f64 {
    let bytes = rank.sends.values().map(|to| to.halo + to.particles);
    bytes.max().unwrap_or(0) as f64
}

fn whole(value: f64) -> String {
    format!("{value:.0}")
}

fn in_kilobytes(bytes: usize) -> String {
    format!("{:.1}", bytes as f64 / 1e3)
}

fn in_milliseconds(seconds: f64) -> String {
    format!("{:.3} ms", 1e3 * seconds)
}
