//! Results of a benchmark, on all ranks.

use super::{Costs, Network};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use turbid::comm::Tally;

/// Results of `turbid bench`; the keys of its JSON are stable.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    /// Million cell updates per second, median of the samples.
    pub mlups: f64,
    /// Every sample.
    pub mlups_samples: Vec<f64>,
    /// Part of the streaming bandwidth that the populations use, median of the pairs.
    pub roofline_fraction: f64,
    /// Streaming bandwidth with as many threads (GB/s, read and write counted), measured between the samples, median.
    pub bandwidth_gb_per_s: f64,
    /// Every measurement of the bandwidth.
    pub bandwidth_samples: Vec<f64>,
    /// Costs of particles beside the fluid.
    #[serde(flatten)]
    pub costs: Costs,
    /// Properties that benchmarks must have in common to be compared: the identity of the case, instructions, ranks, steps.
    pub conditions: Json,
    /// Seconds per step by stage on rank 0.
    pub stages: BTreeMap<String, f64>,
    /// Seconds per step by stage over the ranks.
    pub stages_over_ranks: BTreeMap<String, Spread>,
    /// Seconds per step in calls that send and wait, by kind of message, over the ranks; they are part of the stages.
    pub waiting_over_ranks: BTreeMap<String, Spread>,
    /// Messages to other ranks in a step, of the rank with the most; calls of all ranks are not among them.
    pub messages_per_step: f64,
    /// Bytes in these messages, of the rank with the most.
    pub bytes_per_step: f64,
    /// Reductions, gatherings and barriers of all ranks in a step.
    pub collectives_per_step: f64,
    /// Cost of the transport between ranks; none on one rank.
    pub network: Option<Network>,
    /// Peak resident memory over the number of cells, without the arrays of the bandwidth test.
    pub bytes_per_cell: f64,
    /// Peak resident memory of a process over its ranks, of the process with the most.
    pub memory_per_rank_bytes: u64,
    /// Ranks that share the memory of a process: all if they are threads, one if they are processes.
    pub ranks_per_process: usize,
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
    /// Number of blocks in each direction.
    pub grid: [usize; 3],
    /// Kernels of the device on rank 0, the slowest first, from steps in which each was waited for; none on the processor.
    pub kernels: Vec<KernelReport>,
    /// Contents and work of each rank.
    pub by_rank: Vec<RankReport>,
}

/// Time and bytes of a kernel of a device in a step.
#[derive(Clone, Debug, Serialize)]
pub struct KernelReport {
    /// Its name.
    pub name: String,
    /// Seconds.
    pub seconds: f64,
    /// Bytes that it reads and writes by count, each once.
    pub bytes: f64,
}

/// Contents of one rank at the end of a benchmark, and its work in a step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RankReport {
    /// Number of the rank.
    pub rank: usize,
    /// Cells of its block.
    pub cells: usize,
    /// Cells that particles cover, once for each particle.
    pub covered_cells: usize,
    /// Of these the cells that a surface cuts.
    pub cut_cells: usize,
    /// Segments of rows that covered cells form, once for each particle.
    pub segments: usize,
    /// Particles it owns.
    pub particles: usize,
    /// Ghosts: particles of other ranks.
    pub ghosts: usize,
    /// Contacts it is responsible for.
    pub contacts: usize,
    /// Forces of these contacts on particles that another rank owns; each is sent there.
    pub forces_sent: usize,
    /// Populations that cross to neighbours, per step.
    pub halo: Rate,
    /// Messages of particles and contacts to neighbours, empty ones included, per step.
    pub exchange: Rate,
    /// Calls of all ranks, with the bytes that this one puts in, per step.
    pub collective: Rate,
    /// Peak resident memory of its process before the first sample.
    pub process_memory_bytes: u64,
    /// Seconds per step by stage.
    pub stages: BTreeMap<String, f64>,
    /// The same for the steps without particles.
    pub fluid_only_stages: BTreeMap<String, f64>,
}

/// Messages of one kind in a step.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Rate {
    /// Number of messages.
    pub messages: f64,
    /// Bytes in them.
    pub bytes: f64,
    /// Seconds in the calls that send and wait.
    pub seconds: f64,
}

impl Rate {
    pub(super) fn new(tally: Tally, steps: f64) -> Self {
        Self {
            messages: tally.messages as f64 / steps,
            bytes: tally.bytes as f64 / steps,
            seconds: tally.seconds / steps,
        }
    }
}

/// A figure over the ranks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Most.
    pub max: f64,
}

impl Spread {
    /// Of some values; zeros of none.
    pub(super) fn of(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let fold = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap_or(0.0);
        Self { min: fold(f64::min), mean: values.iter().sum::<f64>() / count, max: fold(f64::max) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_the_least_the_mean_and_the_most() {
        let spread = Spread::of(&[3.0, 1.0, 5.0]);
        let expected = Spread { min: 1.0, mean: 3.0, max: 5.0 };
        assert_eq!(spread, expected);
    }
}
