//! Drag on a body fixed, or moved at a constant velocity, in a periodic cube. See the README of this folder.
//!
//! Lattice units throughout.

#![allow(clippy::print_stdout)]

#[path = "../harness.rs"]
mod harness;

use harness::{Pick, random, reported};
use std::f64::consts::PI;
use std::process::ExitCode;
use std::sync::Arc;
use turbid::comm::Comm;
use turbid::coupling::{
    AnyFluid, Coupling, CouplingParams, ForceBalance, Homogenised, Method, Saturated, SolidOperator,
    SurfaceShift,
};
use turbid::domain::{Decomposition, Domain};
use turbid::fluid::{Boundary, Collision, FluidParams, Precision, Simd};
use turbid::math::{Quat, Vec3, nalgebra::Quaternion};
use turbid::particle::{Particle, ParticleStore, Template};
use turbid::shape::{Cuboid, Cylinder, Ellipsoid, Polyhedron, Shape, Sphere};
use turbid::units::Units;
use turbid_lab::checks::Check;

/// Volume fractions and drag factors of simple-cubic arrays of spheres (Zick and Homsy 1982; others by an own solution with
/// periodic Stokeslets, which agrees with theirs).
const SPHERES: [(f64, f64); 11] = [
    (0.027, 2.00775),
    (0.064, 2.81020),
    (0.065_449_8, 2.84202),
    (0.1, 3.64245),
    (0.125, 4.29159),
    (0.15, 5.01902),
    (0.2, 6.7757),
    (0.216, 7.44195),
    (0.25, 9.062),
    (0.300_74, 12.1144),
    (0.343, 15.4),
];

/// One row: what is computed.
struct Row {
    method: Method,
    collision: Collision,
    tau: f64,
    /// Cells of the diameter of the sphere of equal volume, nearly.
    resolution: f64,
    volume_fraction: f64,
    body: String,
    rotated: u64,
    /// Number of a random place in its cell; 0 is the middle of a cell.
    place: u64,
    /// Speed of fluid and body in a direction without symmetry (cells per step).
    speed: f64,
    reynolds: f64,
}

/// A body of this volume (cells).
fn body(name: &str, volume: f64) -> Arc<dyn Shape> {
    let prism = |sides: u32, length: f64| {
        let corners: Vec<Vec3> = (0..sides)
            .flat_map(|k| {
                let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(sides)).sin_cos();
                [-0.5, 0.5].map(|z| Vec3::new(0.5 * cos, 0.5 * sin, z * length))
            })
            .collect();
        corners
    };
    let hull = |corners: Vec<Vec3>| {
        let unit = Polyhedron::hull(&corners, 1e-9).expect("a body").0;
        let scale = (volume / unit.volume()).cbrt();
        let corners: Vec<Vec3> = corners.iter().map(|c| c * scale).collect();
        Arc::new(Polyhedron::hull(&corners, 1e-9).expect("a body").0) as Arc<dyn Shape>
    };
    let cuboid = |edges: [f64; 3]| {
        let edges = Vec3::from(edges);
        Arc::new(Cuboid::new(edges * (volume / edges.product()).cbrt()).expect("a cuboid")) as Arc<dyn Shape>
    };
    let cylinder = |length: f64| {
        let radius = (volume / (2.0 * PI * length)).cbrt();
        Arc::new(Cylinder::new(radius, 2.0 * radius * length).expect("a cylinder")) as Arc<dyn Shape>
    };
    let ellipsoid = |axes: [f64; 3]| {
        let axes = Vec3::from(axes);
        let scale = (volume / (4.0 / 3.0 * PI * axes.product())).cbrt();
        Arc::new(Ellipsoid::new(axes * scale).expect("an ellipsoid")) as Arc<dyn Shape>
    };
    let signs = || {
        (0..8).map(|n| {
            Vec3::new(f64::from(n & 1), f64::from(n >> 1 & 1), f64::from(n >> 2)) * 2.0 - Vec3::repeat(1.0)
        })
    };
    match name {
        "sphere" => Arc::new(Sphere { radius: (volume * 0.75 / PI).cbrt() }),
        "cube" => cuboid([1.0; 3]),
        "plate" => cuboid([2.0, 2.0, 0.8]),
        "rod" => cuboid([1.0, 1.0, 3.0]),
        "tetrahedron" => hull(signs().filter(|s| s.product() > 0.0).collect()),
        "octahedron" => hull((0..3).flat_map(|a| [Vec3::ith(a, 1.0), Vec3::ith(a, -1.0)]).collect()),
        "dodecahedron" => {
            let g = 0.5 * (1.0 + 5.0_f64.sqrt());
            let ring = signs().flat_map(|s| {
                (0..3).map(move |a| {
                    let mut v = Vec3::zeros();
                    v[(a + 1) % 3] = s.x * g;
                    v[(a + 2) % 3] = s.y / g;
                    v
                })
            });
            hull(ring.chain(signs()).collect())
        }
        "hexagon" => hull(prism(6, 0.8)),
        "triangle" => hull(prism(3, 1.0)),
        "prism" => hull(prism(96, 1.0)),
        "cylinder" => cylinder(1.0),
        "disc" => cylinder(0.4),
        "oblate" => ellipsoid([1.0, 1.0, 0.5]),
        "prolate" => ellipsoid([1.0, 1.0, 2.0]),
        other => panic!("{other}"),
    }
}

/// Drag factor of an array of spheres: through the values of the table.
fn spheres(volume_fraction: f64) -> f64 {
    // `1 / K` is nearly a quadratic in the cube root between three neighbours.
    let x = volume_fraction.cbrt();
    let at = SPHERES.partition_point(|&(phi, _)| phi < volume_fraction).clamp(1, SPHERES.len() - 2);
    let near = &SPHERES[at - 1..=at + 1];
    let mut sum = 0.0;
    for (i, &(phi, k)) in near.iter().enumerate() {
        let mut weight = 1.0;
        for (j, &(other, _)) in near.iter().enumerate() {
            if i != j {
                weight *= (x - other.cbrt()) / (phi.cbrt() - other.cbrt());
            }
        }
        sum += weight / k;
    }
    1.0 / sum
}

struct Outcome {
    /// Drag factor over its reference.
    drag: f64,
    /// Standard deviation of the force over its mean.
    noise: f64,
}

fn measure(row: &Row) -> Outcome {
    let edge = (row.resolution * (PI / 6.0 / row.volume_fraction).cbrt()).round();
    let cells = edge as usize;
    let radius = 0.5 * edge * (6.0 * row.volume_fraction / PI).cbrt();
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [cells; 3], dx: 1.0 };
    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let decomposition = Decomposition::new(domain, 1).expect("one block");
    let shape = body(&row.body, edge.powi(3) * row.volume_fraction);
    let nu = (row.tau - 0.5) / 3.0;
    // A cube of this volume fraction in an array has a drag factor close to this (relative to the sphere of equal volume).
    let expected = if row.body == "cube" {
        if (row.volume_fraction - 0.064).abs() < 1e-9 { 3.3203 } else { 1.13 * spheres(row.volume_fraction) }
    } else {
        spheres(row.volume_fraction)
    };
    let speed = row.reynolds * nu / (2.0 * radius);
    let resistance = 6.0 * PI * nu * radius * expected;
    let acceleration = resistance * speed / edge.powi(3);
    let along = Vec3::new(0.0, 0.0, 1.0);
    let drift = Vec3::new(0.48, -0.6, 0.64) * row.speed;

    let mut seed = row.place;
    let mut aside = || if row.place == 0 { 0.5 } else { random(&mut seed) };
    let centre = Vec3::from_fn(|_, _| (cells / 2) as f64 + aside());
    let mut particle = Particle::at(0, 0, centre);
    particle.velocity = drift.into();
    if row.rotated > 0 {
        let mut seed = row.rotated;
        let q: [f64; 4] = std::array::from_fn(|_| random(&mut seed) - 0.5);
        let q = if row.rotated == 45 {
            Quaternion::new((PI / 8.0).cos(), 0.0, (PI / 8.0).sin(), 0.0)
        } else {
            Quaternion::new(q[0], q[1], q[2], q[3])
        };
        particle.set_orientation(&Quat::new_normalize(q));
    }
    let templates: Arc<[Template]> = Arc::new([Template { shape: shape.clone(), material: 0, density: 1.0 }]);
    let params = FluidParams { relaxation_time: row.tau, collision: row.collision, simd: Simd::best() };
    let mut fluid =
        AnyFluid::new(Precision::F64, &decomposition, &Comm::Solo, &params, &Boundary::none()).unwrap();
    let start = drift + along * speed;
    fluid.set_equilibrium(|_| (1.0, start.into()));
    let coupled = CouplingParams {
        units,
        method: row.method,
        gravity: Vec3::zeros(),
        force_balance: ForceBalance::FluidOnly,
        simd: Simd::best(),
    };
    let mut coupling = Coupling::new(coupled, &decomposition, 0, shape.circumradius());
    let mut store = ParticleStore { templates, particles: vec![particle], owned: 1, owners: vec![0] };
    let volume = edge.powi(3);
    let time_constant = volume / resistance;
    let interval = ((time_constant / 4.0).ceil() as u64).max(50);
    let (mut before, mut steady, mut steps) = (0.0, 0, 0);
    loop {
        let (mut sum, mut count) = (Vec3::zeros(), 0.0);
        let mut forces = Vec::new();
        for step in 0..interval {
            coupling.map(&store);
            let look = step % 7 == 0;
            let flow = fluid.sweep((along * acceleration).into(), &mut coupling, look);
            fluid.exchange();
            let load = coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0];
            let one = (1_u64 << 42) as f64;
            if let Some(flow) = flow {
                sum += Vec3::from(flow.momentum.map(|p| p as f64 / one)) / volume;
                count += 1.0;
            }
            forces.push(load.force);
            let particle = &mut store.particles[0];
            particle.position = domain.wrap(particle.position() + particle.velocity()).into();
            steps += 1;
        }
        let mean = sum / count - drift;
        let change = (mean.z - before).abs() / speed;
        before = mean.z;
        steady = if change < 3e-4 { steady + 1 } else { 0 };
        let passed = row.speed * f64::from(steps);
        if (steady >= 2 && (row.speed == 0.0 || passed > 3.0)) || steps > 200_000 {
            let n = forces.len() as f64;
            let force = forces.iter().sum::<Vec3>() / n;
            // Against the trend over the interval.
            let slope =
                forces.iter().enumerate().map(|(i, f)| (i as f64 - 0.5 * (n - 1.0)) * f.z).sum::<f64>()
                    / (n * (n * n - 1.0) / 12.0);
            let off: Vec<f64> = forces
                .iter()
                .enumerate()
                .map(|(i, f)| f.z - force.z - slope * (i as f64 - 0.5 * (n - 1.0)))
                .collect();
            return Outcome {
                drag: acceleration * volume / (6.0 * PI * nu * radius * mean.z) / expected,
                noise: (off.iter().map(|x| x * x).sum::<f64>() / n).sqrt() / force.z,
            };
        }
    }
}

const SOURCE: &str = "Zick and Homsy (1982), doi:10.1017/S0022112082000627; cubes: own boundary elements";
const OWN_GRID: &str = "the same with 32 cells, relaxation time 1";
/// Keys and their defaults.
const KEYS: [(&str, &str); 13] = [
    ("solids", "paper"),
    ("magic", "0.125"),
    ("tau", "0.55"),
    ("n", "8"),
    ("phi", "0.06545"),
    ("shape", "sphere"),
    ("rotated", "0"),
    ("place", "0"),
    ("speed", "0"),
    ("re", "0.02"),
    ("plane", "fitted"),
    ("curvature", "fitted"),
    ("edges", "fitted"),
];

/// Kind of a row, by which results are summed up, and the row.
fn quantity(pick: &Pick, what: &str) -> String {
    let operators = match (pick.word("solids"), pick.word("magic")) {
        ("paper", _) => "homogenised".to_string(),
        ("sc3", "0.125") => "saturated".to_string(),
        (operator, magic) => format!("saturated, {operator}, magic {magic}"),
    };
    let bodies = match pick.word("shape") {
        "sphere" => "spheres",
        "cube" => "cubes",
        _ => "other bodies",
    };
    let cells = match (bodies, pick.real("n") < 12.0) {
        ("other bodies", _) => pick.named(&["n", "tau"]),
        (_, true) => "below 12 cells".to_string(),
        (_, false) => "12 cells and more".to_string(),
    };
    let inertia = if pick.real("re") >= 1.0 { format!(", {}", pick.named(&["re"])) } else { String::new() };
    let row = pick.named(&["shape", "rotated", "tau", "n", "phi", "place", "speed"]);
    format!("{what}, {operators}, {bodies}, {cells}{inertia}; {row}")
}

/// Drag over its reference, and the noise of the force on a body that moves.
fn checks(pick: &Pick) -> Vec<Check> {
    let SurfaceShift { plane, curvature, edges } = SurfaceShift::FITTED;
    let given = |key: &str, fitted: f64| if pick.word(key) == "fitted" { fitted } else { pick.real(key) };
    let shift = SurfaceShift {
        plane: given("plane", plane),
        curvature: given("curvature", curvature),
        edges: given("edges", edges),
    };
    let saturated = |operator| Method::Saturated(Saturated { operator, shift });
    let row = Row {
        method: match pick.word("solids") {
            "paper" => Method::Homogenised(Homogenised { ramp: 0.5 }),
            "sc1" => saturated(SolidOperator::Sc1),
            "sc2" => saturated(SolidOperator::Sc2),
            "sc3" => saturated(SolidOperator::Sc3),
            other => panic!("{other}"),
        },
        collision: match pick.word("magic") {
            "bgk" => Collision::Bgk,
            _ => Collision::Trt { magic: pick.real("magic") },
        },
        tau: pick.real("tau"),
        resolution: pick.real("n"),
        volume_fraction: pick.real("phi"),
        body: pick.word("shape").into(),
        rotated: pick.whole("rotated"),
        place: pick.whole("place"),
        speed: pick.real("speed"),
        reynolds: pick.real("re"),
    };
    let Outcome { drag, noise } = measure(&row);
    let slow = row.reynolds < 1.0;
    let judged = pick.word("solids") == "sc3" && pick.word("magic") == "0.125" && row.resolution >= 12.0;
    let name = quantity(pick, "drag over its reference");
    let mut found = vec![match row.body.as_str() {
        "sphere" if judged && slow => Check::new(name, drag, 1.0, 0.02, SOURCE),
        "cube" if judged && slow => Check::new(name, drag, 1.0, 0.04, SOURCE),
        _ => reported(name, drag, 1.0, SOURCE),
    }];
    if row.speed != 0.0 {
        let name = quantity(pick, "noise of the force over its mean");
        found.push(if judged && row.body == "sphere" {
            Check::new(name, noise, 0.0, 0.01, "none")
        } else {
            reported(name, noise, 0.0, "none")
        });
    }
    found
}

/// Holds other bodies against the same with 32 cells.
fn against_own_grid(all: &mut [(Pick, Vec<Check>)]) {
    let finest = |pick: &Pick| pick.word("n") == "32";
    let limits: Vec<(Pick, f64)> = all
        .iter()
        .filter(|(pick, _)| finest(pick))
        .map(|(pick, checks)| (pick.clone(), checks[0].measured))
        .collect();
    for (pick, checks) in all.iter_mut().filter(|(pick, _)| !finest(pick)) {
        let body = |other: &Pick| ["shape", "rotated"].iter().all(|key| pick.word(key) == other.word(key));
        let Some((_, limit)) = limits.iter().find(|(other, _)| body(other)) else { continue };
        let (name, drag) = (checks[0].quantity.clone(), checks[0].measured / limit);
        let part = if pick.real("n") < 20.0 { 0.03 } else { 0.015 };
        checks[0] = if pick.word("solids") == "sc3" {
            Check::new(name, drag, 1.0, part, OWN_GRID)
        } else {
            reported(name, drag, 1.0, OWN_GRID)
        };
    }
}

fn main() -> ExitCode {
    let question = "drag of a body in a periodic cube over its reference";
    harness::main("drag", question, include_str!("rows.txt"), &KEYS, checks, against_own_grid)
}
