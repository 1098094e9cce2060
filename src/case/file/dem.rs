//! The engine that moves the particles, as the user writes it.

use crate::case::located::Located;
use crate::engine::LiggghtsProcess;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What moves the particles.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(extend("dependentSchemas" = {
    "liggghts": { "properties": { "engine": { "const": "liggghts" } }, "required": ["engine"] }
}))]
pub struct DemSection {
    /// "native", or "liggghts", for spheres only and with a program built with the cargo feature `liggghts`. Default "native".
    pub engine: Located<EngineKind>,
    /// Settings of LIGGGHTS; only with `engine = "liggghts"`.
    pub liggghts: Option<Located<LiggghtsSection>>,
}

/// Which engine moves the particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EngineKind {
    /// That of turbid.
    #[default]
    Native,
    /// LIGGGHTS with its model `hertz tangential history`, whatever `contact.law` and `contact.damping` say. Its one
    /// coefficient of friction is `friction_kinetic`, or 0 where `friction_static` is 0; `transition_velocity` means nothing
    /// to it.
    Liggghts,
}

/// Settings of LIGGGHTS.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LiggghtsSection {
    /// "worker": in a process of its own, whose crash ends as an error message; "own": in that of turbid. Default "worker".
    pub process: LiggghtsProcess,
    /// LIGGGHTS commands, given after all others of the set-up and before the first step: groups, regions, and fixes that add
    /// forces (`viscous`, `drag`, `addforce`, `spring`, `spring/self`). All others are refused. Default `[]`.
    pub commands: Vec<Located<String>>,
    /// Longest time that a worker may take for a step (s); for the set-up and for saving it has ten times as long. Then
    /// the run ends with an error. Default 60.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e6))]
    pub timeout: Option<Located<f64>>,
}
