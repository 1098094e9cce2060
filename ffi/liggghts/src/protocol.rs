//! What the engine asks of LIGGGHTS and what it answers, and both as bytes for the pipe to a worker.
//!
//! A message is two parts, each a length (`u64`) and as many bytes: its kind with all that is not an array, as JSON, and
//! its array. Both ends are the same program, so the arrays are plain memory.

use bytemuck::{Pod, Zeroable};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::PathBuf;

/// Room that is made for a message before it comes (bytes).
const ROOM: u64 = 1 << 24;

/// What LIGGGHTS is told at the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// Commands before there is a box.
    pub(super) before: Vec<String>,
    /// Commands that make the box; what was saved brings its own.
    pub(super) space: Vec<String>,
    /// Commands after it.
    pub(super) after: Vec<String>,
    /// Commands that need the particles.
    pub(super) last: Vec<String>,
    /// Commands of the user.
    pub(super) user: Vec<String>,
    /// Number of walls; their fixes are named by [`wall_fix`].
    pub(super) walls: usize,
    /// File for what LIGGGHTS says during the set-up.
    pub(super) log_file: Option<PathBuf>,
}

/// Name of the fix of a wall.
pub(crate) fn wall_fix(index: usize) -> String {
    format!("wall{index}")
}

/// A sphere as LIGGGHTS is given it, SI units.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Atom {
    /// Id of the particle, for messages; LIGGGHTS counts from 1.
    pub(super) id: u64,
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    pub(super) radius: f64,
    pub(super) mass: f64,
    /// Moment of inertia that LIGGGHTS takes the sphere to have over the one it has (-).
    pub(super) inertia_ratio: f64,
    /// Index of the material.
    pub(super) material: u64,
}

/// Force (N) and torque (N m) besides contacts, constant over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Push {
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
    /// Of all contacts, and of what commands of the user have added, at this position (N).
    pub(super) contact_force: [f64; 3],
    /// The same (N m).
    pub(super) contact_torque: [f64; 3],
}

/// Force of one contact.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Touch {
    /// Index of the first sphere.
    pub(super) first: u64,
    /// Index of the second, or of the wall.
    pub(super) second: u64,
    /// Whether `second` is a wall.
    pub(super) is_wall: u64,
    /// On the first, without the friction if the second is a sphere (N).
    pub(super) force: [f64; 3],
    /// The friction on the first (N).
    pub(super) friction: [f64; 3],
}

/// What the engine asks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Request {
    /// Begin with these spheres.
    Open(Plan, Vec<Atom>),
    /// Go on with these spheres where [`Save`](Self::Save) ended.
    Resume(Plan, Vec<Atom>, Vec<u8>),
    /// Advance by `step` (s), `substeps` times, under constant loads; answered by [`Reply::States`].
    Advance { step: f64, substeps: u32, loads: Vec<Push> },
    /// The forces of all contacts; answered by [`Reply::Touches`].
    Touches,
    /// All that is needed to go on; answered by [`Reply::Saved`].
    Save,
}

/// What LIGGGHTS answers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Reply {
    Done,
    States(Vec<State>),
    Touches(Vec<Touch>),
    Saved(Vec<u8>),
    /// In LIGGGHTS's own words, if it had any.
    Failed(String),
}

#[derive(Serialize, Deserialize)]
enum RequestHead {
    Open(Plan),
    /// Bytes of what was saved, at the end of the array.
    Resume(Plan, usize),
    /// Bits of the step.
    Advance(u64, u32),
    Touches,
    Save,
}

#[derive(Serialize, Deserialize)]
enum ReplyHead {
    Done,
    States,
    Touches,
    Saved,
    Failed(String),
}

impl Request {
    pub(super) fn write(&self, to: &mut impl Write) -> io::Result<()> {
        match self {
            Self::Open(plan, atoms) => {
                write_message(to, &RequestHead::Open(plan.clone()), &[bytemuck::cast_slice(atoms)])
            }
            Self::Resume(plan, atoms, saved) => {
                let head = RequestHead::Resume(plan.clone(), saved.len());
                write_message(to, &head, &[bytemuck::cast_slice(atoms), saved])
            }
            Self::Advance { step, substeps, loads } => {
                let head = RequestHead::Advance(step.to_bits(), *substeps);
                write_message(to, &head, &[bytemuck::cast_slice(loads)])
            }
            Self::Touches => write_message(to, &RequestHead::Touches, &[]),
            Self::Save => write_message(to, &RequestHead::Save, &[]),
        }
    }

    pub(super) fn read(from: &mut impl Read) -> io::Result<Self> {
        let (head, mut bytes) = read_message(from)?;
        Ok(match head {
            RequestHead::Open(plan) => Self::Open(plan, values(&bytes)?),
            RequestHead::Resume(plan, saved) => {
                let at = bytes.len().checked_sub(saved).ok_or_else(malformed)?;
                let saved = bytes.split_off(at);
                Self::Resume(plan, values(&bytes)?, saved)
            }
            RequestHead::Advance(step, substeps) => {
                Self::Advance { step: f64::from_bits(step), substeps, loads: values(&bytes)? }
            }
            RequestHead::Touches => Self::Touches,
            RequestHead::Save => Self::Save,
        })
    }
}

impl Reply {
    pub(super) fn write(&self, to: &mut impl Write) -> io::Result<()> {
        match self {
            Self::Done => write_message(to, &ReplyHead::Done, &[]),
            Self::States(states) => write_message(to, &ReplyHead::States, &[bytemuck::cast_slice(states)]),
            Self::Touches(touches) => {
                write_message(to, &ReplyHead::Touches, &[bytemuck::cast_slice(touches)])
            }
            Self::Saved(bytes) => write_message(to, &ReplyHead::Saved, &[bytes]),
            Self::Failed(text) => write_message(to, &ReplyHead::Failed(text.clone()), &[]),
        }
    }

    pub(super) fn read(from: &mut impl Read) -> io::Result<Self> {
        let (head, bytes) = read_message(from)?;
        Ok(match head {
            ReplyHead::Done => Self::Done,
            ReplyHead::States => Self::States(values(&bytes)?),
            ReplyHead::Touches => Self::Touches(values(&bytes)?),
            ReplyHead::Saved => Self::Saved(bytes),
            ReplyHead::Failed(text) => Self::Failed(text),
        })
    }
}

/// Reads bytes as one message after another, in each direction; `true` if they are. For tests that hand in any bytes.
pub fn read_messages(bytes: &[u8]) -> bool {
    let all = |read: fn(&mut &[u8]) -> bool| {
        let mut left = bytes;
        while !left.is_empty() {
            // What fails may have taken the rest.
            if !read(&mut left) {
                return false;
            }
        }
        true
    };
    all(|left| Request::read(left).is_ok()) || all(|left| Reply::read(left).is_ok())
}

fn malformed() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "a message that makes no sense")
}

fn values<T: Pod>(bytes: &[u8]) -> io::Result<Vec<T>> {
    if bytes.len().is_multiple_of(size_of::<T>()) {
        Ok(bytemuck::pod_collect_to_vec(bytes))
    } else {
        Err(malformed())
    }
}

/// In one write, so that the other end wakes up once.
fn write_message(to: &mut impl Write, head: &impl Serialize, parts: &[&[u8]]) -> io::Result<()> {
    let head = serde_json::to_vec(head)?;
    let length: usize = parts.iter().map(|part| part.len()).sum();
    let mut message = Vec::with_capacity(16 + head.len() + length);
    message.extend_from_slice(&(head.len() as u64).to_le_bytes());
    message.extend_from_slice(&head);
    message.extend_from_slice(&(length as u64).to_le_bytes());
    for part in parts {
        message.extend_from_slice(part);
    }
    to.write_all(&message)?;
    to.flush()
}

fn read_message<H: DeserializeOwned>(from: &mut impl Read) -> io::Result<(H, Vec<u8>)> {
    let head = read_part(from)?;
    let head = serde_json::from_slice(&head)?;
    Ok((head, read_part(from)?))
}

fn read_part(from: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut length = [0; 8];
    from.read_exact(&mut length)?;
    let length = u64::from_le_bytes(length);
    // Room is made as bytes come: a spoilt length must not ask for more memory than there is.
    let mut bytes = Vec::with_capacity(length.min(ROOM) as usize);
    from.by_ref().take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Plan {
        Plan {
            before: vec!["units si".to_owned()],
            user: vec!["fix a all viscous 1".to_owned()],
            walls: 3,
            log_file: Some("a b/c.log".into()),
            ..Plan::default()
        }
    }

    #[test]
    fn every_request_and_reply_arrives_as_it_was_sent_to_the_bit() {
        let atom = Atom {
            position: [f64::MIN_POSITIVE, -0.0, 1.0 / 3.0],
            radius: 1e-300,
            material: 7,
            ..Atom::zeroed()
        };
        let push = Push { force: [f64::from_bits(1), 2.0, -3.0], torque: [0.1, 0.2, 0.3] };
        let requests = [
            Request::Open(plan(), vec![atom; 3]),
            Request::Resume(plan(), vec![atom; 2], vec![1, 2, 3]),
            Request::Advance { step: 0.1 + 0.2, substeps: 5, loads: vec![push; 4] },
            Request::Touches,
            Request::Save,
        ];
        let mut wire = Vec::new();
        for request in &requests {
            request.write(&mut wire).unwrap();
        }
        let mut from = &wire[..];
        for request in &requests {
            assert_eq!(Request::read(&mut from).unwrap(), *request);
        }
        assert!(from.is_empty());
        let replies = [
            Reply::Done,
            Reply::States(vec![State::default(); 2]),
            Reply::Touches(vec![Touch::zeroed()]),
            Reply::Saved(vec![9; 13]),
            Reply::Failed("all: Illegal \"fix\" command\n".to_owned()),
        ];
        let mut wire = Vec::new();
        for reply in &replies {
            reply.write(&mut wire).unwrap();
        }
        let mut from = &wire[..];
        for reply in &replies {
            assert_eq!(Reply::read(&mut from).unwrap(), *reply);
        }
    }

    #[test]
    fn a_message_that_is_cut_or_spoilt_is_an_error_and_not_a_panic() {
        let mut wire = Vec::new();
        Request::Resume(plan(), vec![Atom::zeroed()], vec![5; 9]).write(&mut wire).unwrap();
        for length in 0..wire.len() {
            assert!(Request::read(&mut &wire[..length]).is_err());
        }
        for at in 0..16 {
            let mut spoilt = wire.clone();
            spoilt[at] ^= 0xff;
            assert!(Request::read(&mut &spoilt[..]).is_err(), "{at}");
        }
    }
}
