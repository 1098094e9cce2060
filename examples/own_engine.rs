//! An engine of one's own moves the particles: a sphere oscillates as prescribed, and the fluid's resistance is read.
//!
//! `cargo run --release --example own_engine` prints
//!
//! ```text
//! time / period  displacement / amplitude  force / (displaced mass * acceleration)
//!         0.125                     0.707                                   -0.027
//!         0.250                     1.000                                    1.421
//!         0.375                     0.707                                    1.974
//!         0.500                    -0.000                                    1.158
//!         0.625                    -0.707                                    0.071
//!         0.750                    -1.000                                   -1.007
//!         0.875                    -0.707                                   -1.910
//!         1.000                    -0.000                                   -0.975
//!         1.125                     0.707                                    0.306
//!         1.250                     1.000                                    1.109
//!         1.375                     0.707                                    2.017
//!         1.500                     0.000                                    1.005
//!         1.625                    -0.707                                    0.191
//!         1.750                    -1.000                                   -1.143
//!         1.875                    -0.707                                   -1.804
//!         2.000                     0.000                                   -1.155
//! ```

use std::f64::consts::PI;
use turbid::comm::{Comm, SavedParts};
use turbid::dem::{ContactState, ContactSummary, DemEngine, Load};
use turbid::domain::Decomposition;
use turbid::particle::ParticleStore;
use turbid::shape::Shape;
use turbid::{Builder, Error, Particles, Result, Setup, Simulation};

/// Moves all particles along x, `x = x0 + a sin(w t)`, whatever acts on them. For one rank.
struct Shaker {
    store: ParticleStore,
    /// Positions along x at the start (m).
    middle: Vec<f64>,
    /// `a` (m).
    amplitude: f64,
    /// `w` (1/s).
    frequency: f64,
    /// Time since the start (s).
    time: f64,
}

impl Shaker {
    fn new(setup: &Setup, amplitude: f64, frequency: f64) -> Self {
        let particles = setup.particles.clone();
        Self {
            middle: particles.iter().map(|particle| particle.position[0]).collect(),
            store: ParticleStore {
                templates: setup.templates.clone(),
                owned: particles.len(),
                owners: vec![0; particles.len()],
                particles,
            },
            amplitude,
            frequency,
            time: 0.0,
        }
    }
}

impl DemEngine for Shaker {
    fn name(&self) -> &'static str {
        "shaker"
    }

    fn supports(&self, _: &dyn Shape) -> bool {
        true
    }

    fn particles(&self) -> &ParticleStore {
        &self.store
    }

    fn advance(&mut self, _: &Comm, _: &[Load], dt: f64) -> Result<()> {
        self.time += dt;
        let (sine, cosine) = (self.frequency * self.time).sin_cos();
        for (particle, middle) in self.store.particles.iter_mut().zip(&self.middle) {
            particle.position[0] = middle + self.amplitude * sine;
            particle.velocity[0] = self.amplitude * self.frequency * cosine;
        }
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        ContactSummary::default()
    }

    fn contact_states(&self, _: &Comm) -> Vec<ContactState> {
        Vec::new()
    }

    fn save(&self, _: &Comm) -> Result<Vec<u8>> {
        let (engine, what) = (self.name(), "checkpoints".to_string());
        Err(Error::Unsupported { engine, what })
    }

    fn restore(&mut self, comm: &Comm, _: &SavedParts) -> Result<()> {
        self.save(comm).map(|_| ())
    }
}

/// Returns the largest force over the mass of the displaced fluid times the largest acceleration, in the second period (-).
pub(crate) fn run() -> Result<f64> {
    let sphere = Particles::spheres(1e-3, 2500.0).at([2e-3; 3]);
    let setup = Builder::new([4e-3; 3])
        .fluid(1000.0, 1e-5)
        .lattice(8.0, 0.6)
        .particles(sphere)
        .gravity([0.0; 3])
        .setup()?;
    let (amplitude, period) = (1e-4, 200.0 * setup.time_step);
    let frequency = 2.0 * PI / period;
    let engine = Shaker::new(&setup, amplitude, frequency);
    let whole = Decomposition::solo(setup.domain);
    let mut simulation = Simulation::with_engine(&setup, &whole, Comm::Solo, Box::new(engine))?;
    let unit = 1000.0 * setup.templates[0].shape.volume() * amplitude * frequency * frequency;
    println!("time / period  displacement / amplitude  force / (displaced mass * acceleration)");
    let mut largest = 0.0_f64;
    for n in 1..=16 {
        simulation.advance(25)?;
        let (time, at) = (f64::from(n) / 8.0, simulation.particles()[0].position().x);
        let force = simulation.loads().map(|(_, load)| load.force.x).sum::<f64>() / unit;
        println!("{time:13.3}  {:24.3}  {force:39.3}", (at - 2e-3) / amplitude);
        if n > 8 {
            largest = largest.max(force.abs());
        }
    }
    Ok(largest)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
