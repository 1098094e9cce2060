//! State of the coupling between two steps, for checkpoints: poses of the particles in the last sweep, and what
//! left their cells then.

use super::Coupling;
use crate::dem::Load;
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
    load: [[f64; 3]; 2],
}

impl Coupling {
    /// Force and torque of the fluid on the particles that this rank owned in the last step, by their ids.
    pub fn last_loads(&self) -> impl Iterator<Item = (u64, Load)> {
        let owned = self.swept_particles.iter().map(|particle| particle.id);
        owned.zip(self.swept_loads.iter().copied())
    }

    /// This rank's part of the state: all parts together describe every particle that a sweep has seen.
    pub fn save(&self) -> Vec<u8> {
        let swept: Vec<Swept> = (self.swept_particles.iter().zip(&self.swept_bodies).enumerate())
            // Of a particle that is owned elsewhere only what left its cells here.
            .filter(|(i, (_, body))| *i < self.swept_owned || body.departed != ExchangeSum::default())
            .map(|(i, (particle, body))| Swept {
                particle: *particle,
                departed: body.departed,
                load: (self.swept_loads.get(i)).map_or([[0.0; 3]; 2], |l| [l.force.into(), l.torque.into()]),
            })
            .collect();
        bytemuck::cast_slice(&swept).to_vec()
    }

    /// Reason why a saved particle cannot have been swept, if there is one.
    fn flaw(&self, store: &ParticleStore, particle: &Particle) -> Option<String> {
        let id = particle.id;
        let Some(template) = store.templates.get(particle.template as usize) else {
            return Some(format!("particle {id} is of the kind {}, which is none", particle.template));
        };
        let units = &self.params.units;
        let rim = particle.angular_velocity().norm() * template.shape.circumradius();
        let fastest = particle.velocity().norm().max(rim) / units.velocity();
        let too_fast = || {
            (fastest >= FIXED_POINT_LIMIT).then(|| {
                format!("the velocity or angular velocity of particle {id} is {fastest:.3e} cells per step")
            })
        };
        particle.flaw(self.decomposition.domain.size()).or_else(too_fast)
    }

    /// Restores the state that all ranks of an earlier run [saved](Self::save); `particles` are those of the engine.
    ///
    /// # Errors
    /// Defect of the parts.
    pub fn restore(&mut self, particles: &ParticleStore, parts: &[Vec<u8>]) -> Result<(), String> {
        let mut swept: BTreeMap<u64, Swept> = BTreeMap::new();
        for (n, bytes) in parts.iter().enumerate() {
            if !bytes.len().is_multiple_of(size_of::<Swept>()) {
                return Err(format!(
                    "part {} of the coupling has {} bytes, which are no whole particles",
                    n + 1,
                    bytes.len()
                ));
            }
            let mut ids = BTreeSet::new();
            for part in bytemuck::pod_collect_to_vec::<u8, Swept>(bytes) {
                let twice = (!ids.insert(part.particle.id))
                    .then(|| format!("particle {} is in it twice", part.particle.id));
                let load = || {
                    let is_finite = part.load.iter().flatten().all(|x| x.is_finite());
                    (!is_finite).then(|| format!("the load on particle {} is not finite", part.particle.id))
                };
                let flaw = twice.or_else(|| self.flaw(particles, &part.particle));
                if let Some(flaw) = flaw.or_else(load) {
                    return Err(format!("part {} of the coupling: {flaw}", n + 1));
                }
                swept
                    .entry(part.particle.id)
                    .and_modify(|all| {
                        all.departed.add(&part.departed, 1);
                        for (sum, own) in all.load.as_flattened_mut().iter_mut().zip(part.load.as_flattened())
                        {
                            *sum += own;
                        }
                    })
                    .or_insert(part);
            }
        }
        if let Some(flaw) = particles.particles.iter().find_map(|particle| self.flaw(particles, particle)) {
            return Err(flaw);
        }
        // Before the first sweep there are none.
        let known = |particle: &Particle| swept.get(&particle.id);
        if let Some(other) = (particles.particles.iter()).find(|particle| {
            !swept.is_empty() && known(particle).is_none_or(|s| s.particle.template != particle.template)
        }) {
            return Err(format!("the coupling does not know particle {}", other.id));
        }
        let count = if swept.is_empty() { 0 } else { particles.owned };
        let then = ParticleStore {
            templates: particles.templates.clone(),
            particles: (particles.particles.iter())
                .filter_map(|particle| Some(known(particle)?.particle))
                .collect(),
            owned: count,
            owners: particles.owners.clone(),
        };
        self.map(&then);
        // One rank takes off what left: the owner, to whom all others send their sums.
        for (particle, body) in then.owned().iter().zip(&mut self.bodies) {
            body.departed = swept[&particle.id].departed;
        }
        let loads = then.owned().iter().map(|particle| swept[&particle.id].load);
        self.swept_loads =
            loads.map(|[force, torque]| Load { force: force.into(), torque: torque.into() }).collect();
        self.note_swept(&then);
        Ok(())
    }
}
