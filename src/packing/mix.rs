//! Metropolis moves of hard bodies until they are in equilibrium: all configurations without overlap are equally
//! likely.
//!
//! Bodies that were pushed apart touch their neighbours far too often. Metropolis moves remove this correlation: each
//! body in turn is shifted and rotated by a random step, which is accepted if it then overlaps no body and no wall,
//! and rejected otherwise,
//!
//! ```text
//! x -> x + s R (u_1, u_2, u_3),     turned by the quaternion (1, s/2 (u_4, u_5, u_6)),     u_i in [-1, 1)
//! ```
//!
//! with `R` the reach of the body. Steps and their reverse are equally likely, so that all states without overlaps
//! become equally likely. The length `s` of the steps is adapted during the first half so that a fraction [`WANTED`]
//! of them is accepted; after that it is constant. Only `+ - * /` and square roots: the same seed gives the same bits
//! on any machine.
//!
//! # Reference
//! Metropolis, Rosenbluth, Rosenbluth, Teller, Teller (1953), doi:10.1063/1.1699114.

use super::Uniform;
use super::neighbours::Bins;
use super::relax::{Pose, body};
use crate::contact::{GrownShape, intersects, intersects_wall};
use crate::domain::Domain;
use crate::math::Vec3;
use crate::wall::Surface;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Moves of every body: this many per square of the longest edge of the box over the diameter of the widest body, as
/// a crowd of bodies spreads like heat, but within these limits. Near neighbours take 100, the longest wave of
/// density 1.7 per square (volume fraction 0.3).
const SWEEPS: f64 = 2.0;
const LEAST_SWEEPS: f64 = 400.0;
const MOST_SWEEPS: f64 = 1000.0;
/// Moves after which larger packings stop, a third of a microsecond each: near neighbours still take those that they need
/// up to half a million bodies.
const MOST_MOVES: f64 = 5e7;
/// Sweeps after which the length of the steps is adapted.
const LOOK: u32 = 10;
/// The part of the moves that is to count (-).
const WANTED: f64 = 0.35;
/// Length of a step to begin with, and the least and the largest, in reaches. No step leads through a body.
const FIRST: f64 = 0.3;
const LEAST: f64 = 1e-3;
const LARGEST: f64 = 0.9;
/// Tells the stream of moves from those of positions and orientations with the same seed.
const MOVES: u64 = 0x006D_6F76_6573;

/// Moves all bodies but the first `fixed` ones about. None that overlapped nothing will.
///
/// Contours are grown by half of the gap that their bodies keep, so that gaps stay as wide as they must be.
pub fn mix(
    domain: &Domain,
    walls: &[Surface],
    contours: &[GrownShape],
    poses: &mut [Pose],
    fixed: usize,
    seed: u64,
) {
    let mut random = Uniform(ChaCha8Rng::seed_from_u64(seed ^ MOVES));
    let reaches: Vec<f64> = contours.iter().map(GrownShape::reach).collect();
    let widest = poses.iter().map(|pose| reaches[pose.contour]).fold(0.0, f64::max);
    let across = domain.size().max() / (2.0 * widest);
    let sweeps = (SWEEPS * across * across)
        .clamp(LEAST_SWEEPS, MOST_SWEEPS)
        .min(MOST_MOVES / (poses.len() - fixed).max(1) as f64)
        .ceil() as u32;
    let mut bins = Bins::new(domain, poses.iter().map(|pose| (pose.position, reaches[pose.contour])));
    let is_sphere: Vec<bool> = contours.iter().map(|contour| contour.shape.as_sphere().is_some()).collect();
    let is_narrow = domain.has_images(2.0 * widest) != [false; 3];
    let (mut step, mut counted) = (FIRST, 0_u32);
    for sweep in 1..=sweeps {
        for i in fixed..poses.len() {
            let mut draw = || Vec3::from_fn(|_, _| 2.0 * random.next() - 1.0);
            let before = poses[i];
            let reach = reaches[before.contour];
            let mut after = before;
            after.position = domain.wrap(before.position + draw() * (step * reach));
            let sphere = is_sphere[before.contour];
            if !sphere {
                after.orientation = before.turned(draw() * (0.5 * step));
            }
            let moved = body(contours, &after);
            let meets = |j: usize| {
                let other = &poses[j];
                let near = reach + reaches[other.contour];
                let meets = |offset: Vec3| {
                    offset.norm_squared() < near * near && intersects(&moved, &body(contours, other), offset)
                };
                let difference = other.position - after.position;
                j != i
                    && (meets(domain.nearest_image(difference))
                        || is_narrow && domain.images(difference, near).any(meets))
            };
            let free = |wall: &Surface| {
                let distance = wall.distance_up_to(after.position, reach);
                let seen = wall.seen_from(after.position);
                distance >= reach || (!sphere && distance > 0.0 && !intersects_wall(&moved, &seen))
            };
            if !bins.any(&after.position, reach, meets) && walls.iter().all(free) {
                bins.shift(i, &before.position, &after.position);
                poses[i] = after;
                counted += 1;
            }
        }
        if sweep % LOOK == 0 && 2 * sweep <= sweeps {
            let part = f64::from(counted) / (f64::from(LOOK) * (poses.len() - fixed) as f64);
            step = (step * 0.5 * (1.0 + part / WANTED)).clamp(LEAST, LARGEST);
            counted = 0;
        }
    }
}

#[cfg(test)]
mod tests;
