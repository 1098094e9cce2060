//! An engine in all processes of an MPI job, seen as a whole by each of them: for comparisons with an engine on one rank.

use crate::comm::{Comm, SavedParts};
use crate::dem::{ContactState, ContactSummary, DemEngine, Load};
use crate::error::{Error, Result};
use crate::particle::{Particle, ParticleStore};
use crate::shape::Shape;

/// All particles and contacts of an engine on every rank. Its calls are collective among the processes, whatever communicator they name.
pub(super) struct Whole {
    engine: Box<dyn DemEngine>,
    comm: Comm,
    store: ParticleStore,
    contacts: ContactSummary,
}

impl Whole {
    pub(super) fn new(engine: Box<dyn DemEngine>, comm: Comm) -> Self {
        let templates = engine.particles().templates.clone();
        let store = ParticleStore { templates, particles: Vec::new(), owned: 0, owners: Vec::new() };
        let mut whole = Self { engine, comm, store, contacts: ContactSummary::default() };
        whole.gather();
        whole
    }

    fn gather(&mut self) {
        let owned = bytemuck::cast_slice(self.engine.particles().owned()).to_vec();
        let mut all: Vec<Particle> = bytemuck::pod_collect_to_vec(&self.comm.all_gather(owned).concat());
        all.sort_unstable_by_key(|particle| particle.id);
        (self.store.owned, self.store.owners) = (all.len(), vec![0; all.len()]);
        self.store.particles = all;
        let own = self.engine.contacts();
        let (mut counts, mut depth) = ([own.count as i64, own.begun as i64], [own.max_depth]);
        self.comm.sum(&mut counts);
        self.comm.max(&mut depth);
        self.contacts =
            ContactSummary { count: counts[0] as usize, max_depth: depth[0], begun: counts[1] as u64 };
    }

    fn unsupported<R>(&self) -> Result<R> {
        let what = "saving and resuming of a comparison in several processes".into();
        Err(Error::Unsupported { engine: self.name(), what })
    }
}

impl DemEngine for Whole {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        self.engine.supports(shape)
    }

    fn particles(&self) -> &ParticleStore {
        &self.store
    }

    fn advance(&mut self, _: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let owned = self.engine.particles().owned().iter();
        let place = |own: &Particle| self.store.particles.binary_search_by_key(&own.id, |p| p.id);
        let own: Vec<Load> = owned.map(|particle| loads[place(particle).expect("one of all")]).collect();
        let moved = self.engine.advance(&self.comm, &own, dt);
        self.comm.agree(moved)?;
        self.gather();
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        self.contacts
    }

    fn tells_contacts(&self) -> bool {
        self.engine.tells_contacts()
    }

    fn contact_states(&self, _: &Comm) -> Vec<ContactState> {
        let own = self.engine.contact_states(&self.comm);
        let all = self.comm.all_gather(bytemuck::cast_slice(&own).to_vec());
        let mut all: Vec<ContactState> = bytemuck::pod_collect_to_vec(&all.concat());
        all.sort_by_key(ContactState::key);
        all
    }

    fn health(&self) -> Result<()> {
        self.engine.health()
    }

    fn save(&self, _: &Comm) -> Result<Vec<u8>> {
        self.unsupported()
    }

    fn restore(&mut self, _: &Comm, _: &SavedParts) -> Result<()> {
        self.unsupported()
    }
}
