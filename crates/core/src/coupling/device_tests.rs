//! The fluid and its coupling on a device against the processor, to the bit. Without a GPU, a driver of the processor (PoCL) runs the same
//! code.

use super::tests::{HOMOGENISED, UNITS, coupled, fluid_for, saturated};
use super::wall_tests::walls;
use super::*;
use crate::comm::{Comm, on_threads};
use crate::device::{Device, devices};
use crate::domain::{Domain, Face};
use crate::fluid::{Boundary, Collision, FluidParams, Precision, WallMotion};
use crate::math::{Patch, Quat};
use crate::particle::Template;
use crate::shape::composite::tests::dumbbell;
use crate::shape::{Cuboid, Cylinder, Ellipsoid, Polyhedron, Shape, Sphere, Through};
use crate::wall::mesh::tests::{placed, plate};
use crate::wall::{Motion, PlacedMesh, Surface, Wall};
use std::f64::consts::PI;
use std::sync::Arc;

/// A system to compute.
#[derive(Clone)]
struct Scene {
    name: &'static str,
    cells: [usize; 3],
    /// The lower and the upper face in z; the others are periodic.
    ends: [Face; 2],
    /// Homogenised cells if there is none.
    operator: Option<SolidOperator>,
    collision: Collision,
    bodies: bool,
}

const MAGIC: Collision = Collision::Trt { magic: 0.125 };
const PERIODIC: [bool; 3] = [true; 3];

const RECURSIVE: Collision = Collision::RecursiveRegularised { magic: 0.125, smagorinsky: 0.2 };

const SCENES: [Scene; 10] = [
    Scene {
        name: "fluid",
        cells: [37, 11, 9],
        ends: [Face::Periodic; 2],
        operator: Some(SolidOperator::Sc3),
        collision: MAGIC,
        bodies: false,
    },
    Scene {
        name: "bodies",
        cells: [40, 26, 24],
        ends: [Face::Periodic; 2],
        operator: Some(SolidOperator::Sc3),
        collision: MAGIC,
        bodies: true,
    },
    Scene {
        name: "bodies that share cells with their images",
        cells: [12, 12, 12],
        ends: [Face::Periodic; 2],
        operator: Some(SolidOperator::Sc3),
        collision: MAGIC,
        bodies: true,
    },
    Scene {
        name: "walls",
        cells: [40, 26, 28],
        ends: [Face::Wall; 2],
        operator: Some(SolidOperator::Sc3),
        collision: MAGIC,
        bodies: true,
    },
    Scene {
        name: "recursive regularised, walls",
        cells: [40, 26, 28],
        ends: [Face::Wall; 2],
        operator: Some(SolidOperator::Sc3),
        collision: RECURSIVE,
        bodies: true,
    },
    Scene {
        name: "homogenised",
        cells: [40, 26, 24],
        ends: [Face::Periodic; 2],
        operator: None,
        collision: Collision::Bgk,
        bodies: true,
    },
    Scene {
        name: "homogenised, two relaxation times",
        cells: [40, 26, 24],
        ends: [Face::Periodic; 2],
        operator: None,
        collision: MAGIC,
        bodies: true,
    },
    Scene {
        name: "inlet and outlet",
        cells: [40, 26, 28],
        ends: [Face::Inlet, Face::Outlet { excess: -0.01, relaxation: Some(0.01), patch: Some(&PATCH) }],
        operator: Some(SolidOperator::Sc3),
        collision: MAGIC,
        bodies: true,
    },
    Scene {
        name: "free slip and outlet",
        cells: [40, 26, 28],
        ends: [Face::FreeSlip, Face::Outlet { excess: 0.01, relaxation: None, patch: None }],
        operator: None,
        collision: Collision::Bgk,
        bodies: true,
    },
    Scene {
        name: "homogenised, walls",
        cells: [40, 26, 28],
        ends: [Face::Wall; 2],
        operator: None,
        collision: Collision::Bgk,
        bodies: true,
    },
];

/// A part of a face.
static PATCH: Patch = Patch::Disc { centre: [20.0, 13.0, 0.0], axis: 2, radius: 9.0 };

impl Scene {
    fn method(&self) -> Method {
        self.operator.map_or(HOMOGENISED, saturated)
    }
}

/// All that a step gives: the hash of the state, loads by id, and the flow.
#[derive(Debug, PartialEq)]
struct Outcome {
    hash: u64,
    loads: Vec<(u64, Load)>,
    flows: Vec<(Vec<[i64; 2]>, u64)>,
}

fn templates() -> Arc<[Template]> {
    let dx = UNITS.dx;
    let hull = |refinement| {
        let round = Sphere { radius: 4.0 * dx }.surface_mesh(refinement);
        Polyhedron::hull(&round.points, 1e-9 * dx).unwrap().0
    };
    let shapes: Vec<Arc<dyn Shape>> = vec![
        Arc::new(Sphere { radius: 4.3 * dx }),
        Arc::new(Cuboid::new(Vec3::new(7.3, 6.1, 8.2) * dx).unwrap()),
        Arc::new(hull(1)),
        Arc::new(Cylinder::new(3.1 * dx, 3.6 * dx).unwrap()),
        Arc::new(Ellipsoid::new(Vec3::new(3.0, 4.0, 5.1) * dx).unwrap()),
        dumbbell(2.6 * dx),
        Arc::new(
            Through::new(Arc::new(Cuboid::new(Vec3::new(5.0, 6.0, 12.0) * dx).unwrap()), 2, Vec3::z())
                .unwrap(),
        ),
        // In its cells more faces meet than are evaluated one after the other.
        Arc::new(hull(2)),
    ];
    shapes.into_iter().map(|shape| Template { shape, material: 0, density: 2000.0 }).collect()
}

/// Bodies of all kinds, of which some share cells, at a step.
fn store(decomposition: &Decomposition, rank: usize, scene: &Scene, step: usize) -> ParticleStore {
    let size = decomposition.domain.size();
    let time = step as f64;
    let count = if scene.bodies { 12 } else { 0 };
    let particles: Vec<Particle> = (0..count)
        .map(|i| {
            let at = |k: f64| (f64::from(i) * k + 0.011 * time * (1.0 + 0.2 * f64::from(i % 3))) % 1.0;
            let position = Vec3::new(at(0.137), at(0.31), at(0.73)).component_mul(&size);
            let mut particle = Particle::at(i as u64, (i % 8) as usize, position);
            particle.velocity = [0.4, -0.3 + 0.05 * f64::from(i), 0.2];
            particle.angular_velocity = [0.3, 0.1 * f64::from(i), -0.2];
            particle.set_orientation(&Quat::from_euler_angles(0.02 * time, 0.3 * f64::from(i), 0.1));
            particle
        })
        .collect();
    let owner = |p: &Particle| decomposition.owner(p.position());
    let (mine, others): (Vec<Particle>, Vec<Particle>) = particles.iter().partition(|p| owner(p) == rank);
    let (owned, particles) = (mine.len(), [mine, others].concat());
    let owners = particles.iter().map(|p| owner(p) as u32).collect();
    ParticleStore { templates: templates(), particles, owned, owners }
}

/// An oblique sheet of facets, through bodies, a periodic face and the upper end.
fn sheet() -> Wall {
    let dx = UNITS.dx;
    let flat = placed(plate([30.0 * dx, 24.0 * dx], [3, 2]), None);
    let orientation = Quat::from_euler_angles(0.9, -0.6, 0.3);
    let surface = Surface::Mesh(PlacedMesh { position: Vec3::new(4.3, 2.1, 7.7) * dx, orientation, ..flat });
    Wall { name: "sheet".into(), surface, motion: Motion::default(), material: 0 }
}

/// Nine steps of the scene, on the processor or on a device.
fn run(scene: &Scene, precision: Precision, grid: [usize; 3], device: Option<&Device>) -> Outcome {
    let mut domain = Domain { faces: Domain::faces(PERIODIC), cells: scene.cells, dx: UNITS.dx };
    domain.faces[4..].copy_from_slice(&scene.ends);
    let decomposition = Decomposition::with_grid(domain, grid);
    let surfaces: Vec<Wall> =
        if domain.is_periodic(2) { Vec::new() } else { [walls(&domain), vec![sheet()]].concat() };
    let lattice_walls = LatticeWalls::new(&surfaces, &UNITS, &domain);
    let mut motions: Vec<WallMotion> = lattice_walls.motions(None);
    if let Some(wall) = motions.get_mut(1) {
        (wall.velocity, wall.varies) = ([0.02, -0.01, 0.0], true);
    }
    if scene.ends[0] == Face::Inlet {
        motions[0].velocity = [0.0, 0.0, 0.02];
    }
    let method = scene.method();
    let mut parts = on_threads(decomposition.ranks(), |comm| {
        let boundary = Boundary {
            motions: &motions,
            wall_of: &|cell| lattice_walls.wall_of(cell),
            part_of_link: &|wall, cell, way| lattice_walls.part_of_link(wall, cell, way),
            between: &|cell| lattice_walls.between(cell),
        };
        let params = FluidParams { collision: scene.collision, ..fluid_for(method) };
        let mut fluid = AnyFluid::new(precision, &decomposition, &comm, &params, &boundary).unwrap();
        fluid.set_equilibrium(|cell| {
            let wave = |a: usize| libm::sin(2.0 * PI * cell[a] as f64 / scene.cells[a] as f64);
            (1.0 + 0.01 * wave(0), [0.02 * wave(1), 0.01 * wave(2), -0.02 * wave(0)])
        });
        let reach = 7.3 * UNITS.dx;
        let mut coupling = Coupling::new(coupled(method), &decomposition, comm.rank(), reach);
        if let Some(device) = device {
            fluid.use_device(device, &mut coupling).unwrap();
            // Else messages go through the host.
            if precision != Precision::F64 {
                fluid.connect_on_device(&comm).unwrap();
            }
        }
        let (mut loads, mut flows) = (Vec::new(), Vec::new());
        for step in 0..9 {
            let mut motions = motions.clone();
            for wall in motions.iter_mut().filter(|wall| wall.varies) {
                wall.velocity = wall.velocity.map(|v| v * (1.0 - 0.2 * step as f64));
                wall.excess = 1e-3 * step as f64;
            }
            fluid.move_walls(&motions);
            let store = store(&decomposition, comm.rank(), scene, step);
            coupling.map(&store);
            let measured = fluid.sweep([1e-4, -2e-4, 3e-5], &mut coupling, step % 4 == 2);
            if let Some(flow) = measured {
                let words = [flow.momentum[0], flow.momentum[1], flow.momentum[2], flow.square, flow.solid];
                flows.push((
                    words.map(crate::math::split_wide).to_vec(),
                    flow.max_speed.to_bits(),
                    flow.fault,
                ));
            }
            fluid.exchange();
            loads = coupling.loads(&store, Vec3::zeros(), &comm);
            loads.truncate(store.owned);
            if step == 8 {
                let all = store.owned().iter().map(|p| p.id).zip(loads.iter().copied()).collect::<Vec<_>>();
                assert!(fluid.take_failure().is_none());
                return (fluid.state_hash(), all, flows);
            }
        }
        (0, loads.iter().map(|load| (0, *load)).collect(), flows)
    });
    let mut loads: Vec<(u64, Load)> = parts.iter_mut().flat_map(|part| std::mem::take(&mut part.1)).collect();
    loads.sort_by_key(|&(id, _)| id);
    Outcome {
        hash: parts.iter().fold(0, |sum, part| sum.wrapping_add(part.0)),
        loads,
        flows: parts
            .into_iter()
            .flat_map(|part| part.2)
            .map(|(words, most, fault)| {
                assert!(fault.is_none());
                (words, most)
            })
            .collect(),
    }
}

/// The first device that can be used, which there must be where tests are told so.
fn device() -> Option<Device> {
    let number = devices().iter().position(|device| device.refused.is_none());
    assert!(number.is_some() || std::env::var_os("TURBID_NEEDS_DEVICE").is_none(), "no OpenCL device");
    number.map(|number| Device::open(number).unwrap())
}

#[test]
fn a_step_transfers_nothing_for_a_cell() {
    let Some(device) = device() else { return };
    let transferred = |cells| {
        let scene = Scene { cells, ..SCENES[1] };
        let decomposition =
            Decomposition::solo(Domain { faces: Domain::faces(PERIODIC), cells, dx: UNITS.dx });
        let (comm, method) = (Comm::Solo, scene.method());
        let mut fluid =
            AnyFluid::new(Precision::F32, &decomposition, &comm, &fluid_for(method), &Boundary::none())
                .unwrap();
        let mut coupling = Coupling::new(coupled(method), &decomposition, 0, 6.5 * UNITS.dx);
        fluid.use_device(&device, &mut coupling).unwrap();
        // Spheres and bodies with flat faces, as the host finds the cells of others.
        let mut store = store(&decomposition, 0, &scene, 3);
        store.particles.retain(|particle| particle.template < 3);
        store.owned = store.particles.len();
        store.owners.truncate(store.owned);
        coupling.map(&store);
        fluid.sweep([0.0; 3], &mut coupling, true);
        (fluid.device_traffic().unwrap() as f64, cells.iter().product::<usize>() as f64)
    };
    let (small, large) = (transferred([40, 26, 24]), transferred([80, 52, 48]));
    println!("{small:?} {large:?}");
    // What is there for each tile of 256 cells is one number of four bytes.
    assert!(large.0 - small.0 < 0.02 * (large.1 - small.1), "{small:?} {large:?}");
}

#[test]
fn a_step_moves_at_most_165_bytes_a_cell_at_a_volume_fraction_of_0_3() {
    let Some(device) = device() else { return };
    // Spheres of 18 cells, 20.5 cells apart on a cubic grid, which would be 0.354.
    let (counts, spacing, diameter) = ([4, 3, 2], 20.5, 18.0);
    let cells = counts.map(|n| libm::ceil(f64::from(n) * spacing) as usize);
    let decomposition = Decomposition::solo(Domain { faces: Domain::faces(PERIODIC), cells, dx: UNITS.dx });
    let method = saturated(SolidOperator::Sc3);
    let mut fluid =
        AnyFluid::new(Precision::F32, &decomposition, &Comm::Solo, &fluid_for(method), &Boundary::none())
            .unwrap();
    let radius = 0.5 * diameter * UNITS.dx;
    let mut coupling = Coupling::new(coupled(method), &decomposition, 0, radius);
    fluid.use_device(&device, &mut coupling).unwrap();
    let at = |n: i32| (f64::from(n) + 0.5) * spacing * UNITS.dx;
    let [nx, ny, nz] = counts;
    let particles: Vec<Particle> = (0..nx * ny * nz)
        .map(|n| Particle::at(n as u64, 0, Vec3::new(at(n % nx), at(n / nx % ny), at(n / nx / ny))))
        .collect();
    let count = particles.len();
    let shape: Arc<dyn Shape> = Arc::new(Sphere { radius });
    let templates = Arc::new([Template { shape, material: 0, density: 2000.0 }]);
    let store = ParticleStore { templates, particles, owned: count, owners: vec![0; count] };
    coupling.map(&store);
    fluid.time_kernels(true);
    fluid.sweep([0.0; 3], &mut coupling, false);
    fluid.exchange();
    let costs = fluid.time_kernels(false);
    let number = cells.iter().product::<usize>() as f64;
    let solid = count as f64 * PI / 6.0 * diameter * diameter * diameter / number;
    // Copies round the box are a part of the surface, which is large in so small a box.
    let bytes: u64 = costs.iter().filter(|cost| cost.name != "copy_links").map(|cost| cost.bytes).sum();
    println!("solid fraction {solid:.3}: {:.1} B a cell; {costs:?}", bytes as f64 / number);
    assert!((0.3..0.36).contains(&solid), "{solid}");
    assert!(bytes as f64 / number < 165.0, "{costs:?}");
    assert!(bytes as f64 / number > 152.0, "{costs:?}");
}

#[test]
fn the_kernels_as_cpp_give_the_bits_of_the_processor() {
    let device = Device::compiled_as_cpp();
    assert!(device.is_some() || std::env::var_os("TURBID_NEEDS_DEVICE").is_none(), "no C++ compiler");
    let Some(device) = device else { return };
    // Kernels with other options take a second each to compile; all scenes are for drivers.
    for (name, precision) in [
        ("recursive regularised, walls", Precision::F32),
        ("bodies", Precision::F64),
        ("homogenised, walls", Precision::F32),
    ] {
        let scene = SCENES.iter().find(|scene| scene.name == name).expect("a scene");
        let expected = run(scene, precision, [1, 1, 1], None);
        let got = run(scene, precision, [1, 1, 1], Some(&device));
        assert_eq!(got, expected, "{name} {precision:?}");
    }
}

#[test]
fn a_device_gives_the_bits_of_the_processor() {
    let Some(device) = device() else { return };
    let of_operator = |operator: SolidOperator| Scene {
        name: operator.name(),
        operator: Some(operator),
        collision: Collision::Bgk,
        ..SCENES[1]
    };
    for scene in &[&SCENES[..], &SolidOperator::ALL.map(of_operator)].concat() {
        for precision in [Precision::F32, Precision::F64, Precision::F16] {
            for grid in [[1, 1, 1], [2, 1, 1], [1, 2, 2]] {
                if precision != Precision::F32 && grid != [1, 1, 1] {
                    continue;
                }
                let expected = run(scene, precision, [1, 1, 1], None);
                let got = run(scene, precision, grid, Some(&device));
                assert_eq!(got.loads, expected.loads, "{} {precision:?} {grid:?}", scene.name);
                if grid == [1, 1, 1] {
                    assert_eq!(got.flows, expected.flows, "{} {precision:?}", scene.name);
                }
                assert_eq!(got.hash, expected.hash, "{} {precision:?} {grid:?}", scene.name);
            }
        }
    }
}
