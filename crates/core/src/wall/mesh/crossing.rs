//! Points inside of a mesh, and segments that cross it, by exact predicates: no way leads through an edge or a corner unseen.
//!
//! A point is enclosed if the facets beyond it along x go round it: the sum of their winding numbers in the plane of y and z. Each edge
//! counts by a half-open interval of z, in the opposite sense for its two facets, so that a ray through it counts once.
//!
//! # Reference
//! Shewchuk (1997), Discrete Comput. Geom. 18, 305, doi:10.1007/PL00009321 (the predicates, crate `robust`).

use super::{FreeSide, WallMesh};
use crate::math::Vec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// First point of a segment on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Part of the way (-).
    pub part: f64,
    /// Facet, of several the first.
    pub facet: u32,
}

pub(super) fn exact(at: &Vec3) -> Coord3D<f64> {
    Coord3D { x: at.x, y: at.y, z: at.z }
}

/// Sense in which a facet goes round the ray along x from a point, 0 if the ray misses it; none if the point lies on it.
pub(super) fn winding(corners: &[Vec3; 3], at: &Vec3) -> Option<i32> {
    let flat = |at: &Vec3| Coord { x: at.y, y: at.z };
    let mut sum = 0;
    for k in 0..3 {
        let (from, to) = (&corners[k], &corners[(k + 1) % 3]);
        let up = from.z <= at.z && at.z < to.z;
        let down = to.z <= at.z && at.z < from.z;
        if !up && !down {
            continue;
        }
        // The same numbers in the same order from both sides of an edge.
        let (low, high) = if up { (from, to) } else { (to, from) };
        if orient2d(flat(low), flat(high), flat(at)) > 0.0 {
            sum += if up { 1 } else { -1 };
        }
    }
    if sum == 0 {
        return Some(0);
    }
    let [a, b, c] = corners.each_ref().map(exact);
    // Positive below the facet, where its corners run clockwise.
    let side = orient3d(a, b, c, exact(at)) * f64::from(sum);
    if side == 0.0 { None } else { Some(if side > 0.0 { sum } else { 0 }) }
}

impl WallMesh {
    /// True if a closed mesh goes round a point. Exact; of points on the mesh either.
    pub fn encloses(&self, at: &Vec3) -> bool {
        if !self.is_closed() || (0..3).any(|i| at[i] < self.bounds[0][i] || at[i] > self.bounds[1][i]) {
            return false;
        }
        let (mut sum, mut on) = (0, false);
        self.tree.each(&[*at, self.tree.far(at)], |facet| match winding(&self.corners(facet), at) {
            Some(winding) => sum += winding,
            None => on = true,
        });
        sum != 0 && !on
    }

    /// True if a point is in the wall; never of a sheet. Exact, but for points on the mesh.
    pub fn is_wall(&self, at: &Vec3) -> bool {
        match self.free {
            FreeSide::Outside => self.encloses(at),
            FreeSide::Inside => !self.encloses(at),
            FreeSide::Both => false,
        }
    }

    /// The first point of a segment from one point to another (m) that is on the mesh; its ends, edges and corners count. Whether there is one is exact.
    pub fn crossing(&self, from: &Vec3, to: &Vec3) -> Option<Crossing> {
        self.crossing_but(from, to, None)
    }

    /// The same without a facet.
    pub(super) fn crossing_but(&self, from: &Vec3, to: &Vec3, but: Option<u32>) -> Option<Crossing> {
        let mut first: Option<Crossing> = None;
        let [start, end] = [from, to].map(exact);
        self.tree.along(from, to, |facet| {
            if but == Some(facet) {
                return;
            }
            let [a, b, c] = self.corners(facet).each_ref().map(exact);
            let [near, far] = [start, end].map(|at| orient3d(a, b, c, at));
            if near > 0.0 && far > 0.0 || near < 0.0 && far < 0.0 || (near - far).abs() == 0.0 {
                return;
            }
            let around = [(a, b), (b, c), (c, a)].map(|(a, b)| orient3d(start, end, a, b));
            if around.iter().any(|side| *side > 0.0) && around.iter().any(|side| *side < 0.0) {
                return;
            }
            let part = near / (near - far);
            let is_first =
                first.is_none_or(|known| part.total_cmp(&known.part).then(facet.cmp(&known.facet)).is_lt());
            if is_first {
                first = Some(Crossing { part, facet });
            }
        });
        first
    }
}
