//! The state of a run in the hands of another owner: a checkpoint with what that one adds.

use super::saved::SavedDriving;
use super::{Simulation, identity};
use crate::case::Setup;
use crate::checkpoint::{self, CaseText, Head, Part};
use crate::error::{Error, Result};
use std::path::Path;

/// Of rank 0, with the caller's bytes.
type Shared = (SavedDriving, Vec<u8>);

impl Simulation {
    /// The head of a checkpoint of this step.
    pub(super) fn head(&self, setup: &Setup) -> Head {
        Head {
            step: self.step,
            cells: setup.domain.cells,
            bytes_per_cell: self.saved_bytes(),
            case: CaseText {
                name: setup.provenance.name.clone(),
                text: setup.provenance.text.clone(),
                files: setup.provenance.files.clone(),
                resolved: identity(setup).to_string(),
            },
        }
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
        self.check()?;
        let state = checkpoint::agreed(&self.comm, self.save())?;
        let shared = match self.comm.rank() {
            0 => serde_json::to_vec(&(state.driving, own)).expect("plain data is always JSON"),
            _ => Vec::new(),
        };
        let head = self.head(setup);
        let part = Part {
            block: self.block,
            engine: &state.engine,
            coupling: &state.coupling,
            shared: &shared,
        };
        checkpoint::write(folder, &self.comm, self.checkpoint, &head, &part, |z, out| {
            self.save_plane(z, out);
        })?;
        self.checkpoint = Some(self.step);
        Ok(())
    }

    /// Resumes the newest sound checkpoint of this case below a folder, which any number of ranks may have written; returns the
    /// bytes that its writer added, the same on all ranks. Collective.
    ///
    /// # Errors
    /// [`Error::Agreed`], the same on all ranks, if there is none of this case.
    pub fn read_checkpoint(&mut self, folder: &Path, setup: &Setup) -> Result<Vec<u8>> {
        let comm = self.comm.clone();
        let resolved = identity(setup).to_string();
        let (own, _) = checkpoint::newest_sound(folder, &comm, |saved| {
            let head = saved.head();
            let fits = (head.cells, head.bytes_per_cell) == (setup.domain.cells, self.saved_bytes())
                && head.case.text == setup.provenance.text
                && head.case.resolved == resolved;
            let shared = if fits {
                serde_json::from_slice::<Shared>(saved.shared())
                    .map_err(|error| Error::Input(format!("{}: {error}", saved.name())))
            } else {
                Err(Error::Input(format!("{} is of another case", saved.name())))
            };
            let read = shared.and_then(|shared| Ok((shared, saved.engines()?, saved.couplings()?)));
            let ((driving, own), engines, couplings) = checkpoint::agreed(&comm, read)?;
            self.restore(head.step, driving, &engines, &couplings, |block, visit| {
                saved.planes(block, visit)
            })?;
            Ok(own)
        })?;
        self.checkpoint = Some(self.step);
        Ok(own)
    }

    /// Bytes of a checkpoint, about, of all ranks.
    pub(crate) fn checkpoint_bytes(setup: &Setup) -> f64 {
        (setup.domain.cell_count() * crate::coupling::AnyFluid::saved_bytes(setup.plan.precision)) as f64
    }
}
