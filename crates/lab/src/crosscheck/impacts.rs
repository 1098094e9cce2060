//! Head-on impacts of glass spheres on others at rest and on a wall, elastic and damped, under both laws of the native engine.

use super::prelude::*;
use super::theory::{Damping, Impact, Instant, cap_ratio, dashpot, impact, lens_ratio};

/// Steps per duration of an elastic impact; of a damped one, at the largest of its [`SPEEDS`].
const ELASTIC_STEPS: f64 = 200.0;
const STEPS: f64 = 1000.0;

/// Speeds (m/s) and coefficients of restitution of damped impacts.
const SPEEDS: [f64; 3] = [1.0, 0.1, 0.01];
const E: [f64; 5] = [0.95, 0.9, 0.8, 0.7, 0.5];

const ELASTIC: Limit = (1e-5, "absolute: leapfrog loses 1.1e-6 where a contact begins and ends");
const ELASTIC_SHAPE: Limit = (5e-5, "relative, to its own law: second order in the step, 1.3e-5");
const TRAJECTORY: Limit = (2e-4, "over the largest depth: the volume law shifts the end by 6e-5");
const ROUNDING: Limit = (1e-9, "over the largest depth: rounding, 1e-12 of the depth per step");
const MOMENTUM: Limit = (1e-14, "over that at the start: rounding of equal and opposite kicks");
const SET: &str = "absolute, to the value that the law realises: first order in the step, 1e-4 at e = 0.5";
const ENGINES: &str = "absolute, between the engines: first order in the step, 1e-4 at e = 0.5";
const DEFAULT_LAW: &str = "absolute: the law of Carvalho and Martins realises e to 1.7e-4 at e = 0.5";
const SHAPE: Limit = (3e-4, "relative, to the integral of its own law: first order in the step");
const HISTORY: Limit = (1e-9, "at equal times, over the peak: rounding of positions, 1e-18 m of 1e-6 m");
const LAW: Limit = (1e-9, "to the law, over the peak: rounding of positions, 1e-18 m of 1e-6 m");
const END: Limit = (1.0, "between the engines: the same step, or one beside it");

/// A sphere that hits one at rest, or a wall.
struct HeadOn {
    name: String,
    restitution: f64,
    speed: f64,
    wall: bool,
    dt: f64,
    /// Recorded time over the duration of the elastic impact.
    durations: f64,
}

fn hertz(wall: bool) -> Hertz {
    let mass = sphere(RADIUS, 0).mass();
    if wall {
        return Hertz::wall(mass, RADIUS, [&GLASS; 2]);
    }
    Hertz::pair([mass; 2], [RADIUS; 2], [&GLASS; 2])
}

impl HeadOn {
    fn damped(name: &str, restitution: f64, speed: f64, durations: f64) -> Self {
        let name = format!("{name}-{restitution}-{speed}");
        let dt = hertz(false).duration(SPEEDS[0]) / STEPS;
        Self { name, restitution, speed, wall: false, dt, durations }
    }

    fn system(&self, laws: Laws) -> Setup {
        let mut system = glass(&self.name, self.restitution, 0.0, laws);
        if self.wall {
            system.walls.push(plane(2, 0.0, true));
            add(&mut system, 0, Vec3::new(5e-3, 5e-3, RADIUS), Vec3::z() * -self.speed);
        } else {
            let at = Vec3::new(4e-3, 2e-3, 5e-3);
            add(&mut system, 0, at, Vec3::x() * self.speed);
            add(&mut system, 0, at + Vec3::x() * (2.0 * RADIUS), Vec3::zeros());
        }
        system
    }

    fn depth(&self, frame: &[Particle]) -> f64 {
        if self.wall {
            return RADIUS - frame[0].position[2];
        }
        2.0 * RADIUS - (frame[1].position() - frame[0].position()).norm()
    }

    /// Speed of separation at the end over that of approach.
    fn rebound(&self, track: &Track) -> f64 {
        let last = track.last();
        let away = if self.wall { last[0].velocity[2] } else { last[1].velocity[0] - last[0].velocity[0] };
        away / self.speed
    }

    /// Tracks of the native engine with the law of the other engine, of the other engine, and of the native engine with its own law.
    fn record(&self, against: &Against) -> Result<[Track; 3]> {
        let steps = (hertz(self.wall).duration(self.speed) / self.dt * self.durations).round() as usize;
        let [same, other] = record(&self.system(SAME), against, self.dt, steps)?;
        Ok([same, other, Track::of(native(&self.system(OWN))?, self.dt, steps)?])
    }

    /// The integral of the law of the other engine (0) or of that of the native engine (1).
    fn theory(&self, law: usize) -> Impact {
        let damping = [Damping::Tsuji, Damping::HuntCrossley][law](self.restitution);
        let ratio = |depth| match (law, self.wall) {
            (0, _) => 1.0,
            (_, false) => lens_ratio([RADIUS; 2], depth),
            (_, true) => cap_ratio(RADIUS, depth),
        };
        impact(&hertz(self.wall), damping, ratio, self.speed)
    }

    /// Checks duration (s) and largest depth (m) in one engine against theory.
    fn check_shape(
        &self,
        findings: &mut Findings,
        what: &str,
        (engine, track): (usize, &Track),
        theory: [f64; 2],
        limit: Limit,
    ) {
        let measured = track.impact(|frame| self.depth(frame));
        for (k, (quantity, unit)) in [("duration", "s"), ("largest depth", "m")].into_iter().enumerate() {
            let mut values = [None, None, Some(theory[k])];
            values[engine] = measured.map(|measured| measured[k]);
            let quantity = format!("{quantity}, {what} ({unit})");
            findings.compare_relative(quantity, values, Between::Theory, limit);
        }
    }

    /// Checks the shape in all [tracks](Self::record), each against the integral of its own law.
    fn check_shapes(&self, findings: &mut Findings, what: &str, [native, other, own]: &[Track; 3]) {
        let [tsuji, crossley] = [0, 1].map(|law| self.theory(law)).map(|i| [i.duration, i.deepest]);
        for (name, track, theory) in [
            ("native tsuji", (0, native), tsuji),
            ("OTHER", (1, other), tsuji),
            ("native hunt_crossley", (0, own), crossley),
        ] {
            self.check_shape(findings, &format!("{what}{name}"), track, theory, SHAPE);
        }
    }
}

/// Impacts without damping: restitution, momentum, duration, depth and path.
pub(super) fn elastic(against: &Against, findings: &mut Findings) -> Result<()> {
    for (law, label) in ["hertz", "volume"].into_iter().enumerate() {
        for speed in [1.0, 0.1] {
            let hertz = hertz(false);
            let (name, dt) = (format!("head-on-{label}-{speed}"), hertz.duration(speed) / ELASTIC_STEPS);
            let case = HeadOn { name, restitution: 1.0, speed, wall: false, dt, durations: 1.25 };
            let [same, other, own] = case.record(against)?;
            let tracks = [if law == 0 { same } else { own }, other];
            let what = format!("{label} law, {speed} m/s");
            let values = [case.rebound(&tracks[0]), case.rebound(&tracks[1]), 1.0].map(Some);
            findings.compare(format!("restitution, {what} (-)"), values, Between::Theory, ELASTIC);
            let sum = |track: &Track| track.last().iter().map(|p| p.velocity[0]).sum::<f64>() / speed;
            let values = [sum(&tracks[0]), sum(&tracks[1]), 1.0].map(Some);
            let quantity = format!("momentum over that at the start, {what} (-)");
            findings.compare(quantity, values, Between::Theory, MOMENTUM);

            let own = case.theory(law);
            let theory = [[own.duration, own.deepest], [hertz.duration(speed), hertz.deepest(speed)]];
            for (i, name) in ["native", "OTHER"].into_iter().enumerate() {
                let what = format!("{what}, {name}");
                case.check_shape(findings, &what, (i, &tracks[i]), theory[i], ELASTIC_SHAPE);
            }
            let spheres = tracks[0].frames.iter().flatten().zip(tracks[1].frames.iter().flatten());
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
                thinned(frames.map(|(k, frame)| [track.time(k) * 1e6, case.depth(frame) * 1e6]), 400)
            };
            let analytic = own.history.iter().map(|i| [i.time * 1e6, i.depth * 1e6]);
            findings.plot_both(
                format!("depth_{label}_{speed}"),
                format!("Elastic head-on impact at {speed} m/s, {label} law"),
                ["time (us)", "depth (um)"],
                tracks.each_ref().map(curve),
                Some(("theory", thinned(analytic, 400))),
            );
        }
    }
    Ok(())
}

/// Restitution over speeds, with both laws of the native engine.
pub(super) fn restitutions(against: &Against, findings: &mut Findings) -> Result<()> {
    let mut curves = [const { Points::new() }; 4];
    for e in E {
        let tolerance = if e > 0.5 { 2e-4 } else { 4e-4 };
        for speed in SPEEDS {
            let case = HeadOn::damped("restitution", e, speed, 1.3);
            let [same, other, own] = case.record(against)?.map(|track| Some(case.rebound(&track)));
            let realised = Some(case.theory(1).restitution);
            for (law, values, between, reason) in [
                ("tsuji", [same, other, Some(e)], Between::Theory, SET),
                ("tsuji, engines", [same, other, None], Between::Engines, ENGINES),
                ("hunt_crossley", [own, None, realised], Between::Theory, SET),
                ("hunt_crossley, engines", [own, other, None], Between::Engines, DEFAULT_LAW),
            ] {
                let quantity = format!("restitution, e = {e}, {speed} m/s, {law} (-)");
                findings.compare(quantity, values, between, (tolerance, reason));
            }
            if speed >= SPEEDS[0] {
                for (curve, value) in curves.iter_mut().zip([same, other, own, realised]) {
                    curve.extend(value.map(|value| [e, value - e]));
                }
            }
        }
    }
    let [same, other, own, theory] = curves;
    findings.plot(
        "off",
        format!("Restitution measured minus set, {STEPS} steps per contact, 1 m/s"),
        ["restitution set", "measured minus set"],
        [
            overlaid("native", same),
            measured("OTHER", other),
            overlaid("native", own),
            reference("hunt_crossley, theory", theory),
        ],
    );
    Ok(())
}

/// Duration and largest depth, each engine against the integral of its own law.
pub(super) fn shapes(against: &Against, findings: &mut Findings) -> Result<()> {
    for e in E {
        let case = HeadOn::damped("duration", e, SPEEDS[0], 1.3);
        case.check_shapes(findings, &format!("e = {e}, "), &case.record(against)?);
    }
    Ok(())
}

pub(super) fn wall(against: &Against, findings: &mut Findings) -> Result<()> {
    let (e, speed) = (0.8, 1.0);
    let dt = hertz(true).duration(speed) / STEPS;
    let case = HeadOn { name: "wall-impact".into(), restitution: e, speed, wall: true, dt, durations: 1.3 };
    let tracks = case.record(against)?;
    let [same, other, own] = tracks.each_ref().map(|track| Some(case.rebound(track)));
    let limit = (2e-4, SET);
    let values = [same, other, Some(e)];
    findings.compare(format!("restitution, e = {e}, tsuji (-)"), values, Between::All, limit);
    let values = [own, None, Some(case.theory(1).restitution)];
    findings.compare(format!("restitution, e = {e}, hunt_crossley (-)"), values, Between::Theory, limit);
    case.check_shapes(findings, "", &tracks);
    let curve = |track: &Track| {
        let frames = 0..track.frames.len() - 1;
        thinned(frames.map(|k| [track.time(k) * 1e6, track.force(k, 0).z]), 500)
    };
    let theory = case.theory(0).history.into_iter().map(|i| [i.time * 1e6, i.force]);
    findings.plot_both(
        "force",
        format!("A sphere hits a wall at {speed} m/s, e = {e}"),
        ["time (us)", "force (N)"],
        [curve(&tracks[0]), curve(&tracks[1])],
        Some(("theory", thinned(theory, 500))),
    );
    Ok(())
}

/// The whole history of the force of damped impacts under the law of the other engine in both engines: against each other, and against the
/// law at the depth `d` and velocity `v` (half a step before) that each engine has worked it out with:
///
/// ```text
/// F = K d^(3/2) + sqrt(5) beta sqrt(m* K) d^(1/4) v
/// ```
pub(super) fn histories(against: &Against, findings: &mut Findings) -> Result<()> {
    for e in [0.9, 0.7, 0.5] {
        let case = HeadOn::damped("force-history", e, SPEEDS[0], 1.25);
        let [native, other, _] = case.record(against)?;
        let tracks = [native, other];
        let theory = case.theory(0);
        let peak = worst(theory.history.iter().map(|i| i.force));
        let steps = 1..tracks[0].frames.len() - 1;
        let force = |i: usize, k: usize| tracks[i].force(k, 1).x;
        let apart = worst(steps.clone().map(|k| (force(0, k) - force(1, k)).abs()));
        let peaks = [0, 1].map(|i| worst(steps.clone().map(|k| force(i, k))));
        let quantity = format!("whole history of the force, e = {e}; shown: peak (N)");
        findings.given(quantity, [peaks[0], peaks[1], peak].map(Some), apart / peak, HISTORY);

        let (hertz, dashpot) = (hertz(false), dashpot(&hertz(false), e));
        let depth = |i: usize, k: usize| case.depth(&tracks[i].frames[k]);
        let off = [0, 1].map(|i| {
            let touching = steps.clone().filter(|&k| depth(i, k) > 0.0);
            worst(touching.map(|k| {
                let (d, v) = (depth(i, k), (depth(i, k) - depth(i, k - 1)) / case.dt);
                (force(i, k) - (hertz.force(d) + dashpot * d.sqrt().sqrt() * v)).abs()
            }))
        });
        let quantity = format!("force off the law at its own depth and velocity, e = {e} (-)");
        findings.given(quantity, [off[0] / peak, off[1] / peak, 0.0].map(Some), worst(off) / peak, LAW);
        let end = |track: &Track| Some(track.impact(|frame| case.depth(frame))?[0] / case.dt);
        let values = [end(&tracks[0]), end(&tracks[1]), Some(theory.duration / case.dt)];
        findings.compare(format!("end of the contact, e = {e} (steps)"), values, Between::Engines, END);

        let times: fn(&Instant) -> f64 = |instant| instant.time;
        let depths: fn(&Instant) -> f64 = |instant| instant.depth;
        for (name, axis, of) in [("time", "time (us)", times), ("depth", "depth (um)", depths)] {
            let engine = |i: usize| -> Points {
                let instant = |k| Instant { time: tracks[i].time(k), depth: depth(i, k), force: force(i, k) };
                let touching = (0..steps.end).map(instant).filter(|instant| instant.depth >= 0.0);
                thinned(touching.map(|instant| [of(&instant) * 1e6, instant.force]), 500)
            };
            let analytic = theory.history.iter().map(|instant| [of(instant) * 1e6, instant.force]);
            findings.plot_both(
                format!("{name}_{e}"),
                format!("Damped head-on impact at {} m/s, e = {e}", case.speed),
                [axis, "force (N)"],
                [engine(0), engine(1)],
                Some(("theory", thinned(analytic, 500))),
            );
        }
    }
    Ok(())
}
