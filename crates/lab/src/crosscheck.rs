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
mod settling;
mod statics;
mod system;
mod theory;

pub use against::Against;

use crate::checks::suite::{self, Part};

/// Names that most files use.
mod prelude {
    pub(super) use super::against::Against;
    pub(super) use super::compare::*;
    pub(super) use super::system::*;
    pub(super) use super::theory::Hertz;
    pub(super) use crate::checks::{Check, Figure, Findings, Moment, measured, overlaid, reference};
    pub(super) use std::sync::Arc;
    pub(super) use turbid::case::Setup;
    pub(super) use turbid::comm::Comm;
    pub(super) use turbid::contact::{ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Material};
    pub(super) use turbid::dem::{DemEngine, Load};
    pub(super) use turbid::domain::Domain;
    pub(super) use turbid::engine::EngineChoice;
    pub(super) use turbid::error::{Error, Result};
    pub(super) use turbid::math::Vec3;
    pub(super) use turbid::particle::{Particle, Template};
    pub(super) use turbid::simulation::engine_of;
}

pub type Case = suite::Case<Against>;

macro_rules! case {
    ($name:literal, $question:literal, $run:path $(,)?) => {
        Case { name: $name, question: $question, source: "", parts: &[Part::quick(1.0, $run)] }
    };
}

pub const CASES: &[Case] = &[
    case!(
        "static-pair",
        "force at rest of two spheres, depths 1e-8 to 0.1 R, equal and unequal radii and materials",
        statics::pairs,
    ),
    case!("static-wall", "force at rest of a sphere and a wall, depths 1e-8 to 0.1 R", statics::wall),
    case!("head-on", "elastic head-on impact: restitution, duration, depth, trajectory", impacts::elastic,),
    case!("restitution", "restitution 0.95 to 0.5 over speeds, both laws of damping", impacts::restitutions,),
    case!(
        "duration",
        "duration and depth of damped impacts, each engine against its own law",
        impacts::shapes,
    ),
    case!(
        "force-history",
        "whole history of the force of damped impacts under the same law",
        impacts::histories,
    ),
    case!("wall-impact", "damped impact on a wall", impacts::wall),
    case!("sliding", "oblique elastic impacts with gross sliding friction, several angles", oblique::sliding,),
    case!("sticking", "oblique impacts with sticking friction, elastic and damped", oblique::sticking),
    case!("near-rigid", "slow oblique impact, against rigid spheres", oblique::rigid),
    case!("spin", "head-on impacts of spinning spheres", oblique::spin),
    case!("periodic", "contacts through the faces, edges and corners of a periodic box", periodic::contacts,),
    case!(
        "free-flight",
        "free flight under constant and random loads, 1 and 10 sub-steps",
        free_flight::loaded,
    ),
    case!(
        "settling-box",
        "1000 dry spheres settle in a box: height, contacts, forces on walls",
        settling::settling,
    ),
    case!("cube-plane", "overlaps of 20 cubes with a plane: face, edge, corner", polyhedra::cube_plane),
    case!("cube-cube", "overlaps of 100 pairs of cubes: faces, edges, corners", polyhedra::cube_cube),
    case!("polyhedra", "overlaps of 100 pairs of irregular polyhedra", polyhedra::irregular_pairs),
    case!("inertia", "principal moments of a cube and ten polyhedra", polyhedra::moments_of_inertia),
];

/// The suite, one line for each case.
pub fn list() -> String {
    let width = CASES.iter().map(|case| case.name.len()).max().unwrap_or(0);
    let lines = (CASES.iter()).map(|case| format!("  {:width$}  {}", case.name, case.question));
    lines.collect::<Vec<_>>().join("\n")
}
