//! Two engines side by side, step by step.

use super::prelude::*;
use turbid::fluid::Precision;
use turbid::simulation::Session;

/// Particles that differ by more than this part of the unit of a quantity have parted.
pub(super) const PARTED: f64 = 1e-3;

/// Compared quantities of every particle, over the diameter, the largest speed and the largest spin so far.
pub(super) const QUANTITIES: [&str; 3] = ["position / D", "velocity / u_max", "spin / w_max"];

const REPEATS: Limit = (0.0, "the native engine under recorded loads repeats the recorded run bit for bit");
const BEGUN: Limit =
    (f64::INFINITY, "reported only: the native engine looks at every sub-step, OTHER at every step");

/// Loads of the fluid on the particles of a four-way run with the native engine, in double precision.
#[derive(Clone, Debug)]
pub(super) struct Recording {
    /// Step by step, ascending by the id of the particle.
    pub(super) loads: Vec<Vec<Load>>,
    pub(super) last: Vec<Particle>,
}

impl Recording {
    /// Of this number of steps of a case, on as many ranks as it asks for.
    pub(super) fn of(setup: &Setup, steps: u64) -> Result<Self> {
        let mut setup = setup.clone();
        (setup.plan.precision, setup.engine) = (Precision::F64, EngineChoice::Native);
        let session = Session::new(setup)?;
        let step = |_| session.advance(1).and_then(|()| session.loads());
        let loads = (0..steps).map(step).collect::<Result<_>>()?;
        session.check()?;
        Ok(Self { loads, last: session.particles()? })
    }
}

/// The first difference above [`PARTED`], in the unit of the quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Difference {
    pub(super) value: f64,
    pub(super) step: u64,
    /// Particle, its position in the native engine (m), and whether it is in contact in either.
    pub(super) id: u64,
    pub(super) position: [f64; 3],
    pub(super) touching: bool,
}

/// Both engines from the same state, and their differences so far; pairs are native, then the other engine.
pub(super) struct Pair {
    engines: [Box<dyn DemEngine>; 2],
    domain: Domain,
    dt: f64,
    diameters: Vec<f64>,
    pub(super) steps: [u64; 2],
    /// Engines that failed, and how.
    pub(super) failures: Vec<(usize, String)>,
    /// Step after which each engine first had a contact.
    pub(super) first_contact: [Option<u64>; 2],
    /// First difference above [`PARTED`] in each of the [`QUANTITIES`], and the largest difference.
    pub(super) parting: [Option<Difference>; 3],
    pub(super) largest: [f64; 3],
    /// Largest distance of a particle from itself after the last step (diameters).
    pub(super) now: f64,
    /// Largest speed (m/s) and spin (1/s) so far, in either engine.
    speed: f64,
    spin: f64,
}

impl Pair {
    /// Both engines with the particles of a case, under another name.
    pub(super) fn start(setup: &Setup, name: &str, against: &Against) -> Result<Self> {
        let mut system = setup.clone();
        system.provenance.name = name.to_string();
        Ok(Self::new(setup, [native(&system)?, against.engine(&system)?]))
    }

    /// Native engine and the other engine, which hold the particles of the case.
    pub(super) fn new(setup: &Setup, engines: [Box<dyn DemEngine>; 2]) -> Self {
        let diameters = setup.templates.iter().map(|t| t.shape.equivalent_diameter());
        let mut pair = Self {
            engines,
            domain: setup.domain,
            dt: setup.time_step,
            diameters: diameters.collect(),
            steps: [0; 2],
            failures: Vec::new(),
            first_contact: [None; 2],
            parting: [None; 3],
            largest: [0.0; 3],
            now: 0.0,
            speed: 0.0,
            spin: 0.0,
        };
        pair.observe();
        pair
    }

    /// The particles of an engine (0 is the native one), ascending by id.
    pub(super) fn particles(&self, engine: usize) -> &[Particle] {
        self.engines[engine].particles().owned()
    }

    /// Advances both under the recorded loads, or without loads, until one fails.
    pub(super) fn run(&mut self, steps: u64, recorded: Option<&Recording>) {
        let _ = (0..steps).all(|step| self.step(step, recorded));
    }

    pub(super) fn step(&mut self, step: u64, recorded: Option<&Recording>) -> bool {
        let none = vec![Load::default(); self.particles(0).len()];
        let loads = recorded.map_or(&none, |recorded| &recorded.loads[step as usize]);
        for engine in 0..2 {
            match self.engines[engine].advance(&Comm::Solo, loads, self.dt) {
                Ok(()) => self.steps[engine] += 1,
                Err(error) => self.failures.push((engine, error.to_string())),
            }
        }
        let whole = self.failures.is_empty();
        if whole {
            self.observe();
        }
        whole
    }

    fn observe(&mut self) {
        let (mut speed, mut spin) = (self.speed, self.spin);
        let mut apart = [(0.0, 0); 3];
        for (index, (a, b)) in self.particles(0).iter().zip(self.particles(1)).enumerate() {
            assert_eq!(a.id, b.id, "both engines have the same particles");
            let distance = self.domain.nearest_image(a.position() - b.position()).norm();
            let here = [
                distance / self.diameters[a.template as usize],
                (a.velocity() - b.velocity()).norm(),
                (a.angular_velocity() - b.angular_velocity()).norm(),
            ];
            for (largest, here) in apart.iter_mut().zip(here) {
                if here > largest.0 || here.is_nan() {
                    *largest = (here, index);
                }
            }
            speed = speed.max(a.velocity().norm()).max(b.velocity().norm());
            spin = spin.max(a.angular_velocity().norm()).max(b.angular_velocity().norm());
        }
        (self.speed, self.spin, self.now) = (speed, spin, apart[0].0);
        for (k, unit) in [1.0, speed, spin].into_iter().enumerate() {
            let (difference, index) = apart[k];
            // Particles at rest in both have no speed to divide by.
            if difference > 0.0 || difference.is_nan() {
                let value = difference / unit;
                self.largest[k] = self.largest[k].max(value);
                if value > PARTED && self.parting[k].is_none() {
                    let [a, b] = [0, 1].map(|engine| &self.particles(engine)[index]);
                    let touching = [a, b].iter().any(|p| p.contact_force.iter().any(|f| *f != 0.0));
                    let (step, id, position) = (self.steps[0], a.id, a.position);
                    self.parting[k] = Some(Difference { value, step, id, position, touching });
                }
            }
        }
        for (engine, first) in self.engines.iter().zip(&mut self.first_contact) {
            let now = engine.contacts();
            if first.is_none() && (now.count > 0 || now.begun > 0) {
                *first = Some(self.steps[0]);
            }
        }
    }

    /// Checks that the native engine repeats the recorded run.
    pub(super) fn check_repeats(&self, findings: &mut Findings, recorded: &Recording) {
        let different = recorded.last.iter().zip(self.particles(0)).filter(|(a, b)| a != b).count();
        let quantity = "particles that do not repeat the recorded run (-)";
        findings.given(quantity, [None; 3], different as f64, REPEATS);
    }

    pub(super) fn begun(&self) -> [f64; 2] {
        self.engines.each_ref().map(|engine| engine.contacts().begun as f64)
    }

    /// Reports the contacts that have begun in both engines.
    pub(super) fn report_begun(&self, findings: &mut Findings) {
        let [native, other] = self.begun();
        let values = [Some(native), Some(other), None];
        findings.given("contacts that began (-)", values, (native - other).abs(), BEGUN);
    }
}
