//! The native engine against LIGGGHTS, case by case, with an analytic value where there is one.

mod compare;
pub mod files;
mod free_flight;
mod gas;
mod impacts;
mod oblique;
pub mod own_case;
mod pair;
mod periodic;
mod record;
mod replay;
mod settling;
mod statics;
mod system;
mod theory;

use crate::checks::Findings;
use std::path::Path;
use turbid::error::Result;

/// Names that most cases use.
mod prelude {
    pub(super) use super::compare::{Between, Limit, Points, moments, overlay, worst};
    pub(super) use super::system::{GLASS, RADIUS, Random, SAME, System, Track, model, plane, sphere};
    pub(super) use super::theory::Hertz;
    pub(super) use crate::checks::Findings;
    pub(super) use std::path::Path;
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
    /// Runs it in both engines; files of the engine (its log) go to the directory, if there is one.
    pub run: fn(Option<&Path>) -> Result<Findings>,
}

impl Case {
    const fn new(id: &'static str, title: &'static str, run: fn(Option<&Path>) -> Result<Findings>) -> Self {
        Self { id, title, run }
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
        "gas",
        "gas of 512 spheres of five sizes: momentum, energy, early agreement, cooling",
        gas::gas,
    ),
    Case::new(
        "settling-box",
        "1000 dry spheres settle in a box: height, contacts, forces on walls",
        settling::settling,
    ),
    Case::new("replay", "recorded loads of four-way runs, replayed through both engines", replay::replay),
];

/// The suite, one line for each case.
pub fn list() -> String {
    let width = CASES.iter().map(|case| case.id.len()).max().unwrap_or(0);
    let lines = (CASES.iter()).map(|case| format!("  {:width$}  {}", case.id, case.title));
    lines.collect::<Vec<_>>().join("\n")
}
