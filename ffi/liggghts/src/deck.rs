//! The commands that set LIGGGHTS up: the same spheres, materials and walls as the native engine has.
//!
//! LIGGGHTS has Hertz's law with its own damping and a Coulomb spring along the surfaces (`model hertz tangential
//! history`): moduli, Poisson's ratio and restitution as the case has them, the kinetic coefficient as the one of friction.
//! Radii are those of contacts, enlargement included.

use super::LiggghtsParams;
use super::protocol::{Plan, wall_fix};
use super::session::PAIRS;
use turbid_core::contact::PairParams;
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
    let axes = domain.periodic.map(|periodic| if periodic { "p" } else { "f" }).join(" ");
    let materials = params.contact.as_ref().map_or(1, |contact| contact.materials.len());
    let size = domain.size();
    let before = vec![
        "units si".to_owned(),
        "atom_style granular".to_owned(),
        "atom_modify map array sort 0 0".to_owned(),
        format!("boundary {axes}"),
        "newton off".to_owned(),
        "communicate single vel yes".to_owned(),
        // The stiffness of the case is what it is: these lift LIGGGHTS's bounds of 5e6 and 1e9 Pa.
        "hard_particles yes".to_owned(),
        "soft_particles yes".to_owned(),
    ];
    let space = vec![
        format!("region box block 0 {:e} 0 {:e} 0 {:e} units box", size.x, size.y, size.z),
        format!("create_box {materials} box"),
    ];
    let mut after = vec![format!("neighbor {:e} bin", SKIN * smallest), "neigh_modify delay 0".to_owned()];
    after.extend(properties(params));
    after.push(format!("pair_style gran {MODEL}"));
    after.push("pair_coeff * *".to_owned());
    if params.contact.is_none() {
        after.push("neigh_modify exclude group all all".to_owned());
    }
    let walls: &[Wall] = if params.contact.is_some() { &params.walls } else { &[] };
    let mut last = Vec::new();
    for (index, wall) in walls.iter().enumerate() {
        let primitive = primitive(wall)?;
        last.push(format!(
            "fix {} all wall/gran {MODEL} primitive type {} {primitive} store_force yes",
            wall_fix(index),
            wall.material + 1
        ));
    }
    last.extend(
        [
            "fix coupling all couple/cfd couple_every 0 mpi",
            "fix loads all couple/cfd/force transfer_torque yes",
            "fix motion all nve/sphere",
            "thermo_style custom step",
            "thermo 1000000000",
        ]
        .map(str::to_owned),
    );
    last.push(format!("compute {PAIRS} all pair/gran/local pos id force force_normal force_tangential"));
    Ok(Plan {
        before,
        space,
        after,
        last,
        user: params.commands.clone(),
        walls: walls.len(),
        log_file: params.log.clone(),
    })
}

/// Elasticity by material, dissipation by pair of materials.
fn properties(params: &LiggghtsParams) -> Vec<String> {
    let (materials, pairs) = match &params.contact {
        Some(contact) => (contact.materials.clone(), contact.pairs.clone()),
        // Never used, but LIGGGHTS asks for them.
        None => (
            vec![turbid_core::contact::Material { youngs_modulus: 1e7, poisson_ratio: 0.25 }],
            vec![PairParams {
                restitution: 1.0,
                friction_static: 0.0,
                friction_kinetic: 0.0,
                transition_velocity: 1.0,
            }],
        ),
    };
    let list = |values: Vec<f64>| -> String {
        values.iter().fold(String::new(), |list, value| list + &format!(" {value:e}"))
    };
    let n = materials.len();
    let young = list(materials.iter().map(|m| m.youngs_modulus).collect());
    let poisson = list(materials.iter().map(|m| m.poisson_ratio).collect());
    let restitution = list(pairs.iter().map(|pair| pair.restitution).collect());
    let friction = list(pairs.iter().map(friction).collect());
    vec![
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

/// A wall in LIGGGHTS's words, or why it has none for it.
pub(crate) fn primitive(wall: &Wall) -> Result<String, String> {
    let cannot = |why: &str| Err(format!("wall `{}`: {why}", wall.name));
    if wall.motion.angular_velocity != Vec3::zeros() {
        return cannot("LIGGGHTS's primitive walls do not turn");
    }
    let velocity = wall.motion.velocity;
    match wall.surface {
        Surface::Plane { point, normal } => {
            let Some(axis) = axis_of(normal) else {
                return cannot("LIGGGHTS's primitive planes stand across x, y or z");
            };
            let text = format!("{}plane {:e}", NAMES[axis], point[axis]);
            let along: Vec<usize> = (0..3).filter(|&i| velocity[i] != 0.0).collect();
            match along[..] {
                [] => {}
                [i] if i != axis => return Ok(format!("{text} shear {} {:e}", NAMES[i], velocity[i])),
                [_] => return cannot("LIGGGHTS's primitive planes do not move towards the particles"),
                _ => return cannot("LIGGGHTS's primitive planes slide along one axis only"),
            }
            Ok(text)
        }
        Surface::Cylinder { point, axis: direction, radius, .. } => {
            let Some(axis) = axis_of(direction) else {
                return cannot("LIGGGHTS's primitive cylinders stand along x, y or z");
            };
            if velocity != Vec3::zeros() {
                return cannot("LIGGGHTS's primitive cylinders stand still here");
            }
            let [a, b] = match axis {
                0 => [1, 2],
                1 => [0, 2],
                _ => [0, 1],
            };
            Ok(format!("{}cylinder {radius:e} {:e} {:e}", NAMES[axis], point[a], point[b]))
        }
    }
}

const NAMES: [&str; 3] = ["x", "y", "z"];

/// The axis that a unit vector lies along, either way.
fn axis_of(direction: Vec3) -> Option<usize> {
    (0..3).find(|&i| (direction[i].abs() - 1.0).abs() < ALIGNED)
}
