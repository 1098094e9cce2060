//! The engine's end of the protocol, for engines in Rust.

use crate::message::{self, AppliedLoad, Body, ContactForce, Kind, Outcome, State};
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
    /// Makes this many sub-steps of `step` (s) under constant loads, one for each particle, in their order.
    fn advance(&mut self, step: f64, substeps: u32, loads: &[AppliedLoad]) -> Outcome<Vec<State>>;
    /// The contacts at the last sub-step.
    fn contacts(&mut self) -> Outcome<Vec<ContactForce>>;
    /// All that [`restore`](Self::restore) needs.
    fn save(&mut self) -> Outcome<Vec<u8>>;
    /// Resumes from what was saved, after a set-up with the particles as they were then.
    fn restore(&mut self, saved: &[u8]) -> Outcome<()>;
}

/// Payload of the answer to a message.
pub(crate) fn answer(engine: &mut dyn Served, kind: Kind, payload: &[u8]) -> Outcome<Vec<u8>> {
    match kind {
        Kind::Hello => Ok(message::hello(&engine.hello())),
        Kind::SetUp => {
            let (plan, bodies) = message::read_set_up(payload)?;
            engine.set_up(plan, bodies).map(|()| Vec::new())
        }
        Kind::Advance => {
            let (step, substeps, loads) = message::read_advance(payload)?;
            Ok(cast_slice(&engine.advance(step, substeps, &loads)?).to_vec())
        }
        Kind::ListContacts => Ok(cast_slice(&engine.contacts()?).to_vec()),
        Kind::Save => engine.save(),
        Kind::Restore => engine.restore(payload).map(|()| Vec::new()),
        other => Err(format!("the engine was sent the message `{}`", other.name())),
    }
}

/// Answers messages until the other end says goodbye or closes.
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
        let written = match answer(engine, kind, &payload) {
            Ok(payload) => message::write(channel, kind.answer(), &payload),
            Err(text) => message::write(channel, Kind::Error, text.as_bytes()),
        };
        if written.is_err() {
            return Ok(());
        }
    }
}
