//! Messages for a state outside the valid range of the method.

use crate::contact::Overlap;
use crate::dem::exchange::Population;
use crate::error::Error;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::wall::Wall;

/// Two particles overlap by more than a quarter of the thickness of the thinner one (m).
pub(super) fn too_deep(step: u64, a: &Particle, b: &Particle, overlap: &Overlap, thinner: f64) -> Error {
    let what = format!(
        "particles {} at {} and {}: overlap {:.3e} m deep, more than a quarter of the thickness {thinner:.3e} m",
        a.id,
        Population::place(a.position()),
        b.id,
        overlap.depth
    );
    Error::Diverged { step, what }
}

/// A particle overlaps a wall by more than a quarter of its thickness (m).
pub(super) fn too_deep_in_wall(step: u64, a: &Particle, wall: &Wall, depth: f64, thickness: f64) -> Error {
    let what = format!(
        "particle {} at {} and wall `{}`: overlap {depth:.3e} m deep, more than a quarter of its thickness \
         {thickness:.3e} m",
        a.id,
        Population::place(a.position()),
        wall.name,
    );
    Error::Diverged { step, what }
}

/// The centre of a particle lies behind a wall by more than its circumradius (m).
pub(super) fn behind_wall(step: u64, a: &Particle, wall: &Wall, distance: f64, radius: f64) -> Error {
    let what = format!(
        "particle {} at {}: its centre lies {:.3e} m behind the wall `{}`, more than its circumradius {radius:.3e} m",
        a.id,
        Population::place(a.position()),
        -distance,
        wall.name,
    );
    Error::Diverged { step, what }
}

/// A particle leaves the box through a face that is not periodic.
pub fn outside(step: u64, before: &Particle, after: &Particle, face: &str, walls: &[Wall]) -> Error {
    let wall = if walls.iter().any(|wall| wall.name == face) {
        format!("wall `{face}`")
    } else {
        format!("face {face}, where there is no wall")
    };
    let what = format!(
        "particle {} at {}: its centre leaves the domain through its {wall}, to {}",
        before.id,
        Population::place(before.position()),
        Population::place(after.position()),
    );
    Error::Diverged { step, what }
}

/// A particle moves further than a cell (`dx`, m) in one sub-step, or nowhere at all.
pub(super) fn too_far(step: u64, before: &Particle, after: &Particle, force: Vec3, dx: f64) -> Error {
    let what = if after.is_finite() {
        format!(
            "moved {:.3e} m in one sub-step, more than a cell ({dx:.3e} m), under {:.3e} N",
            (after.position() - before.position()).amax(),
            force.norm()
        )
    } else {
        format!("its state is not finite, under {:.3e} N", force.norm())
    };
    let place = Population::place(before.position());
    Error::Diverged { step, what: format!("particle {} at {place}: {what}", before.id) }
}
