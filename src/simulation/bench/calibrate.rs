//! Measuring this machine against the built-in costs of a step.

use super::{BenchOptions, bench};
use crate::case;
use crate::comm;
use crate::error::{Error, Result};
use crate::simulation::forecast;
use crate::simulation::work::Calibration;

/// Spheres that fill a fifth of a box too large for caches: what most runs are like.
const CASE: &str = r"
[domain]
size = { diameters = [8, 8, 10] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 12
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
volume_fraction = 0.2
seed = 1
[run]
end = { steps = 100 }
";

/// Times a built-in case on `threads` threads (0 is one per core), in both precisions: a calibration for estimates of later runs,
/// once it is [kept](Calibration::keep). Errors: [`Error::Input`] in an MPI job, or if these are too many threads;
/// [`Error::Memory`].
pub fn calibrate(threads: usize) -> Result<Calibration> {
    if let Some(launched) = comm::launched().filter(|launched| launched.size > 1) {
        return Err(Error::Input(format!(
            "a calibration was started on {} processes, but it is one of threads; start one process, with --threads {}",
            launched.size, launched.size
        )));
    }
    let mut ranks = 1;
    let mut measured_over_estimated = |precision: &str| {
        let mut setup = case::from_text(CASE, "calibration", &[format!("fluid.precision={precision:?}")])?;
        setup.plan.threads = threads;
        let options = BenchOptions { steps: 30, warm_up: 30, no_contact: false, fluid_only: false };
        let report = bench(&setup, &options)?;
        ranks = report.ranks;
        let seconds = report.cells as f64 / (1e6 * report.mlups);
        Ok::<f64, Error>(seconds / forecast(&setup, ranks)?.seconds_per_step())
    };
    let factors = [measured_over_estimated("f32")?, measured_over_estimated("f64")?];
    Ok(Calibration::new(ranks, factors))
}
