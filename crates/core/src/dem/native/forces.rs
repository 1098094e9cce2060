//! Results of the contacts of a sub-step: forces on particles, histories, states for the output.

use crate::comm::Comm;
use crate::contact::law::Action;
use crate::contact::{Overlap, PairLaw, PairProperties, RelativeMotion};
use crate::dem::assign::GhostLayer;
use crate::dem::exchange::LocalParticles;
use crate::dem::facets::Facets;
use crate::dem::history::{History, Records};
use crate::dem::{ContactKey, ContactState, ContactSummary, Load};
use crate::math::Vec3;
use crate::particle::ParticleStore;
use bytemuck::{Pod, Zeroable};

/// Contacts evaluated by one rank, and their effect on its particles. Buffers live from sub-step to sub-step.
#[derive(Clone, Debug, Default)]
pub(super) struct ContactForces {
    /// Histories of the contacts.
    pub(super) history: History,
    /// Number of contacts that began since the start.
    pub(super) begun: u64,
    /// True if two bodies may have several contacts: by their parts, or by their images in a narrow box.
    pub(super) several: bool,
    /// The same of a body and a mesh.
    pub(super) has_meshes: bool,
    /// True if all forces come in the order in which they are added up, so that none waits in `local`.
    is_direct: bool,
    /// Contacts of this sub-step, first those of pairs, then those with walls.
    pub(super) states: Vec<ContactState>,
    /// Sums over time by facet, if they are kept.
    pub(super) facets: Option<Facets>,
    /// Contact force and torque by owned particle, whole after [`reduce`](Self::reduce).
    pub(super) totals: Vec<Load>,
    /// Contact forces on owned particles, with their index.
    local: Vec<(u32, PairForce)>,
    /// The same for other ranks, by peer.
    messages: Vec<Vec<u8>>,
}

/// Force (N) and torque (N m) of the particle or wall `partner` on the particle `to`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct PairForce {
    to: u64,
    partner: u64,
    force: [f64; 3],
    torque: [f64; 3],
}

/// Action of two parts of bodies on each other, touching or not. A pair has one entry in a sub-step, of all that acts between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairEntry {
    /// The bodies, the lower id first; a wall stands second.
    pub(super) key: ContactKey,
    /// Indices of the particles; none for a wall.
    pub(super) indices: [Option<usize>; 2],
    /// Force and torques.
    pub(super) action: Action,
    /// Point of application (m), wrapped.
    pub(super) point: Vec3,
    /// Unit normal, from the first body to the second.
    pub(super) normal: Vec3,
    /// Depth of the overlap (m), negative of a neck; zero for bodies that are apart.
    pub(super) depth: f64,
    /// Volume of the overlap (m^3).
    pub(super) volume: f64,
}

impl PairEntry {
    /// Two bodies that act on each other over a gap.
    pub(super) fn apart(
        key: ContactKey,
        indices: [Option<usize>; 2],
        (point, normal): (Vec3, Vec3),
        action: Action,
    ) -> Self {
        Self { key, indices, action, point, normal, depth: 0.0, volume: 0.0 }
    }

    /// The part of it that counts, where another part of the body has it, too.
    #[must_use]
    pub(super) fn part(mut self, part: f64) -> Self {
        if part < 1.0 {
            self.action.force *= part;
            self.action.torques = self.action.torques.map(|torque| torque * part);
            self.volume *= part;
        }
        self
    }

    /// Adds what the film does.
    #[must_use]
    pub(super) fn with(mut self, film: &Action) -> Self {
        self.action = self.action.plus(film);
        self
    }
}

/// Two bodies that overlap, or hold on to each other by a neck.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactInput<'a> {
    /// The bodies, the lower id first; a wall stands second.
    pub(super) key: ContactKey,
    /// Indices of the particles; none for a wall.
    pub(super) indices: [Option<usize>; 2],
    /// The contact of the sub-step before that continues as this one, if it has another key.
    pub(super) from: Option<ContactKey>,
    /// Law of the two materials.
    pub(super) law: &'a PairLaw,
    /// Geometry.
    pub(super) overlap: &'a Overlap,
    /// Centre of the second body relative to the first (m); zero for a wall.
    pub(super) offset: Vec3,
    /// Sizes and masses.
    pub(super) properties: PairProperties,
    /// Motion of the first body relative to the second at the point of contact.
    pub(super) motion: RelativeMotion,
    /// The point of contact (m), wrapped.
    pub(super) point: Vec3,
}

impl ContactForces {
    /// For a rank with this number of peers, where two bodies have `several` contacts or one, walls that are meshes or not, a law that remembers
    /// `memory` numbers of a contact, and the sums of facets to continue.
    pub(super) fn new(
        (peers, several, has_meshes): (usize, bool, bool),
        memory: usize,
        facets: Option<Facets>,
    ) -> Self {
        let history = History::new(Records::new(memory));
        let is_direct = peers == 0 && !several;
        let messages = vec![Vec::new(); peers];
        Self { history, several, has_meshes, is_direct, facets, messages, ..Self::default() }
    }

    /// Begins a sub-step with this number of owned particles.
    pub(super) fn begin(&mut self, owned: usize) {
        self.totals.clear();
        self.totals.resize(owned, Load::default());
        self.local.clear();
        self.states.clear();
        self.messages.iter_mut().for_each(Vec::clear);
    }

    /// Ends the contacts of the sub-step.
    pub(super) fn finish(&mut self) {
        self.history.advance();
    }

    /// Gives the contacts the keys that they have after particles have moved.
    pub(super) fn rename(&mut self, name: impl Fn(&ContactKey) -> ContactKey) {
        self.history.rename(&name);
        for state in &mut self.states {
            state.parts = name(&state.key()).parts;
        }
    }

    /// Contacts of the sub-step, ascending by key.
    pub(super) fn states(&self) -> Vec<ContactState> {
        let mut states = self.states.clone();
        // Two ascending runs: a stable sort merges them.
        states.sort_by_key(ContactState::key);
        debug_assert!(states.is_sorted_by(|a, b| a.key() < b.key()), "a pair has one entry");
        states
    }

    /// Counts of the contacts of the sub-step. With cohesion a contact at rest may exert no force.
    pub(super) fn summary(&self, cohesive: bool) -> ContactSummary {
        ContactSummary {
            count: (self.states.iter())
                .filter(|state| state.touches() && (cohesive || Vec3::from(state.force) != Vec3::zeros()))
                .count(),
            max_depth: self.states.iter().map(|state| state.depth).fold(0.0, f64::max),
            begun: self.begun,
        }
    }

    /// Finds or begins the history of a contact and evaluates its force, which [`add`](Self::add) adds to both bodies.
    pub(super) fn evaluate(&mut self, input: &ContactInput) -> PairEntry {
        let ContactInput { key, from, indices, law, overlap, point, .. } = *input;
        let (memory, begun) = self.history.remember(key, from.as_ref(), |memory| law.begin(memory));
        self.begun += u64::from(begun);
        PairEntry {
            key,
            indices,
            action: law.act(overlap, input.offset, &input.properties, &input.motion, memory),
            point,
            normal: overlap.normal,
            depth: overlap.depth,
            volume: overlap.volume,
        }
    }

    /// Adds the force of a pair to both bodies and to the list of contacts, of which the output makes the stress and the forces
    /// on walls. Pairs come in ascending order of their ids, those with walls after all others.
    pub(super) fn add(&mut self, pair: &PairEntry, near: &GhostLayer, store: &ParticleStore) {
        let PairEntry { key: ContactKey { first, second, parts }, action: Action { force, torques }, .. } =
            *pair;
        self.states.push(ContactState {
            first,
            second,
            parts,
            point: pair.point.into(),
            normal: pair.normal.into(),
            force: force.into(),
            depth: pair.depth,
            volume: pair.volume,
        });
        let (ids, forces) = ([first, second], [force, -force]);
        if let [Some(index), Some(other)] = pair.indices
            && index == other
        {
            // On a body and its image act opposite forces: of those on the body a torque remains.
            let [to, partner] = ids;
            let torque = (torques[0] + torques[1]).into();
            self.add_to(index, PairForce { to, partner, force: [0.0; 3], torque }, near, store);
            return;
        }
        for (side, index) in pair.indices.into_iter().enumerate() {
            if let Some(index) = index {
                let force = PairForce {
                    to: ids[side],
                    partner: ids[1 - side],
                    force: forces[side].into(),
                    torque: torques[side].into(),
                };
                self.add_to(index, force, near, store);
            }
        }
    }

    /// Adds the force on particle `index` (owned or ghost): here, or in the message to its owner.
    fn add_to(&mut self, index: usize, force: PairForce, near: &GhostLayer, store: &ParticleStore) {
        if index < store.owned {
            if self.is_direct {
                self.totals[index] += Load { force: force.force.into(), torque: force.torque.into() };
            } else {
                self.local.push((index as u32, force));
            }
        } else if let Ok(link) = near.peers.binary_search(&(store.owners[index] as usize)) {
            self.messages[link].extend_from_slice(bytemuck::bytes_of(&force));
        }
    }

    /// Sends forces to the owners and adds up those on the owned particles, by ascending id of the partner, walls last.
    /// Collective.
    pub(super) fn reduce(&mut self, comm: &Comm, near: &GhostLayer, particles: &LocalParticles) {
        if self.is_direct {
            return;
        }
        if !near.peers.is_empty() {
            let before = self.local.len();
            for message in comm.exchange(&near.peers, self.messages.clone()) {
                for force in bytemuck::pod_collect_to_vec::<u8, PairForce>(&message) {
                    if let Some(index) = particles.index_of(force.to) {
                        self.local.push((index as u32, force));
                    }
                }
            }
            // Without messages they are in order already: pairs are, and lower partners come first.
            if self.local.len() > before && !self.several && !self.has_meshes {
                self.local.sort_unstable_by_key(|(index, force)| (*index, force.partner));
            }
        }
        if self.several || self.has_meshes {
            // All contacts of two bodies come from one rank, in the order of their parts and images, which a stable sort keeps.
            self.local.sort_by_key(|(index, force)| (*index, force.partner));
        }
        for (index, force) in &self.local {
            self.totals[*index as usize] += Load { force: force.force.into(), torque: force.torque.into() };
        }
    }
}
