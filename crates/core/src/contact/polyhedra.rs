//! The overlap of two polyhedra, and of a polyhedron and a plane: one clipped by the faces of the other.
//!
//! Volume, centre, area vector and moment are exact integrals over the clipped body ([`clip`](super::clip)); the area
//! vector and the moment are those of its faces that belong to the first body. A face in both surfaces belongs half
//! to each: this is the mean of the values for a small motion either way along its normal, and it is symmetric in the
//! two bodies. Depth is the length of the line along the normal through the centre.
//!
//! Pairs that do not overlap are excluded by the planes of the faces of either body (faces that point away are skipped,
//! by the inscribed sphere), and by the clipping itself, which leaves nothing where an edge passes another edge.

use super::clip::{Clipper, Cut, Integrals, Plane, distances};
use super::overlap::Overlap;
use super::sampled::portal;
use super::solid::Solid;
use crate::math::{Mat3, Vec3};
use std::cell::RefCell;

/// Faces this near to each other, in parts of the smaller reach, lie in one plane.
const COPLANAR: f64 = 1e-10;

/// Memory of a pair from one call to the next; it saves time, and no result depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hint {
    /// Number of the plane that had one body on either side, those of the first body in front.
    plane: u32,
}

/// Buffers of one contact after another.
#[derive(Default)]
struct Workshop {
    clipper: Clipper,
    /// Planes of both bodies, in the frame of the first, those of the first in front.
    planes: Vec<Plane>,
    /// True where the clipped body reaches the plane (of the second body).
    reached: Vec<bool>,
    /// True where the clipped body has a face in the plane.
    present: Vec<bool>,
    weights: Vec<f64>,
}

thread_local! {
    static WORKSHOP: RefCell<Workshop> = RefCell::default();
}

/// Overlap of two polyhedra. Rotations map the body frames to the world frame; `offset` (m) leads from the centre of
/// the first to that of the second. The `hint` is that of an earlier call for this pair, or the default.
pub(super) fn overlap(
    first: &Solid,
    to_world: &Mat3,
    second: &Solid,
    second_to_world: &Mat3,
    offset: Vec3,
    hint: &mut Hint,
) -> Option<Overlap> {
    // From here on in the frame of the first body.
    let turn = to_world.tr_mul(second_to_world);
    let shift = turned_back(to_world, &offset);
    let (over, back) = (turn.transpose(), turned_back(&turn, &-shift));
    let own = first.planes.len();
    if match (hint.plane as usize).checked_sub(own) {
        None => separates(&first.planes[hint.plane as usize], second, &turn, shift),
        Some(n) => second.planes.get(n).is_some_and(|plane| separates(plane, first, &over, back)),
    } {
        return None;
    }
    let separating = separating(&first.planes, second, &turn, shift)
        .or_else(|| separating(&second.planes, first, &over, back).map(|n| own + n));
    if let Some(plane) = separating {
        hint.plane = plane as u32;
        return None;
    }
    WORKSHOP.with_borrow_mut(|workshop| {
        workshop.clip(first, second, &turn, shift)?;
        let scale = COPLANAR * first.reach.min(second.reach);
        workshop.share_coplanar_faces(own, scale);
        workshop.overlap(to_world, offset)
    })
}

/// Returns true if two polyhedra overlap, as [`overlap`] does, but without clipping.
pub(super) fn intersects(
    first: &Solid,
    to_world: &Mat3,
    second: &Solid,
    second_to_world: &Mat3,
    offset: Vec3,
) -> bool {
    // In the frame of the first body.
    let turn = to_world.tr_mul(second_to_world);
    let shift = to_world.tr_mul(&offset);
    let furthest = |along: Vec3| first.furthest(&along) - turn * second.furthest(&-turn.tr_mul(&along));
    portal::meeting(shift, furthest).is_some()
}

/// Overlap of a polyhedron and everything below a plane, `normal . x <= offset` in world axes from the centre of the
/// body, `normal` pointing out of the wall.
pub(super) fn overlap_plane(body: &Solid, to_world: &Mat3, wall: &Plane) -> Option<Overlap> {
    if wall.offset.is_nan() || wall.offset <= -body.reach {
        return None;
    }
    let plane = Plane { normal: to_world.tr_mul(&wall.normal), offset: wall.offset };
    if body.lowest(&plane.normal) >= plane.offset {
        return None;
    }
    WORKSHOP.with_borrow_mut(|workshop| {
        let faces = body.planes.len();
        workshop.clipper.load(&body.graph);
        if workshop.clipper.cut(&plane, faces as u32, 0.0) == Cut::Emptied {
            return None;
        }
        workshop.planes.clear();
        workshop.planes.extend_from_slice(&body.planes);
        workshop.planes.push(plane);
        workshop.weights.clear();
        workshop.weights.resize(faces + 1, 0.0);
        // The section with the plane closes the rest, and has only one normal.
        workshop.weights[faces] = -1.0;
        let mut overlap = workshop.overlap(to_world, -wall.normal)?;
        overlap.normal = -wall.normal;
        Some(overlap)
    })
}

/// Integrals over the part of a polyhedron below some planes in its frame, the area and the moment of the surface of the body there: as if the
/// first plane closed it alone. None if there is no such part.
pub(super) fn piece(body: &Solid, planes: &[Plane]) -> Option<Integrals> {
    if body.lowest(&planes[0].normal) >= planes[0].offset {
        return None;
    }
    WORKSHOP.with_borrow_mut(|workshop| {
        let faces = body.planes.len();
        workshop.clipper.load(&body.graph);
        for (plane, number) in planes.iter().zip(faces as u32..) {
            if workshop.clipper.cut(plane, number, 0.0) == Cut::Emptied {
                return None;
            }
        }
        workshop.weights.clear();
        workshop.weights.resize(faces + planes.len(), 0.0);
        workshop.weights[faces] = -1.0;
        workshop.clipper.integrate(&workshop.weights).filter(|part| part.volume > 0.0)
    })
}

/// Index of the first plane that has the whole body, rotated and shifted, above it.
fn separating(planes: &[Plane], body: &Solid, turn: &Mat3, shift: Vec3) -> Option<usize> {
    for (n, chunk) in planes.chunks(32).enumerate() {
        // Few planes have the inscribed sphere above them, and which ones nobody can predict.
        let mut candidates = (chunk.iter().enumerate())
            .fold(0, |bits, (k, plane)| bits | u32::from(plane.height(&shift) > body.inner) << k);
        while candidates != 0 {
            let k = candidates.trailing_zeros() as usize;
            if separates(&chunk[k], body, turn, shift) {
                return Some(32 * n + k);
            }
            candidates &= candidates - 1;
        }
    }
    None
}

/// Returns true if the whole body, rotated and shifted, is above a plane.
#[inline]
fn separates(plane: &Plane, body: &Solid, turn: &Mat3, shift: Vec3) -> bool {
    let height = plane.height(&shift);
    height > body.inner && height + body.lowest(&turned_back(turn, &plane.normal)) >= 0.0
}

/// `matrix * v`, written out: this is what pairs that miss spend their time on.
#[inline]
fn turned(matrix: &Mat3, v: &Vec3) -> Vec3 {
    Vec3::from_fn(|i, _| matrix[(i, 0)] * v.x + matrix[(i, 1)] * v.y + matrix[(i, 2)] * v.z)
}

/// The same with the transpose.
#[inline]
fn turned_back(matrix: &Mat3, v: &Vec3) -> Vec3 {
    Vec3::from_fn(|i, _| matrix[(0, i)] * v.x + matrix[(1, i)] * v.y + matrix[(2, i)] * v.z)
}

impl Workshop {
    /// Leaves the part of the first body in the second; `None` if there is none.
    fn clip(&mut self, first: &Solid, second: &Solid, turn: &Mat3, shift: Vec3) -> Option<()> {
        let own = first.planes.len();
        self.planes.clear();
        self.planes.extend_from_slice(&first.planes);
        // The face that looks at the first body most takes most away: then there is less to do for the others.
        let mut facing = (f64::NEG_INFINITY, 0);
        self.planes.extend(second.planes.iter().enumerate().map(|(n, plane)| {
            let normal = turned(turn, &plane.normal);
            let offset = plane.offset + normal.dot(&shift);
            if -offset > facing.0 {
                facing = (-offset, own + n);
            }
            Plane { normal, offset }
        }));
        let scale = COPLANAR * first.reach.min(second.reach);
        self.reached.clear();
        self.reached.resize(self.planes.len(), false);
        self.clipper.load(&first.graph);
        for number in std::iter::once(facing.1).chain(own..self.planes.len()) {
            if self.reached[number] {
                continue;
            }
            let plane = &self.planes[number];
            if self.clipper.highest_bound(plane) < -scale {
                continue;
            }
            self.reached[number] = true;
            if self.clipper.cut(plane, number as u32, 0.0) == Cut::Emptied {
                return None;
            }
        }
        Some(())
    }

    /// Faces of the first body weigh 1, of the second 0, and those that lie in both surfaces one half.
    fn share_coplanar_faces(&mut self, own: usize, scale: f64) {
        self.weights.clear();
        self.weights.resize(own, 1.0);
        self.weights.resize(self.planes.len(), 0.0);
        self.present.clear();
        self.present.resize(self.planes.len(), false);
        self.clipper.mark_faces(&mut self.present);
        for face in 0..own {
            let here = self.planes[face];
            // Of two in one plane, rounding decides which one is left.
            let counts = |&n: &usize| self.reached[n] && (self.present[face] || self.present[n]);
            for other in (own..self.planes.len()).filter(counts) {
                let plane = &self.planes[other];
                // Planes that touch the overlap at one height and are parallel: the angle follows from the length.
                if plane.normal.dot(&here.normal) > 1.0 - 1e-14 && (plane.offset - here.offset).abs() < scale
                {
                    (self.weights[face], self.weights[other]) = (0.5, 0.5);
                }
            }
        }
    }

    /// Integrals and depth, turned to world axes. `towards` stands for a normal that the area does not give.
    fn overlap(&mut self, to_world: &Mat3, towards: Vec3) -> Option<Overlap> {
        let integrals = self.clipper.integrate(&self.weights)?;
        let area = integrals.area.norm();
        // A body inside the other is pressed nowhere. Nearly always the root need not be known.
        let is_large = area * area * area > COPLANAR * integrals.volume * integrals.volume;
        let normal = if is_large || {
            let length = libm::cbrt(integrals.volume);
            area > COPLANAR * length * length
        } {
            integrals.area / area
        } else {
            let towards = to_world.tr_mul(&towards);
            towards.try_normalize(0.0).unwrap_or_else(Vec3::x)
        };
        let planes = self.clipper.faces.iter().map(|&face| &self.planes[face as usize]);
        let (ahead, behind) = distances(planes, &integrals.centre, &normal);
        let depth = ahead + behind;
        (depth > 0.0 && depth.is_finite()).then(|| Overlap {
            volume: integrals.volume,
            depth,
            point: turned(to_world, &integrals.centre),
            normal: turned(to_world, &normal),
            area,
            moment: turned(to_world, &integrals.moment),
        })
    }
}

#[cfg(test)]
mod tests;
