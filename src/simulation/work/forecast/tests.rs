use crate::comm::Comm;
use crate::dem::assign::GhostLayer;
use crate::dem::exchange::LocalParticles;
use crate::domain::Decomposition;
use crate::simulation::work::Work;
use crate::simulation::work::radii;
use crate::simulation::work::tests::{bed, suspension};

#[test]
fn all_cells_particles_and_contacts_are_somebodys_and_ghosts_are_those_of_the_engine() {
    for setup in [bed(), suspension()] {
        let work = Work::of(&setup);
        let weights = work.weights(&Comm::Solo);
        for ranks in [1, 2, 3, 5, 8, 12] {
            let cut = Decomposition::balanced(setup.domain, ranks, &weights).unwrap();
            let forecast = work.forecast(&cut);
            assert_eq!((forecast.ranks.len(), forecast.grid), (ranks, cut.grid));
            let sum = |of: fn(&super::RankForecast) -> usize| forecast.ranks.iter().map(of).sum::<usize>();
            assert_eq!(sum(super::RankForecast::cells), setup.domain.cell_count());
            assert_eq!(sum(|rank| rank.particles), setup.particles.len());
            assert_eq!(sum(|rank| rank.contacts), work.contacts.len());
            let covered: f64 = forecast.ranks.iter().map(|rank| rank.covered).sum();
            let all: f64 = work.bodies.iter().map(|body| body.covered).sum();
            assert!((covered / all - 1.0).abs() < 1e-9);
            for (rank, forecast) in forecast.ranks.iter().enumerate() {
                let near = GhostLayer::new(cut.clone(), rank, &radii(&setup));
                let population = LocalParticles::new(&near, setup.templates.clone(), setup.particles.clone());
                let (owned, known) = (population.store.owned, population.store.particles.len());
                assert_eq!((forecast.particles, forecast.ghosts), (owned, known - owned));
                assert!(near.peers.iter().all(|peer| forecast.sends[peer].messages >= 3));
            }
        }
    }
}

#[test]
fn populations_that_cross_are_the_same_number_both_ways_and_five_per_cell_of_a_face() {
    let setup = suspension();
    let work = Work::of(&setup);
    let cut = Decomposition::with_cuts(setup.domain, [vec![0, 20, 48], vec![0, 9, 30, 48], vec![0, 40, 96]]);
    let ranks = work.forecast(&cut).ranks;
    for (rank, forecast) in ranks.iter().enumerate() {
        for (peer, to) in &forecast.sends {
            assert_eq!(to.halo, ranks[*peer].sends[&rank].halo, "{rank} {peer}");
        }
    }
    let halves = Decomposition::with_grid(setup.domain, [1, 1, 2]);
    let halo = work.forecast(&halves).ranks[0].sends[&1].halo;
    // Two faces; in a periodic box what leaves a face sideways enters it again on the other side.
    assert_eq!(halo, 2 * 4 * 5 * 48 * 48);
}

#[test]
fn a_bed_is_shared_out_better_than_by_equal_blocks() {
    let setup = bed();
    let work = Work::of(&setup);
    for ranks in 2..=8 {
        let cut = Decomposition::balanced(setup.domain, ranks, &work.weights(&Comm::Solo)).unwrap();
        let balanced = work.forecast(&cut);
        let equal = work.forecast(&Decomposition::with_grid(setup.domain, [1, 1, ranks]));
        // Cuts go through the whole box, and covered cells are dear: 8 ranks reach 0.83.
        assert!(balanced.balance() > 0.8, "{ranks}: {} {:?}", balanced.balance(), cut.cuts);
        assert!(balanced.balance() > equal.balance() + 0.05, "{ranks}: {}", equal.balance());
        assert!(balanced.efficiency() < balanced.balance() && balanced.efficiency() > 0.3);
    }
}

#[test]
fn one_rank_works_alone_and_sends_nothing() {
    let setup = suspension();
    let forecast = Work::of(&setup).forecast(&Decomposition::solo(setup.domain));
    assert!(forecast.ranks[0].sends.is_empty());
    assert!((forecast.efficiency() - 1.0).abs() < 1e-12);
    assert!((forecast.balance() - 1.0).abs() < 1e-12);
}
