//! Saved states that are whole, damaged, incomplete, or of another case.

use super::*;
use crate::comm::on_threads;
use crate::domain::{Decomposition, Domain};
use crate::math::Vec3;

const BOX: Domain = Domain { faces: Domain::faces([true, true, false]), cells: [32; 3], dx: 0.125 };

/// The outcome of [`Case::load`] of these parts on one of the ranks.
fn load(comm: &Comm, parts: &[Vec<u8>]) -> std::result::Result<Loaded, String> {
    let near = GhostLayer::new(Decomposition::new(BOX, comm.size()).unwrap(), comm.rank(), &[1.0; 2]);
    let case = Case { templates: 2, most_parts: 2, walls: vec![1; 2], memory: 2, near: &near };
    case.load("native", comm, &SavedParts::divided(comm, parts))
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

/// Error of these parts, the same on each of 1 to 3 ranks.
fn objection(parts: &[Vec<u8>]) -> String {
    let alone = load(&Comm::Solo, parts).unwrap_err();
    for ranks in 2..=3 {
        for said in on_threads(ranks, |comm| load(&comm, parts).unwrap_err()) {
            assert_eq!(said, alone, "{ranks} ranks");
        }
    }
    alone
}

/// The same after a change of the first part.
fn after(change: impl Fn(&mut Saved)) -> String {
    let mut parts = two();
    change(&mut parts[0]);
    objection(&bytes(&parts))
}

#[test]
fn all_parts_together_are_the_run_and_each_rank_gets_its_own_parts_and_the_memories_that_it_evaluates() {
    let (parts, written) = (two(), bytes(&two()));
    let Loaded { state: alone, own } = load(&Comm::Solo, &written).unwrap();
    assert_eq!((alone.substep, alone.begun), (40, 5));
    assert_eq!(alone.particles.len(), 3);
    assert_eq!((alone.particles[2], alone.loads[2]), (parts[1].particles[0], parts[1].loads[0]));
    assert_eq!(alone.records.bytes(), [parts[0].records.bytes(), parts[1].records.bytes()].concat());
    assert_eq!(alone.states, [parts[1].states[0], parts[0].states[0]], "ascending");
    assert_eq!(own, [(0, vec![1, 2, 3])]);
    for ranks in 2..=8 {
        let all = on_threads(ranks, |comm| load(&comm, &written).unwrap().state);
        for (rank, saved) in all.iter().enumerate() {
            let part = parts.get(rank).cloned().unwrap_or_default();
            assert_eq!((saved.substep, saved.population), (40, alone.population));
            assert_eq!((saved.begun, &saved.states), (part.begun, &part.states));
            assert_eq!((&saved.particles, &saved.loads), (&part.particles, &part.loads));
        }
        let owner = |x: f64| Decomposition::new(BOX, ranks).unwrap().owner(Vec3::repeat(x));
        let mut keys: Vec<(usize, u64)> = Vec::new();
        for (rank, saved) in all.iter().enumerate() {
            keys.extend(saved.records.iter().map(|(key, _)| (rank, key.first)));
        }
        keys.sort_unstable_by_key(|(_, first)| *first);
        let [(evaluating, 3), (of_wall, 5)] = keys[..] else { panic!("each memory once: {keys:?}") };
        assert_eq!(of_wall, owner(1.25));
        assert!([owner(0.75), owner(2.25)].contains(&evaluating), "{ranks} ranks");
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
        after(|part| part.particles[1].id = 12).contains("holds particle 12, but the next one would be 12")
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
    assert!(after(|part| part.states[0].normal[1] = f64::NAN).contains("contact of 3 with 9 has a number"));
    assert!(after(|part| part.begun = u64::MAX).contains("that of no run"));
}
