//! Contacts and materials as the user writes them.

use crate::case::located::Located;
use crate::case::schema::{non_negative, positive};
use crate::contact::{DampingLaw, ElasticLaw};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Contacts of particles with each other and with walls; the defaults are those of Marquardt et al. (2024).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// Whether particles touch at all. Default true.
    pub enabled: bool,
    /// Young's modulus (Pa). Default 5000, far below real materials, so that contacts last many time steps.
    #[schemars(transform = positive)]
    pub youngs_modulus: Located<f64>,
    /// Poisson's ratio (-), above -1 and at most 0.5. Default 0.245.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson_ratio: Located<f64>,
    /// Coefficient of restitution (-), above 0 and at most 1. Default 0.926.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub restitution: Located<f64>,
    /// Static friction coefficient (-). Default 0.32.
    #[schemars(transform = non_negative)]
    pub friction_static: Located<f64>,
    /// Kinetic friction coefficient (-), the only one that LIGGGHTS has. Default 0.16.
    #[schemars(transform = non_negative)]
    pub friction_kinetic: Located<f64>,
    /// Speed of transition from static to kinetic friction (m/s). Default 0.001.
    #[schemars(transform = positive)]
    pub transition_velocity: Located<f64>,
    /// By how much every surface is grown for contacts (cells); a dry run has `dry.enlargement` instead. Default 0.2.
    #[schemars(transform = non_negative)]
    pub enlargement: Located<f64>,
    /// How the elastic force follows from the overlap. Default "paper".
    pub law: Located<ElasticLaw>,
    /// How the normal force is damped. Default `"hunt_crossley"`.
    pub damping: DampingLaw,
    /// How overlaps are measured. Default "exact".
    pub geometry: Located<GeometryKind>,
    /// Samples per direction of the sampled geometry. Default 8.
    #[schemars(extend("minimum" = 2, "maximum" = 64))]
    pub samples: Located<u32>,
    /// Sub-steps of the particles in each step, at most 10000. Default 1.
    #[schemars(extend("minimum" = 1, "maximum" = 10000))]
    pub substeps: Located<u32>,
    /// What particular pairs of materials do to each other; all others have the values above.
    pub pairs: Vec<Located<PairSection>>,
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
            law: ElasticLaw::OverlapVolume.into(),
            damping: DampingLaw::HuntCrossley,
            geometry: GeometryKind::Exact.into(),
            samples: 8.into(),
            substeps: 1.into(),
            pairs: Vec::new(),
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

/// What two materials do to each other.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairSection {
    /// The names of the two materials, e.g. `["glass", "steel"]` or `["glass", "glass"]`; "default" is that of
    /// `[contact]`.
    pub materials: [Located<String>; 2],
    /// Coefficient of restitution (-), above 0 and at most 1. Default: that of `[contact]`, as for all that follow.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub restitution: Option<Located<f64>>,
    /// Static friction coefficient (-).
    #[schemars(transform = non_negative)]
    pub friction_static: Option<Located<f64>>,
    /// Kinetic friction coefficient (-).
    #[schemars(transform = non_negative)]
    pub friction_kinetic: Option<Located<f64>>,
    /// Speed of transition from static to kinetic friction (m/s).
    #[schemars(transform = positive)]
    pub transition_velocity: Option<Located<f64>>,
}

/// Elasticity of a material that particles and walls name.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSection {
    /// Its name.
    pub name: Located<String>,
    /// Young's modulus (Pa). Default: that of `[contact]`.
    #[schemars(transform = positive)]
    pub youngs_modulus: Option<Located<f64>>,
    /// Poisson's ratio (-), above -1 and at most 0.5. Default: that of `[contact]`.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson_ratio: Option<Located<f64>>,
}
