//! A simulation in the precision that its case asks for, and an engine that tells what it was given.

use crate::case::Setup;
use crate::comm::Comm;
use crate::coupling::MeanFlow;
use crate::dem::{Ballistic, ContactState, ContactSummary, DemEngine, Load};
use crate::domain::Decomposition;
use crate::error::Result;
use crate::fluid::Precision;
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore};
use crate::shape::Shape;
use crate::simulation::Simulation;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// One rank's part of a run.
pub(super) enum Simulation {
    /// Populations of four bytes.
    Single(Box<Simulation<f32>>),
    /// Populations of eight bytes.
    Double(Box<Simulation<f64>>),
}

/// The same words for both.
macro_rules! either {
    ($of:expr, $simulation:ident => $words:expr) => {
        match $of {
            Simulation::Single($simulation) => $words,
            Simulation::Double($simulation) => $words,
        }
    };
}

impl Simulation {
    /// A case at rest. Collective.
    pub(super) fn new(setup: &Setup, decomposition: &Decomposition, comm: Comm) -> Result<Self> {
        Ok(match setup.plan.precision {
            Precision::F32 => Self::Single(Box::new(Simulation::new(setup, decomposition, comm)?)),
            Precision::F64 => Self::Double(Box::new(Simulation::new(setup, decomposition, comm)?)),
        })
    }

    /// A case at rest whose particles move as an engine says. Collective.
    pub(super) fn with_engine(
        setup: &Setup,
        decomposition: &Decomposition,
        comm: Comm,
        engine: Box<dyn DemEngine>,
    ) -> Result<Self> {
        Ok(match setup.plan.precision {
            Precision::F32 => {
                let simulation = Simulation::with_engine(setup, decomposition, comm, engine)?;
                Self::Single(Box::new(simulation))
            }
            Precision::F64 => {
                let simulation = Simulation::with_engine(setup, decomposition, comm, engine)?;
                Self::Double(Box::new(simulation))
            }
        })
    }

    /// Advances by some steps. Collective.
    pub(super) fn steps(&mut self, count: u64) -> Result<()> {
        either!(self, simulation => (0..count).try_for_each(|_| simulation.step()))
    }

    /// Steps done.
    pub(super) fn done(&self) -> u64 {
        either!(self, simulation => simulation.steps_done())
    }

    /// Means over the box at the last measurement.
    pub(super) fn mean_flow(&self) -> MeanFlow {
        either!(self, simulation => simulation.mean_flow())
    }

    /// Acceleration of the fluid in the coming step (m/s^2).
    pub(super) fn acceleration(&self) -> Vec3 {
        either!(self, simulation => simulation.acceleration())
    }

    /// Force and torque of the fluid on each wall in the last step. Collective.
    pub(super) fn wall_loads(&self) -> Vec<Load> {
        either!(self, simulation => simulation.wall_loads())
    }

    /// The ranks.
    pub(super) fn comm(&self) -> &Comm {
        either!(self, simulation => simulation.comm())
    }

    /// The engine.
    pub(super) fn dem(&self) -> &dyn DemEngine {
        either!(self, simulation => simulation.dem())
    }

    /// The particles of this rank.
    pub(super) fn owned(&self) -> &[Particle] {
        self.dem().particles().owned()
    }

    /// Writes a checkpoint below a folder, with bytes of the caller's. Collective.
    pub(super) fn write_snapshot(
        &mut self,
        folder: &Path,
        setup: &Setup,
        decomposition: &Decomposition,
        sound: Option<u64>,
        own: &[u8],
    ) -> Result<()> {
        either!(self, simulation => simulation.write_snapshot(folder, setup, decomposition, sound, own))
    }

    /// Goes on from the newest checkpoint below a folder; the bytes of its writer. Collective.
    pub(super) fn read_snapshot(&mut self, folder: &Path, setup: &Setup) -> Result<Vec<u8>> {
        either!(self, simulation => simulation.read_snapshot(folder, setup))
    }

    /// Size of a checkpoint (bytes), about.
    pub(super) fn snapshot_bytes(&self, setup: &Setup) -> f64 {
        match self {
            Self::Single(_) => Simulation::<f32>::snapshot_bytes(setup),
            Self::Double(_) => Simulation::<f64>::snapshot_bytes(setup),
        }
    }

    /// Velocity (cells per step) of the bare populations in a cell of the block.
    pub(super) fn lattice_velocity(&self, cell: [usize; 3]) -> Vec3 {
        const WET: &str = "a case with a fluid";
        either!(self, simulation => simulation.fluid().expect(WET).moments(cell).1.into())
    }
}

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
