//! A simulation that other threads call: what bindings to other languages, and windows, are built on.

use super::caller::all_or_words;
use super::entrances::nearest_step;
use super::observe::all_fields;
use super::run::{all_good, decompose_for};
use super::together::read_on;
use super::{Fields, Simulation};
use crate::case::{Origin, Setup};
#[cfg(feature = "mpi")]
use crate::comm::MpiComm;
use crate::comm::{Comm, try_on_threads};
use crate::dem::Load;
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::packing::progress::Unfollowed;
use crate::particle::Particle;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

type Job = Arc<dyn Fn(&mut Simulation) + Send + Sync>;

/// A [`Simulation`] on threads of its own, one per rank, which any other thread may call; or one rank of the processes of a
/// [communicator](Self::on_communicator), on a thread of its own. Once a step has failed, every later one returns the same error; what has
/// been reached can still be read.
///
/// Lists are of the particles of this process, ascending by id: of all, if it is the only one. One of several has those that it has
/// [set](Self::set_particles) last, wherever they are; until it has set any, those in its [block](Self::block) now.
///
/// ```
/// use turbid::{Builder, simulation::Session};
/// let session = Session::new(Builder::example().threads(2).setup()?)?;
/// session.advance(10)?;
/// let times = session.on_ranks(|simulation| Ok(simulation.time()))?;
/// assert_eq!(times, [10.0 * session.setup().time_step; 2]);
/// assert!(session.particles()?[0].velocity().z < 0.0);
/// # Ok::<(), turbid::Error>(())
/// ```
pub struct Session {
    setup: Arc<Setup>,
    cut: Arc<Decomposition>,
    block: Block,
    is_of_several: bool,
    ranks: Mutex<Vec<Sender<Job>>>,
    thread: Mutex<Option<JoinHandle<Result<()>>>>,
    /// Ids of the particles that the caller has set last; of one process alone, those of all.
    held: Mutex<Option<Arc<[u64]>>>,
    /// The process that has these threads.
    process: u32,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One rank, which does jobs until nobody can send any more.
fn serve(simulation: Result<Simulation>, jobs: &Mutex<Receiver<Job>>) -> Result<()> {
    let mut simulation = simulation?;
    lock(jobs).iter().for_each(|job| job(&mut simulation));
    Ok(())
}

fn ids(particles: &[Particle]) -> Arc<[u64]> {
    particles.iter().map(|particle| particle.id).collect()
}

/// True on the rank that has the lists of the caller of its process.
fn has_caller(simulation: &Simulation) -> bool {
    simulation.comm.ranks_per_process() == 1 || simulation.comm.rank() == 0
}

/// The processes of a caller's communicator. Collective.
#[cfg(feature = "mpi")]
fn job_of(communicator: i32) -> Result<Comm> {
    MpiComm::of_caller(communicator).map(Comm::Mpi)
}

#[cfg(not(feature = "mpi"))]
fn job_of(_: i32) -> Result<Comm> {
    let what = "a communicator needs MPI, which this turbid was built without: build it with the cargo feature `mpi`";
    Err(Error::Input(what.to_string()))
}

/// Does the work of a rank that is a process; a panic ends them all, since the others would wait for it.
fn of_job(work: impl FnOnce() -> Result<()>) -> Result<()> {
    let done = catch_unwind(AssertUnwindSafe(work));
    #[cfg(feature = "mpi")]
    if done.is_err() {
        crate::comm::abort(101);
    }
    done.unwrap_or_else(|panic| resume_unwind(panic))
}

impl Session {
    /// The case at rest with the engine it asks for, on as many threads as it asks for
    /// ([`Builder::threads`](crate::Builder::threads)).
    ///
    /// # Errors
    /// As [`Simulation::new`] and [`Simulation::on_ranks`]; [`Error::Input`] for a case in which particles come and go.
    pub fn new(setup: Setup) -> Result<Self> {
        Self::with(setup, Simulation::new, None)
    }

    /// The same with particles that the caller moves, as [`Simulation::caller_driven`]; errors as [`new`](Self::new).
    pub fn caller_driven(setup: Setup) -> Result<Self> {
        Self::with(setup, Simulation::caller_driven, None)
    }

    /// A case on the processes of a communicator of a program that has started MPI for calls from several threads
    /// (`MPI_THREAD_SERIALIZED`), given by its handle of Fortran's (`MPI_Comm_c2f`); with particles that the engine of the case moves, or the
    /// caller. Each process is a rank, and the case is read as by [`read_together`](super::read_together). Collective, as is every method but [`setup`](Self::setup), [`block`](Self::block), [`is_of_several`](Self::is_of_several),
    /// [`nearest_step`](Self::nearest_step) and [`check_process`](Self::check_process), and the end of the session.
    ///
    /// # Errors
    /// As [`new`](Self::new) and those of the case, the same on every process; [`Error::Input`] if MPI does not run or for one thread alone, or if Turbid was
    /// built without the cargo feature `mpi`.
    pub fn on_communicator(
        origin: Origin,
        options: &[String],
        communicator: i32,
        caller_moves: bool,
    ) -> Result<Self> {
        let new = if caller_moves { Simulation::caller_driven } else { Simulation::new };
        let job = job_of(communicator)?;
        let setup = read_on(&job, origin, options, &mut Unfollowed)?;
        Self::with(setup, new, Some(job))
    }

    fn with(
        setup: Setup,
        new: fn(&Setup, &Decomposition, Comm) -> Result<Simulation>,
        job: Option<Comm>,
    ) -> Result<Self> {
        if setup.changes_population() {
            let what = "particles of `insertion` and `removal` come and go, but those of a session, in C or Python, are always the same: \
                        run the case with turbid, or with `Simulation` of the Rust library";
            return Err(Error::Input(what.to_string()));
        }
        let cut = Arc::new(decompose_for(&setup, job.as_ref().map(Comm::size))?);
        let setup = Arc::new(setup);
        let here = if job.is_some() { 1 } else { cut.ranks() };
        let (ranks, jobs): (Vec<_>, Vec<_>) = (0..here).map(|_| channel()).unzip();
        let jobs: Vec<_> = jobs.into_iter().map(Mutex::new).collect();
        let is_of_several = job.is_some();
        let block = match &job {
            Some(comm) => cut.block(comm.rank()),
            None => Block { lo: [0; 3], hi: cut.domain.cells },
        };
        let held = (!is_of_several).then(|| {
            let mut all: Vec<u64> = setup.particles.iter().map(|particle| particle.id).collect();
            all.sort_unstable();
            all.into()
        });
        let (of_case, of_ranks) = (setup.clone(), cut.clone());
        let start = move || match job {
            Some(comm) => of_job(|| serve(new(&of_case, &of_ranks, comm), &jobs[0])),
            None => match of_ranks.ranks() {
                1 => serve(new(&of_case, &of_ranks, Comm::Solo), &jobs[0]),
                ranks => {
                    let rank = |comm: Comm| {
                        let jobs = &jobs[comm.rank()];
                        serve(new(&of_case, &of_ranks, comm), jobs)
                    };
                    all_good(try_on_threads(ranks, rank)?).map(|_| ())
                }
            },
        };
        let thread = Builder::new().name("turbid".into()).spawn(start);
        let refused = |error| Error::Input(format!("cannot start a thread: {error}"));
        let thread = Mutex::new(Some(thread.map_err(refused)?));
        let session = Self {
            setup,
            is_of_several,
            block,
            cut,
            ranks: Mutex::new(ranks),
            thread,
            held: Mutex::new(held),
            process: std::process::id(),
        };
        session.on_ranks(|_| Ok(()))?;
        Ok(session)
    }

    /// True if the session is one of several on a communicator.
    pub fn is_of_several(&self) -> bool {
        self.is_of_several
    }

    /// The cells of this process: those of the whole box, if it is the only one.
    pub fn block(&self) -> Block {
        self.block
    }

    /// The case.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Checks that this process has the threads of the session.
    ///
    /// # Errors
    /// [`Error::Input`] in a process that was forked after the session was made: threads do not survive a fork.
    pub fn check_process(&self) -> Result<()> {
        let (opened, here) = (self.process, std::process::id());
        if opened == here {
            return Ok(());
        }
        Err(Error::Input(format!(
            "the threads of this simulation are in process {opened}, of which process {here} is a fork; open the simulation in the \
             process that steps it"
        )))
    }

    /// Calls `body` on every rank and returns the results by rank. Calls from several threads follow each other.
    ///
    /// # Errors
    /// The first error of `body` that names a cause; [`Error::Input`] after a panic; those of
    /// [`check_process`](Self::check_process).
    ///
    /// # Panics
    /// If `body` panics on a rank. All ranks have ended then.
    pub fn on_ranks<R: Send + 'static>(
        &self,
        body: impl Fn(&mut Simulation) -> Result<R> + Send + Sync + 'static,
    ) -> Result<Vec<R>> {
        // First: in a forked process the lock may be that of a thread that is not there.
        self.check_process()?;
        let mut ranks = lock(&self.ranks);
        let (tell, told) = channel();
        let job: Job = Arc::new(move |simulation| {
            let rank = simulation.comm().rank();
            // Nobody listens if another rank has ended.
            let _ = tell.send((rank, body(simulation)));
        });
        // A rank that has ended drops the job, and with it the last sender.
        let _ = ranks.iter().try_for_each(|rank| rank.send(job.clone()));
        drop(job);
        let mut results: Vec<_> = told.iter().collect();
        if ranks.is_empty() || results.len() < ranks.len() {
            ranks.clear();
            return Err(self.end());
        }
        results.sort_unstable_by_key(|(rank, _)| *rank);
        all_good(results.into_iter().map(|(_, result)| result).collect())
    }

    /// Waits for the end of all ranks, which have nobody to send jobs any more, and returns its reason.
    fn end(&self) -> Error {
        match lock(&self.thread).take().map(JoinHandle::join) {
            Some(Err(panic)) => resume_unwind(panic),
            Some(Ok(Err(error))) => error,
            _ => Error::Input("this simulation has ended by a failure before".into()),
        }
    }

    /// The result of rank 0; errors as [`on_ranks`](Self::on_ranks).
    pub fn on_root<R: Send + 'static>(
        &self,
        body: impl Fn(&mut Simulation) -> Result<R> + Send + Sync + 'static,
    ) -> Result<R> {
        Ok(self.on_ranks(body)?.swap_remove(0))
    }

    /// Advances by `count` time steps; errors as [`Simulation::advance`].
    pub fn advance(&self, count: u64) -> Result<()> {
        self.on_root(move |simulation| simulation.advance(count))
    }

    /// Advances to a time (s); errors as [`Simulation::run_until`].
    pub fn run_until(&self, time: f64) -> Result<()> {
        self.on_root(move |simulation| simulation.run_until(time))
    }

    /// The step nearest to a time (s).
    ///
    /// # Errors
    /// [`Error::Input`] for a time that no run reaches.
    pub fn nearest_step(&self, time: f64) -> Result<u64> {
        nearest_step(time, self.setup.time_step)
    }

    /// Looks for a failure since the last control; errors as [`Simulation::check`].
    pub fn check(&self) -> Result<()> {
        self.on_root(Simulation::check)
    }

    /// Steps done.
    pub fn steps_done(&self) -> Result<u64> {
        self.on_root(|simulation| Ok(simulation.steps_done()))
    }

    /// Calls `body` on every rank with the ids of the particles that the caller has there; the result where it is.
    fn on_held<R: Send + 'static>(
        &self,
        body: impl Fn(&mut Simulation, &[u64]) -> Result<R> + Send + Sync + 'static,
    ) -> Result<R> {
        let held = lock(&self.held).clone();
        self.on_root(move |simulation| {
            let held = match &held {
                Some(held) if has_caller(simulation) => held.clone(),
                Some(_) => Arc::default(),
                None => ids(simulation.particles()),
            };
            body(simulation, &held)
        })
    }

    /// Number of particles of this process.
    pub fn count(&self) -> Result<usize> {
        self.on_held(|_, held| Ok(held.len()))
    }

    /// The particles of this process; see [`Simulation::particles`].
    pub fn particles(&self) -> Result<Vec<Particle>> {
        self.on_held(|simulation, held| simulation.particles_of(held))
    }

    /// Sets the states of the particles of this process, which with those of the others are all; errors as
    /// [`Simulation::set_particles`].
    pub fn set_particles(&self, states: Vec<Particle>) -> Result<()> {
        let held = ids(&states);
        self.on_root(move |simulation| {
            simulation.set_particles(if has_caller(simulation) { &states } else { &[] })
        })?;
        *lock(&self.held) = Some(held);
        Ok(())
    }

    /// Load of the fluid in the last step, buoyancy included, on each particle of this process; zeros without a fluid and before the first
    /// step.
    pub fn loads(&self) -> Result<Vec<Load>> {
        self.on_held(|simulation, held| Ok(simulation.loads_of(held)))
    }

    /// Loads of the caller's on the particles of this process, from now on in every step; see [`Simulation::set_external_loads`].
    ///
    /// # Errors
    /// [`Error::Input`] if these are not finite, or not as many as the process has particles, or if the caller moves the particles.
    pub fn set_external_loads(&self, loads: Vec<Load>) -> Result<()> {
        let loads: Arc<[Load]> = loads.into();
        self.on_held(move |simulation, held| {
            let loads = if has_caller(simulation) { &loads[..] } else { &[] };
            let fit = if loads.len() == held.len() {
                Ok(())
            } else {
                Err(format!("there are {} particles, but {} loads", held.len(), loads.len()))
            };
            all_or_words(&simulation.comm, "", fit)?;
            let listed: Vec<(u64, Load)> = held.iter().copied().zip(loads.iter().copied()).collect();
            simulation.set_external_loads(&listed)
        })
    }

    /// Fields of the [block](Self::block) of this process, x varying fastest; see [`Simulation::fields`].
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn fields(&self) -> Result<Fields> {
        let cut = self.cut.clone();
        self.on_root(move |simulation| match simulation.fluid() {
            Some(_) if simulation.comm.ranks_per_process() == simulation.comm.size() => {
                all_fields(simulation, &cut)
            }
            _ => simulation.fields(),
        })
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if self.check_process().is_err() {
            // The other end of the channels, and the thread, are in another process.
            self.ranks.get_mut().map(std::mem::take).map(std::mem::forget).ok();
            self.thread.get_mut().map(Option::take).map(std::mem::forget).ok();
            return;
        }
        lock(&self.ranks).clear();
        if let Some(thread) = lock(&self.thread).take() {
            // A panic has been told to whoever called.
            let _ = thread.join();
        }
    }
}
