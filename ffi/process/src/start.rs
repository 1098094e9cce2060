//! Starting an engine: hello, the set-up of the case, and what an earlier one saved.

use super::{External, Host, Peer, Root};
use crate::child::Worker;
use crate::message::{self, Body, Kind};
use crate::setup::{
    BoxSection, ContactSection, Hello, SetUp, ShapeSection, TemplateSection, WallSection, wall_flaw,
};
use std::cell::RefCell;
use std::fmt::Display;
use turbid_core::comm::Comm;
use turbid_core::contact::PairFinder;
use turbid_core::dem::{ContactSummary, Load};
use turbid_core::error::{Error, Result};
use turbid_core::particle::Particle;

impl External {
    /// Starts with these particles, or resumes with them from what the engine saved, if it did; without `saved`, only greets the
    /// engine. Collective.
    pub(super) fn begin(&mut self, comm: &Comm, all: &[Particle], saved: Option<&[u8]>) -> Result<()> {
        let mut all = all.to_vec();
        all.sort_unstable_by_key(|particle| particle.id);
        self.ids = all.iter().map(|particle| particle.id).collect();
        let mass = |particle: &Particle| self.population.store.templates[particle.template as usize].mass();
        self.mass = all.iter().map(mass).sum();
        for particle in &mut all {
            let inertia = &self.inertias[particle.template as usize];
            let (orientation, spin) = (particle.orientation(), particle.angular_velocity());
            particle.angular_momentum = inertia.angular_momentum(&orientation, spin).into();
        }
        self.population.replace(&self.near, 0, all.iter().map(|particle| (*particle, Load::default())));
        let outcome = match saved {
            Some(saved) if self.rank == 0 => self.launch(all, saved),
            None if self.rank == 0 && !all.is_empty() => {
                self.greet().map(|greeted| self.greeted = Some(greeted))
            }
            _ => Ok(()),
        };
        // The others learn whether it has worked.
        self.failed = comm.any(outcome.is_err());
        self.orientations = comm.any(self.root.as_ref().is_some_and(|root| root.hello.orientations));
        match outcome {
            Ok(()) if self.failed => Err(Error::OtherRank),
            outcome => outcome,
        }
    }

    /// Starts the engine, which must have what the case needs; on rank 0.
    fn greet(&self) -> Result<(Peer, Hello)> {
        let mut peer = match &self.params.host {
            Host::Process(program) => Peer::Process(Worker::start(program).map_err(|e| self.refused(e))?),
            Host::Here(start) => Peer::Here(start()),
        };
        let words = serde_json::json!({ "name": concat!("turbid ", env!("CARGO_PKG_VERSION")) });
        let hello = peer.ask(Kind::Hello, &message::hello(&words), u64::MAX);
        let hello = hello.and_then(|bytes| message::read_hello(&bytes)).map_err(|e| self.refused(e))?;
        self.set_up(&hello).map(|_| (peer, hello))
    }

    /// Sets the engine up with these particles; on rank 0.
    fn launch(&mut self, mut all: Vec<Particle>, saved: &[u8]) -> Result<()> {
        // An engine that there can be one of must be gone before there is another.
        self.root = None;
        let domain = self.near.decomposition().domain;
        if let Some(particle) = all.iter().find(|particle| !particle.is_finite()) {
            return Err(Error::Input(format!("the state of particle {} is not finite", particle.id)));
        }
        if all.is_empty() {
            return Ok(());
        }
        for particle in &mut all {
            particle.position = domain.wrap(particle.position()).into();
        }
        let (mut peer, hello) = self.greeted.take().map_or_else(|| self.greet(), Ok)?;
        let set_up = self.set_up(&hello)?;
        let body = |particle: &Particle| Body {
            id: particle.id,
            template: particle.template,
            position: particle.position,
            orientation: particle.orientation,
            velocity: particle.velocity,
            angular_velocity: particle.angular_velocity,
        };
        let bodies: Vec<Body> = all.iter().map(body).collect();
        let ready = peer.ask(Kind::SetUp, &message::set_up(&set_up, &bodies), u64::MAX);
        ready.map_err(|e| self.refused(e))?;
        if let Some((length, rest)) = saved.split_first_chunk::<8>() {
            let (name, saved) = rest.split_at(rest.len().min(u64::from_le_bytes(*length) as usize));
            if name != hello.name.as_bytes() {
                let (by, here) = (String::from_utf8_lossy(name), &hello.name);
                return Err(self.refused(format!("the state was saved by `{by}`, and this is `{here}`")));
            }
            peer.ask(Kind::Restore, saved, u64::MAX).map_err(|e| self.refused(e))?;
        }
        self.root = Some(Root {
            peer: RefCell::new(peer),
            hello,
            radii: all.iter().map(|p| self.contours[p.template as usize].reach()).collect(),
            finder: PairFinder::new(domain),
            particles: all,
            pairs: Vec::new(),
            summary: ContactSummary::default(),
        });
        Ok(())
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
