//! The cells that a body covers, row by row, and the solid fractions of those that its surface cuts.
//!
//! A row of cells through a convex body has cut cells (`head`), solid ones, and cut cells (`tail`). The cut ones of both ends
//! are evaluated side by side, [`GROUP`] at a time and without branches.

use super::mapper::{Image, Mapper};
use crate::fluid::simd::{Lanes, Registers, Vectorised, vectorise};
use crate::fluid::{GROUP, Real, RowSegments, Segment, Simd};
use crate::math::{ROUND, Vec3};

/// Covered cells, as they are found.
#[derive(Default)]
pub(super) struct Cover {
    /// Rows `y + ny z` of the block, and segments in them.
    pub(super) added: Vec<(u32, Segment)>,
    /// Solid fractions of cut cells.
    pub(super) cut: Vec<f32>,
}

/// [`Cover::add`].
struct AddImage<'a, S> {
    cover: &'a mut Cover,
    surface: S,
    mapper: &'a Mapper,
    image: &'a Image,
}

impl<S: Surface> Vectorised for AddImage<'_, S> {
    #[inline(always)]
    fn run<V: Registers>(self) {
        each_row::<V, _, _>(self.cover, self.surface, self.mapper, self.image);
    }
}

/// Offsets of cells in [`GROUP`] rows: the first and the last that may be covered, and that are wholly solid; none if they cross.
pub(super) struct Rows {
    pub(super) all: [[i32; GROUP]; 2],
    pub(super) full: [[i32; GROUP]; 2],
}

/// Bounds (cells from the centre) of what is covered in [`GROUP`] rows, and of what is wholly solid; nothing if they cross.
pub(super) struct Intervals {
    pub(super) outer: [[f64; GROUP]; 2],
    pub(super) inner: [[f64; GROUP]; 2],
}

impl Intervals {
    /// The cells whose centres are within.
    #[inline(always)]
    pub(super) fn rows<V: Registers>(&self, centre: f64) -> Rows {
        let mut rows = Rows { all: [[0; GROUP]; 2], full: [[0; GROUP]; 2] };
        for ([first, last], [low, high]) in [(&mut rows.all, &self.outer), (&mut rows.full, &self.inner)] {
            let (mut up, mut down) = ([0.0; GROUP], [0.0; GROUP]);
            for at in (0..GROUP).step_by(V::D::WIDTH) {
                let (round, one, centre) = (V::D::splat(ROUND), V::D::splat(1.0), V::D::splat(centre));
                let (low, high) = (load::<f64, V::D>(low, at) + centre, load::<f64, V::D>(high, at) + centre);
                let (above, below) = (low + round, high + round);
                store(&mut up, at, low.if_greater(above - round, above + one, above));
                store(&mut down, at, (below - round).if_greater(high, below - one, below));
            }
            for k in 0..GROUP {
                (first[k], last[k]) = (up[k].to_bits() as i32, down[k].to_bits() as i32);
            }
        }
        rows
    }
}

/// Surface of a body on the lattice, lengths in cells from its centre.
pub(super) trait Surface {
    /// The cells of the rows at `y` in the layer `z`: at least those of non-zero fraction, and only such of fraction one.
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows;

    /// Prepares for the row at `y, z`, of which the cells with offsets from `first` to `last` may be covered.
    fn enter_row<V: Registers>(&mut self, _y: f64, _z: f64, _first: i32, _last: i32) {}

    /// Solid fractions of the cells of the row with the offsets `n`.
    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP];
}

/// The register of numbers that begins at `at`.
#[inline(always)]
pub(super) fn load<T, R: Lanes<T>>(values: &[T], at: usize) -> R {
    assert!(at + R::WIDTH <= values.len());
    // SAFETY: just checked.
    unsafe { R::load(values.as_ptr().add(at)) }
}

/// Writes a register to numbers from `at` on.
#[inline(always)]
pub(super) fn store<T, R: Lanes<T>>(values: &mut [T], at: usize, register: R) {
    assert!(at + R::WIDTH <= values.len());
    // SAFETY: just checked.
    unsafe { register.store(values.as_mut_ptr().add(at)) };
}

/// Cells of a row that an image may cover.
pub(super) struct RowCells {
    /// Offsets of the first and the last.
    pub(super) first: i32,
    pub(super) last: i32,
    /// The solid cells are `begin .. end`; if there are none, both are one past the last.
    pub(super) begin: i32,
    pub(super) end: i32,
    /// Of the row in y and z, and distances from the centre.
    pub(super) offsets: [i64; 2],
    pub(super) from_centre: [f64; 2],
}

/// Work on the rows of an image; must be inlined always.
pub(super) trait RowVisitor<S> {
    /// Works on the cells of a row, at least one.
    fn visit<V: Registers>(&mut self, surface: &mut S, image: &Image, row: &RowCells);
}

/// Visits the rows of an image of a body in which it may cover cells.
#[inline(always)]
pub(super) fn each_row<V: Registers, S: Surface, R: RowVisitor<S>>(
    visitor: &mut R,
    mut surface: S,
    mapper: &Mapper,
    image: &Image,
) {
    let [_, cy, cz] = mapper.motion.centre;
    let [xs, ys, zs] = &image.offsets;
    let (low, high) = (*xs.start() as i32, *xs.end() as i32);
    for nz in zs.clone() {
        let z = nz as f64 - cz;
        for ny in ys.clone().step_by(GROUP) {
            let mut y = [0.0; GROUP];
            for k in 0..GROUP {
                y[k] = (ny + k as i64) as f64 - cy;
            }
            let rows = surface.rows::<V>(&y, z);
            for k in 0..GROUP {
                let (first, last) = (rows.all[0][k].max(low), rows.all[1][k].min(high));
                if first > last || ny + k as i64 > *ys.end() {
                    continue;
                }
                let (begin, end) = (rows.full[0][k].max(first), rows.full[1][k].min(last) + 1);
                let (begin, end) = if begin < end { (begin, end) } else { (last + 1, last + 1) };
                let (offsets, from_centre) = ([ny + k as i64, nz], [y[k], z]);
                let row = RowCells { first, last, begin, end, offsets, from_centre };
                visitor.visit::<V>(&mut surface, image, &row);
            }
        }
    }
}

/// Number of cells of a row of a body.
pub(super) fn small(n: impl TryInto<u16>) -> u16 {
    n.try_into().ok().expect("a body less than 65,536 cells long")
}

impl Cover {
    /// Begins anew, with the memory of segments that are no longer needed.
    pub(super) fn begin(&mut self, former: &mut RowSegments) {
        self.added.clear();
        self.cut = former.clear();
    }

    /// Adds the cells of a periodic image of a body, with the instructions `simd`; they do not change a bit.
    pub(super) fn add<S: Surface>(&mut self, surface: S, mapper: &Mapper, image: &Image, simd: Simd) {
        vectorise(simd, AddImage { cover: self, surface, mapper, image });
    }

    /// Joins the segments of the parts of one body, that of each from `found` on, where those of one image share cells: there the body is one,
    /// with the [union] of its parts. So nothing is counted twice, and parts have no film between them.
    pub(super) fn join(&mut self, found: &[usize], parts: &[(u32, Mapper)]) {
        let first = found[0];
        let part_of = |at: usize| found.partition_point(|begin| *begin <= at) - 1;
        let mut all: Vec<(usize, (u32, Segment))> =
            self.added.split_off(first).into_iter().zip(first..).map(|(of, at)| (part_of(at), of)).collect();
        let image_of = |(_, (row, Segment { x, offset: [nx, ny, nz], .. })): &(usize, (u32, Segment))| {
            (*row, i64::from(*x) - i64::from(*nx), *ny, *nz)
        };
        all.sort_by_key(|of| (image_of(of), of.1.1.x));
        let mut rest = &mut all[..];
        while let [(_, (row, first)), ..] = rest {
            let (row, first) = (*row, *first);
            let (mut end, mut count, image) = (first.end(), 1, image_of(&rest[0]));
            while let Some((_, (_, next))) =
                rest.get(count).filter(|of| image_of(of) == image && of.1.1.x < end)
            {
                end = end.max(next.end());
                count += 1;
            }
            let (together, others) = rest.split_at_mut(count);
            rest = others;
            if count == 1 {
                self.added.push((row, first));
                continue;
            }
            // In the order of the parts, whatever of them is in this block.
            together.sort_by_key(|(part, _)| *part);
            let mut fractions = vec![0.0_f32; (end - first.x) as usize];
            let mut cell = Vec::new();
            for (x, fraction) in (first.x..end).zip(&mut fractions) {
                cell.clear();
                let holds =
                    together.iter().filter(|(_, (_, segment))| (segment.x..segment.end()).contains(&x));
                let fractions_of = holds.map(|(part, (_, segment))| {
                    let cut = &self.cut[segment.cut as usize..];
                    (&parts[*part].1, segment.fraction(cut, (x - segment.x) as usize))
                });
                // What is listed without being covered depends on the block.
                cell.extend(fractions_of.filter(|(_, fraction)| *fraction > 0.0));
                let [nx, ny, nz] = first.offset.map(i64::from);
                *fraction = union(&cell, [nx + i64::from(x - first.x), ny, nz]);
            }
            let head = fractions.iter().take_while(|fraction| **fraction < 1.0).count();
            let solid = fractions[head..].iter().take_while(|fraction| **fraction >= 1.0).count();
            let joined = Segment {
                count: small(fractions.len()),
                head: small(head),
                tail: small(fractions.len() - head - solid),
                cut: self.cut.len() as u32,
                ..first
            };
            self.cut.extend(&fractions[..head]);
            self.cut.extend(&fractions[head + solid..]);
            self.added.push((row, joined));
        }
    }
}

/// Sub-cells along each axis in which the fraction that parts share is evaluated.
const SUB: u32 = 4;

/// Solid fraction of a cell at an offset that these parts of a body cover with their own fractions: their sum, without what each shares with those
/// before it,
///
/// ```text
/// max_i f_i <= sum_i f_i - mean of sum_i g_i (1 - prod_j (1 - g_j)) <= 1,   j before i, that overlap with it
/// ```
///
/// where the mean is over sub-cells with the fractions `g`, by a plane through each surface.
fn union(parts: &[(&Mapper, f32)], offset: [i64; 3]) -> f32 {
    let sum: f32 = parts.iter().map(|(_, fraction)| fraction).sum();
    let most = parts.iter().map(|(_, fraction)| *fraction).fold(0.0, f32::max);
    let share = |n: usize, k: usize| parts[n].0.shares(parts[k].0);
    if most >= 1.0 || !(1..parts.len()).any(|n| (0..n).any(|k| share(n, k))) {
        return sum.min(1.0);
    }
    let planes: Vec<(f64, Vec3)> = parts.iter().map(|(part, _)| part.plane(offset)).collect();
    let per_cell = f64::from(SUB);
    let at = |k: u32| (f64::from(k) + 0.5) / per_cell - 0.5;
    let mut twice = 0.0;
    for k in 0..SUB * SUB * SUB {
        let point = Vec3::new(at(k % SUB), at(k / SUB % SUB), at(k / (SUB * SUB)));
        let below = |n: usize| {
            let (height, normal) = planes[n];
            (0.5 - per_cell * (height + normal.dot(&point))).clamp(0.0, 1.0)
        };
        for n in 1..parts.len() {
            let own = below(n);
            if own > 0.0 {
                let before = (0..n).filter(|&k| share(n, k)).map(|k| 1.0 - below(k));
                twice += own * (1.0 - before.product::<f64>());
            }
        }
    }
    let twice = twice / (per_cell * per_cell * per_cell);
    (sum - twice as f32).max(most).min(1.0)
}

impl<S: Surface> RowVisitor<S> for Cover {
    #[inline(always)]
    fn visit<V: Registers>(&mut self, surface: &mut S, image: &Image, row: &RowCells) {
        let &RowCells { first, last, begin, end, offsets: [ny, nz], from_centre: [y, z] } = row;
        let (start, mut head, mut tail) = (self.cut.len(), begin - first, last + 1 - end);
        let (mut first, mut before) = (first, 0);
        if head + tail > 0 {
            surface.enter_row::<V>(y, z, first, last);
            // Exact: offsets are small whole numbers.
            let c = |x: f32| V::F::splat(x);
            let (origin, gap, in_head) = (c(first as f32), c((end - begin) as f32), c(head as f32));
            let mut done = 0;
            while done < head + tail {
                let mut n = [0.0; GROUP];
                for at in (0..GROUP).step_by(V::F::WIDTH) {
                    // SAFETY: there are more lanes than a register and a group have.
                    let lanes = unsafe { V::F::load(f32::LANE.as_ptr().add(at)) } + c(done as f32);
                    store(&mut n, at, origin + (lanes + in_head.if_greater(lanes, c(0.0), gap)));
                }
                self.cut.extend_from_slice(&surface.fractions::<V>(&n, y, z));
                done += GROUP as i32;
            }
            self.cut.truncate(start + (head + tail) as usize);
            // Without the outermost cells if nothing of them is covered, which is common; without a branch, as it is random.
            let all = &self.cut[start..];
            let front = i32::from(all[0] == 0.0 && head > 0);
            (before, head, first) = (front as usize, head - front, first + front);
            let back = i32::from(all[all.len() - 1] == 0.0 && (tail > 0 || (begin == end && head > 0)));
            let of_tail = i32::from(tail > 0) * back;
            (tail, head) = (tail - of_tail, head - (back - of_tail));
        }
        let count = head + (end - begin) + tail;
        if count == 0 {
            return;
        }
        let segment = Segment {
            body: image.body,
            x: (i64::from(first) + image.base[0]) as u32,
            count: small(count),
            head: small(head),
            tail: small(tail),
            offset: [first, ny as i32, nz as i32],
            cut: (start + before) as u32,
        };
        self.added.push((image.row(row.offsets), segment));
    }
}
