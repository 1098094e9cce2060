//! Images of bodies for a device.
//!
//! Spheres and bodies with flat faces are their geometry; of all others the host finds the cells, and the device gets the solid fractions
//! of those that a surface cuts. The order of all numbers is that of `fluid/device/kernels.cl`.

use super::cover::Cover;
use super::faces::FacePlane;
use super::mapper::{Geometry, Image, Mapper};
use super::saturated::face_numbers;
use crate::fluid::{IMAGE_INTS, Images, Segment};

/// Kinds of images.
const SPHERE: i32 = 0;
const FLAT: i32 = 1;
const MAPPED: i32 = 2;

impl Images {
    /// Adds an image of a body; `find` adds its cells to those `found` if the device does not know its geometry, or if all are `by_host`.
    pub(super) fn add(
        &mut self,
        mapper: &Mapper,
        image: &Image,
        by_host: bool,
        found: &mut Cover,
        find: impl FnOnce(&mut Cover),
    ) {
        let int = |n: i64| i32::try_from(n).expect("a box less than 2^31 cells long");
        let [xs, ys, zs] = &image.offsets;
        let rows = ((ys.end() - ys.start() + 1) * (zs.end() - zs.start() + 1)) as usize;
        let (mut faces, mut radius) = ([0, 0], 0.0);
        let kind = match &mapper.geometry {
            _ if by_host => MAPPED,
            Geometry::Sphere(of) => {
                radius = of * mapper.per_dx;
                SPHERE
            }
            Geometry::Flat(planes) => {
                faces = [self.planes.len() / 5, planes.len()];
                for plane in planes {
                    self.add_face(plane);
                }
                FLAT
            }
            _ => MAPPED,
        };
        let mapped = self.mapped.len() / 5;
        if kind == MAPPED {
            let first = found.added.len();
            find(found);
            self.add_mapped(image, rows, &found.added[first..]);
        }
        let ints = [
            kind,
            image.body as i32,
            int(*xs.start()),
            int(*xs.end()),
            int(*ys.start()),
            int(*ys.end()),
            int(*zs.start()),
            int(*zs.end()),
            int(image.base[0]),
            int(image.base[1]),
            int(image.base[2]),
            int(self.rows as i64),
            int(faces[0] as i64),
            int(faces[1] as i64),
            int(mapped as i64),
        ];
        self.ints.extend(ints);
        self.ints.resize(self.ints.len().next_multiple_of(IMAGE_INTS), 0);
        let motion = &mapper.motion;
        self.numbers.extend(motion.centre);
        self.numbers.extend(motion.velocity);
        self.numbers.extend(motion.angular);
        self.numbers.extend([radius, mapper.shift - radius, 0.0]);
        self.rows += rows;
        self.most_rows = self.most_rows.max(rows);
    }

    fn add_face(&mut self, plane: &FacePlane) {
        let [_, ny, nz] = plane.normal;
        let offset = plane.rest(0.0, 0.0);
        self.planes.extend([ny, nz, offset, plane.slope, plane.reach]);
        let normal = plane.normal.map(|n| n as f32);
        self.faces.extend(normal);
        self.faces.extend([offset as f32, plane.reach as f32]);
        self.faces.extend(face_numbers(normal));
    }

    /// First and last cell of each row, first wholly solid one and the one past the last of those, and the index of the fractions.
    fn add_mapped(&mut self, image: &Image, rows: usize, found: &[(u32, Segment)]) {
        let start = self.mapped.len();
        for _ in 0..rows {
            self.mapped.extend([1, 0, 1, 1, 0]);
        }
        let [_, ys, zs] = &image.offsets;
        let width = ys.end() - ys.start() + 1;
        for &(_, Segment { count, head, tail, offset, cut, .. }) in found {
            let row = (i64::from(offset[1]) - ys.start()) + width * (i64::from(offset[2]) - zs.start());
            let end = offset[0] + i32::from(count);
            let of_row = [offset[0], end - 1, offset[0] + i32::from(head), end - i32::from(tail), cut as i32];
            self.mapped[start + 5 * row as usize..][..5].copy_from_slice(&of_row);
        }
    }
}
