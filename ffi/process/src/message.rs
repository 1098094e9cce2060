//! Frames and payloads of the engine protocol, `docs/engine-protocol.md`: numbers are little-endian, and whatever comes from the
//! other end is checked. A fault names the message and the field.

use crate::setup::{Hello, SetUp};
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_collect_to_vec, pod_read_unaligned};
use serde::Serialize;
use std::collections::HashSet;
use std::io::{self, Read, Write};
use turbid_core::dem::ContactState;
use turbid_core::memory::trying;

const _: () = assert!(cfg!(target_endian = "little"), "records are sent as they lie in memory");

/// Version of the protocol with an engine of one process.
pub const VERSION: u32 = 1;
/// Version with an engine of several processes.
pub const VERSION_OF_PARTS: u32 = 2;
/// Begins every hello.
pub(crate) const MAGIC: [u8; 8] = *b"turbidEP";
/// Bytes before the payload of a message.
const HEAD: usize = 16;
/// Bytes that are reserved before the first of a payload has come; then as many as there are.
const RESERVED: usize = 1 << 20;
/// Most bytes of a text.
const TEXT: u64 = 1 << 16;
/// Most bytes of what grows with the case.
const LARGE: u64 = 1 << 40;
/// Largest deviation of the length of an orientation from one.
const UNIT: f64 = 1e-6;

/// A fault in words, or what the other end says.
pub type Outcome<T> = Result<T, String>;

/// Kinds of messages; `docs/engine-protocol.md` has a section for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Kind {
    Hello = 1,
    SetUp,
    Ready,
    Advance,
    States,
    ListContacts,
    Contacts,
    Save,
    Saved,
    Restore,
    Goodbye,
    Error,
    Exchange,
    ListParticles,
}

impl Kind {
    const ALL: [(Self, &'static str, u64); 14] = [
        (Self::Hello, "hello", TEXT),
        (Self::SetUp, "set-up", LARGE),
        (Self::Ready, "ready", 0),
        (Self::Advance, "advance", LARGE),
        (Self::States, "states", LARGE),
        (Self::ListContacts, "list contacts", 0),
        (Self::Contacts, "contacts", LARGE),
        (Self::Save, "save", 0),
        (Self::Saved, "saved", LARGE),
        (Self::Restore, "restore", LARGE),
        (Self::Goodbye, "goodbye", 0),
        (Self::Error, "error", TEXT),
        (Self::Exchange, "exchange", LARGE),
        (Self::ListParticles, "list particles", 0),
    ];

    /// Its name in the documentation and in messages to users.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize - 1].1
    }

    /// The kind that answers this one; a message of an exchange only continues what was asked.
    pub(crate) fn answer(self) -> Self {
        match self {
            Self::Advance | Self::ListParticles => Self::States,
            Self::ListContacts => Self::Contacts,
            Self::Save => Self::Saved,
            Self::Hello => Self::Hello,
            _ => Self::Ready,
        }
    }
}

/// A particle at set-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Body {
    /// Id, above those of all records before.
    pub id: u64,
    /// Index of the template.
    pub template: u64,
    /// Centre of mass (m), wrapped into the box.
    pub position: [f64; 3],
    /// Unit quaternion `(i, j, k, w)`, from the body frame to the world frame.
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity (1/s), world frame.
    pub angular_velocity: [f64; 3],
}

/// Force and torque on a particle besides contacts and weight, constant over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AppliedLoad {
    /// Id of the particle.
    pub id: u64,
    /// Force on the centre of mass (N).
    pub force: [f64; 3],
    /// Torque about the centre of mass (N m), world frame.
    pub torque: [f64; 3],
}

/// A particle after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct State {
    /// Id of the particle.
    pub id: u64,
    /// Centre of mass (m), wrapped or not.
    pub position: [f64; 3],
    /// As in [`Body`]; without meaning if the engine has no orientations.
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity (1/s), world frame.
    pub angular_velocity: [f64; 3],
    /// Force of all contacts at the last sub-step (N).
    pub contact_force: [f64; 3],
    /// Their torque about the centre of mass (N m), world frame.
    pub contact_torque: [f64; 3],
}

/// A particle that one of several processes of an engine has, with the load on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LoadedState {
    /// The particle.
    pub state: State,
    /// Force of the last [`AppliedLoad`] (N).
    pub force: [f64; 3],
    /// Its torque (N m).
    pub torque: [f64; 3],
}

/// A contact at the last sub-step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactForce {
    /// Id of the first particle.
    pub first: u64,
    /// Id of the second, above that of the first, or [`ContactState::of_wall`] of the index of a wall.
    pub second: u64,
    /// Force on the first (N), friction included.
    pub force: [f64; 3],
}

/// An overlap that the engine has measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeasuredOverlap {
    /// Volume (m^3); 0 if the engine has not measured this one.
    pub volume: f64,
    /// Centroid (m).
    pub centroid: [f64; 3],
}

/// A contact with its overlap, as engines send it that measure overlaps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeasuredContact {
    /// The contact.
    pub contact: ContactForce,
    /// Its overlap.
    pub overlap: MeasuredOverlap,
}

/// Writes a message at once, so that the other end wakes up once.
pub(crate) fn write(to: &mut impl Write, kind: Kind, payload: &[u8]) -> io::Result<()> {
    let head = [(kind as u32).to_le_bytes(), [0; 4]].concat();
    to.write_all(&[&head, &(payload.len() as u64).to_le_bytes()[..], payload].concat())?;
    to.flush()
}

/// Reads a message of at most `most` bytes besides the limit of its kind. What breaks the protocol is
/// [`io::ErrorKind::InvalidData`].
pub(crate) fn read(from: &mut impl Read, most: u64) -> io::Result<(Kind, Vec<u8>)> {
    let broken = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
    let mut head = [0; HEAD];
    from.read_exact(&mut head)?;
    let [kind, zero] = [0, 4].map(|at| pod_read_unaligned::<u32>(&head[at..at + 4]));
    let length: u64 = pod_read_unaligned(&head[8..]);
    let known = Kind::ALL.into_iter().find(|(known, ..)| *known as u32 == kind);
    let Some((kind, name, limit)) = known else {
        return Err(broken(format!("field `kind` of a message is {kind}, which is none")));
    };
    if zero != 0 {
        return Err(broken(format!("message `{name}`: field `reserved` is {zero}, not 0")));
    }
    let most = if kind == Kind::Error { limit } else { limit.min(most) };
    if length > most {
        return Err(broken(format!(
            "message `{name}`: field `length` is {length}, above the {most} that it may be"
        )));
    }
    let (mut payload, length) = (Vec::new(), length as usize);
    while payload.len() < length {
        // Memory is reserved as bytes come: a wrong length must not ask for more than there is.
        let (start, more) = (payload.len(), payload.len().max(RESERVED).min(length - payload.len()));
        if trying(|| payload.try_reserve_exact(more)).is_err() {
            return Err(broken(format!(
                "message `{name}`: no memory for the {length} bytes of field `length`"
            )));
        }
        payload.resize(start + more, 0);
        from.read_exact(&mut payload[start..])?;
    }
    Ok((kind, payload))
}

/// The version with an engine of this number of processes.
fn version_of(parts: usize) -> u32 {
    if parts > 1 { VERSION_OF_PARTS } else { VERSION }
}

/// Payload of a hello, to or from an engine of this number of processes.
pub(crate) fn hello(words: &impl Serialize, parts: usize) -> Vec<u8> {
    let words = serde_json::to_vec(words).expect("plain data");
    [&MAGIC[..], &version_of(parts).to_le_bytes(), &[0; 4], &words].concat()
}

/// Properties that an engine of this number of processes states.
pub(crate) fn read_hello(payload: &[u8], parts: usize) -> Outcome<Hello> {
    let fault = |text: String| Err(format!("message `hello`: {text}"));
    let Some((head, words)) = payload.split_first_chunk::<HEAD>() else {
        return fault(format!("has {} bytes, of at least {HEAD}", payload.len()));
    };
    if head[..8] != MAGIC {
        return fault("field `magic` is not that of this protocol".to_owned());
    }
    let version: u32 = pod_read_unaligned(&head[8..12]);
    let needed = version_of(parts);
    if version != needed {
        let why =
            if parts > 1 { format!(": {parts} processes need version {needed}") } else { String::new() };
        return fault(format!("field `version` is {version}, and this turbid has {needed}{why}"));
    }
    serde_json::from_slice(words).or_else(|error| fault(format!("its JSON: {error}")))
}

/// Payload of a set-up: JSON, filled up with blanks to whole words, and the particles.
pub(crate) fn set_up(plan: &SetUp, bodies: &[Body]) -> Vec<u8> {
    let mut words = serde_json::to_vec(plan).expect("plain data");
    words.resize(words.len().next_multiple_of(8), b' ');
    [&(words.len() as u64).to_le_bytes(), &words[..], cast_slice(bodies)].concat()
}

/// Contents of a set-up: the other end of [`set_up`].
pub(crate) fn read_set_up(payload: &[u8]) -> Outcome<(SetUp, Vec<Body>)> {
    let fault = |text: String| format!("message `set-up`: {text}");
    let (length, rest) = payload.split_first_chunk::<8>().ok_or_else(|| fault("has no length".to_owned()))?;
    let cut =
        usize::try_from(u64::from_le_bytes(*length)).ok().and_then(|length| rest.split_at_checked(length));
    let (words, bodies) = cut.ok_or_else(|| fault("its JSON is cut".to_owned()))?;
    let plan: SetUp = serde_json::from_slice(words).map_err(|error| fault(format!("its JSON: {error}")))?;
    let bodies: Vec<Body> = records(bodies, Kind::SetUp)?;
    if !bodies.iter().all(|body| (body.template as usize) < plan.templates.len()) {
        return Err(fault("field `template` of a particle names none".to_owned()));
    }
    Ok((plan, bodies))
}

/// Payload of an advance.
pub(crate) fn advance(step: f64, substeps: u32, loads: &[AppliedLoad]) -> Vec<u8> {
    [bytes_of(&step), bytes_of(&u64::from(substeps)), cast_slice(loads)].concat()
}

/// Sub-step (s), number of sub-steps and loads.
pub(crate) fn read_advance(payload: &[u8]) -> Outcome<(f64, u32, Vec<AppliedLoad>)> {
    let (head, loads) = payload.split_first_chunk::<HEAD>().ok_or("message `advance`: is cut")?;
    let (step, substeps) = (pod_read_unaligned(&head[..8]), pod_read_unaligned::<u64>(&head[8..]));
    let substeps = substeps.try_into().map_err(|_| "message `advance`: field `substeps` is too large")?;
    Ok((step, substeps, records(loads, Kind::Advance)?))
}

/// The records of a payload.
fn records<T: Pod>(payload: &[u8], kind: Kind) -> Outcome<Vec<T>> {
    let (bytes, size) = (payload.len(), size_of::<T>());
    if !bytes.is_multiple_of(size) {
        return Err(format!(
            "message `{}`: {bytes} bytes, not a multiple of the {size} of a record",
            kind.name()
        ));
    }
    Ok(pod_collect_to_vec(payload))
}

/// The particles of an engine of one process, whose ids are among `ids`, ascending; or of one of several, with their loads.
pub(crate) fn read_states(
    payload: &[u8],
    ids: Option<&[u64]>,
    orientations: bool,
) -> Outcome<Vec<LoadedState>> {
    let found: Vec<LoadedState> = if ids.is_some() {
        let bare = |state| LoadedState { state, ..LoadedState::default() };
        records(payload, Kind::States)?.into_iter().map(bare).collect()
    } else {
        records(payload, Kind::States)?
    };
    check_states(&found, ids, orientations)?;
    Ok(found)
}

/// Refuses states that cannot be: as those of [`read_states`].
pub(crate) fn check_states(found: &[LoadedState], ids: Option<&[u64]>, orientations: bool) -> Outcome<()> {
    for (n, LoadedState { state, force, torque }) in found.iter().enumerate() {
        let fault = |text: String| Err(format!("message `states`: {text}"));
        if ids.is_some_and(|ids| ids.binary_search(&state.id).is_err()) {
            return fault(format!("field `id` of record {n}: there is no particle {}", state.id));
        }
        let fields = [
            ("position", &state.position[..]),
            ("orientation", if orientations { &state.orientation } else { &[] }),
            ("velocity", &state.velocity),
            ("angular_velocity", &state.angular_velocity),
            ("contact_force", &state.contact_force),
            ("contact_torque", &state.contact_torque),
            ("force", force),
            ("torque", torque),
        ];
        for (field, values) in fields {
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return fault(format!("field `{field}` of particle {}: {value} is not finite", state.id));
            }
        }
        let norm = state.orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        if orientations && (norm - 1.0).abs() > UNIT {
            return fault(format!(
                "field `orientation` of particle {}: has the length {norm}, not 1",
                state.id
            ));
        }
    }
    let mut order: Vec<(u64, usize)> =
        found.iter().enumerate().map(|(n, loaded)| (loaded.state.id, n)).collect();
    order.sort_unstable();
    match order.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(&[_, (id, n)]) => {
            Err(format!("message `states`: field `id` of record {n}: particle {id} for the second time"))
        }
        _ => Ok(()),
    }
}

/// Messages between the processes of an engine: each has the index of the process that it goes to or comes from, its length (both
/// u64), and bytes, filled up to whole words.
pub(crate) fn exchange(messages: &[(usize, Vec<u8>)]) -> Vec<u8> {
    let mut payload = Vec::new();
    for (part, bytes) in messages {
        payload.extend([*part as u64, bytes.len() as u64].map(u64::to_le_bytes).concat());
        payload.extend(bytes);
        payload.resize(payload.len().next_multiple_of(8), 0);
    }
    payload
}

/// The other end of [`exchange`], from one of `parts` processes: at most one message to each.
pub(crate) fn read_exchange(mut payload: &[u8], parts: usize) -> Outcome<Vec<(usize, Vec<u8>)>> {
    let fault = |text: String| Err(format!("message `exchange`: {text}"));
    let mut messages: Vec<(usize, Vec<u8>)> = Vec::new();
    while !payload.is_empty() {
        let Some((head, rest)) = payload.split_first_chunk::<HEAD>() else {
            return fault("its last record is cut".to_owned());
        };
        let [part, length] = [0, 8].map(|at| pod_read_unaligned::<u64>(&head[at..at + 8]));
        let n = messages.len();
        if part >= parts as u64 || messages.iter().any(|(other, _)| *other as u64 == part) {
            return fault(format!(
                "field `part` of record {n}: {part} is none of {parts}, or has a message already"
            ));
        }
        let padded = usize::try_from(length).ok().and_then(|length| length.checked_next_multiple_of(8));
        let Some((bytes, rest)) = padded.and_then(|padded| rest.split_at_checked(padded)) else {
            return fault(format!("field `length` of record {n}: {length} bytes are not there"));
        };
        messages.push((part as usize, bytes[..length as usize].to_vec()));
        payload = rest;
    }
    Ok(messages)
}

/// The contacts of particles that are `known`, one of each at least, and this number of walls; with or without `overlaps`, with forces of at
/// most `strongest` (N).
pub(crate) fn read_contacts(
    payload: &[u8],
    known: impl Fn(u64) -> bool,
    all: bool,
    walls: usize,
    overlaps: bool,
    strongest: f64,
) -> Outcome<Vec<MeasuredContact>> {
    let contacts: Vec<MeasuredContact> = if overlaps {
        records(payload, Kind::Contacts)?
    } else {
        let bare = |contact| MeasuredContact { contact, overlap: MeasuredOverlap::default() };
        records(payload, Kind::Contacts)?.into_iter().map(bare).collect()
    };
    let mut pairs = HashSet::new();
    for (n, contact) in contacts.iter().enumerate() {
        let &MeasuredContact { contact: ContactForce { first, second, force }, overlap } = contact;
        let fault = |text: String| Err(format!("message `contacts`: {text}"));
        let listed = |[x, y, z]: [f64; 3]| format!("[{x}, {y}, {z}]");
        let wall = ContactState::wall_of(second);
        // Of several processes one has only one of both, perhaps.
        let other = wall.is_none() && !all;
        if !(known(first) || other && known(second)) {
            return fault(format!("field `first` of record {n}: there is no particle {first}"));
        }
        if !wall.map_or_else(|| !all || known(second), |wall| wall < walls) {
            return fault(format!("field `second` of record {n}: there is no particle or wall {second}"));
        }
        if second <= first {
            return fault(format!("field `second` of record {n}: {second} is not above `first`, {first}"));
        }
        if force.iter().any(|value| !value.is_finite()) {
            return fault(format!("field `force` of record {n}: {} is not finite", listed(force)));
        }
        let largest = force.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if largest > strongest {
            return fault(format!("field `force` of record {n}: {largest:e} is more than {strongest:.3e} N"));
        }
        if !(overlap.volume >= 0.0 && overlap.volume.is_finite()) {
            return fault(format!("field `volume` of record {n}: {} is no volume", overlap.volume));
        }
        if overlap.centroid.iter().any(|value| !value.is_finite()) {
            return fault(format!(
                "field `centroid` of record {n}: {} is not finite",
                listed(overlap.centroid)
            ));
        }
        if !pairs.insert((first, second)) {
            return fault(format!("record {n}: the contact of {first} with {second} for the second time"));
        }
    }
    Ok(contacts)
}

/// Reads bytes as one message after another, and each as what its kind says; `true` if they are such. For tests that hand in any
/// bytes.
pub fn read_messages(mut bytes: &[u8]) -> bool {
    while !bytes.is_empty() {
        let Ok((kind, payload)) = read(&mut bytes, LARGE) else {
            return false;
        };
        assert!(payload.capacity() <= payload.len());
        let ids: Vec<u64> = (0..(payload.len() / size_of::<State>()) as u64).collect();
        let sound = match kind {
            Kind::Hello => [1, 2].iter().any(|&parts| read_hello(&payload, parts).is_ok()),
            Kind::SetUp => read_set_up(&payload).is_ok(),
            Kind::Advance => read_advance(&payload).is_ok(),
            Kind::States => {
                [None, Some(&ids[..])].iter().any(|ids| read_states(&payload, *ids, true).is_ok())
            }
            Kind::Exchange => read_exchange(&payload, 4).is_ok(),
            Kind::Contacts => [false, true]
                .iter()
                .any(|&overlaps| read_contacts(&payload, |id| id < 3, true, 2, overlaps, f64::MAX).is_ok()),
            _ => true,
        };
        if !sound {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests;
