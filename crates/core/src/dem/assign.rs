//! Owner, ghosts and evaluating rank, which every rank finds alike without a message.

use crate::domain::{Decomposition, around};
use crate::math::Vec3;
use crate::particle::ParticleStore;

/// Middle and half edge (m) of a block along each axis.
type Zone = [[f64; 2]; 3];

fn zone(decomposition: &Decomposition, rank: usize) -> Zone {
    let index = decomposition.grid_index(rank);
    std::array::from_fn(|axis| slab(decomposition, axis, index[axis]))
}

/// Middle and half width (m) of the slab with index `p` along an axis.
fn slab(decomposition: &Decomposition, axis: usize, p: usize) -> [f64; 2] {
    let [lo, hi] = decomposition.slab(axis, p);
    [(lo + hi) * 0.5, (hi - lo) * 0.5]
}

/// Ranks that have a particle, as owner or as a ghost, from its position alone.
///
/// Holds the blocks of this rank and its peers; all else is found from the cuts of the box.
#[derive(Clone, Debug)]
pub struct GhostLayer {
    /// This rank.
    pub rank: usize,
    /// Ranks with which messages are exchanged, ascending; mutual.
    pub peers: Vec<usize>,
    decomposition: Decomposition,
    own: Zone,
    /// Those of the peers.
    zones: Vec<Zone>,
    /// Distance to the block within which a particle of each template is a ghost (m).
    reach: Vec<f64>,
}

impl GhostLayer {
    /// For particles that lie in spheres of these radii (m, by template), enlarged for contacts.
    ///
    /// A rank has a particle if its centre is at most `R + R_max + 2 dx` from the rank's block: enough for every
    /// contact of the particles inside the block, also after each has moved by a cell.
    pub fn new(decomposition: Decomposition, rank: usize, radii: &[f64]) -> Self {
        let dx = decomposition.domain.dx;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let reach: Vec<f64> = (radii.iter()).map(|radius| radius + largest + 2.0 * dx).collect();
        // The sender is the owner before the move.
        let furthest = reach.iter().copied().fold(0.0, f64::max) + 1.5 * dx;
        let peers = decomposition.neighbours(rank, furthest);
        Self {
            rank,
            own: zone(&decomposition, rank),
            zones: peers.iter().map(|&peer| zone(&decomposition, peer)).collect(),
            peers,
            reach,
            decomposition,
        }
    }

    /// Number of ranks.
    pub fn ranks(&self) -> usize {
        self.decomposition.ranks()
    }

    /// The box and how it is cut.
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    /// The rank that owns a particle at a wrapped position.
    pub fn owner(&self, position: Vec3) -> usize {
        if self.ranks() == 1 { 0 } else { self.decomposition.owner(position) }
    }

    fn zone(&self, rank: usize) -> Zone {
        if rank == self.rank {
            return self.own;
        }
        (self.peers.binary_search(&rank))
            .map_or_else(|_| zone(&self.decomposition, rank), |link| self.zones[link])
    }

    /// Returns true if `rank` has a particle of this template at a wrapped position, as owner or as a ghost.
    pub fn is_ghost_on(&self, rank: usize, position: Vec3, template: u64) -> bool {
        self.is_in(&self.zone(rank), position, template)
    }

    /// The same for `peers[link]`.
    pub fn is_ghost_on_peer(&self, link: usize, position: Vec3, template: u64) -> bool {
        self.is_in(&self.zones[link], position, template)
    }

    fn is_in(&self, zone: &Zone, position: Vec3, template: u64) -> bool {
        let reach = self.reach[template as usize];
        (0..3).all(|axis| self.is_near(axis, position[axis], zone[axis], reach))
    }

    /// Returns true if a coordinate lies within `reach` (m) of a slab.
    fn is_near(&self, axis: usize, x: f64, [middle, half]: [f64; 2], reach: f64) -> bool {
        let offset = (x - middle).abs();
        self.decomposition.domain.shorter_way(axis, offset) <= half + reach
    }

    /// All ranks that have a particle of this template at a wrapped position, its owner included, ascending. Only slabs
    /// around those of the owner are tested.
    pub fn ranks_with(&self, position: Vec3, template: u64) -> Vec<usize> {
        let cut = &self.decomposition;
        let reach = self.reach[template as usize];
        let owner = cut.grid_index(self.owner(position));
        cut.ranks_in(std::array::from_fn(|axis| {
            around(owner[axis], cut.grid[axis], cut.domain.is_periodic(axis), |p| {
                self.is_near(axis, position[axis], slab(cut, axis, p), reach)
            })
        }))
    }

    /// The rank that evaluates the contact of two particles, each with its owner, wrapped position and template: the
    /// same answer on every rank.
    ///
    /// 1. Both have one owner: that rank.
    /// 2. Otherwise the lower owner that has both.
    /// 3. Otherwise the lowest rank that has both; `None` if there is none.
    ///
    /// # Reference
    /// Marquardt, Hafen, Krause (2024), doi:10.1016/j.cpc.2024.109321, section 3.3.
    pub fn evaluating_rank(&self, a: (usize, Vec3, u64), b: (usize, Vec3, u64)) -> Option<usize> {
        if a.0 == b.0 {
            return Some(a.0);
        }
        let has_both = |&rank: &usize| {
            let zone = self.zone(rank);
            [a, b].iter().all(|&(_, position, template)| self.is_in(&zone, position, template))
        };
        let owners = [a.0.min(b.0), a.0.max(b.0)];
        owners.into_iter().find(has_both).or_else(|| self.ranks_with(a.1, a.2).into_iter().find(has_both))
    }

    /// The rank that evaluates the contact of the particles with these indices.
    pub fn evaluating_rank_of(&self, pair: [usize; 2], store: &ParticleStore) -> Option<usize> {
        let [a, b] = pair.map(|k| {
            let particle = &store.particles[k];
            (store.owners[k] as usize, particle.position(), particle.template)
        });
        self.evaluating_rank(a, b)
    }

    /// Low corner and edges (m) of the part of space in which this rank has particles.
    pub fn window(&self) -> (Vec3, Vec3) {
        let reach = self.reach.iter().copied().fold(0.0, f64::max) + self.decomposition.domain.dx;
        let half = Vec3::from_fn(|axis, _| self.own[axis][1] + reach);
        (Vec3::from_fn(|axis, _| self.own[axis][0]) - half, 2.0 * half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;
    use proptest::prelude::*;

    /// By asking all ranks.
    fn by_exhaustive_search(
        near: &GhostLayer,
        a: (usize, Vec3, u64),
        b: (usize, Vec3, u64),
    ) -> Option<usize> {
        let has_both = |&rank: &usize| [a, b].iter().all(|&(_, x, t)| near.is_ghost_on(rank, x, t));
        let owners = [a.0.min(b.0), a.0.max(b.0)];
        if a.0 == b.0 { Some(a.0) } else { owners.into_iter().chain(0..near.ranks()).find(has_both) }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn all_ranks_find_the_evaluating_rank_of_an_exhaustive_search_for_any_cuts(
            widths in [
                prop::collection::vec(4..9_usize, 1..6),
                prop::collection::vec(4..9_usize, 1..6),
                prop::collection::vec(4..9_usize, 1..6),
            ],
            periodic: [bool; 3],
            radii in [0.2..4.0_f64, 0.2..4.0],
            places in prop::collection::vec(([0.0..1.0_f64, 0.0..1.0, 0.0..1.0], [-9.0..9.0_f64, -9.0..9.0, -9.0..9.0]), 40),
        ) {
            let cuts = widths.map(|widths| {
                let mut at = 0;
                std::iter::once(0).chain(widths.into_iter().map(|w| { at += w; at })).collect::<Vec<_>>()
            });
            let domain = Domain { faces: Domain::faces(periodic), cells: [0, 1, 2].map(|i| cuts[i][cuts[i].len() - 1]), dx: 0.7 };
            let cut = Decomposition::with_cuts(domain, cuts);
            let all: Vec<_> =
                (0..cut.ranks()).map(|rank| GhostLayer::new(cut.clone(), rank, &radii)).collect();
            let size = domain.size();
            for (n, (first, offset)) in places.iter().enumerate() {
                let inside = |x: Vec3| {
                    let x = domain.wrap(x);
                    Vec3::from_fn(|i, _| x[i].clamp(0.0, size[i]))
                };
                let first = Vec3::from(*first).component_mul(&size);
                let [a, b] = [(first, 0), (first + Vec3::from(*offset), n as u64 % 2)].map(|(x, template)| {
                    let x = inside(x);
                    (cut.owner(x), x, template)
                });
                let expected = by_exhaustive_search(&all[0], a, b);
                for near in &all {
                    prop_assert_eq!(near.evaluating_rank(a, b), expected);
                    prop_assert_eq!(near.evaluating_rank(b, a), expected);
                    for (rank, other) in all.iter().enumerate() {
                        prop_assert_eq!(near.is_ghost_on(rank, a.1, a.2), other.is_ghost_on(rank, a.1, a.2));
                    }
                    let who: Vec<usize> = (0..cut.ranks()).filter(|&r| near.is_ghost_on(r, a.1, a.2)).collect();
                    prop_assert_eq!(near.ranks_with(a.1, a.2), who);
                }
            }
        }
    }

    #[test]
    fn an_owner_knows_both_bodies_of_every_pair_that_touches() {
        let domain = Domain { faces: Domain::faces([true, true, false]), cells: [16, 12, 20], dx: 0.5 };
        let radii = [0.95, 0.35];
        let cut = Decomposition::new(domain, 12).unwrap();
        let near = GhostLayer::new(cut.clone(), 0, &radii);
        for n in 0..2000_u32 {
            let part = |k: u32| f64::from(n * k % 1999) / 1999.0;
            let at = Vec3::new(part(7), part(31), part(101)).component_mul(&domain.size());
            let direction = Vec3::new(part(13) - 0.5, part(57) - 0.5, part(211) - 0.5).normalize();
            let partner = domain.wrap(at + direction * (radii[0] + radii[1]));
            let partner = Vec3::new(partner.x, partner.y, partner.z.clamp(0.0, domain.size().z));
            for owner in [cut.owner(at), cut.owner(partner)] {
                assert!(near.is_ghost_on(owner, at, 0) && near.is_ghost_on(owner, partner, 1));
            }
        }
    }

    #[test]
    fn owners_know_their_particles_and_all_who_know_one_are_peers_of_its_owner() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [16, 12, 20], dx: 0.5 };
        let uneven = Decomposition::with_cuts(domain, [vec![0, 4, 16], vec![0, 8, 12], vec![0, 4, 9, 20]]);
        let equal = [1, 2, 3, 4, 6, 8, 12].map(|ranks| Decomposition::new(domain, ranks).unwrap());
        for cut in equal.into_iter().chain([uneven]) {
            let ranks = cut.ranks();
            let all: Vec<_> =
                (0..ranks).map(|rank| GhostLayer::new(cut.clone(), rank, &[0.45, 0.35])).collect();
            for n in 0..500_u32 {
                let part = |k: u32| f64::from(n * k % 499) / 499.0;
                let at = Vec3::new(part(7), part(31), part(101)).component_mul(&domain.size());
                let owner = all[0].owner(at);
                assert!(all[0].is_ghost_on(owner, at, 1));
                for rank in (0..ranks).filter(|&rank| rank != owner && all[0].is_ghost_on(rank, at, 0)) {
                    assert!(all[owner].peers.contains(&rank) && all[rank].peers.contains(&owner));
                }
                for (link, &peer) in all[owner].peers.iter().enumerate() {
                    assert_eq!(all[owner].is_ghost_on_peer(link, at, 0), all[0].is_ghost_on(peer, at, 0));
                }
            }
        }
    }
}
