//! Bodies with flat faces: intersections with a row of cells.

use crate::math::Mat3;
use crate::shape::{Face, Polyhedron};

/// A face of a body that has only flat ones, as a row of cells sees it: world axes, lengths in cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacePlane {
    /// Outward unit normal.
    pub(super) normal: [f64; 3],
    /// Distance from the centre of mass.
    offset: f64,
    /// `1 / normal[0]`, or 0 where the row runs along the face.
    pub(super) slope: f64,
    /// Largest height above the face at which the centre of a cell may lie that it cuts.
    pub(super) reach: f64,
}

/// Normals whose x part is smaller than this are taken to be at right angles to the rows.
const ALONG: f64 = 1e-12;

impl FacePlane {
    /// The faces of a polyhedron, moved in by `shift` (cells).
    pub(super) fn all(polyhedron: &Polyhedron, to_world: &Mat3, dx: f64, shift: f64) -> Vec<Self> {
        let plane = |face: &Face| {
            let normal: [f64; 3] = (to_world * face.normal).into();
            Self {
                normal,
                offset: face.offset / dx - shift,
                slope: if normal[0].abs() < ALONG { 0.0 } else { 1.0 / normal[0] },
                reach: 0.5 * (normal[0].abs() + normal[1].abs() + normal[2].abs()),
            }
        };
        polyhedron.faces.iter().map(plane).collect()
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
