//! Statistics of particles and fluid as the user asks for them.

use super::{Axis, Every};
use crate::document::positive;
use schemars::JsonSchema;
use serde::Deserialize;

/// A profile along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileSection {
    /// Axis of the box along which the bins follow each other.
    pub axis: Axis,
    /// Number of bins of equal length from one face of the box to the other.
    #[schemars(extend("minimum" = 1, "maximum" = 10_000))]
    pub bins: usize,
}

/// Structure of the particles: where they are about each other, and how they touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StructureSection {
    /// Rows of structure.csv, `pair_distribution.csv` and `contact_forces.csv`. Default: 100 over the run.
    pub every: Option<Every>,
    /// Largest distance of two centres (m), at most half of the shortest periodic edge of the box. Default: 3 diameters of the first kind of
    /// particle, or that half.
    #[schemars(transform = positive)]
    pub reach: Option<f64>,
    /// Number of bins of equal width from 0 to there. Default 150.
    #[schemars(extend("minimum" = 1, "maximum" = 10_000))]
    pub bins: Option<usize>,
    /// Plane in which pairs are told apart by their direction: "xy", "xz" or "yz", that of shear or of gravity. Default: none.
    pub plane: Option<PlaneName>,
}

/// A plane of the box by its axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlaneName {
    /// Of x and y.
    Xy,
    /// Of x and z.
    Xz,
    /// Of y and z.
    Yz,
}

/// Motion of the particles over time: displacements and memory of velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DynamicsSection {
    /// Time between two samples. Default: 1000 over the run.
    pub every: Option<Every>,
    /// Number of samples of a block, from each of which displacements are counted anew: the longest time lag. Default 100.
    #[schemars(extend("minimum" = 2, "maximum" = 100_000))]
    pub lags: Option<usize>,
}
