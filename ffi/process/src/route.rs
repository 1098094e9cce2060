//! The way of loads to the parts of an engine, and of particles back to the ranks that own them.
//!
//! A rank that owns a particle knows the part that has it, since that part has sent it. The part finds the owner from the position. A particle
//! that changes its owner in a step was a ghost there before, so that nothing else of it has to be sent.

use super::{CONTACTS_EACH, External, Host, Part, Peer, Served};
use crate::child::Asked;
use crate::message::{
    self, AppliedLoad, Kind, LoadedState, MeasuredContact, Outcome, State, read_contacts, read_states,
};
use bytemuck::{cast_slice, pod_collect_to_vec};
use std::cell::RefMut;
use turbid_core::comm::Comm;
use turbid_core::dem::Load;
use turbid_core::dem::native::failures::position_text;
use turbid_core::error::Result;
use turbid_core::math::Vec3;
use turbid_core::particle::Particle;

/// A particle that has come to its owner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrived {
    pub(super) loaded: LoadedState,
    /// The part that has it.
    pub(super) holder: u32,
}

impl External {
    /// Sends a message to the part of this rank, and returns its answer. Collective: in the meantime the parts may send messages to each
    /// other, if there are several, as often as they like but all of them each time.
    pub(super) fn ask(
        &self,
        comm: &Comm,
        part: Option<&Part>,
        (kind, payload): (Kind, &[u8]),
        most: u64,
    ) -> Outcome<Vec<u8>> {
        let parts = self.seat.parts;
        let asked = Asked { kind, parts, most };
        let Some(part) = part else {
            return self.exchange(comm, None, Ok((kind.answer(), Vec::new())), &asked);
        };
        let answer = part.peer.borrow_mut().ask(kind, payload, &asked);
        self.exchange(comm, Some(part), answer, &asked)
    }

    /// The answer of the part of this rank after all exchanges. Collective.
    fn exchange(
        &self,
        comm: &Comm,
        part: Option<&Part>,
        mut answer: Outcome<(Kind, Vec<u8>)>,
        asked: &Asked,
    ) -> Outcome<Vec<u8>> {
        let parts = asked.parts;
        if parts == 1 || matches!(self.params.host, Host::Here(_)) {
            return answer.map(|(_, payload)| payload);
        }
        loop {
            let exchanges = matches!(answer, Ok((Kind::Exchange, _)));
            let mut counts = [i64::from(exchanges), i64::from(part.is_some() && !exchanges)];
            comm.sum(&mut counts);
            if counts[0] == 0 {
                return answer.map(|(_, payload)| payload);
            }
            if counts[1] > 0 {
                let alone = "sent the message `exchange`, and another part did not".to_owned();
                return if exchanges { Err(alone) } else { answer.map(|(_, payload)| payload) };
            }
            let messages = match &answer {
                Ok((_, payload)) if exchanges => message::read_exchange(payload, parts),
                _ => Ok(Vec::new()),
            };
            let is_sound = !comm.any(messages.is_err());
            let messages = messages?;
            if !is_sound {
                // Another part has broken the protocol, and its rank says so.
                return Ok(Vec::new());
            }
            let received = comm.route(messages);
            if let Some(part) = part {
                let payload = message::exchange(&received);
                answer = part.peer.borrow_mut().ask(Kind::Exchange, &payload, asked);
            }
        }
    }

    /// The engine of this rank, if it runs in this process.
    fn here(&self) -> Option<RefMut<'_, Box<dyn Served>>> {
        let peer = self.peer()?.peer.borrow_mut();
        RefMut::filter_map(peer, |peer| match peer {
            Peer::Here(engine) => Some(engine),
            Peer::Process(_) => None,
        })
        .ok()
    }

    /// Sends the loads of the owned particles to the parts that have these, which make a step; the particles of the part of this rank
    /// then. Collective.
    pub(super) fn advance_parts(&self, comm: &Comm, loads: &[Load], dt: f64) -> Outcome<Vec<LoadedState>> {
        let owned = self.population.store.owned().iter().zip(loads);
        let holders = self.holders.borrow();
        let sent = owned.zip(holders.iter()).map(|((particle, load), &holder)| {
            let load = AppliedLoad { id: particle.id, force: load.force.into(), torque: load.torque.into() };
            (holder as usize, load)
        });
        let mut applied: Vec<AppliedLoad> =
            comm.route_records(sent).into_iter().flat_map(|(_, loads)| loads).collect();
        applied.sort_unstable_by_key(|load| load.id);
        let (parts, substeps) = (self.seat.parts, self.params.substeps);
        let ids: Vec<u64> = applied.iter().map(|load| load.id).collect();
        let of_one = (parts == 1).then_some(&ids[..]);
        let step = dt / f64::from(substeps);
        let mut states = if let Some(mut engine) = self.here() {
            // Without a message, which would be copied.
            engine.advance(step, substeps, &applied)?;
            let states = engine.states()?;
            message::check_states(&states, of_one, self.able.orientations)?;
            states
        } else {
            let message = message::advance(step, substeps, &applied);
            let most = if parts == 1 {
                size_of::<State>() * applied.len()
            } else {
                size_of::<LoadedState>() * self.population.population.count as usize
            };
            let bytes = self.ask(comm, self.peer(), (Kind::Advance, &message), most as u64)?;
            read_states(&bytes, of_one, self.able.orientations)?
        };
        if parts == 1 {
            for loaded in &mut states {
                let load = &applied[ids.binary_search(&loaded.state.id).expect("a known id")];
                (loaded.force, loaded.torque) = (load.force, load.torque);
            }
        }
        Ok(states)
    }

    /// Sends the particles of the part of this rank to their owners; those of this rank. Collective.
    pub(super) fn to_owners(&self, comm: &Comm, states: Vec<LoadedState>) -> Vec<Arrived> {
        let domain = self.near.decomposition().domain;
        let mut owners = Vec::with_capacity(states.len());
        let records = comm.route_records(states.into_iter().map(|loaded| {
            let owner = self.near.owner(domain.wrap(loaded.state.position.into()));
            owners.push((loaded.state.id, owner as u32));
            (owner, loaded)
        }));
        owners.sort_unstable();
        if let Some(part) = &self.part {
            part.owners.replace(owners);
        }
        let mut arrived = Vec::new();
        for (holder, records) in records {
            arrived.extend(records.into_iter().map(|loaded| Arrived { loaded, holder: holder as u32 }));
        }
        arrived
    }

    /// Reason why what has arrived on all ranks is not each particle once, if it is not. Collective.
    pub(super) fn missing(&self, comm: &Comm, arrived: &[Arrived]) -> Option<String> {
        let mut ids: Vec<u64> = arrived.iter().map(|arrived| arrived.loaded.state.id).collect();
        ids.sort_unstable();
        let twice = ids.windows(2).any(|pair| pair[0] == pair[1]);
        let mut counts = [ids.len() as i64, i64::from(twice)];
        comm.sum(&mut counts);
        let count = self.population.population.count;
        if counts == [count as i64, 0] {
            return None;
        }
        // All that there were, and all that there are: the run ends.
        let record = |p: &Particle| {
            let [x, y, z] = p.position.map(f64::to_bits);
            [p.id, x, y, z]
        };
        let before: Vec<[u64; 4]> = self.population.store.owned().iter().map(record).collect();
        let known: Vec<[u64; 4]> = pod_collect_to_vec(&comm.gather(cast_slice(&before).to_vec()).concat());
        let mut now: Vec<u64> = pod_collect_to_vec(&comm.gather(cast_slice(&ids).to_vec()).concat());
        now.sort_unstable();
        let records = now.len();
        let double = now.windows(2).find(|pair| pair[0] == pair[1]);
        let double =
            double.map_or_else(String::new, |pair| format!(", and two of them are of particle {}", pair[0]));
        let lost = known.iter().find(|known| now.binary_search(&known[0]).is_err());
        let lost = lost.map_or_else(String::new, |&[id, x, y, z]| {
            let place = position_text(Vec3::from([x, y, z].map(f64::from_bits)));
            format!("; particle {id}, last seen at {place}, is lost: it has left the box, or moved too far in one step")
        });
        Some(format!("message `states`: {records} records for {count} particles{double}{lost}"))
    }

    /// Asks the parts for the particles that they have, and notes which part has each of the owned ones, if there are several parts: between
    /// two steps. Collective.
    pub(super) fn locate(&self, comm: &Comm) -> Result<()> {
        if self.seat.parts == 1 {
            return Ok(());
        }
        let states = self.ask(comm, self.peer(), (Kind::ListParticles, &[]), u64::MAX);
        let states = states.and_then(|bytes| read_states(&bytes, None, self.able.orientations));
        let states = comm.agree(states.map_err(|what| self.failure(what)))?;
        let arrived = self.to_owners(comm, states);
        if let Some(lost) = self.missing(comm, &arrived) {
            return comm.agree(if self.near.rank == 0 { Err(self.failure(lost)) } else { Ok(()) });
        }
        let mut holders = vec![0; self.population.store.owned];
        let mut unknown = None;
        for Arrived { loaded, holder } in arrived {
            match self.population.index_of(loaded.state.id).and_then(|at| holders.get_mut(at)) {
                Some(place) => *place = holder,
                None => unknown = Some(loaded.state.id),
            }
        }
        self.holders.replace(holders);
        let moved =
            |id: u64| Err(self.failure(format!("message `states`: particle {id} is not where it was given")));
        comm.agree(unknown.map_or(Ok(()), moved))
    }

    /// The contacts that the part of this rank lists. Collective.
    pub(super) fn list_contacts(&self, comm: &Comm) -> Outcome<Vec<MeasuredContact>> {
        let count = self.population.population.count as usize;
        let most = CONTACTS_EACH * size_of::<MeasuredContact>() * (count + 1);
        let bytes = self.ask(comm, self.peer(), (Kind::ListContacts, &[]), most as u64)?;
        let Some(part) = self.peer() else { return Ok(Vec::new()) };
        let owners = part.owners.borrow();
        let known = |id: u64| owners.binary_search_by_key(&id, |&(known, _)| known).is_ok();
        let walls = self.params.touched_walls().len();
        read_contacts(&bytes, known, self.seat.parts == 1, walls, self.able.overlaps, self.strongest)
    }

    /// Sends the contacts of the part of this rank to owners of a body, which know both; those that have come here. Collective.
    pub(super) fn to_first(&self, comm: &Comm, listed: Vec<MeasuredContact>) -> Vec<MeasuredContact> {
        // A rank without a part lists none.
        let owners = self.part.as_ref().map(|part| part.owners.borrow());
        let owners: &[(u64, u32)] = owners.as_deref().map_or(&[], Vec::as_slice);
        let owner = |id: u64| owners.binary_search_by_key(&id, |&(known, _)| known).map(|at| owners[at].1);
        let sent = listed.into_iter().map(|measured| {
            let [first, second] = [measured.contact.first, measured.contact.second];
            let to = owner(first).or_else(|_| owner(second)).expect("one of them is known");
            (to as usize, measured)
        });
        comm.route_records(sent).into_iter().flat_map(|(_, contacts)| contacts).collect()
    }
}
