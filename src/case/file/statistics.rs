//! Statistics of particles and fluid as the user asks for them.

use super::{Axis, Every};
use crate::document::positive;
use schemars::JsonSchema;
use serde::Deserialize;

/// A profile along an axis, or away from it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileSection {
    /// Axis of the box along which the bins follow each other; with `about` that of the rings.
    pub axis: Axis,
    /// Number of bins of equal width, from one face of the box to the other, or from the middle of the rings to `radius`.
    #[schemars(extend("minimum" = 1, "maximum" = 10_000))]
    pub bins: usize,
    /// Point (m) on the line in the middle of rings, which are the bins of a radial profile. Vectors and tensors have the components radial,
    /// azimuthal and axial in place of x, y and z. Default: none.
    pub about: Option<[f64; 3]>,
    /// Radius of the outermost ring (m). Default: the distance of the line to the nearest face, at most half of an edge that is periodic.
    #[schemars(transform = positive)]
    pub radius: Option<f64>,
    /// Also the stress of the particles by the fluid, for which the cells are swept once more. Default false.
    #[serde(default)]
    pub hydrodynamic_stress: bool,
}

/// Structure of the particles: where they are about each other, and how they touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StructureSection {
    /// Rows of structure.csv, `pair_distribution.csv`, `contact_forces.csv` and `structure_factor.csv`. Default: 100 over the run.
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
    /// Wavelength (m) down to which the structure factor is written; half a diameter is beyond its peaks. Default: it is not written.
    #[schemars(transform = positive)]
    pub shortest_wave: Option<f64>,
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
