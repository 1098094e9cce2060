//! Flows between walls, against exact solutions and a plain two-lattice code.

use super::*;
use crate::comm::{Comm, on_threads};
use crate::coupling::{Homogenised, sweep_alone};
use crate::domain::Decomposition;
use crate::fluid::{
    BlockSolids, Body, Collision, ExchangeSum, F16, Fluid, FluidParams, RigidMotion, RowSegments, Segment,
    Simd, SphereRows,
};
use crate::lattice::W;
use crate::lattice::shifted_equilibrium;
use crate::math::{Profile, from_fixed_wide};

pub(super) const MAGIC: Collision = Collision::Trt { magic: 0.1875 };

pub(super) fn domain(cells: [usize; 3], periodic: [bool; 3]) -> Domain {
    Domain { cells, faces: Domain::faces(periodic), dx: 1.0 }
}

pub(super) fn params(relaxation_time: f64, collision: Collision) -> FluidParams {
    FluidParams { relaxation_time, collision, simd: Simd::best() }
}

/// Fluid on one rank.
pub(super) fn solo<S: Population>(domain: Domain, params: &FluidParams, boundary: &Boundary) -> Fluid<S> {
    let decomposition = Decomposition::new(domain, 1).unwrap();
    Fluid::new(&decomposition, &Comm::Solo, params, boundary).unwrap()
}

pub(super) fn step<S: Population>(fluid: &mut Fluid<S>, acceleration: [f64; 3]) {
    sweep_alone(fluid, acceleration, false);
    fluid.exchange();
}

/// Numbers the closed faces that a cell lies beyond: `z-` 0, `z+` 1, `y-` 2, ... or none.
pub(super) fn face_of(cells: [usize; 3], cell: [i64; 3]) -> Option<usize> {
    let side = |a: usize| match cell[a] {
        c if c < 0 => Some(0),
        c if c >= cells[a] as i64 => Some(1),
        _ => None,
    };
    (0..3).find_map(|k| side(2 - k).map(|s| 2 * k + s))
}

pub(super) const AT_REST: WallMotion = WallMotion {
    velocity: [0.0; 3],
    angular_velocity: [0.0; 3],
    pivot: [0.0; 3],
    varies: false,
    profile: Profile::Uniform,
    patch: None,
    excess: 0.0,
};

pub(super) fn sliding(velocity: [f64; 3]) -> WallMotion {
    WallMotion { velocity, ..AT_REST }
}

/// A flow without symmetry.
fn disturbed([x, y, z]: [usize; 3]) -> (f64, [f64; 3]) {
    let wave = |a: usize, b: usize| (0.7 * a as f64 + 1.3 * b as f64).sin();
    (1.0 + 0.01 * wave(x, z), [0.03 * wave(y, z), 0.02 * wave(z, x), 0.03 * wave(x, y)])
}

/// An oblique sheet between cells, from face to face.
pub(super) fn oblique_sheet(domain: &Domain, cell: [i64; 3], wall: usize) -> Option<[Option<usize>; Q]> {
    let behind = |cell: [i64; 3]| {
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| {
            let cells = domain.cells[a] as i64;
            if domain.is_periodic(a) { cell[a].rem_euclid(cells) } else { cell[a] }
        });
        5 * x + 7 * y - 3 * z > 60 && y < 12
    };
    let next = |i: usize| std::array::from_fn(|a| cell[a] + C[i][a] as i64);
    let met = std::array::from_fn(|i| (behind(next(i)) != behind(cell)).then_some(wall));
    met.iter().any(Option::is_some).then_some(met)
}

/// A case without any symmetry: closed faces that slide and turn, and an oblique lump of wall, wall number 6, with a
/// cube of solid that reaches into it.
struct Tangle {
    domain: Domain,
    motions: [WallMotion; 7],
    lump: bool,
}

impl Tangle {
    fn new(cells: [usize; 3], periodic: [bool; 3], lump: bool) -> Self {
        let turning = |axis: usize, rate: f64| {
            let mut angular_velocity = [0.0; 3];
            angular_velocity[axis] = rate;
            WallMotion { angular_velocity, pivot: [3.3, 4.2, 5.1], ..AT_REST }
        };
        Self {
            domain: domain(cells, periodic),
            motions: [
                sliding([0.02, -0.03, 0.0]),
                AT_REST,
                turning(1, 1e-3),
                WallMotion { varies: true, ..sliding([0.0, 0.0, 0.04]) },
                AT_REST,
                WallMotion { varies: true, ..turning(0, -2e-3) },
                WallMotion { varies: true, ..turning(2, 3e-3) },
            ],
            lump,
        }
    }

    /// The motions in a step: some walls slow down and turn back.
    fn motions_in(&self, step: usize) -> [WallMotion; 7] {
        self.motions.clone().map(|motion| {
            let scaled =
                |v: [f64; 3]| v.map(|v| if motion.varies { v * (1.0 - 0.2 * step as f64) } else { v });
            WallMotion {
                velocity: scaled(motion.velocity),
                angular_velocity: scaled(motion.angular_velocity),
                ..motion
            }
        })
    }

    fn wall_of(&self, cell: [i64; 3]) -> Option<usize> {
        let [x, y, z] = cell.map(|c| c as f64);
        // In the middle, where small blocks meet, and across the x faces.
        let r = [x - 0.45 * self.domain.cells[0] as f64, y - 6.7, z - 7.6];
        let lump = r[0].abs() + 1.3 * r[1].abs() + 0.8 * r[2].abs() < 4.1 || (x < 2.5 && y > 10.2 && z < 2.7);
        // Along the whole box.
        let lump = lump || (y < 2.2 && z < 1.2);
        face_of(self.domain.cells, cell).or((lump && self.lump).then_some(6))
    }

    /// The lump is round, as far as its links know; the faces are half-way.
    fn part_of_link(wall: usize, cell: [i64; 3], way: [isize; 3]) -> f64 {
        let number = (0..3).fold(7, |n: i64, a| 31 * n + 5 * cell[a] + way[a] as i64);
        if wall == 6 { 0.01 + 0.98 * (number % 97) as f64 / 97.0 } else { 0.5 }
    }

    /// An oblique sheet, the wall number 4, through the lump and all faces.
    fn between(&self, cell: [i64; 3]) -> Option<[Option<usize>; Q]> {
        if self.lump { oblique_sheet(&self.domain, cell, 4) } else { None }
    }

    fn with_boundary<T>(&self, with: impl FnOnce(&Boundary) -> T) -> T {
        let wall_of = &|cell| self.wall_of(cell);
        let between = &|cell| self.between(cell);
        with(&Boundary { motions: &self.motions, wall_of, part_of_link: &Self::part_of_link, between })
    }

    /// Hash, wall forces, momentum, solid fraction after some steps.
    fn outcome<S: Population>(
        &self,
        grid: [usize; 3],
        simd: Simd,
        collision: Collision,
        steps: usize,
    ) -> (u64, Vec<WallLoad>, [i128; 4]) {
        let decomposition = Decomposition::with_grid(self.domain, grid);
        let params = FluidParams { simd, ..params(0.56, collision) };
        let parts = on_threads(decomposition.ranks(), |comm| {
            let mut fluid = self
                .with_boundary(|boundary| Fluid::<S>::new(&decomposition, &comm, &params, boundary).unwrap());
            fluid.set_equilibrium(disturbed);
            let segments = cube(fluid.block());
            let motion = RigidMotion { velocity: [0.02; 3], ..RigidMotion::default() };
            let none = ExchangeSum::default();
            let mut bodies = [Body { id: 0, reference: [0; 3], motion, exchange: none, departed: none }];
            let mut solid = BlockSolids {
                segments: [&segments, &RowSegments::default()],
                spheres: &SphereRows::default(),
                bodies: &mut bodies,
                model: Homogenised { ramp: 0.5 },
                images: None,
            };
            for step in 0..steps {
                fluid.move_walls(&self.motions_in(step));
                fluid.sweep([1e-5, 0.0, -2e-5], &mut solid, false);
                fluid.exchange();
            }
            let (hash, forces) = (fluid.state_hash(), fluid.wall_loads());
            let flow = fluid.sweep([1e-5, 0.0, -2e-5], &mut solid, true).unwrap();
            assert!(flow.fault.is_none());
            let [px, py, pz] = flow.momentum;
            (hash, forces, [px, py, pz, flow.solid])
        });
        let mut sum = (0, vec![WallLoad::default(); self.motions.len()], [0; 4]);
        for (hash, forces, flow) in parts {
            sum.0 = hash.wrapping_add(sum.0);
            for (to, from) in sum.1.iter_mut().zip(&forces) {
                (0..3).for_each(|a| to.force[a] += from.force[a]);
                (0..3).for_each(|a| to.torque[a] += from.torque[a]);
            }
            (0..4).for_each(|a| sum.2[a] += flow[a]);
        }
        sum
    }
}

/// Cells of a cube of solid in a block.
fn cube(block: Block) -> RowSegments {
    let (mut added, mut cut) = (Vec::new(), Vec::new());
    let [x, y, z]: [Vec<usize>; 3] = std::array::from_fn(|a| {
        (block.lo[a]..block.hi[a]).filter(|&c| ([5, 4, 6][a]..[10, 9, 11][a]).contains(&c)).collect()
    });
    for (&z, &y) in z.iter().flat_map(|z| y.iter().map(move |y| (z, y))).filter(|_| !x.is_empty()) {
        let row = y - block.lo[1] + block.size()[1] * (z - block.lo[2]);
        let offset = [x[0] as i32 - 5, y as i32 - 4, z as i32 - 6];
        let segment = Segment {
            x: (x[0] - block.lo[0]) as u32,
            count: x.len() as u16,
            head: x.len() as u16,
            offset,
            cut: cut.len() as u32,
            ..Segment::default()
        };
        cut.extend(x.iter().map(|_| if y == 4 { 0.3 } else { 1.0 }));
        added.push((row as u32, segment));
    }
    let mut segments = RowSegments::default();
    segments.sort(block.size()[1] * block.size()[2], &added, cut);
    segments
}

/// Closed faces.
const CLOSED: [[bool; 3]; 5] = [
    [true, true, false],
    [true, false, true],
    [false, true, true],
    [false, true, false],
    [false, false, false],
];

/// The slow truth: two lattices, one population at a time, written from the formulae.
#[test]
fn the_in_place_kernel_between_moving_walls_agrees_with_a_plain_two_lattice_code() {
    let (cells, tau, magic, a) = ([18, 13, 14], 0.6, 0.2, [2e-5, -1e-5, 3e-5]);
    let tau_odd = 0.5 + magic / (tau - 0.5);
    for periodic in CLOSED {
        let tangle = Tangle::new(cells, periodic, true);
        let params = params(tau, Collision::Trt { magic });
        let mut fluid = tangle.with_boundary(|boundary| solo::<f64>(tangle.domain, &params, boundary));
        fluid.set_equilibrium(disturbed);
        let all: Vec<[usize; 3]> = (0..cells[2])
            .flat_map(|z| (0..cells[1]).flat_map(move |y| (0..cells[0]).map(move |x| [x, y, z])))
            .filter(|&cell| tangle.wall_of(cell.map(|c| c as i64)).is_none())
            .collect();
        assert_eq!(fluid.fluid_cells(), all.len());
        assert!(all.len() < cells.iter().product());
        let index = |c: [usize; 3]| c[0] + cells[0] * (c[1] + cells[1] * c[2]);
        let mut plain = vec![[0.0; Q]; cells.iter().product()];
        for &c in &all {
            plain[index(c)] = fluid.populations(c);
        }
        for number in 0..7 {
            let motions = tangle.motions_in(number);
            fluid.move_walls(&motions);
            let mut collided = plain.clone();
            for &c in &all {
                let g = &plain[index(c)];
                let rho = 1.0 + g.iter().sum::<f64>();
                let u: [f64; 3] =
                    std::array::from_fn(|k| (0..Q).map(|i| C[i][k] as f64 * g[i]).sum::<f64>() / rho);
                let target = std::array::from_fn(|k| u[k] + a[k]);
                let (eq, pushed) = (shifted_equilibrium(rho, u), shifted_equilibrium(rho, target));
                for i in 0..Q {
                    let j = opposite(i);
                    let even = 0.5 * (g[i] + g[j] - eq[i] - eq[j]);
                    let odd = 0.5 * (g[i] - g[j] - eq[i] + eq[j]);
                    collided[index(c)][i] = g[i] - even / tau - odd / tau_odd + pushed[i] - eq[i];
                }
            }
            let (mut forces, mut torques) = ([[0.0; 3]; 7], [[0.0; 3]; 7]);
            let beside = |c: [usize; 3], i: usize| -> [i64; 3] {
                std::array::from_fn(|k| {
                    let there = c[k] as i64 + C[i][k] as i64;
                    if periodic[k] { there.rem_euclid(cells[k] as i64) } else { there }
                })
            };
            let sheet_beyond = |c: [usize; 3], i: usize| tangle.between(c.map(|c| c as i64))?[i];
            for &c in &all {
                let mut gained = 0.0;
                for i in 0..Q {
                    let (from, next) = (beside(c, opposite(i)), beside(c, i));
                    plain[index(c)][i] = if let Some(wall) = tangle.wall_of(from) {
                        let middle = std::array::from_fn(|k| c[k] as f64 + 0.5 - 0.5 * C[i][k] as f64);
                        let u = motions[wall].at(middle);
                        let cu: f64 = (0..3).map(|k| C[i][k] as f64 * u[k]).sum();
                        let (out, mut back) = (collided[index(c)][opposite(i)], 6.0 * W[i] * cu);
                        let q = Tangle::part_of_link(wall, c.map(|c| c as i64), C[opposite(i)]);
                        if wall == 6 && tangle.wall_of(next).is_none() && sheet_beyond(c, i).is_none() {
                            // The closure a f'_-i + b f_-i + c f'_i with c = 1 - a - b.
                            let left = collided[index(c)][i];
                            let arrived = collided[index(next.map(|c| c as usize))][opposite(i)];
                            let g = f64::max(0.0, 1.5 * q * q - 0.75 * q + 0.125 - magic) / (tau - 0.5);
                            let s = 2.0 / (1.0 + 2.0 * q + 2.0 * g);
                            let (a, b) = (1.0 - 2.0 * g * s, 1.0 - 2.0 * q * s);
                            let all = a * out + b * arrived + (1.0 - a - b) * left + s * back;
                            gained += all - out - back;
                            back = all - out;
                        }
                        let force = C[i].map(|c| -(2.0 * out + back) * c as f64);
                        for k in 0..3 {
                            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                            let r: [f64; 3] =
                                std::array::from_fn(|k| middle[k] - tangle.motions[wall].pivot[k]);
                            forces[wall][k] += force[k];
                            torques[wall][k] += r[l] * force[m] - r[m] * force[l];
                        }
                        out + back
                    } else if let Some(wall) = sheet_beyond(c, opposite(i)) {
                        let out = collided[index(c)][opposite(i)];
                        for k in 0..3 {
                            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                            let r: [f64; 3] = std::array::from_fn(|k| {
                                c[k] as f64 + 0.5 - 0.5 * C[i][k] as f64 - tangle.motions[wall].pivot[k]
                            });
                            forces[wall][k] -= 2.0 * out * C[i][k] as f64;
                            torques[wall][k] -= 2.0 * out * (r[l] * C[i][m] as f64 - r[m] * C[i][l] as f64);
                        }
                        out
                    } else {
                        collided[index(from.map(|c| c as usize))][i]
                    };
                }
                plain[index(c)][0] -= gained;
            }
            step(&mut fluid, a);
            for &c in &all {
                let g = fluid.populations(c);
                assert!(
                    (0..Q).all(|i| (g[i] - plain[index(c)][i]).abs() < 1e-14),
                    "cell {c:?}, periodic {periodic:?}"
                );
            }
            for (wall, load) in fluid.wall_loads().iter().enumerate() {
                let (force, torque) = (load.force.map(from_fixed_wide), load.torque.map(from_fixed_wide));
                for k in 0..3 {
                    assert!((force[k] - forces[wall][k]).abs() < 1e-9, "wall {wall}, periodic {periodic:?}");
                    assert!(
                        (torque[k] - torques[wall][k]).abs() < 1e-8,
                        "wall {wall}, periodic {periodic:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn walls_give_the_same_bits_on_any_blocks_and_instruction_set() {
    let cells = [19, 14, 17];
    for (periodic, lump) in CLOSED.into_iter().flat_map(|p| [(p, false), (p, true)]) {
        let tangle = Tangle::new(cells, periodic, lump);
        for steps in [20, 21] {
            let best = Simd::best();
            let single = tangle.outcome::<f32>([1, 1, 1], best, Collision::Bgk, steps);
            let double = tangle.outcome::<f64>([1, 1, 1], best, MAGIC, steps);
            let half = tangle.outcome::<F16>([1, 1, 1], best, MAGIC, steps);
            assert_ne!(single.0, double.0);
            for grid in [[1, 2, 1], [1, 1, 3], [2, 1, 1], [3, 1, 1], [1, 2, 3], [2, 2, 2], [4, 3, 1]] {
                let what = format!("{grid:?}, periodic {periodic:?}, {steps} steps, lump: {lump}");
                assert_eq!(tangle.outcome::<f32>(grid, best, Collision::Bgk, steps), single, "{what}");
                assert_eq!(tangle.outcome::<f64>(grid, best, MAGIC, steps), double, "{what}");
                assert_eq!(tangle.outcome::<F16>(grid, best, MAGIC, steps), half, "{what}");
            }
            for simd in [Simd::Scalar, Simd::Sse2, Simd::Avx2, Simd::Avx512] {
                if simd.is_available() {
                    assert_eq!(tangle.outcome::<f32>([2, 1, 1], simd, Collision::Bgk, steps), single);
                    assert_eq!(tangle.outcome::<f64>([1, 2, 2], simd, MAGIC, steps), double);
                    assert_eq!(tangle.outcome::<F16>([1, 2, 2], simd, MAGIC, steps), half);
                }
            }
        }
    }
}
