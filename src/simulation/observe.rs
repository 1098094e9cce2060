//! What a run writes on the way: rows, fields, particles, contacts, pictures, and the summary at the end.
//!
//! All ranks take part; rank 0 gathers and writes. A failure to write on rank 0 ends the run on every rank.

mod gather;
mod row;
mod summary;
mod writer;

use super::Simulation;
use crate::case::Setup;
use crate::comm::Comm;
use crate::domain::Decomposition;
use crate::error::{Error, Result};
use crate::fluid::Real;
use crate::output::{Contact, SeriesRow, Summary};
use crate::particle::Particle;
use gather::Fields;
use serde::{Deserialize, Serialize};
use std::time::Instant;
pub(super) use summary::precision_name;
use writer::{Writer, WriterState};

/// Gathers and writes what the output plan asks for.
pub(super) struct Observer<'a> {
    setup: &'a Setup,
    decomposition: &'a Decomposition,
    start: Instant,
    /// Steps between samples and files, by [`SAMPLES`] and the rest; 0 is never.
    every: [u64; 5],
    /// Steps at which they were taken last.
    done: [Option<u64>; 5],
    /// Only on rank 0.
    writer: Option<Writer<'a>>,
}

/// What a run has written, as far as one needs to know it to go on.
#[derive(Serialize, Deserialize)]
pub(super) struct ObserverState {
    done: [Option<u64>; 5],
    writer: WriterState,
}

/// The failure of this rank, or that another one has failed. Collective.
fn agree(comm: &Comm, failed: Option<Error>) -> Result<()> {
    let any = comm.any(failed.is_some());
    match failed {
        Some(error) => Err(error),
        None if any => Err(Error::OtherRank),
        None => Ok(()),
    }
}

/// Which things are due, by the constants below.
type Due = [bool; 5];
const SAMPLES: usize = 0;
const FIELDS: usize = 1;
const PARTICLES: usize = 2;
const PICTURES: usize = 3;
const CONTACTS: usize = 4;

/// Samples over a run whose rows nobody asked for: averages need them.
const DEFAULT_SAMPLES: u64 = 1000;

/// What rank 0 knows of one step; empty on other ranks.
struct Frame {
    step: u64,
    /// Ascending by id.
    particles: Vec<Particle>,
    row: Option<SeriesRow>,
    fields: Option<Fields>,
    /// Ascending by the ids of the pair.
    contacts: Option<Vec<Contact>>,
}

impl<'a> Observer<'a> {
    pub(super) fn new(setup: &'a Setup, decomposition: &'a Decomposition, comm: &Comm, quiet: bool) -> Self {
        let plan = &setup.output;
        let samples = match plan.series_every {
            0 => (setup.end_step / DEFAULT_SAMPLES).max(1),
            asked => asked,
        };
        Self {
            setup,
            decomposition,
            start: Instant::now(),
            every: [
                samples,
                if setup.dry { 0 } else { plan.fields_every },
                plan.particles_every,
                plan.picture_every,
                plan.contacts_every,
            ],
            done: [None; 5],
            writer: (comm.rank() == 0).then(|| Writer::new(setup, quiet)),
        }
    }

    /// Goes on where [`state`](Self::state) was told after `step` steps. Collective.
    ///
    /// # Errors
    /// [`Error::Input`] or [`Error::Io`] if the files are not what they were then.
    pub(super) fn resume(
        setup: &'a Setup,
        decomposition: &'a Decomposition,
        comm: &Comm,
        quiet: bool,
        step: u64,
        state: ObserverState,
    ) -> Result<Self> {
        let mut observer = Self::new(setup, decomposition, comm, quiet);
        observer.done = state.done;
        let failed = match &mut observer.writer {
            Some(writer) => Writer::resume(setup, quiet, step, &state.done, state.writer)
                .map(|resumed| *writer = resumed)
                .err(),
            None => None,
        };
        agree(comm, failed)?;
        Ok(observer)
    }

    /// Prints a warning, quiet or not.
    pub(super) fn warn(&mut self, text: &str) {
        if let Some(writer) = &mut self.writer {
            writer.progress.warn(text);
        }
    }

    /// What rank 0 needs to go on from here; nothing elsewhere. What has been written is safe on disk after this. Collective.
    pub(super) fn state(&mut self, comm: &Comm) -> Result<Option<ObserverState>> {
        let writer = self.writer.as_mut().map(Writer::state).transpose();
        let (writer, failed) = match writer {
            Ok(writer) => (writer, None),
            Err(error) => (None, Some(error)),
        };
        agree(comm, failed)?;
        Ok(writer.map(|writer| ObserverState {
            done: self.done,
            writer,
        }))
    }

    /// Writes what is due after the current step; `last` makes everything due that is wanted at all. Collective.
    ///
    /// # Errors
    /// A failure of any rank since the last control, before anything of it is written; or that of writing.
    pub(super) fn observe<T: Real>(&mut self, simulation: &mut Simulation<T>, last: bool) -> Result<()> {
        let step = simulation.step;
        if let Some(writer) = &mut self.writer {
            writer.progress.update(step);
        }
        let due: Due = std::array::from_fn(|i| {
            let every = self.every[i];
            // There is nothing to see of a fluid at rest.
            let shows = i != PICTURES || step > 0 || self.setup.dry;
            every > 0 && (last || step.is_multiple_of(every)) && self.done[i] != Some(step) && shows
        });
        if due == [false; 5] {
            return Ok(());
        }
        simulation.share_failure()?;
        let start = Instant::now();
        let frame = self.gather(simulation, due);
        let failed = match &mut self.writer {
            Some(writer) => writer.write(&frame, due).err(),
            None => None,
        };
        for (done, _) in self.done.iter_mut().zip(due).filter(|(_, due)| *due) {
            *done = Some(step);
        }
        simulation.timings.add("observe", start.elapsed().as_secs_f64());
        agree(&simulation.comm, failed)
    }

    /// Brings to rank 0 what is needed for `due`. Collective.
    fn gather<T: Real>(&self, simulation: &mut Simulation<T>, due: Due) -> Frame {
        let dry = self.setup.dry;
        let particles = gather::particles(simulation);
        let forces = due[SAMPLES] && !self.setup.walls.is_empty();
        let touches = if due[CONTACTS] || forces {
            simulation.dem.contact_states()
        } else {
            Vec::new()
        };
        let row = (due[SAMPLES])
            .then(|| row::row(self.setup, simulation, &touches))
            .flatten();
        let contacts = due[CONTACTS].then(|| gather::contacts(simulation, &touches));
        let fields =
            ((due[FIELDS] || due[PICTURES]) && !dry).then(|| gather::fields(simulation, self.decomposition));
        Frame {
            step: simulation.step,
            particles,
            row,
            fields,
            contacts,
        }
    }

    /// Averages, the plot and the summary, on rank 0. Collective.
    pub(super) fn finish<T: Real>(
        mut self,
        simulation: &mut Simulation<T>,
        interrupted: bool,
    ) -> Result<Option<Summary>> {
        let hash = simulation.state_hash();
        let Some(writer) = self.writer.take() else {
            return Ok(None);
        };
        writer
            .finish(simulation, hash, interrupted, self.start.elapsed().as_secs_f64())
            .map(Some)
    }
}
