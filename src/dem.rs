//! Engines that move the particles: the trait, the native engine, and a ballistic one for tests of the coupling.

pub mod assign;
pub mod ballistic;
pub mod exchange;
pub mod history;
pub mod integrator;
pub mod native;

use crate::comm::Comm;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::ParticleStore;
use crate::shape::Shape;
pub use ballistic::Ballistic;
pub use history::Record;
pub use native::{Native, NativeParams};

/// What the fluid does to one particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force on the centre of mass (N).
    pub force: Vec3,
    /// Torque about the centre of mass (N m).
    pub torque: Vec3,
}

/// Contacts of one rank at the last sub-step, for the time series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSummary {
    /// Number of contacts this rank is responsible for that exert a force.
    pub count: usize,
    /// Largest depth (m).
    pub max_depth: f64,
    /// Number of contacts that began since the start.
    pub begun: u64,
}

/// Moves the particles; knows contacts, knows nothing of the fluid. All quantities are SI.
///
/// [`advance`](Self::advance) is collective: every rank calls it, in the same order. A failure on one rank is
/// reported there by `Err`; the caller makes the failure collective before the next step.
pub trait DemEngine: Send {
    /// Short name for logs and messages, e.g. `"native"`.
    fn name(&self) -> &'static str;

    /// Whether this engine can represent `shape`; asked once, at set-up.
    fn supports(&self, shape: &dyn Shape) -> bool;

    /// The particles that touch this rank's part of the domain; valid until the next [`advance`](Self::advance).
    fn particles(&self) -> &ParticleStore;

    /// Advances all particles by `dt` (s) under constant `loads`.
    ///
    /// `loads[i]` acts on owned particle `i` of [`particles`](Self::particles), `loads.len() == owned`. Gravity and
    /// contacts are the engine's own business, and so is the number of sub-steps.
    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()>;

    /// Contacts at the last sub-step.
    fn contacts(&self) -> ContactSummary;
}
