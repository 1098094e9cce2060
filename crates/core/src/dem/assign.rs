//! Owner, ghosts and evaluating rank, which every rank finds alike without a message.

use crate::domain::{Decomposition, around};
use crate::math::Vec3;

/// The rank that evaluates a contact.
///
/// 1. Both bodies have one owner: that rank.
/// 2. Otherwise the lower owner that has both.
/// 3. Otherwise the lowest rank that has both; `None` if there is none.
///
/// # Reference
/// Marquardt, Hafen, Krause (2024), doi:10.1016/j.cpc.2024.109321, section 3.3.
fn responsible(
    owners: [usize; 2],
    knows_both: impl Fn(usize) -> bool,
    lowest_that_knows_both: impl FnOnce() -> Option<usize>,
) -> Option<usize> {
    let [a, b] = owners;
    if a == b {
        return Some(a);
    }
    [a.min(b), a.max(b)].into_iter().find(|&rank| knows_both(rank)).or_else(lowest_that_knows_both)
}

/// Block of a rank as a middle and half edges (m), for many questions.
#[derive(Clone, Copy, Debug)]
struct Zone {
    middle: Vec3,
    half: Vec3,
}

impl Zone {
    fn of(decomposition: &Decomposition, rank: usize) -> Self {
        let place = decomposition.place(rank);
        let slabs: [[f64; 2]; 3] = std::array::from_fn(|i| slab(decomposition, i, place[i]));
        Self { middle: Vec3::from_fn(|i, _| slabs[i][0]), half: Vec3::from_fn(|i, _| slabs[i][1]) }
    }
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
pub struct Neighbourhood {
    decomposition: Decomposition,
    rank: usize,
    own: Zone,
    /// Ranks with which messages are exchanged, ascending; mutual.
    pub peers: Vec<usize>,
    /// Those of the peers.
    zones: Vec<Zone>,
    /// Distance to the block within which a particle of each template is a ghost (m).
    reach: Vec<f64>,
}

impl Neighbourhood {
    /// For particles that lie in spheres of these radii (m, by template), enlarged for contacts.
    ///
    /// A rank has a particle if its centre is at most `R + R_max + 2 dx` from the rank's block: enough for every
    /// contact of the particles inside the block, also after each has moved by a cell.
    pub fn new(decomposition: Decomposition, rank: usize, radii: &[f64]) -> Self {
        let dx = decomposition.domain.dx;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let reach: Vec<f64> = (radii.iter()).map(|radius| radius + largest + 2.0 * dx).collect();
        // The sender is the owner of before the move.
        let furthest = reach.iter().copied().fold(0.0, f64::max) + 1.5 * dx;
        let peers = decomposition.neighbours(rank, furthest);
        let zone = |rank| Zone::of(&decomposition, rank);
        Self {
            own: zone(rank),
            zones: peers.iter().map(|&peer| zone(peer)).collect(),
            rank,
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
            self.own
        } else {
            match self.peers.binary_search(&rank) {
                Ok(link) => self.zones[link],
                Err(_) => Zone::of(&self.decomposition, rank),
            }
        }
    }

    /// Returns true if `rank` has a particle of this template at a wrapped position, as owner or as a ghost.
    pub fn knows(&self, rank: usize, position: Vec3, template: u64) -> bool {
        self.holds(&self.zone(rank), position, template)
    }

    /// Returns true if `peers[link]` has a particle of this template at a wrapped position, as owner or as a ghost.
    pub fn peer_knows(&self, link: usize, position: Vec3, template: u64) -> bool {
        self.holds(&self.zones[link], position, template)
    }

    fn holds(&self, zone: &Zone, position: Vec3, template: u64) -> bool {
        let reach = self.reach[template as usize];
        (0..3).all(|i| self.is_near(i, position[i], [zone.middle[i], zone.half[i]], reach))
    }

    /// Returns true if a coordinate lies within `reach` (m) of a slab.
    fn is_near(&self, axis: usize, x: f64, [middle, half]: [f64; 2], reach: f64) -> bool {
        let offset = (x - middle).abs();
        self.decomposition.domain.shorter_way(axis, offset) <= half + reach
    }

    /// All ranks that have a particle of this template at a wrapped position, its owner included, ascending.
    pub fn who_knows(&self, position: Vec3, template: u64) -> Vec<usize> {
        let [xs, ys, zs] = std::array::from_fn(|axis| self.slabs_that_know(axis, position, template));
        let mut ranks = Vec::with_capacity(xs.len() * ys.len() * zs.len());
        for &z in &zs {
            for &y in &ys {
                ranks.extend(xs.iter().map(|&x| self.decomposition.rank_of([x, y, z])));
            }
        }
        ranks
    }

    /// The slabs of an axis whose ranks have a particle as far as that axis goes, ascending. Only slabs around that
    /// of the owner are tested.
    fn slabs_that_know(&self, axis: usize, position: Vec3, template: u64) -> Vec<usize> {
        let cut = &self.decomposition;
        let reach = self.reach[template as usize];
        let owner = cut.place(self.owner(position))[axis];
        around(owner, cut.grid[axis], cut.domain.periodic[axis], |p| {
            self.is_near(axis, position[axis], slab(cut, axis, p), reach)
        })
    }

    /// The rank that evaluates the contact of two particles, each with its owner, wrapped position and template: the
    /// same answer on every rank.
    pub fn responsible(&self, a: (usize, Vec3, u64), b: (usize, Vec3, u64)) -> Option<usize> {
        let knows_both = |rank| {
            let zone = self.zone(rank);
            [a, b].iter().all(|&(_, position, template)| self.holds(&zone, position, template))
        };
        responsible([a.0, b.0], knows_both, || self.lowest_that_knows([a, b].map(|(_, x, t)| (x, t))))
    }

    /// The lowest rank that has both of two particles.
    ///
    /// Ranks have a particle axis by axis, so those that have both are a product of slabs along x, y and z, and the
    /// lowest is at the lowest of each.
    fn lowest_that_knows(&self, [a, b]: [(Vec3, u64); 2]) -> Option<usize> {
        let mut place = [0; 3];
        for axis in 0..3 {
            let of_b = self.slabs_that_know(axis, b.0, b.1);
            let of_a = self.slabs_that_know(axis, a.0, a.1);
            place[axis] = of_a.into_iter().find(|p| of_b.contains(p))?;
        }
        Some(self.decomposition.rank_of(place))
    }

    /// Low corner and edges (m) of the part of space in which `rank` has particles.
    pub fn window(&self, rank: usize) -> (Vec3, Vec3) {
        let reach = self.reach.iter().copied().fold(0.0, f64::max) + self.decomposition.domain.dx;
        let zone = self.zone(rank);
        let half = zone.half + Vec3::repeat(reach);
        (zone.middle - half, 2.0 * half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;
    use proptest::prelude::*;

    /// By asking all ranks.
    fn responsible_by_exhaustive_search(
        near: &Neighbourhood,
        a: (usize, Vec3, u64),
        b: (usize, Vec3, u64),
    ) -> Option<usize> {
        let knows_both = |rank: usize| [a, b].iter().all(|&(_, x, t)| near.knows(rank, x, t));
        let lowest = || (0..near.ranks()).find(|&rank| knows_both(rank));
        responsible([a.0, b.0], knows_both, lowest)
    }

    #[test]
    fn a_contact_of_one_owner_belongs_to_that_owner() {
        assert_eq!(responsible([5, 5], |_| false, || None), Some(5));
    }

    #[test]
    fn a_contact_of_two_owners_belongs_to_the_lower_that_knows_both() {
        assert_eq!(responsible([6, 2], |_| true, || None), Some(2));
        assert_eq!(responsible([2, 6], |_| true, || None), Some(2));
        assert_eq!(responsible([2, 6], |rank| rank != 2, || None), Some(6));
    }

    #[test]
    fn a_contact_that_no_owner_knows_belongs_to_the_lowest_rank_that_does() {
        assert_eq!(responsible([2, 6], |_| false, || Some(4)), Some(4));
        assert_eq!(responsible([2, 6], |_| false, || None), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn all_ranks_find_the_responsible_rank_of_an_exhaustive_search_for_any_cuts(
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
            let domain = Domain { periodic, cells: [0, 1, 2].map(|i| cuts[i][cuts[i].len() - 1]), dx: 0.7 };
            let cut = Decomposition::with_cuts(domain, cuts);
            let all: Vec<_> =
                (0..cut.ranks()).map(|rank| Neighbourhood::new(cut.clone(), rank, &radii)).collect();
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
                let expected = responsible_by_exhaustive_search(&all[0], a, b);
                let pair = [a, b].map(|(_, x, t)| (x, t));
                let lowest = (0..cut.ranks())
                    .find(|&rank| pair.iter().all(|&(x, t)| all[0].knows(rank, x, t)));
                for near in &all {
                    prop_assert_eq!(near.responsible(a, b), expected);
                    prop_assert_eq!(near.responsible(b, a), expected);
                    // The third rule, which a pair that touches never needs.
                    prop_assert_eq!(near.lowest_that_knows(pair), lowest);
                    for (rank, other) in all.iter().enumerate() {
                        prop_assert_eq!(near.knows(rank, a.1, a.2), other.knows(rank, a.1, a.2));
                    }
                    let who: Vec<usize> = (0..cut.ranks()).filter(|&r| near.knows(r, a.1, a.2)).collect();
                    prop_assert_eq!(near.who_knows(a.1, a.2), who);
                }
            }
        }
    }

    #[test]
    fn an_owner_knows_both_bodies_of_every_pair_that_touches() {
        let domain = Domain { periodic: [true, true, false], cells: [16, 12, 20], dx: 0.5 };
        let radii = [0.95, 0.35];
        let cut = Decomposition::new(domain, 12).unwrap();
        let near = Neighbourhood::new(cut.clone(), 0, &radii);
        for n in 0..2000_u32 {
            let part = |k: u32| f64::from(n * k % 1999) / 1999.0;
            let at = Vec3::new(part(7), part(31), part(101)).component_mul(&domain.size());
            let direction = Vec3::new(part(13) - 0.5, part(57) - 0.5, part(211) - 0.5).normalize();
            let partner = domain.wrap(at + direction * (radii[0] + radii[1]));
            let partner = Vec3::new(partner.x, partner.y, partner.z.clamp(0.0, domain.size().z));
            for owner in [cut.owner(at), cut.owner(partner)] {
                assert!(near.knows(owner, at, 0) && near.knows(owner, partner, 1));
            }
        }
    }

    #[test]
    fn owners_know_their_particles_and_all_who_know_one_are_peers_of_its_owner() {
        let domain = Domain { periodic: [true; 3], cells: [16, 12, 20], dx: 0.5 };
        let uneven = Decomposition::with_cuts(domain, [vec![0, 4, 16], vec![0, 8, 12], vec![0, 4, 9, 20]]);
        let equal = [1, 2, 3, 4, 6, 8, 12].map(|ranks| Decomposition::new(domain, ranks).unwrap());
        for cut in equal.into_iter().chain([uneven]) {
            let ranks = cut.ranks();
            let all: Vec<_> =
                (0..ranks).map(|rank| Neighbourhood::new(cut.clone(), rank, &[0.45, 0.35])).collect();
            for n in 0..500_u32 {
                let part = |k: u32| f64::from(n * k % 499) / 499.0;
                let at = Vec3::new(part(7), part(31), part(101)).component_mul(&domain.size());
                let owner = all[0].owner(at);
                assert!(all[0].knows(owner, at, 1));
                for rank in (0..ranks).filter(|&rank| rank != owner && all[0].knows(rank, at, 0)) {
                    assert!(all[owner].peers.contains(&rank) && all[rank].peers.contains(&owner));
                    let gap = 0.8 + 0.1 + 1.0;
                    assert!(cut.is_within(rank, at, gap * (1.0 + 1e-12)));
                }
                for (link, &peer) in all[owner].peers.iter().enumerate() {
                    assert_eq!(all[owner].peer_knows(link, at, 0), all[0].knows(peer, at, 0));
                }
            }
        }
    }
}
