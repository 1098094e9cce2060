//! Two engines side by side, step by step.

use crate::case::Setup;
use crate::comm::Comm;
use crate::crosscheck::Moment;
use crate::crosscheck::report::sphere;
use crate::dem::{DemEngine, Load};
use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::Particle;

/// Particles further apart than this part of their diameter have parted.
pub(super) const PARTED: f64 = 1e-3;

/// So often a particle may come to touch something for the impacts to be few: what rounding has become by then has a limit.
pub(super) const FEW: u32 = 3;

/// Rows of the series, about; and moments of the trajectories.
const ROWS: u64 = 500;
const MOMENTS: u64 = 40;

/// Largest differences between the engines over all particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Apart {
    /// Distance over the diameter (-), and the id of the particle.
    pub(super) position: f64,
    pub(super) id: u64,
    /// Difference of the velocities (m/s).
    pub(super) velocity: f64,
    /// Difference of the angular velocities (1/s).
    pub(super) spin: f64,
}

/// A row of the series; pairs are native, then LIGGGHTS.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) step: u64,
    pub(super) apart: Apart,
    pub(super) contacts: [usize; 2],
    /// Mean kinetic energy, of translation and rotation (J).
    pub(super) energy: [f64; 2],
    /// Largest depth of a contact over the smallest diameter (-).
    pub(super) overlap: [f64; 2],
    /// Mean velocity along gravity (m/s); zero without gravity.
    pub(super) falling: [f64; 2],
}

/// The first particle further apart than [`PARTED`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parting {
    pub(super) step: u64,
    pub(super) id: u64,
    /// Where it is in the native engine (m).
    pub(super) place: [f64; 3],
    /// Whether it touches something, in either engine.
    pub(super) touching: bool,
}

/// The steps from the start on; all are the largest until their end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Span {
    /// How many.
    pub(super) steps: u64,
    /// Differences.
    pub(super) apart: Apart,
    /// Way of a particle in the native engine (m).
    pub(super) path: f64,
    /// Speed (m/s) and spin (1/s) of a particle in the native engine.
    pub(super) speed: f64,
    pub(super) spin: f64,
}

/// What the engines did.
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
    /// Before the first contact in either.
    pub(super) before_contact: Option<Span>,
    /// Until a particle has come to touch something more than [`FEW`] times, or all together have on average.
    pub(super) few_impacts: Option<Span>,
    pub(super) parting: Option<Parting>,
    pub(super) samples: Vec<Sample>,
    pub(super) moments: Vec<Moment>,
    /// All steps.
    pub(super) all: Span,
    /// Smallest diameter (m).
    pub(super) least_diameter: f64,
}

/// Both engines in the same state.
pub(super) struct Pair {
    engines: [Box<dyn DemEngine>; 2],
    domain: Domain,
    dt: f64,
    /// Direction of gravity.
    down: Vec3,
    /// Diameter, mass and moment of inertia by template.
    bodies: Vec<(f64, f64, f64)>,
    /// Ways of all particles in the native engine (m).
    paths: Vec<f64>,
    step: u64,
    every: u64,
    moment_every: u64,
    /// Whether each particle touches something, and how often it has come to, in both engines.
    touches: [Vec<(bool, u32)>; 2],
    found: Comparison,
}

impl Pair {
    /// Native engine and LIGGGHTS with the case at rest, and how many steps they are going to make.
    pub(super) fn new(setup: &Setup, steps: u64, engines: [Box<dyn DemEngine>; 2]) -> Self {
        let bodies: Vec<(f64, f64, f64)> = (setup.templates.iter())
            .map(|t| (t.shape.equivalent_diameter(), t.mass(), t.inertia().x))
            .collect();
        let least_diameter = bodies.iter().map(|body| body.0).fold(f64::INFINITY, f64::min);
        let mut pair = Self {
            engines,
            domain: setup.domain,
            dt: setup.time_step,
            down: setup.gravity.try_normalize(0.0).unwrap_or_else(Vec3::zeros),
            bodies,
            paths: vec![0.0; setup.particles.len()],
            step: 0,
            every: steps.div_ceil(ROWS).max(1),
            moment_every: steps.div_ceil(MOMENTS).max(1),
            touches: [0, 1].map(|_| vec![(false, 0); setup.particles.len()]),
            found: Comparison {
                least_diameter,
                ..Comparison::default()
            },
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
        self.step += 1;
        if !self.found.failures.is_empty() {
            return false;
        }
        for (path, particle) in self.paths.iter_mut().zip(self.engines[0].particles().owned()) {
            *path += particle.velocity().norm() * self.dt;
        }
        self.observe();
        true
    }

    /// What there is to see after a step.
    fn observe(&mut self) {
        let contacts = self.engines.each_ref().map(|engine| engine.contacts());
        for (first, now) in self.found.first_contact.iter_mut().zip(&contacts) {
            if first.is_none() && (now.count > 0 || now.begun > 0) {
                *first = Some(self.step);
            }
        }
        let apart = self.apart();
        self.extend(apart);
        let few = self.count_touches();
        let all = self.found.all;
        if self.found.first_contact == [None; 2] && self.step > 0 {
            self.found.before_contact = Some(all);
        }
        let unbroken = self.found.few_impacts.map_or(0, |span| span.steps) + 1 == self.step;
        let begun = contacts.iter().map(|now| now.begun).max().unwrap_or(0);
        if few && unbroken && 2 * begun <= u64::from(FEW) * self.paths.len() as u64 {
            self.found.few_impacts = Some(all);
        }
        if self.found.parting.is_none() && apart.position > PARTED {
            self.found.parting = Some(self.parting(apart.id));
        }
        if self.step.is_multiple_of(self.every) {
            self.sample(apart);
        }
        if self.step.is_multiple_of(self.moment_every) {
            let spheres = self.engines.each_ref().map(|engine| {
                let store = engine.particles();
                store
                    .owned()
                    .iter()
                    .map(|p| sphere(p, store.template(p)))
                    .collect()
            });
            let time = self.step as f64 * self.dt;
            self.found.moments.push(Moment { time, spheres });
        }
    }

    /// Adds a step to all steps.
    fn extend(&mut self, apart: Apart) {
        let mut all = self.found.all;
        all.steps = self.step;
        if apart.position > all.apart.position {
            (all.apart.position, all.apart.id) = (apart.position, apart.id);
        }
        all.apart.velocity = all.apart.velocity.max(apart.velocity);
        all.apart.spin = all.apart.spin.max(apart.spin);
        all.path = self.paths.iter().copied().fold(0.0, f64::max);
        for particle in self.particles(0) {
            all.speed = all.speed.max(particle.velocity().norm());
            all.spin = all.spin.max(particle.angular_velocity().norm());
        }
        self.found.all = all;
    }

    /// Looks which particles touch something; whether none has come to more than [`FEW`] times.
    fn count_touches(&mut self) -> bool {
        for (engine, touches) in self.engines.iter().zip(&mut self.touches) {
            for (particle, (touching, count)) in engine.particles().owned().iter().zip(touches) {
                let now = particle.contact_force.iter().any(|f| *f != 0.0);
                *count += u32::from(now && !*touching);
                *touching = now;
            }
        }
        self.touches.iter().flatten().all(|(_, count)| *count <= FEW)
    }

    /// Adds a row to the series.
    fn sample(&mut self, apart: Apart) {
        let contacts = self.engines.each_ref().map(|engine| engine.contacts());
        let sample = Sample {
            step: self.step,
            apart,
            contacts: contacts.map(|summary| summary.count),
            overlap: contacts.map(|summary| summary.max_depth / self.found.least_diameter),
            energy: [0, 1].map(|engine| self.mean(engine, |p| self.energy(p))),
            falling: [0, 1].map(|engine| self.mean(engine, |p| p.velocity().dot(&self.down))),
        };
        self.found.samples.push(sample);
    }

    /// Largest differences now.
    fn apart(&self) -> Apart {
        let mut apart = Apart::default();
        for (a, b) in self.particles(0).iter().zip(self.particles(1)) {
            assert_eq!(a.id, b.id, "both engines have the same particles");
            let distance = self.domain.nearest_image(a.position() - b.position()).norm();
            let distance = distance / self.bodies[a.template as usize].0;
            if distance > apart.position {
                (apart.position, apart.id) = (distance, a.id);
            }
            apart.velocity = apart.velocity.max((a.velocity() - b.velocity()).norm());
            apart.spin = apart
                .spin
                .max((a.angular_velocity() - b.angular_velocity()).norm());
        }
        apart
    }

    fn parting(&self, id: u64) -> Parting {
        let at = self.particles(0).partition_point(|particle| particle.id < id);
        Parting {
            step: self.step,
            id,
            place: self.particles(0)[at].position,
            touching: [0, 1]
                .iter()
                .any(|&engine| self.particles(engine)[at].contact_force.iter().any(|f| *f != 0.0)),
        }
    }

    fn energy(&self, particle: &Particle) -> f64 {
        let (_, mass, inertia) = self.bodies[particle.template as usize];
        let (v, w) = (particle.velocity(), particle.angular_velocity());
        0.5 * (mass * v.norm_squared() + inertia * w.norm_squared())
    }

    fn mean(&self, engine: usize, value: impl Fn(&Particle) -> f64) -> f64 {
        let particles = self.particles(engine);
        particles.iter().map(value).sum::<f64>() / particles.len().max(1) as f64
    }

    /// All that was seen.
    pub(super) fn finish(&mut self) -> Comparison {
        let sampled = self.found.samples.last().map(|sample| sample.step);
        if self.found.failures.is_empty() && sampled != Some(self.step) {
            self.sample(self.apart());
        }
        let mut found = std::mem::take(&mut self.found);
        found.begun = self.engines.each_ref().map(|engine| engine.contacts().begun);
        found
    }
}
