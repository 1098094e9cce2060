//! The recursive regularised collision at relaxation times near 1/2, and eddies.

use super::regularised::with_eddies;
use super::tests::{solo_with, step};
use super::*;
use std::f64::consts::TAU;

const PLAIN: Collision = Collision::RecursiveRegularised { magic: 0.125, smagorinsky: 0.0 };

/// Kinetic energy over that of the start of two shear layers that roll up, after a number of steps; no number if it has diverged.
///
/// Reference: Minion and Brown (1997), doi:10.1006/jcph.1997.5843.
fn rolled_up(collision: Collision, relaxation_time: f64, (steps, speed, thin): (usize, f64, f64)) -> f64 {
    let n = 64;
    let params = FluidParams { relaxation_time, collision, simd: Simd::best() };
    let mut fluid = solo_with::<f64>([n, n, 4], &params);
    fluid.set_equilibrium(|[x, y, _]| {
        let [x, y] = [x, y].map(|c| (c as f64 + 0.5) / n as f64);
        let shear = if y < 0.5 { (thin * (y - 0.25)).tanh() } else { (thin * (0.75 - y)).tanh() };
        (1.0, [speed * shear, 0.05 * speed * (TAU * (x + 0.25)).sin(), 0.0])
    });
    let energy = |fluid: &Fluid<f64>| -> f64 {
        let squares = (0..n * n).map(|at| {
            let (_, u) = fluid.moments([at % n, at / n, 0]);
            u.iter().map(|u| u * u).sum::<f64>()
        });
        squares.sum()
    };
    let first = energy(&fluid);
    for _ in 0..steps {
        step(&mut fluid, [0.0; 3]);
    }
    energy(&fluid) / first
}

#[test]
fn thin_shear_layers_roll_up_stably_at_relaxation_times_at_which_others_diverge() {
    // Layers of less than a cell.
    for (tau, speed, steps) in [(0.501, 0.1, 1280), (0.5003, 0.05, 2560)] {
        let [one, two, recursive] = [Collision::Bgk, Collision::Trt { magic: 0.25 }, PLAIN]
            .map(|collision| rolled_up(collision, tau, (steps, speed, 80.0)));
        println!(
            "energy left: {one:.3}, two relaxation times {two:.3}, recursive regularised {recursive:.3}"
        );
        assert!(one.is_nan() && two.is_nan(), "{one} {two}");
        assert!((0.9..1.0).contains(&recursive), "{recursive}");
    }
}

#[test]
fn eddies_add_the_viscosity_of_smagorinsky_to_a_shear_flow() {
    let (tau, smagorinsky, rate) = (0.51, 0.4, 4e-3);
    let collision = Collision::RecursiveRegularised { magic: 0.125, smagorinsky };
    let params = FluidParams { relaxation_time: tau, collision, simd: Simd::best() };
    let mut fluid = solo_with::<f64>([4, 64, 4], &params);
    // A saw of shear: the stress of its straight parts is that of the sum of the viscosities.
    let mut strain = [0.0; 6];
    strain[3] = 0.5 * rate;
    fluid.set_flow(|[_, y, _]| FlowState {
        density: 1.0,
        velocity: [rate * (y as f64 - 31.5), 0.0, 0.0],
        strain,
    });
    let flux = |fluid: &Fluid<f64>| {
        let g = fluid.populations([1, 32, 1]);
        (0..Q).map(|i| (C[i][0] * C[i][1]) as f64 * g[i]).sum::<f64>()
    };
    let exact = |tau: f64| -tau / 3.0 * rate;
    let expected = exact(with_eddies(tau, smagorinsky, strain));
    let before = flux(&fluid);
    for _ in 0..20 {
        step(&mut fluid, [0.0; 3]);
    }
    let after = flux(&fluid);
    println!(
        "momentum flux {before:.6e}, after 20 steps {after:.6e}, exact {expected:.6e}, without eddies {:.6e}",
        exact(tau)
    );
    assert!((before / expected - 1.0).abs() < 1e-12);
    assert!((after / expected - 1.0).abs() < 1e-6);
    // `C^2 |S|` of viscosity is three times as much of a relaxation time.
    let of_eddies = with_eddies(tau, smagorinsky, strain) - tau;
    assert!((of_eddies / (3.0 * smagorinsky * smagorinsky * rate) - 1.0).abs() < 1e-12);
}
