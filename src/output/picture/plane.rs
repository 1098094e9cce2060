//! The plane of a slice, and the velocity on it.

use crate::domain::Domain;
use crate::math::Vec3;

/// The plane of a slice: which axes of the box run across and up.
pub(super) struct Plane {
    pub(super) domain: Domain,
    pub(super) across: usize,
    pub(super) up: usize,
    pub(super) normal: usize,
    /// Whether the coordinate grows downwards in the picture, because gravity points along it.
    pub(super) flipped: bool,
    /// Width and height (m).
    pub(super) size: (f64, f64),
}

impl Plane {
    pub(super) fn new(domain: &Domain, gravity: Vec3) -> Self {
        let up = if gravity.norm() > 0.0 { gravity.iamax() } else { 2 };
        let across = usize::from(up == 0);
        let normal = 3 - up - across;
        let size = domain.size();
        Self {
            domain: *domain,
            across,
            up,
            normal,
            flipped: gravity[up] > 0.0,
            size: (size[across], size[up]),
        }
    }

    /// Distance from the top of the picture of a coordinate along `up`, both in metres.
    pub(super) fn down(&self, up: f64) -> f64 {
        if self.flipped { up } else { self.size.1 - up }
    }

    /// Coordinate along the normal of the slice: the middle of the box (m).
    pub(super) fn height(&self) -> f64 {
        0.5 * self.domain.size()[self.normal]
    }

    /// Unit vectors to the right, upwards in the picture, and towards who looks at it.
    pub(super) fn frame(&self) -> [Vec3; 3] {
        let right = Vec3::ith(self.across, 1.0);
        let up = Vec3::ith(self.up, if self.flipped { -1.0 } else { 1.0 });
        [right, up, right.cross(&up)]
    }

    /// The point of the slice at a place of the picture (m from its top left corner).
    pub(super) fn point(&self, right: f64, down: f64) -> Vec3 {
        let up = if self.flipped { down } else { self.size.1 - down };
        Vec3::ith(self.across, right) + Vec3::ith(self.up, up) + Vec3::ith(self.normal, self.height())
    }

    /// Velocity magnitude (m/s) at every pixel, row by row from the top; linear between cell centres.
    pub(super) fn speeds(&self, velocity: &[[f32; 3]], (width, height): (u32, u32)) -> Vec<f32> {
        let n = self.domain.cells;
        // The middle lies between two layers of cells if their number is even.
        let layers = [(n[self.normal] - 1) / 2, n[self.normal] / 2];
        let cell = |a: usize, b: usize| -> [f32; 3] {
            let mut sum = [0.0; 3];
            for layer in layers {
                let mut at = [0; 3];
                (at[self.across], at[self.up], at[self.normal]) = (a, b, layer);
                let u = velocity[at[0] + n[0] * (at[1] + n[1] * at[2])];
                for i in 0..3 {
                    sum[i] += 0.5 * u[i];
                }
            }
            sum
        };
        let (na, nb) = (n[self.across], n[self.up]);
        let layer: Vec<[f32; 3]> = (0..na * nb).map(|i| cell(i % na, i / na)).collect();
        // Cells on both sides of a pixel, and how far it is from the first to the second.
        let neighbours = |pixel: u32, pixels: u32, axis: usize| {
            let cells = n[axis];
            let place = (f64::from(pixel) + 0.5) / f64::from(pixels) * cells as f64 - 0.5;
            let first = place.floor();
            let index = |cell: f64| {
                if self.domain.periodic[axis] {
                    (cell as isize).rem_euclid(cells as isize) as usize
                } else {
                    (cell.max(0.0) as usize).min(cells - 1)
                }
            };
            (index(first), index(first + 1.0), (place - first) as f32)
        };
        let columns: Vec<_> = (0..width).map(|x| neighbours(x, width, self.across)).collect();
        let mut speeds = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let row = if self.flipped { y } else { height - 1 - y };
            let (b0, b1, t) = neighbours(row, height, self.up);
            for &(a0, a1, s) in &columns {
                let corners = [(a0, b0), (a1, b0), (a0, b1), (a1, b1)].map(|(a, b)| layer[a + na * b]);
                let u: [f32; 3] = std::array::from_fn(|i| {
                    let [p, q, r, w] = corners.map(|u| u[i]);
                    (1.0 - t) * ((1.0 - s) * p + s * q) + t * ((1.0 - s) * r + s * w)
                });
                speeds.push(u.iter().map(|x| x * x).sum::<f32>().sqrt());
            }
        }
        speeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Domain = Domain {
        periodic: [true; 3],
        cells: [20, 11, 40],
        dx: 0.1,
    };

    #[test]
    fn gravity_along_another_axis_turns_the_plane() {
        let plane = Plane::new(&BOX, Vec3::new(-1.0, 0.0, 0.1));
        assert_eq!((plane.across, plane.up, plane.normal), (1, 0, 2));
        let plane = Plane::new(&BOX, Vec3::new(0.0, 2.0, 0.0));
        assert_eq!((plane.across, plane.up, plane.normal), (0, 1, 2));
        assert!(plane.flipped);
    }

    #[test]
    fn between_a_closed_face_and_the_cell_beside_it_the_velocity_is_that_of_the_cell() {
        let velocity: Vec<[f32; 3]> = (0..BOX.cell_count())
            .map(|cell| [(cell / 220) as f32, 0.0, 0.0])
            .collect();
        for (closed, expected) in [(true, [39.0, 0.0]), (false, [29.25, 9.75])] {
            let domain = Domain {
                periodic: [true, true, !closed],
                ..BOX
            };
            let plane = Plane::new(&domain, Vec3::zeros());
            // Two pixels per cell.
            let speeds = plane.speeds(&velocity, (1, 80));
            let got = [speeds[0], speeds[79]];
            assert!(
                got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4),
                "{got:?}"
            );
        }
    }

    #[test]
    fn a_place_of_the_picture_is_a_point_of_the_slice_and_its_axes_look_right() {
        for gravity in [-Vec3::z(), Vec3::z()] {
            let plane = Plane::new(&BOX, gravity);
            let [right, up, towards] = plane.frame();
            assert!((up + gravity).norm() < 1e-15 && right == Vec3::x());
            assert!((right.cross(&up) - towards).norm() < 1e-15);
            let step = plane.point(0.5, 0.25) - plane.point(0.25, 0.75);
            assert!((step - (0.25 * right + 0.5 * up)).norm() < 1e-12);
            assert!((plane.point(0.0, 0.0).y - 0.55).abs() < 1e-12);
        }
    }
}
