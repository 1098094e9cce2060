//! The physics of populations in 16 bits: what rounding them costs.

use super::tests::{bgk, disturbed, solo_with, step, taylor_green_error};
use super::*;

#[test]
fn a_taylor_green_vortex_in_16_bits_is_off_by_less_than_a_third_of_the_error_of_the_grid() {
    let collision = Collision::Trt { magic: 0.1875 };
    let [half, exact] = [taylor_green_error::<F16>(32, collision), taylor_green_error::<f64>(32, collision)];
    println!("Taylor-Green vortex of 32 cells at half decay: error {half:.3e} in f16, {exact:.3e} in f64");
    assert!((half - exact).abs() < exact / 3.0, "{half} {exact}");
}

/// Mean density deviation and velocity of all cells.
fn mean(fluid: &Fluid<F16>) -> [f64; 4] {
    let [nx, ny, nz] = fluid.layout.size;
    let mut sum = [0.0; 4];
    for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
        let (rho, u) = fluid.moments([x, y, z]);
        for (sum, part) in sum.iter_mut().zip([rho - 1.0, rho * u[0], rho * u[1], rho * u[2]]) {
            *sum += part / (nx * ny * nz) as f64;
        }
    }
    sum
}

#[test]
fn rounding_to_16_bits_moves_mean_density_and_momentum_by_less_than_a_thousandth_of_the_speed() {
    let mut fluid = solo_with::<F16>([24, 20, 16], &bgk(0.6, Simd::best()));
    fluid.set_equilibrium(|at| {
        let (rho, u) = disturbed(at);
        (rho, [u[0] + 0.02, u[1], u[2]])
    });
    let start = mean(&fluid);
    let steps = if cfg!(miri) { 1 } else { 10_000 };
    for _ in 0..steps {
        step(&mut fluid, [0.0; 3]);
    }
    let end = mean(&fluid);
    let drift: [f64; 4] = std::array::from_fn(|i| end[i] - start[i]);
    println!("after {steps} steps from density {:.4e}, momentum {:.4e}: drift {drift:?}", start[0], start[1]);
    assert!(drift.iter().all(|drift| drift.abs() < 2e-5), "{drift:?}");
}
