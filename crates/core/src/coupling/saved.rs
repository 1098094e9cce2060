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
    pub fn restore(&mut self, particles: &ParticleStore, parts: &[Vec<u8>]) -> Result<(), String> {
        let mut swept: BTreeMap<u64, Swept> = BTreeMap::new();
        for (n, bytes) in (1..).zip(parts) {
            if !bytes.len().is_multiple_of(size_of::<Swept>()) {
                let size = bytes.len();
                return Err(format!(
                    "part {n} of the coupling has {size} bytes, which are no whole particles"
                ));
            }
            let mut ids = BTreeSet::new();
            for part in bytemuck::pod_collect_to_vec::<u8, Swept>(bytes) {
                let id = part.particle.id;
                let checked = if !ids.insert(id) {
                    Err(format!("particle {id} is in it twice"))
                } else if part.load.as_flattened().iter().all(|x| x.is_finite()) {
                    self.check(particles, &part.particle)
                } else {
                    Err(format!("the load on particle {id} is not finite"))
                };
                checked.map_err(|defect| format!("part {n} of the coupling: {defect}"))?;
                let add = |all: &mut Swept| {
                    all.departed.add(&part.departed, 1);
                    let loads = all.load.as_flattened_mut().iter_mut().zip(part.load.as_flattened());
                    loads.for_each(|(sum, own)| *sum += own);
                };
                swept.entry(id).and_modify(add).or_insert(part);
            }
        }
        particles.particles.iter().try_for_each(|particle| self.check(particles, particle))?;
        // Before the first sweep there are none.
        let known = |particle: &Particle| swept.get(&particle.id);
        if let Some(other) = (particles.particles.iter()).find(|particle| {
            !swept.is_empty() && known(particle).is_none_or(|s| s.particle.template != particle.template)
        }) {
            return Err(format!("the coupling does not know particle {}", other.id));
        }
        let then = ParticleStore {
            templates: particles.templates.clone(),
            particles: (particles.particles.iter())
                .filter_map(|particle| Some(known(particle)?.particle))
                .collect(),
            owned: if swept.is_empty() { 0 } else { particles.owned },
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
