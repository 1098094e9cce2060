//! Claims about bodies that are put into a fluid that moves, and about those that are taken out.

use super::tests::{CELLS, COUPLINGS, UNITS, coupled, fluid_for, store};
use super::*;
use crate::comm::on_threads;
use crate::domain::Domain;
use crate::fluid::Boundary;

/// The step in which the sphere comes.
const COMES: usize = 3;

/// Forces (over `rho V U / dt`) on a sphere that comes into a uniform flow with a velocity of its own, step by step; `told` if the
/// coupling gets to know it.
fn forces(method: Method, ranks: usize, own: [f64; 3], told: bool) -> Vec<Vec3> {
    let flow = [0.05, -0.03, 0.02];
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
    let cut = Decomposition::new(domain, ranks).unwrap();
    let mut sphere = Particle::at(7, 0, Vec3::new(1.43, 1.21, 1.7));
    sphere.velocity = own.map(|u| u * UNITS.velocity());
    let volume = std::f64::consts::FRAC_PI_6 * 1.2_f64.powi(3);
    let unit = UNITS.density * volume * 0.05 * UNITS.velocity() / UNITS.dt;
    let all = on_threads(ranks, |comm| {
        let mut fluid = Fluid::<f64>::new(&cut, &comm, &fluid_for(method), &Boundary::none()).unwrap();
        fluid.set_equilibrium(|_| (1.0, flow));
        let mut fluid = AnyFluid::F64(Box::new(fluid));
        let mut coupling = Coupling::new(coupled(method), &cut, comm.rank(), 0.6);
        let [empty, with] = [&[][..], &[sphere][..]].map(|all| store(&cut, comm.rank(), all, 0.6));
        let mut forces = Vec::new();
        for step in 0..COMES + 6 {
            if step == COMES && told {
                coupling.begin_inserted(&fluid, &with, 7..8, &comm);
            }
            let store = if step < COMES { &empty } else { &with };
            coupling.map(store);
            fluid.sweep([0.0; 3], &mut coupling, false);
            fluid.exchange();
            let loads = coupling.loads(store, Vec3::zeros(), &comm);
            forces.extend(loads.iter().map(|load| load.force / unit));
        }
        forces
    });
    all.into_iter().find(|forces| !forces.is_empty()).unwrap()
}

#[test]
fn a_sphere_that_comes_with_the_velocity_of_the_fluid_feels_no_jolt_on_1_and_4_ranks() {
    for method in COUPLINGS {
        let with_it = forces(method, 1, [0.05, -0.03, 0.02], true);
        assert!(with_it.iter().all(|force| force.norm() < 1e-6), "{method:?}: {with_it:?}");
        let rests = forces(method, 1, [0.0; 3], true);
        assert!(rests.iter().any(|force| force.norm() > 1e-2), "{method:?}: dragged along, {rests:?}");
        assert_eq!(forces(method, 4, [0.0; 3], true), rests, "{method:?}");
    }
    let jolted = forces(COUPLINGS[3], 1, [0.05, -0.03, 0.02], false);
    assert!(jolted[0].norm() > 0.5, "the momentum of the fluid in it: {jolted:?}");
}

#[test]
fn a_body_that_goes_takes_its_load_and_the_momentum_of_the_fluid_in_it_along() {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: CELLS, dx: UNITS.dx };
    let cut = Decomposition::new(domain, 1).unwrap();
    for method in COUPLINGS {
        let mut fluid = Fluid::<f64>::new(&cut, &Comm::Solo, &fluid_for(method), &Boundary::none()).unwrap();
        let mut coupling = Coupling::new(coupled(method), &cut, 0, 0.6);
        let bodies = [Vec3::new(0.8, 1.2, 1.7), Vec3::new(2.2, 1.2, 1.7)];
        let bodies: Vec<Particle> = (0..).zip(bodies).map(|(id, at)| Particle::at(id, 0, at)).collect();
        let mut moving = bodies.clone();
        moving[0].velocity = [0.3, 0.0, 0.0];
        let mut step = |coupling: &mut Coupling, all: &[Particle]| {
            let store = store(&cut, 0, all, 0.6);
            coupling.map(&store);
            coupling.sweep(&mut fluid, [0.0; 3], false);
            fluid.exchange();
            coupling.loads(&store, Vec3::zeros(), &Comm::Solo)
        };
        step(&mut coupling, &moving);
        coupling.remove(&[0]);
        assert!(coupling.last_loads().map(|(particle, _)| particle.id).eq([1]));
        let [load] = step(&mut coupling, &bodies[1..])[..] else { panic!("one is left") };
        // Of 27 kN, the momentum in the one that has gone over a time step, only what it has stirred is felt.
        assert!(load.force.norm() < 10.0, "{method:?}: {load:?}");
    }
}
