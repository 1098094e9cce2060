//! State of the coupling between two steps, for checkpoints: poses of the particles in the last sweep, and what
//! left their cells then.

use super::Coupling;
use crate::comm::Comm;
use crate::dem::{Load, LoadRow};
use crate::fluid::ExchangeSum;
use crate::math::FIXED_POINT_LIMIT;
use crate::particle::{Particle, ParticleStore};
use bytemuck::{Pod, Zeroable};
use std::collections::{BTreeMap, BTreeSet};

/// A particle in the last sweep, and the momentum that left those of its cells that are in the block.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Swept {
    particle: Particle,
    departed: ExchangeSum,
    /// Force (N) and torque (N m) of the fluid, from the owner.
    load: LoadRow,
}

/// The same where there are virtual masses.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SweptLight {
    swept: Swept,
    /// Mean force (N) and torque (N m) of the past, weight included, from the owner.
    mean: LoadRow,
}

impl SweptLight {
    /// Adds what another rank has of the same particle. The sums of `departed` are integers, and only the owner has loads that are not zero.
    fn add(&mut self, other: &Self) {
        self.swept.departed.add(&other.swept.departed, 1);
        let loads = [(&mut self.swept.load, &other.swept.load), (&mut self.mean, &other.mean)];
        for (sums, own) in loads {
            let pairs = sums.as_flattened_mut().iter_mut().zip(own.as_flattened());
            pairs.for_each(|(sum, own)| *sum += own);
        }
    }
}

impl Coupling {
    /// This rank's part of the state: all parts together describe every particle that a sweep has seen.
    pub fn save(&self) -> Vec<u8> {
        let row = |load: Option<&Load>| load.copied().unwrap_or_default().into();
        let swept: Vec<SweptLight> = (self.swept_particles.iter().zip(&self.swept_bodies).enumerate())
            // Of a particle that is owned elsewhere only what left its cells here.
            .filter(|(i, (_, body))| *i < self.swept_owned || body.departed != ExchangeSum::default())
            .map(|(i, (particle, body))| SweptLight {
                swept: Swept {
                    particle: *particle,
                    departed: body.departed,
                    load: row(self.swept_loads.get(i)),
                },
                mean: row(self.swept_means.get(i)),
            })
            .collect();
        if self.virtual_masses.is_empty() {
            return swept.iter().flat_map(|light| bytemuck::bytes_of(&light.swept)).copied().collect();
        }
        bytemuck::cast_slice(&swept).to_vec()
    }

    /// Checks that a saved particle can have been swept.
    fn check(&self, store: &ParticleStore, particle: &Particle) -> Result<(), String> {
        let id = particle.id;
        let Some(template) = store.templates.get(particle.template as usize) else {
            return Err(format!("particle {id} is of the kind {}, which is none", particle.template));
        };
        if let Some(flaw) = particle.flaw(self.decomposition.domain.size()) {
            return Err(flaw);
        }
        let rim = particle.angular_velocity().norm() * template.shape.circumradius();
        let fastest = particle.velocity().norm().max(rim) / self.params.units.velocity();
        if fastest >= FIXED_POINT_LIMIT {
            return Err(format!(
                "the velocity or angular velocity of particle {id} is {fastest:.3e} cells per step"
            ));
        }
        Ok(())
    }

    /// The particles in the parts that this rank has read, each once, or a defect.
    fn read(
        &self,
        store: &ParticleStore,
        parts: &[(usize, &[u8])],
    ) -> Result<Vec<(u64, SweptLight)>, String> {
        let light = !self.virtual_masses.is_empty();
        let size = if light { size_of::<SweptLight>() } else { size_of::<Swept>() };
        let mut swept: BTreeMap<u64, SweptLight> = BTreeMap::new();
        for (n, bytes) in parts {
            let n = n + 1;
            if !bytes.len().is_multiple_of(size) {
                let size = bytes.len();
                return Err(format!(
                    "part {n} of the coupling has {size} bytes, which are no whole particles"
                ));
            }
            let mut ids = BTreeSet::new();
            for bytes in bytes.chunks_exact(size) {
                let mut part = SweptLight::zeroed();
                bytemuck::bytes_of_mut(&mut part)[..size].copy_from_slice(bytes);
                let id = part.swept.particle.id;
                let mut numbers = part.swept.load.as_flattened().iter().chain(part.mean.as_flattened());
                let checked = if !ids.insert(id) {
                    Err(format!("particle {id} is in it twice"))
                } else if numbers.all(|x| x.is_finite()) {
                    self.check(store, &part.swept.particle)
                } else {
                    Err(format!("the load on particle {id} is not finite"))
                };
                checked.map_err(|defect| format!("part {n} of the coupling: {defect}"))?;
                swept.entry(id).and_modify(|sum| sum.add(&part)).or_insert(part);
            }
        }
        Ok(swept.into_iter().collect())
    }

    /// Restores the state that the ranks of an earlier run [saved](Self::save), from the parts that this rank has read, with their indices;
    /// `particles` are those of the engine. Collective.
    ///
    /// # Errors
    /// Defect of the parts, the same on every rank.
    pub fn restore(
        &mut self,
        comm: &Comm,
        particles: &ParticleStore,
        parts: &[(usize, &[u8])],
    ) -> Result<(), String> {
        let offered = comm.agree_words(self.read(particles, parts))?;
        let wanted: Vec<u64> = particles.particles.iter().map(|particle| particle.id).collect();
        let found = comm.fetch_merged(&offered, &wanted, SweptLight::add).found;
        // Those that the last sweep has not seen begin in the next one.
        let last: Vec<u64> = offered.last().map(|(id, _)| *id).into_iter().collect();
        let last = comm.all_gather(bytemuck::cast_slice(&last).to_vec()).concat();
        let seen = bytemuck::pod_collect_to_vec::<u8, u64>(&last).into_iter().max();
        let is_known = |(particle, saved): &(&Particle, &Option<SweptLight>)| match saved {
            Some(saved) => saved.swept.particle.template == particle.template,
            None => seen.is_none_or(|last| particle.id > last),
        };
        let flaws = particles.particles.iter().try_for_each(|particle| self.check(particles, particle));
        let unknown = particles.particles.iter().zip(&found).find(|particle| !is_known(particle));
        let unknown = unknown
            .map_or(Ok(()), |(other, _)| Err(format!("the coupling does not know particle {}", other.id)));
        comm.agree_words(flaws.and(unknown))?;
        let known =
            found.iter().zip(&particles.owners).filter_map(|(saved, owner)| Some((saved.as_ref()?, owner)));
        let (then, owners) = known.map(|(saved, owner)| (saved.swept.particle, *owner)).unzip();
        let own: Vec<&SweptLight> = found[..particles.owned].iter().flatten().collect();
        let templates = particles.templates.clone();
        let then = ParticleStore { templates, particles: then, owned: own.len(), owners };
        self.map(&then);
        // One rank takes off what left: the owner, to whom all others send their sums.
        for (saved, body) in own.iter().zip(&mut self.bodies) {
            body.departed = saved.swept.departed;
        }
        self.swept_loads = own.iter().map(|saved| saved.swept.load.into()).collect();
        let light = !self.virtual_masses.is_empty();
        self.swept_means =
            if light { own.iter().map(|saved| saved.mean.into()).collect() } else { Vec::new() };
        self.note_swept(&then);
        Ok(())
    }
}
