//! Timing a case: steps without output, beside the streaming bandwidth of the machine.

use super::observe::precision_name;
use super::run::{agreed, decompose, on_ranks};
use super::{Simulation, Timings};
use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::EngineChoice;
use crate::domain::Decomposition;
use crate::error::Result;
use crate::fluid::{Precision, Real, stream_bandwidth};
use crate::lattice::Q;
use crate::math::Vec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Samples taken; figures are medians.
const SAMPLES: usize = 5;

/// What to measure.
#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    /// Timed steps per sample.
    pub steps: u64,
    /// Steps before the first sample; suspensions have few contacts at the start.
    pub warm_up: u64,
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
    /// Share of the streaming bandwidth that the traffic of the populations uses, median of the pairs.
    pub roofline_fraction: f64,
    /// Streaming bandwidth with as many threads (GB/s, read and write counted), measured between the samples, median.
    pub bandwidth_gb_per_s: f64,
    /// Every measurement of the bandwidth.
    pub bandwidth_samples: Vec<f64>,
    /// Seconds per step by stage on rank 0.
    pub stages: BTreeMap<String, f64>,
    /// Peak resident memory of the simulation over the number of cells (without the bandwidth test's arrays).
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
///
/// # Errors
/// As [`run`](super::run()), less those of the output.
pub fn bench(setup: &Setup, options: &BenchOptions) -> Result<BenchReport> {
    let mut setup = setup.clone();
    if options.no_contact || options.fluid_only {
        setup.contact = None;
    }
    if options.fluid_only {
        setup.particles.clear();
        setup.engine = EngineChoice::Native;
        // Something must move, without getting fast in any number of steps that a benchmark takes.
        setup.zero_net_flux = false;
        setup.body_acceleration = Vec3::x() * (1e-7 * setup.units.acceleration());
    }
    let decomposition = agreed(setup.engine.refuse_if_missing().and_then(|()| decompose(&setup)))?;
    match setup.precision {
        Precision::F32 => on_ranks(&decomposition, |comm| {
            bench_rank::<f32>(&setup, options, &decomposition, comm)
        }),
        Precision::F64 => on_ranks(&decomposition, |comm| {
            bench_rank::<f64>(&setup, options, &decomposition, comm)
        }),
    }
}

fn bench_rank<T: Real>(
    setup: &Setup,
    options: &BenchOptions,
    decomposition: &Decomposition,
    comm: Comm,
) -> Result<BenchReport> {
    let mut simulation = Simulation::<T>::new(setup, decomposition, comm)?;
    for _ in 0..options.warm_up {
        simulation.step()?;
    }
    let resident = peak_resident_bytes();
    *simulation.timings() = Timings::default();
    let cells = setup.domain.cell_count();
    let (mut mlups, mut bandwidth) = (Vec::new(), Vec::new());
    for _ in 0..SAMPLES {
        let own = stream_bandwidth(1, || simulation.comm.barrier());
        let mut total = [own as i64];
        simulation.comm.sum(&mut total);
        bandwidth.push(total[0] as f64 / 1e9);
        simulation.comm.barrier();
        let start = Instant::now();
        for _ in 0..options.steps {
            simulation.step()?;
        }
        simulation.comm.barrier();
        mlups.push(options.steps as f64 * cells as f64 / start.elapsed().as_secs_f64() / 1e6);
    }
    let mut contacts = [simulation.dem.contacts().count as i64];
    simulation.comm.sum(&mut contacts);
    let traffic = (2 * Q * size_of::<T>()) as f64;
    let fractions: Vec<f64> = mlups
        .iter()
        .zip(&bandwidth)
        .map(|(m, b)| m * traffic / 1e3 / b)
        .collect();
    let steps = (SAMPLES as u64 * options.steps) as f64;
    let stages = simulation
        .timings()
        .stages()
        .iter()
        .map(|&(name, s)| (name.to_owned(), s / steps))
        .collect();
    Ok(BenchReport {
        mlups: median(&mlups),
        roofline_fraction: median(&fractions),
        bandwidth_gb_per_s: median(&bandwidth),
        mlups_samples: mlups,
        bandwidth_samples: bandwidth,
        stages,
        bytes_per_cell: resident as f64 / cells as f64,
        cells,
        particles: setup.particles.len(),
        contacts: contacts[0] as usize,
        precision: precision_name(setup.precision).to_owned(),
        threads: simulation.comm.size(),
        ranks: simulation.comm.size(),
    })
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Largest resident memory of this process so far (bytes).
fn peak_resident_bytes() -> u64 {
    // SAFETY: `getrusage` fills the structure it is given; all its fields are plain numbers.
    let usage = unsafe {
        let mut usage = std::mem::zeroed::<libc::rusage>();
        libc::getrusage(libc::RUSAGE_SELF, &raw mut usage);
        usage
    };
    // Linux counts in KiB.
    usage.ru_maxrss as u64 * 1024
}
