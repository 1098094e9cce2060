//! The case file as the user writes it: every key, its unit and its default, in this one place.
//!
//! `turbid check --schema` prints what stands here as a JSON schema. Numbers are in SI units unless said otherwise.

use super::forms::{Entry, Gravity, Size};
use super::located::Located;
use crate::coupling::ForceBalance;
use crate::fluid::{Precision, Simd};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A case of turbid: resolved particles in a fluid in a periodic box. SI units.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// The box.
    pub domain: DomainSection,
    /// The fluid.
    pub fluid: Located<FluidSection>,
    /// Cell size, time step and method.
    pub lattice: Located<LatticeSection>,
    /// Kinds of particles; the diameter of the first kind is the reference length.
    #[serde(default)]
    pub particles: Vec<Located<ParticleSection>>,
    /// Contacts between particles. The defaults are those of Marquardt et al. (2024).
    #[serde(default)]
    pub contact: ContactSection,
    /// What drives the flow.
    #[serde(default)]
    pub driving: DrivingSection,
    /// How long to run, and with how many threads.
    pub run: RunSection,
    /// What to write, when and where.
    #[serde(default)]
    pub output: OutputSection,
}

/// The box.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomainSection {
    /// Edges: `[x, y, z]` in m, or `{ diameters = [x, y, z] }`. Rounded to whole cells, with a warning.
    pub size: Located<Size>,
    /// Periodic directions. Default and only choice in this version: `[true, true, true]`.
    #[serde(default = "all_periodic")]
    pub periodic: Located<[bool; 3]>,
}

fn all_periodic() -> Located<[bool; 3]> {
    [true; 3].into()
}

/// The fluid: its density, and exactly one of `viscosity`, `archimedes`, `galileo`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FluidSection {
    /// Density (kg/m^3).
    pub density: Located<f64>,
    /// Kinematic viscosity nu (m^2/s).
    pub viscosity: Option<Located<f64>>,
    /// Archimedes number g |s - 1| D^3 / nu^2 (-) of the first kind of particle, density ratio s.
    pub archimedes: Option<Located<f64>>,
    /// Galileo number (-), the square root of the Archimedes number.
    pub galileo: Option<Located<f64>>,
    /// Storage of the populations: "f32" or "f64", twice the memory. Default "f32".
    #[serde(default)]
    pub precision: Precision,
}

/// The lattice: `cells_per_diameter`, and exactly one of `relaxation_time`, `time_step`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeSection {
    /// Cells per diameter of the first kind of particle (-), at least 2; 9 to 27 is usual.
    pub cells_per_diameter: Located<f64>,
    /// Relaxation time (time steps), above 0.5; 0.51 to 1 is usual.
    pub relaxation_time: Option<Located<f64>>,
    /// Time step of the fluid (s).
    pub time_step: Option<Located<f64>>,
    /// Collision operator. Default and only choice in this version: "bgk".
    #[serde(default)]
    pub collision: Collision,
    /// How solids enter the collision. Default and only choice in this version: "paper".
    #[serde(default)]
    pub coupling: Coupling,
    /// Width of the cosine ramp of the solid fraction (cells). Default 0.5.
    #[serde(default = "solid_ramp_width")]
    pub solid_ramp_width: Located<f64>,
}

fn solid_ramp_width() -> Located<f64> {
    0.5.into()
}

/// Collision operator.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Collision {
    /// Bhatnagar, Gross and Krook: one relaxation time.
    #[default]
    Bgk,
}

/// How solids enter the collision.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coupling {
    /// Homogenised velocity by the exact difference, as in Marquardt et al. (2024).
    #[default]
    Paper,
}

/// One kind of particle: shape, density, and exactly one of `volume_fraction`, `count`, `file`, `list`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleSection {
    /// Geometry.
    pub shape: ShapeSection,
    /// Density (kg/m^3).
    pub density: Located<f64>,
    /// Solid volume over volume of the box (-), at most 0.35: random positions.
    pub volume_fraction: Option<Located<f64>>,
    /// Number of particles: random positions.
    pub count: Option<Located<u64>>,
    /// Positions file, relative to the case file: lines of `x;y;z;rx;ry;rz;id` (m, degrees) or CSV with a header.
    pub file: Option<Located<String>>,
    /// Positions: `[x, y, z]` (m), or `{ position = [...], velocity = [...], angular_velocity = [...] }`.
    pub list: Option<Vec<Located<Entry>>>,
    /// Seed of the random positions: the same seed gives the same positions on any machine. Default 1.
    pub seed: Option<Located<u64>>,
    /// Least gap between the surfaces of random particles (m). Default 0.0278 diameters.
    pub minimum_gap: Option<Located<f64>>,
}

/// Geometry of a particle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeSection {
    /// A sphere.
    Sphere(SphereSection),
}

/// A sphere.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereSection {
    /// Diameter (m).
    pub diameter: Located<f64>,
}

/// Contacts between particles; the defaults are those of Marquardt et al. (2024).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// Whether particles touch at all. Default true.
    pub enabled: bool,
    /// Young's modulus (Pa). Default 5000, far below real materials, so that contacts last many time steps.
    pub youngs_modulus: Located<f64>,
    /// Poisson's ratio (-), above -1 and at most 0.5. Default 0.245.
    pub poisson_ratio: Located<f64>,
    /// Coefficient of restitution (-), above 0 and at most 1. Default 0.926.
    pub restitution: Located<f64>,
    /// Static friction coefficient (-). Default 0.32.
    pub friction_static: Located<f64>,
    /// Kinetic friction coefficient (-). Default 0.16.
    pub friction_kinetic: Located<f64>,
    /// Speed of transition from static to kinetic friction (m/s). Default 0.001.
    pub transition_velocity: Located<f64>,
    /// By how much every surface is grown for contacts (cells). Default 0.2.
    pub enlargement: Located<f64>,
    /// How overlaps are measured. Default "exact".
    pub geometry: GeometryKind,
    /// Samples per direction of the sampled geometry. Default 8.
    pub samples: Located<u32>,
    /// Sub-steps of the particles in each fluid step. Default 1.
    pub substeps: Located<u32>,
}

impl Default for ContactSection {
    fn default() -> Self {
        Self {
            enabled: true,
            youngs_modulus: 5e3.into(),
            poisson_ratio: 0.245.into(),
            restitution: 0.926.into(),
            friction_static: 0.32.into(),
            friction_kinetic: 0.16.into(),
            transition_velocity: 1e-3.into(),
            enlargement: 0.2.into(),
            geometry: GeometryKind::Exact,
            samples: 8.into(),
            substeps: 1.into(),
        }
    }
}

/// How overlaps are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GeometryKind {
    /// Closed forms where they exist.
    Exact,
    /// The sampled scheme of Marquardt et al. (2024).
    Sampled,
}

/// What drives the flow.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrivingSection {
    /// Gravity (m/s^2): `[x, y, z]`, or a number for the direction -z. Default 9.80665.
    pub gravity: Located<Gravity>,
    /// Where the force that balances the submerged weight acts. Default "mixture".
    pub force_balance: ForceBalance,
    /// Whether a controller removes the mean volume flux. Default true.
    pub zero_net_flux: bool,
    /// Uniform acceleration of the fluid besides all else (m/s^2). Default `[0, 0, 0]`.
    pub body_acceleration: Located<[f64; 3]>,
}

impl Default for DrivingSection {
    fn default() -> Self {
        Self {
            gravity: Gravity::Downwards(9.80665).into(),
            force_balance: ForceBalance::Mixture,
            zero_net_flux: true,
            body_acceleration: [0.0; 3].into(),
        }
    }
}

/// How long to run, and with how many threads.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunSection {
    /// Length of the run.
    pub end: Located<Duration>,
    /// Averages are taken from here on. Default: one third of the run.
    pub average_from: Option<Located<Duration>>,
    /// Threads; 0 is one per core. Default 0. Results do not depend on it.
    #[serde(default)]
    pub threads: usize,
    /// Instruction set of the kernels. Default: the best of this processor. Results do not depend on it.
    pub simd: Option<Located<Simd>>,
}

/// A length of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Duration {
    /// Seconds.
    Time(f64),
    /// Steps of the fluid.
    Steps(u64),
    /// Units of `t* = D / u_Stokes`, the time in which a particle at Stokes velocity travels one diameter.
    StokesTimes(f64),
}

/// How often to write.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Every {
    /// Not at all.
    Never,
    /// Seconds.
    Time(f64),
    /// Steps of the fluid.
    Steps(u64),
    /// Units of `t* = D / u_Stokes`.
    StokesTimes(f64),
}

/// What to write, when and where.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSection {
    /// Directory for all output, relative to where turbid is started. Default `out/<name of the case file>`.
    pub directory: Option<Located<String>>,
    /// Rows of series.csv. Default: 1000 over the run.
    pub series_every: Option<Located<Every>>,
    /// Fields (.vti): velocity, pressure, solid fraction. Default: 5 over the run.
    pub fields_every: Option<Located<Every>>,
    /// Particles (.vtp). Default: 50 over the run.
    pub particles_every: Option<Located<Every>>,
    /// Pictures (.png). Default: 10 over the run.
    pub picture_every: Option<Located<Every>>,
}

/// The JSON schema of the case file, for editors.
pub fn schema() -> String {
    let schema = schemars::schema_for!(Case);
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is plain JSON");
    text.push('\n');
    text
}
