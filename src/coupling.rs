//! Fluid and particles meet here, and only here.

use serde::{Deserialize, Serialize};

/// Where the force that balances the submerged weight of the particles acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceBalance {
    /// The mean pressure gradient acts on fluid and particles alike, as in a closed vessel.
    #[default]
    Mixture,
    /// All of it on the fluid, as in the reference paper's driver; equals gravity `g / (1 - phi)`.
    FluidOnly,
}
