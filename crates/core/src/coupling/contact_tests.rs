//! Long-term behaviour of cells inside solids, and at contacts: spheres that spin in place. Lattice units.

use super::tests::{COUPLINGS, SC3, coupled, fluid_for};
use super::*;
use crate::comm::Comm;
use crate::domain::Domain;
use crate::fluid::{Boundary, FluidParams};
use crate::particle::Template;
use crate::shape::Sphere;
use std::f64::consts::PI;
use std::sync::Arc;

const RADIUS: f64 = 6.0;

/// The force on the first of some spheres that turn about axes along z with surfaces of this speed, over
/// `6 pi rho nu R u`, and the largest deviation of the density from its mean.
fn turning(solids: Method, relaxation_time: f64, speed: f64, centres: &[Vec3], steps: usize) -> (Vec3, f64) {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [32, 28, 20], dx: 1.0 };
    let decomposition = Decomposition::new(domain, 1).unwrap();
    let params = FluidParams { relaxation_time, ..fluid_for(solids) };
    let mut fluid = Fluid::<f64>::new(&decomposition, &Comm::Solo, &params, &Boundary::none()).unwrap();
    fluid.set_equilibrium(|_| (1.0, [0.0; 3]));
    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let params = CouplingParams { units, ..coupled(solids) };
    let mut coupling = Coupling::new(params, &decomposition, 0, RADIUS);
    let sphere = |(id, centre): (usize, &Vec3)| {
        let mut sphere = Particle::at(id as u64, 0, *centre);
        sphere.angular_velocity = [0.0, 0.0, speed / RADIUS];
        sphere
    };
    let store = ParticleStore {
        templates: Arc::new([Template {
            shape: Arc::new(Sphere { radius: RADIUS }),
            material: 0,
            density: 2.0,
        }]),
        particles: centres.iter().enumerate().map(sphere).collect(),
        owned: centres.len(),
        owners: vec![0; centres.len()],
    };
    let mut force = Vec3::zeros();
    for _ in 0..steps {
        coupling.map(&store);
        coupling.sweep(&mut fluid, [0.0; 3], false);
        fluid.exchange();
        force = coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0].force;
    }
    let mut off = 0.0_f64;
    for n in 0..domain.cells.iter().product() {
        let [nx, ny, _] = domain.cells;
        let (rho, _) = fluid.moments([n % nx, n / nx % ny, n / nx / ny]);
        off = if rho.is_finite() { off.max((rho - 1.0).abs()) } else { f64::INFINITY };
    }
    let viscosity = (relaxation_time - 0.5) / 3.0;
    (force / (6.0 * PI * viscosity * RADIUS * speed), off)
}

#[test]
fn what_is_within_a_sphere_that_spins_on_the_spot_stays_as_it_is() {
    for &solids in &COUPLINGS[1..] {
        for relaxation_time in [0.53, 1.0] {
            let (_, off) = turning(solids, relaxation_time, 0.05, &[Vec3::new(12.3, 12.3, 10.2)], 3000);
            println!("{solids:?}, tau {relaxation_time}: densities within {off:.1e}");
            assert!(off < 0.03, "{solids:?}, tau {relaxation_time}: {off}");
        }
    }
}

#[test]
fn spheres_that_slide_along_each_other_are_not_welded_where_they_overlap() {
    let apart = |gap: f64| {
        let first = Vec3::new(11.3, 10.3, 10.2);
        let between = (2.0 + gap) * RADIUS * Vec3::new(0.8, 0.6, 0.0);
        let (force, off) = turning(SC3, 0.65, 0.02, &[first, first + between], 2000);
        let tangential = force.dot(&Vec3::new(-0.6, 0.8, 0.0));
        println!("gap {gap} R: force {tangential:.2}, densities within {off:.1e}");
        assert!(off < 0.1, "gap {gap}: {off}");
        -tangential
    };
    let near = apart(0.02);
    for overlap in [0.01, 0.03, 0.06] {
        let friction = apart(-overlap);
        assert!(friction > 0.5 * near && friction < 2.5 * near, "overlap {overlap}: {friction} for {near}");
    }
}
