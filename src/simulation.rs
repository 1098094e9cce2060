//! A whole run: ranks, the time step, and what is observed on the way.

use crate::case::Setup;
use crate::error::Result;
use crate::output::Summary;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How a run behaves towards its caller.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// No progress on the terminal.
    pub quiet: bool,
    /// Set by a signal handler: the run ends cleanly after the current step, outputs closed.
    pub stop: Arc<AtomicBool>,
}

/// Runs a case to its end and writes everything it asks for.
pub fn run(_setup: &Setup, _options: &RunOptions) -> Result<Summary> {
    todo!()
}

/// What to measure.
#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    /// Timed steps per sample.
    pub steps: u64,
    /// Leave out contacts.
    pub no_contact: bool,
    /// Leave out particles altogether.
    pub fluid_only: bool,
}

/// What `turbid bench` measured; the keys of its JSON are stable.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    /// Million cell updates per second, median of the samples.
    pub mlups: f64,
    /// Every sample.
    pub mlups_samples: Vec<f64>,
    /// Share of the streaming bandwidth of this machine that the populations' traffic uses.
    pub roofline_fraction: f64,
    /// Streaming bandwidth measured in this process with as many threads (GB/s, read + write).
    pub bandwidth_gb_per_s: f64,
    /// Seconds per step by stage.
    pub stages: BTreeMap<String, f64>,
    /// Peak resident memory of the process over the number of cells.
    pub bytes_per_cell: f64,
    /// Number of cells.
    pub cells: usize,
    /// Number of particles.
    pub particles: usize,
    /// Number of contacts at the end.
    pub contacts: usize,
    /// Storage of the populations.
    pub precision: String,
    /// Threads.
    pub threads: usize,
    /// Ranks.
    pub ranks: usize,
}

/// Times steps of a case without writing anything.
pub fn bench(_setup: &Setup, _options: &BenchOptions) -> Result<BenchReport> {
    todo!()
}
