//! Steps of the fluid of a simulation without its particles, for benchmarks.
//!
//! They are taken in the same arrays: a second fluid would need as much memory again, and its time another state of the machine. The
//! particles wait meanwhile, in a fluid that moves on for a few steps with what it has; their speed and contacts hardly notice.

use super::engine::{Context, engine};
use super::{FluidSystem, Simulation, Timings};
use crate::case::Setup;
use crate::comm::Comm;
use crate::coupling::{Coupling, Driving};
use crate::dem::DemEngine;
use crate::domain::Decomposition;
use crate::error::Result;
use crate::fluid::CoverCount;

/// All of a simulation but its fluid, as it is without particles.
#[doc(hidden)]
pub struct Alone {
    coupling: Coupling,
    driving: Driving,
    dem: Box<dyn DemEngine>,
    /// Times of its steps.
    pub timings: Timings,
}

impl Simulation {
    /// The case at rest; a program that it names as its engine may run. Collective.
    #[doc(hidden)]
    pub fn with_any_engine(setup: &Setup, decomposition: &Decomposition, comm: Comm) -> Result<Self> {
        let context = Context { allowed: true, ..Context::default() };
        let dem = engine(setup, decomposition, &comm, &context)?;
        Self::with_engine(setup, decomposition, comm, dem)
    }

    /// Substitute for the particles: that of a case without any. `None` without a fluid. Collective.
    #[doc(hidden)]
    pub fn alone(&self, setup: &Setup, decomposition: &Decomposition) -> Result<Option<Alone>> {
        let Some(system) = &self.system else {
            return Ok(None);
        };
        let (rank, of) = (self.comm.rank(), setup.expect_fluid());
        let (mut coupling, driving) = FluidSystem::acting(setup, of, decomposition, rank, system.cells);
        system.fluid.prepare(&mut coupling);
        let dem = engine(setup, decomposition, &self.comm, &Context::default())?;
        Ok(Some(Alone { coupling, driving, dem, timings: Timings::default() }))
    }

    /// Takes the particles out, or puts them back.
    #[doc(hidden)]
    pub fn swap_particles(&mut self, with: &mut Alone) {
        let Some(system) = &mut self.system else {
            return;
        };
        std::mem::swap(&mut with.coupling, &mut system.coupling);
        std::mem::swap(&mut with.driving, &mut system.driving);
        std::mem::swap(&mut with.dem, &mut self.dem);
        std::mem::swap(&mut with.timings, &mut self.timings);
    }

    /// Cells that the particles cover on this rank.
    #[doc(hidden)]
    pub fn cover_count(&self) -> CoverCount {
        self.system.as_ref().map(|system| system.coupling.cover_count()).unwrap_or_default()
    }
}
