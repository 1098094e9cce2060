//! Oblique impacts without damping: gross sliding friction, spin, and the limit of rigid spheres.
//!
//! Only gross sliding is compared: where surfaces stick, LIGGGHTS has a tangential spring and the native engine has none.

use super::theory::{Hertz, Sliding, slide};
use super::tools::{Between, GLASS, RADIUS, SAME, Scene, Track, absolute, given, moments, relative, worst};
use super::{Check, Findings, Overlay};
use std::path::Path;
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::particle::Particle;

/// Steps per duration of the impact.
const STEPS: usize = 1000;

const VELOCITY: &str = "largest difference of the velocities of both in all three ways, over the speed of approach: LIGGGHTS resists \
                        by a spring that must be stretched first, the native engine by the speed of sliding; second \
                        order in the step";
const SPIN: &str = "largest difference of the spins of both in all three ways, over what the second one gains: as for the \
                    velocities";
const FRICTIONLESS: &str = "largest difference of the velocities of both in all three ways, over the speed of approach: second order in \
                            the step";
const COULOMB: &str =
    "absolute: with sliding from first to last touch, the sums over all steps are in the ratio mu";
const CONSERVED: &str =
    "over the value at the start: equal and opposite forces along one line, so rounding of some 1000 kicks";
const RIGID: &str = "over the speed of approach: the spheres turn about each other by d_max / 2R of an angle while they touch, \
                     5e-5 here";
const UNTOUCHED: &str = "relative: nothing resists the turning about the normal in either engine";

/// An impact: the basis of its directions, speeds, spins and friction.
#[derive(Clone, Copy, Debug)]
struct Throw {
    /// What it is, for the table.
    what: &'static str,
    /// From the first to the second centre.
    normal: Vec3,
    /// Across, of unit length.
    across: Vec3,
    /// Velocity of the first sphere along both (m/s); the second one is at rest.
    velocity: [f64; 2],
    /// Spin of the spheres (1/s).
    spins: [Vec3; 2],
    /// Friction coefficient (-).
    friction: f64,
}

impl Throw {
    /// In the x-y plane, without spin.
    fn plane(what: &'static str, velocity: [f64; 2], friction: f64) -> Self {
        Self { what, normal: Vec3::x(), across: Vec3::y(), velocity, spins: [Vec3::zeros(); 2], friction }
    }

    fn scene(&self, name: String) -> Scene {
        let mut scene = Scene::glass(name, 1.0, self.friction, SAME);
        let at = Vec3::repeat(5e-3);
        let velocity = self.normal * self.velocity[0] + self.across * self.velocity[1];
        scene.add(0, at, velocity, self.spins[0]);
        scene.add(0, at + self.normal * (2.0 * RADIUS), Vec3::zeros(), self.spins[1]);
        scene
    }
}

/// What became of a throw in all three ways.
struct Outcome {
    scene: Scene,
    tracks: [Track; 2],
    theory: [Sliding; 2],
}

impl Outcome {
    fn of(throw: &Throw, name: String, directory: Option<&Path>) -> Result<Self> {
        let scene = throw.scene(name);
        let mass = scene.mass(0);
        let hertz = Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2]);
        let dt = hertz.duration(throw.velocity[0]) / STEPS as f64;
        let tracks = scene.record(directory, dt, STEPS * 5 / 4, |_| false)?;
        let start = [0, 1].map(|id| Sliding {
            radius: RADIUS,
            mass,
            position: scene.particles[id].position(),
            velocity: scene.particles[id].velocity(),
            spin: scene.particles[id].angular_velocity(),
        });
        let theory = slide(start, &hertz, throw.friction);
        Ok(Self { scene, tracks, theory })
    }

    /// Velocity and spin of a sphere at the end: native, LIGGGHTS, theory.
    fn ends(&self, id: usize) -> [(Vec3, Vec3); 3] {
        let of = |p: &Particle| (p.velocity(), p.angular_velocity());
        let [native, liggghts] = [0, 1].map(|i| of(&self.tracks[i].last()[id]));
        [native, liggghts, (self.theory[id].velocity, self.theory[id].spin)]
    }

    /// Impulses across and along the normal, `J_t / J_n`, in an engine.
    fn impulse_ratio(&self, engine: usize) -> f64 {
        let track = &self.tracks[engine];
        let (mut across, mut along) = (0.0, 0.0);
        for (k, frame) in track.frames.iter().enumerate() {
            let normal = (frame[1].position() - frame[0].position()).normalize();
            let force = track.force(k, 0);
            let push = force.dot(&normal);
            along += push.abs();
            across += (force - normal * push).norm();
        }
        across / along
    }

    /// Largest change of the sums of momentum and angular momentum over the values at the start, in an engine.
    fn drift(&self, engine: usize) -> f64 {
        let mass = self.scene.mass(0);
        let middle = 0.5 * (self.scene.particles[0].position() + self.scene.particles[1].position());
        let inertia = 0.4 * mass * RADIUS * RADIUS;
        let sums = |frame: &[Particle]| {
            let linear: Vec3 = frame.iter().map(|p| p.velocity() * mass).sum();
            let of = |p: &Particle| {
                (p.position() - middle).cross(&p.velocity()) * mass + p.angular_velocity() * inertia
            };
            (linear, frame.iter().map(of).sum::<Vec3>())
        };
        let track = &self.tracks[engine];
        let (linear, angular) = sums(&track.frames[0]);
        let (end, turned) = sums(track.last());
        worst([(end - linear).norm() / linear.norm(), (turned - angular).norm() / angular.norm()])
    }
}

/// The three ways of one number.
fn three(f: impl Fn(usize) -> f64) -> [Option<f64>; 3] {
    [Some(f(0)), Some(f(1)), Some(f(2))]
}

/// Checks that hold for every throw.
fn checks(throw: &Throw, outcome: &Outcome) -> Vec<Check> {
    let (what, speed) = (throw.what, throw.velocity[0]);
    let ends = [0, 1].map(|id| outcome.ends(id));
    let apart = |i: usize, j: usize, of: fn(&(Vec3, Vec3)) -> Vec3| {
        worst(ends.iter().map(|end| (of(&end[i]) - of(&end[j])).norm()))
    };
    let velocity = |end: &(Vec3, Vec3)| end.0;
    let spin = |end: &(Vec3, Vec3)| end.1;
    let all = |of| worst([apart(0, 1, of), apart(0, 2, of), apart(1, 2, of)]);
    let mut checks = Vec::new();
    let component = |id: usize, direction: Vec3| three(|i| ends[id][i].0.dot(&direction));
    let (tolerance, reason) = if throw.friction > 0.0 { (1e-4, VELOCITY) } else { (2e-5, FRICTIONLESS) };
    let quantity = format!("velocities after, {what}; shown: v1 across (m/s)");
    let values = component(0, throw.across);
    checks.push(given(quantity, values, all(velocity) / speed, tolerance, reason));
    if throw.friction > 0.0 {
        let axis = throw.normal.cross(&throw.across);
        let gained = |i: usize| (ends[1][i].1 - throw.spins[1]).dot(&axis);
        let quantity = format!("spins after, {what}; shown: gained by the second (1/s)");
        let scale = gained(2).abs();
        checks.push(given(quantity, three(gained), all(spin) / scale, 2e-3, SPIN));
        let ratio = |engine| Some(outcome.impulse_ratio(engine) / throw.friction);
        let values = [ratio(0), ratio(1), Some(1.0)];
        let quantity = format!("J_t / (mu J_n), {what} (-)");
        checks.push(absolute(quantity, values, Between::Theory, 1e-6, COULOMB));
    }
    let drifts = [0, 1].map(|engine| outcome.drift(engine));
    let quantity = format!("change of momentum and angular momentum, {what} (-)");
    let values = [Some(drifts[0]), Some(drifts[1]), Some(0.0)];
    checks.push(given(quantity, values, worst(drifts), 1e-12, CONSERVED));
    checks
}

/// Force along and across the normal over time.
fn plot(name: &str, throw: &Throw, outcome: &Outcome) -> Overlay {
    let curve = |engine: usize, across: bool| -> Vec<[f64; 2]> {
        let track: &Track = &outcome.tracks[engine];
        let points = (0..track.frames.len() - 1).step_by(4).map(|k| {
            let frame = &track.frames[k];
            let normal = (frame[1].position() - frame[0].position()).normalize();
            let force = track.force(k, 1);
            let along = force.dot(&normal);
            let shown = if across { (force - normal * along).norm() / throw.friction } else { along };
            [track.time(k) * 1e6, shown]
        });
        points.collect()
    };
    Overlay::new(
        name,
        format!("Gross sliding, {}", throw.what),
        ["time (us)", "force (N)"],
        [
            ("native, along", curve(0, false)),
            ("LIGGGHTS, along", curve(1, false)),
            ("native, across / mu", curve(0, true)),
            ("LIGGGHTS, across / mu", curve(1, true)),
        ],
    )
}

/// H7 and H8: several angles and coefficients of friction, in the plane and askew.
pub(super) fn sliding(directory: Option<&Path>) -> Result<Findings> {
    let tangent = |degrees: f64| degrees.to_radians().tan();
    let askew = Throw {
        normal: Vec3::new(0.48, -0.6, 0.64),
        across: Vec3::new(0.8, 0.0, -0.6),
        ..Throw::plane("60 degrees, mu = 0.1, askew", [1.0, tangent(60.0)], 0.1)
    };
    let throws = [
        Throw::plane("45 degrees, mu = 0", [1.0, 1.0], 0.0),
        Throw::plane("45 degrees, mu = 0.1", [1.0, 1.0], 0.1),
        Throw::plane("30 degrees, mu = 0.05", [1.0, tangent(30.0)], 0.05),
        askew,
        Throw::plane("75 degrees, mu = 0.3", [1.0, tangent(75.0)], 0.3),
    ];
    let mut findings = Findings::default();
    for (n, throw) in throws.iter().enumerate() {
        let outcome = Outcome::of(throw, format!("sliding-{n}"), directory)?;
        findings.checks.extend(checks(throw, &outcome));
        if throw.friction > 0.0 {
            findings.overlays.push(plot(&format!("force_{n}"), throw, &outcome));
        }
        if n == 1 {
            let [native, liggghts] = &outcome.tracks;
            let frames = [&native.frames[..], &liggghts.frames];
            findings.moments = moments(&outcome.scene, frames, |k| native.time(k), 40);
        }
    }
    Ok(findings)
}

/// H12: so slow that the spheres are nearly rigid.
pub(super) fn rigid(directory: Option<&Path>) -> Result<Findings> {
    let (speed, friction) = (0.01, 0.1);
    let throw = Throw::plane("45 degrees, mu = 0.1, 0.01 m/s", [speed, speed], friction);
    let outcome = Outcome::of(&throw, "near-rigid".into(), directory)?;
    let mut findings = Findings { checks: checks(&throw, &outcome), ..Findings::default() };
    // Rigid spheres of equal mass exchange their speeds along the normal; the impulse mu m v across it brakes, and spins.
    let limit = [
        (Vec3::y() * (speed * (1.0 - friction)), "first"),
        (Vec3::new(speed, friction * speed, 0.0), "second"),
    ];
    for (id, (rigid, name)) in limit.into_iter().enumerate() {
        let [native, liggghts, _] = outcome.ends(id).map(|end| end.0);
        let apart = worst([native, liggghts].map(|v| (v - rigid).norm() / speed));
        let values = [native.y, liggghts.y, rigid.y].map(Some);
        let quantity = format!("velocity of the {name} sphere against rigid ones; shown: across (m/s)");
        findings.push(given(quantity, values, apart, 1e-4, RIGID));
    }
    let spin = -2.5 * friction * speed / RADIUS;
    let [native, liggghts, _] = outcome.ends(0).map(|end| Some(end.1.z));
    let values = [native, liggghts, Some(spin)];
    findings.push(relative("spin against rigid spheres (1/s)", values, Between::Theory, 1e-4, RIGID));
    Ok(findings)
}

/// Spheres that spin when they meet head-on: about axes across, and along the normal.
pub(super) fn spin(directory: Option<&Path>) -> Result<Findings> {
    // The surface of the first passes that of the second at 2 m/s.
    let turning = Vec3::z() * 4e3;
    let one = Throw {
        spins: [turning, Vec3::zeros()],
        ..Throw::plane("top spin of the first, mu = 0.1", [1.0, 0.0], 0.1)
    };
    let both = Throw {
        spins: [turning, turning],
        ..Throw::plane("the same spin of both, mu = 0.1", [1.0, 0.0], 0.1)
    };
    let mut findings = Findings::default();
    for (n, throw) in [one, both].iter().enumerate() {
        let outcome = Outcome::of(throw, format!("spin-{n}"), directory)?;
        findings.checks.extend(checks(throw, &outcome));
        findings.overlays.push(plot(&format!("force_{n}"), throw, &outcome));
    }
    let axial = Throw {
        spins: [Vec3::x() * 4e3, Vec3::x() * -1e3],
        ..Throw::plane("spin about the normal, mu = 0.1", [1.0, 0.0], 0.1)
    };
    let outcome = Outcome::of(&axial, "spin-axial".into(), directory)?;
    let spins = outcome.ends(0).map(|end| Some(end.1.x));
    let quantity = "spin about the normal of the first (1/s)";
    findings.push(relative(quantity, spins, Between::All, 1e-12, UNTOUCHED));
    Ok(findings)
}
