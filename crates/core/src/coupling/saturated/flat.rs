//! Volume fractions of cells that flat faces cut: up to [`MEETING`] of them in a cell one after the other, more along lines.

use crate::coupling::cover::{Intervals, Rows, Surface, load, store};
use crate::coupling::faces::FacePlane;
use crate::coupling::mapper::Mapper;
use crate::fluid::GROUP;
use crate::fluid::simd::{Choose, Lanes, Registers};
use crate::fluid::volume_fraction::{Normal, behind_both};

/// A body with flat faces.
pub(super) struct FlatSurface<'a> {
    mapper: &'a Mapper,
    planes: &'a [FacePlane],
    /// Distance (cells) by which cells beyond its reach count as cut by a face, too: their fractions say what they are.
    skin: f64,
    /// The same in single precision, and [`GROUP`] side by side; those that are none reach nowhere.
    faces: Vec<Face>,
    groups: Vec<PlaneGroup>,
    /// Faces that may reach into cells of the present row, in their order.
    near: Vec<NearFace>,
}

/// Least skin: more than an error of rounding, so that single precision alone decides which cells are cut, for any larger skin alike.
pub(in crate::coupling) const LEAST_SKIN: f64 = 1e-3;

/// [`GROUP`] planes, see [`FacePlane`].
#[derive(Clone, Copy)]
struct PlaneGroup {
    normal: [[f32; GROUP]; 3],
    offset: [f32; GROUP],
    reach: [f32; GROUP],
}

/// A face: unit normal, distance from the centre, and the largest height above it at which the centre of a cell may lie that it cuts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    normal: [f32; 3],
    offset: f32,
    reach: f32,
    volume: Normal<f32>,
}

impl Face {
    pub(super) fn new(plane: &FacePlane) -> Self {
        let normal = plane.normal.map(|n| n as f32);
        let (offset, reach) = (plane.rest(0.0, 0.0) as f32, plane.reach as f32);
        Self { normal, offset, reach, volume: Normal::unit(normal) }
    }

    /// Remainder of the offset for `n_x x` of cells at `y, z` from the centre.
    #[inline(always)]
    pub(super) fn rest<R: Choose<f32>>(&self, y: R, z: R) -> R {
        R::splat(self.offset) - (R::splat(self.normal[1]) * y + R::splat(self.normal[2]) * z)
    }
}

/// A face that may reach into cells: its index, and what remains of their height `n_x x - rest` above it, alike in a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearFace<R = f32> {
    pub(super) face: u32,
    pub(super) rest: R,
}

impl NearFace {
    /// The same for all lanes.
    #[inline(always)]
    fn splat<R: Choose<f32>>(self) -> NearFace<R> {
        NearFace { face: self.face, rest: R::splat(self.rest) }
    }
}

impl<R: Choose<f32>> NearFace<R> {
    /// Heights above it of the cells at `x`.
    #[inline(always)]
    fn height(self, faces: &[Face], x: R) -> R {
        R::splat(faces[self.face as usize].normal[0]) * x - self.rest
    }
}

/// Cosine between normals.
#[inline(always)]
fn cosine(a: &Face, b: &Face) -> f32 {
    (a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1]) + a.normal[2] * b.normal[2]
}

impl<'a> FlatSurface<'a> {
    pub(super) fn new(mapper: &'a Mapper, planes: &'a [FacePlane], skin: f64) -> Self {
        let none = PlaneGroup { normal: [[0.0; GROUP]; 3], offset: [FAR as f32; GROUP], reach: [0.0; GROUP] };
        let mut groups = vec![none; planes.len().div_ceil(GROUP)];
        for (at, plane) in planes.iter().enumerate() {
            let (group, k) = (&mut groups[at / GROUP], at % GROUP);
            for axis in 0..3 {
                group.normal[axis][k] = plane.normal[axis] as f32;
            }
            (group.offset[k], group.reach[k]) = (plane.rest(0.0, 0.0) as f32, (plane.reach + skin) as f32);
        }
        let faces = planes.iter().map(Face::new).collect();
        Self { mapper, planes, skin, faces, groups, near: Vec::with_capacity(planes.len()) }
    }

    /// The set of those of the first 128 faces that may reach into the cell of the row with this offset.
    #[inline(always)]
    pub(super) fn set_of(&self, n: i32) -> u128 {
        let (x, skin) = (n as f32 - self.mapper.motion.centre[0] as f32, self.skin as f32);
        let mut set = 0;
        for near in &self.near {
            let is_near = near.height(&self.faces, x) > -(self.faces[near.face as usize].reach + skin);
            set |= u128::from(is_near) << near.face;
        }
        set
    }
}

impl Surface for FlatSurface<'_> {
    /// Cells are wholly solid if no face reaches into them, nor would within the skin.
    #[inline(always)]
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        let mut found = Intervals { outer: [[0.0; GROUP]; 2], inner: [[0.0; GROUP]; 2] };
        for at in (0..GROUP).step_by(V::D::WIDTH) {
            let (y, c) = (load::<f64, V::D>(y, at), |x: f64| V::D::splat(x));
            // Bounded, so that they are whole numbers.
            let ([mut outer_low, mut outer_high], [mut inner_low, mut inner_high]) =
                ([c(-FAR), c(FAR)], [c(-FAR), c(FAR)]);
            for plane in self.planes {
                let rest = c(plane.rest(0.0, z)) - c(plane.normal[1]) * y;
                let reach = plane.reach + self.skin;
                let (x, more) = (rest * c(plane.slope), c(reach * plane.slope));
                if plane.slope > 0.0 {
                    outer_high = outer_high.min(x + more);
                    inner_high = inner_high.min(x - more);
                } else if plane.slope < 0.0 {
                    outer_low = outer_low.max(x + more);
                    inner_low = inner_low.max(x - more);
                } else {
                    outer_high = rest.if_greater(c(-reach), outer_high, c(-FAR));
                    inner_high = c(reach).if_greater(rest, c(-FAR), inner_high);
                }
            }
            store(&mut found.outer[0], at, outer_low.min(c(FAR)));
            store(&mut found.outer[1], at, outer_high.max(c(-FAR)));
            store(&mut found.inner[0], at, inner_low.min(c(FAR)));
            store(&mut found.inner[1], at, inner_high.max(c(-FAR)));
        }
        found.rows::<V>(self.mapper.motion.centre[0])
    }

    #[inline(always)]
    fn enter_row<V: Registers>(&mut self, y: f64, z: f64, first: i32, last: i32) {
        let centre = self.mapper.motion.centre[0] as f32;
        let (first, last, y, z) = (first as f32 - centre, last as f32 - centre, y as f32, z as f32);
        self.near.clear();
        let c = |x: f32| V::F::splat(x);
        for (first_face, group) in (0_u32..).step_by(GROUP).zip(&self.groups) {
            let (mut rests, mut above, mut any) = ([0.0; GROUP], [0.0; GROUP], false);
            for at in (0..GROUP).step_by(V::F::WIDTH) {
                let of = |values: &[f32; GROUP]| load::<f32, V::F>(values, at);
                let [nx, ny, nz] = [of(&group.normal[0]), of(&group.normal[1]), of(&group.normal[2])];
                let rest = of(&group.offset) - (ny * c(y) + nz * c(z));
                let most = (nx * c(first)).max(nx * c(last)) - rest + of(&group.reach);
                any |= most.any_greater(c(0.0));
                store(&mut rests, at, rest);
                store(&mut above, at, most);
            }
            if any {
                for k in (0..GROUP).filter(|&k| above[k] > 0.0) {
                    self.near.push(NearFace { face: first_face + k as u32, rest: rests[k] });
                }
            }
        }
    }

    #[inline(always)]
    fn fractions<V: Registers>(&self, n: &[f32; GROUP], _: f64, _: f64) -> [f32; GROUP] {
        let centre = V::F::splat(self.mapper.motion.centre[0] as f32);
        let mut fractions = [0.0; GROUP];
        for at in (0..GROUP).step_by(V::F::WIDTH) {
            let x = load::<f32, V::F>(n, at) - centre;
            if let Some(some) = together(&self.faces, self.near.iter().map(|near| near.splat()), x) {
                store(&mut fractions, at, some);
            } else {
                for k in at..at + V::F::WIDTH {
                    fractions[k] =
                        alone::<V::F>(&self.faces, &self.near, n[k] - self.mapper.motion.centre[0] as f32);
                }
            }
        }
        fractions
    }
}

/// Farther than any cell of a box (cells).
const FAR: f64 = 1e9;

/// Most faces that reach into the same [`GROUP`] of cells to be evaluated together.
pub(super) const MEETING: usize = 12;

/// Volume fractions behind all faces of the cells with their centres at `x` (cells, from the centre of the body), or none if more faces
/// meet there than can be evaluated together. Each is combined with the fraction behind the previous ones, at the cosine to the most
/// similar of them. Faces that are `near` but reach into none of the cells do not change a bit.
#[inline(always)]
pub(super) fn together<R: Choose<f32>>(
    faces: &[Face],
    near: impl Iterator<Item = NearFace<R>>,
    x: R,
) -> Option<R> {
    let c = |x: f32| R::splat(x);
    let (mut fraction, mut outside) = (c(1.0), c(0.0));
    // Faces before that reach into some of the cells, and how high these are above them.
    let (mut met, mut count) = ([(0, c(0.0)); MEETING], 0);
    for near in near {
        let face = &faces[near.face as usize];
        let (height, reach) = (near.height(faces, x), c(face.reach));
        let depth = c(-face.reach);
        if !height.any_greater(depth) {
            continue;
        }
        if count == MEETING {
            return None;
        }
        outside = reach.if_greater(height, outside, c(1.0));
        let mut most_like = c(-1.0);
        for (other, above) in &met[..count] {
            let other = &faces[*other];
            let cosine = cosine(face, other);
            // Where both reach into the cell.
            let common = (height - depth).min(*above + c(other.reach));
            most_like = common.if_greater(c(0.0), most_like.max(c(cosine)), most_like);
            let beyond = common.min(beyond_edge(height, *above, cosine));
            outside = beyond.if_greater(c(0.0), c(1.0), outside);
        }
        let behind = face.volume.splat::<R>().behind(height);
        let both = behind_both(fraction, behind, most_like);
        let next = c(1.0).if_greater(fraction, both, behind);
        fraction = height.if_greater(depth, next, fraction);
        met[count] = (near.face as usize, height);
        count += 1;
    }
    Some(outside.if_greater(c(0.0), c(0.0), fraction))
}

/// Volume fraction of one cell, with the bits of [`together`] unless too many faces meet in it for that.
#[inline(always)]
pub(super) fn alone<R: Choose<f32>>(faces: &[Face], near: &[NearFace], x: f32) -> f32 {
    let (mut count, mut deepest) = (0, (f32::NEG_INFINITY, None));
    for this in near {
        let (reach, height) = (faces[this.face as usize].reach, this.height(faces, x));
        if height >= reach {
            return 0.0;
        }
        count += usize::from(height > -reach);
        if height + reach > deepest.0 {
            deepest = (height + reach, Some(*this));
        }
    }
    if let Some(deepest) = deepest.1.filter(|_| count > MEETING) {
        return along_lines::<R>(faces, near, deepest, x);
    }
    let mut fraction = 1.0;
    for (at, this) in near.iter().enumerate() {
        let (face, height) = (&faces[this.face as usize], this.height(faces, x));
        if height > -face.reach {
            let mut most_like = -1.0;
            for other in &near[..at] {
                let (other, above) = (&faces[other.face as usize], other.height(faces, x));
                if above + other.reach > 0.0 && height + face.reach > 0.0 {
                    let cosine = cosine(face, other);
                    if beyond_edge(height, above, cosine) > 0.0 {
                        return 0.0;
                    }
                    most_like = if cosine > most_like { cosine } else { most_like };
                }
            }
            let behind = face.volume.behind(height);
            fraction = if fraction < 1.0 { behind_both(fraction, behind, most_like) } else { behind };
        }
    }
    fraction
}

/// The first of the longest components.
fn longest(v: [f32; 3]) -> usize {
    let [x, y, z] = v.map(f32::abs);
    let (length, axis) = if y > x { (y, 1) } else { (x, 0) };
    if z > length { 2 } else { axis }
}

/// Lines through a cell along which many faces cut it.
const LINES: usize = 32;
/// Their offsets from the middle of the cell, across them: the lattice (k, 7 k modulo 32) / 32, so that no two lie alike.
const ACROSS: [[f32; LINES]; 2] = {
    let (mut across, mut k) = ([[0.0; LINES]; 2], 0);
    while k < LINES {
        across[0][k] = (k as f32 + 0.5) / LINES as f32 - 0.5;
        across[1][k] = ((7 * k % LINES) as f32 + 0.5) / LINES as f32 - 0.5;
        k += 1;
    }
    across
};
/// Least component of a normal along the lines that is not taken for zero.
const PARALLEL: f32 = 1e-20;

/// Volume fraction of one cell: that behind the face that cuts off most, less the mean length that the others cut off there of [`LINES`]
/// along the axis nearest to its normal. Root mean square error: below 0.007.
#[inline(always)]
fn along_lines<R: Choose<f32>>(faces: &[Face], near: &[NearFace], deepest: NearFace, x: f32) -> f32 {
    let axis = longest(faces[deepest.face as usize].normal);
    let mut ends = [[R::splat(-0.5), R::splat(0.5)]; LINES];
    let ends = &mut ends[..LINES / R::WIDTH];
    shorten(ends, axis, &faces[deepest.face as usize], deepest.height(faces, x));
    let mut cut = [0.0; LINES];
    for (at, [low, high]) in (0..LINES).step_by(R::WIDTH).zip(&*ends) {
        store(&mut cut, at, (*high - *low).max(R::splat(0.0)));
    }
    for this in near {
        let (face, height) = (&faces[this.face as usize], this.height(faces, x));
        if height > -face.reach {
            shorten(ends, axis, face, height);
        }
    }
    for (at, [low, high]) in (0..LINES).step_by(R::WIDTH).zip(&*ends) {
        let whole = load::<f32, R>(&cut, at);
        store(&mut cut, at, whole - (*high - *low).max(R::splat(0.0)));
    }
    let whole = faces[deepest.face as usize].volume.behind(deepest.height(faces, x));
    let left = whole - cut.iter().sum::<f32>() * (1.0 / LINES as f32);
    if left > 0.0 { left } else { 0.0 }
}

/// Cuts off the parts outside of a face of the [`LINES`] along an axis through a cell at this height above the face.
#[inline(always)]
fn shorten<R: Choose<f32>>(ends: &mut [[R; 2]], axis: usize, face: &Face, height: f32) {
    let along = face.normal[axis];
    let along = if along.abs() < PARALLEL { PARALLEL } else { along };
    let [b, d, slope] =
        [face.normal[(axis + 1) % 3], face.normal[(axis + 2) % 3], -1.0 / along].map(R::splat);
    for (at, [low, high]) in (0..LINES).step_by(R::WIDTH).zip(ends) {
        let [u, v] = [load::<f32, R>(&ACROSS[0], at), load::<f32, R>(&ACROSS[1], at)];
        let end = (R::splat(height) + (b * u + d * v)) * slope;
        if along > 0.0 {
            *high = high.min(end);
        } else {
            *low = low.max(end);
        }
    }
}

/// Positive for cells at the heights `a`, `b` above two faces whose normals have this cosine if the edge where they meet is the
/// nearest part of the two and too far away (half the diagonal of a cell) to reach into them.
#[inline(always)]
fn beyond_edge<R: Choose<f32>>(a: R, b: R, cosine: f32) -> R {
    let c = |x: f32| R::splat(x);
    let over = (a - c(cosine) * b).min(b - c(cosine) * a);
    over.min((a * a + b * b) - c(2.0 * cosine) * (a * b) - c(0.75 * (1.0 - cosine * cosine)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::tests::coupled;
    use crate::coupling::{Method, Saturated, SolidOperator};
    use crate::fluid::simd::{Single, Vectorised, vectorise};
    use crate::fluid::{RigidMotion, Simd};
    use crate::math::{Quat, Vec3};
    use crate::shape::{Cuboid, Polyhedron, Shape, Sphere};
    use std::sync::Arc;

    #[test]
    fn cells_looked_at_together_have_the_fractions_that_each_has_alone() {
        // Up to three faces meet in a cell of the one, more of the other.
        let dx = coupled(Method::Saturated(Saturated::new(SolidOperator::Sc3))).units.dx;
        let cuboid = Cuboid::new(Vec3::new(4.3, 5.1, 6.2) * dx).unwrap();
        let hull = |refinement| {
            let round = Sphere { radius: 4.0 * dx }.surface_mesh(refinement);
            Polyhedron::hull(&round.points, 1e-9 * dx).unwrap().0
        };
        let bodies: [(Arc<dyn Shape>, usize); 3] =
            [(Arc::new(cuboid), 3), (Arc::new(hull(0)), 5), (Arc::new(hull(2)), 9)];
        for (shape, most) in bodies {
            let turn = Quat::from_euler_angles(0.3, -0.7, 1.1);
            let motion = RigidMotion { centre: [0.2, 0.1, -0.3], ..RigidMotion::default() };
            let method = Method::Saturated(Saturated::new(SolidOperator::Sc3));
            let mapper = Mapper::new(&shape, turn, motion, &coupled(method), -0.1);
            let crate::coupling::mapper::Geometry::Flat(planes) = &mapper.geometry else { panic!() };
            let mut surface = FlatSurface::new(&mapper, planes, LEAST_SKIN);
            let (mut cut, mut meeting, mut too_many) = (0, 0, 0);
            for row in 0..256 {
                let [y, z] = [row % 16, row / 16].map(|n| f64::from(n) - 7.6);
                for first in [-8, -4, 0] {
                    surface.enter_row::<Single>(y, z, first, first + 7);
                    for n in first..first + 8 {
                        let x = n as f32 - 0.2;
                        let fraction = alone::<f32>(&surface.faces, &surface.near, x);
                        cut += usize::from(fraction > 0.0 && fraction < 1.0);
                        let reaching = |near: &&NearFace| {
                            near.height(&surface.faces, x) > -surface.faces[near.face as usize].reach
                        };
                        if surface.near.iter().filter(reaching).count() > MEETING {
                            too_many += 1;
                            continue;
                        }
                        match together(&surface.faces, surface.near.iter().map(|near| near.splat()), x) {
                            Some(together) => assert_eq!(together.to_bits(), fraction.to_bits()),
                            None => panic!("few faces are evaluated together"),
                        }
                        let cuts = |near: &&NearFace| {
                            let face = &surface.faces[near.face as usize];
                            near.height(&surface.faces, x).abs() < face.reach
                        };
                        meeting = meeting.max(surface.near.iter().filter(cuts).count());
                    }
                }
            }
            assert!(cut > 100 && meeting >= most, "{cut} {meeting}");
            assert_eq!(too_many > 0, planes.len() > 100, "{too_many}");
        }
    }

    struct Alone<'a>(&'a FlatSurface<'a>, f32, &'a mut f32);

    impl Vectorised for Alone<'_> {
        #[inline(always)]
        fn run<V: Registers>(self) {
            *self.2 = alone::<V::F>(&self.0.faces, &self.0.near, self.1);
        }
    }

    #[test]
    fn cells_in_which_many_faces_meet_have_the_volume_behind_them_within_0_03() {
        // A ball and a disc of 1280 faces, a cylinder of 64 sides, and a stone.
        let dx = coupled(Method::Saturated(Saturated::new(SolidOperator::Sc3))).units.dx;
        let ball: Vec<Vec3> = Sphere { radius: 4.0 * dx }.surface_mesh(3).points;
        let disc = ball.iter().map(|at| Vec3::new(at.x, at.y, 0.3 * at.z)).collect();
        let rim = |k: u32| 2.0 * std::f64::consts::PI * f64::from(k) / 64.0;
        let corners =
            |k| [-1.0, 1.0].map(|z| Vec3::new(4.0 * rim(k).cos(), 4.0 * rim(k).sin(), 3.0 * z) * dx);
        let cylinder = (0..64).flat_map(corners).collect();
        let at = |k: i32, step: f64| 8.0 * ((f64::from(k) * step) % 1.0) - 4.0;
        let stone =
            (0..150).map(|k| Vec3::new(at(k, 0.819_172_5), at(k, 0.671_043_6), at(k, 0.549_700_5)) * dx);
        for points in [ball.clone(), disc, cylinder, stone.collect()] {
            let shape: Arc<dyn Shape> = Arc::new(Polyhedron::hull(&points, 1e-9 * dx).unwrap().0);
            let motion = RigidMotion { centre: [0.2, 0.1, -0.3], ..RigidMotion::default() };
            let turn = Quat::from_euler_angles(0.3, -0.7, 1.1);
            let method = Method::Saturated(Saturated::new(SolidOperator::Sc3));
            let mapper = Mapper::new(&shape, turn, motion, &coupled(method), 0.0);
            let crate::coupling::mapper::Geometry::Flat(planes) = &mapper.geometry else { panic!() };
            let mut surface = FlatSurface::new(&mapper, planes, LEAST_SKIN);
            let (mut count, mut squares) = (0, 0.0);
            for (iy, iz) in (-6..=6).flat_map(|iy| (-6..=6).map(move |iz| (iy, iz))) {
                let (y, z) = (f64::from(iy) - 0.1, f64::from(iz) + 0.3);
                surface.enter_row::<Single>(y, z, -6, 6);
                for n in -6..=6 {
                    let x = n as f32 - 0.2;
                    let reaching = |near: &&NearFace| {
                        near.height(&surface.faces, x) > -surface.faces[near.face as usize].reach
                    };
                    let fraction = alone::<f32>(&surface.faces, &surface.near, x);
                    if fraction == 0.0 || surface.near.iter().filter(reaching).count() <= MEETING {
                        continue;
                    }
                    for simd in
                        [Simd::Sse2, Simd::Avx2, Simd::Avx512].into_iter().filter(|s| s.is_available())
                    {
                        let mut found = 0.0;
                        vectorise(simd, Alone(&surface, x, &mut found));
                        assert_eq!(found.to_bits(), fraction.to_bits(), "{simd:?}");
                    }
                    let at = |k: i32| (f64::from(k) + 0.5) / 12.0 - 0.5;
                    let behind = |&k: &i32| {
                        let (x, y, z) = (f64::from(x) + at(k % 12), y + at(k / 12 % 12), z + at(k / 144));
                        planes.iter().all(|plane| plane.height(x, plane.rest(y, z)) < 0.0)
                    };
                    let error = f64::from(fraction) - (0..1728).filter(behind).count() as f64 / 1728.0;
                    assert!(error.abs() < 0.03, "{fraction} {error}");
                    (count, squares) = (count + 1, squares + error * error);
                }
            }
            assert!(count > 20 && squares < 0.007 * 0.007 * f64::from(count), "{count} {squares}");
        }
    }
}
