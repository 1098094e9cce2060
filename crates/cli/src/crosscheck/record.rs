//! Recording what the fluid does to the particles of a four-way run, in double precision.

use super::tools::Scene;
use std::sync::{Arc, Mutex};
use turbid::case::Setup;
use turbid::comm::{Comm, try_on_threads};
use turbid::dem::{ContactState, ContactSummary, DemEngine, Load, Native};
use turbid::domain::Decomposition;
use turbid::error::{Error, Result};
use turbid::fluid::Precision;
use turbid::particle::{Particle, ParticleStore};
use turbid::shape::Shape;
use turbid::simulation::{Simulation, decompose};

/// Loads of a run.
#[derive(Clone, Debug)]
pub(super) struct Recording {
    /// Step by step, ascending by the id of the particle.
    loads: Vec<Load>,
    particles: usize,
    /// The particles at the end, ascending by id.
    pub(super) last: Vec<Particle>,
}

impl Recording {
    /// The loads of a step, ascending by the id of the particle.
    pub(super) fn loads(&self, step: u64) -> &[Load] {
        &self.loads[step as usize * self.particles..][..self.particles]
    }
}

/// Loads of one rank, by step and id.
type Tape = Vec<(u64, u64, Load)>;

/// An engine that writes down the loads it is given, and leaves everything else to another one.
struct Recorder {
    engine: Box<dyn DemEngine>,
    step: u64,
    tape: Arc<Mutex<Tape>>,
}

impl DemEngine for Recorder {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        self.engine.supports(shape)
    }

    fn particles(&self) -> &ParticleStore {
        self.engine.particles()
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let owned = self.engine.particles().owned().iter();
        let entries = owned.zip(loads).map(|(particle, load)| (self.step, particle.id, *load));
        self.tape.lock().expect("nobody panics with the tape").extend(entries);
        self.step += 1;
        self.engine.advance(comm, loads, dt)
    }

    fn contacts(&self) -> ContactSummary {
        self.engine.contacts()
    }

    fn contact_states(&self) -> Vec<ContactState> {
        self.engine.contact_states()
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.engine.save()
    }

    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        self.engine.restore(comm, parts)
    }
}

/// Runs a case with the native engine for so many steps, on as many ranks as it asks for, and records its loads.
pub(super) fn record(setup: &Setup, steps: u64) -> Result<Recording> {
    let decomposition = decompose(setup)?;
    let ranks = if decomposition.ranks() == 1 {
        vec![record_rank(setup, steps, &decomposition, Comm::Solo)]
    } else {
        try_on_threads(decomposition.ranks(), |comm| record_rank(setup, steps, &decomposition, comm))?
    };
    let (mut tapes, mut last, mut failure) = (Tape::new(), Vec::new(), None);
    for rank in ranks {
        match rank {
            Ok((tape, particles)) => {
                tapes.extend(tape);
                last.extend(particles);
            }
            // The error of the rank that failed first is the one to show.
            Err(Error::OtherRank) => _ = failure.get_or_insert(Error::OtherRank),
            Err(error) => failure = Some(error),
        }
    }
    if let Some(error) = failure {
        return Err(error);
    }
    tapes.sort_unstable_by_key(|&(step, id, _)| (step, id));
    last.sort_unstable_by_key(|particle| particle.id);
    let particles = setup.particles.len();
    assert_eq!(tapes.len() as u64, steps * particles as u64, "every particle has one owner");
    Ok(Recording { loads: tapes.into_iter().map(|(.., load)| load).collect(), particles, last })
}

/// The part of one rank: the tape, and the particles it owns at the end.
fn record_rank(
    setup: &Setup,
    steps: u64,
    decomposition: &Decomposition,
    comm: Comm,
) -> Result<(Tape, Vec<Particle>)> {
    let (rank, templates) = (comm.rank(), setup.templates.clone());
    let engine = Native::new(
        Scene::of("", setup).native_params(),
        decomposition.clone(),
        rank,
        templates,
        &setup.particles,
    )?;
    let tape = Arc::new(Mutex::new(Tape::new()));
    let recorder = Recorder { engine: Box::new(engine), step: 0, tape: Arc::clone(&tape) };
    let mut setup = setup.clone();
    setup.plan.precision = Precision::F64;
    let mut run = Simulation::with_engine(&setup, decomposition, comm, Box::new(recorder))?;
    for _ in 0..steps {
        run.step()?;
    }
    run.check()?;
    let last = run.dem().particles().owned().to_vec();
    drop(run);
    let tape = std::mem::take(&mut *tape.lock().expect("nobody panics with the tape"));
    Ok((tape, last))
}
