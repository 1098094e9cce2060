//! The whole history of the force of damped impacts, under the same law in both engines.
//!
//! The law itself is held to rounding, at the depth and velocity that each engine has worked it out with:
//!
//! ```text
//! F = K d^(3/2) + sqrt(5) beta sqrt(m* K) d^(1/4) v
//! ```
//!
//! with the velocity `v` of half a step before, in both engines. So are the histories to each other, at equal times.

use super::damped::{STEPS, depth, hertz, pairs, plain};
use super::theory::{Damping, Hertz, Impact, dashpot, impact};
use super::tools::{Between, SAME, Track, absolute, given, thinned, worst};
use super::{Findings, Overlay};
use std::path::Path;
use turbid::error::Result;

/// Speed of the first sphere (m/s).
const SPEED: f64 = 1.0;

const HISTORY: &str = "largest difference of the forces at equal times, in parts of the peak: the same law, integrator and velocity; \
                       rounding of the positions, 1e-18 m of 1e-6 m, grows with the fourth root of the depth at the ends";
const LAW: &str = "largest difference, in parts of the peak, to the law at the depth and velocity that the engine has worked it out \
                   with, at every step: rounding of the positions, 1e-18 m of 1e-6 m, and at the ends its fourth root";
const END: &str =
    "between the engines, in steps: the contact ends between the same two steps or those beside";

/// The largest difference of the forces of two tracks at equal times, and the largest force of each (N).
fn apart(tracks: &[Track; 2]) -> (f64, [f64; 2]) {
    let steps = 1..tracks[0].frames.len() - 1;
    let force = |i: usize, k: usize| tracks[i].force(k, 1).x;
    let apart = worst(steps.clone().map(|k| (force(0, k) - force(1, k)).abs()));
    (apart, [0, 1].map(|i| worst(steps.clone().map(|k| force(i, k)))))
}

/// The largest difference of the forces of a track to the law, at their own depths and velocities (N).
fn off_law(track: &Track, hertz: &Hertz, e: f64) -> f64 {
    let dashpot = dashpot(hertz, e);
    let speeds = |k: usize| (depth(&track.frames[k], 0) - depth(&track.frames[k - 1], 0)) / track.dt;
    let touching = (1..track.frames.len() - 1).filter(|&k| depth(&track.frames[k], 0) > 0.0);
    worst(touching.map(|k| {
        let depth = depth(&track.frames[k], 0);
        let force = hertz.force(depth) + dashpot * depth.sqrt().sqrt() * speeds(k);
        (track.force(k, 1).x - force).abs()
    }))
}

/// The whole history of the force under the law of LIGGGHTS.
pub(super) fn histories(directory: Option<&Path>) -> Result<Findings> {
    let mut findings = Findings::default();
    for e in [0.9, 0.7, 0.5] {
        let scene = pairs(format!("force-history-{e}"), e, SAME, &[SPEED]);
        let hertz = hertz(&scene);
        let dt = hertz.duration(SPEED) / STEPS as f64;
        let tracks = scene.record(directory, dt, STEPS * 5 / 4, |_| false)?;
        let theory = impact(&hertz, Damping::Tsuji(e), plain, SPEED);
        let (apart, [native, liggghts]) = apart(&tracks);
        let peak = worst(theory.history.iter().map(|i| i.force));
        let peaks = [Some(native), Some(liggghts), Some(peak)];
        let quantity = format!("whole history of the force, e = {e}; shown: peak (N)");
        findings.push(given(quantity, peaks, apart / peak, 1e-9, HISTORY));
        let off = [0, 1].map(|i| off_law(&tracks[i], &hertz, e));
        let values = [Some(off[0] / peak), Some(off[1] / peak), Some(0.0)];
        let quantity = format!("force off the law at its own depth and velocity, e = {e} (-)");
        findings.push(given(quantity, values, worst(off) / peak, 1e-9, LAW));
        let ends = [0, 1].map(|i| tracks[i].impact(|frame| depth(frame, 0)).map(|m| m.duration / dt));
        let values = [ends[0], ends[1], Some(theory.duration / dt)];
        let quantity = format!("end of the contact, e = {e} (steps)");
        findings.push(absolute(quantity, values, Between::Engines, 1.0, END));
        findings.overlays.extend(plots(&tracks, &theory, e));
    }
    Ok(findings)
}

/// Force over time and over depth.
fn plots(tracks: &[Track; 2], theory: &Impact, e: f64) -> [Overlay; 2] {
    let points = |i: usize, x: &dyn Fn(usize) -> f64| {
        let last = tracks[i].frames.len() - 1;
        let touching = (0..last).filter(|&k| depth(&tracks[i].frames[k], 0) >= 0.0);
        thinned(touching.map(|k| [x(k) * 1e6, tracks[i].force(k, 1).x]), 500)
    };
    let over_time = |i: usize| points(i, &|k| tracks[i].time(k));
    let over_depth = |i: usize| points(i, &|k| depth(&tracks[i].frames[k], 0));
    let times = theory.history.iter().map(|i| [i.time * 1e6, i.force]);
    let depths = theory.history.iter().map(|i| [i.depth * 1e6, i.force]);
    let overlay = |name: &str, x: &str, curves: [Vec<[f64; 2]>; 3]| {
        Overlay::new(
            format!("{name}_{e}"),
            format!("Damped head-on impact at {SPEED} m/s, e = {e}"),
            [x, "force (N)"],
            (["native", "LIGGGHTS", "theory"].map(String::from).into_iter()).zip(curves),
        )
    };
    [
        overlay("time", "time (us)", [over_time(0), over_time(1), thinned(times, 500)]),
        overlay("depth", "depth (um)", [over_depth(0), over_depth(1), thinned(depths, 500)]),
    ]
}
