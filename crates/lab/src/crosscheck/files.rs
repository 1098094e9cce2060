//! Files of a cross-check beside its tables and plots.
//!
//! ```text
//! DIRECTORY/
//!   crosscheck.csv  crosscheck.json
//!   CASE_NAME.png  CASE_NAME.svg        overlays
//!   CASE_native.pvd    CASE_native/0000.vtp ...
//!   CASE_liggghts.pvd  CASE_liggghts/0000.vtp ...    of LIGGGHTS; other engines have their own ids
//!   logs/                                what the other engine said
//!   engines/                             its program, if this one has brought it along
//! ```

use crate::checks::{Ending, Outcome, write_plots};
use std::path::Path;
use turbid::domain::Domain;
use turbid::error::Result;
use turbid::output::{Collection, surfaces};

/// Writes the plots and trajectories of a case.
///
/// # Errors
/// [`Error::Io`](turbid::error::Error::Io) if one of them cannot be written.
pub fn write_case(directory: &Path, outcome: &Outcome) -> Result<()> {
    write_plots(directory, outcome)?;
    let Ending::Found(found) = &outcome.ending else {
        return Ok(());
    };
    let other = outcome.engine.unwrap_or_default().id;
    for (engine, name) in ["native", other].iter().enumerate() {
        let stem = format!("{}_{name}", outcome.case);
        let mut collection = Collection::new(directory.join(format!("{stem}.pvd")));
        for (number, moment) in found.moments.iter().enumerate() {
            let file = directory.join(&stem).join(format!("{number:04}.vtp"));
            // An open box leaves the positions as they are.
            let open = Domain { cells: [1; 3], dx: 1.0, faces: Domain::faces([false; 3]) };
            surfaces::write_motion(&file, &open, &moment.templates, &moment.particles[engine])?;
            collection.add(moment.time, &file)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
