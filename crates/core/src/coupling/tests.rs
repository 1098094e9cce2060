//! Hydrodynamic loads on a particle without an engine: particles are at positions set by the test.

use super::*;
use crate::comm::{Comm, on_threads};
use crate::domain::Domain;
use crate::fluid::{Boundary, CellState, Collision, F16, FlowSums, FluidParams, Simd, SumsAlongRows};
use crate::lattice::{C, Q, opposite};
use crate::math::{from_fixed_wide, to_fixed};
use crate::particle::Template;
use crate::shape::Sphere;
use std::f64::consts::PI;
use std::sync::Arc;

pub(super) const UNITS: Units = Units { dx: 0.125, dt: 0.01, density: 1000.0 };
pub(super) const CELLS: [usize; 3] = [24, 20, 28];

pub(super) const HOMOGENISED: Method = Method::Homogenised(Homogenised { ramp: 0.5 });
pub(super) const SC3: Method = saturated(SolidOperator::Sc3);
/// Homogenised cells, and all operators of partially saturated ones.
pub(crate) const COUPLINGS: [Method; 1 + SolidOperator::ALL.len()] = {
    let (mut all, mut n) = ([HOMOGENISED; 1 + SolidOperator::ALL.len()], 1);
    while n < all.len() {
        all[n] = saturated(SolidOperator::ALL[n - 1]);
        n += 1;
    }
    all
};

pub(crate) const fn saturated(operator: SolidOperator) -> Method {
    Method::Saturated(Saturated::new(operator))
}

pub(super) fn coupled(method: Method) -> CouplingParams {
    CouplingParams {
        units: UNITS,
        method,
        gravity: Vec3::zeros(),
        force_balance: ForceBalance::Mixture,
        simd: Simd::best(),
    }
}

pub(super) fn bgk(simd: Simd) -> FluidParams {
    FluidParams { relaxation_time: 0.6, collision: Collision::Bgk, simd }
}

/// Fluid for a coupling.
pub(super) fn fluid_for(method: Method) -> FluidParams {
    FluidParams { collision: method.usual_collision(), ..bgk(Simd::best()) }
}

/// Every rank knows all; owned are those whose centre is in its block.
pub(super) fn store(
    decomposition: &Decomposition,
    rank: usize,
    particles: &[Particle],
    radius: f64,
) -> ParticleStore {
    let templates: Arc<[Template]> =
        Arc::new([Template { shape: Arc::new(Sphere { radius }), material: 0, density: 2000.0 }]);
    let owner = |p: &Particle| decomposition.owner(p.position());
    let (mine, others): (Vec<Particle>, Vec<Particle>) = particles.iter().partition(|p| owner(p) == rank);
    let (owned, particles) = (mine.len(), [mine, others].concat());
    let owners = particles.iter().map(|p| owner(p) as u32).collect();
    ParticleStore { templates, particles, owned, owners }
}

/// Loads on all particles (by id) after `steps` steps from a flow, particles held where they are.
fn loads_after<S: Population>(
    solids: Method,
    particles: &[Particle],
    radius: f64,
    ranks: usize,
    steps: usize,
    flow: impl Fn([usize; 3]) -> (f64, [f64; 3]) + Sync,
) -> Vec<Load> {
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx }, ranks)
            .unwrap();
    let mut all: Vec<(u64, Load)> = on_threads(ranks, |comm| {
        let store = store(&decomposition, comm.rank(), particles, radius);
        let mut fluid =
            Fluid::<S>::new(&decomposition, &comm, &fluid_for(solids), &Boundary::none()).unwrap();
        let mut coupling = Coupling::new(coupled(solids), &decomposition, comm.rank(), radius);
        fluid.set_equilibrium(&flow);
        let mut loads = Vec::new();
        for _ in 0..steps {
            coupling.map(&store);
            coupling.sweep(&mut fluid, [0.0; 3], false);
            fluid.exchange();
            loads = coupling.loads(&store, Vec3::zeros(), &comm);
        }
        store.owned().iter().map(|p| p.id).zip(loads).collect::<Vec<_>>()
    })
    .concat();
    all.sort_by_key(|&(id, _)| id);
    all.into_iter().map(|(_, load)| load).collect()
}

fn rest(_: [usize; 3]) -> (f64, [f64; 3]) {
    (1.0, [0.0; 3])
}

#[test]
fn a_resting_sphere_in_resting_fluid_feels_exactly_nothing() {
    let sphere = Particle::at(0, 0, Vec3::new(1.43, 0.02, 3.3));
    for (solids, ranks) in COUPLINGS.into_iter().flat_map(|s| [1, 4].map(|ranks| (s, ranks))) {
        for load in [
            loads_after::<f32>(solids, &[sphere], 0.6, ranks, 20, rest),
            loads_after::<f64>(solids, &[sphere], 0.6, ranks, 20, rest),
            loads_after::<F16>(solids, &[sphere], 0.6, ranks, 20, rest),
        ] {
            println!("{solids:?}, {ranks} ranks: {:?}", load[0]);
            assert_eq!(load[0], Load::default());
        }
    }
}

#[test]
fn uniform_translation_of_fluid_and_sphere_leaves_the_force_zero_to_round_off() {
    let speed = [0.05, -0.03, 0.02];
    let mut sphere = Particle::at(0, 0, Vec3::new(1.43, 1.21, 1.7));
    sphere.velocity = speed.map(|u| u * UNITS.velocity());
    for solids in COUPLINGS {
        let load = loads_after::<f64>(solids, &[sphere], 0.6, 1, 10, |_| (1.0, speed))[0];
        // A sphere this fast relative to the fluid would feel a momentum flux of about rho u^2 R^2, in lattice units:
        let flux = 0.05 * 0.05 * 4.8 * 4.8;
        println!(
            "{solids:?}: force {:.1e}, torque {:.1e}, flux {flux:.1e}",
            load.force.norm() / UNITS.force(),
            load.torque.norm() / UNITS.torque()
        );
        assert!(load.force.norm() / UNITS.force() < 1e-11 && load.torque.norm() / UNITS.torque() < 1e-10);
    }
}

#[test]
fn a_sphere_thrown_into_fluid_at_rest_feels_added_mass_and_history_but_not_the_fluid_in_its_cells() {
    const STEPS: usize = 20;
    let radius = 0.6;
    let speed = 1e-3;
    let mut sphere = Particle::at(0, 0, Vec3::new(1.43, 1.21, 1.7));
    sphere.velocity = [0.0, 0.0, speed * UNITS.velocity()];
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
    let decomposition = Decomposition::new(domain, 1).unwrap();
    for solids in COUPLINGS {
        let store = store(&decomposition, 0, &[sphere], radius);
        let mut fluid =
            Fluid::<f64>::new(&decomposition, &Comm::Solo, &fluid_for(solids), &Boundary::none()).unwrap();
        let mut coupling = Coupling::new(coupled(solids), &decomposition, 0, radius);
        let mut impulse = 0.0;
        for _ in 0..STEPS {
            coupling.map(&store);
            coupling.sweep(&mut fluid, [0.0; 3], false);
            fluid.exchange();
            impulse -= coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0].force.z / UNITS.force();
        }
        let diameter = 2.0 * radius / UNITS.dx;
        let part = impulse / (speed * PI / 6.0 * diameter.powi(3));
        // Added mass, history force of Basset (1888) and drag of Stokes on a sphere that is set in motion at once.
        let diffused = (fluid_for(solids).relaxation_time - 0.5) / 3.0 * STEPS as f64;
        let expected = 0.5 + 18.0 * (diffused / PI).sqrt() / diameter + 18.0 * diffused / diameter.powi(2);
        println!("{solids:?}: {part:.3} of the momentum of the fluid displaced, {expected:.3} expected");
        // The first steps are as coarse as the lattice; the fluid in its cells would add 1.
        assert!((part / expected - 1.0).abs() < 0.25, "{part} for {expected}");
    }
}

#[test]
fn a_sphere_moved_by_whole_cells_across_faces_edges_and_corners_feels_the_same_force() {
    let shear = |shift: [usize; 3]| {
        move |cell: [usize; 3]| {
            // The flow moves with the sphere.
            let [x, y, z] = std::array::from_fn(|a| (cell[a] + CELLS[a] - shift[a]) % CELLS[a]);
            let wave = |a: usize, b: usize| (0.26 * a as f64 + 0.4 * b as f64).sin();
            (1.0, [0.03 * wave(y, z), 0.02 * wave(z, x), 0.03 * wave(x, y)])
        }
    };
    let inside = Vec3::new(1.43, 1.21, 1.7);
    let load = |solids: Method, shift: [usize; 3], ranks: usize| {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
        let moved = domain.wrap(inside + Vec3::from(shift.map(|n| n as f64 * UNITS.dx)));
        let mut sphere = Particle::at(0, 0, moved);
        (sphere.velocity, sphere.angular_velocity) = ([0.1, 0.05, -0.2], [0.3, -0.2, 0.1]);
        loads_after::<f64>(solids, &[sphere], 0.6, ranks, 6, shear(shift))[0]
    };
    let references = COUPLINGS.map(|solids| load(solids, [0, 0, 0], 1));
    assert!(references.iter().all(|load| load.force.norm() > 0.01 * UNITS.force()));
    // The sphere, nine cells across, comes to lie on one, two and three faces of the box.
    for shift in [[12, 0, 0], [0, 10, 0], [0, 0, 14], [12, 10, 0], [12, 0, 14], [0, 10, 14], [12, 10, 14]] {
        for (ranks, solids, reference) in [1, 2, 6, 8]
            .into_iter()
            .flat_map(|ranks| COUPLINGS.into_iter().zip(references).map(move |(s, r)| (ranks, s, r)))
        {
            let moved = load(solids, shift, ranks);
            let (force, torque) =
                ((moved.force - reference.force).norm(), (moved.torque - reference.torque).norm());
            println!(
                "{shift:?} on {ranks} ranks: force off by {:.1e}, torque by {:.1e}",
                force / reference.force.norm(),
                torque / reference.torque.norm()
            );
            assert!(force < 1e-10 * reference.force.norm(), "{shift:?} on {ranks} ranks: {force:e}");
            assert!(torque < 1e-10 * reference.torque.norm(), "{shift:?} on {ranks} ranks: {torque:e}");
        }
    }
}

#[test]
fn the_solid_volume_on_the_lattice_is_that_of_the_particles() {
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx }, 1)
            .unwrap();
    let spheres = [Vec3::new(0.01, 0.0, 3.4), Vec3::new(1.7, 1.2, 1.55)];
    let particles: Vec<Particle> =
        spheres.iter().enumerate().map(|(i, &x)| Particle::at(i as u64, 0, x)).collect();
    let store = store(&decomposition, 0, &particles, 0.6);
    let mut fluid =
        Fluid::<f64>::new(&decomposition, &Comm::Solo, &bgk(Simd::best()), &Boundary::none()).unwrap();
    let mut coupling = Coupling::new(coupled(HOMOGENISED), &decomposition, 0, 0.6);
    coupling.map(&store);
    let flow = coupling.sweep(&mut fluid, [0.0; 3], true).unwrap();
    let mapped = from_fixed_wide(flow.solid) * UNITS.dx.powi(3);
    let exact = 2.0 * store.templates[0].shape.volume();
    assert!((mapped / exact - 1.0).abs() < 0.02, "{mapped} for {exact}");
}

/// Momentum exchange link by link, as the formula says, before the sweep.
fn force_over_links(fluid: &Fluid<f64>, coupling: &Coupling, particle: &Particle) -> ([f64; 3], [f64; 3]) {
    let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
    for line in 0..CELLS[1] * CELLS[2] {
        for segment in coupling.segments.row(line) {
            for x in segment.x..segment.end() {
                let cell = [x as usize, line % CELLS[1], line / CELLS[1]];
                let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
                let centre = Vec3::from(cell.map(|c| (c as f64 + 0.5) * UNITS.dx));
                let r = domain.nearest_image(centre - particle.position()) / UNITS.dx;
                let u = (particle.velocity() / UNITS.velocity())
                    + (particle.angular_velocity() * UNITS.dt).cross(&r);
                let mut f = Vec3::zeros();
                for i in 1..Q {
                    let c = Vec3::from(C[i].map(|c| c as f64));
                    let to = std::array::from_fn(|a| {
                        (cell[a] as isize + C[i][a]).rem_euclid(CELLS[a] as isize) as usize
                    });
                    let (out, back) = (fluid.populations(to)[i], fluid.populations(cell)[opposite(i)]);
                    f -= out * (c - u) + back * (c + u);
                }
                let t = r.cross(&f);
                (0..3).for_each(|a| force[a] += f[a]);
                (0..3).for_each(|a| torque[a] += t[a]);
            }
        }
    }
    (force, torque)
}

/// Largest difference between loads and the sum over links, force and torque, over a run of a moving sphere across a
/// corner of the box: half a cell in all, so that cells come and go.
fn difference_from_links(simd: Simd, angular_velocity: [f64; 3]) -> [f64; 2] {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
    let decomposition = Decomposition::new(domain, 1).unwrap();
    let mut fluid = Fluid::<f64>::new(&decomposition, &Comm::Solo, &bgk(simd), &Boundary::none()).unwrap();
    let mut coupling = Coupling::new(coupled(HOMOGENISED), &decomposition, 0, 0.6);
    let mut sphere = Particle::at(0, 0, Vec3::new(0.3, 2.4, 3.4));
    (sphere.velocity, sphere.angular_velocity) = ([0.5, 0.3, 0.4], angular_velocity);
    let mut largest = [0.0_f64; 2];
    for _ in 0..14 {
        sphere.position = domain.wrap(sphere.position() + sphere.velocity() * UNITS.dt).into();
        let store = store(&decomposition, 0, &[sphere], 0.6);
        coupling.map(&store);
        let (force, torque) = force_over_links(&fluid, &coupling, &sphere);
        coupling.sweep(&mut fluid, [1e-5, 0.0, 0.0], false);
        fluid.exchange();
        let load = coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0];
        largest[0] = largest[0].max((load.force / UNITS.force() - Vec3::from(force)).norm());
        largest[1] = largest[1].max((load.torque / UNITS.torque() - Vec3::from(torque)).norm());
    }
    largest
}

#[test]
fn momentum_exchange_of_a_moving_sphere_agrees_with_the_sum_over_links() {
    for simd in
        [Simd::Scalar, Simd::Sse2, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.is_available())
    {
        let [force, torque] = difference_from_links(simd, [0.0; 3]);
        assert!(force < 1e-10 && torque < 1e-9, "{simd:?}: {force:e} {torque:e}");
        // What left is weighted with the velocity its cell had then; by now a turning body has moved on by one step,
        // which changes the velocity at the cell by w x U dt: 2e-4 here, times the mass of order one that left at
        // this impulsive start; the lever is up to five cells.
        let [force, torque] = difference_from_links(simd, [0.3, -0.2, 0.1]);
        assert!(force < 3e-4 && torque < 5e-3, "{simd:?}: {force:e} {torque:e}");
    }
}

#[test]
fn the_buoyancy_and_the_mean_gradient_are_part_of_the_load() {
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx }, 1)
            .unwrap();
    let store = store(&decomposition, 0, &[Particle::at(0, 0, Vec3::new(1.0, 1.0, 1.0))], 0.5);
    let (gravity, acceleration) = (Vec3::new(0.0, 0.0, -10.0), Vec3::new(0.0, 0.5, 3.0));
    for (force_balance, share) in [(ForceBalance::Mixture, 1.0), (ForceBalance::FluidOnly, 0.0)] {
        let params = CouplingParams { gravity, force_balance, ..coupled(HOMOGENISED) };
        let mut coupling = Coupling::new(params, &decomposition, 0, 0.5);
        coupling.map(&store);
        let load = coupling.loads(&store, acceleration, &Comm::Solo)[0];
        let expected = 1000.0 * store.templates[0].shape.volume() * (share * acceleration - gravity);
        assert!((load.force - expected).norm() < 1e-9);
    }
}

/// A sphere that a jolt sets off in a flow that turns and is driven: what is left over in the balance of momentum of
/// particle and fluid over all steps (lattice units), and the force of the last step.
fn left_over(solids: Method) -> [f64; 2] {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
    let decomposition = Decomposition::new(domain, 1).unwrap();
    let mut fluid =
        Fluid::<f64>::new(&decomposition, &Comm::Solo, &fluid_for(solids), &Boundary::none()).unwrap();
    let mut coupling = Coupling::new(coupled(solids), &decomposition, 0, 0.6);
    fluid.set_equilibrium(|[x, y, _]| {
        let wave = (0.26 * x as f64).sin() * (0.31 * y as f64).cos();
        (1.0, [0.01, 0.02 * wave, -0.01])
    });
    let total = |fluid: &Fluid<f64>| {
        let mut sum = Vec3::zeros();
        for n in 0..CELLS.iter().product() {
            let [nx, ny, _] = CELLS;
            let (rho, u) = fluid.moments([n % nx, n / nx % ny, n / nx / ny]);
            sum += rho * Vec3::from(u);
        }
        sum
    };
    let within = |coupling: &Coupling| Vec3::from(coupling.swept_bodies[0].departed.force.map(from_fixed));
    let acceleration = Vec3::new(1e-5, -2e-5, 3e-5);
    let mut sphere = Particle::at(0, 0, Vec3::new(0.3, 2.4, 3.4));
    let (mut received, mut force) = (Vec3::zeros(), Vec3::zeros());
    let start = total(&fluid);
    let mut fed = Vec3::zeros();
    let steps = 40;
    for step in 0..steps {
        sphere.velocity = if step < 10 { [0.0; 3] } else { [0.5, 0.3, -0.4] };
        sphere.angular_velocity = [0.3, 0.1 * f64::from(step), -0.2];
        let moved = sphere.position() + sphere.velocity() * UNITS.dt;
        sphere.position = domain.wrap(moved).into();
        let store = store(&decomposition, 0, &[sphere], 0.6);
        coupling.map(&store);
        let mut mass = 0.0;
        coupling.each_row(&fluid, fluid.block(), [0.0; 3], &mut |row| {
            for (_, cell) in row.each() {
                mass += (1.0 - cell.solid_fraction) * (1.0 + cell.density_deviation);
            }
        });
        fed += acceleration * mass;
        coupling.sweep(&mut fluid, acceleration.into(), false);
        fluid.exchange();
        force = coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0].force / UNITS.force();
        received += force;
    }
    // What is within the particle counts as its own, so that it is not part of the fluid.
    let outside = total(&fluid) - within(&coupling) - start;
    [(outside + received - fed).norm(), force.norm()]
}

#[test]
fn fluid_and_particle_keep_their_momentum_and_all_that_is_fed_into_partly_covered_cells_is_accounted_for() {
    for solids in &COUPLINGS[1..] {
        let [rest, force] = left_over(*solids);
        println!("{solids:?}: left over {rest:.1e} of forces of {force:.1e}");
        assert!(rest < 1e-9 && force > 1e-3, "{solids:?}: {rest:e} of {force:e}");
    }
}

#[test]
fn sums_over_rows_of_the_flow_are_those_of_its_cells_to_the_bit_with_any_instructions() {
    let (domain, cells) = (Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx }, CELLS);
    let decomposition = Decomposition::new(domain, 1).unwrap();
    let place = |x: f64| Particle::at(0, 0, Vec3::new(x, 2.4, 3.4));
    let store = store(&decomposition, 0, &[place(0.3)], 0.6);
    let of_cell = |state: &CellState| -> FlowSums {
        let (open, u) = (1.0 - state.solid_fraction, state.velocity);
        let [x, y, z] = u.map(|u| open * u);
        let terms = [open, x, y, z, x * u[0], y * u[1], z * u[2], x * u[1], x * u[2], y * u[2]];
        let mut all = [to_fixed(open * state.density_deviation); 11];
        all.iter_mut().zip(terms).for_each(|(all, term)| *all = to_fixed(term));
        all
    };
    let add = |sums: &mut FlowSums, of: &FlowSums| sums.iter_mut().zip(of).for_each(|(sum, of)| *sum += of);
    for solids in COUPLINGS {
        let found = |simd: Simd| {
            let params = FluidParams { simd, ..fluid_for(solids) };
            let mut fluid =
                Fluid::<f32>::new(&decomposition, &Comm::Solo, &params, &Boundary::none()).unwrap();
            fluid.set_equilibrium(|[x, y, _]| (1.001, [0.01, 0.02 * (0.3 * (x * y) as f64).sin(), -0.01]));
            let mut coupling = Coupling::new(coupled(solids), &decomposition, 0, 0.6);
            coupling.map(&store);
            let (mut along, mut expected) = (SumsAlongRows::default(), vec![FlowSums::default(); cells[0]]);
            let (mut rows, mut cut) = (Vec::new(), 0);
            coupling.each_row(&fluid, fluid.block(), [1e-4, 0.0, -2e-4], &mut |row| {
                let mut of_row = FlowSums::default();
                for ([x, ..], state) in row.each() {
                    add(&mut of_row, &of_cell(&state));
                    add(&mut expected[x], &of_cell(&state));
                    cut += usize::from(state.solid_fraction > 0.0 && state.solid_fraction < 1.0);
                }
                assert_eq!(row.sums(), of_row);
                along.add(row);
                rows.push(of_row);
            });
            let found = along.take();
            assert_eq!(found[..cells[0]], expected);
            assert!(cut > 50 && found[cells[0]..].iter().flatten().all(|sum| *sum == 0));
            rows
        };
        let truth = found(Simd::Scalar);
        for simd in [Simd::Sse2, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.is_available()) {
            assert_eq!(found(simd), truth, "{simd:?}");
        }
    }
}

#[test]
fn steady_flow_through_a_dense_array_does_not_depend_on_the_relaxation_time() {
    let (cells, radius) = ([10; 3], 4.3 * UNITS.dx);
    let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: UNITS.dx };
    let decomposition = Decomposition::new(domain, 1).unwrap();
    let sphere = Particle::at(0, 0, Vec3::new(0.61, 0.66, 0.58));
    let store = store(&decomposition, 0, &[sphere], radius);
    // Over the velocity that the viscosity and the drive make.
    let flow = |tau: f64| {
        let params = FluidParams { relaxation_time: tau, ..fluid_for(SC3) };
        let mut fluid = Fluid::<f64>::new(&decomposition, &Comm::Solo, &params, &Boundary::none()).unwrap();
        let mut coupling = Coupling::new(coupled(SC3), &decomposition, 0, radius);
        let (nu, mut mean) = ((tau - 0.5) / 3.0, 0.0);
        coupling.map(&store);
        // What was within the sphere leaks out slowly.
        for _ in 0..3000 {
            let flow = coupling.sweep(&mut fluid, [0.0, 0.0, 1e-5 * nu], true).expect("measured");
            fluid.exchange();
            coupling.map(&store);
            mean = from_fixed_wide(flow.momentum[2]) / 1e3;
        }
        mean / 1e-5
    };
    let (slow, fast) = (flow(1.0), flow(0.55));
    assert!(slow > 0.1 && (fast / slow - 1.0).abs() < 1e-4, "{fast} {slow}");
}
