//! An engine that tells what it was given.

use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::{Ballistic, ContactState, ContactSummary, DemEngine, Load};
use crate::domain::Decomposition;
use crate::error::Result;
use crate::particle::ParticleStore;
use crate::shape::Shape;
use std::sync::{Arc, Mutex};

/// A ballistic engine whose last load on its first particle can be read while a simulation owns it.
pub(super) struct FixedParticles {
    engine: Ballistic,
    load: Arc<Mutex<Load>>,
}

impl FixedParticles {
    /// The particles of a case, held where they are; and where to read the load.
    pub(super) fn new(setup: &Setup, decomposition: &Decomposition) -> (Box<Self>, Arc<Mutex<Load>>) {
        let load = Arc::new(Mutex::new(Load::default()));
        let templates = setup.templates.clone();
        let engine = Ballistic::new(decomposition.clone(), 0, templates, &setup.particles);
        let held = Self {
            engine,
            load: Arc::clone(&load),
        };
        (Box::new(held), load)
    }

    fn tell(&self, load: Load) {
        *self.load.lock().expect("no holder of the load panics") = load;
    }
}

impl DemEngine for FixedParticles {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        self.engine.supports(shape)
    }

    fn particles(&self) -> &ParticleStore {
        self.engine.particles()
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        self.tell(loads[0]);
        self.engine.advance(comm, loads, dt)
    }

    fn contact_states(&self) -> Vec<ContactState> {
        Vec::new()
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.engine.save()
    }

    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        self.engine.restore(comm, parts)?;
        self.tell(self.engine.last_loads().first().copied().unwrap_or_default());
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        self.engine.contacts()
    }
}
