//! Results of a benchmark, on all ranks.

use super::{Costs, Network};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use turbid::comm::Tally;
use turbid::simulation::CostFactors;

/// Results of `turbid bench`. The keys of its JSON are stable; `validation/scaling/README.md` says what each of them is.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    pub mlups: f64,
    pub mlups_samples: Vec<f64>,
    pub roofline_fraction: f64,
    pub bandwidth_gb_per_s: f64,
    pub bandwidth_samples: Vec<f64>,
    #[serde(flatten)]
    pub costs: Costs,
    pub cost_factors: CostFactors,
    pub conditions: Json,
    pub stages: BTreeMap<String, f64>,
    pub stages_over_ranks: BTreeMap<String, Spread>,
    pub waiting_over_ranks: BTreeMap<String, Spread>,
    pub messages_per_step: f64,
    pub bytes_per_step: f64,
    pub collectives_per_step: f64,
    pub network: Option<Network>,
    pub bytes_per_cell: f64,
    pub memory_per_rank_bytes: u64,
    pub ranks_per_process: usize,
    pub cells: usize,
    pub particles: usize,
    pub contacts: usize,
    pub precision: String,
    pub threads: usize,
    pub ranks: usize,
    pub grid: [usize; 3],
    pub kernels: Vec<KernelReport>,
    pub by_rank: Vec<RankReport>,
}

/// Time and bytes of a kernel of a device in a step.
#[derive(Clone, Debug, Serialize)]
pub struct KernelReport {
    pub name: String,
    pub seconds: f64,
    pub bytes: f64,
}

/// Contents of one rank at the end of a benchmark, and its work in a step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RankReport {
    pub rank: usize,
    pub cells: usize,
    pub covered_cells: usize,
    pub cut_cells: usize,
    pub segments: usize,
    pub particles: usize,
    pub ghosts: usize,
    pub contacts: usize,
    pub forces_sent: usize,
    pub halo: Rate,
    pub exchange: Rate,
    pub collective: Rate,
    pub process_memory_bytes: u64,
    pub stages: BTreeMap<String, f64>,
    pub fluid_only_stages: BTreeMap<String, f64>,
}

/// Messages of one kind in a step.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Rate {
    pub messages: f64,
    pub bytes: f64,
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
    pub min: f64,
    pub mean: f64,
    pub max: f64,
}

impl Spread {
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
