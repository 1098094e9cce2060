//! The spheres of a user's case in both engines, from the same state and under the same loads.
//!
//! A dry case has its contacts, walls and gravity. Of a case with a fluid the loads are recorded in a four-way run with the
//! native engine, and these loads are replayed through both engines: so the engines are compared, and not what the fluid
//! makes of their differences.

mod compare;
mod plots;
mod record;
mod replay;

use super::{Check, Findings};
use crate::case::Setup;
use crate::comm::Comm;
use crate::contact::{ContactModel, DampingLaw, ElasticLaw, Geometry};
use crate::dem::{DemEngine, EngineChoice, LiggghtsOptions, Load, Native, NativeParams};
use crate::domain::Decomposition;
use crate::engine::liggghts::{Liggghts, LiggghtsParams};
use crate::error::{Error, Result};
use compare::{Comparison, FEW, PARTED, Pair, Span};
use record::record;
pub use replay::replay;
use std::path::Path;

/// Id of a user's case in reports.
pub const ID: &str = "own_case";

/// Bytes of memory that recorded loads may take.
const MOST_BYTES: f64 = 4e9;
/// Bytes of one load while it is recorded.
const BYTES: f64 = 112.0;

/// What a case showed.
#[derive(Clone, Debug)]
pub struct OwnCase {
    /// Checks, plots, trajectories.
    pub findings: Findings,
    /// Where the engines part, and what is known of the reasons, one sentence each.
    pub notes: Vec<String>,
    /// Differences and statistics over time, as a table with a header.
    pub series: Vec<Vec<String>>,
}

/// Runs a case for `time` (s), or to its end, in both engines; what LIGGGHTS says goes to `log`.
///
/// # Errors
/// [`Error::Input`] if the case has other bodies than spheres, or is too long to record; what LIGGGHTS says to its set-up;
/// and how a run that records loads fails. An engine that fails on the way is a check that fails.
pub fn run(setup: &Setup, time: Option<f64>, log: Option<&Path>) -> Result<OwnCase> {
    refuse_what_is_no_sphere(setup)?;
    let steps = steps(setup, time)?;
    let recorded = (setup.fluid.as_ref()).map(|_| record(setup, steps)).transpose()?;
    let mut pair = Pair::new(setup, steps, [native(setup)?, liggghts(setup, log)?]);
    let rest = vec![Load::default(); setup.particles.len()];
    for step in 0..steps {
        let loads = recorded.as_ref().map_or(&rest[..], |r| r.loads(step));
        if !pair.advance(loads) {
            break;
        }
    }
    let found = pair.finish();
    let mut checks = Vec::new();
    if let Some(recorded) = recorded.as_ref().filter(|_| found.steps[0] == steps) {
        checks.push(same_as_recorded(recorded, &pair));
    }
    checks.push(both_arrive(&found, steps));
    checks.extend(free_flight(setup, &found));
    checks.extend(few_impacts(setup, &found));
    checks.extend(at_the_end(&found));
    Ok(OwnCase {
        notes: notes(setup, &found),
        series: plots::series(setup, &found),
        findings: Findings {
            checks,
            overlays: plots::overlays(setup, &found),
            moments: found.moments,
        },
    })
}

fn refuse_what_is_no_sphere(setup: &Setup) -> Result<()> {
    let other = setup.templates.iter().find(|t| t.shape.as_sphere().is_none());
    let Some(other) = other else { return Ok(()) };
    Err(Error::Input(format!(
        "the case has particles that are a {}, but the cross-check is of spheres: LIGGGHTS has no others; \
         --set particles.0.shape.sphere.diameter=... makes spheres of the first kind",
        other.shape.kind()
    )))
}

/// Steps in `time`, or to the end of the case.
fn steps(setup: &Setup, time: Option<f64>) -> Result<u64> {
    let steps = match time {
        None => setup.plan.end_step,
        Some(time) if time > 0.0 && time.is_finite() => (time / setup.time_step).ceil().max(1.0) as u64,
        Some(time) => {
            return Err(Error::Input(format!(
                "--time {time} is not a time above 0, in seconds"
            )));
        }
    };
    let each = BYTES * setup.particles.len() as f64;
    if setup.fluid.is_some() && each * steps as f64 > MOST_BYTES {
        let most = (MOST_BYTES / each).floor();
        return Err(Error::Input(format!(
            "the loads of {} particles over {steps} steps are too many to record; run a shorter time, at most --time {:.4e}",
            setup.particles.len(),
            most * setup.time_step
        )));
    }
    Ok(steps)
}

/// The native engine with the case at rest.
fn native(setup: &Setup) -> Result<Box<dyn DemEngine>> {
    Ok(Box::new(Native::new(
        native_params(setup),
        whole(setup),
        0,
        setup.templates.clone(),
        &setup.particles,
    )?))
}

fn native_params(setup: &Setup) -> NativeParams {
    NativeParams {
        contact: setup.contact.clone(),
        walls: setup.walls.clone(),
        gravity: setup.gravity,
        substeps: setup.substeps,
    }
}

/// LIGGGHTS with the case at rest; with the options of the case, if it is one for LIGGGHTS.
fn liggghts(setup: &Setup, log: Option<&Path>) -> Result<Box<dyn DemEngine>> {
    let params = LiggghtsParams {
        contact: setup.contact.clone(),
        walls: setup.walls.clone(),
        gravity: setup.gravity,
        substeps: setup.substeps,
        options: match &setup.engine {
            EngineChoice::Native => LiggghtsOptions::default(),
            EngineChoice::Liggghts(options) => options.clone(),
        },
        log: log.map(Path::to_path_buf),
        ..LiggghtsParams::default()
    };
    let templates = setup.templates.clone();
    Ok(Box::new(Liggghts::new(
        params,
        whole(setup),
        &Comm::Solo,
        templates,
        &setup.particles,
    )?))
}

/// The box in one piece.
fn whole(setup: &Setup) -> Decomposition {
    Decomposition::with_grid(setup.domain, [1; 3])
}

fn same_as_recorded(recorded: &record::Recording, pair: &Pair) -> Check {
    let replayed = pair.particles(0);
    let difference = (recorded.last.iter().zip(replayed))
        .map(|(a, b)| {
            if a == b {
                0.0
            } else {
                (a.position() - b.position()).norm().max(f64::MIN_POSITIVE)
            }
        })
        .fold(0.0, f64::max);
    Check {
        case: ID,
        quantity: "replayed less recorded native run: position (m)".to_string(),
        native: None,
        liggghts: None,
        analytic: None,
        difference,
        tolerance: 0.0,
        reason: "the native engine under recorded loads repeats the recorded run bit for bit",
        pass: difference <= 0.0,
    }
}

fn both_arrive(found: &Comparison, steps: u64) -> Check {
    let [native, liggghts] = found.steps.map(|done| done as f64);
    let difference = (steps as f64 - native).max(steps as f64 - liggghts);
    Check {
        case: ID,
        quantity: "steps done".to_string(),
        native: Some(native),
        liggghts: Some(liggghts),
        analytic: Some(steps as f64),
        difference,
        tolerance: 0.0,
        reason: "both engines must come to the end; the notes say why one does not",
        pass: difference <= 0.0,
    }
}

/// What rounding alone makes of positions (over D): every sub-step of either engine rounds a position and what a velocity adds
/// to it, by at most 4 units in the last place of the box and of the way in all.
fn rounding(setup: &Setup, found: &Comparison, span: &Span) -> f64 {
    let way = setup.domain.size().amax() + span.path;
    4.0 * substeps(setup, span) * f64::EPSILON * way / found.least_diameter
}

fn substeps(setup: &Setup, span: &Span) -> f64 {
    span.steps as f64 * f64::from(setup.substeps)
}

/// Before anything touches both engines integrate the same constant loads: only rounding can part them.
fn free_flight(setup: &Setup, found: &Comparison) -> Vec<Check> {
    let Some(span) = &found.before_contact else {
        return Vec::new();
    };
    let check = |what: &str, difference: f64, tolerance: f64, reason: &'static str| {
        let (tolerance, reason) = if commands(setup).is_empty() {
            (tolerance, reason)
        } else {
            (
                f64::INFINITY,
                "reported only: LIGGGHTS alone gets the commands of the case",
            )
        };
        Check {
            case: ID,
            quantity: format!("largest {what} in {} steps before a contact (-)", span.steps),
            native: None,
            liggghts: None,
            analytic: Some(0.0),
            difference,
            tolerance,
            reason,
            pass: difference <= tolerance,
        }
    };
    // What rests does not differ, and has no speed to divide by.
    let over = |difference: f64, unit: f64| {
        if difference > 0.0 {
            difference / unit
        } else {
            difference
        }
    };
    let apart = &span.apart;
    let each = 4.0 * substeps(setup, span) * f64::EPSILON;
    // Loads may hold gravity up: then a sub-step adds what takes most of it away again.
    let gained = setup.gravity.norm() * setup.time_step / f64::from(setup.substeps);
    let held = if span.speed > 0.0 {
        gained / span.speed
    } else {
        0.0
    };
    vec![
        check(
            "distance over D",
            apart.position,
            rounding(setup, found, span),
            "rounding alone: every sub-step of either engine rounds a position and what a velocity adds to it, at most 4 units in \
             the last place of the box and of the way in all",
        ),
        check(
            "difference of velocities over the largest",
            over(apart.velocity, span.speed),
            each * (1.0 + held),
            "rounding alone: every sub-step of either engine rounds a velocity and what load and gravity add to it, at most 4 \
             units in the last place of the largest velocity and of what gravity adds, in all",
        ),
        check(
            "difference of spins over the largest",
            over(apart.spin, span.spin),
            each,
            "rounding alone: every sub-step of either engine rounds a spin and what a torque adds to it, at most 4 units in the \
             last place of the largest spin in all",
        ),
    ]
}

/// Under the same laws rounding has a limit as long as impacts are few; none if it is too large to say anything, or nothing
/// touches.
fn few_impacts(setup: &Setup, found: &Comparison) -> Option<Check> {
    let span = found.few_impacts.as_ref().filter(|_| has_the_same_laws(setup))?;
    let free = found.before_contact.map_or(0, |free| free.steps);
    // An impact turns the line of flight by the error over the radius, on either side.
    let growth = (10.0 + 4.0 * span.path / found.least_diameter).powi(FEW as i32);
    let tolerance = rounding(setup, found, span) * growth;
    if span.steps <= free || tolerance > PARTED {
        return None;
    }
    let apart = span.apart.position;
    Some(Check {
        case: ID,
        quantity: format!(
            "largest distance over D in {} steps with {FEW} impacts of a particle at most (-)",
            span.steps
        ),
        native: None,
        liggghts: None,
        analytic: Some(0.0),
        difference: apart,
        tolerance,
        reason: "the same laws (Hertz, no friction; no damping, or that of Tsuji without loads), so rounding alone: as before a \
                 contact, and each of three impacts multiplies it by at most 10 and 4 times the longest way over D",
        pass: apart <= tolerance,
    })
}

/// Whether both engines have the same laws of contact to rounding, and LIGGGHTS no commands of the user.
fn has_the_same_laws(setup: &Setup) -> bool {
    let Some(contact) = &setup.contact else {
        return false;
    };
    let moving = (setup.walls.iter().map(|wall| wall.motion))
        .any(|motion| motion.velocity.norm() > 0.0 || motion.angular_velocity.norm() > 0.0);
    different_laws(contact).is_empty()
        && contact.geometry == Geometry::Exact
        && !moving
        && commands(setup).is_empty()
}

fn is_damped(contact: &ContactModel) -> bool {
    contact.pairs.iter().any(|pair| pair.restitution < 1.0)
}

/// Commands of the user, which only LIGGGHTS gets.
fn commands(setup: &Setup) -> &[String] {
    match &setup.engine {
        EngineChoice::Native => &[],
        EngineChoice::Liggghts(options) => &options.commands,
    }
}

/// What both engines show at the end: no theory says how far they may part once something has touched.
fn at_the_end(found: &Comparison) -> Vec<Check> {
    let Some(last) = found.samples.last() else {
        return Vec::new();
    };
    let reported = |quantity: &str, [native, liggghts]: [f64; 2]| Check {
        case: ID,
        quantity: quantity.to_string(),
        native: Some(native),
        liggghts: Some(liggghts),
        analytic: None,
        difference: (native - liggghts).abs(),
        tolerance: f64::INFINITY,
        reason: "absolute difference at the end, reported only: contacts multiply differences, so no theory gives a limit",
        pass: true,
    };
    let mut checks = vec![
        Check {
            native: None,
            liggghts: None,
            difference: last.apart.position,
            ..reported("largest distance over D at the end (-)", [0.0; 2])
        },
        reported("contacts that began (-)", found.begun.map(|n| n as f64)),
        reported("contacts at the end (-)", last.contacts.map(|n| n as f64)),
        reported("largest overlap over D at the end (-)", last.overlap),
        reported("mean kinetic energy at the end (J)", last.energy),
    ];
    if last.falling.iter().any(|v| *v != 0.0) {
        checks.push(reported(
            "mean velocity along gravity at the end (m/s)",
            last.falling,
        ));
    }
    checks
}

fn notes(setup: &Setup, found: &Comparison) -> Vec<String> {
    let mut notes = Vec::new();
    for (engine, error) in &found.failures {
        notes.push(format!("{engine} does not come to the end: {error}"));
    }
    let dt = setup.time_step;
    notes.push(match found.first_contact {
        [None, None] => "nothing touches in either engine".to_string(),
        times => {
            let say =
                |step: Option<u64>| step.map_or("never".to_string(), |n| format!("{:.6e} s", n as f64 * dt));
            format!(
                "first contact: native {}, LIGGGHTS {}",
                say(times[0]),
                say(times[1])
            )
        }
    });
    notes.push(match &found.parting {
        None => format!("no particle parts by more than {PARTED:.0e} D"),
        Some(parting) => {
            let [x, y, z] = parting.place;
            format!(
                "the first to part by more than {PARTED:.0e} D is particle {} at ({x:.6e}, {y:.6e}, {z:.6e}) m, t = {:.6e} s \
                 (step {}), {}",
                parting.id,
                parting.step as f64 * dt,
                parting.step,
                if parting.touching { "in contact" } else { "in free flight" },
            )
        }
    });
    if setup.fluid.is_some() && found.parting.is_some() {
        notes.push(
            "the loads are those of the native run all the time: what has parted is not where the fluid thinks it is".to_string(),
        );
    }
    notes.extend(setup.contact.as_ref().map_or_else(Vec::new, different_laws));
    if !commands(setup).is_empty() {
        let quoted: Vec<String> = commands(setup).iter().map(|text| format!("`{text}`")).collect();
        notes.push(format!(
            "LIGGGHTS alone gets the commands of the case, so what they change is a difference between the engines: {}",
            quoted.join(", ")
        ));
    }
    notes
}

/// What makes the engines part whatever they do.
fn different_laws(contact: &ContactModel) -> Vec<String> {
    let mut notes = Vec::new();
    let mut same = Vec::new();
    if contact.law != ElasticLaw::Hertz {
        same.push("--set contact.law=hertz");
    }
    if contact.damping != DampingLaw::Tsuji && is_damped(contact) {
        same.push("--set contact.damping=tsuji");
    }
    if !same.is_empty() {
        notes.push(format!(
            "the engines have different laws of contact; the native one takes those of LIGGGHTS with {}",
            same.join(" ")
        ));
    }
    if contact.pairs.iter().any(|pair| pair.friction_static > 0.0) {
        notes.push(
            "friction differs by design: LIGGGHTS has a spring along the surfaces and one coefficient, the native engine a law of \
             the sliding speed; --set contact.friction_static=0 switches both off"
                .to_string(),
        );
    }
    notes
}

#[cfg(test)]
mod tests;
