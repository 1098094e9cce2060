//! Kinds of particles as the user writes them.

use super::Axis;
use super::motion::MotionSection;
use super::shapes::ShapeSection;
use crate::document::{non_negative, one_of, positive};
use crate::packing::positions::names;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use std::collections::BTreeMap;

/// One kind of particle: shape, density, and exactly one of `volume_fraction`, `count`, `file`, `list`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of, extend("dependentSchemas" = {
    "sizes": at_random(), "seed": { "anyOf": [at_random(), { "required": ["granular_temperature"] }] }, "minimum_gap": { "anyOf": [at_random(), relaxed()] },
    "overlaps": listed(), "relax_distance": relaxed(), "columns": { "required": ["file"] }
}))]
pub struct ParticleSection {
    /// Geometry.
    pub shape: ShapeSection,
    /// Axis of the box along which the bodies go through its periodic faces, without ends: cylinders, cuboids and prisms whose z axis is laid
    /// along it, as long as the box, placed by `list` or `file`. They turn about that axis alone. Default: none.
    pub through: Option<Axis>,
    /// Density (kg/m^3).
    #[schemars(transform = positive)]
    pub density: f64,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<String>,
    /// "free", "fixed", or prescribed velocities, `{ velocity = [...], angular_velocity = [...], free = [...] }`. `series.csv` has
    /// the force and torque on the fixed and prescribed bodies of a section. Default "free".
    pub motion: Option<MotionSection>,
    /// Constant force (N) on each body besides weight, fluid and contacts, in directions in which it is free. Default `[0, 0, 0]`.
    #[serde(default)]
    pub force: [f64; 3],
    /// Constant torque (N m) on each body, in the axes of the box. Default `[0, 0, 0]`.
    #[serde(default)]
    pub torque: [f64; 3],
    /// Random velocities at the start, of this mean square in each direction (m^2/s^2) and without momentum together, beside those of
    /// `list`, `file` or the flow; by `seed`. Default: none.
    #[schemars(transform = positive)]
    pub granular_temperature: Option<f64>,
    /// Its positions.
    #[serde(flatten)]
    pub positions: PositionsBy,
    /// Columns of the file that have other names, by ours, as `"[factor *] name [unit] [+ constant]"` (m, degrees, m/s, 1/s), e.g.
    /// `{ x = "Points:0", diameter = "2*radius" }`; columns that are unknown are left out then.
    #[serde(default)]
    #[schemars(schema_with = "columns")]
    pub columns: BTreeMap<String, String>,
    /// Sizes of random particles, or of those in a file with a column `diameter` or `radius`, as factors (not lengths) on all lengths:
    /// `{ uniform = [0.8, 1.2], steps = 5 }`, or
    /// `[{ scale = 1, share = 0.7 }, { scale = 0.5, share = 0.3 }]` with shares of their number. Default: all as written.
    pub sizes: Option<Sizes>,
    /// Seed of the random positions and velocities: the same seed gives the same ones on any machine. Default 1.
    pub seed: Option<u64>,
    /// Least gap between the surfaces of random particles (m). Default 0.0278 diameters of the sphere of equal volume, and at
    /// least twice the contact enlargement, so that none begins in contact. With `overlaps = "relax"` that of listed particles,
    /// default 0.
    #[schemars(transform = non_negative)]
    pub minimum_gap: Option<f64>,
    /// Listed particles, or those of a file, that overlap each other or a wall. Bodies that are fixed, or whose whole motion is
    /// prescribed, may. Default "refuse".
    pub overlaps: Option<Overlaps>,
    /// Furthest that `overlaps = "relax"` may move any point of a particle: a length in m, or `{ diameters = 0.2 }`, diameters of
    /// the sphere of equal volume. Default `{ diameters = 0.5 }`.
    pub relax_distance: Option<RelaxDistance>,
}

/// Positions of the particles of a section, or their number.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionsBy {
    /// Solid volume over volume of the box (-), rounded up to whole particles: random positions and orientations, as in a fluid of hard bodies up to 0.45, above that
    /// compressed from there; equal spheres reach 0.63.
    VolumeFraction(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.74))] f64),
    /// Number of particles: random positions and orientations.
    Count(u64),
    /// Positions file, relative to the case file: a table with or without a header, `.xyz`, a dump or data file of LAMMPS or
    /// LIGGGHTS, or points of VTK. A column `kind` says which section, counted from 0, a line belongs to, and each of them names
    /// the file; `diameter` or `radius` (m, of the sphere of equal volume) which of the `sizes`, or without these how large the
    /// particle is; `vx` to `wz` are velocities (m/s, 1/s), with which contacts may overlap.
    File(String),
    /// Positions: `[x, y, z]` (m), or `{ position = [...], orientation = ..., velocity = [...], angular_velocity = [...] }`.
    List(Vec<Entry>),
}

impl ParticleSection {
    /// Entries of its list; none if it has no list.
    pub fn list(&self) -> &[Entry] {
        match &self.positions {
            PositionsBy::List(list) => list,
            _ => &[],
        }
    }

    /// Its positions file.
    pub fn file(&self) -> Option<&str> {
        match &self.positions {
            PositionsBy::File(file) => Some(file),
            _ => None,
        }
    }

    /// True if it says that there are no particles.
    pub fn is_empty(&self) -> bool {
        matches!(self.positions, PositionsBy::Count(0))
    }

    /// True if the positions are random.
    pub fn is_random(&self) -> bool {
        matches!(self.positions, PositionsBy::VolumeFraction(_) | PositionsBy::Count(_))
    }
}

/// Treatment of particles that overlap at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Overlaps {
    /// An error.
    Refuse,
    /// They are moved and turned apart, those of other sections staying where they are.
    Relax,
}

/// A distance.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum RelaxDistance {
    /// In metres.
    Metres(#[schemars(transform = positive)] f64),
    /// In diameters of the particle.
    Relative(RelativeDistance),
}

/// A distance in diameters.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RelativeDistance {
    /// In diameters of the sphere of equal volume (-).
    #[schemars(transform = positive)]
    pub diameters: f64,
}

/// A text for each column.
fn columns(_: &mut SchemaGenerator) -> Schema {
    let text = |(name, unit): (&str, &str)| {
        let description = format!("Column of the file for `{name}` ({unit}).");
        (name.to_owned(), serde_json::json!({ "type": "string", "description": description }))
    };
    let properties: serde_json::Map<_, _> = names().map(text).collect();
    json_schema!({ "type": "object", "properties": properties, "additionalProperties": false })
}

/// Of keys that only particles at random positions have.
fn at_random() -> serde_json::Value {
    serde_json::json!({ "not": listed() })
}

/// Of keys that only particles of a list or a file have.
fn listed() -> serde_json::Value {
    serde_json::json!({ "anyOf": [{ "required": ["file"] }, { "required": ["list"] }] })
}

/// Of keys that only particles have whose overlaps are relaxed.
fn relaxed() -> serde_json::Value {
    serde_json::json!({ "required": ["overlaps"], "properties": { "overlaps": { "const": "relax" } } })
}

/// One particle of a list.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Entry {
    /// Centre (m), at rest.
    Position([f64; 3]),
    /// Centre and motion.
    Moving(Box<MovingEntry>),
}

/// One particle of a list with its motion.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MovingEntry {
    /// Centre (m).
    pub position: [f64; 3],
    /// Orientation. Default: the axes of the shape along those of the box.
    pub orientation: Option<OrientationSection>,
    /// Velocity (m/s). Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity (1/s). Default `[0, 0, 0]`.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
}

/// Orientation of a particle of a list: either `axis` with `angle`, or `quaternion`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["axis", "angle"] }, { "required": ["quaternion"], "not": { "required": ["angle"] } }]))]
pub struct OrientationSection {
    /// Axis of the rotation, of any length, e.g. `{ axis = [0, 0, 1], angle = 45 }`.
    pub axis: Option<[f64; 3]>,
    /// Angle (degrees), right-handed, e.g. `{ axis = [0, 0, 1], angle = 45 }`.
    pub angle: Option<f64>,
    /// Quaternion `[i, j, k, w]` of any length, from the axes of the shape to those of the box.
    pub quaternion: Option<[f64; 4]>,
}

/// Sizes of random particles.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Sizes {
    /// Factors and the fraction of the particles that has each.
    Shares(Vec<SizeShare>),
    /// Factors by a distribution.
    Spread(SizeSpread),
}

/// One size and how many particles have it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizeShare {
    /// Factor on all lengths of the shape (-), e.g. 0.8.
    #[schemars(transform = positive)]
    pub scale: f64,
    /// Fraction of the number of particles (-), e.g. 0.5; fractions need not add up to 1.
    #[schemars(transform = positive)]
    pub share: f64,
}

/// A distribution of factors on all lengths: one of `uniform`, `normal`, `log_normal`, `weibull` and `sieve`. With a shape of 1 mm factors are millimetres.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["uniform"] }, { "required": ["normal"] }, { "required": ["log_normal"] }, { "required": ["weibull"] }, { "required": ["sieve"] }]))]
pub struct SizeSpread {
    /// Smallest and largest factor on all lengths (-), e.g. `[0.8, 1.2]`; each of `steps` has the factor in its middle.
    #[schemars(transform = positive)]
    pub uniform: Option<[f64; 2]>,
    /// Normal distribution, e.g. `{ mean = 1, deviation = 0.1 }`; `range` is by default three deviations to both sides.
    pub normal: Option<Normal>,
    /// Log-normal distribution, e.g. `{ median = 1, deviation = 1.3 }`; `range` is by default three deviations to both sides.
    pub log_normal: Option<LogNormal>,
    /// Distribution of Weibull, by mass that of Rosin and Rammler, e.g. `{ scale = 1, shape = 3 }`; `range` leaves out 0.001 at both ends by default.
    pub weibull: Option<Weibull>,
    /// Sieve curve: rows of a factor, ascending, and the mass fraction that passes (-), from 0 to 1, e.g. `[[0.25, 0], [0.5, 0.2], [1, 0.7], [2, 1]]`; between
    /// rows a line over the logarithm of the size.
    pub sieve: Option<Vec<[f64; 2]>>,
    /// Basis of the distribution: "number" or "mass" of the particles. Default "number", with `weibull` "mass"; a sieve curve is of mass.
    pub by: Option<SharesOf>,
    /// Smallest and largest factor (-), beyond which the distribution is cut off.
    #[schemars(transform = positive)]
    pub range: Option<[f64; 2]>,
    /// Number of sizes, from 1 to 1000, each the mean of its class by mass; of a sieve curve as many between each two rows, rounded up. Default 20, with `uniform` 5.
    #[schemars(extend("minimum" = 1, "maximum" = 1000))]
    pub steps: Option<u32>,
}

/// Basis of the shares of a distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SharesOf {
    /// The number of particles.
    Number,
    /// Their mass.
    Mass,
}

/// A normal distribution.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean factor on all lengths (-).
    #[schemars(transform = positive)]
    pub mean: f64,
    /// Standard deviation (-).
    #[schemars(transform = positive)]
    pub deviation: f64,
}

/// A log-normal distribution.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogNormal {
    /// Median of the factor on all lengths (-).
    #[schemars(transform = positive)]
    pub median: f64,
    /// Geometric standard deviation (-), above 1.
    #[schemars(transform = positive)]
    pub deviation: f64,
}

/// A distribution of Weibull.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Weibull {
    /// Factor on all lengths (-) that 63 % lie below.
    #[schemars(transform = positive)]
    pub scale: f64,
    /// Exponent (-).
    #[schemars(transform = positive)]
    pub shape: f64,
}
