//! Loads of the fluid on the particles of a four-way run, in double precision.

use turbid::case::Setup;
use turbid::comm::try_on_threads;
use turbid::dem::Load;
use turbid::engine::EngineChoice;
use turbid::error::{Error, Result};
use turbid::fluid::Precision;
use turbid::particle::Particle;
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

/// Runs `steps` of a case with the native engine, on as many ranks as it asks for, and records its loads.
pub(super) fn record(setup: &Setup, steps: u64) -> Result<Recording> {
    let mut setup = setup.clone();
    (setup.plan.precision, setup.engine) = (Precision::F64, EngineChoice::Native);
    let decomposition = decompose(&setup)?;
    // The loads by step and id, and the particles that the rank owns at the end.
    let ranks = try_on_threads(decomposition.ranks(), |comm| {
        let mut run = Simulation::new(&setup, &decomposition, comm)?;
        let mut tape = Vec::new();
        for step in 0..steps {
            run.step()?;
            tape.extend(run.loads().map(|(id, load)| (step, id, load)));
        }
        run.check()?;
        Ok((tape, run.particles().to_vec()))
    })?;
    let (mut tapes, mut last, mut failure) = (Vec::new(), Vec::new(), None);
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
    last.sort_unstable_by_key(|particle: &Particle| particle.id);
    let particles = setup.particles.len();
    assert_eq!(tapes.len() as u64, steps * particles as u64, "every particle has one owner");
    Ok(Recording { loads: tapes.into_iter().map(|(.., load)| load).collect(), particles, last })
}
