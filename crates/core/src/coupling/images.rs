//! Images of bodies for a device.
//!
//! Spheres and bodies with flat faces are their geometry; of all others, bodies of several parts among them, the host finds the cells, and the
//! device gets the solid fractions of those that a surface cuts. The order of all numbers is that of `fluid/device/kernels.cl`.

use super::cover::Cover;
use super::faces::FacePlane;
use super::mapper::{Geometry, Image, Mapper};
use super::saturated::LEAST_SKIN;
use crate::domain::Block;
use crate::fluid::volume_fraction::face_numbers;
use crate::fluid::{IMAGE_INTS, Images, LatticeSphere, RigidMotion, Segment};
use std::collections::BTreeMap;

/// Kinds of images.
const SPHERE: i32 = 0;
const FLAT: i32 = 1;
const MAPPED: i32 = 2;

/// Rows of cells that an image may cover.
fn rows_of(image: &Image) -> usize {
    let [_, ys, zs] = &image.offsets;
    ((ys.end() - ys.start() + 1) * (zs.end() - zs.start() + 1)) as usize
}

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
        let rows = rows_of(image);
        let (mut faces, mapped) = ([0, 0], self.mapped.len() / 5);
        let kind = match &mapper.geometry {
            Geometry::Flat(planes) if !by_host => {
                faces = [self.planes.len() / 5, planes.len()];
                for plane in planes {
                    self.add_face(plane);
                }
                FLAT
            }
            _ => {
                let first = found.added.len();
                find(found);
                self.add_mapped(image, rows, &found.added[first..]);
                MAPPED
            }
        };
        self.push(kind, image, rows, [faces[0], faces[1], mapped], &mapper.motion, [0.0, mapper.shift]);
    }

    /// Adds an image of a sphere that moves like this.
    pub(super) fn add_sphere(&mut self, sphere: LatticeSphere, image: &Image, motion: &RigidMotion) {
        let (rows, mapped, LatticeSphere { radius, shift }) = (rows_of(image), self.mapped.len() / 5, sphere);
        self.push(SPHERE, image, rows, [0, 0, mapped], motion, [radius, shift - radius]);
    }

    /// Adds the cells that the host `found` of a body of several parts, in ascending order of rows and cells: images with at most one
    /// segment in a row.
    pub(super) fn add_joined(
        &mut self,
        body: u32,
        motion: &RigidMotion,
        block: Block,
        found: &[(u32, Segment)],
    ) {
        let [_, ny, _] = block.size().map(|n| n as i64);
        let mut layers = BTreeMap::<_, Vec<(u32, Segment)>>::new();
        let mut before = (u32::MAX, 0);
        for &(row, segment) in found {
            before = (row, if before.0 == row { before.1 + 1 } else { 0 });
            let cell = [i64::from(segment.x), i64::from(row) % ny, i64::from(row) / ny];
            let base: [i64; 3] = std::array::from_fn(|a| cell[a] - i64::from(segment.offset[a]));
            layers.entry((base, before.1)).or_default().push((row, segment));
        }
        for ((base, _), found) in layers {
            let offsets = std::array::from_fn(|a| {
                let low = |(_, segment): &(u32, Segment)| i64::from(segment.offset[a]);
                let high = |of: &(u32, Segment)| low(of) + if a == 0 { i64::from(of.1.count) - 1 } else { 0 };
                let least = found.iter().map(low).min().expect("a layer has a segment");
                least..=found.iter().map(high).max().expect("a layer has a segment")
            });
            let image = Image { body, offsets, base, rows: ny };
            let (rows, mapped) = (rows_of(&image), self.mapped.len() / 5);
            self.add_mapped(&image, rows, &found);
            self.push(MAPPED, &image, rows, [0, 0, mapped], motion, [0.0; 2]);
        }
    }

    /// Adds the numbers of an image: its kind and rows, first face, number of faces and first mapped row, motion, and radius of a
    /// sphere and distance by which the surface is moved in, minus that radius.
    fn push(
        &mut self,
        kind: i32,
        image: &Image,
        rows: usize,
        indices: [usize; 3],
        motion: &RigidMotion,
        radii: [f64; 2],
    ) {
        let int = |n: i64| i32::try_from(n).expect("a box less than 2^31 cells long");
        let [[x0, x1], [y0, y1], [z0, z1]] =
            image.offsets.each_ref().map(|of| [int(*of.start()), int(*of.end())]);
        let [x, y, z] = image.base.map(int);
        let [face, faces, mapped] = indices.map(|index| int(index as i64));
        let row = int(self.rows as i64);
        let ints = [kind, image.body as i32, x0, x1, y0, y1, z0, z1, x, y, z, row, face, faces, mapped];
        self.ints.extend_from_slice(&ints);
        self.ints.resize(self.ints.len().next_multiple_of(IMAGE_INTS), 0);
        let [[cx, cy, cz], [ux, uy, uz], [wx, wy, wz]] = [motion.centre, motion.velocity, motion.angular];
        self.numbers.extend_from_slice(&[cx, cy, cz, ux, uy, uz, wx, wy, wz, radii[0], radii[1], 0.0]);
        self.rows += rows;
        self.most_rows = self.most_rows.max(rows);
    }

    fn add_face(&mut self, plane: &FacePlane) {
        let [_, ny, nz] = plane.normal;
        let offset = plane.rest(0.0, 0.0);
        // As on the processor.
        self.planes.extend([ny, nz, offset, plane.slope, plane.reach + LEAST_SKIN]);
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
