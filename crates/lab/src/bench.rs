//! Timing a case: steps without output, in turn with steps of its fluid without particles, beside the streaming bandwidth of the
//! machine, and what every rank has and sends.

mod costs;
mod report;

pub use costs::Costs;
use costs::Samples;
pub use report::{BenchReport, KernelReport, RankReport, Rate, Spread};
use serde::Serialize;
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::time::Instant;
use turbid::case::Setup;
use turbid::comm::{Comm, Traffic};
use turbid::coupling::{AnyFluid, CONTROL_INTERVAL};
use turbid::domain::Decomposition;
use turbid::engine::{EngineChoice, refuse_unusable};
use turbid::error::{Error, Result};
use turbid::fluid::stream_bandwidth;
use turbid::math::Vec3;
use turbid::output::contacts::ids;
use turbid::simulation::{Simulation, agreed, decompose, device_name, identity, instruction_set, on_ranks};
use turbid::timing::Timings;

/// Samples taken; figures are medians.
const SAMPLES: usize = 5;

#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    pub steps: u64,
    /// Steps before the first sample; suspensions have few contacts at the start.
    pub warm_up: u64,
    pub no_contact: bool,
    pub fluid_only: bool,
    /// A program that the case names as its engine may run.
    pub allow_engine: bool,
}

/// Times steps of a case without writing anything; errors as [`run`](turbid::simulation::run()), but those of the output.
pub fn bench(setup: &Setup, options: &BenchOptions) -> Result<BenchReport> {
    let conditions = agreed(conditions(setup, options))?;
    let mut setup = if options.fluid_only { without_particles(setup) } else { setup.clone() };
    if options.no_contact {
        setup.contact = None;
    }
    let decomposition =
        agreed(refuse_unusable(&setup.engine, options.allow_engine).and_then(|()| decompose(&setup)))?;
    let mut report = on_ranks(&decomposition, |comm| bench_rank(&setup, options, &decomposition, comm))?;
    report.conditions = conditions;
    Ok(report)
}

/// All that two benchmarks must have in common for their ratios to be comparable, whatever machine they ran on: the identity of the
/// case, instructions, ranks, steps, and what is left out. Errors: [`Error::Input`] if these are too many ranks.
fn conditions(setup: &Setup, options: &BenchOptions) -> Result<Json> {
    let mut conditions = identity(setup);
    let more = json!({
        "particles": setup.start_count(),
        "simd": instruction_set(setup),
        "device": device_name(setup),
        "ranks": decompose(setup)?.ranks(),
        "steps": options.steps,
        "warm_up": options.warm_up,
        "no_contact": options.no_contact,
        "fluid_only": options.fluid_only,
    });
    if let (Json::Object(all), Json::Object(more)) = (&mut conditions, more) {
        all.extend(more);
    }
    Ok(conditions)
}

/// Part of the timed steps that are repeated without particles.
const PART: u64 = 4;

/// Number of steps without particles beside `steps` with them: few, but as large a part of them measures the flow.
fn steps_alone(steps: u64) -> u64 {
    steps.div_ceil(PART * CONTROL_INTERVAL) * CONTROL_INTERVAL
}

fn without_particles(setup: &Setup) -> Setup {
    let mut setup = setup.clone();
    setup.contact = None;
    setup.particles.clear();
    setup.insertions.clear();
    setup.engine = EngineChoice::Native;
    // Something must move, without getting fast in any number of steps that a benchmark takes.
    let units = setup.units();
    if let Some(fluid) = &mut setup.fluid {
        fluid.net_flux = [None; 3];
        fluid.body_acceleration = (Vec3::x() * (1e-7 * units.acceleration())).into();
    }
    setup
}

fn bench_rank(
    setup: &Setup,
    options: &BenchOptions,
    decomposition: &Decomposition,
    comm: Comm,
) -> Result<BenchReport> {
    let mut simulation = Simulation::with_any_engine(setup, decomposition, comm)?;
    simulation.advance(options.warm_up)?;
    // Ranks of one process share its memory: all look before the first of them fills arrays.
    simulation.comm().barrier();
    let resident = peak_resident_bytes();
    simulation.comm().barrier();
    *simulation.timings() = Timings::default();
    simulation.watch();
    let mut alone = if setup.start_count() == 0 {
        None
    } else {
        simulation.alone(&without_particles(setup), decomposition)?
    };
    let cells = setup.domain.cell_count();
    let (mut samples, mut traffic) = (Samples::default(), Traffic::default());
    // Work (s) with the particles, and without.
    let mut worked = [[0.0; 2]; 2];
    for _ in 0..SAMPLES {
        let own = stream_bandwidth(1, simulation.comm())?;
        let mut total = [own as i64];
        simulation.comm().sum(&mut total);
        samples.bandwidth.push(total[0] as f64 / 1e9);
        let mlups = |simulation: &mut Simulation, steps: u64| {
            let before = simulation.worked();
            let (seconds, sent) = timed(simulation, steps)?;
            let after = simulation.worked();
            let work =
                [after[0] - before[0], after[1] - before[1]].map(|work| work / steps as f64 / SAMPLES as f64);
            Ok::<_, Error>((steps as f64 * cells as f64 / seconds / 1e6, sent, work))
        };
        let (speed, sent, work) = mlups(&mut simulation, options.steps)?;
        worked[0] = [worked[0][0] + work[0], worked[0][1] + work[1]];
        samples.mlups.push(speed);
        traffic = traffic + sent;
        if let Some(alone) = &mut alone {
            simulation.swap_particles(alone);
            let speed = mlups(&mut simulation, steps_alone(options.steps));
            simulation.swap_particles(alone);
            let (speed, _, work) = speed?;
            samples.fluid_only.push(speed);
            worked[1][0] += work[0];
        }
    }
    let steps = (SAMPLES as u64 * options.steps) as f64;
    let kernels = kernels(&mut simulation, options.steps)?;
    let mut mine = rank_report(&mut simulation, traffic, steps, resident);
    if let Some(alone) = &alone {
        mine.fluid_only_stages =
            per_step(&alone.timings, (SAMPLES as u64 * steps_alone(options.steps)) as f64);
    } else if setup.fluid.is_some() {
        samples.fluid_only.clone_from(&samples.mlups);
    }
    let comm = simulation.comm();
    let network = Network::measure(comm);
    let without = alone.is_some().then_some(worked[1][0]);
    let mut cost_factors = simulation.cost_factors(setup, worked[0], without);
    if let Some(Network { seconds_per_message, seconds_per_byte, .. }) = network {
        cost_factors = cost_factors.with_messages(seconds_per_message, seconds_per_byte);
    }
    let by_rank: Vec<RankReport> = comm
        .gather(serde_json::to_vec(&mine).expect("a report is plain JSON"))
        .iter()
        .map(|bytes| serde_json::from_slice(bytes).expect("written just now"))
        .collect();
    let population_bytes = (2 * AnyFluid::saved_bytes(setup.plan.precision)) as f64;
    let costs = Costs::new(&samples, &by_rank, population_bytes);
    let Samples { mlups, bandwidth, .. } = samples;
    let fractions: Vec<f64> =
        mlups.iter().zip(&bandwidth).map(|(m, b)| m * population_bytes / 1e3 / b).collect();
    let over =
        |figure: &dyn Fn(&RankReport) -> f64| Spread::of(&by_rank.iter().map(figure).collect::<Vec<_>>());
    let stages = by_rank.iter().flat_map(|rank| rank.stages.keys());
    let ranks_per_process = comm.ranks_per_process();
    let memory = over(&|rank| rank.process_memory_bytes as f64 / ranks_per_process as f64);
    Ok(BenchReport {
        mlups: median(&mlups),
        roofline_fraction: median(&fractions),
        bandwidth_gb_per_s: median(&bandwidth),
        mlups_samples: mlups,
        bandwidth_samples: bandwidth,
        costs,
        cost_factors,
        conditions: Json::Null,
        stages: mine.stages,
        stages_over_ranks: stages
            .map(|name| (name.clone(), over(&|rank| rank.stages.get(name).copied().unwrap_or(0.0))))
            .collect(),
        waiting_over_ranks: BTreeMap::from([
            ("halo".to_owned(), over(&|rank| rank.halo.seconds)),
            ("exchange".to_owned(), over(&|rank| rank.exchange.seconds)),
            ("collective".to_owned(), over(&|rank| rank.collective.seconds)),
        ]),
        messages_per_step: over(&|rank| rank.halo.messages + rank.exchange.messages).max,
        bytes_per_step: over(&|rank| rank.halo.bytes + rank.exchange.bytes).max,
        collectives_per_step: over(&|rank| rank.collective.messages).max,
        network,
        bytes_per_cell: memory.mean * by_rank.len() as f64 / cells as f64,
        memory_per_rank_bytes: memory.max as u64,
        ranks_per_process,
        cells,
        particles: setup.start_count(),
        contacts: by_rank.iter().map(|rank| rank.contacts).sum(),
        precision: setup.plan.precision.name().to_owned(),
        threads: comm.size(),
        ranks: comm.size(),
        grid: decomposition.grid,
        kernels,
        by_rank,
    })
}

/// Seconds that some steps take, and what this rank sends in them. Collective.
fn timed(simulation: &mut Simulation, steps: u64) -> Result<(f64, Traffic)> {
    simulation.comm().barrier();
    let (start, before) = (Instant::now(), simulation.comm().traffic());
    // Without the message by which `advance` shares failures.
    (0..steps).try_for_each(|_| simulation.step())?;
    let sent = simulation.comm().traffic() - before;
    simulation.comm().barrier();
    Ok((start.elapsed().as_secs_f64(), sent))
}

/// Kernels of the device in some more steps, if one computes the fluid. Collective.
fn kernels(simulation: &mut Simulation, steps: u64) -> Result<Vec<KernelReport>> {
    let time = |simulation: &Simulation, on| {
        simulation.fluid().map(|fluid| fluid.time_kernels(on)).unwrap_or_default()
    };
    if simulation.fluid().and_then(AnyFluid::device_traffic).is_none() {
        return Ok(Vec::new());
    }
    time(simulation, true);
    let timings = std::mem::take(simulation.timings());
    simulation.advance(steps)?;
    *simulation.timings() = timings;
    let report = |cost: turbid::device::KernelCost| KernelReport {
        name: cost.name,
        seconds: cost.seconds / steps as f64,
        bytes: cost.bytes as f64 / steps as f64,
    };
    let mut kernels: Vec<KernelReport> = time(simulation, false).into_iter().map(report).collect();
    kernels.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    Ok(kernels)
}

fn per_step(timings: &Timings, steps: f64) -> BTreeMap<String, f64> {
    timings.stages().iter().map(|&(name, s)| (name.to_owned(), s / steps)).collect()
}

/// State of this rank, and what it did in `steps` steps.
fn rank_report(simulation: &mut Simulation, traffic: Traffic, steps: f64, resident: u64) -> RankReport {
    let stages = per_step(simulation.timings(), steps);
    let cover = simulation.cover_count();
    let particles = simulation.dem().particles();
    let [halo, exchange, collective] =
        [traffic.halo, traffic.exchange, traffic.collective].map(|tally| Rate::new(tally, steps));
    RankReport {
        rank: simulation.comm().rank(),
        cells: simulation.fluid().map_or(0, |fluid| fluid.block().cell_count()),
        covered_cells: cover.cells,
        cut_cells: cover.cut,
        segments: cover.segments,
        particles: particles.owned,
        ghosts: particles.particles.len() - particles.owned,
        contacts: simulation.dem().contacts().count,
        forces_sent: forces_sent(simulation),
        halo,
        exchange,
        collective,
        process_memory_bytes: resident,
        stages,
        fluid_only_stages: BTreeMap::new(),
    }
}

/// Forces of the last contacts on particles of other ranks.
fn forces_sent(simulation: &Simulation) -> usize {
    let particles = simulation.dem().particles();
    let owned = |id: u64| particles.owned().binary_search_by_key(&id, |p| p.id).is_ok();
    simulation.contact_states().iter().flat_map(ids).filter(|&id| !owned(id)).count()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Largest resident memory of this process so far (bytes).
fn peak_resident_bytes() -> u64 {
    // Of this program alone; `getrusage` counts the process that started it, too, if that was larger.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = peak.and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok());
    1024 * kibibytes.unwrap_or(0)
}

/// Repetitions of which the best counts, and exchanges in each.
const REPEATS: usize = 20;
const ROUNDS: u32 = 20;

/// Numbers in a long message: 1 MiB.
const LONG: usize = 1 << 17;

/// Numbers that the control of the flow adds up over all ranks.
const CONTROL_WORDS: usize = 13;

/// Cost of the transport; two ranks at a time exchange messages, all at once.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Network {
    pub seconds_per_message: f64,
    pub seconds_per_byte: f64,
    pub seconds_per_reduction: f64,
}

impl Network {
    /// Measures; nothing to measure on one rank. Collective.
    fn measure(comm: &Comm) -> Option<Self> {
        if comm.size() == 1 {
            return None;
        }
        let (short, long) = (exchange(comm, 1), exchange(comm, LONG));
        let mut words = [1; CONTROL_WORDS];
        let reduction = best(comm, || comm.sum(&mut words));
        let bytes = ((LONG - 1) * size_of::<f64>()) as f64;
        Some(Self {
            seconds_per_message: short,
            seconds_per_byte: (long - short).max(0.0) / bytes,
            seconds_per_reduction: reduction,
        })
    }
}

/// Seconds for an exchange of `numbers` numbers with the partner rank; the last of an odd number of ranks has none.
fn exchange(comm: &Comm, numbers: usize) -> f64 {
    let partner = Some(comm.rank() ^ 1).filter(|&partner| partner < comm.size());
    let peers: Vec<usize> = partner.into_iter().collect();
    let mut pattern = (comm.halo::<f64>(&peers, &vec![numbers; peers.len()])).expect("room for one message");
    let (source, mut target) = (vec![1.0; numbers], vec![0.0; numbers]);
    best(comm, || {
        for link in 0..peers.len() {
            pattern.send(link).copy_from_slice(&source);
        }
        pattern.exchange();
        for link in 0..peers.len() {
            target.copy_from_slice(std::hint::black_box(pattern.received(link)));
        }
    })
}

/// Seconds per call, the best of some; of the slowest rank.
fn best(comm: &Comm, mut call: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        comm.barrier();
        let start = Instant::now();
        for _ in 0..ROUNDS {
            call();
        }
        let mut seconds = [start.elapsed().as_secs_f64() / f64::from(ROUNDS)];
        comm.max(&mut seconds);
        least = least.min(seconds[0]);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid::case::from_text;
    use turbid::comm::on_threads;

    pub(super) const CASE: &str = r"
[domain]
size = { diameters = [4, 4, 5] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 6
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
volume_fraction = 0.35
seed = 1
[contact]
enlargement = 0.5
[run]
end = { steps = 10 }
";

    pub(super) fn setup(threads: usize) -> Setup {
        let mut setup = from_text(CASE, "bench", &[]).unwrap();
        setup.plan.threads = threads;
        setup
    }

    pub(super) fn report(threads: usize) -> BenchReport {
        let mut setup = setup(threads);
        let speed = setup.expect_fluid().scales.stokes_velocity;
        for (n, particle) in (1_u32..).zip(&mut setup.particles) {
            let part = |k: u32| f64::from(n * k % 37) / 18.5 - 1.0;
            particle.velocity = [part(5), part(11), part(17)].map(|v| 0.1 * v * speed);
        }
        let options =
            BenchOptions { steps: 8, warm_up: 40, no_contact: false, fluid_only: false, allow_engine: false };
        bench(&setup, &options).unwrap()
    }

    #[test]
    fn the_parts_of_three_ranks_add_up_to_the_whole() {
        let (whole, parts) = (report(1), report(3));
        assert_eq!([whole.by_rank.len(), parts.by_rank.len()], [1, 3]);
        let all = |figure: fn(&RankReport) -> usize| parts.by_rank.iter().map(figure).sum::<usize>();
        let alone = &whole.by_rank[0];
        assert_eq!(all(|rank| rank.cells), alone.cells);
        assert_eq!(all(|rank| rank.particles), alone.particles);
        assert_eq!(all(|rank| rank.covered_cells), alone.covered_cells);
        assert_eq!(all(|rank| rank.contacts), alone.contacts);
        assert!(alone.contacts > 0 && alone.ghosts == 0 && alone.forces_sent == 0);
        assert!(parts.by_rank.iter().all(|rank| rank.ghosts > 0));
        // A force crosses where one end of a contact is elsewhere, and never both.
        assert!(all(|rank| rank.forces_sent) > 0 && all(|rank| rank.forces_sent) <= alone.contacts);
    }

    #[test]
    fn messages_are_those_of_the_steps_alone_on_3_ranks() {
        let report = report(3);
        assert_eq!((report.ranks, report.ranks_per_process), (3, 3));
        for rank in &report.by_rank {
            // Two neighbours: a message of populations and four of particles to each. A sum in one step of eight.
            let messages = [rank.halo.messages, rank.exchange.messages];
            assert!((messages[0] - 2.0).abs() < 1e-12 && (messages[1] - 8.0).abs() < 1e-12);
            assert!((rank.collective.messages - 0.125).abs() < 1e-12);
            assert!(rank.halo.bytes > 0.0 && rank.exchange.bytes > 0.0);
        }
        assert!((report.messages_per_step - 10.0).abs() < 1e-12);
        let most = report.by_rank.iter().map(|rank| rank.halo.bytes + rank.exchange.bytes);
        assert!((report.bytes_per_step - most.fold(0.0, f64::max)).abs() < 1e-9);
    }

    #[test]
    fn messages_and_reductions_take_some_time_on_3_ranks_and_none_on_one() {
        assert!(Network::measure(&Comm::Solo).is_none());
        for network in on_threads(3, |comm| Network::measure(&comm).unwrap()) {
            let Network { seconds_per_message, seconds_per_byte, seconds_per_reduction } = network;
            assert!(seconds_per_message > 1e-8 && seconds_per_reduction > 1e-8);
            // On a busy machine a long message may be no slower than a short one.
            assert!((0.0..1e-6).contains(&seconds_per_byte), "{network:?}");
        }
    }
}
