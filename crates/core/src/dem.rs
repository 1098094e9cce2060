//! Engines that move the particles: the trait, the native engine, and a ballistic one for callers that set the states themselves.

pub mod assign;
pub mod ballistic;
pub mod exchange;
pub mod facets;
pub mod history;
pub mod integrator;
pub mod native;
pub mod population;
pub mod saved;
pub mod states;

use crate::comm::{Comm, SavedParts};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore};
use crate::shape::Shape;
pub use ballistic::Ballistic;
use bytemuck::{Pod, Zeroable};
pub use exchange::LocalParticles;
pub use facets::Facets;
pub use history::Records;
pub use native::{Native, NativeParams};
use std::cmp::Ordering;
use std::ops::AddAssign;

/// Hydrodynamic load on one particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force on the centre of mass (N).
    pub force: Vec3,
    /// Torque about the centre of mass (N m).
    pub torque: Vec3,
}

impl AddAssign for Load {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }
}

/// Force (N) and torque (N m), as plain data.
pub type LoadRow = [[f64; 3]; 2];

impl From<Load> for LoadRow {
    fn from(load: Load) -> Self {
        [load.force.into(), load.torque.into()]
    }
}

impl From<LoadRow> for Load {
    fn from([force, torque]: LoadRow) -> Self {
        Self { force: force.into(), torque: torque.into() }
    }
}

/// Contacts of one rank at the last sub-step, for the time series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSummary {
    /// Number of contacts evaluated by this rank that exert a force, with cohesion of all.
    pub count: usize,
    /// Largest depth (m).
    pub max_depth: f64,
    /// Number of contacts that began since the start.
    pub begun: u64,
}

/// Two bodies in contact, by id and part. Ascending by the first body and its part, then by the second one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactKey {
    /// Lower id.
    pub first: u64,
    /// Higher id, the same for an image of the body itself, or what stands for a wall, see [`ContactState::of_wall`].
    pub second: u64,
    /// Index of the part of each body that touches, that of the second one with the [image](Self::shift) in its highest bits.
    pub parts: [u32; 2],
}

/// Bits of the index of a part in [`ContactKey::parts`].
const PART_BITS: u32 = 24;

impl ContactKey {
    /// Indices of parts are below this.
    pub const MOST_PARTS: u32 = 1 << PART_BITS;

    /// The same with another [image](Self::shift) of the second body.
    #[must_use]
    pub fn with_shift(mut self, shift: [i8; 3]) -> Self {
        let [x, y, z] = shift.map(|along| along.rem_euclid(3) as u32);
        self.parts[1] = self.indices()[1] | (x + 3 * y + 9 * z) << PART_BITS;
        self
    }

    /// Shift (boxes) of the image of the second body from the one whose centre is nearest to that of the first.
    pub fn shift(&self) -> [i8; 3] {
        let code = self.parts[1] >> PART_BITS;
        [code, code / 3, code / 9].map(|digit| if digit % 3 == 2 { -1 } else { (digit % 3) as i8 })
    }

    /// Indices of the parts.
    pub fn indices(&self) -> [u32; 2] {
        [self.parts[0], self.parts[1] & (Self::MOST_PARTS - 1)]
    }
}

impl Ord for ContactKey {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = |key: &Self| (key.first, key.parts[0], key.second, key.parts[1]);
        order(self).cmp(&order(other))
    }
}

impl PartialOrd for ContactKey {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// One contact that exerted a force at the last sub-step.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactState {
    /// Id of the first particle.
    pub first: u64,
    /// Id of the second particle, or [`of_wall`](Self::of_wall) of the index of a wall.
    pub second: u64,
    /// Those of [`ContactKey::parts`].
    pub parts: [u32; 2],
    /// Point of application (m), wrapped into the domain.
    pub point: [f64; 3],
    /// Unit normal, from the first body to the second.
    pub normal: [f64; 3],
    /// Force on the first body (N); the second gets the opposite.
    pub force: [f64; 3],
    /// Depth of the overlap (m).
    pub depth: f64,
    /// Volume of the overlap (m^3).
    pub volume: f64,
}

impl ContactState {
    /// The bodies and parts that touch.
    pub fn key(&self) -> ContactKey {
        ContactKey { first: self.first, second: self.second, parts: self.parts }
    }

    /// True of surfaces that touch, or hold on to each other by a neck; not of forces over a gap.
    pub fn touches(&self) -> bool {
        self.depth.abs() > 0.0
    }

    /// Branch vectors (m): from the centres of both particles, which are at wrapped positions, to the point of application.
    pub fn levers(&self, domain: &Domain, centres: [Vec3; 2]) -> [Vec3; 2] {
        let (shift, point) = (self.key().shift(), Vec3::from(self.point));
        if shift == [0; 3] {
            return centres.map(|centre| domain.nearest_image(point - centre));
        }
        let [first, second] = centres;
        let between = domain.shifted(domain.nearest_image(second - first), shift);
        let middle = domain.nearest_image(domain.wrap(point - between * 0.5) - first);
        [middle + between * 0.5, middle - between * 0.5]
    }

    /// Stand-in for the id of a particle of the wall with this index; above all ids.
    pub fn of_wall(index: usize) -> u64 {
        u64::MAX - index as u64
    }

    /// The index of the wall, if the second body is one.
    pub fn wall(&self) -> Option<usize> {
        Self::wall_of(self.second)
    }

    /// The index of the wall that [`of_wall`](Self::of_wall) made `second` of, if it did.
    pub fn wall_of(second: u64) -> Option<usize> {
        let index = u64::MAX - second;
        (index < 1 << 32).then_some(index as usize)
    }
}

/// Judgement of the particles of a rank, ghosts included, before they have got other [states](DemEngine::place) and after.
pub type Check<'a> = &'a mut dyn FnMut([&LocalParticles; 2]) -> Result<()>;

/// The error of an engine whose particles neither come nor go.
pub fn fixed_population(engine: &'static str) -> Error {
    Error::Unsupported { engine, what: "particles that come or go during a run".into() }
}

/// Moves the particles under contacts and loads, without knowing the fluid. All quantities are SI.
///
/// [`advance`](Self::advance) is collective: every rank calls it, in the same order. A failure on one rank is
/// reported there by `Err`; the caller makes the failure collective before the next step.
pub trait DemEngine: Send {
    /// Short name for logs and messages, e.g. `"native"`.
    fn name(&self) -> &'static str;

    /// Returns true if this engine can represent `shape`; asked once, at set-up.
    fn supports(&self, shape: &dyn Shape) -> bool;

    /// The particles that touch this rank's part of the domain; valid until the next [`advance`](Self::advance).
    fn particles(&self) -> &ParticleStore;

    /// Advances all particles by `dt` (s) under constant `loads`.
    ///
    /// `loads[i]` acts on owned particle `i` of [`particles`](Self::particles), `loads.len() == owned`. Gravity and
    /// contacts are the engine's own business, and so is the number of sub-steps.
    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()>;

    /// Loads of the last [`advance`](Self::advance) on the owned particles of now, with which they have travelled; zeros before. Empty
    /// if the engine does not keep them.
    fn loads(&self) -> &[Load] {
        &[]
    }

    /// Id that the next particle gets that is [inserted](Self::insert), the same on every rank; none if the particles of this engine
    /// neither come nor go.
    fn next_id(&self) -> Option<u64> {
        None
    }

    /// Adds particles between two calls of [`advance`](Self::advance), at a time (s). They are the same on every rank, in the box, of
    /// templates that there are, with ids ascending from [`next_id`](Self::next_id) on. One whose motion is prescribed gets the velocities
    /// of that time. No contact is remembered of them.
    ///
    /// # Errors
    /// [`Error::Unsupported`] from an engine without [`next_id`](Self::next_id); [`Error::Input`] on every rank, with nothing changed, if
    /// they cannot be added.
    fn insert(&mut self, _: &[Particle], _time: f64) -> Result<()> {
        Err(fixed_population(self.name()))
    }

    /// Removes the particles with these ids, ascending, the same on every rank, between two calls of [`advance`](Self::advance), and what
    /// is remembered of their contacts.
    ///
    /// # Errors
    /// [`Error::Unsupported`] from an engine without [`next_id`](Self::next_id).
    fn remove(&mut self, _ids: &[u64]) -> Result<()> {
        Err(fixed_population(self.name()))
    }

    /// Gives the particles other states between two calls of [`advance`](Self::advance). `owned` are those in this rank's block then,
    /// ascending by id, with the loads of the last step; all ranks together have each particle once. What is remembered of their contacts
    /// stays. `check` gets the particles of this rank before and after, and fails on every rank or on none; nothing has changed then.
    /// Collective.
    ///
    /// # Errors
    /// [`Error::Unsupported`] from an engine of which no states can be set; those of `check`.
    fn place(&mut self, _: &Comm, _owned: Vec<(Particle, Load)>, _check: Check) -> Result<()> {
        Err(Error::Unsupported {
            engine: self.name(),
            what: "states of particles that the caller sets".into(),
        })
    }

    /// Contacts at the last sub-step.
    fn contacts(&self) -> ContactSummary;

    /// Returns true if the engine tells the forces of contacts; if not, [`contact_states`](Self::contact_states) is empty whatever
    /// there is. The same on every rank.
    fn tells_contacts(&self) -> bool {
        true
    }

    /// The contacts that this rank evaluated at the last sub-step, ascending by [key](ContactState::key). Asked for only
    /// when they are written, so that an engine may gather them on request. Collective.
    fn contact_states(&self, comm: &Comm) -> Vec<ContactState>;

    /// Sums over time of the contacts with the facets of meshes that this rank has evaluated; none if they are not kept.
    fn facets(&self) -> Option<&Facets> {
        None
    }

    /// Checks that all requests since the last [`advance`](Self::advance) could be answered. For the end of a run:
    /// during a run the next advance fails instead.
    ///
    /// # Errors
    /// [`Error::Engine`] on the rank where it could not.
    fn health(&self) -> Result<()> {
        Ok(())
    }

    /// This rank's part of the state, from which [`restore`](Self::restore) continues. Collective.
    fn save(&self, comm: &Comm) -> Result<Vec<u8>>;

    /// Restores the state of an earlier run with these templates and this engine, whose ranks [saved](Self::save) a part each; `parts` are
    /// those that this rank has read. The number of ranks may have changed, and so may the particles. Collective.
    ///
    /// Over all ranks, [`contacts`](Self::contacts) and [`contact_states`](Self::contact_states) return what they
    /// returned then.
    ///
    /// # Errors
    /// [`Error::Input`] on every rank if the parts are damaged, incomplete, or of another engine,
    /// version or case; the native engine then keeps its state.
    fn restore(&mut self, comm: &Comm, parts: &SavedParts) -> Result<()>;
}
