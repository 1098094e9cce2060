//! The native engine against LIGGGHTS, case by case, with an analytic value where there is one.

#[cfg(feature = "liggghts")]
mod damped;
#[cfg(feature = "liggghts")]
pub mod files;
#[cfg(feature = "liggghts")]
mod free_flight;
#[cfg(feature = "liggghts")]
mod gas;
#[cfg(feature = "liggghts")]
mod head_on;
#[cfg(feature = "liggghts")]
mod histories;
#[cfg(feature = "liggghts")]
mod oblique;
#[cfg(feature = "liggghts")]
pub mod own_case;
#[cfg(feature = "liggghts")]
mod pair;
#[cfg(feature = "liggghts")]
mod periodic;
#[cfg(feature = "liggghts")]
mod record;
#[cfg(feature = "liggghts")]
mod replay;
#[cfg(feature = "liggghts")]
mod settling;
#[cfg(feature = "liggghts")]
mod statics;
#[cfg(feature = "liggghts")]
mod theory;
#[cfg(feature = "liggghts")]
mod tools;

use crate::checks::Findings;
#[cfg(feature = "liggghts")]
use crate::checks::{Check, Moment};
use std::path::Path;
use turbid::error::Result;
#[cfg(feature = "liggghts")]
use turbid::output::Overlay;

/// A case of the suite.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Short name, for `--case`.
    pub id: &'static str,
    /// What it shows, one line.
    pub title: &'static str,
    /// Runs it in both engines; files of the engine (its log) go to the directory, if there is one.
    pub run: fn(Option<&Path>) -> Result<Findings>,
}

/// What runs a case, or its stand-in in a program without LIGGGHTS, which can only list it.
#[cfg(feature = "liggghts")]
macro_rules! with_liggghts {
    ($run:path) => {
        $run
    };
}
#[cfg(not(feature = "liggghts"))]
macro_rules! with_liggghts {
    ($run:path) => {
        |_| Err(turbid::engine::liggghts_is_missing("`turbid crosscheck`"))
    };
}

/// The suite.
pub const CASES: &[Case] = &[
    Case {
        id: "static-pair",
        title: "force at rest of two spheres, depths 1e-8 to 0.1 R, equal and unequal radii and materials",
        run: with_liggghts!(statics::pairs),
    },
    Case {
        id: "static-wall",
        title: "force at rest of a sphere and a wall, depths 1e-8 to 0.1 R",
        run: with_liggghts!(statics::wall),
    },
    Case {
        id: "head-on",
        title: "elastic head-on impact: restitution, duration, depth, trajectory",
        run: with_liggghts!(head_on::elastic),
    },
    Case {
        id: "restitution",
        title: "restitution 0.95 to 0.5 over speeds, both laws of damping",
        run: with_liggghts!(damped::restitutions),
    },
    Case {
        id: "duration",
        title: "duration and depth of damped impacts, each engine against its own law",
        run: with_liggghts!(damped::shapes),
    },
    Case {
        id: "force-history",
        title: "whole history of the force of damped impacts under the same law",
        run: with_liggghts!(histories::histories),
    },
    Case { id: "wall-impact", title: "damped impact on a wall", run: with_liggghts!(damped::wall) },
    Case {
        id: "sliding",
        title: "oblique elastic impacts with gross sliding friction, several angles",
        run: with_liggghts!(oblique::sliding),
    },
    Case {
        id: "near-rigid",
        title: "slow oblique impact, against rigid spheres",
        run: with_liggghts!(oblique::rigid),
    },
    Case { id: "spin", title: "head-on impacts of spinning spheres", run: with_liggghts!(oblique::spin) },
    Case {
        id: "periodic",
        title: "contacts through the faces, edges and corners of a periodic box",
        run: with_liggghts!(periodic::contacts),
    },
    Case {
        id: "free-flight",
        title: "free flight under constant and random loads, 1 and 10 sub-steps",
        run: with_liggghts!(free_flight::loaded),
    },
    Case {
        id: "gas",
        title: "gas of 512 spheres of five sizes: momentum, energy, early agreement, cooling",
        run: with_liggghts!(gas::gas),
    },
    Case {
        id: "settling-box",
        title: "1000 dry spheres settle in a box: height, contacts, forces on walls",
        run: with_liggghts!(settling::settling),
    },
    Case {
        id: "replay",
        title: "recorded loads of four-way runs, replayed through both engines",
        run: with_liggghts!(replay::replay),
    },
];

/// The suite, one line for each case.
pub fn list() -> String {
    let width = CASES.iter().map(|case| case.id.len()).max().unwrap_or(0);
    let lines = (CASES.iter()).map(|case| format!("  {:width$}  {}", case.id, case.title));
    lines.collect::<Vec<_>>().join("\n")
}
