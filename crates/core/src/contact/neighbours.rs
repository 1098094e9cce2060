//! Neighbour list: pairs whose bounding spheres may meet, found anew only when bodies have moved far enough.
//!
//! The pairs are those of spheres enlarged by half a skin. Until a body has moved by half the skin, no other pair can meet
//! (Verlet 1967, doi:10.1103/PhysRev.159.98). The caller skips pairs that do not meet: results depend neither on the age of the list
//! nor on the rank that has it, and no checkpoint contains it.

use super::pairs::PairFinder;
use super::polyhedra::Hint;
use crate::domain::{Domain, NearestImage};
use crate::math::Vec3;

/// Skin over the largest bounding radius. Pairs apart cost little, so it may be wide.
const SKIN: f64 = 0.2;

/// Two bodies that may meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Neighbour {
    /// Their indices, the lower one first.
    pub pair: [u32; 2],
    /// Shift (boxes) of the second body from its nearest image.
    pub shift: [i8; 3],
    /// Memory of [`overlap_again`](super::overlap_again).
    pub hint: Hint,
}

impl Neighbour {
    /// Offset (m) from the first to the second, whose positions are wrapped.
    #[inline]
    pub fn offset(&self, (domain, nearest): (&Domain, &NearestImage), positions: &[Vec3]) -> Vec3 {
        let [first, second] = self.pair;
        domain.shifted(nearest.of(positions[second as usize] - positions[first as usize]), self.shift)
    }
}

/// Finds pairs as [`PairFinder`] does, and some more, mostly without a search. Images beside the nearest one, and images of a body
/// itself, are pairs of their own.
#[derive(Clone, Debug)]
pub struct NeighbourList {
    finder: PairFinder,
    pairs: Vec<Neighbour>,
    /// Positions (m) and bounding radii (m) for which the pairs were found.
    positions: Vec<Vec3>,
    radii: Vec<f64>,
    /// Half the skin (m).
    half_skin: f64,
}

impl NeighbourList {
    /// An empty list.
    pub fn new(finder: PairFinder) -> Self {
        Self { finder, pairs: Vec::new(), positions: Vec::new(), radii: Vec::new(), half_skin: 0.0 }
    }

    /// All pairs that [`PairFinder::find`] returns, those with further images that meet, of a body with itself once for both directions,
    /// and some that do not meet, in ascending order.
    ///
    /// # Shape
    /// `positions.len() == radii.len()`; positions are wrapped.
    pub fn find(&mut self, positions: &[Vec3], radii: &[f64]) -> &mut [Neighbour] {
        if !self.is_valid(positions, radii) {
            self.search(positions, radii);
        }
        &mut self.pairs
    }

    /// Returns true if no body has moved by half the skin. Bodies with equal radii stand for each other.
    fn is_valid(&self, positions: &[Vec3], radii: &[f64]) -> bool {
        let (nearest, limit) = (self.finder.domain().images_nearest(), self.half_skin * self.half_skin);
        let near = |(now, then): (&Vec3, &Vec3)| {
            // Most have not passed a face of the box.
            let moved = now - then;
            moved.norm_squared() < limit || nearest.of(moved).norm_squared() < limit
        };
        self.radii == radii && positions.iter().zip(&self.positions).all(near)
    }

    fn search(&mut self, positions: &[Vec3], radii: &[f64]) {
        self.half_skin = 0.5 * SKIN * radii.iter().copied().fold(0.0, f64::max);
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        self.radii.clear();
        self.radii.extend(radii.iter().map(|radius| radius + self.half_skin));
        let (domain, radii_of, hint) = (*self.finder.domain(), &self.radii, Hint::default());
        let reach = |pair: [u32; 2]| pair.iter().map(|&k| radii_of[k as usize]).sum::<f64>();
        self.pairs.clear();
        for &pair in self.finder.find(&self.positions, radii_of) {
            self.pairs.extend(domain.shifts(reach(pair)).map(|shift| Neighbour { pair, shift, hint }));
        }
        let (others, widest) = (self.pairs.len(), radii_of.iter().copied().fold(0.0, f64::max));
        if domain.has_images(2.0 * widest) != [false; 3] {
            for pair in (0..radii.len() as u32).map(|k| [k; 2]) {
                let meets = |shift: &[i8; 3]| {
                    let ahead = shift.iter().rev().find(|along| **along != 0).is_some_and(|along| *along > 0);
                    ahead && domain.shifted(Vec3::zeros(), *shift).norm() <= reach(pair)
                };
                let own = domain.shifts(reach(pair)).filter(meets);
                self.pairs.extend(own.map(|shift| Neighbour { pair, shift, hint }));
            }
        }
        if self.pairs.len() > others {
            self.pairs.sort_by_key(|neighbour| neighbour.pair);
        }
        self.radii.copy_from_slice(radii);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::tests::random;
    use crate::domain::Domain;
    use rand::Rng;

    /// Bodies that drift through a periodic box in which some pairs always meet.
    #[test]
    fn no_pair_that_meets_is_missing_while_bodies_move_and_most_steps_search_nothing() {
        let domain = Domain { faces: Domain::faces([true, true, false]), cells: [20, 21, 22], dx: 0.1 };
        let size = domain.size();
        let mut random = random(5);
        let mut part = || random.random_range(0.0..1.0);
        let mut positions: Vec<Vec3> = (0..60).map(|_| Vec3::from_fn(|i, _| part() * size[i])).collect();
        let radii: Vec<f64> = (0..60).map(|_| 0.1 + 0.15 * part()).collect();
        let mut velocities: Vec<Vec3> = (0..60).map(|_| Vec3::from_fn(|_, _| part() - 0.5)).collect();
        let mut finder = PairFinder::new(domain);
        let mut list = NeighbourList::new(PairFinder::new(domain));
        let (mut met, mut searches) = (0, 0);
        for _ in 0..600 {
            searches += usize::from(!list.is_valid(&positions, &radii));
            let listed: Vec<[u32; 2]> = list.find(&positions, &radii).iter().map(|n| n.pair).collect();
            assert!(listed.is_sorted());
            for pair in finder.find(&positions, &radii) {
                assert!(listed.binary_search(pair).is_ok(), "{pair:?}");
                met += 1;
            }
            for (position, velocity) in positions.iter_mut().zip(&mut velocities) {
                *position += *velocity * 3e-3;
                let beyond = position.z < 0.0 || position.z > size.z;
                velocity.z =
                    if beyond { velocity.z.abs() * (0.5 * size.z - position.z).signum() } else { velocity.z };
                *position = domain.wrap(*position);
            }
        }
        assert!(met > 600 * 10 && (20..200).contains(&searches), "{met} {searches}");
    }

    #[test]
    fn every_image_that_meets_is_listed_once_and_those_of_a_body_itself_in_one_direction() {
        let domain = Domain { faces: Domain::faces([true, true, false]), cells: [20, 30, 22], dx: 0.1 };
        let size = domain.size();
        let mut random = random(6);
        for _ in 0..50 {
            let mut part = || random.random_range(0.0..1.0);
            let positions: Vec<Vec3> = (0..5).map(|_| Vec3::from_fn(|i, _| part() * size[i])).collect();
            let radii: Vec<f64> = (0..5).map(|_| 0.2 + 1.15 * part()).collect();
            let mut list = NeighbourList::new(PairFinder::new(domain));
            let listed: Vec<Neighbour> = list.find(&positions, &radii).to_vec();
            let mut found: Vec<([u32; 2], [i64; 3])> = Vec::new();
            for neighbour in &listed {
                let [i, j] = neighbour.pair.map(|k| k as usize);
                let offset = neighbour.offset((&domain, &domain.images_nearest()), &positions);
                if offset.norm() <= radii[i] + radii[j] {
                    let boxes = (offset - (positions[j] - positions[i])).component_div(&size);
                    found.push((neighbour.pair, boxes.map(|n| n.round() as i64).into()));
                }
            }
            let mut expected = Vec::new();
            for (i, j) in (0..5_u32).flat_map(|i| (i..5).map(move |j| (i, j))) {
                for (x, y) in (-3..4_i64).flat_map(|x| (-3..4).map(move |y| (x, y))) {
                    let [a, b] = [i, j].map(|k| k as usize);
                    let shift = Vec3::new(x as f64, y as f64, 0.0).component_mul(&size);
                    let meets = (positions[b] - positions[a] + shift).norm() <= radii[a] + radii[b];
                    if meets && (i != j || (y, x) > (0, 0)) {
                        expected.push(([i, j], [x, y, 0]));
                    }
                }
            }
            assert!(listed.is_sorted_by_key(|neighbour| neighbour.pair));
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn another_number_of_bodies_or_another_radius_makes_a_new_list() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [20; 3], dx: 0.1 };
        let positions = [Vec3::repeat(0.5), Vec3::new(0.5, 0.5, 0.9), Vec3::new(0.5, 0.5, 1.9)];
        let mut list = NeighbourList::new(PairFinder::new(domain));
        let mut pairs = |positions: &[Vec3], radii: &[f64]| {
            list.find(positions, radii).iter().map(|n| n.pair).collect::<Vec<_>>()
        };
        assert!(pairs(&positions[..2], &[0.1, 0.1]).is_empty());
        assert_eq!(pairs(&positions[..2], &[0.1, 0.4]), [[0, 1]]);
        assert_eq!(pairs(&positions, &[0.3, 0.3, 0.4]), [[0, 1], [0, 2]]);
        assert!(pairs(&positions[..1], &[0.3]).is_empty());
    }
}
