//! Who owns, who knows, and who is responsible: every rank finds the same answer without a message.

use crate::domain::Decomposition;
use crate::math::Vec3;

/// The rank that evaluates a contact.
///
/// 1. Both bodies have one owner: that rank.
/// 2. Otherwise the lower owner that knows both.
/// 3. Otherwise the lowest rank that knows both; `None` if there is none.
///
/// # Reference
/// Marquardt, Hafen, Krause (2024), doi:10.1016/j.cpc.2024.109321, section 3.3.
pub fn responsible(
    owner_a: usize,
    owner_b: usize,
    ranks: usize,
    knows_both: impl Fn(usize) -> bool,
) -> Option<usize> {
    if owner_a == owner_b {
        return Some(owner_a);
    }
    [owner_a.min(owner_b), owner_a.max(owner_b)]
        .into_iter()
        .chain(0..ranks)
        .find(|&rank| knows_both(rank))
}

/// Block of a rank as a middle and half edges (m), for many questions.
#[derive(Clone, Copy, Debug)]
struct Zone {
    middle: Vec3,
    half: Vec3,
}

/// Which ranks know a particle, from its position alone.
#[derive(Clone, Debug)]
pub struct Neighbourhood {
    decomposition: Decomposition,
    zones: Vec<Zone>,
    /// Ranks with which messages are exchanged, ascending; mutual.
    pub peers: Vec<usize>,
    /// Distance to the block within which a particle of each template is known (m).
    reach: Vec<f64>,
}

impl Neighbourhood {
    /// For particles that lie in spheres of these radii (m, by template), enlarged for contacts.
    ///
    /// A rank knows a particle if its centre is at most `R + R_max + 2 dx` from the rank's block: enough for every contact of
    /// the particles inside the block, also after each has moved by a cell.
    pub fn new(decomposition: Decomposition, rank: usize, radii: &[f64]) -> Self {
        let dx = decomposition.domain.dx;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let reach: Vec<f64> = (radii.iter()).map(|radius| radius + largest + 2.0 * dx).collect();
        // The sender is the owner of before the move.
        let furthest = reach.iter().copied().fold(0.0, f64::max) + 1.5 * dx;
        let zones = (0..decomposition.ranks())
            .map(|rank| {
                let block = decomposition.block(rank);
                let edge = |cells: [usize; 3]| Vec3::from_fn(|i, _| cells[i] as f64 * dx);
                let (lo, hi) = (edge(block.lo), edge(block.hi));
                Zone {
                    middle: (lo + hi) * 0.5,
                    half: (hi - lo) * 0.5,
                }
            })
            .collect();
        Self {
            peers: decomposition.neighbours(rank, furthest),
            zones,
            reach,
            decomposition,
        }
    }

    /// Number of ranks.
    pub fn ranks(&self) -> usize {
        self.zones.len()
    }

    /// The box and how it is cut.
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    /// The rank that owns a particle at a wrapped position.
    pub fn owner(&self, position: Vec3) -> usize {
        if self.zones.len() == 1 {
            0
        } else {
            self.decomposition.owner(position)
        }
    }

    /// Whether `rank` knows a particle of this template at a wrapped position.
    pub fn knows(&self, rank: usize, position: Vec3, template: u64) -> bool {
        let (zone, reach) = (&self.zones[rank], self.reach[template as usize]);
        (0..3).all(|i| {
            let offset = (position[i] - zone.middle[i]).abs();
            self.decomposition.domain.shorter_way(i, offset) <= zone.half[i] + reach
        })
    }

    /// Low corner and edges (m) of the part of space in which `rank` knows particles.
    pub fn window(&self, rank: usize) -> (Vec3, Vec3) {
        let reach = self.reach.iter().copied().fold(0.0, f64::max) + self.decomposition.domain.dx;
        let half = self.zones[rank].half + Vec3::repeat(reach);
        (self.zones[rank].middle - half, 2.0 * half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;

    #[test]
    fn a_contact_of_one_owner_belongs_to_that_owner() {
        assert_eq!(responsible(5, 5, 8, |_| false), Some(5));
    }

    #[test]
    fn a_contact_of_two_owners_belongs_to_the_lower_that_knows_both() {
        assert_eq!(responsible(6, 2, 8, |_| true), Some(2));
        assert_eq!(responsible(2, 6, 8, |_| true), Some(2));
        assert_eq!(responsible(2, 6, 8, |rank| rank != 2), Some(6));
    }

    #[test]
    fn a_contact_that_no_owner_knows_belongs_to_the_lowest_rank_that_does() {
        assert_eq!(responsible(2, 6, 8, |rank| rank == 7 || rank == 4), Some(4));
        assert_eq!(responsible(2, 6, 8, |_| false), None);
    }

    #[test]
    fn owners_know_their_particles_and_all_who_know_one_are_peers_of_its_owner() {
        let domain = Domain {
            periodic: [true; 3],
            cells: [16, 12, 20],
            dx: 0.5,
        };
        for ranks in [1, 2, 3, 4, 6, 8, 12] {
            let cut = Decomposition::new(domain, ranks).unwrap();
            let all: Vec<_> = (0..ranks)
                .map(|rank| Neighbourhood::new(cut.clone(), rank, &[0.45, 0.35]))
                .collect();
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
            }
        }
    }
}
