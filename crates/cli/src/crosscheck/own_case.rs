//! The spheres of a user's case in both engines, from the same state and under the same loads: where they part.
//!
//! A dry case has its contacts, walls and gravity. Of a case with a fluid the loads are recorded in a four-way run with the
//! native engine, and these loads are replayed through both engines: so the engines are compared, and not what the fluid
//! makes of their differences.

use super::pair::{Comparison, PARTED, Pair, QUANTITIES};
use super::record::{Recording, record};
use super::tools::{Scene, given};
use crate::checks::{Check, Findings, aligned};
use std::fmt::Write as _;
use std::path::Path;
use turbid::case::Setup;
use turbid::contact::{DampingLaw, ElasticLaw};
use turbid::dem::{DemEngine, Load};
use turbid::engine::EngineChoice;
use turbid::error::{Error, Result};
use turbid::output::numbers::small;

/// Id of a user's case in reports.
pub const ID: &str = "own_case";

/// Bytes of memory that recorded loads may take.
const MOST_BYTES: f64 = 4e9;
/// Bytes of one load while it is recorded.
const BYTES: f64 = 112.0;

/// Runs a case for `time` (s), or to its end, in both engines; what LIGGGHTS says goes to the directory, if there is one. The
/// text says where the engines part, and what is known of the reasons.
///
/// # Errors
/// [`Error::Input`] if the case has other bodies than spheres, or is too long to record; what LIGGGHTS says to its set-up;
/// and how a run that records loads fails. An engine that fails on the way is a check that fails.
pub fn run(setup: &Setup, time: Option<f64>, directory: Option<&Path>) -> Result<(Findings, String)> {
    refuse_what_is_no_sphere(setup)?;
    let steps = steps(setup, time)?;
    let recorded = if setup.fluid.is_none() { None } else { Some(record(setup, steps)?) };
    let scene = Scene::of(ID, setup);
    let engines: [Box<dyn DemEngine>; 2] = [Box::new(scene.native()?), Box::new(scene.liggghts(directory)?)];
    let mut pair = Pair::new(setup, engines);
    let rest = vec![Load::default(); setup.particles.len()];
    for step in 0..steps {
        let loads = recorded.as_ref().map_or(&rest[..], |r| r.loads(step));
        if !pair.advance(loads) {
            break;
        }
    }
    let found = &pair.found;
    let mut checks = vec![both_arrive(found, steps)];
    if let Some(recorded) = recorded.as_ref().filter(|_| found.steps[0] == steps) {
        checks.push(repeats("", recorded, &pair));
    }
    checks.extend(QUANTITIES.iter().zip(&found.largest).map(|(quantity, largest)| {
        let reason = "reported only: contacts multiply differences, so no theory gives a limit";
        let quantity = format!("largest difference of {quantity} (-)");
        given(quantity, [None; 3], largest.value, f64::INFINITY, reason)
    }));
    checks.push(begun("", found));
    let findings = Findings { checks, ..Findings::default() };
    Ok((findings, parting(setup, found) + &notes(setup, found)))
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
            return Err(Error::Input(format!("--time {time} is not a time above 0, in seconds")));
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

fn both_arrive(found: &Comparison, steps: u64) -> Check {
    let [native, liggghts] = found.steps.map(|done| done as f64);
    let difference = (steps as f64 - native).max(steps as f64 - liggghts);
    let values = [native, liggghts, steps as f64].map(Some);
    let reason = "both engines must come to the end; the text below says why one does not";
    given("steps done", values, difference, 0.0, reason)
}

/// The native engine repeats the recorded run.
pub(super) fn repeats(what: &str, recorded: &Recording, pair: &Pair) -> Check {
    let both = recorded.last.iter().zip(pair.particles(0));
    let different = both.filter(|(a, b)| a != b).count() as f64;
    let quantity = format!("{what}particles that do not repeat the recorded run (-)");
    let reason = "the native engine under recorded loads repeats the recorded run bit for bit";
    given(quantity, [None; 3], different, 0.0, reason)
}

/// Contacts that began in both engines.
pub(super) fn begun(what: &str, found: &Comparison) -> Check {
    let [native, liggghts] = found.begun.map(|count| count as f64);
    let values = [Some(native), Some(liggghts), None];
    let reason = "reported only: the native engine looks at every sub-step, LIGGGHTS at every step";
    let quantity = format!("{what}contacts that began (-)");
    given(quantity, values, (native - liggghts).abs(), f64::INFINITY, reason)
}

/// Commands of the user, which only LIGGGHTS gets.
fn commands(setup: &Setup) -> &[String] {
    match &setup.engine {
        EngineChoice::Native => &[],
        EngineChoice::Liggghts(options) => &options.commands,
    }
}

/// A table of where the engines part: which quantity, which particle, when, and by how much at most.
fn parting(setup: &Setup, found: &Comparison) -> String {
    let time = |step: u64| format!("{:.6e}", step as f64 * setup.time_step);
    let heads = ["", "parts at (s)", "particle", "in contact", "largest", "particle", "at (s)"];
    let mut rows = vec![heads.map(String::from).to_vec()];
    for ((quantity, parting), largest) in QUANTITIES.iter().zip(&found.parting).zip(&found.largest) {
        let [at, id, touching] = match parting {
            None => ["never", "-", "-"].map(String::from),
            Some(apart) => {
                let touching = if apart.touching { "yes" } else { "no" };
                [time(apart.step), apart.id.to_string(), touching.to_string()]
            }
        };
        let most = [small(largest.value), largest.id.to_string(), time(largest.step)];
        rows.push([vec![(*quantity).to_string(), at, id, touching], most.to_vec()].concat());
    }
    let lines = aligned(&rows).join("\n  ");
    let place = found.parting[0].map_or_else(String::new, |apart| {
        let [x, y, z] = apart.place;
        format!("\n  particle {} then is at ({x:.6e}, {y:.6e}, {z:.6e}) m", apart.id)
    });
    format!("  engines part where they differ by more than {PARTED:.0e}:\n  {lines}{place}\n")
}

/// What is known of the reasons, a line each.
fn notes(setup: &Setup, found: &Comparison) -> String {
    let mut notes = Vec::new();
    for (engine, error) in &found.failures {
        notes.push(format!("{engine} does not come to the end: {error}"));
    }
    let dt = setup.time_step;
    let say = |step: Option<u64>| step.map_or("never".to_string(), |n| format!("{:.6e} s", n as f64 * dt));
    let [native, liggghts] = found.first_contact.map(say);
    notes.push(format!("first contact: native {native}, LIGGGHTS {liggghts}"));
    if setup.fluid.is_some() && found.parting[0].is_some() {
        notes.push(
            "the loads are those of the native run all the time: what has parted is not where the fluid thinks it is".to_string(),
        );
    }
    if let Some(contact) = &setup.contact {
        let mut same = Vec::new();
        if contact.law != ElasticLaw::Hertz {
            same.push("--set contact.law=hertz");
        }
        if contact.damping != DampingLaw::Tsuji && contact.pairs.iter().any(|pair| pair.restitution < 1.0) {
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
                "friction differs by design: LIGGGHTS has a spring along the surfaces and one coefficient, the native engine a law \
                 of the sliding speed; --set contact.friction_static=0 switches both off"
                    .to_string(),
            );
        }
    }
    if !commands(setup).is_empty() {
        notes.push(format!(
            "LIGGGHTS alone gets the commands of the case, so what they change is a difference between the engines: `{}`",
            commands(setup).join("`, `")
        ));
    }
    notes.into_iter().fold(String::new(), |mut text, note| {
        let _ = writeln!(text, "  {note}");
        text
    })
}

#[cfg(test)]
mod tests;
