//! Hydrodynamic loads on a particle beside a wall, and on the walls.

use super::tests::{CELLS, COUPLINGS, HOMOGENISED, SC3, UNITS, coupled, fluid_for, store};
use super::*;
use crate::comm::on_threads;
use crate::fluid::Boundary;
use crate::math::from_fixed_wide;
use crate::wall::{Motion, Surface, Wall};

/// A box closed in z, with a rod along x in it.
pub(super) fn walls(domain: &Domain) -> Vec<Wall> {
    let wall =
        |name: &str, surface| Wall { name: name.into(), surface, motion: Motion::default(), material: 0 };
    let plane = |point, normal| Surface::Plane { point, normal };
    vec![
        wall("z-", plane(Vec3::zeros(), Vec3::z())),
        wall("z+", plane(domain.size(), -Vec3::z())),
        wall(
            "rod",
            Surface::Cylinder { point: Vec3::new(0.0, 1.2, 1.55), axis: Vec3::x(), radius: 0.4, pipe: false },
        ),
    ]
}

/// Final state of a run with particles that stay at their positions.
struct Outcome {
    /// Force and torque on the particles by id.
    loads: Vec<Load>,
    /// Force on all walls (N).
    walls: Vec3,
    /// Sum of the density over the cells that no particle covers.
    free: f64,
}

fn run<S: Population>(
    solids: Method,
    grid: [usize; 3],
    particles: &[Particle],
    steps: usize,
    acceleration: [f64; 3],
    density: f64,
) -> Outcome {
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
        let store = store(&decomposition, comm.rank(), particles, 0.6);
        let mut fluid = Fluid::<S>::new(&decomposition, &comm, &fluid_for(solids), &boundary).unwrap();
        fluid.set_equilibrium(|_| (density, [0.0; 3]));
        let mut coupling = Coupling::new(coupled(solids), &decomposition, comm.rank(), 0.6);
        let mut loads = Vec::new();
        for _ in 0..steps {
            coupling.map(&store);
            coupling.sweep(&mut fluid, acceleration, false);
            fluid.exchange();
            loads = coupling.loads(&store, Vec3::zeros(), &comm);
        }
        let (block, mut free) = (decomposition.block(comm.rank()), 0.0);
        let [nx, ny, nz] = block.size();
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let at = [x, y, z];
            let covered = coupling
                .swept_segments
                .row(y + ny * z)
                .iter()
                .any(|segment| (segment.x..segment.end()).contains(&(x as u32)));
            let in_wall = walls.wall_of(std::array::from_fn(|a| (at[a] + block.lo[a]) as i64)).is_some();
            if !covered && !in_wall {
                free += fluid.moments(at).0;
            }
        }
        let sum = |a: usize| fluid.wall_loads().iter().map(|load| load.force[a]).sum::<i128>();
        let force = Vec3::from_fn(|a, _| from_fixed_wide(sum(a))) * UNITS.force();
        let ids: Vec<u64> = store.owned().iter().map(|p| p.id).collect();
        (ids.into_iter().zip(loads).collect::<Vec<_>>(), force, free)
    });
    let mut loads: Vec<(u64, Load)> = parts.iter().flat_map(|part| part.0.clone()).collect();
    loads.sort_by_key(|&(id, _)| id);
    Outcome {
        loads: loads.into_iter().map(|(_, load)| load).collect(),
        walls: parts.iter().map(|part| part.1).sum(),
        free: parts.iter().map(|part| part.2).sum(),
    }
}

/// One that overlaps the floor and a periodic face, one that overlaps the rod, one that touches nothing.
fn three() -> [Particle; 3] {
    [
        Particle::at(0, 0, Vec3::new(1.43, 0.02, 0.5)),
        Particle::at(1, 0, Vec3::new(2.9, 2.05, 1.9)),
        Particle::at(2, 0, Vec3::new(0.7, 0.9, 2.8)),
    ]
}

#[test]
fn spheres_at_rest_that_overlap_walls_feel_nothing_of_the_pressure() {
    for (solids, density) in COUPLINGS.into_iter().flat_map(|s| [1.0, 1.02].map(|rho| (s, rho))) {
        let outcome = run::<f64>(solids, [1, 1, 1], &three(), 30, [0.0; 3], density);
        for load in outcome.loads {
            println!(
                "density {density}: {:.1e} {:.1e}",
                load.force.norm() / UNITS.force(),
                load.torque.norm() / UNITS.torque()
            );
            if density > 1.0 {
                assert!(
                    load.force.norm() < 1e-9 * UNITS.force() && load.torque.norm() < 1e-8 * UNITS.torque()
                );
            } else {
                assert_eq!(load, Load::default());
            }
        }
    }
}

#[test]
fn spheres_and_walls_together_take_up_all_momentum_that_is_fed_in() {
    let a = 1e-6;
    let outcome = run::<f64>(COUPLINGS[0], [1, 1, 1], &three(), 4000, [a, 0.0, 0.0], 1.0);
    let spheres: Vec3 = outcome.loads.iter().map(|load| load.force).sum();
    let fed = a * outcome.free * UNITS.force();
    println!("spheres {:?}, walls {:?}, fed in {fed}", spheres / fed, outcome.walls / fed);
    assert!(spheres.x > 0.2 * fed && outcome.walls.x > 0.2 * fed);
    assert!((spheres.x + outcome.walls.x - fed).abs() < 1e-5 * fed);
    assert!((spheres.z + outcome.walls.z).abs() < 1e-5 * fed);
}

#[test]
fn loads_beside_walls_are_the_same_bits_on_any_blocks() {
    for solids in [HOMOGENISED, SC3] {
        let load = |grid| run::<f32>(solids, grid, &three(), 60, [3e-5, 1e-5, -2e-5], 1.01).loads;
        let solo = load([1, 1, 1]);
        assert!(solo.iter().all(|load| load.force.norm() > 1e-3 * UNITS.force()));
        for grid in [[1, 2, 1], [1, 1, 2], [3, 1, 1], [2, 2, 2], [1, 2, 3]] {
            assert_eq!(load(grid), solo, "{grid:?}, {solids:?}");
        }
    }
}
