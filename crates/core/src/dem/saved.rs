//! Saved state of an engine as bytes, and its reading by all ranks.
//!
//! A part, written by one rank, is a [`Header`] and then the owned particles, their loads, the histories of contacts,
//! and the contacts of the last sub-step, as plain data of this machine, and at the end the engine's own data. All
//! parts together are the run: a reader picks what its own rank has, so the number of ranks may change.

use super::assign::GhostLayer;
use super::exchange::LocalParticles;
use super::population::Population;
use super::{ContactKey, ContactState, Load, LoadRow, Records};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::Particle;
use crate::wall::Wall;
use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::xxh3_64;

/// Begins every part; the last byte is the version.
const MAGIC: [u8; 8] = *b"turbidE\x03";

/// More sub-steps, and contacts, than a run can have.
const MOST: u64 = 1 << 53;

/// More numbers than a law remembers of a contact.
const MOST_MEMORY: usize = 1 << 10;

/// The state of one rank, or of all together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Saved {
    /// Sub-steps since the start.
    pub substep: u64,
    /// Contacts that began since the start.
    pub begun: u64,
    /// Numbers of the particles of all ranks.
    pub population: Population,
    /// Owned particles.
    pub particles: Vec<Particle>,
    /// Loads of the last step on them.
    pub loads: Vec<Load>,
    /// Memories of contacts.
    pub records: Records,
    /// Contacts of the last sub-step.
    pub states: Vec<ContactState>,
    /// The engine's own data, of all ranks together.
    pub own: Vec<u8>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 8],
    /// Of all bytes that follow this number.
    checksum: u64,
    /// Name of the engine, filled up with zeros.
    engine: [u8; 16],
    particles: u64,
    records: u64,
    /// Numbers of each record besides its key.
    memory: u64,
    states: u64,
    substep: u64,
    begun: u64,
    own: u64,
    population: Population,
}

/// End of [`Header::checksum`].
const UNCHECKED: usize = 16;

fn padded(engine: &str) -> [u8; 16] {
    std::array::from_fn(|i| engine.as_bytes().get(i).copied().unwrap_or(0))
}

/// The next `count` items, if there are as many.
fn take<T: Pod>(rest: &mut &[u8], count: u64) -> Option<Vec<T>> {
    let length = usize::try_from(count).ok()?.checked_mul(size_of::<T>())?;
    let (items, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(bytemuck::pod_collect_to_vec(items))
}

impl Saved {
    /// One part.
    pub fn write(&self, engine: &str) -> Vec<u8> {
        assert_eq!(self.loads.len(), self.particles.len());
        let header = Header {
            magic: MAGIC,
            checksum: 0,
            engine: padded(engine),
            particles: self.particles.len() as u64,
            records: self.records.len() as u64,
            memory: self.records.memory() as u64,
            states: self.states.len() as u64,
            substep: self.substep,
            begun: self.begun,
            own: self.own.len() as u64,
            population: self.population,
        };
        let loads: Vec<LoadRow> = self.loads.iter().map(|load| (*load).into()).collect();
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&self.particles));
        bytes.extend_from_slice(bytemuck::cast_slice(&loads));
        bytes.extend_from_slice(self.records.bytes());
        bytes.extend_from_slice(bytemuck::cast_slice(&self.states));
        bytes.extend_from_slice(&self.own);
        let checksum = xxh3_64(&bytes[UNCHECKED..]);
        bytes[UNCHECKED - 8..UNCHECKED].copy_from_slice(bytemuck::bytes_of(&checksum));
        bytes
    }

    /// The contacts that a part, which has been read, has seen begin.
    pub fn begun(part: &[u8]) -> Option<u64> {
        let head = part.get(..size_of::<Header>())?;
        Some(bytemuck::pod_read_unaligned::<Header>(head).begun)
    }

    /// One part, or its defect.
    pub(super) fn read(engine: &str, bytes: &[u8]) -> std::result::Result<Self, String> {
        let (head, mut rest) = bytes
            .split_at_checked(size_of::<Header>())
            .ok_or_else(|| format!("has only {} bytes", bytes.len()))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        if header.magic[..7] != MAGIC[..7] {
            return Err("is something else".into());
        }
        if header.magic != MAGIC {
            return Err(format!("is of version {}, not {}", header.magic[7], MAGIC[7]));
        }
        if header.checksum != xxh3_64(&bytes[UNCHECKED..]) {
            return Err("is damaged: its checksum does not match".into());
        }
        if header.engine != padded(engine) {
            let name = String::from_utf8_lossy(&header.engine);
            return Err(format!("is of the engine `{}`", name.trim_end_matches('\0')));
        }
        let whole = (|| {
            let particles = take(&mut rest, header.particles)?;
            let loads = take::<LoadRow>(&mut rest, header.particles)?;
            let memory = usize::try_from(header.memory).ok().filter(|memory| *memory <= MOST_MEMORY)?;
            let row = (size_of::<ContactKey>() + memory * size_of::<f64>()) as u64;
            let records: Vec<u8> = take(&mut rest, header.records.checked_mul(row)?)?;
            let records = Records::from_bytes(memory, &records);
            let states = take(&mut rest, header.states)?;
            let own = take(&mut rest, header.own)?;
            rest.is_empty().then(|| Self {
                substep: header.substep,
                begun: header.begun,
                population: header.population,
                particles,
                loads: loads.into_iter().map(Load::from).collect(),
                records,
                states,
                own,
            })
        })();
        whole.ok_or_else(|| format!("has {} bytes, which are not those its head counts", bytes.len()))
    }

    /// The state that the ranks of an earlier run saved as `parts`, the same on every rank, for an engine with these templates and
    /// these walls, whose contact law remembers `memory` numbers of a contact.
    ///
    /// # Errors
    /// [`Error::Input`] on every rank if the parts are damaged, incomplete, or of another engine, version or case.
    pub fn load(
        engine: &str,
        parts: &[Vec<u8>],
        (near, local, walls): (&GhostLayer, &LocalParticles, &[Wall]),
        memory: usize,
    ) -> Result<Self> {
        let (domain, templates) = (near.decomposition().domain, local.store.templates.len());
        let most_parts = local.store.templates.iter().map(|template| template.parts().count()).max();
        let walls = walls.iter().map(|wall| wall.surface.facets()).collect();
        let case = Case { templates, most_parts: most_parts.unwrap_or(1), walls, memory, domain };
        Self::join(engine, parts, &case, (near.rank, near.ranks()))
    }

    /// All particles, loads and records of `parts`; and those contacts of the last sub-step, and the number of
    /// contacts begun, that are the business of `rank` of `size`: as they were for the same number of ranks, and
    /// together always all.
    ///
    /// # Errors
    /// [`Error::Input`], the same on every rank, if the parts are damaged, incomplete, or of another engine, version or case.
    fn join(engine: &str, parts: &[Vec<u8>], case: &Case, (rank, size): (usize, usize)) -> Result<Self> {
        let refuse = |what: String| {
            Error::Input(format!("the saved state of the {engine} engine cannot be used: {what}"))
        };
        let of = |n: usize| format!("part {} of {}", n + 1, parts.len());
        let parts = (parts.iter().enumerate())
            .map(|(n, bytes)| Self::read(engine, bytes).map_err(|what| refuse(format!("{} {what}", of(n)))))
            .collect::<Result<Vec<Self>>>()?;
        let ids = case.ids_of(&parts).map_err(refuse)?;
        let mut all = Self { records: Records::new(case.memory), ..Self::default() };
        for (n, part) in parts.into_iter().enumerate() {
            if n > 0 && part.substep != all.substep {
                return Err(refuse(format!(
                    "part 1 was saved after {} sub-steps, but part {} after {}",
                    all.substep,
                    n + 1,
                    part.substep
                )));
            }
            case.is_sound(&part, &ids).map_err(|what| refuse(format!("{}: {what}", of(n))))?;
            (all.substep, all.population) = (part.substep, part.population);
            all.particles.extend(part.particles);
            all.loads.extend(part.loads);
            all.records.extend(&part.records);
            all.own.extend(part.own);
            if n % size == rank {
                all.begun = all.begun.wrapping_add(part.begun);
                all.states.extend(part.states);
            }
        }
        all.states.sort_by_key(ContactState::key);
        Ok(all)
    }
}

/// True for the contact of a body with an image of itself.
fn is_with_itself(key: &ContactKey) -> bool {
    key.first == key.second && key.shift() != [0; 3]
}

/// Constraints on a saved state.
#[derive(Clone, Debug)]
struct Case {
    /// Number of templates.
    templates: usize,
    /// Parts of the template that has the most.
    most_parts: usize,
    /// Number of facets of each wall.
    walls: Vec<usize>,
    /// Numbers that the contact law remembers of a contact.
    memory: usize,
    domain: Domain,
}

impl Case {
    /// The ids in all `parts`, ascending, which together can be a whole state of this case; or the reason why they cannot.
    fn ids_of(&self, parts: &[Saved]) -> std::result::Result<Vec<u64>, String> {
        let particles = || parts.iter().flat_map(|part| &part.particles);
        let mut ids: Vec<u64> = particles().map(|p| p.id).collect();
        ids.sort_unstable();
        if let Some([twice, ..]) = ids.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("particle {twice} is in it twice"));
        }
        let Some(Population { count, next_id }) = parts.first().map(|part| part.population) else {
            return Err("there is no part of it".into());
        };
        if let Some(n) = parts.iter().position(|part| part.population != parts[0].population) {
            return Err(format!("parts 1 and {} are of other numbers of particles", n + 1));
        }
        if ids.len() as u64 != count {
            return Err(format!("it holds {} particles of {count}: a part of it is missing", ids.len()));
        }
        if let Some(id) = ids.last().filter(|id| **id >= next_id) {
            return Err(format!("it holds particle {id}, but the next one would be {next_id}"));
        }
        if let Some(Particle { id, template, .. }) = particles().find(|p| p.template >= self.templates as u64)
        {
            return Err(format!(
                "particle {id} is of kind {template}, and this case has only {} kinds; continue with the case it was written by",
                self.templates
            ));
        }
        let mut keys: Vec<ContactKey> =
            parts.iter().flat_map(|part| part.records.iter()).map(|(key, _)| key).collect();
        keys.sort_unstable();
        if let Some(twice) = keys.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("the contact of {} with {} is in it twice", twice[0].first, twice[0].second));
        }
        Ok(ids)
    }

    /// Checks that an engine can continue with the numbers of a part of the state with these `ids`; returns the reason if not.
    fn is_sound(&self, part: &Saved, ids: &[u64]) -> std::result::Result<(), String> {
        let finite = |vectors: &[Vec3]| vectors.iter().flatten().all(|x| x.is_finite());
        let known = |id: u64| ids.binary_search(&id).is_ok();
        let partner = |key: &ContactKey| match ContactState::wall_of(key.second) {
            Some(wall) => wall < self.walls.len(),
            None => key.first != key.second && known(key.second) || is_with_itself(key),
        };
        let states = part.states.iter().map(ContactState::key);
        let mut pairs = part.records.iter().map(|(key, _)| key).chain(states);
        let in_box = |particle: &Particle| particle.flaw(self.domain.size());
        if let Some(flaw) = part.particles.iter().find_map(in_box) {
            return Err(flaw);
        }
        let mut loads = part.particles.iter().zip(&part.loads);
        if let Some((particle, _)) = loads.find(|(_, load)| !finite(&[load.force, load.torque])) {
            return Err(format!("the load on particle {} is not finite", particle.id));
        }
        if let Some(ContactKey { first, second, .. }) = pairs.find(|key| !(known(key.first) && partner(key)))
        {
            return Err(format!("it remembers a contact of {first} with {second}, which are not both there"));
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

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Domain = Domain { faces: Domain::faces([true, true, false]), cells: [8, 8, 8], dx: 0.5 };

    fn case() -> Case {
        Case { templates: 2, most_parts: 2, walls: vec![1; 2], memory: 2, domain: BOX }
    }

    /// One contact with what is remembered of it.
    fn remembered(key: ContactKey, memory: [f64; 2]) -> Records {
        let mut records = Records::new(2);
        records.push(key, &memory);
        records
    }

    /// Two ranks' states of three particles, with a contact of two of them and one with a wall.
    fn two() -> [Saved; 2] {
        let particle = |id, template| Particle::at(id, template, Vec3::repeat(0.25 * id as f64));
        let load = Load { force: Vec3::new(1.0, 2.0, 3.0), torque: Vec3::new(4.0, 5.0, 6.0) };
        let record = |first, second| remembered(ContactKey { first, second, parts: [0; 2] }, [0.5, 7.0]);
        let state = |first, second| ContactState { first, second, depth: 1e-3, ..ContactState::zeroed() };
        [
            Saved {
                substep: 40,
                begun: 2,
                population: Population { count: 3, next_id: 12 },
                particles: vec![particle(3, 0), particle(9, 0)],
                loads: vec![load; 2],
                records: record(3, 9),
                states: vec![state(3, 9)],
                own: vec![1, 2, 3],
            },
            Saved {
                substep: 40,
                begun: 3,
                population: Population { count: 3, next_id: 12 },
                particles: vec![particle(5, 1)],
                loads: vec![load],
                records: record(5, ContactState::of_wall(1)),
                states: vec![state(3, 5)],
                own: Vec::new(),
            },
        ]
    }

    fn bytes(parts: &[Saved]) -> Vec<Vec<u8>> {
        parts.iter().map(|part| part.write("native")).collect()
    }

    /// Error of [`Saved::join`] for these parts.
    fn objection(parts: &[Vec<u8>]) -> String {
        let refused = Saved::join("native", parts, &case(), (0, 1)).unwrap_err();
        assert!(matches!(refused, Error::Input(_)));
        refused.to_string()
    }

    /// The same after a change of the first part.
    fn after(change: impl Fn(&mut Saved)) -> String {
        let mut parts = two();
        change(&mut parts[0]);
        objection(&bytes(&parts))
    }

    #[test]
    fn all_parts_together_are_the_run_and_each_rank_gets_its_share_of_the_counts() {
        let (parts, written) = (two(), bytes(&two()));
        let alone = Saved::join("native", &written, &case(), (0, 1)).unwrap();
        assert_eq!((alone.substep, alone.begun), (40, 5));
        assert_eq!(alone.particles.len(), 3);
        assert_eq!((alone.particles[2], alone.loads[2]), (parts[1].particles[0], parts[1].loads[0]));
        assert_eq!(alone.records.bytes(), [parts[0].records.bytes(), parts[1].records.bytes()].concat());
        assert_eq!(alone.states, [parts[1].states[0], parts[0].states[0]], "ascending");
        for rank in 0..3 {
            let pair_force = Saved::join("native", &written, &case(), (rank, 3)).unwrap();
            let (begun, states) = (parts.get(rank)).map_or((0, &[][..]), |part| (part.begun, &part.states));
            assert_eq!((pair_force.begun, &pair_force.states[..]), (begun, states));
            assert_eq!(
                (pair_force.particles, pair_force.records),
                (alone.particles.clone(), alone.records.clone())
            );
        }
    }

    #[test]
    fn a_part_that_was_cut_short_or_damaged_anywhere_is_refused_in_words() {
        let whole = bytes(&two());
        for length in 0..whole[1].len() {
            let cut = [whole[0].clone(), whole[1][..length].to_vec()];
            assert!(objection(&cut).contains("part 2 of 2"), "{length} bytes");
        }
        for at in 0..whole[0].len() {
            let mut damaged = whole.clone();
            damaged[0][at] ^= 0x10;
            let words = objection(&damaged);
            assert!(words.contains("part 1 of 2"), "byte {at}: {words}");
        }
        let longer = [[&whole[0][..], &[0; 8]].concat(), whole[1].clone()];
        assert!(objection(&longer).contains("damaged"));
    }

    #[test]
    fn a_head_that_counts_more_than_there_is_is_refused_even_with_the_right_checksum() {
        for count in [1, 3, u64::MAX, u64::MAX / 192 + 1] {
            let mut part = two()[0].write("native");
            part[32..40].copy_from_slice(&count.to_ne_bytes());
            let checksum = xxh3_64(&part[UNCHECKED..]);
            part[8..16].copy_from_slice(&checksum.to_ne_bytes());
            assert!(objection(&[part]).contains("not those its head counts"), "{count}");
        }
    }

    #[test]
    fn another_engine_version_or_case_and_missing_or_doubled_parts_are_named() {
        let whole = bytes(&two());
        let foreign = two().map(|part| part.write("ballistic")).to_vec();
        assert!(objection(&foreign).contains("is of the engine `ballistic`"), "{}", objection(&foreign));
        let mut later = whole.clone();
        later[1][7] = 9;
        assert!(objection(&later).contains("part 2 of 2 is of version 9, not 3"));
        assert!(objection(&[]).contains("no part of it"));
        assert!(objection(&whole[..1]).contains("holds 2 particles of 3: a part of it is missing"));
        let doubled = [&whole[..], &whole[..1]].concat();
        assert!(objection(&doubled).contains("particle 3 is in it twice"));
        assert!(
            after(|part| part.particles[1].id = 12)
                .contains("holds particle 12, but the next one would be 12")
        );
        assert!(
            after(|part| part.particles[1].template = 2)
                .contains("particle 9 is of kind 2, and this case has only 2")
        );
        assert!(after(|part| part.population.next_id = 13).contains("parts 1 and 2 are of other numbers"));
        assert!(after(|part| part.substep = 39).contains("after 39 sub-steps, but part 2 after 40"));
    }

    #[test]
    fn numbers_with_which_no_engine_continues_are_named_with_their_particle() {
        let of_9 = |name: &str| format!("part 1 of 2: the {name} particle 9 is not finite");
        assert!(after(|part| part.particles[1].velocity[2] = f64::NAN).contains(&of_9("velocity of")));
        assert!(
            after(|part| part.particles[1].contact_torque[0] = f64::INFINITY)
                .contains(&of_9("contact torque of"))
        );
        assert!(after(|part| part.loads[1].torque.y = f64::NAN).contains(&of_9("load on")));
        assert!(after(|part| part.particles[0].orientation = [0.0; 4]).contains("orientation of particle 3"));
        assert!(
            after(|part| part.particles[0].position[2] = 4.1)
                .contains("the position of particle 3 is not in the box")
        );
        assert!(
            after(|part| part.particles[0].position[0] = -1e-9)
                .contains("the position of particle 3 is not in the box")
        );
        let key = |second| ContactKey { first: 3, second, parts: [0; 2] };
        let with = |second| after(|part| part.records = remembered(key(second), [0.5, 7.0]));
        assert!(with(4).contains("contact of 3 with 4"));
        assert!(with(3).contains("contact of 3 with 3"));
        assert!(with(ContactState::of_wall(2)).contains("not both there"));
        assert!(after(|part| part.records.push(key(9), &[0.0; 2])).contains("3 with 9 is in it twice"));
        let third = ContactKey { parts: [2, 0], ..key(9) };
        let third = after(|part| part.records = remembered(third, [0.5, 7.0]));
        assert!(third.contains("the parts or the memory of the contact of 3 with 9"));
        let nan = after(|part| part.records = remembered(key(9), [0.5, f64::NAN]));
        assert!(nan.contains("memory of the contact of 3 with 9"));
        let other = after(|part| {
            part.records = Records::new(1);
            part.records.push(key(9), &[0.5]);
        });
        assert!(other.contains("remembers 1 numbers of each contact, and the law of this case 2"));
        assert!(after(|part| part.states[0].second = 4).contains("contact of 3 with 4"));
        assert!(
            after(|part| part.states[0].normal[1] = f64::NAN).contains("contact of 3 with 9 has a number")
        );
        assert!(after(|part| part.begun = u64::MAX).contains("that of no run"));
    }
}
