use super::super::tests::{AT_REST, MAGIC, face_of, oblique_sheet, params, step};
use super::super::*;
use crate::comm::{Comm, on_threads};
use crate::domain::Decomposition;
use crate::fluid::{Collision, F16, Fluid, FluidParams, Simd};
use crate::lattice::W;
use crate::math::{Patch, Profile, from_fixed_wide};
use std::collections::HashMap;

const OUTLET: Face = Face::Outlet { excess: -0.004, relaxation: None, patch: None };
const ABSORBING: Face = Face::Outlet { excess: -0.004, relaxation: Some(0.02), patch: None };

/// A part of each face.
const PATCH: Patch = Patch::Rectangle { lower: [2.0, 3.0, 2.0], upper: [6.0, 8.0, 9.0], axis: 3 };

/// An outlet in a part of a face.
fn patched(axis: usize, relaxation: Option<f64>) -> Face {
    Face::Outlet { excess: -0.004, relaxation, patch: Some(Box::leak(Box::new(across(axis)))) }
}

fn across(axis: usize) -> Patch {
    let Patch::Rectangle { lower, upper, .. } = PATCH else { unreachable!() };
    Patch::Rectangle { lower, upper, axis }
}

/// A box whose faces are of several kinds, with a lump of wall that reaches some of them; walls slide.
struct Open {
    domain: Domain,
    motions: [WallMotion; 7],
    lump: [[i64; 2]; 3],
}

impl Open {
    fn new(cells: [usize; 3], faces: [Face; 6], lump: [[i64; 2]; 3]) -> Self {
        // Walls are numbered from z- on.
        let motions = [4, 5, 2, 3, 0, 1].map(|n: usize| {
            let mut motion = AT_REST;
            match faces[n] {
                Face::Inlet => {
                    let along = (n / 2 + 1) % 3;
                    motion.velocity[n / 2] = if n.is_multiple_of(2) { 0.03 } else { -0.03 };
                    let mut walls = [None; 3];
                    walls[along] = Some([0.0, cells[along] as f64]);
                    motion.profile = Profile::Parabolic(walls);
                    // Beside an outlet in a part of its face the inlet has a part of its own.
                    if faces.iter().any(|face| matches!(face, Face::Outlet { patch: Some(_), .. })) {
                        (motion.profile, motion.patch) = (Profile::Uniform, Some(across(n / 2)));
                    }
                }
                Face::Wall => motion.velocity[(n / 2 + 1) % 3] = 0.01 * n as f64,
                _ => {}
            }
            motion
        });
        let [x_low, x_high, y_low, y_high, z_low, z_high] =
            [4, 5, 2, 3, 0, 1].map(|n: usize| motions[n].clone());
        let motions = [z_low, z_high, y_low, y_high, x_low, x_high, AT_REST];
        Self { domain: Domain { cells, faces, dx: 1.0 }, motions, lump }
    }

    fn wall_of(&self, cell: [i64; 3]) -> Option<usize> {
        let lump = (0..3).all(|a| (self.lump[a][0]..self.lump[a][1]).contains(&cell[a]));
        let beyond =
            |a: usize| !self.domain.is_periodic(a) && !(0..self.domain.cells[a] as i64).contains(&cell[a]);
        let face = if (0..3).any(beyond) { face_of(self.domain.cells, cell) } else { None };
        face.or(lump.then_some(6))
    }

    fn fluid<S: Population>(
        &self,
        decomposition: &Decomposition,
        comm: &Comm,
        simd: Simd,
        collision: Collision,
    ) -> Fluid<S> {
        let params = FluidParams { simd, ..params(0.6, collision) };
        let part_of_link = &|_, cell: [i64; 3], _| 0.1 + 0.2 * (cell[0] + cell[1]).rem_euclid(5) as f64;
        let wall_of = &|cell| self.wall_of(cell);
        // Beside a lump also a sheet.
        let has_sheet = self.lump != [[0; 2]; 3];
        let between = &|cell| if has_sheet { oblique_sheet(&self.domain, cell, 6) } else { None };
        let boundary = Boundary { motions: &self.motions, wall_of, part_of_link, between };
        let mut fluid = Fluid::new(decomposition, comm, &params, &boundary).unwrap();
        fluid.set_equilibrium(disturbed);
        fluid
    }

    fn solo(&self) -> Fluid<f64> {
        let decomposition = Decomposition::new(self.domain, 1).unwrap();
        self.fluid(&decomposition, &Comm::Solo, Simd::best(), MAGIC)
    }
}

/// A flow without symmetry.
fn disturbed([x, y, z]: [usize; 3]) -> (f64, [f64; 3]) {
    let wave = |a: usize, b: usize| (0.7 * a as f64 + 1.3 * b as f64).sin();
    (1.0 + 0.01 * wave(x, z), [0.03 * wave(y, z), 0.02 * wave(z, x), 0.03 * wave(x, y)])
}

/// A flow that is symmetric about the plane `z = middle`.
fn mirrored(middle: usize) -> impl Fn([usize; 3]) -> (f64, [f64; 3]) {
    move |[x, y, z]| {
        let upper = z >= middle;
        let (rho, [u, v, w]) = disturbed([x, y, if upper { 2 * middle - 1 - z } else { z }]);
        (rho, [u, v, if upper { -w } else { w }])
    }
}

/// Kinds of faces with all neighbours along edges: periodic, free slip, outlets, an inlet, walls.
fn boxes() -> Vec<[Face; 6]> {
    let (p, w, s, i) = (Face::Periodic, Face::Wall, Face::FreeSlip, Face::Inlet);
    vec![
        [p, p, p, p, s, s],
        [p, p, s, w, p, p],
        [s, s, p, p, p, p],
        [i, OUTLET, w, w, p, p],
        [i, OUTLET, s, w, s, s],
        [p, p, s, w, i, OUTLET],
        [w, s, OUTLET, OUTLET, w, w],
        [p, p, p, p, OUTLET, i],
        [s, OUTLET, s, i, OUTLET, w],
        [i, ABSORBING, w, w, p, p],
        [s, ABSORBING, ABSORBING, i, ABSORBING, w],
        [i, patched(0, None), w, w, p, p],
        [i, patched(0, Some(0.02)), s, w, s, s],
        [p, p, s, patched(1, None), i, patched(2, None)],
        [w, s, patched(1, None), OUTLET, w, patched(2, Some(0.02))],
    ]
}

#[test]
fn a_box_that_ends_at_a_plane_of_symmetry_has_the_flow_of_the_whole_one() {
    let (p, w, s, i) = (Face::Periodic, Face::Wall, Face::FreeSlip, Face::Inlet);
    for along in [[p, p, p, p], [w, w, i, OUTLET], [i, OUTLET, p, p], [i, OUTLET, s, w]] {
        for lump in [[[0; 2]; 3], [[3, 6], [4, 8], [5, 11]]] {
            let faces = |upper| [along[0], along[1], along[2], along[3], w, upper];
            let mut whole = Open::new([9, 10, 16], faces(w), lump);
            let mut half = Open::new([9, 10, 8], faces(s), lump);
            for of in [&mut whole, &mut half] {
                // What moves along z, or changes along it, is not symmetric.
                for motion in &mut of.motions[..4] {
                    motion.velocity[2] = 0.0;
                    motion.profile = Profile::Uniform;
                }
                of.motions[..2].fill(AT_REST);
            }
            // The lump is half-way in both: the same links on both sides of the plane.
            let mut fluids = [whole, half].map(|of| {
                let decomposition = Decomposition::new(of.domain, 1).unwrap();
                let boundary = Boundary {
                    motions: &of.motions,
                    wall_of: &|cell| of.wall_of(cell),
                    part_of_link: HALF_WAY,
                    between: NO_SHEETS,
                };
                let params = params(0.6, MAGIC);
                let mut fluid = Fluid::<f64>::new(&decomposition, &Comm::Solo, &params, &boundary).unwrap();
                fluid.set_equilibrium(mirrored(8));
                fluid
            });
            for number in 0..15 {
                for fluid in &mut fluids {
                    step(fluid, [1e-4, 2e-5, 0.0]);
                }
                let [whole, half] = &fluids;
                for (z, y, x) in
                    (0..8).flat_map(|z| (0..10).flat_map(move |y| (0..9).map(move |x| (z, y, x))))
                {
                    if whole.walls.of([x, y, z]).is_some() {
                        continue;
                    }
                    let (a, b) = (whole.populations([x, y, z]), half.populations([x, y, z]));
                    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(apart < 1e-14, "{along:?}, lump {lump:?}, step {number}: {apart} at {x} {y} {z}");
                }
            }
        }
    }
}

#[test]
fn an_outlet_sends_back_what_a_like_cell_beyond_would_send() {
    for faces in boxes() {
        let open = Open::new([9, 10, 11], faces, [[0; 2]; 3]);
        let mut fluid = open.solo();
        let mut links = 0;
        // Mean momenta of the cells at faces that absorb.
        let mut means = HashMap::new();
        for number in 0..6 {
            let added = 1e-4 * f64::from(number);
            if number > 0 {
                let excess = |motion: &WallMotion| WallMotion { excess: added, ..motion.clone() };
                fluid.move_walls(&open.motions.iter().map(excess).collect::<Vec<_>>());
                step(&mut fluid, [1e-4, 0.0, 0.0]);
            }
            for (n, face) in faces.iter().enumerate() {
                let &Face::Outlet { excess, relaxation, patch } = face else { continue };
                let (axis, inwards) = (n / 2, if n.is_multiple_of(2) { 1 } else { -1 });
                for number in 0..9 * 10 * 11 {
                    let source = [number % 9, number / 9 % 10, number / 90];
                    let size = open.domain.cells;
                    let at = if n.is_multiple_of(2) { 0 } else { size[axis] - 1 };
                    // Away from other faces.
                    let inside = |a: usize| a == axis || (source[a] > 1 && source[a] + 2 < size[a]);
                    if source[axis] != at || !(0..3).all(inside) {
                        continue;
                    }
                    let [x, y, z] = source.map(|n| n as isize);
                    let cell = fluid.layout.cell(x, y, z);
                    let sent: [f64; Q] = std::array::from_fn(|i| fluid.populations[fluid.left(cell, i)]);
                    let j: [f64; 3] = std::array::from_fn(|a| (1..Q).map(|i| C[i][a] as f64 * sent[i]).sum());
                    let square: f64 = j.iter().map(|j| j * j).sum();
                    let out = -f64::from(inwards as i8) * j[axis];
                    let mean = means.entry((n, source)).or_insert(out);
                    let absorbed = relaxation.map_or(0.0, |rate| {
                        *mean += rate * (out - *mean);
                        3.0_f64.sqrt() * (out - *mean)
                    });
                    let rho = 1.5 * sent[1..].iter().sum::<f64>() - 0.75 * square;
                    for i in (1..Q).filter(|&i| C[i][axis] == inwards) {
                        let along: [isize; 3] = std::array::from_fn(|a| if a == axis { 0 } else { C[i][a] });
                        let to = std::array::from_fn(|a| (source[a] as isize + along[a]) as usize);
                        if patch.is_some_and(|patch| !patch.has(source.map(|n| n as f64 + 0.5))) {
                            let [x, y, z] = to.map(|n| n as isize);
                            let back = fluid.left(fluid.layout.cell(x, y, z), opposite(i));
                            let [found, sent] =
                                [fluid.populations(to)[i], fluid.populations[back]].map(f64::to_bits);
                            assert_eq!(found, sent, "{faces:?}");
                            continue;
                        }
                        let wanted = excess + added + absorbed;
                        let expected = sent[i] + 2.0 * W[i] * (wanted - rho);
                        assert!((fluid.populations(to)[i] - expected).abs() < 1e-15, "{faces:?}");
                        links += 1;
                    }
                }
            }
        }
        assert_eq!(links > 0, faces.iter().any(|face| matches!(face, Face::Outlet { .. })));
    }
}

#[test]
fn the_mass_that_faces_let_in_is_what_the_fluid_gains_of_an_inlet_its_mean_velocity_times_its_area_and_none_of_a_wall_that_slides()
 {
    let mut sliding = 0;
    for faces in boxes() {
        let open = Open::new([9, 10, 11], faces, [[0; 2]; 3]);
        let mut fluid = open.solo();
        let mass = |fluid: &Fluid<f64>| -> f64 {
            let all = (0..9 * 10 * 11).map(|n| [n % 9, n / 9 % 10, n / 90]);
            all.map(|cell| fluid.populations(cell).iter().sum::<f64>()).sum()
        };
        for _ in 0..6 {
            let before = mass(&fluid);
            step(&mut fluid, [1e-4, 0.0, 0.0]);
            let loads = fluid.wall_loads();
            let gained: f64 = loads.iter().map(|load| from_fixed_wide(load.mass)).sum();
            assert!((mass(&fluid) - before - gained).abs() < 1e-9, "{faces:?}: {gained}");
            for (n, face) in faces.iter().enumerate() {
                let came = from_fixed_wide(loads[[4, 5, 2, 3, 0, 1][n]].mass);
                match face {
                    Face::Inlet => {
                        let patch = &open.motions[[4, 5, 2, 3, 0, 1][n]].patch;
                        let cells = |a: usize| patch.as_ref().map_or([9, 10, 11][a], |_| [4, 5, 7][a]);
                        let area: usize = (0..3).filter(|&a| a != n / 2).map(cells).product();
                        assert!((came - 0.03 * area as f64).abs() < 1e-9, "{faces:?}: {came}");
                    }
                    Face::FreeSlip => assert!(came.abs() < 1e-9, "{faces:?}: {came}"),
                    // It slides along the next axis, with all that it pushes away at one end coming back at the other.
                    Face::Wall if !faces[2 * ((n / 2 + 1) % 3)..][..2].contains(&Face::Wall) => {
                        assert!(came.abs() < 1e-9, "{faces:?}: {came}");
                        sliding += 1;
                    }
                    Face::Wall | Face::Periodic | Face::Outlet { .. } => {}
                }
            }
        }
    }
    assert!(sliding > 20, "{sliding}");
}

/// Hash of the state and loads on walls after some steps, on a number of ranks.
fn outcome<S: Population>(open: &Open, grid: [usize; 3], simd: Simd, collision: Collision) -> Vec<i64> {
    let decomposition = Decomposition::with_grid(open.domain, grid);
    let parts = on_threads(decomposition.ranks(), |comm| {
        let mut fluid = open.fluid::<S>(&decomposition, &comm, simd, collision);
        let mut sums = Vec::new();
        for _ in 0..9 {
            sums.push(fluid.state_hash() as i64);
            step(&mut fluid, [1e-5, 0.0, -2e-5]);
        }
        for load in fluid.wall_loads() {
            sums.extend(load.force.iter().chain([&load.mass]).map(|&sum| sum as i64));
        }
        comm.sum(&mut sums);
        sums
    });
    parts[0].clone()
}

#[test]
fn open_faces_give_the_same_bits_on_any_blocks_and_instruction_set() {
    for (number, faces) in boxes().into_iter().enumerate() {
        for lump in [[[0; 2]; 3], [[7, 12], [0, 5], [8, 20]]] {
            let open = Open::new([19, 14, 17], faces, lump);
            let best = Simd::best();
            let single = outcome::<f32>(&open, [1, 1, 1], best, Collision::Bgk);
            let double = outcome::<f64>(&open, [1, 1, 1], best, MAGIC);
            let half = outcome::<F16>(&open, [1, 1, 1], best, MAGIC);
            for grid in [[1, 2, 1], [1, 1, 3], [2, 1, 1], [3, 1, 1], [1, 2, 3], [2, 2, 2]] {
                let what = format!("{grid:?}, box {number}, lump: {lump:?}");
                assert_eq!(outcome::<f32>(&open, grid, best, Collision::Bgk), single, "{what}");
                assert_eq!(outcome::<f64>(&open, grid, best, MAGIC), double, "{what}");
                assert_eq!(outcome::<F16>(&open, grid, best, MAGIC), half, "{what}");
            }
            for simd in [Simd::Scalar, Simd::Sse2, Simd::Avx2, Simd::Avx512] {
                if simd.is_available() {
                    assert_eq!(outcome::<f32>(&open, [2, 1, 1], simd, Collision::Bgk), single);
                    assert_eq!(outcome::<F16>(&open, [1, 2, 2], simd, MAGIC), half);
                }
            }
        }
    }
}

/// Populations of a block, and its means at outlets.
type Saved = (Block, Vec<u8>, Vec<SavedMean>);

#[test]
fn a_fluid_with_open_faces_continues_to_the_bit_on_any_ranks_from_both_phases() {
    for faces in boxes() {
        let open = Open::new([13, 10, 11], faces, [[5, 8], [0, 3], [4, 11]]);
        // What moving walls have sent before the first step is known up to rounding.
        for before in [1, 4, 5] {
            let run = |ranks: usize, saved: Option<&[Saved]>| {
                let decomposition = Decomposition::new(open.domain, ranks).unwrap();
                let parts = on_threads(ranks, |comm| {
                    let mut fluid = open.fluid::<f32>(&decomposition, &comm, Simd::best(), MAGIC);
                    let (mut bytes, mut means) = (Vec::new(), Vec::new());
                    if let Some(saved) = saved {
                        for (block, bytes, _) in saved {
                            fluid.restore_common(*block, bytes);
                        }
                        let means: Vec<SavedMean> = saved.iter().flat_map(|of| of.2.clone()).collect();
                        fluid.restore_means(&means);
                        fluid.resume();
                    } else {
                        (0..before).for_each(|_| step(&mut fluid, [1e-4, -2e-4, 3e-5]));
                        let block = fluid.block();
                        (block.lo[2]..block.hi[2]).for_each(|z| fluid.save_plane(z, &mut bytes));
                        means = fluid.save_means();
                    }
                    let mut hashes = vec![fluid.state_hash() as i64];
                    (0..3).for_each(|_| step(&mut fluid, [1e-4, -2e-4, 3e-5]));
                    hashes.push(fluid.state_hash() as i64);
                    comm.sum(&mut hashes);
                    ((fluid.block(), bytes, means), hashes)
                });
                let hashes = parts[0].1.clone();
                (parts.into_iter().map(|(saved, _)| saved).collect::<Vec<_>>(), hashes)
            };
            let (saved, expected) = run(3, None);
            for ranks in [1, 2, 4] {
                assert_eq!(run(ranks, Some(&saved)).1, expected, "{faces:?} {before} {ranks}");
            }
        }
    }
}
