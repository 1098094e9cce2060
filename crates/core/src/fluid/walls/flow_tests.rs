//! Flows between walls against their exact solutions.

use super::tests::{AT_REST, MAGIC, domain, face_of, params, sliding, solo, step};
use super::*;
use crate::coupling::sweep_alone;
use crate::fluid::{Collision, Fluid, FluidParams};
use crate::math::from_fixed_wide;
use std::f64::consts::PI;

/// A box with resting faces in the directions that are not periodic.
fn vessel<S: Population>(cells: [usize; 3], periodic: [bool; 3], params: &FluidParams) -> Fluid<S> {
    let boundary = Boundary {
        motions: &[AT_REST; 6],
        wall_of: &|cell| face_of(cells, cell),
        part_of_link: HALF_WAY,
        between: NO_SHEETS,
    };
    solo(domain(cells, periodic), params, &boundary)
}

/// Largest error of the steady flow under an acceleration `a` between walls `width` cells apart across `axis`, relative
/// to its largest velocity `a H^2 / (8 nu)`.
fn poiseuille_error(axis: usize, width: usize, tau: f64, collision: Collision) -> f64 {
    let (mut cells, mut periodic, along) = ([4; 3], [true; 3], (axis + 1) % 3);
    (cells[axis], periodic[axis]) = (width, false);
    let (h, viscosity, fastest) = (width as f64, (tau - 0.5) / 3.0, 1e-3);
    let mut a = [0.0; 3];
    a[along] = 8.0 * viscosity * fastest / (h * h);
    let mut fluid = vessel::<f64>(cells, periodic, &params(tau, collision));
    // exp(-30) of the start is left.
    let steps = (30.0 * h * h / (PI * PI * viscosity)) as usize;
    for _ in 0..steps {
        step(&mut fluid, a);
    }
    (0..width)
        .map(|n| {
            let mut cell = [1; 3];
            cell[axis] = n;
            let s = (n as f64 + 0.5) / h;
            let u = fluid.moments(cell).1[along] + 0.5 * a[along];
            (u / fastest - 4.0 * s * (1.0 - s)).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn with_the_magic_parameter_a_channel_flow_is_exact_for_any_relaxation_time() {
    for tau in [0.52, 0.6, 1.0, 2.0] {
        for axis in 0..3 {
            let error = poiseuille_error(axis, 8, tau, MAGIC);
            println!("tau {tau}, across {axis}: {error:.1e}");
            assert!(error < 1e-10, "tau {tau}, across {axis}: {error:e}");
        }
    }
    // Not so with one relaxation time, where tau moves the walls.
    assert!(poiseuille_error(2, 8, 2.0, Collision::Bgk) > 0.05);
}

#[test]
fn without_a_magic_parameter_a_channel_flow_converges_with_second_order() {
    let recursive = Collision::RecursiveRegularised { magic: 0.125, smagorinsky: 0.0 };
    let mut of_recursive = Vec::new();
    for (collision, tau) in [(Collision::Bgk, 1.2), (recursive, 1.2), (recursive, 0.55)] {
        let errors = [8, 16, 32].map(|width| poiseuille_error(1, width, tau, collision));
        if collision == recursive {
            of_recursive.push(errors[0]);
        }
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{collision:?}, tau {tau}: errors {errors:?}, orders {orders:?}");
        assert!(orders.iter().all(|order| (1.9..2.1).contains(order)), "{orders:?}");
    }
    // Regularised, walls do not depend on the relaxation time.
    assert!((of_recursive[0] - of_recursive[1]).abs() < 1e-9, "{of_recursive:?}");
}

/// Velocity at `(y, z)` from the centre of a square duct of unit width under unit `G / nu`: White (2006), Eq. (3-48).
fn duct(y: f64, z: f64) -> f64 {
    let series: f64 = (1..200)
        .step_by(2)
        .map(|n| {
            let (k, sign) = (f64::from(n) * PI, if n % 4 == 1 { 1.0 } else { -1.0 });
            // cosh(k z) / cosh(k / 2) without overflow
            let ratio = ((k * (z.abs() - 0.5)).exp() + (-k * (z.abs() + 0.5)).exp()) / (1.0 + (-k).exp());
            sign / k.powi(3) * (1.0 - ratio) * (k * y).cos()
        })
        .sum();
    4.0 * series
}

/// Root of the mean square error of the flow in a square duct, and its error in the middle, relative to the largest
/// velocity.
fn duct_errors(width: usize, collision: Collision) -> [f64; 2] {
    let (tau, h) = (0.8, width as f64);
    let viscosity = (tau - 0.5) / 3.0;
    let fastest = 0.02 * 8.0 / h;
    let a = fastest / 0.0736714 * viscosity / (h * h);
    let mut fluid = vessel::<f64>([4, width, width], [true, false, false], &params(tau, collision));
    let steps = (20.0 * h * h / (2.0 * PI * PI * viscosity)) as usize;
    for _ in 0..steps {
        step(&mut fluid, [a, 0.0, 0.0]);
    }
    let error = |y: usize, z: usize| {
        let u = fluid.moments([2, y, z]).1[0] + 0.5 * a;
        let place = |n: usize| (n as f64 + 0.5) / h - 0.5;
        u / fastest - duct(place(y), place(z)) / 0.0736714
    };
    let square: f64 = (0..width * width).map(|n| error(n % width, n / width).powi(2)).sum();
    [square.sqrt() / h, error(width / 2, width / 2).abs()]
}

#[test]
fn the_flow_in_a_square_duct_converges_with_second_order() {
    assert!((duct(0.0, 0.0) - 0.0736714).abs() < 1e-7);
    for collision in [Collision::Bgk, MAGIC] {
        let errors = [8, 16, 32].map(|width| duct_errors(width, collision));
        let order = |k: usize| (errors[k][0] / errors[k + 1][0]).log2();
        println!("{collision:?}: errors {errors:?}, orders {} {}", order(0), order(1));
        assert!(errors[1][1] < 0.02, "{errors:?}");
        assert!(order(0) > 1.8 && order(1) > 1.8);
    }
}

#[test]
fn between_a_sliding_and_a_resting_wall_the_velocity_is_linear_and_the_stress_on_both_is_the_same() {
    let (cells, speed, h) = ([5, 4, 12], 0.03, 12.0);
    for (tau, collision) in [(0.55, Collision::Bgk), (0.8, MAGIC), (1.5, MAGIC)] {
        let motions = [AT_REST, sliding([0.6 * speed, -0.8 * speed, 0.0])];
        let boundary = Boundary {
            motions: &motions,
            wall_of: &|cell| face_of(cells, cell),
            part_of_link: HALF_WAY,
            between: NO_SHEETS,
        };
        let mut fluid = solo::<f64>(domain(cells, [true, true, false]), &params(tau, collision), &boundary);
        let viscosity = (tau - 0.5) / 3.0;
        for _ in 0..(30.0 * h * h / (PI * PI * viscosity)) as usize {
            step(&mut fluid, [0.0; 3]);
        }
        let mut worst = 0.0_f64;
        for z in 0..cells[2] {
            let (rho, u) = fluid.moments([2, 1, z]);
            let exact = speed * (z as f64 + 0.5) / h;
            worst = [u[0] - 0.6 * exact, u[1] + 0.8 * exact, u[2], rho - 1.0]
                .into_iter()
                .fold(worst, |worst, error| worst.max(error.abs()));
        }
        let stress = viscosity * speed / h * (cells[0] * cells[1]) as f64;
        let [lower, upper] = [0, 1].map(|wall| fluid.wall_loads()[wall].force.map(from_fixed_wide));
        println!("tau {tau}: velocity off by {worst:.1e}, {lower:?} {upper:?}, {stress:e}");
        assert!(worst < 1e-10, "tau {tau}: {worst:e}");
        for (axis, share) in [(0, 0.6), (1, -0.8), (2, 0.0)] {
            assert!((lower[axis] - share * stress).abs() < 1e-9 * stress.max(1.0), "{lower:?}");
            assert!((upper[axis] + share * stress).abs() < 1e-9 * stress.max(1.0), "{upper:?}");
        }
    }
}

#[test]
fn a_turning_plate_carries_the_fluid_round_with_it() {
    // Between two plates that turn alike, in a pipe that turns, too: the fluid turns as a rigid body.
    let (cells, rate, middle) = ([24, 24, 8], 2e-3, [12.0, 12.0, 0.0]);
    let turning = WallMotion { angular_velocity: [0.0, 0.0, rate], pivot: middle, ..AT_REST };
    let motions = std::array::from_fn::<_, 7, _>(|_| turning.clone());
    let boundary = Boundary {
        motions: &motions,
        wall_of: &|cell| {
            let r = [cell[0] as f64 + 0.5 - middle[0], cell[1] as f64 + 0.5 - middle[1]];
            face_of(cells, cell).or((r[0] * r[0] + r[1] * r[1] > 11.0 * 11.0).then_some(6))
        },
        part_of_link: HALF_WAY,
        between: NO_SHEETS,
    };
    let mut fluid = solo::<f64>(domain(cells, [false; 3]), &params(0.8, MAGIC), &boundary);
    for _ in 0..4000 {
        step(&mut fluid, [0.0; 3]);
    }
    let mut worst = 0.0_f64;
    for (x, y) in [(12, 12), (16, 12), (8, 18), (20, 14)] {
        let u = fluid.moments([x, y, 3]).1;
        let exact = turning.at([x as f64 + 0.5, y as f64 + 0.5, 3.5]);
        worst = (0..3).map(|a| (u[a] - exact[a]).abs()).fold(worst, f64::max);
    }
    println!("off by {:.2e} of the rim", worst / (rate * 11.0));
    assert!(worst < 0.01 * rate * 11.0);
}

/// Part of the way `(dx, dy)` from a point, given from the axis, to a circle about it: inwards or outwards.
fn to_circle([x, y]: [f64; 2], [dx, dy]: [f64; 2], radius: f64, outwards: bool) -> f64 {
    let (a, b, c) = (dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius);
    let root = (b * b - a * c).sqrt();
    if outwards { (root - b) / a } else { -(root + b) / a }
}

/// Largest error of the flow between a rod at radius `r1` that turns and a pipe at `r2` that rests, relative to the
/// velocity of the rod: `u = A r + B / r`; and that of the torque on both.
fn cylinder_errors(r1: f64, r2: f64, tau: f64) -> [f64; 2] {
    let width = (2.0 * r2) as usize + 4;
    let (cells, centre, speed) = ([width, width, 4], 0.5 * width as f64, 0.02);
    let turning =
        WallMotion { angular_velocity: [0.0, 0.0, speed / r1], pivot: [centre, centre, 0.0], ..AT_REST };
    let boundary = Boundary {
        motions: &[turning, AT_REST],
        wall_of: &|cell| {
            let [x, y] = [cell[0] as f64 + 0.5 - centre, cell[1] as f64 + 0.5 - centre];
            let r = x.hypot(y);
            if r < r1 { Some(0) } else { (r > r2).then_some(1) }
        },
        part_of_link: &|wall, cell, way| {
            let from = [0, 1].map(|a| cell[a] as f64 + 0.5 - centre);
            to_circle(from, [way[0] as f64, way[1] as f64], [r1, r2][wall], wall == 1)
        },
        between: NO_SHEETS,
    };
    let mut fluid = solo::<f64>(domain(cells, [true; 3]), &params(tau, MAGIC), &boundary);
    let (viscosity, gap) = ((tau - 0.5) / 3.0, r2 - r1);
    for _ in 0..(12.0 * gap * gap / (PI * PI * viscosity)) as usize {
        step(&mut fluid, [0.0; 3]);
    }
    let mut worst = 0.0_f64;
    for (x, y) in (0..width).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let place = [x as f64 + 0.5 - centre, y as f64 + 0.5 - centre];
        let r = place[0].hypot(place[1]);
        if r > r1 && r < r2 {
            let u = fluid.moments([x, y, 1]).1;
            let exact = speed * r1 / (r2 * r2 - r1 * r1) * (r2 * r2 / r - r);
            let around = (place[0] * u[1] - place[1] * u[0]) / r;
            worst = worst.max((around - exact).abs() / speed);
        }
    }
    let torque = 4.0 * PI * viscosity * speed * r1 * r2 * r2 / (r2 * r2 - r1 * r1) * 4.0;
    // The sudden start leaves momentum that changes its sign from step to step.
    let mut turn = || {
        step(&mut fluid, [0.0; 3]);
        [0, 1].map(|wall| 0.5 * from_fixed_wide(fluid.wall_loads()[wall].torque[2]))
    };
    let (odd, even) = (turn(), turn());
    let [rod, pipe] = [0, 1].map(|wall| odd[wall] + even[wall]);
    println!("r1 {r1}, tau {tau}: velocity {worst:.4}, torques {:.4} {:.4}", -rod / torque, pipe / torque);
    [worst, (-rod / torque - 1.0).abs().max((pipe / torque - 1.0).abs())]
}

#[test]
fn a_turning_rod_drives_the_flow_between_cylinders() {
    let [coarse, fine] = [8.0, 20.0].map(|r1| cylinder_errors(r1, 2.0 * r1, 0.8));
    assert!(fine[0] < 0.005 && coarse[0] < 0.02, "{coarse:?} {fine:?}");
    assert!(fine[1] < 0.003 && coarse[1] < 0.006, "{coarse:?} {fine:?}");
}

/// Flow rate through a pipe along z of this diameter, its axis off the middle, over that of Hagen and Poiseuille.
fn pipe_flow(diameter: f64, off: [f64; 2], tau: f64, magic: f64) -> f64 {
    let width = diameter as usize + 4;
    let (cells, radius, viscosity) = ([width, width, 4], 0.5 * diameter, (tau - 0.5) / 3.0);
    let from = |cell: [i64; 3]| [0, 1].map(|a| cell[a] as f64 + 0.5 - 0.5 * width as f64 - off[a]);
    let boundary = Boundary {
        motions: &[AT_REST],
        wall_of: &|cell| {
            let [x, y] = from(cell);
            (x.hypot(y) > radius).then_some(0)
        },
        part_of_link: &|_, cell, way| to_circle(from(cell), [way[0] as f64, way[1] as f64], radius, true),
        between: NO_SHEETS,
    };
    let params = params(tau, Collision::Trt { magic });
    let mut fluid = solo::<f64>(domain(cells, [true; 3]), &params, &boundary);
    let (fastest, a) = (0.02, 0.08 * viscosity / (radius * radius));
    for _ in 0..(12.0 * radius * radius / (5.78 * viscosity)) as usize {
        step(&mut fluid, [0.0, 0.0, a]);
    }
    let all = (0..width).flat_map(|y| (0..width).map(move |x| [x, y, 1]));
    let flow: f64 = all
        .filter(|&cell| fluid.walls.of(cell).is_none())
        .map(|cell| fluid.moments(cell).1[2] + 0.5 * a)
        .sum();
    flow / (0.5 * fastest * PI * radius * radius)
}

#[test]
fn the_flow_through_a_pipe_is_right_wherever_its_axis_is_for_any_relaxation_time() {
    for (tau, magic) in [(0.55, 0.125), (0.8, 0.1875), (1.0, 0.125), (1.5, 0.01)] {
        for off in [[0.0, 0.0], [0.5, 0.5], [0.37, 0.03]] {
            let error = pipe_flow(20.0, off, tau, magic) - 1.0;
            println!("tau {tau}, magic {magic}, off {off:?}: {error:+.5}");
            assert!(error.abs() < 4e-3, "tau {tau}, magic {magic}, off {off:?}: {error}");
        }
    }
}

#[test]
fn the_flow_through_a_pipe_converges_with_second_order() {
    let errors = [12.0, 24.0, 48.0].map(|diameter| pipe_flow(diameter, [0.21, 0.47], 1.0, 0.125) - 1.0);
    println!("{errors:?}");
    assert!(errors[0].abs() < 5e-3 && errors[2].abs() < 5e-4, "{errors:?}");
}

#[test]
fn a_closed_box_keeps_its_mass_to_round_off() {
    let cells = [11, 9, 8];
    // A lid slides, so populations are added and taken away.
    let motions = [AT_REST, sliding([0.05, 0.0, 0.0]), AT_REST, AT_REST, AT_REST, AT_REST];
    for lump in [false, true] {
        let boundary = Boundary {
            motions: &motions,
            wall_of: &|cell| {
                let inside = lump && cell.iter().all(|c| (3..5).contains(c));
                face_of(cells, cell).or(inside.then_some(0))
            },
            // Of the lump; faces are half-way.
            part_of_link: &|_, cell, _| 0.05 + 0.3 * cell.iter().sum::<i64>().rem_euclid(4) as f64,
            between: NO_SHEETS,
        };
        let mut fluid = solo::<f64>(domain(cells, [false; 3]), &params(0.6, MAGIC), &boundary);
        let mass = |fluid: &Fluid<f64>| -> f64 {
            (0..cells.iter().product())
                .map(|n: usize| [n % 11, n / 11 % 9, n / 99])
                .filter(|&cell| fluid.walls.of(cell).is_none())
                .map(|cell| fluid.moments(cell).0 - 1.0)
                .sum()
        };
        for _ in 0..2000 {
            step(&mut fluid, [1e-5, -2e-5, 3e-5]);
        }
        let (gained, moved) = (mass(&fluid), fluid.moments([5, 4, 7]).1[0]);
        println!("lump {lump}: mass {gained:.1e}, speed under the lid {moved:.3}");
        assert!(moved > 0.01 && gained.abs() < 1e-11, "{moved} {gained:e}");
    }
}

#[test]
fn a_fluid_in_a_closed_box_under_gravity_comes_to_rest_with_its_weight_on_the_walls() {
    let (cells, g) = ([6, 5, 10], 1e-4);
    let mut fluid = vessel::<f64>(cells, [true, true, false], &params(0.8, Collision::Bgk));
    for _ in 0..20000 {
        step(&mut fluid, [0.0, 0.0, -g]);
    }
    let mut worst = 0.0_f64;
    for z in 0..cells[2] {
        let (rho, u) = fluid.moments([3, 2, z]);
        // Before and after the collision the velocity is off by half of what gravity adds.
        worst = worst.max(u[0].abs()).max(u[1].abs()).max((rho * (u[2] - 0.5 * g)).abs());
    }
    let [floor, lid] = [0, 1].map(|wall| from_fixed_wide(fluid.wall_loads()[wall].force[2]));
    let weight = g * cells.iter().product::<usize>() as f64;
    println!("speed {worst:.1e}, on the floor {floor:e}, on the lid {lid:e}, weight {weight:e}");
    // Second order in what gravity adds in a step.
    assert!(worst < g * g);
    assert!(((lid + floor) / weight + 1.0).abs() < 1e-6);
}

#[test]
fn a_fluid_at_rest_between_resting_walls_stays_exactly_at_rest() {
    let mut fluid = vessel::<f32>([9, 6, 5], [false; 3], &params(0.55, MAGIC));
    for _ in 0..50 {
        step(&mut fluid, [0.0; 3]);
    }
    assert!((0..9).all(|x| fluid.populations([x, 3, 4]).iter().all(|&g| g == 0.0)));
    let flow = sweep_alone(&mut fluid, [0.0; 3], true).unwrap();
    assert_eq!((flow.momentum, flow.square), ([0; 3], 0));
    assert!(fluid.wall_loads().iter().all(|load| *load == WallLoad::default()));
}
