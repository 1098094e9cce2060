//! The particles of one rank, and the messages that update owners and ghosts when particles move.

use super::assign::GhostLayer;
use super::population::Population;
use super::{Load, LoadRow};
use crate::comm::Comm;
use crate::particle::{Particle, ParticleStore, Template};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// Owned particles and ghosts, with their loads.
#[derive(Clone, Debug)]
pub struct LocalParticles {
    /// The particles.
    pub store: ParticleStore,
    /// Loads on the owned particles; `loads.len() == store.owned`.
    pub loads: Vec<Load>,
    /// Loads of the last sub-step on the ghosts, in their order.
    pub ghost_loads: Vec<Load>,
    /// Numbers of all particles.
    pub population: Population,
    /// Number of times that the store has been made anew; until then its particles keep their places.
    pub arrangement: u64,
    incoming: Vec<MigrationRecord>,
}

/// A particle on its way to its new owner, or to a rank that has it as a ghost.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct MigrationRecord {
    particle: Particle,
    load: LoadRow,
}

impl MigrationRecord {
    fn new(particle: Particle, load: Load) -> Self {
        Self { particle, load: load.into() }
    }
}

impl LocalParticles {
    /// The particles of `all` that this rank has, owned or as ghosts, without loads.
    pub fn new(
        near: &GhostLayer,
        templates: Arc<[Template]>,
        all: impl IntoIterator<Item = Particle>,
    ) -> Self {
        let mut local = Self {
            store: ParticleStore { templates, particles: Vec::new(), owned: 0, owners: Vec::new() },
            loads: Vec::new(),
            ghost_loads: Vec::new(),
            population: Population::default(),
            arrangement: 0,
            incoming: Vec::new(),
        };
        local.replace(near, 0, all.into_iter().map(|particle| (particle, Load::default())));
        local
    }

    /// Replaces all particles by those of `all` that this rank has, owned or as ghosts, with their loads; the next id is at least
    /// `next_id`.
    pub fn replace(
        &mut self,
        near: &GhostLayer,
        next_id: u64,
        all: impl IntoIterator<Item = (Particle, Load)>,
    ) {
        self.incoming.clear();
        self.population = Population { count: 0, next_id };
        self.add(near, all);
    }

    /// Replaces all particles by those that the ranks hand over, each by one of them, wherever they are, with their loads; the next id is
    /// at least `next_id`. Collective.
    pub fn take_over(
        &mut self,
        near: &GhostLayer,
        comm: &Comm,
        next_id: u64,
        handed: impl IntoIterator<Item = (Particle, Load)>,
    ) {
        let domain = near.decomposition().domain;
        let mut numbers = Population { count: 0, next_id };
        let mut owned = comm.hand_over(handed.into_iter().map(|(mut particle, load)| {
            particle.position = domain.wrap(particle.position()).into();
            numbers.add(&particle);
            (near.owner(particle.position()), MigrationRecord::new(particle, load))
        }));
        owned.sort_unstable_by_key(|record| record.particle.id);
        self.set_owned(near.rank, owned.into_iter().map(|of| (of.particle, of.load.into())));
        self.refresh(near, comm);
        let all = comm.all_gather(bytemuck::bytes_of(&numbers).to_vec());
        self.population = all.iter().fold(Population::default(), |sum, numbers| {
            let of: Population = bytemuck::pod_read_unaligned(numbers);
            Population { count: sum.count + of.count, next_id: sum.next_id.max(of.next_id) }
        });
    }

    /// Adds those of `new`, the same on every rank, that this rank has, owned or as ghosts.
    pub fn insert(&mut self, near: &GhostLayer, new: impl IntoIterator<Item = Particle>) {
        self.keep(|_| true);
        self.add(near, new.into_iter().map(|particle| (particle, Load::default())));
    }

    /// Removes the particles with these ids, ascending, the same on every rank.
    pub fn remove(&mut self, near: &GhostLayer, ids: &[u64]) {
        self.keep(|particle| ids.binary_search(&particle.id).is_err());
        self.population.count -= ids.len() as u64;
        self.sort_in(near);
    }

    /// Makes those of its particles that stay the incoming ones.
    fn keep(&mut self, stays: impl Fn(&Particle) -> bool) {
        let with_loads = self.store.particles.iter().zip(self.loads.iter().chain(&self.ghost_loads));
        let staying = with_loads.filter(|(particle, _)| stays(particle));
        self.incoming.clear();
        self.incoming.extend(staying.map(|(particle, load)| MigrationRecord::new(*particle, *load)));
    }

    /// Adds those of `all` that this rank has to the incoming ones, and makes these the store.
    fn add(&mut self, near: &GhostLayer, all: impl IntoIterator<Item = (Particle, Load)>) {
        for (mut particle, load) in all {
            particle.position = near.decomposition().domain.wrap(particle.position()).into();
            self.population.add(&particle);
            let owner = near.owner(particle.position());
            if owner == near.rank || near.is_ghost_on(near.rank, particle.position(), particle.template) {
                self.incoming.push(MigrationRecord::new(particle, load));
            }
        }
        self.sort_in(near);
    }

    /// Makes these the owned particles, ascending by id, with their loads; a [refresh](Self::refresh) must follow, which finds the ghosts.
    pub fn set_owned(&mut self, rank: usize, owned: impl IntoIterator<Item = (Particle, Load)>) {
        (self.store.particles, self.loads) = owned.into_iter().unzip();
        self.store.owned = self.loads.len();
        self.store.owners = vec![rank as u32; self.store.owned];
        self.ghost_loads.clear();
        self.arrangement += 1;
    }

    /// The same with other owned particles, of this rank's block, and the ghosts that belong to those of all ranks. Collective.
    #[must_use]
    pub fn placed(&self, near: &GhostLayer, comm: &Comm, owned: Vec<(Particle, Load)>) -> Self {
        let mut placed = self.clone();
        placed.set_owned(near.rank, owned);
        placed.refresh(near, comm);
        placed
    }

    /// After the owned particles have moved (by less than a cell) and been wrapped: hands those that left the block to
    /// their new owners, with their loads, and replaces all ghosts. One message per peer. Collective.
    pub fn refresh(&mut self, near: &GhostLayer, comm: &Comm) {
        if near.peers.is_empty() {
            return;
        }
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); near.peers.len()];
        self.incoming.clear();
        for (particle, load) in self.store.owned().iter().zip(&self.loads) {
            let (position, template) = (particle.position(), particle.template);
            let owner = near.owner(position);
            let record = MigrationRecord::new(*particle, *load);
            for (link, message) in messages.iter_mut().enumerate() {
                if near.peers[link] == owner || near.is_ghost_on_peer(link, position, template) {
                    message.extend_from_slice(bytemuck::bytes_of(&record));
                }
            }
            if owner == near.rank || near.is_ghost_on(near.rank, position, template) {
                self.incoming.push(record);
            }
        }
        for message in comm.exchange(&near.peers, messages) {
            self.incoming.extend(bytemuck::pod_collect_to_vec::<u8, MigrationRecord>(&message));
        }
        self.sort_in(near);
    }

    /// Makes the incoming particles the store: owned before ghosts, each ascending by id.
    fn sort_in(&mut self, near: &GhostLayer) {
        let mut order: Vec<(bool, u64, u32, u32)> = (self.incoming.iter().enumerate())
            .map(|(index, MigrationRecord { particle, .. })| {
                let owner = near.owner(particle.position());
                (owner != near.rank, particle.id, index as u32, owner as u32)
            })
            .collect();
        order.sort_unstable();
        let Self { store, loads, ghost_loads, incoming, .. } = self;
        store.particles.clear();
        store.owners.clear();
        loads.clear();
        ghost_loads.clear();
        for &(ghost, _, index, owner) in &order {
            let MigrationRecord { particle, load } = incoming[index as usize];
            store.particles.push(particle);
            store.owners.push(owner);
            let list = if ghost { &mut *ghost_loads } else { &mut *loads };
            list.push(load.into());
        }
        store.owned = loads.len();
        self.arrangement += 1;
    }

    /// Index of the particle with this id, owned or ghost.
    pub fn index_of(&self, id: u64) -> Option<usize> {
        let owned = self.store.owned;
        let (ours, ghosts) = self.store.particles.split_at(owned);
        ours.binary_search_by_key(&id, |p| p.id)
            .or_else(|_| ghosts.binary_search_by_key(&id, |p| p.id).map(|i| i + owned))
            .ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;
    use crate::domain::{Decomposition, Domain};
    use crate::math::Vec3;
    use crate::shape::Sphere;

    #[test]
    fn every_rank_knows_what_it_must_and_loads_travel_with_their_particles_on_1_to_8_ranks() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [16, 16, 16], dx: 0.25 };
        let templates: Arc<[Template]> =
            Arc::new([Template { shape: Arc::new(Sphere { radius: 0.3 }), material: 0, density: 1.0 }]);
        let all: Vec<Particle> = (0..60_u32)
            .map(|n| {
                let part = |k: u32| f64::from(n * k % 61) / 61.0 * 4.0;
                Particle::at(u64::from(100 - n), 0, Vec3::new(part(7), part(31), part(11)))
            })
            .collect();
        for ranks in [1, 2, 3, 4, 6, 8] {
            let cut = Decomposition::new(domain, ranks).unwrap();
            on_threads(ranks, |comm| {
                let rank = comm.rank();
                let near = GhostLayer::new(cut.clone(), rank, &[0.3]);
                let mut local = LocalParticles::new(&near, templates.clone(), all.clone());
                for load in 0..local.loads.len() {
                    local.loads[load].force.x = local.store.particles[load].id as f64;
                }
                for step in 1..=50 {
                    let owned = local.store.owned;
                    for particle in &mut local.store.particles[..owned] {
                        let id = particle.id as f64;
                        let drift = Vec3::new(0.2, -0.003 * id, 0.002 * id);
                        particle.position = domain.wrap(particle.position() + drift).into();
                    }
                    local.refresh(&near, &comm);
                    let store = &local.store;
                    let mut owned = [store.owned as i64];
                    comm.sum(&mut owned);
                    assert_eq!(owned, [60], "none lost, none doubled, step {step}");
                    for (particle, load) in store.owned().iter().zip(&local.loads) {
                        assert_eq!(load.force.x as u64, particle.id);
                        assert_eq!(cut.owner(particle.position()), rank);
                    }
                    for (i, particle) in store.particles.iter().enumerate() {
                        assert_eq!(local.index_of(particle.id), Some(i));
                        assert_eq!(store.owners[i] as usize, cut.owner(particle.position()));
                    }
                    let mut known = [store.particles.len() as i64];
                    comm.sum(&mut known);
                    let mut due = [store
                        .owned()
                        .iter()
                        .map(|p| {
                            (0..ranks).filter(|&r| r == rank || near.is_ghost_on(r, p.position(), 0)).count()
                                as i64
                        })
                        .sum()];
                    comm.sum(&mut due);
                    assert_eq!(known, due);
                }
            });
        }
    }

    #[test]
    fn particles_that_any_ranks_hand_over_come_to_the_ranks_that_have_them_on_1_to_8_ranks() {
        let domain = Domain { faces: Domain::faces([true, false, true]), cells: [16, 16, 16], dx: 0.25 };
        let templates: Arc<[Template]> =
            Arc::new([Template { shape: Arc::new(Sphere { radius: 0.3 }), material: 0, density: 1.0 }]);
        let count = 5000;
        let part = |n: u64, k: u64| (n * k % 65_521) as f64 / 65_521.0 * 4.1;
        let body =
            |n: u64| Particle::at(2 * n, 0, Vec3::new(part(n, 7), part(n, 311).min(4.0), part(n, 1013)));
        let all: Vec<(Particle, Load)> = (0..count)
            .map(|n| (body(n), Load { force: Vec3::new(n as f64, 1.0, 0.0), torque: Vec3::zeros() }))
            .collect();
        for ranks in [1, 2, 3, 8] {
            let cut = Decomposition::new(domain, ranks).unwrap();
            on_threads(ranks, |comm| {
                let near = GhostLayer::new(cut.clone(), comm.rank(), &[0.3]);
                let known = |from: &[(Particle, Load)]| {
                    let mut local = LocalParticles::new(&near, templates.clone(), Vec::new());
                    local.replace(&near, 7, from.to_vec());
                    local
                };
                let whole = known(&all);
                let own =
                    |n: &usize| if ranks > 2 { *n % (ranks - 1) == comm.rank() } else { comm.rank() == 0 };
                let handed = (0..all.len()).rev().filter(own).map(|n| all[n]);
                let mut local = LocalParticles::new(&near, templates.clone(), Vec::new());
                local.take_over(&near, &comm, 7, handed);
                assert_eq!(local.population, Population { count, next_id: 2 * count - 1 });
                assert_eq!(local.population, whole.population);
                assert!(local.store.particles == whole.store.particles && local.loads == whole.loads);
                assert!(local.store.owners == whole.store.owners && local.ghost_loads == whole.ghost_loads);
                local.take_over(&near, &comm, 9, Vec::new());
                assert_eq!((local.population, local.store.owned), (Population { count: 0, next_id: 9 }, 0));
            });
        }
    }

    /// Positions along an axis where rounding might lose or double a particle: the ends of the box and the faces of
    /// blocks.
    fn edges(cut: &Decomposition, axis: usize) -> Vec<f64> {
        let length = cut.domain.size()[axis];
        let below = |x: f64| f64::from_bits(x.to_bits() - 1);
        let mut places = vec![0.0, below(length)];
        if cut.domain.is_periodic(axis) {
            places.extend([-1e-25, length]);
        } else {
            places.push(length);
        }
        for &at in &cut.cuts[axis][1..cut.grid[axis]] {
            let face = at as f64 * cut.domain.dx;
            places.extend([below(face), face]);
        }
        places
    }

    #[test]
    fn a_particle_that_arrives_on_a_face_edge_or_corner_of_blocks_or_box_has_one_owner_on_12_ranks() {
        let templates: Arc<[Template]> =
            Arc::new([Template { shape: Arc::new(Sphere { radius: 0.3 }), material: 0, density: 1.0 }]);
        for periodic in [[true; 3], [false; 3], [true, false, true]] {
            let domain = Domain { faces: Domain::faces(periodic), cells: [16, 17, 18], dx: 0.1 };
            let equal = Decomposition::with_grid(domain, [2, 2, 3]);
            let uneven =
                Decomposition::with_cuts(domain, [vec![0, 5, 16], vec![0, 13, 17], vec![0, 4, 9, 18]]);
            for cut in [equal, uneven] {
                let [xs, ys, zs] = [0, 1, 2].map(|axis| edges(&cut, axis));
                let mut places = Vec::new();
                for &z in &zs {
                    for &y in &ys {
                        places.extend(xs.iter().map(|&x| Vec3::new(x, y, z)));
                    }
                }
                // Half a cell towards the middle of the box.
                let middle = domain.size() * 0.5;
                let before = |place: &Vec3| place + (middle - place).map(|d| 0.05 * d.signum());
                let all: Vec<Particle> = (0..)
                    .zip(&places)
                    .map(|(id, place)| Particle::at(id, 0, domain.wrap(before(place))))
                    .collect();
                let owned = on_threads(cut.ranks(), |comm| {
                    let rank = comm.rank();
                    let near = GhostLayer::new(cut.clone(), rank, &[0.03]);
                    let mut local = LocalParticles::new(&near, templates.clone(), all.clone());
                    let count = local.store.owned;
                    for particle in &mut local.store.particles[..count] {
                        particle.position = domain.wrap(places[particle.id as usize]).into();
                    }
                    local.refresh(&near, &comm);
                    let ids = |p: &Particle| p.id;
                    local.store.owned().iter().map(ids).collect::<Vec<u64>>()
                });
                let mut ids = owned.concat();
                ids.sort_unstable();
                assert!(ids.iter().copied().eq(0..places.len() as u64), "{:?}", cut.cuts);
            }
        }
    }
}
