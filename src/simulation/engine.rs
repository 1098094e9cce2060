//! The engine that a case asks for.

mod whole;

use super::run;
use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::{DemEngine, Native, NativeParams};
use crate::domain::Decomposition;
use crate::engine::EngineChoice;
use crate::engine::process::{External, ExternalParams};
use crate::error::Result;
use crate::memory;
use crate::particle::Particle;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use whole::Whole;

/// The engine that a case asks for, with its particles at the start, on one rank; `log` is the file for what it prints. A program that
/// the case names may run. An engine [in parts](EngineChoice::is_in_parts) has one in each process of an MPI job, and every process sees
/// it as a whole: its calls are collective then.
///
/// # Errors
/// As [`with_any_engine`](super::Simulation::with_any_engine); [`Error::Input`](crate::Error::Input) if the box has no room for blocks of these processes.
pub fn engine_of(setup: &Setup, log: Option<PathBuf>) -> Result<Box<dyn DemEngine>> {
    let context = Context { allowed: true, log, ..Context::default() };
    let solo = || engine(setup, &Decomposition::solo(setup.domain), &Comm::Solo, &context);
    if !setup.engine.is_in_parts() {
        return solo();
    }
    let comm = run::job()?;
    if comm.size() == 1 {
        return solo();
    }
    let cut = run::decompose(setup)?;
    let parts = engine(setup, &cut, &comm, &context)?;
    Ok(Box::new(Whole::new(parts, comm)))
}

/// Copies of what an engine has saved while a checkpoint is written.
const SAVED_COPIES: f64 = 4.0;

/// Data of the run for an external engine.
#[derive(Clone, Debug, Default)]
pub(super) struct Context {
    /// True if a program that the case names may run.
    pub(super) allowed: bool,
    /// True if the run is resumed: the engine is then restored before anything else.
    pub(super) resumes: bool,
    /// File for what it prints.
    pub(super) log: Option<PathBuf>,
    /// Set when the run shall stop.
    pub(super) stop: Arc<AtomicBool>,
}

/// The rank in whose block a particle of a case begins.
pub(super) fn owner(cut: &Decomposition, particle: &Particle) -> usize {
    if cut.ranks() == 1 { 0 } else { cut.owner(cut.domain.wrap(particle.position())) }
}

/// The particles of the case that this rank hands over: all that it has of a case that is divided, else those that begin in its block.
pub(super) fn handed(setup: &Setup, cut: &Decomposition, comm: &Comm) -> Vec<Particle> {
    let is_here = |particle: &&Particle| setup.placed.is_some() || owner(cut, particle) == comm.rank();
    setup.particles.iter().filter(is_here).copied().collect()
}

/// The engine with the particles of the case. Errors: [`crate::Error::Input`] if this program was built without the engine; those of the
/// engine. Collective.
pub(super) fn engine(
    setup: &Setup,
    decomposition: &Decomposition,
    comm: &Comm,
    context: &Context,
) -> Result<Box<dyn DemEngine>> {
    crate::engine::refuse_unusable(&setup.engine, context.allowed)?;
    let (templates, decomposition) = (setup.templates.clone(), decomposition.clone());
    let handed = handed(setup, &decomposition, comm);
    let external = |params: ExternalParams| -> Result<Box<dyn DemEngine>> {
        let params = ExternalParams {
            contact: setup.contact.clone(),
            walls: setup.walls.clone(),
            gravity: setup.gravity,
            substeps: setup.substeps,
            resumes: context.resumes,
            ..params
        };
        let (templates, decomposition) = (templates.clone(), decomposition.clone());
        Ok(Box::new(External::new(params, decomposition, comm, templates, &handed)?))
    };
    match &setup.engine {
        #[cfg(feature = "liggghts")]
        EngineChoice::Liggghts(options) => {
            use crate::engine::liggghts::{Liggghts, LiggghtsParams};
            let params = LiggghtsParams {
                contact: setup.contact.clone(),
                walls: setup.walls.clone(),
                gravity: setup.gravity,
                substeps: setup.substeps,
                log: context.log.clone(),
                resumes: context.resumes,
                stop: Arc::clone(&context.stop),
                ..options.params()?
            };
            Ok(Box::new(Liggghts::new(params, decomposition, comm, templates, &handed)?))
        }
        #[cfg(not(feature = "liggghts"))]
        EngineChoice::Liggghts(_) => unreachable!("refused above"),
        EngineChoice::Lammps(options) => {
            external(options.params(context.log.clone(), Arc::clone(&context.stop)))
        }
        EngineChoice::Process(options) => {
            let memory = (memory::left() / SAVED_COPIES) as u64;
            let params = options.params(context.log.clone(), Arc::clone(&context.stop));
            external(ExternalParams { memory, ..params })
        }
        EngineChoice::Native => {
            Ok(Box::new(native(setup, &decomposition, comm.rank())?.with(comm, &handed)?))
        }
    }
}

/// The native engine of a rank, with nothing to move yet.
pub(super) fn native(setup: &Setup, cut: &Decomposition, rank: usize) -> Result<Native> {
    let params = NativeParams {
        contact: setup.contact.clone(),
        walls: setup.walls.clone(),
        gravity: setup.gravity,
        substeps: setup.substeps,
        motions: setup.motions.clone(),
        sums_facets: setup.plan.output.wear_every > 0,
    };
    Native::new(params, cut.clone(), rank, setup.templates.clone(), &[])
}
