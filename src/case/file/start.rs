//! Flows at the start as the user writes them.

use super::Axis;
use schemars::JsonSchema;
use serde::Deserialize;

/// Flow at the start of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FluidStart {
    /// Fluid and bodies at rest.
    #[default]
    Rest,
    /// Plane Couette flow between two faces, which needs no time to form.
    Couette,
    /// The same velocity (m/s) everywhere.
    Uniform([f64; 3]),
    /// Linear along a closed direction.
    Shear(ShearSection),
    /// Poiseuille flow between two plates, or in a pipe.
    Poiseuille(PoiseuilleSection),
    /// Vortices of Taylor and Green in a periodic box, one wave in each direction.
    TaylorGreen(TaylorGreenSection),
}

/// A flow whose velocity is linear along a direction.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShearSection {
    /// Rise of the velocity (1/s) in that direction.
    pub gradient: [f64; 3],
    /// The direction: "x", "y" or "z", which is closed by walls.
    pub along: Axis,
    /// Velocity (m/s) in the middle of the box. Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: [f64; 3],
}

/// Flow of a parabolic profile.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoiseuilleSection {
    /// Mean velocity (m/s): between two plates two thirds of the largest, in a pipe half of it.
    pub velocity: [f64; 3],
}

/// Vortices of Taylor and Green.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaylorGreenSection {
    /// Largest velocity (m/s) along the first direction of their plane.
    pub velocity: f64,
    /// The direction across their plane. Default "z", so that they are in x and y.
    #[serde(default = "across")]
    pub normal: Axis,
    /// One wave across the plane, too: vortices that stretch each other and become turbulent at high Reynolds numbers. Default false.
    #[serde(default)]
    pub three_dimensional: bool,
}

fn across() -> Axis {
    Axis::Z
}
