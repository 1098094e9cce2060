//! Motion of particles over time: displacements and memory of velocities from block to block.
//!
//! Rank 0 follows a bounded number of particles, which it gets as they are ([`Need::Selected`], 200 B each): a displacement needs the state of
//! one particle at two times, which no sum over a rank has, as particles change their ranks. From sample to sample a particle takes, of all
//! periodic images, the one nearest to where the mean of both velocities leads it, so that it may move by half a box relative to that.

use super::table::Table;
use super::vtk::parsed;
use super::{FileEstimate, NUMBER, Need, RootOutput, Writer, WriterState, files_of};
use crate::case::{Dynamics, Setup};
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::output::dynamics::{BINS, COLUMNS, diffusion};
use crate::output::{OutputFiles, RowsMark, SeriesTable, Summary, directory};
use crate::particle::Particle;
use crate::simulation::observe::Totals;
use serde::{Deserialize, Serialize};

const NAME: &str = "dynamics";
/// Most particles that are followed.
const MOST: usize = 4096;

/// Writes `dynamics.csv`, and at the end the means over the blocks.
pub(in crate::simulation) struct DynamicsWriter<'a> {
    setup: &'a Setup,
    plan: Dynamics,
    files: OutputFiles,
    /// Only ids that are multiples of this are followed.
    stride: u64,
    table: Table,
    block: Block,
    /// Step of the last sample.
    last: u64,
}

/// Samples since an origin.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Block {
    number: u64,
    /// Step of the origin; nothing before the first sample.
    origin: Option<u64>,
    /// Ascending by id.
    tracers: Vec<Tracer>,
}

/// A particle that is followed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Tracer {
    id: u64,
    /// Displacement since the origin (m).
    way: [f64; 3],
    /// Velocity at the origin (m/s).
    velocity: [f64; 3],
    /// Position and velocity at the last sample.
    last: [[f64; 3]; 2],
}

#[derive(Serialize, Deserialize)]
struct State {
    plan: (u64, usize),
    rows: Option<RowsMark>,
    block: Block,
    last: u64,
}

impl Block {
    /// One that begins with these particles.
    fn new(number: u64, origin: u64, particles: &[Particle]) -> Self {
        let tracer = |particle: &Particle| Tracer {
            id: particle.id,
            way: [0.0; 3],
            velocity: particle.velocity,
            last: [particle.position, particle.velocity],
        };
        Self { number, origin: Some(origin), tracers: particles.iter().map(tracer).collect() }
    }

    /// Follows its particles to where they are a time `dt` (s) later; those that are gone are left out.
    fn follow(&mut self, domain: &Domain, particles: &[Particle], dt: f64) {
        self.tracers.retain_mut(|tracer| {
            let Ok(at) = particles.binary_search_by_key(&tracer.id, |particle| particle.id) else {
                return false;
            };
            let (now, [position, velocity]) = (&particles[at], tracer.last.map(Vec3::from));
            let expected = 0.5 * dt * (velocity + now.velocity());
            let rest = domain.nearest_image(domain.wrap(now.position() - position - expected));
            // Along closed axes nothing is wrapped.
            let way = Vec3::from(tracer.way) + expected + rest;
            tracer.way = way.into();
            tracer.last = [now.position, now.velocity];
            true
        });
    }

    /// Mean squared displacements (m^2) and velocity autocorrelations (m^2/s^2) along the axes; NaN for less than two particles.
    fn moments(&self) -> [[f64; 3]; 2] {
        let count = self.tracers.len() as f64;
        let mean = |of: &dyn Fn(&Tracer) -> f64| self.tracers.iter().map(of).sum::<f64>() / count;
        let covariance = |a: &dyn Fn(&Tracer) -> f64, b: &dyn Fn(&Tracer) -> f64| {
            let [ma, mb] = [mean(a), mean(b)];
            self.tracers.iter().map(|t| (a(t) - ma) * (b(t) - mb)).sum::<f64>() / (count - 1.0)
        };
        let squares = [0, 1, 2].map(|axis| covariance(&|t| t.way[axis], &|t| t.way[axis]));
        let memory = [0, 1, 2].map(|axis| covariance(&|t| t.velocity[axis], &|t| t.last[1][axis]));
        [squares, memory]
    }
}

impl<'a> DynamicsWriter<'a> {
    /// That of a case, if it asks for one.
    pub(in crate::simulation) fn of(setup: &'a Setup) -> Option<Self> {
        let plan = setup.plan.output.dynamics?;
        let files = files_of(setup);
        let table = Table::new(files.table(directory::DYNAMICS), COLUMNS.clone());
        let stride = (setup.expected_particles().div_ceil(MOST) as u64).max(1);
        Some(Self { setup, plan, files, stride, table, block: Block::default(), last: 0 })
    }

    /// Adds a sample of which all particles are known, ascending by id.
    pub(in crate::simulation) fn add(&mut self, step: u64, time: f64, particles: &[Particle]) -> Result<()> {
        let selected = particles.iter().filter(|particle| self.selects(particle)).copied().collect();
        self.complete(&RootOutput { selected, ..RootOutput::of(step, time, &Totals::default()) })
    }

    /// The row of a sample `lag` steps after the origin.
    fn row(&self, output: &RootOutput, lag: u64) -> Vec<Option<f64>> {
        let time = |steps: u64| steps as f64 * self.setup.time_step;
        let origin = time(output.step - lag);
        let front = [self.block.number as f64, origin, time(lag), output.step as f64, output.time].map(Some);
        let [squares, memory] = self.block.moments();
        let values = squares.into_iter().chain(memory).map(|value| value.is_finite().then_some(value));
        front.into_iter().chain([Some(self.block.tracers.len() as f64)]).chain(values).collect()
    }
}

impl Writer for DynamicsWriter<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn every(&self) -> u64 {
        self.plan.every
    }

    fn due(&self, step: u64, _: bool) -> bool {
        // Samples are equally spaced, the end of a run is none of them.
        self.plan.every > 0 && step.is_multiple_of(self.plan.every)
    }

    fn needs(&self) -> Vec<Need> {
        vec![Need::Selected]
    }

    fn selects(&self, particle: &Particle) -> bool {
        let moves = !self.setup.motions[particle.template as usize].holds_centre();
        moves && particle.id.is_multiple_of(self.stride)
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let mut rows = Vec::new();
        let every = self.plan.every;
        let begins = self.block.origin.is_none_or(|origin| {
            let dt = (output.step - self.last) as f64 * self.setup.time_step;
            self.block.follow(&self.setup.domain, &output.selected, dt);
            let lag = output.step - origin;
            rows.push(self.row(output, lag));
            lag >= every * self.plan.lags as u64
        });
        if begins {
            let number = self.block.origin.map_or(0, |_| self.block.number + 1);
            self.block = Block::new(number, output.step, &output.selected);
            rows.push(self.row(output, 0));
        }
        self.last = output.step;
        self.table.write(&rows)
    }

    fn intact(&self) -> Result<()> {
        self.table.intact()
    }

    fn state(&mut self) -> Result<WriterState> {
        let plan = (self.plan.every, self.plan.lags);
        let (rows, block) = (self.table.mark()?, self.block.clone());
        Ok(serde_json::json!(State { plan, rows, block, last: self.last }))
    }

    fn fits(&self, state: &WriterState) -> Result<()> {
        let State { plan, rows, .. } = parsed(NAME, state)?;
        self.table.fits(NAME, plan == (self.plan.every, self.plan.lags), rows.as_ref())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let State { rows, block, last, .. } = parsed(NAME, state)?;
        (self.block, self.last) = (block, last);
        self.table.resume(rows.as_ref())
    }

    fn finish(&mut self, summary: &mut Summary) -> Result<()> {
        let from = self.setup.averages_from(self.last);
        average([&self.files; 2], from, summary)
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let rows = FileEstimate::of(self, end_step, "dynamics", NUMBER * COLUMNS.len() as f64, "");
        Some(rows.in_one_file())
    }
}

/// Self-diffusion coefficients of a run by its blocks from a time (s) on, and their means, in a table that `to` gets; nothing where there are none.
pub(in crate::simulation) fn average(
    [of, to]: [&OutputFiles; 2],
    from: f64,
    summary: &mut Summary,
) -> Result<()> {
    let rows = of.table(directory::DYNAMICS);
    if !rows.is_file() {
        return Ok(());
    }
    summary.averages.extend(diffusion(&SeriesTable::read(&rows)?, from));
    BINS.write_means(&rows, &to.table(directory::DYNAMICS_MEANS), from)
}

#[cfg(test)]
mod tests;
