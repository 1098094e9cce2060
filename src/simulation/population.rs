//! Particles that come and go between two steps. [`Setup::particles`](crate::case::Setup::particles) are those of the start.

use super::{FluidSystem, Simulation};
use crate::case::Setup;
use crate::checkpoint::agreed;
use crate::dem::states::Limits;
use crate::dem::{fixed_population, population};
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::Particle;

/// Particles of all ranks by template, the same on every rank.
pub(super) struct Counts {
    /// At the start, and now.
    pub(super) start: Vec<i64>,
    now: Vec<i64>,
    /// Of all particles of the start, and of a particle of each template: weight less buoyancy (N), in the directions in which forces move
    /// it, and volume (m^3).
    all: (Vec3, f64),
    each: Vec<(Vec3, f64)>,
}

impl Counts {
    pub(super) fn of(setup: &Setup) -> Self {
        let totals = setup.totals();
        let start: Vec<i64> = totals.counts.iter().map(|&count| count as i64).collect();
        let each = (0..setup.templates.len())
            .map(|index| (setup.submerged_weight_of(index), setup.templates[index].shape.volume()));
        Self { now: start.clone(), start, all: (totals.weight(), totals.volume), each: each.collect() }
    }

    /// Weight less buoyancy and volume of all particles: to the bit those of the start where nothing has come or gone.
    pub(super) fn weight_and_volume(&self) -> (Vec3, f64) {
        let changes = self.now.iter().zip(&self.start).map(|(now, start)| (now - start) as f64);
        (changes.zip(&self.each))
            .filter(|(change, _)| *change != 0.0)
            .fold(self.all, |(weight, volume), (change, each)| {
                (weight + each.0 * change, volume + each.1 * change)
            })
    }
}

impl Simulation {
    /// Particles of all ranks of each template, the same on every rank.
    pub fn counts(&self) -> &[i64] {
        &self.counts.now
    }

    /// Counts the particles of all ranks anew, and balances their weight. Collective.
    pub(super) fn recount(&mut self) {
        self.counts.now.fill(0);
        for particle in self.dem.particles().owned() {
            self.counts.now[particle.template as usize] += 1;
        }
        self.comm.sum(&mut self.counts.now);
        let (weight, volume) = self.counts.weight_and_volume();
        if let Some(FluidSystem { driving, .. }) = &mut self.system {
            driving.carry(weight, volume);
        }
    }

    /// Limits of the states that a caller sets.
    pub(super) fn limits(&self) -> Limits {
        Limits {
            templates: self.templates.clone(),
            domain: self.domain,
            time_step: self.units.dt,
            walls: self.walls.clone(),
            time: self.time(),
            solid: self.contacts || self.caller_moves,
            continuous: self.step > 0,
        }
    }

    /// Inserts particles between two steps: of each the template, position (m), orientation, velocity (m/s) and angular velocity (1/s).
    /// Every rank hands over any of them, each by one rank, and gets the ids of its own in their order; an id is never used again. The
    /// particles begin with the momentum of the fluid that they displace. Checkpoints have them. Collective.
    ///
    /// ```
    /// # use turbid::{Builder, math::Vec3, particle::Particle};
    /// # let mut simulation = Builder::example().build()?;
    /// let more = Particle::at(0, 0, Vec3::new(1e-3, 1e-3, 1e-3));
    /// let ids = simulation.insert(&[more])?;
    /// simulation.advance(4)?;
    /// simulation.remove(&ids)?;
    /// assert_eq!((ids[0], simulation.particles().len()), (1, 1));
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) on every rank if one of them is impossible, as for
    /// [`set_particles`](Self::set_particles); [`Error::Unsupported`](crate::Error::Unsupported) from an engine whose particles neither come
    /// nor go. Nothing has changed then.
    pub fn insert(&mut self, own: &[Particle]) -> Result<Vec<u64>> {
        self.known_failure()?;
        let engine = self.dem.name();
        let next = self.dem.next_id().ok_or_else(|| fixed_population(engine))?;
        let (all, mine) = population::numbered(&self.comm, own, next);
        let (present, time) = (&self.dem.particles().particles, self.time());
        let checked = agreed(&self.comm, self.limits().new_particles(&all, present));
        self.dem.insert(&checked?, time)?;
        if let Some(FluidSystem { fluid, coupling, .. }) = &mut self.system {
            coupling.begin_inserted(fluid, self.dem.particles(), population::ids(&all), &self.comm);
        }
        for particle in &all {
            self.record.inserted[particle.template as usize] += 1;
        }
        self.recount();
        Ok(mine)
    }

    /// Removes particles between two steps, and with them their contacts and the momentum of the fluid in them. Every rank names any of
    /// them. Collective.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) on every rank if there is no such particle; [`Error::Unsupported`](crate::Error::Unsupported)
    /// from an engine whose particles neither come nor go. Nothing has changed then.
    pub fn remove(&mut self, own: &[u64]) -> Result<()> {
        self.known_failure()?;
        let engine = self.dem.name();
        self.dem.next_id().ok_or_else(|| fixed_population(engine))?;
        let ids = population::known(&self.comm, own, self.dem.particles().owned())?;
        self.dem.remove(&ids)?;
        if let Some(FluidSystem { coupling, .. }) = &mut self.system {
            coupling.remove(&ids);
        }
        let before = self.counts.now.clone();
        self.recount();
        for ((gone, before), now) in self.record.removed.iter_mut().zip(before).zip(&self.counts.now) {
            *gone += before - now;
        }
        Ok(())
    }
}
