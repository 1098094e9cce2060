//! The physics of the fluid, on every precision, instruction set and decomposition.

use super::simd::Single;
use super::*;
use crate::comm::on_threads;
use crate::coupling::tests::COUPLINGS;
use crate::coupling::{Method, SolidOperator, sweep_alone};
use crate::domain::Domain;
use crate::lattice::{C, W};
use crate::math::from_fixed_wide;
use std::f64::consts::TAU;

const OPERATORS: [Collision; 3] = [
    Collision::Bgk,
    Collision::Trt { magic: 0.1875 },
    Collision::RecursiveRegularised { magic: 0.125, smagorinsky: 0.0 },
];
const EDDIES: Collision = Collision::RecursiveRegularised { magic: 0.125, smagorinsky: 0.3 };
const ALL: [Simd; 4] = [Simd::Scalar, Simd::Sse2, Simd::Avx2, Simd::Avx512];

pub(super) fn bgk(relaxation_time: f64, simd: Simd) -> FluidParams {
    FluidParams { relaxation_time, collision: Collision::Bgk, simd }
}

fn solo<S: Population>(cells: [usize; 3], relaxation_time: f64, simd: Simd) -> Fluid<S> {
    solo_with(cells, &bgk(relaxation_time, simd))
}

pub(super) fn solo_with<S: Population>(cells: [usize; 3], params: &FluidParams) -> Fluid<S> {
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells, dx: 1.0 }, 1).unwrap();
    Fluid::new(&decomposition, &Comm::Solo, params, &Boundary::none()).unwrap()
}

pub(super) fn step<S: Population>(fluid: &mut Fluid<S>, acceleration: [f64; 3]) {
    sweep_alone(fluid, acceleration, false);
    fluid.exchange();
}

/// Amplitude ratio after `steps` of a wave `u_x = U sin(k y)`, divided by the exact decay: 1 + relative error of
/// viscosity.
fn viscosity_error<S: Population>(relaxation_time: f64, collision: Collision, length: usize) -> f64 {
    let params = FluidParams { collision, ..bgk(relaxation_time, Simd::best()) };
    let mut fluid = solo_with::<S>([8, length, 4], &params);
    let k = TAU / length as f64;
    let wave = |y: usize| (k * (y as f64 + 0.5)).sin();
    fluid.set_equilibrium(|[_, y, _]| (1.0, [0.02 * wave(y), 0.0, 0.0]));
    let amplitude = |fluid: &Fluid<S>| -> f64 {
        2.0 / length as f64 * (0..length).map(|y| wave(y) * fluid.moments([3, y, 2]).1[0]).sum::<f64>()
    };
    let viscosity = (relaxation_time - 0.5) / 3.0;
    let steps = (1.0 / (viscosity * k * k)) as usize;
    // Let the non-equilibrium part, zero at the start, build up.
    for _ in 0..50 {
        step(&mut fluid, [0.0; 3]);
    }
    let before = amplitude(&fluid);
    for _ in 0..steps {
        step(&mut fluid, [0.0; 3]);
    }
    let measured = (before / amplitude(&fluid)).ln() / (steps as f64 * k * k);
    measured / viscosity - 1.0
}

#[test]
fn a_shear_wave_decays_with_the_viscosity_of_the_relaxation_time() {
    for (tau, collision) in
        [0.53, 0.55, 0.65, 0.8, 1.0].into_iter().flat_map(|tau| OPERATORS.map(|collision| (tau, collision)))
    {
        let (single, double) =
            (viscosity_error::<f32>(tau, collision, 32), viscosity_error::<f64>(tau, collision, 32));
        println!("tau {tau}, {collision:?}: viscosity error {single:.2e} (f32), {double:.2e} (f64)");
        assert!(single.abs() < 5e-3 && double.abs() < 5e-3, "tau {tau}: {single}, {double}");
    }
}

/// Error of the velocity of a Taylor-Green vortex at the time of half decay, relative to its amplitude.
pub(super) fn taylor_green_error<S: Population>(length: usize, collision: Collision) -> f64 {
    let (tau, speed) = (0.8, 0.02 * 32.0 / length as f64);
    let params = FluidParams { collision, ..bgk(tau, Simd::best()) };
    let mut fluid = solo_with::<S>([length, length, 4], &params);
    let (k, viscosity) = (TAU / length as f64, (tau - 0.5) / 3.0);
    let flow = |x: usize, y: usize, time: f64| {
        let (a, b) = (k * (x as f64 + 0.5), k * (y as f64 + 0.5));
        let u = speed * (-2.0 * viscosity * k * k * time).exp();
        (
            [u * a.cos() * b.sin(), -u * a.sin() * b.cos(), 0.0],
            -0.75 * u * u * ((2.0 * a).cos() + (2.0 * b).cos()),
        )
    };
    fluid.set_equilibrium(|[x, y, _]| {
        let (u, density) = flow(x, y, 0.0);
        (1.0 + density, u)
    });
    let steps = (2.0_f64.ln() / (2.0 * viscosity * k * k)).round() as usize;
    for _ in 0..steps {
        step(&mut fluid, [0.0; 3]);
    }
    let mut square = 0.0;
    for (x, y) in (0..length).flat_map(|x| (0..length).map(move |y| (x, y))) {
        let (u, exact) = (fluid.moments([x, y, 1]).1, flow(x, y, steps as f64).0);
        square += (0..3).map(|a| (u[a] - exact[a]).powi(2)).sum::<f64>();
    }
    (square / (length * length) as f64).sqrt() / (speed / 2.0)
}

#[test]
fn a_taylor_green_vortex_converges_with_second_order() {
    for collision in OPERATORS {
        let errors = [16, 32, 64].map(|length| taylor_green_error::<f64>(length, collision));
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{collision:?}: Taylor-Green errors {errors:?}, orders {orders:?}");
        assert!(orders.iter().all(|order| (1.8..2.2).contains(order)), "{orders:?} from {errors:?}");
    }
}

#[test]
fn two_equal_relaxation_times_are_one() {
    let (cells, tau): (_, f64) = ([13, 6, 5], 0.56);
    let magic = (tau - 0.5) * (tau - 0.5);
    let [one, two] = [Collision::Bgk, Collision::Trt { magic }].map(|collision| {
        let params = FluidParams { collision, ..bgk(tau, Simd::best()) };
        let mut fluid = solo_with::<f64>(cells, &params);
        fluid.set_equilibrium(disturbed);
        for _ in 0..11 {
            step(&mut fluid, [1e-5, 0.0, -2e-5]);
        }
        fluid.populations([12, 5, 2])
    });
    assert!((0..Q).any(|i| one[i].to_bits() != two[i].to_bits()));
    assert!((0..Q).all(|i| (one[i] - two[i]).abs() < 1e-15), "{one:?} {two:?}");
}

#[test]
fn a_uniform_body_force_accelerates_a_periodic_fluid_exactly() {
    for simd in ALL.into_iter().filter(|simd| simd.is_available()) {
        let mut fluid = solo::<f64>([9, 5, 6], 0.55, simd);
        let a = [1e-5, -2e-5, 3e-5];
        for _ in 0..100 {
            step(&mut fluid, a);
        }
        for cell in [[0, 0, 0], [8, 4, 5], [4, 2, 3]] {
            let (rho, u) = fluid.moments(cell);
            let worst = (0..3).map(|i| (u[i] - 100.0 * a[i]).abs()).fold(0.0, f64::max);
            println!("{simd:?}, {cell:?}: density off by {:.1e}, velocity by {worst:.1e}", (rho - 1.0).abs());
            assert!((rho - 1.0).abs() < 1e-14);
            assert!((0..3).all(|i| (u[i] - 100.0 * a[i]).abs() < 1e-15), "{u:?}");
        }
    }
}

/// A flow without symmetry, in lattice units.
pub(super) fn disturbed([x, y, z]: [usize; 3]) -> (f64, [f64; 3]) {
    let wave = |a: usize, b: usize| (0.7 * a as f64 + 1.3 * b as f64).sin();
    (1.0 + 0.01 * wave(x, z), [0.03 * wave(y, z), 0.02 * wave(z, x), 0.03 * wave(x, y)])
}

/// Evaluates an expression with two overlapping cubes of solid near a corner of a box of `cells`, as far as they lie in `block`,
/// given cell by cell; each layer in y has its own velocity.
fn with_cubes<M: SolidModel, R>(
    cells: [usize; 3],
    block: Block,
    model: M,
    work: impl FnOnce(&mut BlockSolids<M>) -> R,
) -> R {
    let (mut added, mut cut, mut bodies) = (Vec::new(), Vec::new(), Vec::new());
    for (cube, j) in (0..2).flat_map(|cube| (0..6).map(move |j| (cube, j))) {
        let velocity = [0.02, -0.01 * j as f64, 0.01 * cube as f64];
        let motion = RigidMotion { velocity, ..RigidMotion::default() };
        let none = ExchangeSum::default();
        bodies.push(Body { id: 0, reference: [0; 3], motion, exchange: none, departed: none });
        for (k, i) in (0..6).flat_map(|k| (0..6).map(move |i| (k, i))) {
            let at = [i + cells[0] - 3 + cube, j + cells[1] - 2, k + 1 + 2 * cube];
            let at: [usize; 3] = std::array::from_fn(|a| at[a] % cells[a]);
            if (0..3).all(|a| (block.lo[a]..block.hi[a]).contains(&at[a])) {
                let [x, y, z] = std::array::from_fn(|a| at[a] - block.lo[a]);
                let offset = [i, j, k].map(|n| n as i32);
                let segment = Segment {
                    body: bodies.len() as u32 - 1,
                    x: x as u32,
                    count: 1,
                    head: 1,
                    offset,
                    cut: cut.len() as u32,
                    ..Segment::default()
                };
                cut.push(if i % 5 == 0 || j % 5 == 0 { 0.3 } else { 1.0 });
                added.push(((y + block.size()[1] * z) as u32, segment));
            }
        }
    }
    let mut segments = RowSegments::default();
    segments.sort(block.size()[1] * block.size()[2], &added, cut);
    work(&mut BlockSolids {
        segments: [&segments, &RowSegments::default()],
        spheres: &SphereRows::default(),
        bodies: &mut bodies,
        model,
        images: None,
    })
}

fn sweep_cubes<S: Population>(fluid: &mut Fluid<S>, acceleration: [f64; 3], method: Method) {
    let (cells, block) = (fluid.domain.cells, fluid.block());
    match method {
        Method::Homogenised(m) => with_cubes(cells, block, m, |s| fluid.sweep(acceleration, s, false)),
        Method::Saturated(m) => with_cubes(cells, block, m, |s| fluid.sweep(acceleration, s, false)),
    };
}

fn hash_after<S: Population>(
    cells: [usize; 3],
    ranks: usize,
    simd: Simd,
    steps: usize,
    (method, collision): (Method, Collision),
) -> u64 {
    let decomposition =
        Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells, dx: 1.0 }, ranks).unwrap();
    on_threads(ranks, |comm| {
        let params = FluidParams { collision, ..bgk(0.56, simd) };
        let mut fluid = Fluid::<S>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
        fluid.set_equilibrium(disturbed);
        for _ in 0..steps {
            sweep_cubes(&mut fluid, [1e-5, 0.0, -2e-5], method);
            fluid.exchange();
        }
        fluid.state_hash()
    })
    .into_iter()
    .fold(0, u64::wrapping_add)
}

#[test]
fn any_number_of_ranks_and_any_instruction_set_give_the_same_bits() {
    let cells = [19, 14, 17];
    let all = COUPLINGS.into_iter().zip([20, 21, 20, 21]).chain([(COUPLINGS[0], 21)]);
    let all = all.map(|(method, steps)| (method, method.usual_collision(), steps));
    let all = all.chain([(COUPLINGS[3], EDDIES, 21), (COUPLINGS[1], EDDIES, 20)]);
    // Miri is a thousand times slower, and wants each access once.
    let (cases, most) =
        if cfg!(miri) { (vec![(COUPLINGS[0], Collision::Bgk, 2)], 2) } else { (all.collect(), 12) };
    for (method, collision, steps) in cases {
        let of = (method, collision);
        let [half, single, double] = [
            hash_after::<F16>(cells, 1, Simd::Scalar, steps, of),
            hash_after::<f32>(cells, 1, Simd::Scalar, steps, of),
            hash_after::<f64>(cells, 1, Simd::Scalar, steps, of),
        ];
        assert_ne!(single, double);
        for ranks in [1, 2, 3, 4, 6, 8, 12].into_iter().filter(|ranks| *ranks <= most) {
            for simd in ALL.into_iter().filter(|simd| simd.is_available()) {
                assert_eq!(
                    hash_after::<F16>(cells, ranks, simd, steps, of),
                    half,
                    "f16, {ranks} ranks, {simd:?}, {of:?}"
                );
                assert_eq!(
                    hash_after::<f32>(cells, ranks, simd, steps, of),
                    single,
                    "f32, {ranks} ranks, {simd:?}, {of:?}"
                );
                assert_eq!(
                    hash_after::<f64>(cells, ranks, simd, steps, of),
                    double,
                    "f64, {ranks} ranks, {simd:?}, {of:?}"
                );
            }
        }
    }
}

/// `B` of a solid fraction and its excess over all bodies, at `t = tau - 1/2`.
fn weight(e: f64, overlap: f64, t: f64) -> f64 {
    e * (0.25 + 0.75 * e) * t / (0.6 * (1.0 - e) + 0.01 + 20.0 * t * overlap)
}

/// Populations of a cell after its collision, one at a time by the formulas; no operator if it is homogenised. Solids: fraction, its excess over all
/// bodies, and velocity.
fn collided(
    g: &[f64; Q],
    params: &FluidParams,
    operator: Option<SolidOperator>,
    a: [f64; 3],
    (e, overlap, us): (f64, f64, [f64; 3]),
) -> [f64; Q] {
    let tau = params.relaxation_time;
    let tau_odd = match params.collision {
        Collision::Bgk => tau,
        Collision::Trt { magic } | Collision::RecursiveRegularised { magic, .. } => 0.5 + magic / (tau - 0.5),
    };
    if let (Collision::RecursiveRegularised { smagorinsky, .. }, Some(_), true) =
        (params.collision, operator, e <= 0.0)
    {
        return regularised(g, tau, smagorinsky, a);
    }
    let rho = 1.0 + g.iter().sum::<f64>();
    let u: [f64; 3] = std::array::from_fn(|a| (0..Q).map(|i| C[i][a] as f64 * g[i]).sum::<f64>() / rho);
    let opposite = crate::lattice::opposite;
    let (eq, solid) = (shifted_equilibrium(rho, u), shifted_equilibrium(rho, us));
    let halves = |f: &[f64; Q], i: usize| {
        let k = opposite(i);
        [0.5 * (f[i] + f[k]), 0.5 * (f[i] - f[k])]
    };
    let deviation: [f64; Q] = std::array::from_fn(|i| g[i] - eq[i]);
    let relaxed = |i: usize, [even, odd]: [f64; 2]| {
        let [sum, difference] = halves(&deviation, i);
        -sum / even - difference / odd
    };
    let beta = weight(e, overlap, tau - 0.5);
    let b = if operator.is_some() { beta / (1.0 + beta) } else { 0.0 };
    let target: [f64; 3] = std::array::from_fn(|k| match operator {
        None => (1.0 - e) * (u[k] + a[k]) + e * us[k],
        Some(_) => u[k] + (1.0 - e) * a[k],
    });
    let pushed = shifted_equilibrium(rho, target);
    let push: [f64; Q] = std::array::from_fn(|i| pushed[i] - eq[i]);
    std::array::from_fn(|i| {
        let k = opposite(i);
        let fluid = relaxed(i, [tau, tau_odd]) + push[i];
        match operator {
            None => g[i] + fluid,
            Some(SolidOperator::Sc1) => g[i] + (1.0 - b) * fluid + b * (g[k] - g[i] + solid[i] - eq[k]),
            Some(SolidOperator::Sc2) => {
                g[i] + (1.0 - b) * fluid + b * (solid[i] - eq[i] + relaxed(i, [tau, tau_odd]))
            }
            Some(SolidOperator::Sc3) => {
                let odd = 0.5 + (tau_odd - 0.5) / (1.0 + 2.0 * (tau_odd - 0.5) * beta);
                let times = [tau + 0.5 * beta, odd];
                let [even_push, odd_push] = halves(&push, i);
                let [_, relative] = halves(&std::array::from_fn(|j| eq[j] - solid[j]), i);
                g[i] + relaxed(i, times) + tau / times[0] * even_push + (1.0 - b) * odd_push
                    - 2.0 * b * relative
            }
        }
    })
}

/// The recursive regularised collision by Hermite polynomials up to the third degree, with those combined that are orthogonal on this
/// lattice (Coreixas 2017).
fn regularised(g: &[f64; Q], tau: f64, smagorinsky: f64, a: [f64; 3]) -> [f64; Q] {
    let delta = |a: usize, b: usize| if a == b { 1.0 } else { 0.0 };
    let c = |i: usize| C[i].map(|c| c as f64);
    let rho = 1.0 + g.iter().sum::<f64>();
    let u: [f64; 3] = std::array::from_fn(|a| (0..Q).map(|i| c(i)[a] * g[i]).sum::<f64>() / rho);
    let flux = |a: usize, b: usize| (0..Q).map(|i| c(i)[a] * c(i)[b] * (g[i] + W[i])).sum::<f64>();
    let pi: [[f64; 3]; 3] = std::array::from_fn(|a| {
        std::array::from_fn(|b| flux(a, b) - rho * (delta(a, b) / 3.0 + u[a] * u[b]))
    });
    let size = pi.iter().flatten().map(|pi| pi * pi).sum::<f64>().sqrt();
    let root = tau * tau + 18.0 * 2.0_f64.sqrt() * smagorinsky * smagorinsky * size / rho;
    let k = 1.0 - 2.0 / (tau + root.sqrt());
    let t: [f64; 3] = std::array::from_fn(|axis| u[axis] + a[axis]);
    let second = |a: usize, b: usize| rho * t[a] * t[b] + k * pi[a][b];
    // Third moments a, b, b.
    let third = |a: usize, b: usize| rho * t[a] * t[b] * t[b] + k * (t[a] * pi[b][b] + 2.0 * t[b] * pi[a][b]);
    std::array::from_fn(|i| {
        let c = c(i);
        let h3 = |a: usize, b: usize| c[a] * (c[b] * c[b] - 1.0 / 3.0);
        let mut f = rho + 3.0 * rho * (0..3).map(|a| c[a] * t[a]).sum::<f64>();
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            f += 4.5 * (c[a] * c[b] - delta(a, b) / 3.0) * second(a, b);
        }
        for [a, b, d] in [[0, 1, 2], [1, 0, 2], [2, 0, 1]] {
            let sums = (h3(a, b) + h3(a, d)) * (third(a, b) + third(a, d));
            let differences = (h3(a, b) - h3(a, d)) * (third(a, b) - third(a, d));
            f += 4.5 * (3.0 * sums + differences);
        }
        W[i] * f - W[i]
    })
}

fn solids_of<M: SolidModel>(
    solids: &BlockSolids<M>,
    all: &[[usize; 3]],
    [nx, ny, _]: [usize; 3],
) -> Vec<(f64, f64, [f64; 3])> {
    let of = |&[x, y, z]: &[usize; 3]| {
        let mut row = SolidRow::<f64>::new(nx.div_ceil(CHUNK));
        solids.fill::<f64, Single>(y + ny * z, nx, &mut row);
        row.cell(x)
    };
    all.iter().map(of).collect()
}

/// The slow truth: two lattices, one population at a time, written from the formulae.
#[test]
fn the_in_place_kernel_agrees_with_a_plain_two_lattice_code() {
    let (cells, a) = ([10, 7, 6], [2e-5, -1e-5, 3e-5]);
    let all: Vec<[usize; 3]> = (0..cells[2])
        .flat_map(|z| (0..cells[1]).flat_map(move |y| (0..cells[0]).map(move |x| [x, y, z])))
        .collect();
    let index = |c: [usize; 3]| c[0] + cells[0] * (c[1] + cells[1] * c[2]);
    let methods = COUPLINGS
        .iter()
        .flat_map(|&m| OPERATORS.into_iter().chain([EDDIES]).map(move |collision| (m, collision)));
    let has = |(method, collision): &(Method, Collision)| {
        let homogenised = matches!(method, Method::Homogenised(_));
        !homogenised || !matches!(collision, Collision::RecursiveRegularised { .. })
    };
    for (method, collision) in methods.filter(has) {
        let params = FluidParams { collision, ..bgk(0.6, Simd::best()) };
        let operator = match method {
            Method::Homogenised(_) => None,
            Method::Saturated(saturated) => Some(saturated.operator),
        };
        let mut fluid = solo_with::<f64>(cells, &params);
        let block = fluid.block();
        fluid.set_equilibrium(disturbed);
        // Fraction, its excess over all bodies, and velocity of the solids in each cell.
        let solids: Vec<(f64, f64, [f64; 3])> = match method {
            Method::Homogenised(m) => with_cubes(cells, block, m, |s| solids_of(s, &all, cells)),
            Method::Saturated(m) => with_cubes(cells, block, m, |s| solids_of(s, &all, cells)),
        };
        let mut plain: Vec<[f64; Q]> = all
            .iter()
            .map(|&c| {
                let (rho, u) = disturbed(c);
                shifted_equilibrium(rho, u)
            })
            .collect();
        for _ in 0..7 {
            let mut next = plain.clone();
            for &c in &all {
                let after = collided(&plain[index(c)], &params, operator, a, solids[index(c)]);
                for (i, after) in after.into_iter().enumerate() {
                    let to: [usize; 3] = std::array::from_fn(|k| {
                        (c[k] as isize + C[i][k]).rem_euclid(cells[k] as isize) as usize
                    });
                    next[index(to)][i] = after;
                }
            }
            plain = next;
            sweep_cubes(&mut fluid, a, method);
            fluid.exchange();
            for &c in &all {
                let g = fluid.populations(c);
                assert!(
                    (0..Q).all(|i| (g[i] - plain[index(c)][i]).abs() < 1e-14),
                    "cell {c:?}, {method:?}, {collision:?}"
                );
            }
        }
    }
}

#[test]
fn an_operator_gives_a_solid_cell_the_momentum_that_the_particle_is_told() {
    let g = shifted_equilibrium(1.02, [0.03, -0.01, 0.02]).map(|x| x * 1.1 + 1e-3);
    let us = [0.01, 0.02, -0.03];
    let momentum = |g: &[f64; Q], a: usize| (0..Q).map(|i| C[i][a] as f64 * g[i]).sum::<f64>();
    let rho = 1.0 + g.iter().sum::<f64>();
    for operator in SolidOperator::ALL {
        let params = FluidParams { collision: Collision::Trt { magic: 0.125 }, ..bgk(0.56, Simd::best()) };
        for (e, overlap, force) in [(1.0, 0.0, 0.0), (0.4, 0.0, 1e-3), (0.8, 0.2, 1e-3)] {
            let after = collided(&g, &params, Some(operator), [force, 0.0, 0.0], (e, overlap, us));
            let mass: f64 = after.iter().sum();
            assert!((mass - g.iter().sum::<f64>()).abs() < 1e-15);
            let beta = weight(e, overlap, 0.06);
            let b = beta / (1.0 + beta);
            for a in 0..3 {
                let fed = if a == 0 { (1.0 - b) * (1.0 - e) * rho * force } else { 0.0 };
                let expected = fed + b * operator.momentum() * (rho * us[a] - momentum(&g, a));
                let given = momentum(&after, a) - momentum(&g, a);
                assert!((given - expected).abs() < 1e-15, "{operator:?} {e}");
            }
        }
    }
}

#[test]
fn a_measuring_sweep_sees_the_momentum_before_the_collision_and_changes_nothing() {
    let (mut fluid, mut twin) =
        (solo::<f32>([13, 6, 5], 0.6, Simd::best()), solo::<f32>([13, 6, 5], 0.6, Simd::best()));
    for f in [&mut fluid, &mut twin] {
        f.set_equilibrium(disturbed);
    }
    let expected: f64 = (0..13 * 6 * 5)
        .map(|n| {
            let (rho, u) = fluid.moments([n % 13, n / 13 % 6, n / 78]);
            rho * u[1]
        })
        .sum();
    let flow = sweep_alone(&mut fluid, [0.0; 3], true).unwrap();
    sweep_alone(&mut twin, [0.0; 3], false);
    assert!((from_fixed_wide(flow.momentum[1]) - expected).abs() < 1e-5);
    assert!(flow.max_speed > 0.03 && flow.fault.is_none());
    fluid.exchange();
    twin.exchange();
    assert_eq!(fluid.state_hash(), twin.state_hash());
}

#[test]
fn a_cell_that_is_too_fast_or_not_a_number_is_found() {
    for bad in [0.45, f64::NAN] {
        let mut fluid = solo::<f32>([13, 6, 5], 0.6, Simd::best());
        fluid.set_equilibrium(|c| (1.0, if c == [12, 3, 4] { [0.0, bad, 0.0] } else { [0.0; 3] }));
        let (cell, _) = sweep_alone(&mut fluid, [0.0; 3], true).unwrap().fault.expect("a fault");
        assert_eq!(cell, [12, 3, 4]);
    }
}

#[test]
fn the_fault_that_is_told_is_the_first_in_the_box_though_rows_next_to_others_are_swept_first_on_4_ranks() {
    // Along y and along z the later cell lies in a row that is swept first.
    for (first, later) in [([3, 2, 2], [3, 5, 2]), ([3, 2, 2], [1, 2, 7]), ([9, 3, 1], [1, 5, 3])] {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [13, 12, 16], dx: 1.0 };
        let grid = [1, 2, 2];
        let decomposition = Decomposition::with_grid(domain, grid);
        let faults = on_threads(4, |comm| {
            let params = bgk(0.6, Simd::best());
            let mut fluid = Fluid::<f32>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
            fluid.set_equilibrium(|c| {
                let bad = c == first || c == later;
                (1.0, if bad { [0.0, 0.45, 0.0] } else { [0.0; 3] })
            });
            let flow = sweep_alone(&mut fluid, [0.0; 3], true);
            fluid.exchange();
            flow.unwrap().fault.map(|(cell, _)| cell)
        });
        assert_eq!(faults, [Some(first), None, None, None]);
    }
}

#[test]
fn what_departed_from_a_cell_is_what_its_neighbours_received() {
    let cells = [18, 9, 8];
    // Before the first step, too, as if one had been.
    for steps in [0, 4, 5] {
        let mut fluid = solo::<f64>(cells, 0.6, Simd::best());
        fluid.set_equilibrium(disturbed);
        for _ in 0..steps {
            step(&mut fluid, [0.0; 3]);
        }
        // In the middle, and where all neighbours are ghosts.
        for cell in [[7, 4, 3], [17, 8, 7], [0, 0, 0]] {
            let mut sum = [0.0; 4];
            for i in 1..Q {
                let to = std::array::from_fn(|a| {
                    (cell[a] as isize + C[i][a]).rem_euclid(cells[a] as isize) as usize
                });
                let g = fluid.populations(to)[i];
                (0..3).for_each(|a| sum[a] += C[i][a] as f64 * g);
                sum[3] += g;
            }
            let departed = fluid.departed(cell);
            assert!((0..4).all(|a| (departed[a] - sum[a]).abs() < 1e-15), "{cell:?}: {departed:?} {sum:?}");
        }
    }
}
