//! Particles that come and go during a simulation, with a fluid.

use std::path::Path;
use turbid::case::{self, Setup};
use turbid::math::Vec3;
use turbid::particle::Particle;
use turbid::{Error, Result, Simulation};

/// Heavy and light spheres, of which the light ones have a virtual mass with the coupling "saturated", in a box in which the fluid bears
/// their weight.
const CASE: &str = r"
[domain]
size = { diameters = [4, 4, 6] }
[fluid]
density = 1000.0
viscosity = 1e-5
[lattice]
cells_per_diameter = 4
relaxation_time = 0.6
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
list = [[1e-3, 1e-3, 1e-3], [2.6e-3, 1e-3, 4e-3]]
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 300.0
list = [[1e-3, 3e-3, 2.5e-3]]
[run]
end = { steps = 100 }
";

fn setup(coupling: &str, threads: usize) -> Setup {
    let mut setup = case::from_text(CASE, "population", &[format!("lattice.coupling={coupling}")]).unwrap();
    setup.plan.threads = threads;
    setup
}

fn at(template: usize, x: f64, y: f64, z: f64) -> Particle {
    let velocity = [1e-3 * x, 0.0, -1e-3];
    Particle { velocity, ..Particle::at(0, template, Vec3::new(x, y, z) * 1e-3) }
}

/// Hash of fluid and particles, then loads and particles by template, and the next id.
#[derive(Clone, Debug, PartialEq)]
struct State {
    hash: u64,
    acceleration: Vec3,
    stresslet: [f64; 6],
    counts: Vec<i64>,
    next_id: Option<u64>,
}

fn state(simulation: &mut Simulation) -> State {
    State {
        hash: simulation.state_hash(),
        acceleration: simulation.acceleration(),
        stresslet: simulation.measure().stresslet,
        counts: simulation.counts().to_vec(),
        next_id: simulation.dem().next_id(),
    }
}

/// Particles come twice and go once; a checkpoint is written between two steps, right after a change.
fn changing(setup: &Setup, folder: &Path) -> Result<[State; 2]> {
    Simulation::on_ranks(setup, |mut simulation| {
        let (rank, ranks) = (simulation.comm().rank(), simulation.comm().size());
        simulation.advance(10)?;
        let new = [at(0, 3.0, 3.0, 5.2), at(1, 1.0, 2.9, 4.5), at(0, 2.9, 2.8, 1.0)];
        let own: Vec<Particle> = new.into_iter().skip(rank).step_by(ranks).collect();
        let ids = simulation.insert(&own)?;
        assert!(ids.len() == own.len() && ids.iter().all(|id| (3..6).contains(id)));
        simulation.advance(7)?;
        simulation.remove(if rank == ranks - 1 { &[1, 4] } else { &[] })?;
        let more = [at(1, 2.6, 1.0, 3.0)];
        let last = simulation.insert(if rank == 0 { &more } else { &[] })?;
        assert!(rank > 0 || last == [6], "no id twice: {last:?}");
        simulation.write_checkpoint(folder, setup, b"")?;
        let middle = state(&mut simulation);
        simulation.advance(12)?;
        Ok([middle, state(&mut simulation)])
    })
}

#[test]
fn particles_come_and_go_to_the_same_bits_on_1_to_4_ranks_and_from_a_checkpoint_in_between() {
    for coupling in ["saturated", "homogenised"] {
        let folder = tempfile::tempdir().unwrap();
        let path = |ranks: usize| folder.path().join(ranks.to_string());
        let alone = changing(&setup(coupling, 1), &path(1)).unwrap();
        assert_eq!(alone[0].counts.iter().sum::<i64>(), 5, "3 + 3 - 2 + 1");
        assert_ne!(alone[0].acceleration, alone[1].acceleration);
        for ranks in [2, 4] {
            let setup = setup(coupling, ranks);
            assert_eq!(changing(&setup, &path(ranks)).unwrap(), alone, "{coupling}, {ranks} ranks");
        }
        for (writers, readers) in [(1, 2), (2, 1), (4, 2)] {
            let setup = setup(coupling, readers);
            let resumed = Simulation::on_ranks(&setup, |mut simulation| {
                simulation.read_checkpoint(&path(writers), &setup)?;
                let middle = state(&mut simulation);
                simulation.advance(12)?;
                Ok([middle, state(&mut simulation)])
            });
            assert_eq!(resumed.unwrap(), alone, "{coupling}, from {writers} to {readers} ranks");
        }
    }
}

#[test]
fn the_fluid_bears_the_weight_of_the_particles_that_are_there() {
    let mut simulation = Simulation::solo(&setup("saturated", 1)).unwrap();
    let before = simulation.acceleration();
    let ids = simulation.insert(&[at(0, 3.0, 3.0, 5.2)]).unwrap();
    assert!(simulation.acceleration().z > 1.3 * before.z, "three spheres for two, one light one");
    simulation.remove(&ids).unwrap();
    assert_eq!(simulation.acceleration(), before);
}

#[test]
fn particles_that_cannot_come_or_go_are_refused_on_every_rank_and_change_nothing() {
    let setup = setup("saturated", 2);
    let said = Simulation::on_ranks(&setup, |mut simulation| {
        simulation.advance(4)?;
        let before = simulation.state_hash();
        let first = simulation.comm().rank() == 0;
        let refused = |result: Result<()>| {
            let error = result.unwrap_err();
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        };
        let mut said = Vec::new();
        for new in [
            at(0, 1.2, 1.0, 1.0),
            at(7, 3.0, 3.0, 5.0),
            at(0, f64::NAN, 1.0, 1.0),
            Particle { velocity: [9.0, 0.0, 0.0], ..at(0, 3.0, 3.0, 5.0) },
        ] {
            said.push(refused(
                simulation.insert(if first { std::slice::from_ref(&new) } else { &[] }).map(|_| ()),
            ));
        }
        said.push(refused(simulation.remove(if first { &[9] } else { &[0] })));
        assert_eq!((simulation.state_hash(), simulation.counts()), (before, &[2, 1][..]));
        Ok(said)
    });
    let words = ["would overlap particle", "no kind 7", "not finite", "cells in a step", "no particle 9"];
    for (said, words) in said.unwrap().iter().zip(words) {
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn a_simulation_whose_particles_the_caller_moves_takes_more_of_them() {
    let setup = setup("saturated", 1);
    let cut = turbid::domain::Decomposition::solo(setup.domain);
    let mut simulation = Simulation::caller_driven(&setup, &cut, turbid::comm::Comm::Solo).unwrap();
    simulation.advance(3).unwrap();
    assert_eq!(simulation.insert(&[at(0, 3.0, 3.0, 5.2)]).unwrap(), [3]);
    simulation.advance(1).unwrap();
    assert_eq!((simulation.particles().len(), simulation.loads().count()), (4, 4));
    assert!(matches!(simulation.remove(&[8]), Err(Error::Input(_))));
}
