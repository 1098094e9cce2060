//! Length of a run, and intervals, as the user writes them.

use crate::document::{free, positive};
use crate::fluid::Simd;
use schemars::JsonSchema;
use serde::Deserialize;

/// Length of the run, and number of threads.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunSection {
    /// Length of the run: `{ time = 0.5 }` (s), `{ steps = 1000 }`, `{ stokes_times = 50 }`, or until it is steady,
    /// `{ steady = { over = { time = 0.1 }, at_most = { time = 2 } } }`.
    pub end: RunEnd,
    /// Averages are taken from here on. Default: one third of the run; of one that ends when it is steady, the last window.
    pub average_from: Option<Duration>,
    /// Threads; 0 is one per core. Default 0. Results do not depend on it.
    #[serde(default)]
    #[schemars(transform = free)]
    pub threads: usize,
    /// Cuts of the box into the blocks of threads or processes. Default "dynamic". Results do not depend on it.
    #[serde(default)]
    #[schemars(transform = free)]
    pub load_balancing: LoadBalancing,
    /// Instruction set of the kernels. Default: the best of this processor. Results do not depend on it.
    #[schemars(transform = free)]
    pub simd: Option<Simd>,
    /// Device that computes the fluid: "cpu", "gpu" or "gpu:1", a device by its number in `turbid doctor`, from 0 on, or "gpu:0,1", devices
    /// that the ranks take in turn. Default "cpu". Results do not depend on it. With devices, the default of `threads` is their number.
    #[schemars(regex(pattern = r"^(cpu|gpu(:[0-9]{1,3}(,[0-9]{1,3})*)?)$"))]
    #[schemars(transform = free)]
    pub device: Option<String>,
}

/// Times at which the box is cut into blocks of about the same work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadBalancing {
    /// At the start alone.
    Static,
    /// Again during a run, when particles have gathered somewhere and the slowest rank has lost more time than it takes.
    #[default]
    Dynamic,
}

/// A length of time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Duration {
    /// Seconds, e.g. `{ time = 0.5 }`.
    Time(#[schemars(transform = positive)] f64),
    /// Steps.
    Steps(u64),
    /// Units of `t* = D / u_Stokes`, the time in which a particle at Stokes velocity travels one diameter.
    StokesTimes(#[schemars(transform = positive)] f64),
}

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunEnd {
    /// After seconds, e.g. `{ time = 0.5 }`.
    Time(#[schemars(transform = positive)] f64),
    /// After steps.
    Steps(u64),
    /// After units of `t* = D / u_Stokes`, the time in which a particle at Stokes velocity travels one diameter.
    StokesTimes(#[schemars(transform = positive)] f64),
    /// At a steady state.
    Steady(SteadySection),
}

/// A steady state: net flux, mean velocity and kinetic energies in the means of two windows, one after the other, are the same.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteadySection {
    /// Length of each window; a row of series.csv or more are in it.
    pub over: Duration,
    /// The run ends here if it has not become steady.
    pub at_most: Duration,
    /// Largest change that counts as none (-), of velocities over the largest of them, of energies over the larger. Default 1e-3.
    #[serde(default = "unchanged")]
    #[schemars(transform = positive)]
    pub change: f64,
}

fn unchanged() -> f64 {
    1e-3
}

/// Interval between outputs.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Every {
    /// Not at all.
    Never,
    /// Seconds.
    Time(#[schemars(transform = positive)] f64),
    /// Steps; "never" switches the output off.
    Steps(#[schemars(extend("minimum" = 1))] u64),
    /// Units of `t* = D / u_Stokes`.
    StokesTimes(#[schemars(transform = positive)] f64),
}

/// Interval between checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CheckpointEvery {
    /// Only when the run is stopped or asked for one.
    Never,
    /// Seconds of wall time.
    WallTime(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e9))] f64),
    /// Seconds.
    Time(#[schemars(transform = positive)] f64),
    /// Steps.
    Steps(#[schemars(extend("minimum" = 1))] u64),
    /// Units of `t* = D / u_Stokes`.
    StokesTimes(#[schemars(transform = positive)] f64),
}
