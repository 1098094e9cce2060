//! The loads of small four-way runs, recorded and replayed through both engines: without contacts against the exact
//! motion, with elastic contacts, and with damped ones that rub.

use super::compare::{Comparison, Pair};
use super::record::{Recording, record};
use super::{liggghts, native};
use crate::case::{self, Setup};
use crate::crosscheck::{Check, Findings, Overlay};
use crate::dem::Load;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::Particle;
use std::path::Path;

/// Id of the case.
const ID: &str = "replay";

/// Spheres that come through a periodic box of fluid from all sides.
const CASE: &str = r#"
[domain]
size = { diameters = [4, 4, 4] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 8
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 12
seed = 5
minimum_gap = 4.5e-4
[contact]
youngs_modulus = 5e5
poisson_ratio = 0.25
restitution = 1.0
friction_static = 0.0
friction_kinetic = 0.0
enlargement = 0.0
law = "hertz"
damping = "tsuji"
substeps = 20
[driving]
gravity = 9.80665
zero_net_flux = true
[run]
end = { steps = 60 }
"#;

/// Forty spheres close to each other.
const DENSE: [&str; 2] = ["particles.0.count=40", "particles.0.minimum_gap=2e-5"];
/// Impacts that dissipate, along the normal and by friction.
const RUBBING: [&str; 4] = [
    "contact.restitution=0.8",
    "contact.friction_static=0.3",
    "contact.friction_kinetic=0.3",
    "contact.transition_velocity=1e-4",
];

/// Cells per step of the spheres at the start: so slow that those with gaps do not meet, and so fast that the others do.
const SPEEDS: [f64; 2] = [0.02, 0.05];

/// Differences of a motion without contacts over the diameter, the largest speed and the largest spin.
const FREE: f64 = 1e-11;
/// Of elastic impacts: rounding of 1e-15, that every impact multiplies by about ten, and each sphere has some three.
const ELASTIC: f64 = 1e-12;
/// Of momentum over the sum of its absolute values.
const MOMENTUM: f64 = 1e-11;

/// Records and replays; what LIGGGHTS says goes to the directory, if there is one.
pub fn replay(directory: Option<&Path>) -> Result<Findings> {
    let log = directory.map(|directory| directory.join("replay.log"));
    let log = log.as_deref();
    let mut found = free(log)?;
    let elastic = Scene::new(&DENSE, SPEEDS[1])?.replay(log)?;
    let rubbing = Scene::new(&[&DENSE[..], &RUBBING].concat(), SPEEDS[1])?.replay(log)?;
    for (what, scene) in [("elastic", &elastic), ("damped", &rubbing)] {
        found.checks.push(scene.repeats(what));
        found.checks.push(scene.momentum(what));
        found.checks.extend(scene.contacts(what)?);
        found.checks.push(scene.distance(what));
    }
    found.overlays.extend(elastic.overlays("elastic"));
    found.overlays.extend(rubbing.overlays("damped"));
    found.moments = rubbing.found.moments;
    Ok(found)
}

/// A check with the usual columns empty.
fn check(quantity: String, difference: f64, tolerance: f64, reason: &'static str) -> Check {
    Check {
        case: ID,
        quantity,
        native: None,
        liggghts: None,
        analytic: None,
        difference,
        tolerance,
        reason,
        pass: difference <= tolerance,
    }
}

/// A run that is recorded, and its replay.
struct Scene {
    setup: Setup,
    recorded: Recording,
    steps: u64,
}

impl Scene {
    fn new(options: &[&str], speed: f64) -> Result<Self> {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        let mut setup = case::from_text(CASE, ID, &options)?;
        setup.plan.threads = 1;
        stir(&mut setup, speed);
        let steps = setup.plan.end_step;
        Ok(Self {
            recorded: record(&setup, steps)?,
            setup,
            steps,
        })
    }

    fn pair(&self, log: Option<&Path>) -> Result<Pair> {
        Ok(Pair::new(
            &self.setup,
            self.steps,
            [native(&self.setup)?, liggghts(&self.setup, log)?],
        ))
    }

    fn replay(self, log: Option<&Path>) -> Result<Replayed> {
        let mut pair = self.pair(log)?;
        for step in 0..self.steps {
            if !pair.advance(self.recorded.loads(step)) {
                break;
            }
        }
        let found = pair.finish();
        if let Some((engine, error)) = found.failures.first() {
            return Err(Error::Input(format!("{engine}: {error}")));
        }
        Ok(Replayed {
            last: [0, 1].map(|engine| pair.particles(engine).to_vec()),
            scene: self,
            found,
        })
    }
}

/// Gives the spheres velocities and spins in all directions, up to `speed` (cells per step) along each axis.
fn stir(setup: &mut Setup, speed: f64) {
    let velocity = speed * setup.domain.dx / setup.time_step;
    let mut state = 7_u64;
    let mut any = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((state >> 33) as f64 + 0.5) / f64::from(1_u32 << 30) - 1.0
    };
    for particle in &mut setup.particles {
        let radius = 0.5
            * setup.templates[particle.template as usize]
                .shape
                .equivalent_diameter();
        particle.velocity = std::array::from_fn(|_| velocity * any());
        particle.angular_velocity = std::array::from_fn(|_| velocity / radius * any());
    }
}

/// The exact motion under loads that are constant over each step.
struct Exact {
    /// Position (m, not wrapped), velocity, angular velocity.
    states: Vec<[Vec3; 3]>,
    /// Mass and moment of inertia.
    inertias: Vec<(f64, f64)>,
}

impl Exact {
    fn new(setup: &Setup) -> Self {
        let state = |p: &Particle| [p.position(), p.velocity(), p.angular_velocity()];
        let inertia = |p: &Particle| {
            let template = &setup.templates[p.template as usize];
            (template.mass(), template.inertia().x)
        };
        Self {
            states: setup.particles.iter().map(state).collect(),
            inertias: setup.particles.iter().map(inertia).collect(),
        }
    }

    fn advance(&mut self, loads: &[Load], gravity: Vec3, dt: f64) {
        for (([x, v, w], load), (mass, inertia)) in self.states.iter_mut().zip(loads).zip(&self.inertias) {
            let acceleration = load.force / *mass + gravity;
            *x += *v * dt + acceleration * (0.5 * dt * dt);
            *v += acceleration * dt;
            *w += load.torque * (dt / inertia);
        }
    }
}

/// Largest differences of position (m), velocity (m/s) and spin (1/s).
type Errors = [f64; 3];

/// Spheres that do not touch: both engines must follow the exact motion.
fn free(log: Option<&Path>) -> Result<Findings> {
    let scene = Scene::new(&[], SPEEDS[0])?;
    let mut pair = scene.pair(log)?;
    let setup = &scene.setup;
    let mut exact = Exact::new(setup);
    let mut errors: [Errors; 3] = [[0.0; 3]; 3];
    let mut largest: Errors = [setup.diameter, 0.0, 0.0];
    let start = pair.particles(0)[0].position();
    let mut ways = [(); 3].map(|()| vec![[0.0, 0.0]]);
    for step in 0..scene.steps {
        let loads = scene.recorded.loads(step);
        exact.advance(loads, setup.gravity, setup.time_step);
        if !pair.advance(loads) {
            break;
        }
        let state = |p: &Particle| [p.position(), p.velocity(), p.angular_velocity()];
        let states = [0, 1].map(|engine| pair.particles(engine).iter().map(state).collect::<Vec<_>>());
        for (error, [a, b]) in errors.iter_mut().zip([
            [&states[0], &exact.states],
            [&states[1], &exact.states],
            [&states[0], &states[1]],
        ]) {
            for (a, b) in a.iter().zip(b) {
                error[0] = error[0].max(
                    setup
                        .domain
                        .nearest_image(setup.domain.wrap(a[0]) - setup.domain.wrap(b[0]))
                        .norm(),
                );
                error[1] = error[1].max((a[1] - b[1]).norm());
                error[2] = error[2].max((a[2] - b[2]).norm());
            }
        }
        for [_, v, w] in &exact.states {
            (largest[1], largest[2]) = (largest[1].max(v.norm()), largest[2].max(w.norm()));
        }
        let time = (step + 1) as f64 * setup.time_step;
        for (way, states) in ways.iter_mut().zip([&states[0], &states[1], &exact.states]) {
            way.push([time, setup.domain.nearest_image(states[0][0] - start).z]);
        }
    }
    let found = pair.finish();
    if let Some((engine, error)) = found.failures.first() {
        return Err(Error::Input(format!("{engine}: {error}")));
    }
    let touched = found
        .first_contact
        .map(|first| f64::from(u8::from(first.is_some())));
    let mut checks = vec![Check {
        native: Some(touched[0]),
        liggghts: Some(touched[1]),
        analytic: Some(0.0),
        ..check(
            "free: contacts (-)".to_string(),
            touched[0] + touched[1],
            0.0,
            "the spheres start so far from each other that none meets another",
        )
    }];
    for (i, quantity) in [
        "position less exact, over D",
        "velocity less exact, over u_max",
        "spin less exact, over w_max",
    ]
    .into_iter()
    .enumerate()
    {
        let [native, liggghts, between] = errors.map(|error| error[i] / largest[i]);
        checks.push(Check {
            native: Some(native),
            liggghts: Some(liggghts),
            analytic: Some(0.0),
            ..check(
                format!("free: {quantity} (-)"),
                native.max(liggghts).max(between),
                FREE,
                "largest of both errors and of the difference between the engines; loads are constant over a step, so the motion \
                 is a parabola in each, and 1200 sub-steps leave rounding only",
            )
        });
    }
    let names = ["native", "LIGGGHTS", "analytic"];
    Ok(Findings {
        checks,
        overlays: vec![Overlay {
            name: "free_position".to_string(),
            title: "replay: a free sphere under the recorded loads".to_string(),
            axes: ["time t (s)".to_string(), "height z - z_0 (m)".to_string()],
            logarithmic: [false; 2],
            curves: names.map(str::to_string).into_iter().zip(ways).collect(),
        }],
        moments: Vec::new(),
    })
}

/// A replay with contacts.
struct Replayed {
    scene: Scene,
    found: Comparison,
    last: [Vec<Particle>; 2],
}

impl Replayed {
    /// The native engine repeats the run.
    fn repeats(&self, what: &str) -> Check {
        let different = self
            .scene
            .recorded
            .last
            .iter()
            .zip(&self.last[0])
            .filter(|(a, b)| a != b);
        check(
            format!("{what}: particles that do not repeat the run (-)"),
            different.count() as f64,
            0.0,
            "the native engine under recorded loads repeats the recorded run bit for bit",
        )
    }

    /// Contacts exchange momentum and give none: what is gained is what the loads gave.
    fn momentum(&self, what: &str) -> Check {
        let Scene {
            setup,
            recorded,
            steps,
        } = &self.scene;
        let mass = |p: &Particle| setup.templates[p.template as usize].mass();
        let momentum =
            |particles: &[Particle]| -> Vec3 { particles.iter().map(|p| p.velocity() * mass(p)).sum() };
        let size =
            |particles: &[Particle]| -> f64 { particles.iter().map(|p| p.velocity().norm() * mass(p)).sum() };
        let weight: Vec3 = setup.particles.iter().map(|p| setup.gravity * mass(p)).sum();
        let loads: Vec3 = (0..*steps)
            .flat_map(|step| recorded.loads(step))
            .map(|load| load.force)
            .sum();
        let given = (loads + weight * *steps as f64) * setup.time_step;
        let exact = momentum(&setup.particles) + given;
        let scale = size(&setup.particles);
        let errors = self
            .last
            .each_ref()
            .map(|last| (momentum(last) - exact).norm() / scale);
        Check {
            native: Some(momentum(&self.last[0]).z),
            liggghts: Some(momentum(&self.last[1]).z),
            analytic: Some(exact.z),
            ..check(
                format!("{what}: momentum along z (kg m/s)"),
                errors[0].max(errors[1]),
                MOMENTUM,
                "vector difference to start and loads, over the sum of all momenta at the start: forces of contact are opposite, so \
                 1200 sub-steps leave rounding only",
            )
        }
    }

    /// When the first spheres touch, and how many contacts begin.
    fn contacts(&self, what: &str) -> Result<[Check; 2]> {
        let [Some(native), Some(liggghts)] = self.found.first_contact else {
            return Err(Error::Input(format!(
                "{what}: nothing touches, so there is nothing to compare"
            )));
        };
        let steps = [native, liggghts].map(|step| step as f64);
        let begun = self.found.begun.map(|count| count as f64);
        Ok([
            Check {
                native: Some(steps[0]),
                liggghts: Some(steps[1]),
                ..check(
                    format!("{what}: steps to the first contact (-)"),
                    (steps[0] - steps[1]).abs(),
                    1.0,
                    "the native engine counts the contacts at the start of its last sub-step, LIGGGHTS those at its end",
                )
            },
            Check {
                native: Some(begun[0]),
                liggghts: Some(begun[1]),
                ..check(
                    format!("{what}: contacts that begin (-)"),
                    (begun[0] - begun[1]).abs(),
                    f64::INFINITY,
                    "reported only: the native engine looks at every sub-step, LIGGGHTS at every step",
                )
            },
        ])
    }

    fn distance(&self, what: &str) -> Check {
        let apart = self
            .found
            .samples
            .iter()
            .map(|s| s.apart.position)
            .fold(0.0, f64::max);
        let quantity = format!("{what}: largest distance between the engines over D (-)");
        if what == "elastic" {
            return check(
                quantity,
                apart,
                ELASTIC,
                "the same law (Hertz, elastic, no friction) in the same leapfrog scheme: rounding of 1e-15, ten times larger with every \
                 impact, and each sphere has some three",
            );
        }
        check(
            quantity,
            apart,
            f64::INFINITY,
            "reported only: the engines have different laws of friction",
        )
    }

    fn overlays(&self, what: &str) -> Vec<Overlay> {
        let dt = self.scene.setup.time_step;
        let series = |value: &dyn Fn(&super::compare::Sample) -> f64| -> Vec<[f64; 2]> {
            self.found
                .samples
                .iter()
                .map(|s| [s.step as f64 * dt, value(s)])
                .collect()
        };
        let axes = |quantity: &str| ["time t (s)".to_string(), quantity.to_string()];
        vec![
            Overlay {
                name: format!("{what}_energy"),
                title: format!("replay, {what} contacts: mean kinetic energy of a sphere"),
                axes: axes("energy E (J)"),
                logarithmic: [false; 2],
                curves: vec![
                    ("native".to_string(), series(&|s| s.energy[0])),
                    ("LIGGGHTS".to_string(), series(&|s| s.energy[1])),
                ],
            },
            Overlay {
                name: format!("{what}_apart"),
                title: format!("replay, {what} contacts: largest distance between the engines"),
                axes: axes("distance / D (-)"),
                logarithmic: [false, true],
                curves: vec![("distance / D".to_string(), series(&|s| s.apart.position))],
            },
        ]
    }
}
