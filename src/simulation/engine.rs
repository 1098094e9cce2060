//! The engine that a case asks for.

use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::{DemEngine, EngineChoice, Native, NativeParams};
#[cfg(feature = "liggghts")]
use crate::dem::{Liggghts, LiggghtsParams};
use crate::domain::Decomposition;
use crate::error::Result;
use std::path::Path;

/// The engine with the particles of the case; what an external one prints goes to `log`, if there is one. Collective.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if this program was built without the engine; what the engine says otherwise.
#[cfg_attr(
    not(feature = "liggghts"),
    expect(unused_variables, reason = "only an external engine prints")
)]
pub(super) fn engine(
    setup: &Setup,
    decomposition: &Decomposition,
    comm: &Comm,
    log: Option<&Path>,
) -> Result<Box<dyn DemEngine>> {
    setup.engine.refuse_if_missing()?;
    let (templates, decomposition) = (setup.templates.clone(), decomposition.clone());
    match &setup.engine {
        #[cfg(feature = "liggghts")]
        EngineChoice::Liggghts(options) => {
            let params = LiggghtsParams {
                contact: setup.contact.clone(),
                walls: setup.walls.clone(),
                gravity: setup.gravity,
                substeps: setup.substeps,
                options: options.clone(),
                log: log.map(Path::to_path_buf),
                program: None,
            };
            let engine = Liggghts::new(params, decomposition, comm, templates, &setup.particles)?;
            Ok(Box::new(engine))
        }
        #[cfg(not(feature = "liggghts"))]
        EngineChoice::Liggghts(_) => unreachable!("refused above"),
        EngineChoice::Native => {
            let params = NativeParams {
                contact: setup.contact.clone(),
                walls: setup.walls.clone(),
                gravity: setup.gravity,
                substeps: setup.substeps,
            };
            let engine = Native::new(params, decomposition, comm.rank(), templates, &setup.particles)?;
            Ok(Box::new(engine))
        }
    }
}
