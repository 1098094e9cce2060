//! Contacts, materials and the engine as the user writes them.

use crate::contact::{
    CohesionLaw, ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Geometry, RollingLaw, TwistingLaw,
    VanDerWaals,
};
use crate::document::{non_negative, positive};
use crate::engine::EngineProcess;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// Contacts of particles with each other and with walls; the defaults are those of Marquardt et al. (2024), but for the friction.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// Contacts between particles and with walls. Default true.
    pub enabled: bool,
    /// Young's modulus (Pa). Default 5000, far below real materials, so that contacts last many time steps.
    #[schemars(transform = positive)]
    pub youngs_modulus: f64,
    /// Poisson's ratio (-), above -1 and at most 0.5. Default 0.245.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson_ratio: f64,
    /// Coefficient of restitution (-), above 0 and at most 1. Default 0.926.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub restitution: f64,
    /// Static friction coefficient (-). Default 0.32.
    #[schemars(transform = non_negative)]
    pub friction_static: f64,
    /// Kinetic friction coefficient (-), the only one that LIGGGHTS has. Default 0.16.
    #[schemars(transform = non_negative)]
    pub friction_kinetic: f64,
    /// Speed of transition from static to kinetic friction (m/s); only with `friction = "nassauer_kuna"`. Default 0.001.
    #[schemars(transform = positive)]
    pub transition_velocity: f64,
    /// Coefficient of rolling friction (-); only with `rolling`. Default 0.
    #[schemars(transform = non_negative)]
    pub rolling_friction: f64,
    /// Work of adhesion (J/m2), what it takes to part a unit of area; only with `cohesion = "dmt"` or `"jkr"`. Default 0.
    #[schemars(transform = non_negative)]
    pub work_of_adhesion: f64,
    /// Density of the energy of cohesion (J/m3); only with `cohesion = "sjkr"`. Default 0.
    #[schemars(transform = non_negative)]
    pub cohesion_density: f64,
    /// Distance by which every surface is grown for contacts (cells); a dry run has `dry.enlargement` instead. Default 0.2, and 0
    /// with `lubrication`.
    #[schemars(transform = non_negative)]
    pub enlargement: Option<f64>,
    /// Law of the elastic force. Default `"overlap_volume"`.
    pub law: ElasticLaw,
    /// Damping of the normal force. Default `"hunt_crossley"`.
    pub damping: DampingLaw,
    /// Law of friction. Default `"mindlin"`.
    pub friction: FrictionLaw,
    /// Law of the resistance to rolling, of bodies without edges and of cylinders. Default `"none"`.
    pub rolling: RollingLaw,
    /// Law of the resistance to twisting. Default `"none"`.
    pub twisting: TwistingLaw,
    /// Law of cohesion, a pull between bodies that touch. Default `"none"`.
    pub cohesion: CohesionLaw,
    /// Measurement of overlaps. Default "exact".
    pub geometry: GeometryKind,
    /// Samples per direction; only with `geometry = "sampled"`. Default 8.
    #[schemars(extend("minimum" = 2, "maximum" = 64))]
    pub samples: u32,
    /// Sub-steps of the particles in each step, at most 10000. Default 1.
    #[schemars(extend("minimum" = 1, "maximum" = 10000))]
    pub substeps: u32,
    /// Forces and torques of the fluid in gaps of spheres and ellipsoids with each other, with walls and with the faces of polyhedra that the lattice
    /// does not resolve. Without this section there are none.
    pub lubrication: Option<LubricationSection>,
    /// Van der Waals force of spheres with each other and with walls, over gaps and in contact; in place of `cohesion`. Without this section there is none.
    pub van_der_waals: Option<VanDerWaals>,
    /// Pairs of materials with values of their own; all others have the values above.
    pub pairs: Vec<PairSection>,
}

/// Forces of the fluid in narrow gaps.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LubricationSection {
    /// Height of the roughness of the surfaces (m): in narrower gaps the resistance is that of this gap. Less than a cell. Default: a
    /// thousandth of the radius of the smallest particle.
    #[schemars(transform = positive)]
    pub roughness: Option<f64>,
}

impl Default for ContactSection {
    fn default() -> Self {
        Self {
            enabled: true,
            youngs_modulus: 5e3,
            poisson_ratio: 0.245,
            restitution: 0.926,
            friction_static: 0.32,
            friction_kinetic: 0.16,
            transition_velocity: 1e-3,
            rolling_friction: 0.0,
            work_of_adhesion: 0.0,
            cohesion_density: 0.0,
            enlargement: None,
            law: ElasticLaw::OverlapVolume,
            damping: DampingLaw::HuntCrossley,
            friction: FrictionLaw::Mindlin,
            rolling: RollingLaw::None,
            twisting: TwistingLaw::None,
            cohesion: CohesionLaw::None,
            geometry: GeometryKind::Exact,
            samples: 8,
            substeps: 1,
            lubrication: None,
            van_der_waals: None,
            pairs: Vec::new(),
        }
    }
}

impl ContactSection {
    /// The part of the contact model that is alike for all materials, but for the enlargement.
    pub(in crate::case) fn model(&self) -> ContactModel {
        ContactModel {
            geometry: match self.geometry {
                GeometryKind::Exact => Geometry::Exact,
                GeometryKind::Sampled => Geometry::Sampled { samples: self.samples },
            },
            law: self.law,
            damping: self.damping,
            friction: self.friction,
            rolling: self.rolling,
            twisting: self.twisting,
            cohesion: self.cohesion,
            van_der_waals: self.van_der_waals,
            ..ContactModel::default()
        }
    }

    /// Distance by which every surface is grown (cells).
    pub(in crate::case) fn enlargement(&self) -> f64 {
        self.enlargement.unwrap_or(if self.lubrication.is_some() { 0.0 } else { 0.2 })
    }

    /// A key with a value that the engine does not have, or a program does not get, and the value as the message says it.
    pub(in crate::case) fn native_only(&self, engine: &EngineSection) -> Option<(&'static str, String)> {
        let law = matches!(self.law, ElasticLaw::OverlapVolume | ElasticLaw::Hertz);
        let damping = matches!(self.damping, DampingLaw::HuntCrossley | DampingLaw::Tsuji);
        let cohesion =
            |known: &[CohesionLaw]| self.cohesion != CohesionLaw::None && !known.contains(&self.cohesion);
        let (named, rolling, cohesion) = match engine {
            EngineSection::Named(EngineKind::Native) => return None,
            EngineSection::Named(EngineKind::Liggghts) => (true, false, cohesion(&[CohesionLaw::Sjkr])),
            EngineSection::Named(EngineKind::Lammps) => {
                (true, self.rolling.is_given(), cohesion(&[CohesionLaw::Dmt, CohesionLaw::Jkr]))
            }
            EngineSection::Process(_) => (false, self.rolling.is_given(), cohesion(&[])),
        };
        let found = [
            ("contact.geometry", json!(self.geometry), self.geometry == GeometryKind::Sampled),
            ("contact.law", json!(self.law), named && !law),
            ("contact.damping", json!(self.damping), named && !damping),
            ("contact.friction", json!(self.friction), self.friction == FrictionLaw::MindlinDeresiewicz),
            ("contact.rolling", json!(self.rolling), rolling),
            ("contact.twisting", json!(self.twisting), self.twisting != TwistingLaw::None),
            ("contact.cohesion", json!(self.cohesion), cohesion),
            ("contact.van_der_waals", json!(self.van_der_waals), self.van_der_waals.is_some()),
        ];
        found.into_iter().find_map(|(key, value, given)| given.then(|| (key, value.to_string())))
    }
}

/// Measurement of overlaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GeometryKind {
    /// Closed forms where they exist.
    Exact,
    /// The sampled scheme of Marquardt et al. (2024).
    Sampled,
}

/// Dissipation between two materials.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairSection {
    /// The names of the two materials, e.g. `["glass", "steel"]` or `["glass", "glass"]`; "default" is that of
    /// `[contact]`.
    pub materials: [String; 2],
    /// Coefficient of restitution (-), above 0 and at most 1. Default: that of `[contact]`, as for all that follow.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub restitution: Option<f64>,
    /// Static friction coefficient (-).
    #[schemars(transform = non_negative)]
    pub friction_static: Option<f64>,
    /// Kinetic friction coefficient (-).
    #[schemars(transform = non_negative)]
    pub friction_kinetic: Option<f64>,
    /// Speed of transition from static to kinetic friction (m/s).
    #[schemars(transform = positive)]
    pub transition_velocity: Option<f64>,
    /// Coefficient of rolling friction (-).
    #[schemars(transform = non_negative)]
    pub rolling_friction: Option<f64>,
    /// Work of adhesion (J/m2).
    #[schemars(transform = non_negative)]
    pub work_of_adhesion: Option<f64>,
    /// Density of the energy of cohesion (J/m3).
    #[schemars(transform = non_negative)]
    pub cohesion_density: Option<f64>,
}

/// Elasticity of a material that particles and walls name.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSection {
    /// Its name.
    pub name: String,
    /// Young's modulus (Pa). Default: that of `[contact]`.
    #[schemars(transform = positive)]
    pub youngs_modulus: Option<f64>,
    /// Poisson's ratio (-), above -1 and at most 0.5. Default: that of `[contact]`.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson_ratio: Option<f64>,
}

/// The engine that moves the particles.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(extend("dependentSchemas" = {
    "liggghts": { "properties": { "engine": { "const": "liggghts" } }, "required": ["engine"] },
    "lammps": { "properties": { "engine": { "const": "lammps" } }, "required": ["engine"] }
}))]
pub struct DemSection {
    /// "native"; or "liggghts", for spheres only and with a program built with the cargo feature `liggghts`; or "lammps",
    /// for spheres only and with Debian's `liblammps0`; or a program that speaks the engine protocol, `{ command = ["python3", "spheres.py"] }`. Default "native".
    pub engine: EngineSection,
    /// Settings of LIGGGHTS; only with `engine = "liggghts"`.
    pub liggghts: Option<LiggghtsSection>,
    /// Settings of LAMMPS; only with `engine = "lammps"`.
    pub lammps: Option<LammpsSection>,
}

/// The engine that moves the particles, by name or as a program.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum EngineSection {
    /// One that turbid knows.
    Named(EngineKind),
    /// A program of the user.
    Process(ProcessSection),
}

impl EngineSection {
    /// True of the engine of turbid.
    pub(in crate::case) fn is_native(&self) -> bool {
        self.is(EngineKind::Native)
    }

    /// True of this engine.
    pub(in crate::case) fn is(&self, of: EngineKind) -> bool {
        matches!(self, Self::Named(kind) if *kind == of)
    }
}

impl Default for EngineSection {
    fn default() -> Self {
        Self::Named(EngineKind::default())
    }
}

/// A program that moves the particles and speaks the engine protocol (`docs/engine-protocol.md`). It runs only with `--allow-engine`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProcessSection {
    /// The program and its arguments. It runs in `folder`; a program with a slash in its name is relative to it, any other one is
    /// looked for as the shell does.
    #[schemars(extend("minItems" = 1))]
    pub command: Vec<String>,
    /// Longest time that it may take for a step (s); for the set-up, for saving and for resuming it has ten times as long. Then the
    /// run ends with an error. Default 60.
    #[serde(default = "default_timeout")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e6))]
    pub timeout: f64,
    /// Folder in which it runs, relative to that of the case file. Default: that of the case file.
    #[serde(default)]
    pub folder: String,
    /// Number of processes of the program, each of which has a part of the particles and speaks version 2 of the protocol; at most one for
    /// each rank. Default 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1))]
    pub processes: u32,
}

fn default_timeout() -> f64 {
    60.0
}

fn one() -> u32 {
    1
}

/// Engines that move particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EngineKind {
    /// That of turbid.
    #[default]
    Native,
    /// LIGGGHTS with its model `hertz tangential history`, whatever `contact.law`, `damping` and `friction` say. Its one
    /// coefficient of friction is `friction_kinetic`, or 0 where `friction_static` is 0; `transition_velocity` means nothing
    /// to it.
    Liggghts,
    /// LAMMPS with its `pair_style granular`: Hertz's law with Tsuji's damping, whatever `contact.law` and `damping` say, and the springs of
    /// Mindlin. Its one coefficient of friction is that of LIGGGHTS.
    Lammps,
}

/// Settings of LIGGGHTS.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LiggghtsSection {
    /// "worker": in a process of its own, whose crash ends as an error message; "own": in that of turbid, in all of them in an MPI job, each
    /// with a part of the spheres. Default "worker".
    pub process: EngineProcess,
    /// LIGGGHTS commands, given after all others of the set-up and before the first step: groups, regions, and fixes that add
    /// forces (`viscous`, `drag`, `addforce`, `spring`, `spring/self`). All others are refused. Default `[]`.
    pub commands: Vec<String>,
    /// Longest time that a worker may take for a step (s); for the set-up and for saving it has ten times as long. Then
    /// the run ends with an error. Default 60.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e6))]
    pub timeout: Option<f64>,
}

/// Settings of LAMMPS.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LammpsSection {
    /// "worker": in a process of its own, whose end is an error message; "own": in that of turbid, in all of them in an MPI job, each
    /// with a part of the spheres; there an error of LAMMPS ends the job. Default "worker".
    pub process: EngineProcess,
    /// Longest time that a worker may take for a step (s); for the set-up and for saving it has ten times as long. Then
    /// the run ends with an error. Default 60.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e6))]
    pub timeout: Option<f64>,
}
