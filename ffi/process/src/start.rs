//! Starting an engine: hello, the set-up of the case, and what an earlier one saved.

use super::{Abilities, External, Host, Part, Peer};
use crate::child::{Asked, Worker};
use crate::message::{self, Body, Kind, Outcome};
use crate::setup::{
    BoxSection, ContactSection, Hello, SetUp, ShapeSection, TemplateSection, WallSection, wall_flaw,
};
use bytemuck::bytes_of;
use std::cell::RefCell;
use std::fmt::Display;
use turbid_core::comm::Comm;
use turbid_core::dem::{ContactSummary, Load};
use turbid_core::error::{Error, Result};
use turbid_core::particle::Particle;

/// Ends the name of an engine of several parts, in what is saved.
const OF_PARTS: char = '\0';

/// States that the parts of an engine have saved: of each the length of the name of the engine (u64) and the name, and its own bytes; of several
/// parts [`OF_PARTS`] ends the name, and the length of its own bytes (u64) stands before them.
#[derive(Debug, Default, PartialEq)]
struct Own<'a> {
    name: &'a str,
    /// By part.
    parts: Vec<&'a [u8]>,
}

impl<'a> Own<'a> {
    fn write(name: &str, parts: usize, own: &[u8]) -> Vec<u8> {
        if parts == 1 {
            return [bytes_of(&(name.len() as u64)), name.as_bytes(), own].concat();
        }
        let name = format!("{name}{OF_PARTS}");
        let [before, length] = [name.len(), own.len()].map(|length| (length as u64).to_le_bytes());
        [&before, name.as_bytes(), &length, own].concat()
    }

    /// Those of all parts, one after the other.
    fn read(mut saved: &'a [u8]) -> Option<Self> {
        let mut all = Self::default();
        while !saved.is_empty() {
            let (name, rest) = sized(saved)?;
            let name = std::str::from_utf8(name).ok()?;
            let own = if let Some(name) = name.strip_suffix(OF_PARTS) {
                all.name = name;
                let (own, rest) = sized(rest)?;
                saved = rest;
                own
            } else {
                (all.name, saved) = (name, &[]);
                rest
            };
            all.parts.push(own);
        }
        Some(all)
    }
}

/// Bytes after their length, and the rest.
fn sized(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)
}

impl External {
    /// Starts with the particles that the ranks hand over, each by one of them. It resumes from `saved`, the states that parts of an earlier
    /// run have saved and that this rank has read, with their indices, if any rank has one; without it, only greets the engine. Collective.
    pub(super) fn begin(
        &mut self,
        comm: &Comm,
        handed: &[Particle],
        saved: Option<&[(usize, Vec<u8>)]>,
    ) -> Result<()> {
        let strange = handed.iter().find(|particle| saved.is_some() && !particle.is_finite());
        let finite =
            comm.agree_words(strange.map_or(Ok(()), |particle| {
                Err(format!("the state of particle {} is not finite", particle.id))
            }));
        if let Err(what) = finite {
            (self.failed, self.failed_here) = (true, true);
            return Err(Error::Input(what));
        }
        self.take(comm, handed);
        let (seat, count) = (self.seat, self.population.population.count);
        let takes_part = seat.part < seat.parts && count > 0;
        let mut outcome = if takes_part { self.greet_once() } else { Ok(()) };
        // The others learn whether it has worked.
        self.failed = comm.any(outcome.is_err());
        if let (Some(saved), false) = (saved, self.failed) {
            // A part begins with the particles of a stretch of the ranks.
            let part = self.near.rank * seat.parts / comm.size();
            let owned = self.population.store.owned().iter();
            let mut of_part: Vec<Particle> = comm.hand_over(owned.map(|particle| (part, *particle)));
            of_part.sort_unstable_by_key(|particle| particle.id);
            outcome = self.launch(comm, takes_part, &of_part, saved);
            self.failed = comm.any(outcome.is_err());
        }
        self.failed_here = outcome.is_err();
        if self.failed {
            return outcome.and(Err(Error::OtherRank));
        }
        let of_part = self.part.as_ref().map(|part| &part.hello);
        let says = |able: fn(&Hello) -> bool| i64::from(of_part.is_some_and(able));
        let mut able =
            [says(|hello| hello.orientations), says(|hello| hello.contacts), says(|hello| hello.overlaps)];
        comm.sum(&mut able);
        let [orientations, tells, overlaps] = able.map(|parts| parts > 0);
        self.able = Abilities { orientations, tells: tells || count == 0, overlaps };
        if saved.is_some() { self.locate(comm) } else { Ok(()) }
    }

    /// Makes the particles that the ranks hand over those of the engine, and notes their mass. Collective.
    fn take(&mut self, comm: &Comm, handed: &[Particle]) {
        let Self { population, near, inertias, .. } = self;
        let templates = population.store.templates.clone();
        let mut counts = vec![0; templates.len()];
        let begun = handed.iter().map(|particle| {
            let (mut particle, template) = (*particle, particle.template as usize);
            let (orientation, spin) = (particle.orientation(), particle.angular_velocity());
            particle.angular_momentum = inertias[template].angular_momentum(&orientation, spin).into();
            counts[template] += 1;
            (particle, Load::default())
        });
        population.take_over(near, comm, 0, begun);
        comm.sum(&mut counts);
        let masses = templates.iter().zip(&counts).map(|(template, count)| *count as f64 * template.mass());
        self.mass = masses.sum();
        self.holders.replace(vec![0; population.store.owned]);
    }

    /// Greets the engine, unless it waits for its set-up.
    fn greet_once(&mut self) -> Result<()> {
        if self.greeted.is_none() {
            // An engine that there can be one of must be gone before there is another.
            self.part = None;
            self.greeted = Some(self.greet()?);
        }
        Ok(())
    }

    /// Starts the part of this rank, which must have what the case needs.
    fn greet(&self) -> Result<(Peer, Hello)> {
        let mut peer = match &self.params.host {
            Host::Process(program) | Host::Processes(program, _) => {
                Peer::Process(Worker::start(program).map_err(|e| self.refused(e))?)
            }
            Host::Here(start) => Peer::Here(start(self.seat)),
        };
        let parts = self.seat.parts;
        let mut words = serde_json::json!({ "name": concat!("turbid ", env!("CARGO_PKG_VERSION")) });
        if parts > 1 {
            (words["part"], words["parts"]) = (self.seat.part.into(), parts.into());
        }
        let asked = Asked { kind: Kind::Hello, parts, most: u64::MAX };
        let hello = peer.ask(Kind::Hello, &message::hello(&words, parts), &asked);
        let hello =
            hello.and_then(|(_, bytes)| message::read_hello(&bytes, parts)).map_err(|e| self.refused(e))?;
        self.set_up(&hello).map(|_| (peer, hello))
    }

    /// Sets the greeted part up with its particles, and gives it what was saved. Collective.
    fn launch(
        &mut self,
        comm: &Comm,
        takes_part: bool,
        particles: &[Particle],
        saved: &[(usize, Vec<u8>)],
    ) -> Result<()> {
        let body = |particle: &Particle| Body {
            id: particle.id,
            template: particle.template,
            position: particle.position,
            orientation: particle.orientation,
            velocity: particle.velocity,
            angular_velocity: particle.angular_velocity,
        };
        let bodies: Vec<Body> = particles.iter().map(body).collect();
        let mut message = Vec::new();
        let mut part = None;
        if let (true, Some((peer, hello))) = (takes_part, self.greeted.take()) {
            message = message::set_up(&self.set_up(&hello)?, &bodies);
            part = Some(Part { peer: RefCell::new(peer), hello, owners: RefCell::default() });
        }
        let ready = self.ask(comm, part.as_ref(), (Kind::SetUp, &message), u64::MAX);
        comm.agree(ready.map_err(|e| self.refused(e)))?;
        let resumed = self.resume(comm, part.as_ref(), saved);
        comm.agree(resumed.map_err(|e| self.refused(e)))?;
        (self.part, self.pairs, self.summary) = (part, Vec::new(), ContactSummary::default());
        Ok(())
    }

    /// Gives the part of this rank what the parts of an earlier run saved, if they did: the states that this rank has read, with their
    /// indices, go to the parts. Collective.
    ///
    /// Of an engine in several processes each part gets the state with its index. A part of any other engine gets all of them, one after the
    /// other, since it finds its particles and contacts only by reading them all (LIGGGHTS in all processes of an MPI job): the one exception
    /// to the rule that a rank gets no more than its share of a saved state, of all bytes that the engine itself has saved.
    fn resume(&self, comm: &Comm, part: Option<&Part>, saved: &[(usize, Vec<u8>)]) -> Outcome<()> {
        let (mut before, now) = ([saved.len() as i64], self.seat.parts);
        comm.sum(&mut before);
        let [before] = before;
        if before == 0 {
            return Ok(());
        }
        let is_process = matches!(self.params.host, Host::Process(_) | Host::Processes(..));
        if is_process && before != now as i64 && !self.params.regroups {
            return Err(format!("the state was saved by {before} processes, and these are {now}"));
        }
        let whole = self.to_parts(comm, saved);
        let own = Own::read(&whole).ok_or_else(|| "what the engine saved is not whole".to_owned());
        let own = comm.agree_words(own)?;
        let here =
            part.map(|part| &part.hello.name).filter(|here| *here != own.name && !own.parts.is_empty());
        comm.agree_words(here.map_or(Ok(()), |here| {
            Err(format!("the state was saved by `{}`, and this is `{here}`", own.name))
        }))?;
        self.ask(comm, part, (Kind::Restore, &own.parts.concat()), u64::MAX).map(drop)
    }

    /// Those of the saved states that the part of this rank gets, in their order. Collective.
    fn to_parts(&self, comm: &Comm, saved: &[(usize, Vec<u8>)]) -> Vec<u8> {
        let parts = self.seat.parts;
        let own_alone = matches!(self.params.host, Host::Processes(..));
        let message = |to: usize| {
            let states = saved.iter().filter(|(n, _)| !own_alone || *n == to);
            let numbers = |n: &usize, own: &[u8]| [*n as u64, own.len() as u64].map(u64::to_le_bytes);
            let framed = states.map(|(n, own)| [numbers(n, own).as_flattened(), own].concat());
            (to, framed.collect::<Vec<_>>().concat())
        };
        let sent = (0..parts).map(message).filter(|(_, message)| !message.is_empty()).collect();
        let mut states = Vec::new();
        let received = comm.route(sent);
        for (_, message) in &received {
            let mut rest = &message[..];
            while let Some((n, after)) = rest.split_first_chunk::<8>() {
                let (state, after) = sized(after).expect("as it was sent");
                states.push((u64::from_le_bytes(*n), state));
                rest = after;
            }
        }
        states.sort_unstable_by_key(|(n, _)| *n);
        states.iter().flat_map(|(_, state)| *state).copied().collect()
    }

    /// The state of the part of this rank, with its name; nothing without a part or of an engine that does not save. Collective.
    pub(super) fn save_parts(&self, comm: &Comm) -> Outcome<Vec<u8>> {
        let part = self.peer();
        if !comm.any(part.is_some_and(|part| part.hello.saves)) {
            return Ok(Vec::new());
        }
        let own = self.ask(comm, part, (Kind::Save, &[]), self.params.memory)?;
        Ok(part.map_or_else(Vec::new, |part| Own::write(&part.hello.name, self.seat.parts, &own)))
    }

    /// The set-up of this case, if the engine has all that it needs.
    fn set_up(&self, hello: &Hello) -> Result<SetUp> {
        let unsupported = |what| Err(Error::Unsupported { engine: self.params.name, what });
        let domain = self.near.decomposition().domain;
        let mut templates = Vec::new();
        for template in self.population.store.templates.iter() {
            let section = TemplateSection::of(template);
            let known =
                section.filter(|section| hello.shapes.iter().any(|kind| kind == section.shape.kind()));
            let Some(section) = known else {
                let (kind, has) = (template.shape.kind(), hello.shapes.join(", "));
                return unsupported(format!("a particle that is a {kind}: {} has {has}", self.params.label));
            };
            if !hello.orientations && !matches!(section.shape, ShapeSection::Sphere { .. }) {
                return unsupported(format!(
                    "a particle that is no sphere: {} has no orientations",
                    self.params.label
                ));
            }
            templates.push(section);
        }
        for wall in self.params.touched_walls() {
            let kind = wall.surface.kind();
            let lacks =
                || (!hello.walls.iter().any(|known| known == kind)).then_some("has a surface that it lacks");
            if let Some(flaw) = wall_flaw(wall).or_else(lacks) {
                return unsupported(format!("the wall `{}`, a {kind}, which {flaw}", wall.name));
            }
        }
        let contact = self.params.contact.as_ref().map(ContactSection::of).transpose().map_err(|what| {
            Error::Unsupported { engine: self.params.name, what: format!("{what}: the protocol has none") }
        })?;
        Ok(SetUp {
            domain: BoxSection { size: domain.size().into(), periodic: domain.periodic() },
            gravity: self.params.gravity.into(),
            templates,
            contact,
            walls: self.params.touched_walls().iter().map(WallSection::of).collect(),
            options: self.params.options.clone(),
        })
    }

    /// The engine does not start, or not with this.
    fn refused(&self, text: impl Display) -> Error {
        Error::Input(format!("{} refuses the set-up: {text}", self.params.label))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_part_or_several_have_saved_is_read_as_it_was_written() {
        for parts in [vec![&b"all of one"[..]], vec![b"of the first", b"", b"of the third"]] {
            let saved: Vec<u8> =
                parts.iter().flat_map(|own| Own::write("an engine", parts.len(), own)).collect();
            assert_eq!(Own::read(&saved), Some(Own { name: "an engine", parts }));
            assert_eq!(Own::read(&saved[..9]), None);
        }
    }
}
