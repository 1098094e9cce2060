//! The lattice Boltzmann fluid of one block, in lattice units.

use serde::{Deserialize, Serialize};

/// Storage type of the populations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Four bytes a population; accurate because populations are shifted by their weights.
    #[default]
    F32,
    /// Eight bytes a population.
    F64,
}

/// Instruction set of the kernels; all give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Simd {
    /// One cell at a time.
    Scalar,
    /// 128-bit registers, on every x86-64 processor.
    Sse2,
    /// 256-bit registers.
    Avx2,
}
