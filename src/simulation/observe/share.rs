//! What this rank writes of the files for `ParaView`: everything at rank 0 where the ranks share one memory, the piece of its own
//! block where they are processes.

use super::gather::{self, Fields};
use super::{CONTACTS, Due, FIELDS, Looks, PARTICLES, SURFACES};
use crate::case::Setup;
use crate::dem::ContactState;
use crate::domain::{Block, Decomposition};
use crate::error::Result;
use crate::output::{
    Contact, FieldSnapshot, ForceAndTorque, OutputFiles, pieces, write_contacts, write_fields,
    write_force_chains,
};
use crate::particle::Particle;
use crate::simulation::Simulation;
use std::path::{Path, PathBuf};

/// Data of one step; those that are not due are not there.
pub(super) struct Share {
    /// Whose piece this is; nothing if it is the whole.
    rank: Option<usize>,
    fields: Option<(Block, Fields)>,
    /// Those that are written as points, ascending by id, and what the fluid does to them.
    points: Option<(Vec<Particle>, Option<Vec<ForceAndTorque>>)>,
    /// Those whose surfaces are written, ascending by id.
    surfaces: Option<Vec<Particle>>,
    /// Ascending by the ids of the pair, and particles, ascending by id, that hold both of each pair.
    contacts: Option<(Vec<Contact>, Vec<Particle>)>,
}

impl Share {
    /// All of it on rank 0, nothing elsewhere; `touches` are the contacts this rank is responsible for. Collective.
    ///
    /// # Errors
    /// On every rank, if one of them has not the memory.
    pub(super) fn whole(
        simulation: &mut Simulation,
        decomposition: &Decomposition,
        due: Due,
        touches: &[ContactState],
    ) -> Result<Self> {
        let first = simulation.comm.rank() == 0;
        let block = Block {
            lo: [0; 3],
            hi: decomposition.domain.cells,
        };
        let fields = due[FIELDS].then(|| gather::fields(simulation, decomposition));
        let fields = fields.transpose()?.map(|fields| (block, fields));
        let contacts = due[CONTACTS].then(|| gather::contacts(simulation, touches));
        let particles = if due[PARTICLES] || due[SURFACES] || due[CONTACTS] {
            gather::particles(simulation, |_| true)
        } else {
            Vec::new()
        };
        let points = due[PARTICLES].then(|| {
            let loads = gather::loads(simulation, &particles, false);
            (particles.clone(), loads)
        });
        Ok(Self {
            rank: None,
            fields: fields.filter(|_| first),
            contacts: contacts
                .filter(|_| first)
                .map(|contacts| (contacts, particles.clone())),
            points: points.filter(|_| first),
            surfaces: (due[SURFACES] && first).then_some(particles),
        })
    }

    /// What belongs to this rank: the cells of its block, its particles, the contacts it is responsible for. Collective.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) on this rank.
    pub(super) fn piece(
        simulation: &mut Simulation,
        decomposition: &Decomposition,
        due: Due,
        touches: &[ContactState],
    ) -> Result<Self> {
        let rank = simulation.comm.rank();
        let block = decomposition.block(rank);
        let contacts = due[CONTACTS].then(|| {
            let contacts = touches.iter().map(gather::contact).collect();
            (contacts, gather::partners(simulation, touches))
        });
        let points = due[PARTICLES].then(|| {
            let own = simulation.dem.particles().owned();
            (own.to_vec(), gather::loads(simulation, own, true))
        });
        // Last, as it is no matter of the others whether this rank has room for them.
        let fields = due[FIELDS].then(|| gather::own_fields(simulation, block));
        Ok(Self {
            rank: Some(rank),
            fields: fields.transpose()?.map(|fields| (block, fields)),
            points,
            surfaces: due[SURFACES].then(|| simulation.dem.particles().owned().to_vec()),
            contacts,
        })
    }

    /// Writes the files.
    pub(super) fn write(&self, setup: &Setup, files: &OutputFiles, looks: &Looks, step: u64) -> Result<()> {
        let domain = &setup.domain;
        if let Some((block, fields)) = &self.fields {
            let snapshot = FieldSnapshot {
                domain: *domain,
                block: *block,
                time: step as f64 * setup.time_step,
                velocity: &fields.velocity,
                pressure: &fields.pressure,
                solid_fraction: &fields.solid_fraction,
            };
            write_fields(&self.path(&files.fields(step)), &snapshot)?;
        }
        if let Some((particles, loads)) = &self.points {
            let path = self.path(&files.particles(step));
            looks.points.write(&path, domain, particles, loads.as_deref())?;
        }
        if let Some(particles) = &self.surfaces {
            let path = self.path(&files.surfaces(step));
            looks.surfaces.write(&path, domain, particles)?;
        }
        if let Some((contacts, particles)) = &self.contacts {
            write_contacts(&self.path(&files.contacts(step)), contacts)?;
            write_force_chains(&self.path(&files.force_chains(step)), domain, particles, contacts)?;
        }
        Ok(())
    }

    /// Where this share of a file goes.
    fn path(&self, file: &Path) -> PathBuf {
        self.rank
            .map_or_else(|| file.to_path_buf(), |rank| pieces::piece(file, rank))
    }
}
