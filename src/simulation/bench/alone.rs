//! Steps of the fluid of a simulation without its particles.
//!
//! They take turns with the steps that are timed, in the same arrays: a second fluid would need as much memory again, and its time
//! another state of the machine. The particles wait meanwhile, in a fluid that moves on for a few steps with what it has; their speed
//! and contacts hardly notice.

use super::super::engine::{Context, engine};
use super::super::{FluidSystem, Simulation, Timings};
use crate::case::Setup;
use crate::coupling::{CONTROL_INTERVAL, Coupling, Driving};
use crate::dem::DemEngine;
use crate::domain::Decomposition;
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::math::Vec3;

/// Part of the timed steps that are repeated without particles.
const PART: u64 = 4;

/// A case without its particles and contacts.
pub(super) fn without_particles(setup: &Setup) -> Setup {
    let mut setup = setup.clone();
    setup.contact = None;
    setup.particles.clear();
    setup.engine = EngineChoice::Native;
    // Something must move, without getting fast in any number of steps that a benchmark takes.
    let units = setup.units();
    if let Some(fluid) = &mut setup.fluid {
        fluid.zero_net_flux = [false; 3];
        fluid.body_acceleration = Vec3::x() * (1e-7 * units.acceleration());
    }
    setup
}

/// All of a simulation but its fluid, as it is without particles.
pub(super) struct Alone {
    coupling: Coupling,
    driving: Driving,
    dem: Box<dyn DemEngine>,
    pub(super) timings: Timings,
}

impl Alone {
    /// Of a simulation of this case; none without a fluid or without particles.
    pub(super) fn new(
        setup: &Setup,
        decomposition: &Decomposition,
        simulation: &Simulation,
    ) -> Result<Option<Self>> {
        let (Some(system), false) = (&simulation.system, setup.particles.is_empty()) else {
            return Ok(None);
        };
        let (setup, comm) = (without_particles(setup), &simulation.comm);
        let (coupling, driving) =
            FluidSystem::acting(&setup, setup.expect_fluid(), decomposition, comm.rank(), system.cells);
        let dem = engine(&setup, decomposition, comm, &Context::default())?;
        Ok(Some(Self { coupling, driving, dem, timings: Timings::default() }))
    }

    /// Number of steps beside `steps` with particles: few, but as large a part of them measures the flow.
    pub(super) fn steps(steps: u64) -> u64 {
        steps.div_ceil(PART * CONTROL_INTERVAL) * CONTROL_INTERVAL
    }

    /// Takes the particles out of the simulation, or puts them back.
    pub(super) fn swap(&mut self, simulation: &mut Simulation) {
        let Some(system) = &mut simulation.system else {
            return;
        };
        std::mem::swap(&mut self.coupling, &mut system.coupling);
        std::mem::swap(&mut self.driving, &mut system.driving);
        std::mem::swap(&mut self.dem, &mut simulation.dem);
        std::mem::swap(&mut self.timings, &mut simulation.timings);
    }
}
