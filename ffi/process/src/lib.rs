//! Engines outside of Turbid behind the engine trait: in a process of their own, or in this one behind the same messages.
//!
//! The messages are those of `docs/engine-protocol.md`. An engine consists of one process or of several, its parts; the first ranks have one
//! each. After a step a part sends each of its particles to the rank whose block holds it, and that rank sends the next load of the particle
//! back there. So no rank has all particles but that of an engine of one part, which moves the some tens of thousands of particles
//! of one core, with the same bits on any number of ranks.
//!
//! An engine has positions, velocities, angular velocities and the history of the contacts; orientations of spheres are integrated
//! here unless it has them. Counts and overlaps of contacts come from the geometry; the force of each is requested only when it is
//! written.

mod child;
mod contacts;
mod message;
mod route;
mod serve;
mod setup;
mod spheres;
mod start;
mod worker;

pub use child::{Program, open_log};
pub use message::{
    AppliedLoad, Body, ContactForce, LoadedState, MeasuredContact, MeasuredOverlap, Outcome, State, VERSION,
    VERSION_OF_PARTS, read_messages,
};
pub use serve::{Served, serve};
pub use setup::{
    BoxSection, ContactSection, Hello, SetUp, ShapeSection, SurfaceSection, TemplateSection, WallSection,
    wall_flaw,
};
pub use spheres::{
    AXES, Order, SphereKind, axis_of, exchange_file, id_of, kinds, path_of, sliding_plane, tag,
};
pub use worker::work;

use child::{Asked, Worker};
use message::Kind;
use route::Arrived;
use std::cell::RefCell;
use std::fmt::Display;
use std::sync::Arc;
use turbid_core::comm::{Comm, SavedParts};
use turbid_core::contact::{ContactModel, GrownShape, PairFinder};
use turbid_core::dem::assign::GhostLayer;
use turbid_core::dem::exchange::LocalParticles;
use turbid_core::dem::integrator::{self, Inertia};
use turbid_core::dem::native::face_passed;
use turbid_core::dem::native::failures::{outside, position_text};
use turbid_core::dem::saved::{Loaded, Saved};
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
    /// True if the engine resumes from what other parts than those of now have saved, one after the other.
    pub regroups: bool,
}

/// The processes in which an engine runs.
#[derive(Clone, Debug)]
pub enum Host {
    /// In a process of its own.
    Process(Program),
    /// In this number of processes of its own, at most one for each rank.
    Processes(Program, usize),
    /// In this one; if all ranks are processes of MPI, in all of them, with a communicator of its own.
    Here(fn(Seat) -> Box<dyn Served>),
}

/// Place of a part in an engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seat {
    /// Its index.
    pub part: usize,
    /// Number of parts; 1 for an engine alone.
    pub parts: usize,
    /// Communicator of the processes that have the parts, as a handle of Fortran's; none for an engine alone.
    pub communicator: Option<i32>,
    /// Blocks of the ranks along each axis, the first one fastest; with a communicator.
    pub grid: [usize; 3],
}

impl Seat {
    /// Blocks of an engine that cuts the box as Turbid does: one of an engine alone.
    pub fn blocks(&self) -> [usize; 3] {
        if self.communicator.is_some() { self.grid } else { [1; 3] }
    }
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
            regroups: false,
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
    /// Kind and payload of the answer to a message that belongs to what was asked.
    fn ask(&mut self, kind: Kind, payload: &[u8], asked: &Asked) -> Outcome<(Kind, Vec<u8>)> {
        match self {
            Self::Process(worker) => worker.ask(kind, payload, asked),
            Self::Here(engine) => {
                serve::answer(&mut **engine, kind, payload, asked.parts).map(|answer| (kind.answer(), answer))
            }
        }
    }
}

/// A part of the engine, on the rank that has it.
#[derive(Debug)]
struct Part {
    peer: RefCell<Peer>,
    hello: Hello,
    /// The particles that it has, ascending by id, with their owners.
    owners: RefCell<Vec<(u64, u32)>>,
}

/// Abilities that the engine says it has, the same on every rank.
#[derive(Clone, Copy, Debug, Default)]
struct Abilities {
    orientations: bool,
    /// It lists contacts.
    tells: bool,
    /// It measures their overlaps.
    overlaps: bool,
}

/// An engine outside of Turbid.
#[derive(Debug)]
pub struct External {
    params: ExternalParams,
    seat: Seat,
    near: GhostLayer,
    population: LocalParticles,
    /// The part that has each of the owned particles.
    holders: RefCell<Vec<u32>>,
    /// By template.
    inertias: Vec<Inertia>,
    /// By template.
    contours: Vec<GrownShape>,
    able: Abilities,
    /// That of this rank; without particles there is none.
    part: Option<Part>,
    /// An engine that has been greeted but not set up.
    greeted: Option<(Peer, Hello)>,
    finder: PairFinder,
    /// Contacts of the last step between particles of this rank, ghosts among them, by id, ascending; a wall is
    /// [`ContactState::of_wall`] of its index.
    pairs: Vec<(u64, u64)>,
    summary: ContactSummary,
    /// Calls of [`advance`](DemEngine::advance) since the start.
    step: u64,
    /// Mass of all particles (kg).
    mass: f64,
    /// Largest force of contacts (N): it moves all particles together by a cell in a sub-step from rest.
    strongest: f64,
    /// True on every rank if the engine has failed: then nothing moves any more.
    failed: bool,
    /// True if it has failed on this rank.
    failed_here: bool,
    /// Reason for missing contacts, until [`health`](DemEngine::health) reports it.
    pending_error: RefCell<Option<String>>,
}

impl External {
    /// True if the overlaps of contacts are those that the engine has measured itself.
    pub fn measures_overlaps(&self) -> bool {
        self.able.overlaps
    }

    /// The particles that this rank owns or has as ghosts, with the engine set up. `handed` are those that this rank hands over, wherever
    /// they are: those of all ranks together are the particles of the case, each once. All other arguments are the same on every rank.
    /// Collective.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for shapes and walls that the engine does not have; [`Error::Input`] if it does not start, or
    /// refuses the set-up.
    pub fn new(
        params: impl Into<ExternalParams>,
        decomposition: Decomposition,
        comm: &Comm,
        templates: Arc<[Template]>,
        handed: &[Particle],
    ) -> Result<Self> {
        let params = params.into();
        assert!(params.substeps > 0);
        let enlargement = params.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        let contour = |template: &Template| GrownShape::new(template.shape.clone(), enlargement);
        let contours: Vec<GrownShape> = templates.iter().map(contour).collect();
        let reach: Vec<f64> = contours.iter().map(GrownShape::reach).collect();
        let inertias = templates.iter().map(Inertia::of).collect();
        let seat = seat(&params, &decomposition, comm)?;
        let near = GhostLayer::new(decomposition, comm.rank(), &reach);
        let (lo, extent) = near.window();
        let finder = PairFinder::in_window(near.decomposition().domain, lo, extent);
        let population = LocalParticles::new(&near, templates, Vec::new());
        let mut engine = Self {
            params,
            seat,
            near,
            population,
            holders: RefCell::default(),
            inertias,
            contours,
            able: Abilities::default(),
            part: None,
            greeted: None,
            finder,
            pairs: Vec::new(),
            summary: ContactSummary::default(),
            step: 0,
            mass: 0.0,
            strongest: f64::MAX,
            failed: false,
            failed_here: false,
            pending_error: RefCell::default(),
        };
        let resumes = engine.params.resumes;
        engine.begin(comm, handed, (!resumes).then_some(&[][..]))?;
        Ok(engine)
    }

    /// The part of this rank, if it has one and the engine works.
    fn peer(&self) -> Option<&Part> {
        self.part.as_ref().filter(|_| !self.failed)
    }

    fn failure(&self, what: impl Display) -> Error {
        let who = if self.seat.parts > 1 && self.part.is_some() {
            format!("{}, part {} of {}", self.params.label, self.seat.part + 1, self.seat.parts)
        } else {
            self.params.label.clone()
        };
        Error::Engine { engine: self.params.name, step: self.step, what: format!("{who}: {what}") }
    }

    /// Notes on every rank whether the engine has failed on any, here with this outcome. Collective.
    fn note_failure<T>(&mut self, comm: &Comm, outcome: Result<T>) -> Result<Option<T>> {
        self.failed = comm.any(outcome.is_err());
        self.failed_here = outcome.is_err();
        outcome.map(|value| (!self.failed).then_some(value))
    }

    /// Makes a step under these loads on the owned particles.
    fn move_all(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let sound = self.health().and_then(|()| self.check(loads));
        if self.note_failure(comm, sound)?.is_none() {
            return Ok(());
        }
        let answer = self.advance_parts(comm, loads, dt).map_err(|what| self.failure(what));
        let Some(states) = self.note_failure(comm, answer)? else {
            return Ok(());
        };
        let arrived = self.to_owners(comm, states);
        if let Some(lost) = self.missing(comm, &arrived) {
            let lost = if self.near.rank == 0 { Err(self.failure(lost)) } else { Ok(()) };
            return self.note_failure(comm, lost).map(drop);
        }
        let updated = self.update_particles(arrived, dt);
        self.population.refresh(&self.near, comm);
        self.count().and(updated)
    }

    /// Refuses loads that are no numbers: they send engines out of their arrays.
    fn check(&self, loads: &[Load]) -> Result<()> {
        let sound = |load: &Load| load.force.iter().chain(&load.torque).all(|x| x.is_finite());
        match self.population.store.owned().iter().zip(loads).find(|(_, load)| !sound(load)) {
            Some((particle, _)) => {
                Err(self.failure(format!("the load on particle {} is not finite", particle.id)))
            }
            None => Ok(()),
        }
    }

    /// Makes the particles that have arrived those of this rank; returns the first failure.
    fn update_particles(&mut self, arrived: Vec<Arrived>, dt: f64) -> Result<()> {
        let (mut outcome, mut owned) = (Ok(()), Vec::with_capacity(arrived.len()));
        for Arrived { loaded: LoadedState { state, force, torque }, holder } in arrived {
            let Some(at) = self.population.index_of(state.id) else {
                outcome = outcome.and(Err(self.failure(format!(
                    "message `states`: particle {} at {} was not near to that place before",
                    state.id,
                    position_text(state.position.into())
                ))));
                continue;
            };
            let before = self.population.store.particles[at];
            let after = self.updated(before, &state, dt).unwrap_or_else(|error| {
                outcome = std::mem::replace(&mut outcome, Ok(())).and(Err(error));
                before
            });
            owned.push((after, [force, torque].into(), holder));
        }
        owned.sort_unstable_by_key(|(particle, ..)| particle.id);
        self.holders.replace(owned.iter().map(|&(.., holder)| holder).collect());
        self.population
            .set_owned(self.near.rank, owned.into_iter().map(|(particle, load, _)| (particle, load)));
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
        if self.able.orientations {
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
        ShapeSection::of(shape).is_some_and(|shape| self.able.orientations || shape.kind() == "sphere")
    }

    fn particles(&self) -> &ParticleStore {
        &self.population.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        assert_eq!(loads.len(), self.population.store.owned);
        let sub_step = dt / f64::from(self.params.substeps);
        self.strongest = self.mass * self.near.decomposition().domain.dx / (sub_step * sub_step);
        let outcome = match (self.failed, self.failed_here) {
            (false, _) => self.move_all(comm, loads, dt),
            (true, true) => Err(self.failure("it has failed before")),
            (true, false) => Ok(()),
        };
        self.step += 1;
        outcome
    }

    fn loads(&self) -> &[Load] {
        &self.population.loads
    }

    fn contacts(&self) -> ContactSummary {
        self.summary
    }

    fn tells_contacts(&self) -> bool {
        self.params.contact.is_none() || self.able.tells
    }

    fn contact_states(&self, comm: &Comm) -> Vec<ContactState> {
        if self.failed || self.step == 0 || !self.able.tells || self.population.population.count == 0 {
            return Vec::new();
        }
        let listed = self.list_contacts(comm).unwrap_or_else(|what| {
            self.pending_error.replace(Some(what));
            Vec::new()
        });
        let states =
            self.to_first(comm, listed).into_iter().filter_map(|contact| self.contact_state(&contact));
        let mut states: Vec<ContactState> = states.collect();
        states.sort_by_key(ContactState::key);
        states
    }

    fn health(&self) -> Result<()> {
        self.pending_error.take().map_or(Ok(()), |what| Err(self.failure(what)))
    }

    /// On the ranks that have parts with what these themselves need, see `start::Own`.
    fn save(&self, comm: &Comm) -> Result<Vec<u8>> {
        if self.failed {
            return Err(self.failure("it has failed, and what it had is lost"));
        }
        let states = self.contact_states(comm);
        comm.agree(self.health())?;
        let own = self.save_parts(comm).map_err(|what| self.failure(what));
        let saved = Saved {
            substep: self.step,
            begun: self.contacts().begun,
            population: self.population.population,
            particles: self.population.store.owned().to_vec(),
            loads: self.population.loads.clone(),
            states,
            own: comm.agree(own)?,
            ..Saved::default()
        };
        // Saving may have moved particles from part to part.
        self.locate(comm)?;
        Ok(saved.write(self.params.name))
    }

    /// A set-up that the engine refuses leaves one that has failed.
    fn restore(&mut self, comm: &Comm, parts: &SavedParts) -> Result<()> {
        let current = (&self.near, &self.population, &self.params.walls[..]);
        let Loaded { state: saved, own } = Saved::load(self.params.name, comm, parts, current, 0)?;
        // Particles of an engine outside neither come nor go.
        let [has, of_case] = [saved.population.count, self.population.population.count];
        if has != of_case {
            return Err(Error::Input(format!(
                "the saved state of the {} engine cannot be used: it holds {has} particles, and this case has {of_case}",
                self.params.name
            )));
        }
        self.begin(comm, &saved.particles, Some(&own))?;
        self.step = saved.substep;
        let handed = saved.particles.into_iter().zip(saved.loads);
        self.population.take_over(&self.near, comm, saved.population.next_id, handed);
        // Whatever fails here failed before it was saved.
        let _ = self.count();
        // The contacts there already are not the first of theirs.
        self.summary.begun = saved.begun;
        Ok(())
    }
}

/// The place of the part of this rank. Collective. Errors: [`Error::Input`] if there are more processes than ranks.
fn seat(params: &ExternalParams, cut: &Decomposition, comm: &Comm) -> Result<Seat> {
    let (part, grid) = (comm.rank(), cut.grid);
    let alone = Seat { part, parts: 1, communicator: None, grid };
    match &params.host {
        Host::Process(_) => Ok(alone),
        Host::Processes(_, parts) if *parts > comm.size() => Err(Error::Input(format!(
            "{} has {parts} processes, and there are {} ranks, each of which has one at most: use --threads {parts}, or mpirun -n {parts}",
            params.label,
            comm.size()
        ))),
        Host::Processes(_, parts) => Ok(Seat { parts: *parts, ..alone }),
        Host::Here(_) if comm.size() == 1 => Ok(alone),
        Host::Here(_) => Ok(comm.duplicate().map_or(alone, |handle| Seat {
            parts: comm.size(),
            communicator: Some(handle),
            ..alone
        })),
    }
}
