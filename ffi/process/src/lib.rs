//! Engines outside of Turbid behind the engine trait: in a process of their own, or in this one behind the same messages.
//!
//! The messages are those of `docs/engine-protocol.md`. Rank 0 has the engine; loads are gathered there, and the states of all
//! particles go to all ranks, each of which takes its own. So any number of ranks gets the same bits, up to the some tens of
//! thousands of particles that one core moves.
//!
//! An engine has positions, velocities, angular velocities and the history of the contacts; orientations of spheres are integrated
//! here unless it has them. Counts and overlaps of contacts come from the geometry; the force of each is requested only when it is
//! written.

mod child;
mod contacts;
mod message;
mod serve;
mod setup;
mod start;

pub use child::{Program, open_log};
pub use message::{
    AppliedLoad, Body, ContactForce, MeasuredContact, MeasuredOverlap, Outcome, State, VERSION, read_messages,
};
pub use serve::{Served, serve};
pub use setup::{
    BoxSection, ContactSection, Hello, SetUp, ShapeSection, SurfaceSection, TemplateSection, WallSection,
    wall_flaw,
};

use bytemuck::{bytes_of, cast_slice, pod_collect_to_vec, pod_read_unaligned};
use child::Worker;
use message::Kind;
use std::cell::RefCell;
use std::fmt::Display;
use std::sync::Arc;
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

/// Most contacts in the mean of all particles; spheres of one size have six at most.
const CONTACTS_EACH: usize = 256;

/// Parameters of an engine outside of Turbid.
#[derive(Clone, Debug)]
pub struct ExternalParams {
    /// Short name, as [`DemEngine::name`].
    pub name: &'static str,
    /// Its name in messages.
    pub label: String,
    /// Elasticity, restitution, friction and enlargement; without, particles pass through each other and through walls.
    pub contact: Option<ContactModel>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: Vec3,
    /// Sub-steps per call of [`advance`](DemEngine::advance), at least one.
    pub substeps: u32,
    /// Further settings.
    pub options: serde_json::Value,
    /// The process in which it runs.
    pub host: Host,
    /// True if the engine is set up by [`restore`](DemEngine::restore), and until then only greeted.
    pub resumes: bool,
    /// Memory for what the engine saves (bytes).
    pub memory: u64,
}

/// The process in which an engine runs.
#[derive(Clone, Debug)]
pub enum Host {
    /// In a process of its own.
    Process(Program),
    /// In this one.
    Here(fn() -> Box<dyn Served>),
}

impl ExternalParams {
    /// Of this engine, with nothing to move yet.
    pub fn new(name: &'static str, label: String, host: Host) -> Self {
        let (gravity, options) = (Vec3::zeros(), serde_json::Value::Null);
        Self {
            name,
            label,
            contact: None,
            walls: Vec::new(),
            gravity,
            substeps: 1,
            options,
            host,
            resumes: false,
            memory: u64::MAX,
        }
    }

    /// Walls that particles touch.
    fn touched_walls(&self) -> &[Wall] {
        if self.contact.is_some() { &self.walls } else { &[] }
    }
}

/// The other end.
#[derive(Debug)]
enum Peer {
    Process(Worker),
    Here(Box<dyn Served>),
}

impl Peer {
    /// Payload of the answer to a message, at most `most` bytes.
    fn ask(&mut self, kind: Kind, payload: &[u8], most: u64) -> Outcome<Vec<u8>> {
        match self {
            Self::Process(worker) => worker.ask(kind, payload, most),
            Self::Here(engine) => serve::answer(&mut **engine, kind, payload),
        }
    }
}

/// State of rank 0.
#[derive(Debug)]
struct Root {
    peer: RefCell<Peer>,
    hello: Hello,
    /// Radius of contact (m) by index.
    radii: Vec<f64>,
    finder: PairFinder,
    /// All particles by index; of their motion only positions and orientations are kept up to date.
    particles: Vec<Particle>,
    /// Contacts of the last step by index, ascending; a wall is [`ContactState::of_wall`] of its index.
    pairs: Vec<(u64, u64)>,
    summary: ContactSummary,
}

/// An engine outside of Turbid.
#[derive(Debug)]
pub struct External {
    params: ExternalParams,
    rank: usize,
    near: GhostLayer,
    population: LocalParticles,
    /// By template.
    inertias: Vec<Inertia>,
    /// By template.
    contours: Vec<GrownShape>,
    /// Ids of all particles, ascending.
    ids: Vec<u64>,
    /// True if the engine has orientations.
    orientations: bool,
    /// Without particles there is none.
    root: Option<Root>,
    /// An engine that has been greeted but not set up.
    greeted: Option<(Peer, Hello)>,
    /// Calls of [`advance`](DemEngine::advance) since the start.
    step: u64,
    /// Mass of all particles (kg).
    mass: f64,
    /// Largest force of contacts (N): it moves all particles together by a cell in a sub-step from rest.
    strongest: f64,
    /// True if the engine has failed: then nothing moves any more.
    failed: bool,
    /// Reason for missing contacts, until [`health`](DemEngine::health) reports it.
    pending_error: RefCell<Option<String>>,
}

impl External {
    /// True if the overlaps of contacts are those that the engine has measured itself.
    pub fn measures_overlaps(&self) -> bool {
        self.root.as_ref().is_some_and(|root| root.hello.overlaps)
    }

    /// The part of `all` that this rank owns or has as ghosts, with the engine set up on rank 0; all arguments are the same on
    /// every rank. Collective.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for shapes and walls that the engine does not have; [`Error::Input`] if it does not start, or
    /// refuses the set-up.
    pub fn new(
        params: impl Into<ExternalParams>,
        decomposition: Decomposition,
        comm: &Comm,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Result<Self> {
        let params = params.into();
        assert!(params.substeps > 0);
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
            orientations: false,
            root: None,
            greeted: None,
            step: 0,
            mass: 0.0,
            strongest: f64::MAX,
            failed: false,
            pending_error: RefCell::default(),
        };
        let resumes = engine.params.resumes;
        engine.begin(comm, all, (!resumes).then_some(&[][..]))?;
        Ok(engine)
    }

    /// The loads of the owned particles, as a message to rank 0.
    fn load_message(&self, loads: &[Load]) -> Vec<u8> {
        let load = |(particle, load): (&Particle, &Load)| AppliedLoad {
            id: particle.id,
            force: load.force.into(),
            torque: load.torque.into(),
        };
        let loads: Vec<AppliedLoad> = self.population.store.owned().iter().zip(loads).map(load).collect();
        cast_slice(&loads).to_vec()
    }

    /// Index of a particle among all.
    fn index(&self, id: u64) -> usize {
        self.ids.binary_search(&id).expect("the ids are those of all particles")
    }

    /// Makes a step under the loads of all ranks, on rank 0; the bytes of a [`State`] for each particle.
    fn advance_all(&self, messages: &[Vec<u8>], dt: f64) -> Result<Vec<u8>> {
        self.health()?;
        let mut loads = vec![AppliedLoad::default(); self.ids.len()];
        for entry in messages.iter().flat_map(|message| message.chunks_exact(size_of::<AppliedLoad>())) {
            let load: AppliedLoad = pod_read_unaligned(entry);
            // NaN sends engines out of their arrays.
            if !load.force.iter().chain(&load.torque).all(|x| x.is_finite()) {
                return Err(self.failure(format!("the load on particle {} is not finite", load.id)));
            }
            loads[self.index(load.id)] = load;
        }
        let substeps = self.params.substeps;
        let message = message::advance(dt / f64::from(substeps), substeps, &loads);
        let most = size_of::<State>() * loads.len();
        let Some(peer) = self.peer() else { return Ok(Vec::new()) };
        let answer = peer.borrow_mut().ask(Kind::Advance, &message, most as u64);
        let states = answer.and_then(|bytes| message::read_states(&bytes, &self.ids, self.orientations));
        states.map(|states| cast_slice(&states).to_vec()).map_err(|what| self.failure(what))
    }

    /// The engine, on rank 0, if it has particles and works.
    fn peer(&self) -> Option<&RefCell<Peer>> {
        self.root.as_ref().filter(|_| !self.failed).map(|root| &root.peer)
    }

    fn failure(&self, what: impl Display) -> Error {
        let what = format!("{}: {what}", self.params.label);
        Error::Engine { engine: self.params.name, step: self.step, what }
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
        self.refuse_absurd(particle.id, state, dt)?;
        let spin = Vec3::from(state.angular_velocity);
        if self.orientations {
            particle.orientation = state.orientation;
        } else {
            let mean = (particle.angular_velocity() + spin) * 0.5;
            particle.set_orientation(&integrator::turned(&particle.orientation(), mean, dt));
        }
        let inertia = &self.inertias[particle.template as usize];
        particle.position = position.into();
        particle.velocity = state.velocity;
        particle.angular_velocity = state.angular_velocity;
        particle.angular_momentum = inertia.angular_momentum(&particle.orientation(), spin).into();
        particle.contact_force = state.contact_force;
        particle.contact_torque = state.contact_torque;
        Ok(particle)
    }
}

impl DemEngine for External {
    fn name(&self) -> &'static str {
        self.params.name
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        ShapeSection::of(shape).is_some_and(|shape| self.orientations || shape.kind() == "sphere")
    }

    fn particles(&self) -> &ParticleStore {
        &self.population.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        assert_eq!(loads.len(), self.population.store.owned);
        let sub_step = dt / f64::from(self.params.substeps);
        self.strongest = self.mass * self.near.decomposition().domain.dx / (sub_step * sub_step);
        let messages = comm.gather(self.load_message(loads));
        let (mut bytes, mut outcome) = (Vec::new(), Ok(()));
        if self.rank == 0 && self.failed {
            outcome = Err(self.failure("it has failed before"));
        } else if self.rank == 0 {
            match self.advance_all(&messages, dt) {
                Ok(states) => bytes = states,
                Err(error) => (self.failed, outcome) = (true, Err(error)),
            }
        }
        if comm.size() > 1 {
            bytes = comm.all_gather(bytes).swap_remove(0);
        }
        let states: Vec<State> = pod_collect_to_vec(&bytes);
        if states.len() == self.ids.len() {
            let domain = self.near.decomposition().domain;
            let now =
                self.root.iter().flat_map(|root| &root.particles).zip(&states).map(|(before, state)| {
                    let orientation = if self.orientations { state.orientation } else { before.orientation };
                    Particle { position: domain.wrap(state.position.into()).into(), orientation, ..*before }
                });
            let now: Vec<Particle> = now.collect();
            outcome = self.count(&now).and(self.update_particles(&states, dt));
            self.population.loads.copy_from_slice(loads);
            self.population.refresh(&self.near, comm);
        }
        self.step += 1;
        outcome
    }

    fn loads(&self) -> &[Load] {
        &self.population.loads
    }

    fn contacts(&self) -> ContactSummary {
        self.root.as_ref().map_or_else(ContactSummary::default, |root| root.summary)
    }

    fn tells_contacts(&self) -> bool {
        self.params.contact.is_none() || self.root.as_ref().is_none_or(|root| root.hello.contacts)
    }

    fn contact_states(&self) -> Vec<ContactState> {
        let (Some(root), Some(peer), 1..) = (&self.root, self.peer(), self.step) else {
            return Vec::new();
        };
        if !root.hello.contacts || self.pending_error.borrow().is_some() {
            return Vec::new();
        }
        let most = CONTACTS_EACH * size_of::<MeasuredContact>() * (self.ids.len() + 1);
        let answer = peer.borrow_mut().ask(Kind::ListContacts, &[], most as u64);
        let walls = self.params.touched_walls().len();
        let (overlaps, strongest) = (root.hello.overlaps, self.strongest);
        let read = |bytes: Vec<u8>| message::read_contacts(&bytes, &self.ids, walls, overlaps, strongest);
        let contacts = answer.and_then(read);
        let contacts = contacts.unwrap_or_else(|what| {
            self.pending_error.replace(Some(what));
            Vec::new()
        });
        let states = contacts.iter().filter_map(|contact| self.contact_state(root, contact));
        let mut states: Vec<ContactState> = states.collect();
        states.sort_by_key(ContactState::key);
        states
    }

    fn health(&self) -> Result<()> {
        self.pending_error.take().map_or(Ok(()), |what| Err(self.failure(what)))
    }

    /// On rank 0 with what the engine itself needs, behind the length of its name and its name.
    fn save(&self) -> Result<Vec<u8>> {
        if self.rank == 0 && self.failed {
            return Err(self.failure("it has failed, and what it had is lost"));
        }
        let mut saved = Saved {
            substep: self.step,
            begun: self.contacts().begun,
            population: self.population.population,
            particles: self.population.store.owned().to_vec(),
            loads: self.population.loads.clone(),
            ..Saved::default()
        };
        if let (Some(root), Some(peer)) = (&self.root, self.peer()) {
            saved.states = self.contact_states();
            self.health()?;
            if root.hello.saves {
                let answer = peer.borrow_mut().ask(Kind::Save, &[], self.params.memory);
                let (own, name) = (answer.map_err(|what| self.failure(what))?, root.hello.name.as_bytes());
                saved.own = [bytes_of(&(name.len() as u64)), name, &own].concat();
            }
        }
        Ok(saved.write(self.params.name))
    }

    /// A set-up that the engine refuses leaves one that has failed.
    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        let current = (&self.near, &self.population, &self.params.walls[..]);
        let saved = Saved::load(self.params.name, parts, current, 0)?;
        // Particles of an engine outside neither come nor go.
        let [has, of_case] = [saved.population.count, self.population.population.count];
        if has != of_case {
            return Err(Error::Input(format!(
                "the saved state of the {} engine cannot be used: it holds {has} particles, and this case has {of_case}",
                self.params.name
            )));
        }
        // The contacts there already are not the first of theirs.
        let begun: u64 = parts.iter().filter_map(|part| Saved::begun(part)).sum();
        self.begin(comm, &saved.particles, Some(&saved.own))?;
        self.step = saved.substep;
        self.population.replace(
            &self.near,
            saved.population.next_id,
            saved.particles.into_iter().zip(saved.loads),
        );
        let now: Vec<Particle> = self.root.iter().flat_map(|root| root.particles.clone()).collect();
        // Whatever fails here failed before it was saved.
        let _ = self.count(&now);
        if let Some(root) = &mut self.root {
            root.summary.begun = begun;
        }
        Ok(())
    }
}
