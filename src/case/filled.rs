//! The part of the box that bodies fill, counted at the points of a grid: bodies may overlap each other and walls.

use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::wall::Surface;

/// Points per diameter of the smallest body, and at most per edge of the box.
const PER_DIAMETER: f64 = 16.0;
const MOST_POINTS: f64 = 192.0;

/// Points of the box outside of walls, and those of them that are in bodies.
pub(super) struct Filled {
    points: [usize; 3],
    /// Volume that a point stands for (m^3).
    volume: f64,
    free: Vec<bool>,
    solid: Vec<bool>,
}

impl Filled {
    pub(super) fn by<'a>(
        domain: &Domain,
        walls: &[Surface],
        templates: &[Template],
        bodies: impl Iterator<Item = &'a Particle> + Clone,
    ) -> Self {
        let size = domain.size();
        let shape = |body: &Particle| &templates[body.template as usize].shape;
        let smallest =
            bodies.clone().map(|body| shape(body).equivalent_diameter()).fold(size.min(), f64::min);
        let points: [usize; 3] = std::array::from_fn(|axis| {
            (PER_DIAMETER * size[axis] / smallest).ceil().clamp(1.0, MOST_POINTS) as usize
        });
        let apart = Vec3::from_fn(|axis, _| size[axis] / points[axis] as f64);
        let at = |n: [i64; 3]| Vec3::from_fn(|axis, _| (n[axis] as f64 + 0.5) * apart[axis]);
        let count = points.iter().product();
        let mut filled =
            Self { points, volume: apart.product(), free: vec![true; count], solid: vec![false; count] };
        if !walls.is_empty() {
            filled.each([0; 3], points.map(|n| n as i64 - 1), domain, |filled, index, n| {
                filled.free[index] = walls.iter().all(|wall| wall.distance(at(n)) > 0.0);
            });
        }
        for body in bodies {
            let (shape, turn) = (shape(body), body.orientation());
            let (lo, hi) = shape.bounds(&turn);
            let cell = |corner: Vec3| {
                std::array::from_fn(|a| ((body.position[a] + corner[a]) / apart[a] - 0.5).round() as i64)
            };
            filled.each(cell(lo), cell(hi), domain, |filled, index, n| {
                let point = turn.inverse_transform_vector(&(at(n) - body.position()));
                filled.solid[index] |= filled.free[index] && shape.signed_distance(point) < 0.0;
            });
        }
        filled
    }

    /// Calls `visit` with the index and the place of the points from `first` to `last` that are in the box or one of its periodic images.
    fn each(
        &mut self,
        first: [i64; 3],
        last: [i64; 3],
        domain: &Domain,
        mut visit: impl FnMut(&mut Self, usize, [i64; 3]),
    ) {
        let [nx, ny, nz] = self.points.map(|n| n as i64);
        let inside = |axis: usize, n: i64, count: i64| {
            let wrapped = if domain.periodic[axis] { n.rem_euclid(count) } else { n };
            (0..count).contains(&wrapped).then_some(wrapped)
        };
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                let (Some(row), Some(plane)) = (inside(1, y, ny), inside(2, z, nz)) else {
                    continue;
                };
                for x in first[0]..=last[0] {
                    if let Some(column) = inside(0, x, nx) {
                        visit(self, (column + nx * (row + ny * plane)) as usize, [x, y, z]);
                    }
                }
            }
        }
    }

    /// Volume of the bodies outside of walls (m^3).
    pub(super) fn solid_volume(&self) -> f64 {
        self.volume * self.solid.iter().filter(|solid| **solid).count() as f64
    }

    /// Least volume fraction of bodies in as many parts of the box along each axis, walls left out (-).
    pub(super) fn least_fraction(&self, parts: [usize; 3]) -> f64 {
        let mut counts = vec![[0_u32; 2]; parts.iter().product()];
        let [nx, ny, _] = self.points;
        for (index, (free, solid)) in self.free.iter().zip(&self.solid).enumerate() {
            let at = [index % nx, index / nx % ny, index / (nx * ny)];
            let part = |axis: usize| at[axis] * parts[axis] / self.points[axis];
            let [all, in_bodies] = &mut counts[part(0) + parts[0] * (part(1) + parts[1] * part(2))];
            *all += u32::from(*free);
            *in_bodies += u32::from(*solid);
        }
        let fractions = counts.iter().filter(|[free, _]| *free > 0);
        fractions.map(|[free, solid]| f64::from(*solid) / f64::from(*free)).fold(1.0, f64::min)
    }
}
