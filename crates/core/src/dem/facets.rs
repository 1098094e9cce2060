//! Sums over time of the contacts with each facet of the meshes among the walls, for wear.
//!
//! ```text
//! impulse         sum F dt            F acts on the facet
//! normal impulse  sum |F . n| dt      n is the normal of the contact
//! friction work   sum F_t . v_t dt    F_t is F along the facet, v_t the velocity of the body there relative to the facet
//! ```
//!
//! What a contact adds is rounded to a multiple of 2^-76 (N s or J), and integers have no order: the sums are the same to the bit on any ranks.

use crate::math::Vec3;
use crate::wall::Wall;
use bytemuck::{Pod, Zeroable};

/// Sums of one facet since the start: impulse along x, y and z, normal impulse (N s), friction work (J).
pub type FacetSums = [i128; 5];

/// The sums of one rank: those of all ranks add up.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facets {
    /// By wall and facet; none of walls that are no meshes.
    walls: Vec<Vec<FacetSums>>,
}

/// Sums of a facet in a saved state.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Row {
    wall: u64,
    facet: u64,
    /// Lower and upper half of each.
    sums: [[u64; 2]; 5],
}

impl Facets {
    /// One N s or J in the units of the sums, which are below 2^27 of it on all ranks together.
    pub const ONE: f64 = (1_u128 << 76) as f64;

    /// Zeros for these walls.
    pub(super) fn new(walls: &[Wall]) -> Self {
        let of = |wall: &Wall| wall.surface.mesh().map_or(0, |placed| placed.mesh.facets().len());
        Self { walls: walls.iter().map(|wall| vec![[0; 5]; of(wall)]).collect() }
    }

    /// The sums by wall and facet; none of walls that are no meshes.
    pub fn walls(&self) -> &[Vec<FacetSums>] {
        &self.walls
    }

    /// Adds a contact over a time `dt` (s): the force (N) on the facet, the normal, and the velocity (m/s) of the body relative to the facet.
    pub(super) fn add(&mut self, (wall, facet): (usize, u32), [force, normal, velocity]: [Vec3; 3], dt: f64) {
        let Some(sums) = self.walls.get_mut(wall).and_then(|of| of.get_mut(facet as usize)) else { return };
        let along = force.dot(&normal);
        let friction = force.dot(&velocity) - along * velocity.dot(&normal);
        let terms = [force.x, force.y, force.z, along.abs(), friction];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += (term * dt * Self::ONE).round_ties_even() as i128;
        }
    }

    /// The sums that are not zero, to [continue](Self::take) from.
    pub(super) fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (wall, facets) in self.walls.iter().enumerate() {
            for (facet, sums) in facets.iter().enumerate().filter(|(_, sums)| **sums != [0; 5]) {
                let halves = sums.map(|sum| [sum as u64, (sum >> 64) as u64]);
                let row = Row { wall: wall as u64, facet: facet as u64, sums: halves };
                bytes.extend_from_slice(bytemuck::bytes_of(&row));
            }
        }
        bytes
    }

    /// Adds saved sums; false if they are not of these walls.
    pub(super) fn take(&mut self, bytes: &[u8]) -> bool {
        let (rows, rest) = bytes.as_chunks::<{ size_of::<Row>() }>();
        rest.is_empty()
            && rows.iter().all(|row| {
                let Row { wall, facet, sums } = bytemuck::pod_read_unaligned(row);
                let of = self.walls.get_mut(wall as usize).and_then(|of| of.get_mut(facet as usize));
                let Some(own) = of else { return false };
                for (own, [low, high]) in own.iter_mut().zip(sums) {
                    *own = own.wrapping_add(i128::from(high as i64) << 64 | i128::from(low));
                }
                true
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wall::mesh::tests::{placed, plate};
    use crate::wall::{Motion, Surface};

    #[test]
    fn sums_are_the_same_in_any_order_and_over_any_number_of_saved_parts() {
        let wall = |surface| Wall { name: String::new(), surface, motion: Motion::default(), material: 0 };
        let walls = [
            wall(Surface::Plane { point: Vec3::zeros(), normal: Vec3::z() }),
            wall(Surface::Mesh(placed(plate([1.0, 1.0], [1, 1]), None))),
        ];
        let contact = |n: u32| {
            let part = f64::from(n) * 0.37 - 3.0;
            let force = Vec3::new(0.1 * part, -1e-3, 2.0 + part * 1e-7);
            ((1, n % 2), [force, Vec3::z(), Vec3::new(0.3, part, -0.1)])
        };
        let mut all = Facets::new(&walls);
        (0..40).for_each(|n| all.add(contact(n).0, contact(n).1, 1e-5));
        let mut parts = [Facets::new(&walls), Facets::new(&walls)];
        (0..40).rev().for_each(|n| parts[n as usize % 3 / 2].add(contact(n).0, contact(n).1, 1e-5));
        let mut again = Facets::new(&walls);
        assert!(parts.iter().all(|part| again.take(&part.save())));
        assert_eq!(again, all);
        // The force along the facet times the velocity along it, and the force across it.
        let [_, y, _, normal, friction] = all.walls()[1][0].map(|sum| sum as f64 / Facets::ONE);
        let expected: f64 =
            (0..40).step_by(2).map(|n| contact(n).1).map(|[f, _, v]| f.x * v.x + f.y * v.y).sum::<f64>()
                * 1e-5;
        assert!(
            (friction - expected).abs() < 1e-15 && (normal - 40e-5).abs() < 1e-8 && (y + 2e-7).abs() < 1e-15
        );
    }

    #[test]
    fn saved_sums_of_other_walls_are_refused() {
        let wall = Wall {
            name: String::new(),
            surface: Surface::Mesh(placed(plate([1.0, 1.0], [1, 1]), None)),
            motion: Motion::default(),
            material: 0,
        };
        let mut facets = Facets::new(std::slice::from_ref(&wall));
        facets.add((0, 1), [Vec3::z(); 3], 1.0);
        let saved = facets.save();
        assert!(Facets::new(std::slice::from_ref(&wall)).take(&saved) && Facets::new(&[wall]).take(&[]));
        assert!(!Facets::new(&[]).take(&saved) && !facets.take(&saved[1..]));
    }
}
