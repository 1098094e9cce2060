//! Prescribed motion of particles, and vectors over time, as the user writes them.

use crate::document::positive;
use crate::math::{TimeFunction, Vec3};
use schemars::JsonSchema;
use serde::Deserialize;

/// Motion of particles.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MotionSection {
    /// Of all degrees of freedom.
    Named(NamedMotion),
    /// By velocities.
    Prescribed(PrescribedSection),
}

/// Motion of all degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedMotion {
    /// Follows from forces and torques.
    Free,
    /// None: position and orientation stay as they are.
    Fixed,
}

/// Prescribed velocities; what is not prescribed and not `free` is zero.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrescribedSection {
    /// Velocity of the centre of mass (m/s): `[x, y, z]`, `{ oscillation = { amplitude = [...], frequency = ... } }` or
    /// `{ table = [[t, x, y, z], ...] }`. Default `[0, 0, 0]`.
    pub velocity: Option<VectorSection>,
    /// Angular velocity (1/s), in the axes of the box, with the forms of `velocity`. Default `[0, 0, 0]`.
    pub angular_velocity: Option<VectorSection>,
    /// Degrees of freedom that follow from forces and torques all the same: "x", "y", "z", "rotation". Default `[]`.
    #[serde(default)]
    pub free: Vec<Freedom>,
}

/// A velocity (m/s), angular velocity (1/s) or acceleration (m/s^2) over time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum VectorSection {
    /// Constant: `[x, y, z]`.
    Constant([f64; 3]),
    /// Variable.
    Variable(VariableVector),
}

/// A velocity (m/s), angular velocity (1/s) or acceleration (m/s^2) that changes with time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VariableVector {
    /// `mean + amplitude sin(2 pi frequency t + phase)`.
    Oscillation(OscillationSection),
    /// Rows `[t, x, y, z]`, times (s) ascending; linear between them, constant before the first and after the last.
    Table(Vec<[f64; 4]>),
}

impl Default for VectorSection {
    fn default() -> Self {
        Self::Constant([0.0; 3])
    }
}

impl VectorSection {
    /// The function of time.
    pub fn function(&self) -> TimeFunction {
        match self {
            Self::Constant(value) => TimeFunction::Constant((*value).into()),
            Self::Variable(VariableVector::Oscillation(given)) => TimeFunction::Oscillation {
                mean: given.mean.into(),
                amplitude: given.amplitude.into(),
                frequency: given.frequency,
                phase: given.phase.to_radians(),
            },
            Self::Variable(VariableVector::Table(rows)) => {
                TimeFunction::Table(rows.iter().map(|[t, x, y, z]| (*t, Vec3::new(*x, *y, *z))).collect())
            }
        }
    }
}

/// A pressure (Pa) over time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ScalarSection {
    /// Constant.
    Constant(f64),
    /// Variable.
    Variable(VariableScalar),
}

/// A pressure (Pa) that changes with time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VariableScalar {
    /// `mean + amplitude sin(2 pi frequency t + phase)`.
    Oscillation(ScalarOscillation),
    /// Rows `[t, p]`, times (s) ascending; linear between them, constant before the first and after the last.
    Table(Vec<[f64; 2]>),
}

impl Default for ScalarSection {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}

impl ScalarSection {
    /// The function of time, along x.
    pub fn function(&self) -> TimeFunction {
        let along = |x: f64| Vec3::new(x, 0.0, 0.0);
        match self {
            Self::Constant(value) => TimeFunction::Constant(along(*value)),
            Self::Variable(VariableScalar::Oscillation(given)) => TimeFunction::Oscillation {
                mean: along(given.mean),
                amplitude: along(given.amplitude),
                frequency: given.frequency,
                phase: given.phase.to_radians(),
            },
            Self::Variable(VariableScalar::Table(rows)) => {
                TimeFunction::Table(rows.iter().map(|[t, x]| (*t, along(*x))).collect())
            }
        }
    }
}

/// A harmonic oscillation of a pressure.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalarOscillation {
    /// Amplitude (Pa).
    pub amplitude: f64,
    /// Frequency (Hz), at most 0.1 over the time step.
    #[schemars(transform = positive)]
    pub frequency: f64,
    /// Phase at time 0 (degrees); 90 begins at the amplitude. Default 0.
    #[serde(default)]
    pub phase: f64,
    /// Mean over a period (Pa). Default 0.
    #[serde(default)]
    pub mean: f64,
}

/// A harmonic oscillation.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OscillationSection {
    /// Amplitude of the velocity (m/s), angular velocity (1/s) or acceleration (m/s^2): that of its integral is this over
    /// `2 pi frequency`.
    pub amplitude: [f64; 3],
    /// Frequency (Hz), at most 0.1 over the time step.
    #[schemars(transform = positive)]
    pub frequency: f64,
    /// Phase at time 0 (degrees); 90 begins at the amplitude. Default 0.
    #[serde(default)]
    pub phase: f64,
    /// Mean over a period, in the same unit. Default `[0, 0, 0]`.
    #[serde(default)]
    pub mean: [f64; 3],
}

/// A degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Freedom {
    /// Motion of the centre of mass along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// Rotation about all axes.
    Rotation,
}
