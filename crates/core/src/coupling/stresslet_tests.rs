//! The particle stresslet, and measurements that equal those of the next sweep.

use super::tests::{CELLS, COUPLINGS, HOMOGENISED, UNITS, coupled, fluid_for, store};
use super::wall_tests::walls;
use super::*;
use crate::comm::on_threads;
use crate::domain::{Decomposition, Domain};
use crate::fluid::{Boundary, F16, Fluid, Stresslet};
use crate::math::{Vec3, from_fixed_wide};
use crate::particle::Particle;

/// One that overlaps the floor, and two that overlap each other across an edge of the box; all turn.
fn three() -> [Particle; 3] {
    [[0.1, 1.5, 0.4], [1.4, 0.02, 3.2], [1.9, 2.4, 3.0]].map(|at| {
        let mut particle = Particle::at((10.0 * at[0]) as u64, 0, at.into());
        (particle.velocity, particle.angular_velocity) = ([0.3, -0.2, 0.1], [2.0, -1.0, 3.0]);
        particle
    })
}

fn sum(stresslets: &[(u64, Stresslet)]) -> Stresslet {
    std::array::from_fn(|i| stresslets.iter().map(|(_, stresslet)| stresslet[i]).sum())
}

/// The sums after some steps, each of which gets beforehand what it will measure.
fn measured<S: Population>(solids: Method, grid: [usize; 3]) -> Stresslet {
    let domain = Domain { faces: Domain::faces([true, true, false]), cells: CELLS, dx: UNITS.dx };
    let decomposition = Decomposition::with_grid(domain, grid);
    let walls = LatticeWalls::new(&walls(&domain), &UNITS, &domain);
    let parts = on_threads(decomposition.ranks(), |comm| {
        let boundary = Boundary {
            motions: &walls.motions(None),
            wall_of: &|cell| walls.wall_of(cell),
            part_of_link: &|wall, cell, way| walls.part_of_link(wall, cell, way),
            between: &|cell| walls.between(cell),
        };
        let store = store(&decomposition, comm.rank(), &three(), 0.6);
        let mut fluid = Fluid::<S>::new(&decomposition, &comm, &fluid_for(solids), &boundary).unwrap();
        let mut coupling = Coupling::new(coupled(solids), &decomposition, comm.rank(), 0.6);
        let mut sums = [0; 6];
        for step in 0..7 {
            coupling.map(&store);
            let before = fluid.state_hash();
            let (foretold, stresslets) = coupling.measure(&fluid, [1e-4, 0.0, 0.0]);
            sums = sum(&stresslets);
            assert_eq!(fluid.state_hash(), before);
            let found = coupling.sweep(&mut fluid, [1e-4, 0.0, 0.0], true);
            assert_eq!(Some(foretold), found, "{solids:?}, step {step}");
            fluid.exchange();
            coupling.loads(&store, Vec3::zeros(), &comm);
        }
        sums
    });
    std::array::from_fn(|i| parts.iter().map(|part| part[i]).sum())
}

#[test]
fn a_measurement_foretells_the_next_sweep_to_the_bit_and_is_the_same_on_any_blocks() {
    for solids in COUPLINGS {
        let (single, double) = (measured::<f32>(solids, [1, 1, 1]), measured::<f64>(solids, [1, 1, 1]));
        assert_eq!(measured::<f32>(solids, [2, 1, 2]), single, "{solids:?}");
        assert_eq!(measured::<f64>(solids, [3, 2, 2]), double, "{solids:?}");
        assert_eq!(measured::<F16>(solids, [2, 1, 2]), measured::<F16>(solids, [1, 1, 1]), "{solids:?}");
        let [single, double] = [single, double].map(|sums| sums.map(from_fixed_wide));
        let largest = double.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        for (s, d) in single.into_iter().zip(double) {
            assert!(largest > 0.1 && (s - d).abs() < 1e-4 * largest, "{single:?} {double:?}");
        }
    }
}

#[test]
fn the_moments_are_those_of_the_force_in_every_cell_about_the_centre() {
    // A sphere at rest in fluid that flows as `u = E r`: all it takes in a cell is along its own part of the
    // strain.
    let strain = [[1e-3, 2e-4, 3e-4], [2e-4, -5e-4, 4e-4], [3e-4, 4e-4, -5e-4]];
    let (centre, radius) = (Vec3::new(1.51, 1.18, 1.73), 0.7);
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx }, 1)
            .unwrap();
    let particle = Particle::at(0, 0, centre);
    let store = store(&decomposition, 0, &[particle], radius);
    let params = fluid_for(HOMOGENISED);
    let comm = crate::comm::Comm::Solo;
    let mut fluid = Fluid::<f64>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
    fluid.set_equilibrium(|cell| {
        let r = Vec3::from(cell.map(|n| n as f64 + 0.5)) - centre / UNITS.dx;
        (1.0, std::array::from_fn(|a| (0..3).map(|b| strain[a][b] * r[b]).sum()))
    });
    let mut coupling = Coupling::new(coupled(HOMOGENISED), &decomposition, 0, radius);
    coupling.map(&store);
    let sums = sum(&coupling.measure(&fluid, [0.0; 3]).1).map(from_fixed_wide);
    // int r E r dV over a sphere is 4 pi a^5 / 15 E; the steps of the lattice leave 5 / 12 over a^2 in cells, 1.3
    // %.
    let cells = radius / UNITS.dx;
    let whole = 4.0 / 15.0 * std::f64::consts::PI * cells.powi(5);
    for (sum, (a, b)) in sums.into_iter().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
        let exact = whole * strain[a][b];
        assert!((sum / exact - 1.0).abs() < 0.03, "{a}{b}: {sum} {exact}");
    }
}
