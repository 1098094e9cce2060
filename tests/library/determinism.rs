//! The same bits for any number of ranks and any instruction set: 200 spheres, 50 of them light, that touch and cross the faces, edges and
//! corners of blocks, 300 steps, in all precisions.

use crate::common::random;
use std::sync::Arc;
use turbid::case::{self, Setup};
use turbid::comm::on_threads;
use turbid::domain::{Decomposition, Weights};
use turbid::fluid::{Precision, Simd};
use turbid::simulation::Simulation;

const STEPS: u64 = 300;
const CASE: &str = r"
[domain]
size = { diameters = [6, 7, 8] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 6
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 150
seed = 7
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 300.0
count = 50
[driving]
gravity = [2.0, -3.0, -9.0]
[run]
end = { steps = 300 }
";

/// The case with random velocities up to half the Stokes velocity, so that contacts begin and blocks are left at once.
fn setup() -> Setup {
    let mut setup = case::from_text(CASE, "case", &[]).unwrap();
    let mut random = random();
    let mut next = || random() - 0.5;
    let speed = setup.expect_fluid().scales.stokes_velocity;
    for particle in &mut setup.particles {
        particle.velocity = std::array::from_fn(|_| next() * speed);
        particle.angular_velocity = std::array::from_fn(|_| next() * 100.0);
    }
    setup
}

/// Result of a run: hash, contacts begun, and particles that changed their rank.
fn outcome(setup: &Setup, cut: &Decomposition, simd: Simd) -> (u64, u64, usize) {
    let mut setup = setup.clone();
    setup.plan.simd = Some(simd);
    let results = on_threads(cut.ranks(), |comm| {
        let mut simulation = Simulation::new(&setup, cut, comm).unwrap();
        let owned = |s: &Simulation| s.dem().particles().owned().iter().map(|p| p.id).collect::<Vec<_>>();
        let before = owned(&simulation);
        for _ in 0..STEPS {
            simulation.step().unwrap();
        }
        let arrived = owned(&simulation).iter().filter(|id| !before.contains(id)).count();
        (simulation.state_hash(), simulation.dem().contacts().begun, arrived)
    });
    assert!(results.iter().all(|r| r.0 == results[0].0));
    (results[0].0, results.iter().map(|r| r.1).sum(), results.iter().map(|r| r.2).sum())
}

fn same_bits(precision: Precision) {
    let mut setup = setup();
    setup.plan.precision = precision;
    let setup = Arc::new(setup);
    assert_eq!(setup.particles.len(), 200);
    assert!(setup.templates[0].shape.as_sphere().is_some());
    let domain = setup.domain;
    let cut = |ranks| Decomposition::new(domain, ranks).unwrap();
    let (hash, contacts, _) = outcome(&setup, &cut(1), Simd::best());
    assert!(contacts > 100, "only {contacts} contacts begun");
    // The blocks a run would take, which leave rows whole, and blocks that meet in corners and cut rows.
    let grids = [[3, 1, 1], [2, 2, 2]].map(|grid| Decomposition::with_grid(domain, grid));
    // Blocks of any size, and those of a work that is nearly all at the bottom.
    let uneven = Decomposition::with_cuts(domain, [vec![0, 22, 36], vec![0, 4, 42], vec![0, 8, 12, 48]]);
    let mut weights = Weights::even(&domain, 1.0);
    for layers in &mut weights.layers {
        let bottom = layers.len() / 3;
        layers[..bottom].iter_mut().for_each(|layer| *layer *= 9.0);
    }
    let balanced = [5, 8].map(|ranks| Decomposition::balanced(domain, ranks, &weights).unwrap());
    assert!(balanced.iter().all(|cut| *cut != Decomposition::with_grid(domain, cut.grid)));
    for cut in [2, 3, 4, 6, 8].map(cut).into_iter().chain(grids).chain([uneven]).chain(balanced) {
        let (other, begun, moved) = outcome(&setup, &cut, Simd::best());
        println!("{:?}: {other:016x}, {begun} contacts begun, {moved} particles changed rank", cut.cuts);
        assert_eq!((other, begun), (hash, contacts), "{:?}", cut.cuts);
        assert!(moved > 10, "only {moved} particles changed rank");
    }
    for simd in [Simd::Scalar, Simd::Sse2, Simd::Avx2, Simd::Avx512]
        .into_iter()
        .filter(|simd| simd.is_available() && *simd != Simd::best())
    {
        let (other, ..) = outcome(&setup, &cut(2), simd);
        println!("{simd:?}: {other:016x}");
        assert_eq!(other, hash, "{simd:?}");
    }
}

#[test]
fn single_precision_gives_the_same_bits_on_any_ranks_and_instruction_set() {
    same_bits(Precision::F32);
}

#[test]
fn half_precision_gives_the_same_bits_on_any_ranks_and_instruction_set() {
    same_bits(Precision::F16);
}

#[test]
fn double_precision_gives_the_same_bits_on_any_ranks_and_instruction_set() {
    same_bits(Precision::F64);
}
