//! One sphere settling slowly in a periodic cube; see the README of this folder.

use crate::support::{compare, note, reference, setup};
use turbid::comm::Comm;
use turbid::coupling::{CONTROL_INTERVAL, ForceBalance};
use turbid::simulation::Simulation;

const CASE: &str = "periodic_settling";
const TOLERANCE: f64 = 0.04;
/// Largest relative change of the velocity in `STRETCH` steps that counts as steady.
const STEADY: f64 = 2e-4;
/// A multiple of the interval at which the flow is measured.
const STRETCH: u64 = 20 * CONTROL_INTERVAL;

/// Settling velocity over the Stokes velocity in a cube of `edge` diameters, averaged over the passage of one cell.
fn settling_velocity(edge: u32, balance: ForceBalance) -> f64 {
    let word = match balance {
        ForceBalance::Mixture => "mixture",
        ForceBalance::FluidOnly => "fluid_only",
    };
    let (setup, decomposition) = setup(
        CASE,
        &[
            format!("domain.size={{ diameters = [{edge}, {edge}, {edge}] }}"),
            format!("driving.force_balance={word:?}"),
        ],
    );
    let mut simulation = Simulation::<f64>::new(&setup, &decomposition, Comm::Solo).unwrap();
    let stokes = setup.scales.stokes_velocity;
    let (mut before, mut steady) = (0.0, false);
    let (mut sum, mut samples, mut acceleration, mut flux) = (0.0, 0.0, 0.0, 0.0);
    let mut passed = 0.0;
    while passed < setup.units.dx {
        for _ in 0..STRETCH {
            simulation.step().unwrap();
        }
        let mixture = simulation.mean_flow().velocity.z;
        let velocity = mixture - simulation.dem().particles().particles[0].velocity().z;
        if steady {
            passed += velocity * STRETCH as f64 * setup.units.dt;
            sum += velocity;
            samples += 1.0;
            acceleration += simulation.acceleration().z;
            flux += mixture;
        }
        // On the way through the lattice the velocity never stops changing altogether.
        steady |= (velocity - before).abs() < STEADY * velocity;
        before = velocity;
        assert!(simulation.steps_done() < setup.end_step, "not steady: {velocity}");
    }
    let name = format!("L = {edge} D, {word}");
    let (velocity, acceleration) = (sum / samples, acceleration / samples);
    note(&format!("{name}: steps"), simulation.steps_done() as f64);
    note(
        &format!("{name}: Reynolds number"),
        velocity * setup.scales.diameter / setup.scales.viscosity,
    );
    note(
        &format!("{name}: net flux over velocity"),
        flux / samples / velocity,
    );
    // What the controller adds to the force that balances the weight.
    let phi = setup.scales.volume_fraction;
    let weight = phi * (setup.scales.density_ratio - 1.0) * setup.gravity.norm();
    let carrier = match balance {
        ForceBalance::Mixture => 1.0,
        ForceBalance::FluidOnly => 1.0 - phi,
    };
    note(
        &format!("{name}: acceleration over that of the balance"),
        acceleration * carrier / weight,
    );
    velocity / stokes
}

fn check(edge: u32) {
    let expected = reference(CASE, "L_over_D", f64::from(edge), "sangani_acrivos");
    let measured = settling_velocity(edge, ForceBalance::Mixture);
    compare(
        &format!("L = {edge} D, mixture: U / U_Stokes"),
        measured,
        expected,
        TOLERANCE,
    );
}

#[test]
fn a_sphere_settles_in_a_cube_of_three_diameters_as_sangani_and_acrivos_say() {
    check(3);
}

#[test]
fn a_sphere_settles_in_a_cube_of_four_diameters_as_sangani_and_acrivos_say() {
    check(4);
}

#[test]
fn the_gradient_on_the_fluid_alone_is_faster_by_the_fluid_fraction() {
    let phi = reference(CASE, "L_over_D", 3.0, "phi");
    let expected = reference(CASE, "L_over_D", 3.0, "sangani_acrivos") / (1.0 - phi);
    let measured = settling_velocity(3, ForceBalance::FluidOnly);
    compare("L = 3 D, fluid_only: U / U_Stokes", measured, expected, TOLERANCE);
}
