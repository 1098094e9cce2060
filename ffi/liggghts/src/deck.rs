//! The commands that set LIGGGHTS up: the same spheres, materials and walls as in the native engine.
//!
//! LIGGGHTS has Hertz's law with its own damping and a Coulomb spring along the surfaces (`model hertz tangential
//! history`). Its one coefficient of friction is the kinetic one; radii are those of contacts, enlargement included.

use super::session::PAIRS;
use serde::Deserialize;
use std::path::PathBuf;
use turbid_core::contact::{CohesionLaw, PairParams, RollingLaw};
use turbid_process::{AXES, ContactSection, SetUp, SurfaceSection, WallSection, axis_of, sliding_plane};

/// Distance beyond contact within which pairs are listed, over the smallest radius: a list lasts until something has moved by
/// half of it.
const SKIN: f64 = 0.3;

/// Fixes that hold a vector for each atom, wherever it goes: its force and its torque while the lists are made again.
pub(crate) const HELD: [&str; 2] = ["heldforce", "heldtorque"];

/// Viscous damping of `rolling_friction epsd`: the fixed one of `RollingLaw::ElasticPlastic` (-).
const ROLLING_DAMPING: f64 = 0.3;

/// The model of contacts.
fn model(contact: Option<&ContactSection>) -> Result<String, String> {
    let (rolling, cohesion) =
        contact.map_or((RollingLaw::None, CohesionLaw::None), |contact| (contact.rolling, contact.cohesion));
    let cohesion = match cohesion {
        CohesionLaw::None => "",
        CohesionLaw::Sjkr => " cohesion sjkr",
        CohesionLaw::Dmt => return Err("LIGGGHTS has no cohesion \"dmt\"".to_owned()),
        CohesionLaw::Jkr => return Err("LIGGGHTS has no cohesion \"jkr\"".to_owned()),
    };
    let rolling = match rolling {
        RollingLaw::None => "",
        RollingLaw::ConstantTorque => " rolling_friction cdt",
        RollingLaw::ElasticPlastic => " rolling_friction epsd",
    };
    Ok(format!("model hertz tangential history{cohesion}{rolling}"))
}

/// The commands of the set-up.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    /// Commands before there is a box.
    pub(super) before: Vec<String>,
    /// Commands that make the box; a restart file brings its own.
    pub(super) space: Vec<String>,
    /// Commands after it.
    pub(super) after: Vec<String>,
    /// Commands that need the particles.
    pub(super) last: Vec<String>,
    /// Further settings from Turbid.
    pub(super) options: Options,
    /// Number of walls; their fixes are named by [`wall_fix`].
    pub(super) walls: usize,
}

/// [`SetUp::options`] for LIGGGHTS.
#[derive(Clone, Debug, Default, Deserialize)]
pub(crate) struct Options {
    /// Commands of the user.
    pub(super) commands: Vec<String>,
    /// File for the log of the set-up.
    pub(super) log_file: Option<PathBuf>,
}

/// Name of the fix of a wall.
pub(crate) fn wall_fix(index: usize) -> String {
    format!("wall{index}")
}

/// The commands for a case, with the smallest radius of contact (m) and the blocks of its processes along each axis, the first one
/// fastest.
pub(crate) fn plan(case: &SetUp, smallest: f64, grid: [usize; 3]) -> Result<Plan, String> {
    let texts = |commands: &[&str]| -> Vec<String> { commands.iter().map(ToString::to_string).collect() };
    let axes = case.domain.periodic.map(|periodic| if periodic { "p" } else { "f" }).join(" ");
    let mut before = texts(&[
        "units si",
        "atom_style granular",
        "atom_modify map hash sort 0 0",
        &format!("boundary {axes}"),
        "newton off",
        "communicate single vel yes",
        // These lift LIGGGHTS's bounds of 5e6 and 1e9 Pa on the stiffness.
        "hard_particles yes",
        "soft_particles yes",
    ]);
    if grid != [1; 3] {
        let [x, y, z] = grid;
        before.push(format!("processors {x} {y} {z} map xyz"));
    }
    let ([x, y, z], materials) =
        (case.domain.size, case.contact.as_ref().map_or(1, |contact| contact.materials.len()));
    let space = vec![
        format!("region box block 0 {x:e} 0 {y:e} 0 {z:e} units box"),
        format!("create_box {materials} box"),
    ];
    let mut after = vec![format!("neighbor {:e} bin", SKIN * smallest), "neigh_modify delay 0".to_owned()];
    after.extend(properties(case.contact.as_ref()));
    let model = model(case.contact.as_ref())?;
    after.extend([format!("pair_style gran {model}"), "pair_coeff * *".to_owned()]);
    if case.contact.is_none() {
        after.push("neigh_modify exclude group all all".to_owned());
    }
    let mut last = Vec::new();
    for (index, wall) in case.walls.iter().enumerate() {
        let (fix, primitive, material) = (wall_fix(index), primitive(wall)?, wall.material + 1);
        last.push(format!(
            "fix {fix} all wall/gran {model} primitive type {material} {primitive} store_force yes"
        ));
    }
    last.extend(HELD.map(|name| format!("fix {name} all property/atom {name} vector no no no 0 0 0")));
    last.extend(texts(&[
        "fix coupling all couple/cfd couple_every 0 mpi",
        "fix loads all couple/cfd/force transfer_torque yes",
        "fix motion all nve/sphere",
        "thermo_style custom step",
        "thermo 1000000000",
        &format!("compute {PAIRS} all pair/gran/local pos id force force_normal force_tangential"),
    ]));
    let options = Options::deserialize(&case.options).map_err(|e| format!("its options: {e}"))?;
    Ok(Plan { before, space, after, last, options, walls: case.walls.len() })
}

/// Elasticity by material, dissipation by pair of materials.
fn properties(contact: Option<&ContactSection>) -> Vec<String> {
    let list =
        |values: Vec<f64>| values.iter().fold(String::new(), |list, value| list + &format!(" {value:e}"));
    // Without contacts they are never used, but LIGGGHTS asks for them.
    let mut lists = ["1e7", "0.25", "1", "0"].map(|value| format!(" {value}"));
    let mut n = 1;
    if let Some(ContactSection { materials, pairs, .. }) = contact {
        n = materials.len();
        lists = [
            list(materials.iter().map(|m| m.youngs_modulus).collect()),
            list(materials.iter().map(|m| m.poisson_ratio).collect()),
            list(pairs.iter().map(|pair| pair.restitution).collect()),
            list(pairs.iter().map(friction).collect()),
        ];
    }
    let [young, poisson, restitution, friction] = lists;
    let mut all = vec![
        format!("fix young all property/global youngsModulus peratomtype{young}"),
        format!("fix poisson all property/global poissonsRatio peratomtype{poisson}"),
        format!(
            "fix restitution all property/global coefficientRestitution peratomtypepair {n}{restitution}"
        ),
        format!("fix friction all property/global coefficientFriction peratomtypepair {n}{friction}"),
    ];
    let Some(contact) = contact else { return all };
    let mut add = |fix: &str, name: &str, value: fn(&PairParams) -> f64| {
        let values = list(contact.pairs.iter().map(value).collect());
        all.push(format!("fix {fix} all property/global {name} peratomtypepair {n}{values}"));
    };
    if contact.rolling.is_given() {
        add("rolling", "coefficientRollingFriction", |pair| pair.rolling_friction);
        add("viscous", "coefficientRollingViscousDamping", |_| ROLLING_DAMPING);
    }
    if contact.cohesion == CohesionLaw::Sjkr {
        add("cohesion", "cohesionEnergyDensity", |pair| pair.cohesion_density);
    }
    all
}

/// LIGGGHTS's one coefficient of friction (-): a static one of zero switches friction off.
pub(crate) fn friction(pair: &PairParams) -> f64 {
    if pair.friction_static > 0.0 { pair.friction_kinetic } else { 0.0 }
}

/// A wall as LIGGGHTS's primitive, or why it has none for it.
pub(crate) fn primitive(wall: &WallSection) -> Result<String, String> {
    let cannot = |why| format!("wall `{}`: LIGGGHTS's primitive {why}", wall.name);
    match wall.surface {
        SurfaceSection::Plane { point, normal } => {
            let (axis, shear) = sliding_plane(wall, normal).map_err(cannot)?;
            Ok(format!("{}plane {:e}{shear}", AXES[axis], point[axis]))
        }
        SurfaceSection::Pipe { point, axis: direction, radius }
        | SurfaceSection::Rod { point, axis: direction, radius } => {
            let Some(axis) = axis_of(direction) else {
                return Err(cannot("cylinders stand along x, y or z"));
            };
            let [a, b] = [[1, 2], [0, 2], [0, 1]][axis];
            Ok(format!("{}cylinder {radius:e} {:e} {:e}", AXES[axis], point[a], point[b]))
        }
    }
}
