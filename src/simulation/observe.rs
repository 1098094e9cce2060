//! What a run writes on the way: rows, fields, particles, contacts, pictures, and the summary at the end.
//!
//! All ranks take part. To rank 0 go the sums of a row, the particles whose paths are written, and the plane of a picture; that of
//! a dry run shows all particles, so they go there, too. Files for `ParaView` are written by rank 0 where the ranks are threads, and
//! piece by piece by all of them where they are processes ([`share`]). A failure to write on one rank ends the run on every rank.

mod gather;
mod pictures;
mod row;
mod share;
mod summary;
mod viscosity;
mod writer;

use super::{Measurement, Simulation};
use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::ContactState;
use crate::domain::Decomposition;
use crate::error::{Error, Result};
use crate::output::{OutputFiles, PATHS, ParticlePoints, ParticleSurfaces, SeriesRow, Summary};
use crate::particle::Particle;
use serde::{Deserialize, Serialize};
use share::Share;
use std::time::Instant;
pub use summary::instruction_set;
use writer::{Writer, WriterState};

/// Gathers and writes what the output plan asks for.
pub(super) struct Observer<'a> {
    setup: &'a Setup,
    decomposition: &'a Decomposition,
    start: Instant,
    /// Steps between samples and files, by [`SAMPLES`] and the rest; 0 is never.
    every: [u64; KINDS],
    /// Steps at which they were taken last.
    done: [Option<u64>; KINDS],
    files: OutputFiles,
    looks: Looks,
    /// Whether every rank writes its own pieces of files.
    pieces: bool,
    /// Largest id of the particles whose paths are written.
    last_path: Option<u64>,
    /// Only on rank 0.
    writer: Option<Writer<'a>>,
}

/// Writers of the files of particles.
struct Looks {
    points: ParticlePoints,
    surfaces: ParticleSurfaces,
}

/// What a run has written, as far as one needs to know it to go on.
#[derive(Serialize, Deserialize)]
pub(super) struct ObserverState {
    done: [Option<u64>; KINDS],
    writer: WriterState,
}

impl ObserverState {
    /// Whether the files of the run are still what it has left, as far as they must be to go on.
    ///
    /// # Errors
    /// [`Error::Input`] if rows are gone.
    pub(super) fn fits(&self, setup: &Setup) -> Result<()> {
        self.writer.fits(setup)
    }
}

/// The failure of this rank, or that another one has failed. Collective.
pub(super) fn agree(comm: &Comm, failed: Option<Error>) -> Result<()> {
    comm.agree(failed.map_or(Ok(()), Err))
}

/// Which things are due, by the constants below.
type Due = [bool; KINDS];
const KINDS: usize = 6;
const SAMPLES: usize = 0;
const FIELDS: usize = 1;
const PARTICLES: usize = 2;
const PICTURES: usize = 3;
const CONTACTS: usize = 4;
const SURFACES: usize = 5;

/// Samples over a run whose rows nobody asked for: averages need them.
const DEFAULT_SAMPLES: u64 = 1000;

/// What rank 0 writes of one step besides its [`Share`]; empty on other ranks.
struct Frame {
    step: u64,
    /// With the particles whose paths are written, ascending by id.
    row: Option<(SeriesRow, Vec<Particle>)>,
    picture: Option<Picture>,
}

/// What a picture shows.
struct Picture {
    /// Velocity of the plane of the slice (m/s); nothing in a dry run.
    velocity: Option<Vec<[f32; 3]>>,
    /// Those that are seen, ascending by id.
    particles: Vec<Particle>,
}

impl<'a> Observer<'a> {
    pub(super) fn new(setup: &'a Setup, decomposition: &'a Decomposition, comm: &Comm, quiet: bool) -> Self {
        let plan = &setup.plan.output;
        let samples = match plan.series_every {
            0 => (setup.plan.end_step / DEFAULT_SAMPLES).max(1),
            asked => asked,
        };
        Self {
            setup,
            decomposition,
            start: Instant::now(),
            every: [
                samples,
                plan.fields_every,
                plan.particles_every,
                plan.picture_every,
                plan.contacts_every,
                plan.surfaces_every,
            ],
            done: [None; KINDS],
            files: OutputFiles::new(&plan.directory),
            looks: Looks {
                points: ParticlePoints::new(&setup.templates, &setup.sections, &setup.frames),
                surfaces: ParticleSurfaces::new(&setup.templates, &setup.sections, &setup.particles),
            },
            pieces: comm.ranks_per_process() < comm.size(),
            last_path: last_path(&setup.particles),
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
    pub(super) fn observe(&mut self, simulation: &mut Simulation, last: bool) -> Result<()> {
        let step = simulation.step;
        if let Some(writer) = &mut self.writer {
            writer.progress.update(step);
        }
        let due: Due = std::array::from_fn(|i| {
            let every = self.every[i];
            // There is nothing to see of a fluid at rest.
            let shows = i != PICTURES || step > 0 || self.setup.fluid.is_none();
            every > 0 && (last || step.is_multiple_of(every)) && self.done[i] != Some(step) && shows
        });
        if due == [false; KINDS] {
            return Ok(());
        }
        let start = Instant::now();
        let measured = due[SAMPLES].then(|| simulation.measure());
        simulation.share_failure()?;
        let outcome = self.write(simulation, due, measured);
        for (done, _) in self.done.iter_mut().zip(due).filter(|(_, due)| *due) {
            *done = Some(step);
        }
        simulation.timings.add("observe", start.elapsed().as_secs_f64());
        outcome
    }

    /// Gathers and writes what is `due`, and with files in pieces their indices when all pieces are there. Collective.
    fn write(&mut self, simulation: &mut Simulation, due: Due, measured: Option<Measurement>) -> Result<()> {
        let touches = if due[CONTACTS] || due[SAMPLES] {
            simulation.dem.contact_states()
        } else {
            Vec::new()
        };
        let frame = self.frame(simulation, due, measured, &touches);
        let share = if self.pieces {
            Share::piece(simulation, self.decomposition, due, &touches)
        } else {
            Share::whole(simulation, self.decomposition, due, &touches)
        };
        let mut outcome = match &mut self.writer {
            Some(writer) => writer.write_rows(&frame),
            None => Ok(()),
        };
        outcome = outcome
            .and(share)
            .and_then(|share| share.write(self.setup, &self.files, &self.looks, frame.step));
        if self.pieces
            && [FIELDS, PARTICLES, SURFACES, CONTACTS]
                .into_iter()
                .any(|i| due[i])
        {
            // No index before all pieces are there.
            agree(&simulation.comm, outcome.err())?;
            outcome = Ok(());
        }
        if let (Ok(()), Some(writer)) = (&outcome, &mut self.writer) {
            let pieces = self.pieces.then_some(self.decomposition);
            outcome = writer.finish_frame(&frame, due, pieces, &self.looks);
        }
        agree(&simulation.comm, outcome.err())
    }

    /// Brings to rank 0 what it writes by itself. Collective.
    fn frame(
        &self,
        simulation: &mut Simulation,
        due: Due,
        measured: Option<Measurement>,
        touches: &[ContactState],
    ) -> Frame {
        let row = measured.map(|measured| {
            let row = row::row(self.setup, simulation, &measured, touches);
            let wanted = |p: &Particle| self.last_path.is_some_and(|last| p.id <= last);
            let paths = if self.setup.plan.output.series_every > 0 {
                gather::particles(simulation, wanted)
            } else {
                Vec::new()
            };
            row.map(|row| (row, paths))
        });
        Frame {
            step: simulation.step,
            row: row.flatten(),
            picture: due[PICTURES].then(|| self.picture(simulation)),
        }
    }

    /// What rank 0 needs for a picture. Collective.
    fn picture(&self, simulation: &mut Simulation) -> Picture {
        let setup = self.setup;
        if setup.fluid.is_none() {
            return Picture {
                velocity: None,
                particles: gather::particles(simulation, |_| true),
            };
        }
        let plane = pictures::plane(setup);
        let radius = |p: &Particle| setup.templates[p.template as usize].shape.circumradius();
        Picture {
            velocity: Some(gather::slice(simulation, self.decomposition, &plane)),
            particles: gather::particles(simulation, |p| plane.cuts(p.position(), radius(p))),
        }
    }

    /// Averages, the plot and the summary, on rank 0. Collective.
    pub(super) fn finish(
        mut self,
        simulation: &mut Simulation,
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

/// The largest of the lowest ids, as many as there are paths.
fn last_path(particles: &[Particle]) -> Option<u64> {
    let mut ids: Vec<u64> = particles.iter().map(|particle| particle.id).collect();
    let count = ids.len().min(PATHS);
    ids.select_nth_unstable(count.checked_sub(1)?);
    ids.get(count - 1).copied()
}
