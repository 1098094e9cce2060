//! Force and torque on spheres and spheroids fixed at a small gap from each other or from a wall while they move. See the README of this
//! folder.
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
use turbid::contact::Lubrication;
use turbid::contact::lubrication::{Partner, Side, Unresolved};
use turbid::contact::nearest::Ellipsoidal;
use turbid::coupling::{
    AnyFluid, Coupling, CouplingParams, ForceBalance, Homogenised, LatticeWalls, Method, Saturated,
    SolidOperator,
};
use turbid::dem::Load;
use turbid::domain::{Decomposition, Domain};
use turbid::fluid::{Boundary, Collision, FluidParams, Precision, Simd};
use turbid::math::{Quat, Vec3};
use turbid::particle::{Particle, ParticleStore, Template};
use turbid::shape::{Cuboid, Ellipsoid, Shape, Sphere};
use turbid::units::Units;
use turbid::wall::{Motion, Surface, Wall};
use turbid_lab::checks::Check;

/// One row: what is computed.
#[derive(Clone)]
struct Row {
    method: Method,
    tau: f64,
    /// Cells of the diameter of the first body, or of the sphere of its volume.
    resolution: f64,
    /// Polar over equatorial semi-axis of both bodies.
    stretch: f64,
    /// Angle of the polar axes with the normal of the gap (degrees).
    tilt: f64,
    /// Radius of the second sphere over that of the first, or half the edge of a cube; none for a wall.
    ratio: Option<f64>,
    /// True if the second body is a cube, which does not move.
    face: bool,
    /// "squeeze", "shear", "spin" or "roll"; "along" is all but the first, at a wall without the last.
    motion: String,
    /// Gap (cells).
    gap: f64,
    /// Number of a random place of the pair in a cell.
    place: u64,
    /// True if the line of centres is not along an axis of the lattice.
    oblique: bool,
    /// Edge of the box over the larger diameter.
    room: f64,
}

impl Row {
    fn is_of_spheres(&self) -> bool {
        self.stretch.to_bits() == 1.0_f64.to_bits()
    }
}

/// Force against the motion of the first sphere and torque on it in a steady state, over `6 pi mu a U` and `8 pi mu a^2 U` (of a
/// spin, `U = a w`; there the torque is the one against the motion).
#[derive(Clone, Copy)]
struct Outcome {
    /// Of the lattice.
    force: f64,
    torque: f64,
    /// With what [`Lubrication`] adds.
    full_force: f64,
    full_torque: f64,
    /// Reduced radius of spheroids (cells).
    reduced: f64,
}

/// The exact force of [`Outcome`] on squeezed bodies; of spheroids, that of spheres with the same reduced radius (cells), whose singular
/// part is the same and whose constant part is not. The series of Brenner (1961), Chem. Engng Sci. 16, 242, for a wall and, with a
/// free surface half-way, for two equal spheres.
fn exact(row: &Row, reduced: f64) -> Option<f64> {
    let is_wall = row.ratio.is_none() || row.face;
    let radius =
        if row.is_of_spheres() { 0.5 * row.resolution } else { reduced * if is_wall { 1.0 } else { 2.0 } };
    let (gap, size) = (row.gap / radius, radius / (0.5 * row.resolution));
    if row.motion != "squeeze" {
        None
    } else if is_wall {
        Some(
            size * squeezed(gap, |sinh, cosh, n, s| {
                let (double, single) = (2.0 * sinh * cosh, s.sinh());
                (2.0 * double + n * (2.0 * s).sinh()) / (4.0 * sinh * sinh - n * n * single * single)
            }),
        )
    } else {
        row.ratio.filter(|ratio| (ratio - 1.0).abs() < 1e-12).map(|_| {
            size * squeezed(0.5 * gap, |sinh, cosh, n, s| {
                let (double, single) = (2.0 * sinh * cosh, s.sinh());
                (4.0 * cosh * cosh + n * n * single * single) / (2.0 * double - n * (2.0 * s).sinh())
            })
        })
    }
}

/// A column of the table of exact values in the box of a row, which `reference.py` has computed; NaN where it lacks the row.
fn tabled(pick: &Pick, column: &str) -> f64 {
    let mut lines = include_str!("exact.csv").lines().filter(|line| !line.starts_with('#'));
    let heads: Vec<&str> = lines.next().expect("heads").split(',').collect();
    let at = heads.iter().position(|head| *head == column).expect("a column");
    let keys = ["with", "n", "gap", "room", "oblique"].map(|key| pick.word(key));
    lines
        .map(|line| line.split(',').collect::<Vec<_>>())
        .find(|cells| cells[..keys.len()] == keys)
        .map_or(f64::NAN, |cells| cells[at].parse().expect("a number"))
}

/// The sum of Brenner's series, a term of which is given `sinh` and `cosh` of `(n + 1/2) s`, `2 n + 1`, and `s`; `cosh s` is the
/// distance of the centre from the plane of symmetry over the radius.
fn squeezed(gap: f64, term: impl Fn(f64, f64, f64, f64) -> f64) -> f64 {
    let s = (1.0 + gap).acosh();
    let each = (1..).map(f64::from).take_while(|n| (n + 0.5) * s < 40.0).map(|n| {
        let x = (n + 0.5) * s;
        let weight = n * (n + 1.0) / ((2.0 * n - 1.0) * (2.0 * n + 3.0));
        weight * (term(x.sinh(), x.cosh(), 2.0 * n + 1.0, s) - 1.0)
    });
    4.0 / 3.0 * s.sinh() * each.sum::<f64>()
}

fn measure(row: &Row) -> Outcome {
    let radius = 0.5 * row.resolution;
    let other = row.ratio.map(|ratio| ratio * radius);
    let nu = (row.tau - 0.5) / 3.0;
    let speed = 0.01 * nu / radius;
    let slim = row.stretch.cbrt();
    let axes = Vec3::new(1.0 / slim, 1.0 / slim, row.stretch / slim);
    let shape_of = |radius: f64| -> Arc<dyn Shape> {
        if row.is_of_spheres() {
            Arc::new(Sphere { radius })
        } else {
            Arc::new(Ellipsoid::new(axes * radius).unwrap())
        }
    };
    let second_of = |radius: f64| -> Arc<dyn Shape> {
        if row.face { Arc::new(Cuboid::new(Vec3::repeat(2.0 * radius)).unwrap()) } else { shape_of(radius) }
    };
    let shapes: Vec<_> = std::iter::once(shape_of(radius)).chain(other.map(second_of)).collect();
    let reach = shapes.iter().map(|shape| shape.circumradius()).fold(0.0, f64::max);
    let edge = (row.room * 2.0 * reach).round();
    let cells = edge as usize;
    let mut seed = row.place;
    let aside = Vec3::from_fn(|_, _| random(&mut seed));
    let middle = Vec3::repeat((cells / 2) as f64) + aside;
    let axis = if row.oblique { Vec3::new(0.48, -0.6, 0.64) } else { Vec3::z() };
    let across = axis.cross(&Vec3::x()).normalize();
    let domain =
        Domain { faces: Domain::faces([true, true, row.ratio.is_some()]), cells: [cells; 3], dx: 1.0 };
    let plane = |name: &str, z: f64, up: f64| Wall {
        name: name.into(),
        surface: Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::z() * up },
        motion: Motion::default(),
        material: 0,
    };

    // The first sphere above; it moves down, or along, or turns as if it rolled along.
    let (mut first, mut second) = (Particle::at(0, 0, Vec3::zeros()), Particle::at(1, 1, Vec3::zeros()));
    let (sin, cos) = row.tilt.to_radians().sin_cos();
    let turn = Quat::rotation_between(&Vec3::z(), &(axis * cos + across * sin)).expect("not upside down");
    // From the centre to the nearest point of the other body.
    let near = |k: usize, way: Vec3| {
        let point = turn * shapes[k].support(turn.inverse() * way);
        if row.face { way * point.dot(&way) } else { point }
    };
    let centre = |k: usize, way: Vec3| way * (0.5 * row.gap) - near(k, -way);
    (first.position, second.position) = if other.is_some() {
        ((middle + centre(0, axis)).into(), (middle + centre(1, -axis)).into())
    } else {
        let point = near(0, -axis);
        ([middle.x, middle.y, row.gap - point.z], [0.0; 3])
    };
    for particle in [&mut first, &mut second] {
        particle.set_orientation(&turn);
    }
    let turning = across.cross(&axis);
    match row.motion.as_str() {
        "squeeze" if row.face => first.velocity = (-axis * speed).into(),
        "squeeze" => (first.velocity, second.velocity) = ((-axis * speed).into(), (axis * speed).into()),
        "shear" => (first.velocity, second.velocity) = ((across * speed).into(), (-across * speed).into()),
        "spin" | "roll" => {
            let spin = turning * (speed / radius);
            first.angular_velocity = spin.into();
            second.angular_velocity = if row.motion == "spin" { spin } else { -spin }.into();
        }
        motion => panic!("{motion}"),
    }
    let count = 1 + usize::from(other.is_some());
    let templates: Arc<[Template]> =
        shapes.iter().map(|shape| Template { shape: shape.clone(), material: 0, density: 1.0 }).collect();

    let units = Units { dx: 1.0, dt: 1.0, density: 1.0 };
    let decomposition = Decomposition::new(domain, 1).expect("one block");
    let walls = [plane("z-", 0.0, 1.0), plane("z+", edge, -1.0)];
    let walls = LatticeWalls::new(if other.is_some() { &[] } else { &walls }, &units, &domain);
    let boundary = Boundary {
        motions: &walls.motions(None),
        wall_of: &|cell| walls.wall_of(cell),
        part_of_link: &|wall, cell, way| walls.part_of_link(wall, cell, way),
        between: &|cell| walls.between(cell),
    };
    let params = FluidParams {
        relaxation_time: row.tau,
        collision: Collision::Trt { magic: 0.125 },
        simd: Simd::best(),
    };
    let mut fluid = AnyFluid::new(Precision::F64, &decomposition, &Comm::Solo, &params, &boundary).unwrap();
    let coupled = CouplingParams {
        units,
        method: row.method,
        gravity: Vec3::zeros(),
        force_balance: ForceBalance::FluidOnly,
        simd: Simd::best(),
    };
    let mut coupling = Coupling::new(coupled, &decomposition, 0, reach);
    let particles = [first, second][..count].to_vec();
    let store = ParticleStore { templates, particles, owned: count, owners: vec![0; count] };

    let interval = (0.5 * radius * radius / nu).ceil().max(50.0) as u64;
    let way = if row.motion == "squeeze" { axis } else { -across };
    // What is left after an interval of the slowest mode, a shear of all of the fluid between the walls.
    let slow = match row.motion.as_str() {
        "shear" | "spin" if other.is_none() => (-PI * PI * nu * interval as f64 / (edge * edge)).exp(),
        _ => 0.0,
    };
    let (mut before, mut last, mut steady, mut steps) = ([f64::INFINITY; 2], None, 0, 0);
    loop {
        let mut sum = Load::default();
        for _ in 0..interval {
            coupling.map(&store);
            fluid.sweep([0.0; 3], &mut coupling, false);
            fluid.exchange();
            sum += coupling.loads(&store, Vec3::zeros(), &Comm::Solo)[0];
            steps += 1;
        }
        let n = interval as f64;
        let found = [
            sum.force.dot(&way) / (n * 6.0 * PI * nu * radius * speed),
            -sum.torque.dot(&turning) / (n * 8.0 * PI * nu * radius * radius * speed),
        ];
        let past = last.replace(found).unwrap_or(found);
        let now = [0, 1].map(|k| (found[k] - slow * past[k]) / (1.0 - slow));
        let [force, torque] = now;
        // Squeezed bodies have no torque, and the fluid takes long to move along with two that roll.
        let mut judged = match row.motion.as_str() {
            "squeeze" => 0..1,
            "roll" => 1..2,
            _ => 0..2,
        };
        let still = judged.all(|k| (now[k] - before[k]).abs() < 1e-3 * now[k].abs());
        steady = if still { steady + 1 } else { 0 };
        before = now;
        if steady >= 2 || steps > 100_000 {
            let side =
                |p: &Particle| Side { velocity: p.velocity(), spin: p.angular_velocity(), rates: [0.0; 2] };
            let still = Side { velocity: Vec3::zeros(), spin: Vec3::zeros(), rates: [0.0; 2] };
            let sides = [&side(&first), &if other.is_some() { side(&second) } else { still }];
            let unresolved = match row.method {
                Method::Saturated(_) => Unresolved::saturated(),
                Method::Homogenised(_) => Unresolved::homogenised(row.tau),
            };
            let film = Lubrication { viscosity: nu, roughness: 0.0, cell: 1.0, unresolved };
            let body = |radius: f64| Ellipsoidal::new(axes * radius, &turn);
            let offset = second.position() - first.position();
            let (gap, partner) = if let Some(other) = other {
                let far = f64::INFINITY;
                let gap = match shapes[1].as_polyhedron() {
                    Some(cube) => body(radius).gap_to_face((cube, &turn), offset, far),
                    None => body(radius).gap(&body(other), offset, far),
                };
                (gap, Partner::Body)
            } else {
                let floor = plane("z-", 0.0, 1.0).surface.seen_from(first.position());
                (body(radius).gap_to_wall(&floor, f64::INFINITY), Partner::Wall)
            };
            let gap = gap.expect("bodies apart");
            assert!((gap.width - row.gap).abs() < 1e-9 && (gap.normal + axis).norm() < 1e-6);
            let mean = shapes.iter().map(|shape| shape.curvature().mean).sum();
            let added = film.film(&gap, mean, partner).map(|film| film.act(sides, 0.0));
            let (more, turn) =
                added.map_or((0.0, 0.0), |action| (action.force.dot(&way), -action.torques[0].dot(&turning)));
            let full_force = force + more / (6.0 * PI * nu * radius * speed);
            let full_torque = torque + turn / (8.0 * PI * nu * radius * radius * speed);
            return Outcome { force, torque, full_force, full_torque, reduced: gap.reduced() };
        }
    }
}

const BRENNER: &str = "Brenner (1961), doi:10.1016/0009-2509(61)80035-3";
const IN_BOX: &str = "bispherical series (O'Neill 1964, Goldman, Cox and Brenner 1967, doi:10.1016/0009-2509(67)80047-2) with the images of the box, reference.py";
const SPHERES: &str = "spheres with the same reduced radius, whose force has the same singular part";
/// Of the force.
const TOLERANCE: f64 = 0.05;
/// Of the torque on a sphere that slides along a wall and the force on one that turns there; of the torque on one that turns.
const AT_WALL: f64 = 0.08;
const TURNING: f64 = 0.12;
/// Of torques on pairs, and of those in a gap of 0.1 cells or of 8 cells across, which depend on the direction in the lattice.
const PAIRS: f64 = 0.04;
const NARROW: f64 = 0.07;
/// Keys and their defaults.
const KEYS: [(&str, &str); 11] = [
    ("solids", "saturated"),
    ("with", "1"),
    ("motion", "squeeze"),
    ("tau", "0.65"),
    ("n", "12"),
    ("gap", "1"),
    ("oblique", "0"),
    ("place", "1"),
    ("room", "4"),
    ("stretch", "1"),
    ("tilt", "0"),
];

/// Forces and torques with lubrication and of the lattice alone against the exact ones.
fn checks(pick: &Pick) -> Vec<Check> {
    let row = Row {
        method: match pick.word("solids") {
            "homogenised" => Method::Homogenised(Homogenised { ramp: 0.5 }),
            "saturated" => Method::Saturated(Saturated::new(SolidOperator::Sc3)),
            other => panic!("{other}"),
        },
        tau: pick.real("tau"),
        resolution: pick.real("n"),
        ratio: match pick.word("with") {
            "wall" => None,
            "face" => Some(2.0),
            ratio => Some(ratio.parse().expect("a ratio of radii")),
        },
        face: pick.word("with") == "face",
        motion: pick.word("motion").into(),
        gap: pick.real("gap"),
        place: pick.whole("place"),
        oblique: pick.word("oblique") != "0",
        room: pick.real("room"),
        stretch: pick.real("stretch"),
        tilt: pick.real("tilt"),
    };
    let spheres = row.is_of_spheres();
    let is_wall = row.ratio.is_none();
    let partner = match pick.word("with") {
        "wall" => "at a wall",
        "face" => "at a face",
        _ => "pairs",
    };
    let low = if row.tau < 0.6 { ", tau below 0.6" } else { "" };
    let bodies = if spheres { "spheres" } else { "spheroids" };
    // Tolerances of their own.
    let narrow = match pick.word("motion") {
        "along" if is_wall && row.gap < 0.2 => ", gap 0.1",
        "along" if !is_wall && (row.gap < 0.2 || row.resolution < 12.0) => ", gap 0.1 or 8 cells",
        _ => "",
    };
    let name = |what: &str, motion: &str| {
        let kind = format!("{what}, {}, {motion}, {bodies} {partner}{narrow}{low}", pick.word("solids"));
        let keys = ["tau", "n", "gap", "oblique", "place", "room", "stretch", "tilt"];
        format!("{kind}; {}", pick.named(&keys))
    };
    let mut checks = Vec::new();
    let mut judge = |what: &str,
                     motion: &str,
                     [full, alone]: [f64; 2],
                     exact: f64,
                     tolerance: f64,
                     source: &str| {
        let quantity = name(what, motion);
        checks.push(if tolerance.is_finite() && exact.is_finite() {
            Check::new(quantity, full, exact, tolerance * exact, source)
        } else {
            reported(quantity, full, exact, source)
        });
        checks.push(reported(name(&format!("{what} of the lattice alone"), motion), alone, exact, source));
    };
    let coupled = match (pick.word("solids"), is_wall) {
        // The drag of homogenised cells is off by more at times other than 0.65.
        ("homogenised", _) => f64::INFINITY,
        (_, true) if row.gap < 0.2 => f64::INFINITY,
        (_, true) => AT_WALL,
        (_, false) if row.gap < 0.2 || row.resolution < 12.0 => NARROW,
        (_, false) => PAIRS,
    };
    let motions: &[&str] = match pick.word("motion") {
        "along" if is_wall => &["shear", "spin"],
        "along" => &["shear", "spin", "roll"],
        motion => &[motion],
    };
    let mut held = Vec::new();
    for &motion in motions {
        let found = measure(&Row { motion: motion.into(), ..row.clone() });
        let (force, torque) = ([found.full_force, found.force], [found.full_torque, found.torque]);
        if motion == "squeeze" {
            let exact = exact(&row, found.reduced).unwrap_or(f64::NAN);
            let (tolerance, source) = if spheres { (TOLERANCE, BRENNER) } else { (f64::INFINITY, SPHERES) };
            judge("force", motion, force, exact, tolerance, source);
            continue;
        }
        let of = |what: &str| if spheres { tabled(pick, &format!("{motion}_{what}")) } else { f64::NAN };
        if motion != "roll" {
            let tolerance = if motion == "shear" && coupled.is_finite() { TOLERANCE } else { coupled };
            judge("force", motion, force, of("force"), tolerance, IN_BOX);
        }
        let turning = is_wall && motion == "spin" && coupled.is_finite();
        judge("torque", motion, torque, of("torque"), if turning { TURNING } else { coupled }, IN_BOX);
        held.push((torque, of("torque")));
    }
    if let ([(slid, exact), (spun, exactly)], true) = (&held[..], is_wall) {
        let free = [0, 1].map(|k| slid[k] / spun[k]);
        judge("a omega / U", "free to turn", free, exact / exactly, coupled, IN_BOX);
    }
    checks
}

fn main() -> ExitCode {
    let question =
        "force on bodies in narrow gaps, with lubrication, over 6 pi mu a U; torque over 8 pi mu a^2 U";
    harness::main("lubrication", question, include_str!("rows.txt"), &KEYS, checks, |_| ())
}
