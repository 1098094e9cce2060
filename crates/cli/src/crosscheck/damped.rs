//! Damped impacts: restitution, duration, depth.

use super::theory::{Damping, Hertz, Impact, impact, lens_ratio};
use super::tools::{
    Between, GLASS, Measured, OWN, RADIUS, SAME, Scene, Track, absolute, plane, relative, thinned,
};
use super::{Check, Findings, Overlay};
use std::path::Path;
use turbid::contact::{DampingLaw, ElasticLaw};
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::particle::Particle;

/// Steps per duration of the elastic impact (of the fastest pair).
pub(super) const STEPS: usize = 1000;

/// Speeds of the pairs of a scene (m/s); the step is that of the fastest.
const SPEEDS: [f64; 3] = [1.0, 0.1, 0.01];

const E: [f64; 5] = [0.95, 0.9, 0.8, 0.7, 0.5];

const SET: &str = "absolute, to what the law realises: first order in the step, at 1000 steps per contact 1e-5 at e = 0.8, 1e-4 \
                   at 0.5, a part of it from the last step";
const ENGINES: &str = "absolute, between the engines: first order in the step in both, at 1000 steps per contact 1e-4 at e = 0.5";
const DEFAULT_LAW: &str = "absolute, between the engines: Hunt-Crossley with the number of Carvalho and Martins realises e to \
                           1.7e-4 at e = 0.5 and better above, the rest is the step";
const COLUMN: &str =
    "relative, each to the integral of its own law: first order in the step, 3e-4 at 1000 steps per contact";
/// Tolerance of a coefficient of restitution at [`STEPS`].
fn tolerance(e: f64) -> f64 {
    if e > 0.5 { 2e-4 } else { 4e-4 }
}

/// Pairs of glass spheres, one for each speed; spheres `2 n` and `2 n + 1` touch.
pub(super) fn pairs(name: String, e: f64, laws: (ElasticLaw, DampingLaw), speeds: &[f64]) -> Scene {
    let mut scene = Scene::glass(name, e, 0.0, laws);
    for (n, &speed) in speeds.iter().enumerate() {
        let at = Vec3::new(4e-3, 2e-3 + 3e-3 * n as f64, 5e-3);
        scene.add(0, at, Vec3::x() * speed, Vec3::zeros());
        scene.add(0, at + Vec3::x() * (2.0 * RADIUS), Vec3::zeros(), Vec3::zeros());
    }
    scene
}

/// Depth of the overlap of a pair of [`pairs`] (m).
pub(super) fn depth(frame: &[Particle], pair: usize) -> f64 {
    2.0 * RADIUS - (frame[2 * pair + 1].position() - frame[2 * pair].position()).norm()
}

/// Speed of separation of a pair at the end, over `speed`.
fn restitution(track: &Track, pair: usize, speed: f64) -> f64 {
    (track.last()[2 * pair + 1].velocity[0] - track.last()[2 * pair].velocity[0]) / speed
}

/// Hertz's law of two spheres of a scene of [`pairs`].
pub(super) fn hertz(scene: &Scene) -> Hertz {
    Hertz::pair([scene.mass(0); 2], [RADIUS; 2], [&GLASS; 2])
}

/// Hertz's law is itself.
pub(super) fn plain(_: f64) -> f64 {
    1.0
}

/// H5: restitution over speeds, with both laws of the native engine.
pub(super) fn restitutions(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    let mut curves = vec![Vec::new(); 4];
    for e in E {
        let scene = pairs(format!("restitution-{e}"), e, SAME, &SPEEDS);
        let hertz = hertz(&scene);
        let dt = hertz.duration(SPEEDS[0]) / STEPS as f64;
        let slowest = hertz.duration(SPEEDS[2]) / dt;
        let parted = |frame: &[Particle]| (0..SPEEDS.len()).all(|pair| depth(frame, pair) < -1e-9);
        let steps = (slowest * 1.3) as usize;
        let [same, liggghts] = scene.record(directory, dt, steps, parted)?;
        let own_scene = pairs(String::new(), e, OWN, &SPEEDS);
        let own = own_scene.record_native(dt, steps, parted)?;
        for (pair, &speed) in SPEEDS.iter().enumerate() {
            let [same, own, liggghts] = [&same, &own, &liggghts].map(|t| Some(restitution(t, pair, speed)));
            let volume = |depth| lens_ratio([RADIUS; 2], depth);
            let realised = impact(&hertz, Damping::HuntCrossley(e), volume, speed).restitution;
            let what = |law: &str| format!("restitution, e = {e}, {speed} m/s, {law} (-)");
            let mut push = |quantity, values, between, reason| {
                let check = absolute(quantity, values, between, tolerance(e), reason);
                findings.push(check);
            };
            push(what("tsuji"), [same, liggghts, Some(e)], Between::Theory, SET);
            push(what("tsuji, engines"), [same, liggghts, None], Between::Engines, ENGINES);
            push(what("hunt_crossley"), [own, None, Some(realised)], Between::Theory, SET);
            push(what("hunt_crossley, engines"), [own, liggghts, None], Between::Engines, DEFAULT_LAW);
            if pair == 0 {
                for (curve, value) in curves.iter_mut().zip([same, liggghts, own, Some(realised)]) {
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
        names.iter().map(|name| (*name).to_owned()).zip(curves),
    ));
    Ok(findings)
}

/// Duration (s) and largest depth (m) of an impact in one engine against the column of its law.
pub(super) fn columns(
    what: &str,
    engine: usize,
    measured: Option<Measured>,
    theory: [f64; 2],
    tolerance: f64,
    reason: &str,
) -> [Check; 2] {
    let quantities = [format!("duration, {what} (s)"), format!("largest depth, {what} (m)")];
    let measured = [measured.map(|m| m.duration), measured.map(|m| m.deepest)];
    let check = |k: usize| {
        let mut values = [None, None, Some(theory[k])];
        values[engine] = measured[k];
        relative(&quantities[k], values, Between::Theory, tolerance, reason)
    };
    [check(0), check(1)]
}

/// Each engine against the integral of its own law.
fn own_laws(
    what: &str,
    tracks: [&Track; 3],
    theory: [&Impact; 2],
    depth: impl Fn(&[Particle]) -> f64,
) -> Vec<Check> {
    let ways = [(0, "native tsuji", 0), (1, "LIGGGHTS", 0), (0, "native hunt_crossley", 1)];
    let checks = ways.iter().zip(tracks).flat_map(|(&(engine, name, law), track)| {
        let theory = [theory[law].duration, theory[law].deepest];
        columns(&format!("{what}{name}"), engine, track.impact(&depth), theory, 3e-4, COLUMN)
    });
    checks.collect()
}

/// H6: duration and largest depth, each engine against the column of its own law.
pub(super) fn shapes(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for e in E {
        let scene = pairs(format!("duration-{e}"), e, SAME, &SPEEDS[..1]);
        let hertz = hertz(&scene);
        let dt = hertz.duration(SPEEDS[0]) / STEPS as f64;
        let parted = |frame: &[Particle]| depth(frame, 0) < -1e-9;
        let [same, liggghts] = scene.record(directory, dt, 2 * STEPS, parted)?;
        let own = pairs(String::new(), e, OWN, &SPEEDS[..1]).record_native(dt, 2 * STEPS, parted)?;
        let tsuji = impact(&hertz, Damping::Tsuji(e), plain, SPEEDS[0]);
        let volume = |depth| lens_ratio([RADIUS; 2], depth);
        let crossley = impact(&hertz, Damping::HuntCrossley(e), volume, SPEEDS[0]);
        let what = format!("e = {e}, ");
        let tracks = [&same, &liggghts, &own];
        findings.checks.extend(own_laws(&what, tracks, [&tsuji, &crossley], |frame| depth(frame, 0)));
    }
    Ok(findings)
}

/// H15: a sphere hits a wall.
pub(super) fn wall(directory: Option<&Path>) -> Result<Findings> {
    let (e, speed) = (0.8, 1.0);
    let scene = |laws| {
        let mut scene = Scene::glass("wall-impact", e, 0.0, laws);
        scene.walls.push(plane(2, 0.0, true, 0));
        scene.add(0, Vec3::new(5e-3, 5e-3, RADIUS), Vec3::z() * -speed, Vec3::zeros());
        scene
    };
    let depth = |frame: &[Particle]| RADIUS - frame[0].position[2];
    let same = scene(SAME);
    let hertz = Hertz::wall(same.mass(0), RADIUS, [&GLASS; 2]);
    let dt = hertz.duration(speed) / STEPS as f64;
    let parted = |frame: &[Particle]| depth(frame) < -1e-9;
    let tracks = same.record(directory, dt, 2 * STEPS, parted)?;
    let own = scene(OWN).record_native(dt, 2 * STEPS, parted)?;
    let tsuji = impact(&hertz, Damping::Tsuji(e), plain, speed);
    let cap = |depth| super::theory::cap_ratio(RADIUS, depth);
    let crossley = impact(&hertz, Damping::HuntCrossley(e), cap, speed);
    let mut findings = Findings::default();
    let after = |track: &Track| Some(track.last()[0].velocity[2] / speed);
    let values = [after(&tracks[0]), after(&tracks[1]), Some(e)];
    let quantity = format!("restitution, e = {e}, tsuji (-)");
    findings.push(absolute(quantity, values, Between::All, 2e-4, SET));
    let values = [after(&own), None, Some(crossley.restitution)];
    let quantity = format!("restitution, e = {e}, hunt_crossley (-)");
    findings.push(absolute(quantity, values, Between::Theory, 2e-4, SET));
    let all = [&tracks[0], &tracks[1], &own];
    findings.checks.extend(own_laws("", all, [&tsuji, &crossley], depth));
    let curve = |track: &Track| {
        let points = (0..track.frames.len() - 1).map(|k| [track.time(k) * 1e6, track.force(k, 0).z]);
        thinned(points, 500)
    };
    let theory = tsuji.history.iter().map(|i| [i.time * 1e6, i.force]);
    findings.overlays.push(Overlay::new(
        "force",
        format!("A sphere hits a wall at {speed} m/s, e = {e}"),
        ["time (us)", "force (N)"],
        [("native", curve(&tracks[0])), ("LIGGGHTS", curve(&tracks[1])), ("theory", thinned(theory, 500))],
    ));
    Ok(findings)
}
