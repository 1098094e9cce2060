//! LIGGGHTS behind the engine trait: spheres, one instance, in a worker process or in this one.
//!
//! Rank 0 has the instance; loads are gathered there, and the states of all particles go to all ranks, each of which takes
//! its own. So any number of ranks gets the same bits, up to the some tens of thousands of particles that one core moves.
//!
//! LIGGGHTS has positions, velocities, angular velocities and the history of the contacts; orientations, which spheres
//! do not need, are integrated here. Counts and overlaps of contacts come from the geometry; the force of each is requested only
//! when it is written, and LIGGGHTS then computes it again. Friction is limited to Coulomb's, as LIGGGHTS adds a dashpot to it
//! that did not act if the contact slid.

mod contacts;
mod deck;
mod instance;
mod protocol;
mod restart;
mod session;
pub mod worker;

pub use instance::end;
#[doc(hidden)]
pub use protocol::read_messages;

use bytemuck::{bytes_of, cast_slice, pod_collect_to_vec, pod_read_unaligned};
use instance::Outcome;
use protocol::{Atom, AtomLoad, ContactForce, Request, State};
use session::Session;
use std::cell::RefCell;
use std::fmt::Display;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use turbid_core::comm::Comm;
use turbid_core::contact::{ContactModel, GrownShape, PairFinder};
use turbid_core::dem::assign::GhostLayer;
use turbid_core::dem::exchange::LocalParticles;
use turbid_core::dem::integrator::{self, Inertia};
use turbid_core::dem::native::face_passed;
use turbid_core::dem::native::failures::{outside, position_text};
use turbid_core::dem::saved::Saved;
use turbid_core::dem::{ContactState, ContactSummary, DemEngine, Load};
use turbid_core::domain::Decomposition;
use turbid_core::error::{Error, Result};
use turbid_core::math::Vec3;
use turbid_core::particle::{Particle, ParticleStore, Template};
use turbid_core::shape::Shape;
use turbid_core::wall::Wall;
use worker::Worker;

const NAME: &str = "liggghts";

/// Parameters of the LIGGGHTS engine.
#[derive(Clone, Debug, Default)]
pub struct LiggghtsParams {
    /// Elasticity, restitution, kinetic friction and enlargement; without, particles pass through each other and through walls.
    pub contact: Option<ContactModel>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: Vec3,
    /// Sub-steps per call of [`advance`](DemEngine::advance), at least one.
    pub substeps: u32,
    /// Whether LIGGGHTS runs in this process instead of a worker.
    pub in_this_process: bool,
    /// Commands of the user, given after all others of the set-up and before the first step. The caller checks them: a
    /// command of LIGGGHTS can read and write any file.
    pub commands: Vec<String>,
    /// Longest time that a worker may take to answer (s), 60 if not given; ten times as long for the set-up and for
    /// saving.
    pub timeout: Option<f64>,
    /// File to which LIGGGHTS's log of the set-up, and all that a worker prints, is appended.
    pub log: Option<PathBuf>,
    /// The turbid program, to be started as the worker; without, the program that runs now.
    pub program: Option<PathBuf>,
    /// Set when the run is told to stop: then a worker that does not answer is not waited for much longer.
    pub stop: Arc<AtomicBool>,
}

impl LiggghtsParams {
    /// Walls that particles touch.
    fn touched_walls(&self) -> &[Wall] {
        if self.contact.is_some() { &self.walls } else { &[] }
    }
}

/// Process in which LIGGGHTS runs.
#[derive(Debug)]
enum Process {
    Own(Option<Session>),
    Worker(Worker),
}

impl Process {
    fn ask(&mut self, request: Request, bytes: &[u8]) -> Outcome<Vec<u8>> {
        match self {
            Self::Own(session) => session::serve(session, request, bytes),
            Self::Worker(worker) => worker.ask(&request, bytes),
        }
    }
}

/// State of rank 0.
#[derive(Debug)]
struct Root {
    process: RefCell<Process>,
    /// Radius of contact (m) by index.
    radii: Vec<f64>,
    /// Index of the template by index.
    templates: Vec<usize>,
    finder: PairFinder,
    /// Wrapped positions (m) by index.
    positions: Vec<Vec3>,
    /// Contacts of the last step, ascending; a wall is [`ContactState::of_wall`] of its index.
    pairs: Vec<(u64, u64)>,
    summary: ContactSummary,
}

/// The LIGGGHTS engine.
#[derive(Debug)]
pub struct Liggghts {
    params: LiggghtsParams,
    rank: usize,
    near: GhostLayer,
    population: LocalParticles,
    /// By template.
    inertias: Vec<Inertia>,
    /// By template.
    contours: Vec<GrownShape>,
    /// Ids of all particles, ascending; a particle's index here is that in LIGGGHTS.
    ids: Vec<u64>,
    /// Without particles there is none.
    root: Option<Root>,
    /// Calls of [`advance`](DemEngine::advance) since the start.
    step: u64,
    /// True if the engine has failed: then nothing moves any more.
    failed: bool,
    /// Why LIGGGHTS did not return the contacts, until [`health`](DemEngine::health) reports it.
    pending_error: RefCell<Option<String>>,
}

impl Liggghts {
    /// The part of `all` that this rank owns or has as ghosts, with LIGGGHTS set up on rank 0; all arguments are the same on
    /// every rank. Collective.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for shapes and walls that LIGGGHTS does not have; [`Error::Input`] if it does not start, or
    /// refuses the set-up.
    pub fn new(
        params: LiggghtsParams,
        decomposition: Decomposition,
        comm: &Comm,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Result<Self> {
        assert!(params.substeps > 0);
        if let Some(template) = templates.iter().find(|t| t.shape.as_sphere().is_none()) {
            let kind = template.shape.kind();
            return Err(unsupported(format!("a particle that is a {kind}: it has spheres only")));
        }
        let enlargement = params.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        let contour = |template: &Template| GrownShape::new(template.shape.clone(), enlargement);
        let contours: Vec<GrownShape> = templates.iter().map(contour).collect();
        let reach: Vec<f64> = contours.iter().map(GrownShape::reach).collect();
        let (rank, inertias) = (comm.rank(), templates.iter().map(Inertia::of).collect());
        let near = GhostLayer::new(decomposition, rank, &reach);
        let population = LocalParticles::new(&near, templates, Vec::new());
        let mut engine = Self {
            params,
            rank,
            near,
            population,
            inertias,
            contours,
            ids: Vec::new(),
            root: None,
            step: 0,
            failed: false,
            pending_error: RefCell::default(),
        };
        engine.begin(comm, all, &[])?;
        Ok(engine)
    }

    /// Starts with these particles, or resumes with them from what LIGGGHTS saved, if it did. Collective.
    fn begin(&mut self, comm: &Comm, all: &[Particle], saved: &[u8]) -> Result<()> {
        let mut all = all.to_vec();
        all.sort_unstable_by_key(|particle| particle.id);
        self.ids = all.iter().map(|particle| particle.id).collect();
        for particle in &mut all {
            let inertia = &self.inertias[particle.template as usize];
            let (orientation, spin) = (particle.orientation(), particle.angular_velocity());
            particle.angular_momentum = inertia.angular_momentum(&orientation, spin).into();
        }
        self.population.replace(&self.near, all.iter().map(|particle| (*particle, Load::default())));
        let outcome = if self.rank == 0 { self.launch(&all, saved) } else { Ok(()) };
        // The others learn whether it has worked.
        self.failed = comm.any(outcome.is_err());
        match outcome {
            Ok(()) if self.failed => Err(Error::OtherRank),
            outcome => outcome,
        }
    }

    /// Starts LIGGGHTS with these particles; on rank 0.
    fn launch(&mut self, all: &[Particle], saved: &[u8]) -> Result<()> {
        // The instance of this process, if there is one, must be free before it is taken again.
        self.root = None;
        let domain = self.near.decomposition().domain;
        let radii: Vec<f64> = (all.iter()).map(|p| self.contours[p.template as usize].reach()).collect();
        if let Some(particle) = all.iter().find(|particle| !particle.is_finite()) {
            return Err(Error::Input(format!("the state of particle {} is not finite", particle.id)));
        }
        if all.is_empty() {
            return Ok(());
        }
        let smallest = radii.iter().copied().fold(f64::INFINITY, f64::min);
        let plan = deck::plan(&self.params, &domain, smallest).map_err(unsupported)?;
        let atoms = (all.iter().zip(&radii)).map(|(p, &radius)| self.atom(p, radius)).collect();
        let mut process = if self.params.in_this_process {
            Process::Own(None)
        } else {
            Process::Worker(Worker::start(&self.params).map_err(refused)?)
        };
        process.ask(Request::Open(plan, atoms), saved).map_err(refused)?;
        self.root = Some(Root {
            process: RefCell::new(process),
            radii,
            templates: all.iter().map(|p| p.template as usize).collect(),
            finder: PairFinder::new(domain),
            positions: all.iter().map(|p| domain.wrap(p.position())).collect(),
            pairs: Vec::new(),
            summary: ContactSummary::default(),
        });
        Ok(())
    }

    /// A particle with this radius of contact (m), as LIGGGHTS is given it.
    fn atom(&self, particle: &Particle, radius: f64) -> Atom {
        let template = particle.template as usize;
        // Without an enlargement exactly one.
        let grown = radius / self.contours[template].shape.circumradius();
        Atom {
            id: particle.id,
            position: self.near.decomposition().domain.wrap(particle.position()).into(),
            velocity: particle.velocity,
            angular_velocity: particle.angular_velocity,
            radius,
            mass: self.inertias[template].mass,
            inertia_ratio: grown * grown,
            material: self.population.store.templates[template].material,
        }
    }

    /// The loads and the weight of the owned particles, with their indices, as a message to rank 0.
    fn load_message(&self, loads: &[Load]) -> Vec<u8> {
        let mut message = Vec::new();
        for (particle, load) in self.population.store.owned().iter().zip(loads) {
            let index = self.index(particle.id) as u64;
            let weight = self.params.gravity * self.inertias[particle.template as usize].mass;
            let load = AtomLoad { force: (load.force + weight).into(), torque: load.torque.into() };
            message.extend_from_slice(&index.to_le_bytes());
            message.extend_from_slice(bytes_of(&load));
        }
        message
    }

    /// Index of a particle among all.
    fn index(&self, id: u64) -> usize {
        self.ids.binary_search(&id).expect("the ids are those of all particles")
    }

    /// Makes a step of LIGGGHTS under the loads of all ranks, on rank 0; the bytes of a [`State`] for each particle.
    fn step_liggghts(&self, messages: &[Vec<u8>], dt: f64) -> Result<Vec<u8>> {
        let mut loads = vec![AtomLoad::default(); self.ids.len()];
        for entry in messages.iter().flat_map(|m| m.chunks_exact(8 + size_of::<AtomLoad>())) {
            let (index, load) = entry.split_at(8);
            loads[pod_read_unaligned::<u64>(index) as usize] = pod_read_unaligned(load);
        }
        // NaN sends LIGGGHTS out of its arrays.
        if let Some(at) = cast_slice::<_, f64>(&loads).iter().position(|x| !x.is_finite()) {
            return Err(self.failure(format!("the load on particle {} is not finite", self.ids[at / 6])));
        }
        let substeps = self.params.substeps;
        let request = Request::Advance { step: dt / f64::from(substeps), substeps };
        let states = self.process().map(|process| process.borrow_mut().ask(request, cast_slice(&loads)));
        states.unwrap_or_else(|| Ok(Vec::new())).map_err(|what| self.failure(what))
    }

    /// LIGGGHTS, on rank 0, if it has particles and works.
    fn process(&self) -> Option<&RefCell<Process>> {
        self.root.as_ref().filter(|_| !self.failed).map(|root| &root.process)
    }

    fn failure(&self, what: String) -> Error {
        Error::Engine { engine: NAME, step: self.step, what }
    }

    /// Updates the owned particles, and returns the first failure.
    fn update_particles(&mut self, states: &[State], dt: f64) -> Result<()> {
        let mut outcome = Ok(());
        for k in 0..self.population.store.owned {
            let particle = self.population.store.particles[k];
            match self.updated(particle, &states[self.index(particle.id)], dt) {
                Ok(particle) => self.population.store.particles[k] = particle,
                failed => outcome = outcome.and(failed.map(drop)),
            }
        }
        outcome
    }

    /// A particle in its new state.
    fn updated(&self, mut particle: Particle, state: &State, dt: f64) -> Result<Particle> {
        let domain = self.near.decomposition().domain;
        let position = domain.wrap(state.position.into());
        if let Some(face) = face_passed(&domain, position) {
            let after = Particle { position: position.into(), ..particle };
            return Err(outside(self.step, &particle, &after, face, &self.params.walls));
        }
        let moved = domain.nearest_image(position - particle.position()).amax();
        if moved > domain.dx || moved.is_nan() {
            let what = format!(
                "particle {} at {}: moved {moved:.3e} m in one step, more than a cell ({:.3e} m)",
                particle.id,
                position_text(particle.position()),
                domain.dx
            );
            return Err(Error::Diverged { step: self.step, what });
        }
        let spin = Vec3::from(state.angular_velocity);
        let mean = (particle.angular_velocity() + spin) * 0.5;
        let orientation = integrator::turned(&particle.orientation(), mean, dt);
        let inertia = &self.inertias[particle.template as usize];
        particle.set_orientation(&orientation);
        particle.position = position.into();
        particle.velocity = state.velocity;
        particle.angular_velocity = state.angular_velocity;
        particle.angular_momentum = inertia.angular_momentum(&orientation, spin).into();
        particle.contact_force = state.contact_force;
        particle.contact_torque = state.contact_torque;
        Ok(particle)
    }
}

impl DemEngine for Liggghts {
    fn name(&self) -> &'static str {
        NAME
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        shape.as_sphere().is_some()
    }

    fn particles(&self) -> &ParticleStore {
        &self.population.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        assert_eq!(loads.len(), self.population.store.owned);
        let messages = comm.gather(self.load_message(loads));
        let (mut bytes, mut outcome) = (Vec::new(), Ok(()));
        if self.rank == 0 && !self.failed {
            match self.step_liggghts(&messages, dt) {
                Ok(states) => bytes = states,
                Err(error) => (self.failed, outcome) = (true, Err(error)),
            }
        }
        if comm.size() > 1 {
            bytes = comm.all_gather(bytes).swap_remove(0);
        }
        let states: Vec<State> = pod_collect_to_vec(&bytes);
        if states.len() == self.ids.len() {
            let positions: Vec<Vec3> = states.iter().map(|state| state.position.into()).collect();
            outcome = self.count(&positions).and(self.update_particles(&states, dt));
            self.population.loads.copy_from_slice(loads);
            self.population.refresh(&self.near, comm);
        }
        self.step += 1;
        outcome
    }

    fn contacts(&self) -> ContactSummary {
        self.root.as_ref().map_or_else(ContactSummary::default, |root| root.summary)
    }

    fn contact_states(&self) -> Vec<ContactState> {
        let (Some(root), Some(process), 1..) = (&self.root, self.process(), self.step) else {
            return Vec::new();
        };
        let answer = process.borrow_mut().ask(Request::Contacts, &[]);
        let bytes = answer.unwrap_or_else(|what| {
            self.pending_error.replace(Some(what));
            Vec::new()
        });
        let contacts: Vec<ContactForce> = pod_collect_to_vec(&bytes);
        let states = contacts.iter().filter_map(|contact| self.contact_state(root, contact));
        let mut states: Vec<ContactState> = states.collect();
        states.sort_by_key(|state| (state.first, state.second));
        states
    }

    fn health(&self) -> Result<()> {
        self.pending_error.take().map_or(Ok(()), |what| Err(self.failure(what)))
    }

    /// On rank 0 with what LIGGGHTS itself needs.
    fn save(&self) -> Result<Vec<u8>> {
        let mut saved = Saved {
            substep: self.step,
            begun: self.contacts().begun,
            particles: self.population.store.owned().to_vec(),
            loads: self.population.loads.clone(),
            ..Saved::default()
        };
        if let Some(process) = self.process() {
            saved.states = self.contact_states();
            let answer = process.borrow_mut().ask(Request::Save, &[]);
            saved.own = answer.map_err(|what| self.failure(what))?;
        }
        Ok(saved.write(NAME))
    }

    /// A set-up that LIGGGHTS refuses leaves an engine that has failed.
    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        let current = (&self.near, &self.population, self.params.walls.len());
        let saved = Saved::load(NAME, parts, current, comm)?;
        // The contacts there are already are not the first of theirs.
        let begun: u64 = parts.iter().filter_map(|part| Saved::begun(part)).sum();
        self.begin(comm, &saved.particles, &saved.own)?;
        self.step = saved.substep;
        self.population.replace(&self.near, saved.particles.into_iter().zip(saved.loads));
        let positions: Vec<Vec3> = self.root.iter().flat_map(|root| root.positions.clone()).collect();
        // Whatever fails here failed before it was saved.
        let _ = self.count(&positions);
        if let Some(root) = &mut self.root {
            root.summary.begun = begun;
        }
        Ok(())
    }
}

/// The case has what LIGGGHTS does not.
fn unsupported(what: String) -> Error {
    Error::Unsupported { engine: NAME, what }
}

/// LIGGGHTS does not start, or not with this.
fn refused(text: impl Display) -> Error {
    Error::Input(format!("LIGGGHTS refuses the set-up: {text}"))
}
