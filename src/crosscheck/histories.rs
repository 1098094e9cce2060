//! The whole history of the force of damped impacts, under the same law in both engines.
//!
//! The law itself is held to rounding, at the depth and velocity that each engine has worked it out with:
//!
//! ```text
//! F = K d^(3/2) + sqrt(5) beta sqrt(m* K) d^(1/4) v
//! ```
//!
//! with `v` of the same moment in the native engine, and of half a step before in LIGGGHTS. So the histories differ by first order
//! in the step. Near the ends of the contact the force has an infinite slope over time, `d^(1/4)`, near the largest depth
//! over depth; so they are compared at equal depths in the shallower half and at equal times in the deeper half.

use super::damped::{STEPS, depth, hertz, pairs, plain};
use super::theory::{Damping, Hertz, Impact, dashpot, impact};
use super::tools::{Between, Judge, SAME, Track, thinned, worst};
use super::{Findings, Overlay};
use crate::error::Result;
use std::path::Path;

/// Speed of the first sphere (m/s).
const SPEED: f64 = 1.0;

const HISTORY: &str = "largest difference of the forces in parts of the peak, at equal times in the deeper half of the contact, at \
                       equal depths in the shallower: the dashpot of LIGGGHTS sees the velocity of half a step before, some \
                       5e-4 at 1000 steps per contact";
const LAW: &str = "largest difference, in parts of the peak, to the law at the depth and velocity that the engine has worked it out \
                   with, at every step: rounding of the positions, 1e-18 m of 1e-6 m, and at the ends its fourth root";
const END: &str =
    "between the engines, in steps: the contact ends between the same two steps or those beside";

/// A moment of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Instant {
    /// Depth (m).
    depth: f64,
    /// Force (N).
    force: f64,
}

/// The moments of a contact, one per step from the first in contact on, and the index of the deepest.
struct History {
    instants: Vec<Instant>,
    deepest: usize,
}

impl History {
    fn of(track: &Track) -> Self {
        let frames = (1..track.frames.len() - 1).map(|k| Instant {
            depth: depth(&track.frames[k], 0),
            force: track.force(k, 1).x,
        });
        let instants: Vec<Instant> = frames.take_while(|instant| instant.depth > 0.0).collect();
        let deepest = (0..instants.len()).max_by(|&a, &b| instants[a].depth.total_cmp(&instants[b].depth));
        Self {
            deepest: deepest.unwrap_or(0),
            instants,
        }
    }

    fn peak(&self) -> f64 {
        worst(self.instants.iter().map(|instant| instant.force))
    }

    /// The force at a depth (m), while it grows or while it shrinks: linear in the fourth root of the depth.
    fn at(&self, depth: f64, shrinking: bool) -> f64 {
        let root = |depth: f64| depth.sqrt().sqrt();
        let (before, after) = self.instants.split_at(self.deepest + 1);
        let mut branch: Vec<Instant> = if shrinking {
            after.iter().rev().copied().collect()
        } else {
            before.to_vec()
        };
        branch.insert(
            0,
            Instant {
                depth: 0.0,
                force: 0.0,
            },
        );
        let above = branch
            .partition_point(|instant| instant.depth < depth)
            .clamp(1, branch.len() - 1);
        let (a, b) = (branch[above - 1], branch[above]);
        let part = (root(depth) - root(a.depth)) / (root(b.depth) - root(a.depth));
        a.force + part * (b.force - a.force)
    }

    /// The largest difference to another history (N).
    fn apart(&self, other: &Self) -> f64 {
        let half = 0.5 * self.instants[self.deepest].depth;
        worst(self.instants.iter().enumerate().map(|(k, instant)| {
            let theirs = if instant.depth < half {
                other.at(instant.depth, k > self.deepest)
            } else {
                other.instants[k].force
            };
            (instant.force - theirs).abs()
        }))
    }
}

/// The largest difference of the forces of a track to the law, at their own depths and velocities (N).
fn off_law(track: &Track, hertz: &Hertz, e: f64, half_a_step_before: bool) -> f64 {
    let dashpot = dashpot(hertz, e);
    let speeds = |k: usize| {
        if half_a_step_before {
            return (depth(&track.frames[k], 0) - depth(&track.frames[k - 1], 0)) / track.dt;
        }
        track.frames[k][0].velocity[0] - track.frames[k][1].velocity[0]
    };
    let touching = (1..track.frames.len() - 1).filter(|&k| depth(&track.frames[k], 0) > 0.0);
    worst(touching.map(|k| {
        let depth = depth(&track.frames[k], 0);
        let force = hertz.force(depth) + dashpot * depth.sqrt().sqrt() * speeds(k);
        (track.force(k, 1).x - force).abs()
    }))
}

/// The whole history of the force under the law of LIGGGHTS.
pub(super) fn histories(directory: Option<&Path>) -> Result<Findings> {
    let judge = Judge("force-history");
    let mut findings = Findings::default();
    for e in [0.9, 0.7, 0.5] {
        let scene = pairs(format!("{}-{e}", judge.0), e, SAME, &[SPEED]);
        let hertz = hertz(&scene);
        let dt = hertz.duration(SPEED) / STEPS as f64;
        let tracks = scene.record(directory, dt, STEPS * 5 / 4, |_| false)?;
        let theory = impact(&hertz, Damping::Tsuji(e), plain, SPEED);
        let [native, liggghts] = [0, 1].map(|i| History::of(&tracks[i]));
        let peak = worst(theory.history.iter().map(|i| i.force));
        let peaks = [Some(native.peak()), Some(liggghts.peak()), Some(peak)];
        let apart = worst([native.apart(&liggghts), liggghts.apart(&native)]) / peak;
        let quantity = format!("whole history of the force, e = {e}; shown: peak (N)");
        findings
            .checks
            .push(judge.given(quantity, peaks, apart, 1e-3, HISTORY));
        let off = [
            off_law(&tracks[0], &hertz, e, false),
            off_law(&tracks[1], &hertz, e, true),
        ];
        let values = [Some(off[0] / peak), Some(off[1] / peak), Some(0.0)];
        let quantity = format!("force off the law at its own depth and velocity, e = {e} (-)");
        findings
            .checks
            .push(judge.given(quantity, values, worst(off) / peak, 1e-9, LAW));
        let ends = [0, 1].map(|i| tracks[i].impact(|frame| depth(frame, 0)).map(|m| m.duration / dt));
        let values = [ends[0], ends[1], Some(theory.duration / dt)];
        let quantity = format!("end of the contact, e = {e} (steps)");
        findings
            .checks
            .push(judge.absolute(quantity, values, Between::Engines, 1.0, 1.0, END));
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
    let overlay = |name: &str, x: &str, curves: [Vec<[f64; 2]>; 3]| Overlay {
        name: format!("{name}_{e}"),
        title: format!("Damped head-on impact at {SPEED} m/s, e = {e}"),
        axes: [x.into(), "force (N)".into()],
        logarithmic: [false; 2],
        curves: (["native", "LIGGGHTS", "theory"].map(String::from).into_iter())
            .zip(curves)
            .collect(),
    };
    [
        overlay(
            "time",
            "time (us)",
            [over_time(0), over_time(1), thinned(times, 500)],
        ),
        overlay(
            "depth",
            "depth (um)",
            [over_depth(0), over_depth(1), thinned(depths, 500)],
        ),
    ]
}
