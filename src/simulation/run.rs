//! A run from the first step to the summary: one thread or process per rank, all doing the same.

use super::branch::Branch;
use super::checkpointer::{Checkpointer, Requests, saved_head};
use super::engine::{Context, engine};
use super::identity::run_id;
use super::observe::{Observer, kinds};
use super::recut::Balance;
use super::together::read_together;
use super::work::{CostFactors, Forecast, Work, cores};
use super::writers::{self, Writer};
use super::{CONTROL_INTERVAL, Simulation};
use crate::case::{Origin, Setup};
use crate::checkpoint::CaseText;
use crate::comm::{self, Comm, try_on_threads};
use crate::domain::Decomposition;
use crate::engine::refuse_unusable;
use crate::error::{Error, Result};
use crate::output::directory::{self, Kind, Lock};
use crate::output::{OutputFiles, Summary};
use crate::packing::progress::Unfollowed;
#[cfg(feature = "mpi")]
use crate::{checkpoint, comm::MpiComm, simulation::together::agreed_on};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Follows a [run](run()), on rank 0: a bar on the terminal, a window. Every method does nothing unless it is overridden.
pub trait Progress: Send + Sync {
    /// The run begins after `first` steps: 0, or those of its checkpoint.
    fn start(&self, _setup: &Setup, _first: u64) {}

    /// `step` steps are done. Called after every step.
    fn step(&self, _step: u64) {}

    /// A warning to the user.
    fn warn(&self, _text: &str) {}

    /// The run has ended after `step` steps, with all its files written. A run that fails does not come here.
    fn finish(&self, _step: u64) {}
}

impl fmt::Debug for dyn Progress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("Progress")
    }
}

/// Options of a run for its caller.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Follows steps and warnings.
    pub progress: Option<Arc<dyn Progress>>,
    /// Set by a signal handler: the run ends after the current step, outputs closed.
    pub stop: Arc<AtomicBool>,
    /// Set by a signal handler, cleared by the run, which writes a checkpoint.
    pub checkpoint: Arc<AtomicBool>,
    /// The run ends before it has taken so long.
    pub max_walltime: Option<Duration>,
    /// Results of an earlier run in the output directory are replaced instead of refused.
    pub overwrite: bool,
    /// A program that the case names as its engine may run.
    pub allow_engine: bool,
}

/// Runs a case to its end and writes everything it asks for. The summary is that of rank 0; the other processes of an MPI job get
/// none.
///
/// ```
/// use turbid::{Builder, simulation};
/// # let folder = std::env::temp_dir().join(format!("turbid-run-{}", std::process::id()));
/// let setup = Builder::example().end(2e-3).threads(1).output(&folder).setup()?;
/// let summary = simulation::run(&setup, &simulation::RunOptions::default())?;
/// assert!(summary.is_some() && folder.join("series.csv").exists());
/// # std::fs::remove_dir_all(folder).unwrap();
/// # Ok::<(), turbid::Error>(())
/// ```
///
/// # Errors
/// [`Error::Input`] or [`Error::Io`] if the case or its output is not possible; [`Error::Diverged`] if the simulation leaves the
/// range of the method and [`Error::Engine`] if an external engine fails, with all output up to then readable.
pub fn run(setup: &Setup, options: &RunOptions) -> Result<Option<Summary>> {
    run_with(setup, options, &|_| Vec::new())
}

/// As [`run`], with writers of the caller's beside those of the case. [`Writer::sums`] makes numbers of what all ranks have.
///
/// ```
/// use turbid::simulation::{self, Need, RootOutput, Writer};
/// use turbid::{Builder, Result};
///
/// /// Prints the rows of the time series.
/// struct Rows;
///
/// impl Writer for Rows {
///     fn name(&self) -> &'static str {
///         "rows"
///     }
///     fn every(&self) -> u64 {
///         5 // steps
///     }
///     fn needs(&self) -> Vec<Need> {
///         vec![Need::Row]
///     }
///     fn complete(&mut self, output: &RootOutput) -> Result<()> {
///         println!("{} s: {:?}", output.time, output.row);
///         Ok(())
///     }
/// }
///
/// # let folder = std::env::temp_dir().join(format!("turbid-writer-{}", std::process::id()));
/// let setup = Builder::example().end(2e-3).threads(1).output(&folder).setup()?;
/// simulation::run_with(&setup, &Default::default(), &|_rank| vec![Box::new(Rows)])?;
/// # std::fs::remove_dir_all(folder).unwrap();
/// # Ok::<(), turbid::Error>(())
/// ```
///
/// # Errors
/// As [`run`]; what a writer says.
pub fn run_with(setup: &Setup, options: &RunOptions, more: &MoreWriters) -> Result<Option<Summary>> {
    run_from(setup, options, more, &Begin::Anew)
}

/// Makes the caller's writers for a rank, the same ones for every rank and call.
pub type MoreWriters<'a> = dyn Fn(usize) -> Vec<Box<dyn Writer>> + Sync + 'a;

#[derive(Clone, Copy, Debug)]
enum Begin<'a> {
    /// That of the case.
    Anew,
    /// Its own last checkpoint.
    Resumed,
    /// The last checkpoint of another run.
    Branched(&'a Branch),
}

/// As [`run`], [`resume`] or [`branch`].
fn run_from(
    setup: &Setup,
    options: &RunOptions,
    more: &MoreWriters,
    begin: &Begin,
) -> Result<Option<Summary>> {
    let start = Instant::now();
    let decomposition =
        agreed(refuse_unusable(&setup.engine, options.allow_engine).and_then(|()| decompose(setup)))?;
    let first = comm::launched().is_none_or(|launched| launched.rank == 0);
    let resumes = matches!(begin, Begin::Resumed);
    let done = if first && resumes { finished(setup) } else { None };
    if job()?.any(done.is_some()) {
        return Ok(done);
    }
    let _lock = agreed(if first {
        let kinds = [kinds(&writers::of(setup)), kinds(&more(0))].concat();
        claim(setup, options, &kinds, resumes)
    } else {
        Ok(None)
    })?;
    let plan = Plan { setup, options, more, decomposition: &decomposition, begin, start };
    on_ranks(&decomposition, |comm| run_rank(&plan, comm))
}

/// Resumes the run of this case from the newest sound checkpoint in its output directory. The summary is as that of [`run`].
/// A run that is [`finished`] stays as it is. Errors: [`Error::Input`] if there is no sound checkpoint; else as [`run`].
pub fn resume(setup: &Setup, options: &RunOptions) -> Result<Option<Summary>> {
    resume_with(setup, options, &|_| Vec::new())
}

/// As [`resume`], with the caller's writers that [`run_with`] had. Errors: as [`resume`]; what a writer says.
pub fn resume_with(setup: &Setup, options: &RunOptions, more: &MoreWriters) -> Result<Option<Summary>> {
    run_from(setup, options, more, &Begin::Resumed)
}

/// Runs a branch to its end, from the newest sound checkpoint of its origin, whose files stay as they are: tables and averages begin
/// there. Errors: as [`run`].
pub fn branch(branch: &Branch, options: &RunOptions) -> Result<Option<Summary>> {
    run_from(&branch.setup, options, &|_| Vec::new(), &Begin::Branched(branch))
}

/// The summary of the run in the output directory if it has come to the end of this case: there is nothing left to resume.
pub fn finished(setup: &Setup) -> Option<Summary> {
    let summary = Summary::read(&OutputFiles::new(&setup.plan.output.directory).summary()).ok()?;
    let steady = summary.steady && setup.plan.steady.is_some();
    (!summary.interrupted && (steady || summary.steps == setup.plan.end_step)).then_some(summary)
}

/// The case of the run with this output directory, from its [newest checkpoint](saved_head); `changes` are options
/// for keys of `[run]` and `[output]`. Errors: [`Error::Input`] if there is no such checkpoint, or for a change that would make
/// another run of it. Collective.
pub fn saved_setup(directory: &Path, changes: &[String], threads: Option<usize>) -> Result<Setup> {
    let head = saved_head(directory)?;
    let CaseText { name, text, files, .. } = &head.case;
    let mut setup = read_together(Origin::Saved(name, text, files), changes, &mut Unfollowed)?;
    setup.plan.output.directory = directory.to_path_buf();
    setup.plan.threads = threads.unwrap_or(setup.plan.threads);
    Ok(setup)
}

/// Takes the output directory, unless something in it must stay.
fn claim(setup: &Setup, options: &RunOptions, kinds: &[Kind], resumes: bool) -> Result<Option<Lock>> {
    let directory = &setup.plan.output.directory;
    let lock = directory::claim(directory, kinds)?;
    if !resumes {
        directory::refuse_inputs(directory, kinds, &setup.provenance.inputs)?;
        if !options.overwrite {
            directory::refuse_results(directory, kinds)?;
        }
    }
    directory::prepare(directory, kinds)?;
    Ok(lock)
}

/// Runs `body` on as many ranks as there are blocks: the result of rank 0 (of this process, if the ranks are processes), or the
/// first error.
pub fn on_ranks<R: Send>(
    decomposition: &Decomposition,
    body: impl Fn(Comm) -> Result<R> + Sync,
) -> Result<R> {
    if decomposition.ranks() == 1 {
        return body(Comm::Solo);
    }
    #[cfg(feature = "mpi")]
    if processes().is_some() {
        let comm = world()?;
        let twin = Comm::Mpi(comm.twin());
        return checkpoint::agreed(&twin, body(Comm::Mpi(comm)));
    }
    Ok(all_good(try_on_threads(decomposition.ranks(), body)?)?.swap_remove(0))
}

/// The results of all ranks, or the first error that names a cause.
pub(super) fn all_good<R>(mut results: Vec<Result<R>>) -> Result<Vec<R>> {
    let tells = |result: &Result<R>| matches!(result, Err(error) if !matches!(error, Error::OtherRank));
    if let Some(failed) = results.iter().position(tells) {
        results.swap(0, failed);
    }
    results.into_iter().collect()
}

/// The number of processes of an MPI job, if the ranks are processes.
fn processes() -> Option<usize> {
    let size = comm::launched()?.size;
    (cfg!(feature = "mpi") && size > 1).then_some(size)
}

/// All processes of an MPI job, or this one alone. Collective.
#[cfg_attr(not(feature = "mpi"), expect(clippy::unnecessary_wraps))]
pub(super) fn job() -> Result<Comm> {
    #[cfg(feature = "mpi")]
    if processes().is_some() {
        return world().map(Comm::Mpi);
    }
    Ok(Comm::Solo)
}

/// Agrees on what every process of an MPI job does for itself: the result of this process, or the error of the first that has
/// failed, with its number. Without MPI the result as it is. Errors: [`Error::Agreed`] also if the launcher is not that of the MPI
/// of this program. Collective.
pub fn agreed<R>(result: Result<R>) -> Result<R> {
    #[cfg(feature = "mpi")]
    if processes().is_some() {
        return agreed_on(&Comm::Mpi(world()?), result);
    }
    result
}

/// The ranks of the MPI job; [`Error::Agreed`] if they are not those of the launcher. Collective.
#[cfg(feature = "mpi")]
fn world() -> Result<MpiComm> {
    let comm = MpiComm::world();
    let result = match comm::launched() {
        Some(told) if (told.rank, told.size) != (comm.rank(), comm.size()) => Err(Error::Input(format!(
            "the launcher says that this is process {} of {}, and MPI says that it is process {} of {}: the launcher and this \
             program are of different MPI libraries; start it with the mpirun or mpiexec of the MPI that it was built with",
            told.rank,
            told.size,
            comm.rank(),
            comm.size()
        ))),
        _ => Ok(()),
    };
    checkpoint::agreed(&Comm::Mpi(comm.twin()), result)?;
    Ok(comm)
}

/// Blocks with about the same work: one per process of an MPI job, else per thread that the case asks for, else per core or as many
/// as fit. Errors: [`Error::Input`] with the largest admissible number if the case asks for more than fit.
pub fn decompose(setup: &Setup) -> Result<Decomposition> {
    decompose_for(setup, processes())
}

/// The same for this number of processes, if the ranks are processes, else for threads.
pub(super) fn decompose_for(setup: &Setup, processes: Option<usize>) -> Result<Decomposition> {
    if let Some(placed) = &setup.placed {
        return Ok(placed.cut(setup.domain));
    }
    let ranks = match processes.unwrap_or(setup.plan.threads) {
        0 => Decomposition::max_ranks(setup.domain, cores()),
        asked => asked,
    };
    let (kind, remedy) = match processes {
        Some(_) => ("processes", "mpirun -n"),
        None => ("threads", "--threads"),
    };
    let blocks = if ranks == 1 {
        Decomposition::new(setup.domain, 1)
    } else {
        Decomposition::balanced(setup.domain, ranks, &Work::of(setup).weights(&Comm::Solo))
    };
    blocks.ok_or_else(|| too_many(setup, ranks, kind, remedy))
}

/// Work of each of `ranks` ranks, on a machine with these costs. Errors: [`Error::Input`] with the largest admissible number if these are too many, or
/// for a case that was [read together](super::read_together).
pub fn forecast(setup: &Setup, ranks: usize, factors: CostFactors) -> Result<Forecast> {
    refuse_divided(setup)?;
    let work = Work::with(setup, factors);
    Decomposition::balanced(setup.domain, ranks, &work.weights(&Comm::Solo))
        .map(|cut| work.forecast(&cut))
        .ok_or_else(|| too_many(setup, ranks, "ranks", "--ranks"))
}

/// Refuses a case of which this process has its own particles alone.
pub(super) fn refuse_divided(setup: &Setup) -> Result<()> {
    if setup.placed.is_none() {
        return Ok(());
    }
    let what = "an estimate needs all particles, and of a case that was read together a process has its own: read it alone";
    Err(Error::Input(what.to_string()))
}

fn too_many(setup: &Setup, ranks: usize, kind: &str, remedy: &str) -> Error {
    let [x, y, z] = setup.domain.cells;
    Error::Input(format!(
        "{ranks} {kind} are too many for a box of {x} x {y} x {z} cells: every rank needs a block at least 4 cells \
         wide; use {remedy} {}",
        Decomposition::max_ranks(setup.domain, ranks)
    ))
}

struct Plan<'a> {
    setup: &'a Setup,
    options: &'a RunOptions,
    more: &'a MoreWriters<'a>,
    decomposition: &'a Decomposition,
    begin: &'a Begin<'a>,
    start: Instant,
}

fn run_rank(plan: &Plan, comm: Comm) -> Result<Option<Summary>> {
    let &Plan { setup, options, more, decomposition, begin, start } = plan;
    let resumes = !matches!(begin, Begin::Anew);
    let log = OutputFiles::new(&setup.plan.output.directory).engine_log(setup.engine.name());
    let stop = Arc::clone(&options.stop);
    let context = Context { allowed: options.allow_engine, resumes, log: Some(log), stop };
    let dem = engine(setup, decomposition, &comm, &context)?;
    let mut simulation = Simulation::with_engine(setup, decomposition, comm, dem)?;
    let mut checkpointer = Checkpointer::new(setup, &simulation, start);
    let mut writers = writers::of(setup);
    writers.extend(more(simulation.comm.rank()));
    let observer = |simulation: &Simulation, writers| {
        let Simulation { comm, step, .. } = simulation;
        Observer::new(setup, comm, writers, *step, options.progress.clone())
    };
    let clear = |comm: &Comm, writers, run: &str| {
        let directory = &setup.plan.output.directory;
        comm.agree(match comm.rank() {
            0 => directory::clear(directory, &kinds(writers)).and_then(|()| directory::sign(directory, run)),
            _ => Ok(()),
        })
    };
    // Nothing can refuse the case once it is here: the results of an earlier run may go.
    let (mut observer, skipped) = match begin {
        Begin::Anew => {
            let run = run_id(setup, "");
            clear(&simulation.comm, &writers, &run)?;
            checkpointer.run = Some(run);
            (observer(&simulation, writers), Vec::new())
        }
        Begin::Resumed => {
            let (state, skipped) = checkpointer.restore(&mut simulation, &writers)?;
            let mut observer = observer(&simulation, writers);
            observer.resume(&simulation.comm, &state)?;
            (observer, skipped)
        }
        Begin::Branched(branch) => {
            let (run, skipped) = branch.restore(&mut simulation)?;
            clear(&simulation.comm, &writers, &run)?;
            checkpointer.run = Some(run);
            (observer(&simulation, writers), skipped)
        }
    };
    for what in skipped {
        observer.warn(&what);
    }
    let (first, mut asked) = (simulation.step, Requests::default());
    let mut balance = Balance::new(setup, &mut simulation);
    let ended = loop {
        observer.observe(&mut simulation, false)?;
        let ended = simulation.step >= setup.plan.end_step || observer.ends(&simulation);
        checkpointer.write_if_due(&mut simulation, &mut observer, asked, ended)?;
        if asked.stop || ended {
            break ended;
        }
        if let Some(balance) = &mut balance {
            balance.cut_if_due(&mut simulation, &mut |simulation| observer.complete_later(simulation))?;
        }
        let tells = simulation.step.is_multiple_of(CONTROL_INTERVAL);
        simulation.requests = if tells { checkpointer.requests(options) } else { Requests::default() };
        if let Err(error) = simulation.step() {
            // The rows of the step before are good, and that they are written is no news.
            let _ = observer.complete_later(&mut simulation);
            return Err(error);
        }
        asked = simulation.requests;
        if checkpointer.is_late(&simulation.comm, options) {
            if !asked.stop && simulation.step == first + 1 {
                observer.warn(&format!(
                    "the time limit leaves room for one step only: {:.0} s of it are kept for a checkpoint and the last files",
                    checkpointer.reserve().as_secs_f64()
                ));
            }
            asked.stop = true;
        }
    };
    observer.complete_later(&mut simulation)?;
    simulation.check()?;
    if let Some(text) = simulation.insertion_is_behind() {
        observer.warn(&text);
    }
    observer.observe(&mut simulation, true)?;
    observer.finish(&mut simulation, !ended)
}
