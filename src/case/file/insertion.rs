//! Particles that come and go during a run, as the user writes them.

use super::particles::OrientationSection;
use super::run::Duration;
use super::walls::PlaneSection;
use crate::document::{non_negative, one_of, positive};
use schemars::JsonSchema;
use serde::Deserialize;

/// Particles that are inserted during the run, at random positions where they overlap nothing: a region, and exactly one of
/// `particle_rate`, `mass_rate`, `volume_fraction`. What finds no room waits, and is tried again after `every`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of)]
pub struct InsertionSection {
    /// The `[[particles]]` section, counted from 0, that has their shape, sizes, density and material; with `count = 0` there are none at the
    /// start. Default 0.
    #[serde(default)]
    pub kind: usize,
    /// Region of their centres; without thickness along an axis it is a plane.
    pub region: RegionSection,
    /// Their number over time.
    #[serde(flatten)]
    pub amount: AmountBy,
    /// Most particles in all. Default: no limit.
    #[schemars(extend("minimum" = 1))]
    pub count: Option<u64>,
    /// Beginning of the insertion. Default: that of the run.
    pub start: Option<Duration>,
    /// End of the insertion; what waits then is not inserted. Default: that of the run.
    pub end: Option<Duration>,
    /// Interval between attempts, each with those that are due until the next. Default: the time in which one particle is due, but at least 20 steps.
    pub every: Option<Duration>,
    /// Velocity (m/s). Default `[0, 0, 0]`.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Largest random deviation from it along each axis (m/s), uniform. Default `[0, 0, 0]`.
    #[serde(default)]
    #[schemars(transform = non_negative)]
    pub velocity_spread: [f64; 3],
    /// Orientation. Default: random.
    pub orientation: Option<OrientationSection>,
    /// Seed of sizes, positions, orientations and velocities: the same seed gives the same ones on any machine. Default 1.
    pub seed: Option<u64>,
}

/// Number of particles that are inserted over time.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AmountBy {
    /// Particles per time (1/s).
    ParticleRate(#[schemars(transform = positive)] f64),
    /// Mass per time (kg/s), by the mean mass of the kind.
    MassRate(#[schemars(transform = positive)] f64),
    /// Solid volume fraction up to which the region is filled (-), by the volume of all particles whose centre is in it, at most 0.35.
    VolumeFraction(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.35))] f64),
}

/// A box in the domain.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionSection {
    /// Lower corner (m).
    pub lower: [f64; 3],
    /// Upper corner (m).
    pub upper: [f64; 3],
}

/// Free particles that are removed during the run: exactly one of `region`, `plane`, `outlet`. Looked for every 8 steps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = one_of)]
pub struct RemovalSection {
    /// Their `[[particles]]` section, counted from 0. Default: all.
    pub kind: Option<usize>,
    /// Place at which they are removed.
    #[serde(flatten)]
    pub place: RemovalPlace,
}

/// Place at which particles are removed.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RemovalPlace {
    /// Those whose centre is in a box.
    Region(RegionSection),
    /// Those whose centre is behind a plane.
    Plane(PlaneSection),
    /// Those whose enclosing sphere reaches a face of the box with an outlet, by its name, e.g. "x+".
    Outlet(String),
}
