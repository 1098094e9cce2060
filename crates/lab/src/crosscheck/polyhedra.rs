//! Polyhedra: volume and centroid of overlaps, principal moments of inertia.
//!
//! Bodies without forces are brought together from where they are apart, since programs follow contacts from step to step.

use super::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, PI, TAU};
use turbid::contact::{Body, Geometry, GrownShape, overlap};
use turbid::math::{Quat, furthest};
use turbid::shape::polyhedron::{COMPUTED, Polyhedron};

const EDGE: f64 = 1e-3;
/// Depth at the end of a path (m), positions along it, and sub-steps between two.
const DEEPEST: f64 = 0.12 * EDGE;
const STEPS: usize = 16;
const FINE: u32 = 10;
const STEP: f64 = 1e-5;
/// Room of a pair (m), and pairs in a row.
const ROOM: f64 = 5.0 * EDGE;
const ROW: usize = 10;

const VOLUME: Limit =
    (1e-9, "relative, worst of all overlaps: rounding of positions, 1e-17 m of a depth of 4e-6 m or more");
const CENTROID: Limit = (1e-9, "over the size of the smaller body, worst of all overlaps: as the volume");
const CLOSED: Limit =
    (1e-9, "relative, worst of all overlaps and both engines, to the closed form: as between the engines");
const MOMENTS: Limit =
    (1e-12, "relative, worst of all bodies and axes: rounding of sums over some 50 tetrahedra");

/// Ways in which a cube meets another one, and the number of each.
const CUBES: [(&str, usize); 6] = [
    ("face on face, along the axes", 10),
    ("face on face, turned about the normal", 10),
    ("edge on face", 20),
    ("edge on edge", 20),
    ("corner on face", 20),
    ("random orientations", 20),
];
/// The same for the floor.
const FLOOR: [(&str, usize); 4] = [("face", 5), ("edge", 5), ("corner", 5), ("random orientations", 5)];

/// A body on its way down to another one, or to the floor.
struct Meeting {
    kind: usize,
    lower: Option<(usize, Quat)>,
    upper: (usize, Quat),
    /// Offset of the upper one across its way (m), and the unit vector back along it.
    aside: Vec3,
    away: Vec3,
}

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + 0.5 * (high - low) * (self.next() + 1.0)
    }

    fn turn(&mut self) -> Quat {
        Quat::from_scaled_axis(self.vector().normalize() * self.between(0.0, PI))
    }
}

fn about(axis: Vec3, angle: f64) -> Quat {
    Quat::from_scaled_axis(axis * angle)
}

/// Turns a cube so that an edge along x, or a corner, is its lowest part.
fn edge_down() -> Quat {
    about(Vec3::x(), FRAC_PI_4)
}

fn corner_down() -> Quat {
    about(Vec3::x(), FRAC_1_SQRT_2.atan()) * about(Vec3::y(), FRAC_PI_4)
}

fn body(points: &[Vec3]) -> Template {
    let (shape, _) = Polyhedron::hull(points, COMPUTED).expect("corners of a body");
    Template { shape: Arc::new(shape), density: DENSITY, material: 0 }
}

fn cube() -> Template {
    Template { shape: Arc::new(Polyhedron::cuboid(Vec3::repeat(EDGE))), ..body(&corners()) }
}

fn corners() -> [Vec3; 8] {
    std::array::from_fn(|n| Vec3::from_fn(|i, _| EDGE * ((n >> i & 1) as f64 - 0.5)))
}

/// Ten bodies with 8 to 26 corners on ellipsoids.
fn irregular(random: &mut Random) -> Vec<Template> {
    let of = |count: usize| {
        let axes = Vec3::from_fn(|_, _| 0.7 * EDGE * random.between(0.7, 1.3));
        let corners: Vec<Vec3> =
            (0..count).map(|_| random.vector().normalize().component_mul(&axes)).collect();
        body(&corners)
    };
    (8..28).step_by(2).map(of).collect()
}

/// Cubes that meet in all ways of [`CUBES`].
fn cube_pairs(random: &mut Random) -> Vec<Meeting> {
    let kinds = CUBES.iter().enumerate().flat_map(|(kind, (_, count))| std::iter::repeat_n(kind, *count));
    let meeting = |kind: usize| {
        let angle = random.between(0.3, FRAC_PI_4);
        let (lower, upper) = match kind {
            0 => (Quat::identity(), Quat::identity()),
            1 => (Quat::identity(), about(Vec3::z(), angle)),
            2 => (Quat::identity(), about(Vec3::z(), angle) * edge_down()),
            3 => (edge_down(), about(Vec3::z(), 2.0 * angle) * edge_down()),
            4 => (Quat::identity(), about(Vec3::z(), angle) * corner_down()),
            _ => (random.turn(), random.turn()),
        };
        let mut aside = random.vector() * (0.3 * EDGE);
        aside.z = 0.0;
        // Only the first kind is along the axes.
        let all = if kind == 0 { Quat::identity() } else { random.turn() };
        let (lower, upper) = (Some((0, all * lower)), (0, all * upper));
        Meeting { kind, lower, upper, aside: all * aside, away: all * Vec3::z() }
    };
    kinds.map(meeting).collect()
}

/// Vertices of a body about its centre, turned.
fn vertices<'a>(template: &'a Template, turn: &'a Quat) -> impl Iterator<Item = Vec3> + 'a {
    let shape = template.shape.as_polyhedron().expect("all bodies are polyhedra");
    shape.vertices.iter().map(move |vertex| turn * vertex)
}

impl Meeting {
    /// Distance along the way at which the two touch (m).
    fn touching(&self, templates: &[Template]) -> f64 {
        let (kind, turn) = self.upper;
        let Some((lower, other)) = self.lower else {
            return -furthest(vertices(&templates[kind], &turn), &-Vec3::z()).z;
        };
        let [a, b] = [lower, kind].map(|kind| GrownShape::new(templates[kind].shape.clone(), 0.0));
        let bodies = [Body { grown: &a, orientation: other }, Body { grown: &b, orientation: turn }];
        let overlaps = |distance: f64| {
            overlap(Geometry::Exact, &bodies[0], &bodies[1], self.aside + self.away * distance).is_some()
        };
        let (mut low, mut high) = (0.0, a.reach() + b.reach());
        while high - low > 1e-15 * EDGE {
            let middle = 0.5 * (low + high);
            (low, high) = if overlaps(middle) { (middle, high) } else { (low, middle) };
        }
        low
    }
}

/// Bodies of which none acts on another, at these distances along their ways, with the speed of the upper ones (m/s).
fn system(
    name: &str,
    templates: &Arc<[Template]>,
    meetings: &[Meeting],
    start: impl Fn(&Meeting) -> f64,
    speed: f64,
    young: f64,
) -> Setup {
    let mut system = glass(name, 1.0, 0.0, OWN);
    let material = Material { youngs_modulus: young, poisson_ratio: 0.25 };
    system.templates = templates.clone();
    system.contact = Some(model(&[material], &[1.0], 0.0, OWN));
    system.domain = open([10 * ROW, 10 * ROW, 10], 0.1 * ROOM);
    let mut add = |(kind, turn): (usize, Quat), at: Vec3, velocity: Vec3| {
        add(&mut system, kind, at, velocity).set_orientation(&turn);
    };
    for (n, meeting) in meetings.iter().enumerate() {
        let middle = Vec3::new((n % ROW) as f64 + 0.5, (n / ROW) as f64 + 0.5, 0.5) * ROOM;
        let (offset, velocity) = (meeting.aside + meeting.away * start(meeting), meeting.away * -speed);
        match meeting.lower {
            Some(lower) => {
                add(lower, middle - offset * 0.5, Vec3::zeros());
                add(meeting.upper, middle + offset * 0.5, velocity);
            }
            None => add(meeting.upper, Vec3::new(middle.x, middle.y, 0.0) + offset, velocity),
        }
    }
    if meetings.iter().any(|meeting| meeting.lower.is_none()) {
        system.walls.push(plane(2, 0.0, true));
    }
    system
}

/// Volume (m^3) and centroid (m) of the overlaps of an engine, by meeting.
fn overlaps(engine: &dyn DemEngine, meetings: &[Meeting]) -> Vec<Option<(f64, Vec3)>> {
    let mut found = vec![None; meetings.len()];
    for contact in engine.contact_states(&Comm::Solo) {
        let meeting = contact.first as usize / (1 + usize::from(meetings[0].lower.is_some()));
        found[meeting] = Some((contact.volume, contact.point.into()));
    }
    found
}

#[derive(Clone, Default)]
struct Worst {
    overlaps: usize,
    volume: f64,
    centroid: f64,
    closed: f64,
    /// Sums over the last overlaps of both engines and closed forms (m^3).
    sums: [f64; 3],
}

/// The larger of two differences; one that is not finite is the worst.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_finite() { a.max(b) } else { f64::INFINITY }
}

/// Brings bodies together in both engines and compares their overlaps; `closed` is the closed form of the volume (m^3) at a depth (m).
fn compare(
    against: &Against,
    findings: &mut Findings,
    name: &str,
    templates: Vec<Template>,
    (kinds, meetings): (&[&str], &[Meeting]),
    closed: impl Fn(&Meeting, f64) -> Option<f64>,
) -> Result<()> {
    let templates: Arc<[Template]> = templates.into();
    let spacing = DEEPEST / (STEPS as f64 - 2.5);
    let ahead = |step: usize| (2.5 - step as f64) * spacing;
    let start = |meeting: &Meeting| meeting.touching(&templates) + ahead(0);
    let mut system = system(name, &templates, meetings, start, spacing / STEP, 1e-12);
    system.substeps = FINE;
    let mut engines = [native(&system)?, against.measuring(&system)?];
    let loads = vec![Load::default(); system.particles.len()];
    let mut worst = vec![Worst::default(); kinds.len()];
    let mut apart = vec![[0.0_f64; 2]; meetings.len()];
    for step in 1..=STEPS {
        for engine in &mut engines {
            engine.advance(&Comm::Solo, &loads, STEP)?;
        }
        let found = engines.each_ref().map(|engine| overlaps(&**engine, meetings));
        // The overlaps are those at the beginning of the last sub-step.
        let depth = -ahead(step) - spacing / f64::from(FINE);
        for (n, meeting) in meetings.iter().enumerate() {
            let (worst, apart) = (&mut worst[meeting.kind], &mut apart[n]);
            let size = [meeting.lower, Some(meeting.upper)].into_iter().flatten();
            let size = size.map(|(kind, _)| templates[kind].shape.volume().cbrt()).fold(f64::MAX, f64::min);
            let [off, shifted] = match [found[0][n], found[1][n]] {
                [None, None] if depth < 0.0 => continue,
                [Some((volume, point)), Some((other, there))] => {
                    if let Some(exact) = closed(meeting, depth) {
                        let off = [volume, other].map(|volume| (volume / exact - 1.0).abs());
                        worst.closed = worse(worse(worst.closed, off[0]), off[1]);
                        worst.sums[2] += if step == STEPS { exact } else { 0.0 };
                    }
                    if step == STEPS {
                        worst.sums[0] += volume;
                        worst.sums[1] += other;
                    }
                    [(other / volume - 1.0).abs(), (point - there).norm() / size]
                }
                // Only one of them has found it, or none.
                _ => [1.0; 2],
            };
            worst.overlaps += 1;
            (worst.volume, worst.centroid) = (worse(worst.volume, off), worse(worst.centroid, shifted));
            *apart = [worse(apart[0], off), worse(apart[1], shifted)];
        }
    }
    for (kind, Worst { overlaps, volume, centroid, closed, sums }) in kinds.iter().zip(worst) {
        let values: Values = [Some(sums[0]), Some(sums[1]), (sums[2] > 0.0).then_some(sums[2])];
        let quantity = format!("volumes of {overlaps} overlaps, {kind}; shown: sum at the end (m^3)");
        findings.given(quantity, values, volume, VOLUME);
        findings.given(
            format!("centroids of {overlaps} overlaps, {kind} (-)"),
            [None; 3],
            centroid,
            CENTROID,
        );
        if sums[2] > 0.0 {
            findings.given(format!("volumes against the closed form, {kind} (m^3)"), values, closed, CLOSED);
        }
    }
    let curve = |k: usize| apart.iter().enumerate().map(move |(n, apart)| [n as f64, apart[k].max(1e-17)]);
    let title = format!("Overlaps of polyhedra, native and OTHER: {name}");
    let axes = ["pair", "largest relative difference on the path (-)"];
    let curves = [measured("volume", curve(0)), overlaid("centroid", curve(1))];
    findings.plot("overlaps", title, axes, curves).logarithmic([false, true]);
    Ok(())
}

/// Cubes with a face, an edge or a corner down on a plane.
pub(super) fn cube_plane(against: &Against, findings: &mut Findings) -> Result<()> {
    let mut random = Random(20);
    let kinds = FLOOR.iter().enumerate().flat_map(|(kind, (_, count))| std::iter::repeat_n(kind, *count));
    let meeting = |kind: usize| {
        let turn = match kind {
            0 => Quat::identity(),
            1 => edge_down(),
            2 => corner_down(),
            _ => random.turn(),
        };
        let upper = (0, about(Vec3::z(), random.between(0.0, TAU)) * turn);
        Meeting { kind, lower: None, upper, aside: Vec3::zeros(), away: Vec3::z() }
    };
    let meetings: Vec<Meeting> = kinds.map(meeting).collect();
    let closed = |meeting: &Meeting, depth: f64| match meeting.kind {
        0 => Some(EDGE * EDGE * depth),
        1 => Some(EDGE * depth * depth),
        2 => Some(0.5 * 3_f64.sqrt() * depth.powi(3)),
        _ => None,
    };
    compare(against, findings, "cube-plane", vec![cube()], (&FLOOR.map(|(kind, _)| kind), &meetings), closed)
}

pub(super) fn cube_cube(against: &Against, findings: &mut Findings) -> Result<()> {
    let meetings = cube_pairs(&mut Random(20));
    let closed = |meeting: &Meeting, depth: f64| {
        let [x, y] = [meeting.aside.x, meeting.aside.y].map(|aside| EDGE - aside.abs());
        (meeting.kind == 0).then_some(x * y * depth)
    };
    compare(against, findings, "cube-cube", vec![cube()], (&CUBES.map(|(kind, _)| kind), &meetings), closed)
}

pub(super) fn irregular_pairs(against: &Against, findings: &mut Findings) -> Result<()> {
    let mut random = Random(21);
    let templates = irregular(&mut random);
    let meeting = |n: usize| {
        let [lower, upper] = [n % 10, (n + n / 10) % 10].map(|kind| (kind, random.turn()));
        let mut aside = random.vector() * (0.1 * EDGE);
        aside.z = 0.0;
        Meeting { kind: 0, lower: Some(lower), upper, aside, away: Vec3::z() }
    };
    let meetings: Vec<Meeting> = (0..100).map(meeting).collect();
    compare(against, findings, "polyhedra", templates, (&["irregular polyhedra"], &meetings), |_, _| None)
}

/// Spins after a step from rest under equal torques about all three principal axes: `T h / I`.
pub(super) fn moments_of_inertia(against: &Against, findings: &mut Findings) -> Result<()> {
    let templates = [vec![cube()], irregular(&mut Random(21))].concat();
    let alone = |kind: usize| {
        let (upper, lower) = ((kind, Quat::identity()), None);
        Meeting { kind, lower, upper, aside: Vec3::zeros(), away: Vec3::z() }
    };
    let bodies: Vec<Meeting> = (0..templates.len()).map(alone).collect();
    let mut system = system("inertia", &templates.into(), &bodies, |_| 0.5 * ROOM, 0.0, 1e-12);
    system.contact = None;
    system.walls.clear();
    // So little that nothing has turned.
    let torque = Vec3::repeat(1e-24);
    let loads = vec![Load { force: Vec3::zeros(), torque }; bodies.len()];
    let mut spins = [Vec::new(), Vec::new()];
    for (spins, mut engine) in spins.iter_mut().zip([native(&system)?, against.engine(&system)?]) {
        engine.advance(&Comm::Solo, &loads, STEP)?;
        *spins = engine.particles().owned().iter().map(Particle::angular_velocity).collect();
    }
    let exact = |k: usize| (torque * STEP).component_div(&system.templates[k].inertia());
    let off = |spins: &Vec<Vec3>| {
        let bodies = spins.iter().enumerate();
        worst(bodies.map(|(k, spin)| (spin.component_div(&exact(k)) - Vec3::repeat(1.0)).amax()))
    };
    let values = [spins[0][1].x, spins[1][1].x, exact(1).x].map(Some);
    let quantity = "principal moments of 11 bodies, from spins; shown: spin of the second about a (1/s)";
    findings.given(quantity, values, off(&spins[0]).max(off(&spins[1])), MOMENTS);
    Ok(())
}
