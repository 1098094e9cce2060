//! The shortest engine: particles keep their velocity (or stay fixed), whatever the loads. For callers that move the particles
//! themselves and set their [states](super::states) between steps, and for tests of the coupling.

use super::assign::GhostLayer;
use super::exchange::LocalParticles;
use super::native::face_passed;
use super::native::failures::outside;
use super::saved::Saved;
use super::{Check, ContactState, ContactSummary, DemEngine, Load, integrator};
use crate::comm::{Comm, SavedParts};
use crate::domain::Decomposition;
use crate::error::Result;
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use std::sync::Arc;

/// An engine without forces.
#[derive(Clone, Debug)]
pub struct Ballistic {
    near: GhostLayer,
    local: LocalParticles,
    /// Calls of [`advance`](DemEngine::advance) since the start.
    step: u64,
}

impl Ballistic {
    /// The particles of `all` that `rank` has, owned or as ghosts; `all` is the same on every rank.
    pub fn new(
        decomposition: Decomposition,
        rank: usize,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Self {
        let radii: Vec<f64> = templates.iter().map(|t| t.shape.circumradius()).collect();
        let near = GhostLayer::new(decomposition, rank, &radii);
        let local = LocalParticles::new(&near, templates, all.iter().copied());
        Self { near, local, step: 0 }
    }

    /// The same with the particles that the ranks hand over, each by one of them. Collective.
    #[must_use]
    pub fn with(mut self, comm: &Comm, handed: &[Particle]) -> Self {
        let handed = handed.iter().map(|particle| (*particle, Load::default()));
        self.local.take_over(&self.near, comm, 0, handed);
        self
    }
}

impl DemEngine for Ballistic {
    fn name(&self) -> &'static str {
        "ballistic"
    }

    fn supports(&self, _: &dyn Shape) -> bool {
        true
    }

    fn particles(&self) -> &ParticleStore {
        &self.local.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let Self { near, local, step } = self;
        assert_eq!(loads.len(), local.store.owned);
        local.loads.copy_from_slice(loads);
        let (domain, mut outcome) = (near.decomposition().domain, Ok(()));
        for particle in &mut local.store.particles[..loads.len()] {
            let before = *particle;
            let position = domain.wrap(particle.position() + particle.velocity() * dt);
            if let Some(face) = face_passed(&domain, position) {
                let after = Particle { position: position.into(), ..before };
                outcome = outcome.and(Err(outside(*step, &before, &after, face, &[])));
                continue;
            }
            particle.position = position.into();
            let orientation = integrator::turned(&particle.orientation(), particle.angular_velocity(), dt);
            particle.set_orientation(&orientation);
        }
        local.refresh(near, comm);
        *step += 1;
        outcome
    }

    fn loads(&self) -> &[Load] {
        &self.local.loads
    }

    fn next_id(&self) -> Option<u64> {
        Some(self.local.population.next_id)
    }

    fn insert(&mut self, new: &[Particle], _: f64) -> Result<()> {
        self.local.insert(&self.near, new.iter().copied());
        Ok(())
    }

    fn remove(&mut self, ids: &[u64]) -> Result<()> {
        self.local.remove(&self.near, ids);
        Ok(())
    }

    fn place(&mut self, comm: &Comm, owned: Vec<(Particle, Load)>, check: Check) -> Result<()> {
        let placed = self.local.placed(&self.near, comm, owned);
        check([&self.local, &placed])?;
        self.local = placed;
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        ContactSummary::default()
    }

    fn tells_contacts(&self) -> bool {
        false
    }

    fn contact_states(&self, _: &Comm) -> Vec<ContactState> {
        Vec::new()
    }

    fn save(&self, _: &Comm) -> Result<Vec<u8>> {
        let saved = Saved {
            substep: self.step,
            population: self.local.population,
            particles: self.particles().owned().to_vec(),
            loads: self.local.loads.clone(),
            ..Saved::default()
        };
        Ok(saved.write(self.name()))
    }

    fn restore(&mut self, comm: &Comm, parts: &SavedParts) -> Result<()> {
        let saved = Saved::load(self.name(), comm, parts, (&self.near, &self.local, &[]), 0)?.state;
        self.step = saved.substep;
        let handed = saved.particles.into_iter().zip(saved.loads);
        self.local.take_over(&self.near, comm, saved.population.next_id, handed);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;
    use crate::domain::Domain;
    use crate::math::Vec3;
    use crate::shape::Sphere;

    #[test]
    fn a_particle_flies_straight_on_through_faces_and_ranks_and_its_load_is_remembered_on_4_ranks() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [8, 8, 8], dx: 1.0 };
        let templates: Arc<[Template]> =
            Arc::new([Template { shape: Arc::new(Sphere { radius: 1.0 }), material: 0, density: 1.0 }]);
        let mut flying = Particle::at(0, 0, Vec3::new(7.5, 1.0, 2.0));
        flying.velocity = [0.5, -0.25, 1.0];
        let all = [flying, Particle::at(1, 0, Vec3::repeat(4.0))];
        on_threads(4, |comm| {
            let cut = Decomposition::new(domain, 4).unwrap();
            let mut engine = Ballistic::new(cut, comm.rank(), templates.clone(), &all);
            for step in 0..40 {
                let loads: Vec<Load> = engine
                    .particles()
                    .owned()
                    .iter()
                    .map(|p| Load {
                        force: Vec3::repeat(p.id as f64 + f64::from(step)),
                        torque: Vec3::zeros(),
                    })
                    .collect();
                engine.advance(&comm, &loads, 0.5).unwrap();
            }
            let mut owned = [engine.particles().owned as i64];
            comm.sum(&mut owned);
            assert_eq!(owned, [2]);
            for (particle, load) in engine.particles().owned().iter().zip(engine.loads()) {
                let expected = [Vec3::new(1.5, 4.0, 6.0), Vec3::repeat(4.0)][particle.id as usize];
                assert!((particle.position() - expected).norm() < 1e-12);
                assert!((load.force.x - 39.0 - particle.id as f64).abs() < 1e-12);
            }
        });
    }

    #[test]
    fn what_was_saved_on_2_ranks_continues_on_1_and_3_ranks_with_its_loads() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [12, 8, 8], dx: 1.0 };
        let templates: Arc<[Template]> =
            Arc::new([Template { shape: Arc::new(Sphere { radius: 1.0 }), material: 0, density: 1.0 }]);
        let all: Vec<Particle> = (0..9_u64)
            .map(|id| {
                let mut particle = Particle::at(id, 0, Vec3::new(1.3, 0.7, 0.9) * id as f64);
                particle.velocity = [0.3, -0.2 * id as f64, 0.1];
                particle.angular_velocity = [0.1 * id as f64, 0.0, 0.3];
                particle
            })
            .collect();
        let engine = |comm: &Comm| {
            let cut = Decomposition::new(domain, comm.size()).unwrap();
            Ballistic::new(cut, comm.rank(), templates.clone(), &all)
        };
        let advance = |engine: &mut Ballistic, comm: &Comm| {
            for _ in 0..10 {
                let pull = |p: &Particle| Load { force: p.position(), torque: Vec3::zeros() };
                let loads: Vec<Load> = engine.particles().owned().iter().map(pull).collect();
                engine.advance(comm, &loads, 0.5).unwrap();
            }
        };
        let state = |engine: &Ballistic, comm: &Comm| {
            let own: Vec<(Particle, Load)> =
                (engine.particles().owned().iter().copied()).zip(engine.loads().iter().copied()).collect();
            let mut owned = [own.len() as i64];
            comm.sum(&mut owned);
            assert_eq!(owned, [9]);
            own
        };
        let whole = on_threads(2, |comm| {
            let mut engine = engine(&comm);
            advance(&mut engine, &comm);
            let (parts, middle) = (comm.all_gather(engine.save(&comm).unwrap()), state(&engine, &comm));
            advance(&mut engine, &comm);
            (parts, middle, state(&engine, &comm))
        });
        let parts = &whole[0].0;
        let middle: Vec<_> = whole.iter().flat_map(|(_, middle, _)| middle.clone()).collect();
        let end: Vec<_> = whole.iter().flat_map(|(_, _, end)| end.clone()).collect();
        for ranks in [1, 3] {
            on_threads(ranks, |comm| {
                let mut engine = engine(&comm);
                engine.restore(&comm, &SavedParts::divided(&comm, parts)).unwrap();
                assert!(state(&engine, &comm).iter().all(|p| middle.contains(p)), "{ranks} ranks");
                advance(&mut engine, &comm);
                assert!(state(&engine, &comm).iter().all(|p| end.contains(p)), "{ranks} ranks");
            });
        }
    }
}
