//! Motions of walls, also over time.

use super::{LinkRule, Walls};
use crate::domain::Domain;
use crate::fluid::layout::Layout;
use crate::fluid::{Population, Real};
use crate::lattice::{C, W};
use crate::math::{Patch, Profile};

/// Rigid motion of a wall in a step, lattice units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WallMotion {
    /// Velocity of the pivot (cells per time step).
    pub velocity: [f64; 3],
    /// Angular velocity about the pivot (1 / time step).
    pub angular_velocity: [f64; 3],
    /// A point of the wall (cells from the corner of the box).
    pub pivot: [f64; 3],
    /// It may be another one in the next step.
    pub varies: bool,
    /// Profile of the velocity, lengths in cells: of an inlet.
    pub profile: Profile,
    /// Part of the face with that velocity, lengths in cells: of an inlet.
    pub patch: Option<Patch>,
    /// Density of an outlet, added to that of its [face](crate::domain::Face::Outlet).
    pub excess: f64,
}

impl WallMotion {
    pub(super) fn moves(&self) -> bool {
        self.varies || self.velocity.iter().chain(&self.angular_velocity).any(|&v| v != 0.0)
    }

    /// `6 w_i c_i . u_w` of the link in direction `i` of a cell of the box: by its position there, so it is the same on every rank. Where it
    /// crosses a face that [sends back to neighbours](crate::domain::Face::sends_to_neighbours), too, the wall does not push through that.
    pub(super) fn correction<T: Real>(&self, cell: [isize; 3], i: usize, domain: &Domain) -> T {
        let centre = cell.map(|n| n as f64 + 0.5);
        if self.patch.as_ref().is_some_and(|patch| !patch.has(centre)) {
            return T::ZERO;
        }
        let u = self.of_cell(std::array::from_fn(|a| cell[a] as f64 + 0.5 * (1.0 - C[i][a] as f64)), centre);
        let pushes = |&a: &usize| {
            let beyond: [isize; 3] = std::array::from_fn(|a| cell[a] - C[i][a]);
            let crossed = domain.face_beyond(a, beyond[a]);
            crossed.is_none_or(|face| !domain.face_at(face, beyond).sends_to_neighbours())
        };
        let cu: f64 = (0..3).filter(pushes).map(|a| C[i][a] as f64 * u[a]).sum();
        T::from_f64(6.0 * W[i] * cu)
    }

    /// Velocity at a position (cells from the corner of the box; cell `n` has its centre at `n + 1/2`).
    pub fn at(&self, position: [f64; 3]) -> [f64; 3] {
        self.of_cell(position, position)
    }

    /// Velocity at a position for a link of the cell with this centre.
    fn of_cell(&self, position: [f64; 3], centre: [f64; 3]) -> [f64; 3] {
        let of_mean = self.profile.at(position, centre);
        let (w, r): (_, [f64; 3]) =
            (self.angular_velocity, std::array::from_fn(|a| position[a] - self.pivot[a]));
        std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            (self.velocity[a] + (w[b] * r[c] - w[c] * r[b])) * of_mean
        })
    }
}

impl<S: Population> Walls<S> {
    /// Gives the walls that vary their motion in the coming step.
    pub(crate) fn set_motions(&mut self, layout: &Layout, motions: &[WallMotion]) {
        assert_eq!(self.motions.len(), motions.len(), "the motion of each wall");
        let (lo, domain) = (self.lo, self.domain);
        let in_box = |cell: [usize; 3]| std::array::from_fn(|a| (cell[a] + lo[a]) as isize);
        self.motions.clone_from_slice(motions);
        self.face_links.set_pressures(|wall| motions[usize::from(wall)].excess);
        for run in self.late.iter().chain(self.early.iter().flatten()) {
            let (motion, i) = (&motions[usize::from(run.wall)], usize::from(run.direction));
            if motion.varies {
                let [x, y, z] = in_box(layout.coordinates(run.near - i * layout.stride));
                let numbers = &mut self.numbers[run.numbers as usize..][..run.count as usize];
                for (x, number) in (x..).zip(numbers) {
                    *number = motion.correction([x, y, z], i, &domain);
                }
            }
        }
        for ends in self.ends.iter_mut().filter(|ends| ends.rule == LinkRule::Moving) {
            let mut numbers = std::mem::take(&mut ends.numbers);
            ends.each(layout, self.size, |link, i, cell, _, _| {
                if let Some(motion) =
                    motions.get(usize::from(ends.walls[link])).filter(|motion| motion.varies)
                {
                    numbers[link] = motion.correction(in_box(cell), i, &domain);
                }
            });
            ends.numbers = numbers;
        }
        self.interpolated.set_motions(layout, (lo, &domain), motions, |motion| motion.varies);
    }
}
