//! Results of the contacts of a sub-step: forces on particles, histories, counts, states for the output.

use crate::comm::Comm;
use crate::contact::{Couple, Overlap, PairLaw, law::Action, law::UNSET};
use crate::dem::assign::Neighbourhood;
use crate::dem::exchange::Population;
use crate::dem::history::{History, Record};
use crate::dem::{ContactState, ContactSummary, Load};
use crate::math::Vec3;
use crate::particle::ParticleStore;
use bytemuck::{Pod, Zeroable};

/// The books of one rank. Buffers live from sub-step to sub-step.
#[derive(Clone, Debug, Default)]
pub(super) struct Ledger {
    /// Memories of the contacts.
    pub(super) history: History,
    /// Counts.
    pub(super) summary: ContactSummary,
    /// Contacts of this sub-step; after [`close`](Self::close) ascending by the ids of the pair.
    pub(super) states: Vec<ContactState>,
    /// Contact force and torque by owned particle, after [`add_up`](Self::add_up).
    pub(super) totals: Vec<Load>,
    /// Contact forces on owned particles, with their index.
    shares: Vec<(u32, Share)>,
    /// The same for other ranks, by peer.
    messages: Vec<Vec<u8>>,
    /// Number of states when the round of the walls began.
    pairs: Option<usize>,
}

/// Effect of one contact on one particle.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Share {
    to: u64,
    partner: u64,
    force: [f64; 3],
    torque: [f64; 3],
}

impl Share {
    /// Force (N) and torque (N m) of `partner` on `to`.
    pub(super) fn new([to, partner]: [u64; 2], force: Vec3, torque: Vec3) -> Self {
        Self { to, partner, force: force.into(), torque: torque.into() }
    }
}

impl ContactSummary {
    /// Counts a contact of the sub-step.
    fn see(&mut self, state: &ContactState) {
        self.count += usize::from(state.force.iter().any(|f| *f != 0.0));
        self.max_depth = self.max_depth.max(state.depth);
    }
}

/// Two bodies that overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting<'a> {
    /// Ids, the lower one first; a wall stands second.
    pub(super) ids: [u64; 2],
    /// Law of the two materials.
    pub(super) law: &'a PairLaw,
    /// Geometry.
    pub(super) overlap: &'a Overlap,
    /// Centre of the second body relative to the first (m); nothing for a wall.
    pub(super) offset: Vec3,
    /// Sizes and masses.
    pub(super) couple: Couple,
    /// Velocity of the first body relative to the second at the point of contact (m/s).
    pub(super) velocity: Vec3,
    /// The point of contact (m), wrapped.
    pub(super) point: Vec3,
}

impl Ledger {
    /// For a rank with this number of peers.
    pub(super) fn new(peers: usize) -> Self {
        Self { messages: vec![Vec::new(); peers], ..Self::default() }
    }

    /// Begins a sub-step.
    pub(super) fn open(&mut self) {
        self.shares.clear();
        self.states.clear();
        self.messages.iter_mut().for_each(Vec::clear);
        (self.summary.count, self.summary.max_depth) = (0, 0.0);
        self.pairs = None;
    }

    /// After the pairs of particles come the contacts with walls, again in ascending order.
    pub(super) fn begin_walls(&mut self) {
        self.history.begin_again();
        self.pairs = Some(self.states.len());
    }

    /// Ends the contacts of the sub-step.
    pub(super) fn close(&mut self) {
        self.history.turn();
        if self.pairs.is_some_and(|n| n < self.states.len()) {
            // Two ascending runs: a stable sort merges them.
            self.states.sort_by_key(|state| (state.first, state.second));
        }
    }

    /// Takes the contacts of a sub-step, ascending by the ids of the pair, from elsewhere.
    pub(super) fn recount(&mut self, states: Vec<ContactState>) {
        (self.summary.count, self.summary.max_depth) = (0, 0.0);
        for state in &states {
            self.summary.see(state);
        }
        self.states = states;
    }

    /// Finds or begins the history of a contact, and evaluates its force. Contacts come in ascending order of the ids.
    pub(super) fn enter(&mut self, meeting: &Meeting) -> Action {
        let Meeting { ids: [first, second], law, overlap, velocity, .. } = *meeting;
        let summary = &mut self.summary;
        let mut record = self.history.recall(first, second).unwrap_or_else(|| {
            summary.begun += 1;
            Record { first, second, damping: UNSET, age: 0 }
        });
        record.damping = law.latch(record.damping, velocity.dot(&overlap.normal));
        record.age += 1;
        self.history.keep(record);
        let action = law.act(overlap, meeting.offset, &meeting.couple, velocity, record.damping);
        let state = ContactState {
            first,
            second,
            point: meeting.point.into(),
            normal: overlap.normal.into(),
            force: action.force.into(),
            depth: overlap.depth,
            volume: overlap.volume,
        };
        summary.see(&state);
        self.states.push(state);
        action
    }

    /// Books the force on particle `index` (owned or ghost): here, or in the message to its owner.
    pub(super) fn book(&mut self, index: usize, share: Share, near: &Neighbourhood, store: &ParticleStore) {
        if index < store.owned {
            self.shares.push((index as u32, share));
        } else if let Ok(link) = near.peers.binary_search(&(store.owners[index] as usize)) {
            self.messages[link].extend_from_slice(bytemuck::bytes_of(&share));
        }
    }

    /// Sends forces to the owners and adds up those on the owned particles, by ascending id of the partner, walls last.
    ///
    /// # Collective
    pub(super) fn add_up(&mut self, comm: &Comm, near: &Neighbourhood, population: &Population) {
        if !near.peers.is_empty() {
            let local = self.shares.len();
            let messages = self.messages.clone();
            for message in comm.exchange(&near.peers, messages) {
                for share in bytemuck::pod_collect_to_vec::<u8, Share>(&message) {
                    if let Some(index) = population.index_of(share.to) {
                        self.shares.push((index as u32, share));
                    }
                }
            }
            // Without messages they are in order already: pairs are, and lower partners come first.
            if self.shares.len() > local {
                self.shares.sort_unstable_by_key(|(index, share)| (*index, share.partner));
            }
        }
        self.totals.clear();
        self.totals.resize(population.store.owned, Load::default());
        for (index, share) in &self.shares {
            let total = &mut self.totals[*index as usize];
            total.force += Vec3::from(share.force);
            total.torque += Vec3::from(share.torque);
        }
    }
}
