//! The overlap of two polyhedra, and of a polyhedron and a plane: one clipped by the faces of the other.
//!
//! Volume, centre, area vector and moment are exact integrals over the clipped body ([`clip`](super::clip)); the area
//! vector and the moment are those of its faces that belong to the first body. A face in both surfaces belongs half
//! to each: this is the mean of the values for a small motion either way along its normal, and it is symmetric in the
//! two bodies. Depth is the length of the line along the normal through the centre.
//!
//! Pairs that do not overlap are excluded by the planes of the faces of either body (faces that point away are skipped,
//! by the inscribed sphere), and by the clipping itself, which leaves nothing where an edge passes another edge.

use super::clip::{Clipper, Cut, Plane, distances};
use super::overlap::Overlap;
use super::sampled::portal;
use super::solid::Solid;
use crate::math::{Mat3, Vec3};
use std::cell::RefCell;

/// Faces this near to each other, in parts of the smaller reach, lie in one plane.
const COPLANAR: f64 = 1e-10;

/// Buffers of one contact after another.
#[derive(Default)]
struct Workshop {
    clipper: Clipper,
    /// Planes of both bodies, in the frame of the first, those of the first in front.
    planes: Vec<Plane>,
    /// True where the clipped body reaches the plane (of the second body).
    reached: Vec<bool>,
    weights: Vec<f64>,
}

thread_local! {
    static WORKSHOP: RefCell<Workshop> = RefCell::default();
}

/// Overlap of two polyhedra. Rotations map the body frames to the world frame; `offset` (m) leads from the centre of
/// the first to that of the second.
pub(super) fn overlap(
    first: &Solid,
    to_world: &Mat3,
    second: &Solid,
    second_to_world: &Mat3,
    offset: Vec3,
) -> Option<Overlap> {
    // From here on in the frame of the first body.
    let turn = to_world.tr_mul(second_to_world);
    let shift = to_world.tr_mul(&offset);
    if separated(&first.planes, second, &turn, shift) {
        return None;
    }
    let back = turn.tr_mul(&-shift);
    if separated(&second.planes, first, &turn.transpose(), back) {
        return None;
    }
    WORKSHOP.with_borrow_mut(|workshop| {
        workshop.clip(first, second, &turn, shift)?;
        let scale = COPLANAR * first.reach.min(second.reach);
        workshop.share_coplanar_faces(first.planes.len(), scale);
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

/// Returns true if one of the planes has the whole body, rotated and shifted, above it.
fn separated(planes: &[Plane], body: &Solid, turn: &Mat3, shift: Vec3) -> bool {
    planes.iter().any(|plane| {
        let height = plane.height(&shift);
        height > body.inner && height + body.lowest(&turn.tr_mul(&plane.normal)) >= 0.0
    })
}

impl Workshop {
    /// Leaves the part of the first body in the second; `None` if there is none.
    fn clip(&mut self, first: &Solid, second: &Solid, turn: &Mat3, shift: Vec3) -> Option<()> {
        let own = first.planes.len();
        self.planes.clear();
        self.planes.extend_from_slice(&first.planes);
        // The face that looks at the first body most takes most away: then there is less to do for the others.
        let mut facing = (f64::NEG_INFINITY, 0);
        for plane in &second.planes {
            let normal = turn * plane.normal;
            let offset = plane.offset + normal.dot(&shift);
            if -offset > facing.0 {
                facing = (-offset, self.planes.len());
            }
            self.planes.push(Plane { normal, offset });
        }
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
        for other in (own..self.planes.len()).filter(|&n| self.reached[n]) {
            let plane = self.planes[other];
            for face in 0..own {
                let here = &self.planes[face];
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
        // A body inside the other is pressed nowhere.
        let length = libm::cbrt(integrals.volume);
        let normal = if area > COPLANAR * length * length {
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
            point: to_world * integrals.centre,
            normal: to_world * normal,
            area,
            moment: to_world * integrals.moment,
        })
    }
}

#[cfg(test)]
mod tests;
