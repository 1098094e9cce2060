//! The box, its periodic directions, its cells, and the blocks that ranks own.
//!
//! Cell `(i, j, k)` covers `[i, i+1) dx` and has its centre at `(i + 1/2) dx`; the box starts at the origin.

mod decomposition;
mod weights;

use crate::math::{Patch, Vec3};
pub use decomposition::Decomposition;
pub(crate) use decomposition::around;
pub use weights::Weights;

/// Kind of a face of the box. For bodies all but the periodic ones are solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// Fluid and bodies that leave here enter at the opposite face, which is periodic too.
    Periodic,
    /// A wall.
    Wall,
    /// A plane of symmetry of the fluid, which slips along it.
    FreeSlip,
    /// Fluid comes in with a given velocity.
    Inlet,
    /// Fluid leaves at a given pressure.
    Outlet {
        /// Density there over the reference, minus 1, to which the [motion of its wall](crate::fluid::WallMotion::excess) adds.
        excess: f64,
        /// Rate (1 / time step) at which the pressure returns to it after sound has left; none if sound is reflected.
        relaxation: Option<f64>,
        /// Part of the face that it has, lengths in cells; the rest is wall. Elsewhere, as a domain is copied often.
        patch: Option<&'static Patch>,
    },
}

impl Face {
    /// Returns true if it is periodic or a wall.
    pub fn is_plain(self) -> bool {
        matches!(self, Self::Periodic | Self::Wall)
    }

    /// Returns true if fluid goes through, by a velocity or a pressure.
    pub fn is_open(self) -> bool {
        matches!(self, Self::Inlet | Self::Outlet { .. })
    }

    /// Returns true if what comes back into a cell beside the face was sent by another cell.
    pub(crate) fn sends_to_neighbours(self) -> bool {
        matches!(self, Self::FreeSlip | Self::Outlet { .. })
    }
}

/// A box of cubic cells, each of whose faces is of a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Number of cells in each direction.
    pub cells: [usize; 3],
    /// Edge of a cell (m).
    pub dx: f64,
    /// Faces: the lower and the upper one in x, in y, in z.
    pub faces: [Face; 6],
}

impl Domain {
    /// Longest reach of two bodies together, in edges of the box, for which the nearest image and those [beside it](Self::shifts) are all
    /// that may touch.
    pub const MOST_REACH: f64 = 1.4;

    /// Faces of a box that is periodic in some directions, with walls in the others.
    pub const fn faces(periodic: [bool; 3]) -> [Face; 6] {
        let mut faces = [Face::Wall; 6];
        let mut n = 0;
        while n < 6 {
            if periodic[n / 2] {
                faces[n] = Face::Periodic;
            }
            n += 1;
        }
        faces
    }

    /// Returns true if direction `axis` is periodic; in the others positions stay as they are and have no images.
    #[inline]
    pub const fn is_periodic(&self, axis: usize) -> bool {
        matches!(self.faces[2 * axis], Face::Periodic)
    }

    /// The closed face beyond which a cell at a place along an axis lies.
    pub(crate) fn face_beyond(&self, axis: usize, place: isize) -> Option<usize> {
        let beyond = [place < 0, place >= self.cells[axis] as isize];
        let side = beyond.iter().position(|beyond| *beyond)?;
        (!self.is_periodic(axis)).then_some(2 * axis + side)
    }

    /// Kind of a closed face beside or at a cell of the lattice: a wall outside of the patch of an outlet. Beyond the edge of the face it is
    /// that of the cell at the edge.
    pub(crate) fn face_at(&self, face: usize, cell: [isize; 3]) -> Face {
        let Face::Outlet { patch: Some(patch), .. } = self.faces[face] else { return self.faces[face] };
        let at = std::array::from_fn(|a| {
            let cells = self.cells[a] as isize;
            let inside =
                if self.is_periodic(a) { cell[a].rem_euclid(cells) } else { cell[a].clamp(0, cells - 1) };
            inside as f64 + 0.5
        });
        if patch.has(at) { self.faces[face] } else { Face::Wall }
    }

    /// Returns true if fluid may flow through the box along an axis.
    pub fn is_open(&self, axis: usize) -> bool {
        self.is_periodic(axis) || self.faces[2 * axis..2 * axis + 2].iter().all(|face| face.is_open())
    }

    /// Periodic directions.
    pub fn periodic(&self) -> [bool; 3] {
        [0, 1, 2].map(|axis| self.is_periodic(axis))
    }

    /// Edges of the box (m).
    pub fn size(&self) -> Vec3 {
        Vec3::from_fn(|i, _| self.cells[i] as f64 * self.dx)
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Volume (m^3).
    pub fn volume(&self) -> f64 {
        self.size().product()
    }

    /// The image of `position` inside the box, `0 <= x < size` in each periodic direction.
    pub fn wrap(&self, position: Vec3) -> Vec3 {
        let size = self.size();
        Vec3::from_fn(|i, _| {
            let (x, length) = (position[i], size[i]);
            // Inside of the box it stays to the bit, without a call of `floor`.
            if !self.is_periodic(i) || (x > 0.0 && x < length) {
                return x;
            }
            let wrapped = x - length * (x / length).floor();
            // Rounding can give `length` itself for a tiny negative `x`.
            if wrapped >= length || wrapped < 0.0 { 0.0 } else { wrapped }
        })
    }

    /// The shortest periodic image of a difference of two wrapped positions.
    #[inline]
    pub fn nearest_image(&self, difference: Vec3) -> Vec3 {
        self.images_nearest().of(difference)
    }

    /// Finder of the shortest periodic images of many differences.
    #[inline]
    pub fn images_nearest(&self) -> NearestImage {
        let size = self.size();
        let half = Vec3::from_fn(|i, _| if self.is_periodic(i) { 0.5 * size[i] } else { f64::INFINITY });
        NearestImage { size, half }
    }

    /// Shifts (boxes) from the nearest image of a difference to the images that may be at most `reach` (m) long, itself included: along
    /// each axis by one at most.
    pub fn shifts(&self, reach: f64) -> impl Iterator<Item = [i8; 3]> + use<> {
        let most = self.has_images(reach).map(i8::from);
        let along = move |i: usize| -most[i]..=most[i];
        along(2).flat_map(move |z| along(1).flat_map(move |y| along(0).map(move |x| [x, y, z])))
    }

    /// Tells along which axes a difference may have several images that are at most `reach` (m) long.
    pub fn has_images(&self, reach: f64) -> [bool; 3] {
        [0, 1, 2].map(|i| self.is_periodic(i) && 2.0 * reach > self.cells[i] as f64 * self.dx)
    }

    /// The image `shift` boxes from another one.
    #[inline]
    pub fn shifted(&self, image: Vec3, shift: [i8; 3]) -> Vec3 {
        // Without a shift to the bit.
        if shift == [0; 3] {
            return image;
        }
        image + Vec3::from(shift.map(f64::from)).component_mul(&self.size())
    }

    /// The images of a difference of two wrapped positions that may be at most `reach` (m) long, see [`shifts`](Self::shifts).
    pub fn images(&self, difference: Vec3, reach: f64) -> impl Iterator<Item = Vec3> + use<> {
        let (domain, nearest) = (*self, self.nearest_image(difference));
        self.shifts(reach).map(move |shift| domain.shifted(nearest, shift))
    }

    /// Number of boxes, to the nearest, that a difference is long.
    pub fn boxes(&self, difference: Vec3) -> [i8; 3] {
        let boxes = difference.component_div(&self.size());
        [0, 1, 2].map(|i| if self.is_periodic(i) { boxes[i].round() as i8 } else { 0 })
    }

    /// The shorter of a distance (not negative) along axis `i` and its way round the back, where there is one.
    #[inline]
    pub fn shorter_way(&self, i: usize, distance: f64) -> f64 {
        if self.is_periodic(i) { distance.min(self.cells[i] as f64 * self.dx - distance) } else { distance }
    }

    /// The cell that holds a wrapped position; the nearest one for a position beyond a wall.
    pub fn cell_of(&self, position: Vec3) -> [usize; 3] {
        std::array::from_fn(|i| ((position[i] / self.dx) as usize).min(self.cells[i] - 1))
    }
}

/// [`Domain::nearest_image`] of many differences, without branches.
#[derive(Clone, Copy, Debug)]
pub struct NearestImage {
    /// Edges of the box (m).
    size: Vec3,
    /// Longest component of an image that is the shortest one (m), infinite along axes without images.
    half: Vec3,
}

impl NearestImage {
    /// The shortest periodic image of a difference of two wrapped positions.
    #[inline]
    pub fn of(&self, difference: Vec3) -> Vec3 {
        Vec3::from_fn(|i, _| {
            let (d, half, size) = (difference[i], self.half[i], self.size[i]);
            let beyond = if d > half { size } else { 0.0 };
            d - if d < -half { -size } else { beyond }
        })
    }
}

/// A box of cells, `lo <= cell < hi`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// First cell.
    pub lo: [usize; 3],
    /// One past the last cell.
    pub hi: [usize; 3],
}

impl Block {
    /// Number of cells in each direction.
    pub fn size(&self) -> [usize; 3] {
        std::array::from_fn(|i| self.hi[i] - self.lo[i])
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.size().iter().product()
    }

    /// The cells of both, if there are any.
    pub fn common(&self, other: &Self) -> Option<Self> {
        let lo: [usize; 3] = std::array::from_fn(|i| self.lo[i].max(other.lo[i]));
        let hi: [usize; 3] = std::array::from_fn(|i| self.hi[i].min(other.hi[i]));
        (0..3).all(|i| lo[i] < hi[i]).then_some(Self { lo, hi })
    }

    /// Appends the cells of `piece`, a part of a plane across z of this block, to `out`; `plane` has all of the plane, `cell` bytes each.
    pub fn cut_plane(&self, plane: &[u8], piece: &Self, cell: usize, out: &mut Vec<u8>) {
        let row = self.size()[0];
        for y in piece.lo[1]..piece.hi[1] {
            let first = (y - self.lo[1]) * row + piece.lo[0] - self.lo[0];
            out.extend_from_slice(&plane[first * cell..(first + piece.size()[0]) * cell]);
        }
    }

    /// The cells, counted over the whole box, in the order of fields: x fastest, then y, then z.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let Self { lo, hi } = *self;
        let rows = (lo[2]..hi[2]).flat_map(move |z| (lo[1]..hi[1]).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| (lo[0]..hi[0]).map(move |x| [x, y, z]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [21, 34, 47], dx: 0.5 };

    #[test]
    fn a_direction_is_periodic_if_its_faces_are() {
        let open = Domain { faces: Domain::faces([true, false, true]), ..BOX };
        let (periodic, wall) = (Face::Periodic, Face::Wall);
        assert_eq!(open.faces, [periodic, periodic, wall, wall, periodic, periodic]);
        assert_eq!(open.periodic(), [true, false, true]);
    }

    #[test]
    fn a_position_on_the_edge_of_the_box_has_exactly_one_image_inside() {
        let size = BOX.size();
        for x in [-1e-25, 0.0, size.x, f64::from_bits(size.x.to_bits() - 1), -size.x, 3.0 * size.x] {
            let wrapped = BOX.wrap(Vec3::new(x, 0.0, 0.0)).x;
            assert!((0.0..size.x).contains(&wrapped), "{x} went to {wrapped}");
        }
    }

    /// The slow truth: case by case.
    #[test]
    fn the_nearest_image_without_branches_is_the_nearest_image_to_the_bit() {
        for domain in [BOX, Domain { faces: Domain::faces([false, true, false]), ..BOX }] {
            let size = domain.size();
            let nearest = |i: usize, d: f64| {
                if domain.is_periodic(i) && d > 0.5 * size[i] {
                    d - size[i]
                } else if domain.is_periodic(i) && d < -0.5 * size[i] {
                    d + size[i]
                } else {
                    d
                }
            };
            let parts = [-1.0, -0.51, -0.5, -0.1, -1e-300, -0.0, 0.0, 0.3, 0.5, 0.7, 1.0];
            for (x, y) in parts.into_iter().flat_map(|x| parts.map(|y| (x, y))) {
                let difference = Vec3::new(x, y, -x).component_mul(&size);
                let one = Vec3::from_fn(|i, _| nearest(i, difference[i]));
                for other in [domain.nearest_image(difference), domain.images_nearest().of(difference)] {
                    assert_eq!(one.map(f64::to_bits), other.map(f64::to_bits), "{difference:?}");
                }
            }
        }
    }

    #[test]
    fn the_nearest_image_is_never_longer_than_half_the_box() {
        let d = BOX.nearest_image(Vec3::new(9.0, -10.0, 23.0));
        assert_eq!(d, Vec3::new(-1.5, 7.0, -0.5));
    }
}
