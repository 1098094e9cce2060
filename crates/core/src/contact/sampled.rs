//! Overlap of any two convex bodies, or of a body and a wall, from samples of signed distances.
//!
//! This improves the scheme of Marquardt et al. (2024), with the same resolution `N_c`:
//!
//! 1. [`portal`]: support points give a direction; at walls it is the normal of the wall.
//! 2. [`frame`]: a box along that direction: of [`ellipsoids`] by formulas, else tightened by planes that touch the bodies.
//! 3. [`side`]: `N_c` times `N_c` lines along each axis of the box. Their ends in the overlap are those of chords of spheres and
//!    ellipsoids, else zeros of convex functions, found to [`PRECISION`] by Newton's method (grown ellipsoids, superellipsoids) or
//!    the secant method by distances; sums over the lines give volume, centre, area vector and moment.
//! 4. The depth is the length of the line along the normal through the centre.
//!
//! A pair is always measured in the same order: swapping reverses the normal and changes no digit. Formulas and
//! comparison: `docs/theory/contact.md`.
//!
//! # Reference
//! Marquardt, Hafen, Krause (2024), doi:10.1016/j.cpc.2024.109321, sections 2.3 and 3.

mod cell;
mod ellipsoids;
mod frame;
pub(super) mod portal;
mod side;

use super::overlap::{Body, Overlap};
use crate::math::{Mat3, Vec3};
use crate::wall::Surface;
use cell::{Cell, positive_part};
use frame::Frame;
use side::{Line, Side};
use std::cell::RefCell;

/// Samples per direction, `N_c`, where nothing else is said.
pub const DEFAULT_SAMPLES: u32 = 8;

/// Precision of the ends of lines, in parts of the thickness of the box.
const PRECISION: f64 = 1e-4;
/// An area vector below this part of the section of the box has no direction: one lies in the other.
const NOWHERE: f64 = 1e-3;

/// Overlap of two bodies by `samples` lines per direction.
///
/// `offset` (m) is the centre of the second body relative to the first.
pub fn overlap(first: &Body, second: &Body, offset: Vec3, samples: u32) -> Option<Overlap> {
    // Of the two orders, that with the offset in the upper half of space.
    let turned_round = offset.iter().find(|x| **x != 0.0).is_some_and(|x| *x < 0.0);
    if turned_round {
        return Some(in_order(second, first, -offset, samples)?.reversed(offset));
    }
    in_order(first, second, offset, samples)
}

/// Returns true if two bodies overlap.
pub(super) fn intersects(first: &Body, second: &Body, offset: Vec3) -> bool {
    let sides = [Side::body(first, Vec3::zeros()), Side::body(second, offset)];
    portal::normal(&sides[0], &sides[1], offset).is_some()
}

fn in_order(first: &Body, second: &Body, offset: Vec3, samples: u32) -> Option<Overlap> {
    let sides = [Side::body(first, Vec3::zeros()), Side::body(second, offset)];
    let normal = portal::normal(&sides[0], &sides[1], offset)?;
    between(&sides, normal, samples)
}

/// Overlap of a body with a wall, by `samples` lines per direction; the wall as seen from the centre of the body.
pub fn overlap_wall(body: &Body, wall: &Surface, samples: u32) -> Option<Overlap> {
    let height = wall.distance(Vec3::zeros());
    if height.is_nan() || height >= body.grown.reach() {
        return None;
    }
    let sides = [Side::body(body, Vec3::zeros()), Side::Wall(wall.clone())];
    between(&sides, -wall.normal(Vec3::zeros()), samples)
}

/// The overlap on one line.
#[derive(Clone, Copy, Debug)]
struct Chord {
    enter: f64,
    leave: f64,
    /// `leave - enter` (m), negative if both sides are met, but apart; NaN if one is missed.
    gap: f64,
    /// Contribution of the ends to the area vector of the first side: +1 leaving, -1 entering through it.
    own: f64,
}

const MISSED: Chord = Chord { enter: f64::NAN, leave: f64::NAN, gap: f64::NAN, own: 0.0 };

/// The chords of a line, the longer (or less apart) first. There is a second only where the outside of a pipe is met
/// twice.
fn chords(sides: &[Side; 2], line: &Line, from: f64, to: f64, precision: f64) -> [Chord; 2] {
    let one = sides[0].intervals(line, from, to, precision);
    if one == [None; 2] {
        return [MISSED; 2];
    }
    let two = sides[1].intervals(line, from, to, precision);
    let mut chords = [MISSED; 2];
    for a in one.into_iter().flatten() {
        for b in two.into_iter().flatten() {
            let (enter, leave) = (a.0.max(b.0).max(from), a.1.min(b.1).min(to));
            let own = f64::from(u8::from(a.1 < b.1)) - f64::from(u8::from(a.0 > b.0));
            let chord = Chord { enter, leave, gap: leave - enter, own };
            // NaN loses every comparison.
            if chords[0].gap >= chord.gap {
                chords[1] = chord;
            } else {
                chords = [chord, chords[0]];
            }
        }
    }
    chords
}

/// Contributions of the ends of a line's overlaps to the area vector of the first side, as [`Chord::own`].
fn own_ends(sides: &[Side; 2], line: &Line, from: f64, to: f64, precision: f64) -> f64 {
    if let [Some(first), Some(second)] = [sides[0].quick(line), sides[1].quick(line)] {
        return side::own_ends(&first, &second, [from, to], precision).unwrap_or(0.0);
    }
    let overlaps = chords(sides, line, from, to, precision).into_iter().filter(|chord| chord.gap > 0.0);
    overlaps.map(|chord| chord.own).sum()
}

/// Sums over the lines, in coordinates of the frame.
#[derive(Default)]
struct Sums {
    volume: f64,
    first: Vec3,
    area: Vec3,
    /// `levers[(i, k)]` is the integral of `x_i n_k`.
    levers: Mat3,
}

thread_local! {
    /// Chords of the lines along the normal.
    static CHORDS: RefCell<Vec<[Chord; 2]>> = RefCell::default();
}

fn between(sides: &[Side; 2], normal: Vec3, samples: u32) -> Option<Overlap> {
    let n = samples.max(1) as usize;
    let frame = frame::around([&sides[0], &sides[1]], normal)?;
    let precision = PRECISION * (frame.hi - frame.lo).z;
    let mut sums = Sums::default();
    CHORDS.with_borrow_mut(|chords| {
        along_normal(sides, &frame, n, precision, chords);
        add_cells(&frame, n, chords, &mut sums);
    });
    if sums.volume.is_nan() || sums.volume <= 0.0 {
        return None;
    }
    for axis in 0..2 {
        add_across(sides, &frame, axis, n, precision, &mut sums);
    }
    let edges = frame.hi - frame.lo;
    let area = sums.area.norm();
    let normal = if area > NOWHERE * edges.x * edges.y { frame.point(sums.area / area) } else { normal };
    let t = &sums.levers;
    let moment = Vec3::new(t[(1, 2)] - t[(2, 1)], t[(2, 0)] - t[(0, 2)], t[(0, 1)] - t[(1, 0)]);
    let point = frame.point(sums.first / sums.volume);
    let reach = edges.norm();
    let through = Line { from: point, along: normal };
    let depth = chords(sides, &through, -reach, reach, precision)[0].gap;
    (depth > 0.0).then(|| Overlap {
        volume: sums.volume,
        depth,
        point,
        normal,
        area,
        moment: frame.point(moment),
    })
}

/// Middle of cell `i` of `n` along an axis of the box.
fn middle(frame: &Frame, axis: usize, i: usize, n: usize) -> f64 {
    let step = (frame.hi[axis] - frame.lo[axis]) / n as f64;
    frame.lo[axis] + (i as f64 + 0.5) * step
}

fn along_normal(sides: &[Side; 2], frame: &Frame, n: usize, precision: f64, found: &mut Vec<[Chord; 2]>) {
    found.clear();
    for j in 0..n {
        for i in 0..n {
            let (u, v) = (middle(frame, 0, i, n), middle(frame, 1, j, n));
            let line = Line { from: frame.point(Vec3::new(u, v, 0.0)), along: frame.axis(2) };
            found.push(chords(sides, &line, frame.lo.z, frame.hi.z, precision));
        }
    }
}

/// Volume, centre, and the contributions of the lines along the normal to area and moment.
fn add_cells(frame: &Frame, n: usize, chords: &[[Chord; 2]], sums: &mut Sums) {
    let step = (frame.hi - frame.lo) / n as f64;
    let section = step.x * step.y;
    let gap = |i: Option<usize>, j: Option<usize>| match (i, j) {
        (Some(i), Some(j)) if i < n && j < n => chords[i + n * j][0].gap,
        _ => f64::NAN,
    };
    for j in 0..n {
        for i in 0..n {
            let [main, second] = chords[i + n * j];
            let (u, v) = (middle(frame, 0, i, n), middle(frame, 1, j, n));
            let mut add = |chord: Chord, part: Cell| {
                let w = 0.5 * (chord.enter + chord.leave);
                let place = Vec3::new(u, v, w);
                let shift = |along: [f64; 2]| Vec3::new(along[0] * step.x, along[1] * step.y, 0.0);
                let volume = section * part.volume;
                sums.volume += volume;
                sums.first += (place + shift(part.centre)) * volume;
                let own = section * part.area * chord.own;
                let middle = place + shift(part.middle);
                sums.area.z += own;
                sums.levers[(0, 2)] += own * middle.x;
                sums.levers[(1, 2)] += own * middle.y;
            };
            if !main.gap.is_nan() {
                let beside = [
                    [gap(i.checked_sub(1), Some(j)), gap(Some(i + 1), Some(j))],
                    [gap(Some(i), j.checked_sub(1)), gap(Some(i), Some(j + 1))],
                ];
                add(main, positive_part(main.gap, beside));
            }
            if second.gap > 0.0 {
                add(second, Cell::whole(second.gap));
            }
        }
    }
}

/// Area and moment across the normal, by lines along an axis of the box.
fn add_across(sides: &[Side; 2], frame: &Frame, axis: usize, n: usize, precision: f64, sums: &mut Sums) {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let step = (frame.hi - frame.lo) / n as f64;
    let section = step[i] * step[j];
    for b in 0..n {
        for a in 0..n {
            let mut from = Vec3::zeros();
            (from[i], from[j]) = (middle(frame, i, a, n), middle(frame, j, b, n));
            let line = Line { from: frame.point(from), along: frame.axis(axis) };
            let own = section * own_ends(sides, &line, frame.lo[axis], frame.hi[axis], precision);
            sums.area[axis] += own;
            sums.levers[(i, axis)] += own * from[i];
            sums.levers[(j, axis)] += own * from[j];
        }
    }
}

#[cfg(test)]
mod tests;
