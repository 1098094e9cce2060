//! Bodies at rest that overlap: together they are one.

use super::tests::{COUPLINGS, coupled, fluid_for};
use super::*;
use crate::comm::on_threads;
use crate::domain::{Decomposition, Domain};
use crate::fluid::{Boundary, Fluid, FluidParams};
use crate::particle::Particle;

const CELLS: [usize; 3] = [20, 16, 18];
const RADIUS: f64 = 4.0;

/// Force on each of some spheres at rest in a driven fluid, on blocks of this grid.
fn forces(solids: Method, centres: &[Vec3], grid: [usize; 3]) -> Vec<Vec3> {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: 1.0 };
    let decomposition = Decomposition::with_grid(domain, grid);
    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let particles: Vec<Particle> =
        centres.iter().enumerate().map(|(id, centre)| Particle::at(id as u64, 0, *centre)).collect();
    let parts = on_threads(decomposition.ranks(), |comm| {
        let params = FluidParams { relaxation_time: 0.8, ..fluid_for(solids) };
        let mut fluid = Fluid::<f64>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
        let mut coupling =
            Coupling::new(CouplingParams { units, ..coupled(solids) }, &decomposition, comm.rank(), RADIUS);
        let store = super::tests::store(&decomposition, comm.rank(), &particles, RADIUS);
        let mut loads = Vec::new();
        for _ in 0..200 {
            coupling.map(&store);
            coupling.sweep(&mut fluid, [1e-5, 2e-5, 0.0], false);
            fluid.exchange();
            loads = coupling.loads(&store, Vec3::zeros(), &comm);
        }
        let ids = store.owned().iter().map(|particle| particle.id);
        ids.zip(loads).map(|(id, load)| (id, load.force)).collect::<Vec<_>>()
    });
    let mut all: Vec<(u64, Vec3)> = parts.into_iter().flatten().collect();
    all.sort_by_key(|(id, _)| *id);
    all.into_iter().map(|(_, force)| force).collect()
}

#[test]
fn spheres_at_the_same_place_feel_together_what_one_alone_feels() {
    let centre = Vec3::new(9.3, 7.8, 8.6);
    for &solids in COUPLINGS.iter().filter(|solids| matches!(solids, Method::Saturated(_))) {
        let one = forces(solids, &[centre], [1, 1, 1])[0];
        let sum: Vec3 = forces(solids, &[centre, centre], [1, 1, 1]).into_iter().sum();
        // Cells at the surface are counted twice, up to the whole cell: the body is larger by half a cell.
        let ratio = sum.norm() / one.norm();
        assert!(ratio > 1.0 && ratio < 1.15, "{solids:?}: {ratio}");
    }
}

#[test]
fn forces_on_overlapping_bodies_are_finite_and_the_same_on_any_blocks() {
    let centres = [[9.3, 7.8, 8.6], [11.3, 8.8, 8.6], [10.1, 7.9, 11.0], [10.1, 7.9, 11.0]].map(Vec3::from);
    for solids in COUPLINGS {
        let whole = forces(solids, &centres, [1, 1, 1]);
        assert!(whole.iter().all(|force| force.iter().all(|x| x.is_finite() && x.abs() < 1.0)), "{whole:?}");
        assert_eq!(forces(solids, &centres, [2, 1, 2]), whole, "{solids:?}");
        assert_eq!(forces(solids, &centres, [1, 2, 1]), whole, "{solids:?}");
    }
}
