//! Two engines side by side, step by step.

use turbid::case::Setup;
use turbid::comm::Comm;
use turbid::dem::{DemEngine, Load};
use turbid::domain::Domain;
use turbid::particle::Particle;

/// Particles that differ by more than this part of the unit of a quantity have parted.
pub(super) const PARTED: f64 = 1e-3;

/// What is compared of every particle, over the diameter, the largest speed and the largest spin so far.
pub(super) const QUANTITIES: [&str; 3] = ["position / D", "velocity / u_max", "spin / w_max"];

/// A difference between the engines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Apart {
    /// How large, in the unit of the quantity.
    pub(super) value: f64,
    pub(super) step: u64,
    /// Of which particle, where it is in the native engine (m), and whether it touches anything in either.
    pub(super) id: u64,
    pub(super) place: [f64; 3],
    pub(super) touching: bool,
}

/// What the engines did; pairs are native, then LIGGGHTS.
#[derive(Clone, Debug, Default)]
pub(super) struct Comparison {
    /// Steps that each engine did.
    pub(super) steps: [u64; 2],
    /// Engines that failed, and how.
    pub(super) failures: Vec<(&'static str, String)>,
    /// Step after which each engine first had a contact.
    pub(super) first_contact: [Option<u64>; 2],
    /// Contacts that each engine has seen begin: the native one looks at every sub-step, LIGGGHTS at every step.
    pub(super) begun: [u64; 2],
    /// Where the engines part in each of the [`QUANTITIES`], and their largest difference.
    pub(super) parting: [Option<Apart>; 3],
    pub(super) largest: [Apart; 3],
    /// Largest speed (m/s) and spin (1/s) so far, in either engine.
    speed: f64,
    spin: f64,
}

/// Both engines in the same state.
pub(super) struct Pair {
    engines: [Box<dyn DemEngine>; 2],
    domain: Domain,
    dt: f64,
    /// By template (m).
    diameters: Vec<f64>,
    pub(super) found: Comparison,
}

impl Pair {
    /// Native engine and LIGGGHTS with the case at rest.
    pub(super) fn new(setup: &Setup, engines: [Box<dyn DemEngine>; 2]) -> Self {
        let diameters = setup.templates.iter().map(|t| t.shape.equivalent_diameter());
        let mut pair = Self {
            engines,
            domain: setup.domain,
            dt: setup.time_step,
            diameters: diameters.collect(),
            found: Comparison::default(),
        };
        pair.observe();
        pair
    }

    /// The particles of an engine, ascending by id: 0 is the native one.
    pub(super) fn particles(&self, engine: usize) -> &[Particle] {
        self.engines[engine].particles().owned()
    }

    /// One step of both under the same loads, ascending by id; false if one has failed.
    pub(super) fn advance(&mut self, loads: &[Load]) -> bool {
        let names = ["the native engine", "LIGGGHTS"];
        for (engine, name) in names.into_iter().enumerate() {
            match self.engines[engine].advance(&Comm::Solo, loads, self.dt) {
                Ok(()) => self.found.steps[engine] += 1,
                Err(error) => self.found.failures.push((name, error.to_string())),
            }
        }
        let both = self.found.failures.is_empty();
        if both {
            self.observe();
        }
        both
    }

    /// What there is to see after a step.
    fn observe(&mut self) {
        let contacts = self.engines.each_ref().map(|engine| engine.contacts());
        let (mut speed, mut spin) = (self.found.speed, self.found.spin);
        let mut apart = [(0.0, 0); 3];
        for (at, (a, b)) in self.particles(0).iter().zip(self.particles(1)).enumerate() {
            assert_eq!(a.id, b.id, "both engines have the same particles");
            let distance = self.domain.nearest_image(a.position() - b.position()).norm();
            let here = [
                distance / self.diameters[a.template as usize],
                (a.velocity() - b.velocity()).norm(),
                (a.angular_velocity() - b.angular_velocity()).norm(),
            ];
            for (largest, here) in apart.iter_mut().zip(here) {
                if here > largest.0 {
                    *largest = (here, at);
                }
            }
            speed = speed.max(a.velocity().norm()).max(b.velocity().norm());
            spin = spin.max(a.angular_velocity().norm()).max(b.angular_velocity().norm());
        }
        (self.found.speed, self.found.spin) = (speed, spin);
        for (k, unit) in [1.0, speed, spin].into_iter().enumerate() {
            let (difference, at) = apart[k];
            // What rests alike does not differ, and has no speed to divide by.
            if difference > 0.0 {
                let apart = self.apart(difference / unit, at);
                if apart.value > self.found.largest[k].value {
                    self.found.largest[k] = apart;
                }
                if apart.value > PARTED {
                    self.found.parting[k].get_or_insert(apart);
                }
            }
        }
        for (first, now) in self.found.first_contact.iter_mut().zip(&contacts) {
            if first.is_none() && (now.count > 0 || now.begun > 0) {
                *first = Some(self.found.steps[0]);
            }
        }
        self.found.begun = contacts.map(|now| now.begun);
    }

    /// A difference of the particle at this place of the list.
    fn apart(&self, value: f64, at: usize) -> Apart {
        let particles = [0, 1].map(|engine| &self.particles(engine)[at]);
        Apart {
            value,
            step: self.found.steps[0],
            id: particles[0].id,
            place: particles[0].position,
            touching: particles.iter().any(|p| p.contact_force.iter().any(|f| *f != 0.0)),
        }
    }
}
