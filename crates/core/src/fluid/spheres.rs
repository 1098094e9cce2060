//! Spheres on a block of fluid: the rows that each may reach, and the solid fractions of the cells of a row, found when it is swept.
//!
//! A sphere is so simple that to find its cells anew in the first-level cache is faster than to read them from memory.

use super::Real;
use super::simd::{Choose, Lanes, Registers};
use super::solid::GROUP;
use super::volume_fraction::{LEAST, Normal, at_least};
use crate::math::{ceil, floor};

/// Half the diagonal of a cell.
pub(crate) const HALF_DIAGONAL: f64 = 0.8660254037844386;

/// Distances from the centre of a sphere below this count as this (cells): far within, in any direction.
pub(crate) const NEAR: f32 = 1e-3;

/// A sphere (lengths in cells).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LatticeSphere {
    /// Radius.
    pub radius: f64,
    /// Distance by which the surface is moved in.
    pub shift: f64,
}

impl LatticeSphere {
    /// Squared distances from the centre within which cells may be covered, and are wholly solid; of the latter -1 if there are none.
    #[inline(always)]
    pub(crate) fn squares(&self) -> [f64; 2] {
        let (outer, inner) = (self.radius + HALF_DIAGONAL, self.radius - HALF_DIAGONAL);
        [outer * outer, if inner > 0.0 { inner * inner } else { -1.0 }]
    }

    /// Offsets of the first and the last cell that may be covered of the row at `y, z` from the centre, which is at `centre` in the
    /// row, and the same of those that are wholly solid, crossing if there are none.
    #[inline(always)]
    fn cells(&self, centre: f64, [y, z]: [f64; 2]) -> [[i32; 2]; 2] {
        let mut cells = [[1, 0]; 2];
        for (ends, square) in cells.iter_mut().zip(self.squares()) {
            let rest = (square - z * z) - y * y;
            if rest >= 0.0 {
                let half = rest.sqrt();
                *ends = [ceil(centre - half), floor(half + centre)];
            }
        }
        cells
    }

    /// For the row at `y, z` from the centre, which is at `centre` in the row.
    #[inline(always)]
    pub(crate) fn row(&self, centre: f64, [y, z]: [f64; 2]) -> SphereRow {
        let least = LEAST * self.radius as f32;
        SphereRow {
            centre: centre as f32,
            square: (y * y + z * z) as f32,
            depth: (self.shift - self.radius) as f32,
            least,
            sizes: [at_least(y as f32, least), at_least(z as f32, least)],
        }
    }
}

/// Numbers that the solid fractions of a row of cells in a sphere need.
#[derive(Clone, Copy)]
pub(crate) struct SphereRow {
    centre: f32,
    square: f32,
    depth: f32,
    least: f32,
    sizes: [f32; 2],
}

impl SphereRow {
    /// Solid fractions of the cells with the offsets `n`. The normal is the vector from the centre, as long as it is: no division.
    #[inline(always)]
    pub(crate) fn fractions<R: Choose<f32>>(&self, n: R) -> R {
        let c = |x: f32| R::splat(x);
        let x = n - c(self.centre);
        let length = (x * x + c(self.square)).sqrt().max(c(NEAR));
        let [my, mz] = self.sizes;
        let normal = Normal::new([at_least(x, c(self.least)), c(my), c(mz)]);
        normal.behind((length + c(self.depth)) * length)
    }
}

/// A periodic image of a sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphereImage {
    /// Index of the body.
    pub body: u32,
    /// Its surface.
    pub sphere: LatticeSphere,
    /// Cell of the block at offset 0.
    pub base: [i32; 3],
}

/// Cells of a row that a sphere covers.
pub(super) struct SphereCells {
    /// Offsets of the first and the last that may be covered, and that are wholly solid.
    pub(super) all: [i32; 2],
    full: [i32; 2],
    row: SphereRow,
}

impl SphereImage {
    /// The cells of the row at these offsets, in a block of `nx` cells; none if it covers none.
    #[inline(always)]
    pub(super) fn cells(&self, centre: [f64; 3], offset: [i32; 3], nx: i32) -> Option<SphereCells> {
        let from_centre = [f64::from(offset[1]) - centre[1], f64::from(offset[2]) - centre[2]];
        let [all, full] = self.sphere.cells(centre[0], from_centre);
        let all = [all[0].max(offset[0]), all[1].min(nx - 1 + offset[0])];
        (all[0] <= all[1]).then(|| SphereCells {
            all,
            full: [full[0].max(all[0]), full[1].min(all[1])],
            row: self.sphere.row(centre[0], from_centre),
        })
    }
}

impl SphereCells {
    /// Numbers of the cells that may be covered, and of those of them that may be cut.
    #[inline(always)]
    pub(super) fn number(&self) -> [usize; 2] {
        let number = |[first, last]: [i32; 2]| (last + 1 - first).max(0) as usize;
        [number(self.all), number(self.all) - number(self.full)]
    }

    /// Solid fractions of a group of cells, the first of which has the offset `n`, not below that of the first cell.
    #[inline(always)]
    pub(super) fn group<V: Registers>(&self, n: i32) -> [f32; GROUP] {
        let ([_, last], [begin, end]) = (self.all, self.full);
        if n >= begin && n + (GROUP as i32 - 1) <= end {
            return [1.0; GROUP];
        }
        let mut fractions = [0.0; GROUP];
        for lane in (0..GROUP).step_by(V::F::WIDTH) {
            let c = |x: i32| V::F::splat(x as f32);
            // SAFETY: there are more lanes than a register and a group have.
            let n = c(n) + unsafe { V::F::load(f32::LANE.as_ptr().add(lane)) };
            // Numbers of cells are whole and small, so exact.
            let (found, zero, one) = (self.row.fractions(n), V::F::splat(0.0), V::F::splat(1.0));
            let cut = n.if_greater(c(end), found, c(begin).if_greater(n, found, one));
            let cut = n.if_greater(c(last), zero, cut);
            // SAFETY: a register fits into the group from `lane` on.
            unsafe { cut.store(fractions.as_mut_ptr().add(lane)) };
        }
        fractions
    }
}

/// Images of spheres in ascending order of the ids of their bodies, and those that may reach each row of a block.
#[derive(Clone, Debug, Default)]
pub struct SphereRows {
    /// All images.
    pub images: Vec<SphereImage>,
    /// Rows of the block in y.
    rows: usize,
    start: Vec<u32>,
    listed: Vec<u32>,
}

impl SphereRows {
    /// Lists the images anew that may reach each row of a block with `ny, nz` rows, with their centres (cells from their offset 0) up to
    /// `skin` cells away from where they are.
    pub fn list(&mut self, [ny, nz]: [usize; 2], skin: f64, centre: impl Fn(&SphereImage) -> [f64; 3]) {
        self.rows = ny;
        self.start.clear();
        self.start.resize(ny * nz + 1, 0);
        // Counted first, then listed.
        let (images, start) = (&self.images, &mut self.start);
        let each = |visit: &mut dyn FnMut(u32, usize)| {
            for (at, image) in (0..).zip(images) {
                let (reach, centre) = (image.sphere.radius + HALF_DIAGONAL + skin, centre(image));
                let [y, z] = [1, 2].map(|a| f64::from(image.base[a]) + centre[a]);
                let within = |x: f64, half: f64, end: usize| {
                    ceil(x - half).max(0) as usize..(floor(x + half) + 1).clamp(0, end as i32) as usize
                };
                for row_z in within(z, reach, nz) {
                    let rest = reach * reach - (row_z as f64 - z) * (row_z as f64 - z);
                    for row_y in within(y, rest.max(0.0).sqrt(), ny) {
                        visit(at, row_y + ny * row_z);
                    }
                }
            }
        };
        each(&mut |_, row| start[row + 1] += 1);
        let mut sum = 0;
        for start in start.iter_mut() {
            sum += *start;
            *start = sum;
        }
        let listed = &mut self.listed;
        listed.resize(sum as usize, 0);
        each(&mut |at, row| {
            listed[start[row] as usize] = at;
            start[row] += 1;
        });
        // Each start has moved to the end of its row, which is the start of the next.
        start.rotate_right(1);
        start[0] = 0;
    }

    /// Row `row` in y and z.
    #[inline(always)]
    pub(super) fn place(&self, row: usize) -> [i32; 2] {
        [(row % self.rows) as i32, (row / self.rows) as i32]
    }

    /// Images that may reach row `y + ny z`; none before the first [`list`](Self::list).
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> &[u32] {
        match (self.start.get(row), self.start.get(row + 1)) {
            (Some(&first), Some(&end)) => &self.listed[first as usize..end as usize],
            _ => &[],
        }
    }
}
