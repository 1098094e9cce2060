//! Reading of the parts of a state by all ranks: each checks and sends what it has read, and none has more than its share.

use super::{Loaded, Saved};
use crate::comm::{Comm, Fetched, SavedParts};
use crate::dem::assign::GhostLayer;
use crate::dem::population::Population;
use crate::dem::{ContactKey, ContactState, Records};
use crate::math::Vec3;
use crate::particle::Particle;
use bytemuck::{Pod, Zeroable, cast_slice, pod_collect_to_vec};
use std::collections::BTreeMap;

/// Or the reason why a state is not that of the case.
type Outcome<T> = std::result::Result<T, String>;

/// More sub-steps, and contacts, than a run can have.
const MOST: u64 = 1 << 53;

/// True for the contact of a body with an image of itself.
fn is_with_itself(key: &ContactKey) -> bool {
    key.first == key.second && key.shift() != [0; 3]
}

/// Position (m, wrapped) and template of a particle, for the ranks that know its contacts.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Place {
    position: [f64; 3],
    template: u64,
}

/// The places of the particles that the contacts of some parts name.
struct Places {
    /// Ascending.
    ids: Vec<u64>,
    /// None where there is no such particle.
    places: Vec<Option<Place>>,
}

impl Places {
    fn of(&self, id: u64) -> Option<Place> {
        self.ids.binary_search(&id).ok().and_then(|at| self.places[at])
    }
}

/// Numbers of a part that every rank compares with those of the others.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Numbers {
    part: u64,
    substep: u64,
    population: Population,
    particles: u64,
    /// Largest id; 0 without particles.
    last: u64,
}

impl Numbers {
    /// Those of all parts, the same on every rank, which must be of one state. Collective.
    fn of_all(comm: &Comm, parts: &SavedParts, read: &[(usize, Saved)]) -> Outcome<Vec<Self>> {
        let of = |(n, part): &(usize, Saved)| Self {
            part: *n as u64,
            substep: part.substep,
            population: part.population,
            particles: part.particles.len() as u64,
            last: part.particles.iter().map(|particle| particle.id).max().unwrap_or(0),
        };
        let own: Vec<Self> = read.iter().map(of).collect();
        let mut all: Vec<Self> = pod_collect_to_vec(&comm.all_gather(cast_slice(&own).to_vec()).concat());
        all.sort_unstable_by_key(|numbers| numbers.part);
        let indices = all.iter().map(|numbers| numbers.part);
        assert!(indices.eq(0..parts.count as u64), "each part is read by one rank");
        for later in &all {
            let n = later.part + 1;
            if later.population != all[0].population {
                return Err(format!("parts 1 and {n} are of other numbers of particles"));
            }
            if later.substep != all[0].substep {
                return Err(format!(
                    "part 1 was saved after {} sub-steps, but part {n} after {}",
                    all[0].substep, later.substep
                ));
            }
        }
        Ok(all)
    }

    /// Checks that all parts together have as many particles as each says, with ids below the next one.
    fn are_whole(all: &[Self]) -> Outcome<()> {
        let Population { count, next_id } = all[0].population;
        let has: u64 = all.iter().map(|numbers| numbers.particles).sum();
        if has != count {
            return Err(format!("it holds {has} particles of {count}: a part of it is missing"));
        }
        match all.iter().map(|numbers| numbers.last).max().filter(|last| has > 0 && *last >= next_id) {
            Some(id) => Err(format!("it holds particle {id}, but the next one would be {next_id}")),
            None => Ok(()),
        }
    }
}

/// Constraints on a saved state.
#[derive(Clone, Debug)]
pub(super) struct Case<'a> {
    /// Number of templates.
    pub(super) templates: usize,
    /// Parts of the template that has the most.
    pub(super) most_parts: usize,
    /// Number of facets of each wall.
    pub(super) walls: Vec<usize>,
    /// Numbers that the contact law remembers of a contact.
    pub(super) memory: usize,
    pub(super) near: &'a GhostLayer,
}

impl Case<'_> {
    /// The state as in [`Saved::load`], or the reason why it is none of this case, the same on every rank. Collective.
    pub(super) fn load(&self, engine: &str, comm: &Comm, parts: &SavedParts) -> Outcome<Loaded> {
        if parts.count == 0 {
            return Err("there is no part of it".into());
        }
        let of = |n: usize| format!("part {} of {}", n + 1, parts.count);
        let read = |(n, bytes): &(usize, Vec<u8>)| {
            let part = Saved::read(engine, bytes).map_err(|what| format!("{} {what}", of(*n)))?;
            self.is_sound(&part).map_err(|what| format!("{}: {what}", of(*n)))?;
            Ok((*n, part))
        };
        let read = comm.agree_words(parts.own.iter().map(read).collect::<Outcome<Vec<_>>>())?;
        let numbers = Numbers::of_all(comm, parts, &read)?;
        let places = self.places(comm, &read)?;
        Numbers::are_whole(&numbers)?;
        let unknown = read.iter().find_map(|(n, part)| Some((n, self.unknown(part, &places)?)));
        comm.agree_words(unknown.map_or(Ok(()), |(n, ContactKey { first, second, .. })| {
            let part = of(*n);
            Err(format!("{part}: it remembers a contact of {first} with {second}, which are not both there"))
        }))?;
        let records = self.records(comm, &read, &places)?;
        let Numbers { substep, population, .. } = numbers[0];
        let mut all = Saved { substep, population, records, ..Saved::default() };
        let mut own = Vec::new();
        for (n, part) in read {
            all.particles.extend(part.particles);
            all.loads.extend(part.loads);
            all.begun = all.begun.wrapping_add(part.begun);
            all.states.extend(part.states);
            if !part.own.is_empty() {
                own.push((n, part.own));
            }
        }
        all.states.sort_by_key(ContactState::key);
        Ok(Loaded { state: all, own })
    }

    /// The places of the particles that contacts of these parts name, in a state that has no particle twice. Collective.
    fn places(&self, comm: &Comm, read: &[(usize, Saved)]) -> Outcome<Places> {
        let domain = self.near.decomposition().domain;
        let place = |particle: &Particle| {
            let position = domain.wrap(particle.position()).into();
            (particle.id, Place { position, template: particle.template })
        };
        let offered: Vec<_> = read.iter().flat_map(|(_, part)| &part.particles).map(place).collect();
        let bodies = |key: ContactKey| {
            let second = ContactState::wall_of(key.second).is_none().then_some(key.second);
            std::iter::once(key.first).chain(second)
        };
        let mut ids: Vec<u64> = read.iter().flat_map(|(_, part)| keys(part)).flat_map(bodies).collect();
        ids.sort_unstable();
        ids.dedup();
        let Fetched { found, twice, .. } = comm.fetch(&offered, &ids);
        let twice = twice.map_or(Ok(()), |id| Err(format!("particle {id} is in it twice")));
        comm.agree_words(twice).map(|()| Places { ids, places: found })
    }

    /// A contact of a part whose bodies are not both there, if it has one.
    fn unknown(&self, part: &Saved, places: &Places) -> Option<ContactKey> {
        let known = |id: u64| places.of(id).is_some();
        let partner = |key: &ContactKey| match ContactState::wall_of(key.second) {
            Some(wall) => wall < self.walls.len(),
            None => key.first != key.second && known(key.second) || is_with_itself(key),
        };
        keys(part).find(|key| !(known(key.first) && partner(key)))
    }

    /// The memories of the contacts that this rank evaluates, in a state that has none twice. Collective.
    fn records(&self, comm: &Comm, read: &[(usize, Saved)], places: &Places) -> Outcome<Records> {
        let mut sorted: BTreeMap<usize, Records> = BTreeMap::new();
        for (key, memory) in read.iter().flat_map(|(_, part)| part.records.iter()) {
            let to = self.evaluating_rank(&key, places);
            sorted.entry(to).or_insert_with(|| Records::new(self.memory)).push(key, memory);
        }
        let sent = sorted.into_iter().map(|(to, records)| (to, records.bytes().to_vec())).collect();
        let mut records = Records::new(self.memory);
        for (_, bytes) in comm.route(sent) {
            records.extend(&Records::from_bytes(self.memory, &bytes));
        }
        let mut keys: Vec<ContactKey> = records.iter().map(|(key, _)| key).collect();
        keys.sort_unstable();
        let twice = keys.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        comm.agree_words(twice.map_or(Ok(()), |ContactKey { first, second, .. }| {
            Err(format!("the contact of {first} with {second} is in it twice"))
        }))?;
        Ok(records)
    }

    /// The rank that evaluates a contact of bodies that are there; the owner of the first one if no rank has both.
    fn evaluating_rank(&self, key: &ContactKey, places: &Places) -> usize {
        let body = |id: u64| {
            let Place { position, template } = places.of(id).expect("a body that is there");
            (self.near.owner(position.into()), position.into(), template)
        };
        let first = body(key.first);
        if ContactState::wall_of(key.second).is_some() {
            return first.0;
        }
        self.near.evaluating_rank(first, body(key.second)).unwrap_or(first.0)
    }

    /// Checks that an engine can continue with the numbers of a part; returns the reason if not.
    fn is_sound(&self, part: &Saved) -> Outcome<()> {
        let finite = |vectors: &[Vec3]| vectors.iter().flatten().all(|x| x.is_finite());
        let size = self.near.decomposition().domain.size();
        let in_box = |particle: &Particle| particle.flaw(size);
        let mut kinds = part.particles.iter();
        if let Some(Particle { id, template, .. }) = kinds.find(|p| p.template >= self.templates as u64) {
            return Err(format!(
                "particle {id} is of kind {template}, and this case has only {} kinds; continue with the case it was written by",
                self.templates
            ));
        }
        if let Some(flaw) = part.particles.iter().find_map(in_box) {
            return Err(flaw);
        }
        let mut loads = part.particles.iter().zip(&part.loads);
        if let Some((particle, _)) = loads.find(|(_, load)| !finite(&[load.force, load.torque])) {
            return Err(format!("the load on particle {} is not finite", particle.id));
        }
        let (has, needs) = (part.records.memory(), self.memory);
        if has != needs && !part.records.is_empty() {
            return Err(format!(
                "it remembers {has} numbers of each contact, and the law of this case {needs}"
            ));
        }
        let mut records = part.records.iter();
        let parts_of = |key: &ContactKey| {
            let wall = ContactState::wall_of(key.second).and_then(|wall| self.walls.get(wall));
            [self.most_parts, wall.copied().unwrap_or(self.most_parts)]
        };
        let is_none = |(key, memory): &(ContactKey, &[f64])| {
            (key.first >= key.second && !is_with_itself(key))
                || key.indices().iter().zip(parts_of(key)).any(|(&part, count)| part as usize >= count)
                || !memory.iter().all(|x| x.is_finite())
        };
        if let Some((ContactKey { first, second, .. }, _)) = records.find(is_none) {
            return Err(format!(
                "the order, the parts or the memory of the contact of {first} with {second} is that of none"
            ));
        }
        let is_finite = |state: &ContactState| {
            finite(
                &[state.point, state.normal, state.force, [state.depth, state.volume, 0.0]].map(Vec3::from),
            )
        };
        if let Some(ContactState { first, second, .. }) = part.states.iter().find(|state| !is_finite(state)) {
            return Err(format!("the contact of {first} with {second} has a number that is not finite"));
        }
        if part.substep.max(part.begun) > MOST {
            return Err("the number of sub-steps or of contacts is that of no run".into());
        }
        Ok(())
    }
}

/// The contacts that a part remembers, and those of its last sub-step.
fn keys(part: &Saved) -> impl Iterator<Item = ContactKey> {
    let states = part.states.iter().map(ContactState::key);
    part.records.iter().map(|(key, _)| key).chain(states)
}
