//! Calls of a program that embeds a simulation: start, advance, and reading between two steps.

use super::observe::own_fields;
use super::{Fields, Simulation, run};
use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::{Ballistic, Load};
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::particle::Particle;

/// Largest number of steps, as of a case.
const MOST_STEPS: f64 = 1e15;

/// Refuses more steps than any case has, and NaN.
pub(super) fn refuse_endless(steps: f64, time_step: f64) -> Result<()> {
    if steps.abs() <= MOST_STEPS {
        return Ok(());
    }
    Err(Error::Input(format!(
        "{steps:e} steps are asked for, but at most {MOST_STEPS:e} steps of {time_step:.3e} s are possible"
    )))
}

/// The step nearest to a time (s), the earlier one of two. Errors: [`Error::Input`] if it is further than any case goes.
pub(super) fn nearest_step(time: f64, time_step: f64) -> Result<u64> {
    let steps = (time / time_step - 0.5).ceil();
    refuse_endless(steps, time_step).map(|()| steps.max(0.0) as u64)
}

impl Simulation {
    /// The whole case on one rank in this thread, at rest; errors as [`new`](Self::new).
    pub fn solo(setup: &Setup) -> Result<Self> {
        Self::new(setup, &Decomposition::solo(setup.domain), Comm::Solo)
    }

    /// The case at rest, with particles that the caller moves: they keep their velocities until
    /// [`set_particles`](Self::set_particles) gives them other states. Contacts, gravity and prescribed motions of the case are the
    /// caller's business. Collective.
    ///
    /// ```
    /// use turbid::{Builder, Simulation, comm::Comm, domain::Decomposition};
    /// let setup = Builder::example().setup()?;
    /// let mut simulation = Simulation::caller_driven(&setup, &Decomposition::solo(setup.domain), Comm::Solo)?;
    /// let (mass, dt) = (setup.templates[0].mass(), setup.time_step);
    /// for _ in 0..10 {
    ///     let mut sphere = simulation.particles()[0];
    ///     simulation.step()?;
    ///     let (_, load) = simulation.loads().next().expect("a particle");
    ///     let velocity = sphere.velocity() + (load.force / mass + setup.gravity) * dt;
    ///     sphere.position = (sphere.position() + velocity * dt).into();
    ///     sphere.velocity = velocity.into();
    ///     simulation.set_particles(&[sphere])?;
    /// }
    /// assert!(simulation.particles()[0].velocity().z < -1e-3);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`with_engine`](Self::with_engine).
    pub fn caller_driven(setup: &Setup, decomposition: &Decomposition, comm: Comm) -> Result<Self> {
        let templates = setup.templates.clone();
        let handed = super::engine::handed(setup, decomposition, &comm);
        let engine = Ballistic::new(decomposition.clone(), comm.rank(), templates, &[]).with(&comm, &handed);
        let simulation = Self::with_engine(setup, decomposition, comm, Box::new(engine))?;
        Ok(Self { caller_moves: true, ..simulation })
    }

    /// Calls `body` on every rank with its part of the case, at rest, and returns the result of rank 0. Ranks are threads, as many
    /// as the case asks for ([`Builder::threads`](crate::Builder::threads)), or the processes of an MPI job.
    ///
    /// Every rank must make the same collective calls, and take part in an error that only some of them notice ([`Comm::agree`]).
    ///
    /// ```
    /// use turbid::{Builder, Simulation};
    /// let hash = |threads| {
    ///     let setup = Builder::example().threads(threads).setup()?;
    ///     Simulation::on_ranks(&setup, |mut simulation| {
    ///         simulation.advance(4)?;
    ///         Ok(simulation.state_hash())
    ///     })
    /// };
    /// assert_eq!(hash(1)?, hash(2)?);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Input`] if the box has no room for these ranks; the first error of `body`.
    pub fn on_ranks<R: Send>(setup: &Setup, body: impl Fn(Self) -> Result<R> + Sync) -> Result<R> {
        let decomposition = run::agreed(run::decompose(setup))?;
        run::on_ranks(&decomposition, |comm| body(Self::new(setup, &decomposition, comm)?))
    }

    /// Advances by whole steps to the one nearest to a time (s), and [checks](Self::check); errors as [`step`](Self::step), and
    /// [`Error::Input`] for a time that no run reaches. Collective.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// simulation.run_until(5.2 * simulation.time_step())?;
    /// assert_eq!(simulation.steps_done(), 5);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn run_until(&mut self, time: f64) -> Result<()> {
        let last = nearest_step(time, self.units.dt)?;
        self.advance(last.saturating_sub(self.step))?;
        self.check()
    }

    /// Time since the start (s).
    pub fn time(&self) -> f64 {
        self.step as f64 * self.units.dt
    }

    /// Time step (s).
    pub fn time_step(&self) -> f64 {
        self.units.dt
    }

    /// The particles that this rank owns, ascending by id: all of them on one rank. Positions in m, velocities in m/s, angular
    /// velocities in 1/s.
    pub fn particles(&self) -> &[Particle] {
        self.dem.particles().owned()
    }

    /// Load of the fluid in the last step, buoyancy included, on each particle that this rank owned in it, with its id, ascending.
    /// Nothing without a fluid and before the first step.
    pub fn loads(&self) -> impl Iterator<Item = (u64, Load)> {
        self.swept().map(|(particle, load)| (particle.id, load))
    }

    /// The particles that this rank owned in the last step, as they were at its start, with their [loads](Self::loads).
    pub(super) fn swept(&self) -> impl Iterator<Item = (&Particle, Load)> {
        let stepped = self.system.as_ref().filter(|_| self.step > 0);
        stepped.into_iter().flat_map(|system| system.coupling.last_loads())
    }

    /// The cells of this rank: the whole box on one rank.
    pub fn block(&self) -> Block {
        self.block
    }

    /// Fields of the [block](Self::block) of this rank, with the particles where they are now. Changes nothing. Empty without a
    /// fluid.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// simulation.advance(2)?;
    /// let fields = simulation.fields()?;
    /// for (cell, fraction) in simulation.block().cells().zip(&fields.solid_fraction) {
    ///     assert!(*fraction < 0.01 || cell.iter().all(|x| (5..11).contains(x)), "only in the middle");
    /// }
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Memory`] on this rank.
    pub fn fields(&mut self) -> Result<Fields> {
        match self.fluid() {
            Some(_) => own_fields(self, self.block),
            None => Ok(Fields::default()),
        }
    }
}
