//! The state of a run in the hands of another owner: a checkpoint with what that one adds.

use super::saved::SavedDriving;
use super::{Simulation, identity};
use crate::case::Setup;
use crate::checkpoint::{self, CaseText, Checkpoint, Head, Part};
use crate::comm::Comm;
use crate::error::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

impl Simulation {
    /// Writes a checkpoint below a folder, with what the owner of the run adds on rank 0. Collective.
    ///
    /// # Errors
    /// A failure of the simulation, of which nothing is kept; or that of writing; the same on all ranks.
    pub(super) fn write_state<T: Serialize>(
        &mut self,
        folder: &Path,
        setup: &Setup,
        own: impl FnOnce(&Comm) -> Result<Option<T>>,
    ) -> Result<()> {
        self.check()?;
        let state = checkpoint::agreed(&self.comm, self.save())?;
        let shared = own(&self.comm)?.map(|own| serde_json::to_vec(&(state.driving, own)));
        let shared = shared.map_or_else(Vec::new, |bytes| bytes.expect("plain data is always JSON"));
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

    /// Resumes the newest checkpoint below a folder that is sound, of this case and as its owner wants it: what that one added,
    /// and for each newer checkpoint why it was left out. Collective.
    ///
    /// # Errors
    /// [`Error::Agreed`], the same on every rank, if there is none.
    pub(super) fn read_state<T: DeserializeOwned>(
        &mut self,
        folder: &Path,
        setup: &Setup,
        is_of_case: impl Fn(&Checkpoint) -> Result<()>,
        fits: impl Fn(&T) -> Result<()>,
    ) -> Result<(T, Vec<String>)> {
        let comm = self.comm.clone();
        let found = checkpoint::newest_sound(folder, &comm, |saved| {
            let head = saved.head();
            let same = (head.cells, head.bytes_per_cell) == (setup.domain.cells, self.saved_bytes());
            let checked = if same { is_of_case(saved) } else { Err(of_another_case(saved)) };
            let shared = checked
                .and_then(|()| {
                    serde_json::from_slice::<(SavedDriving, T)>(saved.shared())
                        .map_err(|error| Error::Input(format!("{}: {error}", saved.name())))
                })
                .and_then(|shared| fits(&shared.1).map(|()| shared));
            let read = shared.and_then(|shared| Ok((shared, saved.engines()?, saved.couplings()?)));
            let ((driving, own), engines, couplings) = checkpoint::agreed(&comm, read)?;
            self.restore(head.step, driving, &engines, &couplings, |block, visit| {
                saved.planes(block, visit)
            })?;
            Ok(own)
        })?;
        self.checkpoint = Some(self.step);
        Ok(found)
    }

    /// Writes a checkpoint of the case below a folder of checkpoints, which may be missing, with bytes of the caller's (those of
    /// rank 0 count). The one that this simulation wrote or read before stays, all others are removed. Collective.
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

    /// Resumes the newest sound checkpoint of this case below a folder, which any number of ranks may have written; returns the
    /// bytes that its writer added, the same on all ranks. Collective.
    ///
    /// # Errors
    /// [`Error::Agreed`], the same on all ranks, if there is none of this case.
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
        self.read_state(folder, setup, is_of_case, |_| Ok(())).map(|(own, _)| own)
    }

    /// Bytes of a checkpoint, about, of all ranks.
    pub fn checkpoint_bytes(setup: &Setup) -> f64 {
        (setup.domain.cell_count() * crate::coupling::AnyFluid::saved_bytes(setup.plan.precision)) as f64
    }
}

fn of_another_case(saved: &Checkpoint) -> Error {
    Error::Input(format!("{} is of another case", saved.name()))
}
