//! Kinds of particles as the user writes them.

use super::shapes::ShapeSection;
use crate::case::forms::{Entry, Sizes};
use crate::case::located::Located;
use crate::case::schema::{non_negative, positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One kind of particle: shape, density, and exactly one of `volume_fraction`, `count`, `file`, `list`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend(
    "oneOf" = [{ "required": ["volume_fraction"] }, { "required": ["count"] }, { "required": ["file"] }, { "required": ["list"] }],
    "dependentSchemas" = { "sizes": at_random(), "seed": at_random(), "minimum_gap": at_random() }
))]
pub struct ParticleSection {
    /// Geometry.
    pub shape: Located<ShapeSection>,
    /// Density (kg/m^3).
    #[schemars(transform = positive)]
    pub density: Located<f64>,
    /// Name of its material. Default "default", which is that of `[contact]`.
    pub material: Option<Located<String>>,
    /// Solid volume over volume of the box (-), at most 0.35: random positions and orientations.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.35))]
    pub volume_fraction: Option<Located<f64>>,
    /// Number of particles: random positions and orientations.
    pub count: Option<Located<u64>>,
    /// Positions file, relative to the case file: lines of `x;y;z;rx;ry;rz;id` (m, degrees) or CSV with a header. A column
    /// `kind` says which section, counted from 0, a line belongs to, and each of them names the file; a column `diameter`
    /// (m) which of the `sizes`; `vx` to `wz` are velocities (m/s, 1/s), with which contacts may overlap.
    pub file: Option<Located<String>>,
    /// Positions: `[x, y, z]` (m), or `{ position = [...], orientation = ..., velocity = [...], angular_velocity = [...] }`.
    pub list: Option<Vec<Located<Entry>>>,
    /// Sizes of random particles, or of those in a file with a column `diameter`, as factors on all lengths: `{ uniform = [0.8, 1.2], steps = 5 }`, or
    /// `[{ scale = 1, share = 0.7 }, { scale = 0.5, share = 0.3 }]` with shares of their number. Default: all as written.
    pub sizes: Option<Located<Sizes>>,
    /// Seed of the random positions: the same seed gives the same positions on any machine. Default 1.
    pub seed: Option<Located<u64>>,
    /// Least gap between the surfaces of random particles (m). Default 0.0278 diameters of the sphere of equal volume, and at
    /// least twice the contact enlargement, so that none begins in contact.
    #[schemars(transform = non_negative)]
    pub minimum_gap: Option<Located<f64>>,
}

/// Of keys that only particles at random positions have.
fn at_random() -> serde_json::Value {
    serde_json::json!({ "not": { "anyOf": [{ "required": ["file"] }, { "required": ["list"] }] } })
}
