//! The checkpoints of a run: when they are due, what is in them, and when a run must end to write its last one in time.

use super::Simulation;
use super::observe::{Observer, ObserverState};
use super::run::RunOptions;
use crate::case::Setup;
use crate::checkpoint::{self, CaseText, Checkpoint, Head, Part};
use crate::coupling::MeanFlow;
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::fluid::Real;
use crate::output::OutputFiles;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A slow disk (bytes per second), for the time that a checkpoint may take before one has been written.
const SLOW_DISK: f64 = 1e8;

/// What is the same on all ranks, or known to rank 0 alone.
#[derive(Serialize, Deserialize)]
struct Shared {
    mean: MeanFlow,
    observer: ObserverState,
}

/// What somebody asks of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Wishes {
    /// To write a checkpoint and end.
    pub(super) stop: bool,
    /// To write a checkpoint.
    pub(super) checkpoint: bool,
}

/// Writes the checkpoints of a run.
pub(super) struct Keeper<'a> {
    setup: &'a Setup,
    folder: PathBuf,
    block: Block,
    start: Instant,
    /// The step of the last one.
    last: Option<u64>,
    /// How long one may take.
    reserve: Duration,
}

impl<'a> Keeper<'a> {
    /// For a run that has begun at `start`.
    pub(super) fn new<T: Real>(
        setup: &'a Setup,
        decomposition: &Decomposition,
        simulation: &Simulation<T>,
        start: Instant,
    ) -> Self {
        let block = decomposition.block(simulation.comm.rank());
        let bytes = (block.cell_count() * simulation.saved_bytes()) as f64;
        Self {
            folder: OutputFiles::new(&setup.output.directory).checkpoints(),
            block,
            setup,
            start,
            last: None,
            reserve: Duration::from_secs_f64(bytes / SLOW_DISK),
        }
    }

    /// What signals and the clock ask of this rank. Called when the ranks are about to tell each other.
    pub(super) fn wishes(&self, options: &RunOptions) -> Wishes {
        let late = options
            .max_walltime
            .is_some_and(|limit| self.start.elapsed() + self.reserve >= limit);
        Wishes {
            stop: late || options.stop.load(Ordering::Relaxed),
            checkpoint: options.checkpoint.swap(false, Ordering::Relaxed),
        }
    }

    /// Writes a checkpoint if the case or somebody wants one after the current step. Collective.
    ///
    /// # Errors
    /// A failure of the simulation, of which nothing is kept; or that of writing.
    pub(super) fn keep<T: Real>(
        &mut self,
        simulation: &mut Simulation<T>,
        observer: &mut Observer,
        wishes: Wishes,
    ) -> Result<()> {
        let (step, every) = (simulation.step, self.setup.output.checkpoint_every);
        let over = step >= self.setup.end_step;
        let due = every > 0 && step > 0 && (step.is_multiple_of(every) || over);
        if self.last == Some(step) || !(due || wishes.stop || wishes.checkpoint) {
            return Ok(());
        }
        let start = Instant::now();
        self.write(simulation, observer)?;
        self.last = Some(step);
        self.reserve = self.reserve.max(2 * start.elapsed());
        simulation
            .timings
            .add("checkpoint", start.elapsed().as_secs_f64());
        Ok(())
    }

    fn write<T: Real>(&self, simulation: &mut Simulation<T>, observer: &mut Observer) -> Result<()> {
        simulation.check()?;
        let state = checkpoint::agreed(&simulation.comm, simulation.save())?;
        let shared = observer.state(&simulation.comm)?.map_or(Vec::new(), |observer| {
            let mean = state.mean;
            serde_json::to_vec(&Shared { mean, observer }).expect("plain data is always JSON")
        });
        let head = Head {
            step: simulation.step,
            cells: self.setup.domain.cells,
            bytes_per_cell: simulation.saved_bytes(),
            case: CaseText {
                name: self.setup.name.clone(),
                text: self.setup.text.clone(),
                files: self.setup.files.clone(),
            },
        };
        let part = Part {
            block: self.block,
            engine: &state.engine,
            coupling: &state.coupling,
            shared: &shared,
        };
        checkpoint::write(&self.folder, &simulation.comm, &head, &part, |z, out| {
            simulation.save_plane(z, out);
        })
    }

    /// Goes on from the newest checkpoint that is sound: what the observer needs to do so, and for each newer checkpoint why
    /// it was left out. Collective.
    ///
    /// # Errors
    /// [`Error::Agreed`], the same on every rank, if none is sound.
    pub(super) fn take_up<T: Real>(
        &mut self,
        simulation: &mut Simulation<T>,
    ) -> Result<(ObserverState, Vec<String>)> {
        let comm = simulation.comm.clone();
        let (observer, skipped) =
            checkpoint::newest_sound(&self.folder, &comm, |saved| self.restore(simulation, saved))?;
        self.last = Some(simulation.step);
        Ok((observer, skipped))
    }

    fn restore<T: Real>(&self, simulation: &mut Simulation<T>, saved: &Checkpoint) -> Result<ObserverState> {
        let comm = simulation.comm.clone();
        let head = saved.head();
        let fits = if (head.cells, head.bytes_per_cell) == (self.setup.domain.cells, simulation.saved_bytes())
        {
            serde_json::from_slice::<Shared>(saved.shared())
                .map_err(|error| Error::Input(format!("{}: {error}", saved.name())))
        } else {
            Err(Error::Input(format!("{} is of another case", saved.name())))
        };
        let read = fits.and_then(|shared| Ok((shared, saved.engines()?, saved.couplings()?)));
        let (shared, engines, couplings) = checkpoint::agreed(&comm, read)?;
        simulation.restore(head.step, shared.mean, &engines, &couplings, |block, visit| {
            saved.planes(block, visit)
        })?;
        Ok(shared.observer)
    }
}
