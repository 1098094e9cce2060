//! A simulation that other threads call: what bindings to other languages, and windows, are built on.

use super::entrances::nearest_step;
use super::observe::{all_fields, all_loads, all_particles};
use super::run::{all_good, decompose};
use super::{Fields, Simulation};
use crate::case::Setup;
use crate::comm::{Comm, try_on_threads};
use crate::dem::Load;
use crate::domain::Decomposition;
use crate::error::{Error, Result};
use crate::particle::Particle;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

type Job = Arc<dyn Fn(&mut Simulation) + Send + Sync>;

/// A [`Simulation`] on threads of its own, one per rank, which any other thread may call. Lists are of all ranks, particles
/// ascending by id. Once a step has failed, every later one returns the same error; what has been reached can still be read.
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
    ranks: Mutex<Vec<Sender<Job>>>,
    thread: Mutex<Option<JoinHandle<Result<()>>>>,
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

impl Session {
    /// The case at rest with the engine it asks for, on as many threads as it asks for
    /// ([`Builder::threads`](crate::Builder::threads)).
    ///
    /// # Errors
    /// As [`Simulation::new`] and [`Simulation::on_ranks`]; [`Error::Input`] for a case in which particles come and go.
    pub fn new(setup: Setup) -> Result<Self> {
        Self::with(setup, Simulation::new)
    }

    /// The same with particles that the caller moves, as [`Simulation::caller_driven`]; errors as [`new`](Self::new).
    pub fn caller_driven(setup: Setup) -> Result<Self> {
        Self::with(setup, Simulation::caller_driven)
    }

    fn with(setup: Setup, new: fn(&Setup, &Decomposition, Comm) -> Result<Simulation>) -> Result<Self> {
        if setup.changes_population() {
            let what = "particles of `insertion` and `removal` come and go, but those of a session, in C or Python, are always the same: \
                        run the case with turbid, or with `Simulation` of the Rust library";
            return Err(Error::Input(what.to_string()));
        }
        let cut = Arc::new(decompose(&setup)?);
        let setup = Arc::new(setup);
        let (ranks, jobs): (Vec<_>, Vec<_>) = (0..cut.ranks()).map(|_| channel()).unzip();
        let jobs: Vec<_> = jobs.into_iter().map(Mutex::new).collect();
        let (of_case, of_ranks) = (setup.clone(), cut.clone());
        let start = move || {
            let rank = |comm: Comm| {
                let rank = comm.rank();
                serve(new(&of_case, &of_ranks, comm), &jobs[rank])
            };
            match of_ranks.ranks() {
                1 => rank(Comm::Solo),
                ranks => all_good(try_on_threads(ranks, rank)?).map(|_| ()),
            }
        };
        let thread = Builder::new().name("turbid".into()).spawn(start);
        let refused = |error| Error::Input(format!("cannot start a thread: {error}"));
        let thread = Mutex::new(Some(thread.map_err(refused)?));
        let session = Self { setup, cut, ranks: Mutex::new(ranks), thread, process: std::process::id() };
        session.on_ranks(|_| Ok(()))?;
        Ok(session)
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

    /// All particles; see [`Simulation::particles`].
    pub fn particles(&self) -> Result<Vec<Particle>> {
        self.on_root(|simulation| Ok(all_particles(simulation, |_| true)))
    }

    /// Sets the states of all particles; errors as [`Simulation::set_particles`].
    pub fn set_particles(&self, states: Vec<Particle>) -> Result<()> {
        self.on_root(move |simulation| simulation.set_particles(&states))
    }

    /// Load of the fluid in the last step, buoyancy included, on each particle; zeros without a fluid and before the first step.
    pub fn loads(&self) -> Result<Vec<Load>> {
        self.on_root(|simulation| {
            let particles = all_particles(simulation, |_| true);
            let none = || vec![Load::default(); particles.len()];
            Ok(all_loads(simulation, &particles).unwrap_or_else(none))
        })
    }

    /// Loads of the caller's on all particles, ascending by id, from now on in every step, on none that come later; see [`Simulation::set_external_load`].
    ///
    /// # Errors
    /// [`Error::Input`] if these are not finite, or not as many as there are particles, or if the caller moves the particles.
    pub fn set_external_loads(&self, loads: Vec<Load>) -> Result<()> {
        let ids: Vec<u64> = self.particles()?.iter().map(|particle| particle.id).collect();
        let count = ids.len();
        if loads.len() != count {
            return Err(Error::Input(format!("there are {count} particles, but {} loads", loads.len())));
        }
        if !loads.iter().all(|load| load.force.iter().chain(load.torque.iter()).all(|x| x.is_finite())) {
            return Err(Error::Input("a load of the caller's is not finite".into()));
        }
        let (ids, loads) = (Arc::new(ids), Arc::new(loads));
        self.on_root(move |simulation| {
            if simulation.caller_moves {
                return Err(Error::Input(
                    "the caller moves the particles, so no load of the caller's acts on them".into(),
                ));
            }
            let (ids, loads) = (ids.clone(), loads.clone());
            simulation.set_external_load(move |_, particle| {
                ids.binary_search(&particle.id).map_or_else(|_| Load::default(), |at| loads[at])
            });
            Ok(())
        })
    }

    /// Fields of the whole box, x varying fastest; see [`Simulation::fields`].
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn fields(&self) -> Result<Fields> {
        let cut = self.cut.clone();
        self.on_root(move |simulation| match simulation.fluid() {
            Some(_) => all_fields(simulation, &cut),
            None => Ok(Fields::default()),
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
