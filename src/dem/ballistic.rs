//! The shortest engine: particles keep their velocity (or stay fixed), whatever the loads. For fixed arrays and for
//! tests of the coupling.

use super::assign::Neighbourhood;
use super::exchange::Population;
use super::{ContactState, ContactSummary, DemEngine, Load, integrator};
use crate::comm::Comm;
use crate::domain::Decomposition;
use crate::error::Result;
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use std::sync::Arc;

/// An engine without forces.
#[derive(Clone, Debug)]
pub struct Ballistic {
    near: Neighbourhood,
    population: Population,
}

impl Ballistic {
    /// The part of `all` that `rank` owns or knows; `all` is the same on every rank.
    pub fn new(
        decomposition: Decomposition,
        rank: usize,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Self {
        let radii: Vec<f64> = templates.iter().map(|t| t.shape.circumradius()).collect();
        let near = Neighbourhood::new(decomposition, rank, &radii);
        let population = Population::new(&near, rank, templates, all.iter().copied());
        Self { near, population }
    }

    /// The loads of the last [`advance`](DemEngine::advance), one per owned particle.
    pub fn last_loads(&self) -> &[Load] {
        &self.population.loads
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
        &self.population.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let Self { near, population } = self;
        assert_eq!(loads.len(), population.store.owned);
        population.loads.copy_from_slice(loads);
        for particle in &mut population.store.particles[..loads.len()] {
            let position = particle.position() + particle.velocity() * dt;
            particle.position = near.decomposition().domain.wrap(position).into();
            let orientation = integrator::turned(&particle.orientation(), particle.angular_velocity(), dt);
            particle.set_orientation(&orientation);
        }
        population.refresh(near, comm);
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        ContactSummary::default()
    }

    fn contact_states(&self) -> Vec<ContactState> {
        Vec::new()
    }

    fn save(&self) -> Result<Vec<u8>> {
        unimplemented!("H1 writes this")
    }

    fn restore(&mut self, _: &Comm, _: &[Vec<u8>]) -> Result<()> {
        unimplemented!("H1 writes this")
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
        let domain = Domain {
            periodic: [true; 3],
            cells: [8, 8, 8],
            dx: 1.0,
        };
        let templates: Arc<[Template]> = Arc::new([Template {
            shape: Arc::new(Sphere { radius: 1.0 }),
            material: 0,
            density: 1.0,
        }]);
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
            for (particle, load) in engine.particles().owned().iter().zip(engine.last_loads()) {
                let expected = [Vec3::new(1.5, 4.0, 6.0), Vec3::repeat(4.0)][particle.id as usize];
                assert!((particle.position() - expected).norm() < 1e-12);
                assert!((load.force.x - 39.0 - particle.id as f64).abs() < 1e-12);
            }
        });
    }
}
