//! Bodies with flat faces: intersections with a row of cells.

use super::surface::BLOCK;
use super::volume_fraction::{behind_both, behind_plane};
use crate::math::Mat3;
use crate::shape::Shape;

/// A face of a body that has only flat ones, as a row of cells sees it: world axes, lengths in cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacePlane {
    /// Outward unit normal.
    normal: [f64; 3],
    /// Distance from the centre of mass.
    offset: f64,
    /// `1 / normal[0]`, or 0 where the row runs along the face.
    slope: f64,
    /// Largest height above the face at which the centre of a cell may lie that it cuts.
    reach: f64,
}

/// Normals whose x part is smaller than this are taken to be at right angles to the rows.
const ALONG: f64 = 1e-12;

impl FacePlane {
    /// The faces of `shape`, if all of them are flat, moved in by `shift` (cells), added to `planes`.
    pub(super) fn collect(shape: &dyn Shape, to_world: &Mat3, dx: f64, shift: f64, planes: &mut Vec<Self>) {
        let Some(polyhedron) = shape.as_polyhedron() else {
            return;
        };
        planes.extend(polyhedron.faces.iter().map(|face| {
            let normal: [f64; 3] = (to_world * face.normal).into();
            Self {
                normal,
                offset: face.offset / dx - shift,
                slope: if normal[0].abs() < ALONG { 0.0 } else { 1.0 / normal[0] },
                reach: 0.5 * (normal[0].abs() + normal[1].abs() + normal[2].abs()),
            }
        }));
    }

    /// Height above the face of a point whose y and z are already in `rest`, see [`rest`](Self::rest).
    #[inline(always)]
    pub(super) fn height(&self, x: f64, rest: f64) -> f64 {
        self.normal[0] * x - rest
    }

    /// Remainder of the offset for `normal[0] x` in the row at `y, z` from the centre.
    #[inline(always)]
    pub(super) fn rest(&self, y: f64, z: f64) -> f64 {
        self.offset - (self.normal[1] * y + self.normal[2] * z)
    }

    /// Volume fractions behind all of `planes` of cells with their centres at `x, y, z` (cells, from the centre of
    /// the body).
    #[inline(always)]
    pub(super) fn shares(planes: &[Self], x: &[f64; BLOCK], y: f64, z: f64) -> [f64; BLOCK] {
        let shares = if planes.len() <= MANY { together(planes, x, y, z) } else { None };
        // No closure: it would not be compiled for the instruction set of the sweep.
        match shares {
            Some(shares) => shares,
            None => one_by_one(planes, x, y, z),
        }
    }
}

/// Most faces that reach into the same [`BLOCK`] of cells to be evaluated together.
const MEETING: usize = 8;

/// Bodies with more faces than this have more than [`MEETING`] in most places.
const MANY: usize = 40;

/// Volume fractions behind all of `planes` of cells with their centres at `x, y, z` (cells, from the centre of the
/// body), or none if more faces meet there than can be evaluated together.
///
/// Volume fraction of a cell that several faces cut: each is combined with the fraction behind the previous ones, at
/// the cosine to the most similar of them.
#[inline(always)]
fn together(planes: &[FacePlane], x: &[f64; BLOCK], y: f64, z: f64) -> Option<[f64; BLOCK]> {
    let (mut share, mut outside) = ([1.0_f64; BLOCK], [false; BLOCK]);
    // Faces before that reach into some of the cells, and which.
    let (mut met, mut count) = ([([0.0; 3], [false; BLOCK]); MEETING], 0);
    for plane in planes {
        let rest = plane.rest(y, z);
        let (mut reached, mut any) = ([false; BLOCK], false);
        let mut height = [0.0; BLOCK];
        for k in 0..BLOCK {
            height[k] = plane.height(x[k], rest);
            reached[k] = height[k] > -plane.reach;
            any |= reached[k];
        }
        if !any {
            continue;
        }
        if count == MEETING {
            return None;
        }
        let n = plane.normal;
        let mut cosine = [-1.0_f64; BLOCK];
        for (other, before) in &met[..count] {
            let c = n[0] * other[0] + n[1] * other[1] + n[2] * other[2];
            for k in 0..BLOCK {
                cosine[k] = if before[k] && c > cosine[k] { c } else { cosine[k] };
            }
        }
        for k in 0..BLOCK {
            let behind = behind_plane(height[k], n);
            let both = behind_both(share[k], behind, cosine[k]);
            let next = if share[k] >= 1.0 { behind } else { both };
            share[k] = if reached[k] { next } else { share[k] };
            outside[k] |= height[k] >= plane.reach;
        }
        met[count] = (n, reached);
        count += 1;
    }
    for k in 0..BLOCK {
        share[k] = if outside[k] { 0.0 } else { share[k] };
    }
    Some(share)
}

/// The same, cell by cell.
#[inline(always)]
fn one_by_one(planes: &[FacePlane], x: &[f64; BLOCK], y: f64, z: f64) -> [f64; BLOCK] {
    let mut shares = [0.0; BLOCK];
    for (share, x) in shares.iter_mut().zip(x) {
        *share = alone(planes, *x, y, z);
    }
    shares
}

/// Volume fraction of one cell.
#[inline(always)]
fn alone(planes: &[FacePlane], x: f64, y: f64, z: f64) -> f64 {
    let mut share = 1.0;
    for (at, plane) in planes.iter().enumerate() {
        let height = plane.height(x, plane.rest(y, z));
        if height >= plane.reach {
            return 0.0;
        }
        if height > -plane.reach {
            let n = plane.normal;
            let behind = behind_plane(height, n);
            if share >= 1.0 {
                share = behind;
                continue;
            }
            // The face before that is most like this one.
            let cosine = planes[..at]
                .iter()
                .filter(|other| other.height(x, other.rest(y, z)) > -other.reach)
                .map(|other| n[0] * other.normal[0] + n[1] * other.normal[1] + n[2] * other.normal[2])
                .fold(-1.0, f64::max);
            share = behind_both(share, behind, cosine);
        }
    }
    share
}

/// An interval of x.
type Interval = (f64, f64);

/// Interval of the row at `y, z` (cells from the centre) below all planes moved out by `growth`, and moved in by it.
#[inline]
pub(super) fn between(
    planes: &[FacePlane],
    y: f64,
    z: f64,
    growth: f64,
) -> Option<(Interval, Option<Interval>)> {
    let (mut outer, mut inner) = ((f64::NEG_INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::INFINITY));
    let mut inside = true;
    for plane in planes {
        let rest = plane.rest(y, z);
        let (x, more) = (rest * plane.slope, growth * plane.slope);
        if plane.slope > 0.0 {
            outer.1 = outer.1.min(x + more);
            inner.1 = inner.1.min(x - more);
        } else if plane.slope < 0.0 {
            outer.0 = outer.0.max(x + more);
            inner.0 = inner.0.max(x - more);
        } else if rest < -growth {
            return None;
        } else if rest < growth {
            inside = false;
        }
    }
    (outer.0 <= outer.1).then_some((outer, (inside && inner.0 <= inner.1).then_some(inner)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Quat, Vec3};
    use crate::shape::{Cuboid, Polyhedron, Sphere};

    #[test]
    fn cells_looked_at_together_have_the_shares_that_each_has_alone() {
        // Up to three faces meet in a cell of the one, more of the other.
        let cuboid = Cuboid::new(Vec3::new(4.3, 5.1, 6.2)).unwrap();
        let round = Sphere { radius: 4.0 }.surface_mesh(0);
        let hull = Polyhedron::hull(&round.points, 1e-9).unwrap().0;
        let bodies: [(&dyn Shape, usize); 2] = [(&cuboid, 3), (&hull, 5)];
        for (shape, most) in bodies {
            let turn = Quat::from_euler_angles(0.3, -0.7, 1.1).to_rotation_matrix();
            let mut planes = Vec::new();
            FacePlane::collect(shape, turn.matrix(), 1.0, -0.1, &mut planes);
            let (mut cut, mut meeting, mut too_many) = (0, 0, 0);
            for row in 0..256 {
                let [y, z] = [row % 16, row / 16].map(|n| f64::from(n) - 7.6);
                for first in [-8.3, -4.3, -0.3] {
                    let x: [f64; BLOCK] = std::array::from_fn(|k| first + k as f64);
                    let Some(shares) = together(&planes, &x, y, z) else {
                        too_many += 1;
                        continue;
                    };
                    let alone = one_by_one(&planes, &x, y, z);
                    assert_eq!(shares.map(f64::to_bits), alone.map(f64::to_bits));
                    cut += shares.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
                    for x in x {
                        let cuts = |plane: &&FacePlane| plane.height(x, plane.rest(y, z)).abs() < plane.reach;
                        meeting = meeting.max(planes.iter().filter(cuts).count());
                    }
                }
            }
            assert!(cut > 100 && meeting >= most, "{cut} {meeting}");
            assert_eq!(too_many > 0, planes.len() > MEETING);
        }
    }
}
