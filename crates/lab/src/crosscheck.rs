//! The native engine against another one, case by case, with an analytic value where there is one.

mod against;
mod compare;
pub mod files;
mod free_flight;
mod impacts;
mod oblique;
pub mod own_case;
mod pair;
mod periodic;
mod polyhedra;
mod record;
mod settling;
mod statics;
mod system;
mod theory;

pub use against::Against;

use crate::checks::{Ending, Findings, Outcome};
use turbid::error::Result;

/// Names that most cases use.
mod prelude {
    pub(super) use super::against::Against;
    pub(super) use super::compare::{Between, Limit, Points, moments, overlay, worst};
    pub(super) use super::system::{GLASS, RADIUS, Random, SAME, System, Track, model, plane, sphere};
    pub(super) use super::theory::Hertz;
    pub(super) use crate::checks::Findings;
    pub(super) use turbid::case::Setup;
    pub(super) use turbid::contact::Material;
    pub(super) use turbid::dem::DemEngine;
    pub(super) use turbid::domain::Domain;
    pub(super) use turbid::error::Result;
    pub(super) use turbid::math::Vec3;
    pub(super) use turbid::output::Overlay;
    pub(super) use turbid::particle::Particle;
}

/// A case of the suite.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Short name, for `--case`.
    pub id: &'static str,
    /// Purpose, one line.
    pub title: &'static str,
    run: fn(&Against) -> Result<Findings>,
}

impl Case {
    const fn new(id: &'static str, title: &'static str, run: fn(&Against) -> Result<Findings>) -> Self {
        Self { id, title, run }
    }

    /// Runs it in both engines.
    pub fn outcome(&self, against: &Against) -> Outcome {
        if let Some(reason) = against.lacks(self.id) {
            let missing = Ending::Missing(reason.to_string());
            return Outcome::new(self.id, self.title, Some(against.name), 0.0, missing);
        }
        Outcome::of_engines(self.id, self.title, against.name, || {
            Ok(against.judge(self.id, (self.run)(against)?))
        })
    }
}

/// The suite.
pub const CASES: &[Case] = &[
    Case::new(
        "static-pair",
        "force at rest of two spheres, depths 1e-8 to 0.1 R, equal and unequal radii and materials",
        statics::pairs,
    ),
    Case::new("static-wall", "force at rest of a sphere and a wall, depths 1e-8 to 0.1 R", statics::wall),
    Case::new(
        "head-on",
        "elastic head-on impact: restitution, duration, depth, trajectory",
        impacts::elastic,
    ),
    Case::new(
        "restitution",
        "restitution 0.95 to 0.5 over speeds, both laws of damping",
        impacts::restitutions,
    ),
    Case::new(
        "duration",
        "duration and depth of damped impacts, each engine against its own law",
        impacts::shapes,
    ),
    Case::new(
        "force-history",
        "whole history of the force of damped impacts under the same law",
        impacts::histories,
    ),
    Case::new("wall-impact", "damped impact on a wall", impacts::wall),
    Case::new(
        "sliding",
        "oblique elastic impacts with gross sliding friction, several angles",
        oblique::sliding,
    ),
    Case::new("near-rigid", "slow oblique impact, against rigid spheres", oblique::rigid),
    Case::new("spin", "head-on impacts of spinning spheres", oblique::spin),
    Case::new(
        "periodic",
        "contacts through the faces, edges and corners of a periodic box",
        periodic::contacts,
    ),
    Case::new(
        "free-flight",
        "free flight under constant and random loads, 1 and 10 sub-steps",
        free_flight::loaded,
    ),
    Case::new(
        "settling-box",
        "1000 dry spheres settle in a box: height, contacts, forces on walls",
        settling::settling,
    ),
    Case::new("cube-plane", "overlaps of 20 cubes with a plane: face, edge, corner", polyhedra::cube_plane),
    Case::new("cube-cube", "overlaps of 100 pairs of cubes: faces, edges, corners", polyhedra::cube_cube),
    Case::new("polyhedra", "overlaps of 100 pairs of irregular polyhedra", polyhedra::irregular_pairs),
    Case::new("inertia", "principal moments of a cube and ten polyhedra", polyhedra::moments_of_inertia),
];

/// The suite, one line for each case.
pub fn list() -> String {
    let width = CASES.iter().map(|case| case.id.len()).max().unwrap_or(0);
    let lines = (CASES.iter()).map(|case| format!("  {:width$}  {}", case.id, case.title));
    lines.collect::<Vec<_>>().join("\n")
}
