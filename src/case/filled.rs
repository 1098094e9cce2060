//! The part of the box that bodies fill, counted at the points of a grid: bodies may overlap each other and walls.

use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::wall::Surface;

/// Points per diameter of the smallest body, and at most per edge of the box.
const PER_DIAMETER: f64 = 16.0;
const MOST_POINTS: f64 = 192.0;
/// Tests of points against a plane, about, above which there are fewer points: a second of one core.
const MOST_TESTS: f64 = 3e8;
/// Tests that one of a point against a body without faces counts for.
const CURVED: f64 = 16.0;
/// Least points along an edge of a part of the box.
const PER_PART: usize = 8;

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
        let tests = bodies.clone().map(|body| {
            let (lo, hi) = shape(body).bounds(&body.orientation());
            let inside = Vec3::from_fn(|axis, _| {
                let edge = hi[axis] - lo[axis];
                if domain.is_periodic(axis) { edge } else { edge.min(size[axis]) }
            });
            inside.product() * shape(body).as_polyhedron().map_or(CURVED, |body| body.faces.len() as f64)
        });
        let tests = walls.len() as f64 * domain.volume() + tests.sum::<f64>();
        let points = points(&size, smallest, tests);
        let apart = Vec3::from_fn(|axis, _| size[axis] / points[axis] as f64);
        let at = |n: [i64; 3]| Vec3::from_fn(|axis, _| (n[axis] as f64 + 0.5) * apart[axis]);
        let count = points.iter().product();
        let mut filled =
            Self { points, volume: apart.product(), free: vec![true; count], solid: vec![false; count] };
        if !walls.is_empty() {
            filled.each([0; 3], points.map(|n| n as i64 - 1), domain, |filled, index, n| {
                filled.free[index] = walls.iter().all(|wall| !wall.is_wall(at(n)));
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

    /// Calls `visit` with the index and the indices along the axes of the points from `first` to `last` that are in the box or one of its
    /// periodic images.
    fn each(
        &mut self,
        first: [i64; 3],
        last: [i64; 3],
        domain: &Domain,
        mut visit: impl FnMut(&mut Self, usize, [i64; 3]),
    ) {
        let counts = self.points.map(|n| n as i64);
        let [x, y, z] = std::array::from_fn(|axis| {
            let (first, last) = (first[axis], last[axis]);
            if domain.is_periodic(axis) { first..=last } else { first.max(0)..=last.min(counts[axis] - 1) }
        });
        let wrapped = |axis: usize, n: i64| n.rem_euclid(counts[axis]);
        for z in z {
            for y in y.clone() {
                let row = counts[0] * (wrapped(1, y) + counts[1] * wrapped(2, z));
                for x in x.clone() {
                    visit(self, (wrapped(0, x) + row) as usize, [x, y, z]);
                }
            }
        }
    }

    /// Volume of the bodies outside of walls (m^3).
    pub(super) fn solid_volume(&self) -> f64 {
        self.volume * self.solid.iter().filter(|solid| **solid).count() as f64
    }

    /// Least volume fraction of bodies in as many parts of the box along each axis, or as many as there are points for, walls left out (-).
    pub(super) fn least_fraction(&self, parts: [usize; 3]) -> f64 {
        let parts: [usize; 3] =
            std::array::from_fn(|axis| parts[axis].min(self.points[axis] / PER_PART).max(1));
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

/// Points along each edge of the box, as of a smallest body of this diameter (m); fewer where the tests that each density of points makes
/// (m^3) would be too many.
fn points(size: &Vec3, smallest: f64, tests: f64) -> [usize; 3] {
    let fine = size.map(|edge| (PER_DIAMETER * edge / smallest).ceil().clamp(1.0, MOST_POINTS));
    let all = tests * fine.product() / size.product();
    let coarser = libm::cbrt(MOST_TESTS / all).min(1.0);
    std::array::from_fn(|axis| (fine[axis] * coarser).ceil() as usize)
}

#[cfg(test)]
mod tests {
    use super::{Filled, points};
    use crate::case::from_text;
    use crate::math::Vec3;

    #[test]
    fn bodies_of_many_faces_are_counted_at_fewer_points() {
        let box_of = Vec3::new(1.0, 1.0, 2.0);
        assert_eq!(points(&box_of, 0.5, 1.0), [32, 32, 64]);
        // 4096 faces in all of the box: 4096 * 41^3 < 3e8 < 4096 * 42^3.
        assert_eq!(points(&box_of, 1e-3, 4096.0 * 2.0), [42; 3]);
    }

    #[test]
    fn only_the_part_of_a_long_plate_that_is_in_a_closed_box_is_visited() {
        let text = "domain = { size = [4e-3, 4e-3, 4e-3], periodic = [false, false, false] }\n\
                    fluid = { density = 1000, viscosity = 1e-5 }\n\
                    lattice = { cells_per_diameter = 8, relaxation_time = 0.8 }\n\
                    run.end.steps = 1\n\
                    particles = [{ shape.sphere.diameter = 1e-3, density = 2500, list = [[2e-3, 2e-3, 2e-3]] }]\n";
        let setup = from_text(text, "plate", &[]).unwrap_or_else(|e| panic!("{e}"));
        let mut filled = Filled::by(&setup.domain, &[], &setup.templates, setup.particles.iter());
        let mut visited = 0;
        let far = 1_000_000_000_000;
        filled.each([-far, 3, -far], [far, 4, -1], &setup.domain, |_, _, _| visited += 1);
        assert_eq!(visited, 0);
        filled.each([-far, 3, -far], [far, 4, 0], &setup.domain, |_, _, _| visited += 1);
        assert_eq!(visited, filled.points[0] * 2);
    }
}
