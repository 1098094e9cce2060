//! The case file as the user writes it: every key, its unit and its default, in this one place.
//!
//! `turbid check --schema` prints what stands here as a JSON schema. Numbers are in SI units unless said otherwise.

mod contacts;
mod insertion;
mod motion;
mod particles;
mod pictures;
mod run;
mod shapes;
mod start;
mod statistics;
mod walls;

use crate::coupling::ForceBalance;
pub use crate::coupling::SolidOperator;
use crate::document::{Format, Schema, free, non_negative, one_of, positive};
use crate::fluid::Precision;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::LazyLock;

pub use contacts::{
    ContactSection, DemSection, EngineKind, EngineSection, GeometryKind, LammpsSection, LiggghtsSection,
    MaterialSection, PairSection, ProcessSection,
};
pub use insertion::{AmountBy, InsertionSection, RegionSection, RemovalPlace, RemovalSection};
pub use motion::{
    Freedom, MotionSection, NamedMotion, OscillationSection, PrescribedSection, ScalarOscillation,
    ScalarSection, VariableScalar, VariableVector, VectorSection,
};
pub use particles::{
    Entry, LogNormal, MovingEntry, Normal, OrientationSection, Overlaps, ParticleSection, PositionsBy,
    RelativeDistance, RelaxDistance, SharesOf, SizeShare, SizeSpread, Sizes, Weibull,
};
pub use pictures::{BodyColour, PictureSection, Quantity, SliceSection, ViewSection, ViewSlice};
pub use run::{CheckpointEvery, Duration, Every, LoadBalancing, RunEnd, RunSection, SteadySection};
pub use shapes::{
    CompositeSection, CubeSection, CylinderSection, LengthUnit, MeshSection, NamedUnit, PartSection,
    ShapeSection,
};
pub use start::{FluidStart, PoiseuilleSection, ShearSection, TaylorGreenSection};
pub use statistics::{DynamicsSection, PlaneName, ProfileSection, StructureSection};
pub use walls::{
    DiscSection, FACES, FaceSection, GivenProfile, InletProfileSection, InletSection, OutletSection,
    PatchSection, PatchesSection, PlaneSection, ProfileKind, RectangleSection, RoundSection, SideKind,
    WallMeshSection, WallSection, WallShape,
};

/// Remedy for a dynamic viscosity.
const DYNAMIC: &str =
    "write viscosity = ... in m^2/s, the dynamic viscosity in Pa s over the density in kg/m^3";

impl Format for Case {
    const EARLIER_NAMES: &'static [(&'static str, &'static str)] =
        &[("homogenised", "paper"), ("overlap_volume", "paper")];

    const OTHER_NAMES: &'static [(&'static str, &'static str, &'static str)] = &[
        ("radius", "diameter", "write diameter = 2 radius"),
        ("radius", "axes", "write axes = [x, y, z], whole lengths from end to end"),
        ("dt", "time_step", "write time_step = ... in seconds"),
        ("tau", "relaxation_time", "write relaxation_time = ... in time steps"),
        ("phi", "volume_fraction", "write volume_fraction = ..."),
        ("nu", "viscosity", "write viscosity = ... in m^2/s"),
        ("kinematic_viscosity", "viscosity", "write viscosity = ... in m^2/s"),
        ("dynamic_viscosity", "viscosity", DYNAMIC),
        ("mu", "viscosity", DYNAMIC),
        ("eta", "viscosity", DYNAMIC),
        ("picture_plane", "pictures", "write pictures = [{ slice = { normal = \"y\", position = ... } }]"),
        ("picture_range", "pictures", "write pictures = [{ slice = { range = [0, ...] } }]"),
    ];

    /// Positions replace what places particles at random.
    const REPLACED: (&'static [&'static str], &'static [&'static str]) =
        (&["file", "list"], &["sizes", "seed", "minimum_gap"]);
}

/// A case of turbid: resolved particles in a fluid in a box, or particles alone (`[dry]`). SI units.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [
    { "required": ["fluid", "lattice", "particles"], "not": { "required": ["dry"] } },
    { "required": ["dry", "particles"], "not": { "anyOf": [{ "required": ["fluid"] }, { "required": ["lattice"] }] } }
]))]
pub struct Case {
    /// The box.
    pub domain: DomainSection,
    /// Walls in the box besides its closed faces.
    #[serde(default)]
    pub walls: Vec<WallSection>,
    /// The fluid. A case has either `[fluid]` and `[lattice]`, or `[dry]`.
    pub fluid: Option<FluidSection>,
    /// Cell size, time step and method.
    pub lattice: Option<LatticeSection>,
    /// Particles without a fluid.
    #[schemars(with = "Option<DryKeys>")]
    pub dry: Option<DrySection>,
    /// Kinds of particles; the diameter of the first kind, as its shape has it before `sizes` scale it, is the reference length D.
    #[serde(default)]
    #[schemars(extend("minItems" = 1))]
    pub particles: Vec<ParticleSection>,
    /// Particles that come during the run.
    #[serde(default)]
    pub insertion: Vec<InsertionSection>,
    /// Particles that go during the run.
    #[serde(default)]
    pub removal: Vec<RemovalSection>,
    /// Materials that particles and walls name.
    #[serde(default)]
    pub materials: Vec<MaterialSection>,
    /// Contacts of particles with each other and with walls. The defaults are those of Marquardt et al. (2024).
    #[serde(default)]
    pub contact: ContactSection,
    /// The engine that moves the particles.
    #[serde(default)]
    pub dem: DemSection,
    /// Forces that drive particles and fluid.
    #[serde(default)]
    pub driving: DrivingSection,
    /// Length of the run, and number of threads.
    pub run: RunSection,
    /// Files to write.
    #[serde(default)]
    pub output: OutputSection,
}

impl Case {
    /// True if there are particles of a section, or will be.
    pub fn has_particles(&self, section: usize) -> bool {
        !self.particles[section].is_empty()
            || self.insertion.iter().any(|insertion| insertion.kind == section)
    }
}

/// The box.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomainSection {
    /// Edges: `[x, y, z]` in metres, or `{ diameters = [x, y, z] }`. Rounded to whole cells, with a warning.
    pub size: Size,
    /// Periodic directions; the others end at `faces`, no-slip walls by default. Default `[true, true, true]`.
    #[serde(default = "all_periodic")]
    pub periodic: [bool; 3],
    /// Closed faces: `"z+" = { velocity = [1e-3, 0, 0] }`, `"x-" = { inlet = { velocity = [1e-3, 0, 0] } }`,
    /// `"x+" = { outlet = { pressure = 0 } }`, `"y-" = { free_slip = true }`. Default: walls at rest.
    #[serde(default)]
    #[schemars(schema_with = "walls::faces")]
    pub faces: BTreeMap<String, FaceSection>,
}

fn all_periodic() -> [bool; 3] {
    [true; 3]
}

/// Edges of the box.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Size {
    /// In metres.
    Metres(#[schemars(transform = positive)] [f64; 3]),
    /// In diameters of the first kind of particle.
    Relative(RelativeSize),
}

/// Edges of the box in diameters.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RelativeSize {
    /// Edges in diameters of the first kind of particle (of the sphere of equal volume).
    #[schemars(transform = positive)]
    pub diameters: [f64; 3],
}

/// Particles without a fluid.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "DryKeys")]
pub struct DrySection {
    /// Time step.
    pub step: DryStep,
    /// Distance by which every surface is grown for contacts (m).
    pub enlargement: f64,
}

/// Time step of a run without a fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DryStep {
    /// In seconds.
    Time(f64),
    /// By the speed (m/s) of the fastest impacts that matter.
    ImpactSpeed(f64),
}

/// Particles without a fluid: exactly one of `time_step`, `impact_speed`.
#[derive(Deserialize, JsonSchema)]
#[serde(rename = "DrySection", deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["time_step"] }, { "required": ["impact_speed"] }]))]
struct DryKeys {
    /// Time step (s), of which contacts should last 50 or more.
    #[schemars(transform = positive)]
    time_step: Option<f64>,
    /// Speed (m/s) of the fastest impacts that matter: the time step is a 50th of the shortest impact of spheres of the
    /// same volume at this speed (between flat faces an impact may last half as long).
    #[schemars(transform = positive)]
    impact_speed: Option<f64>,
    /// Distance by which every surface is grown for contacts (m). Default 0.
    #[serde(default)]
    #[schemars(transform = non_negative)]
    enlargement: f64,
}

impl TryFrom<DryKeys> for DrySection {
    type Error = &'static str;

    fn try_from(keys: DryKeys) -> Result<Self, Self::Error> {
        let step = match (keys.time_step, keys.impact_speed) {
            (Some(step), None) => DryStep::Time(step),
            (None, Some(speed)) => DryStep::ImpactSpeed(speed),
            _ => return Err("exactly one of `time_step` and `impact_speed` is needed"),
        };
        Ok(Self { step, enlargement: keys.enlargement })
    }
}

/// The fluid: its density, and exactly one of `viscosity`, `archimedes`, `galileo`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of)]
pub struct FluidSection {
    /// Density (kg/m^3).
    #[schemars(transform = positive)]
    pub density: f64,
    /// Its viscosity.
    #[serde(flatten)]
    pub viscosity: ViscosityBy,
    /// Storage of the populations: "f32"; "f64", twice the memory; or "f16", half of it and of its traffic, at 3 to 4 digits
    /// (validation/precision). Default "f32".
    #[serde(default)]
    pub precision: Precision,
    /// Flow at the start: "rest"; "couette", linear between the two closed faces of one direction that slide; `{ uniform = [x, y, z] }`
    /// (m/s); `{ shear = { gradient = [x, y, z], along = "z" } }`; `{ poiseuille = { velocity = [x, y, z] } }`; or
    /// `{ taylor_green = { velocity = ... } }`. Also of the free bodies without a velocity of their own. Default "rest".
    #[serde(default)]
    pub start: FluidStart,
}

/// Number that gives the viscosity of a fluid.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViscosityBy {
    /// Kinematic viscosity nu (m^2/s); water has 1e-6.
    Viscosity(#[schemars(transform = positive)] f64),
    /// Archimedes number g |s - 1| D^3 / nu^2 (-) of the first kind of particle, density ratio s.
    Archimedes(#[schemars(transform = positive)] f64),
    /// Galileo number (-), the square root of the Archimedes number.
    Galileo(#[schemars(transform = positive)] f64),
}

/// The lattice: `cells_per_diameter`, and exactly one of `relaxation_time`, `time_step`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of)]
pub struct LatticeSection {
    /// Cells per diameter of the first kind of particle (-), at least 2; 9 to 27 is usual.
    #[schemars(extend("minimum" = 2))]
    pub cells_per_diameter: f64,
    /// Its time step.
    #[serde(flatten)]
    pub time: TimeStepBy,
    /// Collision operator: "trt" with `magic_parameter`; "bgk"; or, with the coupling "saturated", `"recursive_regularised"`, stable at
    /// relaxation times near 0.5, for high Reynolds numbers. Default "trt" with the coupling "saturated", "bgk" with "homogenised".
    pub collision: Option<CollisionKind>,
    /// Magic parameter of "trt" (-), above 0; 3/16 puts walls exactly half-way between cells, 1/8 particles where they are.
    /// Default 1/8 with the coupling "saturated", 3/16 with "homogenised".
    #[schemars(transform = positive)]
    pub magic_parameter: Option<f64>,
    /// Smagorinsky's constant (-) of `"recursive_regularised"`: eddies that the lattice does not resolve have the viscosity `(C dx)^2 |S|`.
    /// 0.1 to 0.2 is usual. Default: none.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub smagorinsky: Option<f64>,
    /// Coupling of particles and fluid: "saturated", partially saturated cells with exact volume fractions, whose drag
    /// does not depend on the relaxation time, or "homogenised", the homogenised velocity of Marquardt et al. (2024). Default
    /// "saturated".
    #[serde(default)]
    pub coupling: Coupling,
    /// Operator of "saturated" in solid cells. Default "sc3".
    pub solid_operator: Option<SolidOperator>,
    /// Width of the cosine ramp of the solid fraction of "homogenised" (cells). Default 0.5.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 2))]
    pub solid_ramp_width: Option<f64>,
}

/// Number that gives the time step of a lattice.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TimeStepBy {
    /// Relaxation time (time steps), above 0.5; 0.51 to 1 is usual, 0.55 a good start.
    RelaxationTime(#[schemars(extend("exclusiveMinimum" = 0.5))] f64),
    /// Time step of the fluid (s); dx^2 / (60 nu) gives a relaxation time of 0.55.
    TimeStep(#[schemars(transform = positive)] f64),
}

/// Collision operator.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CollisionKind {
    /// Bhatnagar, Gross and Krook: one relaxation time.
    Bgk,
    /// Two relaxation times.
    Trt,
    /// Recursive regularised (Malaspinas 2015), with two relaxation times in cells with solids.
    RecursiveRegularised,
}

/// Coupling of particles and fluid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coupling {
    /// Homogenised velocity by the exact difference, as in Marquardt et al. (2024).
    #[serde(alias = "paper")]
    Homogenised,
    /// Partially saturated cells with exact volume fractions.
    #[default]
    Saturated,
}

/// Forces that drive particles and fluid.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrivingSection {
    /// Gravity (m/s^2): `[x, y, z]`, or a number for the direction -z. Default 9.80665.
    pub gravity: Gravity,
    /// Region in which the force acts that balances the submerged weight; closed directions have none, their walls bear the
    /// weight. Default "mixture".
    pub force_balance: Option<ForceBalance>,
    /// Removes the mean volume flux along periodic directions by a controller. Default: true along those in which no
    /// `body_acceleration` acts, but false in a box that is closed along gravity or has moving walls. `true` together with a
    /// `body_acceleration` along a periodic direction is refused.
    pub zero_net_flux: Option<bool>,
    /// Mean velocity of the mixture by volume (m/s), `net_flux` of series.csv, which a controller keeps along periodic directions in place
    /// of `zero_net_flux`.
    pub net_flux: Option<[f64; 3]>,
    /// Uniform acceleration of the fluid besides all else (m/s^2): `[x, y, z]`, `{ oscillation = { amplitude = [...], frequency = ... } }`
    /// or `{ table = [[t, x, y, z], ...] }`. Default `[0, 0, 0]`.
    pub body_acceleration: VectorSection,
}

impl Default for DrivingSection {
    fn default() -> Self {
        Self {
            gravity: Gravity::Downwards(9.80665),
            force_balance: None,
            zero_net_flux: None,
            net_flux: None,
            body_acceleration: VectorSection::default(),
        }
    }
}

/// Gravity as a vector, or as a magnitude that points along -z.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Gravity {
    /// Along -z (m/s^2).
    Downwards(#[schemars(transform = non_negative)] f64),
    /// Any direction (m/s^2).
    Vector([f64; 3]),
}

/// Files to write.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSection {
    /// Directory for all output, relative to where turbid is started. Default `out/<name of the case file>`.
    #[schemars(transform = free)]
    pub directory: Option<String>,
    /// Rows of series.csv, which all means are taken from: cannot be "never". Default: 1000 over the run.
    pub series_every: Option<Every>,
    /// Fields (.vti): velocity, pressure, solid fraction. Default: 5 over the run.
    #[schemars(transform = free)]
    pub fields_every: Option<Every>,
    /// Particles as points (.vtp): position, orientation, motion, forces, in double precision. Default: 50 over the run.
    #[schemars(transform = free)]
    pub particles_every: Option<Every>,
    /// Surfaces of all particles as triangles (.vtp), 11 kB per sphere. Default: as often as particles, but "never" where
    /// they have more than 100000 triangles: 312 spheres or 8333 cubes.
    #[schemars(transform = free)]
    pub surfaces_every: Option<Every>,
    /// Rows of profiles.csv, where there are `profiles`. Default: 100 over the run.
    #[schemars(transform = free)]
    pub profiles_every: Option<Every>,
    /// Profiles of particles and fluid along axes of the box, in profiles.csv, and their means over time. Default: none.
    #[serde(default)]
    #[schemars(transform = free)]
    pub profiles: Vec<ProfileSection>,
    /// Structure of the particles: pair distribution, neighbours, contact network, orientations. Default: none.
    #[schemars(transform = free)]
    pub structure: Option<StructureSection>,
    /// Motion of the particles over time: mean squared displacements, self-diffusion, autocorrelation of velocities. Default: none.
    #[schemars(transform = free)]
    pub dynamics: Option<DynamicsSection>,
    /// Columns of series.csv whose means, standard errors and transients `averages` of summary.json has, beside those of the other tables of
    /// statistics. Default: none.
    #[serde(default)]
    #[schemars(transform = free)]
    pub average: Vec<String>,
    /// Ids of the particles whose paths `particle_series.csv` has. Default: the 16 lowest ids.
    #[serde(default)]
    #[schemars(transform = free, extend("maxItems" = 10_000))]
    pub paths: Vec<u64>,
    /// Contacts (.vtp). Default: as often as particles.
    #[schemars(transform = free)]
    pub contacts_every: Option<Every>,
    /// Wear of walls from meshes (.vtp): contact force and work of friction by facet, summed over time from the start. Default: "never".
    #[schemars(transform = free)]
    pub wear_every: Option<Every>,
    /// Pictures (.png). Default: 10 over the run.
    #[schemars(transform = free)]
    pub picture_every: Option<Every>,
    /// Pictures, each a slice of the flow or a view of the box. Default: a slice of the speed, and a view; in a dry run a view.
    #[schemars(transform = free)]
    pub pictures: Option<Vec<PictureSection>>,
    /// Checkpoints, from which `turbid resume` continues; the last two are kept. Default `{ wall_time = 600 }`, with the engine
    /// LIGGGHTS "never".
    #[schemars(transform = free)]
    pub checkpoint_every: Option<CheckpointEvery>,
    /// A checkpoint at the end, with which a finished run can be extended or branched off. Default: true unless `checkpoint_every` is "never".
    #[schemars(transform = free)]
    pub checkpoint_at_end: Option<bool>,
}

/// An axis of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

/// The JSON schema of the case file, for editors.
pub fn schema() -> String {
    Schema::of::<Case>().text()
}

/// Section and name of the keys that do not change the results of a run, which are marked so above: cases that differ in them alone are
/// one.
pub fn free_keys() -> &'static [[String; 2]] {
    static KEYS: LazyLock<Vec<[String; 2]>> = LazyLock::new(|| Schema::of::<Case>().free_keys());
    &KEYS
}
