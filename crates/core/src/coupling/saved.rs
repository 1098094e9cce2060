//! State of the coupling between two steps, for checkpoints: poses of the particles in the last sweep, and what
//! left their cells then.

use super::Coupling;
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

    /// Restores the state that all ranks of an earlier run [saved](Self::save); `particles` are those of the engine.
    ///
    /// # Errors
    /// Defect of the parts.
    pub fn restore(&mut self, particles: &ParticleStore, parts: &[&[u8]]) -> Result<(), String> {
        let light = !self.virtual_masses.is_empty();
        let size = if light { size_of::<SweptLight>() } else { size_of::<Swept>() };
        let mut swept: BTreeMap<u64, SweptLight> = BTreeMap::new();
        for (n, bytes) in (1..).zip(parts) {
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
                    self.check(particles, &part.swept.particle)
                } else {
                    Err(format!("the load on particle {id} is not finite"))
                };
                checked.map_err(|defect| format!("part {n} of the coupling: {defect}"))?;
                let add = |all: &mut SweptLight| {
                    all.swept.departed.add(&part.swept.departed, 1);
                    let loads = [(&mut all.swept.load, &part.swept.load), (&mut all.mean, &part.mean)];
                    for (sums, own) in loads {
                        let pairs = sums.as_flattened_mut().iter_mut().zip(own.as_flattened());
                        pairs.for_each(|(sum, own)| *sum += own);
                    }
                };
                swept.entry(id).and_modify(add).or_insert(part);
            }
        }
        particles.particles.iter().try_for_each(|particle| self.check(particles, particle))?;
        // Those that the last sweep has not seen begin in the next one.
        let known = |particle: &&Particle| swept.contains_key(&particle.id);
        let seen = swept.keys().next_back().copied();
        let is_known = |particle: &&Particle| match swept.get(&particle.id) {
            Some(saved) => saved.swept.particle.template == particle.template,
            None => seen.is_none_or(|last| particle.id > last),
        };
        if let Some(other) = particles.particles.iter().find(|particle| !is_known(particle)) {
            return Err(format!("the coupling does not know particle {}", other.id));
        }
        let there = particles.particles.iter().zip(&particles.owners);
        let (then, owners) = (there.filter(|(particle, _)| known(particle)))
            .map(|(particle, owner)| (swept[&particle.id].swept.particle, *owner))
            .unzip();
        let then = ParticleStore {
            templates: particles.templates.clone(),
            particles: then,
            owned: particles.owned().iter().filter(known).count(),
            owners,
        };
        self.map(&then);
        // One rank takes off what left: the owner, to whom all others send their sums.
        for (particle, body) in then.owned().iter().zip(&mut self.bodies) {
            body.departed = swept[&particle.id].swept.departed;
        }
        let own = || then.owned().iter().map(|particle| &swept[&particle.id]);
        self.swept_loads = own().map(|saved| saved.swept.load.into()).collect();
        self.swept_means = if light { own().map(|saved| saved.mean.into()).collect() } else { Vec::new() };
        self.note_swept(&then);
        Ok(())
    }
}
