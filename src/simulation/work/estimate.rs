//! Time of a step: the [forecast](super::Forecast) of the slowest rank.

use super::Work;
use crate::case::Setup;
use crate::comm;
use crate::error::Result;
use crate::simulation::decompose;

/// Time of a step, estimated from the particles and walls at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeEstimate {
    /// Of a step (s).
    pub seconds_per_step: f64,
    /// Number of ranks, threads or processes.
    pub ranks: usize,
}

/// Time of a step of a case on the ranks that it asks for, or [`Error::Input`](crate::Error::Input) if these are too many.
pub fn time_estimate(setup: &Setup) -> Result<TimeEstimate> {
    let cut = decompose(setup)?;
    let ranks = cut.ranks();
    // Threads may share cores; the cores of processes are unknown.
    let turns = match comm::launched() {
        Some(launched) if launched.size > 1 => 1.0,
        _ => (ranks as f64 / cores() as f64).max(1.0),
    };
    Ok(TimeEstimate { seconds_per_step: turns * Work::of(setup).forecast(&cut).seconds_per_step(), ranks })
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::seconds_of_files;
    use crate::simulation::work::tests::suspension;

    #[test]
    fn rows_fields_and_surfaces_take_time_as_often_as_they_are_written() {
        let mut setup = suspension();
        let plan = &mut setup.plan;
        plan.end_step = 1000;
        plan.output.series_every = 1000;
        for every in [
            &mut plan.output.fields_every,
            &mut plan.output.particles_every,
            &mut plan.output.surfaces_every,
            &mut plan.output.contacts_every,
            &mut plan.output.picture_every,
        ] {
            *every = 0;
        }
        let least = seconds_of_files(&setup);
        setup.plan.output.series_every = 5;
        let rows = seconds_of_files(&setup);
        assert!((rows / least - 201.0 / 2.0).abs() < 1e-9, "{rows} {least}");
        setup.plan.output.fields_every = 100;
        assert!(seconds_of_files(&setup) > rows);
    }

    #[test]
    fn a_suspension_takes_longer_than_its_fluid_and_on_one_core_not_much_more() {
        let mut setup = suspension();
        setup.plan.threads = 1;
        let cells = setup.domain.cell_count() as f64;
        let forecast = crate::simulation::forecast(&setup, 1).unwrap();
        let each = forecast.seconds_per_step() / cells;
        assert!((5e-9..20e-9).contains(&each), "{each}");
        assert_eq!(time_estimate(&setup).unwrap().ranks, 1);
    }
}
