//! Oblique impacts: gross sliding friction, spin, the limit of rigid spheres, and surfaces that stick.
//!
//! Where surfaces slide, both engines are compared with theory; where they stick, with each other.

use super::against::LIGGGHTS;
use super::prelude::*;
use super::theory::slide;
use std::f64::consts::PI;
use turbid::contact::{CohesionLaw, FrictionLaw, PairLaw, RollingLaw};

/// Steps per duration of the impact.
const STEPS: usize = 1000;

const VELOCITY: Limit =
    (1e-4, "worst of all three ways, over the speed of approach: OTHER first stretches a spring");
const SPIN: Limit =
    (2e-3, "worst of all three ways, over the gain of the second sphere: as for the velocities");
const FRICTIONLESS: Limit =
    (2e-5, "worst of all three ways, over the speed of approach: second order in the step");
const COULOMB: Limit =
    (1e-6, "absolute: with sliding from first to last touch, the sums are in the ratio mu");
const CONSERVED: Limit =
    (1e-12, "over the value at the start: rounding of some 1000 equal and opposite kicks");
const RIGID: Limit =
    (1e-4, "over the speed of approach: the spheres turn by an angle of d_max / 2R, 5e-5 here");
const STICKING: Limit = (1e-12, "over the speed of approach, worst of both spheres: the same law, rounding");
const ADHESIVE: Limit =
    (1e-9, "over the largest depth, worst of both spheres: rounding, 1e-12 of the depth per step");
const PARTING: Limit = (
    1e-3,
    "relative: LAMMPS lets go where the pull is largest, which takes 0.494 of the energy; steps at touch and parting",
);
const UNTOUCHED: Limit = (1e-12, "relative: nothing resists the turning about the normal in either engine");

/// Work of adhesion of the impacts with it (J/m^2).
const ADHESION: f64 = 100.0;

/// Coefficient of rolling friction (-) where a law reads it.
const ROLLING: f64 = 0.2;

/// A sphere that hits one at rest.
#[derive(Clone, Copy, Debug)]
struct Throw {
    what: &'static str,
    /// Unit vectors from the first to the second centre and across, and the velocity of the first sphere along both (m/s).
    normal: Vec3,
    across: Vec3,
    velocity: [f64; 2],
    spins: [Vec3; 2],
    friction: f64,
    restitution: f64,
    rolling: RollingLaw,
    /// Law of cohesion, and the density of its energy over Young's modulus (-) or the work of adhesion (J/m^2).
    cohesion: (CohesionLaw, f64),
    /// Law of friction of the native engine.
    law: FrictionLaw,
}

impl Throw {
    fn plane(what: &'static str, velocity: [f64; 2], friction: f64) -> Self {
        let (normal, across, spins) = (Vec3::x(), Vec3::y(), [Vec3::zeros(); 2]);
        let (restitution, rolling, cohesion) = (1.0, RollingLaw::None, (CohesionLaw::None, 0.0));
        let law = SAME.2;
        Self { what, normal, across, velocity, spins, friction, restitution, rolling, cohesion, law }
    }

    fn run(self, name: &str, against: &Against) -> Result<Outcome> {
        let mut system = glass(name, self.restitution, self.friction, (SAME.0, SAME.1, self.law));
        if let Some(contact) = &mut system.contact {
            contact.rolling = self.rolling;
            contact.pairs[0].rolling_friction = ROLLING;
            let (law, strength) = self.cohesion;
            contact.cohesion = law;
            contact.pairs[0].cohesion_density = strength * GLASS.youngs_modulus;
            contact.pairs[0].work_of_adhesion = strength;
        }
        let at = Vec3::repeat(5e-3);
        let velocity = self.normal * self.velocity[0] + self.across * self.velocity[1];
        let [spin, other] = self.spins.map(Into::into);
        add(&mut system, 0, at, velocity).angular_velocity = spin;
        add(&mut system, 0, at + self.normal * (2.0 * RADIUS), Vec3::zeros()).angular_velocity = other;
        let mass = mass(&system, 0);
        let hertz = Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2]);
        let dt = hertz.duration(self.velocity[0]) / STEPS as f64;
        let tracks = record(&system, against, dt, STEPS * 5 / 4)?;
        let start = [0, 1].map(|id| state(&system.particles[id]));
        let theory = slide(start, RADIUS, mass, &hertz, self.friction);
        let ends = [0, 1].map(|id| {
            let [native, other] = [0, 1].map(|i| state(&tracks[i].last()[id]));
            [native, other, theory[id]].map(|[_, velocity, spin]| [velocity, spin])
        });
        Ok(Outcome { throw: self, system, tracks, ends })
    }
}

struct Outcome {
    throw: Throw,
    system: Setup,
    /// Native, the other engine.
    tracks: [Track; 2],
    /// Velocity and spin at the end by sphere; native, the other engine, theory.
    ends: [[[Vec3; 2]; 3]; 2],
}

impl Outcome {
    /// Force on the first sphere along the normal, and its size across (N), at a frame of an engine.
    fn force(&self, engine: usize, frame: usize) -> [f64; 2] {
        let track = &self.tracks[engine];
        let [a, b] = [0, 1].map(|id| track.frames[frame][id].position());
        let normal = (b - a).normalize();
        let force = track.force(frame, 0);
        let along = force.dot(&normal);
        [along, (force - normal * along).norm()]
    }

    /// Impulses across and along the normal, `J_t / J_n`, in an engine.
    fn impulse_ratio(&self, engine: usize) -> f64 {
        let (mut across, mut along) = (0.0, 0.0);
        for frame in 0..self.tracks[engine].frames.len() {
            let [push, rub] = self.force(engine, frame);
            along += push.abs();
            across += rub;
        }
        across / along
    }

    /// Largest change of the sums of momentum and angular momentum over the values at the start, in an engine.
    fn drift(&self, engine: usize) -> f64 {
        let mass = mass(&self.system, 0);
        let middle = 0.5 * (self.system.particles[0].position() + self.system.particles[1].position());
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

    /// Checks that hold for every throw.
    fn check(&self, findings: &mut Findings) {
        let Throw { what, normal, across, velocity, spins, friction, .. } = self.throw;
        // Largest difference of the velocities (0) or the spins (1) between any two ways.
        let apart = |k: usize| {
            let pairs = [(0, 1), (0, 2), (1, 2)].into_iter();
            worst(pairs.flat_map(|(i, j)| self.ends.map(|end| (end[i][k] - end[j][k]).norm())))
        };
        let values = self.ends[0].map(|[v, _]| Some(v.dot(&across)));
        let limit = if friction > 0.0 { VELOCITY } else { FRICTIONLESS };
        let quantity = format!("velocities after, {what}; shown: v1 across (m/s)");
        findings.given(quantity, values, apart(0) / velocity[0], limit);
        if friction > 0.0 {
            let axis = normal.cross(&across);
            let gained = self.ends[1].map(|[_, spin]| (spin - spins[1]).dot(&axis));
            let quantity = format!("spins after, {what}; shown: gained by the second (1/s)");
            findings.given(quantity, gained.map(Some), apart(1) / gained[2].abs(), SPIN);
            let ratio = |engine| Some(self.impulse_ratio(engine) / friction);
            let quantity = format!("J_t / (mu J_n), {what} (-)");
            findings.compare(quantity, [ratio(0), ratio(1), Some(1.0)], Between::Theory, COULOMB);
        }
        let drifts = [0, 1].map(|engine| self.drift(engine));
        let quantity = format!("change of momentum and angular momentum, {what} (-)");
        findings.given(quantity, [drifts[0], drifts[1], 0.0].map(Some), worst(drifts), CONSERVED);
    }

    /// Force along and across the normal over time.
    fn plot(&self, findings: &mut Findings, name: &str) {
        let curve = |engine: usize, across: bool| {
            let track = &self.tracks[engine];
            let frames = (0..track.frames.len() - 1).step_by(4);
            frames.map(move |k| {
                let [along, size] = self.force(engine, k);
                [track.time(k) * 1e6, if across { size / self.throw.friction } else { -along }]
            })
        };
        findings.plot(
            name,
            format!("Gross sliding, {}", self.throw.what),
            ["time (us)", "force (N)"],
            [
                overlaid("native", curve(0, false)),
                measured("OTHER, along", curve(1, false)),
                overlaid("native", curve(0, true)),
                measured("OTHER, across / mu", curve(1, true)),
            ],
        );
    }
}

/// Several angles and coefficients of friction, in the plane and askew.
pub(super) fn sliding(against: &Against, findings: &mut Findings) -> Result<()> {
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
    for (n, throw) in throws.into_iter().enumerate() {
        let outcome = throw.run(&format!("sliding-{n}"), against)?;
        outcome.check(findings);
        if throw.friction > 0.0 {
            outcome.plot(findings, &format!("force_{n}"));
        }
        if n == 1 {
            let [native, other] = &outcome.tracks;
            let frames = [&native.frames[..], &other.frames];
            findings.moments = moments(&outcome.system.templates, frames, |k| native.time(k), 40);
        }
    }
    Ok(())
}

/// Angles at which surfaces stick for all or part of the impact; and resistance to rolling and cohesion, which an engine may have.
pub(super) fn sticking(against: &Against, findings: &mut Findings) -> Result<()> {
    // LAMMPS has the law of the native engine, too (`mindlin_rescale/force`), and YADE that without the shrinking of the spring.
    let law = if ["lammps", "yade"].contains(&against.name.id) { FrictionLaw::Mindlin } else { SAME.2 };
    let throw = |what, degrees: f64, restitution, rolling| {
        let plane = Throw::plane(what, [1.0, degrees.to_radians().tan()], 0.3);
        Throw { restitution, rolling, law, ..plane }
    };
    let mut throws = Vec::new();
    for (what, degrees) in
        [("5 degrees", 5.0), ("15 degrees", 15.0), ("25 degrees", 25.0), ("35 degrees", 35.0)]
    {
        throws.extend([1.0, 0.8].map(|restitution| throw(what, degrees, restitution, RollingLaw::None)));
    }
    if against.name == LIGGGHTS {
        let spins = [Vec3::z() * 4e3, Vec3::z() * -1e3];
        for (what, rolling) in [
            ("5 degrees, rolling, constant torque", RollingLaw::ConstantTorque),
            ("5 degrees, rolling, elastic-plastic torque", RollingLaw::ElasticPlastic),
        ] {
            throws.push(Throw { spins, ..throw(what, 5.0, 0.8, rolling) });
        }
        // A tenth of the largest elastic force.
        let cohesive = throw("15 degrees, cohesion by density", 15.0, 0.8, RollingLaw::None);
        throws.push(Throw { cohesion: (CohesionLaw::Sjkr, 0.002), ..cohesive });
    }
    if against.name.id == "lammps" {
        adhesive(against, findings)?;
    }
    for (n, throw) in throws.into_iter().enumerate() {
        let Outcome { tracks, .. } = throw.run(&format!("sticking-{n}"), against)?;
        let ends = tracks.each_ref().map(|track| [0, 1].map(|id| state(&track.last()[id])));
        let apart = |k: usize| worst([0, 1].map(|id| (ends[0][id][k] - ends[1][id][k]).norm()));
        let setting = format!("{}, mu 0.3, e {}", throw.what, throw.restitution);
        let [native, other] = ends.map(|ends| Some(ends[0][1].y));
        let quantity = format!("velocities after, {setting}; shown: v1 across (m/s)");
        findings.given(quantity, [native, other, None], apart(1), STICKING);
        let [native, other] = ends.map(|ends| Some(ends[1][2].z));
        let quantity = format!("spins after, {setting}; shown: of the second (1/s)");
        findings.given(quantity, [native, other, None], apart(2) * RADIUS, STICKING);
    }
    Ok(())
}

/// Head-on impacts of spheres with the adhesion of LAMMPS, whose necks take a fifteenth of the energy. LAMMPS lets go where the pull is largest, at `a^3 = 9 a_c^3` and
/// a gap of `3^(1/3) a_c^2 / R*`, the native engine where the neck cannot be longer, at `a_c` and `3 a_c^2 / R*`: so both are compared up to the first of these.
fn adhesive(against: &Against, findings: &mut Findings) -> Result<()> {
    for (law, label) in [(CohesionLaw::Dmt, "dmt"), (CohesionLaw::Jkr, "jkr")] {
        for restitution in [1.0, 0.8] {
            let throw = Throw::plane("head-on", [1.0, 0.0], 0.0);
            let throw = Throw { restitution, cohesion: (law, ADHESION), ..throw };
            let Outcome { tracks, system, .. } =
                throw.run(&format!("adhesive-{label}-{restitution}"), against)?;
            let stretch = system
                .contact
                .as_ref()
                .map_or(0.0, |model| PairLaw::new(model, 0, 0).cohesion.stretch(0.5 * RADIUS));
            let gap = |frame: &[Particle]| (frame[1].position() - frame[0].position()).norm() - 2.0 * RADIUS;
            // A little before 3^(1/3) / 3.
            let last = tracks[0].frames.iter().rposition(|frame| gap(frame) <= 0.47 * stretch).unwrap_or(0);
            let ends = tracks.each_ref().map(|track| [0, 1].map(|id| track.frames[last][id].position()));
            let apart = worst([0, 1].map(|id| (ends[0][id] - ends[1][id]).norm()));
            let [native, other] = tracks.each_ref().map(|track| Some(gap(&track.frames[last])));
            let deepest = tracks[0].frames.iter().map(|frame| -gap(frame)).fold(0.0, f64::max);
            let quantity =
                format!("paths, head-on, {label}, e {restitution}, until LAMMPS lets go; shown: gap (m)");
            findings.given(quantity, [native, other, None], apart / deepest, ADHESIVE);
            if law == CohesionLaw::Jkr && restitution >= 1.0 {
                let speeds = tracks
                    .each_ref()
                    .map(|track| track.last()[1].velocity().x - track.last()[0].velocity().x);
                // Energy over pi w a_c^2 from touch to u^3 = 1 and to u^3 = 3, with a = u^2 a_c: the integral of (u^3 - u^6 / 6) d(u^4 - 4 u).
                let square = stretch * 0.5 * RADIUS / 3.0;
                let of =
                    |cube: f64| (2.0 / 3.0 * cube * cube - cube - cube * cube * cube / 15.0) * cube.cbrt();
                let theory = [1.0, 3.0].map(|end| {
                    let work = PI * ADHESION * square * (of(4.0) - of(end));
                    (1.0 - 4.0 * work / mass(&system, 0)).sqrt()
                });
                let apart = worst([0, 1].map(|k| speeds[k] / theory[k] - 1.0));
                let quantity =
                    "head-on impact, jkr, each engine against its own theory; shown: speed after (m/s)";
                findings.given(quantity, [Some(speeds[0]), Some(speeds[1]), Some(theory[0])], apart, PARTING);
            }
        }
    }
    Ok(())
}

/// So slow that the spheres are nearly rigid.
pub(super) fn rigid(against: &Against, findings: &mut Findings) -> Result<()> {
    let (speed, friction) = (0.01, 0.1);
    let throw = Throw::plane("45 degrees, mu = 0.1, 0.01 m/s", [speed, speed], friction);
    let outcome = throw.run("near-rigid", against)?;
    outcome.check(findings);
    // Rigid spheres of equal mass exchange their speeds along the normal; the impulse mu m v across it brakes, and spins.
    let limit = [
        (Vec3::y() * (speed * (1.0 - friction)), "first"),
        (Vec3::new(speed, friction * speed, 0.0), "second"),
    ];
    for (id, (rigid, name)) in limit.into_iter().enumerate() {
        let [native, other, _] = outcome.ends[id].map(|[velocity, _]| velocity);
        let apart = worst([native, other].map(|v| (v - rigid).norm() / speed));
        let quantity = format!("velocity of the {name} sphere against rigid ones; shown: across (m/s)");
        findings.given(quantity, [native.y, other.y, rigid.y].map(Some), apart, RIGID);
    }
    let [native, other, _] = outcome.ends[0].map(|[_, spin]| spin.z);
    let values = [native, other, -2.5 * friction * speed / RADIUS].map(Some);
    findings.compare_relative("spin against rigid spheres (1/s)", values, Between::Theory, RIGID);
    Ok(())
}

/// Spheres that spin when they meet head-on: about axes across, and along the normal.
pub(super) fn spin(against: &Against, findings: &mut Findings) -> Result<()> {
    let spinning = |what, spins: [Vec3; 2]| Throw { spins, ..Throw::plane(what, [1.0, 0.0], 0.1) };
    // The surface of the first passes that of the second at 2 m/s.
    let turning = Vec3::z() * 4e3;
    for (n, throw) in [
        spinning("top spin of the first, mu = 0.1", [turning, Vec3::zeros()]),
        spinning("the same spin of both, mu = 0.1", [turning; 2]),
    ]
    .into_iter()
    .enumerate()
    {
        let outcome = throw.run(&format!("spin-{n}"), against)?;
        outcome.check(findings);
        outcome.plot(findings, &format!("force_{n}"));
    }
    let axial = spinning("spin about the normal, mu = 0.1", [Vec3::x() * 4e3, Vec3::x() * -1e3]);
    let spins = axial.run("spin-axial", against)?.ends[0].map(|[_, spin]| Some(spin.x));
    let quantity = "spin about the normal of the first (1/s)";
    findings.compare_relative(quantity, spins, Between::All, UNTOUCHED);
    Ok(())
}
