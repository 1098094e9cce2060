//! A box that fits the overlap of two sides closely, aligned with it.
//!
//! A polyhedron that contains the overlap is cut out of the bounding box by half-spaces: flat faces of the sides, and
//! planes that touch a side between it and a corner of the polyhedron. The corners are the furthest in eight
//! directions around the normal, which give the orientation of the overlap, and then those in the directions of the
//! box as long as they are far from the overlap. An empty polyhedron proves that the sides do not touch. The box of two ellipsoids is
//! found by formulas ([`Pencil`]).

use super::ellipsoids::Pencil;
use super::side::Side;
use crate::contact::clip::{Clipper, Cut, Graph};
use crate::math::{Mat3, Vec3, bounding_box};
use std::cell::RefCell;

/// Limit on how far a corner may be outside, relative to the thickness.
const TIGHT: f64 = 0.02;
/// Most cuts in each direction of the box; each halves the way to a thin overlap.
const CUTS: u32 = 40;
/// Directions round the normal, those of the eighths of a circle.
const ROUND: [(f64, f64); 8] = {
    const H: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [(1.0, 0.0), (H, H), (0.0, 1.0), (-H, H), (-1.0, 0.0), (-H, -H), (0.0, -1.0), (H, -H)]
};
/// Margin of the box around the overlap, relative to its edges.
const MARGIN: f64 = 1e-6;

thread_local! {
    static CLIPPER: RefCell<Clipper> = RefCell::default();
}

/// An oriented box: unit vectors along the edges, the third the normal, and the products of its corners with them (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub axes: Mat3,
    pub lo: Vec3,
    pub hi: Vec3,
}

impl Frame {
    /// With a margin; `None` if it is empty or not finite.
    pub(super) fn new(axes: Mat3, lo: Vec3, hi: Vec3) -> Option<Self> {
        let margin = (hi - lo) * MARGIN + Vec3::repeat(f64::MIN_POSITIVE);
        let (lo, hi) = (lo - margin, hi + margin);
        (hi - lo).iter().all(|x| *x > 0.0 && x.is_finite()).then_some(Self { axes, lo, hi })
    }

    /// A point by its coordinates along the axes (m).
    pub(super) fn point(&self, coordinates: Vec3) -> Vec3 {
        self.axes * coordinates
    }

    pub(super) fn axis(&self, n: usize) -> Vec3 {
        self.axes.column(n).into()
    }
}

/// Box about the overlap, the third axis along `normal`; `None` if there is no overlap.
pub(super) fn around(sides: [&Side; 2], normal: Vec3) -> Option<Frame> {
    if let Some(pencil) = Pencil::new(sides, normal) {
        return pencil.frame(normal);
    }
    CLIPPER.with_borrow_mut(|clipper| {
        let axes = about(normal);
        let (lo, hi) = furthest(sides, &axes)?;
        clipper.load(&Graph::cuboid(lo, hi, 0).turned(&axes));
        for plane in sides.iter().flat_map(|side| side.planes()) {
            if clipper.cut(&plane, 0, 0.0) == Cut::Emptied {
                return None;
            }
        }
        for (u, v) in ROUND {
            refine(clipper, sides, axes * Vec3::new(u, v, 0.0), normal, 2)?;
        }
        let axes = self::axes(normal, longest_side(clipper, &axes));
        for n in [2, 0, 1] {
            let axis: Vec3 = axes.column(n).into();
            refine(clipper, sides, axis, normal, CUTS)?;
            refine(clipper, sides, -axis, normal, CUTS)?;
        }
        let (lo, hi) = bounding_box(clipper.positions().map(|x| axes.tr_mul(&x)));
        Frame::new(axes, lo, hi)
    })
}

/// Unit vectors with the third along `normal`.
pub(super) fn about(normal: Vec3) -> Mat3 {
    axes(normal, if normal.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() })
}

/// Unit vectors with the third along `normal` and the first near `along`.
pub(super) fn axes(normal: Vec3, along: Vec3) -> Mat3 {
    let second = normal.cross(&along).normalize();
    Mat3::from_columns(&[second.cross(&normal), second, normal])
}

/// The box of the furthest points of both along the axes.
fn furthest(sides: [&Side; 2], axes: &Mat3) -> Option<(Vec3, Vec3)> {
    let (mut lo, mut hi) = (Vec3::repeat(f64::NEG_INFINITY), Vec3::repeat(f64::INFINITY));
    for n in 0..3 {
        let axis: Vec3 = axes.column(n).into();
        for side in sides {
            if let (Some(high), Some(low)) = (side.support(axis), side.support(-axis)) {
                hi[n] = hi[n].min(axis.dot(&high));
                lo[n] = lo[n].max(axis.dot(&low));
            }
        }
    }
    (0..3).all(|n| lo[n] < hi[n]).then_some((lo, hi))
}

/// Cuts off the furthest corner along a direction, up to `cuts` times, while it is far outside.
fn refine(clipper: &mut Clipper, sides: [&Side; 2], along: Vec3, normal: Vec3, cuts: u32) -> Option<()> {
    let thickness = (clipper.furthest(&normal) - clipper.furthest(&-normal)).dot(&normal);
    for _ in 0..cuts {
        let corner = clipper.furthest(&along);
        // By the side that is further away.
        let mut heights = sides.map(|side| (side.height(corner), side));
        if heights[0].0 < heights[1].0 {
            heights.swap(0, 1);
        }
        let (height, side) = heights[0];
        if height <= TIGHT * thickness {
            break;
        }
        let Some(plane) = side.cut(corner, height, clipper.positions()) else {
            break;
        };
        match clipper.cut(&plane, 0, 0.0) {
            Cut::Trimmed => {}
            Cut::Missed => break,
            Cut::Emptied => return None,
        }
    }
    Some(())
}

/// The direction, among those of the edges across the normal, in which the box round the corners has least area.
fn longest_side(clipper: &Clipper, axes: &Mat3) -> Vec3 {
    let normal: Vec3 = axes.column(2).into();
    let mut best = (f64::INFINITY, axes.column(0).into());
    let scale = (clipper.furthest(&best.1) - clipper.furthest(&-best.1)).norm();
    for edge in clipper.edge_vectors() {
        let flat = edge - normal * normal.dot(&edge);
        let length = flat.norm();
        if length <= 1e-9 * scale {
            continue;
        }
        let along = flat / length;
        let across = normal.cross(&along);
        let flat = clipper.positions().map(|x| Vec3::new(along.dot(&x), across.dot(&x), 0.0));
        let (lo, hi) = bounding_box(flat);
        let area = (hi.x - lo.x) * (hi.y - lo.y);
        // Not for the last digits: the first of equals.
        if area < best.0 * (1.0 - 1e-9) {
            best = (area, along);
        }
    }
    best.1
}
