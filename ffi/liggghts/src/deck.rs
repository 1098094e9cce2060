//! The commands that set LIGGGHTS up: the same spheres, materials and walls as in the native engine.
//!
//! LIGGGHTS has Hertz's law with its own damping and a Coulomb spring along the surfaces (`model hertz tangential
//! history`). Its one coefficient of friction is the kinetic one; radii are those of contacts, enlargement included.

use super::LiggghtsParams;
use super::protocol::{Plan, wall_fix};
use super::session::PAIRS;
use turbid_core::contact::{ContactModel, PairParams};
use turbid_core::domain::Domain;
use turbid_core::math::Vec3;
use turbid_core::wall::{Surface, Wall};

/// Distance beyond contact within which pairs are listed, over the smallest radius: a list lasts until something has moved by
/// half of it.
const SKIN: f64 = 0.3;

/// Most that a unit vector of an axis differs from it.
const ALIGNED: f64 = 1e-9;

const MODEL: &str = "model hertz tangential history";

/// The commands for a box, with the smallest radius of contact (m).
pub(crate) fn plan(params: &LiggghtsParams, domain: &Domain, smallest: f64) -> Result<Plan, String> {
    let texts = |commands: &[&str]| -> Vec<String> { commands.iter().map(ToString::to_string).collect() };
    let axes = domain.periodic.map(|periodic| if periodic { "p" } else { "f" }).join(" ");
    let before = texts(&[
        "units si",
        "atom_style granular",
        "atom_modify map array sort 0 0",
        &format!("boundary {axes}"),
        "newton off",
        "communicate single vel yes",
        // These lift LIGGGHTS's bounds of 5e6 and 1e9 Pa on the stiffness.
        "hard_particles yes",
        "soft_particles yes",
    ]);
    let (size, materials) =
        (domain.size(), params.contact.as_ref().map_or(1, |contact| contact.materials.len()));
    let space = vec![
        format!("region box block 0 {:e} 0 {:e} 0 {:e} units box", size.x, size.y, size.z),
        format!("create_box {materials} box"),
    ];
    let mut after = vec![format!("neighbor {:e} bin", SKIN * smallest), "neigh_modify delay 0".to_owned()];
    after.extend(properties(params));
    after.extend([format!("pair_style gran {MODEL}"), "pair_coeff * *".to_owned()]);
    if params.contact.is_none() {
        after.push("neigh_modify exclude group all all".to_owned());
    }
    let mut last = Vec::new();
    for (index, wall) in params.touched_walls().iter().enumerate() {
        let (fix, primitive, material) = (wall_fix(index), primitive(wall)?, wall.material + 1);
        last.push(format!(
            "fix {fix} all wall/gran {MODEL} primitive type {material} {primitive} store_force yes"
        ));
    }
    last.extend(texts(&[
        "fix coupling all couple/cfd couple_every 0 mpi",
        "fix loads all couple/cfd/force transfer_torque yes",
        "fix motion all nve/sphere",
        "thermo_style custom step",
        "thermo 1000000000",
        &format!("compute {PAIRS} all pair/gran/local pos id force force_normal force_tangential"),
    ]));
    let (user, walls) = (params.commands.clone(), params.touched_walls().len());
    Ok(Plan { before, space, after, last, user, walls, log_file: params.log.clone() })
}

/// Elasticity by material, dissipation by pair of materials.
fn properties(params: &LiggghtsParams) -> [String; 4] {
    let list =
        |values: Vec<f64>| values.iter().fold(String::new(), |list, value| list + &format!(" {value:e}"));
    // Without contacts they are never used, but LIGGGHTS asks for them.
    let mut lists = ["1e7", "0.25", "1", "0"].map(|value| format!(" {value}"));
    let mut n = 1;
    if let Some(ContactModel { materials, pairs, .. }) = &params.contact {
        n = materials.len();
        lists = [
            list(materials.iter().map(|m| m.youngs_modulus).collect()),
            list(materials.iter().map(|m| m.poisson_ratio).collect()),
            list(pairs.iter().map(|pair| pair.restitution).collect()),
            list(pairs.iter().map(friction).collect()),
        ];
    }
    let [young, poisson, restitution, friction] = lists;
    [
        format!("fix young all property/global youngsModulus peratomtype{young}"),
        format!("fix poisson all property/global poissonsRatio peratomtype{poisson}"),
        format!(
            "fix restitution all property/global coefficientRestitution peratomtypepair {n}{restitution}"
        ),
        format!("fix friction all property/global coefficientFriction peratomtypepair {n}{friction}"),
    ]
}

/// LIGGGHTS's one coefficient of friction (-): a static one of zero switches friction off.
pub(crate) fn friction(pair: &PairParams) -> f64 {
    if pair.friction_static > 0.0 { pair.friction_kinetic } else { 0.0 }
}

/// A wall as LIGGGHTS's primitive, or why it has none for it.
pub(crate) fn primitive(wall: &Wall) -> Result<String, String> {
    let cannot = |why: &str| Err(format!("wall `{}`: LIGGGHTS's primitive {why}", wall.name));
    let velocity = wall.motion.velocity;
    if wall.motion.angular_velocity != Vec3::zeros() {
        return cannot("walls do not turn");
    }
    match wall.surface {
        Surface::Plane { point, normal } => {
            let Some(axis) = axis_of(normal) else {
                return cannot("planes stand across x, y or z");
            };
            let text = format!("{}plane {:e}", NAMES[axis], point[axis]);
            let along: Vec<usize> = (0..3).filter(|&i| velocity[i] != 0.0).collect();
            match along[..] {
                [] => Ok(text),
                [i] if i != axis => Ok(format!("{text} shear {} {:e}", NAMES[i], velocity[i])),
                [_] => cannot("planes do not move towards the particles"),
                _ => cannot("planes slide along one axis only"),
            }
        }
        Surface::Cylinder { point, axis: direction, radius, .. } => {
            let Some(axis) = axis_of(direction) else {
                return cannot("cylinders stand along x, y or z");
            };
            if velocity != Vec3::zeros() {
                return cannot("cylinders stand still here");
            }
            let [a, b] = [[1, 2], [0, 2], [0, 1]][axis];
            Ok(format!("{}cylinder {radius:e} {:e} {:e}", NAMES[axis], point[a], point[b]))
        }
    }
}

const NAMES: [&str; 3] = ["x", "y", "z"];

/// The axis that a unit vector lies along, either way.
fn axis_of(direction: Vec3) -> Option<usize> {
    (0..3).find(|&i| (direction[i].abs() - 1.0).abs() < ALIGNED)
}
