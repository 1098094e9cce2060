//! Saved state of an engine as bytes, and its reading by all ranks.
//!
//! A part, written by one rank, is a [`Header`] and then the owned particles, their loads, the histories of contacts,
//! and the contacts of the last sub-step, as plain data of this machine, and at the end the engine's own data. All
//! parts together are the run. Each is read by one rank, which sends what belongs to others, so the number of ranks may change.

mod load;
#[cfg(test)]
mod tests;

use super::assign::GhostLayer;
use super::exchange::LocalParticles;
use super::population::Population;
use super::{ContactKey, ContactState, Load, LoadRow, Records};
use crate::comm::{Comm, SavedParts};
use crate::error::{Error, Result};
use crate::particle::Particle;
use crate::wall::Wall;
use bytemuck::{Pod, Zeroable};
use load::Case;
use xxhash_rust::xxh3::xxh3_64;

/// Begins every part; the last byte is the version.
const MAGIC: [u8; 8] = *b"turbidE\x03";

/// More numbers than a law remembers of a contact.
const MOST_MEMORY: usize = 1 << 10;

/// The state of one rank.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Saved {
    /// Sub-steps since the start.
    pub substep: u64,
    /// Contacts that began since the start.
    pub begun: u64,
    /// Numbers of the particles of all ranks.
    pub population: Population,
    /// Owned particles.
    pub particles: Vec<Particle>,
    /// Loads of the last step on them.
    pub loads: Vec<Load>,
    /// Memories of contacts.
    pub records: Records,
    /// Contacts of the last sub-step.
    pub states: Vec<ContactState>,
    /// The engine's own data.
    pub own: Vec<u8>,
}

/// The state of an earlier run as a rank begins with it.
///
/// Particles, loads, contacts of the last sub-step and the number of contacts begun are those of the parts that this rank has read: all
/// ranks together have each once, and as they were for the same number of ranks. Memories of contacts are those that this rank evaluates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// All but the engine's own data.
    pub state: Saved,
    /// The engine's own data in the parts that this rank has read and that have some, with their indices.
    pub own: Vec<(usize, Vec<u8>)>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 8],
    /// Of all bytes that follow this number.
    checksum: u64,
    /// Name of the engine, filled up with zeros.
    engine: [u8; 16],
    particles: u64,
    records: u64,
    /// Numbers of each record besides its key.
    memory: u64,
    states: u64,
    substep: u64,
    begun: u64,
    own: u64,
    population: Population,
}

/// End of [`Header::checksum`].
const UNCHECKED: usize = 16;

fn padded(engine: &str) -> [u8; 16] {
    std::array::from_fn(|i| engine.as_bytes().get(i).copied().unwrap_or(0))
}

/// The next `count` items, if there are as many.
fn take<T: Pod>(rest: &mut &[u8], count: u64) -> Option<Vec<T>> {
    let length = usize::try_from(count).ok()?.checked_mul(size_of::<T>())?;
    let (items, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(bytemuck::pod_collect_to_vec(items))
}

impl Saved {
    /// One part.
    pub fn write(&self, engine: &str) -> Vec<u8> {
        assert_eq!(self.loads.len(), self.particles.len());
        let header = Header {
            magic: MAGIC,
            checksum: 0,
            engine: padded(engine),
            particles: self.particles.len() as u64,
            records: self.records.len() as u64,
            memory: self.records.memory() as u64,
            states: self.states.len() as u64,
            substep: self.substep,
            begun: self.begun,
            own: self.own.len() as u64,
            population: self.population,
        };
        let loads: Vec<LoadRow> = self.loads.iter().map(|load| (*load).into()).collect();
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&self.particles));
        bytes.extend_from_slice(bytemuck::cast_slice(&loads));
        bytes.extend_from_slice(self.records.bytes());
        bytes.extend_from_slice(bytemuck::cast_slice(&self.states));
        bytes.extend_from_slice(&self.own);
        let checksum = xxh3_64(&bytes[UNCHECKED..]);
        bytes[UNCHECKED - 8..UNCHECKED].copy_from_slice(bytemuck::bytes_of(&checksum));
        bytes
    }

    /// The contacts that a part, which has been read, has seen begin.
    pub fn begun(part: &[u8]) -> Option<u64> {
        let head = part.get(..size_of::<Header>())?;
        Some(bytemuck::pod_read_unaligned::<Header>(head).begun)
    }

    /// One part, or its defect.
    pub(super) fn read(engine: &str, bytes: &[u8]) -> std::result::Result<Self, String> {
        let (head, mut rest) = bytes
            .split_at_checked(size_of::<Header>())
            .ok_or_else(|| format!("has only {} bytes", bytes.len()))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        if header.magic[..7] != MAGIC[..7] {
            return Err("is something else".into());
        }
        if header.magic != MAGIC {
            return Err(format!("is of version {}, not {}", header.magic[7], MAGIC[7]));
        }
        if header.checksum != xxh3_64(&bytes[UNCHECKED..]) {
            return Err("is damaged: its checksum does not match".into());
        }
        if header.engine != padded(engine) {
            let name = String::from_utf8_lossy(&header.engine);
            return Err(format!("is of the engine `{}`", name.trim_end_matches('\0')));
        }
        let whole = (|| {
            let particles = take(&mut rest, header.particles)?;
            let loads = take::<LoadRow>(&mut rest, header.particles)?;
            let memory = usize::try_from(header.memory).ok().filter(|memory| *memory <= MOST_MEMORY)?;
            let row = (size_of::<ContactKey>() + memory * size_of::<f64>()) as u64;
            let records: Vec<u8> = take(&mut rest, header.records.checked_mul(row)?)?;
            let records = Records::from_bytes(memory, &records);
            let states = take(&mut rest, header.states)?;
            let own = take(&mut rest, header.own)?;
            rest.is_empty().then(|| Self {
                substep: header.substep,
                begun: header.begun,
                population: header.population,
                particles,
                loads: loads.into_iter().map(Load::from).collect(),
                records,
                states,
                own,
            })
        })();
        whole.ok_or_else(|| format!("has {} bytes, which are not those its head counts", bytes.len()))
    }

    /// The state that the ranks of an earlier run saved, for an engine with these templates and these walls, whose contact law remembers
    /// `memory` numbers of a contact. Collective.
    ///
    /// # Errors
    /// [`Error::Input`], the same on every rank, if the parts are damaged, incomplete, or of another engine, version or case.
    pub fn load(
        engine: &str,
        comm: &Comm,
        parts: &SavedParts,
        (near, local, walls): (&GhostLayer, &LocalParticles, &[Wall]),
        memory: usize,
    ) -> Result<Loaded> {
        let templates = &local.store.templates;
        let case = Case {
            templates: templates.len(),
            most_parts: templates.iter().map(|template| template.parts().count()).max().unwrap_or(1),
            walls: walls.iter().map(|wall| wall.surface.facets()).collect(),
            memory,
            near,
        };
        case.load(engine, comm, parts).map_err(|what| {
            Error::Input(format!("the saved state of the {engine} engine cannot be used: {what}"))
        })
    }
}
