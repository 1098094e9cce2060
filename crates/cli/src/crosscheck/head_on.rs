//! The head-on impact without damping, and its trajectory.

use super::damped::{columns, depth, hertz, pairs};
use super::theory::{Damping, impact, lens_ratio};
use super::tools::{Between, OWN, RADIUS, SAME, Track, absolute, given, thinned, worst};
use super::{Findings, Overlay};
use std::path::Path;
use turbid::contact::ElasticLaw;
use turbid::error::Result;

/// Steps per duration of the impact.
const STEPS: usize = 200;

const RESTITUTION: &str = "absolute: leapfrog at 200 steps per contact loses 1.1e-6 where the contact begins and ends between \
                           two steps";
const SHAPE: &str =
    "relative, each to its own law: second order in the step, 1.3e-5 at 200 steps per contact";
const TRAJECTORY: &str = "largest difference of the positions at any step, in parts of the largest depth: the integrators are \
                          the same, and the volume law shifts the end of the contact by 6e-5";
const ROUNDING: &str = "largest difference of the positions at any step, in parts of the largest depth: law and integrator are \
                        the same, so rounding alone, 1e-12 of the depth per step";
const MOMENTUM: &str =
    "of the sum of the momenta over that at the start: rounding of equal and opposite kicks";

/// Largest difference of the positions of two tracks (m).
fn apart(tracks: &[Track; 2]) -> f64 {
    let frames = tracks[0].frames.iter().zip(&tracks[1].frames);
    let spheres = frames.flat_map(|(a, b)| a.iter().zip(b));
    worst(spheres.map(|(a, b)| (a.position() - b.position()).norm()))
}

/// H3 and H4: the first sphere hits the second, which is at rest.
pub(super) fn elastic(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for (laws, label) in [(SAME, "hertz"), (OWN, "volume")] {
        for speed in [1.0, 0.1] {
            let scene = pairs(format!("head-on-{label}-{speed}"), 1.0, laws, &[speed]);
            let hertz = hertz(&scene);
            let dt = hertz.duration(speed) / STEPS as f64;
            let tracks = scene.record(directory, dt, STEPS * 5 / 4, |_| false)?;

            let same = laws.0 == ElasticLaw::Hertz;
            let what = format!("{label} law, {speed} m/s");
            let of = |value: fn(f64, f64) -> f64| {
                let ends = tracks.each_ref().map(Track::last);
                let [native, liggghts] =
                    ends.map(|end| value(end[0].velocity[0], end[1].velocity[0]) / speed);
                [Some(native), Some(liggghts), Some(1.0)]
            };
            let quantity = format!("restitution, {what} (-)");
            let restitution = of(|first, second| second - first);
            findings.push(absolute(quantity, restitution, Between::Theory, 1e-5, RESTITUTION));
            let quantity = format!("momentum over that at the start, {what} (-)");
            let momentum = of(|first, second| first + second);
            findings.push(absolute(quantity, momentum, Between::Theory, 1e-14, MOMENTUM));

            let ratio = |depth| if same { 1.0 } else { lens_ratio([RADIUS; 2], depth) };
            let own = impact(&hertz, Damping::Tsuji(1.0), ratio, speed);
            let measured = [0, 1].map(|i| tracks[i].impact(|frame| depth(frame, 0)));
            let theory = [[own.duration, own.deepest], [hertz.duration(speed), hertz.deepest(speed)]];
            for (i, name) in [(0, "native"), (1, "LIGGGHTS")] {
                let what = format!("{what}, {name}");
                findings.checks.extend(columns(&what, i, measured[i], theory[i], 5e-5, SHAPE));
            }
            let difference = apart(&tracks) / hertz.deepest(speed);
            let last = |i: usize| Some(tracks[i].last()[1].position[0] - scene.particles[1].position[0]);
            let values = [last(0), last(1), None];
            let path = format!("path of the second sphere, {what} (m)");
            findings.push(given(&path, values, difference, 2e-4, TRAJECTORY));
            if same {
                let path = format!("{path}, bits");
                findings.push(given(path, values, difference, 1e-9, ROUNDING));
            }
            findings.overlays.push(trajectory(&tracks, &own, label, speed));
        }
    }
    Ok(findings)
}

/// The depth over time in all three ways.
fn trajectory(tracks: &[Track; 2], own: &super::theory::Impact, label: &str, speed: f64) -> Overlay {
    let curve = |track: &Track| {
        let points =
            (track.frames.iter().enumerate()).map(|(k, frame)| [track.time(k) * 1e6, depth(frame, 0) * 1e6]);
        thinned(points, 400)
    };
    let analytic = own.history.iter().map(|i| [i.time * 1e6, i.depth * 1e6]);
    Overlay::new(
        format!("depth_{label}_{speed}"),
        format!("Elastic head-on impact at {speed} m/s, {label} law"),
        ["time (us)", "depth (um)"],
        [("native", curve(&tracks[0])), ("LIGGGHTS", curve(&tracks[1])), ("theory", thinned(analytic, 400))],
    )
}
