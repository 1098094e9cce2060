//! Outlets that let sound leave.

use super::super::tests::{AT_REST, MAGIC, face_of, params, solo, step};
use super::super::*;
use crate::fluid::Fluid;
use std::f64::consts::PI;

/// Speed of sound (cells per time step), the root of 1/3.
const SOUND: f64 = 0.577_350_269_189_625_8;

/// A fluid between a face and an outlet across `axis`, periodic or with walls along the next one, periodic along the third; the velocity of an
/// inlet. An outlet that absorbs sound has the rate of a case.
fn between(
    cells: [usize; 3],
    axis: usize,
    [first, sides]: [Face; 2],
    absorbs: bool,
    velocity: f64,
) -> Fluid<f64> {
    let mut faces = [Face::Periodic; 6];
    faces[2 * axis] = first;
    let relaxation = absorbs.then_some(0.25 * SOUND / cells[axis] as f64);
    faces[2 * axis + 1] = Face::Outlet { excess: 0.0, relaxation, patch: None };
    let next = (axis + 1) % 3;
    faces[2 * next..2 * next + 2].fill(sides);
    let mut motions = [AT_REST; 6];
    motions[[4, 2, 0][axis]].velocity[axis] = velocity;
    let boundary = Boundary {
        motions: &motions,
        wall_of: &|cell| face_of(cells, cell),
        part_of_link: HALF_WAY,
        between: NO_SHEETS,
    };
    solo(Domain { cells, faces, dx: 1.0 }, &params(0.6, MAGIC), &boundary)
}

fn cells_of(size: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..size.iter().product()).map(move |n| [n % size[0], n / size[0] % size[1], n / size[0] / size[1]])
}

/// Kinetic energy and that of the pressure (lattice units).
fn acoustic_energy(fluid: &Fluid<f64>, size: [usize; 3]) -> f64 {
    let of = |cell| {
        let (rho, u) = fluid.moments(cell);
        0.5 * u.iter().map(|u| u * u).sum::<f64>() + 0.5 * (SOUND * (rho - 1.0)).powi(2)
    };
    cells_of(size).map(of).sum()
}

/// Part of the energy of a packet of sound that is in the box once all of it has met the outlet; `waves` along the axis over the length, and
/// across it, in radians per cell. A single pulse without any.
fn reflected(size: [usize; 3], axis: usize, waves: [f64; 2], absorbs: bool) -> f64 {
    let mut fluid = between(size, axis, [Face::Wall, Face::Periodic], absorbs, 0.0);
    let (next, k) = ((axis + 1) % 3, waves.iter().map(|k| k * k).sum::<f64>().sqrt());
    let along = if k > 0.0 { [waves[0] / k, waves[1] / k] } else { [1.0, 0.0] };
    let middle = 0.5 * size[axis] as f64;
    fluid.set_equilibrium(|cell| {
        let [s, t] = [axis, next].map(|a| cell[a] as f64);
        let envelope = (-0.5 * ((s - middle) / 10.0).powi(2)).exp();
        let rho = 1e-4 * envelope * (waves[0] * s + waves[1] * t).cos();
        let mut u = [0.0; 3];
        (u[axis], u[next]) = (SOUND * rho * along[0], SOUND * rho * along[1]);
        (1.0 + rho, u)
    });
    let before = acoustic_energy(&fluid, size);
    // The middle has met the outlet and, if reflected, is back at the first face.
    for _ in 0..(3.0 * middle / (SOUND * along[0])) as usize {
        step(&mut fluid, [0.0; 3]);
    }
    acoustic_energy(&fluid, size) / before
}

#[test]
fn a_plane_pulse_of_sound_leaves_less_than_a_percent_of_its_energy_at_an_outlet_that_absorbs_it() {
    for axis in 0..3 {
        let mut size = [4; 3];
        size[axis] = 160;
        let [absorbed, kept] = [true, false].map(|absorbs| reflected(size, axis, [0.0; 2], absorbs));
        println!("across {axis}: {absorbed:.2e}, {kept:.2e} where it is reflected");
        assert!(absorbed < 0.01, "across {axis}: {absorbed:e}");
        assert!(kept > 0.7, "across {axis}: {kept}");
    }
}

#[test]
fn of_sound_at_thirty_degrees_an_absorbing_outlet_keeps_less_than_a_tenth_of_what_a_reflecting_one_keeps() {
    // At the angle itself (1 - cos) / (1 + cos) of the amplitude returns, 0.5 % of the energy; a short packet has larger angles in it.
    let (length, angle) = (20.0, PI / 6.0);
    let waves = [2.0 * PI / length * angle.cos(), 2.0 * PI / length * angle.sin()];
    let [absorbed, kept] = [true, false].map(|absorbs| reflected([160, 40, 4], 0, waves, absorbs));
    println!("{absorbed:.2e}, {kept:.2e} where it is reflected");
    assert!(absorbed < 0.1 * kept, "{absorbed:e}, {kept:e}");
}

#[test]
fn the_steady_flow_to_an_outlet_that_absorbs_sound_is_that_to_one_that_reflects_it() {
    let size = [24, 8, 4];
    let fluids = [true, false].map(|absorbs| {
        let mut fluid = between(size, 0, [Face::Inlet, Face::Wall], absorbs, 0.01);
        (0..12_000).for_each(|_| step(&mut fluid, [0.0; 3]));
        fluid
    });
    let apart = cells_of(size).map(|cell| {
        let [(a, u), (b, v)] = [0, 1].map(|n| fluids[n].moments(cell));
        (0..3).map(|i| (u[i] - v[i]).abs()).fold((a - b).abs(), f64::max)
    });
    let apart = apart.fold(0.0, f64::max);
    println!("{apart:.1e}");
    assert!(apart < 1e-11, "{apart:e}");
}

#[test]
fn a_vortex_that_leaves_makes_less_pressure_inside_the_box_where_the_outlet_absorbs_sound() {
    let (size, speed, radius) = ([96, 80, 4], 0.05, 8.0);
    // Over `rho U^2`: the largest away from the outlet, and anywhere, once the start is over.
    let [absorbs, reflects] = [true, false].map(|absorbs| {
        let mut fluid = between(size, 0, [Face::Inlet, Face::Periodic], absorbs, speed);
        let strength = 0.2 * speed * 0.5_f64.exp() / radius;
        fluid.set_equilibrium(|[x, y, _]| {
            let [x, y] = [x as f64 - 64.0, y as f64 - 39.5];
            let core = strength * (-0.5 * (x * x + y * y) / (radius * radius)).exp();
            let pressure = -0.5 * (core * radius).powi(2);
            (1.0 + 3.0 * pressure, [speed - core * y, core * x, 0.0])
        });
        let mut largest = [0.0_f64; 2];
        for number in 0..1600 {
            step(&mut fluid, [0.0; 3]);
            if number >= 200 && number % 10 == 0 {
                for cell in cells_of(size).filter(|cell| cell[2] == 0) {
                    let pressure = (fluid.moments(cell).0 - 1.0).abs() / 3.0 / (speed * speed);
                    largest[0] = if cell[0] < 48 { largest[0].max(pressure) } else { largest[0] };
                    largest[1] = largest[1].max(pressure);
                }
            }
        }
        largest
    });
    println!("{absorbs:?}, {reflects:?} where sound is reflected");
    assert!(absorbs[0] < reflects[0] && absorbs[1] < 0.2, "{absorbs:?}, {reflects:?}");
}
