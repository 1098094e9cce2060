//! Polyhedra whose cells are kept while they move little: listed with a skin, and cut cells grouped by the faces that may reach into them.
//!
//! In each step the fractions alone are found, eight cells at a time, wherever in the body these lie. What is listed changes no bit: cells
//! outside have a fraction of 0, those within 1, and faces that do not reach into a cell do not matter. (Of ellipsoids this does not hold
//! far within, where the iteration for the nearest point is not exact.)

use super::flat::{Face, FlatSurface, LEAST_SKIN, NearFace, alone, together};
use crate::coupling::cover::{RowCells, RowVisitor, Surface, each_row, load, small, store};
use crate::coupling::faces::FacePlane;
use crate::coupling::mapper::{Geometry, Image, Mapper};
use crate::coupling::shift_of_reference;
use crate::domain::{Block, Domain};
use crate::fluid::simd::{Lanes, Registers, Tally, Vectorised, vectorise};
use crate::fluid::{Body, GROUP, RigidMotion, RowSegments, Segment, Simd};
use crate::math::{Quat, Vec3};
use crate::shape::Shape;
use std::sync::Arc;

/// Distance (cells) that a point of a body may move before all cells are listed anew.
const SKIN: f64 = 0.2;
/// Least number of steps within the skin for which cells are kept.
const STEPS: f64 = 3.0;
/// Most faces of a body: one bit of a set each.
const MOST_FACES: usize = u128::BITS as usize;

/// Polyhedra of a block.
#[derive(Default)]
pub(in crate::coupling) struct KeptPolyhedra {
    pub(in crate::coupling) rows: RowSegments,
    /// The bodies when they were listed, in ascending order of ids.
    listed: Vec<Listed>,
    /// Of one body after the other.
    runs: Vec<Run>,
    groups: Vec<Group>,
    /// Faces of each run, in their order.
    faces: Vec<u8>,
    /// Scratch.
    found: Found,
}

/// A body when its cells were listed.
struct Listed {
    id: u64,
    shape: Arc<dyn Shape>,
    shift: f64,
    reference: [i64; 3],
    centre: [f64; 3],
    turn: Quat,
    /// One past its last segment as they were found, and its last run.
    segments: usize,
    runs: usize,
    /// In its segments: index of the body, and shift of the offsets since they were listed.
    body: u32,
    moved: [i32; 3],
    /// Centre and orientation to which the fractions belong.
    found_at: Option<([f64; 3], Quat)>,
}

/// Groups of cells into which the same faces may reach; one past the last group and face.
struct Run {
    groups: usize,
    faces: usize,
}

/// Cut cells: offsets when they were listed, and where their fractions go, 0 if there are fewer cells.
struct Group {
    n: [[f32; GROUP]; 3],
    to: [u32; GROUP],
}

/// A cut cell, and the set of the faces that may reach into it.
type Cell = (u128, [i32; 3], u32);

/// The planes of a body whose cells may be kept.
pub(super) fn planes(mapper: &Mapper) -> Option<&[FacePlane]> {
    match &mapper.geometry {
        Geometry::Flat(planes) if planes.len() <= MOST_FACES => Some(planes),
        _ => None,
    }
}

/// Most (cells) by which the height of a cell above a face, or the reach of the face, changes over the angle by which the body turns: the
/// radius of a sphere around its cells, and more.
fn reach(mapper: &Mapper) -> f64 {
    mapper.shape.circumradius() * mapper.per_dx + 4.0
}

impl KeptPolyhedra {
    /// Returns true if it pays to keep the cells of bodies as fast as these.
    pub(in crate::coupling) fn pays<'a>(mut polyhedra: impl Iterator<Item = &'a Mapper>) -> bool {
        let slow = |mapper: &Mapper| {
            let RigidMotion { velocity, angular, .. } = mapper.motion;
            STEPS * (Vec3::from(velocity).norm() + reach(mapper) * Vec3::from(angular).norm()) < SKIN
        };
        polyhedra.all(slow)
    }

    /// Moves to the present `polyhedra`, with the indices of their bodies, in ascending order of ids.
    pub(in crate::coupling) fn update(
        &mut self,
        polyhedra: &[(u32, &Mapper)],
        bodies: &[Body],
        domain: &Domain,
        block: Block,
        simd: Simd,
    ) {
        if !self.moved_little(polyhedra, bodies, domain, block) {
            self.list(polyhedra, bodies, domain, block, simd);
        }
        vectorise(simd, Evaluate { kept: self, polyhedra, bodies });
    }

    /// Tells the segments where the bodies are now; returns false if cells have to be listed anew.
    fn moved_little(
        &mut self,
        polyhedra: &[(u32, &Mapper)],
        bodies: &[Body],
        domain: &Domain,
        block: Block,
    ) -> bool {
        let (mut first, mut changed) = (0, false);
        // Of each body of the segments.
        let mut changes =
            vec![(0, [0; 3]); self.listed.iter().map(|of| of.body as usize + 1).max().unwrap_or(0)];
        let mut before = self.listed.iter_mut().peekable();
        for &(index, mapper) in polyhedra {
            let body = &bodies[index as usize];
            while let Some(gone) = before.next_if(|listed| listed.id < body.id) {
                if gone.segments > first {
                    return false;
                }
            }
            let Some(listed) = before.next_if(|listed| listed.id == body.id) else {
                // Looked for in every step as long as it has no cells.
                if !images_of(mapper, body, index, domain, block).is_empty() {
                    return false;
                }
                continue;
            };
            let has_cells = listed.segments > first;
            first = listed.segments;
            let shift = shift_of_reference(listed.reference, body.reference, domain);
            // Those that go through the box cover the cells along it from a certain offset on.
            if mapper.shape.passage().is_some_and(|passage| shift[passage.axis] != 0) {
                return false;
            }
            let moved = Vec3::from_fn(|a, _| (body.motion.centre[a] - listed.centre[a]) - shift[a] as f64);
            let turn = mapper.orientation * listed.turn.inverse();
            let farthest = moved.norm() + 2.0 * turn.imag().norm() * reach(mapper);
            // Not a number is far, too.
            let is_near = farthest < SKIN;
            if !is_near
                || !Arc::ptr_eq(&mapper.shape, &listed.shape)
                || mapper.shift.to_bits() != listed.shift.to_bits()
            {
                return false;
            }
            let shift = shift.map(|n| n as i32);
            if has_cells {
                changes[listed.body as usize] = (index, std::array::from_fn(|a| shift[a] - listed.moved[a]));
                changed |= listed.body != index || listed.moved != shift;
            }
            (listed.body, listed.moved) = (index, shift);
        }
        if before.any(|gone| gone.segments > first) {
            return false;
        }
        if changed {
            self.rows.renumber(&changes);
        }
        true
    }

    fn list(
        &mut self,
        polyhedra: &[(u32, &Mapper)],
        bodies: &[Body],
        domain: &Domain,
        block: Block,
        simd: Simd,
    ) {
        self.listed.clear();
        self.runs.clear();
        self.groups.clear();
        self.faces.clear();
        let mut found = std::mem::take(&mut self.found);
        found.added.clear();
        // Fractions begin after one that no cell has.
        found.cut = 1;
        for &(index, mapper) in polyhedra {
            let Some(planes) = planes(mapper) else { continue };
            let body = &bodies[index as usize];
            found.cells.clear();
            for image in images_of(mapper, body, index, domain, block) {
                vectorise(simd, ListImage { found: &mut found, mapper, planes, image });
            }
            self.group(&mut found.cells);
            self.listed.push(Listed {
                id: body.id,
                shape: mapper.shape.clone(),
                shift: mapper.shift,
                reference: body.reference,
                centre: body.motion.centre,
                turn: mapper.orientation,
                segments: found.added.len(),
                runs: self.runs.len(),
                body: index,
                moved: [0; 3],
                found_at: None,
            });
        }
        let ([_, ny, nz], mut fractions) = (block.size(), self.rows.clear());
        fractions.resize(found.cut as usize, 0.0);
        self.rows.sort(ny * nz, &found.added, fractions);
        self.found = found;
    }

    /// Groups the cut cells of a body. The last ones of similar sets share a group.
    fn group(&mut self, cells: &mut [Cell]) {
        cells.sort_unstable_by_key(|(set, ..)| *set);
        let (mut shared, mut rest) = (0_u128, Vec::<Cell>::new());
        for same in cells.chunk_by(|a, b| a.0 == b.0) {
            let set = same[0].0;
            let (whole, last) = same.split_at(same.len() / GROUP * GROUP);
            self.push(set, whole);
            let most = shared.count_ones().max(set.count_ones()) + 1;
            if rest.len() + last.len() > GROUP || (shared | set).count_ones() > most {
                self.push(shared, &rest);
                rest.clear();
                shared = 0;
            }
            if !last.is_empty() {
                shared |= set;
                rest.extend(last);
            }
        }
        self.push(shared, &rest);
    }

    /// Adds a run.
    fn push(&mut self, set: u128, cells: &[Cell]) {
        if cells.is_empty() {
            return;
        }
        for cells in cells.chunks(GROUP) {
            let mut group = Group { n: [[0.0; GROUP]; 3], to: [0; GROUP] };
            for (k, (_, n, to)) in cells.iter().enumerate() {
                group.to[k] = *to;
                for (all, n) in group.n.iter_mut().zip(n) {
                    all[k] = *n as f32;
                }
            }
            self.groups.push(group);
        }
        self.faces.extend((0..MOST_FACES as u8).filter(|face| set >> face & 1 == 1));
        self.runs.push(Run { groups: self.groups.len(), faces: self.faces.len() });
    }
}

/// Periodic images of a body that reach the block, or would within the skin.
fn images_of(mapper: &Mapper, body: &Body, index: u32, domain: &Domain, block: Block) -> Vec<Image> {
    let mut images = Vec::new();
    mapper.each_image(domain, block, body.reference, index, SKIN + LEAST_SKIN, |image| {
        images.push(image.clone());
    });
    images
}

/// Cells, as they are found.
#[derive(Default)]
struct Found {
    added: Vec<(u32, Segment)>,
    /// Cut cells of the present body.
    cells: Vec<Cell>,
    /// Number of fractions.
    cut: u32,
}

impl RowVisitor<FlatSurface<'_>> for Found {
    #[inline(always)]
    fn visit<V: Registers>(&mut self, surface: &mut FlatSurface, image: &Image, row: &RowCells) {
        let &RowCells { first, last, begin, end, offsets: [ny, nz], from_centre: [y, z] } = row;
        let segment = Segment {
            body: image.body,
            x: (i64::from(first) + image.base[0]) as u32,
            count: small(last + 1 - first),
            head: small(begin - first),
            tail: small(last + 1 - end),
            offset: [first, ny as i32, nz as i32],
            cut: self.cut,
        };
        self.added.push((image.row(row.offsets), segment));
        if begin == first && end > last {
            return;
        }
        surface.enter_row::<V>(y, z, first, last);
        for n in (first..begin).chain(end..=last) {
            let set = surface.set_of(n);
            self.cells.push((set, [n, ny as i32, nz as i32], self.cut));
            self.cut += 1;
        }
    }
}

/// Work of [`KeptPolyhedra::list`].
struct ListImage<'a> {
    found: &'a mut Found,
    mapper: &'a Mapper,
    planes: &'a [FacePlane],
    image: Image,
}

impl Vectorised for ListImage<'_> {
    #[inline(always)]
    fn run<V: Registers>(self) {
        let surface = FlatSurface::new(self.mapper, self.planes, SKIN + LEAST_SKIN);
        each_row::<V, _, _>(self.found, surface, self.mapper, &self.image);
    }
}

/// Writes the fractions of all cells.
struct Evaluate<'a> {
    kept: &'a mut KeptPolyhedra,
    polyhedra: &'a [(u32, &'a Mapper)],
    bodies: &'a [Body],
}

impl Vectorised for Evaluate<'_> {
    #[inline(always)]
    fn run<V: Registers>(self) {
        let KeptPolyhedra { rows, listed, runs, groups, faces: of_runs, .. } = self.kept;
        let (mut of_body, fractions) = (Vec::new(), rows.fractions());
        let (mut first, mut present) = (0, self.polyhedra.iter());
        for listed in listed {
            let own = first..listed.runs;
            first = listed.runs;
            if own.is_empty() {
                continue;
            }
            let of = |(index, _): &&(u32, &Mapper)| self.bodies[*index as usize].id == listed.id;
            let (_, mapper) = present.find(of).expect("a body with cells is present");
            let place = (mapper.motion.centre, mapper.orientation);
            if listed.found_at.replace(place) == Some(place) {
                continue;
            }
            of_body.clear();
            of_body.extend(planes(mapper).into_iter().flatten().map(Face::new));
            let before = own.start.checked_sub(1).map(|last| &runs[last]);
            let (mut group, mut face) = before.map_or((0, 0), |run| (run.groups, run.faces));
            for run in &runs[own] {
                let near = &of_runs[face..run.faces];
                for group in &groups[group..run.groups] {
                    let of_group = group.fractions::<V>(&of_body, near, &mapper.motion, listed.moved);
                    for (to, fraction) in group.to.iter().zip(of_group) {
                        fractions[*to as usize] = fraction;
                    }
                }
                (group, face) = (run.groups, run.faces);
            }
        }
    }
}

impl Group {
    /// Solid fractions of its cells in a body with these faces, those into which these are `near`, its offsets having `moved`.
    #[inline(always)]
    fn fractions<V: Registers>(
        &self,
        faces: &[Face],
        near: &[u8],
        motion: &RigidMotion,
        moved: [i32; 3],
    ) -> [f32; GROUP] {
        let of = |a: usize| from_centre::<V>(&self.n[a], moved[a], motion.centre[a]);
        let (y, z, centre) = (of(1), of(2), motion.centre[0] as f32);
        let mut fractions = [0.0; GROUP];
        for at in (0..GROUP).step_by(V::F::WIDTH) {
            let c = |x: f32| V::F::splat(x);
            let x = (load::<f32, V::F>(&self.n[0], at) + c(moved[0] as f32)) - c(centre);
            let (y, z) = (load::<f32, V::F>(&y, at), load::<f32, V::F>(&z, at));
            let rest = |&face: &u8| NearFace { face: face.into(), rest: faces[usize::from(face)].rest(y, z) };
            if let Some(some) = together(faces, near.iter().map(rest), x) {
                store(&mut fractions, at, some);
            } else {
                return self.alone::<V>(faces, near, [&of(1), &of(2)], moved[0], centre);
            }
        }
        fractions
    }

    /// The same, cell by cell.
    #[inline(always)]
    fn alone<V: Registers>(
        &self,
        faces: &[Face],
        near: &[u8],
        [y, z]: [&[f32; GROUP]; 2],
        moved: i32,
        centre: f32,
    ) -> [f32; GROUP] {
        std::array::from_fn(|k| {
            let rest =
                |&face: &u8| NearFace { face: face.into(), rest: faces[usize::from(face)].rest(y[k], z[k]) };
            let near: Vec<NearFace> = near.iter().map(rest).collect();
            alone::<V::F>(faces, &near, (self.n[0][k] + moved as f32) - centre)
        })
    }
}

/// Distances of cells with the offsets `n + moved` from the centre, rounded once.
#[inline(always)]
fn from_centre<V: Registers>(n: &[f32; GROUP], moved: i32, centre: f64) -> [f32; GROUP] {
    let mut distances = [0.0; GROUP];
    for at in (0..GROUP).step_by(V::D::WIDTH) {
        // SAFETY: a register fits into the group from `at` on.
        unsafe {
            let n = V::D::widen(n.as_ptr().add(at)) + V::D::splat(moved.into());
            (n - V::D::splat(centre)).narrow(distances.as_mut_ptr().add(at));
        }
    }
    distances
}

#[cfg(test)]
mod tests;
