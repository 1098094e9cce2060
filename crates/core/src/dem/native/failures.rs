//! Errors for a state outside the valid range of the method.

use crate::contact::DEEPEST;
use crate::error::Error;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::wall::Wall;
use std::fmt::Arguments;

/// Coordinates (m) in words.
pub fn position_text(position: Vec3) -> String {
    format!("({:.6e}, {:.6e}, {:.6e}) m", position.x, position.y, position.z)
}

fn diverged(step: u64, particle: &Particle, what: Arguments) -> Error {
    let at = position_text(particle.position());
    Error::Diverged { step, what: format!("particle {} at {at}{what}", particle.id) }
}

/// Returns true if an overlap (m) is too deep for a body of this thickness (m); NaN is.
#[inline]
pub fn is_too_deep(depth: f64, thickness: f64) -> bool {
    depth > DEEPEST * thickness || depth.is_nan()
}

/// The overlap (m) with `partner` is too deep for a body of this thickness (m).
#[cold]
pub(super) fn too_deep(step: u64, a: &Particle, partner: Arguments, depth: f64, thickness: f64) -> Error {
    diverged(
        step,
        a,
        format_args!(
            " and {partner}: overlap {depth:.3e} m deep, more than a quarter of the thickness {thickness:.3e} m; those of stiffer \
             materials (youngs_modulus) are less deep"
        ),
    )
}

/// The centre of a particle lies behind a wall by more than its circumradius (m).
pub(super) fn behind_wall(step: u64, a: &Particle, wall: &Wall, distance: f64, radius: f64) -> Error {
    diverged(
        step,
        a,
        format_args!(
            ": its centre lies {:.3e} m behind the wall `{}`, more than its circumradius {radius:.3e} m",
            -distance, wall.name,
        ),
    )
}

/// A particle leaves the box through a face that is not periodic.
pub fn outside(step: u64, before: &Particle, after: &Particle, face: &str, walls: &[Wall]) -> Error {
    let wall = if walls.iter().any(|wall| wall.name == face) {
        format!("wall `{face}`")
    } else {
        format!("face {face}, where there is no wall")
    };
    let to = position_text(after.position());
    diverged(step, before, format_args!(": its centre leaves the domain through its {wall}, to {to}"))
}

/// A particle moves further than a cell (`dx`, m) in one sub-step, or its state is not finite; `forces` (N) are those of the fluid
/// and of contacts.
pub(super) fn too_far(step: u64, before: &Particle, after: &Particle, forces: [Vec3; 2], dx: f64) -> Error {
    let [load, contacts] = forces;
    let (force, contacts) = ((load + contacts).norm(), contacts.norm());
    if after.is_finite() {
        let moved = (after.position() - before.position()).amax();
        let what = format_args!(
            ": moved {moved:.3e} m in one sub-step, more than a cell ({dx:.3e} m), under {force:.3e} N, contacts \
             alone {contacts:.3e} N"
        );
        return diverged(step, before, what);
    }
    diverged(step, before, format_args!(": its state is not finite, under {force:.3e} N"))
}
