//! The state between two steps: taken apart for a checkpoint, and put together again on any number of ranks.

use super::{FluidSystem, Simulation};
use crate::coupling::{AnyFluid, ControlRecord, MeanFlow};
use crate::domain::Block;
use crate::error::{Error, Result};
use crate::math::FIXED_POINT_LIMIT;
use crate::units::Units;

/// One rank's part of the state, but for the populations.
pub(super) struct SavedState {
    /// From [`DemEngine::save`](crate::dem::DemEngine::save).
    pub(super) engine: Vec<u8>,
    /// From [`Coupling::save`](crate::coupling::Coupling::save).
    pub(super) coupling: Vec<u8>,
    /// The same on every rank.
    pub(super) driving: SavedDriving,
}

/// Takes the saved populations of some cells, or says what is wrong with them.
pub(super) type Visit<'a> = dyn FnMut(Block, &[u8]) -> std::result::Result<(), String> + 'a;

/// The last measurement of the flow, and the accelerations that the controller of the net flux has added.
pub(super) type SavedDriving = (MeanFlow, ControlRecord);

impl Simulation {
    /// Bytes of a saved cell; none without a fluid.
    pub(super) fn saved_bytes(&self) -> usize {
        (self.system.as_ref()).map_or(0, |system| AnyFluid::saved_bytes(system.fluid.precision()))
    }

    /// This rank's part of the state, but for the populations. Collective.
    ///
    /// # Errors
    /// What the engine says, on the rank where it failed.
    pub(super) fn save(&self) -> Result<SavedState> {
        let mut mean = self.mean_flow();
        let mut most = [mean.max_lattice_speed];
        self.comm.max(&mut most);
        mean.max_lattice_speed = most[0];
        Ok(SavedState {
            engine: self.dem.save()?,
            coupling: (self.system.as_ref()).map_or_else(Vec::new, |system| system.coupling.save()),
            driving: (mean, self.control_record()),
        })
    }

    /// Appends the populations of plane `z` of the box, which crosses the block of this rank.
    pub(super) fn save_plane(&self, z: usize, out: &mut Vec<u8>) {
        if let Some(system) = &self.system {
            system.fluid.save_plane(z, out);
        }
    }

    /// Goes on after `step` steps of an earlier run of this case: `planes` hands out the saved populations of all cells of a
    /// block; engines and couplings are the parts of all ranks of that run. Collective.
    ///
    /// # Errors
    /// [`Error::Input`] if the parts are not of this case; whatever `planes` says. Some ranks may find nothing wrong.
    pub(super) fn restore(
        &mut self,
        step: u64,
        (mean, control): SavedDriving,
        engines: &[Vec<u8>],
        couplings: &[Vec<u8>],
        planes: impl FnOnce(Block, &mut Visit) -> Result<()>,
    ) -> Result<()> {
        let mut outcome = self.dem.restore(&self.comm, engines);
        if let Some(FluidSystem { fluid, coupling, driving, .. }) = &mut self.system {
            let read = planes(fluid.block(), &mut |cells, bytes| fluid.restore(cells, bytes));
            fluid.resume();
            let known = coupling.restore(self.dem.particles(), couplings).map_err(Error::Input);
            let measured = is_sound(&mean, &self.units);
            driving.mean = mean;
            driving.record = control;
            outcome = outcome.and(read).and(known).and(measured);
        }
        self.step = step;
        self.failure = None;
        outcome
    }
}

/// Whether a run can go on with a measurement of the flow that was read.
fn is_sound(mean: &MeanFlow, units: &Units) -> Result<()> {
    let [u, v, w] = (mean.velocity / units.velocity()).into();
    let numbers = [u, v, w, mean.solid_fraction, mean.max_lattice_speed];
    if numbers.iter().all(|x| x.abs() < FIXED_POINT_LIMIT) && mean.kinetic_energy.is_finite() {
        return Ok(());
    }
    Err(Error::Input(format!(
        "the mean velocity, solid fraction or energy of the flow in the common state is that of no run: {mean:?}"
    )))
}

#[cfg(test)]
mod tests;
