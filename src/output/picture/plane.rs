//! The plane of a slice, and the flow on it.

use crate::domain::{Block, Domain};
use crate::math::Vec3;

/// The plane of a slice, across an axis of the box. By default it goes through the middle of the box and holds the direction of
/// gravity, upwards in the picture, and if it can the x axis: the x-z plane for gravity along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    pub(super) domain: Domain,
    pub(super) across: usize,
    pub(super) up: usize,
    pub(super) normal: usize,
    /// True if the coordinate grows downwards in the picture, because gravity points along it.
    pub(super) flipped: bool,
    /// Width and height (m).
    pub(super) size: (f64, f64),
    /// Coordinate along the normal (cells).
    coordinate: f64,
}

impl Plane {
    /// The plane for gravity in this direction (without gravity z points up), across the axis of `cut` at its coordinate (m).
    pub fn new(domain: &Domain, gravity: Vec3, cut: Option<(usize, Option<f64>)>) -> Self {
        let mut up = if gravity.norm() > 0.0 { gravity.iamax() } else { 2 };
        let (normal, position) = cut.unwrap_or((3 - up - usize::from(up == 0), None));
        if up == normal {
            // Seen along gravity, the later of the other axes points up.
            up = 2 - usize::from(normal == 2);
        }
        let across = 3 - up - normal;
        let size = domain.size();
        Self {
            domain: *domain,
            across,
            up,
            normal,
            flipped: gravity[up] > 0.0,
            size: (size[across], size[up]),
            coordinate: position.map_or(0.5 * domain.cells[normal] as f64, |position| position / domain.dx),
        }
    }

    /// Coordinate along the normal of the slice (m).
    pub(super) fn height(&self) -> f64 {
        self.coordinate * self.domain.dx
    }

    /// The layers of cells whose middles the plane lies between, the same one twice if it is in the middle of it or beyond the
    /// last; and how far it is from the first to the second, 0 to 1.
    fn layers(&self) -> (usize, usize, f64) {
        let last = self.domain.cells[self.normal] - 1;
        let coordinate = (self.coordinate - 0.5).clamp(0.0, last as f64);
        let first = coordinate as usize;
        let part = coordinate - first as f64;
        (first, if part > 0.0 { first + 1 } else { first }, part)
    }

    /// The cells at the plane: one layer, or the two that it lies between.
    pub fn cells(&self) -> Block {
        let mut cells = Block { lo: [0; 3], hi: self.domain.cells };
        let (first, second, _) = self.layers();
        (cells.lo[self.normal], cells.hi[self.normal]) = (first, second + 1);
        cells
    }

    /// Adds the flow in one of its [`cells`](Self::cells), velocity (m/s) and pressure (Pa), to that of the plane: `width * height`
    /// values for the numbers of cells across and up, across fastest, zero at first. Panics if `flow` has another length.
    pub fn add(&self, flow: &mut [[f32; 4]], cell: [usize; 3], u: [f32; 4]) {
        let n = self.domain.cells;
        assert_eq!(flow.len(), self.values(), "one value per point of the plane");
        let (first, _, part) = self.layers();
        let weight = if cell[self.normal] == first { 1.0 - part } else { part } as f32;
        let at = &mut flow[cell[self.across] + n[self.across] * cell[self.up]];
        for (sum, u) in at.iter_mut().zip(u) {
            *sum += weight * u;
        }
    }

    /// Component of the vorticity along the normal (1/s) at every point, of the [flow](Self::add) there: central differences, one-sided
    /// beside a closed face.
    pub fn vorticity(&self, flow: &[[f32; 4]]) -> Vec<f32> {
        let (n, width) = (self.domain.cells, self.domain.cells[self.across]);
        // Change of a component along another axis, at a point.
        let slope = |component: usize, axis: usize, at: [usize; 2]| {
            let along = usize::from(axis == self.up);
            let (cells, here) = (n[axis], at[along]);
            let (before, after) = if self.domain.is_periodic(axis) {
                ((here + cells - 1) % cells, (here + 1) % cells)
            } else {
                (here.saturating_sub(1), (here + 1).min(cells - 1))
            };
            let value = |place: usize| {
                let mut at = at;
                at[along] = place;
                f64::from(flow[at[0] + width * at[1]][component])
            };
            let steps = if self.domain.is_periodic(axis) { 2 } else { (after - before).max(1) };
            (value(after) - value(before)) / (steps as f64 * self.domain.dx)
        };
        let (a, b) = ((self.normal + 1) % 3, (self.normal + 2) % 3);
        let places = (0..self.values()).map(|place| [place % width, place / width]);
        places.map(|at| (slope(b, a, at) - slope(a, b, at)) as f32).collect()
    }

    /// Number of points of the plane.
    pub fn values(&self) -> usize {
        self.domain.cells[self.across] * self.domain.cells[self.up]
    }

    /// True if the plane cuts a sphere of this radius (m) round a position or one of its periodic images.
    pub fn cuts(&self, position: Vec3, radius: f64) -> bool {
        let off = Vec3::ith(self.normal, position[self.normal] - self.height());
        self.domain.nearest_image(off).norm() <= radius
    }
}

#[cfg(feature = "pictures")]
#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [20, 11, 40], dx: 0.1 };

    #[test]
    fn gravity_along_another_axis_turns_the_plane() {
        let plane = Plane::new(&BOX, Vec3::new(-1.0, 0.0, 0.1), None);
        assert_eq!((plane.across, plane.up, plane.normal), (1, 0, 2));
        let plane = Plane::new(&BOX, Vec3::new(0.0, 2.0, 0.0), None);
        assert_eq!((plane.across, plane.up, plane.normal), (0, 1, 2));
        assert!(plane.flipped);
    }

    #[test]
    fn between_a_closed_face_and_the_cell_beside_it_the_velocity_is_that_of_the_cell() {
        let flow: Vec<[f32; 4]> = (0..800).map(|place| [(place / 20) as f32, 0.0, 0.0, 0.0]).collect();
        for (closed, expected) in [(true, [39.0, 0.0]), (false, [29.25, 9.75])] {
            let domain = Domain { faces: Domain::faces([true, true, !closed]), ..BOX };
            let plane = Plane::new(&domain, Vec3::zeros(), None);
            // Two pixels per cell.
            let flow: Vec<f32> = flow.iter().map(|u| u[0]).collect();
            let speeds = plane.pixels(&flow, (1, 80));
            let got = [speeds[0], speeds[79]];
            assert!(got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{got:?}");
        }
    }

    #[test]
    fn the_velocity_of_the_plane_is_the_mean_of_the_layers_beside_it() {
        for (layers, expected) in [(11, 5.0), (12, 5.5)] {
            let domain = Domain { cells: [20, layers, 40], ..BOX };
            let plane = Plane::new(&domain, Vec3::zeros(), None);
            let (Block { lo, hi }, mut velocity) = (plane.cells(), vec![[0.0; 4]; plane.values()]);
            for (z, y) in (lo[2]..hi[2]).flat_map(|z| (lo[1]..hi[1]).map(move |y| (z, y))) {
                for x in lo[0]..hi[0] {
                    plane.add(&mut velocity, [x, y, z], [x as f32, y as f32, z as f32, 1.0]);
                }
            }
            let mean = |place: u16| [f32::from(place % 20), expected, f32::from(place / 20), 1.0];
            assert_eq!(velocity, (0..800).map(mean).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_vorticity_of_a_rigid_rotation_is_twice_its_rate_and_that_of_a_shear_its_rate() {
        let closed = Domain { faces: Domain::faces([false; 3]), ..BOX };
        for normal in 0..3 {
            let plane = Plane::new(&closed, -Vec3::z(), Some((normal, None)));
            let (rotation, mut flow) = (Vec3::ith(normal, 1.5), vec![[0.0; 4]; plane.values()]);
            let mut shear = flow.clone();
            for cell in plane.cells().cells() {
                let at = Vec3::from(cell.map(|i| i as f64 * closed.dx));
                let u = rotation.cross(&at).map(|u| u as f32);
                plane.add(&mut flow, cell, [u.x, u.y, u.z, 0.0]);
                let mut along = [0.0; 4];
                along[(normal + 1) % 3] = -2.5 * at[(normal + 2) % 3] as f32;
                plane.add(&mut shear, cell, along);
            }
            for (flow, expected) in [(flow, 3.0), (shear, 2.5)] {
                let vorticity = plane.vorticity(&flow);
                assert!(vorticity.iter().all(|w| (w - expected).abs() < 1e-3), "{normal} {expected}");
            }
        }
    }

    #[test]
    fn a_plane_may_be_across_any_axis_and_anywhere_in_the_box() {
        for (normal, axes) in [(0, (1, 2)), (1, (0, 2)), (2, (0, 1))] {
            // Gravity along z does not lie in the last one.
            let plane = Plane::new(&BOX, -Vec3::z(), Some((normal, None)));
            assert_eq!((plane.across, plane.up, plane.normal), (axes.0, axes.1, normal));
        }
        for (position, layers, expected) in
            [(0.55, 5..6, 5.0), (0.575, 5..7, 5.25), (0.0, 0..1, 0.0), (1.1, 10..11, 10.0)]
        {
            let plane = Plane::new(&BOX, -Vec3::z(), Some((1, Some(position))));
            let Block { lo, hi } = plane.cells();
            assert_eq!(lo[1]..hi[1], layers, "{position}");
            let mut velocity = vec![[0.0; 4]; plane.values()];
            for y in lo[1]..hi[1] {
                plane.add(&mut velocity, [0, y, 0], [y as f32, 0.0, 0.0, 0.0]);
            }
            assert!((velocity[0][0] - expected).abs() < 1e-5, "{position}");
            assert!((plane.point(0.0, 0.0).y - position).abs() < 1e-12);
            assert!(plane.cuts(Vec3::new(0.0, position, 0.0), 1e-9));
        }
    }

    #[test]
    fn a_sphere_is_cut_if_it_or_an_image_of_it_reaches_the_middle() {
        let plane = Plane::new(&BOX, Vec3::zeros(), None);
        for (y, radius, cut) in [(0.25, 0.31, true), (0.25, 0.29, false), (1.35, 0.31, true)] {
            assert_eq!(plane.cuts(Vec3::new(0.1, y, 9.0), radius), cut, "{y} {radius}");
        }
        let closed = Domain { faces: Domain::faces([true, false, true]), ..BOX };
        let plane = Plane::new(&closed, Vec3::zeros(), None);
        assert!(!plane.cuts(Vec3::new(0.1, 1.35, 9.0), 0.31));
    }

    #[test]
    fn a_place_of_the_picture_is_a_point_of_the_slice_and_its_axes_look_right() {
        for gravity in [-Vec3::z(), Vec3::z()] {
            let plane = Plane::new(&BOX, gravity, None);
            let [right, up, towards] = plane.frame();
            assert!((up + gravity).norm() < 1e-15 && right == Vec3::x());
            assert!((right.cross(&up) - towards).norm() < 1e-15);
            let step = plane.point(0.5, 0.25) - plane.point(0.25, 0.75);
            assert!((step - (0.25 * right + 0.5 * up)).norm() < 1e-12);
            assert!((plane.point(0.0, 0.0).y - 0.55).abs() < 1e-12);
        }
    }
}
