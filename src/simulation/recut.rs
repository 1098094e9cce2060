//! New cuts of the box during a run, where the particles have gathered somewhere.
//!
//! Every rank times its own work, waiting excluded. From time to time all compare it with the [work](super::work) that their cells, covered
//! cells and contacts should be, which gives the costs of this machine, and these the cuts that would be best now:
//!
//! ```text
//! time of a rank = a cells + b covered cells, c particles and contacts     a, b: least squares over the ranks; c: sum over sum
//! lost           = sum over steps since the last cut of (time of the slowest rank - that with the best cuts)
//! cut anew         when lost > time that cutting takes
//! ```
//!
//! The state is [saved and restored](super::saved) in memory as by a run that is resumed on other blocks, so that no bit depends on it.

use super::Simulation;
use super::work::{CostFactors, Swept, Work};
use crate::case::Setup;
use crate::comm::Comm;
use crate::domain::Decomposition;
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::memory;
use std::rc::Rc;
use std::time::Instant;

/// Steps between two looks, at least and at most.
const EVERY: u64 = 96;
const RAREST: u64 = 16 * EVERY;

/// Part of the time of the slowest rank that is worth a cut: less is chance.
const WORTH: f64 = 0.05;

/// Bytes that are saved, sent and restored in a second, about, before it has been done once.
const RATE: f64 = 2e8;

/// Memory that a new cut takes, over what is saved.
const COPIES: f64 = 3.0;

/// Range of the costs of a machine over those that are built in.
const FACTORS: [f64; 2] = [0.05, 20.0];

/// Time (s) that a rank has worked in its steps, waiting excluded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Busy {
    /// In whole steps.
    pub(super) all: f64,
    /// With motion and contacts of the particles.
    pub(super) particles: f64,
}

impl Busy {
    /// Does some `work` on the particles, and times it.
    pub(super) fn note<R>(busy: &mut Option<Self>, comm: &Comm, work: impl FnOnce() -> R) -> R {
        let Some(busy) = busy else { return work() };
        let watch = Watch::start(comm);
        let result = work();
        busy.particles += watch.work(comm);
        result
    }
}

/// Times and works of a rank (s): cells, covered cells, particles by the [estimate](Work::of_block), and its [`Busy`] times of a step.
type Row = [f64; 5];

/// Work of the ranks since they looked last.
pub(super) struct Balance<'a> {
    setup: &'a Setup,
    /// Step of the last look, and the times then.
    step: u64,
    busy: Busy,
    /// Steps to the next look.
    every: u64,
    /// Cells that are swept, of the box, and the part of the block of this rank.
    swept: (Swept, f64),
    /// Time (s) lost since the last cut.
    lost: f64,
    /// Time (s) that cutting takes.
    price: Option<f64>,
}

impl<'a> Balance<'a> {
    /// Of a run that begins, if its ranks can share their work otherwise.
    pub(super) fn new(setup: &'a Setup, simulation: &mut Simulation) -> Option<Self> {
        let is_shared = simulation.comm.size() > 1 && setup.engine == EngineChoice::Native;
        if !is_shared || !setup.plan.is_cut_anew {
            return None;
        }
        let busy = *simulation.busy.insert(Busy::default());
        let swept = swept(setup, simulation);
        Some(Self { setup, step: simulation.step, busy, every: EVERY, swept, lost: 0.0, price: None })
    }

    /// Cuts the box anew if that is due, after what must come `before` it, and returns true then. Errors: those of `before`, and of restoring
    /// the state, after which the run cannot go on. Collective.
    pub(super) fn cut_if_due(
        &mut self,
        simulation: &mut Simulation,
        before: &mut dyn FnMut(&mut Simulation) -> Result<()>,
    ) -> Result<bool> {
        if simulation.step < self.step + self.every {
            return Ok(false);
        }
        let Some(cut) = self.look(simulation) else { return Ok(false) };
        before(simulation)?;
        let start = Instant::now();
        simulation.cut_anew(self.setup, cut)?;
        let mut seconds = [start.elapsed().as_secs_f64()];
        simulation.timings.add("cut", seconds[0]);
        simulation.comm.max(&mut seconds);
        (self.lost, self.price) = (0.0, Some(seconds[0]));
        self.swept.1 = swept_part(&Work::of_walls(self.setup), simulation);
        Ok(true)
    }

    /// Better cuts, if they are due. Collective.
    fn look(&mut self, simulation: &Simulation) -> Option<Decomposition> {
        let (comm, cut) = (&simulation.comm, &simulation.cut);
        let steps = (simulation.step - self.step) as f64;
        let busy = simulation.busy.unwrap_or_default();
        let mut work = Work::now(self.setup, simulation, self.swept.0.clone());
        let [cells, covered, particles] = work.of_block(&simulation.block, self.swept.1);
        let own: Row = [
            cells,
            covered,
            particles,
            (busy.all - busy.particles - self.busy.all + self.busy.particles) / steps,
            (busy.particles - self.busy.particles) / steps,
        ];
        (self.step, self.busy) = (simulation.step, busy);
        let rows: Vec<Row> = (comm.all_gather(bytemuck::bytes_of(&own).to_vec()).iter())
            .map(|row| bytemuck::pod_read_unaligned(row))
            .collect();
        work.factors = factors(&rows);
        let weights = work.weights(comm);
        let better = Decomposition::balanced(self.setup.domain, comm.size(), &weights)?;
        let foreseen = cut.heaviest(&weights) - better.heaviest(&weights);
        let times = rows.iter().map(|row| row[3] + row[4]);
        let slowest = times.clone().fold(0.0, f64::max);
        let gain = foreseen.min(slowest - times.sum::<f64>() / rows.len() as f64);
        if better == *cut || gain < WORTH * slowest {
            // Looks are rarer where they find nothing.
            (self.lost, self.every) = (0.5 * self.lost, (2 * self.every).min(RAREST));
            return None;
        }
        self.every = EVERY;
        self.lost += gain * steps;
        let particles = simulation.particles().len() as f64;
        let bytes = simulation.block.cell_count() as f64 * simulation.saved_bytes() as f64
            + memory::PER_PARTICLE * particles;
        let mut price = [self.price.unwrap_or(bytes / RATE)];
        comm.max(&mut price);
        let has_room = memory::left() > COPIES * bytes * comm.ranks_per_process() as f64;
        (self.lost > price[0] && !comm.any(!has_room)).then_some(better)
    }
}

impl Simulation {
    /// Measures from now on what this rank works.
    #[doc(hidden)]
    pub fn watch(&mut self) {
        self.busy = Some(Busy::default());
    }

    /// Time (s) that this rank has worked since, waiting excluded: with all but the particles, and with their motion and contacts.
    #[doc(hidden)]
    pub fn worked(&self) -> [f64; 2] {
        let Busy { all, particles } = self.busy.unwrap_or_default();
        [all - particles, particles]
    }

    /// Costs of this machine over those that are built in, from the work (s) of a step of this rank, as [`worked`](Self::worked) has it, and
    /// that of its fluid without particles. Collective.
    #[doc(hidden)]
    pub fn cost_factors(&self, setup: &Setup, [fluid, motion]: [f64; 2], alone: Option<f64>) -> CostFactors {
        let (swept, part) = swept(setup, self);
        let [cells, covered, particles] = Work::now(setup, self, swept).of_block(&self.block, part);
        let mut own: Vec<Row> = vec![[cells, covered, particles, fluid, motion]];
        own.extend(alone.map(|alone| [cells, 0.0, 0.0, alone, 0.0]));
        let all = self.comm.all_gather(bytemuck::cast_slice(&own).to_vec()).concat();
        factors(&bytemuck::pod_collect_to_vec::<u8, Row>(&all))
    }
}

/// Cells of the box that are swept, and the part of those of the block of this rank.
fn swept(setup: &Setup, simulation: &Simulation) -> (Swept, f64) {
    let walls = Work::of_walls(setup);
    (Rc::new(walls.count_swept()), swept_part(&walls, simulation))
}

fn swept_part(walls: &Work, simulation: &Simulation) -> f64 {
    walls.swept_part(simulation.block.lo, simulation.block.size())
}

/// Costs of this machine over those that are built in, from what all ranks have worked.
fn factors(rows: &[Row]) -> CostFactors {
    let sum = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>();
    let over =
        |time: f64, work: f64| if work > 0.0 { (time / work).clamp(FACTORS[0], FACTORS[1]) } else { 1.0 };
    let fluid = over(sum(&|row| row[3]), sum(&|row| row[0] + row[1]));
    let particles = over(sum(&|row| row[4]), sum(&|row| row[2]));
    let [aa, ab, bb] =
        [sum(&|row| row[0] * row[0]), sum(&|row| row[0] * row[1]), sum(&|row| row[1] * row[1])];
    let [at, bt] = [sum(&|row| row[0] * row[3]), sum(&|row| row[1] * row[3])];
    let determinant = aa * bb - ab * ab;
    let both = [bb * at - ab * bt, aa * bt - ab * at].map(|of| of / determinant);
    // Ranks that are too much alike do not tell the two apart.
    let told_apart = determinant > 0.01 * aa * bb && both.iter().all(|of| (0.3..3.0).contains(&(of / fluid)));
    let [cell, covered_cell] = if told_apart { both } else { [fluid; 2] };
    CostFactors { cell, covered_cell, particles, ..CostFactors::default() }
}

/// Measures work: the time since its start, less that in which messages were sent and awaited.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch(Instant, f64);

impl Watch {
    pub(super) fn start(comm: &Comm) -> Self {
        Self(Instant::now(), comm.traffic().seconds())
    }

    /// The work (s) since then.
    pub(super) fn work(self, comm: &Comm) -> f64 {
        self.0.elapsed().as_secs_f64() - (comm.traffic().seconds() - self.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;
    use crate::error::Error;
    use crate::simulation::work::tests::{bed, suspension};

    /// The cuts along z of two ranks, at the start and after a look with the times of a machine that is three times as slow as the one of
    /// the estimate.
    fn cuts(setup: &Setup) -> [Vec<usize>; 2] {
        let halves = Decomposition::with_grid(setup.domain, [1, 1, 2]);
        on_threads(2, |comm| {
            let mut simulation = Simulation::new(setup, &halves, comm).unwrap();
            let mut balance = Balance::new(setup, &mut simulation).unwrap();
            assert!(!balance.cut_if_due(&mut simulation, &mut |_| Ok(())).unwrap());
            simulation.advance(EVERY).unwrap();
            let hash = simulation.state_hash();
            let (swept, part) = balance.swept.clone();
            let [cells, covered, particles] =
                Work::now(setup, &simulation, swept).of_block(&simulation.block, part);
            let took = |work: f64| 3.0 * work * EVERY as f64;
            simulation.busy =
                Some(Busy { all: took(cells + covered + particles), particles: took(particles) });
            let is_cut = balance.cut_if_due(&mut simulation, &mut |_| Ok(())).unwrap();
            assert_eq!((is_cut, simulation.state_hash()), (simulation.cut != halves, hash));
            [halves.cuts[2].clone(), simulation.cut.cuts[2].clone()]
        })
        .swap_remove(0)
    }

    #[test]
    fn a_bed_on_the_floor_is_cut_through_its_middle_and_a_suspension_is_left_as_it_is() {
        let [start, bed] = cuts(&bed());
        assert!(bed[1] + 3 < start[1], "{bed:?}");
        let [start, suspension] = cuts(&suspension());
        assert_eq!(suspension, start);
    }

    #[test]
    fn a_failure_since_the_last_control_is_not_forgotten_when_the_box_is_cut() {
        let setup = bed();
        let halves = Decomposition::with_grid(setup.domain, [1, 1, 2]);
        let other = Decomposition::with_cuts(setup.domain, [vec![0, 48], vec![0, 48], vec![0, 20, 96]]);
        let words = on_threads(2, |comm| {
            let mut simulation = Simulation::new(&setup, &halves, comm).unwrap();
            (0..11).for_each(|_| simulation.step().unwrap());
            if simulation.comm.rank() == 1 {
                simulation.failure =
                    Some(Error::Diverged { step: 10, what: "a particle is too fast".to_string() });
            }
            simulation.cut_anew(&setup, other.clone()).unwrap_err().to_string()
        });
        assert!(
            words.iter().all(|of| of.contains("diverged at step 10: a particle is too fast")),
            "{words:?}"
        );
    }

    #[test]
    fn the_costs_of_a_machine_follow_from_ranks_with_different_work() {
        let row = |cells: f64, covered: f64, particles: f64| {
            [cells, covered, particles, 1.5 * cells + 0.6 * covered, 2.0 * particles]
        };
        let found = factors(&[row(1.0, 0.1, 0.3), row(0.6, 0.9, 0.5), row(0.8, 0.3, 0.0)]);
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
        assert!(
            near(found.cell, 1.5) && near(found.covered_cell, 0.6) && near(found.particles, 2.0),
            "{found:?}"
        );
        // Of ranks that are alike only the sum is known.
        let alike = factors(&[row(1.0, 0.5, 0.1), row(1.0, 0.5, 0.1)]);
        assert!(near(alike.cell, 1.2) && near(alike.covered_cell, 1.2), "{alike:?}");
        let dry = factors(&[[0.0, 0.0, 1.0, 0.1, 3.0], [0.0, 0.0, 2.0, 0.1, 6.0]]);
        assert!(near(dry.particles, 3.0) && near(dry.cell, 1.0), "{dry:?}");
    }
}
