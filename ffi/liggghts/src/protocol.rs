//! Requests of the engine to LIGGGHTS, and the messages to and from a worker.
//!
//! A message is two parts, each a length (`u64`) and as many bytes: JSON, then plain memory, as both ends are the same
//! program. A request is a [`Request`] with its bytes, an answer an `Outcome<()>` with the bytes that were asked for.

use super::instance::Outcome;
use bytemuck::{Pod, Zeroable};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::PathBuf;

/// Memory reserved for a message before it arrives (bytes).
const RESERVED: u64 = 1 << 24;

/// The commands of the set-up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// Commands before there is a box.
    pub(super) before: Vec<String>,
    /// Commands that make the box; a restart file brings its own.
    pub(super) space: Vec<String>,
    /// Commands after it.
    pub(super) after: Vec<String>,
    /// Commands that need the particles.
    pub(super) last: Vec<String>,
    /// Commands of the user.
    pub(super) user: Vec<String>,
    /// Number of walls; their fixes are named by [`wall_fix`].
    pub(super) walls: usize,
    /// File for the log of the set-up.
    pub(super) log_file: Option<PathBuf>,
}

/// Name of the fix of a wall.
pub(crate) fn wall_fix(index: usize) -> String {
    format!("wall{index}")
}

/// A sphere as LIGGGHTS is given it, SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Atom {
    /// Id of the particle, for messages; LIGGGHTS counts from 1.
    pub(super) id: u64,
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    pub(super) radius: f64,
    pub(super) mass: f64,
    /// Moment of inertia of LIGGGHTS's sphere over that of the particle (-).
    pub(super) inertia_ratio: f64,
    /// Index of the material.
    pub(super) material: usize,
}

/// Force (N) and torque (N m) besides contacts, constant over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct AtomLoad {
    pub(super) force: [f64; 3],
    pub(super) torque: [f64; 3],
}

/// A sphere after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct State {
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    /// Force of all contacts, and of commands of the user, at this position (N).
    pub(super) contact_force: [f64; 3],
    /// Their torque (N m).
    pub(super) contact_torque: [f64; 3],
}

/// Force of one contact.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ContactForce {
    /// Index of the first sphere.
    pub(super) first: u64,
    /// Index of the second, or of the wall.
    pub(super) second: u64,
    /// 1 if `second` is a wall, else 0.
    pub(super) is_wall: u64,
    /// On the first, without the friction if the second is a sphere (N).
    pub(super) force: [f64; 3],
    /// The friction on the first (N).
    pub(super) friction: [f64; 3],
}

/// A request of the engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Request {
    /// Starts with these spheres, or resumes with them from the bytes that [`Save`](Self::Save) returned, if there are any.
    Open(Plan, Vec<Atom>),
    /// Advances by `step` (s), `substeps` times, under constant loads, the bytes of an [`AtomLoad`] each; returns a [`State`] each.
    Advance { step: f64, substeps: u32 },
    /// Returns the [`ContactForce`] of each contact.
    Contacts,
    /// Returns all that is needed to resume.
    Save,
}

/// Writes a message at once, so that the other end wakes up once.
pub(crate) fn write(to: &mut impl Write, head: &impl Serialize, bytes: &[u8]) -> io::Result<()> {
    let head = serde_json::to_vec(head)?;
    let mut message = Vec::with_capacity(16 + head.len() + bytes.len());
    for part in [&head, bytes] {
        message.extend_from_slice(&(part.len() as u64).to_le_bytes());
        message.extend_from_slice(part);
    }
    to.write_all(&message)?;
    to.flush()
}

/// Reads a message.
pub(crate) fn read<H: DeserializeOwned>(from: &mut impl Read) -> io::Result<(H, Vec<u8>)> {
    let head = serde_json::from_slice(&read_part(from)?)?;
    Ok((head, read_part(from)?))
}

fn read_part(from: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut length = [0; 8];
    from.read_exact(&mut length)?;
    let length = u64::from_le_bytes(length);
    // Memory is reserved as bytes come: a damaged length must not ask for more than there is.
    let mut bytes = Vec::with_capacity(length.min(RESERVED) as usize);
    from.by_ref().take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

/// Reads bytes as one message after another, in each direction; `true` if they are. For tests that hand in any bytes.
pub fn read_messages(bytes: &[u8]) -> bool {
    fn all<H: DeserializeOwned>(mut bytes: &[u8]) -> bool {
        while !bytes.is_empty() {
            // What fails may have taken the rest.
            if read::<H>(&mut bytes).is_err() {
                return false;
            }
        }
        true
    }
    all::<Request>(bytes) || all::<Outcome<()>>(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open() -> Request {
        let atom = Atom { position: [f64::MIN_POSITIVE, -0.0, 1.0 / 3.0], radius: 1e-300, ..Atom::default() };
        let plan = Plan {
            before: vec!["units si".to_owned()],
            user: vec!["fix a all viscous 1".to_owned()],
            walls: 3,
            log_file: Some("a b/c.log".into()),
            ..Plan::default()
        };
        Request::Open(plan, vec![atom, Atom { mass: f64::from_bits(1), id: u64::MAX, ..atom }])
    }

    #[test]
    fn messages_arrive_as_they_were_sent_to_the_bit() {
        let requests =
            [open(), Request::Advance { step: 0.1 + 0.2, substeps: 5 }, Request::Contacts, Request::Save];
        let answers = [Ok(()), Err("all: Illegal \"fix\" command\n".to_owned())];
        let mut wire = Vec::new();
        for request in &requests {
            write(&mut wire, request, &[1, 2, 3]).unwrap();
        }
        for answer in &answers {
            write(&mut wire, answer, &[]).unwrap();
        }
        let mut from = &wire[..];
        for request in requests {
            // Text tells 0 from -0.
            let (read, bytes) = read::<Request>(&mut from).unwrap();
            assert_eq!((format!("{read:?}"), &bytes[..]), (format!("{request:?}"), &[1, 2, 3][..]));
        }
        for answer in answers {
            assert_eq!(read::<Outcome<()>>(&mut from).unwrap(), (answer, Vec::new()));
        }
        assert!(from.is_empty());
    }

    #[test]
    fn a_message_that_is_cut_or_damaged_is_an_error_and_not_a_panic() {
        let mut wire = Vec::new();
        write(&mut wire, &open(), &[5; 9]).unwrap();
        for length in 0..wire.len() {
            assert!(read::<Request>(&mut &wire[..length]).is_err());
        }
        for at in 0..16 {
            let mut damaged = wire.clone();
            damaged[at] ^= 0xff;
            assert!(read::<Request>(&mut &damaged[..]).is_err(), "{at}");
        }
    }
}
