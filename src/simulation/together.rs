//! Cases that the processes of a job read together.

use super::run::{decompose_for, job};
use super::{engine, identity};
use crate::case::{Origin, Placed, Setup, read_from};
use crate::checkpoint;
use crate::comm::Comm;
use crate::error::{Error, Result};
use crate::packing::progress::Follow;
use std::sync::Arc;

/// Reads a case with `--set` options in every process of an MPI job, as [`case::load_followed`](crate::case::load_followed) in one alone. The
/// first process reads positions files and places the particles, some 200 bytes each, and the others get those in their blocks of it: their
/// [`particles`](Setup::particles) are these, and so are its own then. Without an MPI job the case has all. Collective.
///
/// # Errors
/// As [`case::load`](crate::case::load), [`from_text`](crate::case::from_text) and [`from_saved`](crate::case::from_saved), and as
/// [`decompose`](super::decompose), the same on every process.
pub fn read_together(origin: Origin, options: &[String], follow: &mut dyn Follow) -> Result<Setup> {
    read_on(&job()?, origin, options, follow)
}

/// The same on these ranks.
pub(super) fn read_on(
    comm: &Comm,
    origin: Origin,
    options: &[String],
    follow: &mut dyn Follow,
) -> Result<Setup> {
    if comm.ranks_per_process() == comm.size() {
        return read_from(origin, options, (None, follow));
    }
    divide(comm, origin, options, follow)
}

fn divide(comm: &Comm, origin: Origin, options: &[String], follow: &mut dyn Follow) -> Result<Setup> {
    let first = match comm.rank() {
        0 => read_from(origin, options, (None, follow)).and_then(|setup| {
            let cut = decompose_for(&setup, Some(comm.size()))?;
            let placed = Placed::of(&setup, &cut, identity::setup_hash(&setup));
            let message = serde_json::to_vec(&placed).expect("plain data is always JSON");
            // JSON has no infinite numbers.
            if serde_json::from_slice(&message).ok() != Some(placed) {
                return Err(Error::Input(
                    "a number that follows from the particles is not finite".to_string(),
                ));
            }
            Ok(Some((message, setup)))
        }),
        _ => Ok(None),
    };
    let first = agreed_on(comm, first)?;
    let message = first.as_ref().map_or_else(Vec::new, |(message, _)| message.clone());
    let message = comm.all_gather(message).swap_remove(0);
    let placed: Placed = serde_json::from_slice(&message).expect("what the first process has written");
    let placed = Arc::new(placed);
    let setup = match first {
        Some((_, setup)) => Ok(setup),
        None => read_from(origin, options, (Some(&placed), follow)),
    };
    let mut setup = agreed_on(comm, setup)?;
    let cut = placed.cut(setup.domain);
    let all = std::mem::take(&mut setup.particles).into_iter();
    setup.particles = comm.hand_over(all.map(|particle| (engine::owner(&cut, &particle), particle)));
    setup.particles.sort_unstable_by_key(|particle| particle.id);
    setup.placed = Some(placed);
    Ok(setup)
}

/// The result of this process, or on all the error of the first that has failed, with its number. Collective.
pub(super) fn agreed_on<R>(comm: &Comm, result: Result<R>) -> Result<R> {
    let result = result.map_err(|error| match error {
        Error::Agreed { .. } | Error::OtherRank => error,
        error => Error::Agreed {
            code: error.exit_code(),
            text: match comm.rank() {
                0 => error.to_string(),
                rank => format!("rank {rank}: {error}"),
            },
        },
    });
    checkpoint::agreed(comm, result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;
    use crate::comm::on_threads;
    use crate::packing::progress::Unfollowed;
    use crate::simulation::Simulation;

    const CASE: &str = "domain = { size.diameters = [8, 8, 12], periodic = [true, true, false] }\n\
                        fluid = { density = 1000, archimedes = 100 }\n\
                        lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }\n\
                        run.end.steps = 8\n\
                        [[particles]]\n\
                        shape.sphere.diameter = 1e-3\n\
                        density = 2000\n\
                        count = 60\n\
                        [[particles]]\n\
                        shape.cube.edge = 6e-4\n\
                        density = 1500\n\
                        count = 25\n";

    /// The case in each of some processes.
    fn divided(ranks: usize, text: &str) -> Vec<Result<Setup>> {
        on_threads(ranks, |comm| divide(&comm, Origin::Text(text, "apart"), &[], &mut Unfollowed))
    }

    #[test]
    fn every_process_has_the_particles_of_its_block_and_knows_what_follows_from_all() {
        let whole = from_text(CASE, "apart", &[]).unwrap();
        for ranks in [2, 3, 5] {
            let setups: Vec<Setup> = divided(ranks, CASE).into_iter().map(Result::unwrap).collect();
            let cut = decompose_for(&whole, Some(ranks)).unwrap();
            let mut all = Vec::new();
            for (rank, setup) in setups.iter().enumerate() {
                assert_eq!(decompose_for(setup, Some(ranks)).unwrap(), cut);
                assert!(setup.particles.iter().all(|particle| engine::owner(&cut, particle) == rank));
                assert!(setup.particles.len() < whole.particles.len());
                assert_eq!(setup.totals(), whole.totals());
                assert_eq!(setup.start_count(), whole.particles.len());
                assert_eq!(identity(setup), identity(&whole));
                assert_eq!(identity::run_id(setup, "x"), identity::run_id(&whole, "x"));
                all.extend(&setup.particles);
            }
            all.sort_unstable_by_key(|particle: &crate::particle::Particle| particle.id);
            assert_eq!(all, whole.particles);
        }
    }

    #[test]
    fn a_case_that_is_read_together_runs_as_one_that_every_rank_reads() {
        let whole = from_text(CASE, "apart", &["run.threads=3".to_string()]).unwrap();
        let alone = Simulation::on_ranks(&whole, |mut simulation| {
            simulation.advance(8)?;
            Ok(simulation.state_hash())
        });
        let together = on_threads(3, |comm| {
            let setup = divide(&comm, Origin::Text(CASE, "apart"), &[], &mut Unfollowed)?;
            let cut = decompose_for(&setup, Some(3))?;
            let mut simulation = Simulation::new(&setup, &cut, comm)?;
            simulation.advance(8)?;
            Ok::<_, Error>(simulation.state_hash())
        });
        let alone = alone.unwrap();
        assert!(together.into_iter().all(|hash| hash.unwrap() == alone));
    }

    #[test]
    fn a_case_that_one_process_refuses_is_refused_on_all_with_the_same_words() {
        let refused = CASE.replace("count = 60", "count = 6000");
        let words: Vec<String> =
            divided(3, &refused).into_iter().map(|of| of.unwrap_err().to_string()).collect();
        assert!(words[0].contains("particles.0") && words.iter().all(|of| *of == words[0]), "{words:?}");
        let few = CASE
            .replace("[8, 8, 12]", "[2, 2, 3]")
            .replace("count = 60", "count = 1")
            .replace("count = 25", "count = 0");
        let words: Vec<String> =
            divided(40, &few).into_iter().map(|of| of.unwrap_err().to_string()).collect();
        assert!(
            words[0].contains("40 processes are too many") && words.iter().all(|of| *of == words[0]),
            "{words:?}"
        );
    }
}
