//! Files of a cross-check beside its tables and plots.
//!
//! ```text
//! DIRECTORY/
//!   crosscheck.csv  crosscheck.json
//!   CASE_NAME.png  CASE_NAME.svg        overlays
//!   CASE_native.pvd    CASE_native/0000.vtp ...
//!   CASE_liggghts.pvd  CASE_liggghts/0000.vtp ...
//!   logs/                                what LIGGGHTS said
//! ```

use crate::checks::{Ending, Moment, Outcome, write_plots};
use std::path::Path;
use std::sync::Arc;
use turbid::domain::Domain;
use turbid::error::Result;
use turbid::output::{Collection, surfaces};
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;

/// Names of the engines in files.
const ENGINES: [&str; 2] = ["native", "liggghts"];

/// Writes the plots and trajectories of a case.
///
/// # Errors
/// [`Error::Io`](turbid::error::Error::Io) if one of them cannot be written.
pub fn write_case(directory: &Path, outcome: &Outcome) -> Result<()> {
    write_plots(directory, outcome)?;
    let Ending::Found(found) = &outcome.ending else {
        return Ok(());
    };
    for (engine, name) in ENGINES.iter().enumerate() {
        let stem = format!("{}_{name}", outcome.case);
        let mut collection = Collection::new(directory.join(format!("{stem}.pvd")));
        for (number, moment) in found.moments.iter().enumerate() {
            let file = directory.join(&stem).join(format!("{number:04}.vtp"));
            write_moment(&file, moment, engine)?;
            collection.add(moment.time, &file)?;
        }
    }
    Ok(())
}

/// The spheres of one engine at a moment.
fn write_moment(path: &Path, moment: &Moment, engine: usize) -> Result<()> {
    let mut radii: Vec<f64> = moment.spheres[engine].iter().map(|sphere| sphere.3).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    let templates: Vec<Template> = (radii.iter())
        .map(|&radius| Template { shape: Arc::new(Sphere { radius }), density: 1.0, material: 0 })
        .collect();
    let particles: Vec<Particle> = (0..)
        .zip(&moment.spheres[engine])
        .map(|(id, &(position, velocity, spin, radius))| {
            let template = radii.partition_point(|&known| known < radius);
            let mut particle = Particle::at(id, template, position);
            (particle.velocity, particle.angular_velocity) = (velocity.into(), spin.into());
            particle
        })
        .collect();
    // Positions stay as they are.
    let open = Domain { cells: [1; 3], dx: 1.0, periodic: [false; 3] };
    surfaces::write_motion(path, &open, &templates, &particles)
}

#[cfg(test)]
mod tests;
