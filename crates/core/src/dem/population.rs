//! Particles that come and go between two steps, on any ranks.
//!
//! Ids are never used again: a new particle gets the next one, which every rank knows and checkpoints keep. New particles that several
//! ranks hand over at once get their ids in an order that follows from their states alone, so that they are the same on any number of ranks.

use crate::comm::Comm;
use crate::error::{Error, Result};
use crate::particle::Particle;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Numbers of a population that all ranks know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Population {
    /// Particles of all ranks.
    pub count: u64,
    /// Id of the next particle, above those of all that there have been.
    pub next_id: u64,
}

impl Population {
    /// Counts another particle of a given id.
    pub(super) fn add(&mut self, particle: &Particle) {
        self.count += 1;
        self.next_id = self.next_id.max(particle.id.saturating_add(1));
    }
}

/// All of the particles that the ranks hand over, `own` by this one, with ids from `next` on and ascending; and the ids of `own`.
/// Collective.
pub fn numbered(comm: &Comm, own: &[Particle], next: u64) -> (Vec<Particle>, Vec<u64>) {
    let key = |particle: &Particle| {
        let state: [u64; size_of::<Particle>() / 8] = bytemuck::cast(Particle { id: 0, ..*particle });
        state
    };
    let handed = comm.all_gather(bytemuck::cast_slice(own).to_vec());
    let mut all: Vec<(_, usize, usize, Particle)> = Vec::new();
    for (rank, bytes) in handed.iter().enumerate() {
        let particles = bytemuck::pod_collect_to_vec::<u8, Particle>(bytes);
        all.extend(particles.into_iter().enumerate().map(|(n, p)| (key(&p), rank, n, p)));
    }
    all.sort_unstable_by_key(|&(state, rank, n, _)| (state, rank, n));
    let mut ids = vec![0; own.len()];
    let numbered = (next..).zip(all).map(|(id, (_, rank, n, particle))| {
        if rank == comm.rank() {
            ids[n] = id;
        }
        Particle { id, ..particle }
    });
    (numbered.collect(), ids)
}

/// All of the ids that the ranks hand over, ascending, each once; `owned` are the particles of this rank. Collective.
///
/// # Errors
/// [`Error::Input`] on every rank if there is no particle of one of them.
pub fn known(comm: &Comm, own: &[u64], owned: &[Particle]) -> Result<Vec<u64>> {
    let handed = comm.all_gather(bytemuck::cast_slice(own).to_vec());
    let mut ids: Vec<u64> = bytemuck::pod_collect_to_vec(&handed.concat());
    ids.sort_unstable();
    ids.dedup();
    let is_here = |id: &u64| i64::from(owned.binary_search_by_key(id, |particle| particle.id).is_ok());
    let mut owners: Vec<i64> = ids.iter().map(is_here).collect();
    comm.sum(&mut owners);
    match ids.iter().zip(owners).find(|(_, owners)| *owners == 0) {
        Some((id, _)) => Err(Error::Input(format!("there is no particle {id} to remove"))),
        None => Ok(ids),
    }
}

/// The ids of new particles, which ascend from the next one on.
pub fn ids(new: &[Particle]) -> Range<u64> {
    let first = new.first().map_or(0, |particle| particle.id);
    first..first + new.len() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;
    use crate::math::Vec3;

    fn new(n: u32) -> Particle {
        Particle::at(99, 0, Vec3::new(f64::from(n * 7 % 10), 1.0, -f64::from(n)))
    }

    #[test]
    fn new_particles_get_the_same_ids_whichever_of_one_to_three_ranks_hands_them_over() {
        let alone = numbered(&Comm::Solo, &(0..10).map(new).collect::<Vec<_>>(), 5).0;
        assert!(alone.iter().map(|p| p.id).eq(5..15));
        for ranks in [2, 3] {
            on_threads(ranks, |comm| {
                let own: Vec<Particle> = (0..10).rev().skip(comm.rank()).step_by(ranks).map(new).collect();
                let (all, ids) = numbered(&comm, &own, 5);
                assert_eq!(all, alone);
                for (id, particle) in ids.iter().zip(&own) {
                    assert!((alone[*id as usize - 5].position() - particle.position()).norm() == 0.0);
                }
            });
        }
    }

    #[test]
    fn an_id_that_no_particle_has_is_refused_on_every_rank() {
        on_threads(3, |comm| {
            let rank = comm.rank() as u64;
            let owned = [Particle::at(rank, 0, Vec3::zeros()), Particle::at(rank + 10, 0, Vec3::zeros())];
            let ids = known(&comm, &[(rank + 1) % 3, 11], &owned).unwrap();
            assert_eq!(ids, [0, 1, 2, 11]);
            let wrong: &[u64] = if rank == 1 { &[13] } else { &[0] };
            let error = known(&comm, wrong, &owned).unwrap_err().to_string();
            assert!(error.contains("no particle 13"), "{error}");
        });
    }
}
