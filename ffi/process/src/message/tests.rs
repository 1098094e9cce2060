use super::*;
use crate::setup::{BoxSection, ShapeSection, SurfaceSection, TemplateSection, WallSection};
use proptest::prelude::*;

const IDS: [u64; 3] = [2, 5, 9];

fn case() -> SetUp {
    SetUp {
        domain: BoxSection { size: [1.0 / 3.0, f64::MIN_POSITIVE, 1e300], periodic: [true, false, true] },
        gravity: [0.0, -0.0, -9.81],
        templates: vec![
            TemplateSection {
                shape: ShapeSection::Sphere { radius: 0.1 + 0.2 },
                mass: 1e-9,
                inertia: [1e-300; 3],
                material: 1,
            },
            TemplateSection {
                shape: ShapeSection::Polyhedron { vertices: vec![[0.0; 3]; 4], faces: vec![vec![0, 1, 2]] },
                mass: 1.0,
                inertia: [1.0, 2.0, 3.0],
                material: 0,
            },
        ],
        contact: None,
        walls: vec![WallSection {
            name: "z-".to_owned(),
            material: 0,
            velocity: [1.0, 0.0, 0.0],
            surface: SurfaceSection::Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] },
        }],
        options: serde_json::Value::Null,
    }
}

fn states() -> Vec<State> {
    let state = |&id: &u64| State { id, orientation: [0.0, 0.0, 0.6, 0.8], ..State::default() };
    IDS.iter().map(state).collect()
}

fn of_states(states: &[State]) -> Outcome<Vec<State>> {
    let read = read_states(cast_slice(states), Some(&IDS), true)?;
    Ok(read.iter().map(|loaded| loaded.state).collect())
}

/// Of all particles, or of particle 2 and one beyond.
fn of_contacts(payload: &[u8], all: bool, overlaps: bool) -> Outcome<Vec<MeasuredContact>> {
    let known = |id| if all { IDS.contains(&id) } else { id == 2 };
    read_contacts(payload, known, all, 2, overlaps, 1e3)
}

fn contacts() -> Vec<MeasuredContact> {
    let pairs = [(2, 5), (5, 9), (2, ContactState::of_wall(1))];
    let overlap = MeasuredOverlap { volume: 0.5, centroid: [0.25; 3] };
    let contact = |(first, second)| ContactForce { first, second, force: [1.0; 3] };
    pairs.map(|pair| MeasuredContact { contact: contact(pair), overlap }).to_vec()
}

/// All messages of both directions.
fn wire() -> Vec<u8> {
    let body = Body { id: 7, template: 1, position: [1.0 / 3.0; 3], ..Body::default() };
    let load = AppliedLoad { id: 7, force: [0.1 + 0.2; 3], torque: [-0.0; 3] };
    let mut wire = Vec::new();
    for (kind, payload) in [
        (Kind::Hello, hello(&Hello { name: "x".to_owned(), ..Hello::default() }, 1)),
        (Kind::Hello, hello(&Hello { name: "y".to_owned(), ..Hello::default() }, 3)),
        (Kind::SetUp, set_up(&case(), &[body])),
        (Kind::Ready, Vec::new()),
        (Kind::Advance, advance(1e-5, 3, &[load])),
        (Kind::Save, Vec::new()),
        (Kind::Saved, vec![1, 2, 3]),
        (Kind::Contacts, Vec::new()),
        (Kind::Exchange, exchange(&[(2, vec![1, 2, 3]), (0, Vec::new())])),
        (Kind::ListParticles, Vec::new()),
        (Kind::Error, b"no".to_vec()),
    ] {
        write(&mut wire, kind, &payload).unwrap();
    }
    wire
}

#[test]
fn a_set_up_and_loads_arrive_as_they_were_sent_to_the_bit() {
    let bodies = [Body { id: 3, template: 1, position: [1.0 / 3.0, -0.0, 5e-324], ..Body::default() }];
    let (plan, read) = read_set_up(&set_up(&case(), &bodies)).unwrap();
    // Text tells 0 from -0.
    assert_eq!((format!("{plan:?}"), format!("{read:?}")), (format!("{:?}", case()), format!("{bodies:?}")));
    let loads = [AppliedLoad { id: 3, force: [f64::MIN_POSITIVE; 3], torque: [0.1; 3] }];
    let (step, substeps, read) = read_advance(&advance(0.1 + 0.2, 7, &loads)).unwrap();
    assert_eq!((step.to_bits(), substeps, &read[..]), ((0.1_f64 + 0.2).to_bits(), 7, &loads[..]));
}

#[test]
fn states_come_in_any_order_and_contacts_name_walls() {
    let mut reversed = states();
    reversed.reverse();
    assert_eq!(of_states(&reversed), Ok(reversed));
    assert_eq!(of_contacts(cast_slice(&contacts()), true, true), Ok(contacts()));
    let bare: Vec<ContactForce> = contacts().iter().map(|measured| measured.contact).collect();
    let read = of_contacts(cast_slice(&bare), true, false).unwrap();
    let forces = read.iter().map(|measured| measured.contact);
    assert!(forces.eq(bare) && read.iter().all(|measured| measured.overlap == MeasuredOverlap::default()));
}

#[test]
fn a_state_or_contact_that_cannot_be_is_refused_with_its_field() {
    let state = |change: &dyn Fn(&mut State)| {
        let mut states = states();
        change(&mut states[1]);
        of_states(&states).unwrap_err()
    };
    for (text, words) in [
        (state(&|s| s.id = 4), "field `id` of record 1: there is no particle 4"),
        (state(&|s| s.id = 2), "particle 2 for the second time"),
        (state(&|s| s.position[2] = f64::INFINITY), "field `position` of particle 5: inf"),
        (state(&|s| s.contact_torque[0] = f64::NAN), "field `contact_torque` of particle 5: NaN"),
        (state(&|s| s.orientation[3] = 0.9), "field `orientation` of particle 5"),
    ] {
        assert!(text.contains(words) && text.contains("`states`"), "{text}");
    }
    let measured = |change: &dyn Fn(&mut MeasuredContact)| {
        let mut contacts = contacts();
        change(&mut contacts[1]);
        of_contacts(cast_slice(&contacts), true, true).unwrap_err()
    };
    let contact = |change: &dyn Fn(&mut ContactForce)| measured(&|m| change(&mut m.contact));
    for (text, words) in [
        (contact(&|c| c.first = 3), "field `first` of record 1: there is no particle 3"),
        (contact(&|c| c.second = ContactState::of_wall(2)), "field `second` of record 1"),
        (contact(&|c| c.second = 5), "5 is not above `first`, 5"),
        (contact(&|c| c.force[1] = f64::NAN), "field `force` of record 1"),
        (measured(&|m| m.overlap.volume = -1.0), "field `volume` of record 1: -1 is no volume"),
        (measured(&|m| m.overlap.volume = f64::NAN), "field `volume` of record 1: NaN is no volume"),
        (measured(&|m| m.overlap.centroid[2] = f64::INFINITY), "field `centroid` of record 1"),
        (contact(&|c| (c.first, c.second) = (2, 5)), "2 with 5 for the second time"),
    ] {
        assert!(text.contains("`contacts`") && text.contains(words), "{text}");
    }
}

#[test]
fn one_of_several_processes_lists_contacts_of_which_it_has_one_particle() {
    let mut contacts = contacts();
    assert!(of_contacts(cast_slice(&contacts), false, true).unwrap_err().contains("no particle 5"));
    contacts.remove(1);
    assert_eq!(of_contacts(cast_slice(&contacts), false, true), Ok(contacts));
}

#[test]
fn messages_between_processes_arrive_as_they_were_sent_and_wrong_ones_are_refused() {
    let messages = vec![(2, vec![7; 5]), (0, Vec::new()), (1, vec![1; 16])];
    let payload = exchange(&messages);
    assert_eq!(read_exchange(&payload, 3), Ok(messages.clone()));
    assert_eq!(read_exchange(&[], 3), Ok(Vec::new()));
    let twice = exchange(&[messages[0].clone(), messages[0].clone()]);
    for (payload, parts, words) in [
        (&payload[..], 2, "field `part` of record 0: 2 is none of 2"),
        (&payload[..8], 3, "its last record is cut"),
        (&payload[..20], 3, "field `length` of record 0: 5 bytes are not there"),
        (&twice, 3, "record 1: 2 is none of 3, or has a message already"),
    ] {
        let error = read_exchange(payload, parts).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_message_that_is_cut_or_of_another_version_is_an_error_and_not_a_panic() {
    let wire = wire();
    assert!(read_messages(&wire));
    let mut whole = Vec::new();
    let mut rest = &wire[..];
    while !rest.is_empty() {
        read(&mut rest, LARGE).unwrap();
        whole.push(wire.len() - rest.len());
    }
    for length in 1..wire.len() {
        assert_eq!(read_messages(&wire[..length]), whole.contains(&length), "{length}");
    }
    let [one, several] = [1, 3].map(|parts| hello(&Hello::default(), parts));
    assert!(read_hello(&several, 1).unwrap_err().contains("field `version` is 2, and this turbid has 1"));
    let error = read_hello(&one, 3).unwrap_err();
    assert!(
        error.contains("field `version` is 1") && error.contains("3 processes need version 2"),
        "{error}"
    );
    let long = [&1_u32.to_le_bytes()[..], &[0; 4], &u64::MAX.to_le_bytes()].concat();
    let error = read(&mut &long[..], u64::MAX).unwrap_err().to_string();
    assert!(error.contains("`hello`") && error.contains("field `length`"), "{error}");
    // More than there is, and no more memory than has come.
    let missing = [&9_u32.to_le_bytes()[..], &[0; 4], &(1_u64 << 39).to_le_bytes(), &[1; 9]].concat();
    assert_eq!(read(&mut &missing[..], u64::MAX).unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
}

proptest! {
    // More with PROPTEST_CASES.
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(100_000)))]

    #[test]
    fn any_bytes_behind_any_head_are_read_or_refused(
        kind in 0..16_u32,
        length in prop_oneof![0..400_u64, any::<u64>()],
        bytes in proptest::collection::vec(any::<u8>(), 0..400),
        greets: bool,
    ) {
        let hello = if greets { hello(&0, 1)[..HEAD].to_vec() } else { Vec::new() };
        let length = if length < 400 { (hello.len() + bytes.len()) as u64 } else { length };
        let head = [&kind.to_le_bytes()[..], &[0; 4], &length.to_le_bytes()].concat();
        read_messages(&[&head[..], &hello, &bytes].concat());
        let _ = read_states(&bytes, Some(&IDS), true).and(of_contacts(&bytes, greets, true));
        let _ = read_exchange(&bytes, 3).map(drop).and(read_states(&bytes, None, true).map(drop));
    }

    #[test]
    fn a_changed_byte_is_read_or_refused(at in 0..wire().len(), value: u8) {
        let mut wire = wire();
        wire[at] = value;
        read_messages(&wire);
    }
}
