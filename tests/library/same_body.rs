//! One body described in several ways: volume, inertia, mapped solid fractions, drag and torque are the same, to the rounding of the
//! description, or for bodies that other formulas map, to the error of the mapping.

use std::fmt::Write;
use std::path::Path;
use turbid::case::file::Coupling;
use turbid::comm::Comm;
use turbid::coupling::ForceBalance;
use turbid::domain::Decomposition;
use turbid::fluid::Precision;
use turbid::math::{Quat, Vec3};
use turbid::shape::{Cuboid, Shape};
use turbid::{Builder, Particles, Simulation};

/// Edges of the box and of the cuboid (m).
const BOX: f64 = 3.6e-3;
const EDGES: [f64; 3] = [1.2e-3, 1e-3, 0.8e-3];
const DENSITY: f64 = 2500.0;

/// Outcome of a body that is fixed askew in a periodic box through which a fluid is driven.
struct Outcome {
    volume: f64,
    /// Moments of inertia over the mass about the axes of the case (m^2), with products of inertia.
    inertia: [f64; 6],
    fractions: Vec<f32>,
    force: Vec3,
    torque: Vec3,
}

fn outcome(kind: Particles, coupling: Coupling) -> Outcome {
    let turn = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 0.3));
    let at = Vec3::new(1.81e-3, 1.77e-3, 1.84e-3);
    let setup = Builder::new([BOX; 3])
        .fluid(1000.0, 1e-5)
        .lattice(10.0, 0.8)
        .precision(Precision::F64)
        .coupling(coupling)
        .particles(kind.fixed().posed(at, &turn, Vec3::zeros(), Vec3::zeros()))
        .gravity([0.0; 3])
        .body_acceleration([0.5, 0.3, 1.0])
        .force_balance(ForceBalance::FluidOnly)
        .setup()
        .unwrap_or_else(|e| panic!("{e}"));
    let shape = &setup.templates[0].shape;
    let axes = setup.frames[0].to_rotation_matrix().into_inner();
    let tensor = axes * turbid::math::Mat3::from_diagonal(&shape.inertia_per_mass()) * axes.transpose();
    let whole = Decomposition::solo(setup.domain);
    let mut simulation = Simulation::new(&setup, &whole, Comm::Solo).unwrap();
    simulation.advance(100).unwrap();
    let load = simulation.loads().next().unwrap().1;
    Outcome {
        volume: shape.volume(),
        inertia: [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|at| tensor[at]),
        fractions: simulation.fields().unwrap().solid_fraction,
        force: load.force,
        torque: load.torque,
    }
}

/// Relative differences of volume, inertia, force and torque, and the largest and the mean difference of solid fractions, the
/// mean over the cells of the body.
fn difference(one: &Outcome, other: &Outcome) -> [f64; 6] {
    let inertia = (0..6).map(|i| (one.inertia[i] - other.inertia[i]).abs()).fold(0.0, f64::max);
    let off = one.fractions.iter().zip(&other.fractions).map(|(a, b)| f64::from((a - b).abs()));
    let (most, sum) = off.fold((0.0, 0.0), |(most, sum), off| (f64::max(most, off), sum + off));
    let covered: f64 = one.fractions.iter().copied().map(f64::from).sum();
    // A torque in units of the force on half the box: that of a symmetric body is nearly none.
    let lever = one.force.norm() * 0.25 * BOX;
    [
        (one.volume / other.volume - 1.0).abs(),
        inertia / one.inertia[0],
        most,
        sum / covered,
        (one.force - other.force).norm() / one.force.norm(),
        (one.torque - other.torque).norm() / lever,
    ]
}

/// Corners of the triangles of the cuboid (mm), away from the origin by `shift` (mm).
fn triangles(shift: Vec3) -> Vec<[Vec3; 3]> {
    let mesh = Cuboid::new(Vec3::from(EDGES) * 1e3).unwrap().surface_mesh(0);
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize] + shift)).collect()
}

fn binary_stl(path: &Path, shift: Vec3) {
    let facets = triangles(shift);
    let mut bytes = vec![0; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in &facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    std::fs::write(path, bytes).unwrap();
}

fn obj(path: &Path) {
    let mut text = String::new();
    let facets = triangles(Vec3::zeros());
    for corner in facets.iter().flatten() {
        writeln!(text, "v {:?} {:?} {:?}", corner.x, corner.y, corner.z).unwrap();
    }
    for n in 0..facets.len() {
        writeln!(text, "f {} {} {}", 3 * n + 1, 3 * n + 2, 3 * n + 3).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

const BOTH: [Coupling; 2] = [Coupling::Saturated, Coupling::Homogenised];

/// Compares descriptions with the first one in these couplings: each difference is at most its limit.
fn all_alike(couplings: &[Coupling], descriptions: &[(&str, Particles, [f64; 6])]) {
    for &coupling in couplings {
        let first = outcome(descriptions[0].1.clone(), coupling);
        for (name, kind, limits) in &descriptions[1..] {
            let found = difference(&first, &outcome(kind.clone(), coupling));
            println!(
                "{} and {name}, {coupling:?}: volume {:.1e}, inertia {:.1e}, solid fraction at most {:.1e}, mean {:.1e}, force {:.1e}, \
                 torque {:.1e}",
                descriptions[0].0, found[0], found[1], found[2], found[3], found[4], found[5]
            );
            for (found, limit) in found.iter().zip(limits) {
                assert!(found <= limit, "{name}: {found:e} exceeds {limit:e}");
            }
        }
    }
}

#[test]
fn a_cuboid_is_the_same_as_vertices_and_as_a_mesh_of_any_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    binary_stl(&folder.path().join("near.stl"), Vec3::zeros());
    binary_stl(&folder.path().join("far.stl"), Vec3::new(30.0, -20.0, 7.0));
    obj(&folder.path().join("box.obj"));
    let mesh = |name: &str| Particles::mesh(&path(name), DENSITY).set("shape.mesh.unit", "mm");
    let half = EDGES.map(|edge| 0.5 * edge);
    let corner = |n: usize| std::array::from_fn(|i| if n >> i & 1 == 0 { -half[i] } else { half[i] });
    let corners: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let exact = [1e-14, 1e-14, 1e-7, 1e-9, 1e-9, 1e-9];
    let single = [2e-7, 2e-7, 5e-6, 5e-7, 3e-7, 2e-7];
    let far = [3e-6, 4e-6, 8e-5, 8e-6, 3e-6, 2e-7];
    all_alike(
        &BOTH,
        &[
            ("cuboid", Particles::cuboids(EDGES, DENSITY), exact),
            ("vertices", Particles::polyhedra(&corners, DENSITY), exact),
            ("OBJ", mesh("box.obj"), exact),
            ("STL", mesh("near.stl"), single),
            ("STL 36 mm from the origin", mesh("far.stl"), far),
        ],
    );
}

#[test]
fn round_bodies_are_the_same_under_other_names() {
    let diameter = 1.2e-3;
    let none = [0.0; 6];
    let round = [1e-14, 1e-14, 1e-3, 4e-4, 3e-4, 2e-6];
    all_alike(
        &BOTH,
        &[
            ("sphere", Particles::spheres(diameter, DENSITY), none),
            ("ellipsoid", Particles::ellipsoids([diameter; 3], DENSITY), round),
            ("superellipsoid", Particles::superellipsoids([diameter; 3], [1.0, 1.0], DENSITY), round),
            // A cylinder of a millionth of the diameter between two half spheres.
            (
                "capsule",
                Particles::capsules(diameter, diameter * (1.0 + 1e-6), DENSITY),
                [3e-6, 3e-6, 2e-4, 6e-5, 3e-5, 6e-7],
            ),
        ],
    );
    let axes = [1.4e-3, 1.1e-3, 0.9e-3];
    let same = [1e-14, 1e-14, 6e-6, 1e-6, 1e-6, 1e-7];
    all_alike(
        &BOTH,
        &[
            ("ellipsoid", Particles::ellipsoids(axes, DENSITY), none),
            ("superellipsoid", Particles::superellipsoids(axes, [1.0, 1.0], DENSITY), same),
        ],
    );
}

#[test]
fn a_cylinder_is_nearly_a_prism_of_many_sides_of_the_same_volume() {
    let (diameter, length, sides) = (1e-3, 1.2e-3, 96);
    let step = 2.0 * std::f64::consts::PI / f64::from(sides);
    // Of the polygon that has the area of the circle.
    let radius = 0.5 * diameter * (step / step.sin()).sqrt();
    let corners: Vec<[f64; 3]> = (0..sides)
        .flat_map(|n| {
            let (sine, cosine) = (step * f64::from(n)).sin_cos();
            [-0.5, 0.5].map(|z| [radius * cosine, radius * sine, z * length])
        })
        .collect();
    let cylinder = Particles::cylinders(diameter, length, DENSITY);
    let prism = Particles::polyhedra(&corners, DENSITY);
    let both = |limits: [f64; 6]| [("cylinder", cylinder.clone(), limits), ("prism", prism.clone(), limits)];
    all_alike(&[Coupling::Homogenised], &both([1e-12, 2e-7, 1.2e-2, 1e-3, 2e-3, 1e-3]));
    all_alike(&[Coupling::Saturated], &both([1e-12, 1e-6, 0.03, 5e-3, 5e-3, 1e-3]));
}
