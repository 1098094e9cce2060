//! The checkpoints of a run: when they are due, what is in them, and when a run must end to write its last one in time.

use super::observe::{Observer, ObserverState, Writers};
use super::run::{RunOptions, job};
use super::saved::own_data;
use super::{Simulation, identity};
use crate::case::{CheckpointSpacing, Setup};
use crate::checkpoint::{self, Checkpoint, Head};
use crate::comm::Comm;
use crate::error::{Error, Result};
use crate::output::{OutputFiles, directory};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A slow disk (bytes per second), for the time that a checkpoint may take before one has been written.
const SLOW_DISK: f64 = 1e8;

/// State that is the same on all ranks, or known to rank 0 alone.
#[derive(Serialize, Deserialize)]
pub(super) struct Shared {
    observer: ObserverState,
    /// Time that writing the previous checkpoint took (s).
    write_seconds: Option<f64>,
    /// Id of the run; none in checkpoints of older versions.
    #[serde(default)]
    pub(super) run: Option<String>,
}

impl Shared {
    /// Refuses a directory that holds another run than the one that has left this.
    pub(super) fn is_of(&self, directory: &Path) -> Result<()> {
        directory::refuse_another_run(directory, self.run.as_deref())?;
        self.observer.is_of(directory)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Requests {
    /// To write a checkpoint and end.
    pub(super) stop: bool,
    pub(super) checkpoint: bool,
}

pub(super) struct Checkpointer<'a> {
    setup: &'a Setup,
    folder: PathBuf,
    start: Instant,
    /// Start of the run or end of the last checkpoint.
    safe: Instant,
    /// Time to write one (s), once one has been written.
    write_seconds: Option<f64>,
    pub(super) run: Option<String>,
    /// Bytes of the populations of all ranks.
    bytes: f64,
    /// Start of the last step, with what was written after the one before; and the longest time from one to the next.
    round: Instant,
    longest_round: Duration,
}

impl<'a> Checkpointer<'a> {
    pub(super) fn new(setup: &'a Setup, simulation: &Simulation, start: Instant) -> Self {
        Self {
            folder: OutputFiles::new(&setup.plan.output.directory).checkpoints(),
            setup,
            start,
            safe: Instant::now(),
            write_seconds: None,
            run: None,
            bytes: (setup.domain.cell_count() * simulation.saved_bytes()) as f64,
            round: Instant::now(),
            longest_round: Duration::ZERO,
        }
    }

    /// Time that a run needs to stop: another step with its files, the last files, and a checkpoint, twice the longest that each
    /// has taken. An unknown disk is taken to be slow.
    pub(super) fn reserve(&self) -> Duration {
        let write = self.write_seconds.map_or(self.bytes / SLOW_DISK, |seconds| 2.0 * seconds);
        Duration::from_secs_f64(write) + 2 * self.longest_round
    }

    /// Returns true if the time of the run is over on any rank; called after every step if there is a limit. Collective.
    pub(super) fn is_late(&mut self, comm: &Comm, options: &RunOptions) -> bool {
        let Some(limit) = options.max_walltime else {
            return false;
        };
        let now = Instant::now();
        self.longest_round = self.longest_round.max(now - self.round);
        self.round = now;
        comm.any(self.start.elapsed() + self.reserve() >= limit)
    }

    /// Requests of signals and of the clock to this rank.
    pub(super) fn requests(&self, options: &RunOptions) -> Requests {
        let every = self.setup.plan.output.checkpoint_every;
        let due = matches!(every, CheckpointSpacing::WallTime(interval) if self.safe.elapsed() >= interval);
        Requests {
            stop: options.stop.load(Ordering::Relaxed),
            checkpoint: options.checkpoint.swap(false, Ordering::Relaxed) || due,
        }
    }

    /// Writes a checkpoint if one is due or requested after the current step; errors of the simulation, of which nothing is kept,
    /// or of writing. Collective.
    pub(super) fn write_if_due(
        &mut self,
        simulation: &mut Simulation,
        observer: &mut Observer,
        requests: Requests,
        ended: bool,
    ) -> Result<()> {
        let step = simulation.step;
        let plan = &self.setup.plan;
        let in_turn = matches!(plan.output.checkpoint_every, CheckpointSpacing::Steps(every) if step.is_multiple_of(every));
        let asked = step > 0 && in_turn || requests.stop || requests.checkpoint;
        let at_end = step > 0 && plan.output.checkpoint_at_end && ended;
        if simulation.checkpoint == Some(step) || !(asked || at_end) {
            return Ok(());
        }
        observer.complete_later(simulation)?;
        let start = Instant::now();
        let (write_seconds, run) = (self.write_seconds, self.run.clone());
        let written = simulation.write_state(&self.folder, self.setup, |comm| {
            let observer = observer.state(comm)?;
            Ok(observer.map(|observer| Shared { observer, write_seconds, run }))
        });
        match written {
            // The run is complete without it.
            Err(error @ Error::Agreed { code: 2, .. }) if !asked => {
                observer.warn(&format!("{error}; the run is complete all the same"));
                return Ok(());
            }
            written => written?,
        }
        let seconds = start.elapsed().as_secs_f64();
        self.write_seconds = Some(self.write_seconds.map_or(seconds, |before| before.max(seconds)));
        // It is counted by itself.
        self.round = Instant::now();
        self.safe = self.round;
        simulation.timings.add("checkpoint", start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Restores the newest sound checkpoint: the state of the observer, and for each newer checkpoint why it was skipped. Errors:
    /// [`Error::Agreed`], the same on every rank, if none is sound. Collective.
    pub(super) fn restore(
        &mut self,
        simulation: &mut Simulation,
        writers: &Writers,
    ) -> Result<(ObserverState, Vec<String>)> {
        let (shared, skipped) = simulation.read_state(
            &self.folder,
            self.setup,
            |saved| means_the_same(saved, self.setup),
            |shared: &Shared| {
                directory::refuse_another_run(&self.setup.plan.output.directory, shared.run.as_deref())?;
                shared.observer.fits(writers)
            },
            |_, _| Ok(()),
        )?;
        // Of a file: it may hold any number.
        self.write_seconds = shared.write_seconds.filter(|seconds| (0.0..1e9).contains(seconds));
        self.run = shared.run;
        refuse_end(simulation.step, self.setup)?;
        Ok((shared.observer, skipped))
    }
}

/// Refuses a run that must end at `step` or later and ends before; the same on every rank.
pub(super) fn refuse_end(step: u64, setup: &Setup) -> Result<()> {
    let end = setup.plan.end_step;
    if end >= step {
        return Ok(());
    }
    Err(Error::Agreed {
        code: 2,
        text: format!("the run has done {step} steps, but `run.end` is step {end}: give a later end"),
    })
}

/// Head of the newest checkpoint in the output directory of a run that is of this run: its rows, which rank 0 reads, are there.
/// Collective.
///
/// # Errors
/// [`Error::Agreed`] if there is none, with the defect of each.
pub fn saved_head(directory: &Path) -> Result<Head> {
    let folder = OutputFiles::new(directory).checkpoints();
    let comm = job()?;
    let of_this_run = |saved: &Checkpoint| {
        if comm.rank() == 0 {
            let shared: Shared = own_data(saved)?;
            shared.is_of(directory).map_err(|error| of_another_run(saved, &error))?;
        }
        Ok(saved.head().clone())
    };
    Ok(checkpoint::newest_sound(&folder, &comm, of_this_run)?.0)
}

/// The error of a checkpoint that does not fit the files of the run.
pub(super) fn of_another_run(saved: &Checkpoint, error: &Error) -> Error {
    Error::Input(format!("checkpoint {} of the case `{}`: {error}", saved.name(), saved.head().case.name))
}

/// Refuses a checkpoint of which this program would make another run than the one that wrote it.
pub(super) fn means_the_same(saved: &Checkpoint, setup: &Setup) -> Result<()> {
    let (then, now) = (&saved.head().case.resolved, identity(setup));
    let then: serde_json::Value = serde_json::from_str(then).unwrap_or_default();
    let other: Vec<String> = (now.as_object().into_iter().flatten())
        .filter(|(key, value)| then.get(key) != Some(value))
        .map(|(key, value)| {
            let then = then.get(key).map_or("nothing".to_string(), ToString::to_string);
            format!("{key} was {then} and would be {value}")
        })
        .collect();
    if other.is_empty() {
        return Ok(());
    }
    Err(Error::Input(format!(
        "{}: this version of turbid makes another run of the case: {}; resume it with the version that wrote it, or run the case anew",
        saved.name(),
        other.join(", ")
    )))
}
