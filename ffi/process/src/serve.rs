//! The engine's end of the protocol, for engines in Rust.

use crate::message::{self, AppliedLoad, Body, ContactForce, Kind, LoadedState, Outcome, State};
use crate::setup::{Hello, SetUp};
use bytemuck::cast_slice;
use std::fmt::Debug;
use std::io::{self, Read, Write};

/// An engine that answers messages. An error goes to the user in its words; nothing but the end follows it.
#[allow(clippy::missing_errors_doc, reason = "said of the trait")]
pub trait Served: Debug + Send {
    /// Its name and what it can do.
    fn hello(&self) -> Hello;
    /// Takes the case and its particles, by ascending id.
    fn set_up(&mut self, plan: SetUp, bodies: Vec<Body>) -> Outcome<()>;
    /// Makes this many sub-steps of `step` (s) under constant loads, one for each particle, by ascending id.
    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<()>;
    /// The particles that it has now, in any order, with the loads on them: one of several processes has other ones after a set-up, after a
    /// step, and after it has saved or restored. The loads of one alone are not used.
    fn states(&mut self) -> Outcome<Vec<LoadedState>>;
    /// The contacts at the last sub-step.
    fn contacts(&mut self) -> Outcome<Vec<ContactForce>>;
    /// All that [`restore`](Self::restore) needs.
    fn save(&mut self) -> Outcome<Vec<u8>>;
    /// Resumes from what was saved, after a set-up with the particles as they were then; an engine in several processes of Turbid from
    /// what each has saved, one after the other.
    fn restore(&mut self, saved: &[u8]) -> Outcome<()>;
}

/// Payload of the answer to a message, of one of `parts` processes.
pub(crate) fn answer(engine: &mut dyn Served, kind: Kind, payload: &[u8], parts: usize) -> Outcome<Vec<u8>> {
    match kind {
        Kind::Hello => Ok(message::hello(&engine.hello(), parts)),
        Kind::SetUp => {
            let (plan, bodies) = message::read_set_up(payload)?;
            engine.set_up(plan, bodies).map(|()| Vec::new())
        }
        Kind::Advance => {
            let (step, substeps, loads) = message::read_advance(payload)?;
            engine.advance(step, substeps, &loads)?;
            list_particles(engine, parts)
        }
        Kind::ListParticles => list_particles(engine, parts),
        Kind::ListContacts => Ok(cast_slice(&engine.contacts()?).to_vec()),
        Kind::Save => engine.save(),
        Kind::Restore => engine.restore(payload).map(|()| Vec::new()),
        other => Err(format!("the engine was sent the message `{}`", other.name())),
    }
}

fn list_particles(engine: &mut dyn Served, parts: usize) -> Outcome<Vec<u8>> {
    let states = engine.states()?;
    if parts > 1 {
        return Ok(cast_slice(&states).to_vec());
    }
    let bare: Vec<State> = states.iter().map(|loaded| loaded.state).collect();
    Ok(cast_slice(&bare).to_vec())
}

/// Answers messages, as the one process of an engine, until the other end says goodbye or closes.
///
/// # Errors
/// Those of reading.
pub fn serve(engine: &mut dyn Served, channel: &mut (impl Read + Write)) -> io::Result<()> {
    loop {
        let (kind, payload) = match message::read(channel, u64::MAX) {
            Ok((Kind::Goodbye, _)) => return Ok(()),
            Ok(message) => message,
            // The run has ended.
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
            Err(error) => return Err(error),
        };
        let written = match answer(engine, kind, &payload, 1) {
            Ok(payload) => message::write(channel, kind.answer(), &payload),
            Err(text) => message::write(channel, Kind::Error, text.as_bytes()),
        };
        if written.is_err() {
            return Ok(());
        }
    }
}
