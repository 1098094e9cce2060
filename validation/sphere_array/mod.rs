//! Drag factor of a simple-cubic array of fixed spheres; see the README of this folder.

use crate::support::{Held, compare, note, reference, setup};
use std::f64::consts::PI;
use turbid::comm::Comm;
use turbid::math::Vec3;
use turbid::particle::Particle;
use turbid::simulation::Simulation;

const CASE: &str = "sphere_array";
/// Edge of a cell (m), as in the case file.
const CELL: f64 = 1e-4;

/// `K = rho a L^3 / (6 pi mu R U)` is to be within this of the reference.
const TOLERANCE: f64 = 0.04;
/// The force on the sphere is to be within this of the driving force on the cells that it does not touch.
const BALANCE_TOLERANCE: f64 = 2e-3;
/// Largest relative change of the mean velocity, in the time constant of its approach, that counts as steady.
const STEADY: f64 = 5e-4;

/// Runs to the steady state and checks.
///
/// `edge` is the distance of neighbours (cells), `shift` that of the centres from the middle of a cell (cells). A sphere
/// must not be larger than half the box, so that dense arrays need `copies` spheres in each direction.
fn check(volume_fraction: f64, edge: usize, copies: usize, shift: [f64; 3]) {
    let length = edge as f64 * CELL;
    let radius = 0.5 * length * (6.0 * volume_fraction / PI).cbrt();
    let diameter = 2.0 * radius;
    let side = copies * edge;
    let centres: Vec<[f64; 3]> = (0..copies.pow(3))
        .map(|n| {
            let place = [n % copies, n / copies % copies, n / (copies * copies)];
            std::array::from_fn(|a| ((edge / 2 + edge * place[a]) as f64 + 0.5 + shift[a]) * CELL)
        })
        .collect();
    let size = side as f64 * CELL;
    let (setup, decomposition) = setup(
        CASE,
        &[
            format!("domain.size=[{size:e}, {size:e}, {size:e}]"),
            format!("lattice.cells_per_diameter={:e}", diameter / CELL),
            format!("particles.0.shape.sphere.diameter={diameter:e}"),
            format!("particles.0.list={centres:?}"),
        ],
    );
    assert!(setup.domain.cells == [side; 3] && diameter / CELL >= 12.0);
    assert!((setup.scales.volume_fraction / volume_fraction - 1.0).abs() < 1e-9);

    let (viscosity, acceleration) = (setup.scales.viscosity, setup.body_acceleration.z);
    let expected = reference(CASE, "phi", volume_fraction, "K_zick_homsy");
    // The mass of the cell over the drag per velocity.
    let time_constant = length.powi(3) / (6.0 * PI * viscosity * radius * expected);
    let interval = (time_constant / setup.units.dt).ceil() as u64;

    let (engine, load) = Held::new(&setup, &decomposition);
    let mut simulation = Simulation::<f64>::with_engine(&setup, &decomposition, Comm::Solo, engine);
    let mut velocity = 0.0;
    loop {
        for _ in 0..interval {
            simulation.step().unwrap();
        }
        let before = std::mem::replace(&mut velocity, simulation.mean_flow().velocity.z);
        if (velocity - before).abs() < STEADY * velocity {
            break;
        }
        assert!(
            simulation.steps_done() < setup.end_step,
            "not steady: {before} {velocity}"
        );
    }

    let name = format!(
        "phi {volume_fraction}, {:.2} cells per diameter, shift {shift:?}",
        diameter / CELL
    );
    let reynolds = velocity * diameter / viscosity;
    note(&format!("{name}: Reynolds number"), reynolds);
    assert!(reynolds < 0.05);

    let drag_factor = acceleration * length.powi(3) / (6.0 * PI * viscosity * radius * velocity);
    compare(&format!("{name}: K"), drag_factor, expected, TOLERANCE);

    // Independent of the flow: in the steady state the sphere takes up all momentum that is fed in where it is not.
    let reach = radius + 0.5 * setup.solid_ramp_width * CELL;
    let free = (0..side.pow(3))
        .filter(|n| {
            let cell = [n % side, n / side % side, n / (side * side)];
            let place = Vec3::from(cell.map(|c| (c as f64 + 0.5) * CELL));
            let distance = |p: &Particle| setup.domain.nearest_image(place - p.position()).norm();
            setup.particles.iter().all(|p| distance(p) >= reach)
        })
        .count();
    let fed = setup.units.density * acceleration * free as f64 * CELL.powi(3) / copies.pow(3) as f64;
    let force = load.lock().unwrap().force;
    compare(
        &format!("{name}: force over driving force"),
        force.z / fed,
        1.0,
        BALANCE_TOLERANCE,
    );
    note(
        &format!("{name}: force over (1 - phi) rho a L^3"),
        force.z / ((1.0 - volume_fraction) * setup.units.density * acceleration * length.powi(3)),
    );
}

/// A place without symmetry (cells).
const ASIDE: [f64; 3] = [0.3, -0.2, 0.45];

#[test]
fn the_drag_of_a_simple_cubic_array_is_that_of_zick_and_homsy_at_volume_fraction_0_027() {
    check(0.027, 33, 1, [0.0; 3]);
}

#[test]
fn the_drag_of_a_simple_cubic_array_is_that_of_zick_and_homsy_at_volume_fraction_0_064() {
    check(0.064, 25, 1, [0.0; 3]);
    check(0.064, 25, 1, ASIDE);
}

#[test]
fn the_drag_of_a_simple_cubic_array_is_that_of_zick_and_homsy_at_volume_fraction_0_125() {
    check(0.125, 20, 2, [0.0; 3]);
    check(0.125, 20, 2, ASIDE);
}
