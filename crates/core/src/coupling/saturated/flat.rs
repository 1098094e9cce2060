//! Volume fractions of cells that flat faces cut.

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
                    fractions[k] = alone(&self.faces, &self.near, n[k] - self.mapper.motion.centre[0] as f32);
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

/// Volume fraction of one cell.
pub(super) fn alone(faces: &[Face], near: &[NearFace], x: f32) -> f32 {
    let mut fraction = 1.0;
    for (at, this) in near.iter().enumerate() {
        let (face, height) = (&faces[this.face as usize], this.height(faces, x));
        if height >= face.reach {
            return 0.0;
        }
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
    use crate::fluid::RigidMotion;
    use crate::fluid::simd::Single;
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
                        let fraction = alone(&surface.faces, &surface.near, x);
                        cut += usize::from(fraction > 0.0 && fraction < 1.0);
                        match together(&surface.faces, surface.near.iter().map(|near| near.splat()), x) {
                            Some(together) => assert_eq!(together.to_bits(), fraction.to_bits()),
                            None => too_many += 1,
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
}
