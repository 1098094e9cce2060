//! Particles by id for a caller on any rank: states that it sets, states and loads that it gets, and loads of its own.
//!
//! A caller need not know who owns a particle: [`Comm::fetch`] brings its states to their owners, and loads back.

use super::Simulation;
use crate::comm::{Comm, Fetched};
use crate::dem::states::{self, Deep};
use crate::dem::{Load, LoadRow, LocalParticles};
use crate::error::{Error, Result};
use crate::particle::Particle;
use bytemuck::{Pod, Zeroable};

/// A particle on its way to the rank whose block it is in now.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Moved {
    now: Particle,
    /// State before the last step.
    before: Particle,
    load: LoadRow,
}

/// Load of the caller on a particle at a time (s).
type ExternalLoad = Box<dyn FnMut(f64, &Particle) -> Load>;

/// Loads of the caller.
pub(super) enum ExternalLoads {
    Computed(ExternalLoad),
    /// Those that this rank has, by id.
    Listed(Vec<(u64, LoadRow)>),
}

impl ExternalLoads {
    /// Adds them to the loads of the owned particles at a time (s). Collective if they are listed.
    pub(super) fn add_to(&mut self, loads: &mut [Load], owned: &[Particle], time: f64, comm: &Comm) {
        match self {
            Self::Computed(compute) => {
                for (load, particle) in loads.iter_mut().zip(owned) {
                    *load += compute(time, particle);
                }
            }
            Self::Listed(listed) => {
                let found = comm.fetch(listed, &ids(owned)).found;
                for (sum, own) in loads.iter_mut().zip(found) {
                    *sum += own.map_or_else(Load::default, Load::from);
                }
            }
        }
    }
}

fn ids(particles: &[Particle]) -> Vec<u64> {
    particles.iter().map(|particle| particle.id).collect()
}

/// The result of this rank if all have succeeded; else, on all, the words of the first that has failed, after `prefix`. Collective.
pub(super) fn all_or_words<R>(
    comm: &Comm,
    prefix: &str,
    result: std::result::Result<R, String>,
) -> Result<R> {
    comm.agree_words(result).map_err(|what| Error::Input(format!("{prefix}{what}")))
}

/// Begins the error for states that cannot be set.
const REFUSED: &str = "the states of the particles cannot be set: ";

impl Simulation {
    /// Sets position (m), orientation, velocity (m/s) and angular velocity (1/s) of all particles; what else `states` hold is not read.
    /// Every rank gives any of them, ascending by id, each by one rank. Positions are wrapped; what does not change keeps
    /// every bit. The fluid meets the new states in the next step. After the first step, particles may be a cell away from where they are,
    /// or, if the caller moves them, from where they were before the last step. Collective.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// let mut states = simulation.particles().to_vec();
    /// states[0].velocity = [0.0, 0.0, 1e-3];
    /// simulation.set_particles(&states)?;
    /// assert_eq!(simulation.particles()[0].velocity().z, 1e-3);
    /// assert!(simulation.set_particles(&[]).is_err());
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Input`] on every rank, with nothing changed, if `states` are not those of all particles, or impossible: not finite, too
    /// fast, too far away, or deeper in another body, with which it does not move as one, or a wall than a quarter of the thickness;
    /// [`Error::Unsupported`] from an engine of which no states can be set.
    pub fn set_particles(&mut self, states: &[Particle]) -> Result<()> {
        let step = self.step;
        let before = match self.before.take() {
            Some((of, before)) if of == step => before,
            _ => {
                let dt = if self.caller_moves && step > 0 { self.units.dt } else { 0.0 };
                states::earlier(self.particles(), &self.domain, dt)
            }
        };
        let placed = self.place(states, &before);
        // What was before the step moves along with the particles.
        self.before = Some((step, placed.as_ref().map_or(before, Clone::clone)));
        placed.map(drop)
    }

    /// Gives the particles these states, which were as in `before` before the last step; the states of those that this rank owns then as
    /// they were before it. Collective.
    fn place(&mut self, states: &[Particle], before: &[Particle]) -> Result<Vec<Particle>> {
        let changed = self.changed(states, before);
        let changed = all_or_words(&self.comm, REFUSED, changed)?;
        let to_owner = |moved: Moved| (self.cut.owner(moved.now.position()), moved);
        let arrived = self.comm.route_records(changed.into_iter().map(to_owner));
        let mut arrived: Vec<Moved> = arrived.into_iter().flat_map(|(_, moved)| moved).collect();
        arrived.sort_unstable_by_key(|moved| moved.now.id);
        let owned = arrived.iter().map(|moved| (moved.now, moved.load.into())).collect();
        let before: Vec<Particle> = arrived.iter().map(|moved| moved.before).collect();
        let (comm, limits) = (self.comm.clone(), self.limits());
        self.dem.place(&comm, owned, &mut |[was, now]| {
            let bodies = now.store.particles.iter().map(|particle| (*particle, !stays(particle, was)));
            let bodies: Vec<(Particle, bool)> = bodies.collect();
            let mut deep: Vec<Deep> = limits.overlaps(&bodies).collect();
            if comm.any(deep.iter().any(|deep| deep.other.is_some())) {
                let pairs = deep.iter().filter_map(|deep| Some([deep.body, deep.other?]));
                let wanted: Vec<u64> = pairs.flatten().map(|at| bodies[at].0.id).collect();
                let offered: Vec<(u64, Particle)> = before.iter().map(|state| (state.id, *state)).collect();
                let mut then = comm.fetch(&offered, &wanted).found.into_iter();
                deep.retain(|Deep { body, other, .. }| {
                    let Some(other) = other else { return true };
                    let then = then.next().flatten().zip(then.next().flatten());
                    let as_one = |(one, two): (Particle, Particle)| {
                        limits.move_as_one([&bodies[*body].0, &bodies[*other].0], [&one, &two])
                    };
                    !then.is_some_and(as_one)
                });
            }
            let first = deep.into_iter().next().map(|deep| deep.words);
            all_or_words(&comm, REFUSED, first.map_or(Ok(()), Err))
        })?;
        Ok(before)
    }

    /// The owned particles in the states that the ranks give, or the reason why they cannot be in them. Collective.
    fn changed(&self, states: &[Particle], before: &[Particle]) -> std::result::Result<Vec<Moved>, String> {
        let offered: Vec<(u64, Particle)> = states.iter().map(|state| (state.id, *state)).collect();
        let owned = self.particles();
        let Fetched { found, twice, unwanted } = self.comm.fetch(&offered, &ids(owned));
        if let Some([first, second]) =
            states.windows(2).map(|pair| [pair[0].id, pair[1].id]).find(|[a, b]| a >= b)
        {
            return Err(format!("the ids must ascend, but {second} follows {first}"));
        }
        if let Some(id) = twice {
            return Err(format!("particle {id} is given twice"));
        }
        let (limits, loads) = (self.limits(), self.dem.loads());
        let states = owned.iter().zip(before).zip(found).enumerate();
        let changed = states.map(|(n, ((was, before), state))| {
            let state = state.ok_or_else(|| format!("that of particle {} is missing", was.id))?;
            let now = limits.changed(was, before, &state)?;
            Ok(Moved { now, before: *before, load: loads.get(n).copied().unwrap_or_default().into() })
        });
        let changed = changed.collect::<std::result::Result<Vec<Moved>, String>>()?;
        unwanted.map_or(Ok(changed), |id| Err(format!("there is no particle {id}")))
    }

    /// The particles with these ids, which any ranks own, in this order. Collective.
    ///
    /// # Errors
    /// [`Error::Input`] on every rank if there is no particle of one of them.
    pub fn particles_of(&self, ids: &[u64]) -> Result<Vec<Particle>> {
        let offered: Vec<(u64, Particle)> = self.particles().iter().map(|own| (own.id, *own)).collect();
        let found = ids.iter().zip(self.comm.fetch(&offered, ids).found);
        let known = found.map(|(id, particle)| particle.ok_or_else(|| format!("there is no particle {id}")));
        all_or_words(&self.comm, "", known.collect())
    }

    /// Load of the fluid in the last step, buoyancy included, on each particle with these ids, which any ranks own, in this order; zeros
    /// without a fluid and before the first step. Collective.
    pub fn loads_of(&self, ids: &[u64]) -> Vec<Load> {
        let offered: Vec<(u64, LoadRow)> = self.loads().map(|(id, load)| (id, load.into())).collect();
        let found = self.comm.fetch(&offered, ids).found;
        found.into_iter().map(|found| found.map_or_else(Load::default, Load::from)).collect()
    }

    /// Adds a load of the caller's to that of the fluid, from now on in every step on every particle that this rank owns: a
    /// function of the time at the start of the step (s) and the particle. It is no part of a checkpoint, and particles that the
    /// [caller moves](Self::caller_driven) do not feel it.
    ///
    /// ```
    /// # use turbid::{Builder, dem::Load, math::Vec3};
    /// # let mut simulation = Builder::example().gravity([0.0; 3]).build()?;
    /// simulation.set_external_load(|_time, _particle| Load { force: Vec3::x() * 1e-6, ..Load::default() });
    /// simulation.advance(10)?;
    /// assert!(simulation.particles()[0].velocity().x > 0.0);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn set_external_load(&mut self, load: impl FnMut(f64, &Particle) -> Load + 'static) {
        self.external = Some(ExternalLoads::Computed(Box::new(load)));
    }

    /// The same with constant loads, by id: every rank gives any of them, each by one rank; on the others there is none. Collective, and
    /// so are two messages in every step from now on.
    ///
    /// # Errors
    /// [`Error::Input`] on every rank if a load is not finite, or if the caller moves the particles.
    pub fn set_external_loads(&mut self, loads: &[(u64, Load)]) -> Result<()> {
        let is_finite = |load: &Load| load.force.iter().chain(&load.torque).all(|x| x.is_finite());
        let refused = if self.caller_moves {
            Err("the caller moves the particles, so no load of the caller's acts on them")
        } else if loads.iter().all(|(_, load)| is_finite(load)) {
            Ok(())
        } else {
            Err("a load of the caller's is not finite")
        };
        all_or_words(&self.comm, "", refused.map_err(str::to_owned))?;
        let listed = loads.iter().map(|(id, load)| (*id, (*load).into())).collect();
        self.external = Some(ExternalLoads::Listed(listed));
        Ok(())
    }
}

/// True if a particle is where it was on this rank.
fn stays(particle: &Particle, was: &LocalParticles) -> bool {
    let pose = |of: &Particle| (of.position.map(f64::to_bits), of.orientation.map(f64::to_bits));
    was.index_of(particle.id).is_some_and(|at| pose(&was.store.particles[at]) == pose(particle))
}
