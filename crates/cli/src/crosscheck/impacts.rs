//! Head-on impacts of glass spheres on others at rest and on a wall, elastic and damped, under both laws of the native engine.
//!
//! The force of the damped law is held to rounding, at the depth and velocity `v` (half a step before) that each engine has
//! worked it out with:
//!
//! ```text
//! F = K d^(3/2) + sqrt(5) beta sqrt(m* K) d^(1/4) v
//! ```

use super::compare::{Between, Limit, Points, overlay, thinned, worst};
use super::system::{GLASS, Laws, OWN, RADIUS, SAME, System, Track, plane, sphere};
use super::theory::{Damping, Hertz, Impact, cap_ratio, dashpot, impact, lens_ratio};
use crate::checks::Findings;
use std::path::Path;
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::output::Overlay;
use turbid::particle::Particle;

/// Steps per duration of an elastic and of a damped impact (of the fastest spheres).
const ELASTIC_STEPS: usize = 200;
const STEPS: usize = 1000;

/// Speeds (m/s) and coefficients of restitution of damped impacts.
const SPEEDS: [f64; 3] = [1.0, 0.1, 0.01];
const E: [f64; 5] = [0.95, 0.9, 0.8, 0.7, 0.5];

const ELASTIC: Limit = (
    1e-5,
    "absolute: leapfrog at 200 steps per contact loses 1.1e-6 where the contact begins and ends between two steps",
);
const ELASTIC_SHAPE: Limit =
    (5e-5, "relative, each to its own law: second order in the step, 1.3e-5 at 200 steps per contact");
const TRAJECTORY: Limit = (
    2e-4,
    "largest difference of the positions at any step, in parts of the largest depth: the integrators are the same, and the \
     volume law shifts the end of the contact by 6e-5",
);
const ROUNDING: Limit = (
    1e-9,
    "largest difference of the positions at any step, in parts of the largest depth: law and integrator are the same, so \
     rounding alone, 1e-12 of the depth per step",
);
const MOMENTUM: Limit =
    (1e-14, "of the sum of the momenta over that at the start: rounding of equal and opposite kicks");
const SET: &str = "absolute, to what the law realises: first order in the step, at 1000 steps per contact 1e-5 at e = 0.8, 1e-4 \
                   at 0.5, a part of it from the last step";
const ENGINES: &str = "absolute, between the engines: first order in the step in both, at 1000 steps per contact 1e-4 at e = 0.5";
const DEFAULT_LAW: &str = "absolute, between the engines: Hunt-Crossley with the number of Carvalho and Martins realises e to \
                           1.7e-4 at e = 0.5 and better above, the rest is the step";
const SHAPE: Limit = (
    3e-4,
    "relative, each to the integral of its own law: first order in the step, 3e-4 at 1000 steps per contact",
);
const HISTORY: Limit = (
    1e-9,
    "largest difference of the forces at equal times, in parts of the peak: the same law, integrator and velocity; \
     rounding of the positions, 1e-18 m of 1e-6 m, grows with the fourth root of the depth at the ends",
);
const LAW: Limit = (
    1e-9,
    "largest difference, in parts of the peak, to the law at the depth and velocity that the engine has worked it out \
     with, at every step: rounding of the positions, 1e-18 m of 1e-6 m, and at the ends its fourth root",
);
const END: Limit =
    (1.0, "between the engines, in steps: the contact ends between the same two steps or those beside");

/// Engine, name and law (as in [`HeadOn::theory`]) of the tracks of [`HeadOn::record`].
const WAYS: [(usize, &str, usize); 3] =
    [(0, "native tsuji", 0), (1, "LIGGGHTS", 0), (0, "native hunt_crossley", 1)];

/// Spheres that hit others at rest, or a wall, each at one of these speeds (m/s).
struct HeadOn {
    name: String,
    restitution: f64,
    speeds: Vec<f64>,
    wall: bool,
    /// Steps per duration of the elastic impact at the first speed.
    steps: usize,
}

impl HeadOn {
    /// A pair of spheres for each speed; spheres `2 n` and `2 n + 1` touch.
    fn pairs(name: String, restitution: f64, speeds: &[f64], steps: usize) -> Self {
        Self { name, restitution, speeds: speeds.to_vec(), wall: false, steps }
    }

    fn system(&self, laws: Laws) -> System {
        let mut system = System::glass(&self.name, self.restitution, 0.0, laws);
        if self.wall {
            system.walls.push(plane(2, 0.0, true));
            system.add(0, Vec3::new(5e-3, 5e-3, RADIUS), Vec3::z() * -self.speeds[0], Vec3::zeros());
            return system;
        }
        for (n, &speed) in self.speeds.iter().enumerate() {
            let at = Vec3::new(4e-3, 2e-3 + 3e-3 * n as f64, 5e-3);
            system.add(0, at, Vec3::x() * speed, Vec3::zeros());
            system.add(0, at + Vec3::x() * (2.0 * RADIUS), Vec3::zeros(), Vec3::zeros());
        }
        system
    }

    fn hertz(&self) -> Hertz {
        let mass = sphere(RADIUS, 0).mass();
        if self.wall {
            return Hertz::wall(mass, RADIUS, [&GLASS; 2]);
        }
        Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2])
    }

    /// Depth of the overlap at the impact with this index (m).
    fn depth(&self, frame: &[Particle], n: usize) -> f64 {
        if self.wall {
            return RADIUS - frame[0].position[2];
        }
        2.0 * RADIUS - (frame[2 * n + 1].position() - frame[2 * n].position()).norm()
    }

    /// Speed of separation at the end over that of approach.
    fn rebound(&self, track: &Track, n: usize) -> f64 {
        let last = track.last();
        if self.wall {
            return last[0].velocity[2] / self.speeds[0];
        }
        (last[2 * n + 1].velocity[0] - last[2 * n].velocity[0]) / self.speeds[n]
    }

    /// Native engine with the law of LIGGGHTS, LIGGGHTS, native engine with its own law, each over so many durations of the slowest
    /// elastic impact, or until all are over.
    fn record(&self, directory: Option<&Path>, durations: f64, until_over: bool) -> Result<[Track; 3]> {
        let hertz = self.hertz();
        let dt = hertz.duration(self.speeds[0]) / self.steps as f64;
        let steps = match &self.speeds[..] {
            [_] => self.steps as f64,
            [.., slowest] => hertz.duration(*slowest) / dt,
            [] => 0.0,
        };
        let steps = (steps * durations) as usize;
        let over =
            |frame: &[Particle]| until_over && (0..self.speeds.len()).all(|n| self.depth(frame, n) < -1e-9);
        let [native, liggghts] = self.system(SAME).record(directory, dt, steps, over)?;
        Ok([native, liggghts, self.system(OWN).record_native(dt, steps, over)?])
    }

    /// The integral of the law of LIGGGHTS (0) or of that of the native engine (1).
    fn theory(&self, law: usize, speed: f64) -> Impact {
        let damping = [Damping::Tsuji, Damping::HuntCrossley][law](self.restitution);
        let ratio = |depth| match (law, self.wall) {
            (0, _) => 1.0,
            (_, false) => lens_ratio([RADIUS; 2], depth),
            (_, true) => cap_ratio(RADIUS, depth),
        };
        impact(&self.hertz(), damping, ratio, speed)
    }
}

/// Duration (s) and largest depth (m) of the first impact in one engine against theory.
fn shape(
    findings: &mut Findings,
    what: &str,
    case: &HeadOn,
    (engine, track): (usize, &Track),
    theory: [f64; 2],
    limit: Limit,
) {
    let measured = track.impact(|frame| case.depth(frame, 0));
    for (k, quantity) in ["duration", "largest depth"].into_iter().enumerate() {
        let mut values = [None, None, Some(theory[k])];
        values[engine] = measured.map(|measured| measured[k]);
        let quantity = format!("{quantity}, {what} ({})", ["s", "m"][k]);
        findings.compare_relative(quantity, values, Between::Theory, limit);
    }
}

/// Each engine against the integral of its own law.
fn own_laws(findings: &mut Findings, what: &str, case: &HeadOn, tracks: &[Track; 3], theory: [&Impact; 2]) {
    for ((engine, name, law), track) in WAYS.into_iter().zip(tracks) {
        let Impact { duration, deepest, .. } = *theory[law];
        shape(findings, &format!("{what}{name}"), case, (engine, track), [duration, deepest], SHAPE);
    }
}

/// Impacts without damping: restitution, momentum, duration, depth and path.
pub(super) fn elastic(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for (law, label) in ["hertz", "volume"].into_iter().enumerate() {
        for speed in [1.0, 0.1] {
            let case = HeadOn::pairs(format!("head-on-{label}-{speed}"), 1.0, &[speed], ELASTIC_STEPS);
            let [same, liggghts, own] = case.record(directory, 1.25, false)?;
            let tracks = [if law == 0 { same } else { own }, liggghts];
            let what = format!("{label} law, {speed} m/s");
            let rebounds = tracks.each_ref().map(|track| Some(case.rebound(track, 0)));
            let values = [rebounds[0], rebounds[1], Some(1.0)];
            findings.compare(format!("restitution, {what} (-)"), values, Between::Theory, ELASTIC);
            let sum = |track: &Track| track.last().iter().map(|p| p.velocity[0]).sum::<f64>() / speed;
            let values = [sum(&tracks[0]), sum(&tracks[1]), 1.0].map(Some);
            let quantity = format!("momentum over that at the start, {what} (-)");
            findings.compare(quantity, values, Between::Theory, MOMENTUM);

            let (hertz, own) = (case.hertz(), case.theory(law, speed));
            let theory = [[own.duration, own.deepest], [hertz.duration(speed), hertz.deepest(speed)]];
            for (i, name) in ["native", "LIGGGHTS"].into_iter().enumerate() {
                let track = (i, &tracks[i]);
                shape(&mut findings, &format!("{what}, {name}"), &case, track, theory[i], ELASTIC_SHAPE);
            }
            let frames = tracks[0].frames.iter().zip(&tracks[1].frames);
            let spheres = frames.flat_map(|(a, b)| a.iter().zip(b));
            let apart = worst(spheres.map(|(a, b)| (a.position() - b.position()).norm()));
            let difference = apart / hertz.deepest(speed);
            let path = |track: &Track| Some(track.last()[1].position[0] - track.frames[0][1].position[0]);
            let values = [path(&tracks[0]), path(&tracks[1]), None];
            let quantity = format!("path of the second sphere, {what} (m)");
            findings.given(&quantity, values, difference, TRAJECTORY);
            if law == 0 {
                findings.given(format!("{quantity}, bits"), values, difference, ROUNDING);
            }
            let curve = |track: &Track| {
                let frames = track.frames.iter().enumerate();
                thinned(frames.map(|(k, frame)| [track.time(k) * 1e6, case.depth(frame, 0) * 1e6]), 400)
            };
            let analytic = own.history.iter().map(|i| [i.time * 1e6, i.depth * 1e6]);
            findings.overlays.push(overlay(
                format!("depth_{label}_{speed}"),
                format!("Elastic head-on impact at {speed} m/s, {label} law"),
                ["time (us)", "depth (um)"],
                tracks.each_ref().map(curve),
                Some(("theory", thinned(analytic, 400))),
            ));
        }
    }
    Ok(findings)
}

/// Restitution over speeds, with both laws of the native engine.
pub(super) fn restitutions(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    let mut curves = vec![Vec::new(); 4];
    for e in E {
        let case = HeadOn::pairs(format!("restitution-{e}"), e, &SPEEDS, STEPS);
        let tracks = case.record(directory, 1.3, true)?;
        let tolerance = if e > 0.5 { 2e-4 } else { 4e-4 };
        for (n, &speed) in SPEEDS.iter().enumerate() {
            let [same, liggghts, own] = tracks.each_ref().map(|track| Some(case.rebound(track, n)));
            let realised = Some(case.theory(1, speed).restitution);
            for (law, values, between, reason) in [
                ("tsuji", [same, liggghts, Some(e)], Between::Theory, SET),
                ("tsuji, engines", [same, liggghts, None], Between::Engines, ENGINES),
                ("hunt_crossley", [own, None, realised], Between::Theory, SET),
                ("hunt_crossley, engines", [own, liggghts, None], Between::Engines, DEFAULT_LAW),
            ] {
                let quantity = format!("restitution, e = {e}, {speed} m/s, {law} (-)");
                findings.compare(quantity, values, between, (tolerance, reason));
            }
            if n == 0 {
                for (curve, value) in curves.iter_mut().zip([same, liggghts, own, realised]) {
                    curve.extend(value.map(|value| [e, value - e]));
                }
            }
        }
    }
    let names = ["native, tsuji", "LIGGGHTS", "native, hunt_crossley", "hunt_crossley, theory"];
    findings.overlays.push(Overlay::new(
        "off",
        format!("Restitution measured less that set, {STEPS} steps per contact, 1 m/s"),
        ["restitution set", "measured less set"],
        names.into_iter().zip(curves),
    ));
    Ok(findings)
}

/// Duration and largest depth, each engine against the integral of its own law.
pub(super) fn shapes(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for e in E {
        let case = HeadOn::pairs(format!("duration-{e}"), e, &SPEEDS[..1], STEPS);
        let tracks = case.record(directory, 2.0, true)?;
        let [tsuji, crossley] = [0, 1].map(|law| case.theory(law, SPEEDS[0]));
        own_laws(&mut findings, &format!("e = {e}, "), &case, &tracks, [&tsuji, &crossley]);
    }
    Ok(findings)
}

/// A sphere hits a wall.
pub(super) fn wall(directory: Option<&Path>) -> Result<Findings> {
    let (e, speed) = (0.8, 1.0);
    let case =
        HeadOn { name: "wall-impact".into(), restitution: e, speeds: vec![speed], wall: true, steps: STEPS };
    let tracks = case.record(directory, 2.0, true)?;
    let [tsuji, crossley] = [0, 1].map(|law| case.theory(law, speed));
    let mut findings = Findings::default();
    let [same, liggghts, own] = tracks.each_ref().map(|track| Some(case.rebound(track, 0)));
    let limit = (2e-4, SET);
    let values = [same, liggghts, Some(e)];
    findings.compare(format!("restitution, e = {e}, tsuji (-)"), values, Between::All, limit);
    let values = [own, None, Some(crossley.restitution)];
    findings.compare(format!("restitution, e = {e}, hunt_crossley (-)"), values, Between::Theory, limit);
    own_laws(&mut findings, "", &case, &tracks, [&tsuji, &crossley]);
    let curve = |track: &Track| {
        let frames = 0..track.frames.len() - 1;
        thinned(frames.map(|k| [track.time(k) * 1e6, track.force(k, 0).z]), 500)
    };
    let theory = tsuji.history.iter().map(|i| [i.time * 1e6, i.force]);
    findings.overlays.push(overlay(
        "force",
        format!("A sphere hits a wall at {speed} m/s, e = {e}"),
        ["time (us)", "force (N)"],
        [curve(&tracks[0]), curve(&tracks[1])],
        Some(("theory", thinned(theory, 500))),
    ));
    Ok(findings)
}

/// The whole history of the force of damped impacts under the law of LIGGGHTS in both engines.
pub(super) fn histories(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for e in [0.9, 0.7, 0.5] {
        let speed = SPEEDS[0];
        let case = HeadOn::pairs(format!("force-history-{e}"), e, &[speed], STEPS);
        let [native, liggghts, _] = case.record(directory, 1.25, false)?;
        let tracks = [native, liggghts];
        let theory = case.theory(0, speed);
        let peak = worst(theory.history.iter().map(|i| i.force));
        let steps = 1..tracks[0].frames.len() - 1;
        let force = |i: usize, k: usize| tracks[i].force(k, 1).x;
        let apart = worst(steps.clone().map(|k| (force(0, k) - force(1, k)).abs()));
        let peaks = [0, 1].map(|i| worst(steps.clone().map(|k| force(i, k))));
        let values = [peaks[0], peaks[1], peak].map(Some);
        let quantity = format!("whole history of the force, e = {e}; shown: peak (N)");
        findings.given(quantity, values, apart / peak, HISTORY);

        let (hertz, dashpot) = (case.hertz(), dashpot(&case.hertz(), e));
        let depth = |i: usize, k: usize| case.depth(&tracks[i].frames[k], 0);
        let off_law = |i: usize| {
            let touching = (1..tracks[i].frames.len() - 1).filter(|&k| depth(i, k) > 0.0);
            worst(touching.map(|k| {
                let (d, v) = (depth(i, k), (depth(i, k) - depth(i, k - 1)) / tracks[i].dt);
                (force(i, k) - (hertz.force(d) + dashpot * d.sqrt().sqrt() * v)).abs()
            }))
        };
        let off = [0, 1].map(off_law);
        let values = [off[0] / peak, off[1] / peak, 0.0].map(Some);
        let quantity = format!("force off the law at its own depth and velocity, e = {e} (-)");
        findings.given(quantity, values, worst(off) / peak, LAW);
        let end = |i: usize| {
            let [duration, _] = tracks[i].impact(|frame| case.depth(frame, 0))?;
            Some(duration / tracks[i].dt)
        };
        let values = [end(0), end(1), Some(theory.duration / tracks[0].dt)];
        findings.compare(format!("end of the contact, e = {e} (steps)"), values, Between::Engines, END);

        let curve = |i: usize, x: &dyn Fn(usize) -> f64| -> Points {
            let touching = (0..tracks[i].frames.len() - 1).filter(|&k| depth(i, k) >= 0.0);
            thinned(touching.map(|k| [x(k) * 1e6, force(i, k)]), 500)
        };
        let over_time = [0, 1].map(|i| curve(i, &|k| tracks[i].time(k)));
        let over_depth = [0, 1].map(|i| curve(i, &|k| depth(i, k)));
        let [times, depths]: [Points; 2] = [
            theory.history.iter().map(|i| [i.time * 1e6, i.force]).collect(),
            theory.history.iter().map(|i| [i.depth * 1e6, i.force]).collect(),
        ];
        for (name, x, engines, analytic) in
            [("time", "time (us)", over_time, times), ("depth", "depth (um)", over_depth, depths)]
        {
            let title = format!("Damped head-on impact at {speed} m/s, e = {e}");
            let analytic = Some(("theory", thinned(analytic, 500)));
            findings.overlays.push(overlay(
                format!("{name}_{e}"),
                title,
                [x, "force (N)"],
                engines,
                analytic,
            ));
        }
    }
    Ok(findings)
}
