//! The state between two steps: saved in a checkpoint with what the owner of the run adds, and restored on any number of ranks.

use super::checkpointer::of_another_run;
use super::insertion::Record;
use super::{FluidSystem, Simulation, engine, identity};
use crate::case::Setup;
use crate::checkpoint::{self, CaseText, Checkpoint, Head, Part};
use crate::comm::{Comm, Routed, SavedParts};
use crate::coupling::{AnyFluid, ControlRecord, MeanFlow};
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::math::FIXED_POINT_LIMIT;
use crate::units::Units;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;

/// One rank's part of the state, but for the populations.
struct SavedState {
    /// From [`DemEngine::save`](crate::dem::DemEngine::save).
    engine: Vec<u8>,
    /// From [`Coupling::save`](crate::coupling::Coupling::save) and [`AnyFluid::save_means`].
    coupling: Vec<u8>,
    /// The same on every rank.
    driving: SavedDriving,
}

/// Takes the saved populations of some cells, or says what is wrong with them.
type Visit<'a> = dyn FnMut(Block, &[u8]) -> std::result::Result<(), String> + 'a;

/// States of the engine and of the coupling, in the parts that this rank has read.
pub(super) type States = [SavedParts; 2];

/// The last measurement of the flow, and the accelerations that the controller of the net flux has added.
type SavedDriving = (MeanFlow, ControlRecord);

/// Data that are the same on every rank: of the driving, of the owner of the run, and of particles that come and go, if some do.
#[derive(Serialize, Deserialize)]
struct Common<T>(SavedDriving, T, #[serde(default, skip_serializing_if = "Option::is_none")] Option<Record>);

impl Simulation {
    /// Bytes of a saved cell; none without a fluid.
    pub(super) fn saved_bytes(&self) -> usize {
        (self.system.as_ref()).map_or(0, |system| AnyFluid::saved_bytes(system.fluid.precision()))
    }

    /// This rank's part of the state, or the error of its engine. Collective.
    fn save(&self) -> Result<SavedState> {
        let mut mean = self.mean_flow();
        let mut most = [mean.max_lattice_speed];
        self.comm.max(&mut most);
        mean.max_lattice_speed = most[0];
        let coupling = self.system.as_ref().map_or_else(Vec::new, |system| {
            let mut bytes = system.coupling.save();
            system.fluid.save_means(&mut bytes);
            bytes
        });
        Ok(SavedState {
            engine: self.dem.save(&self.comm)?,
            coupling,
            driving: (mean, self.control_record()),
        })
    }

    /// Appends the populations of plane `z` of the box, which crosses the block of this rank.
    fn save_plane(&self, z: usize, out: &mut Vec<u8>) {
        if let Some(system) = &self.system {
            system.fluid.save_plane(z, out);
        }
    }

    /// Restores the state after `step` steps: `planes` gives the saved populations of all cells of a block; `engines` and
    /// `couplings` are the parts of it that this rank has read; without any part of a coupling the bodies are met as at the start. Errors:
    /// [`Error::Input`] if the parts are not of this case; those of `planes`. Some ranks may find nothing wrong. Collective.
    fn restore(
        &mut self,
        step: u64,
        ((mean, control), record): (SavedDriving, Option<Record>),
        [engines, couplings]: &States,
        planes: impl FnOnce(Block, &mut Visit) -> Result<()>,
    ) -> Result<()> {
        let mut outcome = self.dem.restore(&self.comm, engines);
        if let Some(system) = &mut self.system {
            system.move_walls(step.checked_sub(1));
            let FluidSystem { fluid, coupling, driving, .. } = system;
            let read = planes(fluid.block(), &mut |cells, bytes| fluid.restore(cells, bytes));
            let own = fluid.restore_means(&self.comm, couplings);
            fluid.resume();
            let known = own.and_then(|own| coupling.restore(&self.comm, self.dem.particles(), &own));
            let known = known.map_err(Error::Input);
            if couplings.count == 0 {
                // The fluid in a body moves as the body.
                coupling
                    .begin_moving(self.dem.particles(), |body| [body.velocity(), body.angular_velocity()]);
            }
            let measured = is_sound(&mean, &self.units);
            driving.mean = mean;
            driving.record = control;
            outcome = outcome.and(read).and(known).and(measured);
        }
        self.recount();
        self.record = Record::new(self.templates.len(), &self.plan, 0);
        if let Some(record) = record {
            outcome = outcome.and(self.record.restore(record, &self.plan, step));
        }
        self.step = step;
        (self.failure, self.agreed, self.before) = (None, None, None);
        outcome
    }
}

/// Bytes of cells that a rank sends to another at a time, about: MPI counts up to 2^31.
const MOST_AT_ONCE: usize = if cfg!(test) { 1 << 18 } else { 1 << 28 };

impl Simulation {
    /// Gives the ranks other blocks, of as many ranks, and what belongs to them. Errors: a failure of the simulation; those of saving;
    /// [`Error::Memory`], after which the state is lost. Collective.
    pub(super) fn cut_anew(&mut self, setup: &Setup, cut: Decomposition) -> Result<()> {
        // What has failed since the last control is not to be forgotten.
        self.check()?;
        let (comm, rank) = (self.comm.clone(), self.comm.rank());
        let SavedState { engine: particles, coupling, driving } = checkpoint::agreed(&comm, self.save())?;
        let part = |bytes| SavedParts { own: vec![(rank, bytes)], count: comm.size() };
        let record = self.record.tells().then(|| self.record.clone());
        let states = [part(particles), part(coupling)];
        let received = self.exchange_cells(&cut);
        let before = std::mem::replace(&mut self.cut, cut);
        self.block = self.cut.block(rank);
        self.dem = Box::new(engine::native(setup, &self.cut, rank)?);
        if let Some(of) = &setup.fluid {
            // There need not be room for both.
            self.system = None;
            self.system = Some(FluidSystem::new(setup, of, &self.cut, &comm, self.dem.particles())?);
        }
        let bytes = self.saved_bytes();
        let restored = self.restore(self.step, (driving, record), &states, |block, visit| {
            for (first, (from, cells)) in received {
                let Some(mut piece) = block.common(&before.block(from)) else { continue };
                let planes = piece.lo[2].max(first)..piece.hi[2];
                let plane = piece.cell_count() / piece.size()[2] * bytes;
                for (z, bytes) in planes.zip(cells.chunks_exact(plane)) {
                    (piece.lo[2], piece.hi[2]) = (z, z + 1);
                    visit(piece, bytes).map_err(Error::Input)?;
                }
            }
            Ok(())
        });
        checkpoint::agreed(&comm, restored)
    }

    /// Sends the saved cells to the ranks that have other blocks, some planes at a time: those that come here, with the first plane. Collective.
    fn exchange_cells(&self, cut: &Decomposition) -> Vec<(usize, Routed)> {
        if self.system.is_none() {
            return Vec::new();
        }
        let ([x, y, z], bytes) = (cut.domain.cells, self.saved_bytes());
        let at_once = (MOST_AT_ONCE / (x * y * bytes)).max(1);
        let mut received = Vec::new();
        for first in (0..z).step_by(at_once) {
            let messages = self.cells_of(cut, first..(first + at_once).min(z));
            received.extend(self.comm.route(messages).into_iter().map(|message| (first, message)));
        }
        received
    }

    /// The saved cells of some planes that go to the ranks that have other blocks.
    fn cells_of(&self, cut: &Decomposition, planes: Range<usize>) -> Vec<Routed> {
        let commons = (0..cut.ranks()).filter_map(|to| Some((to, self.block.common(&cut.block(to))?)));
        let mut messages: Vec<(Block, Routed)> =
            commons.map(|(to, common)| (common, (to, Vec::new()))).collect();
        let mut plane = Vec::new();
        for z in planes.start.max(self.block.lo[2])..planes.end.min(self.block.hi[2]) {
            plane.clear();
            self.save_plane(z, &mut plane);
            for (common, (_, message)) in &mut messages {
                if (common.lo[2]..common.hi[2]).contains(&z) {
                    self.block.cut_plane(&plane, common, self.saved_bytes(), message);
                }
            }
        }
        messages.into_iter().map(|(_, message)| message).filter(|(_, message)| !message.is_empty()).collect()
    }
}

impl Simulation {
    /// Makes the restored state that with which a run of its own begins: the last checkpoint is that of another run, and so is what
    /// the controller has added.
    pub(super) fn begin_anew(&mut self) {
        self.checkpoint = None;
        if let Some(FluidSystem { driving, .. }) = &mut self.system {
            driving.record.begin_anew(self.step);
        }
    }

    /// Writes a checkpoint below a folder, with what the owner of the run adds on rank 0. Errors: a failure of the simulation, of
    /// which nothing is kept; or that of writing; the same on all ranks. Collective.
    pub(super) fn write_state<T: Serialize>(
        &mut self,
        folder: &Path,
        setup: &Setup,
        own: impl FnOnce(&Comm) -> Result<Option<T>>,
    ) -> Result<()> {
        self.check()?;
        let state = checkpoint::agreed(&self.comm, self.save())?;
        let record = self.record.tells().then(|| self.record.clone());
        let json =
            |own| serde_json::to_vec(&Common(state.driving, own, record)).expect("plain data is always JSON");
        let shared = own(&self.comm)?.map_or_else(Vec::new, json);
        let head = Head {
            step: self.step,
            cells: setup.domain.cells,
            bytes_per_cell: self.saved_bytes(),
            case: CaseText {
                name: setup.provenance.name.clone(),
                text: setup.provenance.text.clone(),
                files: setup.provenance.files.clone(),
                resolved: identity(setup).to_string(),
            },
        };
        let part =
            Part { block: self.block, engine: &state.engine, coupling: &state.coupling, shared: &shared };
        checkpoint::write(folder, &self.comm, self.checkpoint, &head, &part, |z, out| {
            self.save_plane(z, out);
        })?;
        self.checkpoint = Some(self.step);
        Ok(())
    }

    /// Restores the newest sound checkpoint below a folder that is of this case and `fits`: what the owner of the run added, and
    /// for each newer checkpoint why it was skipped. `adapt` may change the states of engines and couplings first, part by part. What `fits`
    /// is found on rank 0. Errors: [`Error::Agreed`], the same on every rank, if there is none. Collective.
    pub(super) fn read_state<T: DeserializeOwned>(
        &mut self,
        folder: &Path,
        setup: &Setup,
        is_of_case: impl Fn(&Checkpoint) -> Result<()>,
        fits: impl Fn(&T) -> Result<()>,
        adapt: impl Fn(u64, &mut States) -> Result<()>,
    ) -> Result<(T, Vec<String>)> {
        let comm = self.comm.clone();
        let found = checkpoint::newest_sound(folder, &comm, |saved| {
            let head = saved.head();
            let same = (head.cells, head.bytes_per_cell) == (setup.domain.cells, self.saved_bytes());
            let checked = if same { is_of_case(saved) } else { Err(of_another_case(saved)) };
            let shared =
                checked.and_then(|()| shared_data(saved)).and_then(|shared: Common<T>| match comm.rank() {
                    0 => fits(&shared.1).map_err(|error| of_another_run(saved, &error)).map(|()| shared),
                    _ => Ok(shared),
                });
            let read = shared.and_then(|shared| {
                let mut states = saved.states(&comm)?;
                adapt(head.step, &mut states)?;
                Ok((shared, states))
            });
            let (Common(driving, own, record), states) = checkpoint::agreed(&comm, read)?;
            self.restore(head.step, (driving, record), &states, |block, visit| saved.planes(block, visit))?;
            Ok(own)
        })?;
        self.checkpoint = Some(self.step);
        Ok(found)
    }

    /// Writes a checkpoint of the case below a folder, which may be missing, with bytes of the caller's (those of rank 0 count).
    /// The one that this simulation wrote or read before stays, all others are removed. Collective.
    ///
    /// ```
    /// # use turbid::{Builder, Simulation};
    /// let setup = Builder::example().setup()?;
    /// # let folder = std::env::temp_dir().join(format!("turbid-doc-{}", std::process::id()));
    /// let mut simulation = Simulation::solo(&setup)?;
    /// simulation.advance(3)?;
    /// simulation.write_checkpoint(&folder, &setup, b"mine")?;
    ///
    /// let mut resumed = Simulation::solo(&setup)?;
    /// assert_eq!(resumed.read_checkpoint(&folder, &setup)?, b"mine");
    /// assert_eq!(resumed.state_hash(), simulation.state_hash());
    /// # std::fs::remove_dir_all(folder).unwrap();
    /// # Ok::<(), turbid::Error>(())
    /// ```
    ///
    /// # Errors
    /// A failure of the simulation, of which nothing is kept; or that of writing; the same on all ranks.
    pub fn write_checkpoint(&mut self, folder: &Path, setup: &Setup, own: &[u8]) -> Result<()> {
        self.write_state(folder, setup, |comm| Ok((comm.rank() == 0).then_some(own)))
    }

    /// Restores the newest sound checkpoint of this case below a folder, which any number of ranks may have written; returns the
    /// bytes that its writer added, the same on all ranks. Errors: [`Error::Agreed`], the same on all ranks, if there is none of
    /// this case. Collective.
    pub fn read_checkpoint(&mut self, folder: &Path, setup: &Setup) -> Result<Vec<u8>> {
        let resolved = identity(setup).to_string();
        let is_of_case = |saved: &Checkpoint| {
            let case = &saved.head().case;
            if case.text == setup.provenance.text && case.resolved == resolved {
                Ok(())
            } else {
                Err(of_another_case(saved))
            }
        };
        self.read_state(folder, setup, is_of_case, |_| Ok(()), |_, _| Ok(())).map(|(own, _)| own)
    }

    /// Bytes of a checkpoint, about, of all ranks.
    pub fn checkpoint_bytes(setup: &Setup) -> f64 {
        (setup.domain.cell_count() * AnyFluid::saved_bytes(setup.plan.precision)) as f64
    }
}

/// The data that its owner has added to a checkpoint, or [`Error::Input`] if it is of another form.
pub(super) fn own_data<T: DeserializeOwned>(saved: &Checkpoint) -> Result<T> {
    Ok(shared_data(saved)?.1)
}

fn shared_data<T: DeserializeOwned>(saved: &Checkpoint) -> Result<Common<T>> {
    serde_json::from_slice(saved.shared())
        .map_err(|error| Error::Input(format!("checkpoint {}: {error}", saved.name())))
}

fn of_another_case(saved: &Checkpoint) -> Error {
    Error::Input(format!("checkpoint {} is of another case", saved.name()))
}

/// Refuses a measurement of the flow that no run has made.
fn is_sound(mean: &MeanFlow, units: &Units) -> Result<()> {
    let [u, v, w] = (mean.velocity / units.velocity()).into();
    let numbers = [u, v, w, mean.solid_fraction, mean.max_lattice_speed];
    if numbers.iter().all(|x| x.abs() < FIXED_POINT_LIMIT) && mean.kinetic_energy.is_finite() {
        return Ok(());
    }
    Err(Error::Input(format!(
        "the mean velocity, solid fraction or energy of the flow in the common state is that of no run: {u}, {v}, {w}, {}, {}",
        mean.solid_fraction, mean.kinetic_energy
    )))
}

#[cfg(test)]
mod tests;
